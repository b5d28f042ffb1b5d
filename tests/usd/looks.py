"""Materials as text, and what is read of them."""

from __future__ import annotations

from pathlib import Path

from pxr import Sdf, Usd, UsdShade

from hdrusd.report import Report
from hdrusd.scene import Material
from hdrusd.usd.preview import MaterialReader

PATH = Sdf.Path("/Looks/paint")
TYPES = Sdf.ValueTypeNames

DIFFUSE = "color3f inputs:diffuseColor.connect = </Looks/paint/Picture.outputs:rgb>"


def read(stage: Usd.Stage, report: Report | None = None) -> Material | None:
    """What the reader makes of /Looks/paint."""
    reader = MaterialReader(stage, Report() if report is None else report)
    return reader.read(UsdShade.Material(stage.GetPrimAtPath(PATH)), Usd.TimeCode(0))


def shown(stage: Usd.Stage, report: Report | None = None) -> Material:
    """The same, of a material that must be known."""
    made = read(stage, report)
    assert made is not None
    return made


def network(
    folder: Path,
    inputs: str,
    nodes: str = "",
    *,
    graph: str = "",
    surface: str = "UsdPreviewSurface",
    output: str = "surface",
) -> Usd.Stage:
    """A material of one surface with ``inputs``, and nodes beside it."""
    file = folder / "look.usda"
    file.write_text(
        '#usda 1.0\n(\n    metersPerUnit = 1\n)\ndef Scope "Looks"\n{\n'
        f'def Material "paint"\n{{\n{graph}\n'
        f"    token outputs:{output}.connect = </Looks/paint/Surface.outputs:surface>\n"
        '    def Shader "Surface"\n    {\n'
        f'        uniform token info:id = "{surface}"\n'
        f"{inputs}\n        token outputs:surface\n    }}\n{nodes}\n}}\n}}\n"
    )
    return Usd.Stage.Open(str(file))


def node(name: str, kind: str, body: str = "", outputs: str = "float outputs:out") -> str:
    """A node below the material."""
    return f'def Shader "{name}"\n{{\n uniform token info:id = "{kind}"\n{body}\n {outputs}\n}}\n'


def uv_texture(extra: str = "", name: str = "Picture", file: str = "./a.png") -> str:
    """A UsdUVTexture, and where ``extra`` does not say otherwise coordinates for it."""
    asset = f"asset inputs:file = @{file}@\n" if file else ""
    coordinates = ""
    if "inputs:st" not in extra:
        extra += f"\nfloat2 inputs:st.connect = </Looks/paint/{name}_st.outputs:result>"
        coordinates = reader(f"{name}_st", "float2", "st")
    outputs = "float3 outputs:rgb\nfloat outputs:r\nfloat outputs:g\nfloat outputs:b\n"
    return node(name, "UsdUVTexture", asset + extra, outputs + "float outputs:a") + coordinates


def reader(name: str, kind: str, primvar: str, extra: str = "") -> str:
    """A UsdPrimvarReader of a primvar."""
    body = f'string inputs:varname = "{primvar}"\n{extra}'
    return node(name, f"UsdPrimvarReader_{kind}", body, f"{kind} outputs:result")


def transform(name: str, source: str, values: str = "") -> str:
    """A UsdTransform2d of what node ``source`` gives."""
    body = f"float2 inputs:in.connect = </Looks/paint/{source}.outputs:result>\n{values}"
    return node(name, "UsdTransform2d", body, "float2 outputs:result")


def fed(name: str, kind: str, output: str = "rgb", source: str = "Picture") -> str:
    """An input of the surface that a node feeds."""
    return f"{kind} inputs:{name}.connect = </Looks/paint/{source}.outputs:{output}>"
