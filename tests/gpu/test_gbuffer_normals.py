"""Normal maps: which way a bump faces, by how its texture lies on the surface."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_scenes import Array, draw, gbuffer, lights, look, quad, render, waves

from hdrusd.scene import Geometry, ImageData, Material, RenderScene, TextureRef, TextureUse

#: A bump's normal in tangent space, exact as half floats; unit length is not asked for.
BUMP = np.array([0.5, 0.25, 0.75])
UNIT = BUMP / np.linalg.norm(BUMP)

#: A difference of two neighbours' positions: 6e-8 of 3 m, over 1e-2 m a pixel, and as much of
#: the coordinates.
DIRECTION = 1e-4


def picture(*rows: Array) -> Any:
    pixels = np.array([rows], np.float32).reshape(1, -1, 3)
    return lambda _: ImageData(np.tile(pixels, (2, 1, 1)))


def bumpy(**fields: Any) -> Material:
    use = TextureUse(TextureRef("bump.exr", "linear"), **fields)
    return Material(normal_map=use)


def scene(geometry: Geometry, *places: Array, **fields: Any) -> RenderScene:
    options = {"double_sided": fields.pop("double_sided", False)}
    made = RenderScene(
        lights=lights(),
        draws=(draw(geometry, 0, *places, **options),),
        materials=(fields.pop("material", bumpy()),),
        camera=fields.pop("camera", look()),
    )
    return replace(made, **fields)


def normals(gl: Any, made: RenderScene, load: Any = None) -> Array:
    """(n, 3) of the pixels that show the surface."""
    found = gbuffer(gl, made, load or picture(BUMP))
    shown = found["hdr"][..., 3] == 1.0
    assert shown.sum() > 300
    return found["g_normal"][shown][:, :3]


def all_are(got: Array, wanted: Any, tolerance: float = DIRECTION) -> None:
    wanted = np.asarray(wanted) / np.linalg.norm(wanted)
    np.testing.assert_allclose(got, np.broadcast_to(wanted, got.shape), atol=tolerance)


def test_red_is_along_s_green_along_t_blue_outward(gl: Any) -> None:
    """A square in the plane z = 0, s along +X, t along +Y: tangent space is the world."""
    for axis in range(3):
        bump = np.eye(3)[axis] + [0.0, 0.0, 1.0]
        all_are(normals(gl, scene(quad()), picture(bump)), bump)


#: Coordinates (s, t) as a matrix on the square's own, and the bump's normal that follows.
LAYOUTS = {
    "plain": ([[1, 0], [0, 1]], [1, 1]),
    "mirrored in s": ([[-1, 0], [0, 1]], [-1, 1]),
    "mirrored in t": ([[1, 0], [0, -1]], [1, -1]),
    "half a turn": ([[-1, 0], [0, -1]], [-1, -1]),
    "stretched": ([[5, 0], [0, 0.3]], [1, 1]),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_mirrored_and_stretched_coordinates(gl: Any, layout: str) -> None:
    matrix, signs = LAYOUTS[layout]
    geometry = quad(uvs={"st": lambda st: st @ np.array(matrix, float).T})
    all_are(normals(gl, scene(geometry)), UNIT * [*signs, 1])


@pytest.mark.parametrize("degrees", [30.0, 90.0, 200.0])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_turned_coordinates_turn_the_bump(gl: Any, degrees: float, mirror: float) -> None:
    """With s along a and t along b on the surface the normal is a x + b y + n z."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    a, b = np.array([c, s, 0.0]), mirror * np.array([-s, c, 0.0])
    geometry = quad(uvs={"st": lambda st: st @ np.stack([a[:2], b[:2]], axis=1)})
    wanted = a * UNIT[0] + b * UNIT[1] + [0.0, 0.0, UNIT[2]]
    all_are(normals(gl, scene(geometry)), wanted)


def test_transform_of_the_texture_turns_the_bump(gl: Any) -> None:
    """By u' = a u + b v + c as by the coordinates themselves."""
    c, s = math.cos(0.7), math.sin(0.7)
    material = bumpy(matrix=(2 * c, 2 * s, 0.3, -2 * s, 2 * c, 0.1))
    wanted = [c * UNIT[0] - s * UNIT[1], s * UNIT[0] + c * UNIT[1], UNIT[2]]
    all_are(normals(gl, scene(quad(), material=material)), wanted)


def test_sheared_coordinates_keep_red_along_s(gl: Any) -> None:
    """Green then is square to red, on the side to which t grows."""
    geometry = quad(uvs={"st": lambda st: st @ np.array([[1.0, 0.0], [0.5, -1.0]])})
    # s = x + y / 2, t = -y: along +X s grows and t does not.
    all_are(normals(gl, scene(geometry)), UNIT * [1, -1, 1])


PLACES = {
    "turned": [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]],
    "mirrored": [[-1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "scaled": [[0.4, 0, 0], [0, 0.4, 0], [0, 0, 0.4]],
    "scaled unevenly": [[0.5, 0, 0], [0, 1.5, 0], [0, 0, 3]],
}


@pytest.mark.parametrize("name", PLACES)
def test_bump_follows_its_mesh(gl: Any, name: str) -> None:
    linear = np.array(PLACES[name], float)
    place = np.eye(4)
    place[:3, :3] = linear
    s, t = (row / np.linalg.norm(row) for row in linear[:2])
    n = np.cross(linear[0], linear[1]) * np.sign(np.linalg.det(linear))
    n /= np.linalg.norm(n)
    made = scene(quad(), place, camera=look(tuple(2.0 * n + [0.1, 0.3, 0.2])))
    all_are(normals(gl, made), s * UNIT[0] + t * UNIT[1] + n * UNIT[2])


def test_back_of_a_sheet_is_embossed(gl: Any) -> None:
    """What rises on the front is hollow on the back: the normal is the front's, reversed."""
    made = scene(quad(), double_sided=True, camera=look((0.5, 0.3, -3.0)))
    all_are(normals(gl, made), -UNIT)


def test_mirrored_place_seen_from_behind(gl: Any) -> None:
    place = np.diag([-1.0, 1.0, 1.0, 1.0])
    made = scene(quad(), place, double_sided=True, camera=look((0.5, 0.3, -3.0)))
    all_are(normals(gl, made), -UNIT * [-1, 1, 1])


@pytest.mark.parametrize("orthographic", [False, True])
def test_oblique_view(gl: Any, orthographic: bool) -> None:
    camera = look((2.5, -1.0, 0.9), half=0.9 if orthographic else 0.4, orthographic=orthographic)
    all_are(normals(gl, scene(quad(), camera=camera)), UNIT)


def test_scale_and_bias_of_an_8_bit_texture(gl: Any) -> None:
    """(2, 2, 2) and (-1, -1, -1), as UsdPreviewSurface asks: codes 0 to 255 are -1 to 1."""
    codes = np.array([200, 60, 255], np.uint8)
    material = bumpy(scale=(2.0, 2.0, 2.0, 1.0), bias=(-1.0, -1.0, -1.0, 0.0))
    got = normals(
        gl, scene(quad(), material=material), lambda _: ImageData(np.tile(codes, (2, 2, 1)))
    )
    all_are(got, codes / 255.0 * 2.0 - 1.0, 2e-3)  # half floats of 2^-11, twice


def test_every_pixel_reads_its_own_texel(gl: Any) -> None:
    """Left half leans left, right half right."""
    load = picture([-1.0, 0.0, 1.0], [1.0, 0.0, 1.0])
    found = gbuffer(gl, scene(quad(), camera=look(half=0.2)), load)["g_normal"]
    assert (found[:, :24, 0] < 0.0).all()
    assert (found[:, 40:, 0] > 0.0).all()


def test_own_texture_coordinate_set(gl: Any) -> None:
    geometry = quad(uvs={"st": lambda st: st, "detail": lambda st: -3.0 * st})
    plain = TextureUse(TextureRef("bump.exr", "linear"))
    material = replace(bumpy(uv_set="detail"), diffuse_map=plain)
    all_are(normals(gl, scene(geometry, material=material)), UNIT * [-1, -1, 1])


def test_flat_map_changes_nothing(gl: Any) -> None:
    """Over smooth normals, with coordinates that lie askew."""
    sheet = waves()
    uvs = {"st": sheet.points[:, :2] @ np.float32([[1, 2], [-1, 1]])}
    camera = look((0.5, -2.5, 2.5), half=0.45)
    bumped = scene(replace(sheet, uvs=uvs), camera=camera)
    got = normals(gl, bumped, picture(np.array([0.0, 0.0, 2.0])))
    plain = render(gl, replace(bumped, materials=(Material(),)))
    np.testing.assert_allclose(got, plain.normal[plain.surface], atol=1e-6)


@pytest.mark.parametrize(
    "coordinates", [lambda st: 0 * st, lambda st: st[:, :1] * [1.0, 2.0], lambda st: st * 1e-9]
)
def test_coordinates_without_area_leave_a_smooth_surface(gl: Any, coordinates: Any) -> None:
    got = normals(gl, scene(quad(uvs={"st": coordinates})))
    assert np.isfinite(got).all()
    np.testing.assert_allclose(np.linalg.norm(got, axis=1), 1.0, rtol=1e-6)


@pytest.mark.parametrize("bump", [[0.0, 0.0, 0.0], [np.nan] * 3])
def test_no_direction_in_the_map_leaves_a_smooth_surface(gl: Any, bump: list[float]) -> None:
    all_are(normals(gl, scene(quad()), picture(np.array(bump))), [0, 0, 1])


def test_missing_map_leaves_a_smooth_surface(gl: Any) -> None:
    all_are(normals(gl, scene(quad()), lambda _: None), [0, 0, 1])


def test_geometry_without_coordinates_is_smooth(gl: Any) -> None:
    all_are(normals(gl, scene(quad(uvs={}))), [0, 0, 1])


def test_light_follows_the_bump(gl: Any) -> None:
    """E = I (n.l) / d^2: a bump that faces the lamp gets all of it."""
    lamp = np.array([1.0, 0.5, 1.5]) * 2.0
    toward = lamp / np.linalg.norm(lamp)
    made = scene(quad((-0.01, -0.01, 0.0), (0.02, 0, 0), (0, 0.02, 0)), camera=look(half=0.002))
    made = replace(made, lights=lights({"position": tuple(lamp), "intensity": (70.0,) * 3}))
    got = render(gl, made, picture(toward))
    wanted = 0.18 / math.pi * 70.0 / np.sum(lamp**2)
    np.testing.assert_allclose(got.frame[24, 32], wanted, rtol=2e-3)
