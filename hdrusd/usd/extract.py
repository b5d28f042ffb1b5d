"""A stage at a time becomes a RenderScene; what does not vary is read once.

The stage is walked once into flat lists (gprims, lights); each frame only asks
again for what may have changed: matrices, visibility, points, light inputs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt
from pxr import Usd, UsdGeom, UsdLux

from hdrusd.errors import InputError
from hdrusd.report import Kind, Report
from hdrusd.scene import RECT, Camera, RenderScene, light_rows
from hdrusd.units import TEXTURE_GAMMA, dome_luminance
from hdrusd.usd.ambient import has_ambient, read_ambient
from hdrusd.usd.bindings import Bindings
from hdrusd.usd.camera import Conform, framing_camera, read_camera
from hdrusd.usd.emitters import Emitters, beamed_balls
from hdrusd.usd.facing import facing
from hdrusd.usd.findings import place_of, prim_finding
from hdrusd.usd.gprims import GprimReader
from hdrusd.usd.instanced_lights import instanced_rows, joined, moved_row
from hdrusd.usd.instancer import Copies, Instancers
from hdrusd.usd.light import light_time_varying, read_light_row
from hdrusd.usd.light_bounds import sound
from hdrusd.usd.light_texture import LightTextures
from hdrusd.usd.linking import Links
from hdrusd.usd.lux import is_light, light_kind
from hdrusd.usd.mesh_light import MeshLight, is_mesh_light
from hdrusd.usd.profile import Profiles
from hdrusd.usd.varying import hides, place_varies, visible

#: The sky and camera light of a stage that has no light of its own, lux each.
DEFAULT_SKY = 1000.0


@dataclass(slots=True)
class Light:
    """One light prim and its row, kept unless it varies."""

    prim: Usd.Prim
    varies: bool  # its inputs may change in time
    moves: bool  # its place may
    hides: bool
    row: npt.NDArray[np.void] | None = None
    place: npt.NDArray[np.float64] | None = None  # (4, 4) local to world where it was read


@dataclass(slots=True)
class _Plan:
    lights: list[Light] = field(default_factory=list)
    meshes: list[MeshLight] = field(default_factory=list)
    domes: list[Usd.Prim] = field(default_factory=list)
    has_light: bool = False  # any light at all, hidden ones and those we cannot show included


class StageReader:
    """Reads one stage frame by frame.

    ``purposes`` beside "default" that are drawn; ``default_sky``: whether a stage
    without light is shown under ``DEFAULT_SKY``; ``level``: refinements of subdivision
    cages and curves; ``gamma``: of 8-bit pictures on lights.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        report: Report,
        *,
        purposes: Iterable[str] = ("render",),
        default_sky: bool = True,
        level: int = 0,
        gamma: float = TEXTURE_GAMMA,
    ) -> None:
        self.stage = stage
        self.report = report
        self.unit = _meters_per_unit(stage, report)
        self.purposes = {"default", *purposes}
        self.default_sky = default_sky
        self.bindings = Bindings(stage, report)
        self.instancers = Instancers(stage, self.purposes, report)
        self.profiles = Profiles(stage, report)
        self.links = Links(stage, report)
        self.textures = LightTextures(stage, report, gamma=gamma)
        self.emitters = Emitters()
        self.gprims = GprimReader(
            self.bindings,
            self.instancers,
            report,
            meters_per_unit=self.unit,
            level=level,
            links=self.links,
        )
        self._lamps: WeakKeyDictionary[Copies, npt.NDArray[np.void]] = WeakKeyDictionary()
        self._plan: _Plan | None = None
        self._cameras: dict[str | None, Usd.Prim | None] = {}

    def read(self, time: float, camera: Camera, *, sky_visible: bool = False) -> RenderScene:
        """Everything at a time code, in world metres. ``sky_visible``: seen behind the scene."""
        code = Usd.TimeCode(time)
        cache = UsdGeom.XformCache(code)
        plan = self._planned(code)
        self.bindings.update(code)
        self.emitters.clear()
        lights = joined([*self._lights(plan, cache), *self._instanced_lights(code)])
        ambient, skies = read_ambient(
            self.stage, plan.domes, cache, self.report, sky_visible=sky_visible
        )
        if self.default_sky and not plan.has_light:
            lights, ambient = _default_light(camera), (DEFAULT_SKY,) * 3
            prim_finding(
                self.report,
                self.stage.GetPseudoRoot(),
                Kind.ASSUMED,
                "default-sky",
                f"no light: shown under {DEFAULT_SKY:g} lx of sky "
                f"and {DEFAULT_SKY:g} lx from the camera; --disableCameraLight leaves it dark",
            )
        # Nobody chose the side from which a framing camera sees it.
        draws = self.gprims.draws(cache, code, two_sided=camera.framing)
        lamps, glows = self.emitters.draws(len(self.bindings.materials), self.profiles.all)
        if not draws and not self.gprims and not lamps and not sky_visible:
            raise InputError(
                place_of(self.stage),
                "nothing to draw; want meshes or shapes of a purpose that is drawn",
            )
        return RenderScene(
            lights=lights,
            profiles=self.profiles.all,
            draws=draws + lamps,
            materials=(*self.bindings.materials, *glows),
            skies=skies,
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
            self._planned(code)
            front = facing(self.gprims.draws(UsdGeom.XformCache(code), code))
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
        raise InputError(place_of(self.stage), f"{path}: no such camera; the stage has {known}")

    # -- walking the stage ---------------------------------------------------------------

    def _planned(self, code: Usd.TimeCode) -> _Plan:
        if self._plan is None:
            self._plan = self._walk(code)
        return self._plan

    def _walk(self, code: Usd.TimeCode) -> _Plan:
        plan = _Plan(has_light=has_ambient(self.stage))
        everything = Usd.PrimRange(self.stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
        for prim in filter(is_light, everything):
            plan.has_light = True
            self.links.note(prim)
        walk = iter(Usd.PrimRange(self.stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()))
        for prim in walk:
            if not self._wanted(prim):
                walk.PruneChildren()
            elif prim.IsA(UsdGeom.PointInstancer):
                self.instancers.add(prim)
                walk.PruneChildren()
            elif is_light(prim):
                self._plan_light(plan, prim)
            elif prim.IsA(UsdGeom.Gprim):
                self.gprims.add(prim, code)
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
        elif light_kind(prim) != "other":
            plan.lights.append(
                Light(prim, light_time_varying(prim), place_varies(prim), hides(prim))
            )
        elif is_mesh_light(prim):
            plan.meshes.append(MeshLight(prim, self.bindings, self.unit, self.report))
        else:
            text = f"{prim.GetTypeName()} light is not shown"
            prim_finding(self.report, prim, Kind.DROPPED, "light-unknown", text)

    # -- one frame -----------------------------------------------------------------------

    def _lights(self, plan: _Plan, cache: UsdGeom.XformCache) -> Iterator[npt.NDArray[np.void]]:
        """The rows of every light that is not copied, and what of them is seen."""
        code = cache.GetTime()
        found = [(light, self._light(light, cache)) for light in plan.lights]
        lit = [(light, row) for light, row in found if row is not None]
        # All at once: one by one it takes as long as reading them. What only moved is sound.
        good = sound(joined([row for _, row in lit]))
        for (light, row), fine in zip(lit, good.tolist(), strict=True):
            if row is light.row and not fine:
                self._note_unsound(light)
                light.row = None
                continue
            moving = light.varies or light.moves or light.hides
            yield self._shown(light.prim, row, code, moving=moving)
        for mesh in plan.meshes:
            if visible(mesh.prim, code):
                rows = mesh.rows(cache)
                if not sound(rows).all() or not len(rows):
                    text = "not finite, negative, too large or without area; left out"
                    prim_finding(self.report, mesh.prim, Kind.INVALID, "light-invalid", text)
                    continue
                self.links.assign(mesh.prim, rows)
                sp = float(rows["sp"][0])
                self.emitters.show_mesh(
                    mesh.draws(cache), mesh.luminance, sp=sp, moving=mesh.moving
                )
                yield rows

    def _shown(
        self, prim: Usd.Prim, rows: npt.NDArray[np.void], code: Usd.TimeCode, *, moving: bool
    ) -> npt.NDArray[np.void]:
        """Rows as they shine, in tiles where a picture lies on them; notes what is seen."""
        if beamed_balls(rows).any():
            text = "a ball with a cone, focus or photometric file shines and is not seen"
            prim_finding(self.report, prim, Kind.DROPPED, "light-not-seen", text)
        picture = self.textures.of(prim, code) if (rows["shape"] == RECT).all() else None
        if picture is None:
            self.emitters.show(rows, moving=moving)
            return rows
        self.emitters.show(rows, picture.texture, moving=moving)
        return picture.tiles(rows)

    def _light(self, light: Light, cache: UsdGeom.XformCache) -> npt.NDArray[np.void] | None:
        """The row of a light, if it shines at all; whether one just read is sound is not asked."""
        if light.hides and not visible(light.prim, cache.GetTime()):
            return None
        if light.row is None or light.varies or light.moves:
            world = cache.GetLocalToWorldTransform(light.prim)
            matrix = np.array(world, np.float64)
            if light.row is not None and light.place is not None and not light.varies:
                moved = moved_row(light.row, light.place, matrix, self.unit)
                if moved is not None:
                    return moved
            row = read_light_row(light.prim, cache.GetTime(), world, self.unit, self.report)
            if row is not None:
                self.profiles.assign(light.prim, row, cache.GetTime())
                self.links.assign(light.prim, row)
            if row is None:
                self._note_unsound(light)
                return None
            light.row, light.place = row, matrix
        return light.row

    def _note_unsound(self, light: Light) -> None:
        text = "not finite, negative or too large; left out"
        prim_finding(self.report, light.prim, Kind.INVALID, "light-invalid", text)

    def _instanced_lights(self, code: Usd.TimeCode) -> Iterator[npt.NDArray[np.void]]:
        for copies in self.instancers.copies(code):
            if not is_light(copies.source):
                continue
            known = self._lamps.get(copies)
            if known is None or light_time_varying(copies.source):
                rows = instanced_rows(copies, code, self.unit, self.report)
                self.profiles.assign(copies.source, rows, code)
                self.links.assign(copies.source, rows)
                good = sound(rows)
                if not good.all() or not len(rows):
                    text = "not finite, negative, too large or no lamp; left out"
                    prim_finding(self.report, copies.source, Kind.INVALID, "light-invalid", text)
                known = self._lamps[copies] = rows[good]
            varies = copies.varies or light_time_varying(copies.source)
            yield self._shown(copies.source, known, code, moving=varies)


def _default_light(camera: Camera) -> npt.NDArray[np.void]:
    row = light_rows(1)
    row["position"], row["axis"] = camera.back, -np.asarray(camera.back)
    row["intensity"], row["w"], row["shadow"] = DEFAULT_SKY, 0.0, 0
    return row


def _sky_luminance(ambient: tuple[float, float, float]) -> tuple[float, float, float]:
    r, g, b = (dome_luminance(lux) for lux in ambient)
    return r, g, b


def _meters_per_unit(stage: Usd.Stage, report: Report) -> float:
    unit = float(UsdGeom.GetStageMetersPerUnit(stage))
    place = place_of(stage)
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
