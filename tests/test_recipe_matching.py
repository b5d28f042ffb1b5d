"""The entries of a first photometry file fit what they were made for, and nothing else."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import lamp, node, one_square, paint, square
from converted import run
from hypothesis import given
from hypothesis import strategies as st
from pxr import Usd, UsdGeom, UsdLux

from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import TRS, LegacyScene, Node
from hdrusd.photometry.lamp_classes import BY_NAME
from hdrusd.photometry.sidecar import Rule, Sidecar, read_sidecar
from hdrusd.recipe.evidence import leads
from hdrusd.recipe.making import write_recipe
from hdrusd.recipe.naming import told_class
from hdrusd.recipe.text import recipe
from hdrusd.report import Report
from hdrusd.usd.sharing import every_node
from hdrusd.usd.writer import StageWriter

STREET, BULB = BY_NAME["street-light"], BY_NAME["household-bulb"]

#: What begins with # and is an entry.
_COMMENTED = re.compile(r"^# (?=\[\[|\w+ = )", re.MULTILINE)

#: Names that tell a class, that tell none, that are patterns, paths, numbers or nothing.
NAMES = st.sampled_from(["streetlight", "streetlight_1", "bulb_1", "bulb_12", "bulb"]) | (
    st.sampled_from(["Spot", "l1", "l2", "lx1", "l[1]", "ls٣", "1", "2", "*", "?", ""])
    | st.sampled_from(["/s/Spot", "s", "street light\n2", "Looks"])
)
TREES = st.recursive(
    st.tuples(NAMES, st.lists(NAMES, max_size=2), st.just([])),
    lambda below: st.tuples(NAMES, st.lists(NAMES, max_size=2), st.lists(below, max_size=3)),
    max_leaves=8,
)


def proposed(scene: LegacyScene, *, everything: bool = False) -> Sidecar:
    """The first photometry file, read back; ``everything``: with what was commented out."""
    text = recipe("a", leads(scene, lambda image: None))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "photometry.toml"
        file.write_text(_COMMENTED.sub("", text) if everything else text, encoding="utf-8")
        report = Report()
        sidecar = read_sidecar(file, report)
    assert not report.codes()
    return sidecar


def written(scene: LegacyScene) -> list[tuple[Any, str, str]]:
    """Light, node's name and path of each light as a conversion asks for their entries."""
    with tempfile.TemporaryDirectory() as folder:
        units: Any = {"meters_per_unit": 1.0, "source_unit": 1.0, "up": "Y"}
        writer = StageWriter(Path(folder), "other name", scene, Report(), **units)
        writer.write_geometry()
        return [
            (light, place.node.name, str(writer.light_path(place, light)))
            for place in writer.places
            for light in (scene.lights[index] for index in place.node.lights)
        ]


def matched(scene: LegacyScene, sidecar: Sidecar) -> dict[str, str | None]:
    """The class of the entry that each light gets, by its path without the root."""
    found = {}
    for light, name, path in written(scene):
        rule = sidecar.match("light", light.name, name, path=path)
        found[path.removeprefix("/other_name")] = _class(rule)
    return found


def _class(rule: Rule | None) -> str | None:
    told = None if rule is None else re.match(r"class ([\w-]+):", rule.source)
    return told.group(1) if told else None


def planted(trees: list[Any]) -> tuple[LegacyScene, list[Any]]:
    """A scene of trees of names, with lights; names of the lights, and those above each."""
    scene = one_square(roots=[])
    told: list[Any] = []

    def plant(tree: Any, above: tuple[str, ...]) -> Node:
        name, lights, below = tree
        made = node(name)
        for light in lights:
            made.lights.append(len(scene.lights))
            scene.lights.append(lamp(name=light))
            named = told_class((light, name, *above))
            told.append(named[0].name if named else None)
        made.children = [plant(each, (name, *above)) for each in below]
        return made

    scene.roots = [plant(tree, ()) for tree in trees]
    return scene, told


@given(st.lists(TREES, max_size=4))
def test_each_light_gets_the_entry_of_its_class(trees: list[Any]) -> None:
    scene, told = planted(trees)
    wanted = {}
    for light, _, path in written(scene):
        number = next(i for i, each in enumerate(scene.lights) if each is light)
        wanted[path.removeprefix("/other_name")] = told[number]
    for everything in (False, True):
        for path, kind in matched(scene, proposed(scene, everything=everything)).items():
            if kind is None and wanted[path] is not None:
                # What no pattern tells from another: it ends as that does.
                others = {k for p, k in wanted.items() if p != path and p.endswith(path)}
                assert others - {wanted[path]}
            else:
                assert kind == wanted[path]


@given(st.lists(st.tuples(NAMES, NAMES, st.booleans()), max_size=8))
def test_a_material_that_counts_is_alone_of_its_name(
    materials: list[tuple[str, str, bool]],
) -> None:
    """Of materials of one name those that count are of one class, and all of them glow."""
    scene = one_square(
        materials=[paint(name=m, emission=(float(glows),) * 3) for m, _, glows in materials],
        meshes=[square(material=i) for i in range(len(materials))],
        roots=[node(wearer, meshes=[i]) for i, (_, wearer, _) in enumerate(materials)],
    )
    sidecar = proposed(scene)
    for name, wearer, glows in materials:
        rule = sidecar.match("material", name)
        named = told_class((name, wearer))
        alike = {
            (told_class((n, w)) or (None,))[0] if g else "dark"
            for n, w, g in materials
            if n == name
        }
        counts = bool(name) and glows and named is not None and len(alike) == 1
        assert _class(rule) == (named[0].name if counts and named else None)
    assert not sidecar.unmatched()


@given(st.lists(TREES, max_size=4), st.data())
def test_each_node_gets_one_lamp_at_most(trees: list[Any], data: st.DataObject) -> None:
    """What is proposed, all of it uncommented, hangs one lamp at a node at most."""
    scene, _ = planted(trees)
    scene.lights = []
    glass = paint(name="glass", emission=(1.0, 1.0, 1.0))
    scene.materials, scene.meshes = [paint(), glass], [square(), square(material=1)]
    nodes = list(every_node(scene.roots))
    for each in nodes:
        each.lights = []
        each.meshes = [data.draw(st.integers(0, 1))]
    sidecar = proposed(scene, everything=True)
    lamps = [rule for rule in sidecar.rules if rule.section == "lamp"]
    hung = [[rule for rule in lamps if rule.fits((each.name,))] for each in nodes]
    assert all(len(each) <= 1 for each in hung)
    assert all("at" in rule.values or [rule] in hung for rule in lamps)


def test_wildcards_take_nothing_of_another_class() -> None:
    """Street lights l1, l2 beside bulbs whose names begin with l, and lx that tells nothing."""
    names = ["l1", "l2", "lantern_bulb1", "lantern_bulb2", "lx1", "lx2"]
    scene = one_square(lights=[lamp(name=name) for name in names])
    above = ["streetlight", "streetlight", "a", "a", "a", "a"]
    scene.roots = [node(a, lights=[i]) for i, a in enumerate(above)]
    kinds = [STREET.name] * 2 + [BULB.name] * 2 + [None] * 2
    for everything in (False, True):
        assert list(matched(scene, proposed(scene, everything=everything)).values()) == kinds


def test_lights_of_one_name_go_by_their_nodes() -> None:
    scene = one_square(lights=[lamp(name="Spot"), lamp(name="Spot")])
    scene.roots = [node("streetlight_1", lights=[0]), node("kitchen_bulb", lights=[1])]
    sidecar = proposed(scene)
    assert {rule.pattern for rule in sidecar.rules} == {"streetlight_1", "kitchen_bulb"}
    assert list(matched(scene, sidecar).values()) == [STREET.name, BULB.name]


def test_lights_without_names_go_by_their_paths() -> None:
    scene = one_square(lights=[lamp(name="")] * 3)
    scene.roots = [
        node("streetlight_1", children=[node("", lights=[0])]),
        node("streetlight_2", children=[node("", lights=[1])]),
        node("kitchen_bulb", children=[node("", lights=[2])]),
    ]
    sidecar = proposed(scene)
    assert list(matched(scene, sidecar).values()) == [STREET.name, STREET.name, BULB.name]
    assert len(sidecar.rules) == 2


def test_what_no_pattern_tells_apart_does_not_count() -> None:
    """One node in two places is one prototype on the stage: one path, and one entry."""
    shared = node("n", lights=[0])
    scene = one_square(lights=[lamp(name="Spot")])
    scene.roots = [node("streetlight", children=[shared]), node("bulb", children=[shared])]
    (lead,) = leads(scene, lambda image: None)
    assert (lead.counts, lead.count) == (False, 2)
    assert "household-bulb, street-light" in lead.reason


# -- lamps -----------------------------------------------------------------------------------


def post(name: str, mesh: int, height: float = 0.0) -> Node:
    return node(name, transform=TRS((9.0, height, 0.0)), meshes=[mesh])


def lamps(scene: LegacyScene) -> dict[str, Any]:
    return {
        lead.pattern: lead for lead in leads(scene, lambda image: None) if lead.section == "lamp"
    }


def lit(*roots: Node) -> LegacyScene:
    """Nodes that wear grey paint on mesh 0 and what glows on mesh 1."""
    glass = paint(name="glass", emission=(1.0, 1.0, 0.5))
    meshes = [square(), square(material=1)]
    return one_square(materials=[paint(), glass], meshes=meshes, roots=list(roots))


def test_two_street_lights_have_two_lamps() -> None:
    scene = lit(post("streetlight_1", 1), post("streetlight_2", 1), post("streetlight_1_pole", 0))
    assert {pattern: lead.count for pattern, lead in lamps(scene).items()} == {
        "streetlight_1": 1,
        "streetlight_2": 1,
    }


def test_what_hangs_above_and_below_what_glows_is_no_second_lamp() -> None:
    below = post("streetlight_glass", 1)
    below.children = [post("bulb", 0)]
    scene = lit(node("lamppost", children=[below, post("cable", 0)]))
    assert set(lamps(scene)) == {"streetlight_glass"}
    scene = lit(node("lamppost", children=[post("cable", 0)]))
    assert set(lamps(scene)) == {"lamppost"}


def test_nodes_of_one_name_that_do_not_all_glow_have_lamps_at_places() -> None:
    """The square's middle is (0.5, 0.5, 0), and its node stands at (9, 3, 0)."""
    scene = lit(post("streetlight", 1, 3.0), node("road", children=[post("streetlight", 0)]))
    sidecar = proposed(scene, everything=True)
    glows = next(rule for rule in sidecar.rules if rule.section == "lamp")
    assert "match" not in glows.values
    assert glows.values["at"] == [[9.5, 3.5, 0.0]]


@pytest.mark.parametrize(
    ("corner", "size", "offset"),
    [
        ((0.0, 0.0, 0.0), 1.0, (0.5, 1.0, 0.0)),
        ((1e-17, -1e-9, 8e-9), 1.0, (0.5, 1.0, 0.0)),
        ((512_345.0, 0.0, 0.0), 1.0, (512_345.5, 1.0, 0.0)),
        ((0.0, 0.0, 0.0), 1e-3, (5e-4, 1e-3, 0.0)),
        ((0.0, 0.0, 0.0), 123_456.0, (61_730.0, 123_460.0, 0.0)),
    ],
)
def test_offsets_have_the_digits_that_mean_something(
    corner: tuple[float, ...], size: float, offset: tuple[float, ...]
) -> None:
    """The middle of a square's upper edge, to a ten-thousandth of the square."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * size + corner
    mesh = square(points=points.astype(np.float32))
    turned = node("lamppost", transform=TRS((0.0, 0.0, 5.0), (0.0, 0.6, 0.0, 0.8)), meshes=[0])
    (lead,) = lamps(one_square(meshes=[mesh], roots=[turned])).values()
    assert lead.offset == offset


def test_lights_of_a_stage_go_by_their_paths(tmp_path: Path) -> None:
    """Lights of one name in groups of one name; those groups hang in what tells the class."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    for above in ("streetlight/a", "bulb/a", "street_light_2/b", "x/b"):
        UsdLux.SphereLight.Define(stage, f"/World/{above}/Light")
    stage.SetDefaultPrim(stage.GetPrimAtPath("/World"))
    stage.Save()
    report = Report()
    write_recipe(Resolver(tmp_path / "a.usda", report), tmp_path / "photometry.toml")
    result = run(tmp_path / "a.usda", tmp_path / "out" / "a.usda")
    sources = {row["path"].split("/")[2]: row["source"] for row in result.lights[:4]}
    assert {
        name: (re.findall(r"class ([\w-]+):", s) or [""])[0] for name, s in sources.items()
    } == {
        "streetlight": STREET.name,
        "bulb": BULB.name,
        "street_light_2": STREET.name,
        "x": "",
    }
    assert not [code for code in result.report.codes() if code.startswith("sidecar")]
