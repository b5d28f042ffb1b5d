"""Alpha of vertices through convert and into the frame: what lets something through, and how."""

from __future__ import annotations

import json
from base64 import b64encode
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from converted import run
from gltf_square import SUN_LUX, TOWARDS_SUN, matt, square
from lit_ground import findings, seen

#: cd/m2 of the opaque square: R E / pi of R = 0.5.
OPAQUE = 0.5 / np.pi * SUN_LUX * TOWARDS_SUN[2]


def painted(
    folder: Path, alpha: float, material: dict[str, Any] | None = None, **more: Any
) -> Path:
    """The square with vertex colours of one alpha."""
    path = square(folder, material or matt(0.5), **more)
    document = json.loads(path.read_text())
    colors = np.tile(np.array([1.0, 1.0, 1.0, alpha], "<f4"), (4, 1)).tobytes()
    uri = "data:application/octet-stream;base64," + b64encode(colors).decode()
    document["buffers"].append({"byteLength": len(colors), "uri": uri})
    document["bufferViews"].append({"buffer": 1, "byteLength": len(colors)})
    accessor = {"bufferView": len(document["bufferViews"]) - 1, "count": 4}
    document["accessors"].append(accessor | {"type": "VEC4", "componentType": 5126})
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    attributes["COLOR_0"] = len(document["accessors"]) - 1
    path.write_text(json.dumps(document))
    return path


@pytest.mark.parametrize(
    ("material", "alpha", "share"),
    [
        ({"alphaMode": "BLEND"}, 0.25, 0.25),  # over black
        ({"alphaMode": "BLEND"}, 0.0, 0.0),
        ({"alphaMode": "MASK"}, 0.25, 0.0),
        ({"alphaMode": "MASK"}, 0.75, 1.0),
        ({}, 0.25, 1.0),  # opaque: alpha is ignored (glTF 2.0, section 3.9.4)
    ],
)
def test_alpha_of_vertices(
    gl: Any, tmp_path: Path, material: dict[str, Any], alpha: float, share: float
) -> None:
    result = run(painted(tmp_path, alpha, **material))
    assert not findings(result, "vertex-alpha")
    assert seen(gl, result)[24, 32] == pytest.approx(share * OPAQUE, rel=1e-5, abs=1e-9)


def test_alpha_of_vertices_beside_another(tmp_path: Path) -> None:
    """No UsdPreviewSurface multiplies two opacities."""
    faint = matt(0.5)
    faint["pbrMetallicRoughness"]["baseColorFactor"][3] = 0.5
    result = run(painted(tmp_path, 0.25, faint, alphaMode="BLEND"))
    assert findings(result, "vertex-alpha") == ["vertex alpha counts, without the material's 0.5"]
