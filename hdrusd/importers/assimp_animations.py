"""Moving nodes of a file that assimp read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hdrusd.errors import SourceRef
from hdrusd.importers import assimp_library as ai
from hdrusd.legacy.scene import TRS, Channel, Node
from hdrusd.report import Kind, Report

#: Ticks a second of formats that say nothing.
_RATE = 25.0
_STEP = 0  # aiAnimInterpolation_Step


def read_animation(
    record: Any, named: Mapping[str, list[Node]], source: Path, report: Report
) -> None:
    """Give the nodes that an animation names their channels and transform."""
    place = SourceRef(source, "animation 0")
    rate = float(record["rate"])
    if not 0.0 < rate < math.inf:
        text = f"an animation without a rate; {_RATE:g} ticks a second are taken"
        report.add(Kind.ASSUMED, "assimp-animation", place, ai.text(record["name"]), text)
        rate = _RATE
    if record["mesh_channels_count"] or record["morph_channels_count"]:
        text = "moving points of meshes are left out; nodes move"
        report.add(Kind.DROPPED, "assimp-animation", place, ai.text(record["name"]), text)
    for found in ai.records(record["channels"], record["channels_count"], ai.CHANNEL):
        name = ai.text(found["node"])
        nodes = named.get(name, [])
        if not nodes:
            text = "no node of the file has this name; it does not move"
            report.add(Kind.MISSING, "assimp-animation", place, name, text)
        for node in nodes:
            _move(node, found, rate)


def _move(node: Node, found: Any, rate: float) -> None:
    """A path with one key stands still there; assimp gives all three."""
    standing: dict[str, tuple[float, ...]] = {}
    channels = []
    for path, key, kind in _PATHS:
        keys = ai.view(found[key], kind, int(found[f"{key}_count"]))
        good = np.isfinite(keys["time"]) & np.isfinite(keys["value"]).all(axis=1)
        times, first = np.unique(keys["time"][good] / rate, return_index=True)
        values = keys["value"][good][first].astype(np.float64)
        if path == "rotation":
            values = np.roll(values, -1, axis=1)  # w, x, y, z
        if not len(times):
            continue
        standing[path] = tuple(values[0].tolist())
        if len(times) > 1:
            steps = bool((keys["interpolation"][good] == _STEP).all())
            channels.append(Channel(path, times, values, "step" if steps else "linear"))
    node.transform = TRS(**standing)  # type: ignore[arg-type]
    node.animation = tuple(channels)


_PATHS: tuple[tuple[Literal["translation", "rotation", "scale"], str, Any], ...] = (
    ("translation", "places", ai.VECTOR_KEY),
    ("rotation", "turns", ai.TURN_KEY),
    ("scale", "scales", ai.VECTOR_KEY),
)
