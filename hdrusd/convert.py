"""A legacy database becomes a photometric USD stage: ``convert`` in eleven steps."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, cast

import numpy.typing as npt
from pxr import Sdf, Usd

from hdrusd.account.images import image_rows
from hdrusd.account.reflectances import Reflectances
from hdrusd.account.wear import wearers, worn
from hdrusd.added_lamps import add_lamps
from hdrusd.checking import validate
from hdrusd.conversion import Options, Result
from hdrusd.delivery import check_output, check_path, move_into_place, work_folder
from hdrusd.errors import InputError, SourceRef, ValidationError
from hdrusd.importers.importer import Resolver
from hdrusd.importers.importer import read as read_legacy
from hdrusd.input_file import check_input
from hdrusd.lamps import LampMaker, temperature_rgb
from hdrusd.legacy import scene as legacy
from hdrusd.luminaires import LuminaireFiles
from hdrusd.maps import MapWriter
from hdrusd.measures import Measures, stated_measures
from hdrusd.overlay.stage import Overlay
from hdrusd.photometry.estimate import RULES
from hdrusd.photometry.interpret import Interpreter
from hdrusd.photometry.lamp_area import LampArea
from hdrusd.photometry.sidecar import FILE_NAME, Rule, Sidecar, read_sidecar
from hdrusd.report import Kind, Report
from hdrusd.skies import SkyFiles
from hdrusd.surfaces import SurfaceMaker, colored_materials, faded_materials, material_rows
from hdrusd.usd.authorship import authorship_inputs, write_authorship
from hdrusd.usd.material import Surface, write_look, write_photometric
from hdrusd.usd.placed import extents, mesh_areas
from hdrusd.usd.placed_area import PlacedArea
from hdrusd.usd.settings import Settings
from hdrusd.usd.source_stage import STAGES
from hdrusd.usd.tree import Place
from hdrusd.usd.worn_area import LampAreas
from hdrusd.usd.writer import StageWriter

#: Suffixes of a stage that convert writes: text at the top, so that a person can read it.
OUTPUT_SUFFIXES = (".usda",)

#: Size of the picture that a stage asks for, pixels.
_RESOLUTION = (1280, 720)


def convert(source: Path, output: Path, options: Options, report: Report | None = None) -> Result:
    """Convert one file. Raises InputError, ValidationError; ``output`` is whole or untouched."""
    report = Report() if report is None else report
    check_output(output, OUTPUT_SUFFIXES, over_stage=source.suffix.lower() in STAGES)
    check_input(source)
    # OUTPUT names a stage with its folders, a database by its name.
    check_path(source.absolute() if source.suffix.lower() in STAGES else Path(source.name))
    with work_folder(output) as folder:
        if source.suffix.lower() in STAGES:
            sidecar = _find_sidecar(source, options, report)
            result = Overlay(source, output, folder, options, sidecar, report).run()
        else:
            result = _Conversion(source, output, folder, options, report).run()
        move_into_place(folder, output)
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
        resolver.stated = _stated(options, self.sidecar)
        self.scene = read_legacy(resolver, report)
        self.stated = _measures(self.scene, options, self.sidecar, report)
        self.result = Result(
            output, report, self.scene.counts(), source=source, parts=resolver.found
        )
        up = self.stated.up or self.scene.up
        stem = output.stem
        files = folder / f"{stem}.textures", f"./{stem}.textures"
        self.maps = MapWriter(*files, source.resolve().parent, report)
        named = Resolver(
            self.sidecar.path or source, report, options.roots, options.search, options.limits
        )
        self.luminaires = LuminaireFiles(*files, named, report)
        self.added = add_lamps(self.scene, self.sidecar, up, self.luminaires.use, report)
        self.skies = SkyFiles(*files, report)
        self.writer = StageWriter(
            folder,
            stem,
            self.scene,
            report,
            meters_per_unit=options.meters_per_unit,
            source_unit=self.stated.unit_m or self.scene.unit_m,
            up=up,
        )
        self.surfaces: list[Surface] = []

    def run(self) -> Result:
        """The steps, in order."""
        if not self.scene.meshes and not self.scene.lights and not self.scene.cameras:
            raise InputError(self.scene.source, "nothing in it that a stage could show")
        self.writer.write_geometry()
        interpreter = Interpreter(
            RULES[self.options.estimate],
            self.writer.diagonal(),
            self.writer.source_unit,
            temperature_rgb,
            self.report,
        )
        read = ("diffuse_map", "specular_map", *legacy.DATA_MAPS)  # by SurfaceMaker, in this order
        maps = (material.maps() for material in self.scene.materials)
        with self.maps.threaded(m[name].image for m in maps for name in read if name in m):
            self._write_materials(interpreter)
        lamps = LampMaker(
            self.scene,
            self.sidecar,
            interpreter,
            self.luminaires,
            self.skies,
            self.writer,
            self.report,
            self.added,
        )
        lamps.write()
        self.result.lights = lamps.rows
        if not self.scene.meshes and not self.result.lights and not self.scene.cameras:
            raise InputError(self.scene.source, "nothing in it that can be used; see the findings")
        camera = self._write_cameras()
        self._show_nodes()
        lamps.count_shown()
        lamps.free()
        self._account()
        self.writer.write_settings(
            Settings(camera=camera, resolution=_RESOLUTION, operator="reinhard02")
        )
        self.result.note_unmatched(self.sidecar, self.options)
        inputs = authorship_inputs(self.scene.source, self.sidecar.path)
        write_authorship(self.writer.layers["photometry"], self.writer.root, inputs)
        self.writer.save()
        self._validate()
        return self.result

    # -- materials -------------------------------------------------------------------------

    def _write_materials(self, interpreter: Interpreter) -> None:
        materials = self.scene.materials
        colored, faded = colored_materials(self.scene), faded_materials(self.scene)
        maker = SurfaceMaker(self.maps, interpreter, self.sidecar, self.options.gamma, self.report)
        glossed = [maker.glossed(material) for material in materials]
        surfaces = [
            maker.surface(
                m,
                colored=i in colored,
                faded=i in faded,
                area=partial(self._lamp_area, i),
                places=partial(self._lamp_places, i),
            )
            for i, m in enumerate(glossed)
        ]
        self.surfaces = surfaces

        def look(stage: Usd.Stage, index: int, path: Sdf.Path) -> None:
            maps, surface = maker.look(materials[index]), surfaces[index]
            primvars = surface.vertex_color, surface.vertex_opacity
            write_look(stage, path, materials[index], maps, *primvars)

        def photometric(stage: Usd.Stage, index: int, path: Sdf.Path) -> None:
            write_photometric(stage, path, glossed[index], surfaces[index])

        self.writer.edit_materials("look", look)
        self.writer.edit_materials("photometry", photometric)
        self.result.materials = material_rows(materials, self.writer.materials, surfaces)

    @cached_property
    def _wearers(self) -> dict[int | None, list[int]]:
        return wearers(self.scene)

    @cached_property
    def _lamp_areas(self) -> LampAreas:
        writer = self.writer
        placed = writer.meshes, writer.tree.copies
        return LampAreas(writer.stage, self.scene, *placed, self._wearers)

    @cached_property
    def _placed_areas(self) -> dict[int, PlacedArea]:
        """Of the meshes before the photometry file shows and hides nodes."""
        writer = self.writer
        return mesh_areas(writer.stage, writer.meshes, writer.tree.copies)

    def _lamp_area(self, material: int) -> LampArea | None:
        return self._lamp_areas.of(material)

    def _lamp_places(self, material: int, texture: legacy.Texture) -> npt.NDArray[Any] | None:
        materials = list(self.scene.materials)
        materials[material] = replace(materials[material], diffuse_map=texture)
        scene = replace(self.scene, materials=materials)
        return worn(scene, self._placed_areas, material, self._wearers.get(material, ())).uv

    # -- cameras, nodes, checks ------------------------------------------------------------

    def _write_cameras(self) -> str | None:
        """Cameras that the photometry file puts at nodes; the one the settings name."""
        first: str | None = None
        for place in self.writer.places:
            rule = self.sidecar.match("camera", place.node.name)
            if rule is not None:
                camera = _node_camera(place, rule)
                path = str(self.writer.write_node_camera(place, camera))
                if first is None and self.writer.tree.is_shown(place.path):
                    first = path
        return first or self.writer.first_camera

    def _show_nodes(self) -> None:
        for place in self.writer.places:
            rule = self.sidecar.match("node", place.node.name)
            if rule is not None and "visible" in rule.values:
                self.writer.set_visible(place, visible=rule.values["visible"])

    def _account(self) -> None:
        """What a person needs to judge the result: areas, reflectances, textures by class."""
        result, stage = self.result, self.writer.stage
        result.textures = self.maps.written | self.luminaires.written | self.skies.written
        result.diagonal, result.ground = extents(stage)
        result.unit_stated = self.stated.unit_m is not None
        placed = mesh_areas(stage, self.writer.meshes, self.writer.tree.copies)
        judge = Reflectances(self.maps.overview, self.report)
        pairs = zip(self.scene.materials, self.surfaces, result.materials, strict=True)
        for index, (material, surface, row) in enumerate(pairs):
            file = surface.diffuse_map.file.rpartition("/")[2] if surface.diffuse_map else ""
            factor = cast("list[float] | None", self.maps.written.get(file, {}).get("diffuse"))
            found = worn(self.scene, placed, index, self._wearers.get(index, ()))
            row |= judge.row(material, surface, found, factor)
        areas = [row["area_m2"] for row in result.materials]
        made_of, broken = self.maps.made_of, self.maps.broken
        result.images = image_rows(self.scene.materials, self.surfaces, areas, made_of, broken)

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


def _stated(options: Options, sidecar: Sidecar) -> frozenset[str]:
    """What a person states where a format leaves it open."""
    said = {"unit": options.source_unit or sidecar.unit_m, "up": options.up or sidecar.up}
    return frozenset(key for key, value in said.items() if value)


def _measures(
    scene: legacy.LegacyScene, options: Options, sidecar: Sidecar, report: Report
) -> Measures:
    own = Measures(
        scene.unit_m if scene.unit_stated else None, scene.up if scene.up_stated else None
    )
    asked = Measures(options.source_unit, options.up)
    place = SourceRef(scene.source)
    return stated_measures(own, asked, sidecar, place, report, shared=options.shared)


def _node_camera(place: Place, rule: Rule) -> legacy.Camera:
    return legacy.Camera(
        name="Camera",
        source=place.node.source,
        fov_y=rule.number("fov") or 45.0,
        near=rule.number("near") or 0.1,
        far=rule.number("far") or 10_000.0,
    )
