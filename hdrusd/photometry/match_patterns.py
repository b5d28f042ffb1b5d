"""Patterns for ``match`` of the photometry file that fit what is meant and nothing else.

What an entry is held against is ``Sidecar.match``'s to say; this finds the few patterns that
name a group of lights, materials or nodes, and tells which things no pattern can.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from fnmatch import translate
from glob import escape
from itertools import takewhile

#: Names that wildcards are held against, all in all; behind that, names are listed.
_MOST_TRIES = 4_000_000

_NUMBER = re.compile("[0-9]+")

#: What stands for a number in a name, the plainer first.
_ANY = ("*", "[0-9]*")


@dataclass(frozen=True, slots=True)
class Thing:
    """What an entry may fit.

    ``names``: any pattern is held against them, its own is the first; "" is none. ``path``: one
    that begins with "/" is held against it too.
    """

    names: tuple[str, ...]
    path: str = ""


class Patterns:
    """What fits which of ``things``, which go by their numbers."""

    def __init__(self, things: Sequence[Thing]) -> None:
        self.things = things
        self._names: dict[str, set[int]] = {}
        self._paths: dict[str, set[int]] = {}
        for number, thing in enumerate(things):
            for name in thing.names:
                self._names.setdefault(name, set()).add(number)
            self._paths.setdefault(thing.path, set()).add(number)
        tables = self._names, self._paths
        self._tables = [(t, sorted(t), sorted(name[::-1] for name in t)) for t in tables]
        self._tries = _MOST_TRIES

    def of(self, group: Collection[int]) -> tuple[list[tuple[str, list[int]]], list[int]]:
        """Patterns that fit things of a group and no other, few if that can be.

        Each with the things that none before it fits; then those that no pattern tells from
        what is not of the group. A wildcard goes before the own name, that before the path,
        and that before other names.
        """
        members = set(group)
        names = sorted({self.things[number].names[0] for number in members})
        wild = self.wildcard(names, members, members)
        if wild is not None:
            return [(wild, list(group))], []
        found: list[tuple[str, list[int]]] = []
        left: list[int] = []
        done: set[int] = set()
        shared: set[str] = set()  # with what is not of the group
        for number in group:
            if number in done:
                continue
            thing = self.things[number]
            for name in (thing.names[0], thing.path, *thing.names[1:]):
                fitted = set() if name in shared else self._called(name)
                if fitted and fitted <= members:
                    found.append((escape(name), sorted(fitted - done)))
                    done |= fitted
                    break
                shared.add(name)
            else:
                left.append(number)
        return found, [number for number in left if number not in done]

    def wildcard(
        self, names: Sequence[str], wanted: Collection[int], members: set[int], before: str = ""
    ) -> str | None:
        """A pattern for several names that fits all that is wanted and nothing but members.

        ``before``: a pattern for what stands before each name.
        """
        for pattern in _wildcards(names) if len(names) > 1 else ():
            fitted = self.fitted(before + pattern)
            if fitted is not None and fitted.issuperset(wanted) and fitted <= members:
                return before + pattern
        return None

    def fitted(self, pattern: str) -> set[int] | None:
        """The things that a pattern fits; None when too much has been tried."""
        start, end = re.split(r"[*?[]", pattern)[0], re.split(r"[*?\]]", pattern)[-1]
        fits = re.compile(translate(pattern)).match
        found: set[int] = set()
        for table, ordered, backwards in self._tables[: 2 if pattern.startswith("/") else 1]:
            if len(start) < len(end):
                near = [name[::-1] for name in _beginning(backwards, end[::-1])]
            else:
                near = _beginning(ordered, start)
            for name in near:
                self._tries -= 1
                if self._tries < 0:
                    return None
                if name and fits(name):
                    found |= table[name]
        return found

    def _called(self, name: str) -> set[int]:
        """The things that the pattern fits which is a name and no more; no name is none."""
        if not name:
            return set()
        paths = self._paths.get(name, set()) if name.startswith("/") else set()
        return self._names.get(name, set()) | paths


def _beginning(ordered: Sequence[str], start: str) -> list[str]:
    """Of sorted names those that begin so."""
    first = bisect_left(ordered, start)
    last = bisect_right(ordered, start, lo=first, key=lambda name: name[: len(start)])
    return list(ordered[first:last])


def _wildcards(names: Sequence[str]) -> Iterator[str]:
    """Patterns that names may have in common: ``ls*``, ``ls[0-9]*`` of ls0 and ls1."""
    if len({_NUMBER.sub("0", name) for name in names}) == 1:
        for wild in _ANY:
            yield _NUMBER.sub(wild, escape(names[0]))
    ends = zip(min(names), max(names), strict=False)  # all others lie between these two
    same = "".join(a for a, _ in takewhile(lambda pair: pair[0] == pair[1], ends))
    same = same.rstrip("0123456789")
    if same:
        for wild in _ANY:
            yield escape(same) + wild
