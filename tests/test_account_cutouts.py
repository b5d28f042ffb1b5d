"""The reflectance of what is cut out: weighted by the opacity map of the material."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from builders import obj, paint, png, texture
from converted import run

from hdrusd.account.reflectances import Reflectances
from hdrusd.account.wear import Worn
from hdrusd.legacy.scene import Texture, UVTransform
from hdrusd.maps import MapWriter
from hdrusd.report import Report
from hdrusd.usd.material import Map, Surface

#: R of code 230 under D = 1.
R_230 = (230 / 255) ** 2.2


def leaf(shape: tuple[int, int] = (64, 64)) -> npt.NDArray[np.uint8]:
    """White on the upper left quarter, else black."""
    mask = np.zeros(shape, np.uint8)
    mask[: shape[0] // 2, : shape[1] // 2] = 255
    return mask


def grey(values: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    return np.repeat(values[..., None], 3, axis=-1)


@pytest.mark.parametrize("size", [(64, 64), (2, 2), (128, 6)])
def test_a_mask_of_its_own_cuts_as_alpha_does(tmp_path: Path, size: tuple[int, int]) -> None:
    color = grey(leaf() // 255 * 230)
    png(tmp_path / "one.png", np.dstack([color, leaf()]))
    png(tmp_path / "color.png", color)
    png(tmp_path / "mask.png", grey(leaf(size)))
    one = run(obj(tmp_path / "one.obj", "Kd 1 1 1\nmap_Kd one.png\nmap_d one.png"))
    two = run(obj(tmp_path / "two.obj", "Kd 1 1 1\nmap_Kd color.png\nmap_d mask.png"))
    for result in (one, two):
        assert result.materials[0]["reflectance"]["mean"] == pytest.approx(R_230, rel=1e-12)
        assert result.materials[0]["reflectance"]["p95"] == pytest.approx(R_230, rel=1e-12)


def test_what_shines_through_counts_by_its_opacity(tmp_path: Path) -> None:
    color, mask = np.full((8, 8), 100, np.uint8), np.full((8, 8), 51, np.uint8)
    color[:, :4], mask[:, :4] = 230, 255
    png(tmp_path / "color.png", grey(color))
    png(tmp_path / "mask.png", grey(mask))
    (row,) = run(obj(tmp_path / "a.obj", "Kd 1 1 1\nmap_Kd color.png\nmap_d mask.png")).materials
    wanted = (R_230 + 0.2 * (100 / 255) ** 2.2) / 1.2  # 51 of 255 is a fifth
    # 16,384 places spread evenly: their share of a half is known to 1 in 200.
    assert row["reflectance"]["mean"] == pytest.approx(wanted, abs=0.005)


def test_a_mask_lies_by_its_own_transform(tmp_path: Path) -> None:
    color, mask = np.zeros((8, 8), np.uint8), np.zeros((8, 8), np.uint8)
    color[:, 4:], mask[:, :4] = 230, 255
    png(tmp_path / "color.png", grey(color))
    png(tmp_path / "mask.png", grey(mask))
    moved = "Kd 1 1 1\nmap_Kd color.png\nmap_d -o 0.5 0 0 mask.png"
    (row,) = run(obj(tmp_path / "a.obj", moved)).materials
    assert row["reflectance"]["mean"] == pytest.approx(R_230, rel=1e-12)


def test_a_mask_that_is_not_there_cuts_nothing(tmp_path: Path) -> None:
    """As the stage has it: alpha of the diffuse picture is not read where nothing asks for it."""
    png(tmp_path / "one.png", np.dstack([grey(leaf() // 255 * 230), leaf()]))
    (row,) = run(obj(tmp_path / "a.obj", "Kd 1 1 1\nmap_Kd one.png\nmap_d gone.png")).materials
    assert row["reflectance"]["mean"] == pytest.approx(R_230 / 4.0, abs=0.005)


def judged(folder: Path, opacity: Texture, uv: Any, **changes: Any) -> float:
    """Mean reflectance of code 230 on the upper left quarter of black, cut out by ``opacity``."""
    color = texture(grey(leaf((8, 8)) // 255 * 230))
    material = paint(diffuse_map=color, opacity_map=opacity, **changes)
    surface = Surface(
        diffuse=(1.0, 1.0, 1.0),
        gamma=2.2,
        diffuse_map=Map("R.exr", color, raw=True),
        opacity_map=Map("o.png", opacity, raw=True),
    )
    maps = MapWriter(folder, ".", folder, Report())
    row = Reflectances(maps.overview, Report()).row(
        material, surface, Worn(1, 1.0, uv, None), (1.0, 1.0, 1.0)
    )
    return float(row["reflectance"]["mean"])


#: The middle of each texel of 8 x 8, t up.
MIDDLES = np.stack(np.meshgrid(np.arange(8) + 0.5, np.arange(8) + 0.5), -1).reshape(-1, 2) / 8


@pytest.mark.parametrize(
    ("opacity", "changes", "share"),
    [
        ({}, {"alpha_mode": "blend"}, 1.0),
        ({}, {"alpha_mode": "mask", "alpha_cutoff": 0.5}, 1.0),
        ({}, {"alpha_mode": "mask", "alpha_cutoff": 1.0}, 1.0),  # what is at the cutoff is there
        ({}, {"alpha_mode": "mask", "alpha_cutoff": 0.0}, 0.25),  # nothing is below it
        ({"channel": "a"}, {"alpha_mode": "blend"}, 0.25),  # of no alpha 1
        ({"uv_set": "st1"}, {"alpha_mode": "blend"}, 0.25),  # which places show it is not known
        (  # the mask's white quarter covers all
            {"transform": UVTransform((0.5, 0.5), 0.0, (0.0, 0.5))},
            {"alpha_mode": "blend"},
            0.25,
        ),
    ],
)
def test_opacity_by_channel_mode_and_place(
    tmp_path: Path, opacity: dict[str, Any], changes: dict[str, Any], share: float
) -> None:
    mask = texture(grey(leaf((4, 4))), **opacity)
    mean = judged(tmp_path, mask, MIDDLES, **changes)
    assert mean == pytest.approx(R_230 * share, rel=1e-12)


def test_of_a_surface_without_coordinates_the_pictures_are_laid_over_each_other(
    tmp_path: Path,
) -> None:
    mask = texture(grey(leaf((4, 4))))
    mean = judged(tmp_path, mask, None, alpha_mode="blend")
    assert mean == pytest.approx(R_230, rel=1e-12)
