"""Prints the photometry of any USD stage's lights, by the text of UsdLux since OpenUSD 25.05.

    python samples/light_units/read_units.py STAGE

It knows nothing of hdrusd: what another converter wrote is read by the same formulas.
The luminance of a light is ``intensity * 2^exposure * Y(color)`` in cd/m2, so that

    sphere of radius r       I = L pi r^2      cd; normalised, L is divided by 4 pi r^2
    distant of angle a       E = L pi sin^2(a / 2)   lx; normalised, E = L
    emissiveColor            L = Y(color)      cd/m2

with lengths in metres.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator

from pxr import Usd, UsdGeom, UsdLux, UsdShade

#: Luminance of linear Rec. 709.
WEIGHTS = (0.2126, 0.7152, 0.0722)


def luminance(color: tuple[float, float, float]) -> float:
    """Y of linear Rec. 709."""
    return sum(weight * c for weight, c in zip(WEIGHTS, color, strict=True))


def strength(light: UsdLux.LightAPI) -> float:
    """The luminance that the attributes of every light say, cd/m2."""
    exposure = 2.0 ** light.GetExposureAttr().Get()
    return float(light.GetIntensityAttr().Get() * exposure * luminance(light.GetColorAttr().Get()))


def readings(stage: Usd.Stage) -> Iterator[tuple[str, float, str]]:
    """Path, number and unit of each light and each glowing material."""
    unit = UsdGeom.GetStageMetersPerUnit(stage)
    for prim in stage.Traverse():
        if prim.IsA(UsdLux.SphereLight):
            light = UsdLux.LightAPI(prim)
            world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)
            scale = world.GetRow3(0).GetLength() * unit
            radius = UsdLux.SphereLight(prim).GetRadiusAttr().Get() * scale
            candela = strength(light) * math.pi * radius**2
            if light.GetNormalizeAttr().Get():
                candela /= 4.0 * math.pi * radius**2
            yield str(prim.GetPath()), candela, "cd"
        elif prim.IsA(UsdLux.DistantLight):
            light = UsdLux.LightAPI(prim)
            half = math.radians(UsdLux.DistantLight(prim).GetAngleAttr().Get()) / 2.0
            normal = light.GetNormalizeAttr().Get()
            lux = strength(light) * (1.0 if normal else math.pi * math.sin(half) ** 2)
            yield str(prim.GetPath()), lux, "lx"
        elif prim.IsA(UsdShade.Material):
            shader = UsdShade.Material(prim).ComputeSurfaceSource()[0]
            glow = shader and shader.GetInput("emissiveColor")
            value = glow.Get() if glow else None
            if value is not None and luminance(value) > 0.0:
                yield str(prim.GetPath()), luminance(value), "cd/m2"


if __name__ == "__main__":
    for path, value, unit in readings(Usd.Stage.Open(sys.argv[1])):
        print(f"{path}: {value:.6g} {unit}")
