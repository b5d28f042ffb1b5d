"""``inputs:texture:file`` of a RectLight: the light in tiles, and how it is seen.

A picture splits its light into at most 8 x 8 rectangles, each with the mean of its texels:
exact for what such tiles can tell apart, that is beyond about a quarter of the light's width;
nearer, a texel's light comes from all of its tile. Cone and focus are taken from the centre
of each tile. The picture stands upright as seen from the lit side: its first pixel, at the top
left, is at +X +Y of the light (schema text: "min coordinates should be at (+X, +Y)"). An 8-bit
picture is T^gamma, as everywhere; float files are taken as they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd

from hdrusd.errors import InputError
from hdrusd.images import read_image
from hdrusd.report import Kind, Report
from hdrusd.scene import ImageData, TextureRef, TextureUse
from hdrusd.units import TEXTURE_GAMMA
from hdrusd.usd.assets import asset_bytes, resolved_asset
from hdrusd.usd.findings import prim_finding
from hdrusd.usd.lux import input_source

#: Tiles of a textured light along each side.
TILES = 8


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A texture on a rectangle: means (h, w, 3) of tiles, row 0 at +Y, column 0 at +X."""

    texture: TextureUse
    means: npt.NDArray[np.float64]
    rows: npt.NDArray[np.float64]  # (h + 1,) edges of the tiles, 0 to 1 from the top
    columns: npt.NDArray[np.float64]  # (w + 1,) from the left, seen from the lit side

    def tiles(self, lights: npt.NDArray[np.void]) -> npt.NDArray[np.void]:
        """The tiles of (n,) rectangles, (n h w,)."""
        h, w = self.means.shape[:2]
        result = np.repeat(lights, h * w)
        row, column = np.divmod(np.tile(np.arange(h * w), len(lights)), w)
        right, down = self.columns[column + 1], self.rows[row + 1]
        wide, high = right - self.columns[column], down - self.rows[row]
        x, y = result["x"].copy(), result["y"].copy()
        result["position"] += (1.0 - 2.0 * right + wide)[:, None] * x
        result["position"] += (1.0 - 2.0 * down + high)[:, None] * y
        result["x"], result["y"] = x * wide[:, None], y * high[:, None]
        result["intensity"] *= self.means[row, column] * (wide * high)[:, None]
        result["key"] += np.tile(np.arange(h * w), len(lights))
        return result


class LightTextures:
    """The pictures of lights of one stage, each file read once."""

    def __init__(self, stage: Usd.Stage, report: Report, *, gamma: float = TEXTURE_GAMMA) -> None:
        self.report = report
        self.gamma = gamma
        self._known: dict[str, Picture | None] = {}

    def of(self, prim: Usd.Prim, time: Usd.TimeCode) -> Picture | None:
        """The picture on a light; None without one, or where it cannot be read: a finding."""
        source = input_source(prim, "texture:file")
        asset = source.Get(time) if source else None
        if not isinstance(asset, Sdf.AssetPath) or not asset.path:
            return None
        path = resolved_asset(source, asset)
        if path not in self._known:
            try:
                data = asset_bytes(path)
                if data is None:
                    raise InputError(Path(path), "no such file")
                self._known[path] = picture(path, read_image(Path(path), data), self.gamma)
            except (InputError, OSError) as problem:
                self._known[path] = None
                text = f"{problem}; the light is evenly bright"
                prim_finding(self.report, prim, Kind.MISSING, "light-texture", text)
        return self._known[path]


def picture(path: str, image: ImageData, gamma: float = TEXTURE_GAMMA) -> Picture:
    """The tiles of a decoded image; 8-bit colours are T^gamma."""
    pixels = image.pixels
    texels = pixels.astype(np.float64)
    if pixels.dtype == np.uint8:
        texels = (texels / 255.0) ** (gamma if pixels.shape[2] >= 3 else 1.0)
    texels = np.repeat(texels[..., :1], 3, axis=2) if pixels.shape[2] < 3 else texels[..., :3]
    texels = np.maximum(np.nan_to_num(texels, posinf=0.0, neginf=0.0), 0.0)
    edges = [np.arange(min(n, TILES) + 1) * n // min(n, TILES) for n in texels.shape[:2]]
    sums = np.add.reduceat(np.add.reduceat(texels, edges[0][:-1], 0), edges[1][:-1], 1)
    counts = np.diff(edges[0])[:, None] * np.diff(edges[1])[None]
    rows, columns = (edge / edge[-1] for edge in edges)
    return Picture(
        TextureUse(TextureRef(path, "auto", "clamp", "clamp")),
        sums / counts[..., None],
        rows,
        columns,
    )
