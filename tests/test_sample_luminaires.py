"""The sample street's photometric files: what they promise, and where they come from."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hdrusd.errors import SourceRef
from hdrusd.photometry.eulumdat import read_eulumdat
from hdrusd.photometry.ies import is_ies, read_ies
from hdrusd.photometry.luminaire import Luminaire
from hdrusd.photometry.profile import even_profile
from hdrusd.report import Report

FOLDER = Path(__file__).parents[1] / "samples" / "street" / "luminaires"
LUMENS = {"road_cutoff.ies": 10_000.0, "road_lantern.ies": 4_000.0, "shop_downlight.ldt": 1_200.0}

pytestmark = pytest.mark.skipif(
    not FOLDER.exists(), reason="the samples are not beside these tests"
)


def load(name: str) -> Luminaire:
    data = (FOLDER / name).read_bytes()
    report = Report()
    reader = read_ies if is_ies(data) else read_eulumdat
    lamp = reader(data, SourceRef(FOLDER / name), report)
    assert not report.codes()
    return lamp


def test_the_script_makes_the_files(tmp_path: Path) -> None:
    script = [sys.executable, str(FOLDER / "make_luminaires.py"), str(tmp_path)]
    subprocess.run(script, check=True)
    assert {file.name for file in tmp_path.iterdir()} == LUMENS.keys()
    for name in LUMENS:
        # The last digit printed may differ by the mathematics of another processor.
        assert load(name).candela == pytest.approx(
            read_again(tmp_path / name).candela, abs=0.11, rel=1e-4
        )


def read_again(file: Path) -> Luminaire:
    data = file.read_bytes()
    reader = read_ies if is_ies(data) else read_eulumdat
    return reader(data, SourceRef(file), Report())


@pytest.mark.parametrize(("name", "lumens"), LUMENS.items())
def test_flux_and_grid(name: str, lumens: float) -> None:
    lamp = load(name)
    # Linear between 2.5 degrees instead of the formula's curve.
    assert lamp.flux() == pytest.approx(lumens, rel=3e-3)
    assert even_profile(lamp)[1] == 0.0
    nadir = lamp.candela[:, 0]
    assert nadir == pytest.approx(np.full(len(nadir), nadir[0]), abs=0.11)
    assert lamp.candela[:, -1].max() < 0.01 * lumens / 1000.0


def test_the_road_luminaire_is_cut_off_and_looks_to_the_road() -> None:
    lamp = load("road_cutoff.ies")
    c = np.arange(0.0, 360.0)[:, None]
    high = lamp.value(c, np.arange(80.0, 90.1)[None, :])
    assert high.max() <= 30.0 * 10  # cd per 1000 lm: a cut-off luminaire (CIE 1965, 30 at 80)
    assert lamp.value(c, 90.0).max() == 0.0
    row, column = np.unravel_index(int(lamp.candela.argmax()), lamp.candela.shape)
    peak = abs(180.0 - float(lamp.planes[row])), float(lamp.angles[column])
    assert 5.0 <= peak[0] <= 25.0
    assert 55.0 <= peak[1] <= 70.0
    to_the_road, behind = lamp.value(90.0, 45.0), lamp.value(270.0, 45.0)
    assert to_the_road > 3.0 * behind
    for plane in (10.0, 60.0, 300.0):
        assert lamp.value(plane, 60.0) == pytest.approx(lamp.value(180.0 - plane, 60.0))
