"""Scenes of many small things, for the benchmark of conversion: one cube over and over."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np

#: Half the side of the cube, and the distance from one thing to the next, m.
_HALF, _STEP = 0.1, 10.0

_Nodes = list[dict[str, Any]]


def lamps(path: Path, count: int) -> None:
    """glTF: lamps of different candela, points and spots by turns, each at its node; one cube."""
    lights = [_lamp(number, spot=number % 2 == 0) for number in range(count)]
    nodes = [_node(f"N{number}", number, _holds(number)) for number in range(count)]
    _write(path, [*nodes, {"name": "cube", "mesh": 0}], list(range(count + 1)), lights)


def posts(path: Path, count: int) -> None:
    """glTF: posts that share one mesh, each with a node for its lamp at the top."""
    nodes: _Nodes = []
    for number in range(count):
        nodes.append(_node(f"post{number}", number, {"mesh": 0, "children": [2 * number + 1]}))
        lamp = {"name": f"lamp{number}", "translation": [0.0, 0.3, 0.0]} | _holds(0)
        nodes.append(lamp)
    _write(path, nodes, list(range(0, 2 * count, 2)), [_lamp(0, spot=False)])


def meshes(path: Path, count: int) -> None:
    """glTF: nodes with a mesh of their own each, 12 triangles."""
    nodes = [_node(f"n{number}", number, {"mesh": number}) for number in range(count)]
    _write(path, nodes, list(range(count)), [], meshes=count)


def lamps_of_one_node(path: Path, count: int) -> None:
    """COLLADA: lamps that are all at one node."""
    color = "<color>1 0.9 0.7</color><quadratic_attenuation>1</quadratic_attenuation>"
    lights = "".join(
        f'<light id="l{i}" name="L{i}"><technique_common><point>{color}</point>'
        "</technique_common></light>"
        for i in range(count)
    )
    uses = "".join(f'<instance_light url="#l{i}"/>' for i in range(count))
    path.write_text(
        '<?xml version="1.0"?>'
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        '<asset><unit meter="1"/><up_axis>Y_UP</up_axis></asset>'
        f"<library_lights>{lights}</library_lights>"
        '<library_visual_scenes><visual_scene id="s"><node id="n" name="N">'
        f"{uses}</node></visual_scene></library_visual_scenes>"
        '<scene><instance_visual_scene url="#s"/></scene></COLLADA>',
        encoding="utf-8",
    )


def _lamp(number: int, *, spot: bool) -> dict[str, Any]:
    lamp = {"name": f"L{number}", "intensity": 100.0 + number, "color": [1.0, 0.9, 0.7]}
    return lamp | ({"type": "spot", "spot": {"outerConeAngle": 1.0}} if spot else {"type": "point"})


def _holds(light: int) -> dict[str, Any]:
    return {"extensions": {"KHR_lights_punctual": {"light": light}}}


def _node(name: str, number: int, holds: dict[str, Any]) -> dict[str, Any]:
    row, column = divmod(number, 70)
    return {"name": name, "translation": [_STEP * column, 0.0, _STEP * row]} | holds


def _write(
    path: Path, nodes: _Nodes, roots: list[int], lights: list[dict[str, Any]], *, meshes: int = 1
) -> None:
    corners = _HALF * (2.0 * np.indices((2, 2, 2)).reshape(3, 8).T - 1.0)
    sides = "013032467475045051237276026064157173"
    data = corners.astype("<f4").tobytes() + np.array([*map(int, sides)], "<u2").tobytes()
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    low, high = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    cube = {"attributes": {"POSITION": 0}, "indices": 1, "material": 0}
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": roots}],
        "nodes": nodes,
        "meshes": [{"name": f"m{number}", "primitives": [cube]} for number in range(meshes)],
        "materials": [{"name": "steel", "pbrMetallicRoughness": {"metallicFactor": 0.0}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"}
            | {"min": low, "max": high},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 96},
            {"buffer": 0, "byteOffset": 96, "byteLength": 72},
        ],
        "buffers": [{"byteLength": len(data), "uri": uri}],
    }
    if lights:
        document["extensionsUsed"] = ["KHR_lights_punctual"]
        document["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    path.write_text(json.dumps(document), encoding="utf-8")
