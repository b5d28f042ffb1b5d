"""The veil of glare on the GPU; what it draws is defined in glare/pyramid.py.

Every level is an RGBA32F texture: half floats end at 65504, R11F_G11F_B10F too, and lamps are
brighter. Processor time on llvmpipe (two 2.5 GHz cores share it), ms, least of twelve, for 60
degrees:

    picture        levels  matrix  blur and add  compose  in all
    1280 x 720       22       2         31          20       80
    1920 x 1080      50       3         55          43      160
    3840 x 2160     168       5         56         153      390

and 0.1 ms for each lamp beside the picture. "compose" reads the frame and writes another one,
which alone takes 33 ms at 1920 x 1080; "levels" is mostly the first one, 16 texels of the frame
for each of its own. The matrix is on the CPU, behind a read of some 2,500 texels.
"""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.eye.observer import Observer
from hdrusd.glare.model import GlareModel
from hdrusd.glare.pyramid import NODES, Pyramid, pyramid
from hdrusd.glare.splats import MARGIN, as_lamps, shown_pixels, splats, taken
from hdrusd.gpu.blending import blending
from hdrusd.gpu.program import Programs, set_uniforms

_DOWN, _LEVEL = "gpu/shaders/glare_down.frag", "gpu/shaders/glare_level.frag"
_VEIL = "gpu/shaders/glare_veil.frag"
_LAMP = "gpu/shaders/glare_lamp.vert", "gpu/shaders/glare_lamp.frag"
_TAKEN = "gpu/shaders/glare_taken.vert", "gpu/shaders/glare_lamp.frag"


class GlarePass:
    """Draws veils on frames of any size; textures of the last size are kept."""

    def __init__(self, ctx: moderngl.Context, programs: Programs) -> None:
        self.ctx = ctx
        self.programs = programs
        self._texels = ctx.sampler(
            repeat_x=False,
            repeat_y=False,
            filter=(moderngl.NEAREST, moderngl.NEAREST),
            border_color=(0.0, 0.0, 0.0, 0.0),
        )
        self._between = ctx.sampler(
            repeat_x=False, repeat_y=False, filter=(moderngl.LINEAR, moderngl.LINEAR)
        )
        self._size = (0, 0)
        self._frames: dict[tuple[str, int], moderngl.Framebuffer] = {}
        self._wide: moderngl.Texture | None = None

    def veil(
        self,
        hdr: moderngl.Texture,
        field: tuple[float, float],
        model: GlareModel,
        observer: Observer,
        lamps: npt.ArrayLike | None = None,
        *,
        rods: bool = False,
    ) -> moderngl.Texture:
        """The veiled picture: RGBA32F of the size of ``hdr``, valid until the next one.

        ``hdr``: RGB(A) float texture in cd/m2, bottom row first; NaN and negative channels
        are black, A stays as it is. ``field``: width and height of the perspective picture,
        degrees. ``lamps`` (n, 6): those that the picture does not hold, and pixels that show
        them all the same (glare/veil.py); they change nothing in a model without a point
        spread. ``rods``: A is white-relative scotopic luminance, and veiled too. Raises
        HdrusdError for a field or lamps that cannot be.
        """
        plan = pyramid(model, observer, hdr.size, field)
        rows = None if lamps is None else as_lamps(lamps)
        if self._size != hdr.size:
            self._forget()
            self._size = hdr.size
        self._halve(hdr, plan, None if lamps is None or not plan.weights.size else lamps)
        veil = self._spread(plan, rows)
        for level in range(plan.last, plan.first - 1, -1):
            if not plan.weights.size:
                break
            if rows is not None:
                self._splat(plan, level, rows)
            veil = self._add(plan, level, veil)
        return self._compose(hdr, plan, veil, rods)

    def release(self) -> None:
        """Give the textures back."""
        self._forget()
        self._texels.release()
        self._between.release()

    # -- steps ---------------------------------------------------------------------------

    def _halve(self, hdr: moderngl.Texture, plan: Pyramid, lamps: npt.ArrayLike | None) -> None:
        start = min(plan.first, 1)
        self._draw(
            self._frame(plan, "level", start),
            _DOWN,
            {"FROM_FRAME": 1, "STEP": start},
            {"below": (hdr, self._texels)},
            {"texel": _texel(hdr)},
        )
        if lamps is not None:
            pixels, texels, shares = taken(start, *shown_pixels(lamps, plan.size, plan.field))
            hdr.use(0)
            points = np.concatenate([pixels, texels, shares], axis=1)
            self._add_points(plan, start, _TAKEN, points, "2f 2f 3f", "pixel", "place", "share")
        for level in range(start + 1, plan.last + 1):
            below = self._texture(plan, "level", level - 1)
            self._draw(
                self._frame(plan, "level", level),
                _DOWN,
                {"STEP": 1},
                {"below": (below, self._texels)},
                {"texel": _texel(below)},
            )

    def _spread(self, plan: Pyramid, lamps: npt.NDArray[Any] | None) -> moderngl.Texture:
        """What is added at the last level by the matrix: few texels, so on the CPU."""
        w, h = plan.level_size(plan.last)
        start = MARGIN - 1
        data = self._frame(plan, "level", plan.last).read(
            viewport=(start, start, w + 2, h + 2), components=4, dtype="f4", alignment=1
        )
        texels = np.frombuffer(data, np.float32).reshape(h + 2, w + 2, 4)
        size = w + 2 * MARGIN, h + 2 * MARGIN
        if self._wide is None or self._wide.size != size:
            if self._wide is not None:
                self._wide.release()
            self._wide = self.ctx.texture(size, 4, dtype="f4")
        around = [(start, start), (start, start), (0, 0)]
        self._wide.write(np.pad(plan.wide_light(texels, lamps), around).tobytes())
        return self._wide

    def _splat(self, plan: Pyramid, level: int, lamps: npt.NDArray[Any]) -> None:
        place, light = splats(level, lamps, plan.size, plan.field)
        points = np.concatenate([place, light], axis=1)
        self._add_points(plan, level, _LAMP, points, "2f 3f", "place", "luminance")

    def _add_points(
        self,
        plan: Pyramid,
        level: int,
        files: tuple[str, str],
        points: npt.NDArray[Any],
        layout: str,
        *names: str,
    ) -> None:
        """Add rows of what a vertex shader of points takes to the texels of a level."""
        if not len(points):
            return
        frame = self._frame(plan, "level", level)
        program = self.programs.get(*files)
        set_uniforms(program, {"size": frame.size})
        buffer = self.ctx.buffer(points.astype(np.float32))
        vertices = self.ctx.vertex_array(program, [(buffer, layout, *names)])
        with self.ctx.scope(frame, moderngl.NOTHING), blending(self.ctx, frame):
            vertices.render(moderngl.POINTS)
        vertices.release()
        buffer.release()

    def _add(self, plan: Pyramid, level: int, veil: moderngl.Texture) -> moderngl.Texture:
        source = self._texture(plan, "level", level)
        coarser = level < plan.last
        corner, sides = plan.plane_steps(level)
        uniforms: dict[str, Any] = {
            "texel": _texel(source),
            "weights": plan.weights[:, level - plan.first],
            "plane_corner": corner,
            "plane_texel": sides,
            "inverse_step": (NODES - 1) / max(1.0 - plan.least, 1e-9),
        }
        if coarser:
            uniforms["veil_texel"] = _texel(veil)
        self._draw(
            self._frame(plan, "veil", level),
            _LEVEL,
            {"COARSER": 1} if coarser else {},
            {
                "source": (source, self._texels),
                "veil": (veil, self._between if coarser else self._texels),
            },
            uniforms,
        )
        return self._texture(plan, "veil", level)

    def _compose(
        self, hdr: moderngl.Texture, plan: Pyramid, veil: moderngl.Texture, rods: bool
    ) -> moderngl.Texture:
        self._draw(
            self._frame(plan, "whole", 0),
            _VEIL,
            {"SCALE": float(1 << plan.first)} | ({"RODS": 1} if rods else {}),
            {"hdr": (hdr, self._texels), "veil": (veil, self._between)},
            {"texel": _texel(hdr), "veil_texel": _texel(veil)},
        )
        return self._texture(plan, "whole", 0)

    # -- what they need ------------------------------------------------------------------

    def _draw(
        self,
        frame: moderngl.Framebuffer,
        fragment: str,
        defines: dict[str, float],
        textures: dict[str, tuple[moderngl.Texture, moderngl.Sampler]],
        uniforms: dict[str, Any],
    ) -> None:
        vertices = self.programs.fullscreen(fragment, {"MARGIN": MARGIN, "NODES": NODES, **defines})
        units = {name: unit for unit, name in enumerate(textures)}
        set_uniforms(vertices.program, {**units, **uniforms})
        for unit, (texture, sampler) in enumerate(textures.values()):
            texture.use(unit)
            sampler.use(unit)
        with self.ctx.scope(frame, moderngl.NOTHING):
            vertices.render(vertices=3)
        for unit, (_, sampler) in enumerate(textures.values()):
            sampler.clear(unit)

    def _frame(self, plan: Pyramid, kind: str, level: int) -> moderngl.Framebuffer:
        """The target of a step; a level has its margin, the whole picture has none."""
        key = kind, level
        if key not in self._frames:
            w, h = plan.level_size(level)
            around = 0 if kind == "whole" else 2 * MARGIN
            texture = self.ctx.texture((w + around, h + around), 4, dtype="f4")
            texture.filter = moderngl.NEAREST, moderngl.NEAREST
            self._frames[key] = self.ctx.framebuffer([texture])
        return self._frames[key]

    def _texture(self, plan: Pyramid, kind: str, level: int) -> moderngl.Texture:
        (texture,) = self._frame(plan, kind, level).color_attachments
        assert isinstance(texture, moderngl.Texture)
        return texture

    def _forget(self) -> None:
        for frame in self._frames.values():
            for texture in frame.color_attachments:
                texture.release()
            frame.release()
        self._frames.clear()
        if self._wide is not None:
            self._wide.release()
            self._wide = None


def _texel(texture: moderngl.Texture) -> tuple[float, float]:
    return 1.0 / texture.width, 1.0 / texture.height
