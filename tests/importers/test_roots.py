"""No reference of any format leads to a file outside the declared roots: inotify watches it.

Every file named by a reference is there and whole, so that only the roots keep it closed. That
the same references are followed where ``--root`` allows it shows that the test would see it.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import collada_builder
import fbx_builder
import flt_builder
import osg_builder
import pytest
import tds_builder
from builders import obj, png
from fbx_builder import needs_ufbx
from file_watch import watched
from overlaid import HEAD, paint, stage_file
from photometric_files import ies_text
from pxr import UsdUtils
from test_assimp import AC3D, needs_assimp
from test_osgconv import TEXT, needs_osgconv

from hdrusd.conversion import Options
from hdrusd.convert import convert
from hdrusd.errors import InputError
from hdrusd.report import Report

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="inotify is Linux's")


def an_obj(file: Path, name: str) -> None:
    obj(file, f"map_Kd {name}\nmap_Ke {name}")


def an_obj_library(file: Path, name: str) -> None:
    file.write_text(f"mtllib {name}\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")


def gltf(file: Path, image: str, buffer: str = "") -> None:
    (file.parent / "square.bin").write_bytes(bytes(36))
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"name": "m", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"uri": image}],
        "buffers": [{"uri": buffer or "square.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
    }
    file.write_text(json.dumps(document))


def a_gltf_buffer(file: Path, name: str) -> None:
    gltf(file, "none.png", name)


def an_osgt(file: Path, name: str) -> None:
    state = osg_builder.state_set(unit=osg_builder.texture(osg_builder.named(name)))
    body = osg_builder.geode(osg_builder.geometry(more=osg_builder.UVS), fields=state)
    file.write_text(osg_builder.HEADER + osg_builder.scene(body))


def a_dae(file: Path, name: str) -> None:
    image = f'<library_images><image id="i"><init_from>{name}</init_from></image></library_images>'
    params = (
        '<newparam sid="sf"><surface type="2D"><init_from>i</init_from></surface></newparam>'
        '<newparam sid="sm"><sampler2D><source>sf</source></sampler2D></newparam>'
    )
    shader = '<phong><diffuse><texture texture="sm" texcoord="U"/></diffuse></phong>'
    faces = collada_builder.triangles("0 1 2")
    library = image + collada_builder.material(shader, params)
    bind = collada_builder.bound()
    file.write_text(collada_builder.mesh_document(faces, bind=bind, libraries=library))


def a_3ds(file: Path, name: str) -> None:
    build = tds_builder
    paint = build.material("m", build.texture(0xA200, name))
    file.write_bytes(build.file(paint, build.square("Square", build.wears("m", 0, 1))))


def a_flt(file: Path, name: str) -> None:
    build = flt_builder
    pool = build.Pool()
    corners = pool.add(*(build.vertex(p, None, p[:2]) for p in build.SQUARE))
    own = build.thing("o", build.face(corners, texture=0))
    palettes = build.texture(0, name)
    file.write_bytes(build.database(own, palettes=palettes, vertices=pool.data))


def a_flt_reference(file: Path, name: str) -> None:
    build = flt_builder
    pool = build.Pool()
    corners = pool.add(*(build.vertex(p) for p in build.SQUARE))
    own = build.thing("o", build.face(corners))
    file.write_bytes(build.database(own, build.external(name), vertices=pool.data))


def a_binary_osg(file: Path, name: str) -> None:
    text = file.with_name("text.osg")
    text.write_text(TEXT % name)
    option = "noTexturesInIVEFile" if file.suffix == ".ive" else "WriteImageHint=UseExternal"
    command = ["osgconv", "-O", option, text.name, file.name]
    subprocess.run(command, cwd=file.parent, check=True, capture_output=True)
    text.unlink()


def an_fbx(file: Path, name: str) -> None:
    made = fbx_builder.Fbx()
    node = made.model("n", "Mesh")
    uvs = fbx_builder.layer("LayerElementUV", "UV", [0.0, 0.0], [0] * 4, name="uv")
    made.mesh(node, fbx_builder.SQUARE, [(0, 1, 2, 3)], uvs)
    material = made.add("Material", "m", "", "Version: 102", 'ShadingModel: "phong"', under=node)
    names = f'RelativeFilename: "{name}"', f'FileName: "{name}"'
    texture = made.add("Texture", "t", "", 'Type: "TextureVideoClip"', *names, under=None)
    made.connect(texture, material, "DiffuseColor")
    made.write(file.parent, file.name)


def an_ac3d(file: Path, name: str) -> None:
    file.write_text(AC3D.replace("wall.png", name))


#: A stage of its own, so that what is refused does not leave nothing.
OWN = 'def SphereLight "Own" {\n}'


def a_stage_texture(file: Path, name: str) -> None:
    stage_file(file, OWN, paint("/World/paint", f"asset inputs:file = @{name}@"))


def a_stage_emission(file: Path, name: str) -> None:
    nodes = paint("/World/paint", f"asset inputs:file = @{name}@")
    stage_file(file, OWN, nodes.replace("inputs:diffuseColor", "inputs:emissiveColor"))


def a_stage_sublayer(file: Path, name: str) -> None:
    stage_file(file, OWN, head=HEAD.replace("(", f"(\n    subLayers = [@{name}@]", 1))


def a_stage_arc(file: Path, name: str, arc: str) -> None:
    stage_file(file, OWN, f'def "Other" (\n    {arc} = @{name}@\n)\n{{\n}}')


def a_stage_reference(file: Path, name: str) -> None:
    a_stage_arc(file, name, "references")


def a_stage_payload(file: Path, name: str) -> None:
    a_stage_arc(file, name, "payload")


def a_stage_variant(file: Path, name: str) -> None:
    """A reference in a variant that is not selected, which a conversion selects in turn."""
    choice = f'"far" {{\n}}\n"near" (\n references = @{name}@\n) {{\n}}'
    more = 'variants = { string lod = "far" }\nprepend variantSets = "lod"'
    stage_file(file, OWN, f'def "A" (\n{more}\n)\n{{\nvariantSet "lod" = {{\n{choice}\n}}\n}}')


def a_stage_expression(file: Path, name: str) -> None:
    """A reference whose name is known only when it is composed."""
    variables = f'(\n    expressionVariables = {{\n string WHERE = "{name}"\n }}'
    reference = 'def "Other" (\n    references = @`"${WHERE}"`@\n)\n{\n}'
    stage_file(file, OWN, reference, head=HEAD.replace("(", variables, 1))


def a_stage_clip(file: Path, name: str) -> None:
    """Value clips: values of a prim from other layers, by time."""
    clips = (
        "clips = {\n dictionary default = {\n"
        f"  asset[] assetPaths = [@{name}@]\n  asset manifestAssetPath = @{name}@\n"
        '  string primPath = "/World"\n  double2[] active = [(0, 0)]\n }\n}'
    )
    stage_file(file, OWN, f'def Sphere "Moving" (\n{clips}\n)\n{{\n}}')


def a_stage_light(file: Path, name: str, kind: str, attribute: str) -> None:
    schema = '(\n prepend apiSchemas = ["ShapingAPI"]\n)' if "shaping" in attribute else ""
    light = f'def {kind} "Shown" {schema}\n{{\n asset inputs:{attribute} = @{name}@\n}}'
    stage_file(file, OWN, light)


def a_stage_sky(file: Path, name: str) -> None:
    a_stage_light(file, name, "DomeLight", "texture:file")


def a_stage_screen(file: Path, name: str) -> None:
    a_stage_light(file, name, "RectLight", "texture:file")


def a_stage_profile(file: Path, name: str) -> None:
    a_stage_light(file, name, "SphereLight", "shaping:ies:file")


Writer = Callable[[Path, str], None]

#: Suffix of the source, who writes it, and the file that lies outside.
WRITERS = [
    (".obj", an_obj, "secret.png"),
    (".obj", an_obj_library, "secret.mtl"),
    (".gltf", gltf, "secret.png"),
    (".gltf", a_gltf_buffer, "secret.bin"),
    (".osgt", an_osgt, "secret.png"),
    (".dae", a_dae, "secret.png"),
    (".3ds", a_3ds, "secret.png"),
    (".flt", a_flt, "secret.png"),
    (".flt", a_flt_reference, "secret.flt"),
    (".usda", a_stage_texture, "secret.png"),
    (".usda", a_stage_sublayer, "secret.usda"),
    (".usda", a_stage_reference, "secret.usda"),
    (".usda", a_stage_payload, "secret.usda"),
    (".usda", a_stage_variant, "secret.usda"),
    (".usda", a_stage_expression, "secret.usda"),
    (".usda", a_stage_clip, "secret.usda"),
    (".usda", a_stage_sublayer, "secret.usdz"),
    (".usda", a_stage_reference, "secret.usdz"),
    pytest.param(".osgb", a_binary_osg, "secret.png", marks=needs_osgconv),
    pytest.param(".ive", a_binary_osg, "secret.png", marks=needs_osgconv),
    pytest.param(".fbx", an_fbx, "secret.png", marks=needs_ufbx),
    pytest.param(".ac", an_ac3d, "secret.png", marks=needs_assimp),
]

#: What a stage names and a conversion has no need to read: it stays the source's.
UNREAD = [
    (".usda", a_stage_emission, "secret.png"),
    (".usda", a_stage_sky, "secret.png"),
    (".usda", a_stage_screen, "secret.png"),
    (".usda", a_stage_profile, "secret.ies"),
]


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    """A folder of whole files of every kind beside the database's own."""
    folder = tmp_path / "outside"
    png(folder / "secret.png")
    (folder / "secret.mtl").write_text("newmtl m\nKd 1 0 0\n")
    (folder / "secret.bin").write_bytes(bytes(36))
    a_flt(folder / "secret.flt", "none.rgb")
    stage_file(folder / "secret.usda", 'def SphereLight "Secret" {\n}')
    (folder / "secret.ies").write_text(ies_text())
    a_stage_texture(folder / "packed.usda", "secret.png")
    UsdUtils.CreateNewUsdzPackage(str(folder / "packed.usda"), str(folder / "secret.usdz"))
    return folder


def attempt(source: Path, output: Path, **options: object) -> Report:
    """Convert, or be refused."""
    report = Report()
    try:
        convert(source, output, Options(**options), report)  # type: ignore[arg-type]
    except InputError:
        assert not output.exists()
    return report


@pytest.mark.parametrize(("suffix", "write", "file"), [*WRITERS, *UNREAD])
@pytest.mark.parametrize("form", ["above", "absolute", "uri", "link"])
def test_nothing_outside_is_opened(
    tmp_path: Path, outside: Path, suffix: str, write: Writer, file: str, form: str
) -> None:
    inside = tmp_path / "database"
    inside.mkdir()
    name = {
        "above": f"../outside/{file}",
        "absolute": str(outside / file),
        "uri": (outside / file).as_uri(),
        "link": f"link{Path(file).suffix}",
    }[form]
    if form == "link":
        (inside / name).symlink_to(outside / file)
    write(inside / f"a{suffix}", name)
    with watched(outside) as touched:
        report = attempt(inside / f"a{suffix}", tmp_path / "out" / "a.usda")
        assert touched() == []
    kept = [path.name for path in (tmp_path / "out").rglob("*")]
    assert not [one for one in kept if "secret" in one or "link" in one]
    if (suffix, write, file) in UNREAD:
        assert kept
    elif form != "uri":  # which some formats do not have: a strange file name then
        assert "file-refused" in report.codes() or not (tmp_path / "out" / "a.usda").exists()


@pytest.mark.parametrize(("suffix", "write", "file"), WRITERS)
def test_what_a_root_allows_is_opened(
    tmp_path: Path, outside: Path, suffix: str, write: Writer, file: str
) -> None:
    inside = tmp_path / "database"
    inside.mkdir()
    write(inside / f"a{suffix}", f"../outside/{file}")
    with watched(outside) as touched:
        report = attempt(inside / f"a{suffix}", tmp_path / "out" / "a.usda", roots=(outside,))
        assert touched() == [file]
    assert "file-refused" not in report.codes()


def test_a_picture_in_a_package_outside_is_not_copied(tmp_path: Path, outside: Path) -> None:
    """USD opens the package to see whether there is such a picture; more than that nobody does."""
    inside = tmp_path / "database"
    a_stage_texture(inside / "a.usda", "../outside/secret.usdz[0/secret.png]")
    report = attempt(inside / "a.usda", tmp_path / "out" / "a.usda")
    assert "file-refused" in report.codes()
    assert sorted(path.name for path in (tmp_path / "out").rglob("*")) == [
        "a.photometry.usda",
        "a.usda",
    ]
    allowed = attempt(inside / "a.usda", tmp_path / "all" / "a.usda", roots=(outside,))
    assert "file-refused" not in allowed.codes()
    assert list((tmp_path / "all").rglob("*.exr"))


def test_a_layer_that_was_refused_is_whole_where_a_root_allows_it(
    tmp_path: Path, outside: Path
) -> None:
    source = tmp_path / "database" / "a.usda"
    a_stage_sublayer(source, "../outside/secret.usda")
    found = [
        [row["name"] for row in convert(source, tmp_path / "a.usda", options, Report()).lights]
        for options in (Options(), Options(roots=(outside,)))
    ]
    assert [sorted(names) for names in found] == [["Own"], ["Own", "Secret"]]


@pytest.mark.parametrize("tail", ["usdz[packed.usda]", "usda:SDF_FORMAT_ARGS:a=b"])
def test_what_no_empty_layer_can_stand_in_for_is_refused(
    tmp_path: Path, outside: Path, tail: str
) -> None:
    source = tmp_path / "database" / "a.usda"
    a_stage_sublayer(source, f"../outside/secret.{tail}")
    with pytest.raises(InputError, match="outside the declared roots; want it inside, or --root"):
        convert(source, tmp_path / "out" / "a.usda", Options(), Report())
    convert(source, tmp_path / "out" / "a.usda", Options(roots=(outside,)), Report())


def test_the_watch_sees_reading_writing_and_removing(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    (tmp_path / "below" / "a").write_text("a")
    (tmp_path / "b").write_text("b")
    with watched(tmp_path) as touched:
        assert (tmp_path / "b").exists()
        assert sorted(path.name for path in tmp_path.rglob("*")) == ["a", "b", "below"]
        assert touched() == []
        (tmp_path / "below" / "a").read_text()
        assert touched() == ["below/a"]
        (tmp_path / "c").write_text("c")
        shutil.move(tmp_path / "b", tmp_path / "below" / "d")
        (tmp_path / "below" / "d").unlink()
        assert touched() == ["b", "below/a", "below/d", "c"]
