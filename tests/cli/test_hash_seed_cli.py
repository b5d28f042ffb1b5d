"""The order of what is written does not hang on Python's hash seed, which is another each time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from command_line import process

#: Two sets of coordinates for a picture each, unbound: a finding for each channel.
_DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<library_images><image id="i"><init_from>gone.png</init_from></image></library_images>
<library_effects><effect id="e"><profile_COMMON>
<newparam sid="s"><surface type="2D"><init_from>i</init_from></surface></newparam>
<newparam sid="p"><sampler2D><source>s</source></sampler2D></newparam>
<technique sid="c"><phong>
<emission><texture texture="p" texcoord="GlowUV"/></emission>
<ambient><texture texture="p" texcoord="AmbientUV"/></ambient>
<diffuse><texture texture="p" texcoord="DiffuseUV"/></diffuse>
<specular><texture texture="p" texcoord="SpecularUV"/></specular>
<transparent><texture texture="p" texcoord="OpacityUV"/></transparent>
</phong></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="gp"><float_array id="gpa" count="9">0 0 0 1 0 0 0 1 0</float_array>
<technique_common><accessor source="#gpa" count="3" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<source id="gt"><float_array id="gta" count="6">0 0 1 0 0 1</float_array>
<technique_common><accessor source="#gta" count="3" stride="2"><param name="S" type="float"/>
<param name="T" type="float"/></accessor></technique_common></source>
<vertices id="gv"><input semantic="POSITION" source="#gp"/></vertices>
<triangles count="1" material="M"><input semantic="VERTEX" source="#gv" offset="0"/>
<input semantic="TEXCOORD" source="#gt" offset="1" set="0"/>
<input semantic="TEXCOORD" source="#gt" offset="1" set="1"/><p>0 0 1 1 2 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="v"><node><instance_geometry url="#g"><bind_material>
<technique_common><instance_material symbol="M" target="#m"/></technique_common></bind_material>
</instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#v"/></scene></COLLADA>
"""

#: Patterns that fit nothing in any file, in recipes of one name.
_RECIPE = "".join(f'[[light]]\nmatch = "nothing {name}"\ncandela = 1\n' for name in "abcdef")

_TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl paint\nf 1 2 3\n"


def _gltf() -> str:
    """Vertex attributes, extensions and maps that have no home, by words of many hashes."""
    parts: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [f"EXT_{name}" for name in "abcdef"],
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "buffers": [{"byteLength": 36, "uri": "data:;base64," + "AAAAAAAAAAAAAAAA" * 3}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "materials": [{"extensions": {f"EXT_{name}": {} for name in "abcdef"}}],
    }
    names = ["POSITION", *(f"_{name}" for name in "ABCDEF")]
    primitive = {"attributes": dict.fromkeys(names, 0), "material": 0}
    return json.dumps(parts | {"meshes": [{"primitives": [primitive]}]})


@pytest.fixture
def town(tmp_path: Path) -> Path:
    """Files of several kinds, each with more than one thing of which sets are made."""
    for folder in ("north", "south"):
        home = tmp_path / "town" / folder
        home.mkdir(parents=True)
        (home / "photometry.toml").write_text(_RECIPE)
        (home / "a.dae").write_text(_DAE)
        (home / "b.gltf").write_text(_gltf())
        (home / "c.obj").write_text(f"mtllib c.mtl\n{_TRIANGLE}")
        words = " ".join(f"-{word} 1" for word in ("blendu", "boost", "cc", "texres"))
        (home / "c.mtl").write_text(f"newmtl paint\nsharpness 1\nTf 1 1 1\nmap_Kd {words} x.png\n")
    (tmp_path / "town/lamps.usda").write_text(
        '#usda 1.0\n(\n defaultPrim = "a"\n metersPerUnit = 1\n upAxis = "Y"\n)\n'
        'def Xform "a" (variantSets = ["s", "t"]\n variants = {string s = "x"\n string t = "u"})\n'
        '{\n variantSet "s" = {\n"x" {\ndef SphereLight "l" {\n}\n}\n'
        '"y" {\ndef DiskLight "l" {\n}\n}\n}\n'
        ' variantSet "t" = {\n"u" {\ndef SphereLight "m" {\n}\n}\n'
        '"v" {\ndef RectLight "m" {\n}\n}\n}\n}\n'
    )
    return tmp_path / "town"


def test_two_hash_seeds_write_the_same_bytes(town: Path, tmp_path: Path) -> None:
    told: list[tuple[str, str]] = []
    files: list[dict[str, bytes]] = []
    for seed in ("1", "2", "3"):
        out, report = tmp_path / "out", tmp_path / "all.json"
        done = process("convert", town, out, "--report", report, PYTHONHASHSEED=seed)
        assert done.code == 0, done.err
        told.append((done.out, done.err))
        made = [path for path in out.rglob("*") if path.is_file()]
        files.append({str(path): path.read_bytes() for path in (*made, report)})
        for path in made:
            path.unlink()
    assert files[0].keys() == files[1].keys() == files[2].keys()
    unlike = {name for name in files[0] if len({run[name] for run in files}) > 1}
    assert unlike == set()
    assert len(set(told)) == 1
    document = json.loads(files[0][str(tmp_path / "all.json")])
    codes = {entry["code"] for entry in document["findings_by_code"]}
    assert {"collada-texcoord", "mesh-attribute", "material-part"} <= codes
    assert len(document["unused_patterns"]) == 12
