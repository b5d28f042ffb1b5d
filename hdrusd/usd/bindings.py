"""Which faces of a gprim wear which material, and those materials at a time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd, UsdGeom, UsdShade

from hdrusd.report import Kind, Report
from hdrusd.scene import Geometry, Material
from hdrusd.usd.findings import prim_finding
from hdrusd.usd.preview import MaterialReader


@dataclass(slots=True)
class Piece:
    """The faces of a gprim (all when None) that wear one material."""

    faces: npt.NDArray[np.bool_] | None
    material: int
    geometry: Geometry | None = None


class Bindings:
    """The materials of one stage, in a table; each is read once, or again where it may vary."""

    def __init__(self, stage: Usd.Stage, report: Report) -> None:
        self.materials: list[Material] = []
        self.report = report
        self._ids: dict[_Worn, int] = {}
        self._reader = MaterialReader(stage, report)
        self._read_as: dict[Sdf.Path, Material] = {}
        self._varying: dict[Sdf.Path, UsdShade.Material] = {}

    def update(self, code: Usd.TimeCode) -> None:
        """Read again what may have changed since the last frame."""
        for path, material in self._varying.items():
            self._read_as[path] = self._reader.read(material, code) or Material()
        for worn, index in self._ids.items():
            if worn.material in self._varying:
                self.materials[index] = worn.dress(self._read_as[worn.material])

    def pieces(self, prim: Usd.Prim, code: Usd.TimeCode) -> list[Piece]:
        """The material of each face: subsets of family materialBind, and the rest."""
        binding = UsdShade.MaterialBindingAPI(prim)
        subsets = list(binding.GetMaterialBindSubsets()) if prim.IsA(UsdGeom.Mesh) else []
        whole = Piece(None, self._material(prim, binding, code))
        if not subsets:
            return [whole]
        counts = UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get(code)
        rest = np.ones(len(counts or []), np.bool_)
        pieces = []
        for subset in subsets:
            if subset.GetIndicesAttr().ValueMightBeTimeVarying():
                text = "its faces change in time; those of the first time shown are used"
                prim_finding(self.report, subset.GetPrim(), Kind.DROPPED, "subset-animated", text)
            index = np.asarray(subset.GetIndicesAttr().Get(code) or [], np.int64)
            index = index[(index >= 0) & (index < rest.size)]
            faces = np.zeros(rest.size, np.bool_)
            faces[index] = True
            rest[index] = False
            own = UsdShade.MaterialBindingAPI(subset.GetPrim())
            pieces.append(Piece(faces, self._material(subset.GetPrim(), own, code)))
        if rest.any():
            pieces.append(Piece(rest, whole.material))
        return pieces

    def _material(
        self, prim: Usd.Prim, binding: UsdShade.MaterialBindingAPI, code: Usd.TimeCode
    ) -> int:
        bound, _ = binding.ComputeBoundMaterial()
        worn, material = self._bound(bound, prim, code) if bound else self._bare(prim, code)
        if worn not in self._ids:
            self._ids[worn] = len(self.materials)
            self.materials.append(worn.dress(material))
        return self._ids[worn]

    def _bound(
        self, bound: UsdShade.Material, prim: Usd.Prim, code: Usd.TimeCode
    ) -> tuple[_Worn, Material]:
        path = bound.GetPath()
        if path not in self._read_as:
            self._read_as[path] = self._reader.read(bound, code) or Material()
            if _varies(bound.GetPrim()):
                self._varying[path] = bound
        material = self._read_as[path]
        opacity = self._opacity(prim, material.vertex_opacity, code)
        colored = not material.vertex_color or _has(prim, material.vertex_color)
        if not colored:
            text = f"no primvar {material.vertex_color}; what stands for it is used"
            prim_finding(self.report, prim, Kind.MISSING, "primvar-missing", text)
        return _Worn(path, colored=colored, opacity=opacity), material

    def _bare(self, prim: Usd.Prim, code: Usd.TimeCode) -> tuple[_Worn, Material]:
        """Without a material: what displayColor and displayOpacity say."""
        opacity = self._opacity(prim, "displayOpacity", code)
        material = Material(vertex_opacity="displayOpacity", presence=True)
        if not _has(prim, "displayColor"):
            return _Worn(None, colored=False, opacity=opacity), material
        colored = replace(material, diffuse=(1.0, 1.0, 1.0), vertex_color="displayColor")
        return _Worn(None, colored=True, opacity=opacity), colored

    def _opacity(self, prim: Usd.Prim, name: str, code: Usd.TimeCode) -> float | None:
        """The opacity that a gprim's primvar gives it as a whole; None where it has none."""
        if not name or not _has(prim, name):
            return None
        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
        if primvar.ValueMightBeTimeVarying():
            text = f"{name} changes in time; that of the first time shown is used"
            prim_finding(self.report, prim, Kind.DROPPED, "opacity-animated", text)
        value = primvar.ComputeFlattened(code)
        values = np.ravel(np.asarray(value if value is not None else []))
        if values.size == 0 or values.dtype.kind not in "fiu" or not np.isfinite(values).all():
            text = f"{name} is no finite number"
            prim_finding(self.report, prim, Kind.INVALID, "display-opacity", text)
            return None
        low, mean = float(values.min()), float(np.clip(values, 0.0, 1.0).mean())
        if low != float(values.max()):
            text = f"{name} varies over the gprim; its mean {mean:.3g} is used"
            prim_finding(self.report, prim, Kind.REPLACED, "display-opacity", text)
        return mean


@dataclass(frozen=True, slots=True)
class _Worn:
    """A material as one gprim wears it: which of the primvars it reads are there."""

    material: Sdf.Path | None
    colored: bool
    opacity: float | None

    def dress(self, material: Material) -> Material:
        """The material with what its primvars say about the whole gprim."""
        if material.vertex_color and not self.colored:
            r, g, b = (d * a for d, a in zip(material.diffuse, material.vertex_absent, strict=True))
            material = replace(material, diffuse=(r, g, b), vertex_color="")
        if self.opacity is not None:
            material = replace(material, opacity=self.opacity, opacity_map=None)
        through = material.opacity < 1.0 or material.opacity_map is not None
        blend = through and material.opacity_threshold <= 0.0
        presence = blend and material.presence
        return replace(material, vertex_opacity="", blend=blend, presence=presence)


def _has(prim: Usd.Prim, name: str) -> bool:
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    return bool(primvar) and bool(primvar.HasValue())


def _varies(material: Usd.Prim) -> bool:
    """Whether any value of a material's network may change in time, wherever its nodes are."""
    network = Usd.PrimRange(material, Usd.TraverseInstanceProxies())
    pending = [attribute for prim in network for attribute in prim.GetAuthoredAttributes()]
    known: set[Sdf.Path] = set()
    while pending:
        attribute = pending.pop()
        if attribute.GetPath() in known:
            continue
        known.add(attribute.GetPath())
        if attribute.ValueMightBeTimeVarying():
            return True
        for path in attribute.GetConnections():
            source = material.GetStage().GetAttributeAtPath(path)
            if source and UsdShade.Output.IsOutput(source):  # of a node, which reads its inputs
                pending += source.GetPrim().GetAuthoredAttributes()
            if source:
                pending.append(source)
    return False
