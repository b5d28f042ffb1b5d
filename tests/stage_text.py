"""Small stages as text: a camera that looks straight down on 4 m x 3 m, and what is below it."""

from __future__ import annotations

from pathlib import Path

CAMERA = """\
def Camera "Camera"
{
    float focalLength = 24
    float horizontalAperture = 24
    float verticalAperture = 18
    float2 clippingRange = (0.05, 100)
    double3 xformOp:translate = (0, 0, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""

#: Reflectance 1 without a material: displayColor.
GROUND = """\
def Mesh "Ground"
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)]
    color3f[] primvars:displayColor = [(1, 1, 1)]
    uniform token subdivisionScheme = "none"
}
"""

#: L = 10 cd/m2 on a surface of reflectance 1.
SKY = 'def DomeLight "Sky"\n{\n    float inputs:intensity = 10\n}\n'


def panel(
    name: str,
    x: tuple[float, float] = (-0.5, 0.5),
    *,
    inside: str = "",
    color: tuple[float, ...] = (0, 1, 0),
) -> str:
    """A green square half a metre above the ground, with further attributes."""
    corners = [(x[0], -0.5, 0.5), (x[1], -0.5, 0.5), (x[1], 0.5, 0.5), (x[0], 0.5, 0.5)]
    return f"""\
def Mesh "{name}"
{{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = {corners}
    color3f[] primvars:displayColor = [{color}]
    uniform token subdivisionScheme = "none"
    {inside}
}}
"""


def write_stage(path: Path, *parts: str, head: str = "", camera: str = CAMERA) -> Path:
    """A Z-up stage in metres from parts of text."""
    body = "\n".join([camera, *parts])
    metadata = f'    metersPerUnit = 1\n    upAxis = "Z"\n    {head}\n'
    path.write_text(f"#usda 1.0\n(\n{metadata})\n\n{body}", encoding="utf-8")
    return path
