"""Shader 1 in NumPy: from a G-buffer and lights to cd/m2.

The definition that ``gpu/shaders/light.frag`` follows and is tested against; slow,
exact, and free of OpenGL.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.light import (
    cone_factor,
    focus_factor,
    illuminance,
    inverse_edge,
    inverse_square,
    light_vector,
)
from hdrusd.photometry.reflectance import blinn_phong, half_cosine, lambert
from hdrusd.scene import NO_CONE

Array = npt.NDArray[Any]


def shade(
    position: Array,
    normal: Array,
    diffuse: Array,
    specular: Array,
    shininess: Array,
    lights: npt.NDArray[np.void],
    *,
    eye: Array,
    scale: float = 1.0 / np.pi,
) -> npt.NDArray[np.float64]:
    """Luminance per channel, (..., 3) cd/m2, that the lights give; emission and ambient apart.

    ``position`` (..., 3) m; ``normal`` (..., 3) unit; ``diffuse``, ``specular``
    (..., 3) reflectances; ``shininess`` (...); ``lights`` dtype ``scene.LIGHT``;
    ``eye`` (3,) m in the same space; ``scale`` 1/pi, or 1 for ``petit2010``.
    """
    view = eye - position
    view = view / np.linalg.norm(view, axis=-1, keepdims=True)
    nv = np.sum(normal * view, axis=-1)
    total = np.zeros(np.shape(position), np.float64)
    for light in lights:
        to_light = light_vector(light["position"], light["w"], position)
        d2 = np.maximum(np.sum(to_light * to_light, axis=-1), 1e-20)
        unit = to_light / np.sqrt(d2)[..., None]
        nl = np.sum(normal * unit, axis=-1)
        e = illuminance(nl, 1.0 / d2, inverse_square(light["radius"]))
        if light["outer"] < NO_CONE or light["exponent"] > 0.0:
            cosine = -np.sum(unit * light["axis"], axis=-1)
            edge = inverse_edge(light["inner"], light["outer"])
            e = e * cone_factor(cosine, light["inner"], edge)
            e = e * focus_factor(cosine, light["exponent"])
        lux = light["intensity"] * np.asarray(e)[..., None]
        nh = half_cosine(nl, nv, np.sum(unit * view, axis=-1))
        lobe = blinn_phong(nh, shininess, scale)
        total += lambert(diffuse, lux, scale) + specular * lux * lobe[..., None]
    return total
