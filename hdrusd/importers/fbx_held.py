"""ufbx's objects, held to the end of the process.

The binding of ufbx 0.0.5 hands out objects that it does not own: it crashes when one is freed
before another that refers to it, and in Python's cyclic collector. So everything that it returns
is kept in one list, nothing is iterated but what is kept, and the worker (``worker``) switches
the collector off before the first import and leaves without destructors.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

Doubles = npt.NDArray[np.float64]
Numbers = npt.NDArray[np.int64]

#: Everything that the binding ever returned; the process ends with it.
_alive: list[Any] = []
_PLAIN = (bool, int, float, str, bytes, tuple, type(None))


class Held:
    """An object of ufbx: its attributes, items and results are held like itself.

    Numbers, words, bytes and tuples come as they are.
    """

    __slots__ = ("_item", "_known")

    def __init__(self, item: Any) -> None:
        _alive.append(item)
        self._item = item
        self._known: dict[str, Any] = {}

    def __getattr__(self, name: str) -> Any:
        if name not in self._known:
            self._known[name] = hold(getattr(self._item, name))
        return self._known[name]

    def __bool__(self) -> bool:
        return True  # also an empty list: what is not there is None

    def __len__(self) -> int:
        return len(self._item)

    def __getitem__(self, index: int) -> Any:
        return hold(self._item[index])

    def __iter__(self) -> Iterator[Any]:
        for index in range(len(self._item)):
            yield hold(self._item[index])

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        plain = [a._item if isinstance(a, Held) else a for a in arguments]
        return hold(self._item(*plain, **options))

    def rows(self, width: int, kind: npt.DTypeLike = np.float64) -> npt.NDArray[Any]:
        """A list of vectors or pairs as a new array, (n, width); width 1 is (n,)."""
        view = memoryview(self._item)
        _alive.append(view)
        array = np.array(view, dtype=kind)
        return array.reshape(-1) if width == 1 else array.reshape(-1, width)

    def integers(self) -> Numbers:
        """A list of whole numbers as a new array, (n,). It offers no buffer."""
        numbers = iter(self._item)
        _alive.append(numbers)
        return np.fromiter(numbers, np.int64, len(self._item))


def hold(value: Any) -> Any:
    """``value`` if it is plain, else held."""
    return value if isinstance(value, _PLAIN) else Held(value)
