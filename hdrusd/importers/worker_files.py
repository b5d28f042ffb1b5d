"""Files that a worker left in its folder, which may be anything, a link or a pipe included."""

from __future__ import annotations

import json
import math
import os
import stat
from collections.abc import Set
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.importers.exchange_checks import BrokenSceneError

#: Bytes of JSON that the parent parses; a record of a node takes about 200.
_JSON_BYTES = 1 << 28
_DIMENSIONS = 3


def open_regular(path: Path, most: int) -> tuple[int, int]:
    """A regular file of at most ``most`` bytes, opened, and its size. Raises BrokenSceneError."""
    try:
        number = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        raise BrokenSceneError(f"{path.name}: {error.strerror}") from None
    about = os.fstat(number)
    if not stat.S_ISREG(about.st_mode) or about.st_size > most:
        os.close(number)
        raise BrokenSceneError(f"{path.name}: want a file of at most {most} bytes")
    return number, about.st_size


def read_json(path: Path) -> dict[str, Any]:
    """A JSON object. Raises BrokenSceneError, ValueError, RecursionError."""
    number, _ = open_regular(path, _JSON_BYTES)
    with open(number, encoding="utf-8") as stream:
        found = json.load(stream, parse_constant=_no_number)
    if not isinstance(found, dict):
        raise BrokenSceneError(f"{path.name}: no record")
    return found


def _no_number(text: str) -> float:
    raise BrokenSceneError(f"{text} is no number")


def read_arrays(path: Path, declared: Any, dtypes: Set[str], most: int) -> list[npt.NDArray[Any]]:
    """Arrays one after another, ``declared`` as pairs of a dtype of ``dtypes`` and a shape.

    What is declared is there, or nothing is allocated. Raises BrokenSceneError.
    """
    kinds = []
    for dtype, shape in declared:
        sizes = isinstance(shape, list) and all(type(n) is int and n >= 0 for n in shape)
        if dtype not in dtypes or not sizes or len(shape) > _DIMENSIONS:
            raise BrokenSceneError(f"an array of {dtype} {shape}")
        kinds.append((np.dtype(dtype), tuple(shape)))
    number, size = open_regular(path, most)
    with open(number, "rb") as stream:
        if sum(dtype.itemsize * math.prod(shape) for dtype, shape in kinds) != size:
            raise BrokenSceneError(f"{path.name} has {size} bytes; its arrays have another size")
        return [
            np.fromfile(stream, dtype, math.prod(shape)).reshape(shape) for dtype, shape in kinds
        ]
