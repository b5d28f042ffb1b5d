"""What makes cd/m2 of a merged picture: measured spots, a lamp's candela, or the camera itself."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hdrusd.bracket.photographs import Stated
from hdrusd.colour import luminance
from hdrusd.errors import HdrusdError, ParameterError, SourceRef
from hdrusd.photometry.bracketing import (
    BETWEEN,
    CAMERA_CONSTANT,
    TOO_BRIGHT,
    camera_factor,
    disc,
    factor_of,
)
from hdrusd.photometry.response import Response
from hdrusd.report import Kind, Report

#: Spots that differ by more are a finding.
_APART = 0.1

#: A pixel of a lamp is darker than this share of the region's mean only where the lamp is not;
#: and so much of a region is left without remark.
_DARK, _EMPTY = 0.05, 0.02


@dataclass(frozen=True, slots=True)
class Spot:
    """A measured place: the disc of ``radius`` pixels around pixel x, y has ``luminance`` cd/m2."""

    x: int
    y: int
    radius: float
    luminance: float

    def __str__(self) -> str:
        return f"spot {self.x},{self.y},{self.radius:g} = {self.luminance:g} cd/m2"


@dataclass(frozen=True, slots=True)
class Calibration:
    """Spots; or ``candela`` and projected ``area`` in m2 of a lamp that fills a ``region``.

    ``region``: x, y, width, height in pixels from the top left; None for the whole picture.
    Without either the camera's own equation is believed, with ``constant`` as its K. Raises
    ParameterError for numbers out of range.
    """

    spots: tuple[Spot, ...] = ()
    candela: float | None = None
    area: float | None = None
    region: tuple[int, int, int, int] | None = None
    constant: float = CAMERA_CONSTANT

    def __post_init__(self) -> None:
        if (self.candela is None) != (self.area is None):
            raise ParameterError("--candela and --area: want both")
        if self.region is not None and self.candela is None:
            raise ParameterError("--region: want --candela and --area with it")
        if self.spots and self.candela is not None:
            raise ParameterError("--spot and --candela: want one of them")
        numbers = {"--candela": self.candela, "--area": self.area, "K": self.constant}
        numbers |= {f"--spot {s.x},{s.y}": s.luminance for s in self.spots}
        for name, value in numbers.items():
            if value is not None and not (math.isfinite(value) and 0.0 < value < 1e15):
                raise ParameterError(f"{name}: {value:g}; want a positive number")
        for spot in self.spots:
            if not 0.0 <= spot.radius < 1e5:
                raise ParameterError(f"--spot: radius {spot.radius:g}; want 0 pixels or more")

    def check(self, stated: Stated, place: SourceRef) -> None:
        """Raise HdrusdError where neither a person nor the camera says what cd/m2 are."""
        if not (self.spots or self.candela is not None or stated.absolute):
            why = f"no {' and '.join(stated.lacking)} in any picture"
            if not stated.lacking:
                why = "exposures are relative, as given"
            raise HdrusdError(
                f"{place}: {why}: nothing to estimate cd/m2 from; "
                "want --spot, or --candela and --area"
            )


def factor(
    light: npt.NDArray[np.float32],
    state: npt.NDArray[np.uint8],
    wanted: Calibration,
    response: Response,
    place: SourceRef,
    report: Report,
) -> tuple[float, str]:
    """cd/m2 of 1 in ``light`` (h, w, 1 or 3), and a sentence about where it is from.

    ``state`` (h, w): not 0 where no exposure holds a pixel. ``wanted`` is checked. Raises
    HdrusdError.
    """
    if wanted.spots:
        return _by_spots(light, state, wanted.spots, place, report)
    if wanted.candela is not None and wanted.area is not None:
        return _by_candela(light, state, wanted, place, report)
    said = (
        f"camera equation L = {wanted.constant:.4g} N^2 / (t S) at code 118 (ISO 12232), estimate"
    )
    text = f"no measured luminance: {said}; good to a factor of 1.5"
    report.add(Kind.ASSUMED, "bracket-camera", place, "", text)
    return camera_factor(response, wanted.constant), said


def _colour(light: npt.NDArray[np.float32]) -> npt.NDArray[np.float64]:
    """(n, 3) of pixels (..., 1 or 3)."""
    pixels = light.reshape(-1, light.shape[-1]).astype(np.float64)
    return np.broadcast_to(pixels, (len(pixels), 3))


def _by_spots(
    light: npt.NDArray[np.float32],
    state: npt.NDArray[np.uint8],
    spots: tuple[Spot, ...],
    place: SourceRef,
    report: Report,
) -> tuple[float, str]:
    """The geometric mean of what the spots say."""
    height, width = state.shape
    logs = []
    for spot in spots:
        reach = math.ceil(spot.radius)
        left, up = spot.x - reach, spot.y - reach
        if left < 0 or up < 0 or spot.x + reach >= width or spot.y + reach >= height:
            raise HdrusdError(f"{place}: {spot}: outside of the picture, {width} x {height}")
        window = np.s_[up : spot.y + reach + 1, left : spot.x + reach + 1]
        inside = disc((2 * reach + 1,) * 2, reach, reach, spot.radius)
        lost = int(np.count_nonzero(state[window][inside]))
        if lost:
            text = f"{lost} of {int(inside.sum())} pixels are saturated or noise in every picture"
            raise HdrusdError(f"{place}: {spot}: {text}; want a spot that some exposure holds")
        try:
            logs.append(math.log(factor_of(_colour(light[window][inside]), spot.luminance)))
        except HdrusdError as problem:
            raise HdrusdError(f"{place}: {spot}: {problem}") from problem
    apart = max(logs) - min(logs)
    if apart > _APART:
        text = f"{len(spots)} spots differ by up to {100.0 * math.expm1(apart):.3g} %; mean of all"
        report.add(Kind.ASSUMED, "bracket-spots", place, "", text)
    return math.exp(math.fsum(logs) / len(logs)), "; ".join(map(str, spots))


def _by_candela(
    light: npt.NDArray[np.float32],
    state: npt.NDArray[np.uint8],
    wanted: Calibration,
    place: SourceRef,
    report: Report,
) -> tuple[float, str]:
    """L = I / A on average over the region. What is too dark to be held adds next to nothing."""
    assert wanted.candela is not None
    assert wanted.area is not None
    height, width = light.shape[:2]
    x, y, w, h = wanted.region or (0, 0, width, height)
    if not (0 <= x < x + w <= width and 0 <= y < y + h <= height):
        raise HdrusdError(
            f"{place}: region {x},{y},{w},{h}: not inside of the picture, {width} x {height}"
        )
    lost = int(np.count_nonzero(np.isin(state[y : y + h, x : x + w], (TOO_BRIGHT, BETWEEN))))
    if lost:
        text = f"{lost} of {w * h} pixels are saturated in every picture that is not noise there"
        raise HdrusdError(
            f"{place}: region {x},{y},{w},{h}: {text}; want a lamp that some exposure holds"
        )
    pixels = _colour(light[y : y + h, x : x + w])
    target = wanted.candela / wanted.area
    try:
        unit = factor_of(pixels, target)
    except HdrusdError as problem:
        raise HdrusdError(f"{place}: region {x},{y},{w},{h}: {problem}") from problem
    dark = float(np.mean(luminance(pixels) * unit < _DARK * target))
    if dark > _EMPTY:
        text = (
            f"{100.0 * dark:.3g} % of the region is darker than a twentieth of its mean, "
            f"{target:.4g} cd/m2; --area is taken as that of all of it"
        )
        report.add(Kind.ASSUMED, "bracket-region", place, "", text)
    said = f"{wanted.candela:g} cd from {wanted.area:g} m2 in {x},{y},{w},{h}: {target:.6g} cd/m2"
    return unit, said
