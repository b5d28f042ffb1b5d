"""States of a node as a variant set: levels of detail, masks of a switch, frames of a sequence.

All children stand below their node whatever its state; a variant makes those inactive that
its state does not show. So one state is composed at a time, what several masks show is
written once, and a path means the same in every state and every layer: a lamp's photometry
needs no variant of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from pxr import Gf, Sdf

from hdrusd.legacy.scene import Node
from hdrusd.usd.names import Taken, unique

#: Variants of a node times its children. What has more is shown in its current state only.
MOST = 1 << 16

Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class States:
    """The states of one node. ``shown``: (states, children)."""

    kind: str  # "lod", "switch", "frame": the name of the variant set
    names: tuple[str, ...]
    shown: Flags
    selected: int = 0
    ranges: tuple[tuple[float, float], ...] = ()  # of each level of detail, as the node has them
    on_screen: bool = False  # ranges are the inverse of sizes on the screen, in pixels
    too_many: int = 0  # that there are, where only the selected one is told here

    @property
    def current(self) -> Flags:
        """(children,) what the selected state shows."""
        return np.asarray(self.shown[self.selected])


def states_of(node: Node, most: int = MOST) -> States | None:
    """The states of a node; None where there is one alone that shows all children.

    Where states times children are more than ``most``, the selected one alone.
    """
    count = len(node.children)
    if count == 0:
        return None
    found = None
    if node.kind == "lod" and len(node.lod_ranges) > 1:
        found = replace(_levels(node.lod_ranges[:count], count, most), on_screen=node.lod_on_screen)
    elif node.kind == "switch":
        found = _switch(node, count, most)
    elif node.kind == "sequence" and count > 1:
        found = _each("frame", count, most)
    if found is None or (len(found.names) == 1 and found.current.all() and not found.too_many):
        return None
    return found


def _each(kind: str, count: int, most: int) -> States:
    """States that show one child each."""
    if count * count > most:
        return _alone(kind, np.arange(count) == 0, count)
    names = tuple(f"{kind}{number}" for number in range(count))
    return States(kind, names, np.eye(count, dtype=np.bool_))


def _alone(kind: str, current: Flags, states: int) -> States:
    """The current state of too many."""
    return States(kind, ("current",), current[None], too_many=states)


def _levels(ranges: Sequence[tuple[float, float]], count: int, most: int) -> States:
    """What is in range from one limit to the next; the nearest first.

    A child without a range is in none; where no range is one, each child is a level.
    """
    low, high = np.array(ranges, np.float64).T
    real = high > low
    if not real.any():
        return _each("lod", count, most)
    limits = np.unique([low[real], high[real]])
    if (len(limits) - 1) * count > most:
        nearest = np.zeros(count, np.bool_)
        nearest[: len(low)] = real & (low <= limits[0])
        return _alone("lod", nearest, len(limits) - 1)
    shown = np.zeros((len(limits) - 1, count), np.bool_)
    shown[:, : len(low)] = real & (low <= limits[:-1, None]) & (high > limits[:-1, None])
    # Neighbours that show the same are one level, gaps none.
    first = np.ones(len(shown), np.bool_)
    first[1:] = (shown[1:] != shown[:-1]).any(axis=1)
    starts = np.flatnonzero(first)
    ends = np.append(starts[1:], len(shown))
    kept = shown[starts].any(axis=1)
    starts, ends = starts[kept], ends[kept]
    spans = tuple(zip(limits[starts].tolist(), limits[ends].tolist(), strict=True))
    names = tuple(f"lod{number}" for number in range(len(starts)))
    return States("lod", names, shown[starts], ranges=spans)


def _switch(node: Node, count: int, most: int) -> States:
    """The masks that the source has; of one alone what a person would want to choose from."""
    current = _mask(node.switch_on, count)
    states = len(node.switch_masks) if len(node.switch_masks) > 1 else count + 2
    if states * count > most:
        return _alone("switch", np.array(current, np.bool_), states)
    rows: list[tuple[bool, ...]] = []
    names: list[str] = []
    taken: Taken = {}

    def add(name: str, row: tuple[bool, ...]) -> None:
        rows.append(row)
        names.append(unique(name, taken))

    if len(node.switch_masks) > 1:
        for name, mask in node.switch_masks:
            add(name, _mask(mask, count))
    elif count == 1:
        add("on", (True,))
        add("off", (False,))
    else:
        for number, child in enumerate(node.children):
            add(child.name, tuple(other == number for other in range(count)))
        add("all", (True,) * count)
        add("none", (False,) * count)
    if current not in rows:
        add("current", current)
    return States("switch", tuple(names), np.array(rows, np.bool_), rows.index(current))


def _mask(mask: Sequence[bool], count: int) -> tuple[bool, ...]:
    """One flag for each child; those that a mask does not reach are on."""
    return (*mask[:count], *[True] * (count - len(mask)))


def write_states(
    layer: Sdf.Layer, path: Sdf.Path, states: States, children: Sequence[Sdf.Path], unit: float
) -> None:
    """Write the variant set of the prim at ``path``, without a selection.

    ``children``: their paths; ``unit``: metres a source unit. The ranges of levels stay in
    ``customData``: ``hdrusd:lod``, near and far in m, or ``hdrusd:lodPixels``, least and most.
    """
    prim = layer.GetPrimAtPath(path)
    group = Sdf.VariantSetSpec(prim, states.kind)
    prim.variantSetNameList.Prepend(states.kind)
    for name, shown in zip(states.names, states.shown, strict=True):
        variant = Sdf.VariantSpec(group, name).primSpec
        for number in np.flatnonzero(~shown).tolist():
            Sdf.PrimSpec(variant, children[number].name, Sdf.SpecifierOver).active = False
    if not states.ranges:
        return
    near, far = np.array(states.ranges).T
    key, pairs = "lod", (near * unit, far * unit)
    if states.on_screen:
        most = float(np.finfo(np.float32).max)
        sizes = (1.0 / np.maximum(limit, 1.0 / most) for limit in (far, near))
        key, pairs = "lodPixels", tuple(sizes)
    kept = dict(prim.customData.get("hdrusd", {}))  # "hdrusd:..." of UsdObject
    kept[key] = {
        name: Gf.Vec2d(*pair)
        for name, pair in zip(states.names, np.stack(pairs, 1).tolist(), strict=True)
    }
    prim.customData["hdrusd"] = kept


def select(layer: Sdf.Layer, path: Sdf.Path, states: States, number: int) -> None:
    """Select a state in a layer."""
    prim = Sdf.CreatePrimInLayer(layer, path)
    prim.variantSelections[states.kind] = states.names[number]
