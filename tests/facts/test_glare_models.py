"""What the eye scatters, against published equations and their integrals."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.errors import UnknownNameError
from hdrusd.eye.observer import Observer
from hdrusd.glare.cie135 import general_glare, small_angle_glare, stiles_holladay, total_glare
from hdrusd.glare.model import DEFAULT_MODEL, MODELS, angle
from hdrusd.glare.moon_spencer import adapted, is_worthwhile, veil, weights
from hdrusd.glare.spencer95 import WEIGHTS, parts, spread

THETA = np.array([0.1, 1.0, 5.0, 10.0, 30.0])

#: float64 through at most twenty operations, powers among them.
EXACT = 1e-12


def hemisphere(values: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Integral over solid angle, by the logarithm of theta."""
    ring = values * (2.0 * math.pi * np.sin(np.radians(theta)) * np.radians(theta))
    return np.asarray(np.trapezoid(ring, np.log(theta)))


def test_total_glare_by_hand() -> None:
    # Age 0 and no pigment: at 1 degree 9.2e6/(1+(1/.0046)^2)^1.5 + 1.5e5/(1+(1/.045)^2)^1.5
    # + 400/101 + 3e-8.
    core = 9.2e6 / (1.0 + (1.0 / 0.0046) ** 2) ** 1.5 + 1.5e5 / (1.0 + (1.0 / 0.045) ** 2) ** 1.5
    expected = core + 400.0 / 101.0 + 3e-8
    assert total_glare(1.0, 0.0, 0.0) == pytest.approx(expected, rel=EXACT)


@pytest.mark.parametrize(
    ("age", "pigment", "wanted"),
    [
        (25.0, 0.5, [11441.381, 18.864743, 0.28908115, 0.060321132, 0.0076072215]),
        (35.0, 0.5, [11417.548, 19.124445, 0.30082417, 0.063423198, 0.0080174479]),
        (70.0, 0.5, [10946.712, 24.254974, 0.53281245, 0.12470582, 0.016121646]),
        (35.0, 1.2, [11411.470, 19.546536, 0.31274433, 0.069974930, 0.011420211]),
    ],
)
def test_total_glare(age: float, pigment: float, wanted: list[float]) -> None:
    np.testing.assert_allclose(total_glare(THETA, age, pigment), wanted, rtol=1e-7)


def test_the_simpler_equations_of_cie_146() -> None:
    wanted = [10549.723, 15.547892, 0.31190244, 0.071658973, 0.0095528617]
    np.testing.assert_allclose(general_glare(THETA), wanted, rtol=1e-7)
    wanted = [10549.17248, 15.4917248, 0.299668992, 0.064917248, 0.006472286814814815]
    np.testing.assert_allclose(small_angle_glare(THETA), wanted, rtol=EXACT)
    wanted = [1062.5, 10.625, 0.425, 0.10625, 0.011805555555555555]
    np.testing.assert_allclose(stiles_holladay(THETA, 35.0), wanted, rtol=EXACT)
    np.testing.assert_allclose(stiles_holladay(THETA), 10.0 / THETA**2, rtol=EXACT)


def test_general_and_total_agree_as_the_cie_says() -> None:
    # CIE 146: the general equation stands for the total one from 0.1 degrees on, within 20 %
    # over most of the range.
    theta = np.geomspace(0.3, 30.0, 50)
    np.testing.assert_allclose(general_glare(theta), total_glare(theta), rtol=0.25)


@given(st.floats(20.0, 80.0), st.floats(0.0, 1.2))
def test_total_glare_is_nearly_all_light(age: float, pigment: float) -> None:
    # Vos and van den Berg's own normalisation: 1 to 2 % too much.
    theta = np.geomspace(1e-6, 90.0, 4001)
    total = hemisphere(total_glare(theta, age, pigment), theta)
    assert 1.0 <= total <= 1.03


def test_energy_beyond_an_angle() -> None:
    for low, wanted in ((0.1, 0.3243), (0.5, 0.1121), (1.0, 0.0782), (3.0, 0.0501), (10.0, 0.0329)):
        theta = np.geomspace(low, 90.0, 20001)
        assert hemisphere(total_glare(theta), theta) == pytest.approx(wanted, abs=5e-5)


def test_each_part_of_spencer_is_all_light() -> None:
    theta = np.geomspace(1e-7, 90.0, 200_001)
    got = [hemisphere(parts(theta)[:, k], theta) for k in range(4)]
    np.testing.assert_allclose(got, [0.99909, 0.99991, 0.99994, 1.00007], atol=6e-6)


def test_spencer() -> None:
    wanted = [6477.678, 19.017743, 0.47531356, 0.10940756, 0.01145140]
    np.testing.assert_allclose(spread(THETA), wanted, rtol=1e-6)
    wanted = [6824.451, 23.817368, 0.67346637, 0.15914372, 0.01699237]
    np.testing.assert_allclose(spread(THETA, "scotopic"), wanted, rtol=1e-6)
    for weight in WEIGHTS.values():
        assert sum(weight) == pytest.approx(1.0, rel=EXACT)


def test_halo_is_a_ring_that_grows_with_the_wavelength() -> None:
    theta = np.linspace(1.0, 5.0, 4001)
    for wavelength, ring in ((568.0, 3.0), (611.0, 3.0 * 611.0 / 568.0)):
        at = theta[np.argmax(parts(theta, wavelength)[:, 3])]
        assert at == pytest.approx(ring, abs=1e-3)


def fan(*degrees: float) -> np.ndarray:
    a = np.radians(degrees)
    return np.stack([np.sin(a), np.zeros_like(a), -np.cos(a)], axis=-1)


def test_ward_veil_of_three_samples() -> None:
    # Weights of 1 and of 2 degrees are as 4 : 1; sample 0 sees 100 cd/m2 by 0.8 of the 8 %.
    got = veil([0.0, 100.0, 0.0], fan(-1.0, 0.0, 1.0))
    assert got[0] == pytest.approx(6.40048748, rel=1e-8)
    assert got[1] == 0.0
    assert got[2] == pytest.approx(got[0], rel=EXACT)


def test_ward_keeps_an_even_frame() -> None:
    rays = fan(*np.linspace(-20.0, 20.0, 41))
    np.testing.assert_allclose(adapted(np.full(41, 7.0), rays), 7.0, rtol=EXACT)


def test_ward_weights() -> None:
    theta = np.radians([1.0, 5.0, 20.0])
    got = weights(np.cos(theta))
    # cos / theta^2 with theta^2 ~ 2 (1 - cos): 1 % at 20 degrees.
    np.testing.assert_allclose(got, np.cos(theta) / theta**2, rtol=0.011)
    assert weights([1.0, 0.0, -0.5]).tolist() == [0.0, 0.0, 0.0]


def test_pcond_asks_for_a_wide_range() -> None:
    assert is_worthwhile(1.0, math.exp(4.5) * 1.001)
    assert not is_worthwhile(1.0, math.exp(4.5) * 0.999)
    assert not is_worthwhile(0.0, 1.0)


def test_registry() -> None:
    assert set(MODELS) >= {"cie135", "spencer95", "ward97"}
    assert DEFAULT_MODEL == "cie135"
    for name in ("cie135", "spencer95", "ward97"):
        model = MODELS[name]
        assert model.name == name
        assert (model.psf is None) != (model.shares is None)
    psf = MODELS["cie135"].psf
    assert psf is not None
    np.testing.assert_array_equal(psf(THETA, Observer(age=70.0)), total_glare(THETA, 70.0))
    with pytest.raises(UnknownNameError, match="glare model"):
        MODELS["haze"]


@given(st.floats(1e-7, 3.1))
def test_angles_small_and_large(radians: float) -> None:
    a = np.array([0.0, 0.0, -1.0])
    b = np.array([math.sin(radians), 0.0, -math.cos(radians)])
    assert angle(a, b) == pytest.approx(math.degrees(radians), rel=1e-7)


def test_computed_elsewhere(testdata: Path) -> None:
    text = next((testdata / "design").glob("*vectors.json")).read_text(encoding="utf-8")
    told = json.loads(text)["5_glare"]
    for age in (25, 35, 70):
        wanted = told[f"cie99 age{age} p0.5"]
        np.testing.assert_allclose(total_glare(THETA, age), wanted, rtol=1e-6)
    for pigment in (0.0, 1.2):
        wanted = told[f"cie99 age35 p{pigment}"]
        np.testing.assert_allclose(total_glare(THETA, 35.0, pigment), wanted, rtol=1e-6)
    wanted = told["cie99 unnormalised age35 p0.5"]
    np.testing.assert_allclose(total_glare(THETA, normalised=False), wanted, rtol=1e-6)
    for adaptation in WEIGHTS:
        np.testing.assert_allclose(
            spread(THETA, adaptation), told[f"spencer {adaptation}"], rtol=1e-6
        )
