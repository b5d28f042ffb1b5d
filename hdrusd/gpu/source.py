"""GLSL from package resources: ``#include``, ``#define``, and a table back to file and line.

A name is a path from the root of the package ``hdrusd`` ("tonemap/reinhard02.glsl");
other packages put theirs in front ("their_package:their_operator.glsl"); with a line break
in it, it is the text itself, whose first line is its name in messages. The table exists
because drivers do not keep to ``#line``: Mesa 22.3 reports some errors against
string 0 all the same.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib.resources import files

from hdrusd.errors import ShaderError

#: Value of a macro: a number, a word, or a quoted path for ``#include NAME``.
Define = str | int | float
Defines = Mapping[str, Define]

_VERSION = "#version 330 core"
_INCLUDE = re.compile(r'\s*#\s*include\b\s*(?:"(?P<path>[^"]*)"|(?P<macro>\w+))?(?P<rest>.*)')
# "0:12(5): error" (Mesa), "0(12) : error" (NVIDIA), "ERROR: 0:12: ..." (Apple, AMD)
_LINE = re.compile(r"\b0(?::(?P<mesa>\d+)\b|\((?P<nvidia>\d+)\))")


@dataclass(frozen=True, slots=True)
class Source:
    """One stage, ready for the driver. ``lines[i]`` is where joined line i + 1 came from."""

    name: str
    text: str
    lines: tuple[tuple[str, int], ...]

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files that it was made of, the entry first."""
        return tuple(dict.fromkeys(name for name, _ in self.lines if name != "<define>"))

    def rewrite_log(self, log: str) -> str:
        """The driver's log with ``file:line`` wherever it says a joined line."""

        def place(match: re.Match[str]) -> str:
            number = int(match["mesa"] or match["nvidia"])
            if not 1 <= number <= len(self.lines):
                return match[0]
            name, line = self.lines[number - 1]
            return f"{name}:{line}"

        return _LINE.sub(place, log)


def load(name: str, defines: Defines | None = None) -> Source:
    """Read a stage and all that it includes, each file once.

    ``#version 330`` is written here, the defines after it. A define whose value is
    a quoted path only answers ``#include NAME``: the driver does not see it.
    Raises ShaderError for a missing file, a bad directive or a circle.
    """
    return from_text(_read(name, name), name, defines)


def from_text(text: str, name: str, defines: Defines | None = None) -> Source:
    """As ``load``, for a stage that is not in a file; ``name`` stands for it in messages."""
    joined = _Joined(dict(defines or {}))
    joined.emit(_VERSION, name, 1)
    for macro, value in joined.defines.items():
        if not _quoted(value):
            joined.emit(f"#define {macro} {value}", "<define>", 1)
    joined.add(text, name)
    return Source(name, "\n".join(joined.text) + "\n", tuple(joined.lines))


@dataclass(slots=True)
class _Joined:
    defines: dict[str, Define]
    text: list[str] = field(default_factory=list)
    lines: list[tuple[str, int]] = field(default_factory=list)
    done: set[str] = field(default_factory=set)

    def emit(self, line: str, name: str, number: int) -> None:
        self.text.append(line)
        self.lines.append((name, number))

    def add(self, text: str, name: str) -> None:
        """Append a file; includes are opened on a stack, so that depth costs nothing."""
        open_files = [(name, _numbered(text))]
        while open_files:
            name, rest = open_files[-1]
            number, line = next(rest, (0, ""))
            if number == 0:
                open_files.pop()
                self.done.add(name)
            elif line.lstrip().startswith("#version"):
                if line.split()[1:2] != ["330"]:
                    raise ShaderError(f"{name}:{number}: {line.strip()}; want #version 330")
                self.emit("", name, number)
            elif (match := _INCLUDE.match(line)) is None:
                self.emit(line, name, number)
            else:
                wanted = self._path(match, f"{name}:{number}")
                chain = [opened for opened, _ in open_files]
                if wanted in chain:
                    circle = " -> ".join([*chain[chain.index(wanted) :], wanted])
                    raise ShaderError(f"{name}:{number}: #include goes in a circle: {circle}")
                if wanted not in self.done:
                    text = _read(wanted, f"{name}:{number}")
                    open_files.append((wanted.partition("\n")[0], _numbered(text)))

    def _path(self, match: re.Match[str], place: str) -> str:
        path = match["path"]
        if match["macro"]:
            value = self.defines.get(match["macro"], "")
            path = str(value)[1:-1] if _quoted(value) else None
        if not path or match["rest"].split("//")[0].strip():
            raise ShaderError(f'{place}: {match[0].strip()}; want #include "path/from/package"')
        return path


def _quoted(value: Define) -> bool:
    return isinstance(value, str) and len(value) > 2 and value[0] == value[-1] == '"'


def _numbered(text: str) -> Iterator[tuple[int, str]]:
    return iter(enumerate(text.splitlines(), start=1))


def _read(name: str, place: str) -> str:
    if "\n" in name:
        return name
    package, _, path = name.rpartition(":")
    parts = path.split("/")
    if not all(re.fullmatch(r"\w[\w.-]*", part) for part in parts):
        raise ShaderError(f"{place}: {name}: not a path from the root of a package")
    try:
        return files(package or "hdrusd").joinpath(*parts).read_text(encoding="utf-8")
    except (ModuleNotFoundError, OSError) as error:
        raise ShaderError(f"{place}: {name}: no such file in {package or 'hdrusd'}") from error
