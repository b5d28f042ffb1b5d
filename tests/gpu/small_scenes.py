"""RenderScenes in code, and the G-buffer of a rendered one as plain arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.hdr import HdrRenderer, Options
from hdrusd.gpu.peeling import Peeling
from hdrusd.gpu.program import Programs
from hdrusd.gpu.surfaces import SurfacePass
from hdrusd.gpu.textures import TextureCache
from hdrusd.scene import (
    Camera,
    Draw,
    Geometry,
    ImageData,
    Material,
    RenderScene,
    TextureRef,
    light_rows,
)

Array = npt.NDArray[Any]

WIDTH, HEIGHT = 64, 48

#: Two triangles over the unit square, counterclockwise from +Z.
_CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]], np.float64)


def quad(
    origin: tuple[float, ...] = (-1.0, -1.0, 0.0),
    u: tuple[float, ...] = (2.0, 0.0, 0.0),
    v: tuple[float, ...] = (0.0, 2.0, 0.0),
    *,
    normal: tuple[float, ...] | None = None,
    uvs: Mapping[str, Callable[[Array], Array]] | None = None,
    colors: Mapping[str, tuple[float, ...]] | None = None,
    key: str = "quad",
    version: int = 0,
) -> Geometry:
    """A parallelogram; its front is on the side of u x v. ``uvs``: of the unit square."""
    points = np.asarray(origin) + _CORNERS @ np.array([u, v], np.float64)
    facing = np.cross(u, v) if normal is None else np.asarray(normal, np.float64)
    sets = uvs if uvs is not None else {"st": lambda st: st}
    return Geometry(
        key=key,
        version=version,
        points=points.astype(np.float32),
        normals=np.tile(facing, (6, 1)).astype(np.float32),
        uvs={name: np.asarray(f(_CORNERS), np.float32) for name, f in sets.items()},
        colors={n: np.tile(np.float32(c), (6, 1)) for n, c in (colors or {}).items()},
    )


def waves(cells: int = 24, key: str = "waves") -> Geometry:
    """A wavy sheet over [-2, 2]^2 with smooth normals: every angle of light and view."""
    x, y = np.meshgrid(*2 * [np.linspace(-2.0, 2.0, cells + 1)], indexing="ij")
    points = np.stack([x, y, 0.3 * np.sin(2 * x) * np.cos(1.5 * y)], axis=-1)
    slope_x = 0.6 * np.cos(2 * x) * np.cos(1.5 * y)
    slope_y = -0.45 * np.sin(2 * x) * np.sin(1.5 * y)
    normals = np.stack([-slope_x, -slope_y, np.ones_like(x)], axis=-1)
    i, j = (a.ravel() for a in np.meshgrid(*2 * [np.arange(cells)], indexing="ij"))
    pick_i = np.stack([i, i + 1, i + 1, i, i + 1, i], axis=1).ravel()
    pick_j = np.stack([j, j, j + 1, j, j + 1, j + 1], axis=1).ravel()
    return Geometry(
        key=key,
        version=0,
        points=points[pick_i, pick_j].astype(np.float32),
        normals=normals[pick_i, pick_j].astype(np.float32),
        uvs={},
        colors={},
    )


def draw(
    geometry: Geometry, material: int = 0, *matrices: Array, double_sided: bool = False
) -> Draw:
    """One draw, at the origin unless matrices (row vectors) are given."""
    return Draw(geometry, material, np.array(matrices or [np.eye(4)]), double_sided)


def look(
    eye: tuple[float, ...] = (0.0, 0.0, 3.0),
    at: tuple[float, ...] = (0.0, 0.0, 0.0),
    up: tuple[float, ...] = (0.0, 1.0, 0.0),
    *,
    half: float = 0.3,
    orthographic: bool = False,
) -> Camera:
    """A camera by eye and target; ``half``: half the window's height at distance 1 (or m)."""
    back = np.subtract(eye, at).astype(np.float64)
    back /= np.linalg.norm(back)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    wide = half * WIDTH / HEIGHT
    return Camera(
        eye=tuple(map(float, eye)),
        right=tuple(right),
        up=tuple(np.cross(back, right)),
        back=tuple(back),
        window=(-wide, wide, -half, half),
        orthographic=orthographic,
    )


def lights(*rows: Mapping[str, Any]) -> npt.NDArray[np.void]:
    """Lights by their LIGHT fields; a plain white one of 1 cd at the origin otherwise."""
    table = light_rows(len(rows))
    table["intensity"] = 1.0
    for row, fields in zip(table, rows, strict=True):
        for name, value in fields.items():
            row[name] = value
    return table


@dataclass(frozen=True)
class Rendered:
    """A frame and what it was made of, each (h, w, .), top row first."""

    frame: Array  # cd/m2
    surface: Array  # bool: a surface is seen
    position: Array  # m, world
    normal: Array
    diffuse: Array
    shininess: Array  # or the code of GGX
    specular: Array
    metallic: Array
    coat: Array  # weight and alpha of a clear coat
    links: Array  # bits


def rays(camera: Camera, size: tuple[int, int] = (WIDTH, HEIGHT)) -> tuple[Array, Array]:
    """Origins and directions (distance 1 along the view axis) of the pixels' centres, (h, w, 3)."""
    width, height = size
    left, right, bottom, top = camera.window
    x = left + (np.arange(width) + 0.5) / width * (right - left)
    y = top - (np.arange(height) + 0.5) / height * (top - bottom)
    across = x[None, :, None] * np.asarray(camera.right) + y[:, None, None] * np.asarray(camera.up)
    forward = -np.asarray(camera.back)
    eye = np.asarray(camera.eye)
    if camera.orthographic:
        return eye + across, np.broadcast_to(forward, across.shape)
    return np.broadcast_to(eye, across.shape), across + forward


def render(
    gl: moderngl.Context,
    scene: RenderScene,
    load: Callable[[TextureRef], ImageData | None] = lambda _: None,
    size: tuple[int, int] = (WIDTH, HEIGHT),
    **options: Any,
) -> Rendered:
    """One frame by shader 1, each lamp counted alone."""
    # Without shadows, unless asked for: the pixels are what the formulas say of them alone.
    renderer = HdrRenderer(
        gl,
        Programs(gl),
        size,
        load,
        Options(**{"shadows": False, "lights": "exact", **options}),
    )
    return rendered(renderer, scene)


def rendered(renderer: HdrRenderer, scene: RenderScene) -> Rendered:
    """The next frame of a renderer."""
    renderer.render(scene)
    normal, diffuse, specular, hdr = (
        renderer.layer(name).astype(np.float64)
        for name in ("g_normal", "g_diffuse", "g_specular", "hdr")
    )
    try:
        extra = renderer.layer("g_extra").astype(np.float64)
    except KeyError:  # nothing in the scene needs it
        extra = np.broadcast_to([0.0, 1.0, 0.0, 0.0], hdr.shape)
    renderer.ctx.extra["framebuffer"].use()
    origins, directions = rays(scene.camera, renderer.size)
    return Rendered(
        frame=renderer.read().astype(np.float64),
        surface=hdr[..., 3] == 1.0,
        position=origins + normal[..., 3:] * directions,
        normal=normal[..., :3],
        diffuse=diffuse[..., :3],
        shininess=diffuse[..., 3],
        specular=specular[..., :3],
        metallic=specular[..., 3],
        coat=extra[..., :2],
        links=extra[..., 2].astype(np.int64),
    )


#: Targets of gbuffer.frag, in the order of their locations.
TARGETS = ("g_normal", "g_diffuse", "g_specular", "hdr", "g_extra")


def gbuffer(
    gl: moderngl.Context,
    scene: RenderScene,
    load: Callable[[TextureRef], ImageData | None] = lambda _: None,
    sky: Array | None = None,
) -> dict[str, Array]:
    """The G-buffer of the opaque surfaces with all its targets, (h, w, 4), top row first."""
    surfaces = SurfacePass(gl, Programs(gl), TextureCache(gl, load, 2.2), 1.0 / np.pi)
    textures = _opaque(gl, scene, surfaces, sky)
    gl.extra["framebuffer"].use()
    return {name: _pixels(texture) for name, texture in textures.items()}


def layers(
    gl: moderngl.Context,
    scene: RenderScene,
    load: Callable[[TextureRef], ImageData | None] = lambda _: None,
) -> tuple[list[dict[str, Array]], Array, Peeling]:
    """G-buffers of the blended layers, nearest first, and all of it (h, w, 4) without lamps."""
    programs = Programs(gl)
    surfaces = SurfacePass(gl, programs, TextureCache(gl, load, 2.2), 1.0 / np.pi)
    textures = _opaque(gl, scene, surfaces, None)
    peeling = Peeling(gl, programs, (WIDTH, HEIGHT))
    found = []
    for layer in peeling.layers(scene, surfaces, textures["g_normal"]):
        parts = {name: _pixels(texture) for name, texture in layer.textures.items()}
        found.append(parts | {"hdr": _pixels(layer.hdr)})
    peeling.merge(gl.framebuffer([textures["hdr"]]))
    gl.extra["framebuffer"].use()
    return found, _pixels(textures["hdr"]), peeling


def _opaque(
    gl: moderngl.Context, scene: RenderScene, surfaces: SurfacePass, sky: Array | None
) -> dict[str, moderngl.Texture]:
    textures = [gl.texture((WIDTH, HEIGHT), 4, dtype="f4") for _ in TARGETS]
    target = gl.framebuffer(textures, gl.depth_texture((WIDTH, HEIGHT)))
    target.use()
    target.clear(depth=1.0)
    gl.enable_only(moderngl.DEPTH_TEST)
    gl.depth_func = "<"
    surfaces.draw(scene, sky=sky, extra=True)
    gl.enable_only(moderngl.NOTHING)
    return dict(zip(TARGETS, textures, strict=True))


def _pixels(texture: moderngl.Texture) -> Array:
    flat = np.frombuffer(texture.read(), np.float32)
    return flat.reshape(HEIGHT, WIDTH, 4)[::-1].astype(np.float64)


def lit_quad(camera: Camera | None = None, **material: Any) -> RenderScene:
    """The square [-1, 1]^2 in the plane z = 0 under a lamp, seen from +Z."""
    return RenderScene(
        lights=lights({"position": (0.3, 0.2, 2.0), "intensity": (100.0, 80.0, 60.0)}),
        draws=(draw(quad()),),
        materials=(Material(**material),),
        camera=camera or look(),
    )
