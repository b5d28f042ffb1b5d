"""Shader 1 in NumPy: from a G-buffer and lights to cd/m2.

The definition that ``gpu/shaders/light.frag`` follows and is tested against; slow,
exact, and free of OpenGL.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
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
from hdrusd.photometry.microfacet import (
    coat_reflectance,
    fresnel,
    ggx_gain,
    ggx_lobe,
    grazing_reflectance,
    half_angles,
    layered,
    schlick_weight,
)
from hdrusd.photometry.reflectance import blinn_phong, half_cosine, lambert
from hdrusd.scene import NO_CONE, POINT

Array = npt.NDArray[Any]
Doubles = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Where light arrives: the G-buffer of pixels of any shape (...)."""

    position: Array  # (..., 3) m
    normal: Array  # (..., 3) unit
    view: Array  # (..., 3) unit, to the eye
    diffuse: Array  # (..., 3) reflectance
    specular: Array  # (..., 3) reflectance of the highlight, at normal incidence for GGX
    gloss: Array  # (...) Blinn-Phong exponent, or minus the alpha of GGX
    metallic: Array  # (...)
    coat: Array  # (..., 2) weight and alpha of a clear coat; on GGX alone
    links: Array  # (...) bits of the light links that name it


@dataclass(frozen=True, slots=True, eq=False)
class Arrival:
    """What one light gives to a surface."""

    lux: Array  # (..., 3) on it, for what it reflects to all sides
    gloss_lux: Array  # (..., 3) the same for its highlight
    toward: Array  # (..., 3) unit vector that the highlight takes for the way to the light


def point_arrival(light: np.void, surface: Surface) -> Arrival:
    """A lamp without size, or a distant light: E = I f(theta) cos / d^2."""
    to_light = light_vector(light["position"], light["w"], surface.position)
    d2 = np.maximum(np.sum(to_light * to_light, axis=-1), 1e-20)
    toward = to_light / np.sqrt(d2)[..., None]
    nl = np.sum(surface.normal * toward, axis=-1)
    e = illuminance(nl, 1.0 / d2, inverse_square(light["radius"]))
    if light["outer"] < NO_CONE or light["exponent"] > 0.0:
        cosine = -np.sum(toward * light["axis"], axis=-1)
        edge = inverse_edge(light["inner"], light["outer"])
        e = e * cone_factor(cosine, light["inner"], edge)
        e = e * focus_factor(cosine, light["exponent"])
    lux = light["intensity"] * np.asarray(e)[..., None]
    return Arrival(lux, lux, toward)


#: By LIGHT.shape, how light of that shape arrives.
ARRIVALS: dict[int, Callable[[np.void, Surface], Arrival]] = {POINT: point_arrival}


def shade(
    position: Array,
    normal: Array,
    diffuse: Array,
    specular: Array,
    gloss: Array,
    lights: npt.NDArray[np.void],
    *,
    eye: Array,
    scale: float = 1.0 / np.pi,
    metallic: Array | float = 0.0,
    coat: Array | tuple[float, float] = (0.0, 1.0),
    links: Array | int = 0,
) -> Doubles:
    """Luminance per channel, (..., 3) cd/m2, that the lights give; emission and ambient apart.

    ``position`` (..., 3) m; ``normal`` (..., 3) unit; ``diffuse``, ``specular``
    (..., 3) reflectances; ``gloss`` (...): Blinn-Phong exponent, or minus the alpha of GGX;
    ``lights`` dtype ``scene.LIGHT``; ``eye`` (3,) m in the same space; ``scale`` 1/pi, or 1
    for ``petit2010``. ``metallic``, ``coat`` (weight, alpha) and ``links`` as in ``Surface``.
    """
    view = eye - position
    view = view / np.linalg.norm(view, axis=-1, keepdims=True)
    shape = np.shape(position)[:-1]
    surface = Surface(
        position,
        normal,
        view,
        np.asarray(diffuse),
        np.asarray(specular),
        np.broadcast_to(gloss, shape),
        np.broadcast_to(metallic, shape),
        np.broadcast_to(coat, (*shape, 2)),
        np.broadcast_to(links, shape).astype(np.int64),
    )
    total = np.zeros(np.shape(position), np.float64)
    for light in lights:
        arrival = ARRIVALS[int(light["shape"])](light, surface)
        total += reached(light, surface)[..., None] * reflect(
            surface,
            arrival,
            diffuse=float(light["diffuse"]),
            specular=float(light["specular"]),
            scale=scale,
        )
    return total


def reached(light: np.void, surface: Surface) -> Doubles:
    """(...) 1 where the light's link names the surface, else 0."""
    if light["link"] == 0:
        return np.ones(np.shape(surface.links))
    return ((surface.links >> (int(light["link"]) - 1)) & 1).astype(np.float64)


def reflect(
    surface: Surface, arrival: Arrival, *, diffuse: float, specular: float, scale: float
) -> Doubles:
    """cd/m2, (..., 3), of what arrives; ``diffuse``, ``specular``: the light's factors."""
    nl = np.sum(surface.normal * arrival.toward, axis=-1)
    nv = np.sum(surface.normal * surface.view, axis=-1)
    matte = diffuse * lambert(surface.diffuse, np.ones(3), scale)
    is_ggx = surface.gloss < 0.0
    lv = np.sum(arrival.toward * surface.view, axis=-1)
    exponent = np.where(is_ggx, 0.0, surface.gloss)
    lobe = specular * blinn_phong(half_cosine(nl, nv, lv), exponent, scale)
    legacy = arrival.lux * matte + arrival.gloss_lux * surface.specular * lobe[..., None]

    sine2, vh = np.moveaxis(
        half_angles(surface.normal, arrival.toward, surface.view, nl, nv), -1, 0
    )
    weight = schlick_weight(vh)
    f90 = grazing_reflectance(surface.specular, surface.metallic)
    f = fresnel(surface.specular, f90, weight)
    on = coat_reflectance(surface.coat[..., 0], weight)[..., None]
    alpha = np.where(is_ggx, -surface.gloss, 1.0)
    # Both reflections are layered alike, but a light may give them different lux.
    dull = layered(layered(matte, f, np.zeros(nl.shape)), on, np.zeros(nl.shape))
    bright = layered(
        layered(np.zeros(3), f, _lobe(alpha, nl, nv, sine2, scale)),
        on,
        _lobe(surface.coat[..., 1], nl, nv, sine2, scale),
    )
    modern = arrival.lux * dull + arrival.gloss_lux * specular * bright
    return np.where(is_ggx[..., None], modern, legacy)


def _lobe(alpha: Array, nl: Array, nv: Array, sine2: Array, scale: float) -> Array:
    alpha2 = np.square(alpha)
    return ggx_lobe(ggx_gain(nv, alpha2, scale), alpha2, nl, sine2)
