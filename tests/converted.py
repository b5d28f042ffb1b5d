"""What the tests of convert share: run it, and find things in what it wrote."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd, UsdShade
from report_schema import problems, undescribed

from hdrusd.conversion import Options, Result
from hdrusd.convert import convert
from hdrusd.units import LUMINANCE_WEIGHTS
from hdrusd.usd.lux import is_light

_STAGES: deque[Usd.Stage] = deque(maxlen=4)


def run(source: Path, output: Path | None = None, **options: Any) -> Result:
    """Convert beside the source, or to ``output``; the schema must know all of the report."""
    result = convert(source, output or source.with_suffix(".usda"), Options(**options))
    document = result.as_dict()
    assert problems(document) == []
    assert undescribed(document) == set()
    return result


def opened(result: Result) -> Usd.Stage:
    """The stage that was written, kept open for a while: a prim does not keep it."""
    stage = Usd.Stage.Open(str(result.output))
    _STAGES.append(stage)
    return stage


def lights(stage: Usd.Stage) -> dict[str, Usd.Prim]:
    """Its lights by name."""
    return {prim.GetName(): prim for prim in stage.Traverse() if is_light(prim)}


def material(stage: Usd.Stage, name: str = "paint") -> UsdShade.Material:
    """Its material of a name."""
    return next(UsdShade.Material(p) for p in stage.Traverse() if p.GetName() == name)


def surface(stage: Usd.Stage, name: str = "paint") -> UsdShade.Shader:
    """The surface of a material that counts."""
    return material(stage, name).ComputeSurfaceSource()[0]


def texture_node(shader: UsdShade.Shader, name: str) -> UsdShade.Shader | None:
    """The node that feeds an input of a surface."""
    sources, _ = shader.GetInput(name).GetConnectedSources()
    return UsdShade.Shader(sources[0].source.GetPrim()) if sources else None


def texture_file(shader: UsdShade.Shader, name: str) -> Path:
    """The file of the texture on an input."""
    node = texture_node(shader, name)
    assert node is not None
    return Path(node.GetInput("file").Get().resolvedPath)


def sidecar(folder: Path, text: str) -> None:
    """Write a photometry file beside the source."""
    (folder / "photometry.toml").write_text(text)


def luminance(color: Any) -> float:
    """Of linear Rec. 709."""
    return float(np.dot(LUMINANCE_WEIGHTS, color))


#: Lights of KHR_lights_punctual: candela, candela, lux.
POINT = {"name": "point", "type": "point", "intensity": 1000.0, "color": [1.0, 0.8, 0.5]}
SPOT = {
    "name": "spot",
    "type": "spot",
    "intensity": 30_000.0,
    "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5},
}
MOON = {"name": "moon", "type": "directional", "intensity": 0.25, "color": [0.9, 0.95, 1.0]}
