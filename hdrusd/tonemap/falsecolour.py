"""False colour: luminance on a scale from blue to red, to check a scene.

The scales and the palettes of Radiance's falsecolor, without its contour lines. The
legend is in legend.py. Twin of falsecolour.glsl.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hdrusd.colour import luminance, srgb_decode
from hdrusd.errors import ParameterError
from hdrusd.tonemap.operator import Array, Moment, Operator, Parameter, Uniforms, number

#: In the shader's order.
PALETTES = ("spec", "pm3d", "hot", "eco")

#: Base-10 logarithm of 2: GLSL has log2 only.
_LOG10_2 = 0.30102999566398120


def falsecolour_position(y: npt.ArrayLike, scale: float, decades: float) -> Array:
    """Where luminance ``y`` lies on the scale, 0 to 1: 1 + log10(y / scale) / decades.

    ``scale`` is the top in cd/m2, its lower end ``decades`` powers of ten below. With no
    decades the scale is linear: y / scale.
    """
    y = np.asarray(y)
    if decades == 0.0:
        return np.minimum(y / scale, 1.0)
    ratio = np.maximum(y / scale, 10.0**-decades)
    place: Array = np.clip(1.0 + np.log2(ratio) * (_LOG10_2 / decades), 0.0, 1.0)
    return place


def falsecolour_step(v: npt.ArrayLike, steps: float) -> Array:
    """The middle of the one of ``steps`` equal parts of the scale that v is in; 0 steps: v."""
    v = np.asarray(v)
    if steps == 0.0:
        return v
    return np.asarray((np.minimum(np.floor(v * steps), steps - 1.0) + 0.5) / steps)


def falsecolour_palette(v: npt.ArrayLike, palette: str = "spec") -> Array:
    """Code values (..., 3) in [0, 1] for a position in [0, 1], by one of PALETTES.

    "spec": blue, green at 3/8, red; "pm3d": black, blue, red, yellow, as gnuplot's; "hot":
    black, red, yellow, white; "eco": blue, red, yellow.
    """
    v = np.asarray(v)
    if palette == "pm3d":
        channels = np.sqrt(v), v * v * v, np.sin(2.0 * np.pi * v)
    elif palette == "hot":
        channels = 3.0 * v, 3.0 * v - 1.0, 3.0 * v - 2.0
    elif palette == "eco":
        channels = 2.0 * v, 2.0 * v - 1.0, 1.0 - 2.0 * v
    else:
        green = np.where(v > 0.375, 1.6 - 1.6 * v, v * (8.0 / 3.0))
        channels = 1.6 * v - 0.6, green, 1.0 - v * (8.0 / 3.0)
    code: Array = np.stack(channels, axis=-1)
    return code.clip(0.0, 1.0)


def falsecolour(
    rgb: npt.ArrayLike, scale: float, decades: float, palette: str = "spec", steps: float = 0.0
) -> Array:
    """cd/m2 (..., 3) to display-linear colours of the palette, in [0, 1]."""
    place = falsecolour_step(falsecolour_position(luminance(rgb), scale, decades), steps)
    return srgb_decode(falsecolour_palette(place, palette))


def _uniforms(moment: Moment) -> dict[str, float]:
    params = moment.parameters
    palette, decades, steps = params["palette"], params["decades"], params["steps"]
    if palette not in PALETTES:
        raise ParameterError(f"falsecolour: palette: {palette}; want {', '.join(PALETTES)}")
    if decades is not None:
        decades = number("falsecolour", "decades", decades, 0.1, 20.0)
    if steps is not None:
        steps = round(number("falsecolour", "steps", steps, 2.0, 256.0))
    return {
        "falsecolour_scale": number("falsecolour", "scale", params["scale"], 1e-9, 1e12),
        "falsecolour_decades": decades or 0.0,
        "falsecolour_kind": float(PALETTES.index(str(palette))),
        "falsecolour_steps": float(steps or 0),
    }


def _reference(rgb: Array, uniforms: Uniforms) -> Array:
    return falsecolour(
        rgb,
        uniforms["falsecolour_scale"],
        uniforms["falsecolour_decades"],
        PALETTES[int(uniforms["falsecolour_kind"])],
        uniforms["falsecolour_steps"],
    )


OPERATOR = Operator(
    name="falsecolour",
    title="False colour of luminance",
    cite="G. Ward, falsecolor, Radiance",
    parameters=(
        Parameter("scale", 1000.0, "cd/m2", "luminance at the top of the scale (red)"),
        Parameter(
            "decades", 5.0, "", "powers of ten from the top to the bottom (blue), or none: linear"
        ),
        Parameter("palette", "spec", "", "spec, pm3d, hot or eco"),
        Parameter("steps", None, "", "steps of even colour that the scale is cut into, or none"),
    ),
    reference=_reference,
    glsl="tonemap/falsecolour.glsl",
    function="falsecolour",
    uniforms=_uniforms,
    tone_curve=False,
)
