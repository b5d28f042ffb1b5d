"""What every validator that comes with USD says of converted stages: nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import png
from converted import run
from gltf_square import matt, square
from pxr import Usd, UsdValidation

from hdrusd.checking import validate

#: Two materials on one mesh, one with a picture.
TWO_MATERIALS = "mtllib paint.mtl\no wall\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\n"
TWO_MATERIALS += "usemtl red\nf 1/1 2/1 3/2\nusemtl wood\nf 1/1 3/2 4/2\n"


def said(stage: Usd.Stage) -> set[str]:
    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    return {
        f"{e.GetValidator().GetMetadata().name}: {e.GetMessage()}" for e in context.Validate(stage)
    }


def pictured(folder: Path) -> Path:
    """Every texture node that a material may have: picture, transform, normals, opacity."""
    png(folder / "p.png", np.full((2, 2, 4), 128, np.uint8))
    turned: dict[str, Any] = {"KHR_texture_transform": {"rotation": 0.5, "scale": [2, 2]}}
    paint = matt(0.5)
    paint["pbrMetallicRoughness"] |= {"baseColorTexture": {"index": 0, "extensions": turned}}
    more = {"normalTexture": {"index": 0}, "occlusionTexture": {"index": 0}}
    return square(folder, paint, picture="p.png", alphaMode="BLEND", **more)


def two_materials(folder: Path) -> Path:
    png(folder / "p.png", np.full((2, 2, 3), 128, np.uint8))
    (folder / "paint.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl wood\nmap_Kd p.png\n")
    path = folder / "wall.obj"
    path.write_text(TWO_MATERIALS)
    return path


@pytest.mark.parametrize("write", [pictured, two_materials])
def test_converted_stages_please_all_validators(tmp_path: Path, write: Any) -> None:
    result = run(write(tmp_path))
    stage = Usd.Stage.Open(str(result.output))
    assert said(stage) == set()
    assert validate(stage) == []
