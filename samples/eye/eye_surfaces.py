"""What the three scenes share: textures, skies, ground, trees, and the street's materials."""

from __future__ import annotations

import math
import tomllib
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path

import numpy as np
import street_pictures as pictures
import street_surfaces as surfaces
from eye_stage import EyeStage, Finish
from street_model import Array, Material, Mesh, Node, Vec3
from street_shapes import Kit, Shape

from hdrusd.images import write_exr, write_png

STREET = Path(__file__).resolve().parents[1] / "street"

#: Mean reflectance of grain.png, to be multiplied by a Finish's.
GRAIN = 0.5


def write_picture(path: Path, values: Array) -> None:
    """(h, w) or (h, w, 3) between 0 and 1, top row first: PNG in 8 bits, EXR in floats."""
    pixels = values if values.ndim == 3 else np.repeat(values[..., None], 3, axis=2)
    if path.suffix == ".exr":
        write_exr(path, pixels, luminance=False)
    else:
        write_png(path, (np.clip(pixels, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8))


def grain() -> Array:
    """Concrete, asphalt, grass: fine noise in linear light whose mean is GRAIN."""
    rng, n = np.random.default_rng(1), 512
    light = 1.0 + 0.35 * surfaces._noise(rng, n, 4, 8, 16, 32) + 0.35 * (rng.random((n, n)) - 0.5)
    return np.power(light * GRAIN / light.mean(), 1.0 / 2.2)


def day_sky() -> Array:
    """(256, 1024, 3) of a half sphere from the horizon (last row) up, 1 being its brightest."""
    rng, rows, columns = np.random.default_rng(2), 256, 1024
    up = np.linspace(1.0, 0.0, rows)[:, None, None]
    blue, haze = np.array((0.16, 0.26, 0.52)), np.array((0.72, 0.78, 0.86))
    sky = blue + (haze - blue) * np.exp(-4.0 * up)
    cloud = surfaces._noise(rng, columns, 6, 12, 24, 48, 96)[:rows]
    cover = np.clip((cloud - 0.10) * 3.0, 0.0, 1.0)[..., None] * np.clip(6.0 * up, 0.0, 1.0)
    return np.power(np.clip(sky + (1.0 - sky) * 0.85 * cover, 0.0, 1.0), 1.0 / 2.2)


def portal_share(depth: Array, width: float, height: float) -> Array:
    """Share of an even sky's light on the road, ``depth`` m behind a portal of that size.

    The configuration factor of a rectangle that stands on the plane of a point in its
    middle line (J. R. Howell, A Catalog of Radiation Configuration Factors, B-4, twice).
    """
    d, w = np.maximum(depth, 1e-9), width / 2.0
    far = np.hypot(d, height)
    return (np.arctan(w / d) - d / far * np.arctan(w / far)) / math.pi


def sky(stage: EyeStage, finish: Finish) -> str:
    """Half a sphere of 3 km around the origin, seen from within; its path."""
    shape = Shape(finish)
    turn, up = np.linspace(0.0, 2.0 * np.pi, 49), np.linspace(-0.05, 0.5 * np.pi, 17)
    ring = np.stack((np.cos(turn), np.sin(turn), 0.0 * turn), axis=1)
    points = 3000.0 * (
        np.cos(up)[:, None, None] * ring + np.sin(up)[:, None, None] * np.array((0.0, 0.0, 1.0))
    )
    high = np.clip(up / (0.5 * np.pi), 0.0, 1.0)
    s, t = np.meshgrid(turn / (2.0 * np.pi), high)
    shape.grid(points[:, ::-1], np.stack((s, t), axis=2)[:, ::-1])
    path = stage.place("Backdrop")
    stage.surfaces(path, [shape.mesh("Sky")])
    return f"{path}/Sky"


def conifers(shape: Shape, places: Array, rng: np.random.Generator) -> None:
    """Firs of 5 to 11 m at (n, 3) places: three cones each."""
    for x, y, z in places:
        high = 5.0 + 6.0 * rng.random()
        for low, share in ((0.12, 0.22), (0.38, 0.17), (0.62, 0.11)):
            foot, top = low * high, min(low + 0.42, 1.0) * high
            shape.revolve(((share * high, foot), (0.0, top)), 9, (float(x), float(y), float(z)))


def dashes(paint: Shape, x: float, y0: float, y1: float, length: float, gap: float) -> None:
    """A line of road paint 0.12 m wide, 4 mm over the road; ``gap`` 0: unbroken."""
    step = length + gap
    for y in np.arange(y0, y1 - 1e-6, step):
        end = min(y + length, y1)
        corners = ((x - 0.06, y), (x + 0.06, y), (x + 0.06, end), (x - 0.06, end))
        paint.faces([[(a, b, 0.004) for a, b in corners]])


@cache
def _photometry() -> list[dict]:
    return tomllib.loads((STREET / "photometry.toml").read_text(encoding="utf-8"))["material"]


@cache
def street_finish(material: Material, share: float = 1.0) -> Finish:
    """A material of the sample street with the cd/m2 that its photometry file gives it."""
    known = next(
        (e for e in _photometry() if fnmatchcase(material.name, e["match"]) and "luminance" in e),
        {},
    )
    specular = material.specular[0]
    # Blinn and Phong's exponent n as GGX: alpha^2 = 2 / (n + 2), alpha = roughness^2.
    rough = (2.0 / (material.shininess + 2.0)) ** 0.25 if specular else None
    return Finish(
        material.name,
        material.diffuse,
        material.texture or "",
        material.tile,
        roughness=rough,
        f0=min(specular, 0.04),
        luminance=known.get("luminance", 0.0),
        kelvin=known.get("temperature", 0.0),
        colour=tuple(known.get("color", (1.0, 1.0, 1.0))),
        share=share,
        source=known.get("source", ""),
    )


def in_finishes(root: Node, share: float = 1.0) -> Node:
    """A tree of the sample street whose materials are Finishes; ``share`` as in Finish."""
    meshes = [
        Mesh(m.name, street_finish(m.material, share), m.points, m.normals, m.uvs, m.quads, m.tris)
        for m in root.meshes
    ]
    children = [in_finishes(child, share) for child in root.shown()]
    return Node(root.name, children=children, meshes=meshes)


def write_street_textures(out: Path, *names: str) -> None:
    """Write pictures of the sample street: "plate" becomes textures/plate.png."""
    for picture in (getattr(pictures, n, None) or getattr(surfaces, n) for n in names):
        write_picture(out / f"textures/{picture.__name__}.png", picture())


def finishes(*each: Finish) -> Kit:
    """A kit of shapes by the finishes' names."""
    return Kit({finish.name: finish for finish in each})


def flat(name: str, reflectance: Vec3 | float, **more: object) -> Finish:
    """A finish of one reflectance, grey for a number."""
    rgb = (reflectance,) * 3 if isinstance(reflectance, (int, float)) else reflectance
    return Finish(name, rgb, **more)


def grainy(name: str, reflectance: Vec3 | float, tile: float = 4.0, **more: object) -> Finish:
    """A finish with grain whose mean reflectance is this one."""
    rgb = (reflectance,) * 3 if isinstance(reflectance, (int, float)) else reflectance
    scaled = tuple(value / GRAIN for value in rgb)
    return Finish(name, scaled, "grain.png", tile, **more)
