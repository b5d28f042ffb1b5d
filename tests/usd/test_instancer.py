"""Point instancers: where copies are, copies of copies, lamps among them, what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders import new_stage
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from hdrusd.report import Report
from hdrusd.scene import Camera, Draw, RenderScene
from hdrusd.usd import instancer as module
from hdrusd.usd.extract import StageReader
from hdrusd.usd.instancer import mixed


def instancer(
    stage: Usd.Stage,
    path: str = "/I",
    positions: Any = ((0, 0, 0), (5, 0, 0)),
    prototypes: Any = ("/I/Box",),
    indices: Any = None,
) -> UsdGeom.PointInstancer:
    made = UsdGeom.PointInstancer.Define(stage, path)
    made.CreatePositionsAttr([Gf.Vec3f(*map(float, p)) for p in positions])
    made.CreateProtoIndicesAttr([0] * len(positions) if indices is None else list(indices))
    made.CreatePrototypesRel().SetTargets([Sdf.Path(p) for p in prototypes])
    return made


def read(stage: Usd.Stage, report: Report | None = None, time: float = 0.0) -> RenderScene:
    reader = StageReader(stage, Report() if report is None else report, default_sky=False)
    return reader.read(time, Camera(), sky_visible=True)  # lamps alone are no error


def places(draw: Draw) -> list[list[float]]:
    return sorted(draw.transforms[:, 3, :3].round(6).tolist())


def test_copies_stand_where_the_arrays_say_below_the_instancer() -> None:
    stage = new_stage(unit=0.5)
    made = instancer(stage)
    made.AddTranslateOp().Set(Gf.Vec3d(0, 10, 0))
    box = UsdGeom.Cube.Define(stage, "/I/Box")
    box.AddTranslateOp().Set(Gf.Vec3d(0, 0, 3))
    draw = read(stage).draws[0]
    assert places(draw) == [[0, 5, 1.5], [2.5, 5, 1.5]]
    assert not draw.moving


def test_instancers_in_prototypes_multiply() -> None:
    """Two rows of three: rows 10 apart, turned by a right angle about z; boxes 1 apart."""
    stage = new_stage()
    half = float(np.sqrt(0.5))
    outer = instancer(stage, "/Rows", [(0, 0, 0), (0, 0, 10)], ["/Rows/Row"])
    outer.CreateOrientationsAttr([Gf.Quath(half, 0, 0, half)] * 2)
    inner = instancer(stage, "/Rows/Row", [(0, 0, 0), (1, 0, 0), (2, 0, 0)], ["/Rows/Row/Box"])
    inner.AddTranslateOp().Set(Gf.Vec3d(0, 0, 1))
    UsdGeom.Cube.Define(stage, "/Rows/Row/Box")
    draw = read(stage).draws[0]
    wanted = [[0, y, z] for y in (0, 1, 2) for z in (1, 11)]
    assert draw.transforms[:, 3, :3].shape == (6, 3)
    # Orientations are half floats: 2^-11 of the length.
    got = draw.transforms[:, 3, :3]
    distance = np.linalg.norm(got[:, None] - np.array(wanted, float)[None], axis=2)
    assert distance.min(axis=0).max() < 2.0**-10 * 2
    assert sorted(distance.argmin(axis=1).tolist()) == [0, 1, 2, 3, 4, 5]


def test_an_instancer_in_itself_is_a_finding() -> None:
    stage = new_stage()
    instancer(stage, "/I", [(0, 0, 0)], ["/I"])
    UsdGeom.Cube.Define(stage, "/Other")
    report = Report()
    assert len(read(stage, report).draws) == 1
    assert report.codes() == {"instancer-content"}


def test_copies_that_would_fill_the_memory_are_refused(monkeypatch: Any) -> None:
    monkeypatch.setattr(module, "MOST_COPIES", 8)
    stage = new_stage()
    instancer(stage, "/A", [(i, 0, 0) for i in range(3)], ["/A/B"])
    instancer(stage, "/A/B", [(0, i, 0) for i in range(3)], ["/A/B/Box"])
    UsdGeom.Cube.Define(stage, "/A/B/Box")
    UsdGeom.Cube.Define(stage, "/Other")
    report = Report()
    assert len(read(stage, report).draws) == 1
    assert report.codes() == {"instancer-limit"}


def test_prototypes_may_lie_in_a_hidden_place_or_under_an_over() -> None:
    """What hides the prototypes themselves does not hide the copies; a hidden part stays so."""
    stage = new_stage()
    stage.OverridePrim("/Shelf")
    UsdGeom.Scope.Define(stage, "/Hidden").MakeInvisible()
    UsdGeom.Cube.Define(stage, "/Shelf/Box")
    UsdGeom.Xform.Define(stage, "/Hidden/Car")
    UsdGeom.Sphere.Define(stage, "/Hidden/Car/Body")
    UsdGeom.Cube.Define(stage, "/Hidden/Car/Spare").MakeInvisible()
    instancer(stage, "/I", [(0, 0, 0), (1, 0, 0)], ["/Shelf/Box", "/Hidden/Car"], [0, 1])
    draws = read(stage).draws
    assert sorted(draw.geometry.key.split("#")[0] for draw in draws) == [
        "/Hidden/Car/Body",
        "/Shelf/Box",
    ]


def test_values_for_each_copy_are_a_finding() -> None:
    stage = new_stage()
    made = instancer(stage)
    UsdGeom.Cube.Define(stage, "/I/Box")
    color = UsdGeom.PrimvarsAPI(made).CreatePrimvar(
        "displayColor", Sdf.ValueTypeNames.Color3fArray, "varying"
    )
    color.Set([Gf.Vec3f(1, 0, 0), Gf.Vec3f(0, 1, 0)])
    report = Report()
    read(stage, report)
    assert report.codes() == {"instancer-primvars"}


# -- lamps --------------------------------------------------------------------------------


def lamps(kind: Any, **copies: Any) -> tuple[Usd.Stage, Any, UsdGeom.PointInstancer]:
    """A light of a kind at (1, 0, 0) of its prototype, and three copies of that."""
    stage = new_stage()
    made = instancer(stage, "/I", [(0, 0, 0), (0, 0, 20), (7, 0, 0)], ["/I/Post"])
    UsdGeom.Xform.Define(stage, "/I/Post")
    light = kind.Define(stage, "/I/Post/Light")
    UsdGeom.Xformable(light).AddTranslateOp().Set(Gf.Vec3d(1, 0, 0))
    light.CreateIntensityAttr(100.0)
    if "orientations" in copies:
        made.CreateOrientationsfAttr([Gf.Quatf(*q) for q in copies["orientations"]])
    if "scales" in copies:
        made.CreateScalesAttr([Gf.Vec3f(*s) for s in copies["scales"]])
    return stage, light, made


def one_by_one(stage: Usd.Stage, light: Any, made: UsdGeom.PointInstancer) -> Any:
    """The same lights as prims of their own, in the order of the copies."""
    from hdrusd.usd.light import read_light_row

    rows = []
    for matrix in made.ComputeInstanceTransformsAtTime(0.0, 0.0):
        world = UsdGeom.Xformable(light).GetLocalTransformation() * matrix
        rows.append(read_light_row(light.GetPrim(), Usd.TimeCode(0.0), world, 1.0, Report()))
    return np.concatenate(rows)


HALF = float(np.sqrt(0.5))
TURNS = [(1, 0, 0, 0), (HALF, 0, 0, HALF), (HALF, 0, HALF, 0)]
KINDS = [UsdLux.SphereLight, UsdLux.DiskLight, UsdLux.RectLight, UsdLux.CylinderLight]


@pytest.mark.parametrize("kind", [*KINDS, UsdLux.DistantLight])
@pytest.mark.parametrize("normalize", [False, True])
@pytest.mark.parametrize(
    "scales",
    [
        None,
        [(1, 1, 1), (2, 2, 2), (3, 3, 3)],  # alike in all directions
        [(1, 1, 1), (2, 1, 1), (1, 3, 0.5)],  # not: read one by one
        [(1, 1, 1), (-1, 1, 1), (2, 2, -2)],  # mirrored
    ],
)
def test_copies_of_a_lamp_are_what_lamps_at_their_places_are(
    kind: Any, normalize: bool, scales: Any
) -> None:
    options = {"orientations": TURNS} | ({"scales": scales} if scales else {})
    stage, light, made = lamps(kind, **options)
    light.CreateNormalizeAttr(normalize)
    got = read(stage).lights
    wanted = one_by_one(stage, light, made)
    for name in ("position", "w", "intensity", "radius", "axis", "outer", "shape", "profile"):
        assert got[name] == pytest.approx(wanted[name], rel=1e-5, abs=1e-5), name
    if scales is None:
        assert got["x"] == pytest.approx(wanted["x"], rel=1e-5, abs=1e-5)
    assert len(set(got["key"].tolist())) == 3


def test_a_lamp_is_read_a_fixed_number_of_times(monkeypatch: Any) -> None:
    """However many copies there are; those of other sizes need one reading more."""
    from hdrusd.usd import instanced_lights

    count = [0]
    original = instanced_lights.read_light_row

    def counted(*arguments: Any) -> Any:
        count[0] += 1
        return original(*arguments)

    monkeypatch.setattr(instanced_lights, "read_light_row", counted)
    stage = new_stage()
    rng = np.random.default_rng(7)
    made = instancer(stage, "/I", rng.random((5000, 3)) * 100.0, ["/I/Light"])
    made.CreateScalesAttr([Gf.Vec3f(float(s)) for s in rng.random(5000) + 0.5])
    UsdLux.SphereLight.Define(stage, "/I/Light")
    lights = read(stage).lights
    assert len(lights) == 5000
    assert len(set(lights["key"].tolist())) == 5000
    assert count[0] == 2


def test_a_lamp_on_a_car_is_moved_and_read_again_only_where_it_changes(monkeypatch: Any) -> None:
    """A headlight turned by a right angle about z shines along what y was; then it grows."""
    from hdrusd.usd import extract

    count = [0]
    original = extract.read_light_row

    def counted(*arguments: Any) -> Any:
        count[0] += 1
        return original(*arguments)

    monkeypatch.setattr(extract, "read_light_row", counted)
    stage = new_stage()
    car = UsdGeom.Xform.Define(stage, "/Car")
    place, turn, size = car.AddTranslateOp(), car.AddRotateZOp(), car.AddScaleOp()
    for time, x, degrees, scale in ((0, 0, 0, 1), (1, 10, 90, 1), (2, 10, 90, 2)):
        place.Set(Gf.Vec3d(x, 0, 0), time)
        turn.Set(float(degrees), time)
        size.Set(Gf.Vec3f(scale), time)
    light = UsdLux.SphereLight.Define(stage, "/Car/Light")
    light.CreateRadiusAttr(0.1)
    light.AddTranslateOp().Set(Gf.Vec3d(1, 0, 0))
    light.AddRotateYOp().Set(-90.0)  # -Z becomes +X
    reader = StageReader(stage, Report(), default_sky=False)
    rows = [reader.read(t, Camera(), sky_visible=True).lights.copy() for t in (0.0, 1.0, 2.0)]
    assert count[0] == 2
    assert [row["position"][0].tolist() for row in rows] == [
        pytest.approx(wanted, abs=1e-9) for wanted in ([1, 0, 0], [10, 1, 0], [10, 2, 0])
    ]
    assert [row["axis"][0].tolist() for row in rows] == [
        pytest.approx(wanted, abs=1e-9) for wanted in ([1, 0, 0], [0, 1, 0], [0, 1, 0])
    ]
    strength = [float(row["intensity"][0, 0]) for row in rows]
    assert strength == pytest.approx([strength[0], strength[0], 4.0 * strength[0]])
    assert [float(row["radius"][0]) for row in rows] == pytest.approx([0.1, 0.1, 0.2])
    assert len({int(row["key"][0]) for row in rows}) == 1


def test_a_copy_keeps_its_key_when_others_go() -> None:
    stage, _, made = lamps(UsdLux.SphereLight)
    made.CreateIdsAttr([11, 22, 33])
    ids, positions = made.GetIdsAttr(), made.GetPositionsAttr()
    positions.Set([Gf.Vec3f(7, 0, 0)], 1.0)
    positions.Set(positions.Get(), 0.0)
    ids.Set([11, 22, 33], 0.0)
    ids.Set([33], 1.0)
    made.GetProtoIndicesAttr().Set([0, 0, 0], 0.0)
    made.GetProtoIndicesAttr().Set([0], 1.0)
    reader = StageReader(stage, Report(), default_sky=False)
    UsdGeom.Cube.Define(stage, "/Box")
    first, second = (reader.read(t, Camera()).lights for t in (0.0, 1.0))
    assert second["key"].tolist() == [first["key"][2]]
    assert second["position"].tolist() == [[8.0, 0.0, 0.0]]


def test_numbers_of_copies_are_spread_without_meeting() -> None:
    ids = np.arange(100_000)
    assert len(np.unique(mixed(ids))) == 100_000
    # SplitMix64 (Steele, Lea, Flood 2014) from state 0 begins with this.
    assert int(mixed(np.zeros(1, np.int64)).astype(np.uint64)[0]) == 0xE220A8397B1DCDAF


def test_instancers_that_all_hold_all_of_the_next_level_are_cut_short(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "MOST_VISITED", 500)
    stage, wide = new_stage(), 6
    instancer(stage, "/I", [(0, 0, 0)] * wide, [f"/L0/N{i}" for i in range(wide)], range(wide))
    for level in range(6):
        stage.OverridePrim(f"/L{level}")
        targets = [f"/L{level + 1}/N{i}" for i in range(wide)]
        for i in range(wide):
            instancer(stage, f"/L{level}/N{i}", [(0, 0, 0)] * wide, targets, range(wide))
    for i in range(wide):
        UsdGeom.Cube.Define(stage, f"/L6/N{i}")
    report = Report()
    scene = read(stage, report)
    assert "/I" in {f.thing for f in report if f.code == "instancer-limit"}
    tops = 1 + 6 * wide  # all of them are in the stage itself too
    assert 0 < sum(len(d.transforms) for d in scene.draws) <= 500 * tops
