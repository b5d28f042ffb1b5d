"""The second half alone: frames in cd/m2 become pictures for a display."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.colour import dither, quantise, srgb_encode
from hdrusd.errors import SourceRef
from hdrusd.gpu.context import create_context
from hdrusd.gpu.ldr import ToneMapper
from hdrusd.gpu.measure import Measurer
from hdrusd.gpu.program import Programs
from hdrusd.images import REC709, read_exr, write_png
from hdrusd.report import Kind, Report
from hdrusd.tonemap.falsecolour import OPERATOR as FALSE_COLOUR
from hdrusd.tonemap.legend import SMALLEST, paint_legend
from hdrusd.tonemap.operator import Operator, Parameters, Statistics

#: Pictures that wait for the writer; each holds a frame in memory.
_WAITING = 2


class Display:
    """Shader 2 with its measurements: an HDR texture becomes a picture."""

    def __init__(self, ctx: moderngl.Context, programs: Programs, operator: Operator) -> None:
        self.operator = operator
        self.mapper = ToneMapper(ctx, programs)
        self.measurer = Measurer(ctx, programs)

    def show(
        self, hdr: moderngl.Texture, parameters: Parameters, *, top_first: bool = False
    ) -> tuple[npt.NDArray[np.uint8], Statistics | None]:
        """The picture, (h, w, 3) sRGB, top row first, and what was measured for it."""
        settings = self.operator.settings(parameters)
        statistics = self.measurer.measure(hdr, self.operator.needs(settings))
        picture = self.mapper.apply(hdr, self.operator, settings, statistics, top_first=top_first)
        add_legend(picture, self.operator, settings)
        return picture, statistics


def add_legend(picture: npt.NDArray[np.uint8], operator: Operator, settings: Parameters) -> None:
    """The cd/m2 scale on a false colour picture that has room for it, in place."""
    room = all(have >= need for have, need in zip(picture.shape, SMALLEST, strict=False))
    if operator.name == FALSE_COLOUR.name and room:
        paint_legend(picture, float(settings["scale"] or 0), float(settings["decades"] or 0))


def encode(linear: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Display-linear [0, 1], (h, w, 3), as dithered 8-bit sRGB: what shader 2 does last."""
    rows, columns = np.mgrid[0 : linear.shape[0], 0 : linear.shape[1]]
    offset = dither(columns, rows)[..., None]  # the same for all three channels
    return np.asarray(quantise(srgb_encode(linear), offset), np.uint8)


def tonemap_sequence(
    jobs: Sequence[tuple[Path, Path]],
    operator: Operator,
    parameters: Parameters,
    report: Report,
    *,
    reference: bool = False,
    resume: bool = False,
) -> Iterator[Path | None]:
    """Tone map EXR files into PNG files, in order; None for one that ``resume`` skipped.

    ``reference``: by the NumPy definition instead of the GPU. A file that does not say
    what its numbers are is taken as Rec. 709 in cd/m2, a finding. Raises InputError,
    ContextError.
    """
    display: Display | None = None
    with Writer() as writer:
        for source, target in jobs:
            if resume and target.is_file():
                yield None
                continue
            rgb, header = read_exr(source)
            _note_units(source, header, report)
            if reference:
                settings = operator.settings(parameters)
                picture = encode(operator.apply(rgb, None, settings))
                add_legend(picture, operator, settings)
            else:
                if display is None:
                    ctx = create_context()
                    display = Display(ctx, Programs(ctx), operator)
                texture = display.mapper.upload(rgb)
                picture, _ = display.show(texture, parameters, top_first=True)
            writer.submit(write_png, target, picture)
            yield target


def _note_units(source: Path, header: Mapping[str, Any], report: Report) -> None:
    place = SourceRef(source)
    if "whiteLuminance" not in header:
        text = "no whiteLuminance; 1.0 is taken as 1 cd/m2"
        report.add(Kind.ASSUMED, "exr-unit", place, "", text)
    primaries = header.get("chromaticities")
    # OpenEXR's default without the attribute is Rec. 709; 1e-3: headers with rounded values.
    if primaries is not None and not np.allclose(np.ravel(primaries), REC709, rtol=0, atol=1e-3):
        text = f"chromaticities {np.ravel(primaries).round(4).tolist()} are read as Rec. 709"
        report.add(Kind.REPLACED, "exr-primaries", place, "", text)


class Writer:
    """One thread that writes files while the caller goes on; two wait at most.

    A failure comes out of a later ``submit`` or of leaving the block. Leaving it by
    an exception (Ctrl-C) finishes the file in hand, so none is torn, and drops those
    that wait.
    """

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, "hdrusd-writer")
        self._pending: deque[Future[None]] = deque()

    def __enter__(self) -> Writer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            while error is None and self._pending:
                self._pending.popleft().result()
        finally:
            self._pool.shutdown(cancel_futures=True)

    def submit(self, write: Callable[..., None], *args: Any, **options: Any) -> None:
        """Have ``write(*args, **options)`` called; waits while two others are waiting."""
        while self._pending and (self._pending[0].done() or len(self._pending) > _WAITING):
            self._pending.popleft().result()
        self._pending.append(self._pool.submit(write, *args, **options))
