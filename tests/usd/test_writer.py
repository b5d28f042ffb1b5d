"""A LegacyScene in layers: names, instances, levels of detail, lights under scale, animation."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import lamp, node, one_square, paint, square
from pxr import Gf, Tf, Usd, UsdGeom, UsdShade

from hdrusd.legacy import scene as legacy
from hdrusd.legacy.scene import TRS, LegacyScene, Node
from hdrusd.photometry.light import PhotometricLight
from hdrusd.report import Report
from hdrusd.usd.light import read_light_row
from hdrusd.usd.lux import read_lux
from hdrusd.usd.names import unique
from hdrusd.usd.writer import LightAt, StageWriter


def writer(
    folder: Path, scene: LegacyScene, unit: float = 1.0, source_unit: float = 1.0, stem: str = "s"
) -> StageWriter:
    made = StageWriter(
        folder,
        stem,
        scene,
        Report(),
        meters_per_unit=unit,
        source_unit=source_unit,
        up="Z",
    )
    made.write_geometry()
    return made


def saved(made: StageWriter) -> Usd.Stage:
    """What others see: the files, read again."""
    made.save()
    return Usd.Stage.Open(made.stage.GetRootLayer().identifier)


def visible(stage: Usd.Stage, path: str) -> bool:
    prim = stage.GetPrimAtPath(path)
    if not prim or not prim.IsActive():
        return False
    return bool(UsdGeom.Imageable(prim).ComputeVisibility() == "inherited")


def rows(made: StageWriter, light: PhotometricLight, source: legacy.Light) -> list[Any]:
    """The light at each place that has one, written and read for shader 1."""
    found = []
    for place in made.places:
        for _ in place.node.lights:
            prim = made.write_lights([LightAt(place, source, light)])[0]
            world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)
            row = read_light_row(prim, Usd.TimeCode(0), world, made.meters_per_unit, made.report)
            assert row is not None
            found.append((prim, row[0]))
    return found


# -- names --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("names", "wanted"),
    [
        (["Wall", "Wall", "Wall"], ["Wall", "Wall_2", "Wall_3"]),
        (["Wall", "Wall_2", "Wall"], ["Wall", "Wall_2", "Wall_3"]),
        (["Looks"], ["Looks_2"]),  # where the materials are
        (["1st", "a b", "a.b"], ["_1st", "a_b", "a_b_2"]),
        (["", "  "], ["unnamed", "unnamed_2"]),
    ],
)
def test_names_are_valid_and_unique(tmp_path: Path, names: list[str], wanted: list[str]) -> None:
    made = writer(tmp_path, one_square(roots=[node(name) for name in names]))
    assert [place.path.name for place in made.places] == wanted
    for name, place in zip(names, made.places, strict=True):
        prim = made.stage.GetPrimAtPath(place.path)
        assert prim.GetDisplayName() in (name, "")
        assert (prim.GetDisplayName() or prim.GetName()) == name or not name


def test_thousands_of_nodes_of_one_name_ask_little_of_each_other() -> None:
    class Counted(dict[str, int]):
        asked = 0

        def __contains__(self, key: object) -> bool:
            self.asked += 1
            return super().__contains__(key)

    taken = Counted()
    made = [unique("lamp", taken) for _ in range(1000)]
    assert made == ["lamp", *(f"lamp_{number}" for number in range(2, 1001))]
    assert taken.asked <= 2 * 1000


def test_a_stage_is_composed_anew_for_all_siblings_at_once(tmp_path: Path) -> None:
    """Else their number squared: 10,000 nodes took half a minute."""
    count = 50
    nodes = [node(f"n{i}", meshes=[i, count]) for i in range(count)]  # the last one is shared
    meshes = [square() for _ in range(count + 1)]
    materials = [paint(name=f"p{i}") for i in range(count)]
    scene = one_square(roots=nodes, meshes=meshes, materials=materials)
    report = Report()
    units = {"meters_per_unit": 1.0, "source_unit": 1.0, "up": "Z"}
    made = StageWriter(tmp_path, "s", scene, report, **units)  # type: ignore[arg-type]
    looks: dict[str, int] = {}

    def changed(notice: Any, _: Any) -> None:
        for above in {p.GetParentPath() for p in notice.GetResyncedPaths() if p.IsPrimPath()}:
            looks[str(above)] = looks.get(str(above), 0) + 1

    key = Tf.Notice.Register(Usd.Notice.ObjectsChanged, changed, made.stage)
    made.write_geometry()
    made.edit_materials("look", lambda stage, index, path: None)
    key.Revoke()
    assert {"/s", "/s/Looks", "/s/n0"} <= looks.keys()
    assert max(looks.values()) <= 5


def test_names_in_other_scripts_are_kept_for_display(tmp_path: Path) -> None:
    made = writer(tmp_path, one_square(roots=[node("街灯"), node("灯街")]))
    shown = [made.stage.GetPrimAtPath(place.path).GetDisplayName() for place in made.places]
    assert shown == ["街灯", "灯街"]


def test_a_very_long_name_is_cut(tmp_path: Path) -> None:
    made = writer(tmp_path, one_square(roots=[node("x" * 5000), node("x" * 5000)]))
    assert [len(place.path.name) for place in made.places] == [120, 122]


@pytest.mark.parametrize("stem", ["Render", "__Prototypes"])
def test_the_root_stays_clear_of_names_that_the_writer_uses(tmp_path: Path, stem: str) -> None:
    scene = one_square(roots=[node("a", meshes=[0]), node("b", meshes=[0])])
    made = writer(tmp_path, scene, stem=stem)
    assert made.stage.GetDefaultPrim().GetName() == f"{stem}_2"


# -- structure ----------------------------------------------------------------------------


def test_layers_and_stage_metadata(tmp_path: Path) -> None:
    made = writer(tmp_path, one_square(generator="Blender"), unit=0.01)
    made.save()
    stage = Usd.Stage.Open(str(tmp_path / "s.usda"))
    assert list(stage.GetRootLayer().subLayerPaths) == [
        "./s.photometry.usda",
        "./s.look.usda",
        "./s.geometry.usdc",
    ]
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.01
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert stage.GetDefaultPrim().GetPath() == "/s"
    assert "Blender" in stage.GetRootLayer().comment
    geometry = stage.GetLayerStack(includeSessionLayers=False)[3]
    assert geometry.GetPrimAtPath("/s/Wall/square")
    box = UsdGeom.BBoxCache(0, ["default"]).ComputeWorldBound(stage.GetPrimAtPath("/s"))
    assert box.ComputeAlignedRange().GetMax() == Gf.Vec3d(100, 100, 0)


def test_a_mesh_used_twice_is_one_prototype(tmp_path: Path) -> None:
    roots = [node(f"n{i}", meshes=[0], transform=TRS((float(i), 0, 0))) for i in range(3)]
    made = writer(tmp_path, one_square(roots=roots))
    instances = [p for p in made.stage.Traverse() if p.IsInstance()]
    assert len(instances) == 3
    assert len({p.GetPrototype().GetPath() for p in instances}) == 1
    proxies = Usd.PrimRange(made.stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
    meshes = [p for p in proxies if p.IsA(UsdGeom.Mesh)]
    assert len(meshes) == 3
    bound, _ = UsdShade.MaterialBindingAPI(meshes[2]).ComputeBoundMaterial()
    assert not bound or bound.GetPath() == made.materials[0]
    targets = meshes[2].GetRelationship("material:binding").GetTargets()
    assert targets == [made.materials[0]]
    world = UsdGeom.Xformable(meshes[2]).ComputeLocalToWorldTransform(0)
    assert world.ExtractTranslation() == Gf.Vec3d(2, 0, 0)


def test_subsets_bind_their_materials(tmp_path: Path) -> None:
    mesh = square(
        face_counts=np.array([3, 3], np.int32),
        face_indices=np.array([0, 1, 2, 0, 2, 3], np.int32),
        subsets=(legacy.Subset(1, np.array([1], np.int32)),),
    )
    scene = one_square(meshes=[mesh], materials=[paint(), paint(name="glass")])
    made = writer(tmp_path, scene)
    prim = made.stage.GetPrimAtPath("/s/Wall/square")
    (subset,) = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
    assert list(subset.GetIndicesAttr().Get()) == [1]
    assert subset.GetFamilyNameAttr().Get() == "materialBind"
    binding = subset.GetPrim().GetRelationship("material:binding").GetTargets()
    assert binding == [made.materials[1]]


def test_a_deep_tree_does_not_recurse(tmp_path: Path) -> None:
    root = inner = node("n")
    for _ in range(1500):
        child = node("n")
        inner.children.append(child)
        inner = child
    assert len(writer(tmp_path, one_square(roots=[root])).places) == 1501


def test_extras_of_nodes_are_kept(tmp_path: Path) -> None:
    made = writer(tmp_path, one_square(roots=[node("a", extras={"light_points": ({"r": 1.0},)})]))
    text = made.stage.GetPrimAtPath("/s/a").GetCustomDataByKey("hdrusd:extras")
    assert json.loads(text) == {"light_points": [{"r": 1.0}]}


# -- levels of detail, switches -----------------------------------------------------------


def tree(**parts: Any) -> list[Node]:
    return [node("top", children=[node(name) for name in ("a", "b", "c")], **parts)]


@pytest.mark.parametrize(
    ("parts", "shown"),
    [
        ({}, "abc"),
        ({"kind": "lod", "lod_ranges": ((50.0, 100.0), (0.0, 50.0), (100.0, 1e9))}, "b"),
        ({"kind": "lod", "lod_ranges": ((0.0, 50.0), (0.0, 1e9), (50.0, 1e9))}, "ab"),
        ({"kind": "lod", "lod_ranges": ((0.0, 0.0), (0.0, 50.0), (50.0, 1e9))}, "b"),
        ({"kind": "lod", "lod_ranges": ((0.0, 50.0),)}, "abc"),
        ({"kind": "switch", "switch_on": (True, False, True)}, "ac"),
        ({"kind": "switch", "switch_on": (False, False)}, "c"),
        ({"kind": "sequence"}, "a"),
        ({"kind": "billboard"}, "abc"),
    ],
)
def test_which_children_are_shown(tmp_path: Path, parts: dict[str, Any], shown: str) -> None:
    roots = tree(**parts)
    made = writer(tmp_path, one_square(roots=roots))
    stage = saved(made)
    assert "".join(n for n in "abc" if visible(stage, f"/s/top/{n}")) == shown
    assert all(child.visible for child in roots[0].children)  # the record is left as it was
    assert ("lod" in made.report.codes()) == (len(parts.get("lod_ranges", ())) > 1)


def test_a_node_shared_by_two_parents_is_hidden_below_one_only(tmp_path: Path) -> None:
    shared = node("lamp")
    roots = [
        node("off", kind="switch", switch_on=(False,), children=[shared]),
        node("on", kind="switch", switch_on=(True,), children=[shared]),
    ]
    made = writer(tmp_path, one_square(roots=roots))
    stage = saved(made)
    assert not visible(stage, "/s/off/lamp")
    assert visible(stage, "/s/on/lamp")


def test_what_the_source_hides_is_hidden_and_can_be_shown(tmp_path: Path) -> None:
    made = writer(tmp_path, one_square(roots=[node("a", visible=False), node("b")]))
    assert not visible(made.stage, "/s/a")
    made.set_visible(made.places[0], visible=True)
    made.set_visible(made.places[1], visible=False)
    assert visible(made.stage, "/s/a")
    assert not visible(made.stage, "/s/b")
    assert made.layers["photometry"].GetPrimAtPath("/s/b")
    assert not made.layers["geometry"].GetAttributeAtPath("/s/b.visibility")


# -- lights -------------------------------------------------------------------------------

SPOT = PhotometricLight("spot", 800.0, cutoff=30.0, radius=0.05)
UNITS = [(1.0, 1.0), (0.01, 1.0), (1.0, 0.0254)]


@pytest.mark.parametrize(("unit", "source_unit"), UNITS)
@pytest.mark.parametrize(
    "scale", [(1, 1, 1), (4, 4, 4), (-2, 2, 2), (3, 1, 0.5), (1, 0, 1), (0, 0, 0)]
)
def test_a_lamp_keeps_its_size_place_and_aim_under_any_scale(
    tmp_path: Path, unit: float, source_unit: float, scale: tuple[float, ...]
) -> None:
    turn = (0.0, 0.6, 0.0, 0.8)
    inner = node("inner", transform=TRS((1.0, 2.0, 3.0), turn), lights=[0])
    outer = node("outer", transform=TRS(scale=scale), children=[inner])
    source = lamp(position=(0.5, 0.0, 0.0), direction=(0.0, -0.6, -0.8))
    scene = one_square(roots=[outer], lights=[source])
    made = writer(tmp_path, scene, unit, source_unit)
    ((prim, row),) = rows(made, SPOT, source)
    reading = read_lux(prim)
    assert reading is not None
    # float32 radius (squared) and intensity: 3 roundings of 2^-24.
    assert reading.intensity == pytest.approx([800.0] * 3, rel=2e-7)
    assert row["radius"] == pytest.approx(0.05, rel=2e-7)
    world = np.array(
        UsdGeom.Xformable(made.stage.GetPrimAtPath("/s/outer/inner")).ComputeLocalToWorldTransform(
            0
        )
    )
    place = (np.array([0.5, 0.0, 0.0, 1.0]) @ world)[:3] * unit
    assert row["position"] == pytest.approx(place, abs=1e-9)
    aim = np.array([0.0, -0.6, -0.8]) @ world[:3, :3]
    if np.linalg.norm(aim) > 0.0:
        assert row["axis"] == pytest.approx(aim / np.linalg.norm(aim), abs=1e-9)


def test_a_lamp_under_an_animated_scale(tmp_path: Path) -> None:
    grow = legacy.Channel("scale", np.array([0.0, 1.0]), np.array([[3.0] * 3, [3.0] * 3]))
    roots = [node("car", animation=(grow,), lights=[0])]
    made = writer(tmp_path, one_square(roots=roots, lights=[lamp()]))
    ((prim, row),) = rows(made, SPOT, lamp())
    assert row["radius"] == pytest.approx(0.05, rel=2e-7)
    assert read_lux(prim, Usd.TimeCode(12)).intensity == pytest.approx([800.0] * 3, rel=2e-7)


def test_a_light_moves_with_its_node(tmp_path: Path) -> None:
    drive = legacy.Channel("translation", np.array([0.0, 1.0]), np.array([[0, 0, 0], [8.0, 0, 0]]))
    scene = one_square(roots=[node("car", animation=(drive,), lights=[0])], lights=[lamp()])
    made = writer(tmp_path, scene)
    assert made.stage.GetEndTimeCode() == 24.0
    assert made.stage.GetTimeCodesPerSecond() == 24.0
    ((prim, _),) = rows(made, SPOT, lamp())
    world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(12)
    assert world.ExtractTranslation()[0] == pytest.approx(4.0)


def test_one_light_at_two_nodes_is_two_lamps(tmp_path: Path) -> None:
    roots = [node("a", lights=[0]), node("b", transform=TRS((5.0, 0, 0)), lights=[0])]
    made = writer(tmp_path, one_square(roots=roots, lights=[lamp()]))
    (_, first), (_, second) = rows(made, SPOT, lamp())
    assert second["position"][0] - first["position"][0] == 5.0


def test_legacy_numbers_of_a_light_are_kept(tmp_path: Path) -> None:
    source = lamp(
        range=9.0, attenuation=(1.0, 0.0, 0.5), diffuse=(0.5, 0.25, 1.0), spot_exponent=3.0
    )
    made = writer(tmp_path, one_square(roots=[node("a", lights=[0])], lights=[source]))
    ((prim, _),) = rows(made, SPOT, source)
    kept = prim.GetCustomDataByKey("hdrusd:legacy")
    assert kept["diffuse"] == Gf.Vec3d(0.5, 0.25, 1.0)
    assert kept["spotExponent"] == 3.0
    assert prim.GetAttribute("photometric:legacy:range").Get() == 9.0
    assert made.layers["photometry"].GetPrimAtPath(prim.GetPath())
    assert not made.layers["geometry"].GetPrimAtPath(prim.GetPath())


def test_the_sky_says_the_same_twice(tmp_path: Path) -> None:
    made = writer(tmp_path, one_square())
    dome = made.write_ambient(PhotometricLight("ambient", 0.25, (1.0, 1.0, 1.0)))
    root = made.stage.GetDefaultPrim()
    assert root.HasAPI("HdrusdAmbientAPI")
    assert root.GetAttribute("photometric:ambient:illuminance").Get() == 0.25
    assert root.GetRelationship("photometric:ambient:light").GetTargets() == [dome.GetPath()]
    assert read_lux(dome).intensity == pytest.approx([0.25] * 3, rel=2e-7)


def test_diagonal_is_in_metres(tmp_path: Path) -> None:
    assert writer(tmp_path, one_square(), 0.01, 2.0).diagonal() == pytest.approx(2.0 * 2**0.5)
    assert writer(tmp_path / "..", one_square(roots=[], meshes=[]), stem="e").diagonal() == 0.0


def test_a_folder_that_is_gone_is_an_os_error(tmp_path: Path) -> None:
    folder = tmp_path / "work"
    folder.mkdir()
    made = writer(folder, one_square())
    folder.rename(tmp_path / "moved")
    folder.write_text("in the way")
    with pytest.raises(OSError, match="work"):
        made.save()
