"""PointInstancers: what each copies, and the matrices of the copies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd, UsdGeom

from hdrusd.report import Kind, Report
from hdrusd.usd.findings import prim_finding
from hdrusd.usd.lux import is_light
from hdrusd.usd.varying import hides, place_varies, visible

#: Copies of one thing by one instancer, those of nested ones multiplied: 512 MiB of matrices.
MOST_COPIES = 1 << 22

#: Prims that are visited for one instancer with all inside it: they too multiply.
MOST_VISITED = 10_000

#: And for all instancers of a stage at one time.
MOST_VISITED_IN_ALL = 100_000

#: Instancers inside one another; each may multiply the copies.
_DEEPEST = 8

_ARRAYS = (
    "protoIndices",
    "positions",
    "orientations",
    "orientationsf",
    "scales",
    "velocities",
    "accelerations",
    "angularVelocities",
    "invisibleIds",
    "ids",
)

Matrices = npt.NDArray[np.float64]
Ids = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Copies:
    """A gprim or light of a prototype and where its copies are."""

    source: Usd.Prim
    transforms: Matrices  # (k, 4, 4) row vectors, from the source's own space to the world
    ids: Ids  # (k,) the same copy over time has the same
    varies: bool  # places, number or visibility may change in time


class Instancers:
    """The point instancers of one stage, expanded at a time; those at rest only once."""

    def __init__(self, stage: Usd.Stage, purposes: Iterable[str], report: Report) -> None:
        self.report = report
        self.purposes = set(purposes)
        self._prims: list[Usd.Prim] = []
        self._still: dict[Sdf.Path, list[Copies]] = {}
        self._moment: dict[Sdf.Path, list[Copies]] = {}
        self._time: Usd.TimeCode | None = None
        self._left = MOST_VISITED_IN_ALL

    def __bool__(self) -> bool:
        """Whether there is any."""
        return bool(self._prims)

    def add(self, prim: Usd.Prim) -> None:
        """Note an instancer of the stage."""
        self._prims.append(prim)

    def copies(self, code: Usd.TimeCode) -> list[Copies]:
        """Everything that all of them show at a time."""
        if code != self._time:
            self._time, self._moment = code, {}
        found: list[Copies] = []
        self._left = MOST_VISITED_IN_ALL
        for prim in self._prims:
            path = prim.GetPath()
            if path not in self._still and path not in self._moment:
                content, varies = self._whole(prim, code)
                (self._moment if varies else self._still)[path] = content
            found += self._still[path] if path in self._still else self._moment[path]
        return found

    def _whole(self, prim: Usd.Prim, code: Usd.TimeCode) -> tuple[list[Copies], bool]:
        varies = place_varies(prim) or hides(prim)
        if not visible(prim, code):
            return [], varies
        cache = UsdGeom.XformCache(code)
        outer = np.array(cache.GetLocalToWorldTransform(prim), np.float64)[None]
        limit = min(MOST_VISITED, self._left)
        walk = _Walk(cache, self.purposes, self.report, limit)
        first = Copies(prim, outer, np.zeros(1, np.int64), varies)
        content = list(walk.inside(first, (prim.GetPath(),)))
        self._left -= walk.visited
        if walk.stopped:
            text = f"more than {limit} prims in prototypes; the rest is not shown"
            prim_finding(self.report, prim, Kind.DROPPED, "instancer-limit", text)
        return content, varies or walk.varies


class _Walk:
    """One instancer with all that is inside it, at one time."""

    def __init__(
        self,
        cache: UsdGeom.XformCache,
        purposes: set[str],
        report: Report,
        limit: int,
    ) -> None:
        self.limit = limit
        self.cache = cache
        self.time = cache.GetTime()
        self.purposes = purposes
        self.report = report
        self.varies = False
        self.visited = 0

    @property
    def stopped(self) -> bool:
        """Whether there was too much to see all of it."""
        return self.visited > self.limit

    def inside(self, at: Copies, chain: tuple[Sdf.Path, ...]) -> Iterator[Copies]:
        """What the instancer ``at.source`` shows, for each of its own places ``at.transforms``."""
        instancer = UsdGeom.PointInstancer(at.source)
        varies = at.varies or _arrays_vary(at.source)
        self.varies |= varies
        indices = _whole_numbers(instancer.GetProtoIndicesAttr().Get(self.time))
        local = self._matrices(instancer, indices)
        if local is None:
            return
        for primvar in UsdGeom.PrimvarsAPI(at.source).GetPrimvarsWithValues():
            if primvar.GetInterpolation() != UsdGeom.Tokens.constant:
                text = f"{primvar.GetName()}: a value for each copy; all look alike"
                prim_finding(self.report, at.source, Kind.DROPPED, "instancer-primvars", text)
        mask = instancer.ComputeMaskAtTime(self.time)
        shown = np.asarray(mask, np.bool_) if mask else np.ones(len(indices), np.bool_)
        ids = _whole_numbers(instancer.GetIdsAttr().Get(self.time))
        if len(ids) != len(indices):
            ids = np.arange(len(indices))
        stage = at.source.GetStage()
        for number, target in enumerate(instancer.GetPrototypesRel().GetForwardedTargets()):
            chosen = (indices == number) & shown
            if self.stopped:
                return
            root = stage.GetPrimAtPath(target)
            if not root:
                text = f"prototype {target} is not there"
                prim_finding(self.report, at.source, Kind.MISSING, "instancer-prototype", text)
            elif chosen.any() or varies:
                yield from self._prototype(
                    root, at, Copies(root, local[chosen], ids[chosen], varies), chain
                )

    def _prototype(
        self, root: Usd.Prim, at: Copies, copies: Copies, chain: tuple[Sdf.Path, ...]
    ) -> Iterator[Copies]:
        count = len(copies.ids) * len(at.ids)
        if count > MOST_COPIES:
            text = f"{count} copies of {root.GetPath()}; want {MOST_COPIES} at most; not shown"
            prim_finding(self.report, at.source, Kind.DROPPED, "instancer-limit", text)
            return
        # Every copy inside every copy of the instancer itself.
        places = (copies.transforms[None] @ at.transforms[:, None]).reshape(-1, 4, 4)
        ids = (mixed(at.ids)[:, None] + copies.ids).ravel()
        predicate = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsLoaded)
        walk = iter(Usd.PrimRange(root, predicate))
        for source in walk:
            self.visited += 1
            if self.stopped:
                return
            nested = source.IsA(UsdGeom.PointInstancer)
            if nested:
                walk.PruneChildren()
            if not (nested or source.IsA(UsdGeom.Gprim) or is_light(source)):
                continue
            if UsdGeom.Imageable(source).ComputePurpose() not in self.purposes:
                continue
            varies = copies.varies or _varies_within(source, root)
            self.varies |= varies
            if not len(ids) or not _seen_within(source, root, self.time):
                continue
            # IncludeProtoXform has put the root's own transform into the copies.
            inner, _ = self.cache.ComputeRelativeTransform(source, root)
            found = Copies(source, np.array(inner, np.float64) @ places, ids, varies)
            if not nested:
                yield found
            elif source.GetPath() in chain or len(chain) >= _DEEPEST:
                text = f"a PointInstancer in itself, or more than {_DEEPEST} deep, is not shown"
                prim_finding(self.report, source, Kind.DROPPED, "instancer-content", text)
            else:
                yield from self.inside(found, (*chain, source.GetPath()))

    def _matrices(self, instancer: UsdGeom.PointInstancer, indices: Ids) -> Matrices | None:
        computed = instancer.ComputeInstanceTransformsAtTime(
            self.time,
            self.time,
            UsdGeom.PointInstancer.IncludeProtoXform,
            UsdGeom.PointInstancer.IgnoreMask,
        )
        matrices = np.asarray(computed, np.float64).reshape(-1, 4, 4)
        if len(matrices) == len(indices):
            return matrices
        text = f"{len(indices)} prototype indices, {len(matrices)} positions; not drawn"
        prim_finding(self.report, instancer.GetPrim(), Kind.INVALID, "instancer-arrays", text)
        return None


def mixed(ids: Ids) -> Ids:
    """Numbers spread over 64 bits (the finaliser of SplitMix64), so that sums of them differ."""
    z = ids.astype(np.uint64) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return (z ^ (z >> np.uint64(31))).astype(np.int64)


def _whole_numbers(value: object) -> Ids:
    array = np.asarray(value if value is not None else [])
    return array.astype(np.int64) if array.dtype.kind in "iu" else np.zeros(0, np.int64)


def _arrays_vary(prim: Usd.Prim) -> bool:
    attributes = (prim.GetAttribute(name) for name in _ARRAYS)
    return any(attribute and attribute.ValueMightBeTimeVarying() for attribute in attributes)


def _within(source: Usd.Prim, root: Usd.Prim) -> Iterator[Usd.Prim]:
    """From a prim of a prototype up to the prototype's root."""
    prim = source
    while prim and prim != root:
        yield prim
        prim = prim.GetParent()
    yield root


def _seen_within(source: Usd.Prim, root: Usd.Prim, time: Usd.TimeCode) -> bool:
    """Whether nothing inside the prototype hides it: what holds the prototypes may be hidden."""
    chain = (UsdGeom.Imageable(prim) for prim in _within(source, root))
    return all(not p or p.GetVisibilityAttr().Get(time) != "invisible" for p in chain)


def _varies_within(source: Usd.Prim, root: Usd.Prim) -> bool:
    for prim in _within(source, root):
        imageable, xformable = UsdGeom.Imageable(prim), UsdGeom.Xformable(prim)
        if imageable and imageable.GetVisibilityAttr().ValueMightBeTimeVarying():
            return True
        if xformable and xformable.TransformMightBeTimeVarying():
            return True
    return False
