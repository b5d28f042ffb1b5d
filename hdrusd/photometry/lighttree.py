"""Binary trees over lamps that may stand for one another: what lightcut.py cuts.

Lamps merge only with lamps whose beam is the same: shape, axis, cone, focus, links. Each such
group has a tree of its own, and a lamp that is like no other is a tree of one node.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.light import shines_as
from hdrusd.scene import NO_CONE, POINT, SPHERE

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Bools = npt.NDArray[np.bool_]
Lights = npt.NDArray[np.void]

#: Axes and angles that are the same to so many decimals (rad) are one beam.
BEAM_DECIMALS = 6

#: A split leaves at least one in so many on each side, so that a tree is not deep.
_THINNEST = 4

#: m and cd of lights that merge: their products stay within float32.
_FARTHEST, _BRIGHTEST = 1e8, 1e18

#: m: lamps as near as that to their centroid are in one place.
_ONE_PLACE = 1e-6

_AXES = (0, 1, 2)

#: What has to be the same for two lamps to merge, beside the beam. What shades them has not:
#: lamps with a shadow map don't merge.
_SAME = ("shape", "link", "shadow", "diffuse", "specular")


@dataclass(frozen=True, slots=True, eq=False)
class LightTree:
    """Nodes of all trees, (n,) each: the roots first, then level by level, siblings side by side.

    A leaf is the light of its row; an inner node is row ``lights + k`` of the table that
    ``merged_lights`` makes longer.
    """

    position: Doubles  # (n, 3) m: centroid, weighted by strength
    strength: Floats  # cd of the strongest channel, summed; 0 where nothing is known
    variance: Floats  # m2: mean square of the distance from the centroid, by strength
    spread: Floats  # m: coefficient of the first-order terms of the bound over strength
    radius: Floats  # m: no lamp of the node is farther from the centroid
    lamp: Floats  # m: largest radius of a lamp; nearer than that there is no inverse square
    child: Ints  # the first of two; -1 for a leaf
    row: Ints  # in the table of lights and merged lights
    first: Ints  # row of one of the node's lights
    beam: Ints  # number in ``beams``; -1: the same in all directions, or unknown
    beams: Lights  # one light of each group with a cone or a focus
    roots: int  # the first so many nodes
    lights: int

    @property
    def merged(self) -> int:
        """How many rows ``merged_lights`` has."""
        return int(np.count_nonzero(self.child >= 0))


def may_merge(lights: Lights) -> Bools:
    """(n,) True for lights that have the field of a point lamp with cone and focus.

    Profiles, area lights and distant lights have another; a focus below 2 has a kink at
    right angles to the axis, and less than no light follows no bound. A ball shines as the
    point in its middle where no horizon cuts it: small ones may merge. What is too far
    away or too bright for float32 stays alone too.
    """
    focus, outer = lights["exponent"], lights["outer"]
    brightest = np.max(lights["intensity"], axis=1, initial=0.0)
    return np.asarray(
        (lights["w"] == 1.0)
        & (shines_as(lights) == POINT)
        & (lights["profile"] < 0)
        & ((focus == 0.0) | (focus >= 2.0))
        & ((outer <= np.pi) | (outer >= NO_CONE))
        & np.all(lights["intensity"] >= 0.0, axis=1)
        & (brightest > 0.0)
        & (brightest < _BRIGHTEST)
        & np.all(np.abs(lights["position"]) < _FARTHEST, axis=1)
    )


def has_beam(lights: Lights) -> Bools:
    """(n,) True for lights at a place that do not shine alike in all directions."""
    shaped = (lights["outer"] < NO_CONE) | (lights["exponent"] > 0.0)
    return np.asarray(shaped & (lights["w"] > 0.0))


def extent(lights: Lights) -> Doubles:
    """(n,) m: how far from its position a light shines; 0 for points."""
    sides = np.sqrt(np.sum(lights["x"] ** 2 + lights["y"] ** 2, axis=1))
    area = np.where(lights["shape"] == SPHERE, lights["radius"], sides + lights["radius"])
    return np.where((lights["shape"] == POINT) | (lights["w"] == 0.0), 0.0, area)


def beam_groups(lights: Lights, merge: Bools, kinds: Ints) -> Ints:
    """(n,) group numbers: the same for lights that may merge, for each other one its own."""
    shaped = has_beam(lights)
    beam = np.column_stack([lights[name] for name in ("axis", "inner", "outer", "exponent")])
    # Adding 0 turns -0 into 0.
    beam = np.where(shaped[:, None], np.round(beam, BEAM_DECIMALS), 0.0) + 0.0
    same = np.column_stack([beam, *(lights[name].astype(np.float64) for name in _SAME)])
    single = np.where(merge, -1.0, np.arange(len(lights)))
    keys = np.column_stack([same, kinds, single])
    keys = np.ascontiguousarray(keys[:, np.any(keys != keys[:1], axis=0)])
    if not keys.size:
        return np.zeros(len(lights), np.int32)
    whole = keys.view(np.dtype((np.void, keys.dtype.itemsize * keys.shape[1]))).ravel()
    return np.unique(whole, return_inverse=True)[1].astype(np.int32)


def build_tree(lights: Lights, kinds: Ints | None = None) -> LightTree:
    """Trees over ``lights`` (dtype LIGHT).

    ``kinds`` (n,): lights merge within one kind only, and those below 0 not at all.

    Each node is split across its longest axis where the sum of the variances becomes least,
    all nodes of one level at a time.
    """
    known = may_merge(lights)
    kinds = np.zeros(len(lights), np.int32) if kinds is None else kinds
    groups = beam_groups(lights, known & (kinds >= 0), kinds)
    strength = np.where(known, np.max(lights["intensity"], axis=1, initial=0.0), 0.0)
    return _Levels(lights, strength, groups).build()


def merged_lights(tree: LightTree, lights: Lights) -> Lights:
    """A row of LIGHT for each inner node, in the order of ``LightTree.row``.

    The sum of the intensities at the centroid; all else as the first lamp's. ``key`` counts
    down from -1.
    """
    inner = np.flatnonzero(tree.child >= 0)
    sums = np.zeros((len(tree.child), 3))
    leaf = tree.child < 0
    sums[leaf] = lights["intensity"][tree.row[leaf]]
    # Children come after their parents: from the last level up, each is ready in time.
    for level in reversed(_levels_of(tree, inner)):
        sums[level] = sums[tree.child[level]] + sums[tree.child[level] + 1]
    rows = lights[tree.first[inner]]
    rows["position"], rows["intensity"] = tree.position[inner], sums[inner]
    rows["radius"], rows["key"] = tree.lamp[inner], -1 - np.arange(len(inner))
    return rows


def _levels_of(tree: LightTree, inner: npt.NDArray[np.intp]) -> list[npt.NDArray[np.intp]]:
    """Inner nodes by level."""
    levels, end = [], tree.roots
    while len(inner):
        count = int(np.searchsorted(inner, end))
        level, inner = inner[:count], inner[count:]
        levels.append(level)
        end += 2 * count
    return levels


class _Levels:
    """The lamps sorted so that each node of a level is a run of them."""

    def __init__(self, lights: Lights, strength: Doubles, groups: Ints) -> None:
        position = lights["position"]
        position = np.where(np.abs(position) < _FARTHEST, position, 0.0)
        self.origin = position.mean(axis=0) if len(lights) else np.zeros(3)
        intensity = lights["intensity"].astype(np.float64)
        # Of one colour, the centroid is that of every channel.
        lit = strength > 0.0
        share = intensity[lit] / strength[lit, None]
        coloured = bool(np.any(np.abs(share - share[:1]) > 1e-9))
        self.count = len(lights)
        order = np.argsort(groups, kind="stable")
        self.starts = np.flatnonzero(np.diff(groups[order], prepend=-1))
        # One array a coordinate, in the order of the lamps: a third of the time of (n, 3).
        self.lamps: dict[str, Any] = {
            "row": order,
            "strength": strength[order],
            # A centroid needs weights; strength 0 is alone in its tree.
            "weight": np.where(strength > 0.0, strength, 1.0)[order],
            "lamp": lights["radius"].astype(np.float64)[order],
            "extent": extent(lights)[order],
        }
        beam = np.flatnonzero(has_beam(lights))
        groups, of_group = groups[beam], np.full(len(lights), -1)
        _, one, number = np.unique(groups, return_index=True, return_inverse=True)
        of_group[beam] = number
        self.beams = lights[beam[one]]
        self.lamps["beam"] = of_group[order]
        self.lamps |= {f"p{k}": (position[:, k] - self.origin[k])[order] for k in _AXES}
        if coloured:
            self.lamps |= {f"channel{k}": intensity[:, k][order] for k in range(3)}
        self.nodes: dict[str, list[Any]] = {}

    def build(self) -> LightTree:
        roots = count = len(self.starts)
        inner = 0
        while len(self.starts):
            sizes = np.diff(self.starts, append=len(self.lamps["row"]))
            split = sizes > 1
            key = self._measure(sizes)
            more = np.arange(np.count_nonzero(split))
            child = np.full(len(sizes), -1)
            child[split] = count + 2 * more
            first = self.lamps["row"][self.starts]
            row = first.copy()
            row[split] = self.count + inner + more
            self._note(child=child, row=row, first=first, beam=self.lamps["beam"][self.starts])
            count, inner = count + 2 * len(more), inner + len(more)
            self._split(key, np.repeat(split, sizes), sizes[split])
        return self._tree(roots)

    def _measure(self, sizes: Any) -> Doubles:
        """Note the moments of each node; the lamps' places along its longest axis, 0 to 1."""
        lamps, starts = self.lamps, self.starts
        weight = lamps["weight"]
        total = np.add.reduceat(weight, starts)
        offsets, squares = [], []
        for k in _AXES:
            x = lamps[f"p{k}"]
            centroid = np.add.reduceat(weight * x, starts) / total
            centroid = np.where(sizes > 1, centroid, x[starts])
            offset = x - np.repeat(centroid, sizes)
            offset[np.abs(offset) < _ONE_PLACE] = 0.0
            offsets.append(offset)
            squares.append(np.add.reduceat(weight * offset * offset, starts))
            self._note(**{f"position{k}": centroid + self.origin[k]})
        dx, dy, dz = offsets
        distance = np.sqrt(dx * dx + dy * dy + dz * dz)
        radius = np.maximum.reduceat(distance + lamps["extent"], starts)
        first = np.add.reduceat(weight * distance, starts) / 2.0
        if "channel0" in lamps:
            first += 2.5 * self._shift(offsets)
        self._note(
            strength=np.add.reduceat(lamps["strength"], starts),
            variance=sum(squares) / total,
            spread=first / total,
            radius=radius,
            lamp=np.maximum.reduceat(lamps["lamp"], starts),
        )
        axis = np.repeat(np.argmax(squares, axis=0), sizes)
        along = np.where(axis == 0, dx, np.where(axis == 1, dy, dz))
        return np.asarray(0.5 + 0.499 * along / np.repeat(np.maximum(radius, 1e-300), sizes))

    def _shift(self, offsets: list[Doubles]) -> Doubles:
        """|sum I u| of the channel for which it is largest, cd m."""
        channels = [self.lamps[f"channel{k}"] for k in range(3)]
        sums = [[np.add.reduceat(c * u, self.starts) for u in offsets] for c in channels]
        return np.asarray(np.sqrt(np.square(sums).sum(axis=1)).max(axis=0))

    def _split(self, key: Doubles, kept: Bools, sizes: Any) -> None:
        """Leave the leaves, sort the others by ``key`` and cut each node in two."""
        key = key[kept]
        starts = np.cumsum(sizes) - sizes
        node = np.repeat(np.arange(len(sizes)), sizes)
        place = np.argsort(node + key)
        key, source = key[place], np.flatnonzero(kept)[place]
        self.lamps = {name: values[source] for name, values in self.lamps.items()}
        # The variance within the halves is least where that between them is largest.
        weight = self.lamps["weight"]
        moment = weight * (key - 0.5)  # 0.5 is the centroid
        total = np.repeat(np.add.reduceat(weight, starts), sizes) if len(starts) else weight
        before = _running(weight, starts, sizes)
        between = _running(moment, starts, sizes) ** 2
        between /= np.maximum(before * (total - before), 1e-300)
        index = np.arange(len(node)) - np.repeat(starts, sizes)
        thin = np.repeat(np.maximum(sizes // _THINNEST, 1), sizes)
        between[(index < thin) | (index > np.repeat(sizes, sizes) - thin)] = -1.0
        if len(starts):
            best = np.repeat(np.maximum.reduceat(between, starts), sizes)
            found = np.where(between == best, np.arange(len(node)), len(node))
            starts = np.sort(np.concatenate([starts, np.minimum.reduceat(found, starts)]))
        self.starts = starts

    def _note(self, **columns: Any) -> None:
        for name, values in columns.items():
            self.nodes.setdefault(name, []).append(values)

    def _tree(self, roots: int) -> LightTree:
        def column(name: str, kind: Any) -> Any:
            return np.concatenate(self.nodes.get(name, [np.zeros(0)])).astype(kind)

        floats = ("strength", "variance", "spread", "radius", "lamp")
        return LightTree(
            position=np.column_stack([column(f"position{k}", np.float64) for k in _AXES]),
            beams=self.beams,
            roots=roots,
            lights=self.count,
            **{name: column(name, np.float32) for name in floats},
            **{name: column(name, np.int32) for name in ("child", "row", "first", "beam")},
        )


def _running(values: Doubles, starts: Any, sizes: Any) -> Doubles:
    """Sums of what stands before each element within its node."""
    before = np.cumsum(values) - values
    return np.asarray(before - np.repeat(before[starts], sizes))
