"""Scenes for shadows, and what shadow.glsl says of chosen points of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt
from small_scenes import lights, quad

from hdrusd.gpu.evaluate import evaluate
from hdrusd.gpu.program import Programs
from hdrusd.gpu.shadows import ShadowMaps, shadow_rows
from hdrusd.gpu.textures import TextureCache
from hdrusd.report import Report
from hdrusd.scene import RECT, Camera, Draw, Geometry, ImageData, Material, RenderScene

Array = npt.NDArray[Any]

#: The materials of all scenes: casts, blends, glows, has holes.
MATERIALS = (Material(), Material(blend=True, opacity=0.5), Material(emission=(9.0, 9.0, 9.0)))


def maps(
    gl: moderngl.Context,
    *,
    images: dict[str, Array] | None = None,
    samples: int = 16,
    limit: int = 8192,
    report: Report | None = None,
) -> ShadowMaps:
    """Shadow maps whose textures are ``images`` by their file names."""
    known = images or {}
    textures = TextureCache(
        gl, lambda ref: ImageData(known[ref.file]) if ref.file in known else None, 2.2
    )
    return ShadowMaps(gl, Programs(gl), textures, samples=samples, limit=limit, report=report)


def slab(low: Sequence[float], high: Sequence[float], key: str = "slab") -> Geometry:
    """A box along the axes."""
    a, b = np.asarray(low, float), np.asarray(high, float)
    x, y, z = np.diag(b - a)
    faces = [(a, y, x), (a, x, z), (a, z, y), (b, -x, -y), (b, -z, -x), (b, -y, -z)]
    sides = [quad(tuple(o), tuple(u), tuple(v)) for o, u, v in faces]
    points, normals = (
        np.concatenate([getattr(s, n) for s in sides]) for n in ("points", "normals")
    )
    return Geometry(key, 0, points, normals, {}, {})


def plane(half: float, z: float = 0.0, key: str = "plane") -> Geometry:
    """A square that faces up."""
    return quad((-half, -half, z), (2 * half, 0, 0), (0, 2 * half, 0), key=key)


def draw(geometry: Geometry, material: int = 0, *matrices: Array, **fields: Any) -> Draw:
    return Draw(geometry, material, np.array(matrices or [np.eye(4)]), True, **fields)


def move(x: float, y: float, z: float) -> Array:
    m = np.eye(4)
    m[3, :3] = x, y, z
    return m


def scene(lamp: dict[str, Any] | list[dict[str, Any]], *draws: Draw, **fields: Any) -> RenderScene:
    rows = lights(*(lamp if isinstance(lamp, list) else [lamp]))
    fields = {"camera": Camera(eye=(0.0, -7.0, 5.0)), "materials": MATERIALS} | fields
    return RenderScene(lights=rows, draws=draws, **fields)


def seen(
    gl: moderngl.Context,
    shown: RenderScene,
    points: npt.ArrayLike,
    normal: Sequence[float] = (0.0, 0.0, 1.0),
    *,
    light: int = 0,
    shadows: ShadowMaps | None = None,
) -> Array:
    """(n,) visibility of a light from points (n, 3) of surfaces with that normal."""
    shadows = shadows or maps(gl)
    found = shadows.update(shown)
    kind, row = str(found.kind[light]), shown.lights[light]
    assert kind, "the light has no shadows"
    data = found.rows[light, : shadow_rows(kind)]
    points = np.asarray(points, np.float64)
    eye = np.asarray(shown.camera.eye)
    size = float(row["radius"] if row["w"] > 0.0 else np.tan(row["angle"]))
    vectors = [row["position"] - row["w"] * eye, row["axis"], row["x"], row["y"]]
    lamp = f"ShadowLight({', '.join(map(_vector, vectors))}, {size!r})"
    rows = f"vec4[{len(data)}]({', '.join(map(_vector, data))})"
    shadows.use(0)
    return evaluate(
        gl,
        "gpu/shaders/shadow.glsl",
        f"visibility(p, n, n, {lamp}, {rows})",
        {"p": points - eye, "n": np.tile(np.asarray(normal, float), (len(points), 1))},
        "float",
        uniforms={"shadow_atlas": 0, **shadows.uniforms(kind)},
        defines=shadows.defines | dict.fromkeys(kind.split(), 1),
    ).astype(np.float64)


def _vector(values: npt.ArrayLike) -> str:
    numbers = [float(v) for v in np.asarray(values, np.float64)]
    return f"vec{len(numbers)}({', '.join(map(repr, numbers))})"


def along(start: Sequence[float], end: Sequence[float], count: int = 201) -> Array:
    """(count, 3) points from one place to another."""
    t = np.linspace(0.0, 1.0, count)[:, None]
    return np.asarray(start, float) * (1.0 - t) + np.asarray(end, float) * t


def edge(places: Array, share: Array) -> float:
    """Where visibility passes 1/2, once, along ascending places."""
    (crossings,) = np.nonzero((share[1:] >= 0.5) != (share[:-1] >= 0.5))
    assert len(crossings) == 1, f"{len(crossings)} edges"
    i = int(crossings[0])
    t = (0.5 - share[i]) / (share[i + 1] - share[i])
    return float(places[i] + t * (places[i + 1] - places[i]))


# -- lights that have a size, half hidden ------------------------------------------------------

#: m above the surface: the light, and the half plane that hides some of it.
HEIGHT, EDGE = 3.0, 1.2

#: Of 16 points each stands for 1/16; where an edge passes one, half a point is wrong either way.
#: Their weights (cos cos / d^2) differ by less than 1 : 1.6 in the places below.
STEP = 1.6 / 16


def half_plane() -> Any:
    """Hides what is above x < 0."""
    return quad((-40.0, -40.0, EDGE), (40.0, 0.0, 0.0), (0.0, 80.0, 0.0), key="edge")


def corner_factor(x: Array, y: Array) -> Array:
    """Form factor of a parallel rectangle with a corner straight above: x, y sides by height.

    Howell, catalogue of radiation configuration factors, B-3.
    """
    a, b = np.sqrt(1.0 + x * x), np.sqrt(1.0 + y * y)
    return (x / a * np.arctan(y / a) + y / b * np.arctan(x / b)) / (2.0 * math.pi)


def rectangle_factor(x0: Any, x1: Any, y0: Any, y1: Any) -> Array:
    """Of a rectangle anywhere at height 1 above the surface."""
    signs = [(x1, y1, 1), (x0, y1, -1), (x1, y0, -1), (x0, y0, 1)]
    return np.sum([s * corner_factor(np.asarray(x), np.asarray(y)) for x, y, s in signs], axis=0)


def rect_light(**fields: Any) -> dict[str, Any]:
    light = {"position": (0.0, 0.0, HEIGHT), "intensity": 100.0, "shape": RECT}
    return light | {"x": (0.8, 0.0, 0.0), "y": (0.0, 0.5, 0.0)} | fields


def segment(h: Array) -> Array:
    """Share of a disk of radius 1 on the far side of a line at h from its middle."""
    h = np.clip(h, -1.0, 1.0)
    return (np.arccos(h) - h * np.sqrt(1.0 - h * h)) / math.pi
