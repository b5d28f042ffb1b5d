"""The materials of a stage that is converted: reflectance maps and cd/m2 over its networks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from pxr import Sdf, Usd, UsdShade

from hdrusd.account.images import image_rows
from hdrusd.account.reflectances import Reflectances
from hdrusd.account.wear import Worn
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import Image, Texture
from hdrusd.maps import MapWriter
from hdrusd.overlay.areas import Areas
from hdrusd.photometry.interpret import Interpreter
from hdrusd.photometry.sidecar import Sidecar
from hdrusd.report import Kind, Report
from hdrusd.surfaces import SurfaceMaker, material_rows
from hdrusd.usd.assets import asset_bytes, file_on_disk, in_package
from hdrusd.usd.findings import first_place, place_of
from hdrusd.usd.material import Surface
from hdrusd.usd.network import Findings, Node
from hdrusd.usd.overs import Overs
from hdrusd.usd.preview_overs import (
    SourceSurface,
    is_photometric,
    preview_surface,
    read_source_surface,
    write_surface_over,
)
from hdrusd.usd.source_stage import source_layer

#: ``photometric:rule`` of an emission that no photometry file states.
LETTER = "UsdPreviewSurface, cd/m2"

#: Keys of a photometry rule that make a material a lamp.
_LAMP = frozenset({"luminance", "candela", "lumens"})

#: Of a reflectance that a picture or a node states, which stays.
AS_IT_WAS = "UsdPreviewSurface, as it was"


class MaterialOverlay:
    """Writes materials over those of a stage; ``account`` tells of them."""

    def __init__(
        self,
        overs: Overs,
        resolver: Resolver,
        maps: MapWriter,
        interpreter: Interpreter,
        sidecar: Sidecar,
        gamma: float | None,
        report: Report,
    ) -> None:
        self.overs = overs
        self.resolver = resolver
        self.maps = maps
        self.sidecar = sidecar
        self.report = report
        self.maker = SurfaceMaker(maps, interpreter, sidecar, gamma, report)
        self.place = replace(place_of(overs.stage), file=Path(source_layer(overs.stage).realPath))
        self._made: list[tuple[SourceSurface, Surface]] = []
        self._paths: list[Sdf.Path] = []
        self._done: set[str] = set()
        self._photometric = 0

    def write(self, prim: Usd.Prim) -> None:
        """One material, once for every place in the layer."""
        place = str(self.overs.place(prim))
        if place in self._done:
            return
        self._done.add(place)
        rule = self.sidecar.match("material", prim.GetName())
        if is_photometric(prim):
            self._photometric += 1
            return
        surface = preview_surface(UsdShade.Material(prim))
        here = replace(self.place, place=str(first_place(prim)))
        findings = Findings(self.report, self.place, prim)
        if surface is None:
            text = "no UsdPreviewSurface; kept as it is"
            findings.finding("usd-material-kept", text, Kind.REPLACED)
            return
        lamp = rule is not None and bool(_LAMP & rule.values.keys())
        source = read_source_surface(prim, surface, findings, self._picture, emission_map=lamp)
        material = replace(source.material, source=here)
        source = replace(source, material=material)
        glossed = self.maker.glossed(material)
        made = self.maker.surface(glossed, colored=False)
        if made.rule == "source file":
            made = replace(made, rule=LETTER)
            text = f"emission of {made.luminance:.4g} cd/m2 by the letter; stages rarely mean it"
            findings.finding("usd-emission-unit", text, Kind.ASSUMED)
        hdr = rule is not None and bool(rule.values.get("hdr_texture"))
        hdr = hdr and source.material.emission_map is None
        made = _origin(source, made)
        write_surface_over(self.overs, source, glossed, made, hdr=hdr)
        self._made.append((source, made))
        self._paths.append(first_place(prim))

    def note_kept(self) -> None:
        """A finding for what is photometric already."""
        if self._photometric:
            text = f"{self._photometric} materials are photometric already; left alone"
            self.report.add(Kind.ASSUMED, "usd-photometric", self.place, "", text)

    def account(self) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
        """The rows of materials and of pictures for the report."""
        areas, judge = Areas(self.overs.stage), Reflectances(self.maps.overview, self.report)
        rows = []
        for (source, made), path in zip(self._made, self._paths, strict=True):
            (row,) = material_rows([source.material], [path], [made])
            prim = self.overs.stage.GetPrimAtPath(path)
            found = areas.worn(prim) if prim else Worn(0, 0.0, None, None)
            # Of a picture that stays as it is the mean is not known here.
            judged = replace(found, area=0.0) if _kept(source, made) else found
            file = made.diffuse_map.file.rpartition("/")[2] if made.diffuse_map else ""
            factor = cast("list[float] | None", self.maps.written.get(file, {}).get("diffuse"))
            row |= judge.row(source.material, made, judged, factor) | {"area_m2": found.area}
            rows.append(row)
        materials, surfaces = [s.material for s, _ in self._made], [m for _, m in self._made]
        sizes = [row["area_m2"] for row in rows]
        images = image_rows(materials, surfaces, sizes, self.maps.made_of, self.maps.broken)
        return rows, images

    def _picture(self, node: Node, name: str) -> Texture | None:
        """The picture of a texture node; of a diffuse colour only 8-bit codes for a screen."""
        findings = Findings(self.report, self.place, node.shader.GetPrim())
        file = findings.file(node, name)
        if not file:
            return None
        written = str(node.value("file", "").path)
        real = file_on_disk(file)
        if not self.resolver.allowed(real):
            text, code = "not found", "file-missing"
            if real.is_file():
                text, code = "outside the declared roots; kept as it is; ", "file-refused"
                text += f"--root {real.parent} would allow it"
            findings.finding(code, f"{written}: {text}", Kind.MISSING)
            return None
        if in_package(file):
            image = Image(written, self.place, data=asset_bytes(file))
        else:
            image = Image(written, self.place, path=Path(file).resolve())
        space = node.value("sourceColorSpace", "auto")
        coded = space != "raw" and self.maps.coded(image, stated=space == "sRGB")
        return Texture(image, linear=not coded) if coded or name == "emissiveColor" else None


def _kept(source: SourceSurface, made: Surface) -> bool:
    """Whether the diffuse colour comes from a node that stays as it is."""
    fed = source.diffuse is not None or "diffuseColor" in source.fixed
    return fed and made.diffuse_map is None and not made.replaces_reflection


def _origin(source: SourceSurface, made: Surface) -> Surface:
    """The surface without a rule that was not applied: what is kept is as the stage says."""
    if _kept(source, made) and made.rule == "R = D":
        return replace(made, provenance="authored", rule=AS_IT_WAS, source="")
    return made
