"""Contact sheets: pictures of a sequence side by side, named above and beside."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio

from hdrusd.errors import HdrusdError

Picture = npt.NDArray[np.uint8]

#: Pixels between pictures and around them; height of the text and of its line.
_GAP, _TEXT, _LINE = 6, 16, 26
_PAPER, _INK = 24, 0.86  # code value of the ground, of 255; the text's, of 1


def contact_sheet(
    rows: Sequence[Sequence[Picture]],
    columns: Sequence[str],
    moments: Sequence[str] = (),
    *,
    width: int = 480,
) -> Picture:
    """(h, w, 3) sRGB: a row of pictures for each moment, a column for each look.

    ``columns`` stand above, ``moments`` (if any) below each row, at its left. Pictures become
    ``width`` pixels wide. Raises HdrusdError for rows of other lengths than the names.
    """
    if not rows or any(len(row) != len(columns) for row in rows):
        raise HdrusdError(f"contact sheet: want rows of {len(columns)} pictures")
    if moments and len(moments) != len(rows):
        raise HdrusdError(f"contact sheet: {len(moments)} moments, {len(rows)} rows")
    bands = [_side_by_side([_line(name, width) for name in columns])]
    for index, row in enumerate(rows):
        bands.append(_side_by_side([_resized(picture, width) for picture in row]))
        across = bands[0].shape[1]
        below = _line(moments[index], across) if moments else _paper(_GAP, across)
        bands.append(below)
    return _framed(np.concatenate(bands))


def _side_by_side(pictures: Sequence[Picture]) -> Picture:
    """With a gap between; shorter ones have paper below."""
    height = max(picture.shape[0] for picture in pictures)
    parts: list[Picture] = []
    for picture in pictures:
        low = _paper(height - picture.shape[0], picture.shape[1])
        parts += [_paper(height, _GAP), np.concatenate([picture, low])]
    return np.concatenate(parts[1:], axis=1)


def _framed(picture: Picture) -> Picture:
    edges = ((0, _GAP), (_GAP, _GAP), (0, 0))
    return np.pad(picture, edges, constant_values=np.uint8(_PAPER))


def _paper(height: int, width: int) -> Picture:
    return np.full((height, width, 3), _PAPER, np.uint8)


def _resized(picture: Picture, width: int) -> Picture:
    height, old = picture.shape[:2]
    if old == width:
        return picture
    goal = oiio.ROI(0, width, 0, max(round(height * width / old), 1), 0, 1, 0, 3)
    small = oiio.ImageBufAlgo.resize(_buffer(picture), roi=goal)
    if small.has_error:
        raise HdrusdError(f"contact sheet: {small.geterror()}")
    return np.asarray(small.get_pixels(oiio.UINT8))


def _line(text: str, width: int) -> Picture:
    """A line of text on paper; what is too long is cut at the right."""
    line = _buffer(_paper(_LINE, width))
    ink = (_INK, _INK, _INK)
    if not oiio.ImageBufAlgo.render_text(line, 0, _LINE - 8, text, _TEXT, textcolor=ink):
        raise HdrusdError(f"contact sheet: no text ({line.geterror()})")
    return np.asarray(line.get_pixels(oiio.UINT8))


def _buffer(picture: Picture) -> oiio.ImageBuf:
    buffer = oiio.ImageBuf(oiio.ImageSpec(picture.shape[1], picture.shape[0], 3, oiio.UINT8))
    buffer.set_pixels(buffer.roi, np.ascontiguousarray(picture))
    return buffer
