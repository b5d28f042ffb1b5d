"""Exposure-bracketed photographs of one scene become one EXR in cd/m2.

Two passes: pictures one after another, of which a grid of pixels is kept to recover the response
and the noise from; then all of them together, strip by strip, merged into the result. Memory is
that of the result and some strips, however many pictures there are.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.bracket.calibration import Calibration, factor
from hdrusd.bracket.photographs import Photograph, oriented, stated_exposures
from hdrusd.errors import HdrusdError, InputError, SourceRef
from hdrusd.images import write_atomically, write_exr
from hdrusd.photometry.bracketing import (
    BETWEEN,
    TOO_BRIGHT,
    TOO_DARK,
    Exposed,
    departs,
    exposed,
    flattest,
    merge,
    noise,
    ratio,
    steady,
    with_tolerance,
)
from hdrusd.photometry.response import (
    SMOOTHNESS,
    Response,
    linear_response,
    parse_response,
    recover,
    srgb_response,
)
from hdrusd.report import Kind, Report

#: Pictures of a bracket at most: so many files are open at once.
MOST_PICTURES = 64

#: Pixels of the grid, and of those what a response is recovered from.
_GRID = 1 << 16
_PIXELS = {"debevec": 1536, "robertson": 32768}

#: Codes of all pictures that are decoded at once.
_STRIP = 1 << 22

#: Share of departing pixels that is a finding, and the difference of exposures that is.
_MOVED, _APART = 5e-4, 0.1

#: Largest response file.
_RESPONSE_BYTES = 16 << 20

RESPONSES = ("debevec", "robertson", "srgb", "linear")


@dataclass(frozen=True, slots=True)
class Bracket:
    """What is asked for.

    ``exposures``: relative, one a picture; None for those that the files state. ``response``: one
    of RESPONSES or a file. ``smoothness``: Debevec and Malik's lambda.
    """

    files: tuple[Path, ...]
    output: Path
    calibration: Calibration
    exposures: tuple[float, ...] | None = None
    response: str | Path = "debevec"
    response_out: Path | None = None
    smoothness: float = SMOOTHNESS


@dataclass(slots=True)
class _Grid:
    """The pixels that are kept.

    ``codes``: (n, c) a picture, and all as ``shares`` (n, p, c) of the range; ``spread``: how much
    they differ from their neighbours, (n).
    """

    codes: list[npt.NDArray[Any]]
    shares: npt.NDArray[np.float64]
    spread: npt.NDArray[np.float64]


def merge_bracket(bracket: Bracket, report: Report) -> dict[str, Any]:
    """Merge, calibrate, write; what was done, for the report. Raises HdrusdError."""
    response = _given_response(bracket)
    if not 2 <= len(bracket.files) <= MOST_PICTURES:
        place = bracket.files[0] if bracket.files else bracket.output
        text = f"{len(bracket.files)} pictures; want 2 to {MOST_PICTURES} of one scene"
        raise InputError(place, text)
    with ExitStack() as stack:
        pictures = [stack.enter_context(Photograph(file)) for file in bracket.files]
        stated = stated_exposures(pictures, bracket.exposures, report)
        order = sorted(range(len(pictures)), key=lambda i: stated.values[i])
        pictures = [pictures[i] for i in order]
        values = [stated.values[i] for i in order]
        _agree(pictures, values, report)
        bracket.calibration.check(stated, SourceRef(bracket.output))
        grid = _look(pictures)
        response = response or _recovered(bracket, pictures, values, grid)
        if len(response.curves) == 3 and pictures[0].shape[2] == 1:
            raise InputError(pictures[0].path, "a grey picture; the response has three channels")
        tables = [exposed(response, h, p.top) for h, p in zip(values, pictures, strict=True)]
        tables = _judged(pictures, tables, grid, report)
        light, state = _merged(pictures, tables, report)
        turn = pictures[0].orientation()
    light, state = oriented(light, turn), oriented(state, turn)
    unit, said = factor(
        light, state, bracket.calibration, response, SourceRef(bracket.output), report
    )
    light *= np.float32(unit)
    _lost(state, tables, unit, SourceRef(bracket.output), report)
    sources = [
        {"file": picture.path.name, "exposure": float(f"{value:.6g}")}
        for picture, value in zip(pictures, values, strict=True)
    ]
    described = response.method
    if response.spread is not None:
        described += f", scatter {response.spread:.4f} of ln exposure; equal middle codes are grey"
    attributes = {
        "hdrusd:bracketSources": json.dumps(sources),
        "hdrusd:bracketExposure": stated.unit,
        "hdrusd:bracketResponse": described,
        "hdrusd:bracketCalibration": said,
    }
    colour = np.repeat(light, 3, axis=2) if light.shape[2] == 1 else light
    write_exr(bracket.output, colour, attributes)
    return {
        "files": [str(bracket.output)],
        "width": light.shape[1],
        "height": light.shape[0],
        "sources": sources,
        "exposure": stated.unit,
        "response": {"method": response.method, "spread": response.spread},
        "calibration": said,
        "factor": unit,
        "peak": float(light.max()),
        "unheld": int(np.count_nonzero(state)),
    }


def _given_response(bracket: Bracket) -> Response | None:
    """The response that is not to be recovered. Raises InputError."""
    if bracket.response == "srgb":
        return srgb_response()
    if bracket.response == "linear":
        return linear_response()
    if isinstance(bracket.response, str):
        return None
    path = bracket.response
    try:
        if path.stat().st_size > _RESPONSE_BYTES:
            raise InputError(path, f"more than {_RESPONSE_BYTES >> 20} MiB; want a response")
        return parse_response(json.loads(path.read_text(encoding="utf-8")))
    except InputError:
        raise
    except OSError as problem:
        raise InputError(path, problem.strerror or "cannot be read") from problem
    except (ValueError, RecursionError):
        raise InputError(path, "not JSON; want a response of --response-out") from None
    except HdrusdError as problem:
        raise InputError(path, str(problem)) from problem


def _agree(pictures: Sequence[Photograph], values: Sequence[float], report: Report) -> None:
    """Refuse pictures of different sizes and of one exposure."""
    first = pictures[0]
    for picture in pictures[1:]:
        if picture.shape != first.shape or picture.orientation() != first.orientation():
            h, w, c = picture.shape
            text = f"{w} x {h} pixels of {c} channels, orientation {picture.orientation()}"
            h, w, c = first.shape
            wanted = f"{w} x {h} of {c}, {first.orientation()}, as {first.path.name}"
            raise InputError(picture.path, f"{text}; want {wanted}")
    if values[-1] < values[0] * 1.01:
        raise InputError(first.path, f"{len(pictures)} pictures of one exposure; want a bracket")
    for picture in pictures:
        profile = picture.profile()
        if profile and "srgb" not in profile.lower() and "709" not in profile:
            text = f"colour profile {profile!r}; its primaries are read as Rec. 709"
            report.add(Kind.ASSUMED, "bracket-primaries", SourceRef(picture.path), "", text)


def _strips(picture: Photograph, together: int) -> Iterator[tuple[int, int]]:
    """First and last row of each strip when ``together`` pictures are read at once."""
    height, width, channels = picture.shape
    rows = max(1, _STRIP // (width * channels * together))
    for start in range(0, height, rows):
        yield start, min(start + rows, height)


def _look(pictures: Sequence[Photograph]) -> _Grid:
    """A grid of pixels of every picture, read one after another, without those that moved."""
    height, width, channels = pictures[0].shape
    step = max(1, math.ceil(math.sqrt(height * width / _GRID)))
    right = np.arange(step // 2, width, step)
    kept: list[npt.NDArray[Any]] = []
    spread = np.zeros(1)
    for picture in pictures:
        codes, spreads = [], []
        for start, stop in _strips(picture, 1):
            strip = picture.rows(start, stop)
            down = np.arange(step // 2, height, step)
            down = down[(down >= start) & (down < stop)] - start
            middle = strip[np.ix_(down, right)].astype(np.int32)
            away = np.zeros(middle.shape[:2], np.int32)
            for dy, dx in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                beside = np.ix_(
                    np.clip(down + dy, 0, stop - start - 1), np.clip(right + dx, 0, width - 1)
                )
                away = np.maximum(away, np.abs(strip[beside] - middle).max(axis=-1))
            codes.append(strip[np.ix_(down, right)].reshape(-1, channels))
            spreads.append(away.ravel() / picture.top)
        kept.append(np.concatenate(codes))
        spread = np.maximum(spread, np.concatenate(spreads))
    shares = np.stack([code / p.top for code, p in zip(kept, pictures, strict=True)], axis=1)
    still = steady(shares)
    if still.mean() < 0.5:  # then nobody can say what moved
        still[:] = True
    return _Grid([code[still] for code in kept], shares[still], spread[still])


def _recovered(
    bracket: Bracket, pictures: Sequence[Photograph], values: Sequence[float], grid: _Grid
) -> Response:
    """The response of these very pictures, written where it is asked for."""
    method = str(bracket.response)
    chosen = flattest(grid.shares, grid.spread, _PIXELS[method])
    try:
        response = recover(grid.shares[chosen], values, method, bracket.smoothness)
    except HdrusdError as problem:
        raise InputError(pictures[0].path, str(problem)) from problem
    if bracket.response_out is not None:
        text = json.dumps(response.as_dict()) + "\n"
        write_atomically(bracket.response_out, lambda file: _write(file, text))
    return response


def _write(file: Path, text: str) -> None:
    file.write_text(text, encoding="utf-8")


def _judged(
    pictures: Sequence[Photograph], tables: list[Exposed], grid: _Grid, report: Report
) -> list[Exposed]:
    """The tables with tolerances; pictures that disagree as wholes are findings."""
    if not any(
        (table.weight[codes] > 0.0).any() for codes, table in zip(grid.codes, tables, strict=True)
    ):
        text = "no pixel is between dark and saturated in any picture; want other exposures"
        raise InputError(pictures[0].path, text)
    flat = flattest(grid.shares, grid.spread, len(grid.spread) // 2)
    codes = [code[flat] for code in grid.codes]
    for i in range(1, len(tables)):
        times = ratio(codes[i], codes[i - 1], tables[i], tables[i - 1])
        if math.isfinite(times) and abs(math.log(times)) > _APART:
            text = (
                f"reads {times:.3f} times the light that {pictures[i - 1].path.name} does; "
                "want true exposures and the camera's response"
            )
            report.add(Kind.INVALID, "bracket-exposure", SourceRef(pictures[i].path), "", text)
    sigma = noise(codes, tables, merge(codes, tables)[0])
    return [with_tolerance(table, sigma) for table in tables]


def _merged(
    pictures: Sequence[Photograph], tables: Sequence[Exposed], report: Report
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint8]]:
    """E (h, w, c) and why a pixel is not held (h, w); departures are findings."""
    height, width, channels = pictures[0].shape
    light = np.empty((height, width, channels), np.float32)
    state = np.empty((height, width), np.uint8)
    counts = np.zeros(len(pictures), np.int64)
    across, along = np.zeros(width, np.int64), np.zeros(height, np.int64)
    for start, stop in _strips(pictures[0], len(pictures)):
        codes = [picture.rows(start, stop) for picture in pictures]
        light[start:stop], held = merge(codes, tables)
        state[start:stop] = held.max(axis=-1)
        anywhere = np.zeros((stop - start, width), np.bool_)
        for i, (code, table) in enumerate(zip(codes, tables, strict=True)):
            away = departs(code, table, light[start:stop])
            counts[i] += np.count_nonzero(away)
            anywhere |= away
        across += np.count_nonzero(anywhere, axis=0)
        along[start:stop] = np.count_nonzero(anywhere, axis=1)
    moved = int(across.sum())
    if moved > _MOVED * height * width:
        worst = pictures[int(counts.argmax())].path
        (left, right), (up, down) = _most(across), _most(along)
        text = (
            f"{moved} pixels ({100.0 * moved / (height * width):.2g} %) differ between pictures "
            f"beyond noise, most in this one, from {left},{up} to {right},{down} of "
            "its rows: something moved, or the camera did; not corrected"
        )
        report.add(Kind.INVALID, "bracket-ghost", SourceRef(worst), "", text)
    return light, state


def _most(counts: npt.NDArray[np.int64]) -> tuple[int, int]:
    """Between which places all but 2 % of ``counts`` lie."""
    share = np.cumsum(counts) / counts.sum()
    return int(np.searchsorted(share, 0.01)), int(np.searchsorted(share, 0.99))


def _lost(
    state: npt.NDArray[np.uint8],
    tables: Sequence[Exposed],
    unit: float,
    place: SourceRef,
    report: Report,
) -> None:
    """Findings for pixels that no picture holds, with the bounds of what there is in cd/m2."""
    count = np.bincount(state.ravel(), minlength=4)
    shortest, longest = tables[0], tables[-1]
    most = unit * float(shortest.light[:, math.ceil(shortest.saturated)].min())
    least = unit * float(longest.light[:, int(longest.dark)].max())
    texts = {
        TOO_BRIGHT: f"saturated in all pictures; {most:.4g} cd/m2 or more there",
        TOO_DARK: f"noise in all pictures; {least:.4g} cd/m2 or less there",
        BETWEEN: "saturated in one picture and noise in the next; between both bounds",
    }
    for key, text in texts.items():
        if count[key]:
            said = f"{count[key]} pixels ({100.0 * count[key] / state.size:.2g} %) {text}"
            report.add(Kind.CLAMPED, "bracket-unheld", place, "", said)
