"""The state of the eye in the course of a sequence: where it starts, how it goes on, its file.

The state is a value (decision 10). What has to be remembered of a sequence so that another run
can go on with it is ``Checkpoints``: the states of some frames, in one JSON file beside the
pictures.
"""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hdrusd.errors import HdrusdError, InputError
from hdrusd.images import read_exr_header, write_atomically
from hdrusd.tonemap.operator import Moment, Operator, State, statistics

#: What becomes of the eye at a cut: it stays as it was, or knows the new view already.
Cut = Literal["keep", "reset"]

#: Frames from one saved state to the next.
EVERY = 24

_FORMAT = "hdrusd-eye/1"

#: Bytes of a file of states: some thousand of them.
_LARGEST = 1 << 26

#: cd/m2 of the dark that ``Start.seconds`` begins in.
_DARK = 1e-6


@dataclass(frozen=True, slots=True)
class Start:
    """What the eye did before the first frame.

    Nothing said: it has looked at the first frame until nothing changed any more. Else it is
    adapted to an even field of ``luminance`` cd/m2; with ``seconds`` it was in the dark and then
    saw that field for so long. Or it comes from another run in ``state``, which it had at
    ``time`` (s; None: just now). Then it sees the first frame for ``warm_up`` s.
    """

    luminance: float | None = None
    seconds: float | None = None
    state: State | None = None
    time: float | None = None
    warm_up: float = 0.0


class Course:
    """The state of an operator through frames in the order in which they are seen."""

    def __init__(
        self,
        operator: Operator,
        start: Start | None = None,
        cut: Cut = "keep",
        cuts: Collection[float] = (),
    ) -> None:
        self.operator = operator
        self.start = start or Start()
        self.cut = cut
        self.cuts = frozenset(cuts)
        self.state: State | None = None
        self.time: float | None = None

    def resume(self, state: State | None, time: float | None) -> None:
        """Go on from a frame at ``time`` s that had ``state``."""
        self.state, self.time = state, time

    def advance(self, moment: Moment, time: float, frame: float = math.nan) -> Moment:
        """``moment`` of the frame at ``time`` s with its state; ``frame`` is its number."""
        advance = self.operator.advance
        if advance is None:
            return moment
        if self.time is None:
            state, dt = self._begin(moment, time)
        else:
            state, dt = self.state, abs(time - self.time)
        if self.cut == "reset" and frame in self.cuts:
            state, dt = None, math.inf
        try:
            self.state, self.time = advance(state, moment, dt), time
        except (KeyError, TypeError, ValueError) as problem:
            if state is not self.start.state:
                raise
            text = f"{self.operator.name}: the given state is not one of its own ({problem!r})"
            raise HdrusdError(text) from problem
        return replace(moment, state=self.state)

    def _begin(self, moment: Moment, time: float) -> tuple[State | None, float]:
        """The state before the first frame, and for how long it is looked at."""
        advance, start = self.operator.advance, self.start
        assert advance is not None
        if start.state is not None:
            since = 0.0 if start.time is None else max(time - start.time, 0.0)
            return start.state, since + start.warm_up
        if start.luminance is None:
            return None, math.inf
        field_ = self._even(moment, start.luminance)
        if start.seconds is None:
            return advance(None, field_, math.inf), start.warm_up
        dark = advance(None, self._even(moment, _DARK), math.inf)
        return advance(dark, field_, start.seconds), start.warm_up

    def _even(self, moment: Moment, luminance: float) -> Moment:
        """A frame of one luminance, seen as ``moment`` is."""
        stats = moment.statistics
        angles = stats.foveal.field if stats is not None and stats.foveal is not None else None
        need = self.operator.needs(moment.parameters)
        frame = np.full((2, 2, 3), luminance)
        return replace(moment, statistics=statistics(frame, need, angles))


@dataclass(slots=True)
class Checkpoints:
    """States by frame in a JSON file: of every EVERY-th frame, and of the last.

    ``setup`` says all that the states depend on beside the frames; a file with another setup is
    refused.
    """

    file: Path
    operator: str
    setup: Mapping[str, Any]
    states: dict[float, tuple[float, State]] = field(default_factory=dict)  # frame: time, state
    _last: tuple[float, float, State] | None = None
    _since: int = 0

    def load(self) -> None:
        """Take in the file, where there is one. Raises InputError."""
        if not self.file.is_file():
            return
        document = _document(self.file)
        if document.get("setup") != json.loads(json.dumps(self.setup)):
            raise InputError(
                self.file,
                "states of a sequence with other settings; want the same, or another output",
            )
        self.states = _states(self.file, document)

    def keep(self, frame: float, time: float, state: State | None) -> None:
        """Take in the state of a frame, written when it is its turn or with ``save``."""
        if state is None:
            return
        self._last = frame, time, state
        if self._since == 0:
            self.save()
        self._since = (self._since + 1) % EVERY

    def save(self) -> None:
        """Write the file, the state of the latest frame in it."""
        if self._last is None:
            return
        frame, time, state = self._last
        self.states[frame] = time, state
        document = {
            "format": _FORMAT,
            "operator": self.operator,
            "setup": self.setup,
            "states": [
                {"frame": number, "time": when, "state": values}
                for number, (when, values) in self.states.items()
            ],
        }
        text = json.dumps(document, indent=1, allow_nan=False) + "\n"

        def write(temporary: Path) -> None:
            temporary.write_text(text, encoding="utf-8")

        write_atomically(self.file, write)


def read_state(path: Path, operator: Operator, before: float = math.inf) -> tuple[State, float]:
    """The state of the latest frame before ``before``, and its time in s.

    From a file of Checkpoints, or from the header of an EXR frame. Raises InputError, also for
    the state of another operator.
    """
    if path.suffix.lower() == ".exr":
        header = read_exr_header(path)
        text = header.get("hdrusd:state")
        if not isinstance(text, str):
            raise InputError(path, "no hdrusd:state in its header; want a frame that an eye saw")
        document = _parsed(path, text)
    else:
        document = _document(path)
    if document.get("operator") != operator.name:
        raise InputError(path, f"state of {document.get('operator')}; want one of {operator.name}")
    states = _states(path, document)
    known = [number for number in states if number < before]
    if not known:
        raise InputError(path, f"no state of a frame before {before:g}")
    time, state = states[max(known)]
    return state, time


def state_text(operator: Operator, frame: float, time: float, state: State) -> str:
    """What the header of an EXR frame says in ``hdrusd:state``; ``read_state`` reads it."""
    states = [{"frame": frame, "time": time, "state": state}]
    document = {"format": _FORMAT, "operator": operator.name, "states": states}
    return json.dumps(document, allow_nan=False)


def _document(path: Path) -> Mapping[str, Any]:
    if not path.is_file():
        raise InputError(path, "no such file")
    if path.stat().st_size > _LARGEST:
        raise InputError(path, f"{path.stat().st_size} bytes; want the states of a sequence")
    try:
        return _parsed(path, path.read_text(encoding="utf-8"))
    except UnicodeDecodeError as problem:
        raise InputError(path, "not UTF-8; want the states of a sequence") from problem


def _parsed(path: Path, text: str) -> Mapping[str, Any]:
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as problem:
        raise InputError(path, f"not JSON ({problem})") from problem
    if not isinstance(document, dict) or document.get("format") != _FORMAT:
        raise InputError(path, f"format; want {_FORMAT}")
    return document


def _states(path: Path, document: Mapping[str, Any]) -> dict[float, tuple[float, State]]:
    states: dict[float, tuple[float, State]] = {}
    entries: Any = document.get("states")
    for entry in entries if isinstance(entries, list) else [{}]:
        try:
            frame, time, state = float(entry["frame"]), float(entry["time"]), entry["state"]
        except (KeyError, TypeError, ValueError) as problem:
            raise InputError(path, "states; want frame, time and state of each") from problem
        if not (math.isfinite(frame) and math.isfinite(time) and isinstance(state, dict)):
            raise InputError(path, "states; want frame, time and state of each")
        states[frame] = time, state
    return states
