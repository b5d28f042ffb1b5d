"""Lights of FBX: colour times a percentage without a unit, and a law of decay.

FBX SDK, ``FbxLight``: a light shines along its node's -Y; InnerAngle and OuterAngle are whole
angles; Intensity 100 is one; DecayType is none, linear, quadratic or cubic, from DecayStart on.
"""

from __future__ import annotations

import re
from typing import Any, Literal

from hdrusd.importers.fbx_document import LARGEST, Document
from hdrusd.importers.fbx_held import Held
from hdrusd.legacy.scene import Light
from hdrusd.report import Kind

Attenuation = tuple[float, float, float]

_POINT, _DIRECTIONAL, _SPOT, _AREA, _VOLUME = range(5)
_NONE, _LINEAR, _QUADRATIC, _CUBIC = range(4)
_DECAYS = ("none", "linear", "quadratic", "cubic")
_SHAPES = ("rectangle", "sphere")
_FAR = ("EnableFarAttenuation", "FarAttenuationStart", "FarAttenuationEnd")
#: Since this version the numbers of Blender's lights are watts.
_WATTS_SINCE = 2, 80
#: Of radiant power as a lamp's light, lm/W: 683 is that of 555 nm, as glTF exporters agreed.
_LUMENS_A_WATT = 683.0


def read_light(document: Document, light: Held, name: str) -> Light:
    """A light at its node's origin; raw numbers stay in ``extras``."""
    place = document.ref("light", name)
    kind = int(light.type)
    red, green, blue = document.numbers(tuple(light.color), (1.0, 1.0, 1.0), place, "colour")
    factor = document.number(float(light.intensity), 1.0, place, "intensity")
    if factor * max(abs(red), abs(green), abs(blue)) > LARGEST:
        text = f"intensity {100.0 * factor:g} % is beyond 32-bit floats; 100 % is used"
        document.note(Kind.INVALID, "light-intensity", place, name, text)
        factor = 1.0
    extras: dict[str, Any] = {
        "color": (red, green, blue),
        "intensity_percent": 100.0 * factor,
        "decay": _DECAYS[int(light.decay)],
    }
    _note_watts(document, light, name, factor)
    color = red * factor, green * factor, blue * factor
    cutoff, inner, exponent = 180.0, None, 0.0
    made: Literal["point", "spot", "directional"] = "point"
    if kind == _DIRECTIONAL:
        made = "directional"
    elif kind == _SPOT:
        made = "spot"
        cutoff, inner = _cone(document, light, name, extras)
    elif kind == _AREA:
        shape = _SHAPES[int(light.area_shape)]
        extras["area_shape"] = shape
        if shape == "rectangle":
            made, cutoff, exponent = "spot", 90.0, 1.0
        text = f"area light ({shape}) of a size that is not stated; "
        text += "a point with a lamp's cosine" if made == "spot" else "a point"
        document.note(Kind.REPLACED, "fbx-light-area", place, name, text)
    elif kind == _VOLUME:
        text = "volume light; read as a point"
        document.note(Kind.REPLACED, "fbx-light-area", place, name, text)
    attenuation, reach = None, None
    if made != "directional":
        attenuation, reach = _attenuation(document, light, name, extras)
    down = document.numbers(tuple(light.local_direction), (0.0, -1.0, 0.0), place, "direction")
    return Light(
        name,
        place,
        made,
        direction=(down[0], down[1], down[2]),
        diffuse=color,
        specular=color,
        attenuation=attenuation,
        spot_cutoff=cutoff,
        spot_inner=inner,
        spot_exponent=exponent,
        range=None if reach is None else reach * document.unit_m,
        enabled=bool(light.cast_light),
        extras=extras,
    )


def _cone(
    document: Document, light: Held, name: str, extras: dict[str, Any]
) -> tuple[float, float]:
    """Half-angles of the cone and of its full part."""
    place = document.ref("light", name)
    outer = document.number(float(light.outer_angle), 45.0, place, "outer angle")
    inner = document.number(float(light.inner_angle), 0.0, place, "inner angle")
    extras |= {"inner_angle": inner, "outer_angle": outer}
    edge = min(max(outer, 0.0), 180.0) or 45.0
    full = min(max(inner, 0.0), edge)
    if (full, edge) != (inner, outer):
        text = f"angles {inner:g} and {outer:g} degrees; {full:g} and {edge:g} are used"
        document.note(Kind.CLAMPED, "fbx-light-angle", place, name, text)
    if full < edge:
        text = "the cone's edge fades by UsdLux softness between inner and outer angle"
        document.note(Kind.REPLACED, "fbx-light-edge", place, name, text)
    return edge / 2.0, full / 2.0


def _attenuation(
    document: Document, light: Held, name: str, extras: dict[str, Any]
) -> tuple[Attenuation, float | None]:
    """OpenGL's attenuation for the law of decay, per source unit; and the light's end.

    Beyond DecayStart s the law is (s / d)^n, of Maya, which states no start, (1 / d)^n.
    """
    place = document.ref("light", name)
    decay = int(light.decay)
    start = document.number(light.props.find_real("DecayStart", 0.0), 0.0, place, "DecayStart")
    extras["decay_start"] = start
    near, end = (
        document.number(light.props.find_real(word, 0.0), 0.0, place, word) for word in _FAR[1:]
    )
    if light.props.find_bool(_FAR[0], False) and 0.0 <= near < end:
        half = 0.5 * (near + end)
        extras |= {"far_start": near, "far_end": end}
        text = f"whole up to {near:g} and none beyond {end:g} units: read as half at {half:g}"
        document.note(Kind.REPLACED, "fbx-light-range", place, name, text)
        return (1.0, 1.0 / half, 0.0), end
    if decay == _NONE:
        return (1.0, 0.0, 0.0), None
    unit = start if 1e-6 < start < 1e9 else 1.0
    if decay == _LINEAR:
        return (0.0, 1.0 / unit, 0.0), None
    if decay == _CUBIC:
        document.note(
            Kind.REPLACED, "fbx-light-decay", place, name, "cubic decay; read as quadratic"
        )
    return (0.0, 0.0, 1.0 / unit**2), None


def _note_watts(document: Document, light: Held, name: str, factor: float) -> None:
    version = re.match(r"Blender\D*(\d+)\.(\d+)", document.application())
    if version is None or (int(version[1][:6]), int(version[2][:6])) < _WATTS_SINCE:
        return
    unit, key, value = "W", "radiant_watts", factor
    if int(light.type) == _DIRECTIONAL:
        unit, key, value = "W/m2", "illuminance", factor * _LUMENS_A_WATT
    text = (
        f"Blender's {factor:g} {unit} as {100.0 * factor:g} %, a factor without a unit here; "
        f"the photometry file can say {key} = {value:g}"
    )
    document.note(Kind.ASSUMED, "fbx-light-watts", document.ref("light", name), name, text)
