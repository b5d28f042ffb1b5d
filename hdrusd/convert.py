"""A legacy database becomes a photometric USD stage: ``convert`` in eleven steps."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pxr import Sdf, Usd, UsdLux

from hdrusd.errors import InputError, SourceRef, ValidationError
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.importers.importer import read as read_legacy
from hdrusd.legacy import scene as legacy
from hdrusd.luminaires import LuminaireFiles
from hdrusd.maps import MapWriter
from hdrusd.photometry.estimate import DEFAULT_RULE, RULES
from hdrusd.photometry.interpret import Interpreter, LuminaireFile, luminance, rule_color
from hdrusd.photometry.light import PhotometricLight, chromaticity
from hdrusd.photometry.sidecar import FILE_NAME, Rule, Sidecar, read_sidecar
from hdrusd.report import Kind, Report
from hdrusd.surfaces import SurfaceMaker, colored_materials, material_rows
from hdrusd.usd.fixtures import Lamp
from hdrusd.usd.material import write_look, write_photometric
from hdrusd.usd.mesh import COLOR_PRIMVAR
from hdrusd.usd.settings import Settings
from hdrusd.usd.transform import across
from hdrusd.usd.writer import Place, StageWriter
from hdrusd.validation import validate

#: Suffixes of a stage that convert writes: text at the top, so that a person can read it.
OUTPUT_SUFFIXES = (".usda",)

#: Size of the picture that a stage asks for, pixels.
_RESOLUTION = (1280, 720)

#: Bytes in the name of a file, as common file systems have it.
_LONGEST_NAME = 255


@dataclass(frozen=True, slots=True)
class Options:
    """How to convert. ``gamma`` None: the photometry file's, else 2.2."""

    photometry: Path | None = None
    estimate: str = DEFAULT_RULE
    gamma: float | None = None
    meters_per_unit: float = 1.0
    source_unit: float | None = None  # metres a source unit; None: what the format says
    up: str | None = None  # "Y" or "Z"; None: what the format says
    roots: Sequence[Path] = ()
    search: Sequence[Path] = ()
    limits: Limits = field(default_factory=Limits)


@dataclass(slots=True)
class Result:
    """What was written, and the account of it."""

    output: Path
    report: Report
    counts: dict[str, int]
    lights: list[dict[str, Any]] = field(default_factory=list)
    materials: list[dict[str, Any]] = field(default_factory=list)
    textures: dict[str, dict[str, object]] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """JSON form: docs/findings.md."""
        return self.report.as_dict() | {
            "output": str(self.output),
            "counts": self.counts,
            "lights": self.lights,
            "materials": self.materials,
            "textures": self.textures,
        }


def convert(source: Path, output: Path, options: Options, report: Report | None = None) -> Result:
    """Convert one file. Raises InputError, ValidationError; ``output`` is whole or untouched."""
    report = Report() if report is None else report
    _check_output(output)
    if not source.is_file():
        raise InputError(source, "no such file")
    with _work_folder(output) as folder:
        result = _Conversion(source, output, folder, options, report).run()
        _move_into_place(folder, output)
    return result


def _check_output(output: Path) -> None:
    if output.suffix.lower() not in OUTPUT_SUFFIXES:
        raise InputError(output, f"{output.suffix or 'no suffix'}; want {OUTPUT_SUFFIXES[0]}")
    if output.is_dir():
        raise InputError(output, "a folder; want the name of a file")
    longest = f"{output.stem}.photometry.usda"
    if len(longest.encode()) > _LONGEST_NAME:
        raise InputError(output, f"a name of {len(output.name)} characters; want a shorter one")
    textures = output.parent / f"{output.stem}.textures"
    if textures.exists() and not output.exists():
        # It would be replaced, and may well be the source's own.
        raise InputError(textures, "not of an earlier conversion; want another name for OUTPUT")


@contextmanager
def _work_folder(output: Path) -> Iterator[Path]:
    """A folder beside ``output`` that is gone in the end, as are parents made for nothing."""
    above = (output.parent, *output.parent.parents)
    made = [parent for parent in above if not parent.exists()]
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".hdrusd-", dir=output.parent) as folder:
            yield Path(folder)
    finally:
        for parent in made:
            with suppress(OSError):  # it is not there, or not empty
                parent.rmdir()


def _move_into_place(folder: Path, output: Path) -> None:
    """Rename what was made; the root layer last, so that it never names what is not there.

    What stood there before is set aside, and put back when a rename fails.
    """
    names = sorted((p.name for p in folder.iterdir()), key=lambda name: name == output.name)
    old = folder / "replaced"
    old.mkdir()
    touched: list[str] = []
    try:
        for name in names:
            touched.append(name)
            target = output.parent / name
            if target.exists():
                target.rename(old / name)
            (folder / name).rename(target)
    except BaseException:
        for name in reversed(touched):
            target = output.parent / name
            with suppress(OSError):  # the others are put back all the same
                if not (folder / name).exists() and target.exists():
                    target.rename(folder / name)
                if (old / name).exists():
                    (old / name).rename(target)
        raise


@dataclass(frozen=True, slots=True)
class _Lamp:
    """A light of the source, ready to be written."""

    place: Place
    source: legacy.Light
    light: PhotometricLight
    right: legacy.Vec3 | None = None  # where C = 0 of its photometric file points
    flux: float | None = None  # lm of its photometric file
    shaded: bool = False  # by its own fixture too

    def row(self, path: str) -> dict[str, Any]:
        """The account of it for the report."""
        row = _light_row(self.source.name, path, self.light, self.source)
        row["place"] = str(self.place.node.source)
        return row if self.flux is None else row | {"unit": "times the file", "flux_lm": self.flux}


class _Conversion:
    """One run: the pieces that several steps need."""

    def __init__(
        self, source: Path, output: Path, folder: Path, options: Options, report: Report
    ) -> None:
        self.output = output
        self.folder = folder
        self.options = options
        self.report = report
        self.sidecar = _find_sidecar(source, options, report)
        resolver = Resolver(source, report, options.roots, options.search, options.limits)
        self.scene = read_legacy(resolver, report)
        stem = output.stem
        files = folder / f"{stem}.textures", f"./{stem}.textures"
        self.maps = MapWriter(*files, report)
        named = Resolver(
            self.sidecar.path or source, report, options.roots, options.search, options.limits
        )
        self.luminaires = LuminaireFiles(*files, named, report)
        self.writer = StageWriter(
            folder,
            stem,
            self.scene,
            report,
            meters_per_unit=options.meters_per_unit,
            source_unit=options.source_unit or self.scene.unit_m,
            up=options.up or self.scene.up,
        )
        self.result = Result(output, report, self.scene.counts())
        self.lamps: list[tuple[_Lamp, Lamp]] = []

    def run(self) -> Result:
        """The steps, in order."""
        if not self.scene.meshes and not self.scene.lights and not self.scene.cameras:
            raise InputError(self.scene.source, "nothing in it that a stage could show")
        self.writer.write_geometry()
        self.interpreter = Interpreter(
            RULES[self.options.estimate],
            self.writer.diagonal(),
            self.writer.source_unit,
            _temperature_rgb,
            self.report,
        )
        self._write_materials()
        self._write_lights()
        if not self.scene.meshes and not self.result.lights and not self.scene.cameras:
            raise InputError(self.scene.source, "nothing in it that can be used; see the findings")
        camera = self._write_cameras()
        self._show_nodes()
        self._free_lamps()
        self.writer.write_settings(
            Settings(camera=camera, resolution=_RESOLUTION, operator="reinhard02")
        )
        self.sidecar.note_unmatched(self.report)
        self.writer.save()
        self.result.textures = self.maps.written | self.luminaires.written
        self._validate()
        return self.result

    # -- materials -------------------------------------------------------------------------

    def _write_materials(self) -> None:
        materials = self.scene.materials
        colored = colored_materials(self.scene)
        maker = SurfaceMaker(
            self.maps, self.interpreter, self.sidecar, self.options.gamma, self.report
        )
        glossed = [maker.glossed(material) for material in materials]
        surfaces = [maker.surface(m, colored=i in colored) for i, m in enumerate(glossed)]

        def look(stage: Usd.Stage, index: int, path: Sdf.Path) -> None:
            maps = maker.look(materials[index])
            write_look(
                stage, path, materials[index], maps, COLOR_PRIMVAR if index in colored else ""
            )

        def photometric(stage: Usd.Stage, index: int, path: Sdf.Path) -> None:
            write_photometric(stage, path, glossed[index], surfaces[index])

        self.writer.edit_materials("look", look)
        self.writer.edit_materials("photometry", photometric)
        self.result.materials = material_rows(materials, self.writer.materials, surfaces)

    # -- lights ----------------------------------------------------------------------------

    def _write_lights(self) -> None:
        ambients: list[PhotometricLight] = []
        lamps: list[_Lamp] = []
        for place in self.writer.places:
            for index in place.node.lights:
                light = self.scene.lights[index]
                rule = self.sidecar.match("light", light.name, place.node.name)
                if light.kind == "ambient" and self.sidecar.ambient is not None:
                    text = f"{self.sidecar.ambient.place} says the sky; not added to it"
                    self.report.add(
                        Kind.REPLACED, "ambient-replaced", light.source, light.name, text
                    )
                    continue
                file = self._luminaire(light, rule)
                meaning = self.interpreter.light(light, rule, file)
                if meaning is not None and meaning.kind == "ambient":
                    ambients.append(meaning)
                elif meaning is not None:
                    shaded = rule is not None and bool(rule.values.get("fixture_shadow"))
                    lamp = _Lamp(place, light, meaning, shaded=shaded)
                    if rule is not None and file is not None:
                        lamp = self._aimed(lamp, rule, file)
                    lamps.append(lamp)
        for lamp in lamps:
            prim = self.writer.write_light(lamp.place, lamp.source, lamp.light, lamp.right)
            self.result.lights.append(lamp.row(str(prim.GetPath())))
            if lamp.light.kind in ("point", "spot") and not lamp.shaded:
                self.lamps.append((lamp, Lamp(prim, lamp.light)))
        ambient = self._ambient(ambients)
        if ambient is not None:
            path = self.writer.write_ambient(ambient).GetPath()
            self.result.lights.append(_light_row("Sky", str(path), ambient, None))

    def _luminaire(self, light: legacy.Light, rule: Rule | None) -> LuminaireFile | None:
        """The photometric file that a rule gives to a light with a place."""
        if rule is None or "ies" not in rule.values or light.kind not in ("point", "spot"):
            return None
        return self.luminaires.use(str(rule.values["ies"]), rule.place)

    def _aimed(self, lamp: _Lamp, rule: Rule, file: LuminaireFile) -> _Lamp:
        """The lamp with its luminaire's axis and C = 0 where the rule has them."""

        def note(kind: Kind, text: str) -> None:
            self.report.add(kind, "profile-aim", rule.place, lamp.source.name, text)

        axis, right = rule.three("axis"), rule.three("c0")
        if axis is None and lamp.source.kind == "point":
            note(Kind.ASSUMED, "gamma = 0 points along the light's -Z; axis says otherwise")
        source = replace(lamp.source, direction=axis or lamp.source.direction)
        if right is None and not file.symmetric:
            note(Kind.ASSUMED, "C = 0 points as the shortest turn leaves +X; c0 says otherwise")
        elif right is not None and across(right, source.direction) is None:
            note(Kind.INVALID, "c0 lies along the axis; not used")
        flux = lamp.light.intensity * file.luminaire.flux()
        return replace(lamp, source=source, right=right, flux=flux)

    def _ambient(self, from_lights: list[PhotometricLight]) -> PhotometricLight | None:
        """The photometry file's sky, else the sum of what the source calls ambient."""
        rule = self.sidecar.ambient
        if rule is not None:
            return PhotometricLight(
                "ambient",
                rule.number("illuminance") or 0.0,
                rule_color(rule, _temperature_rgb) or (1.0, 1.0, 1.0),
                provenance=rule.provenance,
                rule=str(rule.place),
                source=rule.source,
            )
        if self.scene.ambient is not None and luminance(self.scene.ambient) > 0.0:
            estimate = RULES[self.options.estimate]
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

    # -- cameras, nodes, checks ------------------------------------------------------------

    def _write_cameras(self) -> str | None:
        """Cameras that the photometry file puts at nodes; the one the settings name."""
        first: str | None = None
        for place in self.writer.places:
            rule = self.sidecar.match("camera", place.node.name)
            if rule is not None:
                camera = _node_camera(place, rule)
                path = str(self.writer.write_node_camera(place, camera))
                first = first or path
        return first or self.writer.first_camera

    def _show_nodes(self) -> None:
        for place in self.writer.places:
            rule = self.sidecar.match("node", place.node.name)
            if rule is not None and "visible" in rule.values:
                self.writer.set_visible(place, visible=rule.values["visible"])

    def _free_lamps(self) -> None:
        """Lamps inside their own fixtures shine out of them."""
        self.writer.free_lamps([it for _, it in self.lamps])
        for lamp, it in self.lamps:

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

    def _validate(self) -> None:
        stage = Usd.Stage.Open(str(self.folder / self.output.name))
        problems = validate(stage)
        errors = [problem for problem in problems if problem.severity == "error"]
        if errors:
            raise ValidationError("; ".join(f"{p.path}: {p.text}" for p in errors[:3]))
        for problem in problems:
            self.report.add(
                Kind.ASSUMED, "validation", SourceRef(self.output), str(problem.path), problem.text
            )


def _find_sidecar(source: Path, options: Options, report: Report) -> Sidecar:
    path = options.photometry or source.parent / FILE_NAME
    if options.photometry is None and not path.is_file():
        return Sidecar()
    return read_sidecar(path, report)


def _node_camera(place: Place, rule: Rule) -> legacy.Camera:
    return legacy.Camera(
        name="Camera",
        source=place.node.source,
        fov_y=rule.number("fov") or 45.0,
        near=rule.number("near") or 0.1,
        far=rule.number("far") or 10_000.0,
    )


def _temperature_rgb(kelvin: float) -> legacy.RGB:
    """USD's own blackbody colour, luminance 1; its range is 1000 to 10000 K."""
    r, g, b = UsdLux.BlackbodyTemperatureAsRgb(min(max(kelvin, 1000.0), 10_000.0))
    return chromaticity((r, g, b))[0]


def _light_row(
    name: str, path: str, light: PhotometricLight, source: legacy.Light | None
) -> dict[str, Any]:
    unit = "cd" if light.kind in ("point", "spot") else "lx"
    legacy_value: dict[str, Any] | None = None
    if source is not None:
        legacy_value = {
            "diffuse": list(source.diffuse),
            "candela": source.candela,
            "lux": source.lux,
        }
    return {
        "name": name,
        "path": path,
        "place": "",
        "kind": light.kind,
        "value": light.intensity,
        "unit": unit,
        "chromaticity": list(light.chromaticity),
        "provenance": light.provenance,
        "rule": light.rule,
        "source_value": legacy_value,
        "file": light.profile or None,
        "flux_lm": light.intensity * 4.0 * math.pi if light.kind == "point" else None,
    }
