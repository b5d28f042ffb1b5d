"""The transform elements of a COLLADA node, one by one and over time.

COLLADA 1.4.1, chapter 5: lookat, matrix, rotate, scale, skew, translate; the first stands
outermost. Matrices here are for row vectors, as everywhere in hdrusd, so products run the other
way round. All functions take values for k moments and give (k, 4, 4).
"""

from __future__ import annotations

import numpy as np

from hdrusd.importers.collada_document import Document, Doubles
from hdrusd.importers.collada_xml import Element
from hdrusd.report import Kind

#: Transform elements to how many numbers they hold.
WIDTHS = {"lookat": 9, "matrix": 16, "rotate": 4, "scale": 3, "skew": 7, "translate": 3}

#: A decomposition that is off by more than this share has shear.
_SHEAR = 1e-4


def read_transforms(document: Document, node: Element) -> list[tuple[Element, Doubles]]:
    """The transform elements of a node with their numbers; broken ones are findings."""
    found = []
    for child in node.children:
        if child.tag in WIDTHS:
            values = document.vector(child, WIDTHS[child.tag])
            if values is not None:
                found.append((child, values))
    return found


def matrices(tag: str, values: Doubles) -> Doubles:
    """(k, 4, 4) of one transform element; values: (k, width) as the file has them.

    What has no direction (an axis of length 0, a view along its own up) is the identity.
    """
    count = len(values)
    made = np.tile(np.eye(4), (count, 1, 1))
    if tag == "translate":
        made[:, 3, :3] = values
    elif tag == "scale":
        for axis in range(3):
            made[:, axis, axis] = values[:, axis]
    elif tag == "matrix":
        made = values.reshape(count, 4, 4).transpose(0, 2, 1).copy()
        made[:, :, 3] = (0.0, 0.0, 0.0, 1.0)
    elif tag == "rotate":
        made[:, :3, :3] = _rotation(values[:, :3], np.radians(values[:, 3]))
    elif tag == "lookat":
        made = _lookat(values)
    elif tag == "skew":
        made[:, :3, :3] = _skew(values)
    return made


def product(parts: list[Doubles], count: int) -> Doubles:
    """The transform of elements in the file's order, each (k, 4, 4) or (1, 4, 4)."""
    total = np.tile(np.eye(4), (count, 1, 1))
    for part in reversed(parts):
        total = total @ part
    return total


def static_matrix(document: Document, node: Element, name: str) -> Doubles | None:
    """(4, 4) of a node at rest; None for the identity."""
    found = read_transforms(document, node)
    for element, values in found:
        if element.tag == "matrix" and values[12:].tolist() != [0.0, 0.0, 0.0, 1.0]:
            text = f"matrix whose fourth row is {values[12:].tolist()}; want 0, 0, 0, 1; that is"
            document.note(Kind.INVALID, "node-matrix", element, name, f"{text} used")
    with np.errstate(over="ignore", invalid="ignore"):
        total = product([matrices(e.tag, v[None]) for e, v in found], 1)[0]
        finite = bool((np.abs(total) <= np.finfo(np.float32).max).all())
        volume = float(np.linalg.det(total[:3, :3])) if finite else 1.0
    if not finite:
        text = "transforms whose product is beyond 32-bit floats; none is used"
        document.note(Kind.INVALID, "node-matrix", node, name, text)
        return None
    if volume == 0.0:
        text = "transform of volume 0 flattens what is below"
        document.note(Kind.ASSUMED, "node-singular", node, name, text)
    return None if (total == np.eye(4)).all() else total


def decompose(total: Doubles) -> tuple[Doubles, Doubles, Doubles, float]:
    """Translations (k, 3), quaternions (k, 4) x y z w, scales (k, 3), and the largest error.

    The error is relative: beyond 1e-4 there was shear, which such a transform cannot hold.
    Quaternions of neighbours lie on the same half of the sphere.
    """
    linear = total[:, :3, :3]
    scales = np.sqrt((linear * linear).sum(axis=2))
    safe = np.where(scales > 0.0, scales, 1.0)
    mirrored = np.linalg.det(linear / safe[:, :, None]) < 0.0
    scales[mirrored, 0] *= -1.0
    safe[mirrored, 0] *= -1.0
    axes = linear / safe[:, :, None]
    flat = (scales == 0.0).any(axis=1)
    axes[flat] = np.eye(3)
    quaternions = _quaternions(axes)
    turned = _from_quaternions(quaternions) * scales[:, :, None]
    size = np.maximum(np.abs(linear).max(axis=(1, 2)), np.finfo(np.float64).tiny)
    errors = np.abs(turned - linear).max(axis=(1, 2)) / size
    error = float(errors.max(initial=0.0))
    signs = np.sign((quaternions[1:] * quaternions[:-1]).sum(axis=1))
    signs = np.cumprod(np.where(signs == 0.0, 1.0, signs))
    quaternions[1:] *= signs[:, None]
    return total[:, 3, :3].copy(), quaternions, scales, error


def has_shear(error: float) -> bool:
    """Whether an error of ``decompose`` is more than rounding."""
    return error > _SHEAR


def _unit(vectors: Doubles) -> Doubles:
    """Vectors of length 1; 0 where there is no direction."""
    largest = np.abs(vectors).max(axis=1, keepdims=True)
    vectors = vectors / np.where(largest > 0.0, largest, 1.0)
    lengths = np.sqrt((vectors * vectors).sum(axis=1, keepdims=True))
    unit: Doubles = vectors / np.where(lengths > 0.0, lengths, 1.0)
    return unit


def _rotation(axes: Doubles, angles: Doubles) -> Doubles:
    """(k, 3, 3) for row vectors: Rodrigues' formula, transposed."""
    x, y, z = _unit(axes).T
    zero = np.zeros_like(x)
    # v -> a x v for columns, transposed
    across = np.array([[zero, z, -y], [-z, zero, x], [y, -x, zero]]).transpose(2, 0, 1)
    sine, rest = np.sin(angles)[:, None, None], (1.0 - np.cos(angles))[:, None, None]
    turned: Doubles = np.eye(3) + sine * across + rest * (across @ across)
    return turned


def _lookat(values: Doubles) -> Doubles:
    """From the eye (3), the point looked at (3) and up (3): the camera's own place."""
    eye, aim, up = values[:, :3], values[:, 3:6], values[:, 6:9]
    back = _unit(eye - aim)
    right = _unit(np.cross(_unit(up), back))
    made = np.tile(np.eye(4), (len(values), 1, 1))
    good = right.any(axis=1)
    made[good, 0, :3] = right[good]
    made[good, 1, :3] = np.cross(back, right)[good]
    made[good, 2, :3] = back[good]
    made[:, 3, :3] = eye
    return made


def _skew(values: Doubles) -> Doubles:
    """Angle, axis of rotation and axis of translation, as RenderMan's RiSkew.

    p' = p + tan(angle) (p . u) t, u being the part of the rotation axis square to t.
    """
    angle = np.radians(np.clip(values[:, 0], -89.9, 89.9))
    along = _unit(values[:, 4:7])
    first = _unit(values[:, 1:4])
    square = _unit(first - (first * along).sum(axis=1, keepdims=True) * along)
    made: Doubles = np.eye(3) + np.tan(angle)[:, None, None] * (
        square[:, :, None] * along[:, None, :]
    )
    return made


def _quaternions(axes: Doubles) -> Doubles:
    """(k, 4) x y z w of rotations for row vectors, by the largest component (Shepperd 1978)."""
    m = axes.transpose(0, 2, 1)  # for columns, as the formulas are printed
    trace = np.trace(m, axis1=1, axis2=2)
    squares = np.stack([*(1.0 + 2.0 * m[:, i, i] - trace for i in range(3)), 1.0 + trace], axis=1)
    pick = np.argmax(squares, axis=1)
    xy, xz, yz = m[:, 0, 1] + m[:, 1, 0], m[:, 0, 2] + m[:, 2, 0], m[:, 1, 2] + m[:, 2, 1]
    wx, wy, wz = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    rows = np.array(
        [
            [squares[:, 0], xy, xz, wx],
            [xy, squares[:, 1], yz, wy],
            [xz, yz, squares[:, 2], wz],
            [wx, wy, wz, squares[:, 3]],
        ]
    )
    found = rows[pick, :, np.arange(len(m))]
    return _unit(found)


def _from_quaternions(q: Doubles) -> Doubles:
    """(k, 3, 3) for row vectors."""
    x, y, z, w = q.T
    rows = np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)],
            [2.0 * (x * y - z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + x * w)],
            [2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )
    return rows.transpose(2, 0, 1)
