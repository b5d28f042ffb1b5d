"""An OpenGL 3.3 context through EGL, without a window or a display."""

from __future__ import annotations

import ctypes.util
from typing import Any

import moderngl

from hdrusd.errors import ContextError

#: OpenGL 3.3 core: what everything here is written for.
REQUIRED = 330

_INSTALL = "install a driver with EGL (Debian, Ubuntu: apt-get install libegl1 libgl1-mesa-dri)"


def create_context() -> moderngl.Context:
    """Make a context and make it current in this thread.

    A surfaceless context has no framebuffer, and without one every draw fails
    with GL_INVALID_FRAMEBUFFER_OPERATION, transform feedback included: a small
    one is bound and kept alive in ``ctx.extra["framebuffer"]``. Who binds another
    for a while gives it back (``ctx.scope``).

    Raises ContextError when there is no EGL, no driver, or none with OpenGL 3.3.
    """
    settings: dict[str, Any] = {"backend": "egl"}
    if ctypes.util.find_library("GL") is None:
        # glcontext opens libGL too, which a machine without X may lack; libEGL does in its place.
        settings["libgl"] = ctypes.util.find_library("EGL")
    try:
        ctx = moderngl.create_context(require=REQUIRED, standalone=True, **settings)
    except Exception as error:  # glcontext raises nothing more precise
        reason = " ".join(str(error).split())
        raise ContextError(f"OpenGL 3.3 through EGL: none here ({reason}); {_INSTALL}") from error
    resting = ctx.simple_framebuffer((4, 4))
    resting.use()
    ctx.extra = {"framebuffer": resting}
    return ctx


def describe(ctx: moderngl.Context) -> dict[str, Any]:
    """What the device is and what it grants; plain values, ready for JSON."""
    info = ctx.info
    renderer = str(info["GL_RENDERER"])
    return {
        "vendor": str(info["GL_VENDOR"]),
        "renderer": renderer,
        "version": str(info["GL_VERSION"]),
        "version_code": int(ctx.version_code),
        "software": any(name in renderer.lower() for name in ("llvmpipe", "softpipe", "swrast")),
        "max_texture_size": int(info["GL_MAX_TEXTURE_SIZE"]),
        "max_uniform_block_size": int(info["GL_MAX_UNIFORM_BLOCK_SIZE"]),
    }
