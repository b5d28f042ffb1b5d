"""Shapes of OpenSceneGraph's ShapeDrawable as meshes.

All shapes stand about the z axis in their own frame, then turn and move to their
Center. A cone's Center is its centre of mass, a quarter of the height above the
base; a capsule's Height is the length of its cylindrical part.

Sources: OpenSceneGraph 3.6, include/osg/Shape, src/osg/ShapeDrawable.cpp.
"""

from __future__ import annotations

import math

import numpy as np

from hdrusd.importers.osg_text import Document, Doubles, Integers, Statement
from hdrusd.importers.osg_transforms import rotation_matrix
from hdrusd.legacy.scene import Mesh
from hdrusd.report import Kind

_SEGMENTS = 40  # around, as OpenSceneGraph without TessellationHints
_ROWS = 20  # from pole to pole
_SHAPES = ("Box", "Sphere", "Cylinder", "Cone", "Capsule")

#: Points, normals, corner counts, corner indices.
Surface = tuple[Doubles, Doubles, Integers, Integers]
#: Rows of a surface of revolution: radius, height, and the normal in that plane.
Profile = list[tuple[float, float, float, float]]


def read_shape(document: Document, drawable: Statement) -> Mesh | None:
    """The mesh of a ShapeDrawable, with its colour; None, with a finding, for other shapes."""
    name = document.name(drawable)
    shape = _shape(document, drawable)
    if shape is None:
        text = f"no shape that is kept; want {', '.join(_SHAPES)}; left out"
        document.add(Kind.DROPPED, "osg-shape", drawable, name, text)
        return None
    kind = shape.class_name
    keys = {"Box": (), "Sphere": ("radius",)}.get(kind, ("radius", "height"))
    size = tuple(document.number(shape, 1.0, key) for key in keys)
    if kind == "Box":
        size = document.numbers(shape, 3, "halflengths") or (0.5, 0.5, 0.5)
    center = document.numbers(shape, 3, "center") or (0.0, 0.0, 0.0)
    turn = document.numbers(shape, 4, "rotation") or (0.0, 0.0, 0.0, 1.0)
    length = math.hypot(*turn)
    largest = float(np.finfo(np.float32).max) / 8.0
    if not 0.0 < length < math.inf or not all(0.0 < s < largest for s in map(abs, size)):
        document.add(Kind.INVALID, "osg-shape", shape, name, f"{kind} without extent; left out")
        return None
    points, normals, counts, indices = _tessellated(kind, tuple(map(abs, size)))
    x, y, z, w = (part / length for part in turn)
    rotation = rotation_matrix((x, y, z, w))[:3, :3]
    points = points @ rotation + np.array(center)
    if not np.abs(points).max() < largest:
        document.add(Kind.INVALID, "osg-shape", shape, name, f"{kind} out of range; left out")
        return None
    text = f"{kind} as {len(counts)} faces, without texture coordinates"
    document.add(Kind.REPLACED, "osg-shape-faces", drawable, name, text)
    color = np.array([document.numbers(drawable, 4, "color") or (1.0, 1.0, 1.0, 1.0)])
    if not np.abs(color).max() < largest:
        document.add(Kind.INVALID, "osg-shape", drawable, name, "colour out of range; white")
        color = np.ones((1, 4))
    return Mesh(
        name,
        document.ref(drawable),
        points.astype(np.float32),
        counts.astype(np.int32),
        indices.astype(np.int32),
        normals=(normals @ rotation).astype(np.float32),
        normals_interpolation="uniform" if kind == "Box" else "vertex",
        colors=color.astype(np.float32),
        colors_interpolation="constant",
    )


def _shape(document: Document, drawable: Statement) -> Statement | None:
    if document.new:
        found = document.object(drawable, "shape")
        return found if found is not None and found.class_name in _SHAPES else None
    inner = document.objects(drawable.block)
    return next((item for item in inner if item.class_name in _SHAPES), None)


def _tessellated(kind: str, size: tuple[float, ...]) -> Surface:
    """Points, normals, corner counts and corner indices in the shape's own frame."""
    if kind == "Box":
        return _box(size)
    radius, height = size[0], size[-1]
    turns = np.linspace(-math.pi / 2.0, math.pi / 2.0, _ROWS + 1)
    arc = [(math.cos(a), math.sin(a)) for a in turns.tolist()]
    arc[0], arc[-1] = (0.0, -1.0), (0.0, 1.0)  # the poles, without rounding
    half = height / 2.0
    if kind == "Sphere":
        return _revolved([[(radius * c, radius * s, c, s) for c, s in arc]])
    if kind == "Cylinder":
        side: Profile = [(radius, -half, 1.0, 0.0), (radius, half, 1.0, 0.0)]
        return _revolved([_disc(radius, -half, -1.0), side, _disc(radius, half, 1.0)])
    if kind == "Cone":
        base, slope = -0.25 * height, math.hypot(radius, height)
        out, up = height / slope, radius / slope
        side = [(radius, base, out, up), (0.0, base + height, out, up)]
        return _revolved([_disc(radius, base, -1.0), side])
    caps = [(radius * c, radius * s + math.copysign(half, s), c, s) for c, s in arc]
    middle = _ROWS // 2  # the row at the equator of the lower cap, and again of the upper
    caps[middle : middle + 1] = [(radius, -half, 1.0, 0.0), (radius, half, 1.0, 0.0)]
    return _revolved([caps])


def _disc(radius: float, height: float, side: float) -> Profile:
    rim, pole = (radius, height, 0.0, side), (0.0, height, 0.0, side)
    return [pole, rim] if side < 0.0 else [rim, pole]


def _revolved(profiles: list[Profile]) -> Surface:
    """Surfaces of revolution about z; a profile runs upwards with its outside to the right.

    Quads between the rows, triangles at a pole.
    """
    angle = np.arange(_SEGMENTS + 1) * (2.0 * math.pi / _SEGMENTS)
    angle[-1] = 0.0  # the seam closes without rounding
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points, normals, counts, indices = [], [], [], []
    base = 0
    first = np.arange(_SEGMENTS)
    for profile in profiles:
        for radius, height, out, up in profile:
            rise = np.full((_SEGMENTS + 1, 1), 1.0)
            points.append(np.hstack([radius * around, height * rise]))
            normals.append(np.hstack([out * around, up * rise]))
        for row in range(len(profile) - 1):
            low = base + row * (_SEGMENTS + 1) + first
            high = low + _SEGMENTS + 1
            corners = [low, low + 1, high + 1, high]
            if profile[row][0] == 0.0:
                corners = [low, high + 1, high]
            elif profile[row + 1][0] == 0.0:
                corners = [low, low + 1, high]
            counts.append(np.full(_SEGMENTS, len(corners)))
            indices.append(np.stack(corners, axis=1).ravel())
        base += len(profile) * (_SEGMENTS + 1)
    return (
        np.concatenate(points),
        np.concatenate(normals),
        np.concatenate(counts),
        np.concatenate(indices),
    )


def _box(half: tuple[float, ...]) -> Surface:
    corners = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])
    sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    axes = np.eye(3)
    normals = np.stack([sign * axes[axis] for axis in range(3) for sign in (-1.0, 1.0)])
    return corners * np.array(half), normals, np.full(6, 4), np.array(sides).ravel()
