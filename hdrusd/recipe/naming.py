"""What names say: which are alike, and of which class of lamps they tell."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from glob import escape

from hdrusd.photometry import lamp_classes
from hdrusd.photometry.lamp_classes import LampClass

#: ``lamp_classes.lamp_class``, for what is above many things is asked about with each.
lamp_class = lru_cache(4096)(lamp_classes.lamp_class)


def stem(name: str) -> str:
    """The pattern that fits a name and its like with other numbers: ``lamp_03`` is ``lamp_*``."""
    return re.sub(r"\d+", "*", escape(name))


def told_class(names: Iterable[str]) -> tuple[LampClass, str] | None:
    """The class that the first telling name has, and that name.

    A bulb is a part of many lamps: whatever else is told goes before it.
    """
    told = [(kind, name) for name in names if (kind := lamp_class(name)) is not None]
    more = [(kind, name) for kind, name in told if kind.name != "household-bulb"]
    return next(iter(more or told), None)
