"""Our eye against pictures made by pcond of Radiance 6.0a.

With pcond's own random pixels and luminance weights (pcond.py) its curves are met within 1e-4
(it is 6e-5 lower throughout; its matrices have four digits), and each pixel within what the
makers allow, 2 % or 0.005 of white, for every switch. As we do it, with pixels at fixed places
and the weights of Rec. 709, the same is true of the pixels' shares stated below; pcond itself
would change as much with another seed.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from pcond import FIELD, HIGH, LOW, SCOTOPIC, conditioned, luminance, picture

from hdrusd.eye.acuity import acuity_blur
from hdrusd.eye.foveal import foveal
from hdrusd.eye.scotopic import ward_scotopic
from hdrusd.eye.screen import Screen
from hdrusd.tonemap.histogram import adapted_anchor, fill, histogram, proportionate, trimmed
from hdrusd.tonemap.operator import OPERATORS, Need, statistics

SCENES = ["night_road", "gradient"]
SWITCHES = {"default": "", "linear": "l", "s": "s", "v": "v", "c": "c", "a": "a", "h": "avcs",
            "hl": "avcsl"}  # fmt: skip

#: What the makers allow: of the value, and of white (their files have 8 bits).
RELATIVE, ABSOLUTE = 0.02, 0.005


def inside(*pictures: np.ndarray) -> np.ndarray:
    """Where no picture needed a gamut: pcond's is another than ours."""
    return np.logical_and.reduce([rgb.max(axis=-1) < 1.0 for rgb in pictures])


def outliers(got: np.ndarray, wanted: np.ndarray) -> float:
    """Share of pixels whose luminance is further off than the makers allow."""
    y, want = luminance(got), luminance(wanted)
    wrong = np.abs(y - want) > RELATIVE * want + ABSOLUTE
    return float(wrong[inside(got, wanted)].mean())


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("name", SWITCHES)
def test_every_switch(testdata: Path, scene: str, name: str) -> None:
    folder = testdata / "truth" / "tonemap"
    made = conditioned(picture(folder / f"{scene}_input.exr"), SWITCHES[name])
    # The curve, at 100 luminances, seven digits. Of a linear one it writes the factor between
    # its files, in which 179 cd/m2 are 1 and so is the display's white.
    seen, shown = np.loadtxt(folder / f"{scene}_pcond_{name}.map").T
    unit = 179.0 / HIGH if made.proportional else 1.0
    curve = np.clip(made.curve.display(unit * seen), LOW, HIGH)
    np.testing.assert_allclose(curve, shown, rtol=1e-4)
    # Every pixel, in each channel.
    wanted, got = picture(folder / f"{scene}_pcond_{name}.exr"), made.display()
    common = inside(wanted, got)
    assert common.mean() > 0.65  # the linear maps burn out the rest
    np.testing.assert_allclose(got[common], wanted[common], rtol=RELATIVE, atol=ABSOLUTE)
    # On the average 8 bits do not matter.
    assert luminance(got[common]).mean() == pytest.approx(
        luminance(wanted[common]).mean(), rel=3e-4
    )


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("name", SWITCHES)
def test_linear_scales(testdata: Path, scene: str, name: str) -> None:
    folder = testdata / "truth" / "tonemap"
    made = conditioned(picture(folder / f"{scene}_input.exr"), SWITCHES[name])
    document = json.loads((folder / "tonemap.json").read_text(encoding="utf-8"))
    (output,) = (
        output
        for output in document["pictures"][scene]["outputs"]
        if output["file"] == f"{scene}_pcond_{name}.exr"
    )
    # Where all fits the display, pcond writes its factor, five digits, in units of 179 lm/W.
    assert made.proportional == bool(output["exposure_header"])
    if made.proportional:
        exposure = float(output["exposure_header"][0].removeprefix("EXPOSURE="))
        scale = float(made.curve.display(1e-3)) / 1e-3
        assert scale * 179.0 / HIGH == pytest.approx(exposure, rel=1.2e-4)


# pcond draws 27 % of these pixels at random, so that some of its 100 bins hold 3 % more or less
# of the frame; the shares are what that does to its default curve, the steepest.
@pytest.mark.parametrize(
    ("name", "params", "share"),
    [
        ("default", {}, 0.01),
        ("s", {"ceiling": "human"}, 0.005),
        ("linear", {"method": "linear"}, 0.0),
    ],
)
@pytest.mark.parametrize("scene", SCENES)
def test_operator(testdata: Path, scene: str, name: str, params: dict, share: float) -> None:
    folder = testdata / "truth" / "tonemap"
    hdr = picture(folder / f"{scene}_input.exr")
    wanted = picture(folder / f"{scene}_pcond_{name}.exr")
    operator, stats = OPERATORS["ward97"], statistics(hdr, Need.FOVEAL, FIELD)
    screen = Screen(peak=HIGH, black=LOW)
    got = operator.apply(
        hdr, moment=operator.moment({**params, "solver": "pcond"}, stats, screen=screen)
    )
    assert outliers(got, wanted) <= share
    common = inside(got, wanted)
    y, want = luminance(got)[common], luminance(wanted)[common]
    np.testing.assert_allclose(y, want, rtol=0.05, atol=ABSOLUTE)


@pytest.mark.parametrize("scene", SCENES)
def test_filling_is_near(testdata: Path, scene: str) -> None:
    # pcond's loop ends while 2.5 % of the counts are still above the ceiling; the filling is
    # where it would go.
    h = histogram(foveal(picture(testdata / "truth" / "tonemap" / f"{scene}_input.exr"), FIELD))
    loop = trimmed(h, LOW, HIGH, proportionate)
    further = trimmed(h, LOW, HIGH, proportionate, tolerance=1e-7)
    assert loop is not None
    assert further is not None
    anchor, scene_luminance = adapted_anchor(h, LOW, HIGH, proportionate), np.exp(h.centres)
    filled, exactly = (
        fill(h, LOW, HIGH, scene_luminance, anchor, display_threshold=proportionate, floor=floor)
        for floor in (1e-3, 0.0)
    )
    np.testing.assert_allclose(exactly.log_display, further.log_display, rtol=0, atol=1e-6)
    # Nowhere more than 12 % brighter or darker than what pcond shows.
    np.testing.assert_allclose(filled.log_display, loop.log_display, rtol=0, atol=0.12)


@pytest.mark.parametrize("scene", SCENES)
def test_our_acuity(testdata: Path, scene: str) -> None:
    # Pixels of 0.13 degrees: half a cycle of what is resolved is less nearly everywhere, and
    # pcond's wider boxes hardly show either.
    folder = testdata / "truth" / "tonemap"
    hdr = picture(folder / f"{scene}_input.exr")
    made = conditioned(hdr, "")
    made.rgb = acuity_blur(hdr, foveal(hdr, FIELD))
    assert outliers(made.display(), picture(folder / f"{scene}_pcond_a.exr")) < 2e-4


@pytest.mark.parametrize("scene", SCENES)
def test_our_ramp_of_colour(testdata: Path, scene: str) -> None:
    # With the scotopic weights that pcond has for any primaries; ours are fitted to Rec. 709.
    folder = testdata / "truth" / "tonemap"
    hdr = picture(folder / f"{scene}_input.exr")
    made = conditioned(hdr, "")
    made.rgb = ward_scotopic(hdr, hdr @ SCOTOPIC)
    assert outliers(made.display(), picture(folder / f"{scene}_pcond_c.exr")) == 0.0
