"""Meshes: ``write_mesh`` from the legacy record, ``read_mesh`` as a surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd, UsdGeom, Vt

from hdrusd.legacy.scene import Mesh
from hdrusd.report import Kind
from hdrusd.usd.arrays import integers, rows
from hdrusd.usd.cage import Polygons, refined_cage
from hdrusd.usd.skel import Skin
from hdrusd.usd.specs import attribute, primvar
from hdrusd.usd.subdivision import Refined
from hdrusd.usd.surface import Note, Surface
from hdrusd.usd.triangles import Corners, corners, face_normals, smooth_normals

Floats = npt.NDArray[np.float32]

#: Primvar of vertex colours in the stages that we write.
COLOR_PRIMVAR = "displayColor"
OPACITY_PRIMVAR = "displayOpacity"


def write_mesh(prim: Sdf.PrimSpec, mesh: Mesh) -> None:
    """What a UsdGeomMesh says (subdivisionScheme none), its primvars; no material, no transform.

    Legacy units are kept: the root's transform scales them.
    """
    types = Sdf.ValueTypeNames
    attribute(prim, "subdivisionScheme", types.Token, "none", uniform=True)
    attribute(prim, "points", types.Point3fArray, Vt.Vec3fArray.FromNumpy(mesh.points))
    counts, indices = map(Vt.IntArray.FromNumpy, (mesh.face_counts, mesh.face_indices))
    attribute(prim, "faceVertexCounts", types.IntArray, counts)
    attribute(prim, "faceVertexIndices", types.IntArray, indices)
    if len(mesh.points):
        box = np.stack([mesh.points.min(axis=0), mesh.points.max(axis=0)])
        attribute(prim, "extent", types.Float3Array, Vt.Vec3fArray.FromNumpy(box))
    # False too: it asks renderers to cull.
    attribute(prim, "doubleSided", types.Bool, mesh.two_sided, uniform=True)
    if mesh.left_handed:
        attribute(prim, "orientation", types.Token, "leftHanded", uniform=True)
    if mesh.normals is not None:
        normals = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(mesh.normals))
        primvar(prim, "normals", types.Normal3fArray, normals, mesh.normals_interpolation)
    for name, (values, interpolation) in mesh.uvs.items():
        uv = Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(values))
        primvar(prim, f"primvars:{name}", types.TexCoord2fArray, uv, interpolation)
    if mesh.colors is not None:
        color = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(mesh.colors[:, :3]))
        way = mesh.colors_interpolation
        primvar(prim, f"primvars:{COLOR_PRIMVAR}", types.Color3fArray, color, way)
        if float(mesh.colors[:, 3].min(initial=1.0)) < 1.0:
            opacity = Vt.FloatArray.FromNumpy(np.ascontiguousarray(mesh.colors[:, 3]))
            primvar(prim, f"primvars:{OPACITY_PRIMVAR}", types.FloatArray, opacity, way)


def topology_varies(prim: Usd.Prim) -> bool:
    """Whether faces and what subdivides them may change between frames."""
    names = ("faceVertexIndices", "faceVertexCounts", "holeIndices", "creaseIndices")
    more = ("creaseLengths", "creaseSharpnesses", "cornerIndices", "cornerSharpnesses")
    attributes = [prim.GetAttribute(name) for name in (*names, *more, "orientation")]
    return any(a and a.ValueMightBeTimeVarying() for a in attributes)


@dataclass(frozen=True, slots=True, eq=False)
class Topology:
    """What of a mesh is not in its points: faces, refined as often as was asked for."""

    size: int  # points that it was made for
    indices: npt.NDArray[np.int64]  # the point of each corner, as the prim has them
    triangles: Corners  # of the finest level; ``face`` counts those of the prim
    refined: Refined | None  # where a subdivision scheme is followed
    kept: npt.NDArray[np.int64]  # corners of the prim that are in ``refined``
    smooth: bool  # a subdivision cage: its normals are smooth


def read_topology(
    mesh: UsdGeom.Mesh, time: Usd.TimeCode, size: int, level: int, note: Note
) -> Topology | None:
    """The faces of a mesh with ``size`` points, refined ``level`` times if it is a cage.

    What is broken is noted and left out; None where nothing is left to be drawn.
    """
    counts, indices = (
        integers(a.Get(time))
        for a in (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr())
    )
    left_handed = mesh.GetOrientationAttr().Get(time) == UsdGeom.Tokens.leftHanded
    smooth = mesh.GetSubdivisionSchemeAttr().Get() != UsdGeom.Tokens.none
    try:
        tri = corners(counts, indices, left_handed=left_handed)
    except ValueError as problem:
        note(Kind.INVALID, "mesh-topology", f"{problem}; not drawn")
        return None
    bad = (indices < 0) | (indices >= size)
    if bad.any():
        note(Kind.INVALID, "mesh-index", "faces name points that are not there; left")
        tri = tri.where(~bad[tri.corner].any(axis=1))
    holes = integers(mesh.GetHoleIndicesAttr().Get(time))
    solid = np.ones(counts.size, np.bool_)
    solid[holes[(holes >= 0) & (holes < counts.size)]] = False
    refined, kept = None, np.zeros(0, np.int64)
    if smooth and level > 0:
        made = refined_cage(mesh, time, Polygons(counts, indices, ~bad, size), level, note)
        if made is not None:
            refined, faces, kept, shown = made
            solid &= shown
            tri = corners(refined.counts, refined.indices, left_handed=left_handed)
            tri = Corners(tri.vertex, tri.corner, faces[tri.face])
    if not solid.all():
        tri = tri.select(solid)
    return Topology(size, indices, tri, refined, kept, smooth)


def read_mesh(
    prim: Usd.Prim,
    time: Usd.TimeCode,
    note: Note,
    *,
    level: int = 0,
    skin: Skin | None = None,
    topology: Topology | None = None,
) -> tuple[Surface, Topology] | None:
    """The surface of a mesh at a time, and its topology, which serves other times too.

    ``level``: refinements of a subdivision cage. ``topology``: of another time, where it
    does not vary. None where there is nothing to be drawn.
    """
    mesh = UsdGeom.Mesh(prim)
    given = rows(mesh.GetPointsAttr().Get(time), 3)
    points = np.zeros((0, 3), np.float32) if given is None else given[:, :3].astype(np.float32)
    if topology is None or topology.size != len(points):
        topology = read_topology(mesh, time, len(points), level, note)
    if topology is None:
        return None
    if skin is not None:
        points = skin.points(points, time)
    normals = _given_normals(mesh, time, topology, skin)
    if topology.refined is not None:
        spoilt = ~np.isfinite(points)
        points[spoilt] = np.nan  # which, unlike infinity, is no error in a sum
        points = topology.refined.vertex(points)
    tri = topology.triangles
    finite: npt.NDArray[np.bool_] = np.asarray(np.isfinite(points).all(axis=1))
    if not finite.all():
        note(Kind.INVALID, "mesh-not-finite", "points are not finite; their faces left")
        tri = tri.where(finite[tri.vertex].all(axis=1))
        points = np.where(finite[:, None], points, np.float32(0.0))
    surface = Surface(
        points,
        tri,
        lambda some: _normals(points, topology, normals, some, note),
        lambda values, interpolation, some: _expand(mesh, topology, values, interpolation, some),
    )
    return surface, topology


#: Values and their interpolation, and whether the prim states any at all.
_Normals = tuple[npt.NDArray[np.generic] | None, str, bool]


def _given_normals(
    mesh: UsdGeom.Mesh, time: Usd.TimeCode, topology: Topology, skin: Skin | None
) -> _Normals:
    """primvars:normals, then normals, turned by the skin; a refined cage has its own."""
    if topology.refined is not None:
        return None, "", False
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
    if primvar and primvar.HasValue():
        values, stated = rows(primvar.ComputeFlattened(time), 3), True
        interpolation = str(primvar.GetInterpolation())
    else:
        given = mesh.GetNormalsAttr().Get(time)
        values, stated = rows(given, 3), bool(given)
        interpolation = str(mesh.GetNormalsInterpolation())
    if values is None or skin is None:
        return values, interpolation, stated
    vertices = topology.indices if interpolation == "faceVarying" else np.arange(topology.size)
    if interpolation in ("uniform", "constant") or len(values) != len(vertices):
        return None, interpolation, False  # of no point: computed from the moved ones
    turned = skin.normals(values[:, :3].astype(np.float32), vertices, topology.size, time)
    return turned, interpolation, turned is not None


def _normals(
    points: Floats, topology: Topology, given: _Normals, tri: Corners, note: Note
) -> Floats:
    """Those given; else flat for polygons, smooth for a subdivision cage."""
    values, interpolation, stated = given
    taken = None if values is None else tri.take(values, interpolation)
    if taken is None:
        if stated:
            note(Kind.INVALID, "mesh-normals", "normals do not fit the mesh; computed")
        return (smooth_normals if topology.smooth else face_normals)(points, tri)
    square = np.einsum("ij,ij->i", taken, taken, dtype=np.float64)
    usable = (square > 1e-18) & (square < 1e18)  # False for NaN; float32 can square these
    if not usable.all():
        text = "normals without a direction; those of the faces are used there"
        note(Kind.INVALID, "mesh-normals", text)
        taken = np.where(usable[:, None], taken, face_normals(points, tri))
    return taken


def _expand(
    mesh: UsdGeom.Mesh,
    topology: Topology,
    values: npt.NDArray[np.generic],
    interpolation: str,
    tri: Corners,
) -> Floats | None:
    """Values of a primvar at the corners of some triangles."""
    refined = topology.refined
    if refined is not None and len(values) > 1:
        if interpolation in ("vertex", "varying"):
            if len(values) < topology.size:
                return None
            way = refined.vertex if interpolation == "vertex" else refined.varying
            values = way(values[: topology.size])
        elif interpolation == "faceVarying":
            if len(values) < len(topology.indices):
                return None
            rule = str(mesh.GetFaceVaryingLinearInterpolationAttr().Get())
            values = refined.face_varying(values[topology.kept], rule)
    return tri.take(values, interpolation)
