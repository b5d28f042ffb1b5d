"""``Overs``: a layer of opinions over the prims of a stage, each where composition hears it.

- What a variant brings is overridden inside that variant, so that the others stay as they are.
- What instances share is overridden in a class that all of them inherit: opinions below an
  instance are not heard, and the arcs of an instance are, so instances stay instances.
- Everything else is overridden at its own path.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from pxr import Pcp, Sdf, Usd

from hdrusd.usd.names import Names

#: Below it are the classes that instances inherit.
CLASSES = Sdf.Path("/__Photometry")

#: A variant set and what is selected in it.
_Selection = tuple[str, str]


class Overs:
    """Opinions of ``layer`` over the prims of ``stage``, which stays as it is."""

    def __init__(self, stage: Usd.Stage, layer: Sdf.Layer) -> None:
        self.stage = stage
        self.layer = layer
        self._classes: dict[tuple[str, ...], Sdf.Path] = {}  # places of instances -> their class
        self._heirs: dict[Sdf.Path, tuple[str, ...]] = {}  # of classes with nothing in them yet
        self._names = Names()
        self._known: dict[Sdf.Path, Sdf.Path] = {}  # prototype -> its class
        self._borne: dict[Sdf.Path, set[str]] = {}  # prototype -> places of its instances

    def forget(self) -> None:
        """To be called when the stage has changed: USD calls other prototypes by the same path."""
        self._known.clear()
        self._borne.clear()

    # -- where -----------------------------------------------------------------------------

    def place(self, prim: Usd.Prim) -> Sdf.Path:
        """Where the layer's opinions about a prim stand."""
        if prim.IsInstanceProxy():
            prim = prim.GetPrimInPrototype()
        chain = _chain(prim)
        place = Sdf.Path.absoluteRootPath
        if chain and chain[0].IsPrototype():
            place = self._class(chain.pop(0))
        brought = _selections(prim)
        for ancestor in chain:
            place = place.AppendChild(ancestor.GetName())
            sets = ancestor.GetVariantSets()
            for name in sets.GetNames():
                chosen = sets.GetVariantSelection(name)
                if (name, chosen) in brought:
                    place = place.AppendVariantSelection(name, chosen)
        return place

    def places(self, prim: Usd.Prim) -> set[str]:
        """Its place, and where that is in a class those of the instances that inherit it."""
        found = {str(self.place(prim))}
        chain = _chain(prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim)
        if chain and chain[0].IsPrototype():
            path = chain[0].GetPath()
            if path not in self._borne:
                instances = chain[0].GetInstances()
                self._borne[path] = set().union(*(self.places(it) for it in instances))
            found |= self._borne[path]
        return found

    def _class(self, prototype: Usd.Prim) -> Sdf.Path:
        """The class of a prototype, which all its instances are to inherit."""
        path = prototype.GetPath()
        if path not in self._known:
            instances = [(str(self.place(it)), it.GetName()) for it in prototype.GetInstances()]
            heirs = tuple(place for place, _ in sorted(instances))
            if heirs not in self._classes:
                self._classes[heirs] = self._names.child(CLASSES, min(instances)[1])
                self._heirs[self._classes[heirs]] = heirs
            self._known[path] = self._classes[heirs]
        return self._known[path]

    def _spec(self, place: Sdf.Path) -> Sdf.PrimSpec:
        """The prim spec at a place, made when it is not there; a class with its heirs."""
        own = place.GetPrefixes()[:2]
        if own[0] == CLASSES and len(own) > 1 and own[1] in self._heirs:
            for heir in self._heirs.pop(own[1]):
                self._spec(Sdf.Path(heir)).inheritPathList.Prepend(own[1])
            Sdf.CreatePrimInLayer(self.layer, CLASSES).specifier = Sdf.SpecifierClass
        return Sdf.CreatePrimInLayer(self.layer, place)

    # -- what ------------------------------------------------------------------------------

    def apply(self, prim: Usd.Prim, schema: str) -> None:
        """An API schema."""
        spec = self._spec(self.place(prim))
        listed = spec.GetInfo("apiSchemas").prependedItems if spec.HasInfo("apiSchemas") else []
        if schema not in listed:
            found = Sdf.TokenListOp.Create(prependedItems=[*listed, schema])
            spec.SetInfo("apiSchemas", found)

    def value(
        self,
        prim: Usd.Prim,
        name: str,
        kind: Sdf.ValueTypeName,
        value: object,
        *,
        uniform: bool = False,
    ) -> None:
        """The value of an attribute at all times; what it was connected to counts no more."""
        spec = self._attribute(self.place(prim), name, kind, uniform=uniform)
        spec.default = value
        if prim.GetAttribute(name).HasAuthoredConnections():
            spec.connectionPathList.ClearEditsAndMakeExplicit()

    def samples(
        self, prim: Usd.Prim, name: str, kind: Sdf.ValueTypeName, values: Mapping[float, object]
    ) -> None:
        """Time samples of an attribute, likewise."""
        spec = self._attribute(self.place(prim), name, kind)
        for time, value in values.items():
            self.layer.SetTimeSample(spec.path, time, value)
        if prim.GetAttribute(name).HasAuthoredConnections():
            spec.connectionPathList.ClearEditsAndMakeExplicit()

    def node(
        self, beside: Usd.Prim, name: str, values: Mapping[str, tuple[Sdf.ValueTypeName, object]]
    ) -> Sdf.Path:
        """A new shader, a sibling of ``beside``, with these attributes; its place in the layer."""
        place = self.place(beside).GetParentPath().AppendChild(name)
        spec = self._spec(place)
        spec.specifier, spec.typeName = Sdf.SpecifierDef, "Shader"
        for attribute, (kind, value) in values.items():
            uniform = not attribute.startswith(("inputs:", "outputs:"))
            made = self._attribute(place, attribute, kind, uniform=uniform)
            if value is not None:
                made.default = value
        return place

    def connect(
        self, place: Sdf.Path, name: str, kind: Sdf.ValueTypeName, sources: Sequence[Sdf.Path]
    ) -> None:
        """Connect an attribute of a place to attributes, by paths of the layer."""
        targets = self._attribute(place, name, kind).connectionPathList
        targets.ClearEditsAndMakeExplicit()
        targets.explicitItems = [path.StripAllVariantSelections() for path in sources]

    def source(self, path: Sdf.Path) -> Sdf.Path:
        """The attribute at ``path`` of the stage as the layer calls it."""
        prim = self.stage.GetPrimAtPath(path.GetPrimPath())
        place = self.place(prim) if prim else path.GetPrimPath()
        return place.StripAllVariantSelections().AppendProperty(path.name)

    def _attribute(
        self, place: Sdf.Path, name: str, kind: Sdf.ValueTypeName, *, uniform: bool = False
    ) -> Sdf.AttributeSpec:
        spec = self._spec(place)
        if name in spec.attributes:
            return spec.attributes[name]
        change = Sdf.VariabilityUniform if uniform else Sdf.VariabilityVarying
        return Sdf.AttributeSpec(spec, name, kind, change)


def all_prims(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    """Every defined prim once, what instances share included, in an order of their names.

    USD numbers prototypes as its threads meet them, so they come by their first instance.
    """
    yield from stage.Traverse()
    known: dict[Sdf.Path, str] = {}

    def first_place(prototype: Usd.Prim) -> str:
        path = prototype.GetPath()
        if path not in known:
            known[path] = min(map(place, prototype.GetInstances()))
        return known[path]

    def place(prim: Usd.Prim) -> str:
        chain = _chain(prim)
        if not chain[0].IsPrototype():
            return str(prim.GetPath())
        return "/".join([first_place(chain[0]), *(it.GetName() for it in chain[1:])])

    for prototype in sorted(stage.GetPrototypes(), key=first_place):
        yield from (prim for prim in Usd.PrimRange(prototype) if prim != prototype)


def population(stage: Usd.Stage) -> tuple[int, int]:
    """How many prims there are with all that instances show, counted without going there.

    And how many instances stand in one another, at most.
    """
    known: dict[Sdf.Path, tuple[int, int]] = {}
    inside: dict[Sdf.Path, tuple[int, list[Usd.Prim]]] = {}  # prims, and prototypes of instances
    stack = [stage.GetPseudoRoot()]
    while stack:
        path = stack[-1].GetPath()
        if path not in inside:
            prims = list(Usd.PrimRange(stack[-1]))
            shown = [prim.GetPrototype() for prim in prims if prim.IsInstance()]
            inside[path] = len(prims), shown
            stack += [prim for prim in shown if prim.GetPath() not in inside]
            continue
        stack.pop()
        own, shown = inside[path]
        below = [known.get(prim.GetPath(), (0, 0)) for prim in shown]
        depth = 1 + max(deep for _, deep in below) if below else 0
        known[path] = own + sum(count for count, _ in below), depth
    return known[stage.GetPseudoRoot().GetPath()]


def _chain(prim: Usd.Prim) -> list[Usd.Prim]:
    """The prims from the root, or from the prototype that it is in, down to a prim."""
    chain = []
    while prim and not prim.IsPseudoRoot():
        chain.append(prim)
        prim = prim.GetParent()
    return chain[::-1]


def _selections(prim: Usd.Prim) -> set[_Selection]:
    """The variants that have something to say about a prim."""
    found: set[_Selection] = set()
    pending: list[Pcp.NodeRef] = [prim.GetPrimIndex().rootNode]
    while pending:
        node = pending.pop()
        pending += node.children
        if node.arcType == Pcp.ArcTypeVariant:
            path = node.path
            while path not in (Sdf.Path.emptyPath, Sdf.Path.absoluteRootPath):
                if path.IsPrimVariantSelectionPath():
                    found.add(path.GetVariantSelection())
                path = path.GetParentPath()
    return found


def relative(path: Path) -> str:
    """A relative path as an asset path: anchored to its layer."""
    text = path.as_posix()
    return text if text.startswith("..") else f"./{text}"
