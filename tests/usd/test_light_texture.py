"""Textured rectangles: tiles whose sum is the picture, and the way that it lies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from builders import light_row, new_stage, png
from pxr import Sdf, Usd, UsdLux

from hdrusd.images import write_exr
from hdrusd.photometry.area import rect_illuminance
from hdrusd.report import Report
from hdrusd.scene import RECT, Camera, ImageData
from hdrusd.usd.extract import StageReader
from hdrusd.usd.light_texture import TILES, LightTextures, picture

rng = np.random.default_rng(7)


def image(pixels: np.ndarray) -> ImageData:
    return ImageData(pixels, integers=pixels.dtype == np.uint8)


def panel() -> np.ndarray:
    return light_row(10.0, shape=RECT, x=[2.0, 0, 0], y=[0, 0.5, 0], position=[1.0, 2.0, 3.0])


def test_a_picture_of_few_pixels_has_a_tile_for_each() -> None:
    texels = rng.uniform(0, 5, (2, 3, 3)).astype(np.float32)
    rows = picture("a.exr", image(texels)).tiles(panel())
    assert len(rows) == 6
    assert rows["intensity"] == pytest.approx(10.0 / 6.0 * texels.reshape(6, 3), rel=1e-6)
    # Row by row from +X +Y: the top left as seen from the side that shines.
    wanted = [[1 + 2 * dx, 2 + 0.5 * dy, 3] for dy in (0.5, -0.5) for dx in (2 / 3, 0, -2 / 3)]
    assert rows["position"] == pytest.approx(np.array(wanted))
    assert rows["x"] == pytest.approx(np.tile([2 / 3, 0, 0], (6, 1)))
    assert rows["y"] == pytest.approx(np.tile([0, 0.25, 0], (6, 1)))
    assert len(set(rows["key"])) == 6


@pytest.mark.parametrize("shape", [(37, 19), (8, 8), (1, 100), (5, 640)])
def test_tiles_give_the_candela_of_all_texels(shape: tuple[int, int]) -> None:
    texels = rng.uniform(0, 5, (*shape, 3)).astype(np.float32)
    rows = picture("a.exr", image(texels)).tiles(panel())
    assert len(rows) == min(shape[0], TILES) * min(shape[1], TILES)
    mean = texels.astype(np.float64).mean(axis=(0, 1))
    assert rows["intensity"].sum(axis=0) == pytest.approx(10.0 * mean, rel=1e-12)
    areas = np.linalg.norm(np.cross(rows["x"], rows["y"]), axis=1)
    assert areas.sum() == pytest.approx(1.0)


def test_tiles_of_copies() -> None:
    both = np.concatenate([panel(), panel()])
    both["position"][1] += 10.0
    tiles = picture("a.exr", image(np.ones((2, 2, 3), np.float32))).tiles(both)
    assert tiles["position"][4:] == pytest.approx(tiles["position"][:4] + 10.0)


def test_a_white_picture_changes_nothing() -> None:
    whole, tiles = panel(), picture("a", image(np.full((9, 9, 3), 255, np.uint8))).tiles(panel())
    p, n = np.array([0.3, 0.1, 0.4]), np.array([0.0, 0.0, 1.0])

    def lux(row: np.void) -> float:
        to = row["position"] - (whole["position"][0] - p)
        found = rect_illuminance(to, n, row["axis"], row["x"], row["y"])
        return float(found * row["intensity"][0])

    assert sum(map(lux, tiles)) == pytest.approx(lux(whole[0]), rel=1e-12)


def test_codes_of_pictures_are_raised_to_2_2_and_grey_is_not() -> None:
    code = np.full((1, 1, 3), 128, np.uint8)
    assert picture("a", image(code)).means[0, 0] == pytest.approx((128 / 255) ** 2.2)
    assert picture("a", image(code[..., :1])).means[0, 0] == pytest.approx(128 / 255)
    assert picture("a", image(np.full((1, 1, 3), 2.5, np.float16))).means[0, 0] == pytest.approx(
        2.5
    )


def test_broken_texels_are_dark() -> None:
    texels = np.array([[[np.nan, -1.0, np.inf], [1.0, 1.0, 1.0]]], np.float32)
    assert picture("a", image(texels)).means[0].tolist() == [[0, 0, 0], [1, 1, 1]]


def lit(folder: Path, name: str) -> tuple[Usd.Prim, Report, LightTextures]:
    stage = new_stage()
    light = UsdLux.RectLight.Define(stage, "/Panel")
    light.CreateTextureFileAttr(Sdf.AssetPath(str(folder / name)))
    report = Report()
    return light.GetPrim(), report, LightTextures(stage, report)


def test_files(tmp_path: Path) -> None:
    png(tmp_path / "a.png", np.full((2, 2, 3), 255, np.uint8))
    prim, report, textures = lit(tmp_path, "a.png")
    found = textures.of(prim, Usd.TimeCode(0))
    assert found is not None
    assert found.means == pytest.approx(np.ones((2, 2, 3)))
    assert found.texture.texture.file == str(tmp_path / "a.png")
    write_exr(tmp_path / "b.exr", np.full((1, 1, 3), 40.0, np.float32))
    prim, report, textures = lit(tmp_path, "b.exr")
    found = textures.of(prim, Usd.TimeCode(0))
    assert found is not None
    assert found.means.tolist() == [[[40.0] * 3]]
    assert not report.codes()


@pytest.mark.parametrize("content", [None, b"no picture"])
def test_a_missing_or_broken_file_is_told(tmp_path: Path, content: bytes | None) -> None:
    if content is not None:
        (tmp_path / "a.png").write_bytes(content)
    prim, report, textures = lit(tmp_path, "a.png")
    assert textures.of(prim, Usd.TimeCode(0)) is None
    assert textures.of(prim, Usd.TimeCode(1)) is None
    assert [f.code for f in report] == ["light-texture"]


def test_the_gamma_is_the_renderer_s(tmp_path: Path) -> None:
    stage = new_stage()
    light = UsdLux.RectLight.Define(stage, "/Panel")
    png(tmp_path / "a.png", np.full((2, 2, 3), 128, np.uint8))
    light.CreateTextureFileAttr(Sdf.AssetPath(str(tmp_path / "a.png")))
    reader = StageReader(stage, Report(), gamma=1.0)
    rows = reader.read(0.0, Camera()).lights
    assert rows["intensity"].sum(axis=0) == pytest.approx([128 / 255] * 3)
