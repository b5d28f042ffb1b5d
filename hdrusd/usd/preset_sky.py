"""A sky that has a picture, and its sun or moon, on a stage: a DomeLight and a DistantLight.

The picture is in cd/m2 and the dome's intensity 1, so that UsdLux itself says the luminance;
no ambient term stands beside them. North is -Z on a stage whose Y is up, +Y where Z is.
"""

from __future__ import annotations

from collections.abc import Sequence

from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from hdrusd.photometry.light import PhotometricLight
from hdrusd.usd.light import write_light, write_origin
from hdrusd.usd.transform import aim

#: From +Y up to +Z up: a quarter turn about X.
_Z_UP = Gf.Rotation(Gf.Vec3d(1, 0, 0), 90.0)


def write_sky_dome(
    stage: Usd.Stage, path: Sdf.Path, light: PhotometricLight, picture: str
) -> Usd.Prim:
    """Define the dome; of ``light`` only where its numbers come from is written."""
    dome = UsdLux.DomeLight.Define(stage, path)
    dome.CreateIntensityAttr(1.0)
    dome.CreateColorAttr(Gf.Vec3f(1.0))
    dome.CreateTextureFileAttr(Sdf.AssetPath(picture))
    dome.CreateTextureFormatAttr(UsdLux.Tokens.latlong)
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z:
        turn = UsdGeom.Xformable(dome).AddOrientOp(UsdGeom.XformOp.PrecisionDouble)
        turn.Set(Gf.Quatd(_Z_UP.GetQuat()))
    target = stage.GetEditTarget()
    write_origin(target.GetPrimSpecForScenePath(path), light)
    return dome.GetPrim()


def write_sky_sun(
    stage: Usd.Stage, path: Sdf.Path, light: PhotometricLight, towards: Sequence[float]
) -> Usd.Prim:
    """Define the sun or the moon; ``towards`` it with +Y up, -Z north."""
    prim = write_light(stage, path, light)
    way = -Gf.Vec3d(*towards)
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z:
        way = _Z_UP.TransformDir(way)
    turn = aim((way[0], way[1], way[2]))
    if turn is not None:
        UsdGeom.Xformable(prim).AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(turn))
    return prim
