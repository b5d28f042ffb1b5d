"""A stage at a time becomes a RenderScene; what does not vary is read once.

The stage is walked once into flat lists (gprims, lights); each frame only asks
again for what may have changed: matrices, visibility, points, light inputs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from hdrusd.errors import InputError, SourceRef
from hdrusd.report import Kind, Report
from hdrusd.scene import LIGHT, Camera, Draw, Geometry, RenderScene, light_rows
from hdrusd.units import dome_luminance
from hdrusd.usd.ambient import has_ambient, read_ambient
from hdrusd.usd.bindings import Bindings, Piece
from hdrusd.usd.camera import Conform, framing_camera, read_camera
from hdrusd.usd.facing import facing
from hdrusd.usd.instancer import instancer_content
from hdrusd.usd.light import light_time_varying, read_light_row
from hdrusd.usd.lux import is_light
from hdrusd.usd.mesh import GeometryReader, time_varying

#: The sky and camera light of a stage that has no light of its own, lux each.
DEFAULT_SKY = 1000.0

#: Prims that usdrecord shows and shader 1 has no geometry for.
_NOT_DRAWN = (UsdGeom.Curves, UsdGeom.Points, UsdGeom.NurbsPatch)


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
    matrix: npt.NDArray[np.float64] | None = None  # (k, 4, 4) scene units, where it is kept


@dataclass(slots=True)
class Light:
    """One light prim and its row, kept unless it varies."""

    prim: Usd.Prim
    varies: bool
    hides: bool
    row: npt.NDArray[np.void] | None = None


@dataclass(slots=True)
class _Plan:
    gprims: list[Gprim] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    domes: list[Usd.Prim] = field(default_factory=list)
    instancers: list[Usd.Prim] = field(default_factory=list)
    prototypes: dict[Sdf.Path, Gprim | None] = field(default_factory=dict)
    has_light: bool = False  # any light at all, hidden ones and those we cannot show included


class StageReader:
    """Reads one stage frame by frame.

    ``purposes`` beside "default" that are drawn; ``default_sky``: whether a stage
    without light is shown under ``DEFAULT_SKY``.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        report: Report,
        *,
        purposes: Iterable[str] = ("render",),
        default_sky: bool = True,
    ) -> None:
        self.stage = stage
        self.report = report
        self.unit = _meters_per_unit(stage, report)
        self.purposes = {"default", *purposes}
        self.default_sky = default_sky
        self.bindings = Bindings(stage, report)
        self._plan: _Plan | None = None
        self._cameras: dict[str | None, Usd.Prim | None] = {}
        self._reads = 0
        self._geometries: dict[tuple[str, int], Geometry | None] = {}

    def read(self, time: float, camera: Camera, *, sky_visible: bool = False) -> RenderScene:
        """Everything at a time code, in world metres. ``sky_visible``: seen behind the scene."""
        code = Usd.TimeCode(time)
        cache = UsdGeom.XformCache(code)
        plan = self._planned(code)
        self.bindings.update(code)
        self._reads += 1
        rows = [row for light in plan.lights if (row := self._light(light, cache)) is not None]
        for instancer in plan.instancers:
            rows.extend(self._instanced_lights(instancer, cache, code))
        lights = np.concatenate(rows) if rows else np.zeros(0, LIGHT)
        ambient = read_ambient(self.stage, plan.domes, code, self.report)
        if self.default_sky and not plan.has_light:
            lights, ambient = _default_light(camera), (DEFAULT_SKY,) * 3
            self._finding(
                Kind.ASSUMED,
                "default-sky",
                f"no light: shown under {DEFAULT_SKY:g} lx of sky "
                f"and {DEFAULT_SKY:g} lx from the camera; --disableCameraLight leaves it dark",
            )
        draws = list(self._all_draws(cache, code))
        if not draws and not plan.gprims and not sky_visible:
            raise InputError(
                self._place(), "nothing to draw; want meshes or shapes of a purpose that is drawn"
            )
        if camera.framing:  # nobody chose the side from which it is seen
            draws = [replace(draw, double_sided=True) for draw in draws]
        return RenderScene(
            lights=lights,
            draws=tuple(_merge(draws)),
            materials=tuple(self.bindings.materials),
            ambient=ambient,
            background=_sky_luminance(ambient) if sky_visible else (0.0, 0.0, 0.0),
            camera=camera,
            time=time,
        )

    def camera(
        self, path: str | None, time: float, aspect: float, conform: Conform = "expandAperture"
    ) -> Camera:
        """The camera at ``path``; without one the stage's first, or one that frames the stage."""
        prim = self.camera_prim(path)
        code = Usd.TimeCode(time)
        if prim is None:
            box = UsdGeom.BBoxCache(code, sorted(self.purposes), useExtentsHint=True)
            bounds = box.ComputeWorldBound(self.stage.GetPseudoRoot()).ComputeAlignedRange()
            if bounds.IsEmpty():
                return Camera()
            low, high = np.array(bounds.GetMin()), np.array(bounds.GetMax())
            up = str(UsdGeom.GetStageUpAxis(self.stage))
            front = facing(self._all_draws(UsdGeom.XformCache(code), code))
            return framing_camera(low * self.unit, high * self.unit, up, aspect, front)
        world = UsdGeom.XformCache(code).GetLocalToWorldTransform(prim)
        return read_camera(
            prim, code, world, meters_per_unit=self.unit, aspect=aspect, conform=conform
        )

    def camera_prim(self, path: str | None) -> Usd.Prim | None:
        """The camera prim by path, by its name or its node's; the stage's first for None.

        Raises InputError when it is named and not there.
        """
        if path in self._cameras:
            return self._cameras[path]
        cameras = [
            prim
            for prim in Usd.PrimRange(self.stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
            if prim.IsA(UsdGeom.Camera)
        ]
        if path is None:
            self._cameras[path] = cameras[0] if cameras else None
            return self._cameras[path]
        for prim in cameras:
            if path in (str(prim.GetPath()), prim.GetName(), prim.GetParent().GetName()):
                self._cameras[path] = prim
                return prim
        known = ", ".join(str(prim.GetPath()) for prim in cameras) or "none"
        raise InputError(self._place(), f"{path}: no such camera; the stage has {known}")

    # -- walking the stage ---------------------------------------------------------------

    def _planned(self, code: Usd.TimeCode) -> _Plan:
        if self._plan is None:
            self._plan = self._walk(code)
        return self._plan

    def _walk(self, code: Usd.TimeCode) -> _Plan:
        plan = _Plan(has_light=has_ambient(self.stage))
        everything = Usd.PrimRange(self.stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
        plan.has_light |= any(is_light(prim) for prim in everything)
        walk = iter(Usd.PrimRange(self.stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()))
        for prim in walk:
            if not self._wanted(prim):
                walk.PruneChildren()
            elif prim.IsA(UsdGeom.PointInstancer):
                plan.instancers.append(prim)
                walk.PruneChildren()
            elif is_light(prim):
                self._plan_light(plan, prim)
            elif prim.IsA(UsdGeom.Gprim):
                gprim = self._plan_gprim(prim, code)
                if gprim is not None:
                    plan.gprims.append(gprim)
        return plan

    def _wanted(self, prim: Usd.Prim) -> bool:
        """False prunes: hidden for good, or of a purpose that was not asked for."""
        imageable = UsdGeom.Imageable(prim)
        if not imageable:
            return True
        visibility = imageable.GetVisibilityAttr()
        if not visibility.ValueMightBeTimeVarying() and visibility.Get() == "invisible":
            return False
        purpose = imageable.GetPurposeAttr().Get()
        return purpose in (None, "default") or purpose in self.purposes

    def _plan_light(self, plan: _Plan, prim: Usd.Prim) -> None:
        if prim.IsA(UsdLux.DomeLight) or prim.IsA(UsdLux.DomeLight_1):
            plan.domes.append(prim)
        elif prim.IsA(UsdLux.NonboundableLightBase) or prim.IsA(UsdLux.BoundableLightBase):
            varies = light_time_varying(prim) or _place_varies(prim)
            plan.lights.append(Light(prim, varies, _hides(prim)))
        else:
            self._finding(
                Kind.DROPPED, "light-unknown", f"{prim.GetTypeName()} light is not shown", prim
            )

    def _plan_gprim(self, prim: Usd.Prim, code: Usd.TimeCode) -> Gprim | None:
        if any(prim.IsA(kind) for kind in _NOT_DRAWN):
            self._finding(Kind.DROPPED, "gprim-unknown", f"{prim.GetTypeName()} is not drawn", prim)
            return None
        shared = prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim
        return Gprim(
            prim=prim,
            key=str(shared.GetPath()),
            pieces=self.bindings.pieces(prim, code),
            double_sided=_double_sided(prim),
            shape_varies=time_varying(prim),
            place_varies=_place_varies(prim),
            hides=_hides(prim),
        )

    # -- one frame -----------------------------------------------------------------------

    def _light(self, light: Light, cache: UsdGeom.XformCache) -> npt.NDArray[np.void] | None:
        if light.hides and not _visible(light.prim, cache.GetTime()):
            return None
        if light.row is None or light.varies:
            world = cache.GetLocalToWorldTransform(light.prim)
            row = read_light_row(light.prim, cache.GetTime(), world, self.unit, self.report)
            if row is None or not _sound(row):
                self._finding(
                    Kind.INVALID, "light-invalid", "not finite or negative; left out", light.prim
                )
                return None
            light.row = row
        return light.row

    def _instanced_lights(
        self, prim: Usd.Prim, cache: UsdGeom.XformCache, code: Usd.TimeCode
    ) -> Iterator[npt.NDArray[np.void]]:
        if not _visible(prim, code):
            return
        world = np.array(cache.GetLocalToWorldTransform(prim), np.float64)
        for source, copies in instancer_content(prim, code, self.purposes, self.report):
            if not is_light(source):
                continue
            for matrix in copies @ world:
                place = Gf.Matrix4d(matrix)
                row = read_light_row(source, code, place, self.unit, self.report)
                if row is not None and _sound(row):
                    yield row
                else:
                    text = "not finite, negative or no lamp; left out"
                    self._finding(Kind.INVALID, "light-invalid", text, source)

    def _all_draws(self, cache: UsdGeom.XformCache, code: Usd.TimeCode) -> Iterator[Draw]:
        plan = self._planned(code)
        for gprim in plan.gprims:
            yield from self._draws(gprim, cache, code)
        for prim in plan.instancers:
            if _visible(prim, code):
                yield from self._instanced(prim, cache, code)

    def _draws(self, gprim: Gprim, cache: UsdGeom.XformCache, code: Usd.TimeCode) -> Iterable[Draw]:
        if gprim.hides and not _visible(gprim.prim, code):
            return
        if gprim.matrix is None or gprim.place_varies:
            gprim.matrix = self._to_metres(cache.GetLocalToWorldTransform(gprim.prim))[None]
        self._read_geometry(gprim, code)
        for piece in gprim.pieces:
            if piece.geometry is not None:
                yield Draw(piece.geometry, piece.material, gprim.matrix, gprim.double_sided)

    def _read_geometry(self, gprim: Gprim, code: Usd.TimeCode) -> None:
        version = self._reads if gprim.shape_varies else 0
        reader: GeometryReader | None = None
        for index, piece in enumerate(gprim.pieces):
            if piece.geometry is not None and piece.geometry.version == version:
                continue
            material = self.bindings.materials[piece.material]
            key = f"{gprim.key}#{index}:{material.vertex_color}:{','.join(material.uv_sets())}"
            known = self._geometries.get((key, version))
            if known is None and (key, version) not in self._geometries:
                reader = reader or GeometryReader(gprim.prim, code, self.report)
                known = reader.cut(
                    key, piece.faces, material.uv_sets(), material.vertex_color, version
                )
                if not gprim.shape_varies:
                    self._geometries[key, version] = known
            piece.geometry = known

    def _instanced(
        self, prim: Usd.Prim, cache: UsdGeom.XformCache, code: Usd.TimeCode
    ) -> Iterable[Draw]:
        world = cache.GetLocalToWorldTransform(prim)
        for source, copies in instancer_content(prim, code, self.purposes, self.report):
            gprim = None if is_light(source) else self._prototype(source, code)
            if gprim is None:
                continue
            self._read_geometry(gprim, code)
            matrices = copies @ self._to_metres(world)
            for piece in gprim.pieces:
                if piece.geometry is not None:
                    yield Draw(piece.geometry, piece.material, matrices, gprim.double_sided)

    def _prototype(self, prim: Usd.Prim, code: Usd.TimeCode) -> Gprim | None:
        assert self._plan is not None
        known = self._plan.prototypes
        if prim.GetPath() not in known:
            known[prim.GetPath()] = self._plan_gprim(prim, code)
        return known[prim.GetPath()]

    def _to_metres(self, matrix: Gf.Matrix4d) -> npt.NDArray[np.float64]:
        result = np.array(matrix, np.float64)
        result[:, :3] *= self.unit
        return result

    def _place(self) -> SourceRef:
        return SourceRef(Path(self.stage.GetRootLayer().identifier))

    def _finding(self, kind: Kind, code: str, text: str, prim: Usd.Prim | None = None) -> None:
        thing = str(prim.GetPath()) if prim else ""
        self.report.add(kind, code, self._place(), thing, text)


def _merge(draws: list[Draw]) -> Iterable[Draw]:
    """One draw for all places of a geometry in one material: instances are drawn at once."""
    groups: dict[tuple[str, int, int, bool], list[Draw]] = {}
    for draw in draws:
        key = (draw.geometry.key, draw.geometry.version, draw.material, draw.double_sided)
        groups.setdefault(key, []).append(draw)
    for group in groups.values():
        if len(group) == 1:
            yield group[0]
        else:
            yield replace(group[0], transforms=np.concatenate([d.transforms for d in group]))


def _default_light(camera: Camera) -> npt.NDArray[np.void]:
    row = light_rows(1)
    row["position"], row["axis"] = camera.back, -np.asarray(camera.back)
    row["intensity"], row["w"], row["shadow"] = DEFAULT_SKY, 0.0, 0
    return row


def _sky_luminance(ambient: tuple[float, float, float]) -> tuple[float, float, float]:
    r, g, b = (dome_luminance(lux) for lux in ambient)
    return r, g, b


def _visible(prim: Usd.Prim, code: Usd.TimeCode) -> bool:
    return bool(UsdGeom.Imageable(prim).ComputeVisibility(code) != UsdGeom.Tokens.invisible)


def _sound(row: npt.NDArray[np.void]) -> bool:
    """Whether a light's numbers are numbers, and give light rather than take it."""
    finite = all(np.isfinite(row[name]).all() for name in LIGHT.fields or ())
    return finite and bool((row["intensity"] >= 0.0).all())


def _double_sided(prim: Usd.Prim) -> bool:
    """False only where somebody said so: usdrecord shows both sides of what says nothing."""
    attribute = UsdGeom.Gprim(prim).GetDoubleSidedAttr()
    return bool(attribute.Get()) if attribute.HasAuthoredValue() else True


def _hides(prim: Usd.Prim) -> bool:
    """Whether the visibility of the prim or of one above it may change in time."""
    while prim and not prim.IsPseudoRoot():
        imageable = UsdGeom.Imageable(prim)
        if imageable and imageable.GetVisibilityAttr().ValueMightBeTimeVarying():
            return True
        prim = prim.GetParent()
    return False


def _place_varies(prim: Usd.Prim) -> bool:
    """Whether any transform from the prim up to the root may change in time."""
    while prim and not prim.IsPseudoRoot():
        xformable = UsdGeom.Xformable(prim)
        if xformable and xformable.TransformMightBeTimeVarying():
            return True
        prim = prim.GetParent()
    return False


def _meters_per_unit(stage: Usd.Stage, report: Report) -> float:
    unit = float(UsdGeom.GetStageMetersPerUnit(stage))
    place = SourceRef(Path(stage.GetRootLayer().identifier))
    if not UsdGeom.StageHasAuthoredMetersPerUnit(stage):
        report.add(
            Kind.ASSUMED,
            "no-units",
            place,
            "",
            "no metersPerUnit; USD's 0.01 (centimetres) is used",
        )
    if not (unit > 0.0 and np.isfinite(unit)):
        raise InputError(place, f"metersPerUnit {unit}; want a positive number")
    return unit
