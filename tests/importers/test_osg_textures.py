"""Textures of OpenSceneGraph files: files, pixels in the file, matrices."""

from __future__ import annotations

import base64
import math
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from osg_builder import dressed, inlined, named, old_dressed, quick, state_set, texture

from hdrusd.importers.osg_textures import uv_transform
from hdrusd.legacy.scene import Material, UVTransform
from hdrusd.report import Kind


def test_an_external_picture(tmp_path: Path) -> None:
    (tmp_path / "a.png").touch()
    unit = texture(named("a.png"), "WRAP_S MIRROR \nWRAP_T CLAMP_TO_BORDER ")
    found = dressed(tmp_path, state_set(unit=unit)).material.diffuse_map
    assert found is not None
    assert (found.image.path, found.uv_set) == (tmp_path / "a.png", "st")
    assert (found.wrap_s, found.wrap_t, found.transform) == ("mirror", "black", None)
    old = 'textureUnit 0 {\nGL_TEXTURE_2D ON\nTexture2D {\nfile "b\\\\A.PNG"\n}\n}'
    made = old_dressed(tmp_path, old)
    assert made.material.diffuse_map is not None
    assert made.material.diffuse_map.image.path == tmp_path / "a.png"


def test_wraps_that_are_left_out_clamp(tmp_path: Path) -> None:
    made = dressed(tmp_path, state_set(unit=texture(named("a.png"), "")))
    found = made.material.diffuse_map
    assert found is not None
    assert (found.wrap_s, found.wrap_t) == ("clamp", "clamp")
    assert {"wrap_s", "wrap_t"} <= made.material.defaults


def test_a_missing_picture_keeps_its_name(tmp_path: Path) -> None:
    made = dressed(tmp_path, state_set(unit=texture(named("../../etc/passwd"))))
    assert made.material.diffuse_map is not None
    assert made.material.diffuse_map.image.missing
    assert made.material.diffuse_map.image.name == "../../etc/passwd"
    assert len(made.codes() & {"file-missing", "file-refused"}) == 1


def test_the_first_enabled_unit_is_kept(tmp_path: Path) -> None:
    for name in ("a.png", "b.png", "c.png"):
        (tmp_path / name).touch()
    units = "\n".join(
        f"textureUnit {n} {{\nGL_TEXTURE_2D {on}\nTexture2D {{\nfile {name}\n}}\n}}"
        for n, on, name in ((0, "OFF", "a.png"), (2, "ON", "b.png"), (3, "ON", "c.png"))
    )
    made = old_dressed(tmp_path, units)
    assert made.material.diffuse_map is not None
    assert made.material.diffuse_map.image.name == "b.png"
    assert made.material.diffuse_map.uv_set == "st2"
    assert "c.png" in made.finding("osg-texture-unit").text
    assert made.material.extras == {"texture_units": {"3": "c.png"}}
    assert made.finding("osg-no-coordinates").kind is Kind.MISSING


def test_a_texture_that_nothing_switches_is_on(tmp_path: Path) -> None:
    (tmp_path / "a.png").touch()
    state = state_set(unit=texture(named("a.png"))).replace("GL_TEXTURE_2D ON \n", "")
    made = dressed(tmp_path, state)
    assert made.material.diffuse_map is not None
    assert made.finding("osg-texture-mode-unset").kind is Kind.ASSUMED


@pytest.mark.parametrize(
    ("unit", "code"),
    [
        ("osg::TextureCubeMap {\n}\nValue OFF ", "osg-texture-class"),
        ("osg::Texture2D {\n}\nValue OFF ", "osg-image"),
    ],
)
def test_textures_that_are_dropped(tmp_path: Path, unit: str, code: str) -> None:
    made = dressed(tmp_path, state_set(unit=unit))
    assert (made.material.diffuse_map, made.codes()) == (None, {code})


def test_generated_coordinates_drop_the_texture(tmp_path: Path) -> None:
    unit = "textureUnit 0 {\nGL_TEXTURE_2D ON\nGL_TEXTURE_GEN_S ON\nTexture2D {\nfile a.png\n}\n}"
    made = old_dressed(tmp_path, unit)
    assert (made.material.diffuse_map, made.codes()) == (None, {"osg-texture-generated"})


@pytest.mark.parametrize(
    ("mode", "words"),
    [("DECAL", "D = 1"), ("REPLACE", "D = 1"), ("BLEND", "as MODULATE"), ("ADD", "as MODULATE")],
)
def test_an_environment_other_than_modulate_is_noted(tmp_path: Path, mode: str, words: str) -> None:
    (tmp_path / "a.png").touch()
    unit = texture(named("a.png")) + f"\nosg::TexEnv {{\nMode {mode} \n}}\nValue OFF "
    made = dressed(tmp_path, state_set(unit=unit))
    assert made.material.diffuse_map is not None
    assert made.material.diffuse_map.mode == mode
    assert made.codes() == {"osg-texture-mode"}
    assert made.finding("osg-texture-mode").text.endswith(words)


def inline(folder: Path, size: str, pixel_format: int, data: bytes, packing: int = 1) -> Material:
    """The material of a square with an image in the file, blended."""
    text = base64.b64encode(data).decode()
    image = inlined(size, pixel_format, f"{text[:10]}\n{text[10:]}", packing)
    return dressed(folder, state_set("GL_BLEND ON ", unit=texture(image))).material


@pytest.mark.parametrize(
    ("pixel_format", "data", "packing", "first", "second", "opacity"),
    [
        (0x1907, "010203 040506 0000 070809 0a0b0c", 4, "010203040506", "070809", False),
        (0x1907, "010203 040506 070809 0a0b0c", 1, "010203040506", "070809", False),
        (0x80E0, "010203 040506 070809 0a0b0c", 1, "030201060504", "090807", False),
        (0x80E1, "01020304 05060708" * 2, 1, "0302010407060508", "03020104", True),
        (0x1909, "01 02 03 04", 1, "0102", "03", False),
        (0x190A, "0102 0304 0506 0708", 1, "01020304", "0506", True),
        (0x1906, "01 02 03 04", 1, "ff01ff02", "ff03", True),
    ],
)
def test_pixels_in_the_file(
    tmp_path: Path,
    pixel_format: int,
    data: str,
    packing: int,
    first: str,
    second: str,
    opacity: bool,
) -> None:
    """Two by two pixels; the first row of the file is the bottom one."""
    found = inline(tmp_path, "2 2 1", pixel_format, bytes.fromhex(data) + bytes(2), packing)
    assert found.diffuse_map is not None
    pixels = found.diffuse_map.image.pixels
    assert pixels is not None
    assert pixels[1].tobytes() == bytes.fromhex(first)
    assert pixels[0].tobytes().startswith(bytes.fromhex(second))
    assert (found.opacity_map is not None) is opacity
    assert found.diffuse_map.transform is None


@pytest.mark.parametrize(
    ("pixel_format", "letters", "block", "opacity"),
    [
        (33776, b"DXT1", 8, False),
        (33777, b"DXT1", 8, True),
        (33778, b"DXT3", 16, True),
        (33779, b"DXT5", 16, True),
    ],
)
def test_compressed_pixels_become_a_dds(
    tmp_path: Path, pixel_format: int, letters: bytes, block: int, opacity: bool
) -> None:
    """Six by five pixels are two by two blocks; smaller levels follow and are left out."""
    level = bytes(range(4 * block))
    found = inline(tmp_path, "6 5 1", pixel_format, level + b"smaller levels")
    assert found.diffuse_map is not None
    data = found.diffuse_map.image.data
    assert data is not None
    magic, size, _, height, width, bytes_ = struct.unpack("<4s5I", data[:24])
    assert (magic, size, height, width, bytes_) == (b"DDS ", 124, 5, 6, len(level))
    assert struct.unpack("<II4s", data[76:88]) == (32, 4, letters)
    assert data[128:] == level
    assert found.diffuse_map.transform == UVTransform((1.0, -1.0), 0.0, (0.0, 1.0))
    assert (found.opacity_map is not None) is opacity


def test_a_dds_file_is_shown_with_its_rows_as_they_are(tmp_path: Path) -> None:
    (tmp_path / "a.dds").touch()
    made = dressed(tmp_path, state_set(unit=texture(named("a.dds"))))
    assert made.material.diffuse_map is not None
    assert made.material.diffuse_map.transform == UVTransform((1.0, -1.0), 0.0, (0.0, 1.0))
    assert made.codes() == {"osg-dds-rows"}


@pytest.mark.parametrize(
    "image",
    [
        inlined("2 2 1", 0x1907, "AAAA"),
        inlined("2 2 1", 33779, "AAAA"),
        inlined("1 1 1", 0x1907, "A"),
        inlined("1 1 2", 0x1907, "AAAAAAAA"),
        inlined("1000000 1000000 1", 0x1907, "AAAA"),
        inlined("-1 1e30 1", 0x1907, "AAAA"),
        inlined("1 1 1", 4711, "AAAA"),
    ],
)
def test_broken_pixels_leave_an_image_without_any(tmp_path: Path, image: str) -> None:
    made = dressed(tmp_path, state_set(unit=texture(image)))
    assert made.material.diffuse_map is not None
    assert made.material.diffuse_map.image.missing
    assert "osg-image" in made.codes()


def _shown(matrix: np.ndarray, made: UVTransform | None, *, from_top: bool) -> None:
    """The transform does to three points what the matrix and the turning over do."""
    points = np.array([[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]])
    wanted = (points @ matrix)[:, :2]
    if from_top:
        wanted[:, 1] = 1.0 - wanted[:, 1]
    made = made or UVTransform()
    angle = math.radians(made.rotation)
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    found = (points[:, :2] * made.scale) @ turn + made.translation
    np.testing.assert_allclose(found, wanted, atol=1e-12 * (1.0 + np.abs(wanted).max()))


@quick
@given(
    scale=st.tuples(*[st.floats(0.1, 10).flatmap(lambda x: st.sampled_from([x, -x]))] * 2),
    angle=st.floats(-math.pi, math.pi),
    move=st.tuples(st.floats(-5, 5), st.floats(-5, 5)),
    from_top=st.booleans(),
)
def test_texture_matrices_are_taken_apart(
    scale: tuple[float, float], angle: float, move: tuple[float, float], from_top: bool
) -> None:
    matrix = np.eye(4)
    turn = [[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]]
    matrix[:2, :2] = np.diag(scale) @ np.array(turn)
    matrix[3, :2] = move
    made = uv_transform(tuple(matrix.ravel().tolist()), from_top=from_top)
    _shown(matrix, made, from_top=from_top)


def test_a_texture_matrix_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "a.png").touch()
    rows = "2 0 0 0 \n0 3 0 0 \n0 0 1 0 \n0.5 0.25 0 1 "
    unit = texture(named("a.png")) + f"\nosg::TexMat {{\nMatrix {{\n{rows}\n}}\n}}\nValue OFF "
    new = dressed(tmp_path, state_set(unit=unit)).material
    inside = f"GL_TEXTURE_2D ON\nTexture2D {{\nfile a.png\n}}\nTexMat {{\n{rows}\n}}"
    old = old_dressed(tmp_path, f"textureUnit 0 {{\n{inside}\n}}").material
    for found in (new, old):
        assert found.diffuse_map is not None
        assert found.diffuse_map.transform == UVTransform((2.0, 3.0), 0.0, (0.5, 0.25))


def test_a_texture_matrix_with_shear_is_dropped(tmp_path: Path) -> None:
    (tmp_path / "a.png").touch()
    unit = texture(named("a.png")) + (
        "\nosg::TexMat {\nMatrix {\n1 0 0 0 \n1 1 0 0 \n0 0 1 0 \n0 0 0 1 \n}\n}\nValue OFF "
    )
    made = dressed(tmp_path, state_set(unit=unit))
    assert made.material.diffuse_map is not None
    assert (made.material.diffuse_map.transform, made.codes()) == (None, {"osg-texture-matrix"})
