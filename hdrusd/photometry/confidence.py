"""How far a photometric number may be trusted, from what a stage or a report says of it.

``photometric:provenance``, ``rule`` and ``source`` tell where a number came from; here is
what that is worth. The order, best first: measured, stated with a source, stated, by the
lamp's type, by its class or somebody's guess, by a rule from a colour without a unit.
"""

from __future__ import annotations

import re
from typing import Literal, get_args

Confidence = Literal["high", "medium", "low", "none"]

#: All of them, best first.
LEVELS: tuple[Confidence, ...] = get_args(Confidence)

#: What each means, for a report's legend.
MEANING: dict[Confidence, str] = {
    "high": "measured, or stated in a photometric unit with its source",
    "medium": "stated in a photometric unit without a source, or watts by the lamp's type",
    "low": "typical of a class of lamps or surfaces, somebody's guess, read out of a picture, "
    "or a unit by the letter of UsdLux alone",
    "none": "by an estimate rule, from a colour that has no unit",
}

#: How ``rule`` begins where the lamp's type, or the class of a lamp or surface, gave the number.
BY_LAMP_TYPE = "lamp type "
BY_CLASS = "class "

#: How it begins where a picture or a colour is read as reflectance.
BY_PICTURE = "R = "

#: How ``rule`` begins where the text of a schema gives a unit that its writers rarely mean.
BY_LETTER = "Usd"

#: A ``rule`` that names a place in a photometry file: somebody's own number.
_STATED = re.compile(r":(light|lamp|material)\[\d+\]|:ambient")


def confidence(
    provenance: str | None, rule: str | None = "", source: str | None = ""
) -> Confidence:
    """The level of a number, from the three texts that stand beside it; None is "".

    ``provenance``: measured, authored, estimated, or "" where nothing is recorded, as of a
    reflectance that a picture gave.
    """
    rule = rule or ""
    if provenance == "measured":
        return "high"
    if provenance == "authored" and rule.startswith(BY_LETTER):
        return "low"
    if provenance == "authored":
        return "high" if source else "medium"
    if rule.startswith(BY_LAMP_TYPE):
        return "medium"
    own = not provenance or rule.startswith((BY_CLASS, BY_PICTURE)) or _STATED.search(rule)
    return "low" if own else "none"
