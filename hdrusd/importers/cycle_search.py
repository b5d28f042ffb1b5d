"""Python's search for unreachable cycles, put off while a large tree is built."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def put_off() -> Iterator[None]:
    """No search meanwhile: everything that is made is kept, so each would walk it for nothing.

    A tree of a million objects is walked over and over as it grows, a third of the time that its
    making takes. What is freed meanwhile is freed as ever, by its count of references.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
