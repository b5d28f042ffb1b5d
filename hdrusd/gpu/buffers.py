"""RenderScene arrays in the layouts that the shaders read."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.scene import Camera, Draw, Geometry

Floats = npt.NDArray[np.float32]


def corner_buffer(
    geometry: Geometry, uv_sets: list[str], color: str
) -> tuple[Floats, list[tuple[str, str]]]:
    """Corner attributes side by side, (3 t, .) float32, and (format, attribute) of each part.

    ``uv_sets``: up to four, two to an attribute; one that the geometry has not is 0.
    ``color``: a primvar of it, or "".
    """
    count = len(geometry.points)
    columns: list[Floats] = [geometry.points, geometry.normals]
    content = [("3f", "in_position"), ("3f", "in_normal")]
    blank = np.zeros((count, 2), np.float32)
    uvs = [geometry.uvs.get(name, blank) for name in uv_sets[:4]]
    for first, name in ((0, "in_uv01"), (2, "in_uv23")):
        pair = uvs[first : first + 2]
        if pair:
            columns += [*pair, blank][:2]
            content.append(("4f", name))
    if color:
        columns.append(geometry.colors[color])
        content.append(("3f", "in_color"))
    return np.ascontiguousarray(np.concatenate(columns, axis=1), np.float32), content


def weld(corners: Floats) -> tuple[Floats, npt.NDArray[np.uint32]]:
    """Equal rows once: (vertices (n, .), indices (3 t,)), so that each is transformed once.

    Rows are told apart by a 64-bit hash, and checked: on a collision nothing is welded.
    """
    words = corners.view(np.uint32).astype(np.uint64)
    factors = np.random.default_rng(1).integers(1, 2**63, words.shape[1], np.uint64) * 2 + 1
    mixed = words * factors
    keys = np.bitwise_xor.reduce(mixed ^ (mixed >> np.uint64(29)), axis=1) * factors[0]
    keys ^= (mixed >> np.uint64(3)).sum(axis=1, dtype=np.uint64)
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    vertices = corners[first]
    if not np.array_equal(vertices.view(np.uint32)[inverse], corners.view(np.uint32)):
        return corners, np.arange(len(corners), dtype=np.uint32)
    # In order of first use: neighbours in the mesh stay neighbours in memory.
    order = np.argsort(first)
    rank = np.empty(len(order), np.uint32)
    rank[order] = np.arange(len(order), dtype=np.uint32)
    return np.ascontiguousarray(vertices[order]), rank[inverse]


def instance_rows(draw: Draw, camera: Camera) -> Floats:
    """(k, 12) float32: the columns of each transform, relative to the eye.

    The eye is subtracted in float64, so that a stage far from its origin keeps its
    millimetres.
    """
    m = draw.transforms[:, :, :3].copy()
    m[:, 3] -= camera.eye
    return np.ascontiguousarray(m.transpose(0, 2, 1).reshape(-1, 12), np.float32)


def mirrored(draw: Draw) -> npt.NDArray[np.bool_]:
    """(k,) True where a transform turns right hands into left ones."""
    # Written out: a general determinant takes longer than the whole draw.
    (a, b, c), (d, e, f), (g, h, i) = draw.transforms[:, :3, :3].transpose(1, 2, 0)
    return np.asarray(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0.0)
