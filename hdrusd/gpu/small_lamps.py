"""Lamps in the frame that its pixels cannot show: what they give at the eye, by their candela.

A lamp below a pixel is hit or missed by the pixel's centre: it shows as a whole pixel of its
luminance or not at all. One without a seen shape (``treatAsPoint``, a ball with a beam) never
shows. For the veil of glare each such lamp is a row of its own, E = I / d^2 (glare/veil.py), and
what pixels show of it all the same is taken from what they scatter, so that it counts once.

A lamp counts so in full up to one pixel across, itself or its glass, and from two pixels on it is
what its pixels show; in between both in part, so that nothing jumps as it comes near. Of a lamp
that is partly hidden the four pixels about its place say how much is seen, bilinear. Whatever
stands more than a pixel's width before it hides it, but for its own glass and fixture
(gpu/own_parts.py), and for what blends.
"""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.own_parts import OwnParts
from hdrusd.gpu.program import build
from hdrusd.gpu.source import load
from hdrusd.photometry.eye_illuminance import in_frame, lamps_at_eye
from hdrusd.photometry.light import has_beam
from hdrusd.photometry.lighttree import extent
from hdrusd.scene import POINT, SPHERE, Camera, RenderScene

Doubles = npt.NDArray[np.float64]
Booleans = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]

#: Pixels across up to which a lamp counts by its candela alone, and from which on not at all.
SMALL, LARGE = 1.0, 2.0

#: Share of a distance that two floats of it may differ by, on the way through the G-buffer.
_PRECISION = 1e-5

#: The pixel of a lamp and those around it.
_AROUND = np.stack(np.meshgrid(*2 * [np.arange(-1, 2)]), axis=-1).reshape(9, 2)


@dataclass(frozen=True, slots=True, eq=False)
class _Lamps:
    """Small lamps in a frame. ``towards`` (n, 3): view space, m."""

    lux: Doubles  # (n, 3) at the eye, if nothing hides it
    towards: Doubles
    weight: Doubles  # (n,) 0 to 1: how much it counts by its candela
    front: Doubles  # (n,) m before it where what is its own begins
    shown: Doubles  # (n,) m about it within which pixels may show it; 0: nothing does
    glass: Booleans  # (n,) whether glass shows it, and not a drawn lamp


class SmallLamps:
    """``begin`` with a scene, ``look`` at each sample of its frame, then ask for ``rows``."""

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int]) -> None:
        self.ctx = ctx
        self.size = size
        self._own = OwnParts()
        self._program: moderngl.Program | None = None
        self._forget()

    def _forget(self) -> None:
        self._lamps: _Lamps | None = None
        self._window = (0.0, 0.0, 0.0, 0.0)
        self._visible: Doubles = np.zeros(0)
        self._pixels: list[tuple[Ints, Ints, Doubles]] = []  # number, lamp, light

    def begin(self, scene: RenderScene) -> None:
        """Note the lamps of a scene that count by their candela."""
        self._forget()
        camera, lights = scene.camera, scene.lights
        rows = lamps_at_eye(scene)
        if not len(rows):
            return
        local = (lights["w"] > 0.0) & np.any(lights["intensity"] > 0.0, axis=1)
        finite = np.all(np.isfinite(rows), axis=1)
        found = np.flatnonzero(local & finite & in_frame(rows[:, :3], camera))
        drawn = self._drawn(lights[found])
        towards = self._towards(scene, found)
        pixel = -towards[:, 2] * _pixel(camera, self.size)
        # Before boxes are looked at: what is large enough needs none of it.
        kept = (2.0 * drawn < LARGE * pixel) & (pixel > 0.0)
        found, drawn, towards, pixel = found[kept], drawn[kept], towards[kept], pixel[kept]
        small = lights[found]
        half, far = self._own.glass(scene, small)
        across = 2.0 * np.maximum(drawn, half) / pixel
        weight = np.clip((LARGE - across) / (LARGE - SMALL), 0.0, 1.0)
        some = weight > 0.0
        found, small, drawn, far = found[some], small[some], drawn[some], far[some]
        towards, weight = towards[some], weight[some]
        if not len(found):
            return
        fixture = self._own.fixture_front(scene, small, np.asarray(camera.eye, np.float64))
        self._lamps = _Lamps(
            rows[found, 3:],
            towards,
            weight,
            np.maximum(np.maximum(drawn, far), fixture),
            np.maximum(drawn, far),
            far > 0.0,
        )
        self._window = camera.window
        self._visible = np.zeros(len(found))

    def look(
        self,
        camera: Camera,
        hdr: moderngl.Texture,
        normal: moderngl.Texture,
        diffuse: moderngl.Texture,
        share: float,
    ) -> None:
        """See which lamps a sample of the frame shows; ``share``: its part of the frame."""
        lamps = self._lamps
        if lamps is None:
            return
        left, right, bottom, top = camera.window
        depth = -lamps.towards[:, 2]
        step = np.array([(right - left) / self.size[0], (top - bottom) / self.size[1]])
        # Of the lamp, in pixels whose centres are whole numbers.
        place = (lamps.towards[:, :2] / depth[:, None] - (left, bottom)) / step - 0.5
        near = np.rint(place).astype(np.int64)[:, None] + _AROUND
        inside = np.all((near >= 0) & (near < self.size), axis=2)
        seen, black = self._probe(hdr, normal, diffuse, near)
        distance = np.where(seen[..., 3] > 0.0, seen[..., 3], np.inf)
        bilinear = np.prod(np.maximum(1.0 - np.abs(near - place[:, None]), 0.0), axis=2) * inside
        slack = depth * (_PRECISION + _pixel(camera, self.size))
        free = distance >= (depth - lamps.front - slack)[:, None]
        total = bilinear.sum(axis=1)
        self._visible += share * (bilinear * free).sum(axis=1) / np.where(total > 0.0, total, 1.0)
        reach = (lamps.shown * (1.0 + 1e-3) + _PRECISION * depth)[:, None]
        shows = (np.abs(distance - depth[:, None]) <= reach) & inside
        shows &= (lamps.shown > 0.0)[:, None]
        shows &= black | lamps.glass[:, None]
        lamp, which = np.nonzero(shows)
        number = near[lamp, which] @ (1, self.size[0])
        # A pixel is one lamp's, or that of several which are as good as one.
        found, first = np.unique(number, return_index=True)
        weight = np.zeros(len(found))
        np.maximum.at(weight, np.searchsorted(found, number), lamps.weight[lamp])
        light = np.maximum(np.nan_to_num(seen[lamp[first], which[first], :3]), 0.0)
        self._pixels.append((found, lamp[first], share * weight[:, None] * light))

    def rows(self, frame: npt.NDArray[np.float32]) -> tuple[Doubles, Doubles, Ints]:
        """Of the frame (h, w, 3), top row first: rows of glare/veil.py.

        Lamps (n, 6) with lux; pixels (m, 6) that show them with minus the share of their
        luminance; and (m,) the lamp of each pixel, or -1. In view space of a camera that looks
        at the middle of its window, as the veil has it.
        """
        lamps = self._lamps
        if lamps is None:
            return np.zeros((0, 6)), np.zeros((0, 6)), np.zeros(0, np.int64)
        left, right, bottom, top = self._window
        middle = (left + right) / 2.0, (bottom + top) / 2.0
        plane = lamps.towards[:, :2] / -lamps.towards[:, 2:] - middle
        lit = _rows(plane, lamps.lux * (lamps.weight * self._visible)[:, None])
        shines = np.any(lit[:, 3:] > 0.0, axis=1)
        number, owner, light = (np.concatenate(part) for part in zip(*self._pixels, strict=True))
        found, first, which = np.unique(number, return_index=True, return_inverse=True)
        taken = np.zeros((len(found), 3))
        np.add.at(taken, which.ravel(), light)
        across, up = found % self.size[0], found // self.size[0]
        there = frame[self.size[1] - 1 - up, across].astype(np.float64)
        shares = np.clip(taken / np.where(there > 0.0, there, np.inf), 0.0, 1.0)
        place = np.stack([across + 0.5, up + 0.5], axis=1) / self.size - 0.5
        shown = _rows(place * (right - left, top - bottom), -shares)
        seen = np.any(shares > 0.0, axis=1)
        numbered = np.where(shines, np.cumsum(shines) - 1, -1)
        return lit[shines], shown[seen], numbered[owner[first]][seen]

    def release(self) -> None:
        """Give the program back."""
        if self._program is not None:
            self._program.release()
            self._program = None

    def _drawn(self, lights: npt.NDArray[np.void]) -> Doubles:
        """(n,) m: half the width of what is drawn of a lamp; 0 where nothing is."""
        ball = (lights["shape"] == SPHERE) & has_beam(lights)
        return np.where((lights["shape"] == POINT) | ball, 0.0, extent(lights))

    def _towards(self, scene: RenderScene, found: Ints) -> Doubles:
        away = np.asarray(scene.lights["position"])[found] - np.asarray(scene.camera.eye)
        return np.asarray(away @ scene.camera.rotation())

    def _probe(
        self,
        hdr: moderngl.Texture,
        normal: moderngl.Texture,
        diffuse: moderngl.Texture,
        pixels: Ints,
    ) -> tuple[Doubles, Booleans]:
        """Of pixels (n, 9, 2): light and distance (n, 9, 4), and whether they scatter nothing."""
        if self._program is None:
            source = load("gpu/shaders/lamp_probe.vert")
            self._program = build(self.ctx, source, varyings=("seen", "black"))
        program = self._program
        for unit, (name, texture) in enumerate(
            (("hdr", hdr), ("g_normal", normal), ("g_diffuse", diffuse))
        ):
            texture.use(unit)
            program[name] = unit
        places = np.clip(pixels, 0, np.array(self.size) - 1).reshape(-1, 2)
        buffer = self.ctx.buffer(places.astype(np.float32))
        captured = self.ctx.buffer(reserve=len(places) * 20)
        vertices = self.ctx.vertex_array(program, [(buffer, "2f", "pixel")])
        try:
            vertices.transform(captured, mode=moderngl.POINTS, vertices=len(places))
            values = np.frombuffer(captured.read(), np.float32).reshape(*pixels.shape[:2], 5)
        finally:
            for part in (vertices, buffer, captured):
                part.release()
        return values[..., :4].astype(np.float64), values[..., 4] > 0.0


def _pixel(camera: Camera, size: tuple[int, int]) -> float:
    """Width of a pixel at a distance of 1: the root of its area."""
    left, right, bottom, top = camera.window
    return float(np.sqrt((right - left) * (top - bottom) / (size[0] * size[1])))


def _rows(plane: Doubles, light: Doubles) -> Doubles:
    """(n, 6) of places (n, 2) in the plane at distance 1, and their light (n, 3)."""
    way = np.concatenate([plane, np.full((len(plane), 1), -1.0)], axis=1)
    return np.concatenate([way / np.linalg.norm(way, axis=1, keepdims=True), light], axis=1)
