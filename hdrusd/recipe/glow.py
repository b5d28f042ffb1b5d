"""Where on its faces a material glows: all over, or where its emission map is bright."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from hdrusd.legacy.scene import Image, Material, Mesh
from hdrusd.legacy.texels import texels
from hdrusd.recipe.places import Doubles
from hdrusd.units import LUMINANCE_WEIGHTS
from hdrusd.usd.triangles import Corners, corners

#: A texture in linear values, (h, w, 3), None where it is missing.
Picture = Callable[[Image], Doubles | None]

#: Places along each edge of a triangle at which the map is looked at; triangles of one material
#: on one mesh that are looked at.
_STEPS, _MOST = 8, 20_000

#: What has at least this share of the map's brightest luminance is the lamp.
_BRIGHT = 0.5


def box_of_glow(
    meshes: Sequence[Mesh], index: int, material: Material, picture: Picture
) -> Doubles | None:
    """The box of what glows, (2, 3), in the meshes' space; None where nothing does.

    ``index``: of ``material`` in the scene.
    """
    found = [points for mesh in meshes if len(points := _glowing(mesh, index, material, picture))]
    if not found:
        return None
    points = np.concatenate(found)
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _glowing(mesh: Mesh, index: int, material: Material, picture: Picture) -> Doubles:
    """Points (n, 3) that span what glows."""
    triangles = corners(mesh.face_counts, mesh.face_indices, left_handed=False)
    triangles = triangles.select(mesh.wears(index))
    bright = _bright(mesh, triangles, material, picture)
    if bright is not None:
        return bright
    return np.asarray(mesh.points[np.unique(triangles.vertex)], np.float64)


def _bright(mesh: Mesh, triangles: Corners, material: Material, picture: Picture) -> Doubles | None:
    """Places (n, 3) of the triangles at which the emission map is bright; None without one."""
    use = material.emission_map
    if use is None or use.uv_set not in mesh.uvs or not 0 < len(triangles.face) <= _MOST:
        return None
    pixels, uv = picture(use.image), triangles.take(*mesh.uvs[use.uv_set])
    if pixels is None or uv is None:
        return None
    shares = _shares()
    places = np.einsum("nk,tkc->tnc", shares, uv.reshape(-1, 3, 2)).reshape(-1, 2)
    row, column, inside = texels(use, places, pixels.shape[1], pixels.shape[0])
    luminance = np.where(inside, (pixels @ LUMINANCE_WEIGHTS)[row, column], 0.0)
    most = float(luminance.max())
    if most <= 0.0:
        return np.empty((0, 3))
    points = np.einsum("nk,tkc->tnc", shares, mesh.points[triangles.vertex].astype(np.float64))
    return np.asarray(points.reshape(-1, 3)[luminance >= _BRIGHT * most])


def _shares() -> Doubles:
    """Barycentric coordinates (n, 3) of places spread evenly inside a triangle.

    None is on an edge, where a texture may begin again.
    """
    first, second = np.meshgrid(np.arange(_STEPS), np.arange(_STEPS), indexing="ij")
    kept = first + second < _STEPS
    a, b = (first[kept] + 1.0 / 3.0) / _STEPS, (second[kept] + 1.0 / 3.0) / _STEPS
    return np.stack([a, b, 1.0 - a - b], axis=1)
