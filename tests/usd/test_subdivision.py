"""Subdivision by the published rules: Catmull and Clark 1978, Loop 1987, DeRose et al. 1998."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from hdrusd.usd.subdivision import (
    INFINITE,
    Cage,
    Refined,
    boundary_points,
    refine,
    sharpen_boundary_corners,
)

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
CUBE_FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
TETRA = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], np.float32)
TETRA_FACES = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
#: The ring of edges about the top of the cube, z = 1.
TOP = [(1, 3), (3, 7), (7, 5), (5, 1)]


def cage(
    faces: list[list[int]],
    size: int,
    creases: Any = (),
    sharp: float = 0.0,
    corners: dict[int, float] | None = None,
) -> Cage:
    sharpness = np.zeros(size)
    for point, value in (corners or {}).items():
        sharpness[point] = value
    return Cage(
        np.array([len(face) for face in faces]),
        np.array([point for face in faces for point in face]),
        size,
        np.array(creases, np.int64).reshape(-1, 2),
        np.full(len(creases), sharp),
        sharpness,
    )


def grid(n: int) -> tuple[np.ndarray[Any, Any], list[list[int]]]:
    """Points (x, y, 0) and quads of n x n unit squares."""
    y, x = np.mgrid[0 : n + 1, 0 : n + 1]
    points = np.stack([x, y, 0 * x], -1).reshape(-1, 3).astype(np.float32)
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], -1).reshape(-1, 4)
    return points, quads.tolist()


def euler(fine: Refined) -> int:
    """Points in use - edges + faces."""
    ends = np.stack([fine.indices, _next(fine)], 1)
    edges = len(np.unique(np.sort(ends, axis=1), axis=0))
    return len(np.unique(fine.indices)) - edges + len(fine.counts)


def _next(fine: Refined) -> np.ndarray[Any, Any]:
    width = fine.counts[0]
    return np.roll(fine.indices.reshape(-1, width), -1, axis=1).ravel()


def test_one_step_of_a_cube() -> None:
    """Face point: mean. Edge: mean of ends and face points. Point: (F + 2 R + (n - 3) P) / n."""
    got = refine(cage(CUBE_FACES, 8), "catmullClark", 1).vertex(CUBE)
    assert len(got) == 8 + 12 + 6
    # Of (1, 1, 1): F = (1, 1, 1) / 3, R = (2, 2, 2) / 3, n = 3.
    assert got[:8] == pytest.approx(CUBE * 5.0 / 9.0, abs=1e-6)
    edges = got[8:20]
    assert np.sort(np.abs(edges), axis=1) == pytest.approx(
        np.tile([0.0, 0.75, 0.75], (12, 1)), abs=1e-6
    )
    assert np.sort(np.abs(got[20:]), axis=1).tolist() == [[0.0, 0.0, 1.0]] * 6


def test_a_cubes_points_approach_their_limit() -> None:
    """The limit of a point of valence n is (n^2 P + 4 sum E + sum F) / (n (n + 5)).

    M. Halstead, M. Kass, T. DeRose, Efficient, fair interpolation using Catmull-Clark
    surfaces (1993). Of a cube's corner the neighbours along edges sum to P, those across
    faces to -P: (9 + 4 - 1) / 24 = 1/2. Each level comes nearer by a factor of 4.
    """
    got = refine(cage(CUBE_FACES, 8), "catmullClark", 7).vertex(CUBE)
    assert got[:8] == pytest.approx(CUBE * 0.5, abs=0.1 * 4.0**-7 + 1e-6)


@pytest.mark.parametrize("levels", [1, 2, 3])
def test_what_is_refined_stays_closed(levels: int) -> None:
    fine = refine(cage(CUBE_FACES, 8), "catmullClark", levels)
    assert len(fine.counts) == 6 * 4**levels
    assert euler(fine) == 2
    fine = refine(cage(TETRA_FACES, 4), "loop", levels)
    assert len(fine.counts) == 4 * 4**levels
    assert euler(fine) == 2
    assert np.bincount(fine.base).tolist() == [4**levels] * 4


def test_one_step_of_a_tetrahedron_by_loop() -> None:
    """Edge: 3/8 of the ends, 1/8 of the others; point of valence 3: 7/16, and 3/16 of each."""
    got = refine(cage(TETRA_FACES, 4), "loop", 1).vertex(TETRA)
    others = TETRA.sum(axis=0) - TETRA
    assert got[:4] == pytest.approx(7 / 16 * TETRA + 3 / 16 * others, abs=1e-6)
    # Ends and others of each edge lie opposite: (6/8 - 2/8) of the edge's middle, length 1.
    assert np.linalg.norm(got[4:], axis=1) == pytest.approx(np.full(6, 0.5), abs=1e-6)


def test_loop_keeps_a_regular_plane_as_it_is() -> None:
    """The weights reproduce linear functions where the valence is 6."""
    points, quads = grid(4)
    triangles = [t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])]
    fine = refine(cage(triangles, 25), "loop", 1)
    assert fine.vertex(points)[12] == pytest.approx(points[12], abs=1e-6)
    with pytest.raises(ValueError, match="no triangles"):
        refine(cage(quads, 25), "loop", 1)


def test_catmull_clark_is_a_uniform_bspline_on_a_regular_grid() -> None:
    """Heights x^2 + y^2 at integers becomes 1/8 (z0 + 6 z1 + z2) = x^2 + 1/4 along each axis."""
    points, quads = grid(4)
    z = points[:, 0] ** 2 + points[:, 1] ** 2
    heights = np.stack([points[:, 0], points[:, 1], z], 1)
    got = refine(cage(quads, 25), "catmullClark", 1).vertex(heights)
    assert got[12] == pytest.approx([2.0, 2.0, 8.5], abs=1e-5)


def test_an_infinitely_sharp_ring_stays_where_it_is() -> None:
    fine = refine(cage(CUBE_FACES, 8, TOP, INFINITE), "catmullClark", 4)
    got = fine.vertex(CUBE)
    # The top stays flat, all 17 x 17 points of it, and its rim is the B-spline of the square:
    # in the limit (P0 + 4 P1 + P2) / 6 = 2/3 of each of its corners.
    assert (np.abs(got[:, 2] - 1.0) < 1e-6).sum() == 17**2
    assert np.abs(got[7]) == pytest.approx([2 / 3, 2 / 3, 1.0], abs=0.4 * 4.0**-4 + 1e-6)


def test_a_crease_of_sharpness_one_is_sharp_once() -> None:
    """After one step by the crease rule (3/4, 1/8, 1/8; middles), smooth rules follow."""
    sharp = refine(cage(CUBE_FACES, 8, TOP, INFINITE), "catmullClark", 1).vertex(CUBE)
    once = refine(cage(CUBE_FACES, 8, TOP, 1.0), "catmullClark", 1).vertex(CUBE)
    assert once == pytest.approx(sharp, abs=1e-6)
    assert once[7] == pytest.approx([0.75, 0.75, 1.0], abs=1e-6)
    later = refine(cage(CUBE_FACES, 8, TOP, 1.0), "catmullClark", 2).vertex(CUBE)
    assert later[7, 2] < 1.0


def test_half_a_sharpness_is_half_way() -> None:
    """DeRose et al. 1998: between the smooth and the sharp point by what is left of it."""
    smooth = refine(cage(CUBE_FACES, 8), "catmullClark", 1).vertex(CUBE)
    sharp = refine(cage(CUBE_FACES, 8, TOP, INFINITE), "catmullClark", 1).vertex(CUBE)
    half = refine(cage(CUBE_FACES, 8, TOP, 0.5), "catmullClark", 1).vertex(CUBE)
    assert half == pytest.approx((smooth + sharp) / 2.0, abs=1e-6)


def test_a_sharp_corner_stays() -> None:
    got = refine(cage(CUBE_FACES, 8, corners={7: INFINITE}), "catmullClark", 3).vertex(CUBE)
    assert got[7].tolist() == [1.0, 1.0, 1.0]
    # Three sharp edges make one too.
    edges = [(7, 3), (7, 5), (7, 6)]
    got = refine(cage(CUBE_FACES, 8, edges, INFINITE), "catmullClark", 3).vertex(CUBE)
    assert got[7].tolist() == [1.0, 1.0, 1.0]


def test_boundaries_follow_their_own_curve() -> None:
    """Corners of a lone quad: by (3/4, 1/8, 1/8) under edgeOnly, kept under edgeAndCorner."""
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    edge_only = refine(cage([[0, 1, 2, 3]], 4), "catmullClark", 1).vertex(square)
    assert edge_only[0] == pytest.approx([0.125, 0.125])
    kept = refine(sharpen_boundary_corners(cage([[0, 1, 2, 3]], 4)), "catmullClark", 3)
    assert kept.vertex(square)[:4].tolist() == square.tolist()
    points, quads = grid(2)
    rim = boundary_points(cage(quads, 9))
    assert np.flatnonzero(~rim).tolist() == [4]
    assert points[4].tolist() == [1.0, 1.0, 0.0]


def test_bilinear_leaves_the_surface_as_it_is() -> None:
    fine = refine(cage(CUBE_FACES, 8), "bilinear", 2)
    got = fine.vertex(CUBE)
    assert np.abs(got).max(axis=1).tolist() == [1.0] * len(got)
    assert len(fine.counts) == 6 * 16
    assert np.array_equal(got, fine.varying(CUBE))


def test_varying_values_stay_linear_under_a_smooth_scheme() -> None:
    fine = refine(cage(CUBE_FACES, 8), "catmullClark", 2)
    assert fine.varying(CUBE)[:8].tolist() == CUBE.tolist()


def test_ngons_become_quads_about_their_middle() -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 5, endpoint=False)
    points = np.stack([np.cos(turn), np.sin(turn)], 1).astype(np.float32)
    fine = refine(sharpen_boundary_corners(cage([[0, 1, 2, 3, 4]], 5)), "catmullClark", 1)
    assert fine.counts.tolist() == [4] * 5
    assert fine.vertex(points)[-1] == pytest.approx([0.0, 0.0], abs=1e-6)


def test_the_smooth_rule_for_triangles_weighs_their_centres_by_047() -> None:
    """An edge point is (1/2 - 0.47) of each end and 0.47 of each centre."""
    plain = refine(cage(TETRA_FACES, 4), "catmullClark", 1).vertex(TETRA)
    smooth = refine(cage(TETRA_FACES, 4), "catmullClark", 1, smooth_triangles=True).vertex(TETRA)
    # Ends of an edge sum to 2 M, the two centres to 2/3 M (M: its middle, length 1).
    assert np.linalg.norm(plain[4:10], axis=1) == pytest.approx(np.full(6, 0.5 + 1 / 6), abs=1e-6)
    wanted = 0.03 * 2.0 + 0.47 * 2.0 / 3.0
    assert np.linalg.norm(smooth[4:10], axis=1) == pytest.approx(np.full(6, wanted), abs=1e-6)
    assert smooth[:4] == pytest.approx(plain[:4], abs=1e-6)


@pytest.mark.parametrize(
    ("rule", "corner"),
    # Of a square's corner at 0: kept, or (3/4, 1/8, 1/8) along the rim.
    [
        ("none", 0.125),
        ("cornersOnly", 0.0),
        ("cornersPlus1", 0.0),
        ("cornersPlus2", 0.0),
        ("boundaries", 0.0),
        ("all", 0.0),
    ],
)
def test_texture_coordinates_at_the_corner_of_a_chart(rule: str, corner: float) -> None:
    points, quads = grid(2)
    fine = refine(cage(quads, 9), "catmullClark", 1)
    uv = fine.face_varying(points[np.array(quads).ravel(), :2], rule)
    assert uv[0] == pytest.approx([corner, corner], abs=1e-6)
    assert uv.shape == (4 * len(fine.counts), 2)


@pytest.mark.parametrize(("rule", "middle"), [("boundaries", 0.5), ("cornersPlus1", 0.5)])
def test_rims_of_charts_are_followed(rule: str, middle: float) -> None:
    """The middle point of a chart's straight rim stays on it, by either rule."""
    points, quads = grid(2)
    fine = refine(cage(quads, 9), "catmullClark", 1)
    uv = fine.face_varying(points[np.array(quads).ravel(), :2] / 2.0, rule)
    corner = np.flatnonzero(fine.indices == 1)[0]
    assert uv[corner] == pytest.approx([middle, 0.0], abs=1e-6)


def test_values_that_differ_at_a_point_are_a_seam() -> None:
    """Two quads, the second with its own chart: nothing is mixed over the seam."""
    faces = [[0, 1, 4, 3], [1, 2, 5, 4]]
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [5, 5], [6, 5], [6, 6], [5, 6]], np.float32)
    got = refine(cage(faces, 6), "catmullClark", 2).face_varying(uv, "cornersPlus1")
    near, far = got[: len(got) // 2], got[len(got) // 2 :]
    assert near.min() == 0.0
    assert near.max() == 1.0
    assert far.min() == 5.0
    assert far.max() == 6.0


def test_points_of_no_face_and_edges_of_three_faces_stay() -> None:
    """Where no fan or ring of faces exists a point is a corner; nothing divides by zero."""
    fins = [[0, 1, 2], [0, 1, 3], [0, 1, 4]]
    points = np.random.default_rng(3).random((6, 3)).astype(np.float32)
    got = refine(cage(fins, 6), "catmullClark", 2).vertex(points)
    assert got[[0, 1, 5]].tolist() == points[[0, 1, 5]].tolist()
    assert np.isfinite(got).all()


def test_valence_weights_of_loop() -> None:
    """Of a fan of n triangles about a raised middle: 1 - n beta of its height is left."""
    for n in (4, 5, 6, 9):
        faces = [[0, 1 + k, 1 + (k + 1) % n] for k in range(n)]
        heights = np.zeros((n + 1, 1), np.float32)
        heights[0] = 1.0
        beta = (0.625 - (0.375 + 0.25 * math.cos(2.0 * math.pi / n)) ** 2) / n
        got = refine(cage(faces, n + 1), "loop", 1).vertex(heights)
        assert got[0, 0] == pytest.approx(1.0 - n * beta, abs=1e-6)
