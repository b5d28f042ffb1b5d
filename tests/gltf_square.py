"""A glTF square that faces +Z in a sun of known lux, for what convert makes of maps."""

from __future__ import annotations

import json
import math
from base64 import b64encode
from pathlib import Path
from typing import Any

import numpy as np

#: Lux on a plane that faces the sun.
SUN_LUX = 1000.0

#: Unit vector: 0.48 towards +X, 0.36 towards +Y, as seen from the square.
TOWARDS_SUN = np.array([0.48, 0.36, 0.8])

#: Corners below left, below right, above right, above left.
_CORNERS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], "<f4")
_UPRIGHT = [[0, 1], [1, 1], [1, 0], [0, 0]]  # of the picture: v is down


def matt(reflectance: float) -> dict[str, Any]:
    """A material that has no highlight at all: L = R E / pi."""
    base = [reflectance] * 3 + [1.0]
    return {
        "pbrMetallicRoughness": {"baseColorFactor": base, "metallicFactor": 0.0},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0.0}},
    }


def square(
    folder: Path, material: dict[str, Any], *, picture: str = "", uv: Any = None, **more: Any
) -> Path:
    """A file of the square, 2 m wide, in ``material`` and ``more``; ``picture`` is texture 0."""
    arrays = [
        _CORNERS,
        np.array([[0, 0, 1]] * 4, "<f4"),
        np.array(_UPRIGHT if uv is None else uv, "<f4"),
        np.array([0, 1, 2, 0, 2, 3], "<u2"),
    ]
    kinds = [("VEC3", 5126), ("VEC3", 5126), ("VEC2", 5126), ("SCALAR", 5123)]
    views, accessors, body = [], [], b""
    for number, (array, (kind, component)) in enumerate(zip(arrays, kinds, strict=True)):
        views.append({"buffer": 0, "byteOffset": len(body), "byteLength": array.nbytes})
        accessor = {"bufferView": number, "count": len(array), "type": kind}
        accessors.append(accessor | {"componentType": component})
        body += array.tobytes()
    primitive = {"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3}
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [
            {"mesh": 0},
            {"rotation": _turn(), "extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        "meshes": [{"primitives": [primitive | {"material": 0}]}],
        "materials": [{"name": "paint", **material, **more}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [
            {
                "byteLength": len(body),
                "uri": "data:application/octet-stream;base64," + b64encode(body).decode(),
            }
        ],
        "extensions": {
            "KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": SUN_LUX}]}
        },
    }
    if picture:
        document |= {"images": [{"uri": picture}], "textures": [{"source": 0}]}
    path = folder / "square.gltf"
    path.write_text(json.dumps(document))
    return path


def _turn() -> list[float]:
    """The shortest turn (quaternion x, y, z, w) from -Z, where a light shines, to the square."""
    wanted = -TOWARDS_SUN
    axis = np.cross([0.0, 0.0, -1.0], wanted)
    half = math.acos(-float(wanted[2])) / 2.0
    axis = axis / np.linalg.norm(axis) * math.sin(half)
    return [*axis.tolist(), math.cos(half)]
