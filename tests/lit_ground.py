"""A converted stage seen from straight above: cd/m2 of a level ground, 4 m x 3 m of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from stage_text import CAMERA

from hdrusd.conversion import Result
from hdrusd.job import Job
from hdrusd.render import render_sequence
from hdrusd.report import Report
from hdrusd.units import LUMINANCE_WEIGHTS

WIDTH, HEIGHT = 64, 48


def seen(gl: Any, result: Result, *parts: str) -> npt.NDArray[np.float64]:
    """(48, 64) cd/m2 of the plane z = 0 from 4 m above; ``parts``: text added to the stage.

    To be asked before the stage is opened: an open layer does not see the text.
    """
    text = result.output.read_text(encoding="utf-8")
    result.output.write_text("\n".join([text, CAMERA, *parts]), encoding="utf-8")
    job = Job(result.output, width=WIDTH, height=HEIGHT, shadows=False, camera="/Camera")
    (frame,) = render_sequence(gl, job, Report())
    return np.asarray(frame.hdr[..., :3].astype(np.float64) @ LUMINANCE_WEIGHTS)


def ground() -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """X and y of what each pixel sees of z = 0, m."""
    x = (np.arange(WIDTH) + 0.5) / WIDTH * 4.0 - 2.0
    y = 1.5 - (np.arange(HEIGHT) + 0.5) / HEIGHT * 3.0
    return np.broadcast_to(x, (HEIGHT, WIDTH)), np.broadcast_to(y[:, None], (HEIGHT, WIDTH))


def rows(result: Result) -> dict[str, dict[str, Any]]:
    """The account of the lights by name."""
    return {row["name"]: row for row in result.lights}


def findings(result: Result, code: str) -> list[str]:
    """The texts of the findings of a code."""
    return [finding.text for finding in result.report if finding.code == code]
