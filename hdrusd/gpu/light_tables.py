"""Lights in the layouts that light.frag reads: a class of lights, a table, a variant.

What a light needs in a pixel decides its class, for a software device runs every term
that a shader has. Most lamps are points, perhaps with a beam, and travel light: two to
four texels. Where they are of one make (colour, radius, cone), as along a street, that
travels once for all of them, which leaves one texel a lamp, two with a beam. All others
(area lights, profiles, shadows, links, factors) have six texels and those of their extras.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hdrusd.gpu.profiles import PROFILE
from hdrusd.gpu.shadows import shadow_rows
from hdrusd.photometry.light import inverse_edge, inverse_square, shines_as
from hdrusd.scene import CYLINDER, DISK, NO_CONE, POINT, RECT, SPHERE, Camera

Floats = npt.NDArray[np.float32]
Lights = npt.NDArray[np.void]

#: Batches smaller than the full one, so that a rest of lights costs no more than it must.
#: Few, for each is a program to compile; more where every rectangle has the same rest.
_SMALL_BATCHES = (1, 4, 8, 15, 22)
_SMALL_ALIKE = (1, 2, 3, 4, 6, 8, 10, 12, 16, 20, 24)

#: A make of lamps is a class of its own where that leaves none over, or saves as many a batch.
_ONE_MAKE = 30

#: The class of one make for each class that may have one.
_MAKES = {"PLAIN": "LAMPS", "CONES": "BEAMS"}

#: Colours that are the same to so many decimals of their largest channel are one.
_COLOUR_DECIMALS = 7

_SHAPES = {SPHERE: "SPHERE", DISK: "DISK", RECT: "RECT", CYLINDER: "CYLINDER"}


@dataclass(frozen=True, slots=True, eq=False)
class Extras:
    """What other parts of the renderer know of each light: #defines in words, and texels."""

    shadow_kind: npt.NDArray[np.str_]  # (n,), "" without shadows
    shadow: Floats  # (n, k, 4); gpu/shadows.py
    profile_kind: npt.NDArray[np.str_]  # (n,), "" without a profile
    profile: Floats  # (n, k, 4); gpu/profiles.py

    def of(self, which: npt.NDArray[np.intp]) -> Extras:
        """Those of some lights."""
        return Extras(
            self.shadow_kind[which],
            self.shadow[which],
            self.profile_kind[which],
            self.profile[which],
        )

    def followed_by(self, count: int) -> Extras:
        """The same with ``count`` lights more that have none."""
        return Extras(
            np.pad(self.shadow_kind, (0, count), constant_values=""),
            np.pad(self.shadow, ((0, count), (0, 0), (0, 0))),
            np.pad(self.profile_kind, (0, count), constant_values=""),
            np.pad(self.profile, ((0, count), (0, 0), (0, 0))),
        )


@dataclass(frozen=True, slots=True, eq=False)
class LightClass:
    """Lights that light.frag treats alike."""

    defines: tuple[str, ...]
    members: npt.NDArray[np.intp]  # (n,) their numbers in the scene
    texels: Floats  # (n + 1, rows, 4); the last is dark and fills batches
    uniforms: Mapping[str, tuple[float, ...]] = field(default_factory=dict)  # of one make

    @property
    def rows(self) -> int:
        """Texels a light."""
        return int(self.texels.shape[1])

    def batches(self, varyings: int, alike: bool) -> tuple[int, ...]:
        """How many of them a batch may hold, ascending.

        ``varyings``: vec4 for their texels; ``alike``: all rectangles have as many of them.
        """
        full = varyings // self.rows
        small = _SMALL_ALIKE if alike else _SMALL_BATCHES
        return (*(size for size in small if 4 * size <= 3 * full or (alike and size < full)), full)


def light_classes(lights: Lights, camera: Camera, extras: Extras | None = None) -> list[LightClass]:
    """The lights by what they need; dark ones are left out: they add nothing.

    Positions in the tables are relative to the eye.
    """
    lit = np.flatnonzero(np.any(lights["intensity"] != 0.0, axis=1))
    chosen = lights[lit]
    kinds = _with_makes(chosen, _kinds(chosen, None if extras is None else extras.of(lit)))
    names, which = np.unique(kinds, return_inverse=True)
    classes = []
    for number, name in enumerate(names):
        members = lit[which == number]
        texels = _texels(lights[members], camera, str(name))
        defines = tuple(str(name).split())
        if extras is not None:
            own = extras.of(members)
            parts: list[npt.NDArray[np.floating]] = [texels]
            if "SHADOWED" in defines:
                parts.append(_with_dark(own.shadow[:, : shadow_rows(str(name))]))
            if PROFILE in defines:
                parts.append(_with_dark(own.profile))
            texels = np.concatenate(parts, axis=1)
        table = np.ascontiguousarray(texels, np.float32)
        classes.append(LightClass(defines, members, table, _make(lights[members], str(name))))
    return classes


def _with_makes(lights: Lights, kinds: npt.NDArray[np.str_]) -> npt.NDArray[np.str_]:
    """The kinds, where the commonest make of lamps has one of its own."""
    for kind, make in _MAKES.items():
        number = np.all(np.isfinite(lights["intensity"]), axis=1)
        own = np.flatnonzero((kinds == kind) & (lights["w"] == 1.0) & number)
        if not len(own):
            continue
        lamps = lights[own]
        colour = lamps["intensity"] / _strength(lamps)[:, None]
        same = [np.round(colour, _COLOUR_DECIMALS), lamps["radius"][:, None]]
        if make == "BEAMS":
            same += [lamps["inner"][:, None], lamps["outer"][:, None]]
        keys = np.ascontiguousarray(np.concatenate(same, axis=1) + 0.0)
        words = keys.view(np.dtype((np.void, keys.dtype.itemsize * keys.shape[1]))).ravel()
        _, which, count = np.unique(words, return_inverse=True, return_counts=True)
        most = int(np.argmax(count))
        if count[most] == np.count_nonzero(kinds == kind) or count[most] >= _ONE_MAKE:
            kinds = kinds.copy()
            kinds[own[which == most]] = make
    return kinds


def _make(lamps: Lights, kind: str) -> dict[str, tuple[float, ...]]:
    """The uniforms that say what lamps of one make have in common."""
    if kind not in _MAKES.values():
        return {}
    first = lamps[:1]
    make = *(first["intensity"] / _strength(first))[0], *inverse_square(first["radius"])
    if kind == "LAMPS":
        return {"lamp_make": tuple(map(float, make))}
    edge = *first["inner"], *inverse_edge(first["inner"], first["outer"])
    return {"beam_make": tuple(map(float, make)), "beam_edge": tuple(map(float, edge))}


def _strength(lamps: Lights) -> npt.NDArray[np.float64]:
    """(n,) the channel of the intensity that is farthest from 0, cd, with its sign."""
    largest = np.argmax(np.abs(lamps["intensity"]), axis=1)
    return np.asarray(lamps["intensity"][np.arange(len(lamps)), largest], np.float64)


def _with_dark(texels: Floats) -> Floats:
    return np.concatenate([texels, texels[-1:]])


def _kinds(lights: Lights, extras: Extras | None) -> npt.NDArray[np.str_]:
    """(n,) the #defines of each light, in words."""
    local = lights["w"] > 0.0
    focus = (lights["exponent"] > 0.0) & local
    cone = (lights["outer"] < NO_CONE) & local
    plain = (shines_as(lights) == POINT) & (lights["diffuse"] == 1.0) & (lights["specular"] == 1.0)
    plain &= (lights["link"] == 0) & ~((lights["angle"] > 0.0) & ~local)
    if extras is not None:
        plain &= (extras.shadow_kind == "") & (extras.profile_kind == "")
    kinds = np.where(focus, "FOCUS", np.where(cone, "CONES", "PLAIN")).astype("U200")
    others = np.flatnonzero(~plain)
    if len(others):
        kinds[others] = _words(lights[others], None if extras is None else extras.of(others))
    return kinds


def _words(lights: Lights, extras: Extras | None) -> npt.NDArray[np.str_]:
    """(n,) the #defines of lights that are not simple."""
    local = lights["w"] > 0.0
    beam = ((lights["exponent"] > 0.0) | (lights["outer"] < NO_CONE)) & local
    shape = shines_as(lights)
    words = np.full(len(lights), "SPECIAL", dtype="U200")
    words = np.where(beam, np.char.add(words, " BEAM"), words)
    for number, name in _SHAPES.items():
        words = np.where(shape == number, np.char.add(words, f" {name}"), words)
    words = np.where(~local & (lights["angle"] > 0.0), np.char.add(words, " DISTANT"), words)
    words = np.where(lights["link"] > 0, np.char.add(words, " LINKED"), words)
    if extras is not None:
        shadow = np.char.add("SHADOWED ", extras.shadow_kind)
        for kind, text in (
            (extras.profile_kind, extras.profile_kind),
            (extras.shadow_kind, shadow),
        ):
            words = np.where(kind != "", np.char.add(np.char.add(words, " "), text), words)
    return words


def _texels(lights: Lights, camera: Camera, kind: str) -> npt.NDArray[np.float64]:
    if kind == "PLAIN":
        return _plain(lights, camera)
    if kind == "CONES":
        return _cones(lights, camera)
    if kind == "FOCUS":
        return _focus(lights, camera)
    if kind in _MAKES.values():
        return _of_one_make(lights, camera, kind)
    texels = np.zeros((len(lights) + 1, 6, 4))
    texels[:, :2] = _plain(lights, camera)
    texels[-1, 2:] = [[0, 0, 1, 1], [1, 0, 0, 0], [0, 1, 0, 1], [1, 1, 0, 0]]
    texels[:-1, 2, :3], texels[:-1, 2, 3] = lights["axis"], lights["exponent"]
    texels[:-1, 3, :3], texels[:-1, 3, 3] = lights["x"], lights["inner"]
    texels[:-1, 4, :3] = lights["y"]
    texels[:-1, 4, 3] = inverse_edge(lights["inner"], lights["outer"])
    texels[:-1, 5, 0], texels[:-1, 5, 1] = lights["diffuse"], lights["specular"]
    texels[:-1, 5, 2] = lights["link"]
    texels[:-1, 5, 3] = np.where(lights["w"] > 0.0, lights["radius"], np.tan(lights["angle"]))
    return texels


def _plain(lights: Lights, camera: Camera) -> npt.NDArray[np.float64]:
    texels = np.zeros((len(lights) + 1, 2, 4))
    texels[-1] = _DARK[:2]
    texels[:-1, 0, :3], texels[:-1, 0, 3] = _relative(lights, camera), lights["w"]
    texels[:-1, 1, :3], texels[:-1, 1, 3] = lights["intensity"], inverse_square(lights["radius"])
    return texels


def _cones(lights: Lights, camera: Camera) -> npt.NDArray[np.float64]:
    texels = np.zeros((len(lights) + 1, 3, 4))
    texels[-1] = _DARK[:3]
    texels[:-1, 0, :3] = _relative(lights, camera)
    texels[:-1, 0, 3] = inverse_square(lights["radius"])
    texels[:-1, 1, :3], texels[:-1, 1, 3] = lights["intensity"], lights["inner"]
    texels[:-1, 2, :3] = lights["axis"]
    texels[:-1, 2, 3] = inverse_edge(lights["inner"], lights["outer"])
    return texels


def _of_one_make(lights: Lights, camera: Camera, kind: str) -> npt.NDArray[np.float64]:
    texels = np.zeros((len(lights) + 1, 1 if kind == "LAMPS" else 2, 4))
    texels[-1, 0], texels[-1, 1:] = [0.0, 0.0, 1e6, 0.0], [0.0, 0.0, 1.0, 0.0]
    texels[:-1, 0, :3], texels[:-1, 0, 3] = _relative(lights, camera), _strength(lights)
    if kind == "BEAMS":
        texels[:-1, 1, :3] = lights["axis"]
    return texels


def _focus(lights: Lights, camera: Camera) -> npt.NDArray[np.float64]:
    texels = np.zeros((len(lights) + 1, 4, 4))
    texels[-1] = _DARK
    texels[:, :2] = _plain(lights, camera)
    texels[:-1, 2, :3], texels[:-1, 2, 3] = lights["axis"], lights["exponent"]
    texels[:-1, 3, 0] = lights["inner"]
    texels[:-1, 3, 1] = inverse_edge(lights["inner"], lights["outer"])
    return texels


def _relative(lights: Lights, camera: Camera) -> npt.NDArray[np.float64]:
    return np.asarray(lights["position"] - lights["w"][:, None] * np.asarray(camera.eye))


#: Rows of a light that is not there: dark, and nowhere near a surface.
_DARK = np.array([[0.0, 0.0, 1e6, 1.0], [0, 0, 0, 1], [0, 0, 1, 1], [0, 1, 0, 0]])
