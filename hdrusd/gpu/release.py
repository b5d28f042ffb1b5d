"""Giving back what was made on the GPU: Python's own garbage collection leaves it there."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any


def release(*things: Any) -> None:
    """Release OpenGL objects and their owners, also those in collections; None is nothing.

    What was released already stays so.
    """
    for thing in things:
        if isinstance(thing, Mapping):
            release(*thing.values())
        elif isinstance(thing, Collection):
            release(*thing)
        elif thing is not None:
            thing.release()
