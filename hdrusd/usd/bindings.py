"""Which faces of a gprim wear which material, and those materials at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd, UsdGeom, UsdShade

from hdrusd.report import Report
from hdrusd.scene import Geometry, Material
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
        self._ids: dict[Sdf.Path | str, int] = {}
        self._reader = MaterialReader(stage, report)
        self._varying: dict[int, UsdShade.Material] = {}

    def update(self, code: Usd.TimeCode) -> None:
        """Read again what may have changed since the last frame."""
        for index, material in self._varying.items():
            self.materials[index] = self._reader.read(material, code) or Material()

    def pieces(self, prim: Usd.Prim, code: Usd.TimeCode) -> list[Piece]:
        """The material of each face: subsets of family materialBind, and the rest."""
        binding = UsdShade.MaterialBindingAPI(prim)
        subsets = list(binding.GetMaterialBindSubsets())
        whole = Piece(None, self._material(prim, binding, code))
        if not subsets:
            return [whole]
        counts = UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get(code)
        rest = np.ones(len(counts or []), np.bool_)
        pieces = []
        for subset in subsets:
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
        key = bound.GetPath() if bound else _display_color(prim)
        if key not in self._ids:
            self._ids[key] = len(self.materials)
            self.materials.append(self._read(bound, str(key), code))
            if bound and _varies(bound.GetPrim()):
                self._varying[self._ids[key]] = bound
        return self._ids[key]

    def _read(self, bound: UsdShade.Material, primvar: str, code: Usd.TimeCode) -> Material:
        if bound:
            return self._reader.read(bound, code) or Material()
        return Material(diffuse=(1.0, 1.0, 1.0), vertex_color=primvar) if primvar else Material()


def _display_color(prim: Usd.Prim) -> str:
    """The primvar that colours a gprim without a material; "" where there is none."""
    color = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("displayColor")
    return "displayColor" if color and color.HasValue() else ""


def _varies(material: Usd.Prim) -> bool:
    """Whether any value of a material's own network may change in time."""
    return any(
        attribute.ValueMightBeTimeVarying()
        for prim in Usd.PrimRange(material, Usd.TraverseInstanceProxies())
        for attribute in prim.GetAuthoredAttributes()
    )
