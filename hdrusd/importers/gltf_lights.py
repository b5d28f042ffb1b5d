"""Lights of KHR_lights_punctual, in candela and lux as the extension states them."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from hdrusd.importers.gltf_document import Document, Item
from hdrusd.legacy.scene import Light
from hdrusd.report import Kind

EXTENSION = "KHR_lights_punctual"

_KINDS: dict[str, Literal["point", "spot", "directional"]] = {
    "point": "point",
    "spot": "spot",
    "directional": "directional",
}
_LARGEST = float(np.finfo(np.float32).max)


def read_lights(document: Document) -> tuple[list[Light], list[int | None]]:
    """The lights that can be used, and for each of the file's numbers its place among them."""
    extension = document.root.extension(EXTENSION)
    lights: list[Light] = []
    numbers: list[int | None] = []
    for number, item in enumerate(extension.children("lights") if extension else []):
        light = _light(item, item.name or f"light_{number}")
        numbers.append(None if light is None else len(lights))
        if light is not None:
            lights.append(light)
    return lights, numbers


def _light(item: Item, name: str) -> Light | None:
    kind = _KINDS.get(item.text("type"))
    if kind is None:
        text = f"type {item.text('type')[:40]!r}; want point, spot or directional; light dropped"
        item.note(Kind.INVALID, "light-type", text)
        return None
    color = item.light_colour("color", (1.0, 1.0, 1.0))
    intensity = item.number("intensity", 1.0, low=0.0)
    broken = "intensity" in item and item.finite("intensity") is None
    if broken or intensity * max(color) > _LARGEST:
        text = "intensity, alone or times color, is past float32; light dropped"
        item.note(Kind.INVALID, "light-intensity", text)
        return None
    inner, outer = _cone(item) if kind == "spot" else (None, 180.0)
    return Light(
        name=name,
        source=item.ref,
        kind=kind,
        diffuse=color,
        specular=color,
        spot_cutoff=outer,
        spot_inner=inner,
        range=_range(item, kind),
        candela=None if kind == "directional" else intensity,
        lux=intensity if kind == "directional" else None,
        extras=item.extras(),
    )


def _cone(item: Item) -> tuple[float, float]:
    """Inner and outer half-angle in degrees, from radians."""
    spot = item.child("spot")
    outer = spot.number("outerConeAngle", math.pi / 4.0, low=0.0, high=math.pi / 2.0)
    if outer == 0.0:
        text = "outerConeAngle 0 lights nothing; the default of 45 degrees is used"
        spot.note(Kind.INVALID, "light-cone", text)
        outer = math.pi / 4.0
    inner = spot.number("innerConeAngle", 0.0, low=0.0, high=outer)
    return math.degrees(inner), math.degrees(outer)


def _range(item: Item, kind: str) -> float | None:
    value = item.finite("range")
    if value is None:
        return None
    if value <= 0.0 or kind == "directional":
        text = f"range {value:g} of a {kind} light is not used; want more than 0, no direction"
        item.note(Kind.INVALID, "light-range", text)
        return None
    return value
