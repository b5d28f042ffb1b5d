"""What screens decode: SMPTE ST 2084, ITU-R BT.1886, plain powers; and ITU-R BT.2087."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.colour import (
    bt1886_decode,
    bt1886_encode,
    from_rec2020,
    gamma_decode,
    gamma_encode,
    pq_decode,
    pq_encode,
    to_rec2020,
)


def test_pq() -> None:
    light = [0.005, 0.1, 1.0, 100.0, 203.0, 1000.0, 4000.0, 10000.0]
    wanted = [
        0.015076399042367938,
        0.06233686566269587,
        0.14994573210018022,
        0.508078421517399,
        0.5806888810416109,
        0.751827096247041,
        0.9025723933109373,
        1.0,
    ]
    np.testing.assert_allclose(pq_encode(light), wanted, rtol=1e-6)
    assert pq_decode(0.5) == pytest.approx(92.24570899406527, rel=1e-6)


def test_pq_ends() -> None:
    # c1^m2 at black, which decodes to black again; all above 10,000 cd/m2 is 10,000.
    assert pq_encode(0.0) == pytest.approx((3424 / 4096) ** (2523 / 32), rel=1e-14)
    assert pq_decode(0.0) == 0.0
    assert pq_encode(1e9) == pq_encode(10000.0)


@given(st.floats(1e-4, 1e4))
def test_pq_decode_undoes_encode(light: float) -> None:
    # The 79th and 6th powers, and what is left of 1 - c1: some thousand roundings in the dark.
    assert pq_decode(pq_encode(light)) == pytest.approx(light, rel=1e-9)


def test_bt1886_is_the_recommendations_formula() -> None:
    white, black, g = 100.0, 0.1, 2.4
    code = np.linspace(0.0, 1.0, 11)
    a = (white ** (1 / g) - black ** (1 / g)) ** g
    b = black ** (1 / g) / (white ** (1 / g) - black ** (1 / g))
    light = a * (code + b) ** g
    got = black + bt1886_decode(code, black, white) * (white - black)
    np.testing.assert_allclose(got, light, rtol=1e-12)
    np.testing.assert_allclose(
        bt1886_encode((light - black) / (white - black), black, white), code, rtol=1e-12, atol=1e-14
    )


def test_bt1886_of_a_perfect_black_is_a_power() -> None:
    v = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(bt1886_encode(v, 0.0, 80.0), v ** (1 / 2.4), rtol=1e-13)


def test_gamma() -> None:
    assert gamma_encode(0.25, 2.0) == 0.5
    assert gamma_decode(0.5, 2.0) == 0.25


def test_rec2020() -> None:
    # Rows of BT.2087, in four digits there; white stays white, and back is back.
    red, green, blue = to_rec2020(np.eye(3))
    np.testing.assert_allclose(red, (0.6274, 0.0691, 0.0164), atol=5e-5)
    np.testing.assert_allclose(green, (0.3293, 0.9195, 0.0880), atol=5e-5)
    np.testing.assert_allclose(blue, (0.0433, 0.0114, 0.8956), atol=5e-5)
    np.testing.assert_allclose(to_rec2020(np.ones(3)), 1.0, atol=2e-9)
    rgb = np.array([[0.2, 0.5, 0.9], [4.0, 0.0, 1.0]])
    np.testing.assert_allclose(from_rec2020(to_rec2020(rgb)), rgb, rtol=0, atol=1e-14)
