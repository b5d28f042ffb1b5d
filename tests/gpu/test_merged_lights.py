"""Frames with far lamps merged against frames in which every lamp counts alone.

The bound is that of photometry/lightcut.py: in every pixel and channel the illuminance
differs by no more than ``EPSILON`` times what the lamps would give a plane that faces each.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt
import pytest
from parity import shading
from small_scenes import Rendered, draw, lights, look, quad, render, rendered, waves

from hdrusd.gpu.hdr import HdrRenderer, Options
from hdrusd.gpu.lights import LightMode
from hdrusd.gpu.program import Programs
from hdrusd.gpu.tiles import STILL
from hdrusd.photometry.light import cone_factor, focus_factor, inverse_edge
from hdrusd.photometry.lightcut import EPSILON
from hdrusd.scene import CYLINDER, RECT, SPHERE, Camera, Material, RenderScene, light_rows

Array = npt.NDArray[Any]

SIZE = (192, 144)
COUNT = 400

#: float32 places and angles of a lamp, and of some 400 the sum, as shares of what arrives.
ROUNDING = 2e-5

MATTE = Material(diffuse=(0.5, 0.3, 0.2))
GLOSSY = Material(diffuse=(0.2,) * 3, specular=(0.04,) * 3, shininess=30.0)
WET = Material("ggx", (0.2,) * 3, specular=(0.04,) * 3, roughness=0.3)


def street(seed: int, *materials: Material, count: int = COUNT) -> RenderScene:
    """Lamps in rows and anywhere over 400 m of uneven ground, of several beams and colours."""
    rng = np.random.default_rng(seed)
    rows = light_rows(count)
    rows["position"] = rng.uniform((-200, -200, 1.0), (200, 200, 12.0), (count, 3))
    in_rows = np.arange(count) % 2 == 0
    rows["position"][in_rows, 0] = np.where(np.arange(count)[in_rows] % 4, -7.0, 7.0)
    colours = np.array([(1.2, 0.97, 0.6), (1.0, 1.0, 1.0), (1.9, 0.85, 0.1)])
    rows["intensity"] = rng.lognormal(7.0, 1.0, (count, 1)) * colours[rng.integers(0, 3, count)]
    rows["radius"] = 0.05
    beam = rng.integers(0, 4, count)
    down = beam > 0
    rows["axis"][down] = (0.0, 0.0, -1.0)
    rows["inner"][beam == 1], rows["outer"][beam == 1] = 0.9, 1.3
    rows["exponent"][beam == 2] = 2.0
    rows["shape"][beam == 3] = SPHERE
    ground = replace(draw(waves()), transforms=np.diag([100.0, 100.0, 4.0, 1.0])[None])
    walls = [
        draw(quad((x, -150, 0), (0, 300.0, 0), (0, 0, 20.0), key=f"{x}"), len(materials) - 1)
        for x in (-12.0, -60.0)
    ]
    return RenderScene(
        lights=rows,
        draws=(ground, *walls),
        materials=materials,
        camera=Camera(
            **{n: getattr(CAMERA, n) for n in ("eye", "right", "up", "back", "window")}, far=2000.0
        ),
    )


CAMERA = look((3.0, -120.0, 6.0), (-4.0, 0.0, 1.0), (0.0, 0.0, 1.0), half=0.4)


def facing(got: Rendered, lamps: Array) -> Array:
    """(n,) lx that points give planes that face each, by their strongest channel."""
    total = np.zeros(int(got.surface.sum()))
    points = got.position[got.surface]
    for lamp in lamps:
        way = lamp["position"] - points
        d2 = np.sum(way * way, axis=-1)
        cosine = -np.sum(way * lamp["axis"], axis=-1) / np.sqrt(d2)
        edge = inverse_edge(lamp["inner"], lamp["outer"])
        beam = cone_factor(cosine, lamp["inner"], edge) * focus_factor(cosine, lamp["exponent"])
        total += lamp["intensity"].max() * beam / np.maximum(d2, lamp["radius"] ** 2)
    return total


def sparse(got: Rendered) -> Rendered:
    """A frame as if only some of its pixels showed a surface."""
    chosen = np.zeros(got.surface.shape, bool)
    chosen[3::9, 5::11] = True
    return replace(got, surface=got.surface & chosen)


def renderer(gl: moderngl.Context, lights: LightMode) -> HdrRenderer:
    options = Options(shadows=False, lights=lights)
    return HdrRenderer(gl, Programs(gl), SIZE, lambda _: None, options)


def assert_within_bound(merged: Rendered, exact: Rendered, light: Array) -> float:
    """The bound of each pixel of matte surfaces; returns the mean error, a share of the light.

    ``light``: what ``facing`` says of the pixels.
    """
    seen = exact.surface
    difference = np.abs(merged.frame[seen] - exact.frame[seen])
    allowed = (EPSILON + ROUNDING) * light[:, None] * exact.diffuse[seen] / math.pi
    assert np.all(difference <= allowed), (difference / allowed).max()
    return float(difference.sum() / exact.frame[seen].sum())


@pytest.mark.parametrize("seed", range(4))
def test_a_matte_street_is_within_the_bound(gl: Any, seed: int) -> None:
    scene = street(seed, MATTE)
    exact, merged = (render(gl, scene, size=SIZE, lights=mode) for mode in ("exact", "merged"))
    assert exact.surface.mean() > 0.5
    assert np.array_equal(merged.surface, exact.surface)
    mean = assert_within_bound(merged, exact, facing(exact, scene.lights))
    assert 0.0 < mean < EPSILON / 4  # lightcut.py: a tenth of it and less, and some is merged


def test_auto_merges_more_than_64_lamps_and_no_less(gl: Any) -> None:
    scene = street(1, MATTE)
    frames = {
        (mode, count): render(
            gl, replace(scene, lights=scene.lights[:count]), size=SIZE, lights=mode
        ).frame
        for mode in ("auto", "exact", "merged")
        for count in (64, COUNT)
    }
    assert np.array_equal(frames["auto", 64], frames["exact", 64])
    assert np.array_equal(frames["auto", COUNT], frames["merged", COUNT])
    assert not np.array_equal(frames["auto", COUNT], frames["exact", COUNT])


@pytest.mark.parametrize("material", [GLOSSY, WET], ids=["blinn", "ggx"])
def test_highlights_keep_their_lamps(gl: Any, material: Material) -> None:
    """Highlights have no bound for each pixel: lamps merge where they hardly turn the half vector.

    Half a lobe's width at most (LOBE_SHARE), rms, so the second moment adds up to 1/4 of the
    lobe's curvature in a pixel of one highlight; over the picture the mean stays below epsilon.
    """
    scene = street(5, material, MATTE)
    exact, merged = (render(gl, scene, size=SIZE, lights=mode) for mode in ("exact", "merged"))
    seen = exact.surface
    difference = np.abs(merged.frame[seen] - exact.frame[seen])
    assert 0.0 < difference.sum() < EPSILON * exact.frame[seen].sum()
    # The exact frame is NumPy's, so the comparison is with the truth.
    some = sparse(exact)
    wanted = shading(some, scene)
    np.testing.assert_allclose(
        exact.frame[some.surface], wanted, rtol=1e-4, atol=1e-5 * wanted.max()
    )


def test_a_camera_that_drives_by(gl: Any) -> None:
    """Trees are kept from frame to frame, lists are of each frame."""
    scene = street(6, MATTE)
    together, alone = renderer(gl, "merged"), renderer(gl, "exact")
    for step in range(4):
        eye = np.add(CAMERA.eye, (0.5 * step, 15.0 * step, 0.0))
        camera = look(tuple(eye), (-4.0, 20.0 * step, 1.0), (0.0, 0.0, 1.0), half=0.4)
        moved = replace(scene, camera=camera)
        merged, exact = rendered(together, moved), rendered(alone, moved)
        assert_within_bound(merged, exact, facing(exact, scene.lights))


def test_a_headlight_among_lamps_that_stand(gl: Any) -> None:
    """What moves counts alone, at once where it is; what stands is merged on."""
    scene = street(7, MATTE)
    lamps = scene.lights.copy()
    lamps[0]["axis"], lamps[0]["inner"], lamps[0]["outer"] = (0.0, 1.0, 0.0), 0.2, 0.4
    lamps[0]["exponent"], lamps[0]["intensity"] = 0.0, 30000.0
    together, alone = renderer(gl, "merged"), renderer(gl, "exact")
    standing = facing(rendered(alone, scene), lamps[1:])
    for step in range(STILL + 4):
        lamps = lamps.copy()
        # It comes to rest and is merged again after STILL updates.
        lamps[0]["position"] = (3.0, -110.0 + 9.0 * min(step, 3), 0.7)
        moved = replace(scene, lights=lamps)
        merged, exact = rendered(together, moved), rendered(alone, moved)
        assert_within_bound(merged, exact, standing + facing(exact, lamps[:1]))
        assert not np.array_equal(merged.frame, exact.frame)


def test_what_cannot_merge_counts_alone(gl: Any) -> None:
    """Area lights, distant ones and lamps with links among 400 that merge."""
    scene = street(8, MATTE)
    special = lights(
        {"position": (-4.0, -100.0, 5.0), "shape": RECT, "x": (2.0, 0, 0), "intensity": 5e3},
        {"position": (5.0, -80.0, 5.0), "shape": SPHERE, "radius": 1.5, "intensity": 2e3},
        {"position": (0.0, -60.0, 5.0), "shape": CYLINDER, "radius": 0.1, "intensity": 2e3},
        {"position": (0.0, 0.6, 0.8), "w": 0.0, "angle": 0.01, "intensity": 0.5},
        {"position": (0.0, -90.0, 9.0), "link": 1, "intensity": 9e3},
    )
    special["key"] += COUNT
    draws = tuple(replace(d, links=k % 2) for k, d in enumerate(scene.draws))
    both = replace(scene, draws=draws, lights=np.concatenate([scene.lights, special]))
    exact, merged = (render(gl, both, size=SIZE, lights=mode) for mode in ("exact", "merged"))
    # The bound of the lamps alone covers the difference: the others are exact.
    assert_within_bound(merged, exact, facing(exact, scene.lights))


def test_thousands_of_lights_are_all_there(gl: Any) -> None:
    """5000 lamps of all kinds: the sum of NumPy in some pixels, and of the merged frame."""
    count = 5000
    scene = street(9, MATTE, count=count)
    rows = scene.lights
    rows["intensity"][:] = rows["intensity"][:, [1, 1, 1]] / 10.0
    rows["shape"][10::100], rows["axis"][10::100] = RECT, (0.0, 0.0, -1.0)
    rows["diffuse"][20::100] = 0.5
    exact, merged = (render(gl, scene, lights=mode) for mode in ("exact", "merged"))
    some = sparse(exact)
    assert some.surface.sum() > 15
    wanted = shading(some, scene)
    # 5000 terms in some 350 batches, each rounded to 6e-8 of the sum so far, at random signs.
    np.testing.assert_allclose(exact.frame[some.surface], wanted, rtol=1e-4)
    points = rows[rows["shape"] != RECT]
    assert_within_bound(merged, some, facing(some, points))
