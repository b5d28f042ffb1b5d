"""A context where there is a driver, and one clear line where there is none."""

from __future__ import annotations

import json
from typing import Any

import moderngl
import pytest

from hdrusd.errors import ContextError
from hdrusd.gpu.context import create_context, describe


def test_context_can_draw_at_once(gl: Any) -> None:
    # Without a bound framebuffer this leaves GL_INVALID_FRAMEBUFFER_OPERATION (fixture).
    program = gl.program(
        vertex_shader="#version 330\nout float x;\nvoid main() { x = 2.0; }", varyings=["x"]
    )
    captured = gl.buffer(reserve=4)
    gl.vertex_array(program, []).transform(captured, vertices=1)
    assert captured.read() == b"\x00\x00\x00\x40"


def test_two_contexts(gl: Any) -> None:
    other = create_context()
    assert other.fbo is other.extra["framebuffer"]
    with gl:
        assert gl.buffer(b"mine").read() == b"mine"
    other.release()


def test_describe(gl: Any) -> None:
    about = describe(gl)
    assert about["version_code"] >= 330
    assert about["renderer"]
    # OpenGL 3.3, table 6.40: at least 1024, and 16 KiB.
    assert about["max_texture_size"] >= 1024
    assert about["max_uniform_block_size"] >= 16384
    assert json.loads(json.dumps(about)) == about


def test_software_device_is_called_so(gl: Any) -> None:
    assert describe(gl)["software"] == ("llvmpipe" in gl.info["GL_RENDERER"].lower())


def test_no_driver(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(**_: Any) -> None:
        raise Exception("libEGL.so not\nloaded")

    monkeypatch.setattr(moderngl, "create_context", fail)
    with pytest.raises(ContextError) as caught:
        create_context()
    message = str(caught.value)
    assert "\n" not in message
    assert "libEGL.so not loaded" in message
    assert "apt-get install libegl1 libgl1-mesa-dri" in message
    assert caught.value.exit_code == 5


def test_too_old_a_driver(monkeypatch: pytest.MonkeyPatch, gl: Any) -> None:
    monkeypatch.setattr("hdrusd.gpu.context.REQUIRED", 990)
    with pytest.raises(ContextError, match=r"OpenGL 3\.3 through EGL: none here"):
        create_context()
