"""A first photometry file: what it finds, that it is one, and that it fits what it was made of."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import lamp, node, obj, one_square, paint, png, square, texture
from click.testing import CliRunner, Result
from converted import run
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.cli.main import hdrusd
from hdrusd.legacy.scene import TRS, LegacyScene, Subset
from hdrusd.photometry.lamp_classes import BY_NAME
from hdrusd.recipe.evidence import leads
from hdrusd.recipe.lead import Lead
from hdrusd.recipe.naming import stem
from hdrusd.recipe.text import quoted, recipe


def found(scene: LegacyScene) -> dict[str, Lead]:
    """What was found, by section and pattern."""
    return {f"{lead.section} {lead.pattern}": lead for lead in leads(scene, lambda image: None)}


def street(**changes: Any) -> LegacyScene:
    """Spots 8 m above a square, shining straight down (Y is up)."""
    light = lamp(name="ls0", kind="spot", spot_cutoff=70.0, direction=(0.0, -1.0, 0.0), **changes)
    lights = [replace(light, name=f"ls{i}") for i in range(3)]
    high = [node(f"n{i}", transform=TRS((9.0 * i, 8.0, 0.0)), lights=[i]) for i in range(3)]
    return one_square(lights=lights, roots=[node("ground", meshes=[0]), *high])


def test_what_shines_down_from_above_is_a_street_light() -> None:
    (lead,) = found(street()).values()
    assert (lead.section, lead.pattern, lead.count) == ("light", "ls*", 3)
    assert lead.kind is BY_NAME["street-light"]
    assert lead.counts


@pytest.mark.parametrize("changes", [{"candela": 5.0}, {"enabled": False}, {"kind": "ambient"}])
def test_what_needs_no_number_is_left_out(changes: dict[str, Any]) -> None:
    scene = street()
    scene.lights = [replace(light, **changes) for light in scene.lights]
    assert found(scene) == {}


def test_light_points_where_lights_are_may_be_the_same_lamps() -> None:
    scene = street()
    heads = np.array([[9.0 * i, 8.1, 0.0] for i in range(3)])
    scene.lights.append(lamp(name="heads", positions=heads))
    scene.lights.append(lamp(name="studs", positions=heads - [0.0, 8.0, 0.0]))
    scene.roots.append(node("strings", lights=[3, 4]))
    assert found(scene)["light heads"].twin
    assert not found(scene)["light studs"].twin
    document = recipe("a", leads(scene, lambda image: None))
    assert '# match = "heads"\n# enabled = false\n' in document


def test_a_level_spot_at_a_cars_height_is_a_headlamp() -> None:
    ahead = lamp(name="a", kind="spot", spot_cutoff=20.0, direction=(1.0, 0.0, 0.0))
    car = node("n", transform=TRS((0.0, 0.7, 0.0)), lights=[0])
    scene = one_square(lights=[ahead], roots=[node("ground", meshes=[0]), car])
    assert found(scene)["light a"].kind is BY_NAME["low-beam"]
    car.transform = TRS((0.0, 4.0, 0.0))  # too high
    assert found(scene)["light a"].kind is None
    assert not found(scene)["light a"].counts


def test_names_above_tell_what_a_light_is() -> None:
    scene = one_square(
        lights=[lamp(name="l")],
        roots=[node("Traffic_Light_3", children=[node("x", lights=[0])])],
    )
    assert found(scene)["light l"].kind is BY_NAME["traffic-signal"]


def test_one_name_for_lamps_of_two_kinds_is_not_one_entry() -> None:
    scene = one_square(
        lights=[lamp(name="l1"), lamp(name="l2"), lamp(name="l3")],
        roots=[
            node("stop_lamp", lights=[0]),
            node("tail_lamp", lights=[1]),
            node("tail_lamp", lights=[2]),
        ],
    )
    kinds = {key: lead.kind for key, lead in found(scene).items() if lead.section == "light"}
    assert kinds == {
        "light l1": BY_NAME["stop"],
        "light l2": BY_NAME["rear-position"],
        "light l3": BY_NAME["rear-position"],
    }


def test_what_glows_beside_a_light_is_its_glass() -> None:
    scene = street()
    scene.materials.append(paint(name="glass", emission=(1.0, 0.8, 0.6)))
    scene.meshes.append(square(name="head", material=len(scene.materials) - 1))
    scene.roots[1].meshes.append(1)
    lead = found(scene)["material glass"]
    assert (lead.kind, lead.counts) == (BY_NAME["street-light"], True)
    assert "lamp n0" not in found(scene)  # it has its light


def test_what_glows_alone_lights_nothing() -> None:
    glass = paint(name="street_lamp_glass", emission=(1.0, 1.0, 1.0))
    mesh = square(points=np.array([[0, 4, 0], [2, 4, 0], [2, 6, 0], [0, 6, 0]], np.float32))
    scene = one_square(materials=[glass], meshes=[mesh], roots=[node("post", meshes=[0])])
    assert found(scene)["material street_lamp_glass"].counts
    lead = found(scene)["lamp post"]
    assert (lead.offset, lead.counts) == ((1.0, 5.0, 0.0), False)
    halves = square(
        points=np.array(
            [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [4, 4, 4], [6, 4, 4], [6, 6, 4]],
            np.float32,
        ),
        face_counts=np.array([4, 3], np.int32),
        face_indices=np.arange(7, dtype=np.int32),
        uvs={},
        material=1,
        subsets=(Subset(0, np.array([1], np.int32)),),
    )
    scene = one_square(
        materials=[glass, paint()], meshes=[halves], roots=[node("post", meshes=[0])]
    )
    assert found(scene)["lamp post"].offset == (5.0, 5.0, 4.0)


def test_a_post_that_glows_by_its_map_has_its_lamp_where_the_map_is_bright() -> None:
    """The map's upper quarter is white, and its middle at 0.875; each triangle is looked at in
    eighths of its edges, so the middle is known to a sixteenth.
    """
    shown = np.zeros((64, 64, 3))
    shown[:16] = 1.0
    glass = paint(name="street_lamp", emission=(1.0,) * 3, emission_map=texture())
    scene = one_square(materials=[glass], roots=[node("post", meshes=[0])])
    lead = {lead.section: lead for lead in leads(scene, lambda image: shown)}["lamp"]
    assert lead.offset == pytest.approx((0.5, 0.875, 0.0), abs=1.0 / 16.0)


def test_a_post_by_its_name_is_a_suspicion_with_its_top() -> None:
    points = np.array([[0, 0, 0], [2, 0, 0], [2, 7, 0], [0, 7, 0]], np.float32)
    part = node("mesh", transform=TRS((0.0, 1.0, 0.0)), meshes=[0])
    posts = [
        node(f"Lamppost_0{n}", transform=TRS((100.0 * n, 0.0, 0.0)), children=[part])
        for n in (1, 2)
    ]
    scene = one_square(meshes=[square(points=points)], roots=posts)
    (lead,) = found(scene).values()
    assert (lead.section, lead.pattern) == ("lamp", "Lamppost_*")
    assert (lead.offset, lead.counts, lead.count) == ((1.0, 8.0, 0.0), False, 2)


def test_a_painted_lamp_is_a_suspicion() -> None:
    y, x = np.mgrid[0:64, 0:64]
    glow = np.clip(1.2 * np.exp(-np.hypot(y - 32, x - 32) / 6.0), 0.02, 1.0)
    scene = one_square(materials=[paint(name="wall", diffuse_map=texture())])
    pixels = np.repeat(glow[..., None], 3, axis=2)
    (lead,) = leads(scene, lambda image: pixels)
    assert (lead.section, lead.pattern, lead.found, lead.counts) == (
        "material",
        "wall",
        "spots",
        False,
    )


@given(st.text())
def test_any_name_is_a_string_of_toml(name: str) -> None:
    if any(0xD800 <= ord(c) < 0xE000 for c in name):
        name = ""
    assert tomllib.loads(f"a = {quoted(name)}") == {"a": name}


@given(st.text(min_size=1))
def test_the_stem_of_a_name_fits_it(name: str) -> None:
    assert fnmatchcase(name, stem(name))


@given(st.lists(st.text(st.characters(exclude_categories=["Cs"])), max_size=4))
def test_any_database_gives_a_photometry_file(names: list[str]) -> None:
    lights = [lamp(name=name) for name in names]
    materials = [paint(name=f"headlight {name}", emission=(1.0, 1.0, 1.0)) for name in names]
    scene = one_square(
        lights=lights,
        materials=[paint(), *materials],
        roots=[node("low beam", lights=[i]) for i in range(len(names))],
    )
    text = recipe("a\n[[light]]", leads(scene, lambda image: None))
    document = tomllib.loads(text)
    assert document["ambient"] == {"preset": "moonless"}
    assert set(document) <= {"ambient", "light", "material"}
    for name in names:
        if name:
            assert any(fnmatchcase(name, entry["match"]) for entry in document["light"])


# -- the command ---------------------------------------------------------------------------


def init(*arguments: str) -> Result:
    return CliRunner().invoke(hdrusd, ["recipe", "init", *arguments])


def test_the_command_writes_beside_the_source_what_convert_takes(tmp_path: Path) -> None:
    source = obj(tmp_path / "a.obj", "Ke 1 1 1\nmap_Kd wall.png")
    png(tmp_path / "wall.png")
    source.write_text(source.read_text().replace("o Wall", "o billboard_1"))
    done = init(str(source))
    assert done.exit_code == 0, done.output
    assert done.stdout == f"{tmp_path / 'photometry.toml'}: 2 entries, 0 suspicions\n"
    result = run(source)
    assert not [code for code in result.report.codes() if code.startswith("sidecar")]
    (row,) = (row for row in result.materials if row["name"] == "paint")
    assert row["luminance_cd_m2"] == pytest.approx(BY_NAME["advertisement"].typical)
    assert row["provenance"] == "estimated"
    assert row["confidence"] == "low"


def test_the_top_is_where_up_is(tmp_path: Path) -> None:
    source = obj(tmp_path / "a.obj", "Kd 1 1 1")
    source.write_text(source.read_text().replace("o Wall", "o Lamppost_1"))
    assert "offset = [0.5, 1.0, 0.0]" in init(str(source), "-").stdout
    # The square is flat across Z, so its middle is its top.
    assert "offset = [0.5, 0.5, 0.0]" in init(str(source), "-", "--up", "Z").stdout


def test_the_command_replaces_nothing_unasked(tmp_path: Path) -> None:
    source = obj(tmp_path / "a.obj", "Kd 1 1 1")
    (tmp_path / "photometry.toml").write_text("mine")
    done = init(str(source))
    assert (done.exit_code, (tmp_path / "photometry.toml").read_text()) == (1, "mine")
    assert init(str(source), "--overwrite").exit_code == 0
    assert (tmp_path / "photometry.toml").read_text() != "mine"
    done = init(str(source), "-")
    assert tomllib.loads(done.stdout) == {"ambient": {"preset": "moonless"}}
    assert init(str(tmp_path / "none.obj"), "-").exit_code != 0


@pytest.mark.parametrize(
    "name", ["derived-osg/night_street.osgt", "gazebo/lamp_post/meshes/lamp_post.dae"]
)
def test_real_databases(testdata: Path, tmp_path: Path, name: str) -> None:
    source = testdata / "data" / name
    target = tmp_path / "p.toml"
    root = ("--root", str(source.parents[1]))
    assert init(str(source), str(target), *root).exit_code == 0
    result = run(source, tmp_path / "a.usda", photometry=target, roots=(source.parents[1],))
    assert not [code for code in result.report.codes() if code.startswith("sidecar")]
    levels = json.dumps([row["confidence"] for row in (*result.lights, *result.materials)])
    assert '"low"' in levels


STAGE = """\
#usda 1.0
(
    metersPerUnit = 0.01
    upAxis = "Z"
)
def Xform "StreetLamp_1"
{
    double3 xformOp:translate = (0, 0, 800)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def SphereLight "Bulb" (prepend apiSchemas = ["ShapingAPI"])
    {
        float inputs:shaping:cone:angle = 70
    }
    def Mesh "Glass" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        point3f[] points = [(0, 0, 0), (30, 0, 0), (30, 30, 0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        rel material:binding = </Glow>
    }
}
def DistantLight "Sun"
{
}
def Mesh "Ground"
{
    point3f[] points = [(-900, -900, 0), (900, -900, 0), (900, 900, 0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
}
def Material "Glow"
{
    token outputs:surface.connect = </Glow/S.outputs:surface>
    def Shader "S"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:emissiveColor = (1, 1, 1)
        token outputs:surface
    }
}
"""


def test_a_stage_is_a_database_too(tmp_path: Path) -> None:
    (tmp_path / "a.usda").write_text(STAGE)
    done = init(str(tmp_path / "a.usda"))
    assert done.exit_code == 0, done.output
    text = (tmp_path / "photometry.toml").read_text()
    document = tomllib.loads(text)
    assert [entry["match"] for entry in document["light"]] == ["Bulb"]
    assert document["light"][0]["lumens"] == BY_NAME["street-light"].typical
    assert [entry["match"] for entry in document["material"]] == ["Glow"]
    assert '# match = "Sun"\n# illuminance = 0' in text  # nothing tells how strong it is
    result = run(tmp_path / "a.usda", tmp_path / "out" / "b.usda")
    assert not [code for code in result.report.codes() if code.startswith("sidecar")]
    # What is photometric now needs no recipe any more.
    done = init(str(result.output), str(tmp_path / "again.toml"))
    assert done.exit_code == 0, done.output
    again = tomllib.loads((tmp_path / "again.toml").read_text())
    assert set(again) == {"ambient"}


def test_a_picture_is_looked_at_once() -> None:
    image = texture().image
    shared = [paint(name=f"m{n}", diffuse_map=replace(texture(), image=image)) for n in range(9)]
    asked: list[str] = []
    leads(one_square(materials=shared), lambda image: asked.append(image.name))
    assert asked == ["wall.png"]


def test_the_unit_that_was_stated_stands_in_the_recipe(tmp_path: Path) -> None:
    """An inch, and Z up: convert without options then has the square 0.0254 m wide."""
    source = obj(tmp_path / "a.obj", "Kd 0.5 0.5 0.5")
    options = ["--source-unit", "0.0254", "--up", "Z"]
    assert CliRunner().invoke(hdrusd, ["recipe", "init", str(source), *options]).exit_code == 0
    written = tomllib.loads((tmp_path / "photometry.toml").read_text())
    assert written["source"] == {"unit": 0.0254, "up": "Z"}
    result = run(source)
    assert result.unit_stated
    assert result.diagonal == pytest.approx(0.0254 * 2.0**0.5, rel=1e-6)
    assert not any(finding.code.startswith("sidecar") for finding in result.report)


def test_a_unit_is_a_number(tmp_path: Path) -> None:
    source = obj(tmp_path / "a.obj", "Kd 1 1 1")
    done = init(str(source), "-", "--source-unit", "nan")
    assert done.exit_code == 2
    assert "nan is no number" in done.stderr
