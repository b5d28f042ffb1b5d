"""The sky of a stage: lux from everywhere alike, and domes with pictures.

``write_ambient`` and ``read_ambient``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Gf, Sdf, Usd, UsdGeom

from hdrusd.photometry.light import PhotometricLight
from hdrusd.report import Kind, Report
from hdrusd.scene import RGB, Sky
from hdrusd.usd.dome import dome_picture, read_sky
from hdrusd.usd.findings import prim_finding
from hdrusd.usd.light import read_dome
from hdrusd.usd.light_bounds import STRONGEST

API = "HdrusdAmbientAPI"


def has_ambient(stage: Usd.Stage) -> bool:
    """Whether the default prim states a sky."""
    root = stage.GetDefaultPrim()
    return bool(root) and bool(root.HasAPI(API))


def write_ambient(root: Usd.Prim, light: PhotometricLight, dome: Sdf.Path) -> None:
    """State on the default prim the sky that the light at ``dome`` says to other renderers."""
    root.ApplyAPI(API)
    types = Sdf.ValueTypeNames
    lux = root.CreateAttribute("photometric:ambient:illuminance", types.Float, False)
    lux.Set(light.intensity)
    color = root.CreateAttribute("photometric:ambient:color", types.Color3f, False)
    color.Set(Gf.Vec3f(*light.chromaticity))
    root.CreateRelationship("photometric:ambient:light", False).SetTargets([dome])


def read_ambient(
    stage: Usd.Stage,
    domes: Iterable[Usd.Prim],
    cache: UsdGeom.XformCache,
    report: Report,
    *,
    sky_visible: bool = False,
) -> tuple[RGB, tuple[Sky, ...]]:
    """Illuminance per channel (lx) under open sky, and the skies beside it.

    Our AmbientAPI, unless every dome that stands for it is hidden, and the domes
    that it does not stand for, at the cache's time. What is negative or not finite is
    left out.
    """
    time = cache.GetTime()
    total, skies = np.zeros(3), list[Sky]()
    spoken_for: set[Sdf.Path] = set()
    plain = 0
    if has_ambient(stage):
        root = stage.GetDefaultPrim()
        targets = root.GetRelationship("photometric:ambient:light").GetTargets()
        shown = [p for path in targets if (p := stage.GetPrimAtPath(path)) and _visible(p, time)]
        stated = _stated(root, time)
        if stated is not None:
            spoken_for.update(targets)
            if shown or not targets:
                lux = _sound(stated, root, report)
                plain += bool(lux.any())
                total += lux
    for prim in (dome for dome in domes if _visible(dome, time)):
        if prim.GetPath() in spoken_for:
            if dome_picture(prim, time):
                text = f"{API} stands for this dome; its picture is not shown"
                prim_finding(report, prim, Kind.DROPPED, "dome-texture", text)
            continue
        lux = np.asarray(read_dome(prim, time, report) or (0.0, 0.0, 0.0))
        lux = _sound(lux, prim, report)
        sky = read_sky(prim, time, _rgb(lux), cache.GetLocalToWorldTransform(prim), report)
        if sky is None:
            plain += bool(lux.any())
            total += lux
        else:
            skies.append(replace(sky, visible=sky_visible))
    if plain > 1:
        text = f"{plain} skies without a picture add up; a model that is placed needs none"
        prim_finding(report, stage.GetPseudoRoot(), Kind.ASSUMED, "skies-add", text)
    return _rgb(total), tuple(skies)


def _rgb(values: npt.NDArray[np.float64]) -> RGB:
    r, g, b = (float(v) for v in values)
    return r, g, b


def _stated(root: Usd.Prim, time: Usd.TimeCode) -> npt.NDArray[np.float64] | None:
    """Lux per channel of the AmbientAPI; NaN for what is no number, None where it is silent."""
    lux: Any = root.GetAttribute("photometric:ambient:illuminance").Get(time)
    color: Any = root.GetAttribute("photometric:ambient:color").Get(time)
    if lux is None:
        return None
    tint = np.ones(3) if color is None else np.ravel(np.asarray(color))
    if not isinstance(lux, (int, float)) or tint.dtype.kind not in "fiu" or tint.size != 3:
        return np.full(3, np.nan)
    return np.asarray(float(lux) * tint.astype(np.float64))


def _sound(lux: npt.NDArray[np.float64], prim: Usd.Prim, report: Report) -> npt.NDArray[np.float64]:
    if ((lux >= 0.0) & (lux <= STRONGEST)).all():
        return lux
    text = "not finite, negative or too large; left out"
    prim_finding(report, prim, Kind.INVALID, "light-invalid", text)
    return np.zeros(3)


def _visible(prim: Usd.Prim, time: Usd.TimeCode) -> bool:
    return bool(UsdGeom.Imageable(prim).ComputeVisibility(time) != UsdGeom.Tokens.invisible)
