"""The tree of OpenSceneGraph files: nodes, references, and whole files of the shared data."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from osg_builder import (
    HEADER,
    Loaded,
    geode,
    geometry,
    group,
    light_source,
    load,
    old_geode,
    old_geometry,
    old_group,
    scene,
)

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.importers.importer import read as read_any
from hdrusd.importers.osg import read
from hdrusd.legacy.scene import TRS
from hdrusd.report import Kind, Report


def test_the_format_states_no_axis_and_no_unit(tmp_path: Path) -> None:
    made = load(tmp_path, scene())
    assert (made.scene.up, made.scene.unit_m, made.scene.format) == ("Z", 1.0, "osg")
    assert made.finding("osg-axes").kind is Kind.ASSUMED


def test_names_descriptions_and_masks(tmp_path: Path) -> None:
    udc = 'osg::DefaultUserDataContainer {\nUDC_Descriptions 1 {\n"a b" \n}\n}'
    fields = f'Name "n" \nUserDataContainer TRUE {{\n{udc}\n}}\nNodeMask 0x0 '
    new = load(tmp_path, scene(fields=fields)).root
    old = load(tmp_path, old_group(fields='name n\ndescription "a b"\nnodeMask 0x0')).root
    for node in (new, old):
        assert (node.name, node.extras, node.visible) == ("n", {"descriptions": ("a b",)}, False)
    assert load(tmp_path, old_group(fields="nodeMask 0xffffffff")).root.visible


def test_drawables_may_be_children_and_may_be_hidden(tmp_path: Path) -> None:
    hidden = geometry(more='Name "h" \nNodeMask 0x0 ')
    made = load(tmp_path, scene(geometry(more='Name "a" '), geode(hidden)))
    child, holder = made.root.children
    assert (child.name, child.meshes, holder.meshes) == ("a", [0], [])
    assert (holder.children[0].meshes, holder.children[0].visible) == ([1], False)


# --- references ---------------------------------------------------------------------------


@pytest.mark.parametrize("syntax", ["new", "old"])
def test_a_shared_node_is_one_node_in_two_places(tmp_path: Path, syntax: str) -> None:
    if syntax == "new":
        text = scene(geode(geometry(), fields="UniqueID 3 "), "osg::Geode {\nUniqueID 3 \n}")
    else:
        text = old_group(old_geode(old_geometry(), fields="UniqueID G_3"), "Use G_3")
    made = load(tmp_path, text)
    one, two = made.root.children
    assert (one.meshes, two.meshes, len(made.scene.meshes)) == ([0], [0], 1)
    assert one is two
    assert not made.codes()


def test_a_shared_node_below_another_state_is_another_node(tmp_path: Path) -> None:
    culled = "StateSet TRUE {\nosg::StateSet {\nModeList 1 {\nGL_CULL_FACE ON\n}\n}\n}\n"
    shared = geode(geometry(), fields="UniqueID 3 ")
    other = group("osg::Geode {\nUniqueID 3 \n}", fields=culled)
    made = load(tmp_path, scene(shared, other))
    one, two = made.root.children
    assert one is not two.children[0]
    assert [made.scene.meshes[n.meshes[0]].two_sided for n in (one, two.children[0])] == [
        True,
        False,
    ]


@pytest.mark.parametrize(
    "text",
    [
        HEADER + group("osg::Group {\nUniqueID 1 \n}", geode(geometry()), fields="UniqueID 1 "),
        old_group("Use A", old_geode(old_geometry()), fields="UniqueID A"),
        old_group(old_group("Use A", fields="UniqueID B"), "Use B", fields="UniqueID A"),
    ],
)
def test_a_reference_to_an_ancestor_is_cut(tmp_path: Path, text: str) -> None:
    made = load(tmp_path, text)
    assert made.codes() == {"osg-cycle"}
    assert len(list(made.nodes())) <= 6


def test_a_reference_to_nothing_leaves_an_empty_node(tmp_path: Path) -> None:
    made = load(tmp_path, old_group("Use Nobody", old_geode(old_geometry())))
    assert [child.meshes for child in made.root.children] == [[], [0]]
    assert made.finding("osg-reference").kind is Kind.MISSING


def test_references_that_multiply_end_at_the_limit(tmp_path: Path) -> None:
    parts = [old_group(fields="UniqueID N_0")]
    parts += [old_group(*[f"Use N_{n}"] * 10, fields=f"UniqueID N_{n + 1}") for n in range(30)]
    with pytest.raises(InputError, match="more than 1000 nodes"):
        load(tmp_path, old_group(*parts), limits=Limits(nodes=1000))


def test_references_that_lead_deeper_end_at_the_limit(tmp_path: Path) -> None:
    parts = [old_group(fields="UniqueID N_0")]
    parts += [old_group(f"Use N_{n}", fields=f"UniqueID N_{n + 1}") for n in range(300)]
    with pytest.raises(InputError, match="nodes deeper than 256"):
        load(tmp_path, old_group(*reversed(parts)))


def test_shared_drawables_count_against_the_limit(tmp_path: Path) -> None:
    drawables = ["osg::Geometry {\nUniqueID 9 \n}"] * 50
    first = geode(geometry(more="UniqueID 9 "), *drawables, fields="UniqueID 8 ")
    with pytest.raises(InputError, match="more than 200 nodes"):
        load(
            tmp_path, scene(first, *["osg::Geode {\nUniqueID 8 \n}"] * 50), limits=Limits(nodes=200)
        )


def test_nodes_that_hold_one_another_twice_are_limited(tmp_path: Path) -> None:
    """Each group holds the next one twice: 2^30 nodes from thirty."""
    text = "osg::Group {\nUniqueID 100 \n}"
    for number in range(30):
        again = text.split("\n")[1]
        text = group(text, f"osg::Group {{\n{again}\n}}", fields=f"UniqueID {number + 1} ")
    with pytest.raises(InputError, match="nodes with its instances"):
        load(tmp_path, HEADER + text)


def test_fewer_children_than_declared(tmp_path: Path) -> None:
    text = old_group(old_geode(old_geometry())).replace("num_children 1", "num_children 999999999")
    made = load(tmp_path, text)
    assert (len(made.root.children), made.codes()) == (1, {"osg-count"})


# --- classes ------------------------------------------------------------------------------


def test_level_of_detail(tmp_path: Path) -> None:
    children = (group(fields='Name "far" '), group(fields='Name "near" '))
    fields = "RangeMode PIXEL_SIZE_ON_SCREEN \nRangeList 2 {\n0 100 \n100 2000 \n}"
    made = load(tmp_path, HEADER + group(*children, kind="osg::LOD", fields=fields))
    # Sizes on the screen fall as distances rise: the child of 100 pixels and more is the near one.
    assert (made.root.kind, made.root.lod_ranges) == ("lod", ((1 / 100, 1e9), (1 / 2000, 1 / 100)))
    assert made.codes() == {"osg-lod-pixels"}
    # Before October 2002 the limits between the levels were listed.
    old = old_group(old_group(), old_group(), kind="LOD", fields="Ranges 3 {\n0\n100\n2000\n}")
    assert load(tmp_path, old).root.lod_ranges == ((0, 100), (100, 2000))


def test_a_level_without_range_is_always_shown(tmp_path: Path) -> None:
    old = old_group(old_group(), old_group(), kind="LOD", fields="RangeList 1 {\n5 100\n}")
    made = load(tmp_path, old)
    first, second = made.root.lod_ranges
    assert (first, second[0], made.codes()) == ((5, 100), 0.0, {"osg-lod-ranges"})
    assert second[1] > 1e38


def test_paged_levels_in_other_files(tmp_path: Path) -> None:
    fields = 'RangeList 2 {\n0 50 \n50 900 \n}\nRangeDataList 2 {\n"fine.osgt" \n"" \n}'
    made = load(tmp_path, HEADER + group(group(), kind="osg::PagedLOD", fields=fields))
    assert made.root.lod_ranges == ((50, 900),)  # of the child that is here
    assert made.root.extras == {"files": ("fine.osgt",)}
    assert made.finding("file-missing").kind is Kind.MISSING


@pytest.mark.parametrize("values", ["TRUE FALSE ", "1 0", "1\n0"])
def test_switches(tmp_path: Path, values: str) -> None:
    fields = f"ValueList 2 {{\n{values}\n}}"
    if "TRUE" in values:
        text = HEADER + group(group(), group(), group(), kind="osg::Switch", fields=fields)
    else:
        fields = f"NewChildDefaultValue 1\nValueList {{\n{values}\n}}"
        text = old_group(*[old_group()] * 3, kind="Switch", fields=fields)
    made = load(tmp_path, text)
    assert (made.root.kind, made.root.switch_on) == ("switch", (True, False, True))
    assert all(child.visible for child in made.root.children)


def test_a_multi_switch_shows_its_active_set(tmp_path: Path) -> None:
    sets = "Values 2 {\nSwitchSet 2 {\nTRUE \nFALSE \n}\nSwitchSet 2 {\nFALSE \nTRUE \n}\n}"
    fields = f"ActiveSwitchSet 1 \n{sets}"
    made = load(
        tmp_path, HEADER + group(group(), group(), kind="osgSim::MultiSwitch", fields=fields)
    )
    masks = (("set0", (True, False)), ("set1", (False, True)))
    assert (made.root.switch_on, made.root.switch_masks) == ((False, True), masks)
    assert not made.codes()
    old = "ActiveSwitchSet 1\nValueList 0 {\n1\n0\n}\nValueList 1 {\n0\n1\n}"
    text = old_group(old_group(), old_group(), kind="osgSim::MultiSwitch", fields=old)
    assert load(tmp_path, text).root.switch_on == (False, True)


def test_the_first_of_a_sequence_is_shown(tmp_path: Path) -> None:
    made = load(tmp_path, HEADER + group(group(), group(), kind="osg::Sequence"))
    assert all(child.visible for child in made.root.children)
    assert (made.root.kind, made.codes()) == ("sequence", {"osg-sequence"})


def test_a_billboard_puts_each_drawable_in_its_place(tmp_path: Path) -> None:
    fields = "PositionList 2 {\n0 0 0 \n1 2 3 \n}"
    text = HEADER + geode(geometry(), geometry(), kind="osg::Billboard", fields=fields)
    made = load(tmp_path, text)
    (placed,) = made.root.children
    assert (made.root.meshes, placed.meshes, placed.transform) == ([0], [1], TRS((1, 2, 3)))
    assert (made.root.kind, made.codes()) == ("billboard", {"osg-billboard"})
    body = f"num_drawables 1\n{old_geometry()}\nMode AXIAL_ROT\nPositions {{\n1 2 3\n}}"
    old = load(tmp_path, f"Billboard {{\n{body}\n}}").root
    assert old.children[0].transform == TRS((1, 2, 3))


def test_unknown_classes_pass_their_children_on(tmp_path: Path) -> None:
    made = load(tmp_path, scene(group(geode(geometry()), kind="osgFX::Scribe")))
    assert made.root.children[0].children[0].meshes == [0]
    assert made.finding("osg-node-class").text.startswith("osgFX::Scribe")
    assert load(tmp_path, scene(geode("osgText::Text {\n}"))).codes() == {"osg-drawable"}


def test_callbacks_and_user_data_are_said(tmp_path: Path) -> None:
    udc = "osg::DefaultUserDataContainer {\nUDC_UserObjects 1 {\nosg::Node {\n}\n}\n}"
    fields = (
        "UpdateCallback TRUE {\nosgDemo::Spin {\n}\n}\nCullCallback TRUE {\nosgDemo::Cull {\n}\n}\n"
        f"UserDataContainer TRUE {{\n{udc}\n}}"
    )
    assert load(tmp_path, scene(fields=fields)).codes() == {"osg-callback", "osg-user-data"}


def test_cameras(tmp_path: Path) -> None:
    view = "osg::CameraView {\nPosition 1 2 3 \nFieldOfView 50 \n}"
    # OpenGL 2.1, gluPerspective: 90 degrees high, twice as wide, from 1 to 3.
    render = (
        "osg::Camera {\nReferenceFrame ABSOLUTE_RF \nProjectionMatrix {\n0.5 0 0 0 \n0 1 0 0 \n"
        "0 0 -2 -1 \n0 0 -3 0 \n}\nViewMatrix {\n1 0 0 0 \n0 1 0 0 \n0 0 1 0 \n-5 0 0 1 \n}\n}"
    )
    ortho = (  # gluOrtho2D-like: 8 by 4, from 2 to 6
        "osg::Camera {\nProjectionMatrix {\n0.25 0 0 0 \n0 0.5 0 0 \n0 0 -0.5 0 \n0 0 -2 1 \n}\n}"
    )
    made = load(tmp_path, scene(view, render, ortho))
    first, second, third = made.scene.cameras
    assert (first.fov_y, made.root.children[0].transform) == (50.0, TRS((1, 2, 3)))
    assert (second.fov_y, second.aspect, second.near, second.far) == pytest.approx((90, 2, 1, 3))
    holder = made.root.children[1].children[0]
    assert isinstance(holder.transform, np.ndarray)
    assert holder.transform[3].tolist() == [5, 0, 0, 1]
    assert not made.root.children[1].visible
    assert (third.kind, third.height, third.aspect) == ("orthographic", 4.0, 2.0)
    assert (third.near, third.far) == pytest.approx((2, 6))
    assert made.codes() == {"osg-camera-pass"}


# --- the shared data ----------------------------------------------------------------------


def shared(folder: Path, name: str) -> Loaded:
    """A file of the shared data."""
    report = Report()
    path = folder / "data" / name
    return Loaded(read(Resolver(path, report), report), report)


@pytest.mark.parametrize(
    ("name", "meshes", "triangles", "lights"),
    [
        # data/MANIFEST.md, counted by osgconv 3.6.5
        ("delta3d/examples/data/StaticMeshes/lamps/Lamppost_Trident.osg", 1, 702, 0),
        ("delta3d/examples/data/StaticMeshes/lamps/Lamppost_Trident_PHYSICS.osg", 8, 96, 0),
        ("derived-osg/lamp_post.osg", 1, 270, 1),
        ("derived-osg/night_street.osgt", 14, 86, 6),
        ("derived-osg/suv.osgt", 17, 1514, 0),
        ("osgearth/data/axes.osgt", 7, 1704, 0),
        ("osgearth/data/red_flag.osg", 2, 23, 0),
    ],
)
def test_shared_files_have_the_counts_of_their_manifest(
    testdata: Path, name: str, meshes: int, triangles: int, lights: int
) -> None:
    counts = shared(testdata, name).scene.counts()
    assert (counts["meshes"], counts["triangles"], counts["lights"]) == (meshes, triangles, lights)


def test_the_lamps_of_the_night_street(testdata: Path) -> None:
    made = shared(testdata, "derived-osg/night_street.osgt")
    lamps = [lamp for lamp in made.scene.lights if lamp.positions is None]
    assert {lamp.kind for lamp in lamps} == {"spot"}
    # data/synthetic: lamps 7.9 m high every 20 m, at 5 m to either side in turn
    assert [lamp.position for lamp in lamps] == [
        ((-5, 5)[i % 2], -50 + 20 * i, 7.9) for i in range(6)
    ]
    assert {(lamp.diffuse, lamp.attenuation, lamp.spot_cutoff) for lamp in lamps} == {
        ((1.0, 0.78, 0.5), (0.0, 0.0, 1.0), 70.0)
    }
    heads = [m for m in made.scene.materials if m.name == "sodium"]
    assert [(m.lit, m.emission) for m in heads] == [(False, (1.0, 0.84, 0.6))]
    assert [light.lamps for light in made.scene.lights if light.positions is not None] == [6, 22]


def test_the_lamp_post_has_its_texture_on_unit_1(testdata: Path) -> None:
    made = shared(testdata, "derived-osg/lamp_post.osg")
    used = made.material.diffuse_map
    assert used is not None
    assert (used.image.path, used.uv_set) == (
        (testdata / "data/derived-osg/Lamp_Post_Diffuse.png").resolve(),
        "st1",
    )
    assert made.material.alpha_mode == "blend"
    assert made.scene.ambient == (0.0, 0.0, 0.0)


def test_hostile_files(testdata: Path) -> None:
    with pytest.raises(InputError, match="empty"):
        shared(testdata, "hostile/empty.osgt")
    made = shared(testdata, "hostile/huge_fields.osgt")
    assert (made.faces, made.codes()) == ([[0, 1, 2]], {"osg-draw-count"})


def test_both_suffixes_reach_this_reader(tmp_path: Path) -> None:
    for suffix, text in ((".osg", old_group()), (".osgt", scene(light_source("LightNum 0 ")))):
        path = tmp_path / f"a{suffix}"
        path.write_text(text)
        report = Report()
        assert read_any(Resolver(path, report), report).format == "osg"
