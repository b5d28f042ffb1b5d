"""The scale beside a false colour picture: a bar, ticks and cd/m2 in a small bitmap font."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.errors import HdrusdError
from hdrusd.tonemap.falsecolour import falsecolour_palette, falsecolour_step

Picture = npt.NDArray[np.uint8]

#: 3 x 5 dots a character, rows from the top, the left dot being 4.
_FONT = {
    "0": (7, 5, 5, 5, 7),
    "1": (2, 6, 2, 2, 7),
    "2": (7, 1, 7, 4, 7),
    "3": (7, 1, 7, 1, 7),
    "4": (5, 5, 7, 1, 1),
    "5": (7, 4, 7, 1, 7),
    "6": (7, 4, 7, 5, 7),
    "7": (7, 1, 1, 2, 2),
    "8": (7, 5, 7, 5, 7),
    "9": (7, 5, 7, 1, 7),
    ".": (0, 0, 0, 0, 2),
    "-": (0, 0, 7, 0, 0),
    "+": (0, 2, 7, 2, 0),
    "/": (1, 1, 2, 4, 4),
    "c": (0, 7, 4, 4, 7),
    "d": (1, 7, 5, 5, 7),
    "e": (7, 5, 7, 4, 7),
    "m": (0, 7, 7, 5, 5),
}
_ADVANCE, _LINE = 4, 8  # dots from character to character and from line to line
_BAR, _TICK, _LABEL = 8, 3, 9 * _ADVANCE  # dots across; a label has at most 9 characters

#: The smallest picture that takes a legend, (height, width).
SMALLEST = (3 * _LINE, _BAR + _TICK + _LABEL + 4)


def tick_luminances(scale: float, decades: float, divisions: int = 8) -> list[float]:
    """cd/m2 at the ticks, from the bottom: scale 10^((k / divisions - 1) decades).

    With no decades scale k / divisions.
    """
    if decades == 0.0:
        return [scale * k / divisions for k in range(divisions + 1)]
    return [scale * 10.0 ** ((k / divisions - 1.0) * decades) for k in range(divisions + 1)]


def paint_legend(
    picture: Picture, scale: float, decades: float, palette: str = "spec", steps: float = 0.0
) -> None:
    """Paint the scale into the left edge of ``picture`` (h, w, 3), top row first, in place.

    The other arguments as in falsecolour.py. There are 8 divisions, or fewer
    where the labels would touch. Raises HdrusdError for a picture below SMALLEST.
    """
    height, width = picture.shape[:2]
    if height < SMALLEST[0] or width < SMALLEST[1]:
        need = f"{SMALLEST[1]} x {SMALLEST[0]}"
        raise HdrusdError(f"legend: a picture of {width} x {height} pixels; want {need} or more")
    dot = max(1, min(height // 240, width // SMALLEST[1]))
    line = _LINE * dot
    # Half a line above the first and below the last tick; the unit has the top line.
    top, bottom = line + line // 2, height - line // 2 - 1
    divisions = next((n for n in (8, 4, 2) if (bottom - top) // n >= line), 1)

    picture[:, : SMALLEST[1] * dot] = 0
    _write(picture, "cd/m2", dot, 2 * dot, dot)
    v = np.linspace(1.0, 0.0, bottom - top + 1)
    bar = np.rint(falsecolour_palette(falsecolour_step(v, steps), palette) * 255.0).astype(np.uint8)
    picture[top : bottom + 1, 2 * dot : (2 + _BAR) * dot] = bar[:, None]
    for k, value in enumerate(tick_luminances(scale, decades, divisions)):
        y = bottom - round(k * (bottom - top) / divisions)
        across = slice((2 + _BAR) * dot, (2 + _BAR + _TICK - 1) * dot)
        picture[y, across] = 255
        _write(picture, _label(value), y - 2 * dot, (3 + _BAR + _TICK) * dot, dot)


def _label(luminance: float) -> str:
    """Three digits, in full from a thousand to a million where ``g`` would write 1e+03."""
    return f"{luminance:.0f}" if 999.5 <= luminance < 1e6 else f"{luminance:.3g}"


def _write(picture: Picture, text: str, y: int, x: int, dot: int) -> None:
    """White text with its upper left dot at row ``y``, column ``x``."""
    for index, character in enumerate(text):
        rows = np.array(_FONT[character], np.uint8)[:, None]
        dots = (rows >> np.array([2, 1, 0], np.uint8) & 1).astype(bool)
        mask = np.repeat(np.repeat(dots, dot, axis=0), dot, axis=1)
        left = x + index * _ADVANCE * dot
        picture[y : y + 5 * dot, left : left + 3 * dot][mask] = 255
