"""Zones, beams, flux codes and symmetries of luminaires that have closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from photometric_files import ies, ies_text, ldt, ldt_text

from hdrusd.photometry.distribution import (
    cumulative_flux,
    fan,
    flux_code,
    found_symmetry,
    nadir_luminance,
    peak,
    sections,
    stated_symmetry,
    upward_share,
    zonal_flux,
)
from hdrusd.photometry.luminaire import Luminaire

#: Quarter degrees: a chord of a cosine is below it by step^2 / 8 = 2.4e-6 of its value.
FINE = np.arange(0.0, 90.01, 0.25)
CHORD = math.radians(0.25) ** 2 / 8


def lambert(upside_down: bool = False) -> Luminaire:
    """1000 cd cos gamma, or the same upwards."""
    candela = 1000.0 * np.cos(np.radians(FINE))
    if upside_down:
        return ies(ies_text(candela[::-1], planes=(0,), angles=180.0 - FINE[::-1]))
    return ies(ies_text(candela, planes=(0,), angles=FINE))


def even(candela: float = 100.0) -> Luminaire:
    return ies(ies_text([candela, candela], planes=(0,), angles=(0, 180)))


def test_lambert() -> None:
    lamp = lambert()
    assert lamp.flux() == pytest.approx(1000.0 * math.pi, rel=2 * CHORD)
    cones = np.array([10.0, 30.0, 41.41, 60.0, 90.0, 180.0])
    wanted = 1000.0 * math.pi * np.sin(np.radians(np.minimum(cones, 90.0))) ** 2
    assert cumulative_flux(lamp, cones) == pytest.approx(wanted, rel=2 * CHORD)
    assert zonal_flux(lamp) / (1000.0 * math.pi) == pytest.approx([0.25, 0.5, 0.25, 0.0], abs=1e-5)
    for section in sections(lamp):
        assert fan(section, 0.5) == pytest.approx(120.0, abs=1e-9)  # 60 degrees is a node
        assert fan(section, 0.1) == pytest.approx(2 * math.degrees(math.acos(0.1)), abs=1e-4)
    assert flux_code(lamp) == pytest.approx((43.75, 75.0, 93.75, 100.0, 100.0), abs=1e-3)
    assert upward_share(lamp) == pytest.approx(0.0, abs=1e-12)


def test_lambert_upwards() -> None:
    lamp = lambert(upside_down=True)
    assert upward_share(lamp) == pytest.approx(1.0, abs=1e-12)
    assert [fan(section, 0.5) for section in sections(lamp)] == pytest.approx([120.0] * 2)
    assert flux_code(lamp) is None
    assert zonal_flux(lamp)[3] == pytest.approx(1000.0 * math.pi, rel=2 * CHORD)


def test_a_source_that_is_alike_all_round() -> None:
    lamp = even()
    zones = 2.0 * math.pi * 100.0 * -np.diff(np.cos(np.radians([0.0, 30.0, 60.0, 90.0, 180.0])))
    assert zonal_flux(lamp) == pytest.approx(zones, rel=1e-12)
    assert zonal_flux(lamp).sum() == pytest.approx(400.0 * math.pi, rel=1e-12)
    assert upward_share(lamp) == pytest.approx(0.5, rel=1e-12)
    assert flux_code(lamp) == pytest.approx((25.0, 50.0, 75.0, 50.0, 100.0), rel=1e-12)
    assert [fan(section, 0.5) for section in sections(lamp)] == [360.0, 360.0]
    assert found_symmetry(lamp) == stated_symmetry(lamp) == "rotational"


def test_zones_add_up_to_the_flux_of_the_quadrant() -> None:
    lamp = ies(ies_text(lumens=2000.0))
    assert zonal_flux(lamp).sum() == pytest.approx(lamp.flux(), rel=1e-12)
    assert lamp.flux() == pytest.approx(1127.30, abs=0.005)
    code = flux_code(lamp)
    assert code is not None
    assert code[3:] == pytest.approx((100.0, 100.0 * 1127.3027 / 2000.0), rel=1e-5)
    assert peak(lamp) == (400.0, 0.0, 0.0)


@pytest.mark.parametrize("type", ["A", "B"])
def test_zones_of_types_a_and_b_are_about_the_aim(type: str) -> None:
    """Alike all round; and a window, which is a disk seen from its aim as far as 10 degrees."""
    planes, angles = ((-180, 180), (-90, 90)) if type == "A" else ((-90, 90), (-180, 180))
    lamp = ies(ies_text(np.full((2, 2), 10.0), planes=planes, angles=angles, type=type))
    zones = 2.0 * math.pi * 10.0 * -np.diff(np.cos(np.radians([0.0, 30.0, 60.0, 90.0, 180.0])))
    assert zonal_flux(lamp) == pytest.approx(zones, rel=1e-4)
    window = ies(ies_text(np.full((2, 2), 50.0), planes=(-10, 10), angles=(-10, 10), type=type))
    cone = 2.0 * math.pi * 50.0 * (1.0 - math.cos(math.radians(9.5)))
    assert cumulative_flux(window, [9.5])[0] == pytest.approx(cone, rel=2e-3)
    assert [fan(section, 0.5) for section in sections(window)] == [20.0, 20.0]
    assert upward_share(window) is flux_code(window) is nadir_luminance(window) is None


@pytest.mark.parametrize("type", ["A", "B"])
def test_a_window_that_begins_at_the_aim(type: str) -> None:
    above = ies(ies_text(np.full((2, 2), 50.0), planes=(-10, 10), angles=(0, 6), type=type))
    assert [fan(section, 0.5) for section in sections(above)] == [20.0, 6.0]


def curve(candela: list[float], angles: list[float], other: list[float] | None = None) -> Luminaire:
    rows = [candela, candela if other is None else other]
    return ies(ies_text(rows, planes=(0, 180), angles=angles))


@pytest.mark.parametrize(
    ("candela", "angles", "half"),
    [
        ([100, 0], [0, 90], 90.0),  # a cone: half of it at 45
        ([0, 100, 0], [0, 45, 90], 2 * 67.5),  # a batwing counts from wing to wing
        ([100, 100, 0], [0, 60, 60.001], 2 * 60.0005),
        ([100, 100], [0, 40], 80.0),  # dark beyond the angles of the file
        ([100, 60, 0, 30, 100], [0, 90, 100, 120, 180], None),
    ],
)
def test_beam_angle(candela: list[float], angles: list[float], half: float | None) -> None:
    wanted = 2 * (90.0 + 10.0 / 6.0) if half is None else half  # bright at 90: on to 50 cd
    assert fan(sections(curve(candela, angles))[0], 0.5) == pytest.approx(wanted, abs=1e-6)


def test_a_beam_to_one_side() -> None:
    lamp = curve([0, 0, 100, 0], [0, 20, 40, 60], [0, 0, 0, 0])
    assert fan(sections(lamp)[0], 0.5) == pytest.approx(20.0)  # 30 to 50
    dark = ies(ies_text([0.0, 0.0], planes=(0,), angles=(0, 90)))
    assert fan(sections(dark)[0], 0.5) is None
    assert upward_share(dark) is flux_code(dark) is None


def test_luminance_of_the_opening() -> None:
    size = (0.5, 2.0, 0.0)  # width, length
    assert nadir_luminance(ies(ies_text(size=size))) == pytest.approx(400.0)
    assert nadir_luminance(ies(ies_text(size=(-0.2, -0.2, 0)))) == pytest.approx(
        400.0 / (0.01 * math.pi)
    )
    assert nadir_luminance(ies(ies_text())) is None
    assert nadir_luminance(ldt(ldt_text())) == pytest.approx(400.0 / (0.5 * 0.25))


def test_the_output_ratio_is_that_of_all_lamps() -> None:
    code = flux_code(ies(ies_text(lamps=2, lumens=1000.0)))
    assert code is not None
    assert code[4] == pytest.approx(ies(ies_text()).flux() / 20.0, rel=1e-12)


@pytest.mark.parametrize(
    ("planes", "values", "stated", "found"),
    [
        ((0, 90, 180, 270, 360), (1, 1, 1, 1, 1), "none", "rotational"),
        ((0, 90, 180, 270, 360), (2, 1, 2, 1, 2), "none", "C 0-180 and C 90-270"),
        ((0, 90, 180, 270, 360), (3, 1, 2, 1, 3), "none", "C 0-180"),
        ((0, 90, 180, 270, 360), (2, 1, 2, 3, 2), "none", "C 90-270"),
        ((0, 90, 180, 270, 360), (1, 2, 3, 4, 1), "none", "none"),
        ((0, 90, 180), (3, 1, 2), "C 0-180", "C 0-180"),
        ((90, 180, 270), (1, 2, 3), "C 90-270", "C 90-270"),
        ((0, 90), (1, 2), "C 0-180 and C 90-270", "C 0-180 and C 90-270"),
    ],
)
def test_symmetry(
    planes: tuple[float, ...], values: tuple[float, ...], stated: str, found: str
) -> None:
    lamp = ies(ies_text([[v, v] for v in values], planes=planes, angles=(0, 90)))
    assert (stated_symmetry(lamp), found_symmetry(lamp)) == (stated, found)


def test_the_street_luminaires_have_their_stated_flux() -> None:
    folder = Path(__file__).parents[2] / "samples" / "street" / "luminaires"
    cutoff = ies((folder / "road_cutoff.ies").read_text("latin-1"))
    lantern = ies((folder / "road_lantern.ies").read_text("latin-1"))
    downlight = ldt((folder / "shop_downlight.ldt").read_text("latin-1"))
    wanted = [10_000.0, 4_000.0, 1_200.0]  # of the formula; its chords over 2.5 degrees differ
    for lamp, lumens in zip((cutoff, lantern, downlight), wanted, strict=True):
        assert zonal_flux(lamp).sum() == pytest.approx(lumens, rel=3e-3)
        assert upward_share(lamp) == pytest.approx(0.0, abs=1e-12)
