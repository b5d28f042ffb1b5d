"""Compressed pieces of a file, unpacked in one worker by libraries that are not ours.

The decoders of meshoptimizer and Draco are C++, fed with bytes that somebody may have made to
break them. They see those bytes and nothing else; what they leave is checked.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from hdrusd.errors import InputError
from hdrusd.importers import worker
from hdrusd.importers.exchange_checks import BrokenSceneError
from hdrusd.importers.importer import Resolver
from hdrusd.importers.unpacking_worker import ANSWER, ARRAYS, PACKED, TASK, Array
from hdrusd.importers.worker_files import read_arrays, read_json

_DTYPES = {"|i1", "|u1", "<i2", "<u2", "<u4", "<f4"}

#: Arrays in the order of the question, None where there is none; or what is wrong.
Answer = list[Array | None] | str


class Unpacker:
    """Gathers pieces, then unpacks all at once.

    ``size`` is that of what they are taken from: bytes of it that are used again and again
    under other names are refused.
    """

    def __init__(self, resolver: Resolver, size: int) -> None:
        self._resolver = resolver
        self._left = size
        self._packed: list[memoryview] = []
        self._starts: dict[tuple[int, int], int] = {}
        self._end = 0
        self._task: list[tuple[str, int, int, dict[str, Any]]] = []
        self._numbers: dict[str, int] = {}

    def ask(self, codec: str, packed: memoryview, **options: Any) -> int:
        """The number of a piece, the same for the same question. Raises InputError."""
        place = np.asarray(packed).__array_interface__["data"][0], len(packed)
        start = self._starts.get(place)
        if start is None:
            self._left -= len(packed)
            if self._left < 0:
                text = "compressed data overlap: together more than all buffers hold"
                raise InputError(self._resolver.source, text)
            start = self._starts[place] = self._end
            self._packed.append(packed)
            self._end += len(packed)
        question = codec, start, len(packed), options
        key = json.dumps(question)
        if key not in self._numbers:
            self._numbers[key] = len(self._task)
            self._task.append(question)
        return self._numbers[key]

    def answers(self) -> list[Answer]:
        """One answer a number. Raises InputError where the worker does not end well."""
        if not self._task:
            return []
        with tempfile.TemporaryDirectory(prefix="hdrusd-") as name:
            folder = Path(name).resolve()
            with open(folder / PACKED, "wb") as stream:
                stream.writelines(self._packed)
            (folder / TASK).write_text(json.dumps(self._task), encoding="utf-8")
            module = "hdrusd.importers.unpacking_worker"
            worker.run_module(module, folder, self._resolver, reader="the decoder")
            try:
                return self._answers(folder)
            except (BrokenSceneError, LookupError, TypeError, ValueError, RecursionError) as error:
                text = f"the decoder answered nonsense ({error}); want a file that it can read"
                raise InputError(self._resolver.source, text) from error

    def _answers(self, folder: Path) -> list[Answer]:
        record = read_json(folder / ANSWER)
        most = self._resolver.limits.file_bytes
        arrays = read_arrays(folder / ARRAYS, record["arrays"], _DTYPES, most)
        answers = record["answers"]
        if not isinstance(answers, list) or len(answers) != len(self._task):
            raise BrokenSceneError(f"{len(self._task)} pieces have other answers")
        return [self._answer(answer, arrays) for answer in answers]

    def _answer(self, answer: Any, arrays: list[Array]) -> Answer:
        if isinstance(answer, str):
            return f"cannot be decompressed: {answer}"
        numbers = answer if isinstance(answer, list) else [answer]
        if not all(n is None or (type(n) is int and 0 <= n < len(arrays)) for n in numbers):
            raise BrokenSceneError("an answer without arrays")
        return [None if number is None else arrays[number] for number in numbers]
