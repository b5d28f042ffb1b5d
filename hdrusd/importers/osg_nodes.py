"""What one OpenSceneGraph node says for itself, wherever in the tree it is used.

Sources: OpenSceneGraph 3.6, src/osgWrappers/serializers/osg and osgSim (.osgt),
src/osgWrappers/deprecated-dotosg/osg and osgSim (.osg): LOD, PagedLOD, Switch,
Sequence, Billboard, ProxyNode, Node; osgSim's MultiSwitch.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from hdrusd.importers.osg_cameras import camera_view, render_camera
from hdrusd.importers.osg_text import Block, Document, Doubles, Statement
from hdrusd.importers.osg_transforms import Placement, TransformReader
from hdrusd.legacy.scene import Camera, Vec3
from hdrusd.report import Kind

DRAWABLES = {"Geometry", "ShapeDrawable"}
GEODES = {"Geode", "Billboard"}
#: Nodes that are represented, or for which this module makes the findings.
NODES = {
    "Node",
    "Group",
    "Transform",
    "MatrixTransform",
    "PositionAttitudeTransform",
    "AutoTransform",
    "DOFTransform",
    "LOD",
    "PagedLOD",
    "Switch",
    "MultiSwitch",
    "Sequence",
    "LightSource",
    "LightPointNode",
    "ProxyNode",
    "Camera",
    "CameraView",
    *GEODES,
}
_CALLBACKS = ("eventcallback", "eventcallbacks", "cullcallback", "cullcallbacks")
_DESCRIPTIONS = ("udcdescriptions", "descriptions", "description")
#: Fields that few nodes have.
_NOTED = frozenset({*_CALLBACKS, "userdatacontainer", *_DESCRIPTIONS})
_SETS = 256  # of a MultiSwitch that are kept
_ORIGIN: Vec3 = (0.0, 0.0, 0.0)
_ALWAYS = (0.0, float(np.finfo(np.float32).max))  # osg::LOD takes FLT_MAX for "for ever"

NodeKind = Literal["group", "lod", "switch", "sequence", "billboard"]


@dataclass(frozen=True, slots=True)
class External:
    """A file that stands in the place of a child."""

    name: str  # as written
    folder: str  # the node's DatabasePath; "" where it has none
    place: Statement  # of the node


@dataclass(slots=True)
class Description:
    """A node without its contents: the fields of ``legacy.scene.Node`` and what to put there."""

    place: Statement
    name: str
    visible: bool
    placement: Placement
    kind: NodeKind = "group"
    children: list[Statement | External | None] = field(default_factory=list)  # None: to nothing
    lod_ranges: tuple[tuple[float, float], ...] = ()
    lod_on_screen: bool = False
    switch_on: tuple[bool, ...] = ()
    switch_masks: tuple[tuple[str, tuple[bool, ...]], ...] = ()
    drawables: list[tuple[Statement, Vec3]] = field(default_factory=list)  # and where they stand
    camera: Camera | None = None
    camera_matrix: Doubles | None = None
    extras: dict[str, Any] = field(default_factory=dict)


class NodeReader:
    """Describes the nodes of one file, each once: a node may be used a thousand times."""

    def __init__(self, document: Document, point_limit: int) -> None:
        self.document = document
        self.transforms = TransformReader(document, point_limit)
        self._known: dict[int, Description] = {}

    def read(self, place: Statement) -> Description:
        """The description of a node or drawable; the same object for the same statement."""
        if id(place) not in self._known:
            self._known[id(place)] = self._describe(place)
        return self._known[id(place)]

    def _describe(self, place: Statement) -> Description:
        document, kind = self.document, place.class_name
        name = document.name(place) or kind
        placement = self.transforms.read(place, name)
        made = Description(place, name, self._mask(place), placement)
        self._notes(made)
        if kind in DRAWABLES:
            return made
        if placement.faces_viewer:
            made.kind = "billboard"
        made.children += self._list(place, "children", "num_children")
        if kind in GEODES:
            self._geode(made)
        elif kind in ("LOD", "PagedLOD"):
            self._lod(made)
        elif kind in ("Switch", "MultiSwitch"):
            self._switch(made)
        elif kind == "Sequence":
            self._sequence(made)
        elif kind == "ProxyNode":
            self._files(made)
        elif kind == "CameraView":
            made.camera = camera_view(document, place, name)
        elif kind == "Camera":
            self._render_pass(made)
        elif kind not in NODES:
            text = f"{place.label}: class without a meaning here; its children are kept"
            self._add(Kind.DROPPED, "osg-node-class", made, text)
        return made

    def _add(self, kind: Kind, code: str, made: Description, text: str) -> None:
        self.document.add(kind, code, made.place, made.name, text)

    def _list(self, place: Statement, new: str, old: str) -> list[Statement | None]:
        """Children or drawables: a field of their own in .osgt, all after their number in .osg."""
        statements = place.block.statements if place.block is not None else []
        if self.document.new:
            found = self.document.field(place, new)
            inside = found.block.statements if found is not None and found.block else []
            return [self.document.resolve(s) for s in inside if s.block is not None]
        start = next((i for i, s in enumerate(statements) if s.words[:1] == [old]), None)
        if start is None:
            return []
        declared = statements[start].declared or 0
        inside = [s for s in statements[start + 1 :] if s.block is not None or s.key == "use"]
        if len(inside) < declared:
            text = f"{declared} declared, {len(inside)} found"
            name = self.document.name(place)
            self.document.add(Kind.INVALID, "osg-count", statements[start], name, text)
        return [self.document.resolve(s) for s in inside[:declared]]

    def _mask(self, place: Statement) -> bool:
        """Whether a node is drawn at all: a NodeMask other than 0."""
        word = self.document.word(place, "nodemask")
        try:
            return word is None or int(word[:20], 0) != 0
        except ValueError:
            return True

    def _notes(self, made: Description) -> None:
        """Descriptions as extras; callbacks and user data that are dropped."""
        document, place = self.document, made.place
        if place.block is None or _NOTED.isdisjoint(place.block.fields):
            return
        for key in _CALLBACKS:
            found = document.field(place, key)
            if found is not None and found.block is not None:
                text = "behaviour of a program; dropped"
                document.add(Kind.DROPPED, "osg-callback", found, made.name, text)
        container = document.object(place, "userdatacontainer") if document.new else None
        if container is not None and document.field(container, "udcuserobjects") is not None:
            self._add(Kind.DROPPED, "osg-user-data", made, "user data objects; dropped")
        holder = place if container is None else container
        texts: list[str] = []
        for key in _DESCRIPTIONS:
            found = document.field(holder, key)
            if found is not None and found.block is not None:
                texts += [" ".join(s.words) for s in found.block.statements]
            elif found is not None and key == "description":
                texts += found.words[1:]
        if texts:
            made.extras["descriptions"] = tuple(texts)

    def _geode(self, made: Description) -> None:
        drawables = self._list(made.place, "drawables", "num_drawables")
        where = [_ORIGIN] * len(drawables)
        if made.place.class_name == "Billboard":
            made.kind = "billboard"
            text = "billboard: turns with the viewer; kept at rest"
            self._add(Kind.REPLACED, "osg-billboard", made, text)
            positions = self._numbers(made.place, "positionlist", "positions")
            positions = positions[: min(len(positions) // 3, len(drawables)) * 3].reshape(-1, 3)
            rows = np.where(np.isfinite(positions), positions, 0.0).tolist()
            where[: len(rows)] = [(x, y, z) for x, y, z in rows]
        for drawable, place in zip(drawables, where, strict=True):
            if drawable is not None and drawable.class_name in DRAWABLES:
                made.drawables.append((drawable, place))
            elif drawable is not None:
                text = f"{drawable.label}: no such drawable is kept; left out"
                self.document.add(Kind.DROPPED, "osg-drawable", drawable, made.name, text)

    def _lod(self, made: Description) -> None:
        document, place = self.document, made.place
        places = self._files(made) if place.class_name == "PagedLOD" else None
        count = len(made.children)
        pixels = document.word(place, "rangemode") == "PIXEL_SIZE_ON_SCREEN"
        if pixels:
            text = "ranges are sizes on the screen in pixels; their inverse stands for a distance"
            self._add(Kind.ASSUMED, "osg-lod-pixels", made, text)
        numbers = self._numbers(place, "rangelist")
        if document.field(place, "rangelist") is None:  # before 2002: the limits between levels
            numbers = np.repeat(self._numbers(place, "ranges"), 2)[1:-1]
        pairs = numbers[: len(numbers) // 2 * 2].reshape(-1, 2)
        if places is not None:
            pairs = pairs[[number for number in places if number < len(pairs)]]
        pairs = pairs[:count]
        usable = np.isfinite(pairs).all(axis=1)
        if len(pairs) < count or not usable.all():
            text = (
                f"{int(usable.sum())} ranges for {count} children; the others are always in range"
            )
            self._add(Kind.INVALID, "osg-lod-ranges", made, text)
        ranges = [_ALWAYS] * count
        for number in np.flatnonzero(usable).tolist():
            near, far = float(pairs[number, 0]), float(pairs[number, 1])
            if pixels:  # many pixels are near
                near, far = (1.0 / size if size > 1e-9 else 1e9 for size in (far, near))
            ranges[number] = near, far
        made.kind, made.lod_ranges, made.lod_on_screen = "lod", tuple(ranges), pixels

    def _switch(self, made: Description) -> None:
        """Values are TRUE and FALSE in .osgt, 1 and 0 in .osg; a MultiSwitch has sets of them."""
        document, place, count = self.document, made.place, len(made.children)
        found = document.field(place, "valuelist")
        if place.class_name == "MultiSwitch":
            active = max(int(document.number(place, 0.0, "activeswitchset")), 0)
            holder = document.field(place, "values") if document.new else place
            inner = holder.block.statements if holder is not None and holder.block else []
            sets = [s for s in inner if s.key in ("switchset", "valuelist")]
            found = sets[active] if active < len(sets) else None
            made.switch_masks = tuple(
                (f"set{number}", tuple(_truths(values.block)[:count]))
                for number, values in enumerate(sets[:_SETS])
            )
            if len(sets) > _SETS:
                text = f"{len(sets)} sets of switch values; the first {_SETS} are kept"
                self._add(Kind.DROPPED, "osg-switch-sets", made, text)
        values = _truths(None if found is None else found.block)[:count]
        default = document.word(place, "newchilddefaultvalue") not in ("FALSE", "0")
        made.kind = "switch"
        made.switch_on = tuple(values + [default] * (count - len(values)))

    def _sequence(self, made: Description) -> None:
        made.kind = "sequence"
        text = f"sequence of {len(made.children)} nodes; the first is selected, nothing runs"
        self._add(Kind.REPLACED, "osg-sequence", made, text)

    def _files(self, made: Description) -> list[int]:
        """Put the files that a PagedLOD or ProxyNode names in their places among the children.

        "" stands for a child in this file. Of a ProxyNode whose files' contents stand here too,
        those are used. Returns the place of each child among the names.
        """
        found = self.document.field(made.place, "rangedatalist", "filenames", "filenamelist")
        block = None if found is None else found.block
        names = [s.words[0] if s.words else "" for s in block.statements] if block else []
        here = deque(made.children)
        if made.place.class_name == "ProxyNode" and len(here) > names.count(""):
            names[: len(here)] = [""] * min(len(here), len(names))
        folder = self._database_path(made.place)
        children: list[Statement | External | None] = []
        places = []
        for number, name in enumerate(names):
            if name or here:
                children.append(External(name, folder, made.place) if name else here.popleft())
                places.append(number)
        made.children = [*children, *here]
        return [*places, *range(len(names), len(names) + len(here))]

    def _database_path(self, place: Statement) -> str:
        """``DatabasePath TRUE "tiles/"``, in .osg and for a ProxyNode without the flag."""
        found = self.document.field(place, "databasepath")
        words = [] if found is None else found.words[1:]
        return "" if words[:1] == ["FALSE"] or not words else words[-1]

    def _render_pass(self, made: Description) -> None:
        found = render_camera(self.document, made.place, made.name)
        if found is not None:
            made.camera, made.camera_matrix = found
        text = "a render pass; its camera is kept, its children stand among the others"
        if (self.document.word(made.place, "referenceframe") or "").startswith("ABSOLUTE"):
            made.visible = False
            text = "a render pass with its own frame (a display overlay); kept hidden"
        self._add(Kind.REPLACED, "osg-camera-pass", made, text)

    def _numbers(self, place: Statement, *keys: str) -> Doubles:
        found = self.document.field(place, *keys)
        return np.zeros(0) if found is None or found.block is None else found.block.numbers()


def _truths(block: Block | None) -> list[bool]:
    if block is None:
        return []
    words = [word for s in block.statements for word in s.words]
    words = words or [word.decode() for word in block.raw.split()]
    return [word not in ("FALSE", "0") for word in words]
