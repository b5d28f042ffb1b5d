"""Convert: what stands below a node that is scaled unevenly has the area that it has there."""

from __future__ import annotations

import json
from base64 import b64encode
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import png
from converted import opened, run, sidecar, surface, texture_node
from gltf_square import matt, square
from overlaid import paint, stage_file

from hdrusd.conversion import Result

#: A unit square in the plane z = 0 with white texture coordinates, one in y = 0 with black ones.
_POINTS = [
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
    [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]],
]
_UVS = [[0.9, 0.5], [0.1, 0.5]]

#: Places of which a texture's mean is taken, see account/wear.py.
_PLACES = 16_384


def lamp(folder: Path, *nodes: dict[str, Any]) -> Path:
    """Both squares as one mesh at nodes, in a material of half-white emission."""
    png(folder / "glow.png", np.repeat(np.array([[[0], [255]]], np.uint8), 3, axis=2))
    points = np.array(_POINTS, "<f4").reshape(8, 3)
    uvs = np.repeat(np.array(_UVS, "<f4"), 4, axis=0)
    corners = np.array([0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7], "<u2")
    body = points.tobytes() + uvs.tobytes() + corners.tobytes()
    kinds = [("VEC3", 5126, 8), ("VEC2", 5126, 8), ("SCALAR", 5123, 12)]
    sizes = [points.nbytes, uvs.nbytes, corners.nbytes]
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": [{"mesh": 0, **node} for node in nodes],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2}]}
        ],
        "materials": [
            {"name": "paint", "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}}
        ],
        "images": [{"uri": "glow.png"}],
        "textures": [{"source": 0}],
        "accessors": [
            {"bufferView": view, "type": kind, "componentType": component, "count": count}
            for view, (kind, component, count) in enumerate(kinds)
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": sum(sizes[:view]), "byteLength": size}
            for view, size in enumerate(sizes)
        ],
        "buffers": [
            {
                "byteLength": len(body),
                "uri": f"data:application/octet-stream;base64,{b64encode(body).decode()}",
            }
        ],
    }
    document["meshes"][0]["primitives"][0]["material"] = 0  # type: ignore[index]
    path = folder / "lamp.gltf"
    path.write_text(json.dumps(document))
    return path


def full(result: Result) -> float:
    """cd/m2 where the picture of what glows is white."""
    node = texture_node(surface(opened(result)), "emissiveColor")
    assert node is not None
    return float(node.GetInput("scale").Get()[0])


@pytest.mark.parametrize("turn", [{}, {"rotation": [0.6, 0.0, 0.0, 0.8]}])
def test_lumens_go_out_where_a_stretched_lamp_is_white(
    tmp_path: Path, turn: dict[str, Any]
) -> None:
    """1 m2 of glass beside 10 m2 of post: Phi = pi L A of the glass."""
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\nlumens = 1000\n')
    result = run(lamp(tmp_path, {"scale": [1, 1, 10], **turn}))
    # One place more or less of those on the glass, a share of 1/11.
    assert full(result) == pytest.approx(1000 / pi, rel=11 / _PLACES)
    assert result.materials[0]["area_m2"] == pytest.approx(11.0, rel=1e-6)


def test_lamps_of_several_shapes_are_one_on_average(tmp_path: Path) -> None:
    """1 m2 glass and 1 m2 post; 1 and 10; 4 and 2. So 6 of 19 m2 shine, 19/3 on average."""
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\nlumens = 1000\n')
    result = run(lamp(tmp_path, {}, {"scale": [1, 1, 10]}, {"scale": [2, 2, 1]}))
    assert full(result) == pytest.approx(1000 / pi / 2, rel=19 / 6 / _PLACES)
    assert result.materials[0]["area_m2"] == pytest.approx(19.0, rel=1e-12)


@pytest.mark.parametrize("scale", [[50, 50, 1], [50, 50, 0], [-50, 50, 3]])
def test_ground_made_of_a_small_plane(tmp_path: Path, scale: list[float]) -> None:
    """2 m by 2 m, fifty times as long and as wide."""
    path = square(tmp_path, matt(0.1))
    document = json.loads(path.read_text())
    document["nodes"][0]["scale"] = scale
    path.write_text(json.dumps(document))
    assert run(path).materials[0]["area_m2"] == pytest.approx(10_000.0, rel=1e-12)


MESH = """def Mesh "Quad" (prepend apiSchemas = ["MaterialBindingAPI"])
{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1)]
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 0, 1, 5, 4]
    rel material:binding = </World/floor>
    def GeomSubset "Wall" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1]
        rel material:binding = </World/wall>
    }
}"""


def placed(name: str, scale: str, inside: str = "", how: str = "") -> str:
    return f"""def Xform "{name}" {how}
{{
    float3 xformOp:scale = {scale}
    float xformOp:rotateY = 30
    uniform token[] xformOpOrder = ["xformOp:rotateY", "xformOp:scale"]
    {inside}
}}"""


def test_a_stage_s_own_meshes(tmp_path: Path) -> None:
    """The floor, square to z, has x y m2; its wall, square to y, x z. Instances count each."""
    materials = paint("/World/floor"), paint("/World/wall")
    many = "(\n    instanceable = true\n    references = </World/Kept/Room>\n)"
    source = stage_file(
        tmp_path / "town.usda",
        *materials,
        placed("Own", "(2, 3, 5)", MESH),
        f'def Scope "Kept"\n{{\ntoken visibility = "invisible"\ndef "Room"\n{{\n{MESH}\n}}\n}}',
        placed("A", "(1, 10, 1)", how=many),
        placed("B", "(7, 1, 0)", how=many),
    )
    rows = {row["name"]: row for row in run(source, tmp_path / "night.usda").materials}
    areas = {name: row["area_m2"] for name, row in rows.items()}
    assert areas == pytest.approx({"floor": 6.0 + 10.0 + 7.0, "wall": 10.0 + 1.0 + 0.0}, rel=1e-12)
    assert {name: row["faces"] for name, row in rows.items()} == {"floor": 3, "wall": 3}
