"""One door for built-ins and plug-ins: importers, operators, estimate rules."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import entry_points
from typing import Generic, TypeVar, cast

from hdrusd.errors import UnknownNameError

T = TypeVar("T")


class Registry(Generic[T]):
    """Names to objects; code is imported only when its name is used.

    ``kind`` is the word for messages, ``group`` the entry point group through
    which other packages add theirs.
    """

    def __init__(self, kind: str, group: str) -> None:
        self.kind = kind
        self.group = group
        self._targets: dict[str, str] = {}
        self._loaded: dict[str, T] = {}

    def add(self, name: str, target: str) -> None:
        """Register a built-in as ``module:attribute``; a second one of that name is a bug."""
        if name in self._targets:
            raise ValueError(f"two {self.kind}s named {name}")
        self._targets[name] = target

    def names(self) -> list[str]:
        """All known names, from metadata alone."""
        plugins = (entry.name for entry in entry_points(group=self.group))
        return sorted({*self._targets, *plugins})

    def __contains__(self, name: object) -> bool:
        return name in self._targets or name in self.names()  # metadata take milliseconds

    def __iter__(self) -> Iterator[str]:
        return iter(self.names())

    def __getitem__(self, name: str) -> T:
        if name not in self._loaded:
            self._loaded[name] = self._load(name)
        return self._loaded[name]

    def _load(self, name: str) -> T:
        if name in self._targets:
            module, _, attribute = self._targets[name].partition(":")
            return cast(T, getattr(import_module(module), attribute))
        for entry in entry_points(group=self.group, name=name):
            return cast(T, entry.load())
        raise UnknownNameError(self.kind, name, self.names())
