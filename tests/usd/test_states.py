"""Levels of detail, switches and sequences as variant sets: one state is composed at a time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import HERE, lamp, node, one_square, paint, square
from pxr import Gf, Usd, UsdGeom, UsdShade

import hdrusd.usd.states
from hdrusd.errors import SourceRef
from hdrusd.legacy import scene as legacy
from hdrusd.legacy.scene import TRS, LegacyScene, Node
from hdrusd.photometry.light import PhotometricLight
from hdrusd.report import Report
from hdrusd.scene import Camera
from hdrusd.usd.extract import StageReader
from hdrusd.usd.fixtures import Lamp
from hdrusd.usd.placed import extents, mesh_areas
from hdrusd.usd.states import states_of
from hdrusd.usd.variants import select_variants
from hdrusd.usd.writer import LightAt, StageWriter

POINT = PhotometricLight("point", 100.0, radius=0.05)
NEVER = 1e9


def written(folder: Path, scene: LegacyScene, **units: float) -> StageWriter:
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
    return made


def saved(made: StageWriter) -> Usd.Stage:
    made.save()
    return Usd.Stage.Open(made.stage.GetRootLayer().identifier)


def shown(stage: Usd.Stage) -> set[str]:
    """The names of nodes that hold a mesh which is composed and visible."""
    every = Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
    meshes = (p for p in every if p.IsA(UsdGeom.Mesh))
    names = set()
    for prim in meshes:
        if UsdGeom.Imageable(prim).ComputeVisibility() != "invisible":
            above = prim.GetParent()
            names.add(above.GetParent().GetName() if above.IsInstance() else above.GetName())
    return names


def choose(stage: Usd.Stage, *choices: str) -> set[str]:
    select_variants(stage, choices, SourceRef(Path("s.usda")))
    return shown(stage)


def parts(names: str = "abc") -> list[Node]:
    """Nodes with a mesh each."""
    return [node(name, meshes=[number]) for number, name in enumerate(names)]


def scene_of(*roots: Node, count: int = 3, **more: Any) -> LegacyScene:
    return one_square(roots=list(roots), meshes=[square() for _ in range(count)], **more)


def detail(name: str = "tree", **changes: Any) -> Node:
    ranges = ((0.0, 50.0), (50.0, 200.0), (200.0, NEVER))
    values = {"children": parts(), "kind": "lod", "lod_ranges": ranges} | changes
    return node(name, **values)


def test_levels_of_detail_are_variants_with_their_ranges(tmp_path: Path) -> None:
    made = written(tmp_path, scene_of(detail()), source_unit=0.5)
    stage = saved(made)
    group = stage.GetPrimAtPath("/s/tree").GetVariantSet("lod")
    assert group.GetVariantNames() == ["lod0", "lod1", "lod2"]
    assert group.GetVariantSelection() == "lod0"
    kept = stage.GetPrimAtPath("/s/tree").GetCustomDataByKey("hdrusd:lod")
    # In metres, half a unit each.
    assert kept["lod0"] == Gf.Vec2d(0.0, 25.0)
    assert kept["lod1"] == Gf.Vec2d(25.0, 100.0)
    assert shown(stage) == {"a"}
    assert choose(stage, "/s/tree:lod=lod1") == {"b"}
    assert choose(stage, "/s/tree:lod=lod2") == {"c"}
    assert made.report.codes() == {"lod"}


def test_what_is_added_at_a_distance_stands_in_several_levels() -> None:
    # A child up to 50, one at any distance, one from 50 on.
    tree = detail(lod_ranges=((0.0, 50.0), (0.0, NEVER), (50.0, NEVER)))
    found = states_of(tree)
    assert found is not None
    assert found.shown.tolist() == [[True, True, False], [False, True, True]]
    assert found.ranges == ((0.0, 50.0), (50.0, NEVER))


def test_gaps_between_levels_are_no_level_and_neighbours_alike_are_one() -> None:
    found = states_of(detail(lod_ranges=((10.0, 20.0), (40.0, 60.0), (40.0, 60.0))))
    assert found is not None
    assert found.shown.tolist() == [[True, False, False], [False, True, True]]
    assert found.ranges == ((10.0, 20.0), (40.0, 60.0))


def test_ranges_on_the_screen_stay_pixels(tmp_path: Path) -> None:
    ranges = ((1.0 / 500.0, 1.0 / 100.0), (1.0 / 5000.0, 1.0 / 500.0))
    tree = detail(children=parts("ab"), lod_ranges=ranges, lod_on_screen=True)
    stage = saved(written(tmp_path, scene_of(tree, count=2)))
    prim = stage.GetPrimAtPath("/s/tree")
    assert prim.GetCustomDataByKey("hdrusd:lod") is None
    least, most = prim.GetCustomDataByKey("hdrusd:lodPixels")["lod1"]
    assert (least, most) == pytest.approx((100.0, 500.0))


def test_bounding_boxes_and_the_diagonal_are_of_one_state(tmp_path: Path) -> None:
    near, far = parts("ab")
    far.transform = TRS((1000.0, 0.0, 0.0))
    tree = detail(children=[near, far], lod_ranges=((0.0, 50.0), (50.0, NEVER)))
    made = written(tmp_path, scene_of(tree, count=2))
    assert made.diagonal() == pytest.approx(2.0**0.5)
    assert extents(made.stage)[1] == pytest.approx(1.0)
    areas = mesh_areas(made.stage, made.meshes, made.tree.copies)
    assert {mesh: area.of(np.eye(3)).tolist() for mesh, area in areas.items()} == {0: [1.0] * 3}
    made.set_visible(next(p for p in made.places if p.node is far), visible=True)
    assert made.diagonal() == pytest.approx(2.0**0.5)
    assert 0 not in mesh_areas(made.stage, made.meshes, made.tree.copies)
    made.set_visible(next(p for p in made.places if p.node is near), visible=True)
    stage = saved(made)
    box = UsdGeom.BBoxCache(0, ["default"]).ComputeWorldBound(stage.GetPseudoRoot())
    assert box.ComputeAlignedRange().GetMax() == Gf.Vec3d(1.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("on", "names", "selected", "shows"),
    [
        ((True, False, False), {"a", "b", "c", "all", "none"}, "a", "a"),
        ((True, True, True), {"a", "b", "c", "all", "none"}, "all", "abc"),
        ((False, False, False), {"a", "b", "c", "all", "none"}, "none", ""),
        ((True, False, True), {"a", "b", "c", "all", "none", "current"}, "current", "ac"),
        ((False,), {"a", "b", "c", "all", "none", "current"}, "current", "bc"),
    ],
)
def test_a_switch_can_be_set_by_name(
    tmp_path: Path, on: tuple[bool, ...], names: set[str], selected: str, shows: str
) -> None:
    lights = node("lights", children=parts(), kind="switch", switch_on=on)
    made = written(tmp_path, scene_of(lights))
    stage = saved(made)
    group = stage.GetPrimAtPath("/s/lights").GetVariantSet("switch")
    assert set(group.GetVariantNames()) == names
    assert group.GetVariantSelection() == selected
    assert shown(stage) == set(shows)
    assert choose(stage, "/s/lights:switch=b") == {"b"}
    assert not made.report.codes()


def test_a_switch_of_one_child_is_on_or_off(tmp_path: Path) -> None:
    sign = node("sign", children=parts("a"), kind="switch", switch_on=(False,))
    stage = saved(written(tmp_path, scene_of(sign, count=1)))
    assert shown(stage) == set()
    assert choose(stage, "/s/sign:switch=on") == {"a"}


def test_masks_of_a_switch_are_its_variants(tmp_path: Path) -> None:
    masks = (("day time", (True, False, True)), ("night", (False, True, True)))
    street = node(
        "street", children=parts(), kind="switch", switch_on=masks[1][1], switch_masks=masks
    )
    stage = saved(written(tmp_path, scene_of(street)))
    group = stage.GetPrimAtPath("/s/street").GetVariantSet("switch")
    assert set(group.GetVariantNames()) == {"day_time", "night"}
    assert group.GetVariantSelection() == "night"
    assert shown(stage) == {"b", "c"}
    assert choose(stage, "/s/street:switch=day_time") == {"a", "c"}


def test_a_sequence_shows_one_frame(tmp_path: Path) -> None:
    flame = node("flame", children=parts(), kind="sequence")
    stage = saved(written(tmp_path, scene_of(flame)))
    assert shown(stage) == {"a"}
    assert choose(stage, "/s/flame:frame=frame2") == {"c"}


def test_names_of_variants_are_valid_and_unique() -> None:
    children = [node(name) for name in ("1 on", "1 on", "all", "")]
    found = states_of(node("s", children=children, kind="switch", switch_on=(True,) * 4))
    assert found is not None
    assert found.names == ("_1_on", "_1_on_2", "all", "unnamed", "all_2", "none")
    assert found.names[found.selected] == "all_2"


def test_states_in_states(tmp_path: Path) -> None:
    inner = node("inner", children=parts("ab"), kind="switch", switch_on=(False, True))
    coarse = node("c", meshes=[2])
    tree = detail(children=[inner, coarse], lod_ranges=((0.0, 50.0), (50.0, NEVER)))
    stage = saved(written(tmp_path, scene_of(tree)))
    assert shown(stage) == {"b"}
    assert choose(stage, "/s/tree/inner:switch=a") == {"a"}
    assert choose(stage, "/s/tree:lod=lod1") == {"c"}
    assert choose(stage, "/s/tree:lod=lod0") == {"a"}  # the choice within has stayed


def test_states_of_a_prototype_are_chosen_in_it(tmp_path: Path) -> None:
    tree = detail()
    roots = [node(f"p{i}", transform=TRS((i, 0, 0)), children=[tree]) for i in range(3)]
    stage = saved(written(tmp_path, scene_of(*roots)))
    assert len([p for p in stage.Traverse() if p.IsInstance()]) == 3
    assert shown(stage) == {"a"}
    assert choose(stage, "/__Prototypes/tree:lod=lod1") == {"b"}
    # Of an instance itself it is chosen for that one alone.
    assert choose(stage, "/s/p1/tree:lod=lod2") == {"b", "c"}


def test_materials_stay_bound_in_every_state(tmp_path: Path) -> None:
    stage = saved(written(tmp_path, scene_of(detail(), materials=[paint()])))
    choose(stage, "/s/tree:lod=lod2")
    mesh = stage.GetPrimAtPath("/s/tree/c/square")
    bound = mesh.GetRelationship("material:binding").GetTargets()
    assert bound == ["/s/Looks/paint"]
    assert UsdShade.MaterialBindingAPI(mesh)


def test_a_lamp_in_a_state_shines_in_that_state(tmp_path: Path) -> None:
    children = parts("ab")
    for child in children:
        child.lights = [0]
    lights = node("lights", children=children, kind="switch", switch_on=(True, False))
    made = written(tmp_path, scene_of(lights, count=2, lights=[lamp()]))
    lamps = [
        Lamp(made.write_lights([LightAt(place, lamp(), POINT)])[0], POINT)
        for place in made.places
        for _ in place.node.lights
    ]
    assert len(lamps) == 2
    made.free_lamps(lamps)
    stage = saved(made)

    def count() -> int:
        return len(StageReader(stage, Report(), default_sky=False).read(0, Camera()).lights)

    assert count() == 1
    choose(stage, "/s/lights:switch=all")
    assert count() == 2
    choose(stage, "/s/lights:switch=b")
    assert count() == 1
    # The photometry layer says what the lamp is, and nothing about states.
    layer = made.layers["photometry"]
    assert layer.GetPrimAtPath("/s/lights/b/lamp_07")
    assert not layer.GetPrimAtPath("/s/lights").variantSets


def test_a_fixture_of_another_state_is_none(tmp_path: Path) -> None:
    """A lamp in the finest level, a housing about it in the coarsest: never shown together."""
    corners = np.array(
        [[x, y, z] for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (-0.2, 0.2)], np.float32
    )
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    box = square(
        points=corners,
        face_counts=np.full(6, 4, np.int32),
        face_indices=np.array(sides, np.int32).ravel(),
        uvs={},
    )
    for kind, fixtures in (("lod", 0), ("group", 1)):
        fine, coarse = node("fine", lights=[0]), node("coarse", meshes=[0])
        ranges = ((0.0, 50.0), (50.0, NEVER)) if kind == "lod" else ()
        tree = node("tree", children=[fine, coarse], kind=kind, lod_ranges=ranges)
        folder = tmp_path / kind
        folder.mkdir()
        made = written(folder, one_square(roots=[tree], meshes=[box], lights=[lamp()]))
        place = next(place for place in made.places if place.node is fine)
        it = Lamp(made.write_lights([LightAt(place, lamp(), POINT)])[0], POINT)
        made.free_lamps([it])
        assert len(it.fixtures) == fixtures


def test_the_first_camera_is_one_that_is_composed(tmp_path: Path) -> None:
    off, on = node("off", cameras=[0]), node("on", cameras=[0])
    views = node("views", children=[off, on], kind="switch", switch_on=(False, True))
    scene = one_square(roots=[views], cameras=[legacy.Camera("eye", HERE)])
    assert written(tmp_path, scene).first_camera == "/s/views/on/eye"


def test_a_node_that_is_made_visible_selects_a_state_that_shows_it(tmp_path: Path) -> None:
    lights = node("lights", children=parts(), kind="switch", switch_on=(True, False, False))
    made = written(tmp_path, scene_of(lights))
    (wanted,) = (place for place in made.places if place.node.name == "b")
    made.set_visible(wanted, visible=True)
    stage = saved(made)
    assert "b" in shown(stage)
    # Said in the photometry layer; the geometry keeps what the source says.
    prims = [made.layers[name].GetPrimAtPath("/s/lights") for name in ("photometry", "geometry")]
    assert prims[0].variantSelections["switch"] != "a"
    assert prims[1].variantSelections["switch"] == "a"


def test_states_too_many_for_variants_are_shown_by_visibility(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hdrusd.usd.tree.MOST", 8)
    made = written(tmp_path, scene_of(detail()))
    stage = saved(made)
    assert not stage.GetPrimAtPath("/s/tree").HasVariantSets()
    assert shown(stage) == {"a"}
    assert made.report.codes() == {"state-limit"}
    assert hdrusd.usd.states.MOST > 8


@pytest.mark.parametrize("kind", ["switch", "sequence", "lod"])
@pytest.mark.parametrize("ranged", [True, False])
def test_states_too_many_are_not_told_one_by_one(kind: str, ranged: bool) -> None:
    # All states of them would be 400 million flags.
    count = 20_000
    ranges = tuple((float(i), float(i + 1)) if ranged else (0.0, 0.0) for i in range(count))
    on = tuple(i == 0 for i in range(count))
    tree = node("g", children=[node("a")] * count, kind=kind, lod_ranges=ranges, switch_on=on)
    found = states_of(tree)
    assert found is not None
    assert found.too_many in (count, count + 2)
    assert found.shown.shape == (1, count)
    assert np.flatnonzero(found.current).tolist() == [0]


@pytest.mark.parametrize(
    "tree",
    [
        node("g"),
        node("g", children=parts()),
        node("g", kind="lod", lod_ranges=((0.0, 5.0), (5.0, 9.0))),
        node("g", children=parts("a"), kind="lod", lod_ranges=((0.0, 5.0),)),
        node("g", children=parts("a"), kind="sequence"),
        node("g", children=parts("ab"), kind="lod", lod_ranges=((0.0, 5.0), (0.0, 5.0))),
    ],
)
def test_one_state_is_no_variant_set(tree: Node) -> None:
    assert states_of(tree) is None
