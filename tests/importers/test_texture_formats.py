"""Textures of every format come through convert with their texels, the right way up."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import obj
from converted import opened, run, sidecar, surface, texture_file
from osg_builder import (
    HEADER,
    coordinates,
    geode,
    geometry,
    group,
    inlined,
    state_set,
    texture,
)
from picture_files import (
    BLOCK,
    BLOCK_ROW,
    CLEAR_BLOCK,
    bmp,
    dds,
    png,
    png_chunk,
    sgi,
    tga,
    tiff,
)

from hdrusd.convert import Result
from hdrusd.images import read_exr, read_image
from hdrusd.job import Job
from hdrusd.render import render_sequence
from hdrusd.report import Report

A, B, C, D = (10, 20, 30), (40, 50, 60), (70, 80, 90), (200, 210, 220)
SQUARE = [[A, B], [C, D]]  # the top row first
RED, GREEN, BLUE = (255, 0, 0), (0, 255, 0), (0, 0, 255)
TWO = (2, 2)


def swapped(*texels: tuple[int, ...]) -> bytes:
    """Blue, green, red, alpha."""
    return b"".join(bytes([*texel[2::-1], *texel[3:]]) for texel in texels)


def plain(*texels: tuple[int, ...]) -> bytes:
    """Texels one after the other."""
    return bytes(value for texel in texels for value in texel)


def planes(*texels: tuple[int, ...]) -> list[bytes]:
    """A plane a channel."""
    return [bytes(channel) for channel in zip(*texels, strict=True)]


def clear(row: list[tuple[int, ...]], *alphas: int) -> list[tuple[int, ...]]:
    """Texels with alpha."""
    return [(*texel, alpha) for texel, alpha in zip(row, alphas, strict=True)]


OPAQUE = clear(BLOCK_ROW, 255, 255, 255, 255)
#: Alpha of 4 bits, 0 to 3 in the first row, of which each is n / 15 of 255.
ALPHA_4 = struct.pack("<Q", 0x3210)
#: Alpha between 255 and 0 in sevenths; codes 0, 1, 2 and 7: all, none, 6/7 and 1/7.
ALPHA_8 = bytes([255, 0]) + (0o7210).to_bytes(6, "little")

#: File to the first row of its texels, or all rows.
FILES: dict[str, tuple[bytes, list[Any]]] = {
    "dxt1.dds": (dds((4, 4), BLOCK, letters=b"DXT1"), [OPAQUE]),
    "cut.dds": (
        dds((4, 4), CLEAR_BLOCK, letters=b"DXT1"),
        [[(*BLUE, 255), (*RED, 255), (128, 0, 128, 255), (0, 0, 0, 0)]],
    ),
    "dxt3.dds": (dds((4, 4), ALPHA_4 + BLOCK, letters=b"DXT3"), [clear(BLOCK_ROW, 0, 17, 34, 51)]),
    "dxt5.dds": (
        dds((4, 4), ALPHA_8 + BLOCK, letters=b"DXT5"),
        [clear(BLOCK_ROW, 255, 0, 218, 36)],  # 6/7 of 255 is 218.6, 1/7 is 36.4, cut off
    ),
    "levels.dds": (dds((4, 4), BLOCK + CLEAR_BLOCK * 2, letters=b"DXT1", levels=3), [OPAQUE]),
    "odd.dds": (dds((3, 1), BLOCK, letters=b"DXT1"), [OPAQUE[:3]]),
    "rgba.dds": (
        dds((2, 1), swapped((*A, 7), (*B, 8)), masks=(32, 255 << 16, 255 << 8, 255, 255 << 24)),
        [[(*A, 7), (*B, 8)]],
    ),
    "rgb.dds": (
        dds(TWO, swapped(A, B, C, D), masks=(24, 255 << 16, 255 << 8, 255, 0)),
        SQUARE,
    ),
    "565.dds": (
        dds((2, 1), struct.pack("<HH", 0xF800, 0x07E0), masks=(16, 0xF800, 0x07E0, 0x1F, 0)),
        [[RED, GREEN]],
    ),
    "wall.rgb": (sgi(TWO, planes(C, D, A, B)), SQUARE),
    "packed.rgb": (sgi(TWO, planes(C, D, A, B), packed=True), SQUARE),
    "wall.rgba": (
        sgi((2, 1), planes((*A, 7), (*B, 8))),
        [[(*A, 7), (*B, 8)]],
    ),
    "wall.bw": (sgi((1, 2), [bytes([9, 200])]), [[(200,)], [(9,)]]),
    "wall.int": (sgi((2, 1), [bytes([9, 200])]), [[(9,), (200,)]]),
    "wall.inta": (sgi((2, 1), planes((9, 1), (200, 2))), [[(9, 1), (200, 2)]]),
    "misnamed.int": (png((2, 1), b"\0" + plain(A, B)), [[A, B]]),
    "up.tga": (tga(TWO, swapped(C, D, A, B)), SQUARE),
    "down.tga": (tga(TWO, swapped(A, B, C, D), flags=0x20), SQUARE),
    "packed.tga": (  # a run of two, then two as they are
        tga(TWO, bytes([0x81]) + swapped(C) + bytes([0x01]) + swapped(A, B), kind=10),
        [[A, B], [C, C]],
    ),
    "alpha.tga": (
        tga((2, 1), swapped((*A, 7), (*B, 8)), bits=32, flags=0x28),
        [[(*A, 7), (*B, 8)]],
    ),
    "palette.tga": (
        tga((2, 1), bytes([1, 0]), kind=1, bits=8, palette=swapped(A, B)),
        [[B, A]],
    ),
    "grey.tga": (tga((2, 1), bytes([9, 200]), kind=3, bits=8), [[(9,), (200,)]]),
    "up.bmp": (bmp(TWO, swapped(C, D) + bytes(2) + swapped(A, B) + bytes(2)), SQUARE),
    "down.bmp": (bmp((2, -2), swapped(A, B) + bytes(2) + swapped(C, D) + bytes(2)), SQUARE),
    "palette.bmp": (
        bmp((2, 1), bytes([1, 0, 0, 0]), bits=8, palette=swapped((*A, 0), (*B, 0))),
        [[B, A]],
    ),
    "wall.tif": (tiff(TWO, plain(A, B, C, D)), SQUARE),
    "alpha.tif": (tiff((2, 1), plain((*A, 7), (*B, 8)), channels=4), [[(*A, 7), (*B, 8)]]),
    "wall.png": (png(TWO, b"\0" + plain(A, B) + b"\0" + plain(C, D)), SQUARE),
    "palette.png": (
        png((2, 1), b"\0\1\0", kind=3, more=png_chunk(b"PLTE", plain(A, B))),
        [[B, A]],
    ),
    "clear.png": (
        png(
            (2, 1), b"\0\1\0", kind=3,
            more=png_chunk(b"PLTE", plain(A, B)) + png_chunk(b"tRNS", bytes([7])),
        ),
        [[(*B, 255), (*A, 7)]],
    ),
    "bits.png": (
        png((3, 1), b"\0\xa0", bits=1, kind=3, more=png_chunk(b"PLTE", plain(A, B))),
        [[B, A, B]],
    ),
    "grey.png": (png((2, 1), b"\0\x09\xc8", kind=0), [[(9,), (200,)]]),
}  # fmt: skip


def look(result: Result) -> np.ndarray:
    """The picture beside the stage, as it was."""
    (name,) = [name for name, made in result.textures.items() if made["kind"] == "look"]
    return read_image(result.output.parent / f"{result.output.stem}.textures" / name).pixels


def reflectance(result: Result) -> np.ndarray:
    """The reflectance map (h, w, 3)."""
    (name,) = [name for name, made in result.textures.items() if made["kind"] == "reflectance"]
    folder = result.output.parent / f"{result.output.stem}.textures"
    return read_exr(folder / name)[0]


def expected(codes: np.ndarray) -> np.ndarray:
    """(code / 255)^2.2, grey in all channels."""
    color = codes[..., :3] if codes.shape[-1] > 2 else codes[..., :1].repeat(3, axis=-1)
    return np.asarray((color / 255.0) ** 2.2)


@pytest.mark.parametrize("name", FILES)
def test_texels_are_those_of_the_file(tmp_path: Path, name: str) -> None:
    content, rows = FILES[name]
    (tmp_path / name).write_bytes(content)
    result = run(obj(tmp_path / "a.obj", f"Kd 1 1 1\nmap_Kd {name}"))
    codes = np.array(rows)
    height, width, channels = codes.shape
    shown = look(result)
    assert shown.shape[1:] == (width, channels)
    np.testing.assert_array_equal(shown[:height], codes)
    # A half float has 11 bits; below 2^-14 steps of 2^-24.
    found = reflectance(result)[:height]
    np.testing.assert_allclose(found, expected(codes), rtol=2**-11, atol=2**-25)
    assert "image-broken" not in result.report.codes()


@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_16_bit_codes_keep_their_steps(tmp_path: Path, suffix: str) -> None:
    codes = np.array([[[0, 1, 257], [40_000, 40_001, 65_535]]])
    data = codes.astype(">u2" if suffix == "png" else "<u2").tobytes()
    content = png((2, 1), b"\0" + data, bits=16) if suffix == "png" else tiff((2, 1), data, bits=16)
    (tmp_path / f"wall.{suffix}").write_bytes(content)
    result = run(obj(tmp_path / "a.obj", f"Kd 1 1 1\nmap_Kd wall.{suffix}"))
    found = reflectance(result)
    np.testing.assert_allclose(found, (codes / 65535.0) ** 2.2, rtol=2**-11, atol=2**-25)


def test_webp_without_loss(tmp_path: Path) -> None:
    """No hand could make one: OpenImageIO's own, whose mode without loss keeps every code."""
    import OpenImageIO as oiio

    codes = np.array(SQUARE, np.uint8)
    spec = oiio.ImageSpec(2, 2, 3, oiio.UINT8)
    spec.attribute("compression", "lossless:6")
    out = oiio.ImageOutput.create("wall.webp")
    assert out.open(str(tmp_path / "wall.webp"), spec)
    assert out.write_image(codes)
    assert out.close()
    result = run(obj(tmp_path / "a.obj", "Kd 1 1 1\nmap_Kd wall.webp"))
    np.testing.assert_array_equal(look(result), codes)


@pytest.mark.parametrize(
    "content",
    [
        dds((4, 4), BLOCK * 2, letters=b"DXT1", depth=2, sides=0x200000),
        dds((4, 4), BLOCK * 6, letters=b"DXT1", sides=0xFE00),
        dds((64, 64), BLOCK, letters=b"DXT1"),
        dds((60_000, 60_000), BLOCK, letters=b"DXT1"),
        bmp((60_000, 60_000), bytes(16)),
        tga((65_535, 65_535), bytes(16), kind=10),
        sgi((65_535, 65_535), [bytes(16)]),
        b"KTX 20",
    ],
    ids=["volume", "cube", "short", "huge dds", "huge bmp", "huge tga", "huge sgi", "unknown"],
)
def test_what_cannot_be_read_is_one_finding(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "wall.dds").write_bytes(content)
    result = run(obj(tmp_path / "a.obj", "Kd 1 1 1\nmap_Kd wall.dds"))
    (finding,) = (f for f in result.report if f.code == "image-broken")
    assert finding.thing == "wall.dds"
    assert result.textures == {}


# --- pictures within other files ----------------------------------------------------------


def dressed(path: Path, image: str) -> Path:
    """A square from (0, 0) to (2, 2) in OpenSceneGraph text, its texture once across it."""
    clamped = "WRAP_S CLAMP_TO_EDGE \nWRAP_T CLAMP_TO_EDGE "
    state = state_set(unit=texture(image, clamped))
    corners = "0 0 0\n2 0 0\n2 2 0\n0 2 0"
    st = coordinates("0 0\n1 0\n1 1\n0 1")
    square = geometry(points=corners, more=f"{state}\n{st}")
    eye = "1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 2 1"
    camera = f'osg::MatrixTransform {{\nName "Eye"\nMatrix {{\n{eye}\n}}\n}}'
    path.write_text(HEADER + group(geode(square), camera))
    sidecar(path.parent, "[ambient]\nilluminance = 1\n" + CAMERA)
    return path


CAMERA = '[[camera]]\nmatch = "Eye"\nfov = 45\nnear = 0.1\n'


def corners_seen(gl: Any, result: Result) -> np.ndarray:
    """Pi times the light (2, 2, 3) of a square at 0.1 of its side from the corners.

    That is within half a texel of the edge, where nothing is mixed in.
    """
    job = Job(result.output, width=64, height=36)
    (frame,) = render_sequence(gl, job, Report())
    return np.asarray(frame.hdr)[np.ix_([0, 35], [14, 49])] * np.pi


@pytest.mark.parametrize(
    ("size", "number", "data"),
    [
        ("2 2 1", 0x1907, plain(C, D, A, B)),
        ("2 2 1", 0x80E0, swapped(C, D, A, B)),
        ("2 2 1", 0x1908, plain(*((*texel, 255) for texel in (C, D, A, B)))),
    ],
)
def test_inlined_pixels_begin_at_the_bottom(
    gl: Any, tmp_path: Path, size: str, number: int, data: bytes
) -> None:
    """As OpenGL has them: the first pixel is at s = 0, t = 0."""
    image = inlined(size, number, base64.b64encode(data).decode())
    result = run(dressed(tmp_path / "a.osgt", image))
    np.testing.assert_array_equal(look(result)[..., :3], SQUARE)
    shown = corners_seen(gl, result)
    np.testing.assert_allclose(shown, 0.8 * expected(np.array(SQUARE)), rtol=2**-10)


@pytest.mark.parametrize(
    ("number", "before"), [(33776, b""), (33777, b""), (33778, bytes([255] * 8)), (33779, ALPHA_8)]
)
def test_inlined_blocks_begin_at_the_bottom(
    gl: Any, tmp_path: Path, number: int, before: bytes
) -> None:
    """Codes 0 and 1 in the first row of a block of 4 x 4, which is that at t = 0."""
    half = struct.pack("<HHI", 0xF800, 0x001F, 0x5050)  # two rows: red red blue blue, then red
    image = inlined("4 4 1", number, base64.b64encode(before + half).decode())
    result = run(dressed(tmp_path / "a.osgt", image))
    shown = corners_seen(gl, result)
    np.testing.assert_allclose(
        shown, 0.8 * expected(np.array([[RED, RED], [RED, BLUE]])), rtol=2**-10, atol=1e-7
    )


@pytest.mark.parametrize("name", ["up.tga", "down.tga", "wall.rgb", "wall.png", "up.bmp"])
def test_files_are_seen_the_right_way_up(gl: Any, tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(FILES[name][0])
    source = dressed(tmp_path / "a.osgt", f'FileName "{name}" \nWriteHint 0 2 ')
    shown = corners_seen(gl, run(source))
    np.testing.assert_allclose(shown, 0.8 * expected(np.array(SQUARE)), rtol=2**-10)


@pytest.mark.parametrize("held", ["view", "uri"])
def test_pictures_within_a_gltf(tmp_path: Path, held: str) -> None:
    content, rows = FILES["palette.png"]
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    st = np.array([[0, 0], [1, 0], [0, 1]], "<f4").tobytes()
    whole = points + st + content
    image: dict[str, Any] = {"bufferView": 2, "mimeType": "image/png"}
    if held == "uri":
        image = {"uri": "data:image/png;base64," + base64.b64encode(content).decode()}
    lengths = [len(points), len(st), len(content)]
    starts = [0, len(points), len(points) + len(st)]
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "a.bin", "byteLength": len(whole)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": length}
            for start, length in zip(starts, lengths, strict=True)
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
        ],
        "images": [image],
        "textures": [{"source": 0}],
        "materials": [
            {"name": "paint", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
        ],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}
        ],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    }
    (tmp_path / "a.bin").write_bytes(whole)
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    result = run(tmp_path / "a.gltf")
    np.testing.assert_array_equal(look(result), np.array(rows))
    assert texture_file(surface(opened(result)), "diffuseColor").suffix == ".exr"
    np.testing.assert_allclose(reflectance(result), expected(np.array(rows)), rtol=2**-11)
