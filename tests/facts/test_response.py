"""The response recovered from brackets is the camera's (photometry/response.py)."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pytest
from bracketed import STOPS, film, film_inverse, scene, shoot

from hdrusd.colour import srgb_decode, srgb_encode
from hdrusd.errors import HdrusdError
from hdrusd.photometry.bracketing import flattest
from hdrusd.photometry.response import (
    KNOTS,
    MIDDLE,
    Response,
    bell,
    hat,
    linear_response,
    parse_response,
    recover,
    srgb_response,
)

SHARES = np.arange(KNOTS) / (KNOTS - 1.0)

#: Codes of which the curve is stated: below, sensor noise is as large as a code.
STATED = slice(16, 246)


def recovered(
    method: str,
    step: int = 1,
    response: Callable[..., np.ndarray] = film,
    top: int = 255,
    count: int = 1536,
) -> Response:
    """From the scene in exposures ``step`` times 2 stops apart."""
    stops = STOPS[::-1][::step][::-1]
    light = scene()
    codes = [shoot(light, s, response=response, top=top) / top for s in stops]
    shares = np.stack([code.reshape(-1, 3) for code in codes], axis=1)
    chosen = flattest(shares, np.zeros(len(shares)), count)
    return recover(shares[chosen], 2.0**stops, method)


def errors(found: Response, inverse: np.ndarray) -> np.ndarray:
    """Logarithm of recovered over true exposure, (3, n), up to the factor that is open."""
    truth = np.log(inverse[STATED] / inverse[MIDDLE])
    off = np.log(found.curves[:, STATED]) - truth
    return off - off.mean(axis=1, keepdims=True)


@pytest.mark.parametrize(("method", "count"), [("debevec", 1536), ("robertson", 24000)])
def test_a_toe_and_a_shoulder_come_back(method: str, count: int) -> None:
    off = errors(recovered(method, count=count), film_inverse(SHARES))
    # Stated in docs/bracketing.md: 2 % rms, 6 % at any code, over 2.5 decades of exposure.
    assert np.sqrt(np.mean(off**2)) < 0.02
    assert np.abs(off).max() < 0.06


@pytest.mark.parametrize(("method", "count"), [("debevec", 1536), ("robertson", 24000)])
def test_srgb_comes_back(method: str, count: int) -> None:
    found = recovered(method, response=lambda x: srgb_encode(np.clip(x, 0, 1)), count=count)
    off = errors(found, srgb_decode(SHARES))
    assert np.sqrt(np.mean(off**2)) < 0.02
    assert np.abs(off).max() < 0.06


def test_sixteen_bits_come_back() -> None:
    off = errors(recovered("debevec", top=65535), film_inverse(SHARES))
    assert np.sqrt(np.mean(off**2)) < 0.02


@pytest.mark.parametrize("method", ["debevec", "robertson"])
def test_curves_rise_from_nothing_to_more_than_one(method: str) -> None:
    found = recovered(method)
    assert (np.diff(found.curves, axis=1) >= 0.0).all()
    assert found.curves[:, 0] == pytest.approx(0.0)
    assert found.curves[:, MIDDLE] == pytest.approx(1.0)
    assert found.spread is not None
    assert 0.0 < found.spread < 0.1


@pytest.mark.parametrize("method", ["debevec", "robertson"])
def test_exposures_in_any_unit_make_the_same_curve(method: str) -> None:
    light = scene(40, 60)
    codes = np.stack([shoot(light, s).reshape(-1, 3) / 255.0 for s in STOPS], axis=1)
    one = recover(codes, 2.0**STOPS, method).curves
    other = recover(codes, 1e4 * 2.0**STOPS, method).curves
    assert one == pytest.approx(other, rel=1e-6)


@pytest.mark.parametrize("method", ["debevec", "robertson"])
@pytest.mark.parametrize("code", [0.0, 1.0])
def test_black_and_white_pictures_are_one_line(method: str, code: float) -> None:
    with pytest.raises(HdrusdError, match="want exposures that overlap"):
        recover(np.full((100, 3, 1), code), [1.0, 2.0, 4.0], method)


def test_known_responses() -> None:
    # IEC 61966-2-1 at codes 64 and 200 over code 128; both bit depths share the codes n / 255.
    ratio = srgb_decode(np.array([64.0, 200.0]) / 255.0) / srgb_decode(128.0 / 255.0)
    assert srgb_response().table(255)[0, [64, 200]] == pytest.approx(ratio, rel=1e-9)
    assert srgb_response().table(65535)[0, [64 * 257, 200 * 257]] == pytest.approx(ratio, rel=1e-9)
    assert linear_response().table(255)[0] == pytest.approx(np.arange(256) / 128.0, rel=1e-9)
    tall = linear_response().table(65535)[0]
    assert tall == pytest.approx(np.arange(65536) / (128.0 * 257.0), rel=1e-9)


def test_between_its_values_a_curve_is_a_power() -> None:
    gamma = Response("gamma", (SHARES**2.2)[None])
    assert gamma.table(65535)[0] == pytest.approx((np.arange(65536) / 65535.0) ** 2.2, rel=1e-9)


def test_weights_are_nothing_at_both_ends() -> None:
    assert hat([0.0, 4.0 / 255.0, 250.0 / 255.0, 1.0]) == pytest.approx([0.0] * 4)
    assert bell([0.0, 0.5, 1.0]) == pytest.approx([0.0, 1.0, 0.0])


def test_a_response_survives_its_file() -> None:
    found = recovered("debevec")
    again = parse_response(json.loads(json.dumps(found.as_dict())))
    assert again.method == "debevec"
    assert again.curves == pytest.approx(found.curves, rel=1e-8)
    assert again.spread == found.spread


@pytest.mark.parametrize(
    "document",
    [
        None,
        [],
        {},
        {"format": "hdrusd-response/2", "curves": [[0.0, 1.0, 2.0]]},
        {"format": "hdrusd-response/1"},
        {"format": "hdrusd-response/1", "curves": []},
        {"format": "hdrusd-response/1", "curves": [[0.0, 1.0, 2.0]] * 2},
        {"format": "hdrusd-response/1", "curves": [[0.0, 1.0]]},
        {"format": "hdrusd-response/1", "curves": [[0.0, 1.0, 2.0], [0.0, 1.0], [0.0]]},
        {"format": "hdrusd-response/1", "curves": [[0.0, "a", 2.0]]},
        {"format": "hdrusd-response/1", "curves": [[0.0, [1.0], 2.0]]},
        {"format": "hdrusd-response/1", "curves": [[0.0, float("nan"), 2.0]]},
        {"format": "hdrusd-response/1", "curves": [[0.0, 1.0, float("inf")]]},
        {"format": "hdrusd-response/1", "curves": [[0.0, 2.0, 1.0]]},
        {"format": "hdrusd-response/1", "curves": [[0.0, 0.0, 1.0]]},
        {"format": "hdrusd-response/1", "curves": [[-1.0, 1.0, 2.0]]},
        {"format": "hdrusd-response/1", "curves": [[0.0, 10**400, 2.0]]},
    ],
)
def test_a_file_that_is_no_response_is_one_line(document: object) -> None:
    with pytest.raises(HdrusdError, match="want"):
        parse_response(document)
