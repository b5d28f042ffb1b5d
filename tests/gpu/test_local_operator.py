"""Reinhard's local operator drawn by shader 2, blurs and all, against NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hdrusd.gpu.ldr import ToneMapper
from hdrusd.gpu.program import Programs
from hdrusd.tonemap.operator import statistics
from hdrusd.tonemap.reinhard02_local import OPERATOR
from hdrusd.viewing import encode


@pytest.mark.parametrize("size", [(70, 113), (9, 5)])
def test_picture_with_an_edge_and_lamps(gl: Any, size: tuple[int, int]) -> None:
    height, width = size
    rgb = np.full((height, width, 3), (8.0, 10.0, 14.0), np.float32)
    rgb[:, width // 2 :] *= 100.0
    rgb[height // 3, ::4] = (5e4, 3e4, 1e4)
    moment = OPERATOR.moment(None, statistics(rgb))
    mapper = ToneMapper(gl, Programs(gl))
    picture = mapper.apply_array(rgb, OPERATOR, moment).astype(int)
    mapper.release()
    wanted = encode(OPERATOR.apply(rgb, moment=moment), OPERATOR, moment.screen).astype(int)
    # The same dither: a step where a value lies on the edge between two.
    off = np.abs(picture - wanted).max(axis=-1)
    # Where a difference is as large as its threshold, float32 may choose the next scale.
    assert (off <= 1).mean() > 0.995
    assert off.max() <= 16
