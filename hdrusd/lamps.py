"""What legacy lights become: their photometry, their luminaires, their fixtures, the sky."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from pxr import Sdf, UsdLux

from hdrusd.account.lights import light_row
from hdrusd.errors import SourceRef
from hdrusd.legacy import scene as legacy
from hdrusd.luminaires import LuminaireFiles
from hdrusd.photometry.interpret import Interpreter, LuminaireFile, luminance, rule_color
from hdrusd.photometry.light import PhotometricLight, chromaticity
from hdrusd.photometry.sidecar import Rule, Sidecar
from hdrusd.photometry.spread import SHAPES
from hdrusd.report import Kind, Report
from hdrusd.skies import Sky, SkyFiles, even_sky
from hdrusd.usd.fixtures import Lamp
from hdrusd.usd.placed import is_shown, level_share
from hdrusd.usd.preset_sky import write_sky_dome, write_sky_sun
from hdrusd.usd.transform import across
from hdrusd.usd.tree import Place
from hdrusd.usd.writer import LightAt, StageWriter


@dataclass(frozen=True, slots=True)
class _Lamp:
    """A light of the source, ready to be written."""

    place: Place
    source: legacy.Light
    light: PhotometricLight
    path: Sdf.Path | None
    right: legacy.Vec3 | None = None  # where C = 0 of its photometric file points
    flux: float | None = None  # lm of its photometric file
    shaded: bool = False  # by its own fixture too
    added: bool = False  # the source says nothing of it

    def row(self, path: str, places: int) -> dict[str, Any]:
        """The account of it for the report. ``places``: at which it stands, instances too."""
        return light_row(
            self.source.name,
            path,
            self.light,
            None if self.added else self.source,
            place=str(self.place.node.source),
            node=self.place.node.name,
            places=places,
            file_flux=self.flux,
        )


class LampMaker:
    """Writes the lights of one scene; ``rows`` is the account of them for the report."""

    def __init__(
        self,
        scene: legacy.LegacyScene,
        sidecar: Sidecar,
        interpreter: Interpreter,
        luminaires: LuminaireFiles,
        skies: SkyFiles,
        writer: StageWriter,
        report: Report,
        added: Mapping[int, Rule],
    ) -> None:
        self.scene = scene
        self.sidecar = sidecar
        self.added = added  # the rules of lamps that the database lacked, by their lights
        self.interpreter = interpreter
        self.luminaires = luminaires
        self.skies = skies
        self.writer = writer
        self.report = report
        self.rows: list[dict[str, Any]] = []
        self.fixed: list[tuple[_Lamp, Lamp]] = []
        self._standing: list[tuple[dict[str, Any], list[Sdf.Path]]] = []  # where the rows' lamps do

    def write(self) -> None:
        """Every light of the scene, at its places, and the sky."""
        ambients: list[PhotometricLight] = []
        lamps: list[_Lamp] = []
        lit = [place for place in self.writer.places if place.node.lights]
        for place, metres in zip(lit, self.writer.metres_at(lit), strict=True):
            for index in place.node.lights:
                light = self.scene.lights[index]
                local = light.kind != "ambient"
                path = self.writer.light_path(place, light) if local else None
                rule = self.added.get(index)
                if rule is None:
                    names = light.name, place.node.name
                    rule = self.sidecar.match("light", *names, path=str(path or ""))
                if light.kind == "ambient" and self.sidecar.ambient is not None:
                    text = f"{self.sidecar.ambient.place} says the sky; not added to it"
                    self.report.add(
                        Kind.REPLACED, "ambient-replaced", light.source, light.name, text
                    )
                    continue
                file = self._luminaire(light, rule)
                meaning = self.interpreter.light(light, rule, file, metres=metres)
                if meaning is not None and meaning.kind == "ambient":
                    ambients.append(meaning)
                elif meaning is not None:
                    shaded = rule is not None and bool(rule.values.get("fixture_shadow"))
                    added = index in self.added
                    lamp = _Lamp(place, light, meaning, path, shaded=shaded, added=added)
                    if rule is not None and file is not None:
                        lamp = self._aimed(lamp, rule, file)
                    elif rule is not None:
                        lamp = self._shaped(lamp, rule)
                    lamps.append(lamp)
        at = [LightAt(it.place, it.source, it.light, it.right, it.path) for it in lamps]
        places = self.writer.tree.copies.places
        for lamp, prim in zip(lamps, self.writer.write_lights(at), strict=True):
            stands = places(prim.GetPath())
            self.rows.append(lamp.row(str(prim.GetPath()), len(stands)))
            self._standing.append((self.rows[-1], stands))
            one = lamp.source.positions is None
            if lamp.light.kind in ("point", "spot") and one and not lamp.shaded:
                self.fixed.append((lamp, Lamp(prim, lamp.light)))
        sky = self._sky(ambients)
        if sky is not None:
            self._write_sky(sky)

    def count_shown(self) -> None:
        """What the selected states show of each row, when nodes have been shown and hidden."""
        find = self.writer.stage.GetPrimAtPath
        for row, paths in self._standing:
            stands = [find(path) for path in paths]
            shown = [prim for prim in stands if is_shown(prim)]
            row["lamps_shown"] = row["lamps"] * len(shown) // len(stands)
            if row["kind"] == "distant":
                row["level_lux"] = row["value"] * level_share(shown or stands)

    def _luminaire(self, light: legacy.Light, rule: Rule | None) -> LuminaireFile | None:
        """The photometric file that a rule gives to a light with a place."""
        if rule is None or "ies" not in rule.values or light.kind not in ("point", "spot"):
            return None
        return self.luminaires.use(rule)

    def _aimed(self, lamp: _Lamp, rule: Rule, file: LuminaireFile) -> _Lamp:
        """The lamp with its luminaire's axis and C = 0 where the rule has them."""

        def note(kind: Kind, text: str) -> None:
            self.report.add(kind, "profile-aim", rule.place, lamp.source.name, text)

        axis, right = rule.three("axis"), rule.three("c0")
        if axis is None and lamp.source.kind == "point":
            note(Kind.ASSUMED, f"gamma = 0 points along {_way(lamp.source)}; axis says otherwise")
        source = lamp.source
        if axis is not None:
            source = replace(source, direction=axis, directions=None)
        if right is None and not file.symmetric:
            note(Kind.ASSUMED, "C = 0 points as the shortest turn leaves +X; c0 says otherwise")
        elif right is not None and across(right, source.direction) is None:
            note(Kind.INVALID, "c0 lies along the axis; not used")
        flux = lamp.light.intensity * file.luminaire.flux()
        return replace(lamp, source=source, right=right, flux=flux)

    def _shaped(self, lamp: _Lamp, rule: Rule) -> _Lamp:
        """The lamp as it is aimed where its entry's ``spread`` gives it a half space."""
        beam = SHAPES.get(rule.values.get("spread", "sphere"))
        if lamp.source.kind != "point" or beam is None:
            return lamp
        axis = rule.three("axis")
        if axis is None:
            text = f"shines into the half space along {_way(lamp.source)}; axis says otherwise"
            self.report.add(Kind.ASSUMED, "light-aim", rule.place, lamp.source.name, text)
            return lamp
        return replace(lamp, source=replace(lamp.source, direction=axis, directions=None))

    def _sky(self, from_lights: list[PhotometricLight]) -> Sky | None:
        """The photometry file's sky, else the sum of what the source calls ambient."""
        rule = self.sidecar.ambient
        if rule is not None:
            color = rule_color(rule, temperature_rgb)
            if "preset" in rule.values:
                return self.skies.make(rule, color)
            return even_sky(rule, color)
        ambient = self._ambient(from_lights)
        return None if ambient is None else Sky(ambient)

    def _write_sky(self, sky: Sky) -> None:
        if sky.picture:
            path = self.writer.photometry_path("Sky")
            write_sky_dome(self.writer.stage, path, sky.light, sky.picture)
        else:
            path = self.writer.write_ambient(sky.light).GetPath()
        self.rows.append(light_row("Sky", str(path), sky.light))
        if sky.sun is None:
            return
        assert self.sidecar.ambient is not None
        others = [row["name"] for row in self.rows if row["kind"] == "distant"]
        for name in others:
            text = f"shines from a direction, beside the sky's own {sky.body.lower()}; "
            text += "enabled = false switches it off"
            self.report.add(Kind.ASSUMED, "sky-two-suns", self.sidecar.ambient.place, name, text)
        path = self.writer.photometry_path(sky.body)
        write_sky_sun(self.writer.stage, path, sky.sun, sky.towards)
        self.rows.append(light_row(sky.body, str(path), sky.sun, level=max(sky.towards[1], 0.0)))

    def _ambient(self, from_lights: list[PhotometricLight]) -> PhotometricLight | None:
        """The sum of what the source calls ambient."""
        if self.scene.ambient is not None and luminance(self.scene.ambient) > 0.0:
            estimate = self.interpreter.estimate
            color, strength = chromaticity(estimate.lux(self.scene.ambient))
            self.report.add(
                Kind.GUESSED,
                "ambient-estimate",
                SourceRef(self.scene.source),
                "light model",
                f"{strength:.4g} lx of sky by rule {estimate.name}; the source has no unit",
            )
            from_lights = [
                *from_lights,
                PhotometricLight("ambient", strength, color, rule=estimate.name),
            ]
        if not from_lights:
            return None
        r, g, b = (
            sum(light.intensity * light.chromaticity[i] for light in from_lights) for i in range(3)
        )
        color, strength = chromaticity((r, g, b))
        return replace(from_lights[0], intensity=strength, chromaticity=color)

    def free(self) -> None:
        """Lamps inside their own fixtures shine out of them."""
        self.writer.free_lamps([it for _, it in self.fixed])
        for lamp, it in self.fixed:

            def note(code: str, text: str, source: legacy.Light = lamp.source) -> None:
                self.report.add(Kind.ASSUMED, code, source.source, source.name, text)

            for mesh in it.fixtures:
                note("fixture-shadow", f"stands inside {mesh.path}, its fixture: no shadow of it")
            if it.too_large is not None:
                note(
                    "fixture-large",
                    f"held by {it.too_large.path}, which is too large to be its fixture and "
                    "shades it; want a mesh of the fixture alone",
                )
            if not it.looked_at:
                note("fixture-search", "too much about it to look for its fixture")


def _way(light: legacy.Light) -> str:
    x, y, z = light.direction
    return f"({x:g}, {y:g}, {z:g}) of its node"


def temperature_rgb(kelvin: float) -> legacy.RGB:
    """USD's own blackbody colour, luminance 1; its range is 1000 to 10000 K."""
    r, g, b = UsdLux.BlackbodyTemperatureAsRgb(min(max(kelvin, 1000.0), 10_000.0))
    return chromaticity((r, g, b))[0]
