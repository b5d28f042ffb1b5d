"""OBJ files that are broken, hostile or from the wild: a scene with findings, or InputError.

Counts of real files were taken from the files themselves.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from obj_builder import SQUARE, TRIANGLE, load, load_text, quick

from hdrusd.errors import InputError
from hdrusd.importers import obj_text
from hdrusd.importers.importer import Limits
from hdrusd.report import Kind


@pytest.mark.parametrize(
    ("content", "match"),
    [
        (b"", "no vertex"),
        (b"o x\ng y\n", "no vertex"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "offset 7: want text|binary"),
        (b"\xff\xfev\x00 \x00\x00", "UTF-16"),
        (b"\xff\xfe\x00\x00v\x00\x00\x00", "binary"),
    ],
)
def test_what_is_no_obj_is_refused(tmp_path: Path, content: bytes, match: str) -> None:
    with pytest.raises(InputError, match=match) as error:
        load_text(tmp_path, content)
    assert "model.obj" in str(error.value)
    assert "\n" not in str(error.value)


def test_limits(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="more than 3 vertices"):
        load_text(tmp_path, SQUARE + "f 1 2 3\n", Limits(vertices=3))
    groups = "".join(f"g {i}\nf 1 2 3\n" for i in range(5))
    with pytest.raises(InputError, match="more than 4 objects") as error:
        load_text(tmp_path, SQUARE + groups, Limits(nodes=4))
    assert str(error.value).startswith("model.obj:18:")
    assert len(load_text(tmp_path, SQUARE + groups, Limits(nodes=5, vertices=4)).scene.meshes) == 5


def test_an_endless_line_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(obj_text, "_LONGEST_LINE", 100)
    blocks = obj_text.blocks(b"v 0 0 0\n" + b"f" + b" 1" * 99 + b"\n", Path("x.obj"), size=10)
    with pytest.raises(InputError, match=r"x\.obj:2: a line of more than 100 bytes"):
        list(blocks)


def test_faces_with_bad_indices_are_dropped_and_counted(tmp_path: Path) -> None:
    bad = [
        "1 2 5",
        "0 1 2",
        "-5 1 2",
        "1/-5 2/2 3/3",
        "1//-2 2//1 3//1",
        "1/5 2/2 3/3",
        "1//2 2//1 3//1",
        "1 2 x",
        "1/1/1/1 2 3",
    ]
    text = SQUARE + "f 1 2 3 4\n" + "".join(f"f {face}\n" for face in bad) + "f 4 3 2\n"
    loaded = load_text(tmp_path, text)
    assert loaded.mesh.face_counts.tolist() == [4, 3]
    assert loaded.corner_points[4:] == [[0, 1, 0], [1, 1, 0], [1, 0, 0]]
    finding = loaded.finding("face-index")
    assert finding.kind is Kind.INVALID
    assert finding.source.place == 11
    assert finding.text.startswith(f"{len(bad)} faces")


def test_faces_of_too_few_corners_are_dropped_and_counted(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, SQUARE + "f 1 2\nf\nf 1 2 3\n")
    assert loaded.mesh.face_counts.tolist() == [3]
    finding = loaded.finding("face-corners")
    assert (finding.source.place, finding.text[:7]) == (10, "2 faces")


@pytest.mark.parametrize(
    "vertex",
    ["nan 0 0", "0 inf 0", "1e400 0 0", "1e39 0 0", "0 0", "x 0 0", "0 5 1.#IND", "", "1_0 0 0"],
)
def test_faces_with_points_that_are_no_numbers_are_dropped(tmp_path: Path, vertex: str) -> None:
    """1e39 is finite, but not as a 32-bit float. The broken vertex keeps its number."""
    loaded = load_text(tmp_path, f"{TRIANGLE}v {vertex}\nv 7 7 7\nf 1 2 4\nf 1 2 5\n")
    assert loaded.corner_points == [[0, 0, 0], [1, 0, 0], [7, 7, 7]]
    finding = loaded.finding("face-point")
    assert (finding.source.place, finding.text[:7]) == (6, "1 faces")


def test_nothing_usable_is_an_empty_scene_that_says_so(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, "v nan 0 0\nv 0 1 0\nv 1 0 0\nf 1 2 3\n")
    assert loaded.scene.meshes == []
    assert loaded.finding("obj-empty").kind is Kind.INVALID


def test_what_has_no_polygon_is_counted(tmp_path: Path) -> None:
    text = SQUARE + "l 1 2\nl 1 2 3\np 1\ncurv 0 1 1 2\ns 1\ns 2\ns off\nfoo bar\nf 1 2 3\n"
    loaded = load_text(tmp_path, text)
    elements = {finding.thing: finding for finding in loaded.findings("obj-elements")}
    assert elements.keys() == {"l", "p", "curv"}
    assert elements["l"].text.startswith("2 ")
    assert elements["l"].source.place == 10
    assert loaded.finding("obj-attributes").text.startswith("2 ")
    assert loaded.finding("obj-unknown").source.place == 17


@pytest.mark.parametrize("statement", ["s off", "s 0", "# only", "", "mg 0"])
def test_what_changes_nothing_is_not_reported(tmp_path: Path, statement: str) -> None:
    loaded = load_text(tmp_path, f"{SQUARE}{statement}\nf 1 2 3\n")
    assert loaded.report.codes() == {"obj-units", "material-none"}


def test_names_and_references_of_any_length(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, f"{SQUARE}mtllib {'a ' * 9999}\nusemtl {'x' * 9999}\nf 1 2 3\n")
    assert loaded.material.name == "x" * 9999
    assert max(len(finding.text) + len(finding.thing) for finding in loaded.report) < 300


def test_a_missing_library_and_a_device(tmp_path: Path) -> None:
    loaded = load_text(tmp_path, f"mtllib /dev/zero\nmtllib gone.mtl\n{SQUARE}usemtl m\nf 1 2 3\n")
    assert loaded.material.name == "m"
    assert loaded.finding("file-refused").source.place == 1
    assert loaded.finding("file-missing").source.place == 2


VALID = f"""# c
mtllib model.mtl
{SQUARE}v 0 0 1 1 0.5 0
vt 0.5
o one
usemtl red
s 1
f 1/1/1 2/2/1 3/3/1 4/4/1
g two \\
 three
usemtl blue
f -1//1 2//1 -2//1
l 1 2
""".encode()


@quick
@given(st.data())
def test_mutated_bytes_end_in_a_scene_or_an_input_error(
    tmp_path: Path, data: st.DataObject
) -> None:
    content = bytearray(VALID)
    for _ in range(data.draw(st.integers(1, 6))):
        begin = data.draw(st.integers(0, len(content)))
        end = data.draw(st.integers(begin, min(len(content), begin + 4)))
        piece = st.binary(max_size=4) | st.sampled_from(
            [b"\n", b"\\\n", b"-", b"/", b"f ", b"9" * 20]
        )
        content[begin:end] = data.draw(piece)
    try:
        scene = load_text(tmp_path, bytes(content)).scene
    except InputError:
        return
    for mesh in scene.meshes:
        assert np.isfinite(mesh.points).all()
        assert mesh.face_counts.min() >= 3
        assert mesh.face_counts.sum() == mesh.face_indices.size
        assert np.unique(mesh.face_indices).tolist() == list(range(len(mesh.points)))
        corners = [values for values, _ in mesh.uvs.values()]
        corners += [] if mesh.normals is None else [mesh.normals]
        assert all(len(v) == mesh.face_indices.size and np.isfinite(v).all() for v in corners)
        assert mesh.colors is None or len(mesh.colors) == len(mesh.points)
        worn = [] if mesh.material is None else [mesh.material]
        assert set(worn + [s.material for s in mesh.subsets]) <= set(range(len(scene.materials)))


# Real and hostile files

TESTDATA = os.environ.get("HDRUSD_TESTDATA")
real_data = pytest.mark.skipif(TESTDATA is None, reason="HDRUSD_TESTDATA names no folder of models")


@real_data
@pytest.mark.parametrize(
    ("file", "meshes", "triangles"),
    [  # groups with faces, and the sum of corners - 2, counted in the files
        ("gazebo/prius_hybrid/meshes/Hybrid.obj", 7, 2180),
        ("gazebo/stop_light/meshes/stop_light.obj", 1, 260),
        ("gazebo/suv/meshes/suv.obj", 4, 1514),
        ("magnum-plugins/image-filename-backslash.obj", 1, 2),
        ("tinyobjloader/cornell_box_multimaterial.obj", 8, 36),
        ("tinyobjloader/issue-248-texres-texopt.obj", 6, 12),
        ("tinyobjloader/map-bump.obj", 1, 400),
        ("tinyobjloader/test-nan.obj", 8, 34),  # a quad of the floor is not finite
        ("tinyobjloader/usemtl-issue-104.obj", 1, 6),
        ("trimesh/nancolor.obj", 1, 12),
        ("trimesh/negative_indices.obj", 1, 12),
        ("assimp/invalid/malformed.obj", 1, 8),  # two of six quads name vertices 12 and 0
        ("hostile/bad_indices.obj", 0, 0),
        ("hostile/dev_zero.obj", 1, 2),
        ("hostile/long_line.obj", 1, 4),
        ("hostile/names.obj", 8, 16),
        ("hostile/nan_inf.obj", 0, 0),
        ("hostile/traversal_tex.obj", 1, 6),
    ],
)
def test_counts_of_real_files(file: str, meshes: int, triangles: int) -> None:
    assert TESTDATA is not None
    counts = load(Path(TESTDATA) / "data" / file).scene.counts()
    assert (counts["meshes"], counts["triangles"]) == (meshes, triangles)


@real_data
@pytest.mark.parametrize("file", ["empty.obj", "png_named.obj"])
def test_hostile_files_that_are_no_obj(file: str) -> None:
    assert TESTDATA is not None
    with pytest.raises(InputError, match=file):
        load(Path(TESTDATA) / "data" / "hostile" / file)


@real_data
def test_hostile_names_are_kept() -> None:
    assert TESTDATA is not None
    scene = load(Path(TESTDATA) / "data" / "hostile" / "names.obj").scene
    names = {mesh.name for mesh in scene.meshes}
    assert {"lamp post #1", "1abc", "日本語", "a.b-c", "__class__"} <= names
    assert {"métal", "a/b", ".", "路灯", "$(reboot)", "</Root>"} <= {
        m.name for m in scene.materials
    }


@real_data
def test_textures_outside_the_roots_are_refused_and_inside_found() -> None:
    assert TESTDATA is not None
    model = Path(TESTDATA) / "data" / "gazebo" / "stop_light"
    path = model / "meshes" / "stop_light.obj"
    refused, found = load(path), load(path, roots=(model,))
    assert refused.finding("file-refused").thing == "StopLight"
    assert refused.material.diffuse_map is not None
    assert refused.material.diffuse_map.image.missing
    assert refused.material.diffuse_map.image.name == "stop_light.png"
    assert found.material.diffuse_map is not None
    image = found.material.diffuse_map.image.path
    assert image == (model / "materials" / "textures" / "stop_light.png").resolve()


@pytest.mark.parametrize(
    "index", ["9" * 30, "-" + "9" * 30, "2147483648", "4294967297", "1" * 5000]
)
@pytest.mark.parametrize("beside", ["", "f 1 2 x\n"])
def test_an_index_too_large_for_any_integer_is_out_of_range(
    tmp_path: Path, index: str, beside: str
) -> None:
    loaded = load_text(tmp_path, f"{SQUARE}f 1 2 3\nf 1 2 {index}\n{beside}")
    assert loaded.mesh.face_counts.tolist() == [3]
    assert loaded.finding("face-index").source.place == 11
