"""Where ``recipe init`` looks: at every node, and at places of shared ones up to a bound."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hdrusd.errors import SourceRef
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import TRS, LegacyScene, Node
from hdrusd.recipe import places as places_module
from hdrusd.recipe import stage_scene as stage_module
from hdrusd.recipe.making import write_recipe
from hdrusd.recipe.places import note_unseen, places
from hdrusd.recipe.stage_scene import stage_scene
from hdrusd.report import Report

SOURCE = Path("a.osg")


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five places of what stands in several."""
    monkeypatch.setattr(places_module, "REPEATS", 5)
    monkeypatch.setattr(stage_module, "REPEATS", 5)


def node(name: str, *children: Node, x: float = 0.0) -> Node:
    return Node(name, SourceRef(SOURCE), TRS(translation=(x, 0.0, 0.0)), children=list(children))


def looked_at(*roots: Node) -> tuple[list[str], list[str]]:
    """The names at all places, and what is said of others."""
    scene, report = LegacyScene(SOURCE, "osg", roots=list(roots)), Report()
    note_unseen(scene, report)
    assert report.codes() <= {"recipe-places"}
    return [place.node.name for place in places(scene)], [finding.text for finding in report]


def test_every_node_is_looked_at(tmp_path: Path) -> None:
    """However many there are: what stands once does not count."""
    names = [f"House_{number}" for number in range(50)]
    found, said = looked_at(*(node(name, node(f"{name}_roof")) for name in names))
    assert sorted(found) == sorted([*names, *(f"{name}_roof" for name in names)])
    assert said == []
    nodes = [{"name": name} for name in (*names, "StreetLamp_last")]
    content = {"asset": {"version": "2.0"}, "nodes": nodes, "scene": 0}
    content["scenes"] = [{"nodes": list(range(len(nodes)))}]
    source = tmp_path / "many.gltf"
    source.write_text(json.dumps(content))
    report = Report()
    made = write_recipe(Resolver(source, report), None)
    assert made.suspicions == 1
    assert "StreetLamp_last" in made.text
    assert "recipe-places" not in report.codes()


def test_shared_nodes_have_all_their_places_up_to_the_bound() -> None:
    lamp = node("Lamp")
    poles = [node(f"Pole_{number}", lamp, x=float(number)) for number in range(6)]
    scene = LegacyScene(SOURCE, "osg", roots=poles)
    where = [place.point((0.0, 0.0, 0.0))[0] for place in places(scene) if place.node is lamp]
    assert where == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    assert looked_at(*poles)[1] == []
    found, said = looked_at(*poles, node("Pole_6", lamp), node("Pole_7", lamp), node("Last"))
    assert found.count("Lamp") == 1 + 5
    assert {"Pole_6", "Pole_7", "Last"} <= set(found)
    assert said == ["2 more places of things that stand in several; not looked at"]


@pytest.mark.parametrize(
    ("depth", "number"), [(20, f"{2**20 - 1 - 20 - 5}"), (60, f"over {10**12}")]
)
def test_a_bomb_is_counted_and_not_walked(depth: int, number: str) -> None:
    """Each node stands twice in the one above: 2^depth - 1 places of so many nodes."""
    top = node("n0")
    for level in range(1, depth):
        top = node(f"n{level}", top, top)
    found, said = looked_at(top)
    assert len(found) == depth + 5
    assert len(set(found)) == depth
    assert said == [f"{number} more places of things that stand in several; not looked at"]


def stage(path: Path, instances: int, prims: int) -> tuple[list[str], list[str]]:
    """The names of the nodes of a stage of ``prims`` and of instances of three; what is said."""
    head = '#usda 1.0\n(\n    defaultPrim = "World"\n)\ndef Xform "World"\n{\n'
    parts = 'def Xform "Lamp"\n{\n    def Xform "Post"\n    {\n    }\n'
    parts += '    def Xform "Head" (\n        instanceable = true\n'
    parts += "        references = </Inner>\n    )\n    {\n    }\n}\n"
    inner = 'def Xform "Inner"\n{\n    def Xform "Bulb"\n    {\n    }\n}\n'
    body = "".join(
        f'def Xform "L{i}" (\n    instanceable = true\n    references = </Lamp>\n)\n{{\n}}\n'
        for i in range(instances)
    )
    body += "".join(f'def Xform "P{i}"\n{{\n}}\n' for i in range(prims))
    path.write_text(f'{head}{body}}}\nclass Scope "Made"\n{{\n}}\n{parts}{inner}')
    report = Report()
    scene = stage_scene(path, lambda file: True, report)
    texts = [finding.text for finding in report if finding.code == "recipe-places"]
    return [place.node.name for place in places(scene)], texts


def test_every_prim_is_looked_at_and_instances_up_to_the_bound(tmp_path: Path) -> None:
    """An instance holds a post, a head and, in that, a bulb; Lamp and Inner stand themselves."""
    found, said = stage(tmp_path / "a.usda", instances=2, prims=30)
    assert said == []
    assert found.count("Bulb") == 2 + 1 + 1  # in L0, L1, Lamp, Inner
    found, said = stage(tmp_path / "b.usda", instances=10, prims=30)
    assert {f"L{i}" for i in range(10)} | {f"P{i}" for i in range(30)} <= set(found)
    # Post and Head of one lamp and the bulb of one head are the first of their kind; the other
    # places in instances are 9 (2 + 1) and the bulb in Lamp's own head, of which 5 are seen.
    inside = found.count("Post") + found.count("Head") + found.count("Bulb")
    own = 3  # Post and Head of Lamp, Bulb of Inner
    assert inside == own + 3 + 5
    assert said == [f"{9 * 3 + 1 - 5} more places of things that stand in several; not looked at"]
