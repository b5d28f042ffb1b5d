"""BasisCurves as tubes, or as ribbons where they have normals.

A renderer that draws lines makes them as wide as pixels; light needs an area, so a curve
is a tube of its width in the world. Bases, wraps and the number of segments are those of
UsdGeomBasisCurves, pinned ends by its phantom points 2 P0 - P1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from pxr import Usd, UsdGeom

from hdrusd.report import Kind
from hdrusd.usd.arrays import integers, rows
from hdrusd.usd.points import DEFAULT_WIDTH, given_widths
from hdrusd.usd.surface import Floats, Note, Surface, Values
from hdrusd.usd.triangles import Corners, corners

Ints = npt.NDArray[np.int64]
Doubles = npt.NDArray[np.float64]

#: Triangles of one prim; with more its curves get fewer sides and steps, then are left out.
MOST_TRIANGLES = 1 << 22

_BASES = {  # rows: 1, t, t^2, t^3; columns: the four control points
    "bezier": np.array([[1, 0, 0, 0], [-3, 3, 0, 0], [3, -6, 3, 0], [-1, 3, -3, 1]], float),
    "bspline": np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6.0,
    "catmullRom": np.array([[0, 2, 0, 0], [-1, 0, 1, 0], [2, -5, 4, -1], [-1, 3, -3, 1]]) / 2.0,
}


@dataclass(frozen=True, eq=False)
class Spans:
    """The segments of all curves of a prim, and samples along them."""

    counts: Ints  # (c,) control points
    segments: Ints  # (c,)
    basis: str  # "linear" or a cubic one
    periodic: bool
    pinned: bool
    steps: int  # samples a segment

    @cached_property
    def samples(self) -> Ints:
        """(c,) samples of each curve; the last one of a periodic curve is its first again."""
        return np.where(self.segments > 0, self.segments * self.steps + 1, 0)

    @cached_property
    def curve(self) -> Ints:
        """(s,) the curve of each sample."""
        return np.repeat(np.arange(len(self.counts)), self.samples)

    @cached_property
    def place(self) -> Ints:
        """(s,) which sample of its curve it is."""
        start = np.cumsum(self.samples) - self.samples
        return np.arange(len(self.curve)) - start[self.curve]

    @cached_property
    def _segment(self) -> tuple[Ints, Doubles]:
        """(s,) the segment of its curve, and where in it, 0 to 1."""
        segment = np.minimum(self.place // self.steps, self.segments[self.curve] - 1)
        return segment, (self.place - segment * self.steps) / self.steps

    def vertex(self, values: Values) -> Floats:
        """(s, .) of values at the control points."""
        segment, t = self._segment
        first = (np.cumsum(self.counts) - self.counts)[self.curve]
        count = self.counts[self.curve]
        if self.basis == "linear":
            weights = np.stack([1.0 - t, t])
            before, step = 0, 1
        else:
            powers = np.stack([np.ones_like(t), t, t**2, t**3])
            weights = _BASES[self.basis].T @ powers
            before = 1 if self.pinned and self.basis != "bezier" else 0
            step = 3 if self.basis == "bezier" else 1
        result = np.zeros((len(t), values.shape[1]))
        for offset, weight in enumerate(weights, -before):
            index = segment * step + offset
            if self.periodic:
                index %= count
            inside = np.clip(index, 0, count - 1)
            taken = values[first + inside].astype(np.float64)
            outside = index != inside  # phantom points of pinned curves
            if outside.any():
                inner = np.clip(2 * inside - index, 0, count - 1)[outside]
                taken[outside] = 2.0 * taken[outside] - values[first[outside] + inner]
            result += weight[:, None] * taken
        return result.astype(np.float32)

    def varying(self, values: Values) -> Floats:
        """(s, .) of values at the ends of the segments."""
        segment, t = self._segment
        number = self.varying_counts
        first = (np.cumsum(number) - number)[self.curve]
        after = segment + 1
        if self.periodic:
            after = after % np.maximum(number[self.curve], 1)
        a, b = values[first + segment], values[first + after]
        return np.asarray(a * (1.0 - t[:, None]) + b * t[:, None], np.float32)

    @cached_property
    def varying_counts(self) -> Ints:
        """(c,) values of "varying" interpolation that each curve has."""
        return self.segments + (0 if self.periodic else 1) * (self.segments > 0)

    def take(self, values: Values, interpolation: str) -> Floats | None:
        """(s, .) of a primvar's values; None where their number does not fit."""
        count = len(values)
        if interpolation == "constant" or (count == 1 and interpolation != "uniform"):
            return np.repeat(values[:1], len(self.curve), axis=0).astype(np.float32)
        if interpolation == "uniform" and count >= len(self.counts):
            return values[self.curve].astype(np.float32)
        if interpolation == "vertex" and count >= int(self.counts.sum()):
            return self.vertex(values)
        if interpolation in ("varying", "faceVarying") and count >= int(self.varying_counts.sum()):
            return self.varying(values)
        return None


def read_curves(
    prim: Usd.Prim, time: Usd.TimeCode, note: Note, *, level: int = 0
) -> Surface | None:
    """Tubes of 6 sides (with ``level`` twice as many each), or ribbons across the normals."""
    schema = UsdGeom.BasisCurves(prim)
    given = rows(schema.GetPointsAttr().Get(time), 3)
    counts = integers(schema.GetCurveVertexCountsAttr().Get(time))
    if given is None or not counts.size:
        return None
    if (counts < 0).any() or int(counts.sum()) != len(given):
        text = f"{len(given)} points, {int(counts.sum())} in its curves; not drawn"
        note(Kind.INVALID, "curve-arrays", text)
        return None
    points = given[:, :3].astype(np.float32)
    finite = np.asarray(np.isfinite(points).all(axis=1))
    points = np.where(finite[:, None], points, np.float32(0.0))
    normals = _given_normals(schema, time)
    spans, sides = _spans(schema, counts, level, normals is not None, note)
    if not spans.samples.sum():
        return None
    centre = spans.vertex(points).astype(np.float64)
    radius = _radii(schema, time, spans, note)
    tangent, side = _frames(spans, centre)
    if normals is not None and (up := spans.take(*normals)) is not None:
        across = np.cross(up.astype(np.float64), tangent)
        side = _unit(across, side)
        ring = np.stack([-side, side], axis=1)
        facing = np.repeat(np.cross(tangent, side), 2, axis=0)
        around = 1
    else:
        sides = max(sides, 3)
        turn = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)[:, None]
        other = np.cross(tangent, side)
        ring = np.cos(turn) * side[:, None] + np.sin(turn) * other[:, None]
        facing = ring.reshape(-1, 3)
        around = sides
    shell = (centre[:, None] + radius[:, None, None] * ring).reshape(-1, 3).astype(np.float32)
    tri = _quads(spans, ring.shape[1], around)
    if not finite.all():
        note(Kind.INVALID, "mesh-not-finite", "points are not finite; their faces left")
        reached = spans.vertex(~finite[:, None])[:, 0] != 0.0
        tri = tri.where(~reached[tri.vertex // ring.shape[1]].any(axis=1))
    facing32, width = facing.astype(np.float32), ring.shape[1]

    def expand(values: Values, interpolation: str, some: Corners) -> Floats | None:
        taken = spans.take(values, interpolation)
        return None if taken is None else taken[some.vertex.ravel() // width]

    return Surface(shell, tri, lambda some: facing32[some.vertex.ravel()], expand)


def _spans(
    schema: UsdGeom.BasisCurves, counts: Ints, level: int, flat: bool, note: Note
) -> tuple[Spans, int]:
    """The segments of the curves, and the sides of a tube, as many as are allowed."""
    wrap = str(schema.GetWrapAttr().Get())
    linear = schema.GetTypeAttr().Get() == "linear"
    basis = "linear" if linear else str(schema.GetBasisAttr().Get())
    if basis != "linear" and basis not in _BASES:
        note(Kind.REPLACED, "curve-basis", f"{basis}: no basis of this schema; drawn as lines")
        basis = "linear"
    periodic, pinned = wrap == "periodic", wrap == "pinned"
    if basis == "linear":
        segments = np.where(counts > 1, counts - (0 if periodic else 1), 0)
    elif basis == "bezier":
        segments = np.where(counts > 3, (counts - 4) // 3 + 1, 0)
        if periodic:
            segments = counts // 3
    elif periodic:
        segments = np.where(counts > 2, counts, 0)
    elif pinned:
        segments = np.where(counts > 1, counts - 1, 0)
    else:
        segments = np.maximum(counts - 3, 0)
    if ((segments == 0) & (counts > 0)).any():
        note(Kind.INVALID, "curve-arrays", "curves of too few points are left out")
    steps = 1 if basis == "linear" else 4 << level
    sides = 1 if flat else 6 << level
    total = int(segments.sum())
    while total * steps * sides * 2 > MOST_TRIANGLES and (steps > 1 or sides > 3):
        steps, sides = max(steps // 2, 1), max(sides // 2, 1 if flat else 3)
    if total * steps * sides * 2 > MOST_TRIANGLES:
        kept = np.cumsum(segments) * sides * 2 <= MOST_TRIANGLES
        text = f"the first {int(kept.sum())} of {len(counts)} curves are drawn"
        note(Kind.CLAMPED, "curves-limit", text)
        segments = np.where(kept, segments, 0)
    return Spans(counts, segments, basis, periodic, pinned, steps), sides


def _radii(schema: UsdGeom.BasisCurves, time: Usd.TimeCode, spans: Spans, note: Note) -> Doubles:
    """(s,) half the width at each sample."""
    widths = given_widths(schema, time, note)[:, None]
    taken = spans.take(widths, str(schema.GetWidthsInterpolation()))
    if taken is None or not (np.isfinite(taken).all() and (taken >= 0.0).all()):
        text = f"widths do not fit the curves, or are negative; {DEFAULT_WIDTH:g} is used"
        note(Kind.INVALID, "width", text)
        taken = np.full((len(spans.curve), 1), DEFAULT_WIDTH, np.float32)
    return taken[:, 0].astype(np.float64) / 2.0


def _given_normals(schema: UsdGeom.BasisCurves, time: Usd.TimeCode) -> tuple[Values, str] | None:
    """Normals, which make a curve a ribbon, and their interpolation."""
    primvar = UsdGeom.PrimvarsAPI(schema).GetPrimvar("normals")
    if primvar and primvar.HasValue():
        values = rows(primvar.ComputeFlattened(time), 3)
        interpolation = str(primvar.GetInterpolation())
    else:
        values = rows(schema.GetNormalsAttr().Get(time), 3)
        interpolation = str(schema.GetNormalsInterpolation())
    return None if values is None else (values[:, :3], interpolation)


def _frames(spans: Spans, centre: Doubles) -> tuple[Doubles, Doubles]:
    """(s, 3) tangents, and unit vectors square to them that turn no more than they must."""
    last = spans.place == (spans.samples[spans.curve] - 1)
    first = spans.place == 0
    index = np.arange(len(centre))
    after, before = np.where(last, index, index + 1), np.where(first, index, index - 1)
    if spans.periodic:  # the last sample is the first one again
        span = spans.samples[spans.curve] - 1
        after, before = (
            np.where(last, index - span + 1, after),
            np.where(first, index + span - 1, before),
        )
    tangent = _unit(centre[after] - centre[before], np.array([0.0, 0.0, 1.0]))
    # Each step turns the frame by the smallest rotation that takes a tangent to the next.
    dot = np.einsum("ij,ij->i", tangent[np.maximum(index - 1, 0)], tangent)
    cross = np.cross(tangent[np.maximum(index - 1, 0)], tangent)
    turn = np.concatenate([1.0 + dot[:, None], cross], axis=1)
    back = dot < -1.0 + 1e-12
    turn[back, 0], turn[back, 1:] = 0.0, _square_to(tangent[back])
    turn[first] = (1.0, 0.0, 0.0, 0.0)
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    # All products from a curve's start, in as many passes as its length has bits.
    step = 1
    while step <= int(spans.place.max(initial=0)):
        late = np.flatnonzero(spans.place >= step)
        turn[late] = _times(turn[late], turn[late - step])
        step *= 2
    start = index - spans.place
    side = _rotated(turn, _square_to(tangent[start]))
    if spans.periodic:  # what is left over after a round is spread along it
        end = start + spans.samples[spans.curve] - 1
        to = _square_to(tangent[start])
        over = np.arctan2(
            np.einsum("ij,ij->i", np.cross(to, side[end]), tangent[start]),
            np.einsum("ij,ij->i", to, side[end]),
        )
        angle = -over * spans.place / np.maximum(spans.samples[spans.curve] - 1, 1)
        other = np.cross(tangent, side)
        side = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * other
    return tangent, _unit(side - tangent * np.einsum("ij,ij->i", side, tangent)[:, None], side)


def _quads(spans: Spans, width: int, around: int) -> Corners:
    """Triangles between the rings of ``width`` points of neighbouring samples."""
    ahead = np.flatnonzero(spans.place < spans.samples[spans.curve] - 1)[:, None]
    k = np.arange(around)[None, :]
    a, b = ahead * width + k, ahead * width + (k + 1) % width
    quads = np.stack([a, b, b + width, a + width], axis=-1).reshape(-1, 4)
    return corners(np.full(len(quads), 4), quads.ravel(), left_handed=False)


def _unit(vectors: Doubles, instead: Doubles) -> Doubles:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    good = length > 0.0
    return np.asarray(np.where(good, vectors / np.where(good, length, 1.0), instead))


def _square_to(vectors: Doubles) -> Doubles:
    """A unit vector square to each: across the axis that it is farthest from."""
    axis = np.eye(3)[np.abs(vectors).argmin(axis=1)]
    across = np.cross(vectors, axis)
    return np.asarray(across / np.linalg.norm(across, axis=1, keepdims=True))


def _times(p: Doubles, q: Doubles) -> Doubles:
    """Quaternions (w, x, y, z): first turn by q, then by p."""
    w = p[:, :1] * q[:, :1] - np.einsum("ij,ij->i", p[:, 1:], q[:, 1:])[:, None]
    v = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    return np.concatenate([w, v], axis=1)


def _rotated(q: Doubles, vectors: Doubles) -> Doubles:
    twice = 2.0 * np.cross(q[:, 1:], vectors)
    return np.asarray(vectors + q[:, :1] * twice + np.cross(q[:, 1:], twice))
