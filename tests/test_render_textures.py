"""Texture files of a stage, from the file to the frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import png
from stage_text import CAMERA

from hdrusd.job import Job
from hdrusd.render import Renderer
from hdrusd.report import Report

STAGE = """#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Y"
)
%(camera)s
def Mesh "Wall" (
    prepend apiSchemas = ["MaterialBindingAPI"]
)
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-2, -1.5, 0), (2, -1.5, 0), (2, 1.5, 0), (-2, 1.5, 0)]
    texCoord2f[] primvars:st = [(0, 0), (2, 0), (2, 2), (0, 2)] (
        interpolation = "vertex"
    )
    uniform token subdivisionScheme = "none"
    rel material:binding = </Glow>
}
def Material "Glow"
{
    token outputs:surface.connect = </Glow/Surface.outputs:surface>
    def Shader "Surface"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0, 0, 0)
        float inputs:ior = 1
        color3f inputs:emissiveColor.connect = </Glow/Picture.outputs:rgb>
        token outputs:surface
    }
    def Shader "Picture"
    {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./%(file)s@
        token inputs:sourceColorSpace = "raw"
        float4 inputs:fallback = (0.5, 0.25, 0.125, 1)
        float4 inputs:scale = (100, 100, 100, 1)
        float2 inputs:st.connect = </Glow/Coordinates.outputs:result>
        float3 outputs:rgb
    }
    def Shader "Coordinates"
    {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st"
        float2 outputs:result
    }
}
"""


def frame(gl: Any, folder: Path, file: str, report: Report) -> Any:
    """The wall, lit by nothing, seen whole."""
    path = folder / "wall.usda"
    path.write_text(STAGE % {"camera": CAMERA, "file": file})
    job = Job(stage=path, width=64, height=48, default_sky=False)
    return Renderer(gl, job, report).frame(0.0).hdr


def test_tiles_glow_in_their_places(gl: Any, tmp_path: Path) -> None:
    """Two by two tiles, one of them missing: its fallback is shown."""
    for number, code in ((1001, 51), (1002, 102), (1011, 153)):
        png(tmp_path / f"t.{number}.png", np.full((8, 8, 3), code, np.uint8))
    report = Report()
    got = frame(gl, tmp_path, "t.<UDIM>.png", report)
    # In the middle of each quarter: rows from the top, tiles from the bottom.
    for row, column, wanted in ((36, 16, 20.0), (36, 48, 40.0), (12, 16, 60.0)):
        np.testing.assert_allclose(got[row, column], wanted, rtol=2**-11)
    np.testing.assert_allclose(got[12, 48], (50.0, 25.0, 12.5), rtol=2**-11)
    assert report.codes() == {"texture-tiles"}


@pytest.mark.parametrize("file", ["none.png", "none.<UDIM>.png"])
def test_a_texture_that_is_not_there(gl: Any, tmp_path: Path, file: str) -> None:
    report = Report()
    got = frame(gl, tmp_path, file, report)
    np.testing.assert_allclose(got[24, 32], (50.0, 25.0, 12.5), rtol=1e-6)
    assert report.codes() == {"texture-unreadable"}
