"""ISO 2720 and ISO 12232 numbers, and the exposure that a USD camera computes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from hdrusd.errors import HdrusdError
from hdrusd.tonemap.exposure import (
    OPERATOR,
    ev100_from_illuminance,
    ev100_from_luminance,
    ev100_from_settings,
    exposure,
    saturation_luminance,
)
from hdrusd.tonemap.operator import Need, statistics


def test_sunny_16() -> None:
    # f/16, 1/125 s, ISO 100: 256 x 125 = 32,000.
    ev = ev100_from_settings(16.0, 1.0 / 125.0, 100.0)
    assert ev == pytest.approx(14.965784284662087, rel=1e-14)
    assert saturation_luminance(ev) == pytest.approx(38400.0, rel=1e-12)


def test_meters() -> None:
    # L = 2^EV K / 100 and E = 2^EV C / 100: 4,000 cd/m2 is the same EV; 2,560 lx is EV 10.
    assert ev100_from_luminance(4000.0) == pytest.approx(14.965784284662087, rel=1e-14)
    assert ev100_from_illuminance(2560.0) == pytest.approx(10.0, rel=1e-14)
    assert ev100_from_luminance(0.125) == 0.0


def test_saturation_becomes_white_and_clips() -> None:
    rgb = np.array([[38400.0] * 3, [19200.0, 38400.0, 76800.0], [0.0] * 3])
    got = exposure(rgb, 2.604166666666667e-05)
    np.testing.assert_allclose(got, [[1, 1, 1], [0.5, 1, 1], [0, 0, 0]], rtol=1e-14)


def test_automatic_exposure_of_an_even_field() -> None:
    # White is 1.2 x 100 / 12.5 = 9.6 times the metered average.
    got = OPERATOR.apply(np.full((4, 4, 3), 37.0))
    np.testing.assert_allclose(got, 1.0 / 9.6, rtol=1e-12)


def test_automatic_exposure_meters_the_whole_field() -> None:
    # A meter averages the light, black parts included: not the logarithm, not the lit pixels.
    rgb = np.zeros((2, 2, 3))
    rgb[0, 0] = 8.0
    assert OPERATOR.apply(rgb)[0, 0] == pytest.approx(np.full(3, 4.0 / 9.6), rel=1e-12)


def test_exposure_value_beats_nothing_and_scale_beats_it() -> None:
    rgb = np.full((1, 1, 3), 0.6)
    assert OPERATOR.apply(rgb, None, {"ev100": 0.0}) == pytest.approx(np.full((1, 1, 3), 0.5))
    both = OPERATOR.apply(rgb, None, {"ev100": 0.0, "scale": 1.0})
    assert both == pytest.approx(np.full((1, 1, 3), 0.6))
    assert OPERATOR.needs(OPERATOR.settings()) == Need.AVERAGES
    assert OPERATOR.needs(OPERATOR.settings({"ev100": 3.0})) == Need.NOTHING
    assert OPERATOR.needs(OPERATOR.settings({"scale": 1.0})) == Need.NOTHING


def test_usd_camera_is_the_same_camera() -> None:
    # UsdGeomCamera: responsivity x time x ISO/100 x 2^exposure / f-number^2. A responsivity
    # of 1/1.2 is the saturation-based camera of ISO 12232.
    stage = Usd.Stage.CreateInMemory()
    camera = UsdGeom.Camera.Define(stage, "/camera")
    camera.CreateExposureFStopAttr(16.0)
    camera.CreateExposureTimeAttr(1.0 / 125.0)
    camera.CreateExposureIsoAttr(100.0)
    camera.CreateExposureResponsivityAttr(1.0 / 1.2)
    scale = camera.ComputeLinearExposureScale()
    rgb = np.geomspace(1.0, 1e5, 12).reshape(4, 3)
    by_scale = OPERATOR.apply(rgb, None, {"scale": scale})
    ev = ev100_from_settings(16.0, 1.0 / 125.0, 100.0)
    # The camera's attributes are float32.
    np.testing.assert_allclose(by_scale, OPERATOR.apply(rgb, None, {"ev100": ev}), rtol=1e-6)


def test_black_frame() -> None:
    black = np.zeros((3, 3, 3))
    assert not OPERATOR.apply(black, statistics(black)).any()


@pytest.mark.parametrize("params", [{"ev100": "dark"}, {"ev100": math.inf}, {"scale": -1.0}])
def test_senseless_parameter(params: dict) -> None:
    with pytest.raises(HdrusdError, match="want"):
        OPERATOR.apply(np.ones((1, 1, 3)), None, params)


def test_automatic_exposure_without_statistics() -> None:
    with pytest.raises(HdrusdError, match="statistics"):
        OPERATOR.uniforms(OPERATOR.moment())
