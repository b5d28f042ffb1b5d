"""What speaks for a lamp in a database: its lights, light points, glowing surfaces, names, spots.

A light of the source is certain to be a lamp; how strong it is comes from its class, which its
name or those above it tell, or the way it stands. What glows is a lamp or a screen. A name
alone, or a bright spot in a texture, is a suspicion.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from glob import escape
from pathlib import Path

import numpy as np

from hdrusd.legacy.scene import LegacyScene, Light, Material
from hdrusd.photometry.albedo import words
from hdrusd.photometry.baked import baked_lamps
from hdrusd.photometry.lamp_classes import BY_NAME, LampClass, lamp_class
from hdrusd.photometry.lamp_words import LAMP_WORDS
from hdrusd.recipe.glow import Picture, middle_of_glow
from hdrusd.recipe.places import Doubles, Place, places
from hdrusd.usd.transform import first_matrix

#: m between a light point and the light that it may be the picture of; pairs that are tried.
_SAME, _MOST_PAIRS = 0.5, 4_000_000

#: A street light shines down, within 30 degrees, into a wide cone from at least 3 m.
_DOWN, _WIDE, _HIGH = math.cos(math.radians(30.0)), 40.0, 3.0

#: Words of the part of a lamp that glows; the rest of it is a post.
_GLASS = {"glass", "bulb", "lens", "glow", "emissive", "lit", "light", "lights", "globe", "neon"}

#: A headlamp shines level, within 15 degrees, from 0.5 to 1.5 m (UN Regulation 48, 6.2.4).
_LEVEL, _BUMPER = math.sin(math.radians(15.0)), (0.5, 1.5)


@dataclass(slots=True)
class Lead:
    """One suspicion: ``section`` of the photometry file, the pattern that fits what is meant.

    ``found``: what kind of evidence; ``certain``: it is a lamp, whatever its strength.
    """

    section: str
    pattern: str
    found: str
    reason: str
    kind: LampClass | None
    certain: bool
    count: int = 1
    strength: tuple[float, ...] = ()  # of the lights: their luminance in the source, least first
    offset: tuple[float, ...] | None = None  # of a lamp in its node's space, source units
    twin: bool = False  # light points that stand where other lights do
    where: str = "the top of it; want the middle of the lamp"  # what ``offset`` is

    @property
    def counts(self) -> bool:
        """Whether it becomes an entry that counts: without a number it would say dark."""
        return self.certain and self.kind is not None and not self.twin

    names: set[str] = field(default_factory=set)


def leads(scene: LegacyScene, picture: Picture) -> list[Lead]:
    """Everything that speaks for a lamp, certain things first; what states its unit is left out."""
    where = list(places(scene))
    kinds: dict[int, LampClass | None] = {}
    found = _lights(scene, where, kinds)
    glowing = {index for index, m in enumerate(scene.materials) if any(m.emission)}
    wearers = _wearers(scene, where)
    found += _materials(scene, wearers, glowing, kinds, picture)
    found += _names(scene, where, wearers, glowing)
    found += _spots(scene, picture, glowing)
    return sorted(found, key=lambda lead: not lead.certain)


def stem(name: str) -> str:
    """The pattern that fits a name and its like with other numbers: ``lamp_03`` is ``lamp_*``."""
    return re.sub(r"\d+", "*", escape(name))


def _class(names: Iterable[str]) -> tuple[LampClass, str] | None:
    """The class that the first telling name has, and that name.

    A bulb is a part of many lamps: whatever else is told goes before it.
    """
    told = [(kind, name) for name in names if (kind := lamp_class(name)) is not None]
    more = [(kind, name) for kind, name in told if kind.name != "household-bulb"]
    return next(iter(more or told), None)


# -- lights --------------------------------------------------------------------------------


def _lights(
    scene: LegacyScene, where: Sequence[Place], kinds: dict[int, LampClass | None]
) -> list[Lead]:
    """A lead for each group of like lights; ``kinds`` gets the class of each."""
    up = (0.0, 1.0, 0.0) if scene.up == "Y" else (0.0, 0.0, 1.0)
    ground = _ground(scene, where, up)
    grouped: dict[tuple[str, str], Lead] = {}
    alone = _lone_lights(scene, where)
    for place in where:
        for index in place.node.lights:
            light = scene.lights[index]
            if light.kind == "ambient" or light.candela is not None or light.lux is not None:
                continue
            if not light.enabled:
                continue
            kind, reason = _kind(light, place, up, ground, scene.unit_m)
            kinds[index] = kind
            key = stem(light.name or place.node.name), kind.name if kind else ""
            what = "light points" if light.positions is not None else f"{light.kind} light"
            lead = grouped.setdefault(key, Lead("light", key[0], what, reason, kind, True, 0))
            lead.count += light.lamps
            lead.twin = lead.twin or _stands_at(light, place, alone, _SAME / scene.unit_m)
            lead.names.add(light.name or place.node.name)
            value = float(np.dot((0.2126, 0.7152, 0.0722), light.diffuse))
            lead.strength = tuple(sorted({*lead.strength, value}))
    return _told_apart(list(grouped.values()))


def _lone_lights(scene: LegacyScene, where: Sequence[Place]) -> Doubles:
    """Where lights that are no strings stand, (m, 3)."""
    found = [
        place.point(scene.lights[index].position)
        for place in where
        for index in place.node.lights
        if scene.lights[index].kind in ("point", "spot") and scene.lights[index].positions is None
    ]
    return np.array(found).reshape(-1, 3)


def _stands_at(light: Light, place: Place, alone: Doubles, reach: float) -> bool:
    """Whether each lamp of a string stands where a light does."""
    if light.positions is None or not 0 < len(alone) * light.lamps <= _MOST_PAIRS:
        return False
    lamps = np.c_[light.positions, np.ones(light.lamps)] @ place.world
    apart = np.linalg.norm(lamps[:, None, :3] - alone[None], axis=-1)
    return bool((apart.min(axis=1) <= reach).all())


def _kind(
    light: Light, place: Place, up: tuple[float, float, float], ground: float, unit: float
) -> tuple[LampClass | None, str]:
    named = _class((light.name, *place.names))
    if named is not None:
        return named[0], f"its name, {named[1]}"
    if light.kind != "spot" or light.positions is not None:
        return None, "a light of the source"
    height = (float(place.point(light.position) @ np.array(up)) - ground) * unit
    falling = -float(place.direction(light.direction) @ np.array(up))
    if falling >= _DOWN and light.spot_cutoff >= _WIDE and height >= _HIGH:
        return BY_NAME["street-light"], f"it shines down from {height:.3g} m"
    if abs(falling) <= _LEVEL and _BUMPER[0] <= height <= _BUMPER[1]:
        return BY_NAME["low-beam"], f"it shines level from {height:.3g} m"
    return None, "a light of the source"


def _ground(scene: LegacyScene, where: Sequence[Place], up: tuple[float, float, float]) -> float:
    """The height of the lowest point of all, source units."""
    least = math.inf
    axis = np.array(up)
    for place in where:
        for index in place.node.meshes:
            points = scene.meshes[index].points
            if len(points):
                heights = points @ (place.world[:3, :3] @ axis)
                least = min(least, float(heights.min() + place.world[3, :3] @ axis))
    return least if math.isfinite(least) else 0.0


def _told_apart(found: list[Lead]) -> list[Lead]:
    """Names where one pattern would fit lamps of several kinds; narrow patterns go first."""
    patterns = Counter(lead.pattern for lead in found)
    made = []
    for lead in found:
        if patterns[lead.pattern] > 1 or len(lead.names) == 1:
            made += [_renamed(lead, escape(name), len(lead.names)) for name in sorted(lead.names)]
        else:
            made.append(lead)
    return sorted(made, key=lambda lead: ("*" in lead.pattern, lead.pattern))


def _renamed(lead: Lead, pattern: str, names: int) -> Lead:
    count = lead.count if names == 1 else max(lead.count // names, 1)
    return replace(lead, pattern=pattern, count=count)


# -- surfaces ------------------------------------------------------------------------------


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


def _materials(
    scene: LegacyScene,
    wearers: dict[int, list[Place]],
    glowing: set[int],
    kinds: dict[int, LampClass | None],
    picture: Picture,
) -> list[Lead]:
    """What glows, by its names or by the light that it glows beside."""
    found = []
    for index in sorted(glowing):
        material = scene.materials[index]
        if material.emission_cd_m2:
            continue
        own = wearers.get(index, [])
        named = _class([*_texts(material, own), scene.source.stem])
        beside = _beside(scene, own, kinds) if named is None else None
        kind, reason = None, "it glows in the source"
        if named is not None:
            kind, reason = named[0], f"its name, {named[1]}"
        elif beside is not None:
            kind, reason = beside[0], f"it glows beside the light {beside[1]}"
        value = (float(np.dot((0.2126, 0.7152, 0.0722), material.emission)),)
        lead = Lead("material", escape(material.name), "emission", reason, kind, True)
        lead.count, lead.strength = max(len(own), 1), value
        found.append(lead)
        if kind is not None and kind.key != "luminance" and beside is None:
            dark = (place for place in own if not _shines(place))
            found += [_unlit(scene, place, index, kind, picture) for place in dark]
    return _once(found)


def _unlit(scene: LegacyScene, place: Place, index: int, kind: LampClass, picture: Picture) -> Lead:
    """A lamp for what glows and lights nothing, in the middle of what glows."""
    material = scene.materials[index]
    reason = f"{material.name} glows and no light is at it; what glows lights nothing"
    lead = Lead("lamp", escape(place.node.name), "emission", reason, kind, False)
    meshes = [scene.meshes[mesh] for mesh in place.node.meshes]
    middle = middle_of_glow(meshes, index, material, picture)
    if middle is not None:
        lead.offset, lead.where = _rounded(middle), "the middle of what glows"
    return lead


def _rounded(point: Doubles) -> tuple[float, ...]:
    return tuple(float(f"{value:.4g}") for value in point)


def _beside(
    scene: LegacyScene, wearers: Sequence[Place], kinds: dict[int, LampClass | None]
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
    scene: LegacyScene,
    where: Sequence[Place],
    wearers: dict[int, list[Place]],
    glowing: set[int],
) -> list[Lead]:
    """What is called a lamp, but neither glows nor shines."""
    found = []
    for index, material in enumerate(scene.materials):
        if index in glowing or not wearers.get(index):
            continue
        own = _texts(material, [])
        named = _class(own)
        telling = next((name for name in own if LAMP_WORDS & set(words(name))), "")
        if named is None and telling:
            reason = f"its name, {telling}"
            found.append(Lead("material", escape(material.name), "name", reason, None, False))
        if named is not None and named[0].key != "luminance" and not _GLASS & set(words(named[1])):
            continue
        if named is not None:
            reason = f"its name, {named[1]}"
            lead = Lead("material", escape(material.name), "name", reason, named[0], False)
            lead.count = len(wearers[index])
            found.append(lead)
    for place in where:
        kind = lamp_class(place.node.name)
        if kind is None or kind.key == "luminance" or _shines(place):
            continue
        if any(lamp_class(name) is kind for name in place.names[1:]):
            continue  # a part of it
        pattern = stem(place.node.name)
        lead = Lead("lamp", pattern, "name", f"its name, {place.node.name}", kind, False)
        lead.offset = _top(scene, place)
        found.append(lead)
    return _once(found)


def _top(scene: LegacyScene, place: Place) -> tuple[float, ...] | None:
    """The middle of the top of what hangs at a node, in its space; None of nothing."""
    part = LegacyScene(scene.source, scene.format, roots=[place.node])
    corners = []
    undo = np.linalg.pinv(first_matrix(place.node))
    for below in places(part):
        for index in below.node.meshes:
            points = scene.meshes[index].points
            if len(points):
                box = np.stack([points.min(axis=0), points.max(axis=0)])
                corners.append(np.c_[box, np.ones(2)] @ below.world @ undo)
    if not corners:
        return None
    all_of = np.concatenate(corners)[:, :3]
    least, most = all_of.min(axis=0), all_of.max(axis=0)
    middle = 0.5 * (least + most)
    height = 1 if scene.up == "Y" else 2
    middle[height] = most[height]
    return _rounded(middle)


def _shines(place: Place) -> bool:
    """Whether a light hangs at a node or below it."""
    stack, seen = [place.node], set()
    while stack:
        node = stack.pop()
        if node.lights:
            return True
        if id(node) not in seen:
            seen.add(id(node))
            stack.extend(node.children)
    return False


def _spots(scene: LegacyScene, picture: Picture, glowing: set[int]) -> list[Lead]:
    """Textures with small full spots in a wide glow; each is looked at once."""
    found = []
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
            found.append(Lead("material", escape(material.name), "spots", reason, None, False))
    return _once(found)


def _once(found: Iterable[Lead]) -> list[Lead]:
    """One lead a section and pattern."""
    kept: dict[tuple[str, str], Lead] = {}
    for lead in found:
        key = lead.section, lead.pattern
        if key in kept:
            kept[key].count += lead.count
        else:
            kept[key] = lead
    return list(kept.values())
