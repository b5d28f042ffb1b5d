"""What the further texture units of an OpenSceneGraph file hold: their names and modes tell.

Fixed-function OpenGL makes a product or a sum of the units; a program's shaders make of them
what they like, and exporters name the pictures for it (``LAMP_DIFF``, ``LAMP_ILLUM``). A name
says more than a mode that nobody has set. A unit set to ADD gives light of its own.

Light that was baked is no reflectance and no lamp's: it is not taken. Normal maps are, as those
of OpenGL, whose green points to where t grows.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import PurePosixPath
from typing import Literal

_GLOW, _NORMAL = "an emission map", "a normal map"
#: Words of file names to what the picture is.
_WORDS = {
    word: what
    for what, words in {
        _GLOW: "illum illumination selfillum selfillumination emission emissive emit emis glow",
        "a light map": "lightmap lightmaps lmap baked bake shadow shadows shadowmap ao occlusion",
        _NORMAL: "norm normal normals normalmap nrm nmap",
        "a specular map": "spec specular specularity gloss glossiness",
        "a roughness or metallic map": "rough roughness metal metallic metalness",
        "a reflection map": "env envmap environment reflection refl spheremap",
        "an opacity map": "opacity alpha transparency",
        "a height map": "height heightmap disp displacement bump bumpmap",
        "a detail map": "detail noise",
        "a colour map": "diff diffuse albedo color colour basecolor",
    }.items()
    for word in words.split()
}
_SPLIT = re.compile(r"[a-z]+|[A-Z]+(?![a-z])|[A-Z][a-z]*")
#: What a mode alone says.
_MODES = {
    "ADD": "added to what is lit",
    "MODULATE": "multiplied with the first: a light map or a detail",
    "DECAL": "laid over the first by its alpha",
    "BLEND": "mixed with the first",
    "REPLACE": "in place of the first",
}


def further_map(
    name: str, mode: str | None, *, again: bool
) -> tuple[Literal["emission", "normal"] | None, str]:
    """The map of a material that the picture of a further unit is, and what it seems, in words.

    ``mode``: of its TexEnv, None without one; ``again``: it is the picture of the first unit.
    """
    said = "no mode" if mode is None else f"mode {mode}"
    if again:
        return None, f"{said}, the picture of the first unit again"
    what = named_map(name)
    if what is None:
        does = _MODES.get(mode or "MODULATE", "of unknown use")
        return "emission" if mode == "ADD" else None, f"{said}, {does}"
    said = f"{said}, by its name {what}"
    if what == _NORMAL:
        return "normal", said
    # Multiplied, what is called illumination is light that was baked onto the surface.
    return "emission" if what == _GLOW and mode in (None, "ADD") else None, said


def named_map(name: str) -> str | None:
    """What a picture is by the last word of its name that tells; None where none does."""
    stem = PurePosixPath(name.replace("\\", "/")).stem
    words = [word.lower() for word in _SPLIT.findall(stem)]
    joined = [a + b for a, b in pairwise(words)]  # light_map, SelfIllum
    for number in range(len(words) - 1, -1, -1):
        pair = joined[number - 1] if number else ""
        found = _WORDS.get(pair) or _WORDS.get(words[number])
        if found is not None:
            return found
    return None
