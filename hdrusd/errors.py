"""Every exception that hdrusd raises on purpose.

    HdrusdError
        InputError                 a file says something we cannot use
        OutputError                a file cannot be written, by the words of a library
        UnknownNameError           a name that is not in a registry
        ParameterError             an operator's parameter out of its range
        ShaderError                GLSL did not compile or link
        ContextError               no OpenGL 3.3 context can be had
        SchemaRegistrationError    the USD schemas cannot be registered any more
        ValidationError            what was written does not pass its own validators

Messages read ``place: thing: what is wrong; what is wanted``. Anything else that
escapes is a bug and keeps its traceback. The command line maps each class to an
exit code (``exit_code``), documented in the README.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

#: Characters of a message or a name; file formats have names of any length.
_LONGEST = 400


def one_line(text: str) -> str:
    """``text`` without control characters, which a terminal would obey, and not too long."""
    if not text.isprintable():
        text = "".join(c if c.isprintable() else " " for c in text)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}... ({len(text)} characters)"


@dataclass(frozen=True, slots=True)
class SourceRef:
    """Where a thing was said: a file, and a line or a path inside it."""

    file: Path
    place: int | str | None = None

    def __str__(self) -> str:
        name = one_line(self.file.name)
        return name if self.place is None else f"{name}:{self.place}"


class HdrusdError(Exception):
    """Base class; ``str()`` of it is one line for the user."""

    exit_code = 1


class InputError(HdrusdError):
    """A file that cannot be read or does not make sense."""

    exit_code = 3

    def __init__(self, source: SourceRef | Path, problem: str) -> None:
        self.source = source if isinstance(source, SourceRef) else SourceRef(source)
        self.problem = one_line(problem)
        super().__init__(f"{self.source}: {self.problem}")


class OutputError(HdrusdError):
    """A file that a library could not write; others are an OSError."""

    def __init__(self, path: Path, reason: str) -> None:
        self.path = path
        self.reason = one_line(reason)
        super().__init__(f"{path}: cannot be written ({self.reason})")


class UnknownNameError(HdrusdError):
    """A name that is not registered; the message lists those that are."""

    exit_code = 2

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        known = sorted(known)
        near = get_close_matches(name, known, n=1)
        hint = f"did you mean {near[0]}? " if near else ""
        super().__init__(f"{kind}: {name}: unknown; {hint}known: {', '.join(known)}")


class ParameterError(HdrusdError):
    """A parameter of an operator that is no number or out of its range."""

    exit_code = 2


class ShaderError(HdrusdError):
    """A shader that the driver refused; the log names our files and lines."""


class ContextError(HdrusdError):
    """No usable OpenGL context; the message says what to install."""

    exit_code = 5


class SchemaRegistrationError(HdrusdError):
    """The schemas were registered too late for this process."""


class ValidationError(HdrusdError):
    """A stage that hdrusd wrote, or was asked to check, breaks a rule."""

    exit_code = 4
