"""Any display and view of an OpenColorIO configuration, as studios have them.

OpenColorIO 2, opencolorio.org: the CPU processor is the reference, and its GPU processor
writes the GLSL. It takes exposed RGB (exposure.py) as scene-linear Rec. 709, and gives code
values of the display that is named. Needs the extra "ocio" (PyOpenColorIO).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from hdrusd.errors import HdrusdError, ParameterError, UnknownNameError, one_line
from hdrusd.tonemap.exposure import (
    EXPOSURE_PARAMETERS,
    exposed,
    exposure_advance,
    exposure_needs,
    exposure_trace,
    exposure_uniforms,
)
from hdrusd.tonemap.operator import (
    Array,
    Moment,
    Operator,
    Parameter,
    Parameters,
    Uniforms,
    unbuilt,
)

#: ACES 2.0, pinned: the library's own default changes with its version.
CONFIG = "cg-config-v4.0.0_aces-v2.0_ocio-v2.5"

#: What configurations call scene-linear Rec. 709 with D65 white, the ACES ones first.
_LINEAR_REC709 = ("lin_rec709_scene", "lin_rec709_srgb", "lin_rec709", "Linear Rec.709 (sRGB)")

#: Exposed RGB that stands for all above: what a half float, OpenColorIO's usual input, holds.
_BRIGHTEST = 65504.0

#: The widest 3-D table, whose square is the largest texture of common drivers.
_WIDEST = 128

#: Tables in float32 are not filtered by every driver, and by most with 8 bits of a fraction. A
#: 3-D table lies in a 2-D texture, one layer under the other.
_INTERPOLATION = """
vec3 ocio_bilinear(sampler2D table, vec2 at)
{
    ivec2 last = textureSize(table, 0) - 1;
    vec2 p = clamp(at * vec2(last + 1) - 0.5, vec2(0.0), vec2(last));
    ivec2 a = ivec2(p), b = min(a + 1, last);
    vec2 t = p - vec2(a);
    return mix(mix(texelFetch(table, a, 0).rgb, texelFetch(table, ivec2(b.x, a.y), 0).rgb, t.x),
               mix(texelFetch(table, ivec2(a.x, b.y), 0).rgb, texelFetch(table, b, 0).rgb, t.x),
               t.y);
}

vec3 ocio_row(sampler2D table, int y, int a, int b, float t)
{
    return mix(texelFetch(table, ivec2(a, y), 0).rgb, texelFetch(table, ivec2(b, y), 0).rgb, t);
}

vec3 ocio_trilinear(sampler2D table, vec3 at)
{
    int n = textureSize(table, 0).x;
    vec3 p = clamp(at * float(n) - 0.5, 0.0, float(n - 1));
    ivec3 a = ivec3(p), b = min(a + 1, n - 1);
    vec3 t = p - vec3(a);
    vec3 near = mix(ocio_row(table, a.z * n + a.y, a.x, b.x, t.x),
                    ocio_row(table, a.z * n + b.y, a.x, b.x, t.x), t.y);
    vec3 far = mix(ocio_row(table, b.z * n + a.y, a.x, b.x, t.x),
                   ocio_row(table, b.z * n + b.y, a.x, b.x, t.x), t.y);
    return mix(near, far, t.z);
}
"""

_CODE = """// OpenColorIO
#include "tonemap/exposure.glsl"
{interpolation}{text}
vec3 ocio(vec3 rgb)
{{
    vec3 code = ocio_display(vec4(min(exposed(rgb), {brightest}), 1.0)).rgb;
    return clamp(code, 0.0, 1.0);
}}
"""


def _library() -> Any:
    try:
        import PyOpenColorIO
    except ImportError as error:
        raise HdrusdError(
            "ocio: PyOpenColorIO: not installed; want pip install hdrusd[ocio]"
        ) from error
    return PyOpenColorIO


def transform(parameters: Parameters) -> Any:
    """The PyOpenColorIO processor from scene-linear Rec. 709 to the display's code values.

    Raises ParameterError for a configuration that cannot be read, UnknownNameError for
    names that it has not, HdrusdError without the library.
    """
    library = _library()
    config = _config(library, str(parameters["config"]))
    display = _one_of(
        "display", parameters["display"], config.getDefaultDisplay(), config.getDisplays()
    )
    view = _one_of(
        "view", parameters["view"], config.getDefaultView(display), config.getViews(display)
    )
    found = (config.getColorSpace(name) for name in _LINEAR_REC709)
    default = next((space.getName() for space in found if space is not None), None)
    if parameters["source"] is None and default is None:
        raise ParameterError("ocio: source: the configuration has no linear Rec. 709; want a name")
    source = parameters["source"] or default
    if config.getColorSpace(str(source)) is None:
        raise UnknownNameError("ocio: source", str(source), config.getColorSpaceNames())
    return _asked(
        "view",
        f"{display}, {view}",
        lambda: config.getProcessor(
            library.DisplayViewTransform(src=str(source), display=display, view=view)
        ),
    )


def _config(library: Any, name: str) -> Any:
    """A configuration by its built-in name or, with a slash or .ocio(z) in it, its file."""
    is_file = "/" in name or Path(name).suffix in (".ocio", ".ocioz")
    read = library.Config.CreateFromFile if is_file else library.Config.CreateFromBuiltinConfig
    return _asked("config", name, lambda: read(name))


def _asked(thing: str, name: str, call: Callable[[], Any]) -> Any:
    """What ``call`` returns; the library's complaints as ParameterError."""
    library = _library()
    try:
        return call()
    except (library.Exception, library.ExceptionMissingFile) as error:
        raise ParameterError(one_line(f"ocio: {thing}: {name}: {error}")) from error


def _one_of(kind: str, given: Any, default: str, known: Iterable[str]) -> str:
    name, names = str(default if given is None else given), list(known)
    if name not in names:
        raise UnknownNameError(f"ocio: {kind}", name, names)
    return name


@lru_cache(maxsize=8)
def _built(config: str, display: str | None, view: str | None, source: str | None) -> Operator:
    library = _library()
    names = {"config": config, "display": display, "view": view, "source": source}
    processor = transform(names)
    lossless, said = library.OPTIMIZATION_LOSSLESS, view or "default"
    cpu = _asked("view", said, lambda: processor.getOptimizedCPUProcessor(lossless))
    text, tables = _asked("view", said, lambda: shader(processor))

    def reference(rgb: Array, uniforms: Uniforms) -> Array:
        light = np.minimum(exposed(rgb, uniforms["exposure_scale"]), _BRIGHTEST)
        pixels = np.ascontiguousarray(light, np.float32).reshape(-1, 3)
        cpu.applyRGB(pixels)
        return np.clip(pixels.reshape(light.shape), 0.0, 1.0)

    def uniforms(moment: Moment) -> Uniforms:
        return {**exposure_uniforms("ocio", moment), **tables}

    return replace(OPERATOR, reference=reference, glsl=text, uniforms=uniforms, build=None)


def shader(processor: Any) -> tuple[str, dict[str, Array]]:
    """GLSL 3.30 text of ``ocio``, and the tables that it reads, of a transform's processor."""
    library = _library()
    gpu = processor.getOptimizedGPUProcessor(library.OPTIMIZATION_LOSSLESS)
    wanted = library.GpuShaderDesc.CreateShaderDesc(
        language=library.GPU_LANGUAGE_GLSL_1_3,
        functionName="ocio_display",
        resourcePrefix="ocio_",
    )
    wanted.setAllowTexture1D(False)
    gpu.extractGpuShaderInfo(wanted)
    text, tables = wanted.getShaderText(), {}
    for flat in wanted.getTextures():
        values = np.array(flat.getValues(), np.float32).reshape(flat.height, flat.width, -1)
        tables[flat.samplerName] = values
        if flat.interpolation != library.INTERP_NEAREST:
            text = _read_by("ocio_bilinear", flat.samplerName, text)
    for cube in wanted.get3DTextures():
        n = cube.edgeLen
        if n > _WIDEST:
            raise ParameterError(f"ocio: view: a table of {n} x {n} x {n}; want {_WIDEST} at most")
        tables[cube.samplerName] = np.array(cube.getValues(), np.float32).reshape(n * n, n, 3)
        text = _read_by("ocio_trilinear", cube.samplerName, text)
    code = _CODE.format(interpolation=_INTERPOLATION, text=text, brightest=_BRIGHTEST)
    return code, tables


def _read_by(function: str, sampler: str, text: str) -> str:
    """GLSL in which a texture is read by a function of ours; a 3-D one becomes 2-D."""
    text = re.sub(rf"\bsampler3D(\s+{sampler}\s*;)", r"sampler2D\1", text)
    # The result of texture() is a vec4, of which OpenColorIO takes .r or .rgb.
    return re.sub(rf"\btexture\(\s*{sampler}\s*,", f"{function}({sampler},", text)


def _build(parameters: Parameters) -> Operator:
    names = (parameters[name] for name in ("config", "display", "view", "source"))
    return _built(*(None if name is None else str(name) for name in names))


def _uniforms(moment: Moment) -> Uniforms:
    return exposure_uniforms("ocio", moment)


OPERATOR = Operator(
    name="ocio",
    title="A display and view of an OpenColorIO configuration",
    cite="Academy Software Foundation, OpenColorIO 2; by default Academy, ACES 2.0, 2024",
    parameters=(
        Parameter("config", CONFIG, "", "a built-in configuration's name, or a file"),
        Parameter("display", None, "", "the display, or none for the configuration's default"),
        Parameter("view", None, "", "the view, or none for the display's default"),
        Parameter("source", None, "", "the colour space that is linear Rec. 709, or none: found"),
        *EXPOSURE_PARAMETERS,
    ),
    reference=unbuilt,
    glsl="tonemap/exposure.glsl",
    function="ocio",
    uniforms=_uniforms,
    needs=exposure_needs,
    advance=exposure_advance,
    trace=exposure_trace,
    build=_build,
    encoded=True,
    tone_curve=False,  # a view may be anything; some of ACES 2.0 darken very bright pure colours
)
