"""COLLADA input that is out to break the reader, and the real files of the test data."""

from __future__ import annotations

import re
import time
import tracemalloc
import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from collada_builder import (
    bound,
    document,
    every_node,
    geometry,
    instance,
    load,
    material,
    names,
    source,
    triangles,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits, Resolver, read
from hdrusd.report import Report


def everything() -> str:
    """A document with some of all that is read."""
    sources = source("nn", "0 0 1", 3) + source("tt", "0 0 1 1", 2) + source("cc", "1 0 0 1", 4)
    more = (
        '<input semantic="NORMAL" source="#nn" offset="1"/>'
        '<input semantic="TEXCOORD" source="#tt" offset="2" set="0"/>'
        '<input semantic="COLOR" source="#cc" offset="3"/>'
    )
    quad = '<input semantic="VERTEX" source="#g-v" offset="0"/>'
    faces = (
        triangles("0 0 0 0 1 0 1 0 2 0 0 0", more)
        + f'<polylist count="1" material="m">{quad}<vcount>4</vcount><p>0 1 2 3</p></polylist>'
        + f'<polygons count="1">{quad}<p>0 1 2</p><ph><p>0 1 2</p><h>0 1 2</h></ph></polygons>'
        + f'<tristrips count="1">{quad}<p>0 1 3 2</p></tristrips>'
    )
    params = (
        '<newparam sid="sf"><surface><init_from>i</init_from></surface></newparam>'
        '<newparam sid="sm"><sampler2D><source>sf</source><wrap_s>CLAMP</wrap_s></sampler2D>'
        "</newparam>"
    )
    shader = (
        '<phong><diffuse><texture texture="sm" texcoord="U"/></diffuse><transparent '
        'opaque="RGB_ZERO"><color>.5 .5 .5 1</color></transparent><transparency><float>.5</float>'
        "</transparency></phong>"
    )
    move = (
        source("t", "0 1 2", 1)
        + source("v", "0 90 400", 1)
        + names("k", "LINEAR STEP BEZIER")
        + source("ta", "0 1 2 3 4 5", 2)
    )
    libraries = (
        '<library_images><image id="i"><init_from>file:///a%20b.png</init_from></image>'
        "</library_images>"
        + material(shader, params)
        + f"<library_geometries>{geometry(faces, sources)}</library_geometries>"
        '<library_controllers><controller id="c"><skin source="#g"><bind_shape_matrix>'
        "1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1</bind_shape_matrix></skin></controller>"
        "</library_controllers>"
        '<library_lights><light id="l"><technique_common><spot><color>1 1 1</color>'
        "<falloff_angle>45</falloff_angle></spot></technique_common><extra><technique "
        'profile="blender"><energy>9</energy></technique></extra></light></library_lights>'
        '<library_cameras><camera id="e"><optics><technique_common><perspective><xfov>50</xfov>'
        "<znear>.1</znear></perspective></technique_common></optics></camera></library_cameras>"
        f"<library_animations><animation>{move}"
        '<sampler id="sa"><input semantic="INPUT" source="#t"/><input semantic="OUTPUT" '
        'source="#v"/><input semantic="INTERPOLATION" source="#k"/><input semantic="IN_TANGENT" '
        'source="#ta"/><input semantic="OUT_TANGENT" source="#ta"/></sampler>'
        '<channel source="#sa" target="n/r.ANGLE"/></animation></library_animations>'
        '<library_nodes><node id="sub"><instance_controller url="#c"/></node></library_nodes>'
    )
    nodes = (
        '<node id="n"><translate sid="t">1 2 3</translate><rotate sid="r">0 0 1 90</rotate>'
        f"{instance(bound())}<instance_light url='#l'/><instance_camera url='#e'/>"
        '<node><lookat>0 0 5 0 0 0 0 1 0</lookat><instance_node url="#sub"/></node></node>'
    )
    return document(libraries, nodes, tool="Blender 2.93.0")


EVERYTHING = everything()
PARTS = re.findall(r'<[^>]*>|[^<>"\s]+|\s+', EVERYTHING)
WORD_LIST = (
    "-1 0 nan inf 1e400 4000000000 99999999999999999999 0,5 1,5.2 #g #n #gone x.dae#n \u00e9 &amp; "
    "<p> </p> <node> </node> <a/> <extra/> \0 LINEAR <float/> <color/>"
)
WORDS = st.sampled_from(["", "1 2 3", "<instance_node url='#n'/>", *WORD_LIST.split()])


@settings(
    max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.lists(st.tuples(st.integers(0, len(PARTS) - 1), WORDS), max_size=4))
def test_mutated_documents_convert_or_end_in_an_input_error(
    tmp_path: Path, changes: list[tuple[int, str]]
) -> None:
    parts = list(PARTS)
    for place, word in changes:
        parts[place] = word
    check(tmp_path, "".join(parts).encode("utf-8"))


ATTRIBUTES = sorted(set(re.findall(r'="[^"]*"', EVERYTHING)))
TEXTS = [t for t in re.findall(r">([^<>]+)<", EVERYTHING) if t.strip()]
NUMBERS = st.lists(
    st.sampled_from(["0", "1", "-1", "2", "7", "0.5", "nan", "1e300", "1e39", "9999999999", "1,5"]),
    max_size=18,
).map(" ".join)


@settings(
    max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.lists(st.tuples(st.sampled_from(ATTRIBUTES), st.sampled_from(ATTRIBUTES)), max_size=3),
    st.lists(st.tuples(st.sampled_from(TEXTS), NUMBERS), max_size=3),
)
def test_wrong_values_convert_or_end_in_an_input_error(
    tmp_path: Path, attributes: list[tuple[str, str]], texts: list[tuple[str, str]]
) -> None:
    text = EVERYTHING
    for before, after in attributes:
        text = text.replace(before, after, 1)
    for before, after in texts:
        text = text.replace(f">{before}<", f">{after}<", 1)
    check(tmp_path, text.encode())


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.binary(max_size=200), st.integers(0, len(EVERYTHING)), st.booleans())
def test_cut_and_stained_bytes_end_in_an_input_error_or_a_scene(
    tmp_path: Path, stain: bytes, at: int, cut: bool
) -> None:
    content = EVERYTHING.encode()
    check(tmp_path, content[:at] + stain + (b"" if cut else content[at + len(stain) :]))


def check(folder: Path, content: bytes) -> None:
    """An InputError, or a scene whose numbers fit one another and are finite."""
    try:
        scene, _ = load(folder, content)
    except InputError:
        return
    for node in every_node(scene.roots):
        assert all(0 <= m < len(scene.meshes) for m in node.meshes)
        assert all(0 <= m < len(scene.lights) for m in node.lights)
        assert all(0 <= m < len(scene.cameras) for m in node.cameras)
        if isinstance(node.transform, np.ndarray):
            assert np.isfinite(node.transform).all()
        for channel in node.animation:
            assert np.isfinite(channel.values).all()
            assert (np.diff(channel.times) > 0.0).all()
    for mesh in scene.meshes:
        corners = int(mesh.face_counts.sum())
        assert len(mesh.face_indices) == corners
        assert (mesh.face_counts >= 3).all()
        assert mesh.face_indices.min() >= 0
        assert mesh.face_indices.max() < len(mesh.points)
        assert np.isfinite(mesh.points).all()
        sizes = {"vertex": len(mesh.points), "faceVarying": corners}
        if mesh.normals is not None:
            assert len(mesh.normals) == sizes[mesh.normals_interpolation]
            assert np.isfinite(mesh.normals).all()
        for values, interpolation in mesh.uvs.values():
            assert len(values) == sizes[interpolation]
            assert np.isfinite(values).all()
        for number in [s.material for s in mesh.subsets] + [mesh.material or 0]:
            assert 0 <= number < max(len(scene.materials), 1)
    for light in scene.lights:
        assert np.isfinite([*light.diffuse, light.spot_cutoff, light.candela or 0.0]).all()


# -- XML -------------------------------------------------------------------------------------

BOMB = "".join(
    f'<!ENTITY {c} "{f"&{b};" * 10}">' for b, c in zip("abcdefghi", "bcdefghij", strict=True)
)


@pytest.mark.parametrize(
    ("head", "body"),
    [
        (f'<!DOCTYPE COLLADA [<!ENTITY a "aaaaaaaaaa">{BOMB}]>', "&j;"),
        ('<!DOCTYPE COLLADA [<!ENTITY x SYSTEM "file:///etc/passwd">]>', "&x;"),
        ('<!DOCTYPE COLLADA [<!ENTITY % x SYSTEM "file:///etc/passwd">%x;]>', ""),
        ('<!DOCTYPE COLLADA SYSTEM "http://127.0.0.1/x.dtd">', "&x;"),
        ("", "&x;"),
    ],
)
def test_entities_are_refused(tmp_path: Path, head: str, body: str) -> None:
    begin = time.monotonic()
    with pytest.raises(InputError, match=r"entit"):
        load(tmp_path, document(tool=body, head=head))
    assert time.monotonic() - begin < 2.0


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "empty file"),
        (b"\x89PNG\r\n\x1a\n", "not XML"),
        (b"<svg/>", "want COLLADA"),
        (b"<COLLADA>", "not XML: no element found"),
        (b"<?xml version='1.0' encoding='klingon'?><COLLADA/>", "not XML"),
        (b"PK\x03\x04 and no more", "not a ZIP archive"),
    ],
)
def test_what_is_no_collada(tmp_path: Path, content: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load(tmp_path, content)


def test_deep_xml_and_deep_nodes_end_in_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nested deeper"):
        load(tmp_path, document(nodes="<node>" * 60_000 + "</node>" * 60_000))
    chain = "".join(f'<node id="n{i}"><instance_node url="#n{i + 1}"/></node>' for i in range(2000))
    library = f'<library_nodes>{chain}<node id="n2000"/></library_nodes>'
    with pytest.raises(InputError, match="nested deeper"):
        load(tmp_path, document(library, '<node><instance_node url="#n0"/></node>'))


@pytest.mark.parametrize("ring", [["a"], ["a", "b"], ["a", "b", "c"]])
def test_nodes_that_contain_themselves_are_refused(tmp_path: Path, ring: list[str]) -> None:
    below = [*ring[1:], ring[0]]
    library = "".join(
        f'<node id="{n}"><instance_node url="#{m}"/></node>'
        for n, m in zip(ring, below, strict=True)
    )
    nodes = '<node id="r"><instance_node url="#a"/></node>'
    with pytest.raises(InputError, match="contains itself"):
        load(tmp_path, document(f"<library_nodes>{library}</library_nodes>", nodes))


def test_nodes_that_double_at_each_level_meet_the_limit(tmp_path: Path) -> None:
    library = "".join(
        f'<node id="n{i}"><instance_node url="#n{i + 1}"/><instance_node url="#n{i + 1}"/></node>'
        for i in range(60)
    )
    text = document(
        f'<library_nodes>{library}<node id="n60"/></library_nodes>',
        '<node><instance_node url="#n0"/></node>',
    )
    with pytest.raises(InputError, match="more than 5000 nodes"):
        load(tmp_path, text, limits=Limits(nodes=5000))


def test_controllers_that_name_one_another_end(tmp_path: Path) -> None:
    library = (
        '<library_controllers><controller id="a"><skin source="#b"/></controller>'
        '<controller id="b"><morph source="#a"/></controller></library_controllers>'
    )
    _, report = load(tmp_path, document(library, '<node><instance_controller url="#a"/></node>'))
    assert "collada-controller" in report.codes()


def test_params_that_name_one_another_end(tmp_path: Path) -> None:
    params = "".join(
        f'<newparam sid="{a}"><sampler2D><source>{b}</source></sampler2D></newparam>'
        for a, b in ("xy", "yx")
    )
    shader = '<phong><diffuse><texture texture="x" texcoord="U"/></diffuse></phong>'
    _, report = load(tmp_path, document(material(shader, params)))
    assert "texture-missing" in report.codes()


def test_declared_sizes_allocate_nothing(tmp_path: Path) -> None:
    text = EVERYTHING.replace('count="4"', 'count="4000000000"')
    text = text.replace("<vcount>4</vcount>", "<vcount>2000000000 2000000000</vcount>")
    text = text.replace('offset="1"', 'offset="4000000000"')
    tracemalloc.start()
    try:
        load(tmp_path, text)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 32 << 20


def test_an_archive_that_unpacks_without_end_is_refused(tmp_path: Path) -> None:
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.dae", b" " * (80 << 20))
    with pytest.raises(InputError, match="unpacks to more than"):
        load(tmp_path, packed.getvalue(), "a.zae")


def test_archives_that_are_broken_or_empty(tmp_path: Path) -> None:
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.dae", EVERYTHING)
    whole = packed.getvalue()
    stained = whole[:60] + b"\xff" * 40 + whole[100:]
    for content in (stained, whole[: len(whole) // 2]):
        with pytest.raises(InputError):
            load(tmp_path, content, "a.zae")
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("readme.txt", "nothing")
    with pytest.raises(InputError, match=r"without a \.dae"):
        load(tmp_path, packed.getvalue(), "a.zae")


# -- real files ------------------------------------------------------------------------------

#: Meshes, triangles, lights, cameras as other readers count them; unit in m; up axis. Lines are
#: no meshes here, and a skin's mesh is one.
REAL = {
    "assimp/Collada/cameras.dae": (0, 0, 0, 3, 1.0, "Z"),
    "assimp/Collada/cube_with_2UVs.DAE": (1, 12, 0, 0, 0.0254, "Z"),
    "assimp/Collada/earthCylindrical.DAE": (2, 1920, 0, 0, 0.01, "Z"),
    "assimp/Collada/lights.dae": (0, 0, 5, 0, 1.0, "Z"),
    "assimp/invalid/box_nested_animation_4286.dae": (1, 12, 0, 0, 1.0, "Z"),
    "gazebo/gas_station/meshes/gas_station.dae": (1, 4940, 1, 0, 0.0254, "Z"),
    "gazebo/house_1/meshes/house_1.dae": (1, 1884, 1, 0, 0.0254, "Z"),
    "gazebo/lamp_post/meshes/lamp_post.dae": (1, 270, 1, 0, 0.0254, "Z"),
    "gazebo/office_building/meshes/office_building.dae": (1, 2434, 3, 2, 0.0254, "Z"),
    "magnum-plugins/light.dae": (0, 0, 4, 0, 1.0, "Y"),
    "magnum-plugins/material-color.dae": (1, 1, 0, 0, 1.0, "Y"),
    "magnum-plugins/y-up.dae": (0, 0, 0, 0, 1.0, "Y"),
    "magnum-plugins/z-up.dae": (0, 0, 0, 0, 1.0, "Z"),
    "trimesh/cube_invalid_shininess.dae": (1, 12, 0, 0, 1.0, "Y"),
}
REFUSED = {
    "hostile/billion_laughs.dae": "entity",
    "hostile/bomb.zae": "unpacks",
    "hostile/empty.dae": "empty",
    "hostile/node_cycle.dae": "contains itself",
}


@pytest.mark.parametrize("name", REAL)
def test_real_files_have_what_others_count(testdata: Path, name: str) -> None:
    path = testdata / "data" / name
    report = Report()
    scene = read(Resolver(path, report, [path.parents[1]]), report)
    counts = scene.counts()
    found = tuple(counts[key] for key in ("meshes", "triangles", "lights", "cameras"))
    assert (*found, scene.unit_m, scene.up) == REAL[name]


@pytest.mark.parametrize("name", REFUSED)
def test_hostile_files_are_refused(testdata: Path, name: str) -> None:
    begin = time.monotonic()
    resolver = Resolver(testdata / "data" / name, Report())
    with pytest.raises(InputError, match=REFUSED[name]):
        read(resolver, Report())
    assert time.monotonic() - begin < 10.0


def test_no_file_of_the_data_is_forgotten(testdata: Path) -> None:
    data = testdata / "data"
    found = {
        path.relative_to(data).as_posix()
        for path in data.rglob("*")
        if path.suffix.lower() in (".dae", ".zae", ".kmz")
    }
    assert found == set(REAL) | set(REFUSED)


def test_a_lamp_post_has_its_textures(testdata: Path) -> None:
    path = testdata / "data/gazebo/lamp_post/meshes/lamp_post.dae"
    report = Report()
    scene = read(Resolver(path, report, [path.parents[1]]), report)
    (made,) = scene.materials
    assert made.diffuse_map is not None
    assert made.diffuse_map.image.path is not None
    assert made.diffuse_map.image.path.name == "Lamp_Post_Diffuse.png"
    assert made.emission_map is not None
    assert made.alpha == 1.0


def test_the_skin_of_a_file_with_false_counts_is_in_place(testdata: Path) -> None:
    # the armature stands at (1, -1, 0), the cube is bound at (-1, 1, 1) in it: its middle comes
    # to lie at (0, 0, 1)
    path = testdata / "data/assimp/invalid/box_nested_animation_4286.dae"
    report = Report()
    scene = read(Resolver(path, report), report)
    assert {"collada-count", "collada-bind-shape"} <= report.codes()
    (armature,) = scene.roots
    bone, cube = armature.children
    (skin,) = scene.skins
    assert (cube.skin, skin.joints) == (0, (bone,))
    assert scene.meshes[0].joint_weights.tolist() == [[1.0]] * 8
    # The joint at rest, as its matrix says before the animation.
    joint = np.array(
        [
            [0.7886751, -0.5773503, -0.211325, 0],
            [0.2113248, 0.5773503, -0.7886751, 0],
            [0.5773503, 0.5773503, 0.5773502, 0],
            [0, 0, 0, 1],
        ]
    ).T
    place = skin.inverse_binds[0] @ joint @ armature.transform
    # The numbers of the file have seven digits.
    assert place == pytest.approx(
        np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]]), abs=1e-6
    )
    assert bone.animation
    assert bone.animation[0].times[0] == pytest.approx(0.04166662)
    assert len(bone.animation[0].times) == 40
