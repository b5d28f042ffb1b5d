"""Lamps for nodes that have none: for what glows and lights nothing, and what is called a lamp."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hdrusd.legacy.scene import LegacyScene, Node
from hdrusd.photometry.lamp_classes import LampClass
from hdrusd.photometry.match_patterns import Patterns, Thing
from hdrusd.recipe.glow import Picture, box_of_glow
from hdrusd.recipe.lead import Lead
from hdrusd.recipe.naming import lamp_class, stem
from hdrusd.recipe.places import Doubles, Place, places
from hdrusd.usd.sharing import every_node
from hdrusd.usd.transform import first_matrix

#: Shares that offsets are rounded to: of a thing's size, and of its distance from the origin,
#: where 32-bit floats end.
_OF_SIZE, _OF_DISTANCE = 1e-4, 1e-7

#: What stands between the name of a lamp and the word for a part of it.
_THEN_A_WORD = re.compile(r"[\W_]+(?=[^\W\d_])")


@dataclass(frozen=True, slots=True, eq=False)
class Glowing:
    """A node in one of its places, a material on it that glows, and its class."""

    place: Place
    material: int
    kind: LampClass


@dataclass(slots=True)
class _Proposed:
    """A lamp for a node, in all of its places."""

    node: Node
    kind: LampClass
    found: str
    reason: str
    where: str
    box: Doubles | None  # (2, 3), of what glows or hangs there, in the node's space
    middle: Doubles  # (3,), where the lamp is
    stands: list[Place] = field(default_factory=list)

    @property
    def offset(self) -> tuple[float, ...] | None:
        return None if self.box is None else _rounded(self.middle, self.box)

    def at(self) -> Iterator[tuple[float, ...]]:
        """Where it is in the world, in each place."""
        for place in self.stands:
            here = np.r_[self.middle, 1.0] @ place.world
            box = np.zeros((2, 3)) if self.box is None else self.box
            around = np.c_[box, np.ones(2)] @ place.world
            yield _rounded(here[:3], around[:, :3])


def lamp_leads(
    scene: LegacyScene, where: Sequence[Place], dark: Sequence[Glowing], picture: Picture
) -> Iterator[Lead]:
    """Suspicions, of which each node has one; ``dark``: what glows and has no light."""
    proposed = _glowing(scene, dark, picture)
    proposed |= _called(scene, where, proposed)
    nodes = list(every_node(scene.roots))
    numbers = {id(node): number for number, node in enumerate(nodes)}
    patterns = Patterns([Thing((node.name,)) for node in nodes])
    groups: dict[tuple[object, ...], list[_Proposed]] = {}
    for each in proposed.values():
        key = each.found, stem(each.node.name), each.kind.name, each.offset
        groups.setdefault(key, []).append(each)
    shared: dict[tuple[object, ...], list[_Proposed]] = {}
    for (*alike, _), group in groups.items():
        by_number = {numbers[id(each.node)]: each for each in group}
        told, left = patterns.of(list(by_number))
        for pattern, fitted in told:
            these = [by_number[number] for number in fitted]
            lead = _lead(pattern, these)
            lead.offset = these[0].offset
            yield lead
        shared.setdefault(tuple(alike), []).extend(by_number[number] for number in left)
    for these in filter(None, shared.values()):
        lead = _lead("", these)
        lead.at = tuple(point for each in these for point in each.at())
        yield lead


def _lead(pattern: str, lamps: Sequence[_Proposed]) -> Lead:
    first = lamps[0]
    lead = Lead("lamp", pattern, first.found, first.reason, first.kind, False)
    lead.count, lead.where = sum(len(each.stands) for each in lamps), first.where
    return lead


def _glowing(scene: LegacyScene, dark: Sequence[Glowing], picture: Picture) -> dict[int, _Proposed]:
    """By the ids of their nodes: lamps in the middle of what glows."""
    found: dict[int, _Proposed] = {}
    by: dict[int, int] = {}  # the material that it is proposed for, of several
    for each in dark:
        node = each.place.node
        if by.setdefault(id(node), each.material) != each.material:
            continue
        if id(node) not in found:
            material = scene.materials[each.material]
            meshes = [scene.meshes[mesh] for mesh in node.meshes]
            box = box_of_glow(meshes, each.material, material, picture)
            middle = np.zeros(3) if box is None else box.mean(axis=0)
            reason = f"{material.name} glows and no light is at it; what glows lights nothing"
            where = "the middle of what glows"
            made = _Proposed(node, each.kind, "emission", reason, where, box, middle)
            found[id(node)] = made
        found[id(node)].stands.append(each.place)
    return found


def _called(
    scene: LegacyScene, where: Sequence[Place], glowing: Mapping[int, _Proposed]
) -> dict[int, _Proposed]:
    """By the ids of their nodes: lamps on top of what is called one, and has none at it, above it
    or below it.
    """
    above = {id(node) for each in glowing.values() for at in each.stands for node in at.above}
    lamps = _lamp_names(where, glowing)
    found: dict[int, _Proposed] = {}
    for place in where:
        node = place.node
        kind = lamp_class(node.name)
        if kind is None or kind.key == "luminance" or shines(place):
            continue
        if any(lamp_class(name) is kind for name in place.names[1:]):
            continue  # a part of it
        if id(node) in above or any(id(n) in glowing for n in (node, *place.above)):
            continue
        ends = (match.start() for match in _THEN_A_WORD.finditer(node.name))
        if any(node.name[:end] in lamps.get(_parent(place), ()) for end in ends):
            continue  # a part too, beside it
        if id(node) not in found:
            box = _box(scene, place)
            middle = np.zeros(3) if box is None else box.mean(axis=0)
            if box is not None:
                height = 1 if scene.up == "Y" else 2
                middle[height] = box[1, height]
            reason, top = f"its name, {node.name}", "the top of it; want the middle of the lamp"
            found[id(node)] = _Proposed(node, kind, "name", reason, top, box, middle)
        found[id(node)].stands.append(place)
    return found


def _lamp_names(
    where: Sequence[Place], glowing: Mapping[int, _Proposed]
) -> dict[int | None, set[str]]:
    """The names of nodes that glow or shine, by the ids of what they hang in."""
    found: dict[int | None, set[str]] = {}
    for place in where:
        if place.node.name and (id(place.node) in glowing or place.node.lights):
            found.setdefault(_parent(place), set()).add(place.node.name)
    return found


def _parent(place: Place) -> int | None:
    return id(place.above[0]) if place.above else None


def _box(scene: LegacyScene, place: Place) -> Doubles | None:
    """The box of what hangs at a node, (2, 3), in its space; None of nothing."""
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
    return np.stack([all_of.min(axis=0), all_of.max(axis=0)])


def _rounded(point: Doubles, box: Doubles) -> tuple[float, ...]:
    """A point of a thing, (3,), without what is lost in computing it; ``box``: of the thing."""
    size = float(np.linalg.norm(box[1] - box[0]))
    step = max(_OF_SIZE * size, _OF_DISTANCE * float(np.abs(point).max()))
    if not 0.0 < step < math.inf:
        return tuple(map(float, point))
    digits = -math.floor(math.log10(step))
    return tuple(round(float(value), digits) + 0.0 for value in point)  # no -0


def shines(place: Place) -> bool:
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
