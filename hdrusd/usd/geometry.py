"""One gprim of any schema at one time, as the corner arrays that shader 1 draws."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from pxr import Usd, UsdGeom

from hdrusd.report import Kind, Report
from hdrusd.scene import Geometry
from hdrusd.usd.arrays import rows
from hdrusd.usd.curves import read_curves
from hdrusd.usd.findings import prim_finding
from hdrusd.usd.mesh import Topology, read_mesh
from hdrusd.usd.points import read_points
from hdrusd.usd.shapes import shape_surface
from hdrusd.usd.skel import Skin
from hdrusd.usd.surface import Surface
from hdrusd.usd.tets import read_tets
from hdrusd.usd.triangles import Corners

Floats = npt.NDArray[np.float32]

#: Attributes that shape a gprim, of all the schemas.
_SHAPING = (
    *("points", "normals", "faceVertexIndices", "faceVertexCounts", "holeIndices"),
    *("creaseIndices", "creaseLengths", "creaseSharpnesses", "cornerIndices"),
    *("cornerSharpnesses", "tetVertexIndices", "surfaceFaceVertexIndices"),
    *("curveVertexCounts", "widths", "orientation"),
    *("size", "radius", "radiusTop", "radiusBottom", "height", "width", "length", "axis"),
)


def time_varying(prim: Usd.Prim) -> bool:
    """Whether the shape itself (not its place) may change between frames."""
    attributes = [prim.GetAttribute(name) for name in _SHAPING]
    attributes += [pv.GetAttr() for pv in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithValues()]
    return any(a and a.ValueMightBeTimeVarying() for a in attributes)


class GeometryReader:
    """One gprim at one time, from which the triangles of any set of faces are cut.

    ``level``: refinements of subdivision cages and of curves. ``skin``: what deforms it.
    ``topology``: of a mesh, read at another time, where it does not vary; afterwards the
    one that was used, or None.
    """

    def __init__(
        self,
        prim: Usd.Prim,
        time: Usd.TimeCode,
        report: Report,
        *,
        level: int = 0,
        skin: Skin | None = None,
        topology: Topology | None = None,
    ) -> None:
        self.prim = prim
        self.time = time
        self.report = report
        self.topology = topology
        self._surface = self._read(level, skin)

    def _read(self, level: int, skin: Skin | None) -> Surface | None:
        prim, time = self.prim, self.time
        surface: Surface | None
        if prim.IsA(UsdGeom.Mesh):
            made = read_mesh(
                prim, time, self._finding, level=level, skin=skin, topology=self.topology
            )
            if made is None:
                return None
            surface, self.topology = made
            return surface
        if prim.IsA(UsdGeom.BasisCurves):
            return read_curves(prim, time, self._finding, level=level)
        if prim.IsA(UsdGeom.Points):
            return read_points(prim, time, self._finding)
        if prim.IsA(UsdGeom.TetMesh):
            return read_tets(prim, time, self._finding)
        surface = shape_surface(prim, time)
        if surface is None:
            text = f"{prim.GetTypeName()} is not drawn"
            self._finding(Kind.DROPPED, "gprim-unknown", text)
        return surface

    def cut(
        self,
        key: str,
        faces: npt.NDArray[np.bool_] | None,
        uv_sets: list[str],
        color: str,
        version: int,
    ) -> Geometry | None:
        """Corner arrays of the faces marked (all when None); None when nothing is left."""
        if self._surface is None:
            return None
        tri = self._surface.triangles
        if faces is not None:
            tri = tri.select(faces)
        if tri.face.size == 0:
            return None
        uvs = {name: values for name in uv_sets if (values := self._uv(tri, name)) is not None}
        colors = {}
        if color and (values := self._primvar(tri, color, 3)) is not None:
            colors[color] = self._reflecting(values, color)
        return Geometry(
            key=key,
            version=version,
            points=self._surface.points[tri.vertex.ravel()],
            normals=self._surface.normals(tri),
            uvs=uvs,
            colors=colors,
        )

    def _reflecting(self, values: Floats, name: str) -> Floats:
        """Vertex colours as factors on a reflectance: finite and not negative."""
        if np.isfinite(values).all() and (values >= 0.0).all():
            return values
        self._finding(Kind.INVALID, "color-invalid", f"{name} is not finite or negative; 0 there")
        return np.maximum(np.nan_to_num(values, posinf=0.0, neginf=0.0), 0.0)

    def _uv(self, tri: Corners, name: str) -> Floats | None:
        values = self._primvar(tri, name, 2)
        if values is None:
            self._finding(
                Kind.MISSING, "uv-missing", f"no usable primvar {name} for its texture; 0 is used"
            )
        return values

    def _primvar(self, tri: Corners, name: str, width: int) -> Floats | None:
        primvar = UsdGeom.PrimvarsAPI(self.prim).FindPrimvarWithInheritance(name)
        if not primvar or not primvar.HasValue():
            return None
        values = rows(primvar.ComputeFlattened(self.time), width)
        if values is None:
            return None
        assert self._surface is not None
        interpolation = str(primvar.GetInterpolation())
        return self._surface.expand(values[:, :width], interpolation, tri)

    def _finding(self, kind: Kind, code: str, text: str) -> None:
        prim_finding(self.report, self.prim, kind, code, text)
