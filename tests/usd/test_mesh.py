"""Meshes written and read: polygons, holes, handedness, primvars, subsets, broken topology."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders import new_spec, new_stage, square
from pxr import Gf, Sdf, Usd, UsdGeom, Vt

from hdrusd.legacy.scene import Mesh
from hdrusd.report import Report
from hdrusd.scene import Geometry
from hdrusd.usd.geometry import GeometryReader, time_varying
from hdrusd.usd.mesh import write_mesh

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
ROOF = np.array([*SQUARE, (0.5, 0.5, 1)], np.float32)


def usd_mesh(
    points: Any = SQUARE, counts: Any = (4,), indices: Any = (0, 1, 2, 3), **attributes: Any
) -> UsdGeom.Mesh:
    mesh = UsdGeom.Mesh.Define(new_stage(), "/Mesh")
    mesh.CreatePointsAttr([Gf.Vec3f(*map(float, p)) for p in points])
    mesh.CreateFaceVertexCountsAttr(list(counts))
    mesh.CreateFaceVertexIndicesAttr(list(indices))
    mesh.CreateSubdivisionSchemeAttr("none")
    for name, value in attributes.items():
        mesh.GetPrim().GetAttribute(name).Set(value)
    return mesh


def cut(
    mesh: Any,
    report: Report | None = None,
    *,
    uvs: tuple[str, ...] = (),
    color: str = "",
    faces: Any = None,
    time: float = 0.0,
) -> Geometry | None:
    prim = mesh.GetPrim() if hasattr(mesh, "GetPrim") else mesh
    reader = GeometryReader(prim, Usd.TimeCode(time), Report() if report is None else report)
    return reader.cut("mesh", faces, list(uvs), color, 0)


def drawn(mesh: Any, report: Report | None = None, **options: Any) -> Geometry:
    made = cut(mesh, report, **options)
    assert made is not None
    return made


def uv_primvar(mesh: Any, name: str, values: Any, interpolation: str) -> UsdGeom.Primvar:
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        name, Sdf.ValueTypeNames.TexCoord2fArray, interpolation
    )
    primvar.Set([Gf.Vec2f(*v) for v in values])
    return primvar


# -- writing ------------------------------------------------------------------------------


def written(mesh: Mesh) -> Usd.Prim:
    stage = new_stage()
    write_mesh(new_spec(stage, "/Wall", "Mesh"), mesh)
    return stage.GetPrimAtPath("/Wall")


def test_a_polygon_stays_a_polygon() -> None:
    prim = written(square(two_sided=False))
    mesh = UsdGeom.Mesh(prim)
    assert list(mesh.GetFaceVertexCountsAttr().Get()) == [4]
    assert mesh.GetSubdivisionSchemeAttr().Get() == "none"
    assert mesh.GetDoubleSidedAttr().Get() is False
    assert mesh.GetOrientationAttr().Get() == "rightHanded"
    assert [list(v) for v in mesh.GetExtentAttr().Get()] == [[0, 0, 0], [1, 1, 0]]
    made = drawn(prim, uvs=("st",))
    corners = np.array(SQUARE)[[0, 1, 2, 0, 2, 3]]
    assert made.points.tolist() == corners.tolist()
    assert made.uvs["st"].tolist() == corners[:, :2].tolist()
    assert made.normals.tolist() == [[0, 0, 1]] * 6


def test_everything_of_the_record_is_written_and_read() -> None:
    colors = np.array([[1, 0, 0, 1], [0, 1, 0, 0.5], [0, 0, 1, 1], [1, 1, 1, 1]], np.float32)
    normals = np.array([[0, 0.6, 0.8]], np.float32)
    second = np.arange(8, dtype=np.float32).reshape(4, 2)
    mesh = square(
        colors=colors,
        normals=normals,
        normals_interpolation="constant",
        uvs={"st": (second / 10, "vertex"), "st1": (second, "faceVarying")},
        left_handed=True,
    )
    prim = written(mesh)
    assert UsdGeom.Mesh(prim).GetDoubleSidedAttr().Get() is True
    made = drawn(prim, uvs=("st", "st1"), color="displayColor")
    order = [0, 2, 1, 0, 3, 2]  # left-handed: the other way round
    assert made.uvs["st1"].tolist() == second[order].tolist()
    assert made.uvs["st"] == pytest.approx(second[order] / 10)
    assert made.colors["displayColor"].tolist() == colors[order, :3].tolist()
    assert made.normals == pytest.approx(np.tile(normals, (6, 1)))
    assert list(UsdGeom.Gprim(prim).GetDisplayOpacityAttr().Get()) == [1.0, 0.5, 1.0, 1.0]


def test_opaque_colours_have_no_opacity() -> None:
    prim = written(square(colors=np.ones((4, 4), np.float32)))
    assert not UsdGeom.Gprim(prim).GetDisplayOpacityAttr().HasAuthoredValue()


def test_a_mesh_without_points_draws_nothing() -> None:
    empty = square(
        points=np.zeros((0, 3), np.float32),
        face_counts=np.zeros(0, np.int32),
        face_indices=np.zeros(0, np.int32),
        uvs={},
    )
    assert cut(written(empty)) is None


# -- reading ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("interpolation", "count", "wanted"),
    [
        ("vertex", 5, [0, 1, 2, 0, 2, 3, 3, 2, 4]),
        ("faceVarying", 7, [0, 1, 2, 0, 2, 3, 4, 5, 6]),
        ("uniform", 2, [0, 0, 0, 0, 0, 0, 1, 1, 1]),
        ("constant", 1, [0] * 9),
    ],
)
def test_interpolations(interpolation: str, count: int, wanted: list[int]) -> None:
    mesh = usd_mesh(ROOF, (4, 3), (0, 1, 2, 3, 3, 2, 4))
    uv_primvar(mesh, "st", [(i, -i) for i in range(count)], interpolation)
    assert drawn(mesh, uvs=("st",)).uvs["st"][:, 0].tolist() == wanted


def test_indexed_primvars_are_flattened() -> None:
    mesh = usd_mesh()
    uv_primvar(mesh, "st", [(0, 0), (5, 5)], "vertex").SetIndices(Vt.IntArray([1, 0, 0, 1]))
    assert drawn(mesh, uvs=("st",)).uvs["st"][:, 0].tolist() == [5, 0, 0, 5, 0, 5]


def test_a_primvar_may_stand_on_a_parent() -> None:
    stage = new_stage()
    parent = UsdGeom.Xform.Define(stage, "/Group")
    mesh = UsdGeom.Mesh.Define(stage, "/Group/Mesh")
    mesh.CreatePointsAttr(SQUARE)
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    color = UsdGeom.PrimvarsAPI(parent).CreatePrimvar(
        "displayColor", Sdf.ValueTypeNames.Color3fArray, "constant"
    )
    color.Set([Gf.Vec3f(1, 0, 0)])
    assert drawn(mesh, color="displayColor").colors["displayColor"].tolist() == [[1, 0, 0]] * 6


def test_holes_are_left_out() -> None:
    mesh = usd_mesh(ROOF, (4, 3), (0, 1, 2, 3, 3, 2, 4), holeIndices=[0])
    assert len(drawn(mesh).points) == 3
    mesh.GetHoleIndicesAttr().Set([0, 1, 7, -1])
    assert cut(mesh) is None


def test_a_subset_of_faces_is_cut_out() -> None:
    mesh = usd_mesh(ROOF, (4, 3), (0, 1, 2, 3, 3, 2, 4))
    assert len(drawn(mesh, faces=np.array([False, True])).points) == 3
    assert len(drawn(mesh, faces=np.array([True, False])).points) == 6
    assert cut(mesh, faces=np.array([False, False])) is None


def test_a_subdivision_cage_is_smooth_and_a_polygon_flat() -> None:
    counts, indices = (3, 3, 3, 3), (0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4)
    flat = usd_mesh(ROOF, counts, indices)
    top = drawn(flat).normals.reshape(-1, 3, 3)[:, 2]
    assert len(np.unique(top.round(6), axis=0)) == 4
    smooth = usd_mesh(ROOF, counts, indices, subdivisionScheme="catmullClark")
    top = drawn(smooth).normals.reshape(-1, 3, 3)[:, 2]
    assert top == pytest.approx(np.tile([0, 0, 1], (4, 1)), abs=1e-6)


def test_primvars_normals_come_before_normals() -> None:
    mesh = usd_mesh()
    mesh.CreateNormalsAttr([Gf.Vec3f(0, 0, 1)] * 4)
    assert drawn(mesh).normals.tolist() == [[0, 0, 1]] * 6
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "normals", Sdf.ValueTypeNames.Normal3fArray, "constant"
    )
    primvar.Set([Gf.Vec3f(0, 1, 0)])
    assert drawn(mesh).normals.tolist() == [[0, 1, 0]] * 6


@pytest.mark.parametrize(
    "bad", [(0, 0, 0), (float("nan"), 0, 0), (float("inf"), 0, 0), (1e20, 0, 0)]
)
def test_a_normal_without_direction_becomes_the_faces(bad: tuple[float, float, float]) -> None:
    mesh = usd_mesh()
    mesh.CreateNormalsAttr([Gf.Vec3f(0, 1, 0)] * 3 + [Gf.Vec3f(*bad)])
    report = Report()
    normals = drawn(mesh, report).normals
    assert normals[5].tolist() == [0, 0, 1]
    assert normals[:5].tolist() == [[0, 1, 0]] * 5
    assert report.codes() == {"mesh-normals"}


def test_normals_that_do_not_fit_are_computed() -> None:
    mesh = usd_mesh()
    mesh.CreateNormalsAttr([Gf.Vec3f(0, 1, 0)] * 2)
    report = Report()
    assert drawn(mesh, report).normals.tolist() == [[0, 0, 1]] * 6
    assert report.codes() == {"mesh-normals"}


@pytest.mark.parametrize(
    ("counts", "indices", "code", "triangles"),
    [
        ((4,), (0, 1, 2), "mesh-topology", 0),
        ((-4,), (0, 1, 2, 3), "mesh-topology", 0),
        ((2_000_000_000,), (0, 1, 2), "mesh-topology", 0),
        ((3, 3), (0, 1, 2, 0, 2, 99), "mesh-index", 1),
        ((3, 3), (0, 1, 2, 0, 2, -1), "mesh-index", 1),
    ],
)
def test_broken_topology(counts: Any, indices: Any, code: str, triangles: int) -> None:
    report = Report()
    made = cut(usd_mesh(SQUARE, counts, indices), report)
    assert report.codes() == {code}
    assert (0 if made is None else len(made.points) // 3) == triangles


def test_faces_of_one_and_two_corners_draw_nothing() -> None:
    assert len(drawn(usd_mesh(SQUARE, (1, 2, 0, 3), (0, 0, 1, 1, 2, 3))).points) == 3


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_points_that_are_not_finite_take_their_faces_along(bad: float) -> None:
    report = Report()
    made = drawn(usd_mesh([*SQUARE[:3], (0, bad, 0)], (3, 3), (0, 1, 2, 0, 2, 3)), report)
    assert len(made.points) == 3
    assert np.isfinite(made.points).all()
    assert report.codes() == {"mesh-not-finite"}


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        (Sdf.ValueTypeNames.TexCoord2fArray, [Gf.Vec2f(0, 0)] * 3),  # too few
        (Sdf.ValueTypeNames.FloatArray, [0.0] * 4),  # not two numbers
        (Sdf.ValueTypeNames.StringArray, ["a"] * 4),
        (Sdf.ValueTypeNames.String, "st"),
        (Sdf.ValueTypeNames.TexCoord2fArray, []),
    ],
)
def test_texture_coordinates_that_cannot_be_used_are_a_finding(kind: Any, value: Any) -> None:
    mesh = usd_mesh()
    UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", kind, "vertex").Set(value)
    report = Report()
    assert drawn(mesh, report, uvs=("st",)).uvs == {}
    assert report.codes() == {"uv-missing"}


def test_indices_of_a_primvar_that_lead_nowhere_are_a_finding() -> None:
    mesh = usd_mesh()
    uv_primvar(mesh, "st", [(0, 0)], "vertex").SetIndices(Vt.IntArray([0, 0, 0, 7]))
    normals = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "normals", Sdf.ValueTypeNames.Normal3fArray, "vertex"
    )
    normals.Set([Gf.Vec3f(0, 1, 0)])
    normals.SetIndices(Vt.IntArray([0, 0, 0, 7]))
    report = Report()
    made = drawn(mesh, report, uvs=("st",))
    assert made.uvs == {}
    assert made.normals.tolist() == [[0, 0, 1]] * 6
    assert report.codes() == {"uv-missing", "mesh-normals"}


def test_attributes_of_another_type_than_the_schemas(tmp_path: Any) -> None:
    layer = tmp_path / "odd.usda"
    layer.write_text(
        '#usda 1.0\ndef Mesh "Mesh"\n{\n    string points = "many"\n'
        "    float[] faceVertexCounts = [3.5]\n    int3[] faceVertexIndices = [(0, 1, 2)]\n}\n"
    )
    stage = Usd.Stage.Open(str(layer))
    assert cut(stage.GetPrimAtPath("/Mesh")) is None


def test_only_what_moves_is_time_varying() -> None:
    mesh = usd_mesh()
    assert not time_varying(mesh.GetPrim())
    points = mesh.GetPointsAttr()
    points.Set([Gf.Vec3f(*p) for p in SQUARE], 0.0)
    points.Set([Gf.Vec3f(p[0] + 2.0, p[1], 5.0) for p in SQUARE], 2.0)
    assert time_varying(mesh.GetPrim())
    assert drawn(mesh, time=1.0).points[0].tolist() == [1.0, 0.0, 2.5]


def test_animated_texture_coordinates_are_time_varying() -> None:
    mesh = usd_mesh()
    primvar = uv_primvar(mesh, "st", [(0, 0)] * 4, "vertex")
    primvar.GetAttr().Set([Gf.Vec2f(0, 0)] * 4, 0.0)
    primvar.GetAttr().Set([Gf.Vec2f(1, 0)] * 4, 1.0)
    assert time_varying(mesh.GetPrim())
