"""The shared truth set: every case by the set's own checker."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
from truth.cases import OPTIONS, check, read_cases, render_case, worst

from hdrusd.report import Report

#: The cases of the shared set, and beside it what else their words ask for.
CASES = (
    "ambient_plus_point",
    "area_disk_cm",
    "area_rect",
    "area_sphere",
    "blinn_phong",
    "dome_two_tone",
    "emissive_quads_cm",
    "ggx_metal",
    "headlights_anim",
    "ies_batwing_cm",
    "ies_downlight",
    "ies_road",
    "instanced_lamps",
    "ldt_road",
    "point_plane",
    "point_tilted_cm",
    "road_grid_one_sided",
    "roof_opening",
    "room_flux",
    "shadow_box",
    "spot_soft_cm",
    "sun_cards",
    "texture_lambert",
    "two_coloured_lights",
)

#: Where nothing is approximated the difference is that of float32, of the sixth digit that
#: the stages are written with, and of the grid of a photometric file.
EXACT = 1e-4


@pytest.fixture
def truth(testdata: Path) -> Path:
    folder = testdata / "truth"
    if not (folder / "expected.json").is_file():
        pytest.skip("the test data has no truth set")
    return folder


def test_the_set_has_these_cases(truth: Path) -> None:
    assert {case.id for case in read_cases(truth)} >= set(CASES)


@pytest.mark.parametrize("name", CASES)
def test_case_passes(gl: Any, truth: Path, tmp_path: Path, name: str) -> None:
    (case,) = [case for case in read_cases(truth) if case.id == name]
    render_case(gl, case, tmp_path, Report())
    good, text = check(case, tmp_path)
    assert good, text
    if not case.approximated:
        assert worst(case, tmp_path) <= EXACT


# -- folders of cases in the same format, made by others ---------------------------------------

STAGE = """#usda 1.0
( metersPerUnit = 1 )
def Mesh "Ground"
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)]
    color3f[] primvars:displayColor = [(0.5, 0.5, 0.5)]
}
def DomeLight "Sky"
{
    float inputs:intensity = 10
}
def Camera "Eye"
{
    double3 xformOp:translate = (0, 0, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""


def foreign(folder: Path, value: float, **entry: Any) -> Path:
    """A set of one case that has only what the format cannot do without."""
    rgb = {"Y": value, "RGB": [value] * 3}
    probe = {"id": "a", "frame": 0.0, "pixel": [4, 3], "expect": rgb, "rel_tol": 0.01}
    case = {
        "id": "one",
        "stage": "one.usda",
        "resolution": [8, 6],
        "frames": [{"time": 0, "exr": "one.exr"}],
        "probes": [probe | {"abs_tol": 1e-6}],
        **entry,
    }
    (folder / "one.usda").write_text(STAGE)
    text = json.dumps({"format": "hdrusd-truth/1", "cases": [case]})
    (folder / "expected.json").write_text(text)
    return folder


@pytest.mark.parametrize("covers", [["what nobody here has heard of"], ["occlusion"]])
def test_any_words_are_run(gl: Any, tmp_path: Path, covers: list[str]) -> None:
    """A plane under an open sky of 10 cd/m2 shows rho L, whether or not its sky is looked for."""
    (case,) = read_cases(foreign(tmp_path, 5.0, covers=covers))
    render_case(gl, case, tmp_path, Report())
    good, text = check(case, tmp_path)
    assert good, text
    assert worst(case, tmp_path) < 0.01


def test_needs_ask_for_options_like_covers(tmp_path: Path) -> None:
    (case,) = read_cases(foreign(tmp_path, 5.0, needs="needs a dome with occlusion"))
    assert case.options.items() >= OPTIONS["occlusion"].items()


def test_light_where_none_may_be_is_infinitely_wrong(gl: Any, tmp_path: Path) -> None:
    (case,) = read_cases(foreign(tmp_path, 0.0))
    render_case(gl, case, tmp_path, Report())
    assert not check(case, tmp_path)[0]
    assert worst(case, tmp_path) == math.inf
