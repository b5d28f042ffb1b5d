"""Scotopic luminance from what lamps are: a second frame of the scene as rods would light it.

RGB says little of what rods see of a lamp: it makes twice too much of sodium's. A lamp that
states its S/P, the ratio of its scotopic to its photopic light, is given that much light in a
second frame, and ``eye.scotopic.scotopic`` of that frame is right for its light as it arrives;
only the colours of surfaces are still estimated from RGB.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.colour import luminance
from hdrusd.eye.scotopic import scotopic
from hdrusd.scene import Material, RenderScene

#: S/P of CIE standard illuminants, rounded to 0.01: 1700 times the integral with V' (CIE 1951)
#: over 683 times that with V (CIE 1924), of the spectra of CIE 15:2018 (A incandescent, D
#: daylight, FL fluorescent, HP1 and HP2 high-pressure sodium, HP3 to HP5 metal halide, LED-B
#: white by a blue LED, LED-BH by a blue and a red one, LED-V by a violet one, LED-RGB by three).
ILLUMINANTS = {
    "A": 1.41,
    "D50": 2.16,
    "D55": 2.27,
    "D65": 2.46,
    "D75": 2.61,
    "E": 2.26,
    "FL1": 2.20,
    "FL2": 1.57,
    "FL3": 1.25,
    "FL4": 1.02,
    "FL5": 2.15,
    "FL6": 1.48,
    "FL7": 2.32,
    "FL8": 2.09,
    "FL9": 1.78,
    "FL10": 1.85,
    "FL11": 1.60,
    "FL12": 1.25,
    "HP1": 0.56,
    "HP2": 1.06,
    "HP3": 1.36,
    "HP4": 1.59,
    "HP5": 1.79,
    "LED-B1": 1.21,
    "LED-B2": 1.33,
    "LED-B3": 1.72,
    "LED-B4": 1.85,
    "LED-B5": 2.18,
    "LED-BH1": 1.27,
    "LED-RGB1": 1.66,
    "LED-V1": 1.41,
    "LED-V2": 1.96,
}


def scotopic_factor(rgb: npt.ArrayLike, sp: npt.ArrayLike) -> npt.NDArray[Any]:
    """What light of colours (..., 3) is multiplied by for its S/P to be ``sp`` (...); 1 for 0."""
    rgb, sp = np.asarray(rgb, np.float64), np.asarray(sp, np.float64)
    rods, cones = scotopic(rgb), luminance(rgb)
    told = (sp > 0.0) & (rods > 0.0)
    return np.where(told, sp * cones / np.where(told, rods, 1.0), 1.0)


def scotopic_scene(scene: RenderScene) -> RenderScene | None:
    """The scene of which ``eye.scotopic.scotopic`` is taken; None where nobody states an S/P.

    The two reflections of each light are scaled, not its intensity: shadow maps and merged
    lamps stay those of the photopic frame.
    """
    glow = any(material.emission_sp > 0.0 for material in scene.materials)
    if not (glow or (scene.lights["sp"] > 0.0).any()):
        return None
    lights = scene.lights.copy()
    factor = scotopic_factor(lights["intensity"], lights["sp"])
    for name in ("diffuse", "specular"):
        lights[name] *= factor
    return replace(scene, lights=lights, materials=tuple(map(_glowing, scene.materials)))


def _glowing(material: Material) -> Material:
    if material.emission_sp <= 0.0:
        return material
    factor = float(scotopic_factor(material.emission, material.emission_sp))
    red, green, blue = (factor * channel for channel in material.emission)
    use = material.emission_map
    if use is not None:
        red_scale, green_scale, blue_scale, alpha = use.scale
        scale = factor * red_scale, factor * green_scale, factor * blue_scale, alpha
        use = replace(use, scale=scale)
    return replace(material, emission=(red, green, blue), emission_map=use)
