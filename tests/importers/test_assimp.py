"""Formats that assimp reads: hand-made files whose content is known."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hdrusd.errors import InputError
from hdrusd.importers import assimp, importer, worker
from hdrusd.importers.assimp_library import find_library
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.legacy.scene import TRS, LegacyScene, UVTransform
from hdrusd.report import Report

needs_assimp = pytest.mark.skipif(
    find_library() is None, reason="assimp is missing; pip install 'hdrusd[assimp]'"
)
#: float32 numbers of assimp's, 24 bits.
CLOSE = {"rel": 2.0**-23, "abs": 0.0}

AC3D = """AC3Db
MATERIAL "red" rgb 0.5 0.25 0.125  amb 0.1 0.2 0.3  emis 0.4 0.5 0.6  spec 0.7 0.8 0.9  \
shi 32  trans 0.25
OBJECT world
kids 2
OBJECT light
name "lamp"
loc 1 2 3
kids 0
OBJECT poly
name "wall"
loc 10 20 30
texture "wall.png"
texrep 2 3
numvert 4
0 0 0
1 0 0
1 1 0
0 1 0
numsurf 1
SURF 0
mat 0
refs 4
0 0 0
1 1 0
2 1 1
3 0 1
kids 0
"""

X = """xof 0303txt 0032
AnimTicksPerSecond { 10; }
Frame root {
 FrameTransformMatrix {
  1.0,0.0,0.0,0.0,0.0,1.0,0.0,0.0,0.0,0.0,1.0,0.0,5.0,6.0,7.0,1.0;;
 }
 Mesh square {
  3;
  0.0;0.0;0.0;,
  1.0;0.0;0.0;,
  1.0;1.0;2.0;;
  1;
  3;0,1,2;;
  MeshMaterialList { 1; 1; 0;;
   Material paint { 0.5;0.25;0.125;0.75;; 20.0; 0.1;0.2;0.3;; 0.4;0.5;0.6;; }
  }
 }
}
AnimationSet walk {
 Animation { { root }
  AnimationKey { 2; 2; 0;3;5.0,6.0,7.0;;, 20;3;15.0,6.0,7.0;;; }
 }
}
"""

PLY = """ply
format ascii 1.0
element vertex 5
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face 2
property list uchar int vertex_indices
end_header
0 0 0 255 0 0
1 0 0 0 255 0
1 1 0 0 0 255
0 1 0 51 51 51
0 0 %s 255 255 255
4 0 1 2 3
3 0 1 4
"""

STL = """solid one
facet normal 0 0 1
 outer loop
  vertex 0 0 0
  vertex 2 0 0
  vertex 0 2 0
 endloop
endfacet
endsolid one
"""

OFF = "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"

#: What a light of another format is to assimp; .ase has no place in our list.
ASE = """*3DSMAX_ASCIIEXPORT 200
*LIGHTOBJECT {
 *NODE_NAME "spot"
 *LIGHT_TYPE Target
 *NODE_TM {
  *NODE_NAME "spot"
  *TM_ROW0 1 0 0
  *TM_ROW1 0 1 0
  *TM_ROW2 0 0 1
  *TM_ROW3 4 5 6
 }
 *LIGHT_SETTINGS {
  *LIGHT_COLOR 1 0.5 0.25
  *LIGHT_INTENS 2
  *LIGHT_HOTSPOT 40
  *LIGHT_FALLOFF 60
 }
}
"""


def load(folder: Path, name: str, text: str | bytes) -> tuple[LegacyScene, Report]:
    """A file with this content, by its suffix."""
    file = folder / name
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    report = Report()
    return importer.read(Resolver(file, report), report), report


@needs_assimp
def test_ac3d(tmp_path: Path) -> None:
    (tmp_path / "wall.png").touch()
    scene, report = load(tmp_path, "a.ac", AC3D)
    (material,), (mesh,), (light,) = scene.materials, scene.meshes, scene.lights
    assert material.name == "red"
    assert material.diffuse == (0.5, 0.25, 0.125)
    assert material.ambient == pytest.approx((0.1, 0.2, 0.3), **CLOSE)
    assert material.emission == pytest.approx((0.4, 0.5, 0.6), **CLOSE)
    assert material.specular == pytest.approx((0.7, 0.8, 0.9), **CLOSE)
    assert (material.shininess, material.alpha, material.alpha_mode) == (32.0, 0.75, "blend")
    assert material.defaults == frozenset()
    texture = material.diffuse_map
    assert texture is not None
    assert texture.image.path == tmp_path / "wall.png"
    assert (texture.wrap_s, texture.wrap_t) == ("repeat", "repeat")
    assert texture.transform == UVTransform((2.0, 3.0))
    assert mesh.points.tolist() == [[10, 20, 30], [11, 20, 30], [11, 21, 30], [10, 21, 30]]
    assert mesh.face_counts.tolist() == [4]
    assert mesh.face_indices.tolist() == [0, 1, 2, 3]
    assert mesh.uvs["st"][0].tolist() == [[0, 0], [1, 0], [1, 1], [0, 1]]
    assert (light.kind, light.diffuse, light.attenuation) == ("point", (1.0, 1.0, 1.0), None)
    (lamp,) = (node for node in scene.roots[0].children if node.name == "lamp")
    assert lamp.lights == [0]
    assert isinstance(lamp.transform, np.ndarray)
    assert lamp.transform[3].tolist() == [1.0, 2.0, 3.0, 1.0]
    assert report.codes() == {"assimp-axes"}


@needs_assimp
def test_x_moves_and_turns_right_handed(tmp_path: Path) -> None:
    scene, _ = load(tmp_path, "a.x", X)
    (node,), (mesh,), (material,) = scene.roots, scene.meshes, scene.materials
    assert node.transform == TRS((5.0, 6.0, -7.0))
    (channel,) = node.animation
    assert channel.path == "translation"
    assert channel.times.tolist() == [0.0, 2.0]
    assert channel.values.tolist() == [[5.0, 6.0, -7.0], [15.0, 6.0, -7.0]]
    assert channel.interpolation == "linear"
    assert sorted(mesh.points[:, 2].tolist()) == [-2.0, 0.0, 0.0]
    assert (material.diffuse, material.alpha) == ((0.5, 0.25, 0.125), 0.75)
    assert material.shininess == 20.0
    assert material.emission == pytest.approx((0.4, 0.5, 0.6), **CLOSE)
    assert material.defaults == {"ambient"}


@needs_assimp
def test_ply_keeps_polygons_and_colours(tmp_path: Path) -> None:
    scene, _ = load(tmp_path, "a.ply", PLY % "1")
    (mesh,) = scene.meshes
    assert mesh.face_counts.tolist() == [4, 3]
    corners = mesh.points[mesh.face_indices]
    assert corners.tolist()[4:] == [[0, 0, 0], [1, 0, 0], [0, 0, 1]]
    assert mesh.colors is not None
    colors = mesh.colors[mesh.face_indices]
    assert colors[:3].tolist() == [[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1]]
    assert colors[3] == pytest.approx((0.2, 0.2, 0.2, 1.0), **CLOSE)


@needs_assimp
def test_a_point_that_is_none_costs_its_faces(tmp_path: Path) -> None:
    scene, report = load(tmp_path, "a.ply", PLY % "nan")
    (mesh,) = scene.meshes
    assert mesh.face_counts.tolist() == [4]
    assert np.isfinite(mesh.points).all()
    assert "assimp-number" in report.codes()


@needs_assimp
def test_stl_and_off(tmp_path: Path) -> None:
    mesh = load(tmp_path, "a.stl", STL)[0].meshes[0]
    assert mesh.points.tolist() == [[0, 0, 0], [2, 0, 0], [0, 2, 0]]
    assert mesh.normals is not None
    assert mesh.normals.tolist() == [[0, 0, 1]] * 3
    mesh = load(tmp_path, "a.off", OFF)[0].meshes[0]
    assert mesh.face_counts.tolist() == [4]
    assert mesh.points[mesh.face_indices].tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


@needs_assimp
def test_a_spotlight(tmp_path: Path) -> None:
    file = tmp_path / "a.ase"
    file.write_text(ASE)
    report = Report()
    resolver = Resolver(file, report)
    scene = worker.read("hdrusd.importers.assimp_worker:read", resolver, report)
    assert scene.meshes == []  # none is made up
    (light,) = scene.lights
    assert (light.name, light.kind, light.diffuse) == ("spot", "spot", (2.0, 1.0, 0.5))
    assert light.spot_cutoff == pytest.approx(30.0, rel=2.0**-22)
    assert light.spot_inner == pytest.approx(20.0, rel=2.0**-22)
    assert light.attenuation is None
    assert math.hypot(*light.direction) == pytest.approx(1.0)


@needs_assimp
def test_a_real_file(testdata: Path) -> None:
    file = testdata / "data/assimp/AC/SphereWithLight.ac"
    report = Report()
    scene = importer.read(Resolver(file, report), report)
    counts = scene.counts()
    counts = {
        key: counts[key] for key in ("meshes", "triangles", "materials", "textures", "lights")
    }
    assert list(counts.values()) == [1, 17664, 1, 1, 1]
    texture = scene.materials[0].diffuse_map
    assert texture is not None
    assert texture.image.path == file.resolve().with_name("earthSpherical.jpg")


@needs_assimp
@pytest.mark.parametrize("suffix", [".ac", ".b3d", ".lwo", ".ms3d", ".off", ".ply", ".stl", ".x"])
@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x89PNG\r\n\x1a\n" + bytes(64),
        b"version https://git-lfs.github.com/spec/v1\n",
        AC3D.replace("numvert 4", "numvert 4000000000").encode(),
        (PLY % "1").replace("vertex 5", "vertex 4000000000").encode(),
        OFF.replace("4 1 0", "4000000000 1 0").encode(),
        b"BB3D" + b"\xff" * 64,
        b"FORM\xff\xff\xff\xf0LWO2LAYR\xff\xff\xff\xff",
        b"solid " + b"a" * 74 + b"\xff\xff\xff\xff",
        b"MS3D000000\x04\x00\x00\x00\xff\xff" + bytes(64),
    ],
)
def test_hostile_files_are_a_scene_or_one_line(tmp_path: Path, suffix: str, content: bytes) -> None:
    """Nothing but InputError, and a scene has something in it."""
    file = tmp_path / f"a{suffix}"
    file.write_bytes(content)
    report = Report()
    resolver = Resolver(file, report, limits=Limits(worker_seconds=30))
    try:
        scene = importer.read(resolver, report)
    except InputError as error:
        problem = str(error)
    else:
        assert scene.meshes
        return
    assert problem.startswith(f"a{suffix}")
    assert "want" in problem


def test_without_assimp_one_line_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assimp, "find_library", lambda: None)
    with pytest.raises(InputError, match=r"pip install 'hdrusd\[assimp\]'"):
        load(tmp_path, "a.ac", AC3D)
