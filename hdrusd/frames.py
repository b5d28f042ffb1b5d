"""Frame lists and numbered file names, in usdrecord's grammar.

``101``, ``101:105``, ``105:101``, ``101:109x2``, ``101:104x0.5``, and lists of these
with commas. File names hold ``####`` for whole frames or ``###.###`` for fractions.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from decimal import Decimal, InvalidOperation
from pathlib import Path

from hdrusd.errors import HdrusdError

#: More frames than this in one list is a slip of the keyboard.
MAX_FRAMES = 1_000_000

#: No time code is larger, and no stride is smaller than its inverse.
MAX_TIME = Decimal(10) ** 9

_PLACEHOLDER = re.compile(r"#+(?:\.#+)?")
_FLOAT_PLACEHOLDER = re.compile(r"#+\.#+")


class FrameError(HdrusdError):
    """A frame list or a file name that does not say which frames are meant."""

    exit_code = 2


def parse_frames(spec: str) -> list[float]:
    """Time codes of a frame list, in the order written. Raises FrameError."""
    times: list[float] = []
    for part in spec.split(","):
        for value in _parse_range(part.strip(), spec):
            times.append(float(value))
            if len(times) > MAX_FRAMES:
                raise FrameError(f"--frames: {spec}: more than {MAX_FRAMES} frames")
    return times


def _parse_range(part: str, spec: str) -> Iterator[Decimal]:
    span, by, stride_text = part.partition("x")
    first_text, colon, last_text = span.partition(":")
    try:
        first = Decimal(first_text)
        last = Decimal(last_text) if colon else first
        stride = Decimal(stride_text) if by else Decimal(1)
    except InvalidOperation:
        raise FrameError(
            f"--frames: {part or spec!r}: not a frame list; want 101, 101:105, 101:109x2"
        ) from None
    if not (first.is_finite() and last.is_finite() and stride.is_finite()):
        raise FrameError(f"--frames: {part}: want finite numbers")
    # copy_abs: abs() rounds to the context, which overflows.
    if max(first.copy_abs(), last.copy_abs()) > MAX_TIME or 0 < stride.copy_abs() < 1 / MAX_TIME:
        raise FrameError(f"--frames: {part}: want frames to {MAX_TIME:g}, strides from 1e-9")
    if by and (not colon or stride == 0 or (stride < 0 and last >= first)):
        raise FrameError(f"--frames: {part}: want a stride that leads from first to last")
    stride = abs(stride)
    count = int(abs(last - first) / stride)
    if count > MAX_FRAMES:
        raise FrameError(f"--frames: {part}: more than {MAX_FRAMES} frames")
    step = stride if last >= first else -stride
    for index in range(count + 1):
        yield first + step * index


def format_frames(times: Sequence[float]) -> str:
    """A frame list that ``parse_frames`` reads back."""
    return ",".join(_number(time) for time in times)


def _number(time: float) -> str:
    text = format(Decimal(repr(time)), "f")
    return text.rstrip("0").rstrip(".") if "." in text else text


def has_placeholder(pattern: str) -> bool:
    """Whether a file name is numbered."""
    return _PLACEHOLDER.search(Path(pattern).name) is not None


def frame_path(pattern: str, time: float) -> Path:
    """The file of one frame; ``pattern`` itself where it has no placeholder."""
    path = Path(pattern)

    def number(match: re.Match[str]) -> str:
        text = match.group()
        whole, dot, fraction = text.partition(".")
        digits = len(fraction)
        width = len(whole) + len(dot) + digits
        return f"{time:0{width}.{digits}f}"

    return path.with_name(_substitute(path.name, number))


def _substitute(name: str, number: object) -> str:
    # "shot.####.exr": the dot before exr is no fraction, "###.###" is one.
    pattern = _FLOAT_PLACEHOLDER if _FLOAT_PLACEHOLDER.search(name) else re.compile(r"#+")
    return pattern.sub(number, name, count=1)  # type: ignore[call-overload, no-any-return]


def check_pattern(pattern: str, times: Sequence[float] | None) -> None:
    """Refuse a name that cannot hold the frames: none or two placeholders, lost fractions.

    ``times`` None: a single picture without a frame list, which takes no placeholder
    (as in usdrecord). Raises FrameError.
    """
    name = Path(pattern).name
    found = _PLACEHOLDER.findall(name)
    if len(found) > 1:
        raise FrameError(f"{name}: two frame placeholders; want one, as in out.####.exr")
    if times is None:
        if found:
            raise FrameError(f"{name}: a frame placeholder and no frames; want a plain name")
        return
    if not found:
        raise FrameError(f"{name}: no frame placeholder; want one, as in out.####.exr")
    paths = {frame_path(pattern, time) for time in times}
    if len(paths) < len(set(times)):
        raise FrameError(f"{name}: frames fall on the same file; want a fraction, out.###.###.exr")
    digits = len(found[0].partition(".")[2])
    if any(round(time, digits) != time for time in times):
        raise FrameError(f"{name}: {found[0]} cannot tell these frames; want out.###.###.exr")


def find_frames(pattern: str) -> list[tuple[float, Path]]:
    """The numbered files that exist, by frame; a plain name is its own frame 0.

    A number is written as ``frame_path`` writes it: in.####.exr is not in.1.exr.
    """
    path = Path(pattern)
    if not has_placeholder(pattern):
        return [(0.0, path)]
    expression = re.escape(path.name)
    marks = _PLACEHOLDER.search(path.name)
    assert marks is not None
    expression = expression.replace(
        re.escape(marks.group()), r"(-?\d+\.\d+)" if "." in marks.group() else r"(-?\d+)", 1
    )
    frames = [
        (float(match.group(1)), file)
        for file in path.parent.glob("*")
        if (match := re.fullmatch(expression, file.name)) is not None
    ]
    return sorted((time, file) for time, file in frames if frame_path(pattern, time) == file)
