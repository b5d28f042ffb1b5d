"""Lumens to candela: closed forms of every spread, and the renderer's own falloff."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hdrusd.photometry.light import cone_factor, focus_factor, inverse_edge
from hdrusd.photometry.spread import SHAPES, Beam, Emitter, Spread, beam_solid_angle, solid_angle

#: A beam of none of the others' shape.
NARROW = Beam(30.0, 0.4, 3.0)


@pytest.mark.parametrize(
    ("spread", "angle"),
    [("sphere", 4 * math.pi), ("hemisphere", 2 * math.pi), ("lambert", math.pi)],
)
def test_plain_spreads(spread: Spread, angle: float) -> None:
    assert solid_angle(spread, NARROW) == angle
    # And the shape that a lamp without a cone is given has just that flux a candela.
    assert beam_solid_angle(SHAPES.get(spread, Beam())) == pytest.approx(angle, rel=1e-12)


@pytest.mark.parametrize("degrees", [0.5, 15.0, 60.0, 90.0, 150.0])
def test_a_hard_cone(degrees: float) -> None:
    expected = 2.0 * math.pi * (1.0 - math.cos(math.radians(degrees)))
    # Of half a degree the difference of cosines has lost four digits of sixteen.
    assert solid_angle("cone", Beam(degrees)) == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize(("degrees", "exponent"), [(20.0, 2.0), (60.0, 8.0), (90.0, 128.0)])
def test_a_cone_with_a_focus(degrees: float, exponent: float) -> None:
    # int_0^a cos^n sin dt = (1 - cos^(n + 1) a) / (n + 1)
    rest = 1.0 - math.cos(math.radians(degrees)) ** (exponent + 1.0)
    expected = 2.0 * math.pi * rest / (exponent + 1.0)
    assert solid_angle("cone", Beam(degrees, 0.0, exponent)) == pytest.approx(expected, rel=1e-12)


def test_a_focus_alone_shines_both_ways() -> None:
    # UsdLux focus is |cos|^n: both half spaces.
    assert solid_angle("cone", Beam(exponent=3.0)) == pytest.approx(math.pi, rel=1e-12)


@pytest.mark.parametrize(
    "beam", [NARROW, Beam(80.0, 1.0, 0.0), Beam(45.0, 0.3, 2.5), Beam(89.0, 1.0, 60.0)]
)
def test_soft_cones_are_the_renderers_own(beam: Beam) -> None:
    outer = np.float64(math.radians(beam.cutoff))
    inner = outer * (1.0 - beam.softness)
    angle = (np.arange(1_000_000) + 0.5) * (float(outer) / 1_000_000)
    share = cone_factor(np.cos(angle), inner, inverse_edge(inner, outer))
    share *= focus_factor(np.cos(angle), np.float64(beam.exponent))
    expected = 2.0 * math.pi * float(np.sum(share * np.sin(angle))) * float(outer) / 1_000_000
    # The midpoint rule in a million steps is good to 1e-10 here.
    assert solid_angle("cone", beam) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("beam", "angle"),
    [
        # int_0^a cos sin 2 pi dt = pi sin^2 a before a face, which does not shine behind
        (Beam(emitter="face"), math.pi),
        (Beam(60.0, emitter="face"), 0.75 * math.pi),
        (Beam(120.0, emitter="face"), math.pi),
        # int cos^(n + 1) sin 2 pi dt over a half space
        (Beam(exponent=3.0, emitter="face"), 2.0 * math.pi / 5.0),
        (Beam(90.0, 0.0, 0.5, emitter="face"), 2.0 * math.pi / 2.5),
        # int sin^2 t dt 2 pi about a tube; half of it within 90 degrees of the axis
        (Beam(emitter="tube"), math.pi**2),
        (Beam(90.0, emitter="tube"), 0.5 * math.pi**2),
        # with cos t = sin u cos v about the tube: int sin^(n + 2) u du int |cos v|^n dv
        (Beam(exponent=1.0, emitter="tube"), (4.0 / 3.0) * 4.0),
        (Beam(exponent=2.0, emitter="tube"), (3.0 * math.pi / 8.0) * math.pi),
        (Beam(90.0, 0.0, 4.0, emitter="tube"), (5.0 * math.pi / 16.0) * (3.0 * math.pi / 8.0)),
    ],
)
def test_faces_and_tubes(beam: Beam, angle: float) -> None:
    # The midpoint rule in 32,768 steps of at most 1e-4 rad: 1e-8 / 12, some more at a root.
    assert solid_angle("cone", beam) == pytest.approx(angle, rel=1e-7)


@pytest.mark.parametrize(
    "beam", [Beam(80.0, 1.0, 0.0), Beam(135.0, 0.3, 2.5), Beam(30.0, 0.4, 3.0)]
)
@pytest.mark.parametrize("emitter", ["face", "tube"])
def test_soft_cones_of_faces_and_tubes(beam: Beam, emitter: Emitter) -> None:
    """A sum over directions: the shape's share is the cosine to -Z, or the sine to the tube, X."""
    n = 2000
    angle, turn = ((np.arange(n) + 0.5) * end / n for end in (math.pi, 2.0 * math.pi))
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    shape = np.broadcast_to(np.maximum(cosine, 0.0), (n, n))
    if emitter == "tube":
        shape = np.sqrt(1.0 - (sine * np.cos(turn)) ** 2)
    outer = np.float64(math.radians(beam.cutoff))
    inner = outer * (1.0 - beam.softness)
    share = cone_factor(cosine, inner, inverse_edge(inner, outer))
    share *= focus_factor(cosine, np.float64(beam.exponent))
    wanted = float(np.sum(share * shape * sine)) * (math.pi / n) * (2.0 * math.pi / n)
    # Steps of 2e-3 rad: their square.
    assert solid_angle("cone", replace(beam, emitter=emitter)) == pytest.approx(wanted, rel=1e-5)
