"""What the tests of stages as sources share: a source, and what a stage comes to, prim by prim."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdMedia

HEAD = '#usda 1.0\n(\n    defaultPrim = "World"\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n'


def stage_file(path: Path, *parts: str, head: str = HEAD) -> Path:
    """A stage of text; the parts stand in /World."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(head + 'def Xform "World"\n{\n' + "\n".join(parts) + "\n}\n")
    return path


def lamp(kind: str, inside: str, name: str = "Lamp") -> str:
    """A UsdLux light with lines of inputs."""
    shaped = '(\n    prepend apiSchemas = ["ShapingAPI"]\n)' if "shaping:" in inside else ""
    return f'def {kind} "{name}" {shaped}\n{{\n{inside}\n}}'


def paint(path: str, texture: str = "", surface: str = "", extra: str = "") -> str:
    """A material of ``path``, "/World/paint"; ``texture``: lines of the diffuse node, if any."""
    diffuse = f"color3f inputs:diffuseColor.connect = <{path}/T.outputs:rgb>" if texture else ""
    node = (
        f"""
    def Shader "T"
    {{
        uniform token info:id = "UsdUVTexture"
        {texture}
        float3 outputs:rgb
        float outputs:a
    }}"""
        if texture
        else ""
    )
    return f"""\
def Material "{path.rpartition("/")[2]}"
{{
    token outputs:surface.connect = <{path}/S.outputs:surface>
    def Shader "S"
    {{
        uniform token info:id = "UsdPreviewSurface"
        {diffuse}
        {surface}
        token outputs:surface
    }}{node}
    {extra}
}}"""


def composed(stage: Usd.Stage) -> dict[str, Any]:
    """Everything that a stage says, by prim and property, but for who made it."""
    found: dict[str, Any] = {}
    everything = Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), everything):
        path = str(prim.GetPath())
        schemas = [name for name in prim.GetAppliedSchemas() if "Authorship" not in name]
        found[path] = str(prim.GetTypeName()), schemas, prim.IsInstance(), prim.IsActive()
        for attribute in prim.GetAuthoredAttributes():
            if not attribute.GetName().startswith("authorship:"):
                times = attribute.GetTimeSamples()
                found[f"{path}.{attribute.GetName()}"] = (
                    [(time, _plain(attribute.Get(time))) for time in times],
                    _plain(attribute.Get()),
                    [str(target) for target in attribute.GetConnections()],
                )
        for relation in prim.GetAuthoredRelationships():
            name = f"{path}.{relation.GetName()}"
            found[name] = [str(target) for target in relation.GetTargets()]
    return found


def _plain(value: Any) -> Any:
    """A value that can be compared: of an asset what it resolves to."""
    if isinstance(value, Sdf.AssetPath):
        return value.resolvedPath or value.path
    if hasattr(value, "__len__") and len(value) > 16:
        array = np.asarray(value)
        return array.tobytes() if array.dtype.kind in "biuf" else tuple(map(str, value))
    return str(value)


def record(stage: Usd.Stage, name: str = "hdrusd") -> dict[str, Any]:
    """What a record of the AuthorshipAPI on the default prim says."""
    api = UsdMedia.AuthorshipAPI(stage.GetDefaultPrim(), name)
    return {
        "package": api.GetSoftwarePackageAttr().Get(),
        "version": api.GetSoftwareVersionAttr().Get(),
        "inputs": list(api.GetInputsAttr().Get() or []),
    }
