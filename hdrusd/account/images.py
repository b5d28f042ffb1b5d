"""Every picture that a source names, and the class of what it is used for.

Only pictures of reflectance and emission go through T^gamma; the rest stays as it is. What no
material uses is listed too, by the notes that a reader left in ``extras``: an unused picture
that is called an emission map is a lamp that stays dark.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any

from hdrusd.legacy.pictures import picture_names
from hdrusd.legacy.scene import Image, Material
from hdrusd.photometry.albedo import words
from hdrusd.usd.material import Surface

#: The classes, best first where a picture has several uses.
CLASSES = ("reflectance", "emission", "opacity", "data", "lookup", "unused")

#: Fields of a material with textures, by class; what is in any other field is data.
_FIELDS = {
    "diffuse_map": "reflectance",
    "specular_map": "reflectance",
    "emission_map": "emission",
    "opacity_map": "opacity",
}

#: Words of names by which an unused picture shows what it was meant for.
_MEANT = {
    "emission": "emission emissive emit emis glow illum illumination selfillum night ke",
    "data": "normal normals norm nrm nm bump disp displacement height parallax spec specular gloss"
    " rough roughness metal metallic metalness ao occlusion orm mask refl reflection pm pr ps ks ns"
    " shininess",
    "lookup": "lut ramp gradient toon env envmap spheremap cubemap sphere cube",
}

_PICTURE = re.compile(r"\.(png|jpe?g|tga|bmp|dds|tiff?|rgba?|sgi|int|inta|gif|exr|hdr|webp|ktx2?)$")

#: Nested notes that are looked through, and names that are taken from one material.
_DEPTH, _MOST = 4, 64


def image_rows(
    materials: Sequence[Material],
    surfaces: Sequence[Surface],
    areas: Sequence[float],
    made_of: Mapping[str, Image],
    broken: Callable[[Image], bool],
) -> list[dict[str, Any]]:
    """A row for each picture, however many names it has. ``areas``: m2 that wear each material;
    ``made_of``: the files of the conversion and the image that each was made from; ``broken``:
    whether a picture that is there could not be decoded.
    """
    used = [texture.image for material in materials for texture in material.maps().values()]
    names, said = picture_names(used), {image.name for image in used}
    rows: dict[Hashable, dict[str, Any]] = {}
    total = sum(areas)
    triples = zip(materials, surfaces, areas, strict=True)
    for number, (material, surface, area) in enumerate(triples):
        share = area / total if total > 0.0 else 0.0
        for name, texture in material.maps().items():
            image, key = texture.image, texture.image.key()
            row = _row(rows, key, names[key], str(image.source))
            row["called"].setdefault(image.name)
            row["uses"].add(_use(name, surface))
            row["missing"] |= image.missing
            row["broken"] |= broken(image)
            wearers = row["materials"].setdefault(material.name, set())
            if number not in wearers:
                wearers.add(number)
                row["share"] += share
    for material in materials:
        for key, name in _noted(material.extras):
            if name not in rows and name not in said:
                row = _row(rows, name, name, str(material.source))
                row["meant"] = _meant(key, name)
                row["materials"][material.name] = set()
    for file, image in made_of.items():
        if image.key() in rows:
            rows[image.key()]["files"].append(file)
    for row in rows.values():
        uses, called = row.pop("uses"), row.pop("called")
        row["also_called"] = [*called][1:]
        row["materials"] = list(row["materials"])
        row["class"] = next((c for c in CLASSES if c in uses), "unused")
        row["also"] = [c for c in CLASSES if c in uses and c != row["class"]]
    return list(rows.values())


def _row(
    rows: dict[Hashable, dict[str, Any]], key: Hashable, name: str, place: str
) -> dict[str, Any]:
    empty: dict[str, Any] = {
        "name": name,
        "called": {},  # in the source, in its order
        "place": place,
        "uses": set(),
        "meant": None,
        "missing": False,
        "broken": False,
        "materials": {},  # by name, which need not be unique: numbers
        "share": 0.0,
        "files": [],
    }
    return rows.setdefault(key, empty)


def _use(name: str, surface: Surface) -> str:
    """What a field's texture is used for; the glass of a lamp reflects nothing."""
    use = _FIELDS.get(name, "data")
    if use in ("reflectance", "data") and surface.replaces_reflection:
        shows = name == "diffuse_map" and surface.emission_map is not None
        return "emission" if shows else "unused"
    if use == "emission" and not any(surface.emission):
        return "unused"
    return use


def _noted(extras: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(key, name) of pictures that a reader noted without using them."""
    found: list[tuple[str, str]] = []
    stack: list[tuple[str, Any, int]] = [("", extras, 0)]
    while stack and len(found) < _MOST:
        key, value, depth = stack.pop()
        if isinstance(value, str):
            found += [(key, word) for word in _names(value)]
        elif isinstance(value, Mapping) and depth < _DEPTH:
            stack += [(f"{key} {k}", v, depth + 1) for k, v in value.items()]
        elif isinstance(value, (list, tuple)) and depth < _DEPTH:
            stack += [(key, v, depth + 1) for v in value[:_MOST]]
    return found


def _names(text: str) -> list[str]:
    """A picture's name: the whole text, else its last word, as behind MTL's options."""
    text = text.strip()
    if len(text) > 400 or not _PICTURE.search(text.lower()):
        return []
    return [text.split()[-1]] if text.startswith("-") else [text]


def _meant(key: str, name: str) -> str | None:
    """The class that a name, or the word by which it is noted, speaks of."""
    stem = name.replace("\\", "/").rsplit("/", 1)[-1].rsplit(".", 1)[0]
    found = set(words(stem)) | set(words(key))
    return next((use for use, said in _MEANT.items() if found & set(said.split())), None)
