"""Entries of a photometry file as TOML text."""

from __future__ import annotations

import json
from glob import escape
from typing import Any


def toml_entry(section: str, name: str, **values: Any) -> str:
    """An entry for what is called ``name``, and nothing else."""
    return toml_table(section, escape(name), **values)


def toml_table(section: str, pattern: str, **values: Any) -> str:
    """An entry for what a shell pattern fits; strings, numbers and lists of numbers."""
    pairs = {"match": pattern} | values
    return "\n".join([f"[[{section}]]", *(f"{key} = {_value(v)}" for key, v in pairs.items())])


def quoted(text: str) -> str:
    """A basic string of TOML, all of it printable."""
    escaped = {'"': '\\"', "\\": "\\\\"}
    return '"' + "".join(escaped.get(c, c if c.isprintable() else _coded(c)) for c in text) + '"'


def _value(value: Any) -> str:
    # JSON's numbers and lists of them are TOML's too.
    return quoted(value) if isinstance(value, str) else json.dumps(value)


def _coded(character: str) -> str:
    code = ord(character)
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
