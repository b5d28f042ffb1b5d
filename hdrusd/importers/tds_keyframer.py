"""The keyframer's half of a 3D Studio file: nodes, their parents, pivots and tracks.

Source: Autodesk, 3D Studio File Toolkit for release 3, "3DS Chunk Definitions" (KFDATA).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hdrusd.errors import InputError
from hdrusd.importers.tds_chunks import Chunk, Document
from hdrusd.importers.tds_keys import Track, TrackReader
from hdrusd.legacy.scene import Vec3
from hdrusd.report import Kind

AMBIENT, OBJECT, CAMERA, TARGET, LIGHT, LIGHT_TARGET, SPOT = range(0xB001, 0xB008)
#: What aims at what.
TARGET_OF = {CAMERA: TARGET, SPOT: LIGHT_TARGET}

_HEADER, _INSTANCE, _PIVOT, _ID, _HIDE = 0xB010, 0xB011, 0xB013, 0xB030, 0xB029
#: Tracks by name, and how many floats a key of each has.
_TRACKS = {
    0xB020: ("position", 3),
    0xB021: ("rotation", 4),
    0xB022: ("scale", 3),
    0xB023: ("field of view", 1),
    0xB024: ("roll", 1),
    0xB025: ("color", 3),
    0xB027: ("hotspot", 1),
    0xB028: ("falloff", 1),
    _HIDE: ("hide", 0),
}
#: Sizes before the scale track was made, boxes, and the active part of the timeline.
_SILENT = frozenset({0xB012, 0xB014, 0xB015})
_SETTINGS = frozenset({0xB008, 0xB009, 0xB00A, 0x7001, 0x7011, 0x7012, 0x7020})
_NO_PARENT = 0xFFFF
_HIDDEN = 0x0800
_UNLINKED = 0x0700


@dataclass(slots=True)
class KeyNode:
    """One node. ``kind`` is its tag; ``parent`` an index into the list of nodes."""

    kind: int
    chunk: Chunk
    name: str = ""
    instance: str = ""
    number: int | None = None  # that parents are named by
    parent_number: int = _NO_PARENT
    parent: int | None = None
    hidden: bool = False
    pivot: Vec3 = (0.0, 0.0, 0.0)
    tracks: dict[str, Track] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """What the node is called: an instance or a dummy has a name of its own."""
        return self.instance or self.name


def read_keyframer(document: Document, chunk: Chunk, tracks: TrackReader) -> list[KeyNode]:
    """The nodes of a KFDATA chunk, each below a parent that is there and not below itself."""
    nodes = []
    for child in document.children(chunk):
        if AMBIENT <= child.tag <= SPOT:
            nodes.append(_node(document, child, tracks))
        else:
            document.unread(child, "", _SETTINGS)
    _find_parents(document, nodes)
    return nodes


def _node(document: Document, chunk: Chunk, tracks: TrackReader) -> KeyNode:
    node = KeyNode(chunk.tag, chunk)
    for child in document.children(chunk):
        if child.tag == _HEADER:
            node.name, at = document.text(child)
            node.hidden = bool(document.word(child, 0, node.name, at) & _HIDDEN)
            node.parent_number = document.word(child, _NO_PARENT, node.name, at + 4)
        elif child.tag == _ID:
            node.number = document.word(child, 0, node.name)
        elif child.tag == _INSTANCE:
            node.instance, _ = document.text(child)
        elif child.tag == _PIVOT:
            node.pivot = document.triple(child, node.pivot, node.name)
        elif child.tag in _TRACKS:
            key, width = _TRACKS[child.tag]
            track = tracks.read(child, width, node.name)
            if track is not None:
                node.tracks[key] = track
        else:
            document.unread(child, node.name, _SILENT)
    _note_tracks(document, node)
    return node


def _note_tracks(document: Document, node: KeyNode) -> None:
    """What of the tracks moves and cannot, in a stage of ours."""
    for key in ("field of view", "color", "hotspot", "falloff"):
        track = node.tracks.get(key)
        if track is not None and np.ptp(track.values, axis=0).any():
            text = f"{key} that changes over time; its first key holds"
            document.note(Kind.DROPPED, "3ds-track-dropped", track.chunk, node.title, text)
    hide = node.tracks.get("hide")
    if hide is not None:
        node.hidden = node.hidden or int(np.count_nonzero(hide.frames <= 0.0)) % 2 == 1
        if (hide.frames > 0.0).any():
            text = "hidden and shown over time; as at the first frame"
            document.note(Kind.DROPPED, "3ds-track-dropped", hide.chunk, node.title, text)
    if node.parent_number != _NO_PARENT:
        for key in ("position", "rotation", "scale"):
            track = node.tracks.get(key)
            if track is not None and track.flags & _UNLINKED:
                text = f"{key} that does not follow the parent along some axes; follows it"
                document.note(Kind.REPLACED, "3ds-unlinked", track.chunk, node.title, text)


def _find_parents(document: Document, nodes: list[KeyNode]) -> None:
    """Set ``parent``. Without NODE_ID the order in the file is the number. Raises InputError."""
    numbers: dict[int, int] = {}
    for index, node in enumerate(nodes):
        numbers.setdefault(index if node.number is None else node.number, index)
    for node in nodes:
        if node.parent_number == _NO_PARENT:
            continue
        node.parent = numbers.get(node.parent_number)
        if node.parent is None:
            text = f"parent {node.parent_number} is not there; the node stands in the world"
            document.note(Kind.MISSING, "3ds-parent", node.chunk, node.title, text)
    _cut_cycles(document, nodes)
    depth = [0] * len(nodes)  # 0: not known yet
    for index in range(len(nodes)):
        chain: list[int] = []
        at: int | None = index
        while at is not None and not depth[at]:
            chain.append(at)
            at = nodes[at].parent
        above = 0 if at is None else depth[at]
        for below in reversed(chain):
            above += 1
            depth[below] = above
        if depth[index] > document.limits.depth:
            text = f"nested deeper than {document.limits.depth} nodes"
            raise InputError(document.ref(nodes[index].chunk), text)


def _cut_cycles(document: Document, nodes: list[KeyNode]) -> None:
    """A node that hangs below itself loses its parent."""
    seen = [-1] * len(nodes)  # the walk that came by
    for index in range(len(nodes)):
        at: int | None = index
        while at is not None and seen[at] == -1:
            seen[at] = index
            above = nodes[at].parent
            if above is not None and seen[above] == index:
                text = f"parent {nodes[at].parent_number} hangs below it; stands in the world"
                node = nodes[at]
                document.note(Kind.INVALID, "3ds-cycle", node.chunk, node.title, text)
                node.parent = None
            at = nodes[at].parent
