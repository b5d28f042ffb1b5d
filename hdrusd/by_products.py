"""What a sequence leaves beside its pictures: what the eye went through, and a video."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from hdrusd.adaptation_log import AdaptationLog
from hdrusd.colour import from_rec2020, luminance
from hdrusd.course import EVERY
from hdrusd.errors import ParameterError
from hdrusd.eye.screen import Screen
from hdrusd.images import read_image
from hdrusd.plots import check_plot
from hdrusd.tonemap.operator import Moment, Operator
from hdrusd.video import VideoWriter
from hdrusd.viewing import decoded

#: The column of what the screen shows.
SCREEN = "mean luminance of the screen [cd/m2]"


def flicker(log: AdaptationLog) -> float:
    """The largest change of the screen's mean luminance from one frame to the next.

    As a share of their mean; 0 where no two neighbours were shown.
    """
    shown = [row.get(SCREEN, math.nan) for _, row in log.in_order()]
    before, after = np.array(shown[:-1]), np.array(shown[1:])
    change = np.abs(after - before) / (0.5 * (after + before))
    return float(np.nanmax(change)) if np.isfinite(change).any() else 0.0


class ByProducts:
    """A table of the eye (``csv``), its plot, and a video; each only where it has a name.

    Without an operator there is nothing to tell. To be used in a ``with`` block. An interrupted
    sequence leaves the table of what was seen, and no video. Raises HdrusdError where an extra
    is missing, before any work.
    """

    def __init__(
        self,
        operator: Operator | None,
        *,
        csv: Path | None = None,
        plot: Path | None = None,
        video: Path | None = None,
        fps: float = 24.0,
        resume: bool = False,
        screen: Screen | None = None,
    ) -> None:
        if plot is not None:
            check_plot()
        if video is not None and screen is not None and screen.eotf == "pq":
            raise ParameterError(f"video: screen {screen.name} is PQ; want an SDR screen")
        self.operator = operator
        self.csv = csv
        self.plot = plot
        self.log = AdaptationLog()
        self._seen = 0
        if resume and csv is not None and csv.is_file():
            self.log = AdaptationLog.read_csv(csv)
        self._stack = contextlib.ExitStack()
        self._video = None if video is None else VideoWriter(video, fps)

    def __enter__(self) -> ByProducts:
        if self._video is not None:
            self._stack.enter_context(self._video)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if self.log.rows:
                if self.csv is not None:
                    self.log.write_csv(self.csv)
                if self.plot is not None and error is None:
                    self.log.write_plot(self.plot, self.operator.title if self.operator else "")
        finally:
            self._stack.__exit__(kind, error, trace)

    def add(
        self, frame: float, time: float, moment: Moment | None, picture: Any, file: Path | None
    ) -> None:
        """The next frame; ``picture`` None: as it is in ``file`` already."""

        def pixels() -> Any:
            there = picture is None and file is not None
            return read_image(file).pixels[..., :3] if there else picture  # type: ignore[arg-type]

        if moment is not None:
            numbers = self._numbers(moment)
            if self.csv is not None:
                numbers[SCREEN] = screen_luminance(pixels(), moment.screen)
            self.log.add(frame, time, numbers)
            # As often as states are saved, so that a killed run's table is as long as they go.
            if self.csv is not None and self._seen % EVERY == 0:
                self.log.write_csv(self.csv)
            self._seen += 1
        if self._video is not None and (picture is not None or file is not None):
            self._video.add(eight_bits(pixels()))

    def _numbers(self, moment: Moment) -> dict[str, float]:
        numbers: dict[str, float] = {}
        stats = moment.statistics
        if stats is not None:
            numbers["average luminance [cd/m2]"] = stats.average
            numbers["log average luminance [cd/m2]"] = stats.log_average
        if self.operator is not None and self.operator.trace is not None:
            numbers |= self.operator.trace(moment)
        return numbers


def playback_rate(fps: float, frames: Sequence[float]) -> float:
    """Pictures a second so that ``frames`` of which ``fps`` are a second last as long as they do.

    1:240x2 has half of them. Frames at uneven steps play at their mean one.
    """
    steps = np.abs(np.diff(np.asarray(frames, np.float64)))
    step = float(steps.mean()) if steps.size else 1.0
    return fps / step if step > 0.0 else fps


def screen_luminance(picture: Any, screen: Screen) -> float:
    """Mean luminance, cd/m2, that ``screen`` shows of code values (h, w, 3), reflections too.

    Of one pixel in four, the same ones in every frame.
    """
    picture = picture[::2, ::2]
    codes = picture if picture.dtype.kind == "u" else sixteen_bits(picture)
    most = 1 << (8 * codes.itemsize)
    levels = decoded(np.arange(most) / (most - 1.0), screen)
    counts = (np.bincount(codes[..., i].ravel(), minlength=most) for i in range(3))
    linear = np.array([levels @ count for count in counts]) * (3.0 / codes.size)
    if screen.eotf == "pq":  # cd/m2 already, of other primaries
        return float(luminance(from_rec2020(linear))) + screen.reflected
    return float(screen.black_level + luminance(linear) * (screen.peak - screen.black))


def sixteen_bits(picture: Any) -> Any:
    """Code values [0, 1], as a PNG of 16 bits is read, as the integers they were."""
    return (picture * 65535.0 + 0.5).astype(np.uint16)


def eight_bits(picture: Any) -> Any:
    """Code values of 16 bits, or [0, 1], as 8, rounded; 8 bits as they are."""
    if picture.dtype.kind == "f":
        return (picture * 255.0 + 0.5).astype(np.uint8)
    if picture.dtype == np.uint16:
        return ((picture.astype(np.uint32) * 255 + 32767) // 65535).astype(np.uint8)
    return np.ascontiguousarray(picture)
