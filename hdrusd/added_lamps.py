"""Lamps that a database lacks: ``[[lamp]]`` of a photometry file puts them into the scene.

An LDR database often has lamp posts and no lights. An entry names places (``at``, source
units) or nodes (``match``, with ``offset`` in their own space), and says all that a
``[[light]]`` entry may say of the lamp that stands there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef
from hdrusd.legacy.scene import TRS, LegacyScene, Light, Node, Vec3
from hdrusd.photometry.recipe_keys import is_strong, note_weak
from hdrusd.photometry.sidecar import Rule, Sidecar
from hdrusd.photometry.spread import SHAPES
from hdrusd.report import Kind, Report
from hdrusd.usd.transform import first_matrix

#: Half-angle of a lamp without one: it shines everywhere.
_EVERYWHERE = 180.0

#: Degrees off straight down that are told.
_OFF = 1.0

#: Places of nodes that are looked at; what hangs in ever more places is a bomb.
_MOST = 100_000


def add_lamps(
    scene: LegacyScene,
    sidecar: Sidecar,
    up: str,
    file_of: Callable[[Rule], object | None],
    report: Report,
) -> dict[int, Rule]:
    """Hang the lamps into ``scene``; the rule of each new light by its index.

    ``up``: "Y" or "Z", against which lamps without an axis shine. ``file_of``: what a
    rule's photometric file has; a lamp is not placed whose only strength is one that has nothing.
    """
    rules: dict[int, Rule] = {}
    aimed: dict[int, list[Rule]] = {}  # by the ids of their nodes, which may be turned
    nodes = _nodes(scene)  # before any is added
    for rule in sidecar.rules:
        if rule.section != "lamp":
            continue
        places = rule.values.get("at", ())
        named = [node for node in nodes if rule.fits((node.name,))] if _of_nodes(rule) else []
        rule.matched = bool(places or named)
        if not rule.matched:
            continue
        if not is_strong(rule.values.keys() - {"ies"}) and file_of(rule) is None:
            note_weak(rule.place, report)
            continue
        index = len(scene.lights)
        scene.lights.append(_light(rule, up))
        rules[index] = rule
        if places:
            holder = Node(_name(rule), rule.place)
            holder.children = [_stand(rule, index, place) for place in places]
            scene.roots.append(holder)
        for node in named:
            node.lights.append(index)
            if "axis" not in rule.values and _has_a_way(rule):
                aimed.setdefault(id(node), []).append(rule)
    if aimed:
        _note_turned(scene, aimed, np.array(_down(up)), report)
    return rules


def _of_nodes(rule: Rule) -> bool:
    return "match" in rule.values


def _has_a_way(rule: Rule) -> bool:
    """Whether it matters where the lamp points."""
    shaped = rule.values.get("spread", "sphere") in SHAPES
    return shaped or "cutoff" in rule.values or "ies" in rule.values


def _note_turned(
    scene: LegacyScene, aimed: Mapping[int, list[Rule]], down: npt.NDArray[Any], report: Report
) -> None:
    """A finding for lamps whose node is turned: down is that of the node."""
    stack = [(node, np.eye(3)) for node in scene.roots]
    for _ in range(_MOST):
        if not stack:
            return
        node, above = stack.pop()
        world = first_matrix(node)[:3, :3] @ above
        way = down @ world
        length = float(np.linalg.norm(way))
        cosine = float(way @ down) / length if length > 0.0 else 1.0
        off = math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))
        for rule in aimed.get(id(node), ()) if off > _OFF else ():
            text = (
                f"points {off:.3g} degrees off straight down, as its node {node.name} is turned; "
            )
            text += "axis says otherwise"
            report.add(Kind.ASSUMED, "light-aim", rule.place, _name(rule), text)
        stack.extend((child, world) for child in node.children)


def _name(rule: Rule) -> str:
    return str(rule.values.get("name", "Lamp"))


def _down(up: str) -> Vec3:
    return (0.0, -1.0, 0.0) if up == "Y" else (0.0, 0.0, -1.0)


def _light(rule: Rule, up: str) -> Light:
    cutoff = rule.number("cutoff")
    return Light(
        _name(rule),
        SourceRef(rule.place.file, rule.place.place),
        "point" if cutoff is None else "spot",
        position=(rule.three("offset") or (0.0, 0.0, 0.0)) if _of_nodes(rule) else (0, 0, 0),
        direction=rule.three("axis") or _down(up),
        spot_cutoff=_EVERYWHERE if cutoff is None else cutoff,
    )


def _stand(rule: Rule, index: int, place: list[float]) -> Node:
    x, y, z = map(float, place)
    return Node(_name(rule), rule.place, TRS((x, y, z)), lights=[index])


def _nodes(scene: LegacyScene) -> list[Node]:
    """Every node once, however often it hangs."""
    found: dict[int, Node] = {}
    stack = list(scene.roots)
    while stack:
        node = stack.pop()
        if id(node) not in found:
            found[id(node)] = node
            stack.extend(node.children)
    return list(found.values())
