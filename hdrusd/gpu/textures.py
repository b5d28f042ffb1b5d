"""Images on the GPU, linear before they are filtered."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.context import describe
from hdrusd.gpu.release import release
from hdrusd.photometry.reflectance import reflectance_table
from hdrusd.scene import ImageData, Material, TextureRef

Texels = npt.NDArray[np.generic]
Four = tuple[float, float, float, float]

#: Threads that decode ahead of the one that uploads, and textures that may wait for it.
_THREADS, _AHEAD = 2, 4

#: Texels a turn while a large image is made smaller.
_STRIP = 2**22

#: Lists of materials for which a texture that none of them names is kept; and one that another
#: has replaced, which casters may hold until they are looked at anew.
_KEEP = 2

#: Samples along the longer side of a pixel's footprint. A software device takes 25 times as
#: long for them: 400 ns a texel instead of 16 (llvmpipe of Mesa 22.3).
ANISOTROPY = 16.0


@dataclass(frozen=True, slots=True)
class Uploaded:
    """A texture, and how its coordinates follow from those of the image: s' = scale s + offset."""

    texture: moderngl.Texture
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)


@dataclass(slots=True)
class Wanted:
    """What the materials read of one texture: channels (0 to 3), and what tiles fall back to."""

    channels: set[int] = field(default_factory=set)
    fallback: Four = (0.0, 0.0, 0.0, 1.0)

    @property
    def channel(self) -> int | None:
        """The one that is read; None where it is several."""
        return next(iter(self.channels)) if len(self.channels) == 1 else None


@dataclass(frozen=True, slots=True)
class _Placed:
    """Texels (h, w, 1 or 4), bottom row first, and where the image lies among them."""

    texels: Texels
    scale: tuple[float, float]
    offset: tuple[float, float]
    repeat: tuple[bool, bool]


def linear_texels(pixels: Texels, decode: str, gamma: float, channel: int | None = None) -> Texels:
    """Texels, (h, w, 4) float16 or float32, bottom row first, ready to be filtered.

    8-bit colour becomes T^gamma (photometry/reflectance.py) in half floats: 11 bits,
    relative error below 2^-11, which 256 codes do not exceed. Alpha stays linear.
    ``channel``: that one alone, (h, w, 1).
    """
    wanted = range(4) if channel is None else (channel,)
    dtype = np.float32 if pixels.dtype == np.float32 else np.float16
    out: Texels = np.empty((*pixels.shape[:2], len(wanted)), dtype)
    curved = decode == "gamma" or (
        decode == "auto" and pixels.dtype == np.uint8 and pixels.shape[2] >= 3
    )
    for i, c in enumerate(wanted):
        out[..., i] = _channel(pixels[::-1], c, gamma if curved and c < 3 else 1.0, dtype)
    return out


def _channel(pixels: Texels, channel: int, gamma: float, dtype: Any) -> Any:
    """One channel of R, G, B, A: grey stands for three, and alpha is 1 where there is none."""
    channels = pixels.shape[2]
    if channel == 3:
        if channels in (1, 3):
            return 1.0
        plane = pixels[..., -1]
    else:
        plane = pixels[..., channel if channels >= 3 else 0]
    if plane.dtype == np.uint8:
        return reflectance_table(gamma, 1.0).astype(dtype)[plane]
    return plane if gamma == 1.0 else np.maximum(plane, 0.0) ** gamma


@dataclass(slots=True)
class _Known:
    """A material; kept, so that its identity stays its own. ``last``: list that it was in."""

    material: Material
    refs: frozenset[TextureRef]
    last: int


class TextureCache:
    """Textures by what they refer to; a file is decoded once while materials name it.

    ``load`` is called from several threads at once.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        load: Callable[[TextureRef], ImageData | None],
        gamma: float,
    ) -> None:
        self.ctx = ctx
        self.load = load
        self.gamma = gamma
        self.anisotropy = 1.0 if describe(ctx)["software"] else min(ANISOTROPY, ctx.max_anisotropy)
        self._kept: dict[TextureRef, Uploaded | None] = {}
        self._holds: dict[TextureRef, int | None] = {}  # the one channel, or None for all
        self._seen: dict[int, _Known] = {}  # by identity
        self._materials: Sequence[Material] = ()
        self._list = 0  # how many lists of materials there were
        self._used: dict[TextureRef, int] = {}  # the last list
        self._retired: list[tuple[int, moderngl.Texture]] = []

    def prepare(self, materials: Sequence[Material]) -> frozenset[TextureRef]:
        """Upload all that materials need, decoded in threads; what they need no more goes.

        A texture of which one channel is read takes a quarter of the memory, and half the
        time to read on a software device. Returns those of which there is another texture
        now: what holds the one before must let go of it.
        """
        if materials is self._materials:
            return frozenset()
        self._materials = materials
        self._list += 1
        missing = self._missing(self._wanted(materials))
        replaced = frozenset(ref for ref, _ in missing if self._kept.get(ref) is not None)
        self._upload_all(missing)
        self._forget()
        return replaced

    def _upload_all(self, missing: Sequence[tuple[TextureRef, Wanted]]) -> None:
        if len(missing) < 2:
            for ref, wanted in missing:
                self._keep(ref, wanted, self._decode(ref, wanted))
            return
        waiting: deque[tuple[TextureRef, Wanted, Future[_Placed | None]]] = deque()
        with ThreadPoolExecutor(_THREADS, "texture") as pool:
            for ref, wanted in missing:
                waiting.append((ref, wanted, pool.submit(self._decode, ref, wanted)))
                if len(waiting) > _AHEAD:
                    self._take(*waiting.popleft())
            while waiting:
                self._take(*waiting.popleft())

    def get(self, ref: TextureRef) -> Uploaded | None:
        """The texture, or None where ``load`` found nothing (it made the finding)."""
        if ref not in self._kept:
            wanted = Wanted({0, 1, 2, 3})
            self._keep(ref, wanted, self._decode(ref, wanted))
        self._used[ref] = self._list
        return self._kept[ref]

    def release(self) -> None:
        """Give all of them back; those that are asked for later are read anew."""
        release([made.texture for made in self._kept.values() if made is not None])
        release([texture for _, texture in self._retired])
        for kept in (self._kept, self._holds, self._seen, self._used, self._retired):
            kept.clear()
        self._materials = ()

    def _wanted(self, materials: Iterable[Material]) -> dict[TextureRef, Wanted]:
        """What materials not seen before read, by texture."""
        found: dict[TextureRef, Wanted] = {}
        for material in materials:
            known = self._seen.get(id(material))
            if known is not None:
                known.last = self._list
                continue
            uses = material.maps().values()
            refs = frozenset(use.texture for use in uses)
            self._seen[id(material)] = _Known(material, refs, self._list)
            for use in uses:
                wanted = found.setdefault(use.texture, Wanted(fallback=use.fallback))
                wanted.channels |= {use.channel} if use.channel >= 0 else {0, 1, 2}
        return found

    def _forget(self) -> None:
        """Release what no material of the last lists names, and what was replaced before."""
        oldest = self._list - _KEEP
        self._seen = {key: known for key, known in self._seen.items() if known.last >= oldest}
        for known in self._seen.values():
            for ref in known.refs:
                self._used[ref] = max(self._used.get(ref, 0), known.last)
        # What could not be had takes nothing, and is not looked for again.
        for ref in [r for r, made in self._kept.items() if made and self._used[r] < oldest]:
            made = self._kept.pop(ref)
            assert made is not None
            made.texture.release()
            del self._holds[ref], self._used[ref]
        for at, texture in self._retired:
            if at < oldest:
                texture.release()
        self._retired = [(at, texture) for at, texture in self._retired if at >= oldest]

    def _missing(self, found: dict[TextureRef, Wanted]) -> list[tuple[TextureRef, Wanted]]:
        """Those of which nothing is kept, or not every channel that is wanted now."""
        missing = []
        for ref, wanted in found.items():
            if ref in self._kept:
                holds = self._holds[ref]
                if holds is None or wanted.channels <= {holds}:
                    continue
                wanted.channels.add(holds)
            missing.append((ref, wanted))
        return missing

    # -- from file to texels, in any thread ----------------------------------------------

    def _decode(self, ref: TextureRef, wanted: Wanted) -> _Placed | None:
        image = self.load(ref)
        if image is None:
            return None
        if image.tiles is not None:
            return self._tiled(ref, image, wanted)
        return wrapped(self._texels(ref, image, image.halvings, wanted.channel), ref)

    def _texels(
        self, ref: TextureRef, image: ImageData, halvings: int, channel: int | None
    ) -> Texels:
        """Linear texels, ``halvings`` times made half as wide and high by their means."""
        pixels, side = image.pixels, 2**halvings
        if halvings == 0:
            return linear_texels(pixels, ref.decode, self.gamma, channel)
        h, w = pixels.shape[:2]
        pad = ((0, -h % side), (0, -w % side), (0, 0))
        high = side * max(_STRIP // (side * w), 1)
        strips = []
        for top in range(0, h, high):
            strip = pixels[top : top + high]
            strip = np.pad(strip, ((0, -len(strip) % side), *pad[1:]), "edge")
            fine = linear_texels(strip, ref.decode, self.gamma, channel)
            cells = fine.reshape(len(fine) // side, side, -1, side, fine.shape[2])
            strips.append(cells.mean(axis=(1, 3), dtype=np.float32).astype(fine.dtype))
        return np.concatenate(strips[::-1])

    def _tiled(self, ref: TextureRef, image: ImageData, wanted: Wanted) -> _Placed:
        """Tiles side by side as large as the largest, in a frame of what is shown elsewhere."""
        tiles = {
            place: self._texels(ref, tile, image.halvings, wanted.channel)
            for place, tile in (image.tiles or {}).items()
        }
        columns, rows = ([place[i] for place in tiles] for i in (0, 1))
        first, lowest = min(columns), min(rows)
        high, wide = (max(t.shape[i] for t in tiles.values()) for i in (0, 1))
        fallback = wanted.fallback if wanted.channel is None else (wanted.fallback[wanted.channel],)
        dtype = max((t.dtype for t in tiles.values()), key=lambda d: d.itemsize)
        height = (max(rows) - lowest + 1) * high + 2
        width = (max(columns) - first + 1) * wide + 2
        atlas: Texels = np.empty((height, width, len(fallback)), dtype)
        atlas[:] = np.asarray(fallback, dtype)
        for (column, row), tile in tiles.items():
            y, x = 1 + (row - lowest) * high, 1 + (column - first) * wide
            atlas[y : y + high, x : x + wide] = _stretched(tile, high, wide)
        return _Placed(
            atlas,
            (wide / width, high / height),
            ((1 - first * wide) / width, (1 - lowest * high) / height),
            (False, False),
        )

    # -- from texels to the GPU, in the context's thread ---------------------------------

    def _take(self, ref: TextureRef, wanted: Wanted, made: Future[_Placed | None]) -> None:
        self._keep(ref, wanted, made.result())

    def _keep(self, ref: TextureRef, wanted: Wanted, placed: _Placed | None) -> None:
        before = self._kept.get(ref)
        if before is not None:
            self._retired.append((self._list, before.texture))
        self._kept[ref] = None if placed is None else self._upload(placed)
        self._holds[ref] = None if placed is None else wanted.channel

    def _upload(self, placed: _Placed) -> Uploaded:
        texels = placed.texels
        h, w, channels = texels.shape
        dtype = "f2" if texels.dtype == np.float16 else "f4"
        texture = self.ctx.texture((w, h), channels, np.ascontiguousarray(texels), dtype=dtype)
        if channels == 1:  # whichever channel a shader asks for
            texture.swizzle = "RRRR"
        texture.repeat_x, texture.repeat_y = placed.repeat
        texture.build_mipmaps()
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        if self.anisotropy > 1.0:
            texture.anisotropy = self.anisotropy
        return Uploaded(texture, placed.scale, placed.offset)


def wrapped(texels: Texels, ref: TextureRef) -> _Placed:
    """Texels for the wrap modes of ``ref``: moderngl has repeat and clamp, texels make the rest."""
    scale, offset = [1.0, 1.0], [0.0, 0.0]
    for i, wrap in enumerate((ref.wrap_s, ref.wrap_t)):
        axis = 1 - i  # s runs along the columns
        if wrap == "mirror":
            texels = np.concatenate([texels, np.flip(texels, axis)], axis=axis)
            scale[i] = 0.5
        elif wrap == "black":
            size = texels.shape[axis]
            pad = [(0, 0)] * 3
            pad[axis] = (1, 1)
            texels = np.pad(texels, pad)
            scale[i], offset[i] = size / (size + 2), 1 / (size + 2)
    repeat_s, repeat_t = (wrap in ("repeat", "mirror") for wrap in (ref.wrap_s, ref.wrap_t))
    return _Placed(texels, (scale[0], scale[1]), (offset[0], offset[1]), (repeat_s, repeat_t))


def _stretched(texels: Texels, high: int, wide: int) -> Texels:
    """Texels of another size: each takes the nearest one's value."""
    h, w = texels.shape[:2]
    if (h, w) == (high, wide):
        return texels
    rows, columns = np.arange(high) * h // high, np.arange(wide) * w // wide
    return np.asarray(texels[rows[:, None], columns[None, :]])
