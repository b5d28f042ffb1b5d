"""Lamps below a pixel: E = I / d^2 at the eye, whether a pixel's centre hits them or not."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders import light_row
from small_scenes import quad

from hdrusd.eye.observer import Observer
from hdrusd.glare.dazzling import most_dazzling
from hdrusd.glare.model import MODELS, angle
from hdrusd.glare.pyramid import pyramid
from hdrusd.glare.veil import directions, kernel, pixel_angle
from hdrusd.gpu.glare import GlarePass
from hdrusd.gpu.hdr import HdrRenderer, Options
from hdrusd.gpu.own_parts import triangle_distance
from hdrusd.gpu.program import Programs
from hdrusd.scene import DISK, RECT, SPHERE, Camera, Draw, Material, RenderScene
from hdrusd.usd.emitters import Emitters

SIZE = 160, 120

#: 16 by 12 degrees, nearly: pixels of 0.1 degrees.
HALF = math.tan(math.radians(8.0)), math.tan(math.radians(8.0)) * 0.75
FIELD = 16.0, 2.0 * math.degrees(math.atan(HALF[1]))
CAMERA = Camera(window=(-HALF[0], HALF[0], -HALF[1], HALF[1]), far=5000.0)
PIXEL = 2.0 * HALF[0] / SIZE[0]  # m at 1 m

EYE, CIE = Observer(), MODELS["cie135"]
DARK = Material(diffuse=(0.0, 0.0, 0.0))
GREY = Material(diffuse=(0.5, 0.5, 0.5))


def placed(*position: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[3, :3] = position
    return matrix[None]


def at(column: float, row: float, distance: float) -> tuple[float, float, float]:
    """A place whose image lies there, in pixels from the lower left corner."""
    x, y = ((v / n * 2.0 - 1.0) * h for v, n, h in zip((column, row), SIZE, HALF, strict=True))
    return x * distance, y * distance, -distance


def with_shapes(scene: RenderScene) -> RenderScene:
    """The scene with its lamps as ``StageReader`` draws them."""
    emitters = Emitters()
    emitters.show(scene.lights)
    draws, materials = emitters.draws(len(scene.materials), scene.profiles)
    return replace(scene, draws=scene.draws + draws, materials=scene.materials + materials)


def scene_of(*lights: Any, draws: Iterable[Draw] = (), camera: Camera = CAMERA) -> RenderScene:
    """Lamps and a black sheet far behind them."""
    sheet = quad((-2000.0, -2000.0, 0.0), (4000.0, 0.0, 0.0), (0.0, 4000.0, 0.0), key="sheet")
    behind = Draw(sheet, 0, placed(0.0, 0.0, -4000.0))
    return RenderScene(
        lights=np.concatenate(lights),
        draws=(behind, *draws),
        materials=(DARK, GREY, Material(diffuse=(0.0, 0.0, 0.0), emission=(3000.0,) * 3)),
        camera=camera,
    )


@pytest.fixture
def programs(gl: Any) -> Any:
    made = Programs(gl)
    yield made
    made.release()


def frame_and_rows(
    gl: Any, programs: Programs, scene: RenderScene, samples: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    options = Options(samples=samples, shadows=False)
    renderer = HdrRenderer(gl, programs, SIZE, lambda _: None, options)
    renderer.render(scene)
    frame = renderer.read()
    rows = renderer.small_lamps(frame)
    renderer.release()
    return frame, most_dazzling(*rows).rows


def veiled(frame: np.ndarray, rows: np.ndarray) -> np.ndarray:
    return np.asarray(pyramid(CIE, EYE, SIZE, FIELD).paint(frame, rows))


def lux(rows: np.ndarray) -> np.ndarray:
    return np.asarray(rows[rows[:, 3:].min(axis=1) >= 0.0, 3:].sum(axis=0))


def pixels(rows: np.ndarray) -> np.ndarray:
    return np.asarray(rows[rows[:, 3:].min(axis=1) < 0.0])


#: Of a ball of 5 cm at 200 m: 0.3 pixels across.
BALL = {"shape": SPHERE, "radius": 0.05}
DISTANCE = 200.0


@pytest.mark.parametrize("changes", [{}, BALL, {**BALL, "inner": 0.5, "outer": 1.0}])
def test_illuminance_is_candela_over_distance_squared(
    gl: Any, programs: Programs, changes: dict[str, Any]
) -> None:
    place = at(91.3, 40.8, DISTANCE)
    towards = np.array(place) / np.linalg.norm(place)
    lamp = light_row((800.0, 600.0, 400.0), position=place, axis=-towards, **changes)
    _, rows = frame_and_rows(gl, programs, with_shapes(scene_of(lamp)))
    (lit,) = rows[rows[:, 3] > 0.0]
    np.testing.assert_allclose(lit[:3], towards, atol=1e-7)
    wanted = np.array((800.0, 600.0, 400.0)) / np.dot(place, place)
    np.testing.assert_allclose(lit[3:], wanted, rtol=1e-6)


def test_a_lamp_that_is_hit_shows_as_a_pixel_that_does_not_scatter(
    gl: Any, programs: Programs
) -> None:
    lamp = light_row(1000.0, position=at(91.5, 40.5, DISTANCE), **BALL)
    frame, rows = frame_and_rows(gl, programs, with_shapes(scene_of(lamp)))
    # L = I / (pi r^2), in the pixel whose centre it is.
    assert frame[SIZE[1] - 1 - 40, 91] == pytest.approx(1000.0 / (math.pi * 0.0025), rel=2e-3)
    (shown,) = pixels(rows)
    np.testing.assert_allclose(
        shown[:3], np.array(at(91.5, 40.5, 1.0)) / np.linalg.norm(at(91.5, 40.5, 1.0)), atol=1e-7
    )
    assert shown[3:].tolist() == [-1.0, -1.0, -1.0]


def far_from(place: tuple[float, float, float], degrees: float) -> np.ndarray:
    """(h, w) the pixels at least so far from a place, top row first."""
    way = np.array(place) / np.linalg.norm(place)
    return np.asarray(angle(directions(SIZE, FIELD), way) > degrees)


@pytest.mark.parametrize("drawn", [False, True])
def test_veil_is_the_closed_form_wherever_in_a_pixel_the_lamp_is(
    gl: Any, programs: Programs, drawn: bool
) -> None:
    """f(theta) I / d^2 within the pyramid's 7 %, and the same within 1 %, hit or missed."""
    random = np.random.default_rng(5)
    hits, veils = 0, []
    places = [(80.5, 60.5), (80.02, 60.02), *random.uniform(80.0, 81.0, (10, 2)).tolist()]
    for column, row in places:
        place = at(column, row, DISTANCE)
        lamp = light_row(5000.0, position=place, **(BALL if drawn else {}))
        scene = scene_of(lamp)
        frame, rows = frame_and_rows(gl, programs, with_shapes(scene) if drawn else scene)
        hits += bool(frame.max() > 0.0)
        theta = angle(directions(SIZE, FIELD), np.array(place) / np.linalg.norm(place))
        f = kernel(CIE, EYE, pixel_angle(SIZE, FIELD), theta)
        ratio = veiled(frame, rows)[..., 0] / (f * 5000.0 / np.dot(place, place))
        beyond = (theta > 1.0) & (theta < 5.0)
        assert abs(ratio[beyond].mean() - 1.0) < 0.04
        assert np.abs(ratio[beyond] - 1.0).max() < 0.25
        veils.append(ratio[beyond].mean())
    assert hits == 0 if not drawn else 0 < hits < len(places)
    assert max(veils) / min(veils) - 1.0 < 0.01


@pytest.mark.parametrize("samples", [1, 4])
def test_veil_does_not_change_as_a_lamp_moves_by_parts_of_a_pixel(
    gl: Any, programs: Programs, samples: int
) -> None:
    """Mean luminance of the veil two degrees and more away, within 0.5 % from step to step."""
    means = []
    for step in np.linspace(80.0, 82.0, 21):
        place = at(step, 60.0 + 0.37 * step % 1.0, DISTANCE)
        lamp = light_row(5000.0, position=place, **BALL)
        frame, rows = frame_and_rows(gl, programs, with_shapes(scene_of(lamp)), samples)
        means.append(veiled(frame, rows)[far_from(at(81.0, 60.5, 1.0), 2.0)].mean())
    assert np.abs(np.diff(means) / means[:-1]).max() < 0.005


def test_nothing_jumps_as_a_lamp_comes_near(gl: Any, programs: Programs) -> None:
    """From half a pixel to four across, at constant lux and off the pixels' grid."""
    totals = []
    for across in np.geomspace(0.5, 1.6, 12):
        distance = 2.0 * 0.05 / (across * PIXEL)
        place = at(80.3, 60.4, distance)
        lamp = light_row(distance**2, position=place, **BALL)
        frame, rows = frame_and_rows(gl, programs, with_shapes(scene_of(lamp)))
        totals.append(veiled(frame, rows)[far_from(place, 2.0)].mean())
    # A disc of 1.6 pixels is 2.0 pixels in area and hits 1 to 4: off by a factor without.
    assert np.abs(np.diff(totals) / totals[:-1]).max() < 0.25
    assert totals[0] == pytest.approx(totals[4], rel=0.01)


def wall(distance: float, key: str = "wall", **changes: Any) -> Draw:
    """20 m square, over all of the frame."""
    sheet = quad((-10.0, -10.0, 0.0), (20.0, 0.0, 0.0), (0.0, 20.0, 0.0), key=key)
    return Draw(sheet, 1, placed(0.0, 0.0, -distance), **changes)


@pytest.mark.parametrize(("distance", "seen"), [(5.0, 0.0), (49.0, 0.0), (50.5, 1.0)])
def test_what_stands_before_a_lamp_hides_it(
    gl: Any, programs: Programs, distance: float, seen: float
) -> None:
    lamp = light_row(100.0, position=at(80.3, 60.4, 50.0))
    _, rows = frame_and_rows(gl, programs, scene_of(lamp, draws=[wall(distance)]))
    assert lux(rows)[0] * 50.0**2 == pytest.approx(100.0 * seen, rel=1e-3)


def test_a_lamp_comes_out_from_behind_an_edge_over_one_pixel(gl: Any, programs: Programs) -> None:
    """The edge at column 80: hidden to 79.5, free from 80.5, half way half seen."""
    sheet = quad((0.0, -10.0, 0.0), (-10.0, 0.0, 0.0), (0.0, 20.0, 0.0), normal=(0.0, 0.0, 1.0))
    half = Draw(sheet, 1, placed(0.0, 0.0, -10.0), double_sided=True)
    shares = []
    for column in (79.0, 79.5, 79.75, 80.0, 80.5):
        lamp = light_row(2500.0, position=at(column, 60.3, 50.0))
        _, rows = frame_and_rows(gl, programs, scene_of(lamp, draws=[half]))
        shares.append(float(lux(rows)[0]))
    np.testing.assert_allclose(shares, [0.0, 0.0, 0.25, 0.5, 1.0], atol=1e-3)


def box(distance: float, size: float, key: str, material: int, **changes: Any) -> Draw:
    """A square of ``size`` m that stands before a lamp, and has a little depth."""
    u, v = (size, 0.0, 0.01), (0.0, size, 0.01)
    sheet = quad((-size / 2.0, -size / 2.0, -0.01), u, v, key=key)
    return Draw(sheet, material, placed(0.0, 0.0, -distance), **changes)


def test_own_fixture_does_not_hide_a_lamp_and_a_wall_does(gl: Any, programs: Programs) -> None:
    """The shadow link has bit 0 of what casts; the fixture has none."""
    lamp = light_row(100.0, position=(0.0, 0.0, -50.0), shadow_link=1)
    fixture = box(49.6, 0.6, "fixture", 1, shadow_links=0)
    _, rows = frame_and_rows(gl, programs, scene_of(lamp, draws=[fixture]))
    assert lux(rows)[0] * 2500.0 == pytest.approx(100.0)
    other = box(49.6, 0.6, "other", 1, shadow_links=1)
    _, rows = frame_and_rows(gl, programs, scene_of(lamp, draws=[other]))
    assert not len(rows)
    _, rows = frame_and_rows(gl, programs, scene_of(lamp, draws=[fixture, wall(49.0)]))
    assert not len(rows)  # the wall casts no shadow of the lamp either, but is no fixture
    behind = wall(49.0, shadow_links=1)
    _, rows = frame_and_rows(gl, programs, scene_of(lamp, draws=[fixture, behind]))
    assert not len(rows)


def test_glass_that_shows_a_lamp_is_counted_once(gl: Any, programs: Programs) -> None:
    """A glass of 0.1 m before a lamp without shape: far off by candela, near by its pixels."""
    for distance, small in ((200.0, True), (10.0, False)):
        glass = box(distance - 0.1, 0.1, "glass", 2)
        lamp = light_row(1000.0, position=(0.0, 0.0, -distance))
        off = -PIXEL * distance / 2.0
        camera = replace(CAMERA, eye=(off, off, 0.0))
        frame, rows = frame_and_rows(gl, programs, scene_of(lamp, draws=[glass], camera=camera))
        assert frame.max() == pytest.approx(3000.0)  # the centre of the pixel hits the glass
        if small:
            assert lux(rows)[0] * distance**2 == pytest.approx(1000.0, rel=1e-3)
            assert len(pixels(rows)) == 1
            assert veiled(frame, rows)[30, 40, 0] == pytest.approx(
                veiled(0.0 * frame, rows)[30, 40, 0], rel=1e-6
            )
        else:
            assert not len(rows)


def test_large_and_flat_lamps_and_those_beside_are_none(gl: Any, programs: Programs) -> None:
    large = light_row(1.0, position=at(80.0, 60.0, 5.0), **BALL)
    beside = light_row(1.0, position=at(-3.0, 60.0, 50.0))
    sun = light_row(1.0, position=(0.0, 0.0, -1.0), w=0.0)
    away = {"axis": (0.0, 0.0, -1.0), "x": (0.05, 0.0, 0.0), "y": (0.0, 0.05, 0.0)}
    turned = [
        light_row(1.0, position=at(20.0, 60.0, 200.0), shape=shape, radius=0.0, **away)
        for shape in (RECT, DISK)
    ]
    _, rows = frame_and_rows(gl, programs, with_shapes(scene_of(large, beside, sun, *turned)))
    assert not len(rows)
    parallel = replace(CAMERA, orthographic=True)
    _, rows = frame_and_rows(gl, programs, scene_of(beside, camera=parallel))
    assert not len(rows)


@pytest.mark.parametrize(("size", "field"), [(SIZE, FIELD), ((641, 361), (15.0, 8.5))])
@pytest.mark.parametrize("name", ["cie135", "ward97"])
def test_gpu_takes_pixels_out_as_the_definition_does(
    gl: Any, programs: Programs, size: tuple[int, int], field: tuple[float, float], name: str
) -> None:
    """Levels that begin at 0 and at 1, pixels in corners and of either parity."""
    random = np.random.default_rng(3)
    frame = random.uniform(0.1, 1.0, (size[1], size[0], 3)).astype(np.float32)
    corners = [(0, 0), (size[0] - 1, size[1] - 1), (30, 41), (31, 40), (31, 40)]
    half = [math.tan(math.radians(a) / 2.0) for a in field]
    rows = []
    for number, (column, row) in enumerate(corners):
        frame[size[1] - 1 - row, column] = 1e5
        x, y = (
            (2.0 * (v + 0.5) / n - 1.0) * h
            for v, n, h in zip((column, row), size, half, strict=True)
        )
        way = np.array([x, y, -1.0]) / math.hypot(x, y, 1.0)
        rows.append([*way, *([-1.0, -0.75, -0.5] if number < 4 else [-0.5] * 3)])
    lamps = np.array([*rows, [0.0, 0.0, -1.0, 0.2, 0.1, 0.3]], np.float32).astype(np.float64)
    plan = pyramid(MODELS[name], EYE, size, field)
    wanted = plan.paint(frame, lamps)
    data = np.ascontiguousarray(frame[::-1])
    texture = gl.texture(size, 3, data, dtype="f4", alignment=1)
    glare = GlarePass(gl, programs)
    out = glare.veil(texture, field, MODELS[name], EYE, lamps)
    got = np.frombuffer(out.read(), np.float32).reshape(size[1], size[0], 4)[::-1, :, :3]
    # float32 rounds a pixel of 1e5 by 0.004 of a cd/m2, and a level has 9 / 64 of it or less.
    close = (30 * 11 + 2 * max(size)) * 2.0**-24
    np.testing.assert_allclose(got, wanted, rtol=close, atol=1e5 * 2.0**-24)
    if name == "ward97":
        np.testing.assert_array_equal(wanted, plan.paint(frame))
    glare.release()


def test_glass_of_two_lamps_in_one_mesh(gl: Any, programs: Programs) -> None:
    """A car's: 1.4 m from end to end, 4 pixels, and each lamp's part below one pixel."""
    one, other = (
        quad((x - 0.05, -0.05, 0.05), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0)) for x in (-0.65, 0.65)
    )
    both = replace(
        one,
        key="headlamps",
        points=np.concatenate([one.points, other.points]),
        normals=np.concatenate([one.normals, other.normals]),
        uvs={},
    )
    # And a sky that glows about all of it is nobody's glass.
    dome = quad((-1e3, -1e3, -3e3), (2e3, 0.0, 0.0), (0.0, 2e3, 4e3), key="dome")
    lamps = [light_row(1000.0, position=(x, 0.0, -200.0)) for x in (-0.65, 0.65)]
    draws = [Draw(both, 2, placed(0.0, 0.0, -200.0)), Draw(dome, 2, placed(0.0, 0.0, 0.0))]
    _, rows = frame_and_rows(gl, programs, scene_of(*lamps, draws=draws))
    assert lux(rows)[0] * 200.0**2 == pytest.approx(2000.0, rel=1e-3)


def test_distance_of_a_triangle() -> None:
    """Over its inside, beside an edge, beyond a corner, and of one without area."""
    corners = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
    places = np.array([[1.0, 1.0, 2.0], [2.0, -1.0, 0.0], [-3.0, -4.0, 12.0], [2.0, 1.5, 0.5]])
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    triangles = np.concatenate([corners - places[:, None], [flat - (1.0, 2.0, 0.0)]])
    np.testing.assert_allclose(triangle_distance(triangles), [2.0, 1.0, 13.0, 0.5, 2.0], rtol=1e-12)
    np.testing.assert_allclose(
        triangle_distance(triangles[:, ::-1]), [2.0, 1.0, 13.0, 0.5, 2.0], rtol=1e-12
    )
