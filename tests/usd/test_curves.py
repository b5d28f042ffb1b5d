"""Curves as tubes and ribbons, points as balls, tetrahedra as their surface."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from builders import new_stage
from pxr import Gf, Usd, UsdGeom

from hdrusd.report import Report
from hdrusd.scene import Geometry
from hdrusd.usd import curves as module
from hdrusd.usd import points as points_module
from hdrusd.usd.curves import Spans
from hdrusd.usd.geometry import GeometryReader

CONTROL = np.array([[0, 0, 0], [1, 0, 0], [2, 3, 0], [3, 3, 1]], float)


def spans(basis: str, wrap: str, counts: Any, segments: Any, steps: int = 2) -> Spans:
    return Spans(
        np.array(counts), np.array(segments), basis, wrap == "periodic", wrap == "pinned", steps
    )


def test_a_bezier_curve_by_de_casteljau() -> None:
    a, b, c, d = CONTROL
    middle = (a + 3 * b + 3 * c + d) / 8.0
    got = spans("bezier", "nonperiodic", [4], [1]).vertex(CONTROL)
    assert got == pytest.approx(np.stack([a, middle, d]), abs=1e-6)


def test_a_catmull_rom_curve_passes_through_its_points() -> None:
    """Between the inner two; halfway at (-P0 + 9 P1 + 9 P2 - P3) / 16."""
    a, b, c, d = CONTROL
    got = spans("catmullRom", "nonperiodic", [4], [1]).vertex(CONTROL)
    assert got == pytest.approx(np.stack([b, (-a + 9 * b + 9 * c - d) / 16, c]), abs=1e-6)


def test_a_bspline_is_the_mean_of_its_neighbours_at_a_knot() -> None:
    a, b, c, d = CONTROL
    got = spans("bspline", "nonperiodic", [4], [1], 1).vertex(CONTROL)
    assert got == pytest.approx(np.stack([(a + 4 * b + c) / 6, (b + 4 * c + d) / 6]), abs=1e-6)


@pytest.mark.parametrize("basis", ["bspline", "catmullRom"])
def test_pinned_curves_run_from_their_first_point_to_their_last(basis: str) -> None:
    got = spans(basis, "pinned", [4], [3]).vertex(CONTROL)
    assert got[0] == pytest.approx(CONTROL[0], abs=1e-6)
    assert got[-1] == pytest.approx(CONTROL[3], abs=1e-6)


@pytest.mark.parametrize(("basis", "count"), [("bspline", 4), ("catmullRom", 4), ("linear", 4)])
def test_periodic_curves_end_where_they_began(basis: str, count: int) -> None:
    got = spans(basis, "periodic", [count], [count]).vertex(CONTROL)
    assert got[-1] == pytest.approx(got[0], abs=1e-6)
    assert len(got) == 2 * count + 1


def test_values_by_interpolation() -> None:
    """Two curves: linear ones of three and two points, with one sample a segment."""
    line = spans("linear", "nonperiodic", [3, 2], [2, 1], 1)
    values = np.arange(5.0)[:, None]
    for interpolation in ("vertex", "varying"):
        got = line.take(values, interpolation)
        assert got is not None
        assert got[:, 0].tolist() == [0, 1, 2, 3, 4]
    uniform = line.take(np.array([[7.0], [8.0]]), "uniform")
    assert uniform is not None
    assert uniform[:, 0].tolist() == [7, 7, 7, 8, 8]
    constant = line.take(np.array([[7.0]]), "constant")
    assert constant is not None
    assert constant[:, 0].tolist() == [7] * 5
    assert line.take(values[:4], "vertex") is None
    assert line.take(values, "spiral") is None


# -- as geometry --------------------------------------------------------------------------


def curve(points: Any, counts: Any = None, **attributes: Any) -> UsdGeom.BasisCurves:
    made = UsdGeom.BasisCurves.Define(new_stage(), "/Curve")
    made.CreatePointsAttr([Gf.Vec3f(*map(float, p)) for p in points])
    made.CreateCurveVertexCountsAttr([len(points)] if counts is None else list(counts))
    made.CreateTypeAttr("linear")
    for name, value in attributes.items():
        made.GetPrim().GetAttribute(name).Set(value)
    return made


def cut(schema: Any, report: Report | None = None, **options: Any) -> Geometry | None:
    report = Report() if report is None else report
    level = options.pop("level", 0)
    reader = GeometryReader(schema.GetPrim(), Usd.TimeCode(0.0), report, level=level)
    return reader.cut("curve", None, [], options.get("color", ""), 0)


def drawn(schema: Any, report: Report | None = None, **options: Any) -> Geometry:
    geometry = cut(schema, report, **options)
    assert geometry is not None
    return geometry


def test_a_straight_tube_is_a_prism_of_six_sides() -> None:
    geometry = drawn(curve([(0, 0, 0), (0, 0, 5)], widths=[0.2]))
    assert len(geometry.points) == 6 * 2 * 3
    assert np.hypot(*geometry.points[:, :2].T) == pytest.approx(np.full(36, 0.1), abs=1e-6)
    assert geometry.normals[:, 2] == pytest.approx(np.zeros(36), abs=1e-6)
    outwards = (geometry.normals * geometry.points).sum(axis=1)
    assert outwards == pytest.approx(np.full(36, 0.1), abs=1e-6)


def test_its_sides_face_outwards() -> None:
    a, b, c = (
        drawn(curve([(0, 0, 0), (0, 0, 5)], widths=[0.2])).points.reshape(-1, 3, 3).swapaxes(0, 1)
    )
    facing = np.cross(b - a, c - a)
    assert ((facing * (a + b + c)).sum(axis=1) > 0.0).all()


def test_widths_run_along_the_curve() -> None:
    made = curve([(0, 0, 0), (0, 0, 5)], widths=[0.2, 1.0])
    made.SetWidthsInterpolation("vertex")
    points = drawn(made).points
    radius = np.hypot(points[:, 0], points[:, 1])
    assert radius == pytest.approx(np.where(points[:, 2] > 2.5, 0.5, 0.1), abs=1e-6)


def test_normals_make_a_ribbon() -> None:
    made = curve([(0, 0, 0), (0, 0, 5)], widths=[0.2])
    made.CreateNormalsAttr([(0, 1, 0), (0, 1, 0)])
    made.SetNormalsInterpolation("vertex")
    geometry = drawn(made)
    assert len(geometry.points) == 2 * 3
    assert np.abs(geometry.points[:, 0]) == pytest.approx(np.full(6, 0.1), abs=1e-6)
    assert geometry.points[:, 1] == pytest.approx(np.zeros(6), abs=1e-6)
    assert np.abs(geometry.normals[:, 1]) == pytest.approx(np.ones(6), abs=1e-6)


def test_a_ring_closes_without_a_twist() -> None:
    """A knot in space: neighbouring rings of a periodic tube, the last and first too, agree."""
    turn = np.linspace(0.0, 2.0 * math.pi, 60, endpoint=False)
    out = 2.0 + np.cos(3 * turn)
    knot = np.stack([out * np.cos(2 * turn), out * np.sin(2 * turn), np.sin(3 * turn)], axis=1)
    geometry = drawn(curve(knot, widths=[0.2], wrap="periodic"))
    quads = geometry.points.reshape(-1, 6, 3)
    along = np.linalg.norm(quads[:, 2] - quads[:, 1], axis=1).reshape(60, 6)
    # Between the same side of two rings is the step of the curve, less or more by its bend.
    step = np.linalg.norm(np.roll(knot, -1, axis=0) - knot, axis=1)
    assert (np.abs(along - step[:, None]) < 0.1 * 1.2).all()


def test_tubes_of_more_sides_with_complexity() -> None:
    made = curve(CONTROL, type="cubic", basis="bezier", widths=[0.1])
    low, high = (drawn(made, level=level) for level in (0, 1))
    assert len(low.points) == 4 * 6 * 6
    assert len(high.points) == 8 * 12 * 6


@pytest.mark.parametrize(
    ("attributes", "code"),
    [
        ({"widths": []}, "width"),
        ({"widths": [-1.0]}, "width"),
        ({"widths": [float("nan")]}, "width"),
    ],
)
def test_widths_that_are_none_become_one(attributes: Any, code: str) -> None:
    report = Report()
    made = curve([(0, 0, 0), (0, 0, 5)], **attributes)
    points = drawn(made, report).points
    assert np.hypot(points[:, 0], points[:, 1]) == pytest.approx(np.full(36, 0.5), abs=1e-6)
    assert report.codes() == {code}


def test_broken_curves_are_findings() -> None:
    report = Report()
    assert cut(curve(CONTROL, [3], widths=[1.0]), report) is None
    assert cut(curve(CONTROL, [5, -1], widths=[1.0]), report) is None
    assert cut(curve(CONTROL[:1], widths=[1.0]), report) is None
    assert report.codes() == {"curve-arrays"}
    report = Report()
    broken = curve([(0, 0, 0), (0, 0, 1), (float("inf"), 0, 0), (0, 0, 3)], widths=[1.0])
    geometry = drawn(broken, report)
    assert report.codes() == {"mesh-not-finite"}
    assert np.isfinite(geometry.points).all()
    assert len(geometry.points) == 36  # one segment of three reaches no broken point


def test_points_that_coincide_and_turn_back_do_not_divide_by_zero() -> None:
    line = [(0, 0, 0), (0, 0, 0), (0, 0, 1), (0, 0, 0), (0, 0, 2)]
    assert np.isfinite(drawn(curve(line, widths=[1.0])).points).all()


def test_more_curves_than_memory_lose_sides_then_number(monkeypatch: Any) -> None:
    monkeypatch.setattr(module, "MOST_TRIANGLES", 100)
    report = Report()
    line = [(0, 0, 0), (0, 0, 1)] * 12
    assert len(drawn(curve(line, [2] * 12, widths=[1.0]), report).points) == 12 * 3 * 6
    assert not report.codes()
    line = [(0, 0, 0), (0, 0, 1)] * 50
    assert len(drawn(curve(line, [2] * 50, widths=[1.0]), report).points) == 16 * 3 * 6
    assert report.codes() == {"curves-limit"}


# -- points and tetrahedra ----------------------------------------------------------------


def cloud(places: Any, widths: Any = None) -> UsdGeom.Points:
    made = UsdGeom.Points.Define(new_stage(), "/Cloud")
    made.CreatePointsAttr([Gf.Vec3f(*map(float, p)) for p in places])
    if widths is not None:
        made.CreateWidthsAttr(list(widths))
    return made


def test_points_are_balls_of_their_width() -> None:
    made = cloud([(0, 0, 0), (10, 0, 0)], [1.0, 4.0])
    made.SetWidthsInterpolation("vertex")
    geometry = drawn(made)
    assert len(geometry.points) == 2 * 20 * 3
    from_first = np.linalg.norm(geometry.points[:60], axis=1)
    from_second = np.linalg.norm(geometry.points[60:] - [10, 0, 0], axis=1)
    assert from_first == pytest.approx(np.full(60, 0.5), abs=1e-6)
    assert from_second == pytest.approx(np.full(60, 2.0), abs=1e-5)
    assert geometry.normals[:60] == pytest.approx(geometry.points[:60] / 0.5, abs=1e-6)
    a, b, c = geometry.points[:60].reshape(-1, 3, 3).swapaxes(0, 1)
    assert ((np.cross(b - a, c - a) * a).sum(axis=1) > 0.0).all()


def test_each_point_has_its_colour() -> None:
    made = cloud([(0, 0, 0), (10, 0, 0)], [1.0])
    made.CreateDisplayColorPrimvar("vertex").Set([Gf.Vec3f(1, 0, 0), Gf.Vec3f(0, 1, 0)])
    colors = drawn(made, color="displayColor").colors["displayColor"]
    assert colors[:60].tolist() == [[1, 0, 0]] * 60
    assert colors[60:].tolist() == [[0, 1, 0]] * 60


def test_very_many_points_have_fewer_sides_and_an_end(monkeypatch: Any) -> None:
    monkeypatch.setattr(points_module, "_FEW", 1)
    monkeypatch.setattr(points_module, "MOST_POINTS", 3)
    report = Report()
    geometry = drawn(cloud([(i, 0, 0) for i in range(5)], [1.0]), report)
    assert len(geometry.points) == 3 * 8 * 3
    a, b, c = (geometry.points[:24]).reshape(-1, 3, 3).swapaxes(0, 1)
    assert ((np.cross(b - a, c - a) * a).sum(axis=1) > 0.0).all()
    assert report.codes() == {"points-limit"}


def test_points_without_a_place_or_a_width_are_left_out() -> None:
    report = Report()
    made = cloud([(0, 0, 0), (float("nan"), 0, 0), (1, 0, 0)], [1.0, 1.0, -1.0])
    made.SetWidthsInterpolation("vertex")
    assert len(drawn(made, report).points) == 60
    assert report.codes() == {"mesh-not-finite"}
    report = Report()
    assert np.abs(drawn(cloud([(0, 0, 0)]), report).points).max() <= 0.5
    assert report.codes() == {"width"}


def test_two_tetrahedra_show_all_faces_but_the_one_they_share() -> None:
    made = UsdGeom.TetMesh.Define(new_stage(), "/Tets")
    made.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)])
    made.CreateTetVertexIndicesAttr([Gf.Vec4i(0, 1, 2, 3), Gf.Vec4i(1, 2, 3, 4)])
    assert len(drawn(made).points) == 6 * 3
    made.CreateSurfaceFaceVertexIndicesAttr([Gf.Vec3i(0, 1, 2), Gf.Vec3i(0, 1, 99)])
    report = Report()
    assert len(drawn(made, report).points) == 3
    assert report.codes() == {"mesh-index"}


@pytest.mark.parametrize("kind", ["NurbsCurves", "NurbsPatch", "HermiteCurves", "Volume"])
def test_what_has_no_surface_here_is_said(kind: str) -> None:
    prim = new_stage().DefinePrim("/Thing", kind)
    report = Report()
    reader = GeometryReader(prim, Usd.TimeCode(0.0), report)
    assert reader.cut("thing", None, [], "", 0) is None
    assert report.codes() == {"gprim-unknown"}
