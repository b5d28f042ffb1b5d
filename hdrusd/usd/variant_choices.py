"""Variants that a stage has and does not show: how each is shown in turn, and what it brings."""

from __future__ import annotations

from dataclasses import dataclass

from pxr import Sdf, Usd

from hdrusd.usd.overs import Overs


@dataclass(frozen=True, slots=True)
class Choice:
    """A variant of a set on one prim, or on all instances of one prototype alike."""

    holders: tuple[Sdf.Path, ...]
    name: str
    variant: str

    def select(self, session: Sdf.Layer) -> None:
        """Select it in a session layer."""
        for path in self.holders:
            Sdf.CreatePrimInLayer(session, path).variantSelections[self.name] = self.variant

    def brought(self, overs: Overs) -> Brought:
        """What it brings, once it is selected."""
        place = overs.place(overs.stage.GetPrimAtPath(self.holders[0]))
        while place.IsPrimVariantSelectionPath():
            place = place.GetParentPath()
        return Brought(str(place), f"{{{self.name}={self.variant}}}")


@dataclass(frozen=True, slots=True)
class Brought:
    """What a variant brings: the places below its prim that have its selection in them."""

    prim: str
    selection: str

    def has(self, overs: Overs, prim: Usd.Prim) -> bool:
        """Whether a prim is there by the variant, or has something from it."""
        if not prim.IsInPrototype() and not prim.IsInstanceProxy():
            # Its one place is its path, with variants: to be asked of a whole stage, each time.
            below = str(Sdf.Path(self.prim).StripAllVariantSelections())
            if not str(prim.GetPath()).startswith(below):
                return False
        return any(
            text.startswith(self.prim) and self.selection in text[len(self.prim) :]
            for text in overs.places(prim)
        )


def other_variants(prim: Usd.Prim) -> list[Choice]:
    """The variants of a prim that are not selected; of an instance for all that are like it."""
    holders = (prim.GetPath(),)
    if prim.IsInstance():
        alike = prim.GetPrototype().GetInstances()
        holders = tuple(sorted(it.GetPath() for it in alike if not it.IsInPrototype()))
    sets, found = prim.GetVariantSets(), []
    for name in sets.GetNames():
        one = sets.GetVariantSet(name)
        others = (v for v in one.GetVariantNames() if v != one.GetVariantSelection())
        found += [Choice(holders, name, variant) for variant in others]
    return found
