"""The lights of a stage that is converted: candela and lux over its UsdLux inputs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pxr import Sdf, Usd, UsdGeom

from hdrusd.account.lights import light_row
from hdrusd.errors import SourceRef
from hdrusd.lamps import temperature_rgb
from hdrusd.legacy import scene as legacy
from hdrusd.luminaires import LuminaireFiles
from hdrusd.photometry.interpret import Interpreter, LuminaireFile, rule_color
from hdrusd.photometry.light import PhotometricLight
from hdrusd.photometry.light_unit import CONSTANTS, LIGHT_UNITS, LightUnit
from hdrusd.photometry.sidecar import Rule, Sidecar
from hdrusd.photometry.spread import OWN, Beam, Emitter, beam_solid_angle
from hdrusd.photometry.strength import STRENGTHS, Stated, note_wrong_unit, stated_candela
from hdrusd.report import Kind, Report
from hdrusd.skies import SkyFiles, even_sky
from hdrusd.usd import ambient, light, light_overs
from hdrusd.usd.findings import first_place
from hdrusd.usd.light_overs import (
    NO_SHAPING,
    SourceLight,
    read_source_light,
    shaping,
    write_light_over,
)
from hdrusd.usd.lux import (
    input_source,
    light_kind,
    normalized,
    photometric_file,
    strength_per_nit,
)
from hdrusd.usd.names import unique
from hdrusd.usd.overs import Overs
from hdrusd.usd.placed import is_shown, level_share
from hdrusd.usd.preset_sky import write_sky_dome, write_sky_sun
from hdrusd.usd.source_stage import source_layer
from hdrusd.usd.transform import uniform_scale

#: Lights that shine by their shape, each way as much as is seen of it.
_EMITTERS: dict[str, Emitter] = {"disk": "face", "rect": "face", "cylinder": "tube"}

#: Keys of a light's rule that turn or free a lamp, which a stage says itself.
_UNUSED = ("axis", "c0", "fixture_shadow")

_EARLIEST = Usd.TimeCode.EarliestTime()


class LightOverlay:
    """Writes lights over those of a stage; ``rows`` is the account of them."""

    def __init__(
        self,
        overs: Overs,
        interpreter: Interpreter,
        sidecar: Sidecar,
        luminaires: LuminaireFiles,
        skies: SkyFiles,
        report: Report,
    ) -> None:
        self.overs = overs
        self.stage = overs.stage
        self.interpreter = interpreter
        self.sidecar = sidecar
        self.luminaires = luminaires
        self.skies = skies
        self.report = report
        self.unit = LIGHT_UNITS[sidecar.light_unit]
        self.file = Path(source_layer(self.stage).realPath)
        self.sky = sidecar.ambient if not ambient.has_ambient(self.stage) else None
        self.rows: list[dict[str, Any]] = []
        self.selected = True  # whether the stage is in the states that are shown
        self._standing: list[tuple[dict[str, Any], list[tuple[Sdf.Path, int]]]] = []
        self._done: set[str] = set()
        self._photometric = 0

    def write(self, prim: Usd.Prim, places: Sequence[Usd.Prim]) -> None:
        """One light, once for every place in the layer."""
        place = str(self.overs.place(prim))
        if place in self._done:
            return
        self._done.add(place)
        names = [prim.GetName(), prim.GetDisplayName(), prim.GetParent().GetName()]
        rule = self.sidecar.match("light", *names, str(first_place(prim)))
        if light_overs.is_photometric(prim):
            self._photometric += 1
            world = UsdGeom.Xformable(places[0]).ComputeLocalToWorldTransform(_EARLIEST)
            metres = uniform_scale(world)[0] * UsdGeom.GetStageMetersPerUnit(self.stage)
            time = _brightest(prim)
            made = light.read_light(prim, time, scale=metres)
            path = str(first_place(prim))
            row = light_row(prim.GetName(), path, made, level=_level(made, places))
            row |= _of_shape(prim, made, strength_per_nit(prim, time, False, world)[0])
            self._add(row, places)
            return
        source = read_source_light(prim, places)
        if source is None or not source.sound:
            text = (
                "no closed form" if source is None else "a strength that is negative or no number"
            )
            self._note(prim, Kind.REPLACED, "usd-light-kept", f"{text}; kept as it is")
            return
        if source.kind == "dome" and self.sky is not None:
            text = f"{self.sky.place} says the sky; hidden"
            self._note(prim, Kind.REPLACED, "ambient-replaced", text)
            self._hide(prim)
            return
        self._note_unused(prim, rule)
        source = self._in_unit(source)
        file = self._luminaire(source, rule)
        meaning = self._meaning(source, rule, file)
        if meaning is None:
            self._hide(prim)
            return
        radius = None if rule is None else rule.number("radius")
        if not source.alike and not meaning.profile:
            text = "copies of different size; their candela stay with the nits"
            self._note(prim, Kind.ASSUMED, "usd-light-copies", text)
        if source.resampled:
            text = "varies on no straight line between its time samples; read at every time code"
            self._note(prim, Kind.REPLACED, "usd-light-resampled", text)
        write_light_over(self.overs, source, meaning, radius=radius)
        self._account(source, meaning, file, places)

    def _add(self, row: dict[str, Any], places: Sequence[Usd.Prim]) -> None:
        """A row of the account, and where its lamps stand: nowhere in states not selected."""
        stands = [(prim.GetPath(), light_overs.copies(prim)) for prim in places]
        row["lamps"] = sum(count for _, count in stands)
        self.rows.append(row)
        self._standing.append((row, stands if self.selected else []))

    def count_shown(self) -> None:
        """How many lamps of each row the stage shows, now that it is composed with the overs."""
        find = self.stage.GetPrimAtPath
        for row, stands in self._standing:
            row["lamps_shown"] = sum(count for path, count in stands if is_shown(find(path)))

    def write_sky(self) -> None:
        """The sky of the photometry file, where it states one and the stage has not."""
        rule, root = self.sky, self.stage.GetDefaultPrim()
        if rule is None:
            return
        if not root:
            text = "a sky needs a defaultPrim to stand on; not used"
            self.report.add(Kind.DROPPED, "usd-rule-unused", rule.place, "ambient", text)
            return
        color = rule_color(rule, temperature_rgb)
        made = self.skies.make(rule, color) if "preset" in rule.values else even_sky(rule, color)
        if made is None:
            return
        # The layer alone, so that what is written does not change the stage that is read.
        top = Sdf.Layer.CreateAnonymous()
        top.pseudoRoot.SetInfo("upAxis", UsdGeom.GetStageUpAxis(self.stage))
        top.subLayerPaths.append(self.overs.layer.identifier)
        alone = Usd.Stage.Open(top)
        alone.SetEditTarget(self.overs.layer)
        path = self._free(root, "Sky")
        if made.picture:
            dome = write_sky_dome(alone, path, made.light, made.picture)
            UsdGeom.Xformable(dome).SetResetXformStack(True)  # north is not the default prim's
        else:
            light.write_light(alone, path, made.light)
            ambient.write_ambient(alone.OverridePrim(root.GetPath()), made.light, path)
        self.rows.append(light_row(path.name, str(path), made.light))
        if made.sun is not None:
            path = self._free(root, made.body)
            sun = write_sky_sun(alone, path, made.sun, made.towards)
            UsdGeom.Xformable(sun).SetResetXformStack(True)
            level = max(made.towards[1], 0.0)
            self.rows.append(light_row(path.name, str(path), made.sun, level=level))

    def _free(self, root: Usd.Prim, name: str) -> Sdf.Path:
        """A path below the default prim where the stage has nothing."""
        taken = dict.fromkeys(root.GetAllChildrenNames(), 1)
        return root.GetPath().AppendChild(unique(name, taken))

    def note_kept(self) -> None:
        """A finding for what is photometric already."""
        if self._photometric:
            text = f"{self._photometric} lights are photometric already; left alone"
            self.report.add(Kind.ASSUMED, "usd-photometric", SourceRef(self.file), "", text)
        if self.sidecar.ambient is not None and self.sky is None:
            text = "the stage states its sky already; left alone"
            place = self.sidecar.ambient.place
            self.report.add(Kind.DROPPED, "usd-rule-unused", place, "ambient", text)

    # -- one light -------------------------------------------------------------------------

    def _in_unit(self, source: SourceLight) -> SourceLight:
        """The light with its strength in candela or lux by the unit that is asked for."""
        prim, unit = source.prim, self.unit
        distant = source.kind == "distant"
        if unit.name != "nits" and source.kind != "dome" and not normalized(prim, _EARLIEST):
            text = f"{unit.name} go with normalize 1; read as nits"
            self._note(prim, Kind.ASSUMED, "usd-light-unit", text)
            return source
        factor = self._factor(unit, distant=distant)
        moments = {
            time: replace(m, strength=m.strength * factor) for time, m in source.moments.items()
        }
        return replace(source, moments=moments)

    def _factor(self, unit: LightUnit, *, distant: bool) -> float:
        """What the cd or lx by the letter are multiplied by.

        The letter divides by an area in the stage's units; watts do not know of these.
        """
        if distant:
            return unit.distant
        metres = UsdGeom.GetStageMetersPerUnit(self.stage) if unit.name != "nits" else 1.0
        return unit.local / (metres * metres)

    def _luminaire(self, source: SourceLight, rule: Rule | None) -> LuminaireFile | None:
        if rule is None or "ies" not in rule.values or source.kind in ("distant", "dome"):
            return None
        return self.luminaires.use(rule)

    def _meaning(
        self, source: SourceLight, rule: Rule | None, file: LuminaireFile | None
    ) -> PhotometricLight | None:
        """The light in photometric terms; None where it is off."""
        prim, top = source.prim, source.brightest
        if source.kind == "dome" and (rule is None or not self._plain_dome(prim, rule)):
            self._note_letter(source)
            return self._letter(PhotometricLight("ambient", top.strength, top.color))
        if rule is None and top.strength == 0.0:
            return self._letter(PhotometricLight("point", 0.0, top.color))
        own = "" if source.kind in ("distant", "dome") else photometric_file(prim)
        stated = None
        lit = rule is not None and rule.values.get("enabled", True)
        if rule is not None and lit and own and file is None:
            rule = self._without_strength(prim, rule)
        if rule is not None and lit and source.kind in _EMITTERS:
            rule, stated = self._by_shape(source, rule, file)
        made = self.interpreter.light(self._asked(source), rule, file)
        if made is None:
            return None
        if stated is not None:
            made = replace(made, provenance=stated.provenance, rule=stated.rule)
            made = replace(made, source=stated.source)
        if made.rule == "source file":
            self._note_letter(source)
            made = self._letter(made)
        return replace(made, profile=own) if own and not made.profile else made

    def _without_strength(self, prim: Usd.Prim, rule: Rule) -> Rule:
        """A rule for a light that is a factor on the unread candela of a photometric file."""
        said = [key for key in STRENGTHS if key in rule.values]
        if said:
            text = f"{rule.place} says {' and '.join(said)}, which would multiply "
            text += f"{photometric_file(prim)} of the stage; not used; want ies beside it"
            self._note(prim, Kind.INVALID, "sidecar-unit", text)
        return _without(rule, said)

    def _by_shape(
        self, source: SourceLight, rule: Rule, file: LuminaireFile | None
    ) -> tuple[Rule, Stated | None]:
        """The rule of a face or a tube with its strength in candela: its shape spreads its light.

        With how they came about, where the rule states a strength and no ``file`` does.
        """
        emitter = _EMITTERS[source.kind]
        said = rule.values.get("spread")
        if file is None and said not in (None, "cone", OWN[emitter]):
            text = f"a {source.prim.GetTypeName()} shines by its shape: not by spread {said}"
            self._note(source.prim, Kind.REPLACED, "light-spread", text)
        if said not in ("cone", OWN[emitter]):
            rule = _without(rule, ["spread"])

        def note(kind: Kind, code: str, text: str) -> None:
            self._note(source.prim, kind, code, text)

        beam = Beam(*shaping(source.prim), emitter)
        stated = stated_candela(rule, beam, note) if file is None else None
        rule = _without(rule, ["spread"])
        if stated is not None:
            values = {**_without(rule, STRENGTHS).values, "candela": stated.value}
            rule = replace(rule, values=values)
        return rule, stated

    def _letter(self, made: PhotometricLight) -> PhotometricLight:
        return replace(made, provenance="authored", rule=self.unit.text, source="")

    def _asked(self, source: SourceLight) -> legacy.Light:
        """The light as the other formats hand it to the interpreter."""
        top, prim = source.brightest, source.prim
        kinds = {"distant": "directional", "dome": "ambient"}
        local = source.kind not in kinds
        cutoff, softness, exponent = shaping(prim) if local else NO_SHAPING
        return legacy.Light(
            name=prim.GetName(),
            source=SourceRef(self.file, str(first_place(prim))),
            kind=kinds.get(source.kind, "point"),  # type: ignore[arg-type]
            diffuse=top.color,
            specular=top.color,
            candela=top.strength if local else None,
            lux=None if local else top.strength,
            spot_cutoff=cutoff,
            spot_inner=cutoff * (1.0 - softness) if 0.0 < softness <= 1.0 else None,
            spot_exponent=exponent,
            radius=min(max(source.radius, 1e-3), 10.0) if local else None,
        )

    def _note_unused(self, prim: Usd.Prim, rule: Rule | None) -> None:
        for key in _UNUSED:
            if rule is not None and key in rule.values:
                text = f"{key} is not used: the stage says how the lamp stands and what it shades"
                self.report.add(Kind.DROPPED, "usd-rule-unused", rule.place, prim.GetName(), text)

    def _plain_dome(self, prim: Usd.Prim, rule: Rule) -> bool:
        """Whether a rule's illuminance can be a dome's: not of one with a picture."""
        if "illuminance" not in rule.values:

            def note(kind: Kind, code: str, text: str) -> None:
                self._note(prim, kind, code, text)

            note_wrong_unit(rule, "illuminance", STRENGTHS, note)
            return "enabled" in rule.values
        if light_overs.pictured(prim):
            text = f"{rule.place}: a dome with a picture takes no illuminance"
            self._note(prim, Kind.INVALID, "sidecar-unit", text)
            return False
        return True

    def _note_letter(self, source: SourceLight) -> None:
        """What the number rests on, and what else it may be."""
        prim, strength = source.prim, source.brightest.strength
        unit = "lx" if source.kind in ("distant", "dome") else "cd"
        if unit == "cd" and photometric_file(prim):
            unit = "times its photometric file"
        elif light_overs.pictured(prim):
            unit = "lx where its picture is 1"
        text = f"{strength:.4g} {unit} by the letter of UsdLux 25.05"
        if self.unit.name != "nits":
            text = f"{strength:.4g} {unit} by light_unit {self.unit.name}"
        self._note(prim, Kind.ASSUMED, "usd-light-unit", text)
        if self.unit.name != "nits":
            return
        stated = input_source(prim, "intensity")
        specs = stated.GetPropertyStack(_EARLIEST) if stated else []
        writer = str(specs[0].layer.documentation) if specs else ""
        if writer.startswith("Blender") and (source.kind == "dome" or normalized(prim, _EARLIEST)):
            right = LIGHT_UNITS["blender-watts"]
            factor = self._factor(right, distant=source.kind == "distant")
            text = (
                f"{writer} writes watts; {strength * factor:.4g} {unit} with "
                '[usd] light_unit = "blender-watts" in the photometry file'
            )
            self._note(prim, Kind.ASSUMED, "usd-light-writer", text)
        elif specs and stated.Get(_EARLIEST) in CONSTANTS.get(source.kind, ()):
            text = (
                f"intensity {stated.Get(_EARLIEST):g} is what NVIDIA's converter writes for every "
                f"{source.kind} light; want [[light]] candela or illuminance in the photometry file"
            )
            self._note(prim, Kind.ASSUMED, "usd-light-writer", text)

    def _hide(self, prim: Usd.Prim) -> None:
        self.overs.value(prim, "visibility", Sdf.ValueTypeNames.Token, "invisible")

    def _account(
        self,
        source: SourceLight,
        made: PhotometricLight,
        file: LuminaireFile | None,
        places: Sequence[Usd.Prim],
    ) -> None:
        prim = source.prim
        flux = None if file is None else made.intensity * file.luminaire.flux()
        row = light_row(
            prim.GetName(),
            str(first_place(prim)),
            replace(made, radius=source.radius) if source.radius > 0.0 else made,
            self._asked(source),
            place=str(SourceRef(self.file, str(first_place(prim)))),
            node=prim.GetParent().GetName(),
            file_flux=flux,
            level=_level(made, places),
        )
        row |= _of_shape(prim, made, source.brightest.per_nit)
        self._add(row, places)

    def _note(self, prim: Usd.Prim, kind: Kind, code: str, text: str) -> None:
        self.report.add(kind, code, SourceRef(self.file), str(first_place(prim)), text)


def _of_shape(prim: Usd.Prim, made: PhotometricLight, per_nit: float) -> dict[str, float | None]:
    """Luminance and flux of a light by its shape. ``per_nit``: cd on the axis that 1 nit makes."""
    kind = light_kind(prim)
    if kind in ("distant", "dome", "other") or made.profile:
        return {}
    row = {"luminance_cd_m2": made.intensity / per_nit if per_nit > 0.0 else None}
    if kind in _EMITTERS:
        beam = Beam(*shaping(prim), _EMITTERS[kind])
        row["flux_lm"] = made.intensity * beam_solid_angle(beam)
    return row


def _without(rule: Rule, keys: Iterable[str]) -> Rule:
    left = {key: value for key, value in rule.values.items() if key not in set(keys)}
    return replace(rule, values=left)


def _brightest(prim: Usd.Prim) -> Usd.TimeCode:
    """When a photometric light is at its strongest."""
    names = (light.INTENSITY, light.ILLUMINANCE, "inputs:intensity")
    for attribute in filter(None, map(prim.GetAttribute, names)):
        if times := attribute.GetTimeSamples():
            values = [attribute.Get(time) for time in times]  # None where a sample is blocked
            known = [v if v is not None and math.isfinite(v) else -math.inf for v in values]
            return Usd.TimeCode(times[known.index(max(known))])
    return Usd.TimeCode.Default()


def _level(made: PhotometricLight, places: Sequence[Usd.Prim]) -> float:
    """The share that a level ground gets of what comes from afar."""
    return level_share(places) if made.kind == "distant" else 1.0
