"""What the header of an EXR frame says for an eye: rate, field of view, camera, lamps.

Headers come from anywhere: what makes no sense is as if it were not there.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef
from hdrusd.images import REC709
from hdrusd.report import Kind, Report
from hdrusd.scene import Camera

#: Frames a second where neither the user nor the file says (UsdStage's default).
DEFAULT_FPS = 24.0

#: Text of lamps that is read at most.
_LONGEST = 1 << 16


class Clock:
    """Seconds of frames by their numbers and the rate that the first of them states."""

    def __init__(self, fps: float | None, report: Report) -> None:
        self.fps = fps
        self.report = report

    def time(self, number: float, source: Path, header: Mapping[str, Any]) -> float:
        """When frame ``number`` is, in s. A rate that has to be assumed is a finding."""
        if self.fps is None:
            self.fps = rate_of(header)
            if self.fps is None:
                self.fps = DEFAULT_FPS
                text = f"no rate; {DEFAULT_FPS:g} frames a second are assumed, see --fps"
                self.report.add(Kind.ASSUMED, "exr-rate", SourceRef(source), "", text)
        return number / self.fps


def number_of(header: Mapping[str, Any]) -> float:
    """The frame's number; 0 where it states none."""
    number = header.get("hdrusd:frame")
    return float(number) if isinstance(number, (int, float)) and math.isfinite(number) else 0.0


def rate_of(header: Mapping[str, Any]) -> float | None:
    """Frames a second that an EXR states: ours, or OpenEXR's ratio; None where it states none."""
    said: Any = header.get("hdrusd:timeCodesPerSecond", header.get("framesPerSecond"))
    try:
        rate = float(said)
    except (TypeError, ValueError):
        try:
            rate = float(said.n) / float(said.d)
        except (AttributeError, TypeError, ValueError, ZeroDivisionError):
            return None
    return rate if math.isfinite(rate) and rate > 0.0 else None


def field_of(
    header: Mapping[str, Any], width: int, height: int, across: float | None = None
) -> tuple[float, float] | None:
    """Width and height in degrees of an EXR frame by its camera's matrices, which it may state.

    ``across``: the width in degrees, which is believed before them. None where neither is known,
    and for an orthographic camera.
    """
    if across is not None:
        half = math.tan(math.radians(across) / 2.0)
        return across, math.degrees(2.0 * math.atan(half * height / width))
    try:
        view = np.asarray(header["worldToCamera"], np.float64).reshape(4, 4)
        ndc = np.asarray(header["worldToNDC"], np.float64).reshape(4, 4)
        projection = np.linalg.inv(view) @ ndc
    except (KeyError, ValueError, TypeError, np.linalg.LinAlgError):
        return None
    if not np.isfinite(projection).all() or abs(projection[2, 3]) < 1e-3:
        return None
    scale = abs(projection[0, 0] / projection[2, 3]), abs(projection[1, 1] / projection[2, 3])
    if min(scale) < 1e-3:
        return None
    return (
        math.degrees(2.0 * math.atan(1.0 / scale[0])),
        math.degrees(2.0 * math.atan(1.0 / scale[1])),
    )


def field_of_view(camera: Camera) -> tuple[float, float] | None:
    """Width and height of a camera's picture in degrees; None for an orthographic one."""
    if camera.orthographic:
        return None
    left, right, bottom, top = camera.window
    across = math.degrees(2.0 * math.atan((right - left) / 2.0))
    return across, math.degrees(2.0 * math.atan((top - bottom) / 2.0))


def camera_of(header: Mapping[str, Any]) -> str | None:
    """The name of the camera."""
    camera = header.get("hdrusd:camera")
    return camera if isinstance(camera, str) else None


def exposure_of(header: Mapping[str, Any]) -> float | None:
    """The linear scale of the camera's exposure, 1/(cd/m2)."""
    scale = header.get("hdrusd:exposureScale")
    if isinstance(scale, (int, float)) and 0.0 < scale < math.inf:
        return float(scale)
    return None


def lamps_text(lamps: npt.NDArray[np.float64]) -> str:
    """Rows of glare/dazzling.py as ``hdrusd:lamps`` says them; nine digits keep a float32."""
    return json.dumps([[float(f"{value:.9g}") for value in row] for row in lamps])


def lamps_of(header: Mapping[str, Any]) -> npt.NDArray[np.float64] | None:
    """Rows of lamps and of pixels that show them (glare/veil.py); None where it states none."""
    text = header.get("hdrusd:lamps")
    if not isinstance(text, str) or len(text) > _LONGEST:
        return None
    try:
        rows = np.array(json.loads(text), np.float32).astype(np.float64).reshape(-1, 6)
    except (ValueError, TypeError, OverflowError, RecursionError):
        return None
    length = np.linalg.norm(rows[:, :3], axis=1)
    sound = (
        np.isfinite(rows).all(axis=1) & (np.abs(length - 1.0) < 1e-3) & (rows >= -1.0).all(axis=1)
    )
    lamp, pixel = (rows[:, 3:] >= 0.0).all(axis=1), (rows[:, 3:] <= 0.0).all(axis=1)
    return np.asarray(rows[sound & (lamp | pixel)])


def note_units(source: Path, header: Mapping[str, Any], report: Report) -> None:
    """Findings for a frame that is not known to be Rec. 709 in cd/m2."""
    place = SourceRef(source)
    if "whiteLuminance" not in header:
        text = "no whiteLuminance; 1.0 is taken as 1 cd/m2"
        report.add(Kind.ASSUMED, "exr-unit", place, "", text)
    primaries = header.get("chromaticities")
    # OpenEXR's default without the attribute is Rec. 709; 1e-3: headers with rounded values.
    if primaries is not None and not np.allclose(np.ravel(primaries), REC709, rtol=0, atol=1e-3):
        text = f"chromaticities {np.ravel(primaries).round(4).tolist()} are read as Rec. 709"
        report.add(Kind.REPLACED, "exr-primaries", place, "", text)


def note_broken(source: Path, rgb: npt.NDArray[np.float32], report: Report) -> None:
    """A finding for pixels of a frame that are no light: not a number, infinite or below 0."""
    broken = int(np.count_nonzero(~((rgb >= 0.0) & (rgb < np.inf)).all(axis=-1)))
    if broken:
        text = f"{broken} pixels are no numbers, infinite or negative; shown black or as 1e12 cd/m2"
        report.add(Kind.CLAMPED, "exr-pixels", SourceRef(source), "", text)
