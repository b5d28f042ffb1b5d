"""The second half alone: frames in cd/m2 become pictures for a display, an eye between them."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.by_products import ByProducts, playback_rate
from hdrusd.course import Checkpoints, Course, Cut, Start
from hdrusd.errors import SourceRef
from hdrusd.gpu.context import create_context
from hdrusd.gpu.ldr import deep
from hdrusd.gpu.program import Programs
from hdrusd.images import REC709, read_exr_header, read_exr_layers, write_png
from hdrusd.report import Kind, Report
from hdrusd.tonemap.operator import Moment
from hdrusd.viewing import Eye, ReferenceEye, Shown, Sight, Viewing, with_rods

#: Pictures that wait for the writer; each holds a frame in memory.
_WAITING = 2

#: What read_exr_layers gives.
_Layers = tuple[npt.NDArray[np.float32], dict[str, Any], dict[str, npt.NDArray[np.float32]]]

#: Frames a second where neither the user nor the file says (UsdStage's default).
DEFAULT_FPS = 24.0


@dataclass(frozen=True, slots=True)
class Showing:
    """How a sequence is looked at.

    ``stills``: each frame by an eye that has looked at it for long enough. ``fps``: frames a
    second; None: what the frames say. ``states``: the file of Checkpoints. ``cuts``: numbers of
    frames that begin a new view. ``reference``: by the NumPy definition instead of the GPU.
    """

    viewing: Viewing
    start: Start = field(default_factory=Start)
    cut: Cut = "keep"
    cuts: Collection[float] = ()
    stills: bool = False
    fps: float | None = None
    across: float | None = None  # width in degrees; None: what the frames say
    states: Path | None = None
    log: Path | None = None  # table of what the eye went through, CSV
    plot: Path | None = None
    video: Path | None = None
    resume: bool = False
    reference: bool = False

    def course(self) -> Course:
        """The eye before the first frame."""
        return Course(self.viewing.operator, self.start, self.cut, self.cuts)

    def setup(self) -> dict[str, Any]:
        """All that states depend on beside the frames, as JSON has it."""
        viewing, start = self.viewing, self.start
        return {
            **viewing.setup(),
            "start": asdict(start),
            "cut": self.cut,
            "cuts": sorted(self.cuts),
            "fps": self.fps,
            "across": self.across,
        }


@dataclass(frozen=True, slots=True)
class Seen:
    """A frame of a sequence. ``shown`` is None where its picture was there already."""

    frame: float
    file: Path
    time: float
    moment: Moment | None
    shown: Shown | None


def tonemap_sequence(
    jobs: Sequence[tuple[float, Path, Path]], showing: Showing, report: Report
) -> Iterator[Seen]:
    """Frames (number, EXR, PNG) become pictures, in the order in which they are seen.

    A frame whose picture is there is skipped with ``resume``; the eye goes on from the state
    that is known before the first one that is not, so that pictures are what they are
    without a break. A file that does not say what its numbers are is taken as Rec. 709 in
    cd/m2, a finding. Raises InputError, ContextError.
    """
    operator = showing.viewing.operator
    in_time = operator.advance is not None and not showing.stills
    states = None
    if in_time and showing.states is not None:
        states = Checkpoints(showing.states, operator.name, showing.setup())
        if showing.resume:
            states.load()
    course = showing.course()
    begin = 0
    if in_time and showing.resume:
        done = [target.is_file() for _, _, target in jobs]
        begin = first_to_see([frame for frame, _, _ in jobs], done, course, states)
    eye: _Eye | None = None
    camera: Any = None
    if 0 < begin < len(jobs):
        camera = read_exr_header(jobs[begin - 1][1]).get("hdrusd:camera")
    clock = _Clock(showing.fps, report if in_time and len(jobs) > 1 else Report())
    with Reader() as reader, Writer() as writer, _by_products(jobs, showing) as beside:
        try:
            for index, (frame, source, target) in enumerate(jobs):
                there = showing.resume and target.is_file()
                if index < begin or (there and not in_time):
                    beside.add(frame, math.nan, None, None, target)
                    yield Seen(frame, target, math.nan, None, None)
                    continue
                eye = eye or _Eye(showing, course)
                rgb, header, layers = reader.read(source, _next_source(jobs, index, showing))
                _note_units(source, header, report)
                time = clock.time(frame, source, header)
                if camera not in (None, header.get("hdrusd:camera")):
                    course.cuts |= {frame}
                camera = header.get("hdrusd:camera")
                angles = field_of(header, rgb.shape[1], rgb.shape[0], showing.across)
                rods = layers.get("scotopic.Y") if showing.viewing.night_colour else None
                pixels = rgb if rods is None else with_rods(rgb, rods)
                sight = Sight(time, frame, angles, rods=rods is not None)
                moment, shown = eye.look(pixels, sight, picture=not there)
                if states is not None:
                    states.keep(frame, time, moment.state)
                beside.add(frame, time, moment, shown.picture if shown else None, target)
                if shown is not None:
                    writer.submit(write_png, target, shown.picture, pq=deep(shown.moment.screen))
                yield Seen(frame, target, time, moment, shown)
        finally:
            if states is not None:
                states.save()
            if eye is not None:
                eye.release()


def _next_source(
    jobs: Sequence[tuple[float, Path, Path]], index: int, showing: Showing
) -> Path | None:
    """The file that will be read after that of a job."""
    every = not showing.resume or (showing.viewing.operator.advance and not showing.stills)
    later = range(index + 1, len(jobs))
    return next((jobs[i][1] for i in later if every or not jobs[i][2].is_file()), None)


def _by_products(jobs: Sequence[tuple[float, Path, Path]], showing: Showing) -> ByProducts:
    operator = showing.viewing.operator
    fps = showing.fps
    if fps is None and showing.video is not None:
        fps = rate_of(read_exr_header(jobs[0][1]))
    return ByProducts(
        operator,
        csv=None if operator.advance is None or showing.stills else showing.log,
        plot=showing.plot,
        video=showing.video,
        fps=playback_rate(fps or DEFAULT_FPS, [frame for frame, _, _ in jobs]),
        # The other part of a split sequence has its lines there too.
        resume=showing.resume or showing.start.state is not None,
    )


def first_to_see(
    frames: Sequence[float], done: Sequence[bool], course: Course, states: Checkpoints | None
) -> int:
    """Index of the frame with which an interrupted sequence goes on.

    That after the latest known state before the first frame that is not ``done``; ``course`` then
    has this state. Without one, 0; where all is done, past the end.
    """
    missing = next((i for i, there in enumerate(done) if not there), len(done))
    if missing == len(done):
        return missing
    for index in range(missing - 1, -1, -1):
        if states is not None and (known := states.states.get(frames[index])) is not None:
            course.resume(known[1], known[0])
            return index + 1
    return 0


class _Eye:
    """Eye or ReferenceEye for frames from files; a new one for each still."""

    def __init__(self, showing: Showing, course: Course) -> None:
        self.showing = showing
        self._numpy: ReferenceEye | None = None
        self._gpu: Eye | None = None
        if showing.reference:
            self._numpy = ReferenceEye(showing.viewing, course)
        else:
            ctx = create_context()
            self._gpu = Eye(ctx, Programs(ctx), showing.viewing, course)

    def look(
        self, rgb: np.ndarray[Any, Any], sight: Sight, *, picture: bool
    ) -> tuple[Moment, Shown | None]:
        eye = self._numpy or self._gpu
        assert eye is not None
        if self.showing.stills:
            eye.course = self.showing.course()
        if not picture:
            return eye.see_array(rgb, sight), None
        shown = eye.show_array(rgb, sight)
        return shown.moment, shown

    def release(self) -> None:
        if self._gpu is not None:
            self._gpu.release()


class _Clock:
    """Seconds of frames by their numbers and what the first of them says."""

    def __init__(self, fps: float | None, report: Report) -> None:
        self.fps = fps
        self.report = report

    def time(self, frame: float, source: Path, header: Mapping[str, Any]) -> float:
        if self.fps is None:
            self.fps = rate_of(header)
            if self.fps is None:
                self.fps = DEFAULT_FPS
                text = f"no rate; {DEFAULT_FPS:g} frames a second are assumed, see --fps"
                self.report.add(Kind.ASSUMED, "exr-rate", SourceRef(source), "", text)
        number = header.get("hdrusd:frame")
        known = isinstance(number, (int, float)) and math.isfinite(number)
        return (float(number) if known else frame) / self.fps  # type: ignore[arg-type]


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


class Reader:
    """One thread that reads the next frame while the caller works on this one.

    What cannot be read is raised when its turn comes, not before. Leaving the block waits for the
    frame in hand.
    """

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, "hdrusd-reader")
        self._ahead: tuple[Path, Future[_Layers]] | None = None

    def __enter__(self) -> Reader:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def read(self, source: Path, ahead: Path | None = None) -> _Layers:
        """``read_exr_layers`` of ``source``; then ``ahead`` is read, and kept for the next call."""
        found, self._ahead = self._ahead, None
        if found is None or found[0] != source:
            found = source, self._pool.submit(read_exr_layers, source)
        result = found[1].result()
        if ahead is not None:
            self._ahead = ahead, self._pool.submit(read_exr_layers, ahead)
        return result


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
