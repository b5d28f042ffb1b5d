"""A UsdGeomMesh as the cage of a subdivision surface: creases, corners, boundaries, limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Usd, UsdGeom

from hdrusd.report import Kind
from hdrusd.usd.arrays import integers, numbers
from hdrusd.usd.subdivision import (
    Cage,
    Refined,
    Scheme,
    boundary_points,
    refine,
    sharpen_boundary_corners,
)
from hdrusd.usd.surface import Note

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

#: Faces of the finest level of one mesh; a mesh that would have more is refined less often.
MOST_FACES = 1 << 21


@dataclass(frozen=True, slots=True, eq=False)
class Polygons:
    """Faces as the prim has them, and which of their corners name a point that is there."""

    counts: Ints
    indices: Ints
    good: Bools  # (corners,)
    size: int  # points


def refined_cage(
    mesh: UsdGeom.Mesh, time: Usd.TimeCode, polygons: Polygons, level: int, note: Note
) -> tuple[Refined, Ints, Ints, Bools] | None:
    """A mesh refined by its own scheme; None where it cannot be, which is noted.

    With it: the prim's face that each refined face lies in; the prim's corners that
    were refined; (faces,) False for faces that only support others.
    """
    scheme: Scheme = str(mesh.GetSubdivisionSchemeAttr().Get())  # type: ignore[assignment]
    if scheme not in ("catmullClark", "loop", "bilinear"):
        note(Kind.INVALID, "subdivision", f"{scheme}: no subdivision scheme; not refined")
        return None
    counts = polygons.counts
    whole = np.ones(counts.size, np.bool_)
    of_corner = np.repeat(np.arange(counts.size), counts)
    whole[of_corner[~polygons.good]] = False
    whole &= counts > 2
    kept = np.flatnonzero(whole[of_corner])
    if not kept.size:
        return None
    size = polygons.size
    creases, sharp = _creases(mesh, time, size, note)
    cage = Cage(
        counts[whole],
        polygons.indices[kept],
        size,
        creases,
        sharp,
        _corners(mesh, time, size, note),
    )
    boundary = str(mesh.GetInterpolateBoundaryAttr().Get(time))
    shown = np.ones(counts.size, np.bool_)
    if boundary == "edgeAndCorner":
        cage = sharpen_boundary_corners(cage)
    elif boundary == "none" and scheme != "bilinear":
        at = boundary_points(cage)[cage.indices]
        shown[of_corner[kept][at]] = False
    level = _affordable(cage, scheme, level, note)
    smooth_triangles = str(mesh.GetTriangleSubdivisionRuleAttr().Get(time)) == "smooth"
    try:
        refined = refine(cage, scheme, level, smooth_triangles=smooth_triangles)
    except ValueError as problem:
        note(Kind.INVALID, "subdivision", f"{problem}; not refined")
        return None
    return refined, np.flatnonzero(whole)[refined.base], kept, shown


def _affordable(cage: Cage, scheme: Scheme, level: int, note: Note) -> int:
    """The level asked for, or the finest that has no more faces than ``MOST_FACES``."""
    faces = 4 * len(cage.counts) if scheme == "loop" else len(cage.indices)
    allowed = 0
    while allowed < level and faces << (2 * allowed) <= MOST_FACES:
        allowed += 1
    if allowed < level:
        text = f"refined {allowed} times, not {level}: want {MOST_FACES} faces at most"
        note(Kind.CLAMPED, "subdivision-limit", text)
    return allowed


def _creases(
    mesh: UsdGeom.Mesh, time: Usd.TimeCode, size: int, note: Note
) -> tuple[Ints, npt.NDArray[np.float64]]:
    """Ends (e, 2) and sharpness (e,) of the edges of all creases."""
    none = np.zeros((0, 2), np.int64), np.zeros(0)
    indices = integers(mesh.GetCreaseIndicesAttr().Get(time))
    lengths = integers(mesh.GetCreaseLengthsAttr().Get(time))
    sharpness = numbers(mesh.GetCreaseSharpnessesAttr().Get(time))
    if not (indices.size or lengths.size):
        return none
    fits = (
        lengths.size > 0
        and bool((lengths >= 2).all())
        and int(lengths.sum()) == indices.size
        and sharpness.size in (lengths.size, int((lengths - 1).sum()))
        and bool(((indices >= 0) & (indices < size)).all())
    )
    if not fits:
        note(Kind.INVALID, "subdivision", "creases do not fit the mesh; left smooth")
        return none
    last = np.cumsum(lengths) - 1
    inside = np.ones(indices.size, np.bool_)
    inside[last] = False
    start = np.flatnonzero(inside)
    if sharpness.size == lengths.size:
        sharpness = np.repeat(sharpness, lengths - 1)
    return np.stack([indices[start], indices[start + 1]], axis=1), sharpness


def _corners(
    mesh: UsdGeom.Mesh, time: Usd.TimeCode, size: int, note: Note
) -> npt.NDArray[np.float64]:
    """(size,) sharpness of the points."""
    result = np.zeros(size)
    indices = integers(mesh.GetCornerIndicesAttr().Get(time))
    sharpness: Any = numbers(mesh.GetCornerSharpnessesAttr().Get(time))
    if not indices.size:
        return result
    if len(sharpness) != indices.size or not ((indices >= 0) & (indices < size)).all():
        note(Kind.INVALID, "subdivision", "sharp corners do not fit the mesh; left smooth")
        return result
    result[indices] = sharpness
    return result
