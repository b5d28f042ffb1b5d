"""What stands in several places is written once, and shows the same as copies do."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import HERE, lamp, node, one_square, square
from pxr import Usd, UsdGeom

from hdrusd.legacy import scene as legacy
from hdrusd.legacy.scene import TRS, Channel, LegacyScene, Node, Skin
from hdrusd.photometry.light import PhotometricLight
from hdrusd.report import Report
from hdrusd.scene import Camera, RenderScene
from hdrusd.usd.extract import StageReader
from hdrusd.usd.fixtures import Lamp
from hdrusd.usd.writer import LightAt, StageWriter

POINT = PhotometricLight("point", 100.0, radius=0.05)

#: A closed box of 0.4 m about the origin: it holds a lamp there, as a fixture does.
CORNERS = np.array(
    [[x, y, z] for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (-0.2, 0.2)], np.float32
)
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def housing() -> Any:
    return square(
        name="housing",
        points=CORNERS,
        face_counts=np.full(6, 4, np.int32),
        face_indices=np.array(SIDES, np.int32).ravel(),
        uvs={},
    )


def car() -> Node:
    """Four nodes: a body with two lamps, one of them in a housing."""
    held = node("left", transform=TRS((2.0, 1.0, 0.0)), meshes=[1], lights=[0])
    bare = node("right", transform=TRS((2.0, -1.0, 0.0)), lights=[0])
    return node("car", children=[node("body", meshes=[0]), held, bare])


def place(number: int) -> TRS:
    """A spiral of places, each turned another way."""
    half = number / 2.0
    return TRS(
        (3.0 * number * math.cos(number), 3.0 * number * math.sin(number), 0.0),
        (0.0, 0.0, math.sin(half), math.cos(half)),
    )


def fleet(count: int, shared: bool, **parts: Any) -> LegacyScene:
    """Cars at ``count`` places: one Node, or as many."""
    one = car()
    roots = [
        node(f"place_{i}", transform=place(i), children=[one if shared else car()])
        for i in range(count)
    ]
    meshes = [square(), housing()]
    return one_square(**{"roots": roots, "meshes": meshes, "lights": [lamp()]} | parts)


def written(folder: Path, scene: LegacyScene, **units: float) -> StageWriter:
    folder.mkdir(parents=True, exist_ok=True)
    made = StageWriter(
        folder,
        "s",
        scene,
        Report(),
        meters_per_unit=units.get("unit", 1.0),
        source_unit=units.get("source_unit", 1.0),
        up="Z",
    )
    made.write_geometry()
    lamps = [
        Lamp(made.write_lights([LightAt(place, scene.lights[index], POINT)])[0], POINT)
        for place in made.places
        for index in place.node.lights
    ]
    made.free_lamps(lamps)
    made.save()
    return made


def opened(made: StageWriter) -> Usd.Stage:
    return Usd.Stage.Open(made.stage.GetRootLayer().identifier)


def read(stage: Usd.Stage, time: float = 0.0) -> RenderScene:
    report = Report()
    found = StageReader(stage, report, default_sky=False).read(time, Camera())
    assert not report.codes()
    return found


def seen(scene: RenderScene) -> tuple[list[Any], list[Any]]:
    """Where all triangles are; all lamps, each with the middles of what does not shade it."""
    triangles: list[Any] = []
    middles: list[tuple[Any, int]] = []
    for draw in scene.draws:
        for matrix in draw.transforms:
            points = draw.geometry.points @ matrix[:3, :3] + matrix[3, :3]
            triangles += [tuple(row) for row in points.reshape(-1, 9).round(4).tolist()]
            middle = points.astype(np.float64).mean(axis=0).round(3).tolist()
            middles.append((tuple(middle), draw.shadow_links))
    lamps = []
    for row in scene.lights:
        link = int(row["shadow_link"])
        free = [at for at, bits in middles if link and not bits >> (link - 1) & 1]
        values = (*row["position"].round(4).tolist(), round(float(row["radius"]), 6))
        lamps.append((values, tuple(np.round(row["intensity"], 3).tolist()), tuple(sorted(free))))
    return sorted(triangles), sorted(lamps)


def test_a_car_in_300_places_is_one_prototype(tmp_path: Path) -> None:
    shared = written(tmp_path / "shared", fleet(300, True))
    copied = written(tmp_path / "copied", fleet(300, False))
    stage = opened(shared)
    instances = [prim for prim in stage.Traverse() if prim.IsInstance()]
    assert len(instances) == 300
    assert len({prim.GetPrototype().GetPath() for prim in instances}) == 1
    lights = shared.layers["photometry"].GetPrimAtPath("/__Prototypes/car").nameChildren
    assert [len(child.nameChildren) for child in lights] == [1, 1]  # two lamps, written once
    one, other = seen(read(stage)), seen(read(opened(copied)))
    assert len(one[0]) == 300 * (2 + 12)
    assert len(one[1]) == 600
    assert one == other
    # Each lamp in a housing is free of its own one, and only that.
    free = [len(lamp[2]) for lamp in one[1]]
    assert sorted(free) == [0] * 300 + [1] * 300

    def size(made: StageWriter) -> int:
        return sum(
            path.stat().st_size
            for path in Path(made.stage.GetRootLayer().realPath).parent.iterdir()
        )

    assert size(shared) < 0.25 * size(copied)


@pytest.mark.parametrize(("unit", "source_unit"), [(0.01, 1.0), (1.0, 0.0254)])
def test_lamps_keep_their_size_in_prototypes(
    tmp_path: Path, unit: float, source_unit: float
) -> None:
    scenes = [
        seen(
            read(
                opened(
                    written(
                        tmp_path / str(shared),
                        fleet(3, shared),
                        unit=unit,
                        source_unit=source_unit,
                    )
                )
            )
        )
        for shared in (True, False)
    ]
    assert scenes[0] == scenes[1]
    assert {lamp[0][3] for lamp in scenes[0][1]} == {0.05}


def test_what_is_scaled_differently_holds_its_lamps_apart(tmp_path: Path) -> None:
    def scene(shared: bool) -> LegacyScene:
        made = fleet(4, shared)
        for number, root in enumerate(made.roots):
            root.transform = replace(place(number), scale=(1.0 + number % 2,) * 3)
        return made

    shared, copied = (written(tmp_path / str(s), scene(s)) for s in (True, False))
    one, other = seen(read(opened(shared))), seen(read(opened(copied)))
    assert one == other
    assert {lamp[0][3] for lamp in one[1]} == {0.05}


def test_meshes_alone_are_shared_whatever_their_scale(tmp_path: Path) -> None:
    part = node("part", children=[node("a", meshes=[0]), node("b", meshes=[1])])
    roots = [node(f"n{i}", transform=TRS(scale=(i, 1, 1)), children=[part]) for i in (1, 2, 3)]
    stage = opened(written(tmp_path, one_square(roots=roots, meshes=[square(), housing()])))
    assert len([prim for prim in stage.Traverse() if prim.IsInstance()]) == 3
    assert len(seen(read(stage))[0]) == 3 * 14


def test_prototypes_in_prototypes(tmp_path: Path) -> None:
    def scene(shared: bool) -> LegacyScene:
        wheel = node("wheel", meshes=[0], lights=[0])

        def axle() -> Node:
            mine = wheel if shared else None
            ends = [node(f"end_{y}", transform=TRS((0.0, y, 0.0))) for y in (-1.0, 1.0)]
            for end in ends:
                end.children = [mine or node("wheel", meshes=[0], lights=[0])]
            return node("axle", children=ends)

        one = axle()
        roots = [
            node(f"p{i}", transform=place(i), children=[one if shared else axle()])
            for i in range(5)
        ]
        return one_square(roots=roots, lights=[lamp()])

    shared, copied = (written(tmp_path / str(s), scene(s)) for s in (True, False))
    one, other = seen(read(opened(shared))), seen(read(opened(copied)))
    assert one == other
    assert len(one[1]) == 10


def test_a_fixture_beside_the_prototype_opens_its_instance(tmp_path: Path) -> None:
    """A lamp shared by three poles; one of them has a housing of its own about it."""

    def scene(shared: bool) -> LegacyScene:
        bulb = node("bulb", children=[node("inner", lights=[0], meshes=[0])])
        roots = []
        for i in range(3):
            mine = (
                bulb if shared else node("bulb", children=[node("inner", lights=[0], meshes=[0])])
            )
            pole = node(f"pole{i}", transform=place(i), children=[mine])
            if i == 1:
                pole.meshes = [1]
            roots.append(pole)
        tiny = square(points=square().points * np.float32(0.001))
        return one_square(roots=roots, meshes=[tiny, housing()], lights=[lamp()])

    shared, copied = (written(tmp_path / str(s), scene(s)) for s in (True, False))
    one, other = seen(read(opened(shared))), seen(read(opened(copied)))
    assert one == other
    assert max(len(lamp[2]) for lamp in one[1]) >= 1
    stage = opened(shared)
    names = [p.GetParent().GetName() for p in stage.Traverse() if p.IsInstance()]
    assert names == ["pole0", "pole2"]


def test_cameras_of_prototypes_are_found_where_they_stand(tmp_path: Path) -> None:
    one = node("car", meshes=[0], children=[node("driver", cameras=[0])])
    roots = [node(f"p{i}", transform=TRS((i * 5.0, 0.0, 0.0)), children=[one]) for i in (1, 2)]
    scene = one_square(roots=roots, cameras=[legacy.Camera("eye", HERE)])
    made = written(tmp_path, scene)
    assert made.first_camera == "/s/p1/car/driver/eye"
    camera = StageReader(opened(made), Report()).camera(made.first_camera, 0.0, 1.0)
    assert camera.eye == pytest.approx((5.0, 0.0, 0.0))


def test_an_animated_prototype_moves_in_all_places(tmp_path: Path) -> None:
    drive = Channel("translation", np.array([0.0, 1.0]), np.array([[0, 0, 0], [0, 0, 8.0]]))
    one = node("car", meshes=[0], animation=(drive,))
    roots = [node(f"p{i}", transform=TRS((i * 5.0, 0, 0)), children=[one]) for i in range(2)]
    stage = opened(written(tmp_path, one_square(roots=roots)))
    for i in range(2):
        form = UsdGeom.Xformable(stage.GetPrimAtPath(f"/s/p{i}/car"))
        world = form.ComputeLocalToWorldTransform(12.0).ExtractTranslation()
        assert list(world) == pytest.approx([i * 5.0, 0.0, 4.0])


def test_a_skinned_figure_in_three_places(tmp_path: Path) -> None:
    half = math.sin(math.pi / 4)
    joint = node("joint", transform=TRS((0.0, 0.0, 0.0), (0.0, 0.0, half, half)))
    body = node("body", meshes=[0], skin=0)
    figure = node("figure", children=[joint, body])
    mesh = square(
        uvs={},
        joint_indices=np.zeros((4, 1), np.int32),
        joint_weights=np.ones((4, 1), np.float32),
    )
    roots = [node(f"p{i}", transform=TRS((i * 5.0, 0, 0)), children=[figure]) for i in range(3)]
    skin = Skin("rig", HERE, (joint,), np.eye(4)[None])
    stage = opened(written(tmp_path, one_square(roots=roots, meshes=[mesh], skins=[skin])))
    assert len([p for p in stage.Traverse() if p.IsInstance()]) == 3
    lows = []
    for draw in read(stage).draws:
        for matrix in draw.transforms:
            points = draw.geometry.points @ matrix[:3, :3] + matrix[3, :3]
            lows.append(points.min(axis=0).round(4).tolist())
    # A quarter turn about z takes the unit square to x from -1 to 0.
    assert sorted(lows) == [[-1.0, 0.0, 0.0], [4.0, 0.0, 0.0], [9.0, 0.0, 0.0]]


def test_a_figure_whose_joints_stand_elsewhere_is_not_shared(tmp_path: Path) -> None:
    joint = node("joint")
    body = node("body", meshes=[0], skin=0)
    mesh = square(
        joint_indices=np.zeros((4, 1), np.int32), joint_weights=np.ones((4, 1), np.float32)
    )
    roots = [joint, *(node(f"p{i}", children=[body]) for i in range(2))]
    skin = Skin("rig", HERE, (joint,), np.eye(4)[None])
    stage = opened(written(tmp_path, one_square(roots=roots, meshes=[mesh], skins=[skin])))
    assert not [p for p in stage.Traverse() if p.IsInstance()]
    assert len(seen(read(stage))[0]) == 4
