"""Flux of lamps with cones and foci against closed forms and a sum over directions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from hdrusd.photometry.flux import flux
from hdrusd.photometry.light import HARD_EDGE, PhotometricLight, cone_factor, focus_factor


def lamp(**changes: Any) -> PhotometricLight:
    return PhotometricLight(**{"kind": "spot", "intensity": 1000.0} | changes)


def test_a_point_sends_4_pi_times_its_candela() -> None:
    assert flux(lamp(kind="point")) == pytest.approx(4000.0 * math.pi, rel=1e-14)


@pytest.mark.parametrize("cutoff", [1.0, 30.0, 89.0, 120.0])
def test_a_hard_cone_is_its_solid_angle(cutoff: float) -> None:
    wanted = 2000.0 * math.pi * (1.0 - math.cos(math.radians(cutoff)))
    assert flux(lamp(cutoff=cutoff)) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("exponent", [1.0, 2.0, 32.0])
def test_a_focus_within_a_cone(exponent: float) -> None:
    # 2 pi I (1 - cos^(e + 1) a) / (e + 1)
    rest = math.cos(math.radians(60.0)) ** (exponent + 1.0)
    wanted = 2000.0 * math.pi * (1.0 - rest) / (exponent + 1.0)
    assert flux(lamp(cutoff=60.0, exponent=exponent)) == pytest.approx(wanted, rel=1e-12)


def test_a_focus_alone_shines_both_ways() -> None:
    assert flux(lamp(exponent=3.0)) == pytest.approx(4000.0 * math.pi / 4.0, rel=1e-12)


@pytest.mark.parametrize(
    ("cutoff", "softness", "exponent"),
    [
        (70.0, 1.0, 0.0),
        (70.0, 0.4, 0.0),
        (70.0, 0.7, 5.0),
        (135.0, 1.0, 1.0),  # |cos| has a corner at 90 degrees
        (179.0, 1.0, 3.0),
        (135.0, 0.1, 1.0),
    ],
)
def test_a_soft_edge_against_a_sum_over_directions(
    cutoff: float, softness: float, exponent: float
) -> None:
    light = lamp(cutoff=cutoff, softness=softness, exponent=exponent)
    n = 200_000
    angle = (np.arange(n) + 0.5) * math.pi / n  # the midpoint rule's error goes with n^-2
    outer = math.radians(cutoff)
    inner = outer * (1.0 - softness)
    cone = cone_factor(
        np.cos(angle), np.array(inner), np.array(min(1 / (outer - inner), HARD_EDGE))
    )
    focus = focus_factor(np.cos(angle), np.array(exponent))
    wanted = 2000.0 * math.pi * float(np.sum(cone * focus * np.sin(angle))) * math.pi / n
    assert flux(light) == pytest.approx(wanted, rel=1e-6)


def test_what_has_none() -> None:
    assert flux(lamp(kind="distant")) is None
    assert flux(lamp(profile="./a.ies")) is None
