"""What all casters hide of one direction of the sky, for a sky made of very many of them.

One tile at a time, of light from far away that way; ``visibility`` of shaders/shadow.glsl
with SHADOW_ORTHO reads it.
"""

from __future__ import annotations

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.cascades import ball_view
from hdrusd.gpu.casters import Casters
from hdrusd.gpu.program import Programs
from hdrusd.gpu.shadow_drawing import TileDrawing, Tiles

Doubles = npt.NDArray[np.float64]


class DirectionMap:
    """A square shadow map of ``size`` texels, drawn anew for each direction.

    ``casters`` are those of the frame's ShadowMaps, after its update.
    """

    def __init__(
        self, ctx: moderngl.Context, programs: Programs, casters: Casters, size: int = 2048
    ) -> None:
        self.casters = casters
        self.size = size
        self._drawing = TileDrawing(ctx, programs)
        self._drawing.resize((size, size), moving=False)

    @property
    def uniforms(self) -> dict[str, float]:
        """For a program with shadow.glsl, beside the unit of ``shadow_atlas``."""
        rounding = float(np.max(np.abs(self.casters.bounds()))) * 2.0**-22
        return {"shadow_rounding": rounding, "shadow_aspect": 1.0}

    def draw(
        self,
        direction: npt.ArrayLike,
        eye: npt.ArrayLike,
        middle: npt.ArrayLike,
        radius: float,
    ) -> npt.NDArray[np.float32]:
        """Draw the map; the (6, 4) texels that ``visibility`` takes with it.

        ``direction`` (3,): unit vector towards the light. Receivers are in the ball of
        ``radius`` (m) around ``middle`` (3,), casters anywhere; places are in world metres.
        """
        origin = self.casters.origin
        from_eye = np.asarray(eye, np.float64) - origin
        view = ball_view(
            np.asarray(direction, np.float64),
            np.asarray(middle, np.float64) - origin,
            radius,
            from_eye,
            self.casters.bounds(),
        )
        tiles = Tiles(
            matrices=view.matrices(self.size),
            balls=view.balls(),
            tangents=np.ones(1),
            squares=np.array([[0.0, 0.0, self.size]]),
            links=np.zeros(1, np.int64),
        )
        self._drawing.draw_still(tiles, [*self.casters.still, *self.casters.moving])
        return view.data(self.size, (0, 0), (self.size, self.size)).astype(np.float32)

    def use(self, unit: int) -> None:
        """Bind the map for ``sampler2DShadow shadow_atlas``."""
        self._drawing.use(unit)
