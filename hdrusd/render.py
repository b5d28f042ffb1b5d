"""A stage becomes frames: ``render_sequence``, HDR in cd/m2 and what a display shows of it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt
from pxr import Tf, UsdGeom

from hdrusd.by_products import ByProducts, playback_rate
from hdrusd.course import Checkpoints, Course, Known, note_cuts, state_text
from hdrusd.display import first_to_see
from hdrusd.errors import HdrusdError, InputError, SourceRef
from hdrusd.eye.mesopic import mesopic_layer
from hdrusd.eye.scotopic import scotopic
from hdrusd.eye.screen import Screen
from hdrusd.frame_header import field_of_view, lamps_text
from hdrusd.frame_io import Writer
from hdrusd.frames import frame_path
from hdrusd.glare.dazzling import most_dazzling
from hdrusd.gpu.hdr import HdrRenderer, Options
from hdrusd.gpu.ldr import deep
from hdrusd.gpu.program import Programs
from hdrusd.images import half_clipped, write_exr, write_png
from hdrusd.job import Job
from hdrusd.photometry.eye_illuminance import eye_illuminance
from hdrusd.photometry.scotopic_light import scotopic_scene
from hdrusd.report import Kind, Report
from hdrusd.resuming import VIEWING, check_frames, check_pictures, viewing_text
from hdrusd.scene import Camera, Doubles, RenderScene
from hdrusd.tonemap.operator import DEFAULT_OPERATOR, OPERATORS, Moment, Operator
from hdrusd.usd.extract import StageReader
from hdrusd.usd.opening import one_line_of, open_stage, usd_warnings
from hdrusd.usd.settings import read_settings
from hdrusd.usd.textures import TextureLoader
from hdrusd.viewing import (
    Eye,
    Sight,
    Viewing,
    note_glare,
    reads_screen,
    with_exposure,
    with_rods,
)

#: Width of a picture that neither the stage nor the user sizes (usdrecord's).
DEFAULT_WIDTH = 960

#: The largest picture; OpenGL 3.3 grants no more on many devices.
MAX_SIZE = 16384


@dataclass(frozen=True, slots=True)
class Frame:
    """One rendered moment."""

    time: float
    hdr: npt.NDArray[np.float32]  # (h, w, 3) cd/m2, top row first
    ldr: npt.NDArray[Any] | None  # (h, w, 3) code values
    moment: Moment | None  # what the eye made of it, where there is a picture
    camera: Camera
    files: tuple[Path, ...] = ()
    skipped: bool = False
    light_error: float = 0.0  # bound of merging lamps (HdrRenderer.light_error); 0: each alone
    layers: Mapping[str, npt.NDArray[np.float32]] = field(default_factory=dict)  # (h, w)
    lamps: npt.NDArray[np.float64] = field(
        default_factory=lambda: np.zeros((0, 6))
    )  # glare/veil.py


class Renderer:
    """A stage and a device; frames in any order."""

    def __init__(self, ctx: moderngl.Context, job: Job, report: Report) -> None:
        self.job = job
        self.report = report
        self.stage = open_stage(job.stage, job.mask, job.session_layer, report, job.variants)
        self.settings = read_settings(self.stage, job.settings)
        self.reader = StageReader(
            self.stage,
            report,
            purposes=job.purposes,
            default_sky=job.default_sky,
            level=job.level,
            gamma=job.gamma,
        )
        self.camera_path = job.camera or self.settings.camera
        self.size = self._size()
        limit = int(ctx.info["GL_MAX_TEXTURE_SIZE"])
        self.textures = TextureLoader(job.stage, report, limit)
        programs = Programs(ctx)
        try:
            self.hdr = HdrRenderer(
                ctx,
                programs,
                self.size,
                self.textures,
                Options(
                    reflection=job.reflection,
                    gamma=job.gamma,
                    samples=job.samples,
                    shadows=job.shadows,
                    lights=job.lights,
                    sky_samples=job.sky_samples,
                ),
                report,
                SourceRef(job.stage),
            )
        except moderngl.Error as problem:
            width, height = self.size
            raise HdrusdError(
                f"{width} x {height} pixels: too large for this device ({problem})"
            ) from problem
        self._told_lamps = False
        self.viewing = self._viewing()
        self.eye: Eye | None = None
        if self.viewing is not None:
            note_glare(self.viewing, SourceRef(job.stage), report)
            note_cuts(job.cuts, self.times, SourceRef(job.stage), report)
            course = Course(self.viewing.operator, job.start, job.cut, job.cuts)
            self.eye = Eye(ctx, programs, self.viewing, course)

    @property
    def times(self) -> Sequence[float]:
        """The job's time codes, or the stage's start."""
        return self.job.times if self.job.times is not None else [self.stage.GetStartTimeCode()]

    def seconds(self, time: float) -> float:
        """When a time code is, in s; the default time is 0."""
        return time / self.stage.GetTimeCodesPerSecond() if math.isfinite(time) else 0.0

    def frame(self, time: float) -> Frame:
        """Render one time code (NaN: the default time). Raises InputError."""
        with usd_warnings(self.job.stage, self.report):
            try:
                return self._frame(time)
            except Tf.ErrorException as problem:
                text = f"frame {time:g}: {one_line_of(problem)}"
                raise InputError(self.job.stage, text) from problem

    def known(self, frame: Frame) -> Known:
        """The state of the eye after a frame that it saw."""
        state = None if frame.moment is None else frame.moment.state
        return Known(self.seconds(frame.time), state, frame.camera.name)

    def release(self) -> None:
        """Free what is on the GPU."""
        if self.eye is not None:
            self.eye.release()
        self.hdr.release()
        self.hdr.programs.release()

    def _frame(self, time: float) -> Frame:
        width, height = self.size
        camera = self.reader.camera(self.camera_path, time, width / height, self.settings.conform)
        self._check_camera(camera)
        scene = self.reader.read(time, camera, sky_visible=self.job.sky_visible)
        rods = self._rods(scene)
        texture = self.hdr.render(scene)
        self.textures.publish()
        hdr, moment, ldr = self.hdr.read(), None, None
        lamps = self._lamps(scene, hdr)
        if self.eye is not None and self.viewing is not None:
            sight = self._sight(self.viewing, camera, time, lamps)
            if rods is not None and self.viewing.night_colour:
                shown = self.eye.show_array(with_rods(hdr, rods), replace(sight, rods=True))
            else:
                shown = self.eye.show(texture, sight)
            moment, ldr = shown.moment, shown.picture
        error, layers = self.hdr.light_error, self._layers(hdr, rods)
        return Frame(time, hdr, ldr, moment, camera, light_error=error, layers=layers, lamps=lamps)

    def _lamps(self, scene: RenderScene, hdr: npt.NDArray[np.float32]) -> Doubles:
        """Lamps that the frame does not hold (glare/veil.py): beside it, or below a pixel."""
        small, pixels, owner = self.hdr.small_lamps(hdr)
        found = most_dazzling(np.concatenate([small, eye_illuminance(scene)]), pixels, owner)
        if (found.merged or found.pixels) and not self._told_lamps:
            self._told_lamps = True
            text = (
                f"{found.merged} lamps below a pixel or beside the frame veil it together, with "
                f"all their light, each within {found.within:.2g} degrees of where it stands"
            )
            if found.pixels:
                text += f"; {found.pixels} pixels that show lamps count beside them"
            self.report.add(Kind.ASSUMED, "glare-lamps", SourceRef(self.job.stage), "", text)
        return found.rows

    def _sight(self, viewing: Viewing, camera: Camera, time: float, lamps: Doubles) -> Sight:
        """What the eye has to know of a frame."""
        return Sight(
            self.seconds(time),
            time if math.isfinite(time) else 0.0,
            field_of_view(camera),
            with_exposure(viewing, camera.exposure_scale),
            lamps,
            camera=camera.name,
        )

    def _rods(self, scene: RenderScene) -> npt.NDArray[np.float32] | None:
        """Scotopic luminance (h, w) by a frame of its own; None where no lamp states its S/P.

        Nor where nobody asks for it.
        """
        job, viewing = self.job, self.viewing
        wanted = job.scotopic or job.mesopic or (viewing is not None and viewing.night_colour)
        second = scotopic_scene(scene) if wanted else None
        if second is None:
            return None
        self.hdr.render(second)
        return scotopic(self.hdr.read()).astype(np.float32)

    def _layers(
        self, hdr: npt.NDArray[np.float32], rods: npt.NDArray[np.float32] | None
    ) -> dict[str, npt.NDArray[np.float32]]:
        """What the job wants beside RGB; without ``rods`` by the colours of the frame."""
        layers = {}
        if self.job.scotopic:
            layers["scotopic.Y"] = scotopic(hdr).astype(np.float32) if rods is None else rods
        if self.job.mesopic:
            layers["mesopic.Y"] = mesopic_layer(hdr, rods)
        return layers

    def _check_camera(self, camera: Camera) -> None:
        """A camera that sees nothing would give black frames, silently."""
        left, right, bottom, top = camera.window
        numbers = (*camera.eye, *camera.right, *camera.up, *camera.window, camera.near, camera.far)
        if not (all(map(math.isfinite, numbers)) and left < right and bottom < top):
            raise InputError(
                self.job.stage,
                f"{camera.name}: sees nothing; want finite numbers, film and focal length above 0",
            )

    def _viewing(self) -> Viewing | None:
        """The user's, else the stage's, else Reinhard's; None where no picture is asked for."""
        job, settings = self.job, self.settings
        if job.operator is None and job.png is None:
            return None
        operator = job.operator or OPERATORS[settings.operator or DEFAULT_OPERATOR]
        operator.check(job.parameters)
        screen = job.screen or Screen()
        if job.screen is None and (settings.peak is not None or settings.black is not None):
            peak = screen.peak if settings.peak is None else settings.peak
            black = screen.black if settings.black is None else settings.black
            screen = replace(screen, name="stage", peak=peak, black=black)
            if not reads_screen(operator, job.parameters):
                text = f"display peak and black are recorded; {operator.name} does not read them"
                self.report.add(Kind.DROPPED, "display-unused", SourceRef(job.stage), "", text)
        return Viewing(
            operator,
            self._parameters(operator),
            job.observer,
            screen,
            job.glare,
            job.acuity,
            job.night_colour,
        )

    def _parameters(self, operator: Operator) -> dict[str, Any]:
        """The user's, else the stage's for this operator."""
        given = dict(self.job.parameters)
        names = {parameter.name for parameter in operator.parameters}
        if self.settings.operator == operator.name:
            for name, value in (("key", self.settings.key), ("white", self.settings.white)):
                if name in names and value is not None:
                    given.setdefault(name, value)
        return given

    def _size(self) -> tuple[int, int]:
        job, settings = self.job, self.settings
        if job.width is None and job.height is None and settings.resolution is not None:
            width, height = settings.resolution
        else:
            aspect = self._aspect()
            width = job.width or (round(job.height * aspect) if job.height else DEFAULT_WIDTH)
            height = job.height or max(round(width / aspect), 1)
        if not (1 <= width <= MAX_SIZE and 1 <= height <= MAX_SIZE):
            raise InputError(self.job.stage, f"{width} x {height} pixels; want 1 to {MAX_SIZE}")
        return width, height

    def _aspect(self) -> float:
        """Of the picture: the settings' resolution, else the camera's film."""
        if self.settings.resolution is not None and self.settings.resolution[1] > 0:
            return self.settings.resolution[0] / self.settings.resolution[1]
        prim = self.reader.camera_prim(self.camera_path)
        if prim is None:
            return 16.0 / 9.0
        camera = UsdGeom.Camera(prim)
        width = float(camera.GetHorizontalApertureAttr().Get())
        height = float(camera.GetVerticalApertureAttr().Get())
        return width / height if width > 0.0 and height > 0.0 else 16.0 / 9.0


def render_sequence(ctx: moderngl.Context, job: Job, report: Report) -> Iterator[Frame]:
    """Render and write the frames of a job, in order.

    Encoding overlaps rendering: a thread writes while the next frame is drawn. With ``resume``
    a frame whose files are all there is skipped; an eye in time goes on from the state that is
    known before the first one that is not (``first_to_see``).
    """
    renderer = Renderer(ctx, job, report)
    outputs = [
        (time, tuple(frame_path(p, time) for p in (job.exr, job.png) if p is not None))
        for time in renderer.times
    ]
    states = _checkpoints(renderer)
    if job.resume:
        done = [file for _, files in outputs if _all_there(files) for file in files]
        check_frames(done, _drawn(job), renderer.size, report)
        check_pictures(done, renderer.viewing.setup() if renderer.viewing else {}, report)
    begin, eye = 0, renderer.eye
    in_time = eye is not None and eye.course.operator.advance is not None
    if job.resume and in_time and eye is not None:
        there_yet = [_all_there(files) for _, files in outputs]
        begin = first_to_see(renderer.times, there_yet, eye.course, states)
    with Writer() as writer, _by_products(renderer) as beside:
        try:
            for index, (time, files) in enumerate(outputs):
                there = job.resume and _all_there(files)
                if index < begin or (there and not in_time):
                    blank = np.zeros((0, 0, 3), np.float32)
                    beside.add(
                        time, renderer.seconds(time), None, None, files[-1] if files else None
                    )
                    yield Frame(time, blank, None, None, Camera(), files, skipped=True)
                    continue
                frame = renderer.frame(time)
                last = files[-1] if files else None
                beside.add(time, renderer.seconds(time), frame.moment, frame.ldr, last)
                if states is not None:
                    states.keep(time, renderer.known(frame))
                if not there:
                    _write(renderer, frame, writer)
                yield replace(frame, files=files, skipped=there)
        finally:
            if states is not None:
                states.save()
            renderer.release()


def _by_products(renderer: Renderer) -> ByProducts:
    job, viewing = renderer.job, renderer.viewing
    if viewing is None:
        return ByProducts(None)
    in_time = viewing.operator.advance is not None
    return ByProducts(
        viewing.operator,
        csv=job.log if in_time else None,
        plot=job.plot,
        video=job.video,
        fps=playback_rate(renderer.stage.GetTimeCodesPerSecond(), renderer.times),
        resume=job.resume or job.start.file is not None,
        screen=viewing.screen,
    )


def _all_there(files: Sequence[Path]) -> bool:
    return bool(files) and all(file.is_file() for file in files)


def _checkpoints(renderer: Renderer) -> Checkpoints | None:
    """Where the states of the eye are kept; None for one without states."""
    job, viewing = renderer.job, renderer.viewing
    if viewing is None or viewing.operator.advance is None or job.states is None:
        return None
    setup = {
        **viewing.setup(),
        "stage": job.stage.name,
        "camera": str(renderer.camera_path),
        "size": list(renderer.size),
        "start": asdict(job.start),
        "cut": job.cut,
        "cuts": sorted(job.cuts),
    }
    states = Checkpoints(job.states, viewing.operator.name, setup)
    if job.resume or job.start.file is not None:
        states.load(job.resume)
    return states


def _write(renderer: Renderer, frame: Frame, writer: Writer) -> None:
    job = renderer.job
    if job.exr is not None:
        path, header = frame_path(job.exr, frame.time), exr_header(renderer, frame)
        if job.half and (clipped := half_clipped(frame.hdr)):
            text = f"{clipped} pixels are clipped at 65504 cd/m2, where half floats end"
            renderer.report.add(Kind.CLAMPED, "half-clipped", SourceRef(path), "", text)
        writer.submit(
            write_exr,
            path,
            frame.hdr,
            header,
            half=job.half,
            compression=job.compression,
            layers=frame.layers,
        )
    if job.png is not None and frame.ldr is not None:
        path = frame_path(job.png, frame.time)
        pq = frame.moment is not None and deep(frame.moment.screen)
        texts = {VIEWING: viewing_text(renderer.viewing.setup())} if renderer.viewing else None
        writer.submit(write_png, path, frame.ldr, pq=pq, texts=texts)


def _drawn(job: Job) -> dict[str, Any]:
    """What of a frame's header is the same for all of a job."""
    return {
        "hdrusd:reflection": job.reflection,
        "hdrusd:stage": job.stage.name,
        "hdrusd:shadows": "maps" if job.shadows else "none",
        "hdrusd:samples": job.samples,
        "hdrusd:skySamples": job.sky_samples,
    }


def exr_header(renderer: Renderer, frame: Frame) -> dict[str, Any]:
    """What a frame says about itself.

    Time, camera matrices (row vectors, metres), reflection; how lights were added: "exact" or
    "merged" with the bound of its error, shadows, samples a pixel and of the sky.
    """
    camera, stage, job = frame.camera, renderer.stage, renderer.job
    view = camera.world_to_view()
    ndc = view @ camera.projection()
    header: dict[str, Any] = {
        "worldToCamera": view.astype(np.float32),
        "worldToNDC": ndc.astype(np.float32),
        "hdrusd:timeCodesPerSecond": float(stage.GetTimeCodesPerSecond()),
        "hdrusd:camera": camera.name,
        "hdrusd:lights": "merged" if frame.light_error else "exact",
        "hdrusd:lightErrorBound": frame.light_error,
        **_drawn(job),
    }
    if math.isfinite(frame.time):  # the default time is no number
        header["hdrusd:frame"] = float(frame.time)
    if frame.moment is not None and frame.moment.state is not None and renderer.viewing is not None:
        number = frame.time if math.isfinite(frame.time) else 0.0
        known = renderer.known(frame)
        header["hdrusd:state"] = state_text(renderer.viewing.operator, number, known)
    if len(frame.lamps):
        header["hdrusd:lamps"] = lamps_text(frame.lamps)
    if camera.exposure_scale is not None:
        header["hdrusd:exposureScale"] = float(camera.exposure_scale)
    return header
