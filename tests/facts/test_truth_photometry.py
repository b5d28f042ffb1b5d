"""The photometric files and road scenes of the truth set, shaded here in NumPy.

What remains for a renderer then is to bring the same numbers to the GPU.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Usd

from hdrusd.errors import SourceRef
from hdrusd.photometry.eulumdat import read_eulumdat
from hdrusd.photometry.ies import is_ies, read_ies
from hdrusd.photometry.luminaire import Luminaire
from hdrusd.photometry.profile import even_profile, pack_profiles, profile_candela
from hdrusd.report import Report
from hdrusd.scene import Camera
from hdrusd.usd.extract import StageReader

CASES = ["ies_downlight", "ies_batwing_cm", "ies_road", "ldt_road", "road_grid_one_sided"]

#: Lumens that lights.json gives to seven digits, from a sum over finite steps.
FLUX = 1e-5


def load(file: Path) -> Luminaire:
    report = Report()
    data = file.read_bytes()
    reader = read_ies if is_ies(data) else read_eulumdat
    lamp = reader(data, SourceRef(file), report)
    assert not report.codes()
    return lamp


@pytest.fixture
def truth(testdata: Path) -> Path:
    return testdata / "truth"


def case(truth: Path, name: str) -> tuple[dict[str, Any], dict[str, Any]]:
    cases = json.loads((truth / "expected.json").read_text())["cases"]
    (found,) = (case for case in cases if case["id"] == name)
    return found, json.loads((truth / found["photometry"]).read_text())


def test_every_file_is_exact_on_its_grid(truth: Path) -> None:
    files = sorted((truth / "photometry").iterdir())
    assert len(files) >= 5
    for file in files:
        lamp = load(file)
        _, lost = even_profile(lamp)
        assert lost == 0.0, file.name


def test_the_forms_of_one_road_luminaire_agree(truth: Path) -> None:
    names = "road_c360.ies", "road_c90_270.ies", "road_isym3.ldt"
    lamps = [load(truth / "photometry" / name) for name in names]
    c, gamma = np.meshgrid(np.arange(0.0, 360.0, 1.7), np.arange(0.0, 100.0, 1.3))
    first = lamps[0].value(c, gamma)
    assert first.max() > 9000.0
    assert lamps[1].value(c, gamma) == pytest.approx(first, rel=1e-9)
    # The .ldt has cd per 1000 lm to 0.01 of 12,000 lm; half a step of each is 0.06 + 0.005 cd.
    assert lamps[2].value(c, gamma) == pytest.approx(first, abs=0.07)


@pytest.mark.parametrize("name", CASES)
def test_flux_peak_and_axes(truth: Path, name: str) -> None:
    found, plain = case(truth, name)
    stage = Usd.Stage.Open(str(truth / found["stage"]))
    scene = StageReader(stage, Report()).read(0.0, Camera())
    assert len(scene.lights) == len(plain["lights"])
    for row, light in zip(scene.lights, plain["lights"], strict=True):
        lamp = load(truth / "stages" / light["file"])
        assert lamp.flux() * light["multiplier"] == pytest.approx(light["flux_lm"], rel=FLUX)
        peak = float(scene.profiles[row["profile"]].candela.max())
        assert peak * row["intensity"] == pytest.approx([light["max_candela"]] * 3, rel=1e-6)
        assert row["x"] == pytest.approx(light["c0_direction"], abs=1e-7)
        assert row["y"] == pytest.approx(light["c90_direction"], abs=1e-7)
        assert row["axis"] == pytest.approx(light["nadir_direction"], abs=1e-7)
    assert len(scene.profiles) == len({light["file"] for light in plain["lights"]})


@pytest.mark.parametrize("name", CASES)
def test_probes(truth: Path, name: str) -> None:
    found, plain = case(truth, name)
    reflectance = {m["name"].lower(): np.array(m["reflectance_rgb"]) for m in plain["materials"]}
    points = np.array([probe["point_m"] for probe in found["probes"]])
    normals = np.array([probe["normal"] for probe in found["probes"]])
    lux = np.zeros(len(points))
    for light in plain["lights"]:
        profile, _ = even_profile(load(truth / "stages" / light["file"]))
        atlas, ((place, grid),) = pack_profiles([profile])
        way = points - light["position_m"]
        square = np.sum(way * way, axis=1)
        way /= np.sqrt(square)[:, None]
        names = "c0_direction", "c90_direction", "nadir_direction"
        local = np.stack([way @ light[axis] for axis in names], axis=1)
        candela = profile_candela(atlas, place, grid.astype(np.float64), local)
        cosine = np.maximum(-np.sum(way * normals, axis=1), 0.0)
        lux += candela * light["multiplier"] * cosine / square
    for probe, illuminance in zip(found["probes"], lux, strict=True):
        rho = reflectance[probe["surface"].lower()]
        assert illuminance * rho / np.pi == pytest.approx(probe["expect"]["RGB"], rel=1e-3)
