"""Polygons to triangles and corners."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdrusd.usd.triangles import Corners, corners, face_normals, smooth_normals

COUNTS = st.lists(st.integers(0, 9), max_size=40)


def loop(counts: list[int], indices: list[int], left_handed: bool) -> list[tuple[int, int, int]]:
    """The fan of each face, one face after the other."""
    triangles, start = [], 0
    for count in counts:
        face = indices[start : start + count]
        start += count
        for second, third in pairwise(face[1:]):
            triangles.append((face[0], third, second) if left_handed else (face[0], second, third))
    return triangles


@given(COUNTS, st.randoms(use_true_random=False), st.booleans())
def test_faces_are_fanned_from_their_first_corner(
    counts: list[int], random: object, left_handed: bool
) -> None:
    indices = [random.randrange(100) for _ in range(sum(counts))]  # type: ignore[attr-defined]
    tri = corners(np.array(counts, int), np.array(indices, int), left_handed=left_handed)
    assert [tuple(t) for t in tri.vertex.tolist()] == loop(counts, indices, left_handed)
    places = list(range(len(indices)))
    assert [tuple(t) for t in tri.corner.tolist()] == loop(counts, places, left_handed)
    faces = [f for f, count in enumerate(counts) for _ in range(max(count - 2, 0))]
    assert tri.face.tolist() == faces


@pytest.mark.parametrize(("counts", "indices"), [([4], [0, 1, 2]), ([3], [0, 1, 2, 3]), ([-3], [])])
def test_counts_and_indices_must_fit(counts: list[int], indices: list[int]) -> None:
    with pytest.raises(ValueError, match="corners"):
        corners(np.array(counts), np.array(indices, int), left_handed=False)


def square_and_triangle() -> Corners:
    return corners(np.array([4, 3]), np.array([0, 1, 2, 3, 2, 1, 4]), left_handed=False)


@pytest.mark.parametrize(
    ("interpolation", "count", "wanted"),
    [
        ("constant", 1, [0] * 9),
        ("uniform", 2, [0] * 6 + [1] * 3),
        ("vertex", 5, [0, 1, 2, 0, 2, 3, 2, 1, 4]),
        ("varying", 5, [0, 1, 2, 0, 2, 3, 2, 1, 4]),
        ("faceVarying", 7, [0, 1, 2, 0, 2, 3, 4, 5, 6]),
    ],
)
def test_values_reach_their_corners(interpolation: str, count: int, wanted: list[int]) -> None:
    values = np.arange(count)[:, None] * [1.0, 10.0]
    got = square_and_triangle().take(values, interpolation)
    assert got is not None
    assert got.dtype == np.float32
    assert got[:, 0].tolist() == wanted
    assert got[:, 1].tolist() == [10 * w for w in wanted]


@pytest.mark.parametrize(
    ("interpolation", "count"),
    [("uniform", 0), ("constant", 0), ("vertex", 4), ("faceVarying", 6), ("faceVarying", 1)],
)
def test_too_few_values_are_refused(interpolation: str, count: int) -> None:
    assert square_and_triangle().take(np.zeros((count, 2)), interpolation) is None


def test_an_unknown_interpolation_is_refused() -> None:
    assert square_and_triangle().take(np.zeros((9, 2)), "spiral") is None


def test_triangles_of_some_faces() -> None:
    tri = square_and_triangle().select(np.array([False, True]))
    assert tri.vertex.tolist() == [[2, 1, 4]]
    assert tri.corner.tolist() == [[4, 5, 6]]
    assert tri.face.tolist() == [1]


def test_flat_normals_face_the_side_from_which_corners_run_counterclockwise() -> None:
    points = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], np.float32)
    tri = corners(np.array([4]), np.arange(4), left_handed=False)
    assert face_normals(points, tri).tolist() == [[0, 0, 1]] * 6
    tri = corners(np.array([4]), np.arange(4), left_handed=True)
    assert face_normals(points, tri).tolist() == [[0, 0, -1]] * 6


def test_a_face_without_area_has_no_direction_and_no_nan() -> None:
    tri = corners(np.array([3]), np.array([0, 0, 0]), left_handed=False)
    assert face_normals(np.zeros((1, 3), np.float32), tri).tolist() == [[0, 0, 0]] * 3
    assert smooth_normals(np.zeros((1, 3), np.float32), tri).tolist() == [[0, 0, 0]] * 3


def test_smooth_normals_weigh_faces_by_area() -> None:
    # A roof ridge between a face of area 2 that looks up and one of area 1 that looks along x.
    points = np.array([[0, 0, 0], [0, 1, 0], [-4, 0, 0], [0, 0, -2]], np.float32)
    tri = corners(np.array([3, 3]), np.array([0, 1, 2, 1, 0, 3]), left_handed=False)
    areas = face_normals(points, tri)[::3] * np.array([[2.0], [1.0]])
    wanted = areas.sum(axis=0) / np.linalg.norm(areas.sum(axis=0))
    got = smooth_normals(points, tri)
    assert got[0] == pytest.approx(wanted, abs=1e-7)
    assert got[2] == pytest.approx(areas[0] / 2.0, abs=1e-7)  # a corner of one face
