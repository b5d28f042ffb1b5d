"""Convert: lamps inside their own fixtures shine out of them, those in rooms don't."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import gltf_lights
from converted import lights, opened, run, sidecar
from pxr import Sdf, Usd, UsdGeom, UsdLux

import hdrusd.usd.fixtures
from hdrusd.conversion import Result
from hdrusd.job import Job
from hdrusd.photometry.fixture import stopped
from hdrusd.render import render_sequence
from hdrusd.report import Report
from hdrusd.usd.fixtures import PlacedMesh, free_from
from hdrusd.usd.light import read_light

LIGHT = "KHR_lights_punctual"
LAMP = {"name": "lamp", "type": "point", "intensity": 1000.0}

#: Corners of a box's twelve triangles, as the sides of its three coordinates.
_CORNERS = np.array(
    [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32
)  # corner 4 x + 2 y + z
_FACES = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]


def box(low: tuple[float, ...], high: tuple[float, ...]) -> Any:
    """(36, 3) corners of triangles."""
    corners = np.array(low, np.float32) + _CORNERS * np.subtract(high, low).astype(np.float32)
    return np.concatenate([corners[[a, b, c, a, c, d]] for a, b, c, d in _FACES])


GROUND = box((-50.0, -0.1, -50.0), (50.0, 0.0, 50.0))
HOUSING = box((-0.3, 9.8, -0.3), (0.3, 10.3, 0.3))


def write(
    path: Path,
    meshes: dict[str, Any],
    nodes: list[dict[str, Any]] | None = None,
    *,
    materials: Mapping[str, Any] = {},
    **more: Any,
) -> Path:
    """Meshes of one node each, and a lamp of 1000 cd 10 m above the origin; Y is up."""
    body = b"".join(np.asarray(points, "<f4").tobytes() for points in meshes.values())
    views, accessors, start = [], [], 0
    for points in meshes.values():
        length = 12 * len(points)
        views.append({"buffer": 0, "byteOffset": start, "byteLength": length})
        accessors.append(
            {"bufferView": len(views) - 1, "componentType": 5126, "count": len(points)}
            | {"type": "VEC3", "min": points.min(0).tolist(), "max": points.max(0).tolist()}
        )
        start += length
    paint = {"name": "paint", "pbrMetallicRoughness": {"metallicFactor": 0}}
    kinds = [paint, *materials.values()]
    made = [
        {
            "name": name,
            "primitives": [
                {
                    "attributes": {"POSITION": index},
                    "material": 1 + list(materials).index(name) if name in materials else 0,
                }
            ],
        }
        for index, name in enumerate(meshes)
    ]
    place = {"name": "post", "translation": [0, 10, 0], "extensions": {LIGHT: {"light": 0}}}
    nodes = nodes or [*({"name": n, "mesh": i} for i, n in enumerate(meshes)), place]
    uri = "data:application/octet-stream;base64," + base64.b64encode(body).decode()
    return gltf_lights(
        path,
        [LAMP],
        nodes,
        buffers=[{"byteLength": len(body), "uri": uri}],
        bufferViews=views,
        accessors=accessors,
        meshes=made,
        materials=kinds,
        **more,
    )


def excluded(result: Result) -> dict[str, list[str]]:
    """What each light leaves out of its shadows."""
    found = {}
    for name, prim in lights(opened(result)).items():
        collection = UsdLux.LightAPI(prim).GetShadowLinkCollectionAPI()
        found[name] = [str(path) for path in collection.GetExcludesRel().GetTargets()]
    return found


def codes(result: Result) -> set[str]:
    return {code for code in result.report.codes() if code.startswith("fixture")}


def below(gl: Any, result: Result, tmp_path: Path) -> Any:
    """cd/m2 of the ground under the lamp, from beneath its housing."""
    eye = tmp_path / "eye.usda"
    eye.write_text(
        '#usda 1.0\ndef Camera "Eye"\n{\n    float focalLength = 240\n'
        "    float horizontalAperture = 24\n    float verticalAperture = 18\n"
        "    matrix4d xformOp:transform = ((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), "
        '(0, 9, 0, 1))\n    uniform token[] xformOpOrder = ["xformOp:transform"]\n}\n'
    )
    job = Job(result.output, width=8, height=6, session_layer=eye, camera="/Eye")
    (frame,) = render_sequence(gl, job, Report())
    return frame.hdr


#: A white surface without a highlight: L = E / pi.
WHITE = '[[material]]\nmatch = "paint"\ndiffuse = [1, 1, 1]\nspecular = [0, 0, 0]\nroughness = 1\n'


def test_a_lamp_in_its_housing_lights_the_ground(gl: Any, tmp_path: Path) -> None:
    source = write(tmp_path / "street.gltf", {"Ground": GROUND, "Housing": HOUSING})
    sidecar(tmp_path, WHITE)
    result = run(source)
    assert excluded(result) == {"lamp": ["/street/Housing/Housing_0"]}
    (finding,) = [f for f in result.report if f.code == "fixture-shadow"]
    assert finding.thing == "lamp"
    assert "/street/Housing/Housing_0" in finding.text
    # I / d^2 = 10 lx; half an 8 by 6 picture of 0.9 m is 0.45 m off: cos^3 = 1 - 0.003.
    assert below(gl, result, tmp_path) == pytest.approx(10.0 / np.pi, rel=5e-3)


def test_a_lamp_in_a_room_does_not_light_the_street(gl: Any, tmp_path: Path) -> None:
    room = box((-1.5, 9.2, -2.0), (1.5, 11.0, 2.0))
    source = write(tmp_path / "street.gltf", {"Ground": GROUND, "Room": room})
    sidecar(tmp_path, WHITE)
    result = run(source)
    assert excluded(result) == {"lamp": []}
    assert codes(result) == set()
    assert np.all(below(gl, result, tmp_path) == 0.0)


def test_the_photometry_file_keeps_the_shadow(gl: Any, tmp_path: Path) -> None:
    source = write(tmp_path / "street.gltf", {"Ground": GROUND, "Housing": HOUSING})
    sidecar(tmp_path, WHITE + '[[light]]\nmatch = "lamp"\nfixture_shadow = true\n')
    result = run(source)
    assert excluded(result) == {"lamp": []}
    assert codes(result) == set()
    assert np.all(below(gl, result, tmp_path) == 0.0)


def test_what_is_merged_with_the_ground_still_shades(tmp_path: Path) -> None:
    merged = np.concatenate([GROUND, HOUSING])
    result = run(write(tmp_path / "street.gltf", {"Street": merged}))
    assert excluded(result) == {"lamp": []}
    (finding,) = [f for f in result.report if f.code == "fixture-large"]
    assert "/street/Street/Street_0" in finding.text


def test_cars_and_walls_are_no_fixtures(tmp_path: Path) -> None:
    """A lamp below a car, before a wall and beside a pole."""
    car = box((-0.9, 10.2, -2.0), (0.9, 11.6, 2.0))
    wall = box((-2.0, 7.0, 0.2), (2.0, 12.0, 0.4))
    pole = box((0.1, 0.0, -0.1), (0.3, 12.0, 0.1))
    result = run(write(tmp_path / "street.gltf", {"Car": car, "Wall": wall, "Pole": pole}))
    assert excluded(result) == {"lamp": []}
    assert codes(result) == set()


def test_of_copies_each_lamp_leaves_out_its_own(tmp_path: Path) -> None:
    nodes = [
        {
            "name": f"post{i}",
            "translation": [20.0 * i, 0, 0],
            "rotation": [0, np.sin(i), 0, np.cos(i)],
            "mesh": 0,
            "children": [3 + i],
        }
        for i in range(3)
    ]
    nodes += [
        {"name": f"at{i}", "translation": [0, 10, 0], "extensions": {LIGHT: {"light": 0}}}
        for i in range(3)
    ]
    result = run(write(tmp_path / "street.gltf", {"Housing": HOUSING}, nodes))
    stage = opened(result)
    found = {}
    for prim in (prim for prim in stage.Traverse() if prim.HasAPI(UsdLux.LightAPI)):
        query = UsdLux.LightAPI(prim).GetShadowLinkCollectionAPI().ComputeMembershipQuery()
        meshes = Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
        found[str(prim.GetParent().GetParent().GetName())] = [
            mesh.GetPath().GetPrefixes()[1].name
            for mesh in meshes
            if mesh.IsA(UsdGeom.Mesh) and not query.IsPathIncluded(mesh.GetPath())
        ]
    assert found == {f"post{i}": [f"post{i}"] for i in range(3)}


def test_posts_that_stand_alike_are_looked_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Forty posts of two makes, ten of each turned: four looks."""
    looks = []

    def noted(*args: Any) -> Any:
        looks.append(args)
        return stopped(*args)

    monkeypatch.setattr(hdrusd.usd.fixtures, "stopped", noted)
    open_above = box((-0.3, 9.8, -0.3), (0.3, 10.05, 0.3))
    nodes: list[dict[str, Any]] = []
    for i in range(40):
        place = {"translation": [20.0 * i, 0.1 * i, -7.0 * i], "rotation": [0, i % 4 // 2, 0, 1]}
        if i % 4 < 2:
            del place["rotation"]
        nodes.append({"name": f"post{i}", "mesh": i % 2, "children": [40 + i], **place})
    nodes += [
        {"name": f"at{i}", "translation": [0, 10, 0], "extensions": {LIGHT: {"light": 0}}}
        for i in range(40)
    ]
    result = run(write(tmp_path / "s.gltf", {"A": HOUSING, "B": open_above}, nodes))
    assert len(looks) == 4
    lamps = [p for p in opened(result).Traverse() if p.HasAPI(UsdLux.LightAPI)]
    links = [UsdLux.LightAPI(lamp).GetShadowLinkCollectionAPI() for lamp in lamps]
    targets = [link.GetExcludesRel().GetTargets() for link in links]
    # Each its own post: the parent of what it leaves out is the parent of its node.
    posts = [lamp.GetParent().GetParent().GetPath() for lamp in lamps]
    assert len(posts) == 40
    assert [[path.GetParentPath() for path in some] for some in targets] == [[p] for p in posts]


@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_lengths_are_metres(tmp_path: Path, unit: float) -> None:
    """A housing of 0.6 m in a source of centimetres; one of 6 m is none."""
    for factor, wanted in ((100.0, ["/street/Housing/Housing_0"]), (1000.0, [])):
        housing = (HOUSING - np.array([0, 10, 0], "f4")) * np.float32(factor)
        nodes = [
            {"name": "Housing", "mesh": 0},
            {"name": "post", "extensions": {LIGHT: {"light": 0}}},
        ]
        source = write(tmp_path / f"{factor:g}" / "street.gltf", {"Housing": housing}, nodes)
        result = run(source, source_unit=0.01, meters_per_unit=unit)
        assert excluded(result) == {"lamp": wanted}


def test_glass_that_blends_and_what_is_hidden_hold_nothing(tmp_path: Path) -> None:
    glass = {"Housing": {"name": "glass", "alphaMode": "BLEND"}}
    source = write(tmp_path / "street.gltf", {"Housing": HOUSING}, materials=glass)
    assert excluded(run(source)) == {"lamp": []}
    source = write(tmp_path / "hidden" / "street.gltf", {"Housing": HOUSING})
    sidecar(source.parent, '[[node]]\nmatch = "Housing"\nvisible = false\n')
    assert excluded(run(source)) == {"lamp": []}


def test_what_moves_is_where_it_is_at_the_start(tmp_path: Path) -> None:
    """A lantern that stands 5 m beside its lamp but at the first time."""
    times = np.array([0, 1], "<f4").tobytes()
    places = np.array([[0, 0, 0], [5, 0, 0]], "<f4").tobytes()
    source = write(tmp_path / "street.gltf", {"Housing": HOUSING})
    document = json.loads(source.read_text())
    uri = "data:application/octet-stream;base64," + base64.b64encode(times + places).decode()
    document["buffers"].append({"byteLength": 32, "uri": uri})
    document["bufferViews"] += [
        {"buffer": 1, "byteLength": 8},
        {"buffer": 1, "byteOffset": 8, "byteLength": 24},
    ]
    number = {"componentType": 5126, "count": 2}
    document["accessors"] += [
        {"bufferView": 1, "type": "SCALAR", "min": [0], "max": [1], **number},
        {"bufferView": 2, "type": "VEC3", **number},
    ]
    document["nodes"][0]["translation"] = [5, 0, 0]
    document["animations"] = [
        {
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            "samplers": [{"input": 1, "output": 2}],
        }
    ]
    source.write_text(json.dumps(document))
    assert excluded(run(source)) == {"lamp": ["/street/Housing/Housing_0"]}


def test_a_light_reads_back_as_it_was(tmp_path: Path) -> None:
    result = run(write(tmp_path / "street.gltf", {"Housing": HOUSING}))
    light = lights(opened(result))["lamp"]
    before = read_light(light)
    free_from(light, [PlacedMesh(Sdf.Path("/street/Other"), Sdf.Path("/street"), 0)])
    assert read_light(light) == before
