"""Names of prims: valid, unique among siblings, as near to the source's as they can be."""

from __future__ import annotations

from dataclasses import dataclass, field

from pxr import Sdf, Tf

#: Characters of a name that are kept; all of it is the display name.
_LONGEST = 120

#: Names of siblings, each with the last number that told another from it.
Taken = dict[str, int]


def identifier(wanted: str) -> str:
    """A valid name for a prim, a joint or a variant."""
    wanted = wanted.strip()[:_LONGEST] or "unnamed"
    # A digit in front would be replaced, and "1st" and "2nd" be told apart no more.
    return str(Tf.MakeValidIdentifier(f"_{wanted}" if wanted[0].isdigit() else wanted))


def unique(wanted: str, taken: Taken) -> str:
    """A valid name that is not ``taken``; it is from now on."""
    name = base = identifier(wanted)
    number = taken.get(base, 1)  # of ten thousand alike none asks all before it
    while name in taken:
        number += 1
        name = f"{base}_{number}"
    taken[base] = number
    taken.setdefault(name, 1)
    return name


@dataclass(slots=True)
class Names:
    """Valid and unique child names under each prim."""

    taken: dict[Sdf.Path, Taken] = field(default_factory=dict)

    def child(self, parent: Sdf.Path, wanted: str) -> Sdf.Path:
        """A free path below ``parent`` for a name from the source."""
        return parent.AppendChild(unique(wanted, self.taken.setdefault(parent, {})))
