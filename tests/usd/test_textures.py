"""The loader of texture files: tiles, limits, and what it says."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from builders import png

from hdrusd.images import write_exr
from hdrusd.report import Report
from hdrusd.scene import ImageData, TextureRef
from hdrusd.usd import textures
from hdrusd.usd.textures import TextureLoader, texture_size


def grey(code: int, side: int = 2) -> npt.NDArray[np.uint8]:
    return np.full((side, side, 3), code, np.uint8)


def load(file: Path | str, report: Report, **options: int) -> ImageData | None:
    loader = TextureLoader(Path("s.usda"), report, **options)
    image = loader(TextureRef(str(file), "auto"))
    loader.publish()
    return image


def test_tiles_by_column_and_row(tmp_path: Path) -> None:
    """1001 + u + 10 v; u to 9."""
    for number, code in ((1001, 10), (1002, 20), (1011, 30), (1012, 40)):
        png(tmp_path / f"a.{number}.png", grey(code))
    report = Report()
    image = load(tmp_path / "a.<UDIM>.png", report)
    assert image is not None
    assert image.tiles is not None
    codes = {place: int(tile.pixels[0, 0, 0]) for place, tile in image.tiles.items()}
    assert codes == {(0, 0): 10, (1, 0): 20, (0, 1): 30, (1, 1): 40}
    assert image.integers
    assert not report.codes()


@pytest.mark.parametrize("name", ["wood[1].png", "wood [old].<UDIM>.png", "[a]/wood.png"])
def test_a_bracket_in_a_files_name_makes_no_package_of_it(tmp_path: Path, name: str) -> None:
    png(tmp_path / name.replace("<UDIM>", "1001"), grey(10))
    report = Report()
    image = load(tmp_path / name, report)
    assert image is not None
    whole = image if image.tiles is None else image.tiles[0, 0]
    assert whole.pixels.tolist() == grey(10).tolist()
    assert not report.codes()


def test_missing_tiles_are_said(tmp_path: Path) -> None:
    png(tmp_path / "a.1001.png", grey(10))
    png(tmp_path / "a.1013.png", grey(10))
    (tmp_path / "a.1003.png").write_bytes(b"no picture")
    report = Report()
    image = load(tmp_path / "a.<UDIM>.png", report)
    assert image is not None
    assert image.tiles is not None
    assert set(image.tiles) == {(0, 0), (2, 1)}
    assert report.codes() == {"texture-tiles", "texture-unreadable"}
    assert "no tile 1002, 1003, 1011, 1012" in "".join(map(str, report))


def test_no_tile_at_all(tmp_path: Path) -> None:
    report = Report()
    png(tmp_path / "a.1101.png", grey(1))  # past the last number
    assert load(tmp_path / "a.<UDIM>.png", report) is None
    assert report.codes() == {"texture-unreadable"}


def test_a_texture_past_the_devices_limit_is_halved(tmp_path: Path) -> None:
    png(tmp_path / "a.png", np.zeros((8, 40, 3), np.uint8))
    report = Report()
    image = load(tmp_path / "a.png", report, max_size=16)
    assert image is not None
    assert image.halvings == 2  # 40, 20, 10
    assert report.codes() == {"texture-shrunk"}
    assert "1/4" in str(next(iter(report)))


def test_a_texture_of_too_many_texels_is_halved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(textures, "MAX_TEXELS", 100)
    png(tmp_path / "a.png", np.zeros((20, 20, 3), np.uint8))
    image = load(tmp_path / "a.png", Report())
    assert image is not None
    assert image.halvings == 1


def test_what_goes_to_the_device() -> None:
    """Mirrors are texels, black is a frame of one texel, tiles have one too."""
    picture = ImageData(np.zeros((3, 5, 1), np.uint8))
    assert texture_size(TextureRef("", "auto", "repeat", "clamp"), picture) == (5, 3)
    assert texture_size(TextureRef("", "auto", "mirror", "black"), picture) == (10, 5)
    tiled = ImageData(picture.pixels, tiles={(1, 0): picture, (3, 0): picture})
    assert texture_size(TextureRef("", "auto"), tiled) == (17, 5)


def test_what_is_not_finite_is_dark(tmp_path: Path) -> None:
    values = np.array([[[1.0, np.nan, np.inf], [2.0, 3.0, 4.0]]], np.float32)
    with np.errstate(invalid="ignore"):
        write_exr(tmp_path / "a.exr", values)
    report = Report()
    image = load(tmp_path / "a.exr", report)
    assert image is not None
    assert np.isfinite(image.pixels).all()
    assert image.pixels[0, 0, 1] == 0.0
    assert report.codes() == {"texture-not-finite"}


def test_findings_are_in_the_order_of_names(tmp_path: Path) -> None:
    report = Report()
    loader = TextureLoader(tmp_path / "s.usda", report)
    refs = [TextureRef(str(tmp_path / f"{name}.png"), "auto") for name in "dbacdbac"]
    with ThreadPoolExecutor(2) as pool:
        assert set(pool.map(loader, refs)) == {None}
    assert len(report) == 0
    loader.publish()
    assert [finding.thing for finding in report] == ["a.png", "b.png", "c.png", "d.png"]
