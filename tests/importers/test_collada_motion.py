"""COLLADA transforms and their animation: closed forms of where a point comes to lie."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from collada_builder import document, load, names, numbers, source
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hdrusd.importers.collada_transforms import decompose, has_shear
from hdrusd.legacy.scene import Channel, Node
from hdrusd.report import Report

Doubles = npt.NDArray[np.float64]


def placed(folder: Path, transforms: str, point: tuple[float, float, float]) -> Doubles:
    """Where a point of a node with these transforms lies."""
    scene, _ = load(folder, document(nodes=f"<node>{transforms}</node>"))
    matrix = scene.roots[0].transform
    matrix = np.eye(4) if matrix is None else matrix
    assert isinstance(matrix, np.ndarray)
    found: Doubles = (np.array([*point, 1.0]) @ matrix)[:3]
    return found


@pytest.mark.parametrize(
    ("transforms", "point", "place"),
    [
        ("<translate>1 2 3</translate>", (1, 1, 1), (2, 3, 4)),
        ("<scale>2 3 4</scale>", (1, 1, 1), (2, 3, 4)),
        ("<rotate>0 0 1 90</rotate>", (1, 0, 0), (0, 1, 0)),
        ("<rotate>0 0 9 90</rotate>", (1, 0, 0), (0, 1, 0)),  # an axis of any length
        ("<rotate>1 1 1 120</rotate>", (1, 0, 0), (0, 1, 0)),  # x to y to z
        ("<rotate>0 0 0 90</rotate>", (1, 0, 0), (1, 0, 0)),
        ("<matrix>0 -1 0 5  1 0 0 6  0 0 1 7  0 0 0 1</matrix>", (1, 0, 0), (5, 7, 7)),
        # the first stands outermost: turned, then moved
        ("<translate>5 0 0</translate><rotate>0 0 1 90</rotate>", (1, 0, 0), (5, 1, 0)),
        ("<rotate>0 0 1 90</rotate><translate>5 0 0</translate>", (1, 0, 0), (0, 6, 0)),
        # from (0, 0, 5) to the origin a camera looks down -Z, and up is Y
        ("<lookat>0 0 5  0 0 0  0 1 0</lookat>", (0, 0, -5), (0, 0, 0)),
        ("<lookat>5 0 0  0 0 0  0 0 1</lookat>", (0, 0, -5), (0, 0, 0)),
        ("<lookat>5 0 0  0 0 0  0 0 1</lookat>", (0, 2, 0), (5, 0, 2)),
        # RiSkew of 45 degrees: y is pushed along x by its own length
        ("<skew>45 0 1 0 1 0 0</skew>", (0, 2, 0), (2, 2, 0)),
    ],
)
def test_each_transform(
    tmp_path: Path, transforms: str, point: tuple[float, float, float], place: tuple[float, ...]
) -> None:
    assert placed(tmp_path, transforms, point) == pytest.approx(place, abs=1e-14)


@pytest.mark.parametrize(
    "transforms",
    [
        "<translate>1 nan 3</translate>",
        "<translate>1 2</translate>",
        "<matrix>1 2 3</matrix>",
        "<scale>1e39 1 1</scale>",
        "<scale>1e30 1 1</scale><scale>1e30 1 1</scale>",
    ],
)
def test_broken_transforms_are_left_out(tmp_path: Path, transforms: str) -> None:
    scene, report = load(tmp_path, document(nodes=f"<node>{transforms}</node>"))
    assert scene.roots[0].transform is None
    assert report.codes() & {"collada-number", "node-matrix"}


# -- animation ------------------------------------------------------------------------------


def animated(
    folder: Path,
    transforms: str,
    target: str,
    times: Any,
    values: Any,
    width: int = 1,
    mode: str = "LINEAR",
    more: str = "",
) -> tuple[Node, Report]:
    """A node with one channel; ``more``: further sources, ``i`` and ``o`` for the tangents."""
    count = len(np.ravel(times))
    tangents = "".join(
        f'<input semantic="{semantic}" source="#{name}"/>'
        for semantic, name in (("IN_TANGENT", "i"), ("OUT_TANGENT", "o"))
        if f'id="{name}"' in more
    )
    library = (
        "<library_animations><animation>"
        + source("t", numbers(times), 1)
        + source("v", numbers(values), width)
        + names("k", " ".join([mode] * count))
        + more
        + '<sampler id="sm"><input semantic="INPUT" source="#t"/><input semantic="OUTPUT" '
        f'source="#v"/><input semantic="INTERPOLATION" source="#k"/>{tangents}</sampler>'
        f'<channel source="#sm" target="{target}"/></animation></library_animations>'
    )
    scene, report = load(folder, document(library, f'<node id="n">{transforms}</node>'))
    return scene.roots[0], report


def channel(node: Node, path: str) -> Channel:
    """The channel of a path."""
    (found,) = [c for c in node.animation if c.path == path]
    return found


MOVE = '<translate sid="t">1 2 3</translate>'


def test_a_whole_translation(tmp_path: Path) -> None:
    node, report = animated(tmp_path, MOVE, "n/t", [0, 2.5], [[0, 0, 0], [10, 0, 5]], 3)
    made = channel(node, "translation")
    assert made.times.tolist() == [0, 2.5]  # seconds
    assert made.values.tolist() == [[0, 0, 0], [10, 0, 5]]
    assert [c.path for c in node.animation] == ["translation"]
    assert not report.codes() - {"collada-source"}


@pytest.mark.parametrize("target", ["n/t.Y", "n/t(1)"])
def test_one_number_of_a_translation(tmp_path: Path, target: str) -> None:
    node, _ = animated(tmp_path, MOVE, target, [0, 1], [5, 7])
    assert channel(node, "translation").values.tolist() == [[1, 5, 3], [1, 7, 3]]


def test_a_cell_of_a_matrix(tmp_path: Path) -> None:
    text = '<matrix sid="m">1 0 0 4  0 1 0 5  0 0 1 6  0 0 0 1</matrix>'
    node, _ = animated(tmp_path, text, "n/m(3)(1)", [0, 1], [7, 8])  # column 3, row 1: y
    assert channel(node, "translation").values.tolist() == [[4, 7, 6], [4, 8, 6]]


def test_sampled_matrices(tmp_path: Path) -> None:
    first = [2, 0, 0, 1, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]
    then = [0, -2, 0, 1, 2, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]
    node, _ = animated(
        tmp_path, f'<matrix sid="m">{numbers(first)}</matrix>', "n/m", [0, 1], [first, then], 16
    )
    half = math.sqrt(0.5)
    assert channel(node, "rotation").values == pytest.approx(
        np.array([[0, 0, 0, 1], [0, 0, half, half]]), abs=1e-15
    )
    assert node.transform is not None
    assert node.transform.scale == pytest.approx((2, 2, 2))  # type: ignore[union-attr]
    assert node.transform.translation == (1, 0, 0)  # type: ignore[union-attr]


def test_a_full_turn_goes_all_the_way_round(tmp_path: Path) -> None:
    text = '<rotate sid="r">0 0 1 0</rotate>'
    node, report = animated(tmp_path, text, "n/r.ANGLE", [0, 1], [0, 360])
    made = channel(node, "rotation")
    turned = np.unwrap(2.0 * np.arctan2(made.values[:, 2], made.values[:, 3]))
    assert np.degrees(turned) == pytest.approx(360.0 * made.times, abs=1e-9)
    assert (np.degrees(np.diff(turned)) < 90.0).all()
    assert "animation-cubic" in report.codes()


def test_a_step_holds(tmp_path: Path) -> None:
    node, _ = animated(tmp_path, MOVE, "n/t.X", [0, 1], [5, 7], mode="STEP")
    made = channel(node, "translation")
    assert made.interpolation == "step"
    assert made.times.tolist() == [0, 1]


def test_a_bezier_is_its_polynomial(tmp_path: Path) -> None:
    # inner points at thirds of the time make time linear in the parameter s; with inner values
    # 0 and 1 the value is 3 s^2 - 2 s^3
    tangents = source("i", numbers([[-1, 0], [2, 1]]), 2) + source(
        "o", numbers([[1, 0], [4, 1]]), 2
    )
    node, _ = animated(tmp_path, MOVE, "n/t.X", [0, 3], [0, 1], mode="BEZIER", more=tangents)
    made = channel(node, "translation")
    s = made.times / 3.0
    assert len(s) > 64
    assert made.values[:, 0] == pytest.approx(3 * s**2 - 2 * s**3, abs=1e-11)


def test_a_bezier_may_bend_in_time(tmp_path: Path) -> None:
    # both inner points at the first key: time s^3, value s^3 + 3 (1 - s) s^2 with the second at 1
    tangents = source("i", numbers([[0, 0], [0, 1]]), 2) + source("o", numbers([[0, 0], [1, 1]]), 2)
    node, _ = animated(tmp_path, MOVE, "n/t.X", [0, 1], [0, 1], mode="BEZIER", more=tangents)
    made = channel(node, "translation")
    s = np.cbrt(made.times)
    assert made.values[:, 0] == pytest.approx(s**3 + 3 * (1 - s) * s**2, abs=1e-10)


def test_a_hermite_is_its_polynomial(tmp_path: Path) -> None:
    tangents = source("i", numbers([[0, 0], [0, 2]]), 2) + source("o", numbers([[0, 2], [0, 0]]), 2)
    node, _ = animated(tmp_path, MOVE, "n/t.X", [0, 1], [0, 1], mode="HERMITE", more=tangents)
    made = channel(node, "translation")
    s = made.times
    wanted = 2 * (s**3 - 2 * s**2 + s) + (3 * s**2 - 2 * s**3) + 2 * (s**3 - s**2)
    assert made.values[:, 0] == pytest.approx(wanted, abs=1e-14)


@pytest.mark.parametrize(
    ("target", "times", "values", "code"),
    [
        ("n/gone", [0, 1], [0, 1], "animation-path"),
        ("lamp/color.R", [0, 1], [0, 1], "animation-path"),
        ("n/t(9)", [0, 1], [0, 1], "animation-path"),
        ("n/t", [0, 1], [0, 1], "animation-dropped"),
        ("n/t.X", [0, 0], [0, 1], "animation-dropped"),
        ("n/t.X", [0, 1], [0], "animation-dropped"),
        ("n/t.X", [0, math.nan], [0, 1], "animation-dropped"),
    ],
)
def test_what_cannot_be_animated_says_so(
    tmp_path: Path, target: str, times: Any, values: Any, code: str
) -> None:
    node, report = animated(tmp_path, MOVE, target, times, values)
    assert code in report.codes()
    assert not node.animation


def test_an_unknown_interpolation_is_linear(tmp_path: Path) -> None:
    node, report = animated(tmp_path, MOVE, "n/t.X", [0, 1], [0, 1], mode="CARDINAL")
    assert channel(node, "translation").interpolation == "linear"
    assert "animation-interpolation" in report.codes()


# -- apart and together ---------------------------------------------------------------------

UNIT = st.floats(-1.0, 1.0)


@given(
    hnp.arrays(np.float64, (5, 4), elements=UNIT),
    hnp.arrays(np.float64, (5, 3), elements=st.floats(0.1, 10.0)),
    st.booleans(),
)
def test_what_was_put_together_comes_apart(q: Doubles, scales: Doubles, mirrored: bool) -> None:
    lengths = np.sqrt((q * q).sum(axis=1, keepdims=True))
    q = np.where(lengths > 0.1, q / np.where(lengths > 0.1, lengths, 1.0), (0.0, 0.0, 0.0, 1.0))
    x, y, z, w = q.T
    columns = np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    ).transpose(2, 0, 1)
    if mirrored:
        scales = scales * (-1.0, 1.0, 1.0)
    total = np.tile(np.eye(4), (5, 1, 1))
    total[:, :3, :3] = scales[:, :, None] * columns.transpose(0, 2, 1)
    _, rotations, found, error = decompose(total)
    assert not has_shear(error)
    assert error < 1e-13
    assert found == pytest.approx(scales, rel=1e-12)
    assert np.abs((rotations * q).sum(axis=1)) == pytest.approx(np.ones(5), abs=1e-12)


def test_shear_is_noticed() -> None:
    total = np.eye(4)[None].copy()
    total[0, 1, 0] = 0.5
    assert has_shear(decompose(total)[3])
