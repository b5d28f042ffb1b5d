"""COLLADA geometry, units and the tree."""

from __future__ import annotations

import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from collada_builder import (
    SQUARE,
    bound,
    document,
    every_node,
    geometry,
    instance,
    load,
    material,
    mesh_document,
    source,
    triangles,
)

from hdrusd.importers.collada_geometry import face_normals
from hdrusd.importers.importer import Resolver, read
from hdrusd.legacy.scene import Mesh
from hdrusd.report import Kind, Report

QUAD = '<input semantic="VERTEX" source="#g-v" offset="0"/>'


def only_mesh(folder: Path, text: str) -> tuple[Mesh, Report]:
    """The one mesh of a document."""
    scene, report = load(folder, text)
    (mesh,) = scene.meshes
    return mesh, report


@pytest.mark.parametrize(
    ("faces", "counts", "indices"),
    [
        (f'<triangles count="2">{QUAD}<p>0 1 2 0 2 3</p></triangles>', [3, 3], [0, 1, 2, 0, 2, 3]),
        (
            f'<polylist count="2">{QUAD}<vcount>4 3</vcount><p>0 1 2 3 0 1 2</p></polylist>',
            [4, 3],
            [0, 1, 2, 3, 0, 1, 2],
        ),
        (
            f'<polygons count="2">{QUAD}<p>0 1 2</p><p>0 1 2 3</p></polygons>',
            [3, 4],
            [0, 1, 2, 0, 1, 2, 3],
        ),
        # strips turn every second triangle over (COLLADA 1.4.1, tristrips)
        (f'<tristrips count="1">{QUAD}<p>0 1 3 2</p></tristrips>', [3, 3], [0, 1, 3, 1, 2, 3]),
        (f'<trifans count="1">{QUAD}<p>0 1 2 3</p></trifans>', [3, 3], [0, 1, 2, 0, 2, 3]),
    ],
)
def test_each_kind_of_faces(
    tmp_path: Path, faces: str, counts: list[int], indices: list[int]
) -> None:
    mesh, _ = only_mesh(tmp_path, mesh_document(faces))
    assert mesh.face_counts.tolist() == counts
    assert mesh.face_indices.tolist() == indices
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert mesh.points.dtype == np.float32


def test_strips_wind_as_their_first_triangle(tmp_path: Path) -> None:
    faces = f'<tristrips count="2">{QUAD}<p>0 1 3 2</p><p>0 1 3</p></tristrips>'
    mesh, _ = only_mesh(tmp_path, mesh_document(faces))
    corners = mesh.points[mesh.face_indices].astype(np.float64)
    assert (face_normals(corners, mesh.face_counts.astype(np.int64)) == (0, 0, 1)).all()


def test_corners_with_normals_coordinates_and_colours_of_their_own(tmp_path: Path) -> None:
    sources = (
        source("nn", "0 0 1  0 1 0", 3)
        + source("t0", "0 0  .25 .5", 2)
        + source("t1", "1 1 0  .5 .75 0", 3)
        + source("cc", "1 0 0 .5", 4)
    )
    more = (
        '<input semantic="NORMAL" source="#nn" offset="1"/>'
        '<input semantic="TEXCOORD" source="#t0" offset="2" set="3"/>'
        '<input semantic="TEXCOORD" source="#t1" offset="3" set="7"/>'
        '<input semantic="COLOR" source="#cc" offset="4"/>'
    )
    text = mesh_document(triangles("0 0 0 1 0  1 1 1 0 0  2 0 0 0 0", more), sources)
    mesh, report = only_mesh(tmp_path, text)
    assert mesh.normals is not None
    assert mesh.normals.tolist() == [[0, 0, 1], [0, 1, 0], [0, 0, 1]]
    assert mesh.normals_interpolation == "faceVarying"
    assert mesh.uvs["st"][0].tolist() == [[0, 0], [0.25, 0.5], [0, 0]]
    assert mesh.uvs["st1"][0].tolist() == [[0.5, 0.75], [1, 1], [1, 1]]
    assert mesh.colors is not None
    assert mesh.colors.tolist() == [[1, 0, 0, 0.5]] * 3
    assert len(mesh.points) == 3  # the fourth is used by no face
    assert "texcoord-depth" not in report.codes()  # it is 0 throughout


def test_an_input_by_the_points_own_numbers_is_for_points(tmp_path: Path) -> None:
    more = '<input semantic="TEXCOORD" source="#t" offset="0"/>'
    text = mesh_document(
        triangles("0 1 2 0 2 3").replace("<p>", more + "<p>"), source("t", "0 0 1 0 1 1 0 1", 2)
    )
    mesh, _ = only_mesh(tmp_path, text)
    values, interpolation = mesh.uvs["st"]
    assert interpolation == "vertex"
    assert values.tolist() == [[0, 0], [1, 0], [1, 1], [0, 1]]


def test_a_normal_of_length_0_becomes_that_of_its_face(tmp_path: Path) -> None:
    more = '<input semantic="NORMAL" source="#nn" offset="1"/>'
    text = mesh_document(triangles("0 0 1 1 2 0", more), source("nn", "1 0 0  0 0 0", 3))
    mesh, report = only_mesh(tmp_path, text)
    assert mesh.normals is not None
    assert mesh.normals.tolist() == [[1, 0, 0], [0, 0, 1], [1, 0, 0]]
    assert "mesh-normals" in report.codes()


def test_normals_of_polygons_are_square_to_them() -> None:
    # a unit square in the plane y = 5, a triangle x + y + z = 1, and one without area
    points = np.array(
        [[0, 5, 0], [0, 5, 1], [1, 5, 1], [1, 5, 0]]
        + [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        + [[2, 2, 2]] * 3,
        np.float64,
    )
    found = face_normals(points, np.array([4, 3, 3]))
    third = 1.0 / np.sqrt(3.0)
    assert np.allclose(found, [[0, 1, 0], [third] * 3, [0, 0, 1]], atol=1e-15)


def test_primitives_with_the_same_inputs_are_one_mesh_with_subsets(tmp_path: Path) -> None:
    faces = triangles("0 1 2", material="a") + triangles("0 2 3", material="b")
    bind = bound("", "m", "a") + bound("", "q", "b")
    bind = bind.replace("</technique_common></bind_material><bind_material><technique_common>", "")
    libraries = material(name="m") + material(name="q")
    scene, _ = load(tmp_path, mesh_document(faces, bind=bind, libraries=libraries))
    (mesh,) = scene.meshes
    assert mesh.material is None
    worn = {scene.materials[s.material].name: s.faces.tolist() for s in mesh.subsets}
    assert worn == {"m": [0], "q": [1]}


def test_counts_are_not_believed(tmp_path: Path) -> None:
    text = mesh_document(triangles("0 1 2"), points=SQUARE)
    text = text.replace('count="1" material', 'count="99999999999" material')
    text = text.replace('count="12"', 'count="3"').replace('count="4"', 'count="4000000000"')
    mesh, report = only_mesh(tmp_path, text)
    assert mesh.face_counts.tolist() == [3]
    assert "collada-count" in report.codes()


def test_what_cannot_be_used_is_dropped_by_face(tmp_path: Path) -> None:
    faces = (
        f'<polylist count="5">{QUAD}<vcount>3 2 3 3 3</vcount>'
        "<p>0 1 2  0 1  0 1 9  0 1 4  0 2 3</p></polylist>"
    )
    mesh, report = only_mesh(tmp_path, mesh_document(faces, points=f"{SQUARE} nan 0 0"))
    assert mesh.face_indices.tolist() == [0, 1, 2, 0, 2, 3]
    assert {"collada-faces", "face-point"} <= report.codes()


def test_decimal_commas_are_points_and_said_once(tmp_path: Path) -> None:
    text = mesh_document(triangles("0 1 2"), points="0,0 0 0  1,5 0 0  1 2,25 0")
    mesh, report = only_mesh(tmp_path, text.replace('meter="1"', 'meter="0,0254"'))
    assert mesh.points.tolist() == [[0, 0, 0], [1.5, 0, 0], [1, 2.25, 0]]
    assert [f.code for f in report].count("decimal-comma") == 1


@pytest.mark.parametrize(
    ("asset", "unit", "up"),
    [
        ('<unit name="inch" meter="0.0254"/><up_axis>Z_UP</up_axis>', 0.0254, "Z"),
        ('<unit meter="1"/>', 1.0, "Y"),
        ('<unit meter="-3"/><up_axis>SIDEWAYS</up_axis>', 1.0, "Y"),
    ],
)
def test_units_and_axes(tmp_path: Path, asset: str, unit: float, up: str) -> None:
    scene, report = load(tmp_path, document(asset=asset))
    assert (scene.unit_m, scene.up) == (unit, up)
    assert ("collada-asset" in report.codes()) == ("-3" in asset)


def test_with_x_up_the_scene_is_turned(tmp_path: Path) -> None:
    scene, report = load(tmp_path, document(nodes="<node/>", asset="<up_axis>X_UP</up_axis>"))
    (root,) = scene.roots
    assert scene.up == "Y"
    turned = np.array([1.0, 2.0, 3.0, 1.0]) @ root.transform
    assert turned.tolist() == [-2, 1, 3, 1]  # right is -Y, up +X, towards the eye +Z
    assert "collada-up-axis" in report.codes()


def test_an_asset_used_300_times_is_one_mesh(tmp_path: Path) -> None:
    library = (
        f"<library_geometries>{geometry(triangles('0 1 2'))}</library_geometries><library_nodes>"
        f'<node id="pole">{instance()}</node></library_nodes>'
    )
    nodes = "".join(
        f'<node id="n{i}"><translate>{i} 0 0</translate><instance_node url="#pole"/></node>'
        for i in range(300)
    )
    scene, _ = load(tmp_path, document(library, nodes))
    assert len(scene.meshes) == 1
    placed = [n for n in every_node(scene.roots) if n.meshes == [0]]
    assert len(placed) == 300


def test_an_instance_may_bind_another_material(tmp_path: Path) -> None:
    library = f"<library_geometries>{geometry(triangles('0 1 2'))}</library_geometries>"
    libraries = library + material(name="m") + material(name="q")
    nodes = "".join(f"<node>{instance(bound('', target))}</node>" for target in "mqm")
    scene, _ = load(tmp_path, document(libraries, nodes))
    assert [node.meshes for node in scene.roots] == [[0], [1], [0]]
    assert scene.meshes[0].points is scene.meshes[1].points
    assert [scene.materials[m.material or 0].name for m in scene.meshes] == ["m", "q"]


def test_a_skin_without_joints_stays_in_its_bind_shape(tmp_path: Path) -> None:
    library = (
        f"<library_geometries>{geometry(triangles('0 1 2'))}</library_geometries>"
        '<library_controllers><controller id="c"><skin source="#g"><bind_shape_matrix>'
        "1 0 0 5  0 1 0 6  0 0 1 7  0 0 0 1</bind_shape_matrix></skin></controller>"
        "</library_controllers>"
    )
    scene, report = load(
        tmp_path, document(library, '<node><instance_controller url="#c"/></node>')
    )
    (inner,) = scene.roots[0].children
    assert inner.meshes == [0]
    assert inner.transform[3].tolist() == [5, 6, 7, 1]
    assert "skin-dropped" in report.codes()


def test_what_has_no_reader_is_a_finding_with_its_line(tmp_path: Path) -> None:
    text = document("\n<library_physics_models/>", '\n<node id="n"><portal/></node>')
    _, report = load(tmp_path, text)
    lines = {f.source.place for f in report if f.code == "collada-element"}
    assert lines == {2, 3}
    assert all(f.kind is Kind.DROPPED for f in report if f.code == "collada-element")


@pytest.mark.parametrize("manifest", [True, False])
def test_an_archive_holds_document_and_pictures(tmp_path: Path, manifest: bool) -> None:
    images = (
        '<library_images><image id="i"><init_from>images/wall%201.png</init_from></image>'
        "</library_images>"
    )
    shader = '<phong><diffuse><texture texture="i" texcoord="U"/></diffuse></phong>'
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        if manifest:
            archive.writestr("manifest.xml", "<dae_root>./models/a.dae</dae_root>")
        archive.writestr("models/a.dae", document(images + material(shader)))
        archive.writestr("images/Wall 1.png", b"picture")
    path = tmp_path / "a.zae"
    path.write_bytes(packed.getvalue())
    report = Report()
    scene = read(Resolver(path, report), report)
    assert scene.format == "collada"
    texture = scene.materials[0].diffuse_map
    assert texture is not None
    assert texture.image.data == b"picture"


def test_text_in_latin_1_that_says_utf_8_is_mended(tmp_path: Path) -> None:
    content = document(nodes='<node name="Straße"/>').encode("latin-1")
    scene, report = load(tmp_path, content)
    assert scene.roots[0].name == "Straße"
    assert "encoding" in report.codes()


def test_without_a_named_scene_the_first_is_read(tmp_path: Path) -> None:
    text = document(nodes='<node name="n"/>').replace('url="#s"', 'url="#gone"')
    scene, report = load(tmp_path, text)
    assert [node.name for node in scene.roots] == ["n"]
    assert {"collada-reference", "scenes-other"} <= report.codes()
