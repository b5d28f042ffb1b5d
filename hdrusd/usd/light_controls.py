"""What a light is told beside strength and shape: multipliers, S/P, shadows, filters; its key."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Usd, UsdLux

from hdrusd.report import Kind, Report
from hdrusd.usd.findings import prim_finding
from hdrusd.usd.lux import input_number, input_source

#: Inputs of ShadowAPI that are not physical and not read, and when they change nothing.
_SHADOW_INPUTS: dict[str, Any] = {
    "shadow:color": (0.0, 0.0, 0.0),
    "shadow:distance": -1.0,
    "shadow:falloff": -1.0,
    "shadow:falloffGamma": 1.0,
}


#: Scotopic over photopic light of the lamp.
SP_RATIO = "photometric:scotopicPhotopicRatio"

#: No light has more: the most is 72, at 410 nm (CIE 1951 V' over CIE 1924 V).
_MOST_BLUE = 100.0


def light_key(prim: Usd.Prim) -> int:
    """A number of the light by its path, the same in every frame and run."""
    digest = hashlib.blake2b(str(prim.GetPath()).encode(), digest_size=8).digest()
    return int.from_bytes(digest, "little", signed=True)


def casts_shadows(prim: Usd.Prim, time: Usd.TimeCode) -> bool:
    """``inputs:shadow:enable`` of a light with ShadowAPI; true without it."""
    source = input_source(prim, "shadow:enable") if prim.HasAPI(UsdLux.ShadowAPI) else None
    return not (source and source.Get(time) is False)


def scotopic_ratio(prim: Usd.Prim, time: Usd.TimeCode) -> float | None:
    """The S/P that a light states, whatever it is; None where it states none."""
    source = input_source(prim, SP_RATIO)
    return input_number(prim, SP_RATIO, time) if source and source.HasAuthoredValue() else None


def read_controls(
    prim: Usd.Prim, time: Usd.TimeCode, rows: npt.NDArray[np.void], report: Report
) -> None:
    """Fill ``diffuse``, ``specular``, ``sp`` and ``shadow`` of rows of ``scene.LIGHT``."""

    def finding(kind: Kind, code: str, text: str) -> None:
        prim_finding(report, prim, kind, code, text)

    for name in ("diffuse", "specular"):
        factor = input_number(prim, name, time)
        if factor < 0.0:
            text = f"inputs:{name} {factor:g}; read as 0"
            finding(Kind.CLAMPED, "light-multiplier", text)
        rows[name] = np.maximum(factor, 0.0)  # NaN stays, and the light is left out
    ratio = scotopic_ratio(prim, time)
    if ratio is not None and 0.0 < ratio <= _MOST_BLUE:
        rows["sp"] = ratio
    elif ratio is not None:
        text = f"inputs:{SP_RATIO} {ratio:g}; want above 0, at most {_MOST_BLUE:g}; not used"
        finding(Kind.INVALID, "light-scotopic", text)
    if prim.HasAPI(UsdLux.ShadowAPI):
        rows["shadow"] = casts_shadows(prim, time)
        for name, neutral in _SHADOW_INPUTS.items():
            source = input_source(prim, name)
            value: Any = source.Get(time) if source else None
            if value is not None and not np.array_equal(np.ravel(value), np.ravel(neutral)):
                finding(Kind.DROPPED, "shadow-input", f"inputs:{name} is not used")
    filters = prim.GetRelationship("light:filters")
    if filters and filters.GetTargets():
        finding(Kind.DROPPED, "light-filters", "light filters are not used")
