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
from typing import Any, Literal, NamedTuple

import numpy as np

from hdrusd.errors import InputError, ParameterError, SourceRef
from hdrusd.images import read_exr_header, write_atomically
from hdrusd.input_file import check_input
from hdrusd.report import Kind, Report
from hdrusd.tonemap.operator import Moment, Operator, State, statistics

#: What becomes of the eye at a cut: it stays as it was, or knows the new view already.
Cut = Literal["keep", "reset"]

#: Frames from one saved state to the next.
EVERY = 24

_FORMAT = "hdrusd-eye/1"

#: Bytes of a file of states: some thousand of them. Numbers that a state may have, and how deep.
_LARGEST, _MOST, _DEEPEST = 1 << 26, 10_000, 4

#: cd/m2 of the dark that ``Start.seconds`` begins in.
_DARK = 1e-6


class Known(NamedTuple):
    """The state of the eye after a frame at ``time`` s, by a ``camera`` (None: unknown)."""

    time: float
    state: State | None
    camera: str | None = None


@dataclass(frozen=True, slots=True)
class Start:
    """What the eye did before the first frame.

    Nothing said: it has looked at the first frame until nothing changed any more. Else it is
    adapted to an even field of ``luminance`` cd/m2; with ``seconds`` it was in the dark and then
    saw that field for so long. Or it comes from another run, whose states are in ``file``
    (``read_state``), with that of the latest frame before the number ``before``. Then it sees the
    first frame for ``warm_up`` s.
    """

    luminance: float | None = None
    seconds: float | None = None
    file: Path | None = None
    before: float = math.inf
    warm_up: float = 0.0


class Course:
    """The state of an operator through frames in the order in which they are seen.

    A frame whose number is in ``cuts`` begins a new view, and so does one of another camera.
    Raises ParameterError for a start that the operator cannot have, InputError for its file.
    """

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
        self.known: Known | None = None  # after the frame before
        self._given: Known | None = None
        if operator.advance is None and self.start != Start():
            raise ParameterError(
                f"{operator.name}: has no state to start with; want an operator in time"
            )
        if self.start.file is not None:
            self._given = read_state(self.start.file, operator, self.start.before)

    def resume(self, known: Known) -> None:
        """Go on from a frame of this course."""
        self.known = known

    def advance(
        self, moment: Moment, time: float, frame: float = math.nan, camera: str | None = None
    ) -> Moment:
        """``moment`` of the frame at ``time`` s with its state; ``frame`` is its number."""
        advance = self.operator.advance
        if advance is None:
            return moment
        before = self.known or self._given
        if self.known is not None:
            state, dt = self.known.state, abs(time - self.known.time)
        else:
            state, dt = self._begin(moment, time)
        other = before is not None and before.camera is not None and before.camera != camera
        if self.cut == "reset" and (other or frame in self.cuts):
            state, dt = None, math.inf
        try:
            after = advance(state, moment, dt)
        except (KeyError, TypeError, ValueError, OverflowError) as problem:
            if state is None:
                raise
            text = f"{self.operator.name}: state: not one of its own ({problem!r})"
            raise ParameterError(text) from problem
        self.known = Known(time, after, camera)
        return replace(moment, state=after)

    def _begin(self, moment: Moment, time: float) -> tuple[State | None, float]:
        """The state before the first frame, and for how long it is looked at."""
        advance, start, given = self.operator.advance, self.start, self._given
        assert advance is not None
        if given is not None:
            return given.state, max(time - given.time, 0.0) + start.warm_up
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


def note_cuts(
    cuts: Collection[float], frames: Collection[float], place: SourceRef, report: Report
) -> None:
    """A finding for cuts at frames that are not seen: misspelt, or another part's."""
    unseen = sorted(set(cuts) - set(frames))
    if unseen:
        some = ", ".join(f"{number:g}" for number in unseen[:8]) + ", ..." * (len(unseen) > 8)
        text = f"--cuts {some}: not frames of this sequence; nothing is cut there"
        report.add(Kind.MISSING, "cuts", place, "", text)


@dataclass(slots=True)
class Checkpoints:
    """What is known by frame, in a JSON file: of every EVERY-th frame, and of the last.

    ``setup`` says all that the states depend on beside the frames, its "start" what the eye did
    before them; a file with another setup is refused.
    """

    file: Path
    operator: str
    setup: Mapping[str, Any]
    states: dict[float, Known] = field(default_factory=dict)
    _last: tuple[float, Known] | None = None
    _since: int = 0

    def load(self, whole: bool = True) -> None:
        """Take in the file, where there is one. Raises InputError.

        Not ``whole``: this run is the other part of the sequence in the file, and goes on with
        it; whatever else is there is replaced.
        """
        if not self.file.is_file():
            return
        document = _document(self.file)
        setup, own = document.get("setup"), _plain(self.setup)
        if not whole:
            if not isinstance(setup, dict) or {**setup, "start": None} != {**own, "start": None}:
                return
            self.setup = setup
        elif setup != own:
            given = setup if isinstance(setup, dict) else {}
            other = ", ".join(key for key in own if given.get(key) != own[key])
            raise InputError(
                self.file,
                f"states of a sequence with other settings ({other}); want the same, or another "
                "output",
            )
        self.states = _states(self.file, document)

    def keep(self, frame: float, known: Known) -> None:
        """Take in what is known after a frame, written when it is its turn or with ``save``."""
        if known.state is None:
            return
        self._last = frame, known
        if self._since == 0:
            self.save()
        self._since = (self._since + 1) % EVERY

    def save(self) -> None:
        """Write the file, the latest frame in it."""
        if self._last is None:
            return
        frame, known = self._last
        self.states[frame] = known
        document = {
            "format": _FORMAT,
            "operator": self.operator,
            "setup": _plain(self.setup),
            "states": [_entry(number, known) for number, known in self.states.items()],
        }
        text = json.dumps(document, indent=1, allow_nan=False) + "\n"

        def write(temporary: Path) -> None:
            temporary.write_text(text, encoding="utf-8")

        write_atomically(self.file, write)


def read_state(path: Path, operator: Operator, before: float = math.inf) -> Known:
    """What is known after the latest frame before ``before``, or else after the latest of all.

    From a file of Checkpoints, or from the header of an EXR frame. Raises InputError, also for
    the state of another operator.
    """
    if path.suffix.lower() == ".exr":
        text = read_exr_header(path).get("hdrusd:state")
        if not isinstance(text, str):
            raise InputError(path, "no hdrusd:state in its header; want a frame that an eye saw")
        document = _parsed(path, text)
    else:
        document = _document(path)
    if document.get("operator") != operator.name:
        raise InputError(path, f"state of {document.get('operator')}; want one of {operator.name}")
    states = _states(path, document)
    if not states:
        raise InputError(path, "no state; want that of a frame")
    # Another shot may begin at a lower number: then it is the last one's eye that looks on.
    numbers = [number for number in states if number < before] or list(states)
    return states[max(numbers)]


def state_text(operator: Operator, frame: float, known: Known) -> str:
    """What the header of an EXR frame says in ``hdrusd:state``; ``read_state`` reads it."""
    document = {"format": _FORMAT, "operator": operator.name, "states": [_entry(frame, known)]}
    return json.dumps(document, allow_nan=False)


def _entry(frame: float, known: Known) -> dict[str, Any]:
    entry = {"frame": frame, "time": known.time, "state": known.state}
    return entry if known.camera is None else {**entry, "camera": known.camera}


def _plain(value: Any) -> Any:
    """Settings as JSON has them: infinity and paths in words."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    return value if value is None or isinstance(value, (bool, int, float, str)) else str(value)


def _document(path: Path) -> Mapping[str, Any]:
    check_input(path)
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


def _states(path: Path, document: Mapping[str, Any]) -> dict[float, Known]:
    states: dict[float, Known] = {}
    entries: Any = document.get("states")
    for entry in entries if isinstance(entries, list) else [{}]:
        try:
            frame, time, state = float(entry["frame"]), float(entry["time"]), entry["state"]
            sound = math.isfinite(frame) and math.isfinite(time) and isinstance(state, dict)
            sound = sound and _finite(state)
        except (KeyError, TypeError, ValueError, OverflowError):
            sound = False
        if not sound:
            raise InputError(path, "states; want frame, time and state of each, finite numbers")
        camera = entry.get("camera")
        states[frame] = Known(time, state, camera if isinstance(camera, str) else None)
    return states


def _finite(value: Any, depth: int = 0) -> bool:
    """Whether a state holds nothing but finite numbers, in lists or under names."""
    if isinstance(value, (dict, list)):
        items = list(value.values()) if isinstance(value, dict) else value
        few = depth < _DEEPEST and len(items) <= _MOST
        return few and all(_finite(item, depth + 1) for item in items)
    return isinstance(value, (int, float)) and math.isfinite(float(value))
