"""A stage becomes frames: ``render_sequence``, HDR in cd/m2 and what a display shows of it."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt
from pxr import Sdf, Tf, Usd, UsdGeom, UsdUtils

from hdrusd.display import Display, Writer
from hdrusd.errors import HdrusdError, InputError, SourceRef
from hdrusd.frames import frame_path
from hdrusd.gpu.hdr import HdrRenderer, Options, Reflection
from hdrusd.gpu.lights import LightMode
from hdrusd.gpu.program import Programs
from hdrusd.images import Compression, half_clipped, write_exr, write_png
from hdrusd.report import Kind, Report
from hdrusd.scene import Camera
from hdrusd.tonemap.operator import DEFAULT_OPERATOR, OPERATORS, Operator, Parameters, Statistics
from hdrusd.units import TEXTURE_GAMMA
from hdrusd.usd.extract import StageReader
from hdrusd.usd.settings import read_settings
from hdrusd.usd.textures import TextureLoader
from hdrusd.usd.variants import select_variants

#: Width of a picture that neither the stage nor the user sizes (usdrecord's).
DEFAULT_WIDTH = 960

#: The largest picture; OpenGL 3.3 grants no more on many devices.
MAX_SIZE = 16384


@dataclass(frozen=True, slots=True)
class Job:
    """What to render. ``exr`` and ``png`` are file name patterns, either may be None."""

    stage: Path
    times: Sequence[float] | None = None  # None: the stage's start
    exr: str | None = None
    png: str | None = None
    camera: str | None = None
    width: int | None = None
    height: int | None = None
    operator: Operator | None = None  # None: the stage's, where a PNG is asked for
    parameters: Parameters = field(default_factory=dict)
    reflection: Reflection = "lambert"
    gamma: float = TEXTURE_GAMMA
    purposes: Sequence[str] = ("render",)
    mask: Sequence[str] = ()
    variants: Sequence[str] = ()  # PRIM:SET=NAME each
    level: int = 0  # refinements of subdivision cages and curves
    session_layer: Path | None = None
    settings: str | None = None  # path of a RenderSettings prim
    default_sky: bool = True
    sky_visible: bool = False
    samples: int = 1  # a pixel
    shadows: bool = True
    lights: LightMode = "auto"
    sky_samples: int = 0  # directions in which the sky may be hidden; 0: it is seen everywhere
    half: bool = False
    compression: Compression = "zip"
    resume: bool = False


@dataclass(frozen=True, slots=True)
class Frame:
    """One rendered moment."""

    time: float
    hdr: npt.NDArray[np.float32]  # (h, w, 3) cd/m2, top row first
    ldr: npt.NDArray[np.uint8] | None  # (h, w, 3) sRGB
    statistics: Statistics | None
    camera: Camera
    files: tuple[Path, ...] = ()
    skipped: bool = False
    light_error: float = 0.0  # bound of merging lamps (HdrRenderer.light_error); 0: each alone


def open_stage(
    path: Path,
    mask: Sequence[str] = (),
    session: Path | None = None,
    report: Report | None = None,
    variants: Sequence[str] = (),
) -> Usd.Stage:
    """Open a stage, all of it or what ``mask`` names, with these ``variants`` (PRIM:SET=NAME).

    ``report``: takes what USD warns of (arcs that lead nowhere or in a circle), which
    otherwise goes to standard error. Raises InputError.
    """
    paths = [_mask_path(path, name) for name in mask]
    root, over = _layer(path), None if session is None else _layer(session)
    if variants:  # over the user's session layer, which is a file and stays as it is
        choices = Sdf.Layer.CreateAnonymous("session.usda")
        choices.subLayerPaths = [] if over is None else [over.identifier]
        over = choices
    layers = [root, over] if over is not None else [root]
    with usd_warnings(path, report):
        try:
            if mask:
                stage = Usd.Stage.OpenMasked(*layers, Usd.StagePopulationMask(paths))
            else:
                stage = Usd.Stage.Open(*layers)
        except Tf.ErrorException as problem:
            raise InputError(path, f"not a USD stage ({_one_line(problem)})") from problem
        select_variants(stage, variants, SourceRef(path))
    for target in paths:
        if report is not None and not stage.GetPrimAtPath(target):
            report.add(Kind.MISSING, "mask", SourceRef(path), str(target), "no such prim")
    return stage


@contextlib.contextmanager
def usd_warnings(path: Path, report: Report | None) -> Iterator[None]:
    """What USD warns of within the block becomes findings of the stage at ``path``."""
    if report is None:
        yield
        return
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        for said in delegate.TakeUncoalescedDiagnostics():
            report.add(Kind.INVALID, "usd-warning", SourceRef(path), "", _warning(said.commentary))


def _layer(path: Path) -> Sdf.Layer:
    if not path.is_file():
        raise InputError(path, "no such file")
    try:
        layer = Sdf.Layer.FindOrOpen(str(path))
    except Tf.ErrorException as problem:
        raise InputError(path, f"not a USD layer ({_one_line(problem)})") from problem
    if layer is None:
        raise InputError(path, "not a USD layer")
    return layer


def _mask_path(stage: Path, name: str) -> Sdf.Path:
    path = Sdf.Path(name) if Sdf.Path.IsValidPathString(name) else Sdf.Path()
    if not (path.IsAbsolutePath() and path.IsAbsoluteRootOrPrimPath()):
        raise InputError(stage, f"--mask {name}: no prim path; want one like /World/Street")
    return path


def _warning(text: str) -> str:
    """A warning of USD in one line, without addresses of this process and how it came up."""
    text = re.sub(r"@anon:[^@]*@|\(instantiating stage on stage [^)]*\)", "", text)
    return " ".join(text.split())[:300]


def _one_line(problem: Exception) -> str:
    """The first sentence that USD says, without its C++ places."""
    lines = [line.strip() for line in str(problem).splitlines() if "Error in" in line]
    text = lines[0].rpartition(" : ")[2] if lines else str(problem)
    return " ".join(text.split())[:200].strip("' ")


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
        operator = self._operator()
        self.display = Display(ctx, programs, operator) if operator is not None else None

    @property
    def times(self) -> Sequence[float]:
        """The job's time codes, or the stage's start."""
        return self.job.times if self.job.times is not None else [self.stage.GetStartTimeCode()]

    def frame(self, time: float) -> Frame:
        """Render one time code (NaN: the default time). Raises InputError."""
        with usd_warnings(self.job.stage, self.report):
            try:
                return self._frame(time)
            except Tf.ErrorException as problem:
                text = f"frame {time:g}: {_one_line(problem)}"
                raise InputError(self.job.stage, text) from problem

    def _frame(self, time: float) -> Frame:
        width, height = self.size
        camera = self.reader.camera(self.camera_path, time, width / height, self.settings.conform)
        self._check_camera(camera)
        scene = self.reader.read(time, camera, sky_visible=self.job.sky_visible)
        texture = self.hdr.render(scene)
        self.textures.publish()
        statistics, ldr = None, None
        if self.display is not None:
            parameters = self._parameters(self.display.operator, camera)
            ldr, statistics = self.display.show(texture, parameters)
        error = self.hdr.light_error
        return Frame(time, self.hdr.read(), ldr, statistics, camera, light_error=error)

    def _check_camera(self, camera: Camera) -> None:
        """A camera that sees nothing would give black frames, silently."""
        left, right, bottom, top = camera.window
        numbers = (*camera.eye, *camera.right, *camera.up, *camera.window, camera.near, camera.far)
        if not (all(map(math.isfinite, numbers)) and left < right and bottom < top):
            raise InputError(
                self.job.stage,
                f"{camera.name}: sees nothing; want finite numbers, film and focal length above 0",
            )

    def _operator(self) -> Operator | None:
        """The user's, else the stage's, else Reinhard's; None where no picture is asked for."""
        job, settings = self.job, self.settings
        if job.operator is not None or job.png is None:
            return job.operator
        operator = OPERATORS[settings.operator or DEFAULT_OPERATOR]
        operator.check(job.parameters)
        if settings.peak is not None or settings.black is not None:
            text = f"display peak and black are recorded; {operator.name} does not read them"
            self.report.add(Kind.DROPPED, "display-unused", SourceRef(job.stage), "", text)
        return operator

    def _parameters(self, operator: Operator, camera: Camera) -> dict[str, Any]:
        """The user's, else the stage's for this operator, else the camera's exposure."""
        given = dict(self.job.parameters)
        names = {parameter.name for parameter in operator.parameters}
        if self.settings.operator == operator.name:
            for name, value in (("key", self.settings.key), ("white", self.settings.white)):
                if name in names and value is not None:
                    given.setdefault(name, value)
        if {"scale", "ev100"} <= names and not {"scale", "ev100"} & given.keys():
            given["scale"] = camera.exposure_scale
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

    Encoding overlaps rendering: a thread writes while the next frame is drawn.
    With ``resume`` a frame whose files are all there is skipped.
    """
    renderer = Renderer(ctx, job, report)
    with Writer() as writer:
        for time in renderer.times:
            files = tuple(frame_path(p, time) for p in (job.exr, job.png) if p is not None)
            if job.resume and files and all(file.is_file() for file in files):
                blank = np.zeros((0, 0, 3), np.float32)
                yield Frame(time, blank, None, None, Camera(), files, skipped=True)
                continue
            frame = renderer.frame(time)
            if job.exr is not None:
                path, header = frame_path(job.exr, time), exr_header(renderer, frame)
                if job.half and (clipped := half_clipped(frame.hdr)):
                    text = f"{clipped} pixels are clipped at 65504 cd/m2, where half floats end"
                    report.add(Kind.CLAMPED, "half-clipped", SourceRef(path), "", text)
                writer.submit(
                    write_exr,
                    path,
                    frame.hdr,
                    header,
                    half=job.half,
                    compression=job.compression,
                )
            if job.png is not None and frame.ldr is not None:
                writer.submit(write_png, frame_path(job.png, time), frame.ldr)
            yield replace(frame, files=files)


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
        "hdrusd:reflection": job.reflection,
        "hdrusd:stage": job.stage.name,
        "hdrusd:lights": "merged" if frame.light_error else "exact",
        "hdrusd:lightErrorBound": frame.light_error,
        "hdrusd:shadows": "maps" if job.shadows else "none",
        "hdrusd:samples": job.samples,
        "hdrusd:skySamples": job.sky_samples,
    }
    if math.isfinite(frame.time):  # the default time is no number
        header["hdrusd:frame"] = float(frame.time)
    if camera.exposure_scale is not None:
        header["hdrusd:exposureScale"] = float(camera.exposure_scale)
    return header
