"""What to render, and how it is looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hdrusd.course import Cut, Start
from hdrusd.eye.observer import Observer
from hdrusd.eye.screen import Screen
from hdrusd.glare.model import GlareModel
from hdrusd.gpu.hdr import Reflection
from hdrusd.gpu.lights import LightMode
from hdrusd.images import Compression
from hdrusd.tonemap.operator import Operator, Parameters
from hdrusd.units import TEXTURE_GAMMA


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
    observer: Observer = field(default_factory=Observer)
    glare: GlareModel | None = None
    acuity: bool = False
    night_colour: bool = False
    screen: Screen | None = None  # None: the stage's peak and black, else Screen's own
    start: Start = field(default_factory=Start)
    cut: Cut = "keep"
    cuts: Sequence[float] = ()
    states: Path | None = None  # file of Checkpoints
    log: Path | None = None  # table of what the eye went through, CSV
    plot: Path | None = None
    video: Path | None = None
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
    scotopic: bool = False  # the layer scotopic.Y in the EXR
    mesopic: bool = False  # mesopic.Y
    half: bool = False
    compression: Compression = "zip"
    resume: bool = False
