"""Shader 1 in NumPy: from a G-buffer and lights to cd/m2.

The definition that ``gpu/shaders/light.frag`` follows and is tested against; slow,
exact, and free of OpenGL.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.area import (
    cylinder_illuminance,
    disk_illuminance,
    rect_illuminance,
    sphere_illuminance,
)
from hdrusd.photometry.highlight import (
    STRAIGHT,
    blinn_alpha2,
    cylinder_point,
    disk_point,
    highlight_share,
    lobe_share,
    rect_point,
    sphere_point,
    sphere_spread,
    spread,
)
from hdrusd.photometry.light import (
    cone_factor,
    focus_factor,
    illuminance,
    inverse_edge,
    inverse_square,
    light_vector,
    shines_as,
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
from hdrusd.photometry.profile import pack_profiles, profile_candela
from hdrusd.photometry.reflectance import blinn_phong, half_cosine, lambert
from hdrusd.scene import CYLINDER, DISK, POINT, RECT, SPHERE, Profile

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
    middle: Array  # (...) N.L of the light's centre
    spread: Array  # (..., 2) by how much its size moves the half vector (highlight.py); 0: none


def _point(light: np.void, to: Array, normal: Array) -> Array:
    d2 = np.maximum(np.sum(to * to, axis=-1), 1e-20)
    cosine = np.sum(normal * to, axis=-1) / np.sqrt(d2)
    return illuminance(cosine, 1.0 / d2, inverse_square(light["radius"]))


def _rect(light: np.void, to: Array, normal: Array) -> Array:
    return rect_illuminance(to, normal, light["axis"], light["x"], light["y"])


def _disk(light: np.void, to: Array, normal: Array) -> Array:
    return disk_illuminance(to, normal, light["axis"], light["x"], light["y"])


def _sphere(light: np.void, to: Array, normal: Array) -> Array:
    return sphere_illuminance(to, normal, light["radius"])


def _cylinder(light: np.void, to: Array, normal: Array) -> Array:
    return cylinder_illuminance(to, normal, light["x"], light["radius"])


#: By LIGHT.shape, lux per candela on the axis from a light in ``to`` (..., 3) m.
FIELDS: dict[int, Callable[[np.void, Array, Array], Array]] = {
    POINT: _point,
    RECT: _rect,
    DISK: _disk,
    SPHERE: _sphere,
    CYLINDER: _cylinder,
}


def arrive(light: np.void, surface: Surface, profiles: Sequence[Profile]) -> Arrival:
    """What a light gives: E = I f(theta) cos / d^2 of a lamp without size, else by area.py.

    Cone, focus and profile of a light that has a size are those of the direction from its
    centre. Its highlight is that of its representative point (highlight.py); what lies below
    the highlight gets 1 - F of that point too.
    """
    to = light_vector(light["position"], light["w"], surface.position)
    toward = to / np.sqrt(np.maximum(np.sum(to * to, axis=-1), 1e-20))[..., None]
    if light["w"] == 0.0 and light["angle"] > 0.0:
        received = sphere_illuminance(toward, surface.normal, np.sin(light["angle"]))
    else:
        received = FIELDS[int(shines_as(light))](light, to, surface.normal)
    if light["w"] > 0.0:
        cosine = -np.sum(toward * light["axis"], axis=-1)
        edge = inverse_edge(light["inner"], light["outer"])
        received = received * cone_factor(cosine, light["inner"], edge)
        received = received * focus_factor(cosine, light["exponent"])
    if light["profile"] >= 0:
        received = received * _candela(light, toward, profiles[int(light["profile"])])
    lux = light["intensity"] * np.asarray(received)[..., None]
    middle = np.sum(surface.normal * toward, axis=-1)
    point, moved = represented(light, to, surface)
    point = point / np.sqrt(np.maximum(np.sum(point * point, axis=-1), 1e-20))[..., None]
    return Arrival(lux, lux, point, middle, moved)


def represented(light: np.void, to: Array, surface: Surface) -> tuple[Array, Array]:
    """(..., 3) to the point of a light that stands for it in a highlight, (..., 2) its spread.

    ``to`` (..., 3): to its centre. The spread is times k of ``lobe_share``.
    """
    nv = np.sum(surface.normal * surface.view, axis=-1, keepdims=True)
    ray = 2.0 * nv * surface.normal - surface.view
    view, x, y, radius = surface.view, light["x"], light["y"], light["radius"]
    straight = np.array([STRAIGHT, STRAIGHT**2])
    if light["w"] == 0.0:
        sine = np.sin(light["angle"])
        return sphere_point(to, ray, sine), sphere_spread(to, view, sine)
    shape = int(shines_as(light))
    if shape == RECT:
        return rect_point(to, ray, light["axis"], x, y), straight * spread(to, view, x, y)
    if shape == DISK:
        return disk_point(to, ray, light["axis"], x, y), spread(to, view, x, y)
    if shape == SPHERE:
        return sphere_point(to, ray, radius), sphere_spread(to, view, radius)
    if shape == CYLINDER:
        across = np.cross(x, to)
        size = np.sqrt(np.maximum(np.sum(across * across, axis=-1, keepdims=True), 1e-20))
        moved = spread(to, view, x, radius * across / size)
        return cylinder_point(to, ray, x, radius), straight * moved
    return to, np.zeros((*to.shape[:-1], 2))


def _candela(light: np.void, toward: Array, profile: Profile) -> Array:
    """Of the profile in the direction of emission."""
    sides = (v / np.linalg.norm(v) for v in (light["x"], light["y"]))
    away = -np.stack([np.sum(toward * v, axis=-1) for v in (*sides, light["axis"])], axis=-1)
    atlas, placements = pack_profiles([profile])
    place, grid = placements[0]
    return profile_candela(atlas, place, grid, away)


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
    profiles: Sequence[Profile] = (),
) -> Doubles:
    """Luminance per channel, (..., 3) cd/m2, that the lights give; emission and ambient apart.

    ``position`` (..., 3) m; ``normal`` (..., 3) unit; ``diffuse``, ``specular``
    (..., 3) reflectances; ``gloss`` (...): Blinn-Phong exponent, or minus the alpha of GGX;
    ``lights`` dtype ``scene.LIGHT``, with the scene's ``profiles``; ``eye`` (3,) m in the same
    space, or (..., 3); ``scale`` 1/pi, or 1 for ``petit2010``. ``metallic``, ``coat`` (weight,
    alpha) and ``links`` as in ``Surface``. Shadows are not part of it.
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
        arrival = arrive(light, surface, profiles)
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
    lobe = lobe * _of_size(arrival, nl, blinn_alpha2(exponent))
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
    lobes = [
        _lobe(width, nl, nv, sine2, scale) * _of_size(arrival, nl, np.square(width))
        for width in (alpha, surface.coat[..., 1])
    ]
    bright = layered(layered(np.zeros(3), f, lobes[0]), on, lobes[1])
    modern = arrival.lux * dull + arrival.gloss_lux * specular * bright
    return np.where(is_ggx[..., None], modern, legacy)


def _of_size(arrival: Arrival, nl: Array, alpha2: Array) -> Array:
    return highlight_share(lobe_share(arrival.spread, 1.0, alpha2), nl, arrival.middle)


def _lobe(alpha: Array, nl: Array, nv: Array, sine2: Array, scale: float) -> Array:
    alpha2 = np.square(alpha)
    return ggx_lobe(ggx_gain(nv, alpha2, scale), alpha2, nl, sine2)
