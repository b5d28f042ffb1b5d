"""Step two of shader 1: every light on every pixel that shows a surface.

The screen is cut into tiles. A tile knows how near and far its surfaces are and
whether they shine, so that a dull tile is not charged for highlights and a tile
outside of a beam not for the lamp. A batch of lights reaches the pixels of a
rectangle of tiles as flat varyings of one instance, which on a software device cost
a third of reading a buffer in every pixel. Batches add up by blending.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import Any, Literal

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.batches import Draws, Lists, batches
from hdrusd.gpu.light_tables import Extras, LightClass, light_classes
from hdrusd.gpu.program import Programs
from hdrusd.gpu.release import release
from hdrusd.gpu.surfaces import set_used
from hdrusd.gpu.tiles import LightLists, TileList, tile_balls
from hdrusd.photometry.lighttree import has_beam
from hdrusd.scene import Camera, Material, RenderScene

Ints = npt.NDArray[np.int32]
LightMode = Literal["auto", "exact", "merged"]
Bind = Callable[[moderngl.Program, Sequence[str]], None]

#: Side of a tile, pixels.
TILE = 32

#: Lights above which far ones are merged in the mode "auto".
MANY = 64

#: Lamps with a beam from which on it pays to ask which tiles they reach.
FEW = 4

#: Texels a row of the tables that vertices read; every device has as many.
_WIDTH = 2048

#: Texture units, after those of the G-buffer.
TABLE_UNIT, ORDER_UNIT, SHADOW_UNIT, PROFILE_UNIT = 5, 6, 7, 8

#: Points of an area light whose shadows are looked at.
SAMPLES = 16

#: Bits of a tile's highlights, and the #defines for them.
_GLOSS: dict[int, tuple[str, ...]] = {0: (), 1: ("BLINN",), 2: ("GGX",), 3: ("BLINN", "GGX")}

#: Lamps without and with a cone that may share a batch, those of one make first.
_LAMPS, _BEAMS = (("LAMPS",), ("PLAIN",)), (("BEAMS",), ("CONES",))


@dataclass(frozen=True, slots=True, eq=False)
class TileBounds:
    """What the tiles show, each (rows, columns), bottom row first; tile_bounds.frag."""

    near: npt.NDArray[np.float32]  # m along the view axis; above ``far`` where nothing is seen
    far: npt.NDArray[np.float32]
    lobe: npt.NDArray[np.float32]  # narrowest highlight, rad
    gloss: npt.NDArray[np.int32]  # 1 Blinn-Phong, 2 GGX, 3 both


class LightPass:
    """Adds lights to a frame from its G-buffer."""

    def __init__(
        self,
        ctx: moderngl.Context,
        programs: Programs,
        size: tuple[int, int],
        scale: float,
        mode: LightMode = "auto",
    ) -> None:
        self.ctx = ctx
        self.mode = mode
        self.programs = programs
        self.size = size
        self.scale = scale
        self._lists = LightLists()
        # Two vec4 are the place in the window and its ray. OpenGL 3.3 grants 16, most devices 32.
        names = ("GL_MAX_VERTEX_OUTPUT_COMPONENTS", "GL_MAX_FRAGMENT_INPUT_COMPONENTS")
        self._varyings = min(int(ctx.info.get(name, 64)) for name in names) // 4 - 2
        self._grid = (-(-size[0] // TILE), -(-size[1] // TILE))
        self._bounds = ctx.texture(self._grid, 4, dtype="f4")
        self._bounds_frame = ctx.framebuffer([self._bounds])
        self._areas = ctx.buffer(reserve=1 << 16, dynamic=True)
        self._list_buffer = ctx.buffer(reserve=1 << 16, dynamic=True)
        self._vaos: dict[moderngl.Program, moderngl.VertexArray] = {}

    def add(
        self,
        scene: RenderScene,
        layers: Mapping[str, moderngl.Texture],
        frame: moderngl.Framebuffer,
        extras: Extras | None = None,
        bind: Bind | None = None,
    ) -> None:
        """All lights of a scene into ``frame`` (blended, depth kept).

        ``layers``: the G-buffer by the names of its samplers. ``bind``: sets what the
        extras need in a program with these #defines.
        """
        merge = self._may_merge(scene.lights, extras)
        table = _Table(self.ctx, self._lists.update(scene.lights, merge), scene.camera, extras)
        if not table.classes:
            return
        dielectric = common_dielectric(scene.materials)
        alike = dielectric is not None and not table.merged
        glossy: tuple[str, ...] = ()
        if not alike and any(map(shines, scene.materials)):
            glossy = ("GLOSSY",) if dielectric is None else ("GLOSSY", "DIELECTRIC")
            if dielectric is None and "g_extra" in layers:  # a coat shines on a matt surface too
                glossy += ("COATED",)
        bounds = self.tile_bounds(layers, glossy)
        if alike:
            bounds = replace(bounds, gloss=np.full_like(bounds.gloss, 2))
        bumped = any(material.normal_map is not None for material in scene.materials)
        regions = self._regions(table, bounds, scene.camera)
        ctx = self.ctx
        frame.use()
        ctx.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
        ctx.depth_func = ">"
        ctx.blend_func = moderngl.ONE, moderngl.ONE
        frame.depth_mask = False
        uniforms = {name: unit for unit, name in enumerate(layers)} | {
            "lights": TABLE_UNIT,
            "order": ORDER_UNIT,
            "lambert_scale": self.scale,
            "size": self.size,
        }
        uniforms |= window_uniforms(scene.camera)
        for unit, layer in enumerate(layers.values()):
            layer.use(unit)
        table.texture.use(TABLE_UNIT)
        if dielectric is not None:
            uniforms["dielectric"] = dielectric
        try:
            for region in regions:
                names = list(_GLOSS[region.gloss])
                if 2 & region.gloss:
                    names += ["COATED"] if "g_extra" in layers else []
                    names += ["DIELECTRIC"] if dielectric is not None else []
                names += ["ORTHOGRAPHIC"] if scene.camera.orthographic else []
                names += ["BUMPED"] if bumped else []
                self._add_classes(table, region, names, uniforms, bind)
        finally:
            table.texture.release()
            frame.depth_mask = True
            ctx.enable_only(moderngl.NOTHING)

    def release(self) -> None:
        """Give the GPU's memory back."""
        release(self._vaos, self._areas, self._list_buffer, self._bounds_frame, self._bounds)

    @property
    def merged(self) -> int:
        """How many lamps of the last frame may have been seen as one with others."""
        return self._lists.in_trees

    def merges(self, lights: npt.NDArray[np.void]) -> bool:
        """Whether far lamps of these are taken together."""
        return self.mode == "merged" or (self.mode == "auto" and len(lights) > MANY)

    def _may_merge(
        self, lights: npt.NDArray[np.void], extras: Extras | None
    ) -> npt.NDArray[np.bool_]:
        if not self.merges(lights):
            return np.zeros(len(lights), np.bool_)
        if extras is None:
            return np.ones(len(lights), np.bool_)
        return np.asarray((extras.shadow_kind == "") & (extras.profile_kind == ""))

    def _regions(self, table: _Table, bounds: TileBounds, camera: Camera) -> list[_Region]:
        """The screen by highlights, and which lights reach what part of it."""
        seen = bounds.far > 0.0
        if table.merged or table.beams >= FEW:
            row, column = np.nonzero(seen)
            corners = np.stack([column, row, column + 1, row + 1], axis=1) * TILE
            areas = np.minimum(corners, [*self.size, *self.size]).astype(np.int32)
            gloss = bounds.gloss[seen]
            lobe = np.where(gloss > 0, bounds.lobe[seen], np.inf).astype(np.float32)
            tiles = tile_balls(areas, bounds.near[seen], bounds.far[seen], lobe, self.size, camera)
            found = self._lists.lists(table.kinds, tiles, camera.eye)
            return [
                _Region(
                    int(kind),
                    areas[gloss == kind],
                    {k: table.of_tiles(each, gloss == kind) for k, each in found.items()},
                )
                for kind in np.unique(gloss)
            ]
        regions = []
        for kind in np.unique(bounds.gloss[seen]):
            areas = runs(seen & (bounds.gloss == kind), self.size)
            regions.append(_Region(int(kind), areas, table.everywhere(len(areas))))
        return regions

    def tile_bounds(
        self, layers: Mapping[str, moderngl.Texture], glossy: Sequence[str] = ()
    ) -> TileBounds:
        """Reduce the G-buffer to its tiles and read that; ``glossy``: #defines."""
        defines: dict[str, Any] = {"TILE": TILE} | dict.fromkeys(glossy, 1)
        vao = self.programs.fullscreen("gpu/shaders/tile_bounds.frag", defines)
        self._bounds_frame.use()
        self.ctx.enable_only(moderngl.NOTHING)
        for unit, name in enumerate(layers):
            layers[name].use(unit)
            set_used(vao.program, name, unit)
        vao.render(moderngl.TRIANGLES, vertices=3)
        columns, rows = self._grid
        found = np.frombuffer(self._bounds.read(), np.float32).reshape(rows, columns, 4)
        near, far, lobe, gloss = np.moveaxis(found, -1, 0)
        return TileBounds(near, far, lobe, gloss.astype(np.int32))

    def _add_classes(
        self,
        table: _Table,
        region: _Region,
        names: Sequence[str],
        uniforms: Mapping[str, Any],
        bind: Bind | None,
    ) -> None:
        """All lights on a region, whose surfaces have one kind of highlight."""
        nothing = Lists.same(np.zeros(0, np.int32), len(region.areas))
        for first, second in table.pairs():
            kind = None if first is None else table.classes[first]
            coned = None if second is None else table.classes[second]
            lists = nothing if first is None else region.lists.get(first, nothing)
            coned_lists = nothing if second is None else region.lists.get(second, nothing)
            order = np.concatenate([lists.order, coned_lists.order])
            if not len(order):
                continue
            texture = _texture(self.ctx, order, "i4")
            texture.use(ORDER_UNIT)
            own = {**uniforms, "dark": (table.dark(first), table.dark(second))}
            own |= (dict(kind.uniforms) if kind else {}) | (dict(coned.uniforms) if coned else {})
            for draws in batches(
                lists,
                kind.batches(self._varyings, lists.alike) if kind is not None else (1,),
                kind.rows if kind is not None else 1,
                coned_lists.after(len(lists.order)),
                coned.batches(self._varyings, coned_lists.alike) if coned is not None else (1,),
                coned.rows if coned is not None else 1,
                self._varyings,
            ):
                program = self._program(kind, coned, draws.sizes, names)
                for name, value in own.items():
                    set_used(program, name, value)
                if bind is not None and kind is not None:
                    bind(program, kind.defines)
                self._draw(program, region.areas, draws)
            texture.release()

    def _program(
        self,
        kind: LightClass | None,
        coned: LightClass | None,
        sizes: tuple[int, int],
        names: Sequence[str],
    ) -> moderngl.Program:
        used = [c if size else None for c, size in zip((kind, coned), sizes, strict=True)]
        defines: dict[str, str | int | float] = {}
        for which, each, size in zip(("FIRST", "CONED"), used, sizes, strict=True):
            defines[which] = size
            defines[f"{which}_ROWS"] = each.rows if each is not None else 0
            # Applies the macro X to each of them.
            defines[f"ALL_{which}(X)"] = " ".join(f"X({k})" for k in range(size))
        own = [name for each in used if each is not None for name in each.defines]
        if "SHADOWED" in own:
            defines["SAMPLES"] = SAMPLES
        defines |= dict.fromkeys((*own, *names), 1)
        return self.programs.get("gpu/shaders/light.vert", "gpu/shaders/light.frag", defines)

    def _draw(self, program: moderngl.Program, areas: Ints, draws: Draws) -> None:
        for buffer, data in (
            (self._areas, areas[draws.rectangles]),
            (self._list_buffer, draws.lists),
        ):
            if buffer.size < data.nbytes:
                buffer.orphan(2 * data.nbytes)
            buffer.write(np.ascontiguousarray(data, np.int32))
        if program not in self._vaos:
            content = [(self._areas, "4i /i", "in_area"), (self._list_buffer, "4i /i", "in_list")]
            self._vaos[program] = self.ctx.vertex_array(program, content)
        instances = len(draws.rectangles)
        self._vaos[program].render(moderngl.TRIANGLE_STRIP, vertices=4, instances=instances)


@dataclass(frozen=True, slots=True, eq=False)
class _Region:
    """Rectangles of the screen with one kind of highlight, and their lights by class."""

    gloss: int
    areas: Ints  # (k, 4)
    lists: dict[int, Lists]


class _Table:
    """The texels of all classes one after the other, in a texture.

    ``lights``: those of the scene, to which ``extras`` belongs, and then merged ones.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        lights: npt.NDArray[np.void],
        camera: Camera,
        extras: Extras | None,
    ) -> None:
        count = 0 if extras is None else len(extras.shadow_kind)
        self.merged = extras is not None and len(lights) > count
        more = None if extras is None else extras.followed_by(len(lights) - count)
        self.classes = light_classes(lights, camera, more)
        self.kinds = np.full(len(lights), -1, np.int32)
        self._starts = np.zeros(len(lights), np.int32)
        self._dark = []
        begin = 0
        for number, kind in enumerate(self.classes):
            self.kinds[kind.members] = number
            self._starts[kind.members] = begin + np.arange(len(kind.members)) * kind.rows
            begin += len(kind.texels) * kind.rows
            self._dark.append(begin - kind.rows)
        self.beams = int(np.count_nonzero(has_beam(lights[self.kinds >= 0])))
        if self.classes:
            texels = np.concatenate([kind.texels.reshape(-1, 4) for kind in self.classes])
            self.texture = _texture(ctx, texels, "f4")

    def dark(self, number: int | None) -> int:
        """Where the light of a class begins that is not there."""
        return 0 if number is None else self._dark[number]

    def everywhere(self, rectangles: int) -> dict[int, Lists]:
        """Every light for every rectangle."""
        return {
            number: Lists.same(self._starts[kind.members], rectangles)
            for number, kind in enumerate(self.classes)
        }

    def of_tiles(self, found: TileList, chosen: npt.NDArray[np.bool_]) -> Lists:
        """The lists of some of the tiles."""
        return Lists(self._starts[found.rows], found.first[chosen], found.count[chosen])

    def pairs(self) -> list[tuple[int | None, int | None]]:
        """What is drawn together: lamps without and with a cone, each other class alone."""
        named = {kind.defines: number for number, kind in enumerate(self.classes)}
        plain = [named.pop(name) for name in _LAMPS if name in named]
        coned = [named.pop(name) for name in _BEAMS if name in named]
        rest: list[tuple[int | None, int | None]] = [(number, None) for number in named.values()]
        return [*zip_longest(plain, coned), *rest]


def shines(material: Material) -> bool:
    """Whether a surface can have a highlight."""
    values = any(material.specular) or material.metallic > 0.0 or material.clearcoat > 0.0
    maps = (material.specular_map, material.metallic_map, material.clearcoat_map)
    return values or any(use is not None for use in maps)


def common_dielectric(materials: Sequence[Material]) -> float | None:
    """The reflectance at normal incidence that all surfaces have in common, None of metals.

    Most stages leave it at 4 %; then no pixel needs to look it up, and it has no colour.
    """
    values = {m.specular for m in materials}
    plain = all(
        m.model == "ggx" and m.metallic == 0.0 and m.clearcoat == 0.0
        and m.specular_map is None and m.metallic_map is None and m.clearcoat_map is None
        for m in materials
    )  # fmt: skip
    if len(values) != 1 or not plain:
        return None
    r, g, b = values.pop()
    return r if r == g == b and r > 0.0 else None


def common_specular(materials: Sequence[Material]) -> float | None:
    """What all surfaces have for g_specular, without colour and none of it metal; else None."""
    return common_dielectric(materials) if any(map(shines, materials)) else 0.0


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
    """Values in rows of one width: (n, 4) float32 texels, or (n,) int32 numbers."""
    channels = 4 if values.ndim == 2 else 1
    flat = values.reshape(-1, channels)
    tallest = int(ctx.info["GL_MAX_TEXTURE_SIZE"])
    width = min(max(len(flat), 1), max(_WIDTH, -(-len(flat) // tallest)))
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
