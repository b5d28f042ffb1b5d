"""Contact sheets: where pictures and names stand."""

from __future__ import annotations

import numpy as np
import pytest

from hdrusd.contact_sheet import contact_sheet
from hdrusd.errors import HdrusdError


def flat(value: int, height: int = 27, width: int = 48) -> np.ndarray:
    return np.full((height, width, 3), value, np.uint8)


def test_pictures_stand_in_rows_and_columns() -> None:
    sheet = contact_sheet([[flat(100), flat(200)], [flat(50), flat(250)]], ["A", "B"], width=48)
    gap, line = 6, 26
    assert sheet.shape == (line + 2 * (27 + gap) + gap, 2 * 48 + 3 * gap, 3)
    ys, xs = (line, line + 27 + gap), (gap, gap + 48 + gap)
    for y, values in zip(ys, ((100, 200), (50, 250)), strict=True):
        for x, value in zip(xs, values, strict=True):
            assert (sheet[y : y + 27, x : x + 48] == value).all()


def test_names_are_written_above_and_moments_below() -> None:
    plain = contact_sheet([[flat(100)]], [""], width=48)
    named = contact_sheet([[flat(100)]], ["eye"], width=48)
    rows = np.flatnonzero((named != plain).any(axis=(1, 2)))
    assert rows.size
    assert rows.max() < 26
    timed = contact_sheet([[flat(100)]], [""], ["1 s"], width=48)
    assert (timed[26 + 27 :] > 100).any()


def test_pictures_become_as_wide_as_asked() -> None:
    sheet = contact_sheet([[flat(80, 360, 640), flat(90, 90, 160)]], ["", ""], width=320)
    assert sheet.shape[1] == 2 * 320 + 18
    assert (sheet[26 : 26 + 180, 6:326] == 80).all()
    assert (sheet[26 : 26 + 180, 332:652] == 90).all()


@pytest.mark.parametrize(
    ("rows", "moments"), [([], []), ([[flat(1)]], []), ([[flat(1), flat(2)]], ["a", "b"])]
)
def test_rows_that_do_not_fit_are_refused(rows: list, moments: list[str]) -> None:
    with pytest.raises(HdrusdError, match="contact sheet: "):
        contact_sheet(rows, ["A", "B"], moments)
