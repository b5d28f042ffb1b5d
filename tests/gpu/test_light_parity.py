"""Every kind of light on every kind of material: the frame is NumPy's shading of its G-buffer."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from parity import assert_is_its_shading, shading
from small_scenes import draw, lights, look, quad, render, waves

from hdrusd.photometry.light import SMALL_SPHERE
from hdrusd.scene import (
    CYLINDER,
    DISK,
    RECT,
    SPHERE,
    Camera,
    Draw,
    Material,
    Profile,
    RenderScene,
)

CANDELA = (900.0, 700.0, 400.0)
AXIS = np.array([-0.4, -0.2, -0.8944272]) / np.linalg.norm([-0.4, -0.2, -0.8944272])
ACROSS = np.cross(AXIS, (0.0, 1.0, 0.0)) / np.linalg.norm(np.cross(AXIS, (0.0, 1.0, 0.0)))
UP = np.cross(AXIS, ACROSS)

HIGH = {"position": (1.0, 0.5, 1.6), "intensity": CANDELA, "axis": AXIS, "x": ACROSS, "y": UP}
#: Between the waves, so that horizons of the surface cut it.
LOW = {"position": (1.0, 0.5, 0.2), "intensity": CANDELA, "axis": (-1.0, 0.0, 0.0)}
#: So far that four points stand for it.
FAR = HIGH | {"position": (10.0, 5.0, 16.0), "intensity": (9e4, 7e4, 4e4)}
CONE = {"inner": 0.2, "outer": 0.6, "exponent": 3.0}


def flat(shape: int, place: dict[str, Any] = HIGH, **fields: Any) -> dict[str, Any]:
    return place | {"shape": shape, "x": 0.6 * ACROSS, "y": 0.3 * UP} | fields


SIDES = {"x": (0.0, 0.5, 0.0), "y": (0.0, 0.0, 0.5)}

KINDS: dict[str, dict[str, Any]] = {
    "rect": flat(RECT),
    "sheared rect": flat(RECT, x=0.6 * ACROSS + 0.2 * UP),
    "low rect": flat(RECT, LOW, **SIDES),
    "far rect": flat(RECT, FAR, x=0.06 * ACROSS, y=0.03 * UP),
    "disk": flat(DISK, x=0.5 * ACROSS, y=0.5 * UP),
    "elliptic disk": flat(DISK),
    "low disk": flat(DISK, LOW, **SIDES),
    "far disk": flat(DISK, FAR, x=0.06 * ACROSS, y=0.06 * UP),
    "sphere": HIGH | {"shape": SPHERE, "radius": 0.4},
    "low sphere": LOW | {"shape": SPHERE, "radius": 0.15},
    "small sphere": HIGH | {"shape": SPHERE, "radius": SMALL_SPHERE},
    "cylinder": HIGH | {"shape": CYLINDER, "radius": 0.1, "x": 0.8 * ACROSS},
    "low cylinder": LOW | {"shape": CYLINDER, "radius": 0.05, "x": (0.0, 0.5, 0.3)},
    "sun": {"position": (0.36, 0.48, 0.8), "w": 0.0, "intensity": CANDELA, "angle": 0.0046},
    "wide distant": {"position": (0.96, 0.0, 0.28), "w": 0.0, "intensity": CANDELA, "angle": 0.7},
    "rect in a cone": flat(RECT, **CONE),
    "sphere in a cone": HIGH | CONE | {"shape": SPHERE, "radius": 0.4},
}

PAINT = Material("ggx", (0.5, 0.3, 0.2), specular=(0.04,) * 3, roughness=0.4)
BLINN = Material(diffuse=(0.2, 0.2, 0.2), specular=(0.05, 0.04, 0.03), shininess=40.0)
MATERIALS: dict[str, tuple[Material, ...]] = {
    "matte": (Material(diffuse=(0.5, 0.3, 0.2)),),
    "blinn": (BLINN,),
    "ggx": (PAINT,),
    "tinted": (replace(PAINT, specular=(0.04, 0.06, 0.02), metallic=0.3),),
    "coated": (replace(PAINT, roughness=0.6, clearcoat=0.8, clearcoat_roughness=0.3),),
    "both": (replace(PAINT, metallic=1.0), BLINN),
}

ABOVE = look((0.5, -2.5, 2.5), half=0.45)

#: What stands in the tiles of the waves as the second material.
BESIDE = quad((-1.2, -1.2, 0.35), (0.8, 0.1, 0.0), (-0.1, 0.8, 0.0), key="beside")


def scene(
    materials: tuple[Material, ...],
    *rows: dict[str, Any],
    camera: Camera = ABOVE,
    **fields: Any,
) -> RenderScene:
    """Waves under lights, and over them a square of the second material if there is one."""
    draws: tuple[Draw, ...] = (draw(waves()),)
    if len(materials) > 1:
        draws = (*draws, draw(BESIDE, 1))
    values = {"draws": draws, "materials": materials, "camera": camera} | fields
    return RenderScene(lights=lights(*rows), **values)


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_light_on_each_material(gl: Any, kind: str, material: str) -> None:
    got = assert_is_its_shading(gl, scene(MATERIALS[material], KINDS[kind]))
    if material == "both":
        assert set(np.unique(np.sign(got.shininess[got.surface]))) == {-1.0, 1.0}


@pytest.mark.parametrize("other", ["ggx", "coated"])
def test_a_matte_surface_of_the_other_model_in_one_tile(gl: Any, other: str) -> None:
    """Without a highlight its gloss is 0: as a width of GGX, away from the light, 0 / 0."""
    away = quad((-1.2, -1.0, 0.3), (1.6, 0.0, 0.0), (0.0, 0.3, 1.0), key="away")
    shown = scene((MATERIALS[other][0], MATERIALS["matte"][0]), HIGH, KINDS["sphere"])
    assert_is_its_shading(gl, replace(shown, draws=(shown.draws[0], draw(away, 1))))


@pytest.mark.parametrize("material", ["blinn", "coated"])
def test_the_raw_highlights_of_petit2010(gl: Any, material: str) -> None:
    shown = scene(MATERIALS[material], KINDS["rect"], KINDS["sun"], KINDS["cylinder"])
    assert_is_its_shading(gl, shown, reflection="petit2010")


# -- many at once -----------------------------------------------------------------------------

POINT_LAMP = {"position": (-1.0, 0.5, 2.0), "intensity": (40.0, 90.0, 60.0)}
PLAIN_KINDS = [
    POINT_LAMP,
    POINT_LAMP | {"axis": AXIS, "inner": 0.2, "outer": 0.6},
    POINT_LAMP | {"axis": AXIS, "exponent": 12.0},
    {"position": (0.36, 0.48, 0.8), "w": 0.0, "intensity": (30.0, 40.0, 50.0)},
]


@pytest.mark.parametrize("material", MATERIALS)
def test_all_kinds_in_one_frame(gl: Any, material: str) -> None:
    assert_is_its_shading(gl, scene(MATERIALS[material], *PLAIN_KINDS, *KINDS.values()))


@pytest.mark.parametrize("kind", ["rect", "sphere in a cone", "wide distant"])
@pytest.mark.parametrize("count", [3, 4, 5, 6, 9, 11])
def test_batch_borders_of_special_lights(gl: Any, kind: str, count: int) -> None:
    """Six texels a light, five lights a batch; a light lost or taken twice is a missing number."""
    rows = [KINDS[kind] | {"intensity": tuple(2.0**k * np.eye(3)[k % 3])} for k in range(count)]
    assert_is_its_shading(gl, scene(MATERIALS["matte"], *rows))


@pytest.mark.parametrize("count", [3, 4, 7])
def test_batch_borders_of_lights_with_profiles(gl: Any, count: int) -> None:
    """Eight texels a light, three lights a batch."""
    rows = [
        KINDS["sphere"] | {"profile": 0, "intensity": tuple(2.0**k * np.eye(3)[k % 3])}
        for k in range(count)
    ]
    assert_is_its_shading(gl, scene(MATERIALS["matte"], *rows, profiles=(PROFILES["C"],)))


def test_five_beams_by_lists_of_tiles(gl: Any) -> None:
    """From four lamps with a beam on, tiles have lists of those that reach them."""
    rows = [
        KINDS["rect in a cone"] | {"position": (1.0 - 0.6 * k, 0.5, 1.6), "outer": 0.4}
        for k in range(5)
    ]
    narrow = PLAIN_KINDS[1] | {"inner": 0.05, "outer": 0.1}
    assert_is_its_shading(gl, scene(MATERIALS["both"], *rows, narrow, KINDS["disk"]))


# -- profiles ---------------------------------------------------------------------------------


def made_profile(kind: Any) -> Profile:
    """A lopsided lobe over a type's own angles, 5 to 45 degrees a cell."""
    full = {"C": (0.0, 2 * math.pi), "A": (-1.2, 1.4), "B": (-1.4, 1.2)}[kind]
    angles = {"C": (0.0, 2.0), "A": (-1.1, 1.3), "B": (-1.5, 1.5)}[kind]
    plane, angle = np.meshgrid(np.linspace(*full, 13), np.linspace(*angles, 19), indexing="ij")
    candela = 3.0 + np.cos(plane) * np.sin(2 * angle) + np.cos(angle)
    return Profile(candela.astype(np.float32), full, angles, kind)


PROFILES = {kind: made_profile(kind) for kind in "ABC"}


@pytest.mark.parametrize("kind", PROFILES)
@pytest.mark.parametrize("shape", ["point", "rect in a cone", "cylinder"])
def test_profiles_of_each_type(gl: Any, kind: str, shape: str) -> None:
    lamp = (HIGH if shape == "point" else KINDS[shape]) | {"profile": 1}
    shown = scene(MATERIALS["both"], lamp, profiles=(PROFILES["C"], PROFILES[kind]))
    assert_is_its_shading(gl, shown)


def test_lights_with_all_profiles_and_none(gl: Any) -> None:
    rows = [HIGH | {"profile": k, "position": (k - 1.0, 0.5, 1.6)} for k in range(3)]
    shown = scene(MATERIALS["blinn"], *rows, HIGH, profiles=tuple(PROFILES.values()))
    assert_is_its_shading(gl, shown)


# -- links and factors ------------------------------------------------------------------------

#: Bits of the two surfaces, and the links of lights: the highest of 24 that a float32 holds.
BITS = (1 | 1 << 23, 1 << 1 | 1 << 23)


@pytest.mark.parametrize("kind", ["point", "rect", "sun"])
@pytest.mark.parametrize("link", [1, 2, 3, 24])
def test_linked_lights_shine_on_what_they_name(gl: Any, kind: str, link: int) -> None:
    lamp = (POINT_LAMP if kind == "point" else KINDS[kind]) | {"link": link}
    base = scene(MATERIALS["both"], lamp, PLAIN_KINDS[3])
    shown = replace(
        base, draws=tuple(replace(d, links=b) for d, b in zip(base.draws, BITS, strict=True))
    )
    got = assert_is_its_shading(gl, shown)
    without = render(gl, replace(shown, lights=shown.lights[1:])).frame
    for number, bits in enumerate(BITS):
        on_it = got.surface & ((got.shininess > 0.0) == bool(number))
        assert on_it.any()
        named = bool(bits >> (link - 1) & 1)
        assert bool(np.any(got.frame[on_it] > without[on_it] * 1.0001)) == named


@pytest.mark.parametrize("factors", [(0.0, 1.0), (1.0, 0.0), (0.25, 3.0)])
@pytest.mark.parametrize("kind", ["point", "cylinder", "wide distant"])
@pytest.mark.parametrize("material", ["blinn", "coated", "both"])
def test_factors_on_diffuse_and_highlight(
    gl: Any, material: str, kind: str, factors: tuple[float, float]
) -> None:
    lamp = POINT_LAMP if kind == "point" else KINDS[kind]
    row = lamp | dict(zip(("diffuse", "specular"), factors, strict=True))
    assert_is_its_shading(gl, scene(MATERIALS[material], row, HIGH))


# -- cameras and places -----------------------------------------------------------------------

EVERYTHING = [KINDS[k] for k in ("rect", "low disk", "sphere", "cylinder", "wide distant")]


def test_orthographic_camera(gl: Any) -> None:
    camera = look((0.5, -2.5, 2.5), half=1.2, orthographic=True)
    shown = scene(MATERIALS["both"], *EVERYTHING, *PLAIN_KINDS, camera=camera)
    assert_is_its_shading(gl, shown)


def test_instances_turned_and_stretched(gl: Any) -> None:
    """Places and normals are those of the G-buffer, whichever instance made them."""
    turn = np.eye(4)
    turn[:3, :3] = [[0.0, 0.5, 0.0], [-0.5, 0.0, 0.0], [0.0, 0.0, 1.5]]
    turn[3, :3] = 0.8, 0.6, 0.1
    small = np.diag([-0.5, 0.4, 0.5, 1.0])
    small[3, :3] = -0.9, -0.4, 0.0
    shown = scene(MATERIALS["both"], *EVERYTHING)
    shown = replace(shown, draws=(draw(waves(), 0, turn, small), *shown.draws[1:]))
    assert_is_its_shading(gl, shown)


def test_ten_kilometres_from_the_origin(gl: Any) -> None:
    """Positions are float64 until the eye is subtracted: nothing changes but by roundings."""
    away = np.array([7000.0, -7000.0, 1000.0])
    shown = scene(MATERIALS["both"], *EVERYTHING, *PLAIN_KINDS)
    moved_lights = shown.lights.copy()
    moved_lights["position"] += moved_lights["w"][:, None] * away
    matrix = np.eye(4)
    matrix[3, :3] = away
    moved = replace(
        shown,
        lights=moved_lights,
        draws=tuple(replace(d, transforms=matrix[None]) for d in shown.draws),
        camera=replace(shown.camera, eye=tuple(np.asarray(shown.camera.eye) + away)),
    )
    far = assert_is_its_shading(gl, moved)
    near = render(gl, shown)
    assert np.array_equal(far.surface, near.surface)
    wanted = shading(near, shown)
    # Depths differ in their last digit, by 1e-7 of 4 m: 1e-5 of the distance to the nearest lamp.
    np.testing.assert_allclose(far.frame[far.surface], wanted, rtol=2e-4, atol=1e-5 * wanted.max())
