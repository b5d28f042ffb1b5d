"""photometry/profile.glsl against the NumPy functions of the same names."""

from __future__ import annotations

import inspect
import math
from typing import Any

import numpy as np
import pytest
from photometric_files import ies, ies_text, ldt, ldt_text
from test_photometry_twins import ROUNDING, f32, unit

from hdrusd.gpu.evaluate import evaluate
from hdrusd.gpu.profiles import ProfileAtlas
from hdrusd.gpu.program import build
from hdrusd.gpu.source import from_text
from hdrusd.photometry import profile
from hdrusd.photometry.profile import even_profile, pack_profiles, profile_candela
from hdrusd.scene import Profile, light_rows

FILE = "photometry/profile.glsl"
N = 4096

#: Abramowitz and Stegun 4.4.49 promises 2e-8 rad; the quotient, the square, nine products and
#: sums below 1 and up to two differences near pi are rounded: (4 + 2 pi) 2^-24 at most.
ARCTAN = 2e-8 + (4 + 2 * math.pi) * ROUNDING

#: The sides that go in are rounded too: a square, a sum, a root of numbers below 1.
ANGLE = ARCTAN + 3 * ROUNDING

rng = np.random.default_rng(63)
VECTORS = np.concatenate([np.eye(3), -np.eye(3), unit(N - 6)])


def test_angle_from_sides(gl: Any) -> None:
    turns = np.linspace(-math.pi, math.pi, N)
    length = np.exp(rng.uniform(-8.0, 8.0, N))
    y, x = f32(length * np.sin(turns)), f32(length * np.cos(turns))
    got = evaluate(gl, FILE, "angle_from_sides", {"y": y, "x": x}, "float")
    assert np.abs(got - profile.angle_from_sides(y, x)).max() <= ARCTAN
    small = evaluate(gl, FILE, "angle_from_sides", {"y": f32([1e-6]), "x": f32([1.0])}, "float")
    assert small[0] == pytest.approx(1e-6, rel=1e-6)


def test_no_direction_has_an_angle_all_the_same(gl: Any) -> None:
    zero = {"y": np.zeros(1), "x": np.zeros(1)}
    assert evaluate(gl, FILE, "angle_from_sides", zero, "float").tolist() == [0.0]


@pytest.mark.parametrize("type", [0, 1, 2])
def test_profile_angles(gl: Any, type: int) -> None:
    arrays = {"direction": VECTORS, "type": np.full(N, float(type))}
    got = evaluate(gl, FILE, "profile_angles", arrays, "vec2")
    wanted = profile.profile_angles(VECTORS, np.array(type))
    # Near a pole the angle about it is any: compare where the sides of both are clear.
    clear = np.minimum(np.linalg.norm(VECTORS[:, :2], axis=1), 1.0) > 1e-3
    clear &= np.linalg.norm(VECTORS[:, [0, 2]], axis=1) > 1e-3
    clear &= np.linalg.norm(VECTORS[:, 1:], axis=1) > 1e-3
    turned = np.abs(got - wanted)
    turned = np.minimum(turned, 2 * math.pi - turned)  # -pi is pi
    assert turned[clear].max() <= ANGLE


def on_gpu(gl: Any, profiles: list[Profile], number: int, vectors: np.ndarray) -> np.ndarray:
    """profile_candela of directions, through the atlas as the renderer makes it."""
    atlas = ProfileAtlas(gl)
    atlas.update(tuple(profiles))
    lights = light_rows(1)
    lights["profile"] = number
    texels, kinds = atlas.of_lights(lights)
    assert kinds.tolist() == ["PROFILE"]
    text = f"""
        #include "{FILE}"
        uniform sampler2D atlas;
        uniform vec4 place;
        uniform vec4 grid;
        in vec3 direction;
        out float result;
        void main()
        {{
            gl_Position = vec4(0.0);
            result = profile_candela(atlas, place, grid, direction);
        }}
    """
    program = build(gl, from_text(text, "<twin>"), varyings=("result",))
    assert atlas.texture is not None
    atlas.texture.use(0)
    program["atlas"] = 0
    program["place"], program["grid"] = (tuple(map(float, row)) for row in texels[0])
    buffer = gl.buffer(vectors.astype(np.float32))
    captured = gl.buffer(reserve=4 * len(vectors))
    vertices = gl.vertex_array(program, [(buffer, "3f4", "direction")])
    vertices.transform(captured, mode=gl.POINTS, vertices=len(vectors))
    result = np.frombuffer(captured.read(), np.float32).astype(np.float64)
    for thing in (buffer, captured, vertices, program):
        thing.release()
    atlas.release()
    return result


def road() -> str:
    """A figure with a steep flank, 5 by 2.5 degrees, as road luminaires have."""
    planes, angles = np.arange(90.0, 271.0, 5.0), np.arange(0.0, 91.0, 2.5)
    c, g = np.radians(planes)[:, None], np.radians(angles)
    rows = 1e4 * np.exp(-(((g - 1.1 - 0.1 * np.sin(c)) / 0.12) ** 2)) + 2500 * np.cos(g)
    return ies_text(rows, planes=planes.tolist(), angles=angles.tolist())


PROFILES = [
    even_profile(ies(road()))[0],
    even_profile(ies(ies_text()))[0],
    even_profile(ldt(ldt_text()))[0],
    even_profile(ies(ies_text([900, 300, 0], planes=(0,), angles=(0, 60, 180))))[0],
    even_profile(ies(ies_text([900, 300, 5], planes=(0,), angles=(90, 100, 180))))[0],
    even_profile(ies(ies_text(np.arange(63) ** 2, planes=range(-40, 41, 10),
                              angles=range(-15, 16, 5), type="A")))[0],
    even_profile(ies(ies_text(np.arange(63) ** 2, planes=range(-40, 41, 10),
                              angles=range(-15, 16, 5), type="B")))[0],
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(PROFILES)))
def test_profile_candela(gl: Any, number: int) -> None:
    chosen = PROFILES[number]
    got = on_gpu(gl, PROFILES, number, VECTORS)
    atlas, places = pack_profiles(PROFILES)
    place, grid = places[number].astype(np.float64)
    wanted = profile_candela(atlas, place, grid, VECTORS)
    # An angle and its first one are subtracted and multiplied by cells a radian: 3 roundings
    # of up to 2 pi. What that moves the value is at most the steepest slope; mixing rounds 6
    # times.
    moved = ANGLE + 3 * ROUNDING * 2 * math.pi
    slope = sum(
        float(np.abs(np.diff(chosen.candela, axis=axis)).max(initial=0.0)) * grid[1 + 2 * axis]
        for axis in (0, 1)
    )
    peak = float(chosen.candela.max())
    # Where the table ends in light, a rounding decides between it and nothing.
    edge = edges(chosen, VECTORS)
    worst = np.abs(got - wanted)[~edge].max()
    assert worst <= moved * slope + 6 * ROUNDING * peak
    assert worst <= 1e-5 * peak
    assert (got[edge] >= 0.0).all()
    assert np.count_nonzero(got) > 10


def edges(chosen: Profile, vectors: np.ndarray) -> np.ndarray:
    """Directions within a thousandth of a cell and its rounding of the end of the table."""
    number = "CAB".index(chosen.type)
    angles = profile.profile_angles(vectors, np.array(number))
    near = np.zeros(len(vectors), bool)
    for index, ends in ((1, chosen.angles), (0, chosen.planes)):
        if index == 0 and chosen.type == "C":
            continue
        cell = (ends[1] - ends[0]) / (chosen.candela.shape[index] - 1)
        for end in ends:
            near |= np.abs(np.abs(angles[:, index] - end) - profile.EDGE * cell) < 2e-6
    return near


def test_signatures_are_the_same() -> None:
    for name, parameters in {
        "angle_from_sides": ["y", "x"],
        "profile_angles": ["direction", "type"],
        "profile_candela": ["atlas", "place", "grid", "direction"],
    }.items():
        assert list(inspect.signature(getattr(profile, name)).parameters) == parameters


def test_the_atlas_stays_while_the_profiles_do(gl: Any) -> None:
    atlas = ProfileAtlas(gl)
    atlas.update(())
    assert atlas.texture is None
    lights = light_rows(3)
    texels, kinds = atlas.of_lights(lights)
    assert texels.shape == (3, 2, 4)
    assert kinds.tolist() == ["", "", ""]
    atlas.update(tuple(PROFILES))
    first = atlas.texture
    atlas.update(tuple(PROFILES))
    assert atlas.texture is first
    atlas.update(tuple(PROFILES[:2]))
    assert atlas.texture is not first
    atlas.release()
