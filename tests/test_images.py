"""Frames and textures on disk: exact numbers, honest headers, whole files or none."""

from __future__ import annotations

import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import OpenImageIO as oiio
import pytest

from hdrusd.errors import HdrusdError, InputError
from hdrusd.images import (
    half_clipped,
    read_exr,
    read_image,
    write_atomically,
    write_exr,
    write_png,
)

#: Every kind of float32: denormal, tiny, the eye's range, the sun, the largest.
EXTREMES = np.array([0, 1e-45, 1e-38, 3.2e-6, 1 / 3, 0.18, 65504, 65520, 1.6e9, 3.4e38], np.float32)


def frame() -> np.ndarray:
    rng = np.random.default_rng(3)
    rgb = rng.lognormal(0.0, 5.0, (9, 14, 3)).astype(np.float32)
    rgb.reshape(-1)[: EXTREMES.size] = EXTREMES
    return rgb


# -- EXR --------------------------------------------------------------------------------------


def test_float32_comes_back_bit_for_bit(tmp_path: Path) -> None:
    rgb = frame()
    write_exr(tmp_path / "a.exr", rgb)
    got, _ = read_exr(tmp_path / "a.exr")
    assert got.dtype == np.float32
    np.testing.assert_array_equal(got, rgb)


def test_openimageio_reads_the_same_numbers(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", frame())
    picture = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    spec = picture.spec()
    assert str(spec.format) == "float"
    assert list(spec.channelnames) == ["R", "G", "B"]
    np.testing.assert_array_equal(picture.read_image(oiio.FLOAT), frame())
    assert spec.get_float_attribute("whiteLuminance") == 1.0
    primaries = spec.getattribute("chromaticities")
    np.testing.assert_allclose(
        primaries, [0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290], rtol=1e-6
    )
    picture.close()


def test_header_by_openexr(tmp_path: Path) -> None:
    """SMPTE ST 2065-4 and OpenEXR's standard attributes: 1.0 is 1 cd/m2, Rec. 709, D65."""
    matrix = np.arange(16, dtype=np.float32).reshape(4, 4)
    write_exr(tmp_path / "a.exr", frame(), {"worldToCamera": matrix, "hdrusd:camera": "/Cam"})
    with OpenEXR.File(str(tmp_path / "a.exr"), header_only=True) as file:
        header = dict(file.header())
    assert header["whiteLuminance"] == 1.0
    np.testing.assert_allclose(
        header["chromaticities"], [0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290], rtol=1e-6
    )
    np.testing.assert_array_equal(header["worldToCamera"], matrix)
    assert header["hdrusd:camera"] == "/Cam"


def test_maps_do_not_claim_a_luminance(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", frame(), luminance=False)
    assert "whiteLuminance" not in read_exr(tmp_path / "a.exr")[1]


def test_half_floats_end_at_65504(tmp_path: Path) -> None:
    """IEEE 754 binary16. 65519 would still round down to it, 65520 to infinity."""
    rgb = np.zeros((1, 4, 3), np.float32)
    rgb[0, :, 0] = [0.25, 65504.0, 65520.0, 1.6e9]
    rgb[0, 3, 1] = -1e6
    write_exr(tmp_path / "a.exr", rgb, half=True)
    got, _ = read_exr(tmp_path / "a.exr")
    np.testing.assert_array_equal(got[0, :, 0], [0.25, 65504.0, 65504.0, 65504.0])
    assert got[0, 3, 1] == -65504.0
    assert half_clipped(rgb) == 2
    assert half_clipped(rgb[:, :2]) == 0


def test_white_luminance_scales(tmp_path: Path) -> None:
    """A file with white at 100 cd/m2 holds 0.18 where 18 cd/m2 are."""
    write_exr(tmp_path / "a.exr", np.full((2, 2, 3), 0.18), {"whiteLuminance": 100.0})
    np.testing.assert_allclose(read_exr(tmp_path / "a.exr")[0], 18.0, rtol=1e-6)


@pytest.mark.parametrize("white", [0.0, -1.0, float("inf"), float("nan")])
def test_absurd_white_luminance_is_refused(tmp_path: Path, white: float) -> None:
    write_exr(tmp_path / "a.exr", frame(), {"whiteLuminance": white})
    with pytest.raises(InputError, match="whiteLuminance"):
        read_exr(tmp_path / "a.exr")


def exr_of(path: Path, channels: dict[str, np.ndarray]) -> Path:
    header: dict[str, Any] = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, channels) as file:
        file.write(str(path))
    return path


def test_grey_frames_are_spread(tmp_path: Path) -> None:
    grey = np.full((2, 3), 7.0, np.float32)
    got, _ = read_exr(exr_of(tmp_path / "a.exr", {"Y": grey}))
    np.testing.assert_array_equal(got, np.full((2, 3, 3), 7.0))


def test_frames_without_colour_are_refused(tmp_path: Path) -> None:
    depth = exr_of(tmp_path / "a.exr", {"Z": np.zeros((2, 3), np.float32)})
    with pytest.raises(InputError, match="channels Z; want R, G, B or Y"):
        read_exr(depth)


def test_truncated_and_other_files_are_refused(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", frame())
    whole = (tmp_path / "a.exr").read_bytes()
    for name, data in {"empty.exr": b"", "text.exr": b"hello", "cut.exr": whole[:200]}.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(InputError, match=name) as problem:
            read_exr(tmp_path / name)
        assert "\n" not in str(problem.value)
    with pytest.raises(InputError, match="no such file"):
        read_exr(tmp_path / "none.exr")


def declared(path: Path, side: int) -> Path:
    """A tiny EXR whose header says side x side."""
    write_exr(path, np.zeros((4, 4, 3), np.float32))
    data = path.read_bytes()
    for name in (b"dataWindow\0box2i\0", b"displayWindow\0box2i\0"):
        at = data.index(name) + len(name) + 4
        data = data[:at] + struct.pack("<4i", 0, 0, side - 1, side - 1) + data[at + 16 :]
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("side", [15_000, 100_000])
def test_declared_sizes_of_frames_are_not_believed(tmp_path: Path, side: int) -> None:
    with pytest.raises(InputError, match=f"{side} x {side} pixels"):
        read_exr(declared(tmp_path / "a.exr", side))


# -- whole files or none ----------------------------------------------------------------------


def test_failure_leaves_nothing(tmp_path: Path) -> None:
    target = tmp_path / "a.exr"
    target.write_bytes(b"before")

    def fail(temporary: Path) -> None:
        temporary.write_bytes(b"half a fi")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_atomically(target, fail)
    assert target.read_bytes() == b"before"
    assert [path.name for path in tmp_path.iterdir()] == ["a.exr"]


def test_missing_folders_are_made(tmp_path: Path) -> None:
    write_png(tmp_path / "a/b/c.png", np.zeros((2, 2, 3), np.uint8))
    assert (tmp_path / "a/b/c.png").is_file()


_FULL_DISK = """
import resource, signal, sys
from pathlib import Path
import numpy as np
from hdrusd.images import write_exr, write_png
from hdrusd.errors import HdrusdError
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
noise = np.random.default_rng(0).integers(0, 255, (200, 200, 3))
try:
    if sys.argv[1].endswith("png"):
        write_png(Path(sys.argv[1]), noise.astype(np.uint8))
    else:
        write_exr(Path(sys.argv[1]), noise.astype(np.float32))
except (HdrusdError, OSError) as problem:
    print("refused:", problem)
"""


@pytest.mark.parametrize("name", ["a.exr", "a.png"])
def test_full_disk_leaves_nothing(tmp_path: Path, name: str) -> None:
    """A file size limit stands in for a full disk."""
    target = tmp_path / name
    run = subprocess.run(
        [sys.executable, "-c", _FULL_DISK, str(target)], capture_output=True, text=True, check=True
    )
    assert run.stdout.startswith(f"refused: {target}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("write", [write_exr, write_png])
def test_folder_that_takes_no_files(tmp_path: Path, write: Any) -> None:
    (tmp_path / "file").write_text("not a folder")
    kind = np.uint8 if write is write_png else np.float32
    with pytest.raises((OSError, HdrusdError)):
        write(tmp_path / "file" / "a.exr", np.zeros((2, 2, 3), kind))


# -- PNG and textures -------------------------------------------------------------------------


def test_png_comes_back_bit_for_bit(tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (5, 7, 3)).astype(np.uint8)
    write_png(tmp_path / "a.png", pixels)
    np.testing.assert_array_equal(read_image(tmp_path / "a.png").pixels, pixels)
    np.testing.assert_array_equal(
        read_image(Path("in/a.usdz[a.png]"), (tmp_path / "a.png").read_bytes()).pixels, pixels
    )


def test_16_bit_pictures_keep_their_steps(tmp_path: Path) -> None:
    codes = np.array([[[0], [1], [257], [65535]]], np.uint16)
    spec = oiio.ImageSpec(4, 1, 1, oiio.UINT16)
    out = oiio.ImageOutput.create(str(tmp_path / "a.png"))
    out.open(str(tmp_path / "a.png"), spec)
    out.write_image(codes)
    out.close()
    got = read_image(tmp_path / "a.png").pixels
    np.testing.assert_allclose(got[..., 0], codes[..., 0] / 65535.0, rtol=1e-6)


@pytest.mark.parametrize("suffix", ["png", "tga", "tif"])
def test_colours_are_not_multiplied_by_alpha(tmp_path: Path, suffix: str) -> None:
    """UsdPreviewSurface textures hold straight alpha: a leaf does not darken towards its rim."""
    pixels = np.full((1, 4, 4), 200, np.uint8)
    pixels[0, :, 3] = [255, 128, 1, 0]
    file = tmp_path / f"a.{suffix}"
    spec = oiio.ImageSpec(4, 1, 4, oiio.UINT8)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    out = oiio.ImageOutput.create(str(file))
    out.open(str(file), spec)
    out.write_image(pixels)
    out.close()
    np.testing.assert_array_equal(read_image(file).pixels, pixels)


def test_rgba_maps_keep_colour_beside_alpha(tmp_path: Path) -> None:
    rgba = np.full((2, 2, 4), 0.5, np.float32)
    rgba[..., 3] = 0.25
    write_exr(tmp_path / "map.exr", rgba, half=True, luminance=False)
    np.testing.assert_array_equal(read_image(tmp_path / "map.exr").pixels, rgba)


@pytest.mark.parametrize("shape", [(1, 1), (8, 8), (9, 17), (3, 40), (40, 3)])
def test_tiles_hold_the_same_texels(tmp_path: Path, shape: tuple[int, int]) -> None:
    rgb = np.random.default_rng(1).random((*shape, 3)).astype(np.float16)
    path = tmp_path / "map.exr"
    write_exr(path, rgb, half=True, luminance=False, compression="piz", tile=8)
    np.testing.assert_array_equal(read_image(path).pixels, rgb)
    np.testing.assert_array_equal(read_exr(path)[0], rgb)
    spec = oiio.ImageInput.open(str(path)).spec()
    assert (spec.tile_height, spec.tile_width) == (min(shape[0], 8), min(shape[1], 8))


def test_broken_pictures_are_refused_in_one_line(tmp_path: Path) -> None:
    write_png(tmp_path / "a.png", np.zeros((64, 64, 3), np.uint8))
    whole = (tmp_path / "a.png").read_bytes()
    for name, data in {"empty.png": b"", "text.jpg": b"hello", "cut.png": whole[:60]}.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(InputError, match=name) as problem:
            read_image(tmp_path / name)
        assert "\n" not in str(problem.value)


_LIMITED = """
import resource, sys
from pathlib import Path
from hdrusd.errors import InputError
from hdrusd.images import read_image
used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try:
    read_image(Path(sys.argv[1]))
except InputError as problem:
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - used
    print(grown // 1024, problem)
"""


@pytest.mark.parametrize("name", ["huge_dims.png", "huge_dims.rgb", "huge_dims.tga"])
def test_declared_sizes_of_textures_are_not_believed(testdata: Path, name: str) -> None:
    """Refused before their memory is asked for: 64 MiB is what the libraries may take."""
    run = subprocess.run(
        [sys.executable, "-c", _LIMITED, str(testdata / "data" / "hostile" / name)],
        capture_output=True,
        text=True,
        check=True,
    )
    grown, _, message = run.stdout.partition(" ")
    assert name in message
    assert int(grown) < 64
