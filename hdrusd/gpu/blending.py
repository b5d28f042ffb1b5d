"""States of OpenGL for a while: given back whatever happens in between."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import moderngl


@contextmanager
def blending(
    ctx: moderngl.Context,
    frame: moderngl.Framebuffer,
    factors: tuple[int, int] = (moderngl.ONE, moderngl.ONE),
    *,
    depth: str = "",
) -> Iterator[None]:
    """Draw into ``frame``, blended, adding up unless ``factors`` say otherwise.

    ``depth``: the comparison with its depths, which are not written; "" for none.
    """
    frame.use()
    ctx.enable_only(moderngl.BLEND | (moderngl.DEPTH_TEST if depth else moderngl.NOTHING))
    ctx.blend_func = factors
    if depth:
        ctx.depth_func = depth
    frame.depth_mask = False
    try:
        yield
    finally:
        frame.depth_mask = True
        ctx.enable_only(moderngl.NOTHING)
