"""OpenFlight textures: files, attribute files, alpha by the first bytes of a picture."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from flt_builder import SQUARE, Loaded, Pool, database, face, load, material, texture, thing, vertex

from hdrusd.conversion import Options
from hdrusd.convert import convert
from hdrusd.images import read_exr, read_image
from hdrusd.importers.flt_textures import has_alpha
from hdrusd.report import Kind


def sgi(channels: int, side: int = 2) -> bytes:
    """An SGI picture: uncompressed, 8 bits; row 0 is the bottom, planes of 10, 20, 30, 40."""
    dimension = 2 if channels == 1 else 3
    head = struct.pack(">hbbHHHHii", 474, 0, 1, dimension, side, side, channels, 0, 255)
    planes = b"".join(bytes([10 * (c + 1)]) * side * side for c in range(channels))
    return head.ljust(512, b"\0") + planes


def attributes(both: int = 0, u: int = 2, v: int = 2, mode: int = 0, as_alpha: int = 0) -> bytes:
    """An attribute file up to what is read of it, and more."""
    words = [2, 2, 0, 0, 0, 0, 4, 1, 1, both, u, v, 0, 0, 0, mode, as_alpha]
    return struct.pack(">17i", *words).ljust(600, b"\0")


def textured(folder: Path, file: str, **fields: object) -> Loaded:
    """A square that wears a picture."""
    pool = Pool()
    corners = pool.add(*(vertex(p, None, p[:2]) for p in SQUARE))
    own = thing("o", face(corners, texture=0, **fields))  # type: ignore[arg-type]
    return load(folder, database(own, palettes=texture(0, file), vertices=pool.data))


def test_a_texture_repeats_unless_its_attributes_say_otherwise(tmp_path: Path) -> None:
    (tmp_path / "a.rgb").write_bytes(sgi(3))
    got = textured(tmp_path, "a.rgb").material
    assert got.diffuse_map is not None
    assert (got.diffuse_map.wrap_s, got.diffuse_map.wrap_t) == ("repeat", "repeat")
    assert (got.name, got.diffuse_map.image.path) == ("a", tmp_path / "a.rgb")
    assert (got.alpha_mode, got.opacity_map) == ("opaque", None)


@pytest.mark.parametrize(
    ("said", "wraps"),
    [
        (attributes(1), ("clamp", "clamp")),
        (attributes(0, 1, 2), ("clamp", "repeat")),
        (attributes(1, 3, 0), ("mirror", "repeat")),
        (attributes(1)[:60], ("clamp", "clamp")),  # where the oldest files end
    ],
)
def test_wraps(tmp_path: Path, said: bytes, wraps: tuple[str, str]) -> None:
    (tmp_path / "a.rgb").write_bytes(sgi(3))
    (tmp_path / "a.rgb.attr").write_bytes(said)
    made = textured(tmp_path, "a.rgb")
    got = made.material.diffuse_map
    assert got is not None
    assert (got.wrap_s, got.wrap_t) == wraps
    assert not made.report.codes()


@pytest.mark.parametrize(
    ("said", "code"),
    [
        (b"short", "flt-attributes"),
        (attributes(9), "flt-attributes"),
        (attributes(mode=-1), "flt-attributes"),
        (attributes(mode=2), "flt-texture-mode"),
        (attributes(as_alpha=1), "flt-texture-alpha"),
    ],
)
def test_attributes_that_are_odd(tmp_path: Path, said: bytes, code: str) -> None:
    (tmp_path / "a.rgb").write_bytes(sgi(3))
    (tmp_path / "a.rgb.attr").write_bytes(said)
    made = textured(tmp_path, "a.rgb")
    assert made.report.codes() == {code}
    assert made.material.diffuse_map is not None
    assert made.material.diffuse_map.mode == ("DECAL" if code == "flt-texture-mode" else "MODULATE")


@pytest.mark.parametrize(
    ("mode", "words", "diffuse"),
    [
        (0, None, 0.5),
        (1, "environment BLEND; kept as a note, shown as MODULATE", 0.5),
        (2, "environment DECAL: in place of the material's colour; shown with D = 1", 1.0),
        (3, "environment REPLACE: in place of the material's colour; shown with D = 1", 1.0),
        (4, "environment ADD; kept as a note, shown as MODULATE", 0.5),
    ],
)
def test_what_is_said_of_an_environment_is_done(
    tmp_path: Path, mode: int, words: str | None, diffuse: float
) -> None:
    """R = T^2.2 D of the codes 10, 20 and 30, where D of the material is 0.5."""
    (tmp_path / "a.rgb").write_bytes(sgi(3))
    (tmp_path / "a.rgb.attr").write_bytes(attributes(mode=mode))
    pool = Pool()
    corners = pool.add(*(vertex(p, None, p[:2]) for p in SQUARE))
    own = thing("o", face(corners, texture=0, material=0))
    palettes = texture(0, "a.rgb") + material(0, "paint")
    path = tmp_path / "scene.flt"
    path.write_bytes(database(own, palettes=palettes, vertices=pool.data))
    result = convert(path, tmp_path / "scene.usda", Options())
    said = [f.text for f in result.report if f.code == "flt-texture-mode"]
    assert said == ([] if words is None else [f"texture {words}"])
    (name,) = [name for name, made in result.textures.items() if made["kind"] == "reflectance"]
    rgb, _ = read_exr(tmp_path / "scene.textures" / name)
    wanted = (np.array([10, 20, 30]) / 255.0) ** 2.2 * diffuse
    assert rgb[0, 0] == pytest.approx(wanted, rel=2**-11)  # half floats


def test_alpha_is_cut_out_unless_the_template_blends(tmp_path: Path) -> None:
    (tmp_path / "a.rgba").write_bytes(sgi(4))
    cut = textured(tmp_path, "a.rgba")
    assert (cut.material.alpha_mode, cut.material.alpha_cutoff) == ("mask", 0.5)
    assert cut.finding("flt-alpha").kind is Kind.ASSUMED
    blended = textured(tmp_path, "a.rgba", template=1).material
    assert blended.alpha_mode == "blend"
    assert blended.opacity_map is not None
    assert blended.opacity_map.channel == "a"


@pytest.mark.parametrize(
    ("name", "content", "alpha"),
    [
        ("a.int", sgi(1), False),
        ("a.inta", sgi(2), True),
        ("a.rgb", sgi(3), False),
        ("a.rgb", sgi(4), True),  # whatever its name says
        ("a.jpg", b"", False),
        ("a.png", b"\x89PNG\r\n\x1a\n" + bytes(17) + b"\x02", False),
        ("a.png", b"\x89PNG\r\n\x1a\n" + bytes(17) + b"\x06", True),
        ("a.tga", bytes(16) + b"\x18\x00", False),
        ("a.tga", bytes(16) + b"\x20\x08", True),
        ("a.dds", b"DDS ", True),
    ],
)
def test_alpha_by_the_first_bytes(tmp_path: Path, name: str, content: bytes, alpha: bool) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    assert has_alpha(path) is alpha


@pytest.mark.parametrize(("name", "channels"), [("a.int", 1), ("a.inta", 2), ("a.rgba", 4)])
def test_pictures_of_the_format_are_read(tmp_path: Path, name: str, channels: int) -> None:
    path = tmp_path / name
    path.write_bytes(sgi(channels))
    pixels = read_image(path).pixels
    assert pixels.shape == (2, 2, channels)
    assert pixels[0, 0].tolist() == [10, 20, 30, 40][:channels]


def test_a_missing_picture_keeps_its_name(tmp_path: Path) -> None:
    made = textured(tmp_path, "C:\\textures\\gone.rgb")
    assert made.material.diffuse_map is not None
    assert made.material.diffuse_map.image.name == "C:\\textures\\gone.rgb"
    assert made.report.codes() == {"file-missing"}


def test_attributes_outside_the_roots_are_not_read(tmp_path: Path) -> None:
    inner = tmp_path / "in"
    inner.mkdir()
    (inner / "a.rgb").write_bytes(sgi(3))
    (tmp_path / "away.attr").write_bytes(attributes(1))
    (inner / "a.rgb.attr").symlink_to(tmp_path / "away.attr")
    got = textured(inner, "a.rgb").material.diffuse_map
    assert got is not None
    assert got.wrap_s == "repeat"
