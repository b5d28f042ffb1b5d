"""The second half alone: frames in cd/m2 become pictures for a display, an eye between them."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hdrusd.by_products import ByProducts, playback_rate
from hdrusd.course import Checkpoints, Course, Cut, Known, Start, note_cuts
from hdrusd.errors import SourceRef
from hdrusd.frame_header import (
    DEFAULT_FPS,
    Clock,
    camera_of,
    exposure_of,
    field_of,
    lamps_of,
    note_broken,
    note_units,
    number_of,
    rate_of,
)
from hdrusd.frame_io import Reader, Writer
from hdrusd.gpu.context import create_context
from hdrusd.gpu.ldr import deep
from hdrusd.gpu.program import Programs
from hdrusd.images import read_exr_header, write_png
from hdrusd.input_file import check_input
from hdrusd.report import Report
from hdrusd.resuming import VIEWING, check_pictures, viewing_text
from hdrusd.tonemap.operator import Moment
from hdrusd.viewing import (
    Eye,
    ReferenceEye,
    Shown,
    Sight,
    Viewing,
    note_glare,
    with_exposure,
    with_rods,
)


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
    across: float | None = None  # width in degrees; None: what the frames say, or the screen
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
    for _, source, _ in jobs:  # before anything of an earlier run is written anew
        check_input(source)
    place = SourceRef(jobs[0][1])
    note_glare(showing.viewing, place, report)
    note_cuts(showing.cuts, [frame for frame, _, _ in jobs], place, report)
    operator = showing.viewing.operator
    in_time = operator.advance is not None and not showing.stills
    states = None
    if in_time and showing.states is not None:
        states = Checkpoints(showing.states, operator.name, showing.setup())
        if showing.resume or showing.start.file is not None:
            states.load(showing.resume)
    course = showing.course()
    setup = showing.viewing.setup()
    texts = {VIEWING: viewing_text(setup)}
    if showing.resume:
        there_already = (target for _, _, target in jobs if target.is_file())
        check_pictures(there_already, setup, report)
    begin = 0
    if in_time and showing.resume:
        done = [target.is_file() for _, _, target in jobs]
        begin = first_to_see([frame for frame, _, _ in jobs], done, course, states)
    eye: _Eye | None = None
    clock = Clock(showing.fps, report if in_time and len(jobs) > 1 else Report())
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
                note_units(source, header, report)
                note_broken(source, rgb, report)
                # A name's number is the sequence's; a single picture has only its own.
                number = frame if len(jobs) > 1 else number_of(header) or frame
                rods = layers.get("scotopic.Y") if showing.viewing.night_colour else None
                sight = Sight(
                    clock.time(number, source, header),
                    frame,
                    field_of(header, rgb.shape[1], rgb.shape[0], showing.across),
                    with_exposure(showing.viewing, exposure_of(header)),
                    lamps_of(header),
                    rods is not None,
                    camera_of(header),
                )
                pixels = rgb if rods is None else with_rods(rgb, rods)
                moment, shown = eye.look(pixels, sight, picture=not there)
                beside.add(frame, sight.time, moment, shown.picture if shown else None, target)
                if states is not None:
                    states.keep(frame, Known(sight.time, moment.state, sight.camera))
                if shown is not None:
                    pq = deep(shown.moment.screen)
                    writer.submit(write_png, target, shown.picture, pq=pq, texts=texts)
                yield Seen(frame, target, sight.time, moment, shown)
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
        resume=showing.resume or showing.start.file is not None,
        screen=showing.viewing.screen,
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
            course.resume(known)
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
