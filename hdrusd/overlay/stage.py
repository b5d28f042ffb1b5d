"""A USD stage becomes photometric under a layer of its own: the stage itself is not touched.

OUTPUT.usda              the source's units, axis, times and default prim; sublayers:
OUTPUT.photometry.usda   lights, reflectance, cd/m2, our schemas: opinions over the source
the source               as it is, where it is

What has our schemas already is left alone.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from hdrusd.checking import validate
from hdrusd.conversion import Options, Result
from hdrusd.delivery import earlier_files
from hdrusd.errors import InputError, SourceRef, ValidationError
from hdrusd.importers.importer import Resolver
from hdrusd.lamps import temperature_rgb
from hdrusd.luminaires import LuminaireFiles
from hdrusd.maps import MapWriter
from hdrusd.measures import Measures, stated_measures
from hdrusd.overlay.lights import LightOverlay
from hdrusd.overlay.materials import MaterialOverlay
from hdrusd.photometry.estimate import RULES
from hdrusd.photometry.interpret import Interpreter
from hdrusd.photometry.sidecar import Sidecar
from hdrusd.report import Kind, Report
from hdrusd.skies import SkyFiles
from hdrusd.usd.authorship import authorship_inputs, write_authorship
from hdrusd.usd.layer_files import new_layer, save_layer
from hdrusd.usd.light_overs import light_places
from hdrusd.usd.lux import is_light
from hdrusd.usd.opening import usd_warnings
from hdrusd.usd.overs import Overs, all_prims, population, relative
from hdrusd.usd.placed import extents
from hdrusd.usd.source_stage import (
    copy_stage_metadata,
    copy_time_metadata,
    files_of,
    open_source,
    source_layer,
)
from hdrusd.usd.variant_choices import Brought, Choice, other_variants

#: Variants that are selected in turn, outer ones first.
_Choices = tuple[Choice, ...]

#: Instances in one another: each is met below the one above it.
_MOST_NESTED = 64

#: So many of them, so that each has its photometry.
_MOST_VARIANTS = 256


class Overlay:
    """One run over one source."""

    def __init__(
        self,
        source: Path,
        output: Path,
        folder: Path,
        options: Options,
        sidecar: Sidecar,
        report: Report,
    ) -> None:
        self.source = source
        self.output = output
        self.folder = folder
        self.options = options
        self.sidecar = sidecar
        self.report = report
        self.resolver = Resolver(source, report, options.roots, options.search, options.limits)
        if source.stat().st_size > options.limits.file_bytes:
            raise InputError(source, f"want at most {options.limits.file_bytes} bytes")
        self.stage = open_source(source, self.resolver.allowed, report)
        asked = Measures(options.source_unit, options.up)
        own, place = _own_measures(self.stage), SourceRef(source)
        stated = stated_measures(own, asked, sidecar, place, report, shared=options.shared)
        for key, value in (("metersPerUnit", stated.unit_m), ("upAxis", stated.up)):
            if value is not None:
                self.stage.GetRootLayer().pseudoRoot.SetInfo(key, value)
        self.unit_stated = own.unit_m is not None or stated.unit_m is not None
        self._check_output()
        count, nested = population(self.stage)
        if nested > _MOST_NESTED:
            text = f"{nested} instances in one another; want at most {_MOST_NESTED}"
            raise InputError(source, text)
        if count > options.limits.nodes:
            text = f"{count} prims with all instances; want at most {options.limits.nodes}"
            raise InputError(source, text)
        stem = output.stem
        files = folder / f"{stem}.textures", f"./{stem}.textures"
        self.layer = new_layer(folder / f"{stem}.photometry.usda")
        copy_time_metadata(source_layer(self.stage), self.layer)
        self.overs = Overs(self.stage, self.layer)
        interpreter = Interpreter(
            RULES[options.estimate], self._diagonal(), 1.0, temperature_rgb, report
        )
        self.maps = MapWriter(*files, source.resolve().parent, report)
        beside = sidecar.path or source
        named = Resolver(beside, report, options.roots, options.search, options.limits)
        self.luminaires = LuminaireFiles(*files, named, report)
        self.materials = MaterialOverlay(
            self.overs, self.resolver, self.maps, interpreter, sidecar, options.gamma, report
        )
        self.skies = SkyFiles(*files, report)
        self.lights = LightOverlay(
            self.overs, interpreter, sidecar, self.luminaires, self.skies, report
        )

    def run(self) -> Result:
        """The steps, in order. Raises InputError, ValidationError."""
        with usd_warnings(self.source, self.report):
            return self._run()

    def _run(self) -> Result:
        counts = self._counts()
        self._note_unused()
        with self.maps.threaded(()):  # maps are written behind
            self._convert(None)
            self._convert_other_variants()
        if not any(counts.values()) and not self.layer.rootPrims:  # in no variant either
            refused = (f.text for f in self.report if f.code == "file-refused")
            text = next(refused, "nothing in it that a stage could show")
            raise InputError(self.source, text)
        self.lights.write_sky()
        self.lights.note_kept()
        self.materials.note_kept()
        materials, images = self.materials.account()
        self._save()
        self._validate()
        self.lights.count_shown()
        result = Result(
            self.output,
            self.report,
            counts=counts,
            lights=self.lights.rows,
            materials=materials,
            images=images,
            textures=self.maps.written | self.luminaires.written | self.skies.written,
            diagonal=self._diagonal(),
            ground=extents(self.stage)[1],
            unit_stated=self.unit_stated,
            source=self.source,
            parts=set(files_of(self.stage)),
        )
        result.note_unmatched(self.sidecar, self.options)
        return result

    def _convert(self, brought: Brought | None) -> None:
        """Write over what is there now; ``brought``: only over what a variant brings."""
        self.lights.selected = brought is None
        shared: dict[Sdf.Path, list[Usd.Prim]] = {}
        for prim in list(all_prims(self.stage)):
            material, light = prim.IsA(UsdShade.Material), is_light(prim)
            rule = self.sidecar.match("node", prim.GetName(), str(prim.GetPath()))
            if not material and not light and rule is None:
                continue
            if brought is not None and not brought.has(self.overs, prim):
                continue
            if material:
                self.materials.write(prim)
            elif light and not prim.IsInPrototype():
                self.lights.write(prim, [prim])
            elif light:
                # A walk through all instances, which most variants bring no light into.
                shared = shared or light_places(self.stage)
                self.lights.write(prim, shared[prim.GetPath()])
            if rule is not None and "visible" in rule.values and prim.IsA(UsdGeom.Imageable):
                token = "inherited" if rule.values["visible"] else "invisible"
                self.overs.value(prim, "visibility", Sdf.ValueTypeNames.Token, token)

    def _convert_other_variants(self) -> None:
        """Each variant that is not selected, one by one, and those that it brings itself."""
        session = self.stage.GetSessionLayer()
        chains: list[_Choices] = [(choice,) for choice in self._unselected(())]
        for number, chain in enumerate(chains):  # grows
            if number == _MOST_VARIANTS:
                text = f"more than {_MOST_VARIANTS} variants; those behind are not converted"
                self._note(Kind.CLAMPED, "usd-variants", "", text)
                break
            session.Clear()
            for choice in chain:
                choice.select(session)
            self.overs.forget()
            self._convert(chain[-1].brought(self.overs))
            chains += [(*chain, choice) for choice in self._unselected(chain)]
        session.Clear()
        self.overs.forget()
        for prototype in self.stage.GetPrototypes():
            for prim in Usd.PrimRange(prototype):
                if prim != prototype and prim.HasVariantSets():
                    place = str(self.overs.place(prim).StripAllVariantSelections())
                    text = "variants inside an instance; only those selected are converted"
                    self._note(Kind.DROPPED, "usd-variants", place, text)

    def _unselected(self, chain: _Choices) -> list[Choice]:
        """The variants not selected: all, or those that the last of a chain brings itself."""
        brought = chain[-1].brought(self.overs) if chain else None
        known = {path for choice in chain for path in choice.holders}
        found: list[Choice] = []
        for prim in self.stage.Traverse():
            if not prim.HasVariantSets() or prim.GetPath() in known:
                continue
            if brought is None or brought.has(self.overs, prim):
                found += (these := other_variants(prim))
                known.update(path for choice in these for path in choice.holders)
        return found

    # -- what is asked and said --------------------------------------------------------------

    def _check_output(self) -> None:
        """Raises InputError where a file of the source would be overwritten, or go."""
        stem = self.output.stem
        folder = self.output.parent.resolve()
        replaced = {folder / f"{stem}.usda", folder / f"{stem}.photometry.usda"}
        replaced.update(file.resolve() for file in earlier_files(self.output))
        for file in files_of(self.stage):
            real = file.resolve()
            if real in replaced:
                raise InputError(self.output, f"would replace {real}; want another name")

    def _note_unused(self) -> None:
        """What is asked of other formats and has no meaning for a stage."""
        unit = UsdGeom.GetStageMetersPerUnit(self.stage)
        if self.options.meters_per_unit not in (1.0, unit):
            text = f"--metersPerUnit is not used; the stage keeps its {unit:g} m"
            self._note(Kind.DROPPED, "usd-option", "", text)
        if not self.unit_stated:
            text = f"no metersPerUnit; {unit:g}, as USD reads it. See --source-unit"
            self._note(Kind.ASSUMED, "no-units", "", text)
        for rule in self.sidecar.rules:
            if rule.section == "camera":
                rule.matched = True
                text = "a stage has its own cameras; not used"
                self.report.add(Kind.DROPPED, "usd-rule-unused", rule.place, rule.pattern, text)

    def _note(self, kind: Kind, code: str, thing: str, text: str) -> None:
        self.report.add(kind, code, SourceRef(self.source), thing, text)

    def _diagonal(self) -> float:
        """Of the whole scene, m."""
        purposes = [UsdGeom.Tokens.default_, UsdGeom.Tokens.render]
        cache = UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), purposes)
        box = cache.ComputeWorldBound(self.stage.GetPseudoRoot()).ComputeAlignedRange()
        size = 0.0 if box.IsEmpty() else float(box.GetSize().GetLength())
        return size * float(UsdGeom.GetStageMetersPerUnit(self.stage))

    def _counts(self) -> dict[str, int]:
        """What there is, each shared thing once."""
        counts = dict.fromkeys(("meshes", "triangles", "materials", "textures", "lights"), 0)
        counts["cameras"] = 0
        files: set[str] = set()
        for prim in all_prims(self.stage):
            if prim.IsA(UsdGeom.Gprim):
                counts["meshes"] += 1
                if prim.IsA(UsdGeom.Mesh):
                    attribute = UsdGeom.Mesh(prim).GetFaceVertexCountsAttr()
                    faces = np.asarray(attribute.Get(Usd.TimeCode.EarliestTime()) or [], np.int64)
                    counts["triangles"] += int(np.maximum(faces - 2, 0).sum())
            counts["materials"] += prim.IsA(UsdShade.Material)
            counts["cameras"] += prim.IsA(UsdGeom.Camera)
            file = prim.GetAttribute("inputs:file") if prim.IsA(UsdShade.Shader) else None
            asset = file.Get() if file else None
            if isinstance(asset, Sdf.AssetPath) and asset.path:
                files.add(asset.resolvedPath or asset.path)
        counts["lights"] = len(light_places(self.stage))
        counts["textures"] = len(files)
        return counts

    # -- writing -----------------------------------------------------------------------------

    def _save(self) -> None:
        """The photometry layer, and the root layer, which names it and the source."""
        default = self.stage.GetDefaultPrim()
        if default and self.layer.rootPrims:
            inputs = authorship_inputs(self.source, self.sidecar.path)
            write_authorship(self.layer, default.GetPath(), inputs, default)
        root = new_layer(self.folder / self.output.name)
        copy_stage_metadata(self.stage.GetRootLayer(), root)
        way = os.path.relpath(self.source.resolve(), self.output.parent.resolve())
        root.subLayerPaths[:] = [f"./{self.output.stem}.photometry.usda", relative(Path(way))]
        for layer in (self.layer, root):
            save_layer(layer)

    def _validate(self) -> None:
        """The stage as it is now; what its source has wrong itself is no reason to refuse it."""
        before = set(validate(self.stage))
        self.stage.GetRootLayer().subLayerPaths.insert(0, self.layer.identifier)
        problems = validate(self.stage)
        errors = [p for p in problems if p.severity == "error" and p not in before]
        if errors:
            raise ValidationError("; ".join(f"{p.path}: {p.text}" for p in errors[:3]))
        for problem in problems:
            kind = Kind.INVALID if problem.severity == "error" else Kind.ASSUMED
            place = SourceRef(self.output)
            self.report.add(kind, "validation", place, str(problem.path), problem.text)


def _own_measures(stage: Usd.Stage) -> Measures:
    said = source_layer(stage).pseudoRoot
    return Measures(
        UsdGeom.GetStageMetersPerUnit(stage) if said.HasInfo("metersPerUnit") else None,
        str(UsdGeom.GetStageUpAxis(stage)) if said.HasInfo("upAxis") else None,
    )
