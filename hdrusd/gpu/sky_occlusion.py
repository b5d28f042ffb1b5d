"""Sky light past what stands in its way: ``SkyOcclusion``, for rooms and streets by day.

The sky is seen from a number of directions that share the sphere evenly. From each of
them the casters are drawn from outside of everything into a tile of a depth texture,
without perspective, and every pixel of the picture looks up whether that direction
reaches it. The lux under open sky times the share that arrives is the result, so that
where nothing stands in the way it is what it is without this.

Error: the share of the sky that is seen through an opening is counted in whole
directions; through one that fills 5 % of a surface's sky 1024 directions are good to
12 %, 4096 to 3 % and 16384 to 1 % (the truth set's roof opening). A tile is spread over
all surfaces in the picture: what is smaller than its texels (the finding
"sky-occlusion" has their size) does not shade.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef
from hdrusd.gpu.blending import blending
from hdrusd.gpu.casters import Casters
from hdrusd.gpu.lights import window_uniforms
from hdrusd.gpu.program import Programs
from hdrusd.gpu.release import release
from hdrusd.gpu.shadow_drawing import TileDrawing, Tiles
from hdrusd.gpu.sky import SkyPass
from hdrusd.gpu.surfaces import set_used
from hdrusd.report import Kind, Report
from hdrusd.scene import RenderScene

Doubles = npt.NDArray[np.float64]

#: Directions that one pass over the picture looks up: 16 floats each of the 1024 uniforms that
#: OpenGL 3.3 grants.
BATCH = 32

#: Tiles drawn together: their side in texels, and how many stand side by side.
TILE, _GRID = 256, (8, 4)

#: Texels around what a tile is for.
_BORDER = 2

#: How far from the surfaces a caster may be, in half sizes of what is seen.
_FARTHEST = 1000.0


class SkyOcclusion:
    """Adds the sky's diffuse light; surfaces must have been drawn with it apart.

    ``casters``: taken as they are, of the moment that is drawn. ``report`` takes one finding
    with the size of a texel in the first frame.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        programs: Programs,
        casters: Casters,
        skies: SkyPass,
        size: tuple[int, int],
        scale: float,
        samples: int,
        report: Report,
        place: SourceRef | None = None,
    ) -> None:
        self.ctx = ctx
        self.programs = programs
        self.skies = skies
        self.size = size
        self.scale = scale
        self.report = report
        self.place = place or SourceRef(Path())
        self._said = False
        self.directions = even_directions(samples)
        self._casters = casters
        self._tiles = TileDrawing(ctx, programs)
        #: Sums of sky_occlusion.frag, for ``SkyPass.add_mirrored``; after ``add``.
        self.arriving = ctx.texture(size, 4, dtype="f4")
        self.arriving.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._sum = ctx.framebuffer([self.arriving])
        self._vaos: dict[moderngl.Program, moderngl.VertexArray] = {}

    def release(self) -> None:
        """Give the GPU's memory back, but for that of the casters."""
        release(self._tiles, self._sum, self.arriving, self._vaos)

    def add(
        self,
        scene: RenderScene,
        layers: Mapping[str, moderngl.Texture],
        frame: moderngl.Framebuffer,
    ) -> None:
        """The sky's light on the surfaces of a G-buffer, into ``frame`` (blended).

        ``layers``: the G-buffer by the names of its samplers, with g_scattered.
        """
        box = self._surfaces(scene, layers["g_normal"])
        luminance = self.skies.luminance(scene, self.directions)
        bright = np.any(luminance > 0.0, axis=1)
        if box is None or not bright.any():
            return
        self._sum.use()
        self._sum.clear()
        self._look_up(scene, layers, box, self.directions[bright], luminance[bright])
        self._finish(scene, layers, frame)

    def _surfaces(self, scene: RenderScene, normals: moderngl.Texture) -> Doubles | None:
        """(2, 3) lowest and highest corner of what is seen, m from the eye; None for nothing."""
        width, height = self.size
        found = np.frombuffer(normals.read(), np.float32).reshape(height, width, 4)
        depth = found[..., 3].astype(np.float64)
        if not (depth > 0.0).any():
            return None
        window = window_uniforms(scene.camera)
        x = ((np.arange(width) + 0.5) / width)[None, :, None] * np.asarray(window["ray_x"])
        y = ((np.arange(height) + 0.5) / height)[:, None, None] * np.asarray(window["ray_y"])
        across = np.asarray(window["ray_origin"]) + x + y
        if not window["orthographic"]:
            across = across * depth[..., None]
        points = across + depth[..., None] * np.asarray(window["forward"])
        points = points[depth > 0.0]
        return np.array([points.min(axis=0), points.max(axis=0)])

    def _look_up(
        self,
        scene: RenderScene,
        layers: Mapping[str, moderngl.Texture],
        box: Doubles,
        directions: Doubles,
        luminance: Doubles,
    ) -> None:
        """The sums of sky_occlusion.frag over all directions."""
        program = self.programs.get(
            "gpu/shaders/sky.vert", "gpu/shaders/sky_occlusion.frag", {"BATCH": BATCH}
        )
        columns, rows = _GRID
        size = columns * TILE, rows * TILE
        self._tiles.resize(size)
        eye = np.asarray(scene.camera.eye) - self._casters.origin
        views = Views(box + eye, self._casters.bounds(), directions)
        self._say(views.texel)
        groups = [*self._casters.still, *self._casters.moving]
        number = np.arange(BATCH)
        squares = TILE * np.column_stack([number % columns, number // columns, number * 0 + 1])
        for first in range(0, len(directions), BATCH):
            chosen = slice(first, first + BATCH)
            count = len(directions[chosen])
            self._tiles.draw(views.tiles(chosen, squares[:count]), groups)
            values = {
                **views.uniforms(chosen, squares[:count], eye),
                "shining": np.append(luminance[chosen], views.scales(chosen), axis=1),
            }
            # A batch that is not full is filled with darkness.
            full = {name: _filled(value) for name, value in values.items()}
            self._tiles.use(len(layers))
            values = {"inverse_size": 1.0 / np.array(size), **full}
            units = {"depths": len(layers), "texel": views.texel}
            with blending(self.ctx, self._sum):
                self._draw(program, scene, layers, units | values)

    def _finish(
        self,
        scene: RenderScene,
        layers: Mapping[str, moderngl.Texture],
        frame: moderngl.Framebuffer,
    ) -> None:
        program = self.programs.get("gpu/shaders/sky.vert", "gpu/shaders/sky_light.frag", {})
        self.arriving.use(len(layers))
        values = {
            "arriving": len(layers),
            "sky_lux": self.skies.lux_coefficients(scene),
            "lambert_scale": self.scale,
        }
        with blending(self.ctx, frame, depth=">"):
            self._draw(program, scene, layers, values)

    def _draw(
        self,
        program: moderngl.Program,
        scene: RenderScene,
        layers: Mapping[str, moderngl.Texture],
        values: Mapping[str, Any],
    ) -> None:
        for unit, (name, layer) in enumerate(layers.items()):
            layer.use(unit)
            set_used(program, name, unit)
        for name, value in (dict(values) | window_uniforms(scene.camera)).items():
            if isinstance(value, np.ndarray):
                program[name].write(np.ascontiguousarray(value, np.float32))  # type: ignore[union-attr]
            else:
                set_used(program, name, value)
        if program not in self._vaos:
            self._vaos[program] = self.ctx.vertex_array(program, [])
        self._vaos[program].render(moderngl.TRIANGLES, vertices=3)

    def _say(self, texel: float) -> None:
        if not self._said:
            self._said = True
            text = f"sky light is shaded by what is larger than {texel:.2g} m in the first frame"
            self.report.add(Kind.ASSUMED, "sky-occlusion", self.place, "", text)


class Views:
    """Orthographic views against each of (n, 3) directions to the sky, onto a box of surfaces.

    ``box``, ``casters`` (2, 3): lowest and highest corners, m from the casters' origin.
    """

    def __init__(self, box: Doubles, casters: Doubles, directions: Doubles) -> None:
        middle = box.mean(axis=0)
        # The same for all directions, so that a texel is as wide in all.
        half = max(float(np.linalg.norm(box[1] - box[0])) / 2.0, 1e-3)
        half *= TILE / (TILE - 2 * _BORDER)
        self.texel = 2.0 * half / TILE
        steep = np.abs(directions[:, 2:]) > 0.9
        beside = np.cross(directions, np.where(steep, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]))
        x = beside / np.linalg.norm(beside, axis=1, keepdims=True)
        y = np.cross(directions, x)
        # Nearest and farthest corner along each direction, of casters and surfaces.
        corners = np.stack([box, casters])
        ends = corners[:, None] * directions[None, :, None, :]
        near, far = np.max(ends, axis=2).sum(axis=-1), np.min(ends, axis=2).sum(axis=-1)
        # What lies beyond ``_FARTHEST`` would take the digits of the depth.
        reach = directions @ middle
        near = np.minimum(near.max(axis=0), reach + _FARTHEST * half) + self.texel
        far = np.maximum(far.min(axis=0), reach - _FARTHEST * half) - self.texel
        #: (n, 4) rows of the map to clip space: x, y, z of a place and 1.
        self.x = np.column_stack([x, -x @ middle]) / half
        self.y = np.column_stack([y, -y @ middle]) / half
        scale = 2.0 / (near - far)
        self.z = np.column_stack([-directions * scale[:, None], (near + far) / (near - far)])
        self.directions = directions
        self._scale = scale

    def tiles(self, chosen: slice, squares: npt.NDArray[Any]) -> Tiles:
        """What draws the casters of some of the views into squares (left, bottom, side)."""
        count = len(self.directions[chosen])
        matrices = np.zeros((count, 4, 4))
        for column, row in enumerate((self.x, self.y, self.z)):
            matrices[:, :, column] = row[chosen]
        matrices[:, 3, 3] = 1.0
        nowhere = np.tile([0.0, 0.0, 0.0, -1.0], (count, 1))  # a lamp without a body
        return Tiles(matrices, nowhere, np.ones(count), squares, np.zeros(count, np.int64))

    def scales(self, chosen: slice) -> Doubles:
        """(k, 1) depth in the texture a metre."""
        return np.asarray(self._scale[chosen, None] / 2.0)

    def uniforms(
        self, chosen: slice, squares: npt.NDArray[Any], eye: Doubles
    ) -> dict[str, Doubles]:
        """Of sky_occlusion.frag: from places relative to the eye to texels and depth."""
        at_eye = np.append(eye, 1.0)
        found = {}
        for axis, (name, row) in enumerate((("across", self.x), ("along", self.y))):
            moved = row[chosen].copy()
            moved[:, 3] = moved @ at_eye
            moved *= TILE / 2.0
            moved[:, 3] += squares[:, axis] + TILE / 2.0
            found[name] = moved
        depth = self.z[chosen] @ at_eye / 2.0 + 0.5
        found["towards"] = np.column_stack([self.directions[chosen], depth])
        return found


def _filled(values: Doubles) -> Doubles:
    return np.concatenate([values, np.zeros((BATCH - len(values), 4))])


def even_directions(count: int) -> Doubles:
    """(count, 3) unit vectors that share the sphere evenly: a Fibonacci lattice."""
    k = np.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    turn = math.pi * (1.0 + math.sqrt(5.0)) * k
    level = np.sqrt(1.0 - z * z)
    return np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=-1)
