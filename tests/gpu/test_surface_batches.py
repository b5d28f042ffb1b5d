"""Merged, culled and kept geometry shows what the same draws show one by one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_scenes import HEIGHT, WIDTH, Array, draw, lights, look, quad, waves

from hdrusd.gpu.buffers import instance_rows, mirrored, split
from hdrusd.gpu.culling import in_view
from hdrusd.gpu.hdr import HdrRenderer
from hdrusd.gpu.program import Programs
from hdrusd.gpu.surface_batches import (
    BATCH_RADIUS,
    BATCH_TRIANGLES,
    MERGED_TRIANGLES,
    clusters,
    read_mesh,
    spheres,
)
from hdrusd.scene import Camera, Draw, Material, RenderScene

LAYERS = ("g_normal", "g_diffuse", "g_specular", "hdr")


@pytest.fixture
def renderer(gl: Any) -> Iterator[HdrRenderer]:
    yield HdrRenderer(gl, Programs(gl), (WIDTH, HEIGHT), lambda _: None)
    gl.extra["framebuffer"].use()


def show(renderer: HdrRenderer, scene: RenderScene) -> dict[str, Array]:
    renderer.draw_surfaces(scene)
    return {name: renderer.layer(name).astype(np.float64) for name in LAYERS}


def apart(scene: RenderScene) -> RenderScene:
    """The same, with every draw kept to itself."""
    return replace(scene, draws=tuple(replace(d, moving=True) for d in scene.draws))


def same(got: dict[str, Array], wanted: dict[str, Array]) -> None:
    """Of the same surfaces, but for roundings of positions and normals and for edges."""
    seen, meant = (layers["hdr"][..., 3] > 0.0 for layers in (got, wanted))
    assert meant.mean() > 0.05
    both = seen & meant
    assert (seen != meant).sum() <= 0.005 * seen.size
    for name in LAYERS:
        close = np.isclose(got[name][both], wanted[name][both], rtol=1e-4, atol=1e-5).all(axis=-1)
        assert close.mean() > 0.99, name


def place(rng: np.random.Generator, reach: float = 1.0) -> Array:
    """A turned, unevenly scaled, perhaps mirrored copy somewhere."""
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    m = np.eye(4)
    m[:3, :3] = turn * rng.uniform(0.1, 0.3, (3, 1)) * rng.choice([-1, 1], (3, 1))
    m[3, :3] = rng.uniform(-reach, reach, 3)
    return m


def heap(count: int, **fields: Any) -> RenderScene:
    """Draws of three materials and of several places each, all over each other."""
    rng = np.random.default_rng(count)
    draws = [
        draw(
            waves(4, key=f"waves {k}") if k % 2 else quad(key=f"quad {k}"),
            k % 3,
            *(place(rng) for _ in range(1 + k % 4)),
            double_sided=k % 5 > 0,
        )
        for k in range(count)
    ]
    colours = np.random.default_rng(1).uniform(0.1, 0.9, (3, 3))
    materials = tuple(Material(diffuse=tuple(c), shininess=9.0) for c in colours)
    made = RenderScene(lights=lights(), draws=tuple(draws), materials=materials, camera=look())
    return replace(made, **fields)


# -- merging ----------------------------------------------------------------------------------


def test_merged_draws_look_as_single_ones(renderer: HdrRenderer) -> None:
    scene = heap(60, ambient=(3.0, 2.0, 1.0))
    got = show(renderer, scene)
    merged = len(renderer.surfaces._batches)
    same(got, show(renderer, apart(scene)))
    assert merged <= 3 * 2, "60 draws in three materials, one-sided and double-sided"


def test_draws_that_differ_in_links_are_not_merged(renderer: HdrRenderer) -> None:
    scene = heap(2)
    linked = [replace(d, material=0, double_sided=True, links=k) for k, d in enumerate(scene.draws)]
    show(renderer, replace(scene, draws=tuple(linked)))
    assert len(renderer.surfaces._batches) >= 2


def test_many_copies_are_not_merged(renderer: HdrRenderer) -> None:
    """A draw of many triangles stays one call: memory for all its copies is what costs."""
    rng = np.random.default_rng(8)
    sheet = waves(24)
    copies = MERGED_TRIANGLES // (24 * 24 * 2) + 1
    scene = heap(1)
    many = draw(sheet, 0, *(place(rng) for _ in range(copies)), double_sided=True)
    got = show(renderer, replace(scene, draws=(many,)))
    assert sum(batch.vertices.size for batch in renderer.surfaces._batches) <= 2 * 25 * 25 * 24
    same(got, show(renderer, apart(replace(scene, draws=(many,)))))


@pytest.mark.parametrize("distance", [1e4, 1e6])
@pytest.mark.parametrize("moving", [False, True])
def test_far_from_the_origin_keeps_millimetres(
    renderer: HdrRenderer, distance: float, moving: bool
) -> None:
    """The same heap elsewhere: distances in view agree to a hundredth of a millimetre."""
    near = heap(12)
    offset = np.array([distance, -0.7 * distance, 0.3 * distance])
    move = np.eye(4)
    move[3, :3] = offset
    far = replace(
        near,
        draws=tuple(replace(d, transforms=d.transforms @ move, moving=moving) for d in near.draws),
        camera=replace(near.camera, eye=tuple(near.camera.eye + offset)),
    )
    got, wanted = show(renderer, far)["g_normal"], show(renderer, near)["g_normal"]
    both = (got[..., 3] > 0) & (wanted[..., 3] > 0)
    assert both.mean() > 0.3
    close = np.abs(got[both][:, 3] - wanted[both][:, 3]) < 1e-5
    assert close.mean() > 0.99  # the others are edges


def test_split_doubles_keep_48_bits() -> None:
    values = np.random.default_rng(2).uniform(-1e7, 1e7, (100, 3))
    high, low = split(values)
    assert np.abs(high.astype(np.float64) + low - values).max() <= 1e7 * 2.0**-48


def test_rows_of_a_matrix() -> None:
    m = np.diag([2.0, 3.0, -4.0, 1.0])
    m[3, :3] = 1.0 / 3.0, 1e7 + 0.1, 0.0
    (row,) = instance_rows(m[None]).astype(np.float64)
    assert row.reshape(4, 4)[:3, :3].tolist() == np.diag([2.0, 3.0, -4.0]).tolist()
    np.testing.assert_allclose(row[[3, 7, 11]] + row[12:15], m[3, :3], rtol=2.0**-48)
    assert row[15] == -1.0
    assert mirrored(m[None]).tolist() == [True]


def test_clusters_are_small_and_whole() -> None:
    rng = np.random.default_rng(4)
    centres = rng.uniform(-2000, 2000, (3000, 3))
    radii, weights = rng.uniform(0, 400, 3000), rng.integers(1, 3000, 3000)
    found = list(clusters(centres, radii, weights))
    assert sorted(np.concatenate(found)) == list(range(3000))
    for chosen in found:
        if len(chosen) > 1:
            assert weights[chosen].sum() <= BATCH_TRIANGLES
            low = (centres[chosen] - radii[chosen, None]).min(axis=0)
            high = (centres[chosen] + radii[chosen, None]).max(axis=0)
            assert (high - low).max() <= 2.0 * BATCH_RADIUS


def test_many_in_one_place_come_to_an_end() -> None:
    found = list(clusters(np.zeros((100, 3)), np.full(100, 1e9), np.ones(100, np.int64)))
    assert len(found) == 100


# -- culling ----------------------------------------------------------------------------------


@pytest.mark.parametrize("orthographic", [False, True])
def test_spheres_that_are_left_out_have_no_point_in_view(orthographic: bool) -> None:
    """Points inside each sphere, projected by the camera's own matrix."""
    camera = look((1.0, 2.0, 3.0), half=2.0 if orthographic else 0.4, orthographic=orthographic)
    camera = replace(camera, near=0.5, far=6.0)
    rng = np.random.default_rng(6)
    centres, radii = rng.uniform(-6, 6, (2000, 3)), rng.uniform(0.0, 1.5, 2000)
    seen = in_view(camera, centres, radii)
    assert 0.02 < seen.mean() < 0.8
    inside = rng.normal(size=(2000, 200, 3))
    inside *= (radii[:, None] * rng.uniform(0, 1, (2000, 200)))[..., None] / np.linalg.norm(
        inside, axis=-1, keepdims=True
    )
    points = np.concatenate([centres[:, None] + inside, np.ones((2000, 200, 1))[..., :1]], axis=-1)
    clip = points @ camera.world_to_view() @ camera.projection()
    shown = (np.abs(clip[..., :3]) < clip[..., 3:]).all(axis=-1).any(axis=-1)
    assert not (shown & ~seen).any()


def test_a_place_without_numbers_counts_as_seen() -> None:
    nowhere = np.array([[np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0]])
    assert in_view(Camera(), nowhere, np.ones(2))[0]


def test_spheres_contain_their_mesh() -> None:
    rng = np.random.default_rng(3)
    mesh = read_mesh(waves(6), [], "")
    assert mesh is not None
    transforms = np.array([place(rng) for _ in range(50)])
    centres, radii = spheres(mesh, transforms)
    points = mesh.vertices[:, :3] @ transforms[:, :3, :3] + transforms[:, None, 3, :3]
    distances = np.linalg.norm(points - centres[:, None], axis=-1)
    assert (distances <= radii[:, None] * (1 + 1e-12)).all()


@pytest.mark.parametrize("moving", [False, True])
def test_what_is_not_seen_is_not_drawn_and_comes_back(renderer: HdrRenderer, moving: bool) -> None:
    """Copies to all sides; the camera turns, and sees its part each time."""
    rng = np.random.default_rng(5)
    places = [place(rng, 4.0) for _ in range(200)]
    scene = heap(1)
    drawn = replace(draw(quad(), 0, *places, double_sided=True), moving=moving)
    eyes = [((0, 0, 0.1), (0, 0, -9)), ((0, 0, 0), (9, 1, 0)), ((0, 0, 0.1), (0, 0, -9))]
    frames = []
    for eye, at in eyes:
        turned = replace(scene, draws=(drawn,), camera=look(eye, at, half=0.7))
        frames.append(show(renderer, turned))
        fresh = HdrRenderer(renderer.ctx, renderer.programs, (WIDTH, HEIGHT), lambda _: None)
        wide = replace(
            turned,
            draws=tuple(
                replace(drawn, transforms=drawn.transforms[k][None], moving=True)
                for k in range(200)
            ),
        )
        same(frames[-1], show(fresh, wide))
    assert not np.array_equal(frames[0]["g_normal"], frames[1]["g_normal"])
    np.testing.assert_array_equal(frames[0]["g_normal"], frames[2]["g_normal"])


# -- from frame to frame ----------------------------------------------------------------------


def test_things_that_move_appear_and_vanish(renderer: HdrRenderer) -> None:
    """Each frame is what a renderer that sees it first shows."""
    rng = np.random.default_rng(7)
    scene = heap(6)
    body = waves(6, key="body")
    bent = replace(body, version=1, points=body.points + np.float32([0.0, 0.0, 0.3]))

    def with_body(geometry: Any, *places: Array) -> RenderScene:
        moving = Draw(geometry, 1, np.array(places), double_sided=True, moving=True)
        return replace(scene, draws=(*scene.draws, moving))

    a, b, c = (place(rng) for _ in range(3))
    mirror = b @ np.diag([-1.0, 1.0, 1.0, 1.0])
    frames = [
        with_body(body, a),
        with_body(body, b),
        with_body(body, a, b, c),
        with_body(body, mirror, c),
        scene,
        with_body(bent, b),
        replace(scene, draws=scene.draws[1:]),
        replace(scene, draws=scene.draws[::-1]),
    ]
    for frame in frames:
        fresh = HdrRenderer(renderer.ctx, renderer.programs, (WIDTH, HEIGHT), lambda _: None)
        got, wanted = show(renderer, frame), show(fresh, frame)
        for name in LAYERS:
            np.testing.assert_array_equal(got[name], wanted[name])


def test_two_draws_of_one_moving_geometry(renderer: HdrRenderer) -> None:
    left, right = np.diag([0.3, 0.3, 1.0, 1.0]), np.diag([0.3, 0.3, 1.0, 1.0])
    left[3, 0], right[3, 0] = -0.6, 0.6
    both = [replace(draw(quad(), 0, m), moving=True) for m in (left, right)]
    scene = replace(heap(1), draws=tuple(both))
    for _ in range(2):
        seen = show(renderer, scene)["hdr"][24, :, 3]
        assert seen[16] == 1.0
        assert seen[48] == 1.0
        assert seen[32] == 0.0


def test_a_geometry_that_bends_keeps_its_weld() -> None:
    """The vertices of the frame before, unless corners that were one come apart."""
    sheet = waves(8)
    mesh = read_mesh(sheet, [], "")
    assert mesh is not None
    bent = replace(sheet, points=sheet.points * np.float32(1.5))
    again = read_mesh(bent, [], "", mesh)
    assert again is not None
    assert again.first is mesh.first
    torn = replace(
        sheet,
        points=sheet.points
        + np.random.default_rng(1).normal(size=(len(sheet.points), 3)).astype(np.float32),
    )
    apart_again = read_mesh(torn, [], "", mesh)
    assert apart_again is not None
    assert len(apart_again.vertices) == len(sheet.points)
    np.testing.assert_array_equal(apart_again.vertices[apart_again.indices][:, :3], torn.points)


def test_nothing_at_all(renderer: HdrRenderer) -> None:
    empty = replace(
        waves(), points=np.zeros((0, 3), np.float32), normals=np.zeros((0, 3), np.float32)
    )
    for moving in (False, True):
        draws = (
            replace(draw(empty), moving=moving),
            Draw(quad(), 0, np.zeros((0, 4, 4)), moving=moving),
        )
        seen = show(renderer, RenderScene(draws=draws, materials=(Material(),), camera=look()))
        assert not seen["hdr"].any()
