"""Far lamps seen as one, with a bound on the error: lightcuts for candela.

After Walter et al. 2005, "Lightcuts: a scalable approach to illumination": a binary tree over
the lamps, and for each place a cut through it: a node of the cut stands for all its lamps. From
there: tree, cut, refinement until an error bound holds. Ours: one cut for a whole tile of the
picture, a merged lamp at the centroid instead of at one of its lamps, an analytic bound of
second order for any normal, and one budget for the sum of all errors instead of 2 % a node.

The bound. Lamps i of one node with I_i candela at p_i = c + u_i, c the centroid, so that
sum I_i u_i = 0. Seen from x, v = c - x, r = |v|, R = max |u_i| < r, M = sum I_i |u_i|^2.
A facing plane gets the vector g(v) = v / |v|^3 a candela, a plane with normal n gets
max(0, n.g). g is minus the gradient of 1/|v|, of which the third derivative is at most 6/|v|^4.
By Taylor at c the first order cancels and the rest is, with q = R / r,

    |sum I_i g(v + u_i) - I g(v)|  <=  M integral_0^1 (1 - s) 6 / (r - s R)^4 ds
                                   =   M (3 - 2 q) / (r^2 (r - R)^2),                       (a)

which lamps in one line with x attain. If the horizon of x runs between the lamps, max(0, .) is
no longer linear: the difference is the smaller one of what lies above and what lies below, and

    <=  sum I_i |u_i| / (2 (r - R)^3),                                                      (b)

as sum I_i n.u_i = 0. Lamps of several colours share the centroid of their strongest channels; a
channel whose own is elsewhere adds, with P = |sum I_i u_i| of it, 2 P / r^3 + P / (2 (r - R)^3).
A beam f of the angle between axis and ray, |f'| <= F1 and |f''|, |f' cot| <= F2, multiplies 6
in the integral by (F2 + F1 + 4 F1 + 6) / 6, since |D^2 (f g)| <= |D^2 f| |g| + 2 |Df| |Dg| +
|f| |D^2 g|. A smoothstep over w rad has F1 = 3 / (2 w) and F2 = 6 / w^2; |cos|^k (k >= 2) has
sqrt(k) and k; where the tile and the lamps lie within the full part of a cone, its own are 0.

A tile is a ball of radius T about t; r >= |c - t| - T. What a lamp gives a facing plane is at
least I / ((|c - t| + T)^2 + M / I) (Jensen). So for each point of the tile and each normal

    |illuminance by the cut - illuminance by all lamps|  <=  epsilon sum_i I_i f_i / d_i^2,

the right side being what a small ball there catches from all sides (scalar illuminance, without
occluders). In each channel, the right side by the strongest one.

Highlights are not bounded so: a lobe may show a far lamp alone. On a tile with a lobe as wide
as alpha over the half vector H (rad: alpha of GGX, sqrt(2 / (n + 2)) of Blinn-Phong) lamps merge
only while they turn H by less than ``LOBE_SHARE`` of it: sqrt(M / I) / r <= LOBE_SHARE alpha
|L + V|, where |dH| <= |dL| / |L + V| for unit vectors L, V to lamp and eye. At grazing angles
|L + V| is small, so lamps ahead keep their streaks on a wet road.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.beam import Beams, beams_of
from hdrusd.photometry.lighttree import LightTree, extent
from hdrusd.scene import DISK, NO_CONE, RECT

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Bools = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]

#: Share of the light at a place by which merging may change it. The bound adds up what the
#: worst place and normal of a tile would see of each node: the mean error that is found on
#: streets is a tenth of it and less.
EPSILON = 0.02

#: How far (rms) merged lamps may turn the half vector, in widths of the narrowest lobe.
LOBE_SHARE = 0.5

#: |L + V| that counts where it is less: there the half vector has no direction any more.
_LEAST_SUM = 0.02

#: Nodes that are looked at for every tile.
_DENSE = 160

#: Pairs (tile, node) looked at together: as many as stay in the processor's cache.
_PAIRS = 1 << 16

#: Into so many shares the budget is cut at first, if there are so many to merge.
_SHARES = 24


@dataclass(frozen=True, slots=True, eq=False)
class Tiles:
    """Balls that hold what tiles show: m relative to the eye, world directions, (m,) each."""

    centre: Floats  # (m, 3)
    radius: Floats
    lobe: Floats  # rad: alpha of the narrowest lobe; inf: none
    toward_eye: Floats  # (m, 3) unit vectors

    def part(self, first: int, last: int) -> Tiles:
        """The tiles from ``first`` to before ``last``."""
        s = slice(first, last)
        return Tiles(self.centre[s], self.radius[s], self.lobe[s], self.toward_eye[s])


def cut(
    tree: LightTree, eye: npt.ArrayLike, tiles: Tiles, epsilon: float = EPSILON
) -> tuple[Ints, Ints]:
    """What lights each tile: pairs (tile, row), (p,) int32 each, in order of the tiles.

    ``row``: of the lights followed by ``merged_lights``. A light whose cone does not touch
    a tile's ball is left out of it, which changes nothing. ``epsilon``: of the bound above;
    0 merges only what stands in one place. ``eye``: (3,) m, where the tiles' origin is.
    """
    nodes = _Nodes(tree, np.asarray(eye, np.float64))
    step = max(_PAIRS // max(nodes.dense, 1), 1)
    parts = [np.zeros((2, 0), np.int32)]
    for first in range(0, len(tiles.radius), step):
        tile, node = _Cut(nodes, tiles.part(first, first + step), epsilon).run()
        # Sorted by counting where the numbers are short.
        order = np.argsort(tile.astype(np.uint16 if step < 1 << 16 else np.intp), kind="stable")
        parts.append(np.stack([tile[order] + first, tree.row[node[order]]]).astype(np.int32))
    tile, row = np.concatenate(parts, axis=1)
    return tile, row


def reached(lights: npt.NDArray[np.void], eye: npt.ArrayLike, tiles: Tiles) -> tuple[Ints, Ints]:
    """Where lights with a beam or a dark side shine: pairs (tile, light), in order of the tiles.

    A pair is left out where no point of the tile's ball lies in the light's outer cone or
    before a flat light's face, which changes nothing; without either, none is.
    """
    table = lights.copy()
    flat = np.isin(lights["shape"], (RECT, DISK)) & (lights["w"] > 0.0)
    # Nothing shines out of its back: no cone of it is wider than a half space.
    table["outer"] = np.where(flat, np.minimum(lights["outer"], np.pi / 2), lights["outer"])
    table["inner"] = np.minimum(lights["inner"], table["outer"])
    table["outer"] = np.where(lights["w"] > 0.0, table["outer"], NO_CONE)
    beams = beams_of(table)
    parts = [np.zeros((2, 0), np.int32)]
    step = max(_PAIRS // max(len(lights), 1), 1)
    with np.errstate(all="ignore"):
        places = (lights["position"] - np.asarray(eye, np.float64)).astype(np.float32).T
        size = extent(lights).astype(np.float32)
        for first in range(0, len(tiles.radius), step):
            part = tiles.part(first, first + step)
            x, y, z = (c[:, None] - p for c, p in zip(part.centre.T, places, strict=True))
            along, across = beams.along_and_across((x, y, z))
            distance = np.sqrt(x * x + y * y + z * z)
            dark = beams.misses(along, across, distance, part.radius[:, None] + size)
            tile, light = np.nonzero(~dark)
            parts.append(np.stack([tile + first, light]).astype(np.int32))
    tile, light = np.concatenate(parts, axis=1)
    return tile, light


class _Nodes:
    """Columns of the tree as the bound needs them, float32, relative to the eye."""

    def __init__(self, tree: LightTree, eye: Doubles) -> None:
        self.tree = tree
        lamp = np.maximum(tree.lamp, np.float32(1e-6))
        columns = [
            *(tree.position - eye).T,
            tree.radius,
            tree.strength,
            tree.variance + lamp * lamp,
            tree.strength * tree.variance,
            tree.strength * tree.spread,
            # Nearer than its radius a lamp is no point. A leaf is right at any distance.
            np.where(tree.child < 0, np.float32(-np.inf), lamp),
            tree.variance,
        ]
        # A row a node: to fetch it takes a seventh of fetching from ten columns.
        self.table = np.column_stack(columns).astype(np.float32)
        self.beams = beams_of(tree.beams)
        self.inner = tree.child >= 0
        child = np.where(self.inner, tree.child, 0)
        # Nodes of two lamps that shine everywhere: below them there is nothing to look at.
        pair = self.inner & ~self.inner[child] & ~self.inner[child + 1 - (child == 0)]
        self.pair = pair & (tree.beam < 0)
        self.parent = np.full(len(tree.child), -1)
        self.parent[tree.child[self.inner]] = np.flatnonzero(self.inner)
        self.parent[tree.child[self.inner] + 1] = np.flatnonzero(self.inner)
        # The first levels, which nearly all tiles go through, are looked at as a matrix.
        self.levels = [(0, tree.roots)]
        while True:
            first, last = self.levels[-1]
            more = 2 * int(np.count_nonzero(self.inner[first:last]))
            if not more or last + more > _DENSE:
                break
            self.levels.append((last, last + more))
        self.dense = self.levels[-1][1]


class _Cut:
    """The cut through the trees for some tiles at once."""

    def __init__(self, nodes: _Nodes, tiles: Tiles, epsilon: float) -> None:
        self.nodes, self.epsilon, self.count = nodes, epsilon, len(tiles.radius)
        turn = (np.float32(LOBE_SHARE) * np.minimum(tiles.lobe, np.float32(1e15))) ** 2
        glossy = bool(np.any(np.isfinite(tiles.lobe)))
        columns = [*tiles.centre.T, tiles.radius] + glossy * [turn, *tiles.toward_eye.T]
        self.table = np.column_stack(columns).astype(np.float32)
        # Finished pairs, and merged ones with their bounds.
        self.leaves: list[tuple[Indices, Indices]] = []
        self.merged: list[tuple[Indices, Indices, Floats, Floats]] = []
        self.light = np.zeros(self.count)  # least light of the finished ones

    def run(self) -> tuple[Indices, Indices]:
        """Pairs (tile, node)."""
        tile, node, limit = self.start()
        while True:
            while len(tile):
                tile, node = self.refine(tile, node, limit)
            held = [np.concatenate(k) for k in zip(*self.merged, strict=True)]
            tile, node, error, light = held
            # Over the budget: those above the mean share of it once more.
            budget = np.bincount(tile, light, self.count) + self.light
            budget *= self.epsilon
            number = np.bincount(tile, minlength=self.count)
            over = np.bincount(tile, error, self.count) > budget
            limit = np.where(over, budget / np.maximum(number, 1), np.inf).astype(np.float32)
            split = error > np.take(limit, tile)
            kept = ~split
            self.merged = [(tile[kept], node[kept], error[kept], light[kept])]
            if not np.any(split):
                break
            tile, node = self.children(tile[split], node[split], light[split])
        self.leaves.append((tile, node))
        tiles, found = zip(*self.leaves, strict=True)
        return np.concatenate(tiles), np.concatenate(found)

    def start(self) -> tuple[Indices, Indices, Floats]:
        """Go through the first levels; what is left to look at, and the bound a node may have."""
        nodes = self.nodes
        tree, n = nodes.tree, nodes.dense
        error = np.zeros((self.count, n), np.float32)
        light, lit = error.copy(), np.ones((self.count, n), np.bool_)
        tiles = self.table.T[:, :, None]
        beam = tree.beam[:n]
        for some in (np.flatnonzero(beam < 0), np.flatnonzero(beam >= 0)):
            if len(some):
                shaped = nodes.beams.take(beam[some]) if beam[some[0]] >= 0 else None
                found = bound(tiles, np.ascontiguousarray(nodes.table[some].T), shaped)
                error[:, some], light[:, some] = found[:2]
                if shaped is not None:
                    lit[:, some] = found[2]
        fringe = np.ones(n, np.bool_)
        fringe[nodes.parent[:n][nodes.parent[:n] >= 0]] = False
        total = light[:, fringe].sum(axis=1)
        shares = min(_SHARES, max(tree.merged, 1))
        limit = (self.epsilon / shares * total).astype(np.float32)
        fine = error <= limit[:, None]
        open_ = lit & nodes.inner[:n] & ~fine
        for first, last in nodes.levels[1:]:
            above = nodes.parent[first:last]
            reached = open_[:, above]
            lit[:, first:last] &= reached
            open_[:, first:last] &= reached
        take = lit & ~open_
        tile, node = np.nonzero(take & nodes.inner[:n])
        self.merged.append((tile, node, error[tile, node], light[tile, node]))
        leaf = take & ~nodes.inner[:n]
        self.light += np.where(leaf, light, 0.0).sum(axis=1)
        at, lamp = np.nonzero(leaf)
        self.leaves.append((at, lamp))
        tile, node = np.nonzero(open_ & fringe)
        return *self.children(tile, node, light[tile, node]), limit

    def children(self, tile: Indices, node: Indices, light: Floats) -> tuple[Indices, Indices]:
        """The halves of nodes; where they are two lamps, these are finished."""
        child = np.take(self.nodes.tree.child, node)
        pair = np.take(self.nodes.pair, node)
        last, at = child[pair], tile[pair]
        self.leaves += [(at, last), (at, last + 1)]
        self.light += np.bincount(at, light[pair], self.count)
        tile, node = np.repeat(tile[~pair], 2), np.repeat(child[~pair], 2)
        node[1::2] += 1
        return tile, node

    def refine(self, tile: Indices, node: Indices, limit: Floats) -> tuple[Indices, Indices]:
        """Look at pairs: keep those within the limit of their tile, the children of the others."""
        nodes = self.nodes
        beam = np.take(nodes.tree.beam, node) if len(nodes.tree.beams) else None
        if beam is not None:
            some = np.flatnonzero(beam >= 0)
            if len(some) and len(some) < len(tile):
                rest = np.flatnonzero(beam < 0)
                parts = [self.refine(tile[k], node[k], limit) for k in (some, rest)]
                tile, node = (np.concatenate(k) for k in zip(*parts, strict=True))
                return tile, node
        shaped = nodes.beams.take(beam) if beam is not None and beam[0] >= 0 else None
        tiles, rows = (
            np.take(k, i, axis=0).T for k, i in ((self.table, tile), (nodes.table, node))
        )
        error, light, lit = bound(tiles, rows, shaped)
        inner = np.take(nodes.inner, node)
        if shaped is not None:
            tile, node, inner = tile[lit], node[lit], inner[lit]
            error, light = error[lit], light[lit]
        fine = error <= np.take(limit, tile)
        held = np.flatnonzero(fine & inner)
        self.merged.append((tile[held], node[held], error[held], light[held]))
        leaf = np.flatnonzero(~inner)
        self.leaves.append((tile[leaf], node[leaf]))
        self.light += np.bincount(tile[leaf], light[leaf], self.count)
        split = np.flatnonzero(inner & ~fine)
        return self.children(tile[split], node[split], light[split])


def bound(tiles: Floats, nodes: Floats, beams: Beams | None) -> tuple[Floats, Floats, Bools | None]:
    """Of pairs: error bound, least light, both lx of a facing plane; may it be lit at all.

    An infinite error: these lamps may not merge here. Columns that broadcast: of tiles
    place, radius and, where there are lobes, square of the turn that they bear and way to the
    eye; of nodes those of ``_Nodes``.
    """
    cx, cy, cz, ball, *gloss = tiles
    x, y, z, size, strength, softness, moment, first_order, nearest, variance = nodes
    with np.errstate(all="ignore"):
        vx, vy, vz = x - cx, y - cy, z - cz
        distance = np.sqrt(vx * vx + vy * vy + vz * vz)
        near = distance - ball
        gap = near - size
        far = distance + ball
        light = strength / (far * far + softness)
        inverse = 1.0 / np.maximum(gap, np.float32(1e-9))
        error = moment * (3.0 * near - 2.0 * size) / (near * near * near)
        error = (error + first_order * inverse) * (inverse * inverse)
        apart = gap <= nearest
        if gloss:
            turn, ex, ey, ez = gloss
            sum2 = 2.0 + 2.0 * (vx * ex + vy * ey + vz * ez) / distance
            sum2 = np.maximum(sum2, np.float32(_LEAST_SUM**2))
            apart |= variance > turn * (near * near) * sum2
        lit = None
        if beams is not None:
            along, across = beams.along_and_across((-vx, -vy, -vz))
            reach = ball + size
            lit = ~beams.misses(along, across, distance, reach)
            held = beams.holds(along, across, distance, reach)
            error *= np.where(held, beams.full, beams.edge)
            least = beams.least_focus(along, across, distance, reach)
            light = np.where(lit & held, light * least, np.float32(0.0))
        error[apart] = np.inf
    return error, light, lit
