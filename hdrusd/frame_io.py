"""Frames read and pictures written by threads of their own, while the caller works on another."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.images import read_exr_layers

#: Pictures that wait for the writer; each holds a frame in memory.
_WAITING = 2

#: What read_exr_layers gives.
_Layers = tuple[npt.NDArray[np.float32], dict[str, Any], dict[str, npt.NDArray[np.float32]]]


class Reader:
    """One thread that reads the next frame while the caller works on this one.

    What cannot be read is raised when its turn comes, not before. Leaving the block waits for the
    frame in hand.
    """

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, "hdrusd-reader")
        self._ahead: tuple[Path, Future[_Layers]] | None = None

    def __enter__(self) -> Reader:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def read(self, source: Path, ahead: Path | None = None) -> _Layers:
        """``read_exr_layers`` of ``source``; then ``ahead`` is read, and kept for the next call."""
        found, self._ahead = self._ahead, None
        if found is None or found[0] != source:
            found = source, self._pool.submit(read_exr_layers, source)
        result = found[1].result()
        if ahead is not None:
            self._ahead = ahead, self._pool.submit(read_exr_layers, ahead)
        return result


class Writer:
    """One thread that writes files while the caller goes on; two wait at most.

    A failure comes out of a later ``submit`` or of leaving the block. Leaving it by
    an exception (Ctrl-C) finishes the file in hand, so none is torn, and drops those
    that wait.
    """

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, "hdrusd-writer")
        self._pending: deque[Future[None]] = deque()

    def __enter__(self) -> Writer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            while error is None and self._pending:
                self._pending.popleft().result()
        finally:
            self._pool.shutdown(cancel_futures=True)

    def submit(self, write: Callable[..., None], *args: Any, **options: Any) -> None:
        """Have ``write(*args, **options)`` called; waits while two others are waiting."""
        while self._pending and (self._pending[0].done() or len(self._pending) > _WAITING):
            self._pending.popleft().result()
        self._pending.append(self._pool.submit(write, *args, **options))
