"""Lamps that a database lacks: ``[[lamp]]`` of a photometry file puts them into the scene.

An LDR database often has lamp posts and no lights. An entry names places (``at``, source
units) or nodes (``match``, with ``offset`` in their own space), and says all that a
``[[light]]`` entry may say of the lamp that stands there.
"""

from __future__ import annotations

from hdrusd.errors import SourceRef
from hdrusd.legacy.scene import TRS, LegacyScene, Light, Node, Vec3
from hdrusd.photometry.sidecar import Rule, Sidecar

#: Half-angle of a lamp without one: it shines everywhere.
_EVERYWHERE = 180.0


def add_lamps(scene: LegacyScene, sidecar: Sidecar, up: str) -> dict[int, Rule]:
    """Hang the lamps into ``scene``; the rule of each new light by its index.

    ``up``: "Y" or "Z", against which lamps without an axis shine.
    """
    rules: dict[int, Rule] = {}
    nodes = _nodes(scene)  # before any is added
    for rule in sidecar.rules:
        if rule.section != "lamp":
            continue
        index = len(scene.lights)
        scene.lights.append(_light(rule, up))
        rules[index] = rule
        places = rule.values.get("at", ())
        if places:
            holder = Node(_name(rule), rule.place)
            holder.children = [_stand(rule, index, place) for place in places]
            scene.roots.append(holder)
            rule.matched = True
        if "match" in rule.values:
            for node in nodes:
                if rule.fits((node.name,)):
                    node.lights.append(index)
                    rule.matched = True
    return rules


def _name(rule: Rule) -> str:
    return str(rule.values.get("name", "Lamp"))


def _light(rule: Rule, up: str) -> Light:
    cutoff = rule.number("cutoff")
    down: Vec3 = (0.0, -1.0, 0.0) if up == "Y" else (0.0, 0.0, -1.0)
    return Light(
        _name(rule),
        SourceRef(rule.place.file, rule.place.place),
        "point" if cutoff is None else "spot",
        position=(rule.three("offset") or (0.0, 0.0, 0.0)) if "match" in rule.values else (0, 0, 0),
        direction=rule.three("axis") or down,
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
