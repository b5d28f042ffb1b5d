"""What casts a shadow and what does not; what moves; what is drawn again and what is kept."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from shadow_scenes import MATERIALS, along, draw, edge, maps, move, plane, scene, seen, slab
from small_scenes import quad

from hdrusd.gpu.shadows import ShadowMaps
from hdrusd.report import Report
from hdrusd.scene import Camera, Material, RenderScene, TextureRef, TextureUse

LAMP = {"position": (0.0, 0.0, 4.0), "intensity": 800.0, "radius": 0.05}
FLOOR = draw(plane(6.0))
ROOF = plane(0.5, 1.3, "roof")
BELOW = [(0.1, 0.2, 0.0)]
SUN = {"position": (0.0, 0.6, 0.8), "w": 0.0, "intensity": 100.0}


class Spy:
    """Counts the tiles that are drawn."""

    def __init__(self, shadows: ShadowMaps, monkeypatch: pytest.MonkeyPatch) -> None:
        self.counts = dict.fromkeys(("draw", "keep", "redraw"), 0)
        for name in self.counts:
            monkeypatch.setattr(shadows._drawing, name, self.counted(shadows._drawing, name))

    def counted(self, drawing: Any, name: str) -> Any:
        draws = getattr(drawing, name)

        def count(tiles: Any, groups: Any) -> None:
            self.counts[name] += len(tiles)
            draws(tiles, groups)

        return count

    def taken(self) -> tuple[int, ...]:
        counts = tuple(self.counts.values())
        self.counts = dict.fromkeys(self.counts, 0)
        return counts


@pytest.mark.parametrize("moving", [False, True])
def test_what_casts(gl: Any, moving: bool) -> None:
    def below(roof: Any) -> float:
        shown = scene(LAMP, FLOOR, replace(roof, moving=moving))
        return float(seen(gl, shown, BELOW)[0])

    assert below(draw(ROOF)) == 0.0
    assert below(draw(ROOF, casts=False)) == 1.0
    assert below(draw(ROOF, 1)) == 1.0  # blends
    assert below(draw(ROOF, 2)) == 0.0  # emits, and is no lamp's


GLASS = slab((-0.2, -0.2, -0.1), (0.2, 0.2, 0.0), "glass")


@pytest.mark.parametrize("moving", [False, True])
def test_a_lamp_s_glass_lets_its_light_through(gl: Any, moving: bool) -> None:
    """What emits casts, but for what is small and near a lamp: each copy for itself."""

    def below(*places: Any, lamp: Any = LAMP, geometry: Any = GLASS) -> list[float]:
        shown = scene(lamp, FLOOR, draw(geometry, 2, *places, moving=moving))
        return seen(gl, shown, [(0.0, 0.1, 0.0), (2.5, 0.1, 0.0)]).tolist()

    # A street's lamp: its glass is 0.2 m below. One copy more, half way to the second point.
    assert below(move(0, 0, 3.8)) == [1.0, 1.0]
    assert below(move(0, 0, 3.8), move(1.25, 0, 2.0)) == [1.0, 0.0]
    assert below(move(0, 0, 3.65)) == [0.0, 1.0]  # 0.35 m
    assert below(move(0, 0, 3.65), lamp=LAMP | {"radius": 0.12}) == [1.0, 1.0]  # three radii
    # A facade with lit windows, 4 m wide, beside the lamp.
    wall = slab((-2.0, -0.2, -0.1), (2.0, 0.2, 0.0), "wall")
    assert below(move(0, 0, 3.8), geometry=wall)[0] == 0.0


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("lamp", [LAMP, SUN])
def test_what_is_far_off_leaves_the_shadows_alone(
    gl: Any, moving: bool, lamp: dict[str, Any]
) -> None:
    report = Report()
    shadows = maps(gl, report=report)
    far = draw(plane(50.0, 0.0, "far"), 0, move(1e7, 0, 0), moving=moving)
    shown = scene(lamp, FLOOR, draw(plane(0.5, 0.02, "low")), far)
    places = along((0.0, -3.0, 0.0), (0.0, 3.0, 0.0), 301)
    share = seen(gl, shown, places, shadows=shadows)
    assert report.codes() == {"shadow-far"}
    assert np.array_equal(share, seen(gl, replace(shown, draws=shown.draws[:2]), places))
    assert 0.0 < share.mean() < 1.0
    shadows.update(replace(shown, draws=shown.draws[1:]))
    assert len(report) == 1


@pytest.mark.parametrize("moving", [False, True])
def test_shadow_links(gl: Any, moving: bool) -> None:
    """The second lamp's shadows are of the second roof alone."""
    first = draw(plane(0.3, 1.3, "first"), shadow_links=0b01, moving=moving)
    second = draw(ROOF, 0, move(2, 0, 0), shadow_links=0b10, moving=moving)
    lamps = [LAMP | {"shadow_link": link} for link in (0, 1, 2)]
    shown = scene(lamps, FLOOR, first, second)
    places = [(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)]
    shares = [seen(gl, shown, places, light=i).tolist() for i in range(3)]
    assert shares == [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]


def test_every_lamp_may_leave_out_a_roof(gl: Any) -> None:
    """A row of lamps, each without the roof below it; bits beyond the last lamp mean nothing."""
    count, everything = 20, (1 << 70) - 1
    links = [everything - (1 << i) for i in range(count)]
    roofs = [draw(ROOF, 0, move(5 * i, 0, 0), shadow_links=k) for i, k in enumerate(links)]
    ground = draw(plane(200.0, 0.0, "ground"), shadow_links=everything)
    places = [(5.0 * i, 0.0, 4.0) for i in range(count)]
    lamps = [LAMP | {"position": p, "shadow_link": i + 1} for i, p in enumerate(places)]
    for i in (1, 7, count - 1):
        # The shadow of its neighbour's roof, 5 m off, falls 5 * 4 / 2.7 m off.
        points = [(5.0 * i, 0.0, 0.0), (5.0 * i - 20.0 / 2.7, 0.0, 0.0)]
        assert seen(gl, scene(lamps, ground, *roofs), points, light=i).tolist() == [1.0, 0.0]


@pytest.mark.parametrize("moving", [False, True])
def test_a_cutout_casts_with_its_holes(gl: Any, moving: bool) -> None:
    """A square whose left half has an opacity of 0.2, below the threshold of 0.5."""
    image = np.full((64, 64, 1), 255, np.uint8)
    image[:, :32] = 51
    use = TextureUse(TextureRef("holes.png", "linear", "clamp", "clamp"), channel=0)
    material = Material(opacity_map=use, opacity_threshold=0.5)
    roof = quad((-0.5, -0.5, 1.3), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), key="roof")
    shown = scene(LAMP, FLOOR, draw(roof, 3, moving=moving), materials=(*MATERIALS, material))
    shadows = maps(gl, images={"holes.png": image})
    places = along((-0.7, 0.1, 0.0), (0.7, 0.1, 0.0), 1401)
    share = seen(gl, shown, places, shadows=shadows)
    # The seam at x = 0, where the filter of texels 1.6 cm wide (2.3 on the floor) passes 1/2.
    assert abs(edge(places[:, 0], share)) < 0.024
    assert share[0] == 1.0
    assert share[-1] == 0.0
    # Without its picture the fallback counts: (0, 0, 0, 1) in channel 0 is a hole.
    assert np.all(seen(gl, shown, BELOW) == 1.0)


@pytest.mark.parametrize("code", [7, 51, 100, 128, 255])
def test_a_texel_at_the_threshold_casts(gl: Any, code: int) -> None:
    """As what is seen of the surface does; half floats round some of these codes down."""
    material = Material(
        opacity_map=TextureUse(TextureRef("a.exr", "linear", "clamp", "clamp"), channel=0),
        opacity_threshold=code / 255.0,
    )
    roof = quad((-0.5, -0.5, 1.3), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), key="roof")
    shown = scene(LAMP, FLOOR, draw(roof, 3), materials=(*MATERIALS, material))
    for alpha, light in ((code, 0.0), (code - 1, 1.0)):
        image = np.full((4, 4, 1), alpha / 255.0, np.float16)
        assert seen(gl, shown, BELOW, shadows=maps(gl, images={"a.exr": image}))[0] == light


def test_nothing_inside_the_lamp_casts(gl: Any) -> None:
    """A lampshade of half side 0.1 around a lamp of radius 0.2 lets it shine; a larger one not."""
    shade = slab((-0.1, -0.1, 3.9), (0.1, 0.1, 4.1))
    small = scene(LAMP | {"radius": 0.2}, FLOOR, draw(shade))
    assert np.all(seen(gl, small, BELOW) == 1.0)
    assert np.all(seen(gl, scene(LAMP, FLOOR, draw(shade)), BELOW) == 0.0)
    ball = scene(LAMP | {"radius": 0.2, "shape": 1}, FLOOR, draw(shade))
    assert np.all(seen(gl, ball, BELOW) == 1.0)


def test_many_copies_cast_each_its_shadow(gl: Any) -> None:
    """Copies whose corners are too many to be merged: 40,000 of a box of 36 corners."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(200), np.arange(200)))
    places = np.tile(np.eye(4), (40_000, 1, 1))
    places[:, 3, 0], places[:, 3, 1] = 0.2 * (x - 100), 0.2 * (y - 100)
    box = slab((0.05, 0.05, 0.5), (0.15, 0.15, 0.51))
    shown = scene(LAMP, FLOOR, draw(box, 0, *places))
    # The shadow of the one beside the lamp's foot, and the gap there.
    share = seen(gl, shown, [(0.1 * 4 / 3.49, 0.1 * 4 / 3.49, 0.0), (0.0, 0.0, 0.0)])
    assert share.tolist() == [0.0, 1.0]


@pytest.mark.parametrize("lamp", [LAMP, LAMP | {"inner": 0.7, "outer": 0.8}, SUN])
def test_a_sequence_is_what_its_frames_are_alone(gl: Any, lamp: dict[str, Any]) -> None:
    """A roof that moves under a moving lamp, comes, goes: no trace of the frames before."""
    shadows = maps(gl)
    places = np.concatenate([along((-3, y, 0), (3, y, 0), 61) for y in (-1.0, 0.1, 1.0)])
    still = draw(plane(0.2, 2.0, "still"), 0, move(0.4, 0.5, 0))
    for step in range(6):
        roof = draw(ROOF, 0, move(0.5 * step - 1.0, 0.0, 0.0), moving=True)
        draws = [FLOOR, still] if step == 4 else [FLOOR, still, roof]
        where = lamp if step < 3 or "w" in lamp else lamp | {"position": (0.3, 0.0, 4.0)}
        shown = scene(where, *draws)
        together = seen(gl, shown, places, shadows=shadows)
        assert np.array_equal(together, seen(gl, shown, places))
        assert 0.0 < together.mean() < 1.0


def test_deforming_geometry(gl: Any) -> None:
    shadows = maps(gl)
    for version, x in enumerate((0.0, 2.0, 0.0)):
        roof = replace(plane(0.5, 1.3, "roof"), version=version)
        roof.points[:, 0] += x
        shown = scene(LAMP, FLOOR, draw(roof, moving=True))
        assert seen(gl, shown, BELOW, shadows=shadows)[0] == (1.0 if x else 0.0)


def test_what_stands_still_is_drawn_once(gl: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    shadows = maps(gl)
    spy = Spy(shadows, monkeypatch)
    lamps = [LAMP, LAMP | {"position": (2.0, 0.0, 4.0)}]
    shadows.update(scene(lamps, FLOOR, draw(ROOF)))
    assert spy.taken() == (10, 0, 0)  # each lamp's lower faces: nothing is above it
    # Another moment, another eye, lamps of another brightness: nothing is drawn.
    brighter = [lamp | {"intensity": 900.0} for lamp in lamps]
    shadows.update(scene(brighter, FLOOR, draw(ROOF), camera=Camera(eye=(0.1, -6.0, 5.0))))
    assert spy.taken() == (0, 0, 0)
    # A lamp moves: its own tiles alone.
    lamps[1] = LAMP | {"position": (2.1, 0.0, 4.0)}
    shadows.update(scene(lamps, FLOOR, draw(ROOF)))
    assert spy.taken() == (5, 0, 0)
    # Something moves below both, in one tile of each: their tiles are kept apart once.
    for x in (0.0, 0.1, 0.2):
        thing = draw(plane(0.1, 1.0, "thing"), 0, move(x, 0, 0), moving=True)
        shadows.update(scene(lamps, FLOOR, draw(ROOF), thing))
        assert spy.taken() == (0, 0 if x else 10, 2)
    # It goes: the tiles that saw it once more.
    shadows.update(scene(lamps, FLOOR, draw(ROOF)))
    assert spy.taken() == (0, 0, 2)
    shadows.update(scene(lamps, FLOOR, draw(ROOF)))
    assert spy.taken() == (0, 0, 0)


def test_lights_that_need_no_shadows(gl: Any) -> None:
    """Those without, dark ones, and one below which nothing stands."""
    spot = LAMP | {"inner": 0.2, "outer": 0.3, "axis": (0.0, 0.0, 1.0)}
    lamps = [LAMP | {"shadow": 0}, LAMP | {"intensity": 0.0}, spot, LAMP]
    kinds = maps(gl).update(scene(lamps, FLOOR)).kind.tolist()
    assert kinds == ["", "", "", "SHADOW_CUBE"]
    assert maps(gl).update(scene(LAMP, draw(plane(6.0), casts=False))).kind.tolist() == [""]
    assert maps(gl).update(RenderScene()).kind.tolist() == []


def test_lights_that_do_not_fit_shine_without_shadows(gl: Any) -> None:
    """Tiles of 64: a texture of 1024 holds 16 rows of three lights of five; the nearest have it."""
    report = Report()
    shadows = maps(gl, limit=1024, report=report)
    lamps = [LAMP | {"position": (0.02 * i - 1.0, 0.0, 4.0)} for i in range(60)]
    shown = scene(lamps, FLOOR, draw(ROOF), camera=Camera(eye=(-2.0, 0.0, 4.0)))
    kinds = shadows.update(shown).kind
    assert np.flatnonzero(kinds != "").tolist() == list(range(48))
    assert shadows.left_out.tolist() == list(range(48, 60))
    (finding,) = report
    assert finding.code == "shadow-budget"
    assert "12 of 60 lights" in finding.text
    assert "at (-0.04, 0, 4) m with 800 cd, (-0.02, 0, 4) m with 800 cd, (0, 0, 4)" in finding.text
    shadows.update(shown)
    assert len(report) == 1
    # Seen from a little farther on those that have shadows keep them.
    near = replace(shown, camera=Camera(eye=(-1.0, 0.0, 4.2)))
    assert shadows.update(near).kind.tolist() == kinds.tolist()


def test_broken_casters_do_no_harm(gl: Any) -> None:
    broken = plane(0.5, 1.3, "broken")
    broken.points[1] = np.nan, 0.0, 1e30
    far = move(0, 0, 0)
    far[0, 0] = np.inf
    draws = [draw(broken), draw(broken, moving=True), draw(ROOF, 0, far, moving=True)]
    assert seen(gl, scene(LAMP, FLOOR, *draws), [(0.3, 0.0, 0.0)])[0] in (0.0, 1.0)
    share = seen(gl, scene(LAMP, FLOOR, *draws), [(3.0, 0.0, 0.0)])
    assert share[0] == 1.0
