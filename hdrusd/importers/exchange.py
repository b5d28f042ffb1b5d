"""A LegacyScene as two files: how a reader in a worker process hands over what it read.

``scene.json`` holds the records, ``arrays.bin`` the arrays one after another, little endian.
The parent believes nothing of it: the worker ran a library on a file that may be hostile.

The form follows the dataclasses of ``legacy.scene`` by their annotations, so a new field
travels by itself. Fields at their default are left out. A Node is written as its number in the
order of the walk, wherever it stands, so that the depth of the tree costs no stack and a
reference to a node of the tree stays one. A path never travels: ``load_scene`` puts the input's
own in, and looks a picture's reference up with ``Resolver.find``.
"""

from __future__ import annotations

import json
import math
import types
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import IO, Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.exchange_checks import BrokenSceneError, check_image, check_scene
from hdrusd.importers.importer import Resolver
from hdrusd.importers.worker_files import read_arrays, read_json
from hdrusd.legacy.scene import Image, LegacyScene, Node
from hdrusd.report import Finding, Kind, Report

SCENE = "scene.json"
ARRAYS = "arrays.bin"

#: What an array may be made of, as NumPy writes it.
_DTYPES = {"|u1", "<i4", "<f4", "<f8"}

_Array = npt.NDArray[Any]


def save_scene(scene: LegacyScene, folder: Path, findings: Iterable[Finding]) -> None:
    """Write ``scene`` and the findings of its reader into ``folder``.

    A picture has embedded ``data`` or ``pixels``, or its ``name`` alone: the reference as
    written. Raises ValueError where a number is not finite or a node stands in the tree twice.
    """
    numbers: dict[int, int] = {}
    nodes = list(_walk(scene.roots))
    for node in nodes:
        if id(node) in numbers:
            raise ValueError(f"node {node.name!r} stands in the tree twice")
        numbers[id(node)] = len(numbers)
    with open(folder / ARRAYS, "wb") as stream:
        writer = _Writer(stream, numbers)
        record = {
            "nodes": [writer.fields(node) for node in nodes],
            "scene": writer.fields(scene),
            "findings": [
                {"kind": f.kind, "code": f.code, "place": f.source.place, "thing": f.thing}
                | {"text": f.text}
                for f in findings
            ],
            "arrays": writer.arrays,
        }
    with open(folder / SCENE, "w", encoding="utf-8") as text:
        json.dump(record, text, allow_nan=False, separators=(",", ":"))


def save_refusal(error: InputError, folder: Path) -> None:
    """Write the InputError of a reader instead of a scene; ``load_scene`` raises it."""
    record = {"refusal": [error.source.place, error.problem]}
    (folder / SCENE).write_text(json.dumps(record), encoding="utf-8")


def _walk(roots: Sequence[Node]) -> Iterator[Node]:
    """The nodes, parents before their children."""
    stack = list(reversed(roots))
    while stack:
        node = stack.pop()
        yield node
        stack.extend(reversed(node.children))


@dataclass(slots=True)
class _Writer:
    stream: IO[bytes]
    nodes: Mapping[int, int]  # id to number
    arrays: list[tuple[str, tuple[int, ...]]] = field(default_factory=list)
    _known: dict[int, tuple[int, Any]] = field(default_factory=dict)  # id to number; keeps it alive

    def fields(self, record: Any) -> dict[str, Any]:
        """The fields of a dataclass that are not at their default."""
        kind: Any = type(record)
        found = ((name, getattr(record, name), least) for name, least in _defaults(kind))
        return {
            name: self.value(value) for name, value, least in found if not _is_same(value, least)
        }

    def value(self, value: Any) -> Any:
        """Anything that a LegacyScene holds, in JSON."""
        if isinstance(value, Node):
            return self.nodes[id(value)]
        if isinstance(value, np.ndarray | bytes):
            return {"array": self._array(value)}
        if is_dataclass(value):
            return self.fields(value)
        if isinstance(value, Path):
            return None  # the parent knows which file was read
        if isinstance(value, Mapping):
            return {str(key): self.value(item) for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [self.value(item) for item in value]
        if isinstance(value, frozenset):
            return sorted(value)
        if isinstance(value, np.generic):
            return value.item()
        return value

    def _array(self, value: _Array | bytes) -> int:
        if id(value) not in self._known:
            array = np.frombuffer(value, np.uint8) if isinstance(value, bytes) else value
            array = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
            self._known[id(value)] = len(self.arrays), value
            self.arrays.append((array.dtype.str, array.shape))
            self.stream.write(array.data)
        return self._known[id(value)][0]


@cache
def _defaults(kind: type) -> list[tuple[str, Any]]:
    """The fields of a dataclass, and what it fills in by itself; MISSING for nothing."""
    return [
        (f.name, f.default if f.default_factory is MISSING else f.default_factory())
        for f in fields(kind)
    ]


def _is_same(value: Any, default: Any) -> bool:
    if isinstance(value, np.ndarray) or type(value) is not type(default):
        return False
    return bool(value == default)


def load_scene(folder: Path, resolver: Resolver, report: Report) -> LegacyScene:
    """The scene that a worker left in ``folder``; its findings go into ``report``.

    Indices, shapes, sizes and the limits of ``resolver`` are checked. Pictures that are named
    only are looked up, with findings. Raises InputError.
    """
    try:
        record = read_json(folder / SCENE)
        if "refusal" in record:
            place, problem = record["refusal"]
            place = place if isinstance(place, int | str) else None
            raise InputError(SourceRef(resolver.source, place), str(problem))
        reader = _Reader(record, resolver)
        scene = reader.scene(folder)
        check_scene(scene, resolver.limits)
        reader.tell(report)
    except (BrokenSceneError, LookupError, TypeError, ValueError, ArithmeticError) as error:
        text = f"its reader answered nonsense ({error}); want a file that it can read"
        raise InputError(resolver.source, text) from error
    except RecursionError as error:
        raise InputError(resolver.source, "its reader answered lists without end") from error
    return scene


class _Reader:
    """Reads by the annotations of the dataclasses; every value is checked against its own."""

    def __init__(self, record: dict[str, Any], resolver: Resolver) -> None:
        self.record = record
        self.resolver = resolver
        self.nodes: dict[int, Node] = {}
        self._arrays: list[_Array] = []
        self._images: dict[tuple[Any, ...], Image] = {}

    def scene(self, folder: Path) -> LegacyScene:
        """The scene, its tree checked to be one."""
        limits, table = self.resolver.limits, self.record["nodes"]
        if len(table) > limits.nodes:
            raise InputError(self.resolver.source, f"more than {limits.nodes} nodes")
        self._read_arrays(folder)
        for number in reversed(range(len(table))):  # children stand behind their parent
            self.nodes[number] = self._record(Node, table[number])
        scene: LegacyScene = self._record(LegacyScene, self.record["scene"])
        seen: set[int] = set()
        level = scene.roots
        for depth in range(limits.depth + 1):
            if level and depth == limits.depth:
                raise InputError(self.resolver.source, f"nodes deeper than {limits.depth}")
            below: list[Node] = []
            for node in level:
                if id(node) in seen:
                    raise BrokenSceneError("a node with two parents")
                seen.add(id(node))
                below += node.children
            level = below
        if len(seen) != len(table):
            raise BrokenSceneError("a node outside the tree")
        return scene

    def tell(self, report: Report) -> None:
        """The worker's findings, into the report."""
        for entry in self.record["findings"]:
            texts = entry["code"], entry["thing"], entry["text"]
            place = entry["place"]
            if not all(isinstance(text, str) for text in texts):
                raise BrokenSceneError("a finding without words")
            source = SourceRef(
                self.resolver.source, place if isinstance(place, int | str) else None
            )
            report.add(Kind(entry["kind"]), texts[0], source, texts[1], texts[2])

    def _read_arrays(self, folder: Path) -> None:
        most = self.resolver.limits.file_bytes
        self._arrays = read_arrays(folder / ARRAYS, self.record["arrays"], _DTYPES, most)
        for array in self._arrays:
            if array.dtype.kind == "f" and not np.isfinite(array).all():
                raise BrokenSceneError("an array with numbers that are not finite")

    def _record(self, kind: type, data: Any) -> Any:
        if not isinstance(data, dict):
            raise BrokenSceneError(f"a {kind.__name__} that is none")
        hints = _hints(kind)
        if unknown := data.keys() - hints.keys():
            raise BrokenSceneError(f"a {kind.__name__} with {', '.join(sorted(unknown))}")
        found = {name: self._value(hints[name], value) for name, value in data.items()}
        if kind is Image:
            return self._image(found, data)
        return kind(**found)

    def _image(self, found: dict[str, Any], data: dict[str, Any]) -> Image:
        """One record an image, however often it is used; a name alone is looked up."""
        key = found["name"], str(data.get("data")), str(data.get("pixels"))
        if key not in self._images:
            if found.get("data") is None and found.get("pixels") is None:
                found["path"] = self.resolver.find(found["name"], found["source"])
            self._images[key] = Image(**found)
            check_image(self._images[key], self.resolver.limits)
        return self._images[key]

    def _value(self, hint: Any, data: Any) -> Any:
        """``data`` as the annotation ``hint`` wants it. Raises BrokenSceneError."""
        origin, inner = _parts(hint)
        if origin is None:
            return self._plain(hint, data)
        if origin in (Union, types.UnionType):
            return self._one_of(inner, data)
        if origin is np.ndarray:
            return self._array(data, np.dtype(get_args(inner[1])[0]))
        if origin is Literal:
            return _checked(data, lambda: data in inner, hint)
        if origin in (list, tuple, frozenset):
            _checked(data, lambda: isinstance(data, list), hint)
            if origin is tuple and inner[-1] is not Ellipsis:
                _checked(data, lambda: len(data) == len(inner), hint)
                return tuple(self._value(h, d) for h, d in zip(inner, data, strict=True))
            return origin(self._value(inner[0], item) for item in data)
        _checked(data, lambda: isinstance(data, dict), hint)  # a Mapping
        return {key: self._value(inner[1], item) for key, item in data.items()}

    def _plain(self, hint: Any, data: Any) -> Any:
        if hint is Any:
            return _plain_data(data)
        if hint is Path:
            return self.resolver.source
        if hint is Node:
            return self.nodes[data]
        if hint is bytes:
            return self._array(data, np.dtype(np.uint8)).tobytes()
        if hint is float:
            _checked(data, lambda: type(data) in (int, float) and math.isfinite(data), hint)
            return float(data)
        if is_dataclass(hint) and isinstance(hint, type):
            return self._record(hint, data)
        return _checked(data, lambda: type(data) is hint, hint)

    def _one_of(self, hints: tuple[Any, ...], data: Any) -> Any:
        if data is None:
            return _checked(None, lambda: types.NoneType in hints, hints)
        for hint in hints:
            if hint in (types.NoneType, Path):  # no path of the worker's is taken
                continue
            try:
                return self._value(hint, data)
            except (BrokenSceneError, KeyError):
                continue
        raise BrokenSceneError(f"a value that is none of {hints}")

    def _array(self, data: Any, dtype: np.dtype[Any]) -> _Array:
        number = data.get("array") if isinstance(data, dict) else None
        if type(number) is not int or not 0 <= number < len(self._arrays):
            raise BrokenSceneError(f"no array of {dtype} where one is wanted")
        array = self._arrays[number]
        if array.dtype != dtype:
            raise BrokenSceneError(f"an array of {array.dtype} where {dtype} is wanted")
        return array


@cache
def _parts(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    return get_origin(hint), get_args(hint)


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def _checked(data: Any, good: Callable[[], bool], hint: Any) -> Any:
    if not good():
        raise BrokenSceneError(f"{type(data).__name__} where {hint} is wanted")
    return data


def _plain_data(data: Any) -> Any:
    """Extras: JSON, its lists as tuples."""
    if isinstance(data, list):
        return tuple(_plain_data(item) for item in data)
    if isinstance(data, dict):
        return {key: _plain_data(item) for key, item in data.items()}
    return data
