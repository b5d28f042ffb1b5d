"""Where two scenes differ, field by field."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from hdrusd.errors import SourceRef


def differences(a: Any, b: Any, path: str = "", *, rtol: float = 0.0) -> list[str]:
    """The paths of the fields that differ in value or type; numbers must be equal to the bit.

    With ``rtol`` floating point may differ by that, relatively: a form with fewer digits. Places
    (SourceRef) are not compared.
    """
    if type(a) is not type(b):
        return [path]
    if isinstance(a, np.ndarray):
        same = a.dtype == b.dtype and a.shape == b.shape
        if same and rtol and a.dtype.kind == "f":
            same = np.allclose(a, b, rtol=rtol, atol=0.0)
        else:
            same = same and np.array_equal(a, b)
        return [] if same else [path]
    if rtol and isinstance(a, float):
        return [] if math.isclose(a, b, rel_tol=rtol) else [path]
    if isinstance(a, SourceRef):
        return []
    if is_dataclass(a):
        dot = f"{path}." if path else ""
        pairs = [(f"{dot}{f.name}", getattr(a, f.name), getattr(b, f.name)) for f in fields(a)]
    elif isinstance(a, Mapping):
        if a.keys() != b.keys():
            return [path]
        pairs = [(f"{path}[{key}]", a[key], b[key]) for key in a]
    elif isinstance(a, list | tuple):
        if len(a) != len(b):
            return [path]
        pairs = [(f"{path}[{n}]", x, y) for n, (x, y) in enumerate(zip(a, b, strict=True))]
    else:
        return [] if a == b else [path]
    return [found for name, x, y in pairs for found in differences(x, y, name, rtol=rtol)]
