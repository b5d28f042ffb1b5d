"""Pictures in floats hold light, not codes: what the look shows of them, and what is said."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest
from builders import obj
from converted import opened, run, surface, texture_file, texture_node

from hdrusd.conversion import Result
from hdrusd.images import read_exr, read_image, write_exr

#: Linear values and their codes by IEC 61966-2-1: 255 (1.055 L^(1/2.4) - 0.055), and
#: 255 12.92 L up to 0.0031308; 0.5 is 187.52, 0.18 is 117.64, 0.0025 is 8.24.
LIGHT = [0.0, 0.0025, 0.18, 0.5, 1.0]
CODES = [0, 8, 118, 188, 255]


def floats(path: Path, pixels: npt.ArrayLike) -> Path:
    """A picture of 32-bit floats, (w, channels), alpha not multiplied in."""
    row = np.asarray(pixels, np.float32)[None]
    spec = oiio.ImageSpec(row.shape[1], 1, row.shape[2], oiio.FLOAT)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    assert out.write_image(row), out.geterror()
    out.close()
    return path


def grey(values: Any) -> npt.NDArray[np.float64]:
    return np.repeat(np.asarray(values, np.float64)[:, None], 3, axis=1)


def convert(path: Path, mtl: str = "map_Kd {}") -> Result:
    """An OBJ file beside a picture whose material wears it; D = 1."""
    return run(obj(path.with_name("wall.obj"), f"Kd 1 1 1\n{mtl.format(path.name)}"))


def look(result: Result) -> Any:
    """The surface with the photometry muted."""
    stage = opened(result)
    stage.MuteLayer(stage.GetRootLayer().ComputeAbsolutePath("wall.photometry.usda"))
    return surface(stage)


@pytest.mark.parametrize("name", ["a.tif", "a.hdr"])
def test_the_look_of_light_is_coded_by_the_curve_that_it_is_marked_with(
    tmp_path: Path, name: str
) -> None:
    result = convert(floats(tmp_path / name, grey(LIGHT)))
    shown = look(result)
    node = texture_node(shown, "diffuseColor")
    assert node is not None
    assert node.GetInput("sourceColorSpace").Get() == "sRGB"
    pixels = read_image(texture_file(shown, "diffuseColor")).pixels
    # RGBE holds 0.0025 and 0.18 to 1/256; no code is that near to the next one.
    assert pixels.tolist() == [[[code] * 3 for code in CODES]]
    assert "look-clipped" not in result.report.codes()


def test_alpha_beside_floats(tmp_path: Path) -> None:
    pixels = np.concatenate([grey(LIGHT), np.array([0.0, 0.25, 0.5, 0.75, 1.0])[:, None]], axis=1)
    result = convert(floats(tmp_path / "a.tif", pixels))
    made = read_image(texture_file(look(result), "diffuseColor")).pixels[0]
    assert made[:, :3].tolist() == [[code] * 3 for code in CODES]
    assert made[:, 3].tolist() == [0, 64, 128, 191, 255]


def test_grey_floats(tmp_path: Path) -> None:
    result = convert(floats(tmp_path / "grey.tif", np.array(LIGHT)[:, None]))
    assert read_image(texture_file(look(result), "diffuseColor")).pixels[0, :, 0].tolist() == CODES


def test_light_above_white_is_clipped_in_the_look_and_told(tmp_path: Path) -> None:
    result = convert(floats(tmp_path / "a.hdr", grey([0.5, 1.0, 4.0, 0.0])))
    made = read_image(texture_file(look(result), "diffuseColor")).pixels[0]
    assert made[:, 0].tolist() == [188, 255, 255, 0]
    (finding,) = [f for f in result.report if f.code == "look-clipped"]
    assert finding.thing == "a.hdr"
    assert "1 of 4 texels, up to 4" in finding.text


def test_exr_is_copied_as_it_is_and_marked_as_linear(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    write_exr(path, np.asarray(grey([0.5, 4.0])[None], np.float32), luminance=False)
    shown = look(convert(path))
    node = texture_node(shown, "diffuseColor")
    assert node is not None
    assert node.GetInput("sourceColorSpace").Get() == "raw"
    assert texture_file(shown, "diffuseColor").read_bytes() == path.read_bytes()


def test_opacity_in_floats_is_no_light(tmp_path: Path) -> None:
    path = floats(tmp_path / "a.tif", np.array([0.25, 0.5])[:, None])
    shown = look(convert(path, "map_d {}"))
    node = texture_node(shown, "opacity")
    assert node is not None
    assert node.GetInput("sourceColorSpace").Get() == "raw"
    rgb, _ = read_exr(texture_file(shown, "opacity"))
    assert rgb[0, :, 0].tolist() == [0.25, 0.5]
