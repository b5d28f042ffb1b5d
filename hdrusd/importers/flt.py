"""Reader for OpenFlight databases: ``.flt``, revisions 14.2 to 16.

A database is often many files: each external reference is read once, whatever the number
of its uses, and its nodes are shared. Files are read one after the other, never one
inside another, and a reference that leads back to a file above it is cut.

Source: OpenFlight Scene Description Database Specification 16.5 (Presagis, 2016).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from pathlib import Path

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.expansion import check_expansion
from hdrusd.importers.flt_materials import MaterialReader
from hdrusd.importers.flt_palettes import Palettes, read_palettes
from hdrusd.importers.flt_records import Document, load
from hdrusd.importers.flt_textures import TextureReader
from hdrusd.importers.flt_tree import Reference, Tree, TreeReader
from hdrusd.importers.importer import Resolver, resolver_of
from hdrusd.legacy.merge import rescaled
from hdrusd.legacy.scene import LegacyScene
from hdrusd.report import Kind, Report

#: All palettes of its own: the flags of a reference before revision 14.2, and of 15.4.1,
#: whose writers left them 0.
_OWN = 0xFFFFFFFF
_FLAGS_UNSET = 1541

#: A file, the palettes that it inherits, what it inherits from and by which flags, and the unit
#: that it is scaled to.
_Key = tuple[Path, int, int, float]


def read(resolver: Resolver, report: Report) -> LegacyScene:
    """Read ``resolver.source``. Raises InputError when nothing can be used."""
    return _SceneReader(resolver, report).read()


@dataclass(slots=True)
class _Waiting:
    """A reference to be followed, and the file that it stands in."""

    document: Document
    palettes: Palettes
    reference: Reference


@dataclass(slots=True)
class _SceneReader:
    """Reads a file and all that it refers to."""

    resolver: Resolver
    report: Report
    scene: LegacyScene = field(init=False)
    materials: MaterialReader = field(init=False)
    waiting: deque[_Waiting] = field(default_factory=deque)
    _trees: dict[_Key, Tree | None] = field(default_factory=dict)
    _palettes: list[Palettes] = field(default_factory=list)  # kept: their ids are in keys
    _below: dict[Path, set[Path]] = field(default_factory=dict)  # files that a file refers to
    _count: int = 0

    def __post_init__(self) -> None:
        self.scene = LegacyScene(self.resolver.source, "flt", up="Z")
        textures = TextureReader(self.report)
        self.materials = MaterialReader(self.report, self.scene.materials, textures)

    def read(self) -> LegacyScene:
        """The whole scene. Raises InputError past the limits."""
        document = load(self.resolver, self.report)
        self.scene.unit_m, self.scene.unit_stated = document.unit_m, document.unit_stated
        self.scene.generator = f"OpenFlight {document.version / 100:.2f}"
        tree = self._tree(document, read_palettes(document))
        self.scene.roots.append(tree.root)
        while self.waiting:
            self._follow(self.waiting.popleft())
        check_expansion(self.scene.roots, self.resolver.limits)
        return self.scene

    def _tree(self, document: Document, palettes: Palettes) -> Tree:
        lights = self.scene.lights
        first, factor = len(lights), document.unit_m / self.scene.unit_m
        reader = TreeReader(document, palettes, self.scene, self.materials, self._count)
        tree = reader.read()
        if factor != 1.0:
            lights[first:] = [rescaled(light, factor) for light in lights[first:]]
        self._count = reader.count
        self.waiting += [_Waiting(document, palettes, found) for found in tree.references]
        total = sum(len(mesh.points) for mesh in self.scene.meshes)
        if total > self.resolver.limits.vertices:
            text = f"more than {self.resolver.limits.vertices} points with its references"
            raise InputError(self.resolver.source, text)
        return tree

    def _follow(self, waiting: _Waiting) -> None:
        """Put the nodes of an external file below the node that refers to it."""
        document, reference = waiting.document, waiting.reference
        record, node = reference.record, reference.node
        named, _, wanted = document.text(record, 4, 200).partition("<")
        named, wanted = named.strip(), wanted.partition(">")[0].strip()
        path = document.resolver.find(named, document.ref(record), thing=node.name)
        if path is None:
            node.extras = {**node.extras, "file": named}
            return
        flags = _OWN
        if document.version != _FLAGS_UNSET:
            (flags,) = document.integers(record, 208 if document.version >= 1510 else 206, "I")
        home = document.resolver.source.resolve()
        if path not in self._below.get(home, ()) and self._reaches(path, home):
            text = f"{named} leads back to this file; cut here"
            document.add(Kind.INVALID, "flt-cycle", record, node.name, text)
            return
        self._below.setdefault(home, set()).add(path)
        tree = self._external(path, waiting, flags)
        if tree is None:
            return
        part = tree.named.get(wanted) if wanted else tree.root
        if part is None:
            text = f"{named} has no node {wanted}; all of it is shown"
            document.add(Kind.MISSING, "flt-external", record, node.name, text)
            part = tree.root
        node.children.append(part)

    def _external(self, path: Path, waiting: _Waiting, flags: int) -> Tree | None:
        """The tree of a file under inherited palettes; None, with a finding, if it is broken."""
        document = waiting.document
        own = flags | 0x00FFFFFF == _OWN
        inherited = (0, 0) if own else (id(waiting.palettes), flags)
        key = path, *inherited, document.unit_m
        if key in self._trees:
            return self._trees[key]
        self._trees[key] = None
        try:
            # What is stated is the unit of the source, which its parts are scaled to.
            resolver = replace(resolver_of(path, document.resolver), stated=frozenset())
            inner = load(resolver, self.report)
        except InputError as error:
            record, node = waiting.reference.record, waiting.reference.node
            document.add(Kind.INVALID, "flt-external", record, node.name, f"{error}; left out")
            return None
        palettes = waiting.palettes.inherited(read_palettes(inner), flags, document.version)
        self._palettes.append(waiting.palettes)
        tree = self._tree(inner, palettes)
        if inner.unit_m != document.unit_m:
            factor = inner.unit_m / document.unit_m
            text = f"units of {inner.unit_m:g} m in a file of {document.unit_m:g} m; scaled"
            self.report.add(Kind.REPLACED, "flt-unit", SourceRef(path), path.name, text)
            tree.scale(factor)
        self._trees[key] = tree
        return tree

    def _reaches(self, start: Path, goal: Path) -> bool:
        """Whether a file refers, through others, to a file."""
        seen, stack = {start}, [start]
        while stack:
            path = stack.pop()
            if path == goal:
                return True
            new = self._below.get(path, set()) - seen
            seen |= new
            stack += new
        return False
