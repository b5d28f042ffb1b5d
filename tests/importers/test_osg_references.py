"""OpenSceneGraph: files that ProxyNode and PagedLOD name, in every form and of other formats."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from flt_builder import one_square
from osg_builder import (
    HEADER,
    SQUARE,
    Loaded,
    geode,
    geometry,
    group,
    load,
    material,
    old_geode,
    old_geometry,
    old_group,
    scene,
    state_set,
)

from hdrusd.errors import InputError
from hdrusd.importers import importer
from hdrusd.importers.assimp_library import find_library
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.importers.osg_transforms import rotation_matrix
from hdrusd.legacy.scene import TRS
from hdrusd.report import Kind, Report

needs_osgconv = pytest.mark.skipif(
    shutil.which("osgconv") is None, reason="osgconv is missing; it is in openscenegraph"
)
OBJ = "v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n"


def proxy(*names: str, children: str = "", fields: str = "") -> str:
    """A ProxyNode."""
    listed = "\n".join(f'"{name}" ' for name in names)
    inside = f"Children 1 {{\n{children}\n}}\n" if children else ""
    files = f"FileNames {len(names)} {{\n{listed}\n}}"
    return f"osg::ProxyNode {{\n{fields}\n{files}\n{inside}}}"


def paged(ranges: str, *names: str, children: tuple[str, ...] = (), fields: str = "") -> str:
    """A PagedLOD, whose ranges are lines."""
    listed = "\n".join(f'"{name}" ' for name in names)
    count = len(ranges.splitlines())
    inside = "\n".join(children)
    return (
        f"osg::PagedLOD {{\n{fields}\nRangeList {count} {{\n{ranges}\n}}\n"
        f"RangeDataList {len(names)} {{\n{listed}\n}}\n"
        f"Children {len(children)} {{\n{inside}\n}}\n}}"
    )


def square(folder: Path, name: str, *, node: str = "part") -> None:
    """A file with a square."""
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(HEADER + geode(geometry(), fields=f'Name "{node}" ') + "\n")


def read(file: Path, *, roots: tuple[Path, ...] = (), limits: Limits | None = None) -> Loaded:
    """A file by its suffix."""
    report = Report()
    resolver = Resolver(file, report, roots, limits=limits or Limits())
    return Loaded(importer.read(resolver, report), report)


# --- files of OpenSceneGraph itself -------------------------------------------------------


def test_a_file_is_read_once_for_all_its_uses(tmp_path: Path) -> None:
    square(tmp_path, "parts/lamp.osgt")
    text = scene(*(proxy("parts/lamp.osgt") for _ in range(3)))
    made = load(tmp_path, text)
    places = [child.children for child in made.root.children]
    assert [[node.name for node in nodes] for nodes in places] == [["part"]] * 3
    assert len({id(nodes[0]) for nodes in places}) == 1  # one prototype
    assert len(made.scene.meshes) == 1
    assert not made.codes()


def test_names_of_windows_and_of_the_older_text(tmp_path: Path) -> None:
    square(tmp_path, "parts/lamp.osgt")
    made = load(tmp_path, scene(proxy("parts\\\\lamp.osgt")))
    assert made.node("part").meshes == [0]
    old = "ProxyNode {\nFileNameList 1 {\nparts/lamp.osgt\n}\nnum_children 0\n}"
    assert load(tmp_path, old).node("part").meshes == [0]


def test_a_file_is_below_the_state_of_its_node(tmp_path: Path) -> None:
    """What OpenSceneGraph draws: materials of the part hold unless those above override them."""
    red = material('Name "red" \nDiffuse TRUE Front 1 0 0 1 Back 1 0 0 1 ', "OVERRIDE")
    blue = material('Name "blue" \nDiffuse TRUE Front 0 0 1 1 Back 0 0 1 1 ')
    part = geode(geometry(), fields=state_set(attributes=blue))
    (tmp_path / "part.osgt").write_text(HEADER + part)
    plain, under = proxy("part.osgt"), proxy("part.osgt", fields=state_set(attributes=red))
    made = load(tmp_path, scene(plain, under))
    worn = [made.scene.meshes[child.children[0].meshes[0]] for child in made.root.children]
    names = [made.scene.materials[mesh.material or 0].name for mesh in worn]
    assert names == ["blue", "red"]
    assert worn[0].points is worn[1].points


def test_pictures_are_looked_for_beside_the_file_that_names_them(tmp_path: Path) -> None:
    wall = old_geode(
        old_geometry(), fields="StateSet {\nGL_TEXTURE_2D ON\nTexture2D {\nfile w.png\n}\n}"
    )
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "w.png").touch()
        (tmp_path / folder / "wall.osg").write_text(wall)
    (tmp_path / "a" / "again.osg").write_text(wall)
    made = load(tmp_path, scene(proxy("a/wall.osg", "a/again.osg", "b/wall.osg")))
    paths = [m.diffuse_map.image.path for m in made.scene.materials if m.diffuse_map]
    assert paths == [tmp_path / "a/w.png", tmp_path / "b/w.png"]  # one picture, one material


def test_the_database_path(tmp_path: Path) -> None:
    square(tmp_path, "tiles/a.osgt", node="right")
    square(tmp_path, "a.osgt", node="wrong")
    for text, wanted in (
        (paged("0 9", "a.osgt", fields='DatabasePath TRUE "tiles/" '), "right"),
        (proxy("a.osgt", fields='DatabasePath "tiles" '), "right"),
        (paged("0 9", "a.osgt", fields="DatabasePath FALSE "), "wrong"),
        # of another machine
        (paged("0 9", "tiles/a.osgt", fields='DatabasePath TRUE "/data/x" '), "right"),
    ):
        made = load(tmp_path, scene(text))
        assert [node.name for node in made.root.children[0].children] == [wanted]
        assert not made.codes()


def test_levels_in_other_files(tmp_path: Path) -> None:
    for name in ("mid", "fine"):
        square(tmp_path, f"{name}.osgt", node=name)
    far = group(fields='Name "far" ')
    node = paged("500 9000\n100 500\n0 100", "", "mid.osgt", "fine.osgt", children=(far,))
    made = load(tmp_path, HEADER + node)
    assert made.root.kind == "lod"
    assert [child.name for child in made.root.children] == ["far", "mid", "fine"]
    assert made.root.lod_ranges == ((500, 9000), (100, 500), (0, 100))
    # The file's own child may stand anywhere among the names.
    node = paged("0 100\n500 9000\n100 500", "fine.osgt", "", "mid.osgt", children=(far,))
    made = load(tmp_path, HEADER + node)
    assert [child.name for child in made.root.children] == ["fine", "far", "mid"]
    assert made.root.lod_ranges == ((0, 100), (500, 9000), (100, 500))


def test_a_level_whose_file_is_missing_is_left_out(tmp_path: Path) -> None:
    square(tmp_path, "fine.osgt", node="fine")
    far = group(fields='Name "far" ')
    node = paged("500 9000\n100 500\n0 100", "", "mid.osgt", "fine.osgt", children=(far,))
    made = load(tmp_path, HEADER + node)
    assert [child.name for child in made.root.children] == ["far", "fine"]
    assert made.root.lod_ranges == ((500, 9000), (0, 100))
    assert made.root.extras == {"files": ("mid.osgt",)}
    assert made.finding("file-missing").text.startswith("mid.osgt: not found")


def test_a_level_of_several_nodes_is_one(tmp_path: Path) -> None:
    two = old_geode(old_geometry(), fields='name "a"') + old_geode(fields='name "b"')
    (tmp_path / "two.osg").write_text(two)
    made = load(tmp_path, HEADER + paged("0 9", "two.osg"))
    (level,) = made.root.children
    assert (level.name, [child.name for child in level.children]) == ("two", ["a", "b"])
    assert made.root.lod_ranges == ((0, 9),)


def test_contents_that_stand_in_the_file_too(tmp_path: Path) -> None:
    """As ``includeExternalReferences`` writes: names and children are as many."""
    square(tmp_path, "a.osgt", node="file")
    made = load(tmp_path, scene(proxy("a.osgt", children=group(fields='Name "here" '))))
    assert [node.name for node in made.root.children[0].children] == ["here"]
    # But "" stands for a child, and the other name for a file.
    made = load(tmp_path, scene(proxy("", "a.osgt", children=group(fields='Name "here" '))))
    assert [node.name for node in made.root.children[0].children] == ["here", "file"]


# --- what leads nowhere -------------------------------------------------------------------


def test_files_that_lead_back(tmp_path: Path) -> None:
    (tmp_path / "b.osgt").write_text(scene(proxy("scene.osgt"), proxy("b.osgt")))
    made = load(tmp_path, scene(proxy("b.osgt"), proxy("scene.osgt")))
    texts = sorted(f.text for f in made.report if f.code == "osg-cycle")
    assert texts == [
        "b.osgt leads back to this file; cut here",
        "scene.osgt leads back to this file; cut here",
        "scene.osgt leads back to this file; cut here",
    ]


def test_broken_files_and_unknown_formats(tmp_path: Path) -> None:
    (tmp_path / "empty.osgt").touch()
    (tmp_path / "tile.osgb").write_bytes(b"no such file")
    (tmp_path / "cow.osgt.5.scale").touch()
    (tmp_path / "broken.obj").write_bytes(b"\0\0")
    names = ("empty.osgt", "tile.osgb", "cow.osgt.5.scale", "broken.obj")
    made = load(tmp_path, scene(proxy(*names), geode(geometry())))
    texts = [f.text for f in made.report if f.code == "osg-external"]
    assert len(texts) == 4
    assert all(name in text for name, text in zip(names, texts, strict=True))
    assert all("left out" in text for text in texts)
    assert len(made.scene.meshes) == 1


def test_no_file_outside_the_roots(tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    square(tmp_path, "secret.osgt")
    (home / "link.osgt").symlink_to(tmp_path / "secret.osgt")
    text = scene(
        proxy("../secret.osgt", str(tmp_path / "secret.osgt"), "link.osgt"),
        paged("0 9", "secret.osgt", fields='DatabasePath TRUE "../" '),
    )
    made = load(home, text)
    assert not made.scene.meshes
    assert made.codes() == {"file-refused", "file-missing"}
    allowed = read(home / "scene.osgt", roots=(tmp_path,))
    assert len(allowed.scene.meshes) == 1


def test_names_that_are_no_paths(tmp_path: Path) -> None:
    made = load(
        tmp_path, scene(proxy("x" * 5000 + ".osgt", fields=f'DatabasePath "{"y/" * 9000}" '))
    )
    assert made.codes() == {"file-missing"}


def test_all_files_share_the_limits(tmp_path: Path) -> None:
    for name in ("a", "b", "c"):
        square(tmp_path, f"{name}.osgt")
    text = scene(proxy("a.osgt", "b.osgt", "c.osgt"))
    load(tmp_path, text, limits=Limits(vertices=12))
    with pytest.raises(InputError, match="more than 11 points with the files"):
        load(tmp_path, text, limits=Limits(vertices=11))
    load(tmp_path, text, limits=Limits(nodes=11))  # 2 nodes; 3 names, 3 nodes, 3 drawables
    with pytest.raises(InputError, match="more than 10 nodes"):
        load(tmp_path, text, limits=Limits(nodes=10))
    with pytest.raises(InputError, match="more than 4 nodes"):
        load(tmp_path, scene(proxy("none", "none", "none")), limits=Limits(nodes=4))
    for name, inner in (("e", "f"), ("f", "g"), ("g", "none")):  # two nodes a file
        (tmp_path / f"{name}.osgt").write_text(scene(proxy(f"{inner}.osgt")))
    load(tmp_path, scene(proxy("e.osgt")), limits=Limits(depth=8))
    with pytest.raises(InputError, match="nodes deeper than 7"):
        load(tmp_path, scene(proxy("e.osgt")), limits=Limits(depth=7))


# --- other formats ------------------------------------------------------------------------


def world(made: Loaded, holder: str) -> np.ndarray:
    """The points of the first mesh below a node, by the transform of that node's child."""
    (part,) = made.node(holder).children
    node, matrix = part, np.eye(4)
    while True:
        if isinstance(node.transform, np.ndarray):
            matrix = node.transform @ matrix
        if node.meshes:
            points = made.scene.meshes[node.meshes[0]].points
            return np.asarray(points @ matrix[:3, :3] + matrix[3, :3])
        node = node.children[0]


def test_an_obj_is_turned_as_openscenegraph_turns_it(tmp_path: Path) -> None:
    """As osgconv 3.6.5 does: its vertex (0, 2, 0) is then (0, 0, 2)."""
    (tmp_path / "t.obj").write_text(OBJ)
    made = load(tmp_path, scene(proxy("t.obj", fields='Name "p" '), geode(geometry())))
    assert world(made, "p").tolist() == [[0, 0, 0], [1, 0, 0], [0, 0, 2]]
    found = made.finding("osg-external-axes")
    assert (found.kind, found.thing) == (Kind.ASSUMED, "t.obj")
    assert "Y up is turned to Z up, 1 unit is 1 unit" in found.text
    assert "unplaced" not in made.codes()


def test_an_openflight_file_comes_in_metres(tmp_path: Path) -> None:
    """OpenSceneGraph's reader converts to metres unless told noUnitsConversion."""
    (tmp_path / "feet.flt").write_bytes(one_square(unit=4))
    (tmp_path / "metres.flt").write_bytes(one_square())
    made = load(tmp_path, scene(proxy("feet.flt", fields='Name "f" '), proxy("metres.flt")))
    (feet,), (metres,) = (node.children for node in made.root.children)
    assert np.allclose(np.asarray(feet.transform), np.diag((0.3048,) * 3 + (1.0,)), rtol=1e-15)
    assert metres.transform is None
    texts = [f.text for f in made.report if f.code == "osg-external-axes"]
    assert "units of 0.3048 m are scaled to metres" in texts[0]
    assert "in metres" in texts[1]


PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 2 0\n3 0 1 2\n"
)
STL = (
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 2 0\n"
    "endloop\nendfacet\nendsolid a\n"
)
AC = (
    'AC3Db\nMATERIAL "m" rgb 1 1 1  amb 0 0 0  emis 0 0 0  spec 0 0 0  shi 10  trans 0\n'
    'OBJECT world\nkids 1\nOBJECT poly\nname "r"\nnumvert 3\n0 0 0\n1 0 0\n0 2 0\n'
    "numsurf 1\nSURF 0x20\nmat 0\nrefs 3\n0 0 0\n1 0 0\n2 0 0\nkids 0\n"
)
DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>
<created>2020-01-01T00:00:00</created><modified>2020-01-01T00:00:00</modified>
<unit name="inch" meter="0.0254"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a" count="9">0 0 0 1 0 0 0 2 0</float_array><technique_common>
<accessor source="#a" count="3" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node id="n">
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""


@needs_osgconv
@pytest.mark.parametrize(
    ("suffix", "content"),
    [
        (".obj", OBJ.encode()),
        (".dae", DAE.encode()),
        (".ply", PLY.encode()),
        (".stl", STL.encode()),
        (".ac", AC.encode()),
    ],
)
def test_other_formats_stand_as_openscenegraph_places_them(
    tmp_path: Path, suffix: str, content: bytes
) -> None:
    if suffix in (".ply", ".stl", ".ac") and find_library() is None:
        pytest.skip("assimp is missing; pip install 'hdrusd[assimp]'")
    (tmp_path / f"t{suffix}").write_bytes(content)
    convert(tmp_path, f"t{suffix}", "theirs.osgt")
    theirs = read(tmp_path / "theirs.osgt")
    ours = load(tmp_path, scene(proxy(f"t{suffix}")))
    box = [np.sort(corners(made), axis=0)[[0, -1]] for made in (ours, theirs)]
    assert np.allclose(box[0], box[1], rtol=1e-5, atol=1e-5)  # the text has six digits


def corners(made: Loaded) -> np.ndarray:
    """All points, where their nodes place them."""
    found = []
    stack = [(root, np.eye(4)) for root in made.scene.roots]
    while stack:
        node, above = stack.pop()
        matrix = above
        if isinstance(node.transform, TRS):
            matrix = np.diag((*node.transform.scale, 1.0)) @ rotation_matrix(
                node.transform.rotation
            )
            matrix[3, :3] = node.transform.translation
            matrix = matrix @ above
        elif node.transform is not None:
            matrix = node.transform @ above
        for mesh in node.meshes:
            found.append(made.scene.meshes[mesh].points @ matrix[:3, :3] + matrix[3, :3])
        stack += [(child, matrix) for child in node.children]
    return np.concatenate(found)


def test_another_format_is_read_once_and_keeps_its_tables_apart(tmp_path: Path) -> None:
    (tmp_path / "t.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n")
    (tmp_path / "t.obj").write_text(
        "mtllib t.mtl\nv 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nusemtl red\nf 1 2 3\n"
        "usemtl blue\nf 1 2 4\n"
    )
    white = material('Name "white" \nDiffuse TRUE Front 1 1 1 1 Back 1 1 1 1 ')
    own = geode(geometry(), fields=state_set(attributes=white))
    made = load(tmp_path, scene(own, proxy("t.obj"), proxy("t.obj")))
    first, second = (node.children[0] for node in made.root.children[1:])
    assert first is second
    assert [m.name for m in made.scene.materials] == ["white", "red", "blue"]
    mesh = made.scene.meshes[1]
    assert [subset.material for subset in mesh.subsets] == [1, 2]


def test_points_of_other_formats_count(tmp_path: Path) -> None:
    (tmp_path / "t.obj").write_text(OBJ)
    text = scene(geode(geometry()), proxy("t.obj"))
    assert len(load(tmp_path, text, limits=Limits(vertices=7)).scene.meshes) == 2
    made = load(tmp_path, text, limits=Limits(vertices=6))
    assert len(made.scene.meshes) == 1
    assert "more than 6 points" in made.finding("osg-external").text


# --- forms --------------------------------------------------------------------------------


@needs_osgconv
@pytest.mark.parametrize("suffix", [".osgt", ".osgb", ".ive"])
def test_every_form_names_its_files(tmp_path: Path, suffix: str) -> None:
    """One database, written by osgconv in each form."""
    part = old_geode(old_geometry(points=SQUARE), fields='name "part"')
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "part.osg").write_text(part)
    convert(tmp_path, "sub/part.osg", f"sub/part{suffix}")
    name = f"sub/part{suffix}"
    far = old_group(fields='name "far"')
    levels = (
        'PagedLOD {\nname "levels"\nRangeList 2 {\n100 9000\n0 100\n}\n'
        f'FileNameList 2 {{\n""\n{name}\n}}\nnum_children 1\n{far}}}\n'
    )
    town = old_group(levels, levels, fields='name "town"')
    (tmp_path / "town.osg").write_text(town)
    convert(tmp_path, "town.osg", f"town{suffix}")
    made = read(tmp_path / f"town{suffix}")
    for levels_node in made.root.children:
        assert [child.name for child in levels_node.children] == ["far", "part"]
        assert levels_node.lod_ranges == ((100, 9000), (0, 100))
    assert made.root.children[0].children[1] is made.root.children[1].children[1]
    assert len(made.scene.meshes) == 1
    assert made.codes() <= {"worker-unconfined"}


def convert(folder: Path, source: str, target: str) -> None:
    """Run osgconv without its optimizer, which takes empty nodes out."""
    subprocess.run(
        ["osgconv", source, target],
        cwd=folder,
        check=True,
        capture_output=True,
        env={"PATH": os.environ["PATH"], "OSG_OPTIMIZER": "OFF"},
    )
