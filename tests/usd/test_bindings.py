"""What gprims wear over time: what follows it, and what says that it does not."""

from __future__ import annotations

from builders import new_stage
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from hdrusd.report import Report
from hdrusd.usd.bindings import Bindings


def test_what_is_frozen_is_said() -> None:
    stage, report = new_stage(), Report()
    mesh = UsdGeom.Mesh.Define(stage, "/Mesh")
    mesh.CreateFaceVertexCountsAttr([3, 3])
    opacity = mesh.CreateDisplayOpacityPrimvar("constant")
    subset = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).CreateMaterialBindSubset("S", [0])
    for time in (0.0, 1.0):
        opacity.Set([0.25 + 0.5 * time], time)
        subset.GetIndicesAttr().Set([int(time)], time)
    Bindings(stage, report).pieces(mesh.GetPrim(), Usd.TimeCode(0.0))
    found = {(f.code, f.thing) for f in report}
    assert {("opacity-animated", "/Mesh"), ("subset-animated", "/Mesh/S")} <= found


def test_a_network_outside_of_its_material_may_vary() -> None:
    stage, report = new_stage(), Report()
    cube = UsdGeom.Cube.Define(stage, "/Cube").GetPrim()
    material = UsdShade.Material.Define(stage, "/Paint")
    shader = UsdShade.Shader.Define(stage, "/Elsewhere")
    shader.CreateIdAttr("UsdPreviewSurface")
    color = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    for time in (0.0, 1.0):
        color.Set(Gf.Vec3f(time), time)
    output = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput().ConnectToSource(output)
    UsdShade.MaterialBindingAPI.Apply(cube).Bind(material)
    bindings = Bindings(stage, report)
    (piece,) = bindings.pieces(cube, Usd.TimeCode(0.0))
    bindings.update(Usd.TimeCode(1.0))
    assert bindings.materials[piece.material].diffuse == (1.0, 1.0, 1.0)
