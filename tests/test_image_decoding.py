"""What of a picture file is colour, what is alpha, what is neither; and JPEG files cut short."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import numpy as np
import OpenEXR
import OpenImageIO as oiio
import pytest
from builders import obj
from converted import opened, run, surface, texture_file
from picture_files import dds, tga

from hdrusd.errors import InputError
from hdrusd.images import read_image

DATA = os.environ.get("HDRUSD_TESTDATA")
NOISE = np.random.default_rng(7).integers(0, 256, (64, 64, 3), np.uint8)


# -- channels -----------------------------------------------------------------------------


def exr(path: Path, **values: float) -> Path:
    """2 x 2 texels of one value a channel; "_" in a name stands for "."."""
    channels = {
        name.replace("_", "."): np.full((2, 2), value, np.float32) for name, value in values.items()
    }
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, channels) as file:
        file.write(str(path))
    return path


@pytest.mark.parametrize(
    ("channels", "texel", "dropped"),
    [
        ({"R": 1.0, "G": 2.0}, [1.0, 2.0, 0.0], []),  # OpenEXR fills in 0 for a colour
        ({"R": 1.0, "B": 2.0}, [1.0, 0.0, 2.0], []),
        ({"R": 1.0, "G": 2.0, "A": 0.5}, [1.0, 2.0, 0.0, 0.5], []),
        ({"R": 1.0}, [1.0], []),
        ({"R": 1.0, "A": 0.5}, [1.0, 0.5], []),
        ({"Y": 1.0, "A": 0.5}, [1.0, 0.5], []),
        ({"Y": 1.0, "Z": 9.0}, [1.0], ["Z"]),
        ({"Z": 9.0}, [9.0], []),
        ({"R": 1.0, "G": 2.0, "B": 3.0, "A": 0.5}, [1.0, 2.0, 3.0, 0.5], []),
        ({"R": 1.0, "G": 2.0, "B": 3.0, "AO": 0.3}, [1.0, 2.0, 3.0], ["AO"]),
        ({"R": 1.0, "G": 2.0, "B": 3.0, "Z": 9.0}, [1.0, 2.0, 3.0], ["Z"]),
        (
            {"R": 1.0, "G": 2.0, "B": 3.0, "A": 0.5, "AO": 0.3, "Z": 9.0},
            [1.0, 2.0, 3.0, 0.5],
            ["AO", "Z"],
        ),
        ({"R": 1.0, "G": 2.0, "B": 3.0, "spec_A": 0.3}, [1.0, 2.0, 3.0], ["spec.A"]),
        ({"d_R": 1.0, "d_G": 2.0, "d_B": 3.0, "d_A": 0.5}, [1.0, 2.0, 3.0, 0.5], []),
        ({"N_X": 1.0, "N_Y": 2.0, "N_Z": 3.0}, [1.0, 2.0, 3.0], []),
    ],
)
def test_channels_of_an_exr_go_by_their_names(
    tmp_path: Path, channels: dict[str, float], texel: list[float], dropped: list[str]
) -> None:
    found = read_image(exr(tmp_path / "a.exr", **channels))
    wanted = np.broadcast_to(np.float32(texel), (2, 2, len(texel)))
    np.testing.assert_array_equal(found.pixels, wanted)
    told = found.dropped.removeprefix("channels ").partition(":")[0]
    assert sorted(told.split(", ") if told else []) == dropped


def test_a_channel_name_that_is_no_text_can_be_told(tmp_path: Path) -> None:
    file = exr(tmp_path / "a.exr", R=1.0, G=2.0, XX=4.0, B=3.0)
    file.write_bytes(file.read_bytes().replace(b"XX\0", b"\xff\xfe\0"))
    assert read_image(file).dropped.encode() == b"channels ??: neither colour nor alpha; not read"


@pytest.mark.parametrize(
    ("extra", "channels"),
    [(0, 3), (1, 4), (2, 4)],  # TIFF 6.0, ExtraSamples: unspecified, associated, unassociated alpha
)
def test_a_fourth_sample_of_a_tiff_is_alpha_where_it_says_so(
    tmp_path: Path, extra: int, channels: int
) -> None:
    tags = [
        (256, 4, 1, 1),
        (257, 4, 1, 1),
        (258, 3, 4, 12),
        (259, 3, 1, 1),
        (262, 3, 1, 2),
        (273, 4, 1, 8),
        (277, 3, 1, 4),
        (278, 4, 1, 1),
        (279, 4, 1, 4),
        (338, 3, 1, extra),
    ]
    head = b"II*\0" + struct.pack("<I", 20) + bytes([10, 20, 30, 40]) + struct.pack("<4H", *[8] * 4)
    body = b"".join(struct.pack("<HHII", *tag) for tag in tags)
    file = tmp_path / "a.tif"
    file.write_bytes(head + struct.pack("<H", len(tags)) + body + bytes(4))
    found = read_image(file)
    assert found.pixels.shape == (1, 1, channels)
    assert found.pixels[0, 0, 0] in (10, 64)  # divided by an associated alpha: 10 * 255 / 40
    assert bool(found.dropped) == (channels == 3)


def test_grey_and_alpha_of_a_tga(tmp_path: Path) -> None:
    file = tmp_path / "a.tga"
    file.write_bytes(tga((1, 1), bytes([100, 51]), kind=3, bits=16, flags=8))
    np.testing.assert_array_equal(read_image(file).pixels, [[[100, 51]]])


def test_two_channels_of_a_dds_are_red_and_green(tmp_path: Path) -> None:
    """ATI2, also called BC5: two blocks of one channel each; here all texels are 200 and 90."""
    blocks = bytes([200, 200, *[0] * 6, 90, 90, *[0] * 6])
    file = tmp_path / "a.dds"
    file.write_bytes(dds((4, 4), blocks, letters=b"ATI2"))
    wanted = np.broadcast_to(np.uint8([200, 90, 0]), (4, 4, 3))
    np.testing.assert_array_equal(read_image(file).pixels, wanted)


@pytest.mark.parametrize(
    ("channels", "color", "said"),
    [
        ({"R": 0.5, "G": 0.25}, [0.5, 0.25, 0.0], False),
        ({"R": 0.5, "G": 0.25, "B": 0.75, "AO": 0.5}, [0.5, 0.25, 0.75], True),
    ],
)
def test_what_is_no_alpha_makes_no_surface_transparent(
    tmp_path: Path, channels: dict[str, float], color: list[float], said: bool
) -> None:
    exr(tmp_path / "a.exr", **channels)
    result = run(obj(tmp_path / "a.obj", "Kd 1 1 1\nmap_Kd a.exr"))
    made = read_image(texture_file(surface(opened(result)), "diffuseColor"))
    np.testing.assert_array_equal(made.pixels, np.broadcast_to(np.float16(color), (2, 2, 3)))
    assert ("image-channels" in result.report.codes()) == said


# -- JPEG ---------------------------------------------------------------------------------


def jpeg(path: Path, *, progressive: bool = False) -> bytes:
    spec = oiio.ImageSpec(64, 64, 3, oiio.UINT8)
    spec.attribute("jpeg:progressive", int(progressive))
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec)
    assert out.write_image(NOISE)
    out.close()
    return path.read_bytes()


def with_thumbnail(picture: bytes) -> bytes:
    """A whole JPEG within a segment of its own, as Exif has it."""
    segment = b"Exif\0\0" + picture
    head = b"\xff\xe1" + struct.pack(">H", len(segment) + 2)
    return picture[:2] + head + segment + picture[2:]


@pytest.mark.parametrize("progressive", [False, True])
@pytest.mark.parametrize("thumbnail", [False, True])
@pytest.mark.parametrize("share", [0.55, 0.75, 0.98, "end"])
def test_a_jpeg_that_is_cut_short_is_broken(
    tmp_path: Path, share: float | str, thumbnail: bool, progressive: bool
) -> None:
    """ITU-T T.81, B.2.1: a picture ends in EOI. What is missing would be made up, grey."""
    file = tmp_path / "a.jpg"
    data = jpeg(file, progressive=progressive)
    data = with_thumbnail(data) if thumbnail else data
    file.write_bytes(data)
    assert read_image(file).pixels.shape == (64, 64, 3)
    file.write_bytes(data[:-2] if isinstance(share, str) else data[: int(share * len(data))])
    with pytest.raises(InputError, match="want a whole file"):
        read_image(file)
    with pytest.raises(InputError, match="broken image"):
        read_image(Path("a.jpg"), file.read_bytes())


@pytest.mark.parametrize("fill", ["zeros", "another end"])
def test_a_jpeg_with_a_part_that_is_not_there_is_broken(tmp_path: Path, fill: str) -> None:
    file = tmp_path / "a.jpg"
    data = jpeg(file)
    half = len(data) // 2
    file.write_bytes(data[:half] + (bytes(half) if fill == "zeros" else b"\xff\xd9"))
    with pytest.raises(InputError, match="broken image") as caught:
        read_image(Path("b.jpg"), file.read_bytes())
    assert "tmp" not in str(caught.value)


@pytest.mark.parametrize("after", [b"\0", b"film", "itself", "half"])
def test_what_follows_the_end_of_a_jpeg_is_nothing_to_it(
    tmp_path: Path, after: bytes | str
) -> None:
    """Padding, the film of a moving photo, the pictures of MPF (CIPA DC-007)."""
    file = tmp_path / "a.jpg"
    data = jpeg(file)
    wanted = read_image(file).pixels
    more = after if isinstance(after, bytes) else data if after == "itself" else data[:2000]
    file.write_bytes(data + more)
    np.testing.assert_array_equal(read_image(file).pixels, wanted)


def test_many_empty_segments_of_a_jpeg_are_not_gone_through(tmp_path: Path) -> None:
    file = tmp_path / "a.jpg"
    data = jpeg(file)
    file.write_bytes(data[:2] + b"\xff\xfe\0\2" * 70_000 + data[2:])
    with pytest.raises(InputError, match="broken image"):
        read_image(file)


@pytest.mark.skipif(DATA is None, reason="HDRUSD_TESTDATA names no test data")
def test_every_real_jpeg_is_whole() -> None:
    root = Path(str(DATA)) / "data"
    files = [p for p in root.rglob("*") if p.suffix.lower() in (".jpg", ".jpeg")]
    assert len(files) > 10
    for file in files:
        read_image(file)
