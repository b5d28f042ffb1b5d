"""Subdivision surfaces: Catmull-Clark, Loop and bilinear, refined uniformly.

Rules: E. Catmull and J. Clark, Recursively generated B-spline surfaces on arbitrary
topological meshes (1978); C. Loop, Smooth subdivision surfaces based on triangles (1987);
semi-sharp creases: T. DeRose, M. Kass, T. Truong, Subdivision surfaces in character
animation (SIGGRAPH 1998), with the sharpness of a child one less than its parent's and ten
or more infinite. Boundaries, face-varying values and the smooth triangle rule are those
of UsdGeomMesh. Points are those of the refined cage, not pushed to the limit.

The topology is refined once; ``Refined`` then turns the values of any moment.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Doubles = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]
Scheme = Literal["catmullClark", "loop", "bilinear"]

#: From here on an edge or corner stays sharp at every level.
INFINITE = 10.0

#: Weight of a triangle's centre for a point on its edge (triangleSubdivisionRule "smooth").
_SMOOTH_TRIANGLE = 0.47

#: Rows that are summed at a time, so that what is summed does not fill the memory.
_CHUNK = 1 << 18


@dataclass(frozen=True, slots=True, eq=False)
class Cage:
    """Faces with three corners and more, and how sharp their edges and points are."""

    counts: Ints  # (f,) corners of each face
    indices: Ints  # (sum of counts,) points of each face in turn
    size: int  # points, all indices are less
    creases: Ints  # (e, 2) the ends of edges
    crease_sharpness: Doubles  # (e,)
    sharpness: Doubles  # (size,) of the points


@dataclass(frozen=True, slots=True, eq=False)
class Stencil:
    """Weighted sums of rows: row r takes ``index[start[r]:start[r + 1]]``, one or more each."""

    start: Ints
    index: Ints
    weight: Floats

    def apply(self, values: Floats) -> Floats:
        """(rows, .) from (n, .)."""
        rows = len(self.start) - 1
        out = np.empty((rows, values.shape[1]), np.float32)
        for first in range(0, rows, _CHUNK):
            last = min(first + _CHUNK, rows)
            begin, end = self.start[first], self.start[last]
            terms = values[self.index[begin:end]] * self.weight[begin:end, None]
            out[first:last] = np.add.reduceat(terms, self.start[first:last] - begin, axis=0)
        return out


@dataclass(frozen=True, slots=True, eq=False)
class Level:
    """One step: centres of the faces, then points by their neighbours and those centres."""

    faces: Stencil | None  # (f,) of the points; None for Loop, which makes no centres
    points: Stencil  # of the points and, after them, the centres
    linear: Stencil  # the same without smoothing

    def apply(self, values: Floats, *, smooth: bool) -> Floats:
        """Values of the points of the finer level."""
        if self.faces is None:
            return (self.points if smooth else self.linear).apply(values)
        centres = self.faces.apply(values)
        both = np.concatenate([values, centres])
        moved = (self.points if smooth else self.linear).apply(both)
        return np.concatenate([moved, centres])


@dataclass(frozen=True, eq=False)
class Refined:
    """The finest level, and how values come there."""

    cage: Cage
    levels: tuple[Level, ...]
    counts: Ints
    indices: Ints
    base: Ints  # (faces,) the face of the cage that each lies in
    scheme: Scheme
    smooth_triangles: bool

    def vertex(self, values: npt.NDArray[np.generic]) -> Floats:
        """(points, .) of values at the cage's points, by the scheme's own weights."""
        return self._apply(values, smooth=True)

    def varying(self, values: npt.NDArray[np.generic]) -> Floats:
        """(points, .) of values at the cage's points, linearly over each face."""
        return self._apply(values, smooth=False)

    def face_varying(self, values: npt.NDArray[np.generic], rule: str) -> Floats:
        """(corners, .) of values at the cage's corners.

        Corners at one point with equal values are one value, whatever their indices; the
        others are seams. ``rule``: faceVaryingLinearInterpolation of UsdGeomMesh.
        """
        values = np.ascontiguousarray(values, np.float32)
        rows = np.column_stack([self.cage.indices.astype(np.float64), values])
        _, first, of = np.unique(rows, axis=0, return_index=True, return_inverse=True)
        of = of.reshape(-1).astype(np.int64)
        flat = _face_varying_cage(self.cage, of, self._edge_sharpness, rule)
        scheme: Scheme = "bilinear" if rule == "all" and self.scheme != "loop" else self.scheme
        finest = refine(flat, scheme, len(self.levels), smooth_triangles=self.smooth_triangles)
        moved = finest.varying(values[first]) if rule == "all" else finest.vertex(values[first])
        return moved[finest.indices]

    @cached_property
    def _edge_sharpness(self) -> Doubles:
        """(corners,) of the cage's edge from each corner to the next; boundaries are 0 here."""
        edges = _Edges(self.cage)
        return edges.crease[edges.of_corner]

    def _apply(self, values: npt.NDArray[np.generic], *, smooth: bool) -> Floats:
        result = np.ascontiguousarray(values, np.float32)
        for level in self.levels:
            result = level.apply(result, smooth=smooth)
        return result


def refine(cage: Cage, scheme: Scheme, levels: int, *, smooth_triangles: bool = False) -> Refined:
    """Refine ``levels`` times. ValueError for Loop on faces that are not triangles."""
    if scheme == "loop" and (cage.counts != 3).any():
        raise ValueError("Loop subdivision of faces that are no triangles")
    steps: list[Level] = []
    fine, base = cage, np.arange(len(cage.counts))
    for _ in range(levels):
        level, fine, parent = (_refine_loop if scheme == "loop" else _refine_quads)(
            fine, scheme, smooth_triangles
        )
        steps.append(level)
        base = base[parent]
    return Refined(cage, tuple(steps), fine.counts, fine.indices, base, scheme, smooth_triangles)


def boundary_points(cage: Cage) -> npt.NDArray[np.bool_]:
    """(size,) True for the points of an edge with one face alone."""
    edges = _Edges(cage)
    found = np.zeros(cage.size, np.bool_)
    found[edges.ends[edges.faces == 1].ravel()] = True
    return found


def sharpen_boundary_corners(cage: Cage) -> Cage:
    """The cage with infinitely sharp points where a boundary has one face only."""
    alone = np.bincount(cage.indices, minlength=cage.size) == 1
    return replace(cage, sharpness=np.where(alone, INFINITE, cage.sharpness))


class _Edges:
    """The edges of a cage and what is sharp about them."""

    def __init__(self, cage: Cage) -> None:
        n = np.int64(max(cage.size, 1))
        start = np.cumsum(cage.counts) - cage.counts
        after = np.arange(1, len(cage.indices) + 1)
        after[start + cage.counts - 1] = start
        self.after = after  # (c,) the next corner of the face
        self.face = np.repeat(np.arange(len(cage.counts)), cage.counts)  # (c,)
        a, b = cage.indices, cage.indices[after]
        keys, of, count = np.unique(
            np.minimum(a, b) * n + np.maximum(a, b), return_inverse=True, return_counts=True
        )
        self.of_corner: Ints = of.reshape(-1)  # (c,) the edge to the next corner
        self.faces: Ints = count  # (e,) how many faces share it
        self.ends: Ints = np.stack([keys // n, keys % n], axis=1)  # (e, 2)
        self.crease = np.zeros(len(keys))
        if len(cage.creases) and len(keys):
            wanted = cage.creases.min(axis=1) * n + cage.creases.max(axis=1)
            at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
            known = keys[at] == wanted
            np.maximum.at(self.crease, at[known], cage.crease_sharpness[known])
        # What does not part two faces cannot be smooth.
        self.sharpness: Doubles = np.where(count == 2, self.crease, INFINITE)

    def creases(self, first_edge_point: int) -> tuple[Ints, Doubles]:
        """Ends and sharpness of the halves of the creases in the finer level."""
        some = np.flatnonzero(_child(self.crease) > 0.0)
        middle = first_edge_point + some
        ends = self.ends[some]
        pairs = np.concatenate(
            [np.stack([ends[:, 0], middle], 1), np.stack([ends[:, 1], middle], 1)]
        )
        return pairs, np.tile(_child(self.crease[some]), 2)


def _child(sharpness: Doubles) -> Doubles:
    return np.where(sharpness >= INFINITE, sharpness, np.maximum(sharpness - 1.0, 0.0))


def _refine_quads(cage: Cage, scheme: Scheme, smooth_triangles: bool) -> tuple[Level, Cage, Ints]:
    """Catmull-Clark or bilinear: a quad for each corner."""
    edges = _Edges(cage)
    points, count, faces = cage.size, len(edges.ends), len(cage.counts)
    corners = len(cage.indices)
    centre = points + edges.face  # (c,) where a corner's face has its centre in the table
    start = np.concatenate([[0], np.cumsum(cage.counts)])
    of_faces = Stencil(start, cage.indices, np.repeat(1.0 / cage.counts, cage.counts).astype("f4"))
    terms = _Terms(points + count)
    linear = _Terms(points + count)
    linear.add(np.arange(points), np.arange(points), 1.0)
    edge_rows = points + np.arange(count)
    for end in range(2):
        linear.add(edge_rows, edges.ends[:, end], 0.5)
    straight = linear.stencil()
    if scheme == "bilinear":
        smooth = straight
    else:
        # Edges: a quarter each of the ends and the two centres; half each of the ends if sharp.
        sharp = np.clip(edges.sharpness, 0.0, 1.0)
        side = np.full(corners, 0.25)
        if smooth_triangles:
            side[cage.counts[edges.face] == 3] = _SMOOTH_TRIANGLE
        side = np.bincount(edges.of_corner, side, minlength=count) / np.maximum(edges.faces, 1)
        for end in range(2):
            terms.add(edge_rows, edges.ends[:, end], 0.5 - side * (1.0 - sharp))
        inner = edges.faces[edges.of_corner] == 2
        weight = (side * (1.0 - sharp))[edges.of_corner]
        terms.add(points + edges.of_corner[inner], centre[inner], weight[inner])
        share = _vertex_rules(cage, edges, terms)
        # Smooth points: (n - 2) / n, and 1 / n^2 of each neighbour and centre.
        valence = np.maximum(np.bincount(edges.ends.ravel(), minlength=points), 1).astype(float)
        terms.add(np.arange(points), np.arange(points), share * (valence - 2.0) / valence)
        ring = share / valence**2
        for end in range(2):
            at = edges.ends[:, end]
            terms.add(at, edges.ends[:, 1 - end], ring[at])
        terms.add(cage.indices, centre, ring[cage.indices])
        smooth = terms.stencil()
    before = np.empty(corners, np.int64)
    before[edges.after] = np.arange(corners)
    quads = np.stack(
        [
            cage.indices,
            points + edges.of_corner,
            points + count + edges.face,
            points + edges.of_corner[before],
        ],
        axis=1,
    )
    pairs, sharpness = edges.creases(points)
    fine = Cage(
        np.full(corners, 4),
        quads.ravel(),
        points + count + faces,
        pairs,
        sharpness,
        np.concatenate([_child(cage.sharpness), np.zeros(count + faces)]),
    )
    return Level(of_faces, smooth, straight), fine, edges.face


def _refine_loop(cage: Cage, scheme: Scheme, smooth_triangles: bool) -> tuple[Level, Cage, Ints]:
    """Loop: four triangles for each."""
    edges = _Edges(cage)
    points, count = cage.size, len(edges.ends)
    edge_rows = points + np.arange(count)
    linear, terms = _Terms(points + count), _Terms(points + count)
    linear.add(np.arange(points), np.arange(points), 1.0)
    sharp = np.clip(edges.sharpness, 0.0, 1.0)
    for end in range(2):
        linear.add(edge_rows, edges.ends[:, end], 0.5)
        terms.add(edge_rows, edges.ends[:, end], 0.375 + 0.125 * sharp)
    opposite = cage.indices[edges.after[edges.after]]
    inner = edges.faces[edges.of_corner] == 2
    weight = (0.125 * (1.0 - sharp))[edges.of_corner]
    terms.add(points + edges.of_corner[inner], opposite[inner], weight[inner])
    share = _vertex_rules(cage, edges, terms)
    valence = np.maximum(np.bincount(edges.ends.ravel(), minlength=points), 1).astype(float)
    beta = (0.625 - (0.375 + 0.25 * np.cos(2.0 * np.pi / valence)) ** 2) / valence
    terms.add(np.arange(points), np.arange(points), share * (1.0 - valence * beta))
    for end in range(2):
        at = edges.ends[:, end]
        terms.add(at, edges.ends[:, 1 - end], (share * beta)[at])
    v0, v1, v2 = cage.indices.reshape(-1, 3).T
    e0, e1, e2 = points + edges.of_corner.reshape(-1, 3).T
    children = np.stack([v0, e0, e2, e0, v1, e1, e2, e1, v2, e0, e1, e2], axis=1)
    pairs, sharpness = edges.creases(points)
    fine = Cage(
        np.full(4 * len(cage.counts), 3),
        children.ravel(),
        points + count,
        pairs,
        sharpness,
        np.concatenate([_child(cage.sharpness), np.zeros(count)]),
    )
    parent = np.repeat(np.arange(len(cage.counts)), 4)
    return Level(None, terms.stencil(), linear.stencil()), fine, parent


def _vertex_rules(cage: Cage, edges: _Edges, terms: _Terms) -> Doubles:
    """Add the corner and crease parts of every point; returns (size,) what is left to smooth.

    Where the sharpness ends within this step, the rule before and the rule after are mixed
    by how much of it is left (DeRose et al. 1998, appendix B).
    """
    points = cage.size
    parent, child = edges.sharpness, _child(edges.sharpness)
    corner = np.where(_not_manifold(cage, edges), INFINITE, cage.sharpness)
    ending = (parent > 0.0) & (child <= 0.0)
    ends_here = (corner > 0.0) & (_child(corner) <= 0.0)
    number = _per_point(edges, ending.astype(float), points) + ends_here
    total = _per_point(edges, np.where(ending, parent, 0.0), points)
    total += np.where(ends_here, corner, 0.0)
    mix = np.minimum(total / np.maximum(number, 1.0), 1.0)
    share = np.zeros(points)
    for edge, point, part in ((parent, corner, mix), (child, _child(corner), 1.0 - mix)):
        sharp = edge > 0.0
        met = _per_point(edges, sharp.astype(float), points)
        kept = (point > 0.0) | (met >= 3)
        crease = ~kept & (met == 2)
        share += np.where(kept | crease, 0.0, part)
        terms.add(np.arange(points), np.arange(points), part * (kept + 0.75 * crease))
        for end in range(2):
            at = edges.ends[sharp, end]
            terms.add(at, edges.ends[sharp, 1 - end], (part * 0.125 * crease)[at])
    return share


def _not_manifold(cage: Cage, edges: _Edges) -> npt.NDArray[np.bool_]:
    """(size,) True where the faces of a point form no single fan or ring, or there are none."""
    faces = np.bincount(cage.indices, minlength=cage.size)
    valence = np.bincount(edges.ends.ravel(), minlength=cage.size)
    rims = _per_point(edges, (edges.faces == 1).astype(float), cage.size)
    thick = _per_point(edges, (edges.faces > 2).astype(float), cage.size) > 0
    ring = (rims == 0) & (valence == faces)
    fan = (rims == 2) & (valence == faces + 1)
    return np.asarray(thick | ~(ring | fan) | (faces == 0))


def _per_point(edges: _Edges, values: Doubles, points: int) -> Doubles:
    """Sum over the edges that meet at each point."""
    sums = np.bincount(edges.ends.ravel(), np.repeat(values, 2), minlength=points)
    return sums.astype(np.float64)


def _face_varying_cage(cage: Cage, of: Ints, sharp: Doubles, rule: str) -> Cage:
    """The faces over their own values: ``of`` (c,) names the value at each corner."""
    size = int(of.max(initial=-1)) + 1
    flat = Cage(cage.counts, of, size, np.zeros((0, 2), np.int64), np.zeros(0), np.zeros(size))
    edges = _Edges(flat)
    creased = sharp > 0.0
    pairs = np.stack([of, of[edges.after]], axis=1)[creased]
    point = np.zeros(size, np.int64)  # of the cage, that a value belongs to
    point[of] = cage.indices
    rim = _per_point(edges, (edges.faces == 1).astype(float), size) > 0
    alone = np.bincount(of, minlength=size) == 1
    values = np.bincount(point, minlength=cage.size)[point]  # that meet at the value's point
    kept = cage.sharpness[point] >= INFINITE
    if rule == "boundaries":
        kept |= rim
    elif rule in ("cornersOnly", "cornersPlus1", "cornersPlus2"):
        kept |= alone
    if rule in ("cornersPlus1", "cornersPlus2"):
        kept |= values >= 3
    if rule == "cornersPlus2":
        dart = rim & (values == 1) & ~boundary_points(cage)[point]
        beside = np.zeros(cage.size, np.bool_)
        beside[point[alone]] = True
        kept |= dart | (beside[point] & (values == 2))
    sharpness = np.where(kept, INFINITE, cage.sharpness[point])
    return replace(flat, creases=pairs, crease_sharpness=sharp[creased], sharpness=sharpness)


class _Terms:
    """Row, column, weight of a sparse matrix, collected and then sorted by row."""

    def __init__(self, rows: int) -> None:
        self.count = rows
        self.parts: list[tuple[Ints, Ints, Floats]] = []

    def add(self, rows: Ints, columns: Ints, weights: Doubles | float) -> None:
        """Add terms; those of weight 0 are left out."""
        weights = np.broadcast_to(np.asarray(weights, np.float32), rows.shape)
        some = weights != 0.0
        self.parts.append((rows[some], columns[some], weights[some]))

    def stencil(self) -> Stencil:
        """The matrix; each row has a term or more."""
        rows, columns, weights = (np.concatenate(part) for part in zip(*self.parts, strict=True))
        order = np.argsort(rows, kind="stable")
        start = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=self.count))])
        return Stencil(start, columns[order], weights[order])
