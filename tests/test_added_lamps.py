"""``[[lamp]]``: lamps that a database lacks stand where the photometry file says, as strong."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import obj
from converted import opened, run, sidecar
from pxr import Usd, UsdGeom

from hdrusd.job import Job
from hdrusd.render import render_sequence
from hdrusd.report import Report
from hdrusd.usd.lux import read_lux

FLOOR = """\
mtllib a.mtl
o Post_1
v -20 0 20
v 20 0 20
v 20 0 -20
v -20 0 -20
usemtl floor
f 1 2 3 4
"""


def floor(folder: Path) -> Path:
    (folder / "a.mtl").write_text("newmtl floor\nKd 0.5 0.5 0.5\nKs 0 0 0\n")
    (folder / "a.obj").write_text(FLOOR)
    return folder / "a.obj"


def where(prim: Usd.Prim) -> list[float]:
    world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)
    return [round(v, 6) for v in world.ExtractTranslation()]


def test_places_are_in_the_units_of_the_source(tmp_path: Path) -> None:
    source = floor(tmp_path)
    sidecar(
        tmp_path,
        '[[lamp]]\nname = "Street"\nat = [[100, 300, 0], [-100, 300, 50]]\ncandela = 400\n'
        'provenance = "measured"\n',
    )
    result = run(source, source_unit=0.01)
    found = [prim for prim in opened(result).Traverse() if prim.GetTypeName() == "SphereLight"]
    assert sorted(where(prim) for prim in found) == [[-1, 3, 0.5], [1, 3, 0]]
    rows = [row for row in result.lights if row["kind"] == "point"]
    assert [(row["value"], row["unit"], row["provenance"]) for row in rows] == [
        (400.0, "cd", "measured")
    ] * 2
    assert result.counts["lights"] == 0  # of the source
    assert not [code for code in result.report.codes() if code.startswith("sidecar")]


def test_a_node_gets_its_lamp(tmp_path: Path) -> None:
    source = obj(tmp_path / "a.obj", "Kd 0.5 0.5 0.5")
    text = source.read_text()
    source.write_text(text.replace("o Wall", "o Post_1") + "o Post_2\nf 1/1 2/2 3/3\n")
    sidecar(
        tmp_path,
        '[[lamp]]\nmatch = "Post_*"\nname = "Head"\noffset = [0, 5, 1]\n'
        "cutoff = 60\nlumens = 1000\n",
    )
    result = run(source)
    found = [prim for prim in opened(result).Traverse() if prim.GetTypeName() == "SphereLight"]
    assert len(found) == 2
    assert [where(prim) for prim in found] == [[0, 5, 1]] * 2
    for prim in found:
        reading = read_lux(prim)
        assert reading is not None
        # A hard cone of 60 degrees: I = Phi / (2 pi (1 - cos 60)) = Phi / pi.
        assert reading.intensity[0] == pytest.approx(1000.0 / math.pi, rel=1e-4)
        down = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0).TransformDir((0, 0, -1))
        assert list(down) == pytest.approx([0, -1, 0], abs=1e-6)


@pytest.mark.parametrize("up", ["Y", "Z"])
@pytest.mark.parametrize("shape", ["cutoff = 60\ncandela = 9", 'lumens = 9\nspread = "lambert"'])
def test_a_lamp_without_an_axis_shines_down(tmp_path: Path, up: str, shape: str) -> None:
    source = floor(tmp_path)
    sidecar(tmp_path, f"[[lamp]]\nat = [[0, 5, 5]]\n{shape}\n")
    result = run(source, up=up)
    (prim,) = (prim for prim in opened(result).Traverse() if prim.GetTypeName() == "SphereLight")
    way = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0).TransformDir((0, 0, -1))
    down = [0, -1, 0] if up == "Y" else [0, 0, -1]
    assert list(way) == pytest.approx(down, abs=1e-6)
    told = [f.text for f in result.report if f.code == "light-aim"]
    assert all("({}, {}, {})".format(*down) in text for text in told)
    assert len(told) == ("lambert" in shape)


def test_the_floor_below_is_lit(gl: Any, tmp_path: Path) -> None:
    source = floor(tmp_path)
    sidecar(
        tmp_path,
        "[ambient]\nilluminance = 0\n[[lamp]]\nat = [[0, 5, 0]]\ncandela = 250\n"
        '[[camera]]\nmatch = "nothing"\n',
    )
    result = run(source)
    stage = opened(result)
    camera = UsdGeom.Camera.Define(stage, "/a/above")
    camera.AddTranslateOp().Set((0.0, 20.0, 0.0))
    camera.AddRotateXOp().Set(-90.0)
    stage.GetRootLayer().Save()
    job = Job(result.output, width=64, height=64, camera="/a/above", shadows=False)
    (frame,) = render_sequence(gl, job, Report())
    # 250 cd from 5 m: 10 lx below it; 0.5 / pi of that. The lamp itself is seen by nobody.
    middle = np.asarray(frame.hdr)[31:33, 31:33].mean()
    assert middle == pytest.approx(0.5 / math.pi * 10.0, rel=2e-3)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("[[lamp]]\ncandela = 5\n", "sidecar-invalid"),
        ("[[lamp]]\nat = []\ncandela = 5\n", "sidecar-invalid"),
        ("[[lamp]]\nat = [[1, 2]]\ncandela = 5\n", "sidecar-invalid"),
        ('[[lamp]]\nmatch = "none"\ncandela = 5\n', "sidecar-no-match"),
        ("[[lamp]]\nat = [[1, 2, 3]]\noffset = [1, 2, 3]\ncandela = 5\n", "sidecar-invalid"),
        ("[[lamp]]\nat = [[1, 2, 3]]\ncandela = 5\nlumens = 7\n", "sidecar-rival"),
        ("[[lamp]]\nat = [[1, 2, 3]]\n", "sidecar-invalid"),
        ("[[lamp]]\nat = [[1, 2, 3]]\ncandella = 5\n", "sidecar-unknown-key"),
    ],
)
def test_what_is_wrong_is_a_finding(tmp_path: Path, text: str, code: str) -> None:
    source = floor(tmp_path)
    sidecar(tmp_path, text)
    assert code in run(source).report.codes()


def test_the_account_leads_back_to_the_entry(tmp_path: Path) -> None:
    source = floor(tmp_path)
    sidecar(tmp_path, '[[lamp]]\nat = [[0, 5, 0]]\ncandela = 250\nprovenance = "estimated"\n')
    result = run(source)
    (row,) = (row for row in result.lights if row["kind"] == "point")
    assert row["source_value"] is None
    assert row["confidence"] == "low"  # somebody's guess, not a colour without a unit
    (entry,) = (e for e in result.as_dict()["fix_first"] if e["what"].startswith("Lamp:"))
    assert entry["write"] is None  # a [[light]] entry would not reach it
    assert "lamp[1]" in entry["what"]


@pytest.mark.parametrize(
    ("keys", "others"),
    [
        ("candella = 250", ["sidecar-unknown-key"]),
        ("candela = -5", ["sidecar-invalid"]),
        ("watts = 70", ["sidecar-invalid"]),
        ('watts = 70\nlamp = "neon"', ["sidecar-invalid"] * 2),
        ("illuminance = 12", []),
        ('ies = "gone.ies"', ["file-missing"]),
        ('ies = "bad.ies"', ["profile-invalid"]),
        ('ies = "bad.ies"\nwatts = 70', ["sidecar-invalid", "profile-invalid"]),
    ],
)
def test_a_lamp_of_no_strength_does_not_shine(tmp_path: Path, keys: str, others: list[str]) -> None:
    source = floor(tmp_path)
    (tmp_path / "bad.ies").write_text("IESNA91\nTILT=NONE\n1 2\n")
    sidecar(tmp_path, f"[[lamp]]\nat = [[0, 5, 0]]\n{keys}\n")
    result = run(source)
    assert result.lights == []
    assert not [prim for prim in opened(result).Traverse() if prim.GetName() == "Lamp"]
    weak = [f for f in result.report if f.text.startswith("no strength; not placed; want one of")]
    assert [(f.code, str(f.source.place)) for f in weak] == [("sidecar-invalid", "lamp[1]")]
    told = [f.code for f in result.report if "lamp[1]" in str(f.source) and f not in weak]
    assert told == others


@pytest.mark.parametrize("keys", ['watts = 70\nlamp = "led"', "watts = 70\nefficacy = 90"])
def test_a_bad_file_leaves_another_strength(tmp_path: Path, keys: str) -> None:
    source = floor(tmp_path)
    (tmp_path / "bad.ies").write_text("IESNA91\nTILT=NONE\n1 2\n")
    sidecar(tmp_path, f'[[lamp]]\nat = [[0, 5, 0]]\nies = "bad.ies"\n{keys}\n')
    result = run(source)
    assert len(result.lights) == 1
    assert "sidecar-rival" not in result.report.codes()


@pytest.mark.parametrize(
    ("rest", "told"),
    [
        ("cutoff = 60", True),
        ('lumens = 900\nspread = "hemisphere"', True),
        ("cutoff = 60\naxis = [0, 0, -1]", False),
        ("candela = 9", False),  # shines everywhere
    ],
)
def test_down_of_a_turned_node_is_told(tmp_path: Path, rest: str, told: bool) -> None:
    """Turned by 30 degrees about X, and once more by the node above it."""
    half = math.radians(15.0)
    turned = [math.sin(half), 0.0, 0.0, math.cos(half)]
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, 2]}],
        "nodes": [
            {"name": "arm", "rotation": turned, "children": [1]},
            {"name": "head", "rotation": turned, "camera": 0},
            {"name": "head", "translation": [4, 0, 0], "camera": 0},
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}],
    }
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    strength = "" if "candela" in rest or "lumens" in rest else "candela = 9\n"
    sidecar(tmp_path, f'[[lamp]]\nmatch = "head"\n{strength}{rest}\n')
    found = [f.text for f in run(tmp_path / "a.gltf").report if f.code == "light-aim"]
    text = "points 60 degrees off straight down, as its node head is turned; axis says otherwise"
    assert [t for t in found if t.startswith("points")] == [text] * told
