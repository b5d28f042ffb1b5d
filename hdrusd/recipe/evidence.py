"""What speaks for a lamp in a database: its lights, light points, glowing surfaces, names, spots.

A light of the source is certain to be a lamp; how strong it is comes from its class, which its
name or those above it tell, or the way it stands. What glows is a lamp or a screen. A name
alone, or a bright spot in a texture, is a suspicion.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from glob import escape
from pathlib import Path

import numpy as np

from hdrusd.legacy.scene import LegacyScene, Material
from hdrusd.photometry.albedo import words
from hdrusd.photometry.baked import baked_lamps
from hdrusd.photometry.lamp_classes import LampClass
from hdrusd.photometry.lamp_words import LAMP_WORDS
from hdrusd.recipe.glow import Picture
from hdrusd.recipe.lamp_leads import Glowing, lamp_leads, shines
from hdrusd.recipe.lead import Lead
from hdrusd.recipe.light_leads import Kinds, light_leads
from hdrusd.recipe.naming import told_class
from hdrusd.recipe.places import Place, places
from hdrusd.units import LUMINANCE_WEIGHTS

#: Words of the part of a lamp that glows; the rest of it is a post.
_GLASS = {"glass", "bulb", "lens", "glow", "emissive", "lit", "light", "lights", "globe", "neon"}


def leads(scene: LegacyScene, picture: Picture) -> list[Lead]:
    """Everything that speaks for a lamp, certain things first; what states its unit is left out.

    What the pattern of one fits belongs to it alone.
    """
    where = list(places(scene))
    found, kinds = light_leads(scene, where)
    glowing = {index for index, m in enumerate(scene.materials) if any(m.emission)}
    wearers = _wearers(scene, where)
    surfaces, dark = _emission(scene, wearers, glowing, kinds)
    for more in (_names(scene, wearers, glowing), _spots(scene, picture, glowing)):
        for index, lead in more:
            surfaces.setdefault(index, lead)
    found += _by_name(scene, surfaces, wearers)
    found += lamp_leads(scene, where, dark, picture)
    return sorted(found, key=lambda lead: not lead.certain)


def _wearers(scene: LegacyScene, where: Sequence[Place]) -> dict[int, list[Place]]:
    """The places of the nodes that wear each material."""
    worn: dict[int, list[Place]] = {}
    for place in where:
        used = set()
        for index in place.node.meshes:
            mesh = scene.meshes[index]
            used |= {mesh.material} | {subset.material for subset in mesh.subsets}
        for material in used - {None}:
            assert material is not None
            worn.setdefault(material, []).append(place)
    return worn


def _texts(material: Material, wearers: Sequence[Place]) -> list[str]:
    """The names that may tell what a material is: its own, its pictures', its wearers'."""
    maps = (material.emission_map, material.diffuse_map)
    pictures = [Path(m.image.name.replace("\\", "/")).stem for m in maps if m is not None]
    return [material.name, *pictures, *(name for place in wearers[:8] for name in place.names)]


def _emission(
    scene: LegacyScene, wearers: Mapping[int, list[Place]], glowing: set[int], kinds: Kinds
) -> tuple[dict[int, Lead], list[Glowing]]:
    """What glows, by its names or by the light that it glows beside; and where that lights
    nothing.
    """
    found: dict[int, Lead] = {}
    dark: list[Glowing] = []
    for index in sorted(glowing):
        material = scene.materials[index]
        if material.emission_cd_m2:
            continue
        own = wearers.get(index, [])
        named = told_class([*_texts(material, own), scene.source.stem])
        beside = _beside(scene, own, kinds) if named is None else None
        kind, reason = None, "it glows in the source"
        if named is not None:
            kind, reason = named[0], f"its name, {named[1]}"
        elif beside is not None:
            kind, reason = beside[0], f"it glows beside the light {beside[1]}"
        value = (float(np.dot(LUMINANCE_WEIGHTS, material.emission)),)
        lead = Lead("material", escape(material.name), "emission", reason, kind, True)
        lead.count, lead.strength = max(len(own), 1), value
        found[index] = lead
        if kind is not None and kind.key != "luminance" and beside is None:
            dark += [Glowing(place, index, kind) for place in own if not shines(place)]
    return found, dark


def _beside(
    scene: LegacyScene, wearers: Sequence[Place], kinds: Kinds
) -> tuple[LampClass, str] | None:
    """The class of a light that hangs in the same node, or in the one above, and its name."""
    for place in wearers[:8]:
        for node in (place.node, *place.above[:1]):
            for near in (node, *node.children[:100]):
                for index in near.lights:
                    kind = kinds.get(index)
                    if kind is not None:
                        return kind, scene.lights[index].name or near.name
    return None


def _names(
    scene: LegacyScene, wearers: Mapping[int, list[Place]], glowing: set[int]
) -> Iterator[tuple[int, Lead]]:
    """Materials that are called lamps and do not glow."""
    for index, material in enumerate(scene.materials):
        if index in glowing or not wearers.get(index):
            continue
        own = _texts(material, [])
        named = told_class(own)
        telling = next((name for name in own if LAMP_WORDS & set(words(name))), "")
        if named is None and telling:
            reason = f"its name, {telling}"
            yield index, Lead("material", escape(material.name), "name", reason, None, False)
        if named is not None and named[0].key != "luminance" and not _GLASS & set(words(named[1])):
            continue
        if named is not None:
            reason = f"its name, {named[1]}"
            lead = Lead("material", escape(material.name), "name", reason, named[0], False)
            lead.count = len(wearers[index])
            yield index, lead


def _spots(scene: LegacyScene, picture: Picture, glowing: set[int]) -> Iterator[tuple[int, Lead]]:
    """Textures with small full spots in a wide glow; each is looked at once."""
    counts: dict[object, int] = {}
    for index, material in enumerate(scene.materials):
        if index in glowing or material.diffuse_map is None:
            continue
        image = material.diffuse_map.image
        key = image.path or id(image)
        if key not in counts:
            pixels = picture(image)
            counts[key] = 0 if pixels is None else baked_lamps(pixels)
        count = counts[key]
        if count:
            reason = f"{count} full texels in a wide glow in {image.name}"
            yield index, Lead("material", escape(material.name), "spots", reason, None, False)


def _by_name(
    scene: LegacyScene, surfaces: Mapping[int, Lead], wearers: Mapping[int, list[Place]]
) -> Iterator[Lead]:
    """One lead for all materials of a name, which one entry fits; none of a class where they
    are not alike.
    """
    named: dict[str, list[int]] = {}
    for index, material in enumerate(scene.materials):
        if index in surfaces or index in wearers:
            named.setdefault(material.name, []).append(index)
    for name, indices in named.items():
        found = [surfaces[index] for index in indices if index in surfaces]
        if not found:
            continue
        lead = found[0]
        lead.count = sum(each.count for each in found)
        lead.strength = tuple(sorted({value for each in found for value in each.strength}))
        alike = {(each.kind and each.kind.name, each.certain) for each in found}
        if not name:
            lead.kind = None
            lead.reason += "; it has no name, so no entry fits it: name it in the source"
        elif len(alike) > 1 or len(found) < len(indices):
            lead.kind = None
            lead.reason += f"; {len(indices)} materials have this name, and not all are such"
        yield lead
