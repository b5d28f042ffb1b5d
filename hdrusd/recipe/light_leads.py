"""Entries for the lights of a database, each with the class that its name or its place tells."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from glob import escape

import numpy as np

from hdrusd.legacy.scene import LegacyScene, Light
from hdrusd.photometry.lamp_classes import BY_NAME, LampClass
from hdrusd.photometry.match_patterns import Patterns, Thing
from hdrusd.recipe.lead import Lead
from hdrusd.recipe.light_paths import light_paths, without_root
from hdrusd.recipe.naming import stem, told_class
from hdrusd.recipe.places import Doubles, Place
from hdrusd.units import LUMINANCE_WEIGHTS as _WEIGHTS

Kinds = Mapping[int, LampClass | None]

#: m between a light point and the light that it may be the picture of; pairs that are tried.
_SAME, _MOST_PAIRS = 0.5, 4_000_000

#: A street light shines down, within 30 degrees, into a wide cone from at least 3 m.
_DOWN, _WIDE, _HIGH = math.cos(math.radians(30.0)), 40.0, 3.0

#: A headlamp shines level, within 15 degrees, from 0.5 to 1.5 m (UN Regulation 48, 6.2.4).
_LEVEL, _BUMPER = math.sin(math.radians(15.0)), (0.5, 1.5)


@dataclass(frozen=True, slots=True)
class _Found:
    """A light that lacks its number, in one of its places."""

    light: Light
    kind: LampClass | None
    reason: str
    twin: bool


def light_leads(scene: LegacyScene, where: Sequence[Place]) -> tuple[list[Lead], Kinds]:
    """Leads that fit like lights and nothing else, and the class of each light by its index."""
    lit = [(place, index) for place in where for index in place.node.lights]
    found = _found(scene, where, lit)
    kinds = {lit[number][1]: each.kind for number, each in found.items()}
    groups: dict[tuple[object, ...], list[int]] = {}
    for number, each in found.items():
        name = stem(each.light.name or lit[number][0].node.name)
        key = name, each.kind and each.kind.name, each.light.kind == "directional", each.twin
        groups.setdefault(key, []).append(number)
    patterns = Patterns([_thing(scene, place, index) for place, index in lit])
    made: list[Lead] = []
    shared: list[tuple[list[int], list[int]]] = []
    for group in groups.values():
        told, left = patterns.of(group)
        made += [_lead(pattern, [found[n] for n in numbers]) for pattern, numbers in told]
        if left:
            shared.append((group, left))
    made.sort(key=lambda lead: ("*" in lead.pattern, lead.pattern))
    alike: list[int] = []
    if shared and scene.format != "usd":  # a stage's paths are names already
        paths = zip(patterns.things, light_paths(scene, lit), strict=True)
        patterns = Patterns([replace(thing, path=path) for thing, path in paths])
    for group, left in shared:
        told, untold = _by_path(patterns, group, left)
        made += [_lead(pattern, [found[n] for n in numbers]) for pattern, numbers in told]
        alike += untold
    return [*made, *_untold(patterns, found, alike)], kinds


def _thing(scene: LegacyScene, place: Place, index: int) -> Thing:
    """What ``match`` is held against; of a stage the path too, whatever a pattern begins with."""
    name, node = scene.lights[index].name, place.node.name
    if scene.format != "usd":
        return Thing((name, node) if name else (node,))
    above = place.names[1:2] or ("",)
    return Thing((name, *above, "/" + "/".join(reversed(place.names))))


def _by_path(
    patterns: Patterns, group: Sequence[int], left: Sequence[int]
) -> tuple[list[tuple[str, list[int]]], list[int]]:
    """Patterns of paths for those of a group that their names do not tell, and what is left."""
    members, wanted = set(group), set(left)
    parts = {number: without_root(patterns.things[number].path) for number in left}
    heads = {head for head, _ in parts.values()}
    if len(heads) == 1:
        rests = sorted({rest for _, rest in parts.values()})
        wild = patterns.wildcard(rests, wanted, members, heads.pop())
        if wild is not None:
            return [(wild, list(left))], []
    found: list[tuple[str, list[int]]] = []
    untold: list[int] = []
    done: set[int] = set()
    tried: set[str] = set()
    for number in left:
        if number in done:
            continue
        head, rest = parts[number]
        pattern = head + escape(rest)
        fitted = patterns.fitted(pattern) if rest and pattern not in tried else None
        tried.add(pattern)
        if fitted and fitted <= members:
            found.append((pattern, sorted((fitted & wanted) - done)))
            done |= fitted
        else:
            untold.append(number)
    return found, [number for number in untold if number not in done]


def _lead(pattern: str, lights: Sequence[_Found]) -> Lead:
    first = lights[0]
    what = "light points" if first.light.positions is not None else f"{first.light.kind} light"
    lead = Lead("light", pattern, what, first.reason, first.kind, True)
    lead.count = sum(each.light.lamps for each in lights)
    lead.strength = tuple(sorted({float(np.dot(_WEIGHTS, each.light.diffuse)) for each in lights}))
    lead.twin = any(each.twin for each in lights)
    return lead


def _untold(
    patterns: Patterns, found: Mapping[int, _Found], alike: Sequence[int]
) -> Iterator[Lead]:
    """One lead for all of a name where no pattern tells those of one class from others."""
    named: dict[str, list[_Found]] = {}
    for number in alike:
        named.setdefault(patterns.things[number].names[0], []).append(found[number])
    for name, lights in sorted(named.items()):
        lead = _lead(escape(name), lights)
        kinds = sorted({each.kind.name for each in lights if each.kind is not None})
        lead.kind, lead.twin = None, False
        lead.reason = "no pattern tells them from others of the same name"
        lead.reason += f"; taken for {', '.join(kinds)}" if kinds else ""
        yield lead


def _found(
    scene: LegacyScene, where: Sequence[Place], lit: Sequence[tuple[Place, int]]
) -> dict[int, _Found]:
    """What lacks its number, by its own in ``lit``."""
    up = (0.0, 1.0, 0.0) if scene.up == "Y" else (0.0, 0.0, 1.0)
    ground = _ground(scene, where, up)
    alone = _lone_lights(scene, lit)
    found = {}
    for number, (place, index) in enumerate(lit):
        light = scene.lights[index]
        if light.kind == "ambient" or light.candela is not None or light.lux is not None:
            continue
        if not light.enabled:
            continue
        kind, reason = _kind(light, place, up, ground, scene.unit_m)
        twin = _stands_at(light, place, alone, _SAME / scene.unit_m)
        found[number] = _Found(light, kind, reason, twin)
    return found


def _lone_lights(scene: LegacyScene, lit: Sequence[tuple[Place, int]]) -> Doubles:
    """Where lights that are no strings stand, (m, 3)."""
    found = [
        place.point(scene.lights[index].position)
        for place, index in lit
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
    named = told_class((light.name, *place.names))
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
