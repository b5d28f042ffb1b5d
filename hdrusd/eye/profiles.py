"""Profiles by name, from a file, or in the user's own words: ``elderly,pigment=1.2``.

    [NAME | FILE.toml][,KEY=VALUE ...]

A file holds the keys of one profile, at the top: ``age = 70``. Its ``title`` is for people.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from hdrusd.errors import HdrusdError, InputError, ParameterError, UnknownNameError
from hdrusd.input_file import check_input

#: A profile is a few lines; more than this many bytes is another file.
_LARGEST = 65536

#: A number, or a word.
Value = float | str


@dataclass(frozen=True, slots=True)
class Range:
    """Numbers that a key takes, ends included."""

    least: float
    most: float

    def __str__(self) -> str:
        return f"{self.least:g} to {self.most:g}"


#: A key takes numbers in a range, or one of some words.
Rules = Mapping[str, Range | tuple[str, ...]]


def check(kind: str, key: str, value: object, rules: Rules) -> Value:
    """``value`` as a float or a word that the key takes.

    Numbers may be text. Raises UnknownNameError for the key or the word, ParameterError.
    """
    if key not in rules:
        raise UnknownNameError(f"{kind}: key", key, rules)
    rule = rules[key]
    if isinstance(rule, tuple):
        if value not in rule:
            raise UnknownNameError(f"{kind}: {key}", str(value), rule)
        return str(value)
    try:
        number = float("nan" if isinstance(value, bool) else value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if not rule.least <= number <= rule.most:
        raise ParameterError(f"{kind}: {key}: {value!s:.40}; want {rule}")
    return number


def parse(kind: str, text: str, table: Path, rules: Rules) -> dict[str, Any]:
    """The keys that ``text`` sets, its own last.

    ``kind`` is the word for messages, ``table`` the TOML file of the names. Raises
    UnknownNameError, ParameterError, InputError.
    """
    first, *rest = text.split(",")
    values: dict[str, Value] = {}
    if "=" in first:
        rest = [first, *rest]
    elif first.lower().endswith(".toml"):
        values |= _read(kind, Path(first), rules)
    else:
        profiles = named(table)
        if first not in profiles:
            raise UnknownNameError(kind, first, profiles)
        values |= {k: v for k, v in profiles[first].items() if k != "title"}
    for part in rest:
        key, equals, value = (word.strip() for word in part.partition("="))
        if not equals:
            raise ParameterError(f"{kind}: {part!r}; want KEY=VALUE")
        values[key] = check(kind, key, value, rules)
    return values


@cache
def named(table: Path) -> Mapping[str, Mapping[str, Any]]:
    """The profiles of a table that comes with hdrusd, by name."""
    return tomllib.loads(table.read_text(encoding="utf-8"))


def _read(kind: str, path: Path, rules: Rules) -> dict[str, Value]:
    """The profile that a user's file holds. Raises InputError."""
    check_input(path)
    with path.open("rb") as file:
        data = file.read(_LARGEST + 1)
    if len(data) > _LARGEST:
        raise InputError(path, f"more than {_LARGEST} bytes; want a {kind} profile")
    try:
        document = tomllib.loads(data.decode("utf-8"))
        document.pop("title", None)
        return {key: check(kind, key, value, rules) for key, value in document.items()}
    except HdrusdError as problem:
        raise InputError(path, str(problem)) from None
    except RecursionError:
        raise InputError(path, "not TOML (nested too deep)") from None
    except ValueError as problem:  # not UTF-8, not TOML, or a number of thousands of digits
        raise InputError(path, f"not TOML ({problem})") from None
