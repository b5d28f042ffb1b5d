"""Writes light_units.gltf: four sources of light whose photometry is known exactly.

    python samples/light_units/make_light_units.py [FOLDER]

A grey floor (reflectance 0.5) lies in y = 0. Above it, far from one another, stand a point
light, a spot that looks down, and a panel that glows; a directional light falls straight
down on all of it. glTF's units are metres, candela (point, spot), lux (directional) and
cd/m2 (emissive strength). README.md beside this file has the luminance of the floor.
"""

from __future__ import annotations

import base64
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

LIGHTS = "KHR_lights_punctual"
MATT = "KHR_materials_pbrSpecularGlossiness"

#: Floor and panel, triangles that look up: half sizes in m.
FLOOR, PANEL = (40.0, 15.0), (2.0, 2.0)


def quad(half: tuple[float, float]) -> list[list[float]]:
    """Corners of a rectangle in y = 0, counter-clockwise seen from above."""
    x, z = half
    return [[-x, 0, z], [x, 0, z], [x, 0, -z], [-x, 0, -z]]


def turned_down() -> list[float]:
    """The quaternion that turns -Z, along which glTF's lights shine, to -Y."""
    return [-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]


def document() -> dict[str, Any]:
    """The whole glTF, its one buffer inside."""
    points = np.array([quad(FLOOR), quad(PANEL)], "<f4")
    indices = np.array([0, 1, 2, 0, 2, 3], "<u2")
    data = points.tobytes() + indices.tobytes()

    def positions(half: tuple[float, float], offset: int) -> dict[str, Any]:
        x, z = half
        return {
            "bufferView": 0,
            "byteOffset": offset,
            "componentType": 5126,
            "count": 4,
            "type": "VEC3",
            "min": [-x, 0.0, -z],
            "max": [x, 0.0, z],
        }

    def node(name: str, at: list[float], **rest: Any) -> dict[str, Any]:
        return {"name": name, "translation": at, **rest}

    def lamp(index: int) -> dict[str, Any]:
        return {LIGHTS: {"light": index}}

    return {
        "asset": {"version": "2.0", "generator": "make_light_units.py of hdrusd"},
        "extensionsUsed": [LIGHTS, "KHR_materials_emissive_strength", MATT],
        "extensions": {
            LIGHTS: {
                "lights": [
                    {"name": "point_1000_cd", "type": "point", "intensity": 1000.0},
                    {
                        "name": "spot_30000_cd",
                        "type": "spot",
                        "intensity": 30_000.0,
                        "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.3},
                    },
                    {"name": "directional_0.25_lx", "type": "directional", "intensity": 0.25},
                ]
            }
        },
        "scene": 0,
        "scenes": [{"nodes": [0, 1, 2, 3, 4, 5]}],
        "nodes": [
            node("floor", [0, 0, 0], mesh=0),
            node("point", [-25, 10, 0], extensions=lamp(0)),
            node("spot", [0, 20, 0], rotation=turned_down(), extensions=lamp(1)),
            node("sun", [0, 30, 0], rotation=turned_down(), extensions=lamp(2)),
            node("panel_20000_cd_m2", [25, 0.01, 0], mesh=1),
            node("camera", [0, 30, 45], rotation=[-0.27, 0.0, 0.0, 0.9628603220], camera=0),
        ],
        "cameras": [
            {"type": "perspective", "perspective": {"yfov": 0.6, "znear": 1.0, "zfar": 200.0}}
        ],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0}, "indices": 2, "material": 0}]},
            {"primitives": [{"attributes": {"POSITION": 1}, "indices": 2, "material": 1}]},
        ],
        "materials": [
            {
                "name": "grey_0.5",
                "pbrMetallicRoughness": {
                    "baseColorFactor": [0.5, 0.5, 0.5, 1.0],
                    "metallicFactor": 0.0,
                },
                # Matt: without a highlight L = R E / pi is all that is seen.
                "extensions": {
                    MATT: {"diffuseFactor": [0.5, 0.5, 0.5, 1.0], "specularFactor": [0, 0, 0]}
                },
            },
            {
                "name": "glow_20000_cd_m2",
                "pbrMetallicRoughness": {"baseColorFactor": [0.0, 0.0, 0.0, 1.0]},
                "emissiveFactor": [1.0, 1.0, 1.0],
                "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 20_000.0}},
            },
        ],
        "accessors": [
            positions(FLOOR, 0),
            positions(PANEL, 48),
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 96, "target": 34962},
            {"buffer": 0, "byteOffset": 96, "byteLength": 12, "target": 34963},
        ],
        "buffers": [
            {
                "byteLength": len(data),
                "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
            }
        ],
    }


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    text = json.dumps(document(), indent=1) + "\n"
    (folder / "light_units.gltf").write_text(text, encoding="utf-8")
