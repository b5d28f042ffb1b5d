"""Step two of shader 1: every light on every pixel that shows a surface.

The screen is cut into tiles. A tile knows how near and far its surfaces are and
whether they shine, so that a dull tile is not charged for highlights and a tile
outside of a beam not for the lamp. A batch of lights reaches the pixels of a
rectangle of tiles as flat varyings of one instance, which on a software device cost
a third of reading a buffer in every pixel. Batches add up by blending.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.light_tables import Extras, LightClass, light_classes
from hdrusd.gpu.program import Programs
from hdrusd.gpu.surfaces import set_used
from hdrusd.scene import Camera, Material, RenderScene

Ints = npt.NDArray[np.int32]

#: Side of a tile, pixels.
TILE = 32

#: Texels a row of the tables that vertices read; every device has as many.
_WIDTH = 2048

#: Texture units, after those of the G-buffer; 7 and up are for what a light's extras need.
TABLE_UNIT, ORDER_UNIT = 5, 6

#: Bits of a tile's highlights, and the #defines for them.
_GLOSS: dict[int, tuple[str, ...]] = {0: (), 1: ("BLINN",), 2: ("GGX",), 3: ("BLINN", "GGX")}


@dataclass(frozen=True, slots=True, eq=False)
class TileBounds:
    """What the tiles show, (rows, columns, 4), bottom row first; tile_bounds.frag."""

    near: npt.NDArray[np.float32]  # m along the view axis; above ``far`` where nothing is seen
    far: npt.NDArray[np.float32]
    lobe: npt.NDArray[np.float32]  # narrowest highlight, rad
    gloss: npt.NDArray[np.int32]  # 1 Blinn-Phong, 2 GGX, 3 both


@dataclass(frozen=True, slots=True, eq=False)
class Batches:
    """Rectangles and their lights for one gloss: one instanced draw for each batch size."""

    areas: Ints  # (k, 4) left, bottom, right, top, pixels
    lists: Ints  # (k, 2) where in ``order`` they begin, lights in them
    order: Ints  # numbers of lights in the class's table


class LightPass:
    """Adds lights to a frame from its G-buffer."""

    def __init__(
        self, ctx: moderngl.Context, programs: Programs, size: tuple[int, int], scale: float
    ) -> None:
        self.ctx = ctx
        self.programs = programs
        self.size = size
        self.scale = scale
        self._grid = (-(-size[0] // TILE), -(-size[1] // TILE))
        self._bounds = ctx.texture(self._grid, 4, dtype="f4")
        self._bounds_frame = ctx.framebuffer([self._bounds])
        self._areas = ctx.buffer(reserve=1 << 16, dynamic=True)
        self._lists = ctx.buffer(reserve=1 << 15, dynamic=True)
        self._vaos: dict[moderngl.Program, moderngl.VertexArray] = {}

    def add(
        self,
        scene: RenderScene,
        layers: Mapping[str, moderngl.Texture],
        frame: moderngl.Framebuffer,
        extras: Extras | None = None,
        bind: Callable[[moderngl.Program], None] | None = None,
    ) -> None:
        """All lights of a scene into ``frame`` (blended, depth kept).

        ``layers``: the G-buffer by the names of its samplers. ``bind``: sets what the
        extras need in a program.
        """
        classes = light_classes(scene.lights, scene.camera, extras)
        if not classes:
            return
        bounds = self.tile_bounds(layers, any(shines(m) for m in scene.materials))
        ctx = self.ctx
        frame.use()
        ctx.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
        ctx.depth_func = ">"
        ctx.blend_func = moderngl.ONE, moderngl.ONE
        frame.depth_mask = False
        units = {name: unit for unit, name in enumerate(layers)}
        for name, unit in units.items():
            layers[name].use(unit)
        shared: dict[str, Any] = {"lambert_scale": self.scale, "size": self.size}
        shared |= units | window_uniforms(scene.camera)
        coated = "g_extra" in layers
        for kind in classes:
            self._add_class(kind, bounds, shared, coated, bind)
        frame.depth_mask = True
        ctx.enable_only(moderngl.NOTHING)

    def tile_bounds(self, layers: Mapping[str, moderngl.Texture], glossy: bool) -> TileBounds:
        """Reduce the G-buffer to its tiles and read that."""
        defines: dict[str, Any] = {"TILE": TILE} | ({"GLOSSY": 1} if glossy else {})
        vao = self.programs.fullscreen("gpu/shaders/tile_bounds.frag", defines)
        self._bounds_frame.use()
        self.ctx.enable_only(moderngl.NOTHING)
        for unit, name in enumerate(layers):
            layers[name].use(unit)
            set_used(vao.program, name, unit)
        vao.render(moderngl.TRIANGLES, vertices=3)
        columns, rows = self._grid
        found = np.frombuffer(self._bounds.read(), np.float32).reshape(rows, columns, 4)
        return TileBounds(
            found[..., 0], found[..., 1], found[..., 2], found[..., 3].astype(np.int32)
        )

    def _add_class(
        self,
        kind: LightClass,
        bounds: TileBounds,
        shared: dict[str, Any],
        coated: bool,
        bind: Callable[[moderngl.Program], None] | None,
    ) -> None:
        table = _texture(self.ctx, kind.texels, "f4")
        table.use(TABLE_UNIT)
        for gloss, defines in _GLOSS.items():
            batches = exact_batches(kind, bounds, gloss, self.size)
            if not len(batches.areas):
                continue
            order = _texture(self.ctx, batches.order, "i4")
            order.use(ORDER_UNIT)
            sizes = np.searchsorted(kind.batches, batches.lists[:, 1])
            names = (*kind.defines, *defines, *(("COATED",) if coated and 2 & gloss else ()))
            for number in np.unique(sizes):
                batch = kind.batches[number]
                program = self._program(kind.rows, batch, names)
                own = {"lights": TABLE_UNIT, "order": ORDER_UNIT, "count": len(kind.members)}
                for name, value in (shared | own).items():
                    set_used(program, name, value)
                if bind is not None:
                    bind(program)
                chosen = sizes == number
                self._draw(program, batches.areas[chosen], batches.lists[chosen])
            order.release()
        table.release()

    def _program(self, rows: int, batch: int, names: Sequence[str]) -> moderngl.Program:
        defines: dict[str, str | int | float] = {"ROWS": rows, "BATCH": batch, "ALL": f"ALL{batch}"}
        defines |= dict.fromkeys(names, 1)
        return self.programs.get("gpu/shaders/light.vert", "gpu/shaders/light.frag", defines)

    def _draw(self, program: moderngl.Program, areas: Ints, lists: Ints) -> None:
        for buffer, data in ((self._areas, areas), (self._lists, lists)):
            if buffer.size < data.nbytes:
                buffer.orphan(2 * data.nbytes)
            buffer.write(np.ascontiguousarray(data, np.int32))
        if program not in self._vaos:
            content = [(self._areas, "4i /i", "in_area"), (self._lists, "2i /i", "in_list")]
            self._vaos[program] = self.ctx.vertex_array(program, content)
        self._vaos[program].render(moderngl.TRIANGLE_STRIP, vertices=4, instances=len(areas))


def shines(material: Material) -> bool:
    """Whether a surface can have a highlight."""
    values = any(material.specular) or material.metallic > 0.0 or material.clearcoat > 0.0
    maps = (material.specular_map, material.metallic_map, material.clearcoat_map)
    return values or any(use is not None for use in maps)


def exact_batches(
    kind: LightClass, bounds: TileBounds, gloss: int, size: tuple[int, int]
) -> Batches:
    """Every light of a class on every tile of that gloss."""
    areas = runs(np.where(bounds.far > 0.0, bounds.gloss, -1) == gloss, size)
    count = len(kind.members)
    first = np.arange(0, count, kind.batches[-1], dtype=np.int32)
    lists = np.stack([first, np.minimum(count - first, kind.batches[-1])], axis=1)
    return Batches(
        areas=np.repeat(areas, len(lists), axis=0),
        lists=np.tile(lists, (len(areas), 1)).astype(np.int32),
        order=np.arange(count, dtype=np.int32),
    )


def runs(chosen: npt.NDArray[np.bool_], size: tuple[int, int]) -> Ints:
    """(k, 4) rectangles in pixels that cover the chosen tiles, neighbours in a row joined."""
    edges = np.diff(np.pad(chosen.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    row, left = np.nonzero(edges > 0)
    _, right = np.nonzero(edges < 0)
    areas = np.stack([left, row, right, row + 1], axis=1) * TILE
    return np.minimum(areas, [*size, *size]).astype(np.int32)


def _texture(
    ctx: moderngl.Context, values: npt.NDArray[np.generic], dtype: str
) -> moderngl.Texture:
    """Values in rows of one width: (n, rows, 4) float32 texels, or (n,) int32 numbers."""
    channels = 4 if values.ndim == 3 else 1
    flat = values.reshape(-1, channels)
    width = min(max(len(flat), 1), _WIDTH)
    height = max(-(-len(flat) // width), 1)
    full = np.zeros((height * width, channels), flat.dtype)
    full[: len(flat)] = flat
    texture = ctx.texture((width, height), channels, full, dtype=dtype)
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def window_uniforms(camera: Camera) -> dict[str, Any]:
    """What gbuffer.glsl needs to find a pixel's place again: its ray, in world directions."""
    right, up = np.asarray(camera.right), np.asarray(camera.up)
    left, far_right, bottom, top = camera.window
    return {
        "ray_origin": tuple(left * right + bottom * up),
        "ray_x": tuple((far_right - left) * right),
        "ray_y": tuple((top - bottom) * up),
        "forward": tuple(-np.asarray(camera.back)),
        "orthographic": camera.orthographic,
    }
