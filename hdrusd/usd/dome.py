"""A dome light with a picture: ``read_sky``, which is what ``scene.Sky`` holds.

OpenUSD 26.11, schema text of DomeLight and DomeLight_1: a lat-long picture stands as
OpenEXR's, with its top row towards +Y of the light's space, its middle towards +Z and
a quarter of its width from the left towards +X. With ``poleAxis`` Z, or "scene" on a
stage whose Z is up, the top row is towards +Z and the middle towards -Y.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from hdrusd.report import Kind, Report
from hdrusd.scene import RGB, Sky, TextureRef
from hdrusd.units import dome_luminance
from hdrusd.usd.assets import resolved_asset
from hdrusd.usd.findings import prim_finding
from hdrusd.usd.light_controls import casts_shadows
from hdrusd.usd.lux import input_source

#: Formats read as lat-long. What "automatic" looks for in a file is RenderMan's own.
_LATLONG = ("latlong", "automatic")


def read_sky(
    prim: Usd.Prim, time: Usd.TimeCode, lux: RGB, world: Gf.Matrix4d, report: Report
) -> Sky | None:
    """The picture of a dome; None for a dome without one that can be read.

    ``lux``: per channel, from ``read_dome``: what the dome would give if its picture were
    white. ``world``: local to world, row vectors; of it the rotation counts, and whether it
    mirrors.
    """
    if prim.GetRelationship("portals").HasAuthoredTargets():
        text = "portals are not used; they change no light, only how it is sampled"
        prim_finding(report, prim, Kind.DROPPED, "dome-portals", text)
    picture = dome_picture(prim, time)
    if not picture:
        return None
    layout = input_source(prim, "texture:format").Get(time)
    if layout not in _LATLONG:
        text = f"a picture in the format {layout} is not read; the dome is uniform. Want latlong"
        prim_finding(report, prim, Kind.DROPPED, "dome-texture", text)
        return None
    red, green, blue = (dome_luminance(channel) for channel in lux)
    axes = _orthogonal(np.array(world, np.float64)[:3, :3])
    if axes is None:
        text = "a transform without volume or not finite; the dome is not turned"
        prim_finding(report, prim, Kind.INVALID, "dome-transform", text)
        axes = np.eye(3)
    if _pole(prim) == "Z":
        axes = np.stack([axes[0], axes[2], -axes[1]])
    texture = TextureRef(picture, "auto", "repeat", "clamp")
    return Sky(
        texture,
        (red, green, blue),
        tuple(float(v) for v in axes.ravel()),
        shadow=casts_shadows(prim, time),
    )


def dome_picture(prim: Usd.Prim, time: Usd.TimeCode) -> str:
    """Where the picture of a dome is; "" for a dome without one."""
    attribute = input_source(prim, "texture:file")
    asset = attribute.Get(time) if attribute else None
    if not isinstance(asset, Sdf.AssetPath) or not asset.path:
        return ""
    return resolved_asset(attribute, asset)


def _pole(prim: Usd.Prim) -> str:
    """The axis of the light's space that the picture's top row is towards: "Y" or "Z"."""
    if not prim.IsA(UsdLux.DomeLight_1):
        return "Y"
    pole = str(UsdLux.DomeLight_1(prim).GetPoleAxisAttr().Get())
    return pole if pole in ("Y", "Z") else str(UsdGeom.GetStageUpAxis(prim.GetStage()))


def _orthogonal(matrix: npt.NDArray[np.float64]) -> npt.NDArray[np.float64] | None:
    """The nearest (3, 3) rotation, or rotation and mirror, by its singular values."""
    if not np.isfinite(matrix).all():
        return None
    largest = float(np.abs(matrix).max())
    u, sizes, v = np.linalg.svd(matrix / largest if largest > 0.0 else matrix)
    return np.asarray(u @ v) if sizes[2] > 1e-9 * sizes[0] else None
