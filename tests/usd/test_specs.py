"""Prims as specs: a layer has the same text as by the schemas' own calls."""

from __future__ import annotations

from typing import Any

import numpy as np
from builders import new_spec, new_stage, square
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

from hdrusd.photometry.light import PhotometricLight
from hdrusd.usd import specs
from hdrusd.usd.light import write_light_spec
from hdrusd.usd.mesh import write_mesh

TYPES = Sdf.ValueTypeNames


def text(stage: Usd.Stage) -> str:
    return str(stage.GetRootLayer().ExportToString())


def test_transforms_stand_in_their_order() -> None:
    ours, usd = new_stage(), new_stage()
    prim = new_spec(ours, "/Node", "Xform")
    turn = Gf.Quatd(0.6, 0.0, 0.8, 0.0)
    specs.reset_moves(prim)
    specs.move(prim, "translate", TYPES.Double3, Gf.Vec3d(1, 2, 3))
    specs.move(prim, "orient", TYPES.Quatd, turn)
    specs.move(prim, "scale", TYPES.Double3, Gf.Vec3d(2, 2, 2))
    specs.hide(prim)
    form = UsdGeom.Xform.Define(usd, "/Node")
    form.SetResetXformStack(True)
    form.AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    form.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(turn)
    form.AddScaleOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(2, 2, 2))
    form.MakeInvisible()
    assert text(ours) == text(usd)


def test_a_mesh_is_what_its_schema_says() -> None:
    ours, usd = new_stage(), new_stage()
    colors = np.array([[0.1, 0.2, 0.3, 0.5]] * 4, np.float32)
    normals = np.array([[0, 0, 1]] * 4, np.float32)
    mesh = square(colors=colors, normals=normals, left_handed=True)
    prim = new_spec(ours, "/Wall", "Mesh")
    write_mesh(prim, mesh)
    specs.bind_faces(prim, "paint", Sdf.ValueTypeNames.IntArray.defaultValue, Sdf.Path("/M"))
    made = UsdGeom.Mesh.Define(usd, "/Wall")
    made.CreateSubdivisionSchemeAttr("none")
    made.CreatePointsAttr(mesh.points)
    made.CreateFaceVertexCountsAttr(mesh.face_counts)
    made.CreateFaceVertexIndicesAttr(mesh.face_indices)
    made.CreateExtentAttr(np.stack([mesh.points.min(axis=0), mesh.points.max(axis=0)]))
    made.CreateDoubleSidedAttr(mesh.two_sided)
    made.CreateOrientationAttr("leftHanded")
    made.CreateNormalsAttr(normals)
    made.SetNormalsInterpolation(mesh.normals_interpolation)
    for name, (uv, interpolation) in mesh.uvs.items():
        primvars = UsdGeom.PrimvarsAPI(made)
        primvars.CreatePrimvar(name, TYPES.TexCoord2fArray, interpolation).Set(uv)
    made.CreateDisplayColorPrimvar(mesh.colors_interpolation).Set(colors[:, :3].copy())
    made.CreateDisplayOpacityPrimvar(mesh.colors_interpolation).Set(colors[:, 3].copy())
    subset = UsdGeom.Subset.CreateGeomSubset(made, "paint", "face", [], "materialBind").GetPrim()
    UsdShade.MaterialBindingAPI(made).SetMaterialBindSubsetsFamilyType("nonOverlapping")
    UsdShade.MaterialBindingAPI.Apply(subset).GetDirectBindingRel().SetTargets(["/M"])
    assert text(ours) == text(usd)


def test_a_lamp_is_what_its_schemas_say() -> None:
    ours, usd = new_stage(), new_stage()
    lamp = PhotometricLight("spot", 100.0, (1.0, 1.0, 1.0), cutoff=40.0, softness=0.5, sp=1.5)
    write_light_spec(new_spec(ours, "/Lamp", "SphereLight"), lamp)
    light = UsdLux.SphereLight.Define(usd, "/Lamp")
    prim = light.GetPrim()
    shaping = UsdLux.ShapingAPI.Apply(prim)
    prim.ApplyAPI("HdrusdPhotometricLightAPI")
    light.CreateRadiusAttr(lamp.radius)
    light.CreateTreatAsPointAttr(True)
    light.CreateIntensityAttr(100.0 / (np.pi * lamp.radius**2))
    light.CreateColorAttr(Gf.Vec3f(1.0))
    light.CreateNormalizeAttr(False)
    shaping.CreateShapingConeAngleAttr(40.0)
    shaping.CreateShapingConeSoftnessAttr(0.5)
    shaping.CreateShapingFocusAttr(0.0)
    stated: tuple[tuple[str, Any], ...] = (
        ("inputs:photometric:luminousIntensity", 100.0),
        ("inputs:photometric:scotopicPhotopicRatio", 1.5),
        ("photometric:provenance", lamp.provenance),
        ("photometric:confidence", "none"),
    )
    for name, value in stated:
        # Of the applied schema, which knows type and variability.
        prim.GetAttribute(name).Set(value)
    assert text(ours) == text(usd)


def test_what_is_kept_of_a_source_is_read_back() -> None:
    stage = new_stage()
    prim = new_spec(stage, "/Lamp", "Xform")
    specs.display_name(prim, "Lampe 1")
    specs.keep(prim, {"era": 1987}, legacy={"exponent": 2.0})
    specs.apply(prim, "ShapingAPI")
    specs.apply(prim, "ShapingAPI", "ShadowAPI")
    read = stage.GetPrimAtPath("/Lamp")
    assert read.GetDisplayName() == "Lampe 1"
    assert read.GetCustomDataByKey("hdrusd:extras") == '{"era": 1987}'
    assert read.GetCustomDataByKey("hdrusd:legacy:exponent") == 2.0
    assert read.GetAppliedSchemas() == ["ShapingAPI", "ShadowAPI"]
