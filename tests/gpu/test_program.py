"""Programs are made once, and what the driver says of them names our files and lines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hdrusd.errors import ShaderError
from hdrusd.gpu.evaluate import evaluate
from hdrusd.gpu.program import Programs, set_uniforms

Write = Callable[..., str]
LDR = ("gpu/shaders/fullscreen.vert", "gpu/shaders/ldr.frag")


def variant(operator: str) -> dict[str, str]:
    return {
        "OPERATOR": operator,
        "ENCODE": "encode_srgb",
        "OPERATOR_GLSL": f'"tonemap/{operator}.glsl"',
    }


def test_same_program_for_the_same_files_and_defines(gl: Any) -> None:
    programs = Programs(gl)
    first = programs.get(*LDR, variant("reinhard02"))
    assert programs.get(*LDR, dict(reversed(variant("reinhard02").items()))) is first
    assert programs.get(*LDR, variant("exposure")) is not first


def test_fullscreen_reaches_every_pixel(gl: Any, write_shader: Write) -> None:
    write_shader("x.frag", "out vec4 c;\nvoid main() { c = vec4(gl_FragCoord.xy, 0, 1); }")
    vertices = Programs(gl).fullscreen("lamp_shaders:x.frag")
    target = gl.framebuffer([gl.texture((13, 7), 4, dtype="f4")])
    with gl.scope(target):
        vertices.render(vertices=3)
    got = np.frombuffer(target.read(components=2, dtype="f4"), np.float32).reshape(7, 13, 2)
    x, y = np.meshgrid(np.arange(13) + 0.5, np.arange(7) + 0.5)
    np.testing.assert_array_equal(got, np.stack([x, y], axis=-1))


def test_error_names_file_and_line(gl: Any, write_shader: Write) -> None:
    text = '#include "colour.glsl"\n\nout vec4 c;\nvoid main() { c = vec4(lumen(c.rgb)); }\n'
    write_shader("x.frag", text)
    with pytest.raises(ShaderError, match=r"lamp_shaders:x\.frag:4\b.*lumen"):
        Programs(gl).get(LDR[0], "lamp_shaders:x.frag")


def test_link_error(gl: Any, write_shader: Write) -> None:
    vertex = write_shader(
        "x.vert", "out vec3 tint;", "void main() { tint = vec3(1); gl_Position = vec4(0); }"
    )
    fragment = write_shader("x.frag", "in vec4 tint;", "out vec4 c;", "void main() { c = tint; }")
    with pytest.raises(ShaderError, match=r"x\.vert \+ lamp_shaders:x\.frag: [\s\S]*tint"):
        Programs(gl).get(vertex, fragment)


def test_unknown_uniform(gl: Any) -> None:
    program = Programs(gl).get(*LDR, variant("exposure"))
    with pytest.raises(ShaderError, match=r"exposure_skale: not in the program; has .*_scale"):
        set_uniforms(program, {"exposure_skale": 1.0})


def test_array_uniform(gl: Any, write_shader: Write) -> None:
    write_shader("x.frag", "uniform float curve[4];\nfloat at(int i) { return curve[i]; }\n")
    curve = np.array([0.5, 1.5, 2.5, 3.5])
    got = evaluate(
        gl, "lamp_shaders:x.frag", "at", {"i": [3, 0]}, "float", uniforms={"curve": curve}
    )
    assert got.tolist() == [3.5, 0.5]


def test_evaluate_function_expression_and_statements(gl: Any) -> None:
    rgb = np.eye(3)
    weights = np.array([0.2126, 0.7152, 0.0722], np.float32)
    got = evaluate(gl, "colour.glsl", "luminance", {"rgb": rgb}, "float")
    np.testing.assert_array_equal(got, weights)
    got = evaluate(gl, "colour.glsl", "luminance(rgb) * k", {"rgb": rgb, "k": [1, 2, 4]}, "float")
    np.testing.assert_array_equal(got, weights * [1, 2, 4])
    both = evaluate(
        gl,
        [],
        "a = p.yx; n = i + 1u;",
        {"p": np.arange(6.0).reshape(3, 2), "i": np.arange(3, dtype=np.uint32)},
        {"a": "vec2", "n": "uint"},
    )
    np.testing.assert_array_equal(both["a"], [[1, 0], [3, 2], [5, 4]])
    assert both["n"].tolist() == [1, 2, 3]
    assert both["n"].dtype == np.uint32


def test_evaluate_names_the_line_of_an_error(gl: Any) -> None:
    with pytest.raises(ShaderError, match="lumen"):
        evaluate(gl, "colour.glsl", "lumen", {"rgb": np.eye(3)}, "float")
