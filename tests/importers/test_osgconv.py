"""OpenSceneGraph's .ive by osgconv; what it writes, by our own reader."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from file_watch import watched
from same_scene import differences

from hdrusd.errors import InputError
from hdrusd.images import read_image, write_png
from hdrusd.importers import importer
from hdrusd.importers.confine import landlock_version
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.legacy.scene import LegacyScene
from hdrusd.report import Kind, Report

needs_osgconv = pytest.mark.skipif(
    shutil.which("osgconv") is None, reason="osgconv is missing; it is in openscenegraph"
)

#: A square that wears a picture.
TEXT = """Geode {
  num_drawables 1
  Geometry {
    StateSet {
      textureUnit 0 {
        GL_TEXTURE_2D ON
        Texture2D { file "%s" wrap_s REPEAT wrap_t REPEAT }
      }
    }
    PrimitiveSets 1 { DrawArrays QUADS 0 4 }
    VertexArray Vec3Array 4 { 0 0 0 1 0 0 1 1 0 0 1 0 }
    TexCoordArray 0 Vec2Array 4 { 0 0 1 0 1 1 0 1 }
  }
}
"""

#: Two pixels.
PIXELS = np.array([[[7, 8, 9], [1, 2, 3]]], np.uint8)


def load(file: Path, limits: Limits | None = None) -> tuple[LegacyScene, Report]:
    """A file by its suffix."""
    report = Report()
    return importer.read(Resolver(file, report, limits=limits or Limits()), report), report


def square(folder: Path, name: str, picture: str) -> Path:
    """A binary file of the square, which names a picture, now there, and does not hold it."""
    (folder / picture).parent.mkdir(exist_ok=True)
    write_png(folder / picture, PIXELS)
    text = folder / "text.osg"
    text.write_text(TEXT % picture)
    option = "noTexturesInIVEFile" if name.endswith(".ive") else "WriteImageHint=UseExternal"
    subprocess.run(["osgconv", "-O", option, text.name, name], cwd=folder, check=True)
    text.unlink()
    return folder / name


def test_without_osgconv_one_line_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    file = tmp_path / "street.ive"
    file.write_bytes(b"\4\3\2\1")
    with pytest.raises(InputError, match="install the package openscenegraph"):
        load(file)


@needs_osgconv
def test_the_street_is_that_of_the_text(testdata: Path) -> None:
    text, _ = load(testdata / "data/derived-osg/night_street.osgt")
    scene, report = load(testdata / "data/derived-osg/night_street.ive")
    picture = "materials[2].diffuse_map.image"
    # the text has six digits
    found = differences(text, scene, rtol=5e-6)
    assert found == ["source", f"{picture}.path", f"{picture}.pixels"]
    held, named = (s.materials[2].diffuse_map for s in (scene, text))
    assert held is not None
    assert named is not None
    assert held.image.pixels is not None
    assert named.image.path is not None
    assert np.array_equal(held.image.pixels, read_image(named.image.path).pixels)
    assert "worker-unconfined" not in report.codes() or not landlock_version()


@needs_osgconv
@pytest.mark.parametrize(
    ("name", "meshes", "triangles", "materials", "textures", "lights"),
    [  # counted by another reader
        ("delta3d/examples/data/StaticMeshes/TestTownLt.ive", 54, 5078, 54, 54, 0),
        ("delta3d/examples/data/StaticMeshes/house1.ive", 5, 57, 5, 5, 0),
        ("derived-osg/night_street.ive", 14, 86, 4, 1, 6),
        ("derived-osg/stop_light.ive", 3, 260, 1, 1, 0),
    ],
)
def test_real_files(
    testdata: Path,
    name: str,
    meshes: int,
    triangles: int,
    materials: int,
    textures: int,
    lights: int,
) -> None:
    scene, _ = load(testdata / "data" / name)
    found = scene.counts()
    want = {"meshes": meshes, "triangles": triangles, "materials": materials}
    want |= {"textures": textures, "lights": lights}
    assert {key: found[key] for key in want} == want
    maps = [material.diffuse_map for material in scene.materials if material.diffuse_map]
    assert all(texture.image.data or texture.image.pixels is not None for texture in maps)


def test_an_empty_file(testdata: Path) -> None:
    with pytest.raises(InputError, match=r"empty\.ive: empty; want \.ive"):
        load(testdata / "data/hostile/empty.ive")


def test_another_file_of_that_name(tmp_path: Path) -> None:
    (tmp_path / "a.ive").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    with pytest.raises(InputError, match=r"not \.ive, by its first bytes"):
        load(tmp_path / "a.ive")


@needs_osgconv
def test_noise_behind_a_good_head(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).bytes(4096)
    (tmp_path / "a.ive").write_bytes(b"\4\3\2\1\x2d\0\0\0\0\0\0\0" + noise)
    with pytest.raises(InputError, match="osgconv"):
        load(tmp_path / "a.ive", Limits(worker_seconds=20))


@needs_osgconv
@pytest.mark.parametrize("name", ["a.ive", "a.osgb"])
def test_a_named_picture_is_found_beside_the_file(tmp_path: Path, name: str) -> None:
    scene, report = load(square(tmp_path, name, "maps/wall.png"))
    texture = scene.materials[0].diffuse_map
    assert texture is not None
    assert texture.image.name == "maps/wall.png"
    if name == "a.ive":
        assert texture.image.pixels is not None
        assert texture.image.pixels.tolist() == PIXELS.tolist()
    else:
        assert texture.image.path == tmp_path / "maps" / "wall.png"
    assert "file-missing" not in report.codes()


@needs_osgconv
@pytest.mark.parametrize("deep", ["", "../" * 12])
@pytest.mark.parametrize("name", ["a.ive", "a.osgb"])
def test_a_picture_that_moved_beside_the_file(tmp_path: Path, name: str, deep: str) -> None:
    home = tmp_path / "home"
    inside = tmp_path.joinpath(*"abcdefghijklmn")
    home.mkdir()
    inside.mkdir(parents=True)
    reference = f"{deep}gone.png" if deep else str(home / "gone.png")
    file = square(inside, name, reference)
    (inside / reference).rename(inside / "gone.png")
    scene, report = load(file)
    texture = scene.materials[0].diffuse_map
    assert texture is not None
    assert not texture.image.missing
    assert "file-found-elsewhere" in report.codes()


@needs_osgconv
@pytest.mark.parametrize("name", ["a.ive", "a.osgb"])
def test_a_picture_that_is_not_there_is_said(tmp_path: Path, name: str) -> None:
    file = square(tmp_path, name, "wall.png")
    (tmp_path / "wall.png").unlink()
    scene, report = load(file)
    assert len(scene.meshes) == 1
    (found,) = (finding for finding in report if finding.code == "file-missing")
    assert found.kind is Kind.MISSING
    assert found.text.startswith("wall.png: ")


@needs_osgconv
@pytest.mark.skipif(not landlock_version(), reason="this system has no Landlock")
@pytest.mark.parametrize("absolute", [False, True])
@pytest.mark.parametrize("name", ["a.ive", "a.osgb"])
def test_no_file_outside_is_opened(tmp_path: Path, name: str, absolute: bool) -> None:
    outside, inside = tmp_path / "outside", tmp_path / "inside"
    outside.mkdir()
    inside.mkdir()
    reference = str(outside / "wall.png") if absolute else "../outside/wall.png"
    file = square(inside, name, reference)
    with watched(outside) as touched:
        _, report = load(file)
        assert touched() == []
        read_image(outside / "wall.png")
        assert touched() == ["wall.png"]  # the watch works
    assert "file-refused" in report.codes()
