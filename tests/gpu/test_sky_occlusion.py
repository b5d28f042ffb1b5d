"""Sky light past what stands in its way, against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shadow_scenes import draw, plane, slab
from sky_scenes import GBuffer, sky, sky_pass, surfaces
from small_scenes import look, quad, render

from hdrusd.errors import SourceRef
from hdrusd.gpu.casters import Casters
from hdrusd.gpu.hdr import HdrRenderer, Options
from hdrusd.gpu.program import Programs
from hdrusd.gpu.sky_occlusion import SkyOcclusion, Views, even_directions
from hdrusd.gpu.textures import TextureCache
from hdrusd.report import Report
from hdrusd.scene import Camera, Draw, Material, RenderScene

PI = math.pi
SIZE = (32, 24)


def lit(
    gl: Any, scene: RenderScene, layers: Any, samples: int, report: Report | None = None, **sky: Any
) -> Any:
    """What the sky adds to a G-buffer, (h, w, 3) cd/m2."""
    buffer = GBuffer(gl, **layers)
    programs, textures = Programs(gl), TextureCache(gl, lambda _: None, 2.2)
    report = Report() if report is None else report
    casters = Casters(gl, programs, textures)
    casters.update(scene)
    occlusion = SkyOcclusion(
        gl, programs, casters, sky_pass(gl, **sky), buffer.size, 1 / PI, samples, report
    )
    occlusion.add(scene, buffer.layers, buffer.frame)
    return buffer.read()[..., :3]


def from_above(half: float, height: float = 1.0) -> tuple[Camera, Any, Any]:
    """A camera that looks down on the plane z = 0 through everything, and that plane."""
    view = look((0.0, 0.0, height), up=(0.0, 1.0, 0.0), half=half, orthographic=True)
    normal = np.zeros((SIZE[1], SIZE[0], 3))
    normal[..., 2] = 1.0
    return view, normal, np.full(normal.shape[:2], height)


def ground(*things: Draw, **fields: Any) -> RenderScene:
    values = {"ambient": (PI, PI, PI), "materials": (Material(),)} | fields
    return RenderScene(draws=(draw(plane(50.0)), *things), **values)


def places(view: Camera) -> Any:
    left, right, bottom, top = view.window
    x = left + (np.arange(SIZE[0]) + 0.5) / SIZE[0] * (right - left)
    y = top - (np.arange(SIZE[1]) + 0.5) / SIZE[1] * (top - bottom)
    return np.broadcast_arrays(x[None, :], y[:, None])


def test_directions_share_the_sphere() -> None:
    d = even_directions(1000)
    assert np.linalg.norm(d, axis=1) == pytest.approx(np.ones(1000), abs=1e-12)
    assert d.mean(axis=0) == pytest.approx(np.zeros(3), abs=1e-3)
    # In every cap of a tenth of the sphere there are about a hundred.
    caps = [int(np.sum(d @ axis > 0.8)) for axis in even_directions(50)]
    assert min(caps) >= 96
    assert max(caps) <= 104


def test_nothing_in_the_way_is_open_sky(gl: Any) -> None:
    view, normal, depth = from_above(2.0)
    normal[:, :16] = [0.6, 0.0, 0.8]  # shading normals need not be the plane's
    got = lit(gl, ground(camera=view), surfaces(normal, depth, f0=0.0, scattered=0.5), 256)
    # The ground itself hides what is below it; a surface that lies in it sees the upper half.
    assert got[:, 16:] == pytest.approx(np.full((24, 16, 3), 0.5), rel=1e-5)
    assert got[:, :16] == pytest.approx(np.full((24, 16, 3), 0.5 * 0.9), rel=2e-2)


def test_a_wall_takes_its_share_of_an_even_sky(gl: Any) -> None:
    # A wall of height h, endless: a level surface d away keeps (1 + cos a) / 2, tan a = h / d.
    view, normal, depth = from_above(1.0, 5.0)
    wall = quad((1.4, -400.0, 0.0), (0.0, 800.0, 0.0), (0.0, 0.0, 2.0), key="wall")
    scene = ground(draw(wall), camera=view)
    got = lit(gl, scene, surfaces(normal, depth, f0=0.0, scattered=1.0), 4096)[..., 0]
    x, _ = places(view)
    wanted = (1.0 + np.cos(np.arctan2(2.0, 1.4 - x))) / 2.0
    assert got == pytest.approx(wanted, rel=0.01)


def parallel_opening(x: Any, y: Any, corners: Any, height: float) -> Any:
    """Share of the sky, weighted by cosine, through a level rectangle: Lambert's contour sum."""
    points = [np.stack(np.broadcast_arrays(a - x, b - y, height), axis=-1) for a, b in corners]
    points = [p / np.linalg.norm(p, axis=-1, keepdims=True) for p in points]
    total = 0.0
    for a, b in zip(points, [*points[1:], points[0]], strict=True):
        cross = np.cross(a, b)
        size = np.linalg.norm(cross, axis=-1)
        total = total + np.arctan2(size, np.sum(a * b, axis=-1)) * cross[..., 2] / size
    return np.abs(total) / (2 * PI)


def roof(opening: Any, height: float, half: float = 400.0) -> list[Draw]:
    """Four plates around an opening."""
    (a, b), (c, d) = opening
    z = height
    plates = [((-half, -half, z), (a, half, z)), ((c, -half, z), (half, half, z))]
    plates += [((a, -half, z), (c, b, z)), ((a, d, z), (c, half, z))]
    draws = []
    for k, (low, high) in enumerate(plates):
        u, v = (high[0] - low[0], 0.0, 0.0), (0.0, high[1] - low[1], 0.0)
        draws.append(draw(quad(low, u, v, key=f"roof{k}")))
    return draws


def test_an_opening_in_a_roof(gl: Any) -> None:
    view, normal, depth = from_above(1.0, 2.0)
    scene = ground(*roof(((-0.8, -0.7), (1.2, 1.1)), 3.0), camera=view)
    got = lit(gl, scene, surfaces(normal, depth, f0=0.0, scattered=1.0), 8192)[..., 0]
    x, y = places(view)
    corners = [(-0.8, -0.7), (1.2, -0.7), (1.2, 1.1), (-0.8, 1.1)]
    wanted = parallel_opening(x, y, corners, 3.0)
    # Of 8192 directions 200 to 270 pass the opening; a lattice's count in a region that small is
    # right to about the root of the number at its edge, 60: 8 in 235, 3.4 %. Over all pixels it
    # evens out.
    assert got == pytest.approx(wanted, rel=0.035)
    assert got.mean() == pytest.approx(wanted.mean(), rel=0.005)


def test_the_sky_s_colours_come_from_their_own_sides(gl: Any) -> None:
    # Red to the left of +Z, that is towards +X; blue towards -X. The dome's pole is +Z here.
    texels = np.zeros((32, 64, 3), np.float32)
    texels[:, :32, 0] = texels[:, 32:, 2] = 1.0
    dome = sky(rotation=(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0))
    view, normal, depth = from_above(0.2, 5.0)
    wall = quad((0.3, -400.0, 0.0), (0.0, 800.0, 0.0), (0.0, 0.0, 100.0), key="wall")
    scene = ground(draw(wall), camera=view, ambient=(0.0, 0.0, 0.0), skies=(dome,))
    got = lit(gl, scene, surfaces(normal, depth, f0=0.0, scattered=1.0), 2048, sky=texels)
    assert got[..., 0].max() < 0.01
    assert got[..., 2] == pytest.approx(np.full((24, 32), 0.5), rel=0.02)


def test_casters_that_do_not_cast_let_the_sky_through(gl: Any) -> None:
    view, normal, depth = from_above(1.0, 5.0)
    lid = slab((-30, -30, 2), (30, 30, 2.1))
    layers = surfaces(normal, depth, f0=0.0, scattered=1.0)
    dark = lit(gl, ground(draw(lid), camera=view), layers, 512)
    assert dark.max() < 0.02
    scene = ground(draw(lid, casts=False), camera=view)
    assert lit(gl, scene, layers, 512) == pytest.approx(np.ones((24, 32, 3)), rel=1e-5)


METAL = Material(diffuse=(0.5, 0.4, 0.3), metallic=1.0)
GLOSSY = Material(model="ggx", diffuse=(0.5,) * 3, specular=(0.1,) * 3, roughness=0.5)


@pytest.mark.parametrize(
    "material",
    [
        Material(diffuse=(0.5,) * 3, occlusion=0.2),
        METAL,
        replace(METAL, metallic=0.5),
        GLOSSY,
        replace(GLOSSY, metallic=0.6, occlusion=0.5, clearcoat=0.7, emission=(1.0, 2.0, 3.0)),
    ],
)
@pytest.mark.parametrize("shadows", [False, True])
def test_open_sky_is_the_same_with_and_without_samples(
    gl: Any, material: Material, shadows: bool
) -> None:
    view, _, _ = from_above(1.0, 5.0)
    scene = ground(camera=view, materials=(material,), ambient=(100.0, 90.0, 80.0))
    plain, sampled = (
        render(gl, scene, size=SIZE, shadows=shadows, sky_samples=n).frame for n in (0, 128)
    )
    assert sampled == pytest.approx(plain, rel=1e-5)
    if material.occlusion == 0.2:
        assert sampled[..., 0] == pytest.approx(np.full((24, 32), 0.5 * 0.2 * 100.0 / PI), rel=1e-5)


def test_a_texel_s_size_is_said_once(gl: Any) -> None:
    report, place = Report(), SourceRef(Path("street.usda"))
    renderer = HdrRenderer(
        gl,
        Programs(gl),
        SIZE,
        lambda _: None,
        Options(sky_samples=64, samples=4),
        report,
        place,
    )
    for height in (5.0, 6.0):
        renderer.render(ground(camera=from_above(height, height)[0]))
    (finding,) = report
    assert (finding.code, finding.source) == ("sky-occlusion", place)


def test_where_nothing_is_seen_nothing_is_done(gl: Any) -> None:
    view, normal, depth = from_above(1.0)
    report = Report()
    got = lit(gl, ground(camera=view), surfaces(0 * normal, 0 * depth), 64, report)
    assert (got == 0.0).all()
    assert not report.codes()
    night = ground(camera=view, ambient=(0.0, 0.0, 0.0))
    assert (lit(gl, night, surfaces(normal, depth), 64, report) == 0.0).all()
    lit(gl, ground(camera=view), surfaces(normal, depth), 64, report)
    assert report.codes() == {"sky-occlusion"}


def test_a_caster_at_the_end_of_the_world_does_not_take_the_depth_s_digits() -> None:
    box = np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]])
    far = np.array([[-1e9, -1e9, -1e9], [1e9, 1e9, 1e9]])
    views = Views(box, far, even_directions(16))
    # 24 bits of depth: a step is not above a tenth of a texel.
    assert (views.texel / 10.0 > 1.0 / (views.scales(slice(None)) * 2.0**24)).all()
