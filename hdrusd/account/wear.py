"""Where materials are worn: by how many faces, over which area, and places spread over it.

The places are what a statistic of a texture is taken at: an atlas shows little of itself on
one surface, and a tile that repeats shows all of it many times.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.legacy.scene import LegacyScene, Mesh, Texture
from hdrusd.usd.placed_area import PlacedArea
from hdrusd.usd.triangles import Corners, corners

Array = npt.NDArray[Any]

#: Places on all that wears a material: the mean of a texture is known to about 1 %.
PLACES = 16_384

#: Of a sequence that fills a square evenly (Roberts 2018, R2): 1/g and 1/g^2, g^3 = g + 1.
_R2 = np.array([0.7548776662466927, 0.5698402909980532])


@dataclass(frozen=True, slots=True)
class Worn:
    """One material on the scene: ``faces``, ``area`` in m2, and places that each stand for
    the same area: texture coordinates (n, 2) and vertex colours (n, 3), or None without.
    """

    faces: int
    area: float
    uv: Array | None
    color: Array | None


@dataclass(frozen=True, slots=True)
class _Part:
    mesh: Mesh
    faces: npt.NDArray[np.bool_]  # (f,), which of them wear it
    placed: PlacedArea  # where it stands


def wearers(scene: LegacyScene) -> dict[int | None, list[int]]:
    """The meshes that have each material."""
    found: dict[int | None, list[int]] = {}
    for index, mesh in enumerate(scene.meshes):
        for material in {mesh.material, *(subset.material for subset in mesh.subsets)}:
            found.setdefault(material, []).append(index)
    return found


def worn(
    scene: LegacyScene, placed: Mapping[int, PlacedArea], material: int, meshes: Sequence[int]
) -> Worn:
    """How a material is worn. ``placed``: what its places make of each mesh that is shown;
    ``meshes``: those that have the material (``wearers``).
    """
    count, parts = 0, []
    for index in meshes:
        faces = scene.meshes[index].wears(material)
        count += int(faces.sum())
        if index in placed and faces.any():
            parts.append(_Part(scene.meshes[index], faces, placed[index]))
    texture = scene.materials[material].diffuse_map
    pieces = [_Piece.of(part, texture) for part in parts]
    area = float(sum(piece.areas.sum() for piece in pieces))
    if not (0.0 < area < np.inf):
        return Worn(count, 0.0, None, None)
    return Worn(count, area, *_places(pieces, area))


@dataclass(frozen=True, slots=True)
class _Piece:
    """The triangles of one mesh that wear a material, with their values at corners."""

    areas: Array  # (t,), m2
    uv: Array | None  # (t, 3, 2)
    color: Array | None  # (t, 3, 3)

    @classmethod
    def of(cls, part: _Part, texture: Texture | None) -> _Piece:
        mesh = part.mesh
        triangles = corners(mesh.face_counts, mesh.face_indices, left_handed=False)
        triangles = triangles.select(part.faces)
        a, b, c = np.moveaxis(mesh.points[triangles.vertex].astype(np.float64), 1, 0)
        areas = part.placed.of(0.5 * np.cross(b - a, c - a))
        uv = None
        if texture is not None and texture.uv_set in mesh.uvs:
            uv = _at_corners(triangles, *mesh.uvs[texture.uv_set])
        color = None
        if mesh.colors is not None:
            color = _at_corners(triangles, mesh.colors[:, :3], mesh.colors_interpolation)
        return cls(areas, uv, color)


def _at_corners(triangles: Corners, values: Array, interpolation: str) -> Array | None:
    found = triangles.take(values, interpolation)
    return None if found is None else found.reshape(len(triangles.face), 3, -1)


def _places(pieces: list[_Piece], area: float) -> tuple[Array | None, Array | None]:
    """Values at places that lie as densely everywhere."""
    if all(piece.uv is None and piece.color is None for piece in pieces):
        return None, None
    areas = np.concatenate([piece.areas for piece in pieces])
    reached = np.cumsum(areas)
    ladder = (np.arange(PLACES) + 0.5) * (reached[-1] / PLACES)
    triangle = np.minimum(np.searchsorted(reached, ladder), len(areas) - 1)
    r, s = np.moveaxis((0.5 + np.arange(PLACES)[:, None] * _R2) % 1.0, 1, 0)
    root = np.sqrt(r)
    shares = np.stack([1.0 - root, root * (1.0 - s), root * s], axis=1)
    sizes = [len(piece.areas) for piece in pieces]
    return (
        _spread([piece.uv for piece in pieces], sizes, triangle, shares, 0.0),
        _spread([piece.color for piece in pieces], sizes, triangle, shares, 1.0),
    )


def _spread(
    values: list[Array | None], sizes: list[int], triangle: Array, shares: Array, missing: float
) -> Array | None:
    width = next((v.shape[2] for v in values if v is not None), None)
    if width is None:
        return None
    whole = [
        np.full((size, 3, width), missing, np.float32) if v is None else v
        for v, size in zip(values, sizes, strict=True)
    ]
    return np.asarray(np.einsum("nk,nkc->nc", shares, np.concatenate(whole)[triangle]))
