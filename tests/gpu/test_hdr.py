"""Shader 1 against its NumPy definition on its own G-buffer, and against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from parity import assert_is_its_shading
from small_scenes import draw, lights, lit_quad, look, quad, rays, render, waves

from hdrusd.scene import Camera, Material, RenderScene

MATTE = Material(diffuse=(0.5, 0.3, 0.2))
GLOSSY = Material(diffuse=(0.2, 0.2, 0.2), specular=(0.05, 0.04, 0.03), shininess=40.0)

POINT = {"position": (1.0, 0.5, 2.0), "intensity": (900.0, 700.0, 400.0)}
SPOT = POINT | {"axis": (-0.4, -0.2, -0.8944272), "inner": 0.2, "outer": 0.6}
FOCUS = POINT | {"axis": (-0.4, -0.2, -0.8944272), "exponent": 12.0}
BOTH = SPOT | {"exponent": 3.0}
DISTANT = {"position": (0.36, 0.48, 0.8), "w": 0.0, "intensity": (30.0, 40.0, 50.0)}
LAMP = POINT | {"radius": 1.5}


def sheet(material: Material, *rows: dict[str, Any], camera: Camera | None = None) -> RenderScene:
    return RenderScene(
        lights=lights(*rows),
        draws=(draw(waves()),),
        materials=(material,),
        camera=camera or look((0.5, -2.5, 2.5), half=0.45),
    )


@pytest.mark.parametrize("material", [MATTE, GLOSSY], ids=["matte", "glossy"])
@pytest.mark.parametrize(
    "light",
    [POINT, SPOT, FOCUS, BOTH, DISTANT, LAMP],
    ids=["point", "spot", "focus", "spot-focus", "distant", "large"],
)
def test_frame_is_the_shading_of_its_g_buffer(
    gl: Any, material: Material, light: dict[str, Any]
) -> None:
    assert_is_its_shading(gl, sheet(material, light))


@pytest.mark.parametrize("reflection", ["lambert", "petit2010"])
def test_both_reflections(gl: Any, reflection: str) -> None:
    """With ambient light, of which Blinn-Phong has its diffuse part."""
    scene = sheet(GLOSSY, POINT, SPOT, FOCUS, DISTANT)
    dark = assert_is_its_shading(gl, scene, reflection=reflection)
    lit = render(gl, replace(scene, ambient=(3.0, 2.0, 1.0)), reflection=reflection)
    scale = 1.0 if reflection == "petit2010" else 1.0 / math.pi
    wanted = dark.frame + dark.diffuse * (3.0, 2.0, 1.0) * scale
    # one rounding of the sum that each batch is added to
    np.testing.assert_allclose(lit.frame[dark.surface], wanted[dark.surface], rtol=1e-6)


def test_orthographic_camera(gl: Any) -> None:
    camera = look((0.5, -2.5, 2.5), half=1.2, orthographic=True)
    assert_is_its_shading(gl, sheet(GLOSSY, POINT, SPOT, DISTANT, camera=camera))


@pytest.mark.parametrize("count", [1, 15, 16, 30, 300])
def test_any_number_of_plain_lights(gl: Any, count: int) -> None:
    rng = np.random.default_rng(count)
    rows = [
        {
            "position": (*rng.uniform(-3, 3, 2), rng.uniform(1, 4)),
            "intensity": rng.uniform(1, 100, 3),
        }
        for _ in range(count)
    ]
    assert_is_its_shading(gl, sheet(MATTE, *rows))


@pytest.mark.parametrize("kind", [SPOT, FOCUS, DISTANT], ids=["spot", "focus", "distant"])
@pytest.mark.parametrize("count", [7, 8, 10, 11, 15, 16])
def test_batch_borders_of_each_kind(gl: Any, kind: dict[str, Any], count: int) -> None:
    """Lights that differ in colour only: a light lost or taken twice is a missing number."""
    rows = [kind | {"intensity": tuple(2.0**k * np.eye(3)[k % 3])} for k in range(count)]
    assert_is_its_shading(gl, sheet(GLOSSY, *rows))


def test_kinds_in_one_frame_add_up(gl: Any) -> None:
    rows = [POINT, SPOT, FOCUS, DISTANT, BOTH]
    single = [render(gl, sheet(GLOSSY, row)).frame for row in rows]
    together = render(gl, sheet(GLOSSY, *rows)).frame
    # one rounding a light added
    np.testing.assert_allclose(together, np.sum(single, axis=0), rtol=1e-5, atol=1e-6)


def test_each_frame_starts_anew(gl: Any) -> None:
    bright = render(gl, sheet(MATTE, POINT)).frame
    dark = render(gl, sheet(MATTE)).frame
    assert bright.max() > 1.0
    assert not dark.any()


# -- closed forms on a plane: the pixel's ray meets z = 0 -------------------------------------


def plane_points(camera: Camera) -> np.ndarray:
    origins, directions = rays(camera)
    return np.asarray(origins - directions * (origins[..., 2:] / directions[..., 2:]))


def lambert_plane(camera: Camera, rho: tuple[float, ...]) -> np.ndarray:
    """L = rho I cos(theta) / (pi d^2) under the lamp of ``lit_quad``, 0 off the square."""
    points = plane_points(camera)
    to_light = np.array([0.3, 0.2, 2.0]) - points
    d2 = np.sum(to_light**2, axis=-1, keepdims=True)
    lux = np.array([100.0, 80.0, 60.0]) * to_light[..., 2:] / d2**1.5
    inside = np.max(np.abs(points[..., :2]), axis=-1, keepdims=True) < 1.0
    return np.asarray(np.where(inside, np.asarray(rho) * lux / math.pi, 0.0))


def test_lambert_plane(gl: Any) -> None:
    scene = lit_quad(diffuse=(0.5, 0.4, 0.3))
    got = render(gl, scene).frame
    np.testing.assert_allclose(got, lambert_plane(scene.camera, (0.5, 0.4, 0.3)), rtol=1e-5)


def test_ambient_and_emission_are_added_once(gl: Any) -> None:
    scene = replace(
        lit_quad(diffuse=(0.5, 0.4, 0.3), emission=(7.0, 8.0, 9.0)),
        ambient=(10.0, 20.0, 30.0),
        lights=lights(),
    )
    got = render(gl, scene)
    wanted = np.array([7, 8, 9]) + np.array([0.5, 0.4, 0.3]) * np.array([10, 20, 30]) / math.pi
    np.testing.assert_allclose(
        got.frame[got.surface], np.tile(wanted, (got.surface.sum(), 1)), 1e-6
    )


@pytest.mark.parametrize("distance", [1e3, 1e6])
def test_far_from_the_origin_keeps_millimetres(gl: Any, distance: float) -> None:
    """Everything moved by 1,000 km: the eye is subtracted in float64, so nothing changes."""
    offset = np.array([distance, -0.7 * distance, 0.5 * distance])
    near = lit_quad(diffuse=(0.5, 0.4, 0.3), specular=(0.04,) * 3, shininess=20.0)
    move = np.eye(4)
    move[3, :3] = offset
    far_lights = near.lights.copy()
    far_lights["position"] += offset
    far = replace(
        near,
        lights=far_lights,
        draws=(draw(quad(), 0, move),),
        camera=replace(near.camera, eye=tuple(np.asarray(near.camera.eye) + offset)),
    )
    # 1e6 m in float64 is good to 2e-10 m; the frames differ by roundings of float32 at most
    np.testing.assert_allclose(render(gl, far).frame, render(gl, near).frame, rtol=1e-5)


# -- faces ------------------------------------------------------------------------------------


def from_behind(*, double_sided: bool, lamp_z: float = -2.0) -> RenderScene:
    return RenderScene(
        lights=lights({"position": (0.0, 0.0, lamp_z), "intensity": (100.0,) * 3}),
        draws=(draw(quad(), double_sided=double_sided),),
        materials=(MATTE,),
        camera=look((0.0, 0.0, -3.0)),
    )


def test_back_faces_are_not_drawn(gl: Any) -> None:
    got = render(gl, from_behind(double_sided=False))
    assert not got.surface.any()
    assert not got.frame.any()


def test_double_sided_faces_the_eye(gl: Any) -> None:
    got = render(gl, from_behind(double_sided=True))
    assert got.surface.any()
    np.testing.assert_allclose(
        got.normal[got.surface], np.tile([0, 0, -1.0], (got.surface.sum(), 1))
    )
    assert got.frame[got.surface].min() > 0.0


def test_double_sided_is_not_lit_from_the_far_side(gl: Any) -> None:
    got = render(gl, from_behind(double_sided=True, lamp_z=2.0))
    assert got.surface.any()
    assert not got.frame.any()


def matrix(rows: list[list[float]], move: tuple[float, ...] = (0.0, 0.0, 0.0)) -> np.ndarray:
    m = np.eye(4)
    m[:3, :3] = rows
    m[3, :3] = move
    return m


MIRRORS = {
    "x": matrix([[-1, 0, 0], [0, 1, 0], [0, 0, 1]]),
    "swap": matrix([[0, 1, 0], [1, 0, 0], [0, 0, 1]]),
}


@pytest.mark.parametrize("mirror", MIRRORS)
def test_mirrored_faces_keep_their_front(gl: Any, mirror: str) -> None:
    """A mirror turns the winding around; what faced the camera still does, and is lit alike."""
    plain = lit_quad(diffuse=(0.5, 0.4, 0.3))
    got = render(gl, replace(plain, draws=(draw(quad(), 0, MIRRORS[mirror]),)))
    np.testing.assert_allclose(got.frame, lambert_plane(plain.camera, (0.5, 0.4, 0.3)), rtol=1e-5)


def test_mirrored_in_depth_shows_its_back(gl: Any) -> None:
    scene = replace(lit_quad(), draws=(draw(quad(), 0, np.diag([1.0, 1.0, -1.0, 1.0])),))
    assert not render(gl, scene).surface.any()


def test_plain_and_mirrored_instances_in_one_draw(gl: Any) -> None:
    left = matrix(np.eye(3).tolist(), (-1.0, 0.0, 0.0)) @ np.diag([0.5, 0.5, 1.0, 1.0])
    right = left @ np.diag([-1.0, 1.0, 1.0, 1.0])
    scene = replace(lit_quad(diffuse=(1.0, 1.0, 1.0)), draws=(draw(quad(), 0, left, right),))
    got = render(gl, scene)
    whole = lambert_plane(scene.camera, (1.0, 1.0, 1.0))
    inside = np.max(np.abs(plane_points(scene.camera)[..., :2]) - [1.0, 0.5], axis=-1) < 0.0
    np.testing.assert_array_equal(got.surface, inside)
    np.testing.assert_allclose(got.frame[inside], whole[inside], rtol=1e-5)


@pytest.mark.parametrize("flip", [1.0, -1.0], ids=["plain", "mirrored"])
def test_normals_under_non_uniform_scale(gl: Any, flip: float) -> None:
    """The normal of a sheared, scaled plane is its geometric one: the inverse transpose."""
    linear = np.array([[2.0 * flip, 0.0, 0.4], [0.0, 0.5, -0.3], [0.2, 0.1, 3.0]])
    u, v = np.array([2.0, 0.0, 1.0]), np.array([0.0, 2.0, 0.5])
    scene = replace(
        lit_quad(),
        draws=(draw(quad((-1.0, -1.0, -0.75), tuple(u), tuple(v)), 0, matrix(linear.tolist())),),
    )
    got = render(gl, scene)
    wanted = np.cross(u @ linear, v @ linear) * flip  # a mirror turns the cross product around
    wanted /= np.linalg.norm(wanted)
    assert got.surface.any()
    np.testing.assert_allclose(
        got.normal[got.surface], np.tile(wanted, (got.surface.sum(), 1)), atol=1e-6
    )


def test_nearer_surface_hides_the_farther(gl: Any) -> None:
    near = quad((-0.5, -0.5, 0.5), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), key="near")
    for order in ([0, 1], [1, 0]):
        draws = (draw(quad(), 0), draw(near, 1))
        scene = RenderScene(
            draws=tuple(draws[k] for k in order),
            materials=(Material(emission=(1.0, 1.0, 1.0)), Material(emission=(5.0, 5.0, 5.0))),
            camera=look(),
        )
        frame = render(gl, scene).frame
        assert frame[24, 32, 0] == 5.0
        assert frame[2, 32, 0] == 1.0


def test_new_version_of_a_geometry_is_shown(gl: Any) -> None:
    from small_scenes import HEIGHT, WIDTH

    from hdrusd.gpu.hdr import HdrRenderer, Options
    from hdrusd.gpu.program import Programs

    renderer = HdrRenderer(
        gl, Programs(gl), (WIDTH, HEIGHT), lambda _: None, Options(shadows=False)
    )
    first = lit_quad()
    renderer.render(first)
    seen = renderer.read().any(axis=-1).sum()
    small = quad((-0.5, -0.5, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), version=1)
    renderer.render(replace(first, draws=(draw(small),)))
    assert renderer.read().any(axis=-1).sum() == pytest.approx(seen / 4, rel=0.1)
    gl.extra["framebuffer"].use()


# -- vertex colour, alpha ---------------------------------------------------------------------


def test_vertex_colour_multiplies_the_reflectance(gl: Any) -> None:
    scene = replace(
        lit_quad(diffuse=(0.5, 0.4, 0.3), vertex_color="paint"),
        draws=(draw(quad(colors={"paint": (0.1, 0.5, 1.0)})),),
    )
    got = render(gl, scene).frame
    np.testing.assert_allclose(got, lambert_plane(scene.camera, (0.05, 0.2, 0.3)), rtol=1e-5)


def test_missing_vertex_colour_is_white(gl: Any) -> None:
    scene = lit_quad(diffuse=(0.5, 0.4, 0.3), vertex_color="paint")
    got = render(gl, scene).frame
    np.testing.assert_allclose(got, lambert_plane(scene.camera, (0.5, 0.4, 0.3)), rtol=1e-5)


@pytest.mark.parametrize(("opacity", "seen"), [(0.49, False), (0.5, True), (1.0, True)])
def test_opacity_below_the_threshold_is_cut_out(gl: Any, opacity: float, seen: bool) -> None:
    got = render(gl, lit_quad(opacity=opacity, opacity_threshold=0.5))
    assert bool(got.surface.any()) is seen
