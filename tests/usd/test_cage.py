"""UsdGeomMesh as a cage: what its attributes ask for, and what of them does not fit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders import new_stage
from pxr import Gf, Sdf, Usd, UsdGeom

from hdrusd.report import Report
from hdrusd.scene import Geometry
from hdrusd.usd import cage
from hdrusd.usd.geometry import GeometryReader

CUBE = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
FACES = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]


def mesh(
    points: Any = CUBE, counts: Any = (4,) * 6, indices: Any = FACES, **attributes: Any
) -> UsdGeom.Mesh:
    made = UsdGeom.Mesh.Define(new_stage(), "/Mesh")
    made.CreatePointsAttr([Gf.Vec3f(*map(float, p)) for p in points])
    made.CreateFaceVertexCountsAttr(list(counts))
    made.CreateFaceVertexIndicesAttr(list(indices))
    for name, value in attributes.items():
        made.GetPrim().GetAttribute(name).Set(value)
    return made


def cut(
    made: UsdGeom.Mesh, level: int, report: Report | None = None, **options: Any
) -> Geometry | None:
    report = Report() if report is None else report
    reader = GeometryReader(made.GetPrim(), Usd.TimeCode(0.0), report, level=level)
    faces = options.get("faces")
    return reader.cut("mesh", faces, list(options.get("uvs", ())), options.get("color", ""), 0)


def drawn(made: UsdGeom.Mesh, level: int, report: Report | None = None, **options: Any) -> Geometry:
    geometry = cut(made, level, report, **options)
    assert geometry is not None
    return geometry


def test_the_scheme_of_a_mesh_that_says_nothing_is_catmull_clark() -> None:
    geometry = drawn(mesh(), 1)
    assert len(geometry.points) == 24 * 2 * 3
    # The cube's corner comes to 5/9, its faces' middles stay at 1.
    assert np.abs(geometry.points).max() == pytest.approx(1.0)
    lengths = np.linalg.norm(geometry.points, axis=1)
    assert lengths.min() == pytest.approx(5 / 9 * 3**0.5, abs=1e-6)


def test_without_refinement_the_cage_itself_is_shown_as_before() -> None:
    assert np.abs(drawn(mesh(), 0).points).min() == 1.0


def test_meshes_that_are_no_cages_stay() -> None:
    assert len(drawn(mesh(subdivisionScheme="none"), 3).points) == 6 * 2 * 3


def test_normals_of_a_refined_cage_are_its_own() -> None:
    made = mesh()
    made.CreateNormalsAttr([(1, 0, 0)] * 8)
    made.SetNormalsInterpolation("vertex")
    geometry = drawn(made, 2)
    towards = (geometry.normals * geometry.points).sum(axis=1)
    assert (towards > 0.9 * np.linalg.norm(geometry.points, axis=1)).all()


def test_left_handed_cages_face_the_other_way() -> None:
    right, left = drawn(mesh(), 1), drawn(mesh(orientation="leftHanded"), 1)
    assert (left.normals * left.points).sum(axis=1).max() < 0.0
    assert (right.normals * right.points).sum(axis=1).min() > 0.0


@pytest.mark.parametrize("each", [False, True])
def test_creases_by_crease_or_by_edge(each: bool) -> None:
    made = mesh(
        creaseIndices=[1, 3, 7, 5, 1],
        creaseLengths=[5],
        creaseSharpnesses=[10.0] * 4 if each else [10.0],
    )
    top = drawn(made, 3).points[:, 2]
    assert top.max() == pytest.approx(1.0)
    # The flat top: all 8 x 8 quads, 2 triangles of 3 corners each.
    flat = (np.abs(top.reshape(-1, 3) - 1.0) < 1e-6).all(axis=1)
    assert flat.sum() == 8 * 8 * 2


def test_a_sharp_corner() -> None:
    made = mesh(cornerIndices=[7], cornerSharpnesses=[10.0])
    assert drawn(made, 2).points.sum(axis=1).max() == pytest.approx(3.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"creaseIndices": [1, 99], "creaseLengths": [2], "creaseSharpnesses": [10.0]},
        {"creaseIndices": [1, 3], "creaseLengths": [3], "creaseSharpnesses": [10.0]},
        {"creaseIndices": [1, 3], "creaseLengths": [2], "creaseSharpnesses": []},
        {"creaseIndices": [1, 3], "creaseLengths": [1, 1], "creaseSharpnesses": [1.0, 1.0]},
        {"creaseIndices": [1, 3], "creaseLengths": [2], "creaseSharpnesses": [float("nan")]},
        {"cornerIndices": [-1], "cornerSharpnesses": [1.0]},
        {"cornerIndices": [1, 2], "cornerSharpnesses": [1.0]},
    ],
)
def test_what_does_not_fit_leaves_it_smooth_and_is_said(wrong: dict[str, Any]) -> None:
    report = Report()
    assert np.array_equal(drawn(mesh(**wrong), 1, report).points, drawn(mesh(), 1).points)
    assert report.codes() == {"subdivision"}


@pytest.mark.parametrize(
    ("rule", "corner"), [("edgeAndCorner", 0.0), ("edgeOnly", 0.125), ("none", None)]
)
def test_boundaries(rule: str, corner: float | None) -> None:
    """One quad: its corner stays, is rounded, or it only supports what is not there."""
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    made = mesh(square, [4], range(4), interpolateBoundary=rule)
    geometry = cut(made, 1)
    if corner is None:
        assert geometry is None
    else:
        assert geometry is not None
        assert geometry.points.min(axis=0)[:2].tolist() == [0.0, 0.0]
        assert np.abs(geometry.points[:, :2] - corner).max(axis=1).min() < 1e-6


def test_holes_and_subsets_are_those_of_the_cage() -> None:
    made = mesh(holeIndices=[0])
    assert len(drawn(made, 1).points) == 20 * 2 * 3
    some = np.array([True, True, False, False, False, False])
    assert len(drawn(made, 1, faces=some).points) == 4 * 2 * 3


def test_faces_of_two_corners_and_of_missing_points_are_left_out() -> None:
    report = Report()
    made = mesh(CUBE, [2, 4, 4, *[4] * 5], [0, 1, 0, 1, 3, 99, *FACES])
    geometry = drawn(made, 1, report)
    assert report.codes() == {"mesh-index"}
    assert np.array_equal(geometry.points, drawn(mesh(), 1).points)


def test_points_that_are_not_finite_spoil_what_they_reach() -> None:
    report = Report()
    broken = [*CUBE[:7], (float("inf"), 1, 1)]
    geometry = drawn(mesh(broken), 1, report)
    assert report.codes() == {"mesh-not-finite"}
    assert np.isfinite(geometry.points).all()
    assert 0 < len(geometry.points) < 24 * 6


def test_primvars_come_along_by_their_interpolation() -> None:
    made = mesh()
    api = UsdGeom.PrimvarsAPI(made)
    for name, interpolation, values in (
        ("v", "vertex", [(1.0, 0.0)] * 8),
        ("w", "varying", [(x / 2 + 0.5, y / 2 + 0.5) for x, y, _ in CUBE]),
        ("u", "uniform", [(float(f), 0.0) for f in range(6)]),
        ("c", "constant", [(3.0, 4.0)]),
        ("f", "faceVarying", [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] * 6),
    ):
        primvar = api.CreatePrimvar(name, Sdf.ValueTypeNames.TexCoord2fArray, interpolation)
        primvar.Set([Gf.Vec2f(*value) for value in values])
    got = drawn(made, 2, uvs=("v", "w", "u", "c", "f")).uvs
    count = 6 * 16 * 6
    assert all(values.shape == (count, 2) for values in got.values())
    assert got["v"] == pytest.approx(np.tile([1.0, 0.0], (count, 1)))
    assert got["w"].min() == 0.0  # linear: the corners keep theirs
    assert got["w"].max() == 1.0
    assert np.bincount(got["u"][:, 0].astype(int)).tolist() == [16 * 6] * 6
    assert got["c"][0].tolist() == [3.0, 4.0]
    assert got["f"].min() == 0.0  # every face a chart of its own, with its corners kept
    assert got["f"].max() == 1.0


def test_loop_needs_triangles() -> None:
    report = Report()
    assert len(drawn(mesh(subdivisionScheme="loop"), 2, report).points) == 6 * 2 * 3
    assert report.codes() == {"subdivision"}


def test_refinement_that_would_fill_the_memory_stops_before(monkeypatch: Any) -> None:
    monkeypatch.setattr(cage, "MOST_FACES", 100)
    report = Report()
    geometry = drawn(mesh(), 3, report)  # 24, 96, then 384 quads
    assert len(geometry.points) == 96 * 6
    assert report.codes() == {"subdivision-limit"}
