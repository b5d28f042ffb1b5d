"""What the stages of this folder must show, from plain numbers; no stage is read here.

Every camera looks straight down, so the pixel [i, j] of 64 x 48 looks along
((i + 0.5) / 32 - 1) / 2, (1 - (j + 0.5) / 24) 3 / 8, -1 and meets the plane at height z
where that says. Lambert: L = rho E / pi. Point light: E = I cos(theta) / d^2.

``python tests/truth_stages/closed_forms.py`` writes expected.json, the textures and the
photometric file anew.
"""

from __future__ import annotations

import json
import math
import struct
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

FOLDER = Path(__file__).parent
WIDTH, HEIGHT = 64, 48
PI = math.pi
MATTE = np.array([0.5, 0.4, 0.3])
SKY = 10.0  # cd/m2; E = pi L, so a surface under it shows rho L

#: Candela of luminaire.ies by C plane (0 to 360 in steps of 90) and gamma (0 to 90 in steps of 30).
CANDELA = ((400, 500, 300, 0), (400, 300, 100, 50), (400, 200, 50, 0), (400, 350, 250, 80))


def plane(z: float = 0.0, eye: tuple[float, ...] = (0.0, 0.0, 4.0)) -> Array:
    """(h, w, 3) where the pixels' rays meet the height z, m."""
    x = ((np.arange(WIDTH) + 0.5) / (WIDTH / 2) - 1.0) * 0.5
    y = (1.0 - (np.arange(HEIGHT) + 0.5) / (HEIGHT / 2)) * 0.375
    distance = eye[2] - z
    at = np.zeros((HEIGHT, WIDTH, 3))
    at[..., 0] = eye[0] + x[None, :] * distance
    at[..., 1] = eye[1] + y[:, None] * distance
    at[..., 2] = z
    return at


def point_lux(at: Array, candela: float, place: tuple[float, ...]) -> Array:
    """(h, w, 1) lux on an upward plane: I cos(theta) / d^2."""
    to_light = np.asarray(place) - at
    return np.asarray(
        candela * to_light[..., 2:] / np.linalg.norm(to_light, axis=-1, keepdims=True) ** 3
    )


def from_axis(at: Array, place: tuple[float, ...], axis: tuple[float, ...]) -> Array:
    """(h, w, 1) cosine of the angle at the lamp between its axis and the way to the point."""
    away = at - np.asarray(place)
    return np.asarray(
        (away @ np.asarray(axis))[..., None] / np.linalg.norm(away, axis=-1, keepdims=True)
    )


def inside(at: Array, x: tuple[float, float], y: tuple[float, float]) -> Array:
    """(h, w, 1) bool: within a rectangle."""
    a, b = at[..., :1], at[..., 1:2]
    return (a > x[0]) & (a < x[1]) & (b > y[0]) & (b < y[1])


def point_plane(_: float) -> Array:
    return point_lux(plane(), 1000.0, (0.5, 0.25, 2.0)) * MATTE / PI


def spot_cone(_: float) -> Array:
    """1 - smoothstep of the angle from 20 to 40 degrees."""
    place, tilt = (0.0, -0.5, 3.0), math.radians(20.0)
    theta = np.degrees(np.arccos(from_axis(plane(), place, (0.0, math.sin(tilt), -math.cos(tilt)))))
    t = np.clip((theta - 20.0) / 20.0, 0.0, 1.0)
    return (1.0 - t * t * (3.0 - 2.0 * t)) * point_lux(plane(), 2000.0, place) * MATTE / PI


def spot_focus(_: float) -> Array:
    place = (-0.4, 0.3, 1.5)
    share = from_axis(plane(), place, (0.0, 0.0, -1.0)) ** 12
    return share * point_lux(plane(), 500.0, place) * MATTE / PI


def distant_lux(_: float) -> Array:
    lux = 2000.0 * math.cos(math.radians(40.0)) * np.array([1.0, 0.9, 0.8])
    return np.broadcast_to(lux * MATTE / PI, (HEIGHT, WIDTH, 3))


def dome(_: float) -> Array:
    return np.broadcast_to(SKY * np.array([0.5, 1.0, 2.0]) * MATTE, (HEIGHT, WIDTH, 3))


def ambient_api(_: float) -> Array:
    return np.broadcast_to(5.0 * np.array([0.9, 1.0, 1.2945]) * MATTE / PI, (HEIGHT, WIDTH, 3))


def emissive(_: float) -> Array:
    panel = inside(plane(0.5), (-0.5, 0.5), (-0.5, 0.5))
    return np.where(panel, np.array([20000.0, 10000.0, 5000.0]), 0.0)


def texture_spaces(_: float) -> Array:
    code = 128.0 / 255.0
    return np.where(plane()[..., :1] < 0.0, code**2.2, code) * np.full(3, SKY)


#: Of the stage instances, m: its lamps; x, y, z and half the sides of its plates, of two kinds.
LAMPS = ((-1.0, 0.0, 2.0), (1.0, 0.5, 2.0))
RED = ((-1.0, 0.0, 0.1, 0.25, 0.25), (1.0, 0.5, 0.1, 0.25, 0.25))
GREY = ((-1.0, -1.0, 0.2, 0.25, 0.25), (0.0, -1.0, 0.2, 0.125, 0.25), (1.0, -1.0, 0.2, 0.25, 0.125))


def behind_plates(at: Array, lamp: tuple[float, ...], grow: float = 0.0) -> Array:
    """(h, w, 1) bool: whether plates, larger by ``grow`` m all around, hide the lamp."""
    hidden = np.zeros((HEIGHT, WIDTH, 1), bool)
    way = np.asarray(lamp) - at
    for x, y, z, w, h in RED + GREY:
        rise = z - at[0, 0, 2]
        if rise > 0.0:
            hit = at + way * rise / way[..., 2:]
            w, h = w + grow, h + grow
            hidden |= inside(hit, (x - w, x + w), (y - h, y + h))
    return hidden


def instances(_: float) -> Array:
    def shown(z: float, rho: Array) -> Array:
        at = plane(z)
        lux = sum(point_lux(at, 400.0, lamp) * ~behind_plates(at, lamp) for lamp in LAMPS)
        return np.asarray(lux * rho / PI)

    result = shown(0.0, MATTE)
    for x, y, z, w, h in RED + GREY:
        plate = inside(plane(z), (x - w, x + w), (y - h, y + h))
        result = np.where(plate, shown(z, np.array([0.8, 0.1, 0.0]) if z == 0.1 else MATTE), result)
    return result


def animated(time: float) -> Array:
    k = time / 10.0  # all samples are at 0 and 10, and USD interpolates linearly
    at = plane(0.0, (k, -0.5 * k, 4.0 + k))
    return point_lux(at, 1000.0 * (1.0 + k), (-1.0 + 2.0 * k, 0.5 * k, 2.0 - k)) * MATTE / PI


def vertex_colour(_: float) -> Array:
    at = plane()
    right = np.zeros((HEIGHT, WIDTH, 3))
    # of the two triangles (0, 1, 2) and (0, 2, 3) over [0, 3] x [-3, 3]
    right[..., 0] = 0.6 * at[..., 0] / 3.0
    right[..., 1] = 0.6 * (at[..., 1] + 3.0) / 6.0
    return np.where(at[..., :1] < 0.0, np.array([0.1, 0.2, 0.3]), right) * SKY


def cut_out(_: float) -> Array:
    kept = inside(plane(0.5), (0.0, 1.0), (-0.5, 0.5))
    return np.where(kept, 1.0, MATTE) * SKY


def blinn_phong(_: float) -> Array:
    """L = (kd + ks (n + 8) / 8 (N.H)^n) E / pi."""
    at, place = plane(), (0.5, 0.25, 2.0)
    to_light = np.asarray(place) - at
    to_eye = np.array([0.0, 0.0, 4.0]) - at
    half = to_light / np.linalg.norm(to_light, axis=-1, keepdims=True)
    half = half + to_eye / np.linalg.norm(to_eye, axis=-1, keepdims=True)
    cosine = half[..., 2:] / np.linalg.norm(half, axis=-1, keepdims=True)
    lobe = np.array([0.05, 0.04, 0.03]) * (60.0 + 8.0) / 8.0 * cosine**60
    return np.asarray((0.1 + lobe) * point_lux(at, 1000.0, place) / PI)


def photometric_light(_: float) -> Array:
    color = np.array([1.0, 0.5, 0.25])
    candela = 300.0 * color / (color @ [0.2126, 0.7152, 0.0722])
    return point_lux(plane(), 1.0, (0.0, 0.0, 1.5)) * candela * MATTE / PI


def mesh_parts(_: float) -> Array:
    at, bright = plane(), np.array([0.9, 0.8, 0.7])
    x, y = at[..., :1], at[..., 1:2]
    result = np.zeros((HEIGHT, WIDTH, 3))
    for left, rho in ((-2.0, MATTE), (-1.0, bright), (1.0, MATTE)):  # 0 to 1 is the hole
        result = np.where(inside(at, (left, left + 1.0), (-1.0, 0.0)), rho * SKY, result)
    result = np.where(inside(at, (-2.0, -1.0), (0.25, 1.25)), MATTE * SKY, result)
    pentagon = inside(at, (1.0, 2.0), (0.25, 1.25)) & (y < 1.25 - np.abs(x - 1.5))
    return np.where(pentagon, bright * SKY, result)


def rect_light(_: float) -> Array:
    """Lambert's contour formula: E = L / 2 sum of angle times the normal's upward part."""
    at, turn = plane(), math.radians(30.0)
    x, y = (
        0.6 * np.array([math.cos(turn), math.sin(turn)]),
        0.4 * np.array([-math.sin(turn), math.cos(turn)]),
    )
    corners = [np.array([*(a * x + b * y), 1.0]) for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    ways = [corner + np.array([0.3, -0.2, 0.0]) - at for corner in corners]
    ways = [way / np.linalg.norm(way, axis=-1, keepdims=True) for way in ways]
    total = np.zeros((HEIGHT, WIDTH, 1))
    for a, b in zip(ways, ways[1:] + ways[:1], strict=True):
        normal = np.cross(b, a)  # seen from below the corners go counterclockwise
        sine = np.linalg.norm(normal, axis=-1, keepdims=True)
        angle = np.arctan2(sine, np.sum(a * b, axis=-1, keepdims=True))
        total += angle * normal[..., 2:] / sine
    return np.asarray(2000.0 / 2.0 * np.abs(total) * MATTE / PI)


def disk_light(_: float) -> Array:
    """A parallel disk: E = pi L / 2 (1 - (d2 + h2 - r2) / sqrt((d2 + h2 + r2)^2 - 4 d2 r2))."""
    at = plane()
    d2 = (at[..., :1] + 0.4) ** 2 + (at[..., 1:2] - 0.3) ** 2
    h2, r2 = 0.8**2, 0.5**2
    share = 0.5 * (1.0 - (d2 + h2 - r2) / np.sqrt((d2 + h2 + r2) ** 2 - 4.0 * d2 * r2))
    return np.asarray(3000.0 * share * MATTE)


def from_ball() -> Array:
    """(h, w, 1) m between the pixels' rays and the middle of sphere_light's lamp."""
    ray = plane() - np.array([0.0, 0.0, 4.0])
    way = np.cross(ray, np.array([0.3, -0.2, 0.7 - 4.0]))
    return np.asarray(np.linalg.norm(way, axis=-1) / np.linalg.norm(ray, axis=-1))[..., None]


def sphere_light(_: float) -> Array:
    """E = pi L (r / d)^2 cos, as of a point of L pi r^2 candela; L where the ball is seen."""
    ground = point_lux(plane(), 1000.0 * PI * 0.6**2, (0.3, -0.2, 0.7)) * MATTE / PI
    return np.where(from_ball() < 0.6, 1000.0, ground)


def photometric_file(_: float) -> Array:
    """Bilinear in the angles; C = 0 is the light's +X, here +Y; C = 90 its +Y, here -X."""
    at, place = plane(), (0.3, -0.2, 2.0)
    away = at - np.asarray(place)
    gamma = np.degrees(np.arccos(from_axis(at, place, (0.0, 0.0, -1.0)))) / 30.0
    c = np.degrees(np.arctan2(-away[..., :1], away[..., 1:2])) % 360.0 / 90.0
    table = np.array([*CANDELA, CANDELA[0]], np.float64)
    i, j = np.minimum(c.astype(int), 3), np.minimum(gamma.astype(int), 2)
    u, v = c - i, gamma - j
    candela = (1.0 - u) * ((1.0 - v) * table[i, j] + v * table[i, j + 1])
    candela = candela + u * ((1.0 - v) * table[i + 1, j] + v * table[i + 1, j + 1])
    return 2.0 * candela * point_lux(at, 1.0, place) * MATTE / PI


#: The lamp and the box of spot_shadow, m.
BOX_LAMP, BOX_LOW, BOX_HIGH = (-0.8, 0.4, 3.0), (-0.3, -0.3, 0.5), (0.3, 0.3, 1.0)


def shaded(at: Array, grow: float = 0.0) -> Array:
    """(h, w, 1) bool: whether the box, larger by ``grow`` m all around, hides the lamp."""
    way = np.asarray(BOX_LAMP) - at
    low = (np.asarray(BOX_LOW) - grow - at) / way
    high = (np.asarray(BOX_HIGH) + grow - at) / way
    enter = np.minimum(low, high).max(axis=-1, keepdims=True)
    leave = np.maximum(low, high).min(axis=-1, keepdims=True)
    return np.asarray((enter < leave) & (leave > 0.0) & (enter < 1.0))


def spot_shadow(_: float) -> Array:
    """All that is in view lies within the 52 degrees that the cone fills."""
    ground = np.where(shaded(plane()), 0.0, point_lux(plane(), 2000.0, BOX_LAMP))
    top = inside(plane(BOX_HIGH[2]), (-0.3, 0.3), (-0.3, 0.3))
    return np.where(top, point_lux(plane(BOX_HIGH[2]), 2000.0, BOX_LAMP), ground) * MATTE / PI


def ggx_metal(_: float) -> Array:
    """L = F D G / (4 n.l n.v) E: Walter et al. 2007 with separable Smith; F = F0 of a metal."""
    at, place, alpha2 = plane(), (0.5, 0.25, 2.0), 0.45**4
    to_light = np.asarray(place) - at
    to_eye = np.array([0.0, 0.0, 4.0]) - at
    to_light = to_light / np.linalg.norm(to_light, axis=-1, keepdims=True)
    to_eye = to_eye / np.linalg.norm(to_eye, axis=-1, keepdims=True)
    half = to_light + to_eye
    nh = half[..., 2:] / np.linalg.norm(half, axis=-1, keepdims=True)
    nl, nv = to_light[..., 2:], to_eye[..., 2:]
    d = alpha2 / (PI * (nh**2 * (alpha2 - 1.0) + 1.0) ** 2)
    g = [2.0 * c / (c + np.sqrt(alpha2 + (1.0 - alpha2) * c**2)) for c in (nl, nv)]
    lobe = d * g[0] * g[1] / (4.0 * nl * nv) * np.array([0.9, 0.6, 0.3])
    return np.asarray(lobe * point_lux(at, 1000.0, place))


def two_tone_dome(_: float) -> Array:
    """A surface tilted by t sees (1 + cos t) / 2 of what is above the horizon."""
    x, y = plane()[..., :1] / 4.0, plane()[..., 1:2] / 4.0  # the ray's ways for one down
    slope = math.sqrt(3.0)  # z = slope (x - 0.05)
    along = (4.0 + slope * 0.05) / (1.0 + slope * x)
    panel = (x * along > 0.05) & (x * along < 0.55) & (np.abs(y * along) < 0.71)
    return np.where(panel, 0.75 * 512.0 + 0.25 * 64.0, 512.0) * MATTE


def panes(_: float) -> Array:
    """One pane or three of opacity 0.25 over the ground: each fades what is behind it into 0.8."""
    one, three = (0.8 + 0.75**count * (MATTE - 0.8) for count in (1, 3))
    return np.where(plane()[..., :1] < 0.0, one, three) * SKY


def light_link(_: float) -> Array:
    linked = point_lux(plane(), 1000.0, (0.5, 0.25, 2.0))
    free = point_lux(plane(), 500.0, (-0.5, 0.5, 1.5))
    return np.where(plane()[..., :1] < 0.0, linked + free, free) * MATTE / PI


@dataclass(frozen=True)
class Truth:
    """A stage's closed form: time code to (h, w, 3) cd/m2; pixels worth a probe."""

    closed_form: Callable[[float], Array]
    covers: tuple[str, ...]
    probes: tuple[tuple[int, int], ...] = ((8, 8), (32, 24), (40, 20), (55, 40))
    frames: tuple[float, ...] = (0.0,)
    notes: tuple[str, ...] = field(default=())


TRUTHS: Mapping[str, Truth] = {
    "point_plane": Truth(point_plane, ("point light", "inverse square", "cosine")),
    "point_plane_cm": Truth(point_plane, ("point light", "metersPerUnit")),
    "spot_cone": Truth(
        spot_cone, ("spot light", "cone", "soft edge"), ((32, 24), (20, 20), (40, 30), (12, 12))
    ),
    "spot_focus": Truth(spot_focus, ("spot light", "focus")),
    "distant_lux": Truth(distant_lux, ("distant light", "lux", "normalize", "exposure")),
    "dome": Truth(dome, ("dome light", "ambient")),
    "ambient_api": Truth(ambient_api, ("AmbientAPI", "dome light")),
    "emissive": Truth(emissive, ("emissive",), ((32, 24), (4, 4))),
    "texture_spaces": Truth(texture_spaces, ("texture", "gamma 2.2", "raw")),
    "instances": Truth(
        instances,
        ("instancing", "lights in instances", "PointInstancer"),
        ((32, 12), (15, 23), (48, 15), (15, 41), (32, 41), (27, 41), (49, 41), (49, 36)),
    ),
    "animated": Truth(animated, ("animation", "time samples", "moving camera"), frames=(0, 5, 10)),
    "vertex_colour": Truth(vertex_colour, ("vertex colour", "primvar reader")),
    "cut_out": Truth(cut_out, ("opacity", "alpha mask"), ((5, 5), (27, 24), (38, 24))),
    "blinn_phong": Truth(blinn_phong, ("specular", "Blinn-Phong"), ((32, 24), (36, 22), (10, 40))),
    "photometric_light": Truth(photometric_light, ("PhotometricLightAPI", "light colour")),
    "mesh_parts": Truth(
        mesh_parts,
        ("subsets", "holes", "left-handed", "back faces", "polygons"),
        ((8, 32), (24, 32), (40, 32), (56, 32), (8, 12), (32, 12), (56, 12), (49, 5)),
    ),
    "rect_light": Truth(rect_light, ("area light", "rect")),
    "disk_light": Truth(disk_light, ("area light", "disk")),
    "sphere_light": Truth(
        sphere_light, ("area light", "sphere", "seen"), ((8, 8), (37, 27), (55, 12), (55, 40))
    ),
    "photometric_file": Truth(photometric_file, ("IES LM-63", "candela multiplier", "type C")),
    "spot_shadow": Truth(
        spot_shadow, ("spot light", "shadow", "cube"), ((8, 8), (32, 24), (42, 30), (55, 40))
    ),
    "ggx_metal": Truth(ggx_metal, ("specular", "GGX", "metallic")),
    "two_tone_dome": Truth(
        two_tone_dome, ("dome light", "lat-long texture", "dome orientation"), ((8, 8), (38, 24))
    ),
    "panes": Truth(panes, ("opacity", "transparency", "order"), ((8, 8), (40, 24))),
    "light_link": Truth(light_link, ("light linking", "point light")),
}


def expected() -> dict[str, Any]:
    """The folder's expected.json, format hdrusd-truth/1."""
    cases = []
    for name, truth in TRUTHS.items():
        many = len(truth.frames) > 1
        cases.append(
            {
                "id": name,
                "class": "core",
                "stage": f"{name}.usda",
                "camera": "/World/Camera",
                "resolution": [WIDTH, HEIGHT],
                "covers": list(truth.covers),
                "frames": [
                    {"time": t, "exr": f"{name}.{t:04.0f}.exr" if many else f"{name}.exr"}
                    for t in map(float, truth.frames)
                ],
                "probes": [
                    _probe(number, truth.closed_form(t), float(t), pixel)
                    for t in truth.frames
                    for number, pixel in enumerate(truth.probes, 1)
                ],
            }
        )
    return {"format": "hdrusd-truth/1", "set": "own", "cases": cases}


def _probe(number: int, picture: Array, time: float, pixel: tuple[int, int]) -> dict[str, Any]:
    rgb = [float(f"{v:.8g}") for v in picture[pixel[1], pixel[0]]]
    value = {"Y": float(f"{np.dot([0.2126, 0.7152, 0.0722], rgb):.8g}"), "RGB": rgb}
    return {
        "id": f"p{number:02d}",
        "frame": time,
        "pixel": list(pixel),
        "expect": value,
        "pixel_average": value,
        "rel_tol": 1e-3,
        "abs_tol": 1e-6,
    }


def png(code: int) -> bytes:
    """A picture of one 8-bit RGB pixel, all channels ``code``."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    header = struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0)
    row = zlib.compress(bytes([0, code, code, code]))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", row) + chunk(b"IEND", b"")


def radiance() -> bytes:
    """A Radiance picture of 64 x 32 pixels: 512 above the horizon, 64 below, all channels."""
    header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32 +X 64\n"
    return header + bytes([128, 128, 128, 138]) * 1024 + bytes([128, 128, 128, 135]) * 1024


def luminaire() -> str:
    """``CANDELA`` as a file of IESNA LM-63-2002."""
    planes = [*CANDELA, CANDELA[0]]
    rows = ["0 30 60 90", "0 90 180 270 360", *(" ".join(map(str, row)) for row in planes)]
    lines = ["IESNA:LM-63-2002", "[TEST] hdrusd", "TILT=NONE", "1 -1 1 4 5 1 2 0 0 0", "1 1 10"]
    return "\n".join([*lines, *rows, ""])


def document() -> str:
    """expected.json as text, a probe a line."""
    text = json.dumps(expected(), indent=1)
    return text + "\n"


if __name__ == "__main__":
    (FOLDER / "expected.json").write_text(document(), encoding="utf-8")
    (FOLDER / "code128.png").write_bytes(png(128))
    (FOLDER / "two_tone.hdr").write_bytes(radiance())
    (FOLDER / "luminaire.ies").write_text(luminaire(), encoding="utf-8")
