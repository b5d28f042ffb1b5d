"""Pictures decoded ahead and maps written behind by threads, while the caller goes on in order."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Generic, TypeVar

T = TypeVar("T")

#: Processor cores that this process may use; macOS has no way to say.
CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

#: Threads; OpenImageIO and OpenEXR release the interpreter's lock.
_workers = min(CORES, 8)

#: Bytes of maps that wait to be written.
_WAITING = 256 << 20


def share(processes: int) -> None:
    """Have fewer threads here, where so many processes do the same work beside this one."""
    global _workers
    _workers = max(_workers // processes, 1)


class MapThreads(Generic[T]):
    """A block in which ``wanted`` is made ahead, in that order, and work is done behind.

    A failure of the work comes out of a later ``submit`` or of leaving the block. Leaving it by an
    exception waits for what is in hand alone.
    """

    def __init__(self, wanted: Iterable[tuple[str, Callable[[], T]]]) -> None:
        self._wanted = iter(wanted)
        self._pool = ThreadPoolExecutor(_workers, "hdrusd-maps")
        self._ahead: dict[str, Future[T]] = {}
        self._taken: set[str] = set()
        self._behind: deque[tuple[int, Future[None]]] = deque()

    def __enter__(self) -> MapThreads[T]:
        self._start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            while error is None and self._behind:
                self._behind.popleft()[1].result()
        finally:
            self._pool.shutdown(cancel_futures=True)

    def take(self, key: str) -> T | None:
        """What was made ahead under ``key``, once; None where nothing was."""
        self._taken.add(key)
        found = self._ahead.pop(key, None)
        self._start()
        return None if found is None else found.result()

    def submit(self, size: int, work: Callable[[], None]) -> None:
        """Have ``work`` done, which holds ``size`` bytes; waits where too much is waiting."""
        while self._behind and (self._behind[0][1].done() or self._waiting() + size > _WAITING):
            self._behind.popleft()[1].result()
        self._behind.append((size, self._pool.submit(work)))

    def _waiting(self) -> int:
        return sum(size for size, _ in self._behind)

    def _start(self) -> None:
        while len(self._ahead) < 2 * _workers:
            key, make = next(self._wanted, (None, None))
            if key is None or make is None:
                return
            if key not in self._taken and key not in self._ahead:
                self._ahead[key] = self._pool.submit(make)
