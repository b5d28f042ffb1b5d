"""A legacy database becomes a photometric USD stage: ``convert`` in ten steps."""

from __future__ import annotations

import math
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pxr import Sdf, Usd, UsdLux

from hdrusd.errors import InputError, SourceRef, ValidationError
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.importers.importer import read as read_legacy
from hdrusd.legacy import scene as legacy
from hdrusd.maps import MapWriter
from hdrusd.photometry.estimate import DEFAULT_RULE, RULES
from hdrusd.photometry.interpret import Interpreter, luminance, rule_color
from hdrusd.photometry.light import PhotometricLight, chromaticity
from hdrusd.photometry.sidecar import FILE_NAME, Rule, Sidecar, read_sidecar
from hdrusd.report import Kind, Report
from hdrusd.units import TEXTURE_GAMMA
from hdrusd.usd.material import Map, Surface, write_look, write_photometric
from hdrusd.usd.mesh import COLOR_PRIMVAR
from hdrusd.usd.settings import Settings
from hdrusd.usd.writer import Place, StageWriter
from hdrusd.validation import validate

#: Suffixes of a stage that convert writes: text at the top, so that a person can read it.
OUTPUT_SUFFIXES = (".usda",)

#: Size of the picture that a stage asks for, pixels.
_RESOLUTION = (1280, 720)


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
        """JSON form: docs/report.md."""
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
    if output.suffix.lower() not in OUTPUT_SUFFIXES:
        raise InputError(output, f"{output.suffix or 'no suffix'}; want {OUTPUT_SUFFIXES[0]}")
    if not source.is_file():
        raise InputError(source, "no such file")
    output.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".hdrusd-", dir=output.parent) as folder:
        work = _Conversion(source, output, Path(folder), options, report)
        result = work.run()
        _move_into_place(Path(folder), output)
    return result


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
        self.maps = MapWriter(folder / f"{stem}.textures", f"./{stem}.textures", report)
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

    def run(self) -> Result:
        """The steps, in order."""
        if not self.scene.meshes and not self.scene.lights and not self.scene.cameras:
            raise InputError(self.scene.source, "nothing in it that a stage could show")
        self.writer.write_geometry()
        self.interpreter = Interpreter(
            RULES[self.options.estimate], self.writer.diagonal(), _temperature_rgb, self.report
        )
        self._write_materials()
        self._write_lights()
        camera = self._write_cameras()
        self._hide_nodes()
        self.writer.write_settings(
            Settings(camera=camera, resolution=_RESOLUTION, operator="reinhard02")
        )
        self.sidecar.note_unmatched(self.report)
        self.writer.save()
        self.result.textures = self.maps.written
        self._validate()
        return self.result

    # -- materials -------------------------------------------------------------------------

    def _write_materials(self) -> None:
        colored = _colored_materials(self.scene)
        surfaces = [
            self._surface(index, material, index in colored)
            for index, material in enumerate(self.scene.materials)
        ]

        def look(stage: Usd.Stage, index: int, path: Sdf.Path) -> None:
            material = self.scene.materials[index]
            used = {
                role: made
                for role, texture in (
                    ("diffuse", material.diffuse_map),
                    ("emission", material.emission_map),
                    ("opacity", material.opacity_map),
                )
                if texture is not None and (made := self.maps.look(texture)) is not None
            }
            if "diffuse" in used:  # the LDR picture is texture times diffuse colour
                used["diffuse"] = replace(used["diffuse"], scale=material.diffuse)
            write_look(stage, path, material, used, COLOR_PRIMVAR if index in colored else "")

        def photometric(stage: Usd.Stage, index: int, path: Sdf.Path) -> None:
            write_photometric(stage, path, self.scene.materials[index], surfaces[index])

        self.writer.edit_materials("look", look)
        self.writer.edit_materials("photometry", photometric)

    def _surface(self, index: int, material: legacy.Material, colored: bool) -> Surface:
        rule = self.sidecar.match("material", material.name)
        gamma = self.options.gamma or (rule and rule.number("gamma")) or self.sidecar.gamma
        gamma = gamma or TEXTURE_GAMMA
        diffuse = (rule and rule.color("diffuse")) or material.diffuse
        textured = material.diffuse_map
        if textured is not None and textured.mode in ("REPLACE", "DECAL"):
            diffuse = (1.0, 1.0, 1.0)  # the texture covers the material's colour
        hdr = bool(rule and rule.values.get("hdr_texture"))
        emission, provenance, name, source = self.interpreter.emission(material, rule)
        lamp = rule is not None and rule.number("luminance") is not None
        emission_map = self._emission_map(material, emission, gamma, hdr)
        reflectance = None
        if textured is not None and not lamp:
            reflectance = self.maps.reflectance(
                textured, diffuse, gamma, material.source, material.name
            )
        if reflectance is None:
            diffuse = self._clip(material, diffuse)
        self._note_energy(material, diffuse)
        surface = Surface(
            diffuse=diffuse,
            gamma=gamma,
            diffuse_map=reflectance,
            source_texture=self._look_file(textured),
            emission=emission,
            luminance=luminance(emission),
            emission_map=emission_map,
            replaces_reflection=lamp,
            opacity_map=self._opacity(material),
            vertex_color=COLOR_PRIMVAR if colored else "",
            provenance=provenance if luminance(emission) > 0.0 else "",
            rule=name,
            source=source,
        )
        if colored and reflectance is not None:
            self.report.add(
                Kind.REPLACED,
                "vertex-color",
                material.source,
                material.name,
                "vertex colours times a texture: only hdrusd multiplies both",
            )
        self.result.materials.append(
            {
                "name": material.name,
                "path": str(self.writer.materials[index]),
                "gamma": gamma,
                "diffuse": list(diffuse),
                "reflectance_map": reflectance.file if reflectance else None,
                "luminance_cd_m2": surface.luminance,
                "provenance": provenance if surface.luminance > 0.0 else None,
                "rule": name or None,
            }
        )
        return surface

    def _emission_map(
        self, material: legacy.Material, emission: legacy.RGB, gamma: float, hdr: bool
    ) -> Map | None:
        texture = material.emission_map or (material.diffuse_map if hdr else None)
        if texture is None or luminance(emission) <= 0.0:
            if hdr:
                self.report.add(
                    Kind.MISSING,
                    "hdr-texture-missing",
                    material.source,
                    material.name,
                    "hdr_texture asked for; the material has no texture or no luminance",
                )
            return None
        return self.maps.luminance(texture, gamma, emission, peak=hdr)

    def _look_file(self, texture: legacy.Texture | None) -> str:
        made = None if texture is None else self.maps.look(texture)
        return made.file if made else ""

    def _opacity(self, material: legacy.Material) -> Map | None:
        """Opacity stays as it was: the look's own file, read raw."""
        if material.opacity_map is None or material.alpha_mode == "opaque":
            return None
        made = self.maps.look(material.opacity_map)
        return replace(made, raw=True) if made else None

    def _clip(self, material: legacy.Material, diffuse: legacy.RGB) -> legacy.RGB:
        if max(diffuse) > 1.0 or min(diffuse) < 0.0:
            self.report.add(
                Kind.CLAMPED,
                "diffuse-clipped",
                material.source,
                material.name,
                f"diffuse {tuple(round(c, 4) for c in diffuse)}; clipped to [0, 1]",
            )
            r, g, b = (min(max(c, 0.0), 1.0) for c in diffuse)
            return r, g, b
        return diffuse

    def _note_energy(self, material: legacy.Material, diffuse: legacy.RGB) -> None:
        total = max(d + s for d, s in zip(diffuse, material.specular, strict=True))
        if material.pbr is None and total > 1.0 + 1e-6:
            self.report.add(
                Kind.ASSUMED,
                "energy",
                material.source,
                material.name,
                f"diffuse and specular add up to {total:.3g}; more than falls in",
            )

    # -- lights ----------------------------------------------------------------------------

    def _write_lights(self) -> None:
        ambients: list[PhotometricLight] = []
        interpreted: dict[int, list[tuple[Place, PhotometricLight]]] = {}
        for place in self.writer.places:
            for index in place.node.lights:
                light = self.scene.lights[index]
                rule = self.sidecar.match("light", light.name, place.node.name)
                meaning = self.interpreter.light(light, rule)
                if meaning is None:
                    continue
                if meaning.kind == "ambient":
                    ambients.append(meaning)
                else:
                    interpreted.setdefault(index, []).append((place, meaning))
        for index, place, light, prim in self.writer.write_lights(interpreted):
            self._account(str(prim.GetPath()), self.scene.lights[index], place, light)
        ambient = self._ambient(ambients)
        if ambient is not None:
            path = self.writer.write_ambient(ambient).GetPath()
            self.result.lights.append(_light_row("Sky", str(path), ambient, None, ""))

    def _ambient(self, from_lights: list[PhotometricLight]) -> PhotometricLight | None:
        """The photometry file's sky, else the sum of what the source calls ambient."""
        rule = self.sidecar.ambient
        lux = rule.number("illuminance") if rule else None
        if rule is not None and lux is not None:
            color = rule_color(rule, _temperature_rgb) or (1.0, 1.0, 1.0)
            return PhotometricLight(
                "ambient",
                lux,
                color,
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

    def _account(
        self, path: str, source: legacy.Light, place: Place, light: PhotometricLight
    ) -> None:
        self.result.lights.append(
            _light_row(source.name, path, light, source, str(place.node.source))
        )

    # -- cameras, nodes, checks ------------------------------------------------------------

    def _write_cameras(self) -> str | None:
        """Cameras that the photometry file puts at nodes; the one the settings name."""
        first: str | None = None
        for place in self.writer.places:
            rule = self.sidecar.match("camera", place.node.name)
            if rule is None:
                for index in place.node.cameras:
                    name = self.scene.cameras[index].name
                    first = first or self._camera_path(place, name)
                continue
            camera = _node_camera(place, rule)
            first = first or str(self.writer.write_node_camera(place, camera))
        return first

    def _camera_path(self, place: Place, name: str) -> str | None:
        prim = self.writer.stage.GetPrimAtPath(place.path)
        cameras = [p for p in prim.GetChildren() if p.GetTypeName() == "Camera"]
        return str(cameras[0].GetPath()) if cameras else None

    def _hide_nodes(self) -> None:
        for place in self.writer.places:
            rule = self.sidecar.match("node", place.node.name)
            if rule is not None and rule.values.get("visible") is False:
                self.writer.hide(place)

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


def _colored_materials(scene: legacy.LegacyScene) -> set[int]:
    """Materials worn by a mesh with vertex colours that are not all white."""
    colored: set[int] = set()
    for mesh in scene.meshes:
        if mesh.colors is not None and not bool((mesh.colors[:, :3] == 1.0).all()):
            colored.update(subset.material for subset in mesh.subsets)
            if mesh.material is not None:
                colored.add(mesh.material)
    return colored


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
    return float(r), float(g), float(b)


def _light_row(
    name: str, path: str, light: PhotometricLight, source: legacy.Light | None, place: str
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
        "place": place,
        "kind": light.kind,
        "value": light.intensity,
        "unit": unit,
        "chromaticity": list(light.chromaticity),
        "provenance": light.provenance,
        "rule": light.rule,
        "source_value": legacy_value,
        "flux_lm": light.intensity * 4.0 * math.pi if light.kind == "point" else None,
    }


def _move_into_place(folder: Path, output: Path) -> None:
    """Rename what was made; the root layer last, so that it never names what is not there."""
    names = sorted(folder.iterdir(), key=lambda path: path.name == output.name)
    for path in names:
        target = output.parent / path.name
        if path.is_dir() and target.is_dir():
            shutil.rmtree(target)
        path.replace(target)
