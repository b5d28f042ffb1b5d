"""The geometry of a stage: every gprim, and copy of one, as draws at a time.

What does not vary is read once and handed out again as the same objects, so that the GPU
keeps what it has; what varies is read anew at each time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd, UsdGeom

from hdrusd.report import Report
from hdrusd.scene import Draw, Geometry
from hdrusd.usd.bindings import Bindings, Piece
from hdrusd.usd.geometry import GeometryReader, time_varying
from hdrusd.usd.instancer import Instancers
from hdrusd.usd.linking import Links
from hdrusd.usd.lux import is_light
from hdrusd.usd.mesh import Topology, topology_varies
from hdrusd.usd.skel import Skin, Skins
from hdrusd.usd.varying import hides, place_varies, visible


@dataclass(slots=True)
class Gprim:
    """One gprim (or instance of one) and what may vary of it."""

    prim: Usd.Prim
    key: str  # of the geometry: instances share their prototype's
    pieces: list[Piece]
    double_sided: bool
    shape_varies: bool
    place_varies: bool
    hides: bool  # its visibility may change in time
    skin: Skin | None  # what deforms it
    topology_varies: bool
    topology: Topology | None = None  # of the last time

    @property
    def moving(self) -> bool:
        """Whether one frame may show it otherwise than another."""
        return self.shape_varies or self.place_varies or self.hides

    @property
    def moving_inside(self) -> bool:
        """The same, wherever the prim as a whole is: as a prototype of an instancer."""
        return self.shape_varies or (self.skin is not None and self.skin.moves_place)

    def place(self, cache: UsdGeom.XformCache) -> npt.NDArray[np.float64]:
        """(4, 4) from the space of its geometry to the world, row vectors, scene units."""
        if self.skin is not None:
            return self.skin.place(cache)
        return np.array(cache.GetLocalToWorldTransform(self.prim), np.float64)


class GprimReader:
    """The gprims of one stage and what its instancers copy: ``add`` all, then ask for ``draws``."""

    def __init__(
        self,
        bindings: Bindings,
        instancers: Instancers,
        report: Report,
        *,
        meters_per_unit: float,
        level: int = 0,
        links: Links | None = None,
    ) -> None:
        self.report = report
        self.level = level
        self.bindings = bindings
        self.instancers = instancers
        self.links = links
        self._metres = np.array([meters_per_unit] * 3 + [1.0])  # of the columns of a matrix
        self._skins = Skins(report)
        self._gprims: list[Gprim] = []
        self._prototypes: dict[Sdf.Path, Gprim | None] = {}
        self._geometries: dict[str, Geometry | None] = {}  # of what does not vary
        self._moment: dict[str, Geometry | None] = {}  # of what does, at the time last read
        self._time: Usd.TimeCode | None = None
        self._version = 0
        self._still: dict[bool, tuple[Draw, ...]] = {}

    def __bool__(self) -> bool:
        """Whether there is anything that could be drawn at some time."""
        return bool(self._gprims or any(self._prototypes.values()))

    def add(self, prim: Usd.Prim, code: Usd.TimeCode) -> None:
        """Note a gprim of the stage."""
        if (gprim := self._plan(prim, code)) is not None:
            self._gprims.append(gprim)

    def draws(
        self, cache: UsdGeom.XformCache, code: Usd.TimeCode, *, two_sided: bool = False
    ) -> tuple[Draw, ...]:
        """All draws at a time; those that nothing moves are the same objects at every time.

        ``two_sided``: both sides of everything are drawn.
        """
        if code != self._time:
            self._time, self._moment = code, {}
            self._version += 1
        if two_sided not in self._still:
            self._still[two_sided] = self._gather(cache, code, moving=False, two_sided=two_sided)
        moving = self._gather(cache, code, moving=True, two_sided=two_sided)
        return self._still[two_sided] + moving if moving else self._still[two_sided]

    def _gather(
        self, cache: UsdGeom.XformCache, code: Usd.TimeCode, *, moving: bool, two_sided: bool
    ) -> tuple[Draw, ...]:
        draws: list[Draw] = []
        for gprim in self._gprims:
            if gprim.moving == moving and not (gprim.hides and not visible(gprim.prim, code)):
                places = (gprim.place(cache) * self._metres)[None]
                draws += self._draws(gprim, places, code, moving=moving)
        for copies in self.instancers.copies(code):
            shape = None if is_light(copies.source) else self._prototype(copies.source, code)
            if shape is not None and (copies.varies or shape.moving_inside) == moving:
                places = copies.transforms * self._metres
                if shape.skin is not None:  # its geometry is not in the prim's own space
                    own = np.array(cache.GetLocalToWorldTransform(shape.prim), np.float64)
                    places = shape.place(cache) @ np.linalg.pinv(own) @ places
                draws += self._draws(shape, places, code, moving=moving)
        if two_sided:
            draws = [replace(draw, double_sided=True) for draw in draws]
        return tuple(_merge(draws))

    def _plan(self, prim: Usd.Prim, code: Usd.TimeCode) -> Gprim | None:
        skin = self._skins.of(prim)
        # Instances share their prototype's shape, but each may have an animation of its own.
        shared = prim.GetPrimInPrototype() if prim.IsInstanceProxy() and skin is None else prim
        return Gprim(
            prim=prim,
            key=str(shared.GetPath()),
            pieces=self.bindings.pieces(prim, code),
            double_sided=_double_sided(prim),
            shape_varies=time_varying(prim) or (skin is not None and skin.points_vary),
            place_varies=skin.moves_place if skin is not None else place_varies(prim),
            hides=hides(prim),
            skin=skin,
            topology_varies=topology_varies(prim),
        )

    def _draws(
        self,
        gprim: Gprim,
        transforms: npt.NDArray[np.float64],
        code: Usd.TimeCode,
        *,
        moving: bool,
    ) -> Iterator[Draw]:
        """One gprim at all its places, (k, 4, 4) in metres: a draw for each of its materials."""
        self._read_geometry(gprim, code)
        path = gprim.prim.GetPath()
        links, shadow_links = (0, 0) if self.links is None else self.links.bits(path)
        for piece in gprim.pieces:
            if piece.geometry is not None:
                yield Draw(
                    piece.geometry,
                    piece.material,
                    transforms,
                    gprim.double_sided,
                    moving=moving,
                    links=links,
                    shadow_links=shadow_links,
                )

    def _read_geometry(self, gprim: Gprim, code: Usd.TimeCode) -> None:
        known = self._moment if gprim.shape_varies else self._geometries
        version = self._version if gprim.shape_varies else 0
        reader: GeometryReader | None = None
        for index, piece in enumerate(gprim.pieces):
            material = self.bindings.materials[piece.material]
            uv_sets = material.uv_sets()
            key = f"{gprim.key}#{index}:{material.vertex_color}:{','.join(uv_sets)}"
            if key not in known:
                reader = reader or self._reader(gprim, code)
                known[key] = reader.cut(key, piece.faces, uv_sets, material.vertex_color, version)
            piece.geometry = known[key]

    def _reader(self, gprim: Gprim, code: Usd.TimeCode) -> GeometryReader:
        reader = GeometryReader(
            gprim.prim,
            code,
            self.report,
            level=self.level,
            skin=gprim.skin,
            topology=gprim.topology,
        )
        if gprim.shape_varies and not gprim.topology_varies:
            gprim.topology = reader.topology
        return reader

    def _prototype(self, prim: Usd.Prim, code: Usd.TimeCode) -> Gprim | None:
        known = self._prototypes
        if prim.GetPath() not in known:
            known[prim.GetPath()] = self._plan(prim, code)
        return known[prim.GetPath()]


def _merge(draws: list[Draw]) -> Iterable[Draw]:
    """One draw for all places of a geometry in one material: instances are drawn at once."""
    groups: dict[tuple[object, ...], list[Draw]] = {}
    for draw in draws:
        links = draw.links, draw.shadow_links
        key = (id(draw.geometry), draw.material, draw.double_sided, *links, draw.casts)
        groups.setdefault(key, []).append(draw)
    for group in groups.values():
        if len(group) == 1:
            yield group[0]
        else:
            yield replace(group[0], transforms=np.concatenate([d.transforms for d in group]))


def _double_sided(prim: Usd.Prim) -> bool:
    """False only where somebody said so: usdrecord shows both sides of what says nothing."""
    attribute = UsdGeom.Gprim(prim).GetDoubleSidedAttr()
    return bool(attribute.Get()) if attribute.HasAuthoredValue() else True
