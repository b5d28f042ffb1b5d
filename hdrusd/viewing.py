"""One frame as an eye sees it: glare, adaptation, acuity, colour, tone mapping, the screen.

``Eye`` does it on the GPU, shader 2; ``ReferenceEye`` is its definition in NumPy. Both take the
steps in this order:

1. what the eye's own media scatter lies over the frame (glare);
2. the veiled frame is measured, and the eye adapts to it (Course, Operator.advance);
3. details that it cannot resolve are gone (acuity);
4. colours fade and turn blue where rods see (night colour);
5. the operator says what the screen shall show, the screen's curve what it is told.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.colour import (
    bt1886_decode,
    bt1886_encode,
    clean,
    dither,
    gamma_decode,
    gamma_encode,
    pq_decode,
    pq_encode,
    quantise,
    srgb_decode,
    srgb_encode,
    to_rec2020,
)
from hdrusd.course import Course
from hdrusd.errors import SourceRef
from hdrusd.eye.acuity import acuity_blur
from hdrusd.eye.foveal import Foveal, default_field
from hdrusd.eye.observer import Observer
from hdrusd.eye.scotopic import TINT, night_colour, scotopic, white_relative
from hdrusd.eye.screen import Screen
from hdrusd.glare.model import GlareModel
from hdrusd.glare.pyramid import pyramid
from hdrusd.gpu.glare import GlarePass
from hdrusd.gpu.ldr import ToneMapper, deep
from hdrusd.gpu.measure import Measurer
from hdrusd.gpu.program import Programs
from hdrusd.gpu.vision import AcuityPass
from hdrusd.report import Kind, Report
from hdrusd.tonemap.falsecolour import OPERATOR as FALSE_COLOUR
from hdrusd.tonemap.falsecolour import PALETTES
from hdrusd.tonemap.legend import SMALLEST, paint_legend
from hdrusd.tonemap.operator import Moment, Need, Operator, Parameters, statistics

Array = npt.NDArray[Any]

#: Shares of the colours' fading and of the blue shift (eye.scotopic.night_colour).
NIGHT = (1.0, TINT)


@dataclass(frozen=True, slots=True)
class Viewing:
    """Who looks, at what screen, and what of the eye is modelled beside the operator."""

    operator: Operator
    parameters: Parameters = field(default_factory=dict)
    observer: Observer = field(default_factory=Observer)
    screen: Screen = field(default_factory=Screen)
    glare: GlareModel | None = None
    acuity: bool = False
    night_colour: bool = False

    def moment(self, parameters: Parameters | None = None) -> Moment:
        """A frame seen so, not yet measured; ``parameters`` in place of one's own."""
        given = self.parameters if parameters is None else parameters
        return self.operator.moment(given, None, self.observer, self.screen)

    def setup(self) -> dict[str, Any]:
        """All of it by name and number, as JSON has it."""
        return {
            "operator": self.operator.name,
            "parameters": self.operator.settings(self.parameters),
            "observer": asdict(self.observer),
            "screen": asdict(self.screen),
            "glare": self.glare.name if self.glare is not None else None,
            "acuity": self.acuity,
            "night_colour": self.night_colour,
        }

    def field(self, sight: Sight, size: tuple[int, int]) -> tuple[float, float]:
        """Width and height in degrees: the camera's, else the screen's, else a usual one."""
        if sight.field is not None:
            return sight.field
        if self.screen.field is None:
            return default_field(*size)
        half = math.tan(math.radians(self.screen.field) / 2.0)
        return self.screen.field, math.degrees(2.0 * math.atan(half * size[1] / size[0]))

    def needs(self, moment: Moment) -> Need:
        """What has to be measured of a frame."""
        need = self.operator.needs(moment.parameters)
        return need | Need.FOVEAL if self.acuity else need


@dataclass(frozen=True, slots=True)
class Sight:
    """What of a frame is known beside its pixels.

    ``time`` in s, ``frame`` its number, ``camera`` the camera's name; ``field``: width and height
    in degrees, None where the camera is unknown; ``parameters`` of the operator where they are
    this frame's own.
    ``lamps`` (n, 6): those that the frame does not hold and that dazzle all the same, and pixels
    that show some of them (glare/veil.py). ``rods``: the frame's fourth channel is its
    white-relative scotopic luminance (``with_rods``).
    """

    time: float = 0.0
    frame: float = 0.0
    field: tuple[float, float] | None = None
    parameters: Parameters | None = None
    lamps: Array | None = None
    rods: bool = False
    camera: str | None = None


@dataclass(frozen=True, slots=True)
class Shown:
    """What was shown of a frame: code values (h, w, 3), top row first; and why."""

    picture: Array
    moment: Moment


class Eye:
    """Frames on the GPU, in the order in which they are seen."""

    def __init__(
        self, ctx: moderngl.Context, programs: Programs, viewing: Viewing, course: Course
    ) -> None:
        self.viewing = viewing
        self.course = course
        self.mapper = ToneMapper(ctx, programs)
        self.measurer = Measurer(ctx, programs)
        self._glare = GlarePass(ctx, programs)
        self._acuity = AcuityPass(ctx, programs)

    def show(self, hdr: moderngl.Texture, sight: Sight) -> Shown:
        """Adapt to an RGBA float texture in cd/m2, bottom row first, and the picture of it."""
        return self._show(hdr, sight, top_first=False)

    def show_array(self, frame: npt.NDArray[np.float32], sight: Sight) -> Shown:
        """As ``show``, for a frame (h, w, 3 or 4), top row first."""
        texture, top_first = self._upload(frame)
        return self._show(texture, sight, top_first)

    def see_array(self, frame: npt.NDArray[np.float32], sight: Sight) -> Moment:
        """Adapt to a frame without a picture of it."""
        texture, top_first = self._upload(frame)
        return self._adapt(self._veiled(texture, sight), sight, top_first)

    def _upload(self, frame: npt.NDArray[np.float32]) -> tuple[moderngl.Texture, bool]:
        """The frame as a texture, and whether its top row is first."""
        if self.viewing.acuity and frame.shape[2] == 3:  # AcuityPass wants four channels
            frame = np.concatenate([frame, np.ones_like(frame[..., :1])], axis=-1)
        # The levels of a veil begin at the bottom row.
        top_first = self.viewing.glare is None
        return self.mapper.upload(frame if top_first else frame[::-1]), top_first

    def _show(self, hdr: moderngl.Texture, sight: Sight, top_first: bool) -> Shown:
        viewing = self.viewing
        sharp = veiled = self._veiled(hdr, sight)
        moment = self._adapt(veiled, sight, top_first)
        if viewing.acuity:
            sharp = self._acuity.apply(veiled, _foveal(moment), top_first=top_first)
        night = NIGHT if viewing.night_colour else None
        picture = self.mapper.apply(
            sharp, viewing.operator, moment, night=night, rods=sight.rods, top_first=top_first
        )
        add_legend(picture, viewing.operator, moment)
        return Shown(picture, moment)

    def release(self) -> None:
        """Free what is on the GPU."""
        for part in (self.mapper, self.measurer, self._glare, self._acuity):
            part.release()

    def _veiled(self, hdr: moderngl.Texture, sight: Sight) -> moderngl.Texture:
        viewing = self.viewing
        if viewing.glare is None:
            return hdr
        angles = self.viewing.field(sight, hdr.size)
        return self._glare.veil(
            hdr, angles, viewing.glare, viewing.observer, sight.lamps, rods=sight.rods
        )

    def _adapt(self, hdr: moderngl.Texture, sight: Sight, top_first: bool) -> Moment:
        moment = self.viewing.moment(sight.parameters)
        angles = self.viewing.field(sight, hdr.size)
        need = self.viewing.needs(moment)
        stats = self.measurer.measure(hdr, need, angles, top_first=top_first)
        moment = replace(moment, statistics=stats)
        return self.course.advance(moment, sight.time, sight.frame, sight.camera)


class ReferenceEye:
    """Frames in NumPy: what ``Eye`` means."""

    def __init__(self, viewing: Viewing, course: Course) -> None:
        self.viewing = viewing
        self.course = course

    def see_array(self, frame: npt.NDArray[np.float32], sight: Sight) -> Moment:
        """Adapt to a frame (h, w, 3 or 4) in cd/m2, without a picture of it."""
        return self._adapt(self._veiled(clean(frame), sight), sight)

    def show_array(self, frame: npt.NDArray[np.float32], sight: Sight) -> Shown:
        """Adapt to a frame, and the picture of it."""
        viewing, operator = self.viewing, self.viewing.operator
        sharp = self._veiled(clean(frame), sight)
        moment = self._adapt(sharp, sight)
        if (
            viewing.acuity
            and moment.statistics is not None
            and moment.statistics.foveal is not None
        ):
            sharp = acuity_blur(sharp, moment.statistics.foveal)
        rgb = sharp[..., :3]
        if viewing.night_colour:
            s_n = sharp[..., 3] if sight.rods else white_relative(scotopic(rgb))
            rgb = night_colour(rgb, s_n, *NIGHT)
        picture = encode(operator.apply(rgb, moment=moment), operator, moment.screen)
        add_legend(picture, operator, moment)
        return Shown(picture, moment)

    def _veiled(self, frame: Array, sight: Sight) -> Array:
        viewing = self.viewing
        if viewing.glare is None:
            return frame
        size = frame.shape[1], frame.shape[0]
        angles = viewing.field(sight, size)
        plan = pyramid(viewing.glare, viewing.observer, size, angles)
        return plan.paint(frame if sight.rods else frame[..., :3], sight.lamps)

    def _adapt(self, frame: Array, sight: Sight) -> Moment:
        moment = self.viewing.moment(sight.parameters)
        rgb = frame[..., :3]
        angles = self.viewing.field(sight, (rgb.shape[1], rgb.shape[0]))
        stats = statistics(rgb, need, angles) if (need := self.viewing.needs(moment)) else None
        moment = replace(moment, statistics=stats)
        return self.course.advance(moment, sight.time, sight.frame, sight.camera)


def note_glare(viewing: Viewing, place: SourceRef, report: Report) -> None:
    """A finding for an observer's age or pigment that the model of glare does not know."""
    usual, observer, glare = Observer(), viewing.observer, viewing.glare
    if glare is None or glare.by_observer:
        return
    said = {name: getattr(observer, name) for name in ("age", "pigment")}
    other = [f"{n} {value:g}" for n, value in said.items() if value != getattr(usual, n)]
    if other:
        text = f"observer's {', '.join(other)}: the veil of {glare.name} is the same for all"
        report.add(Kind.DROPPED, "glare-observer", place, "", text)


def _foveal(moment: Moment) -> Foveal:
    stats = moment.statistics
    assert stats is not None, "Viewing.needs asks for it"
    assert stats.foveal is not None, "Viewing.needs asks for it"
    return stats.foveal


def with_rods(rgb: npt.ArrayLike, rods: npt.ArrayLike) -> npt.NDArray[np.float32]:
    """A frame (h, w, 3) and its scotopic luminance (h, w), scotopic cd/m2, white-relative."""
    fourth = white_relative(clean(np.asarray(rods, np.float32)))[..., None]
    return np.concatenate([np.asarray(rgb, np.float32), fourth.astype(np.float32)], axis=-1)


def with_exposure(viewing: Viewing, scale: float | None) -> Parameters:
    """Parameters for a frame whose camera states its exposure, 1/(cd/m2): that, unless given."""
    given = dict(viewing.parameters)
    names = {parameter.name for parameter in viewing.operator.parameters}
    if scale is not None and {"scale", "ev100"} <= names and not {"scale", "ev100"} & given.keys():
        given["scale"] = scale
    return given


def reads_screen(operator: Operator, parameters: Parameters) -> bool:
    """Whether an operator's picture depends on the screen's peak and black."""
    moments = [
        operator.moment(parameters, None, None, Screen(peak=peak, black=black))
        for peak, black in ((100.0, 1.0), (300.0, 0.5))
    ]
    frame = np.geomspace(0.01, 1e4, 48).reshape(4, 4, 3)
    stats = statistics(frame, operator.needs(moments[0].parameters))
    first, second = (
        operator.apply(frame, moment=operator.steady(replace(moment, statistics=stats)))
        for moment in moments
    )
    return not np.array_equal(first, second)


def encode(linear: Array, operator: Operator, screen: Screen) -> Array:
    """Display-linear [0, 1], (h, w, 3), as code values: 8 bits with dither, or 16."""
    code = linear if operator.encoded else _encoded(linear, screen)
    if deep(screen):
        return (code * 65535.0 + 0.5).astype(np.uint16)
    rows, columns = np.mgrid[0 : linear.shape[0], 0 : linear.shape[1]]
    offset = dither(columns, rows)[..., None]  # the same for all three channels
    return np.asarray(quantise(code, offset), np.uint8)


def _encoded(linear: Array, screen: Screen) -> Array:
    if screen.eotf == "gamma22":
        return gamma_encode(linear, 2.2)
    if screen.eotf == "bt1886":
        return bt1886_encode(linear, screen.black, screen.peak)
    if screen.eotf == "pq":
        emitted = screen.black + linear * (screen.peak - screen.black)
        return pq_encode(np.maximum(to_rec2020(emitted), 0.0))
    return srgb_encode(linear)


def decoded(code: Array, screen: Screen) -> Array:
    """Code values [0, 1] as display-linear light, of a PQ screen as cd/m2 of Rec. 2020."""
    if screen.eotf == "gamma22":
        return gamma_decode(code, 2.2)
    if screen.eotf == "bt1886":
        return bt1886_decode(code, screen.black, screen.peak)
    if screen.eotf == "pq":
        return pq_decode(code)
    return srgb_decode(code)


def add_legend(picture: Array, operator: Operator, moment: Moment) -> None:
    """The cd/m2 scale on a false colour picture that has room for it, in place."""
    room = all(have >= need for have, need in zip(picture.shape, SMALLEST, strict=False))
    if operator.name == FALSE_COLOUR.name and room and picture.dtype == np.uint8:
        scale = operator.uniforms(moment)
        paint_legend(
            picture,
            scale["falsecolour_scale"],
            scale["falsecolour_decades"],
            PALETTES[int(scale["falsecolour_kind"])],
            scale["falsecolour_steps"],
        )
