"""Variant selections of the user, made in the session layer: the files stay as they are."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import NoReturn

from pxr import Sdf, Tf, Usd

from hdrusd.errors import InputError, SourceRef

#: Names of what there is that a message lists.
_LISTED = 12


def select_variants(stage: Usd.Stage, choices: Sequence[str], place: SourceRef) -> None:
    """Select ``PRIM:SET=NAME`` each, in order: one may bring the set of the next.

    Raises InputError with what there is for a prim, a set or a name that is not there.
    """
    for choice in choices:
        match = re.fullmatch(r"(/[^:]*):([^=]+)=(.+)", choice)
        if match is None or not Sdf.Path.IsValidPathString(match[1]):
            _refuse(place, choice, "want PRIM:SET=NAME, like /World/Car:paint=red")
        path, name, variant = Sdf.Path(match[1]), match[2], match[3]
        prim = stage.GetPrimAtPath(path)
        if not prim:
            having = (p for p in stage.Traverse() if p.HasVariantSets())
            known = (str(p.GetPath()) for p in having)
            _refuse(place, choice, f"no such prim; {_list('prims with variants', known)}")
        if prim.IsInstanceProxy() or prim.IsInPrototype():
            _refuse(place, choice, "inside an instance; want the instance itself or a prim above")
        sets = prim.GetVariantSets()
        if name not in sets.GetNames():
            _refuse(place, choice, f"no such variant set; {_list('sets', sets.GetNames())}")
        names = sets.GetVariantSet(name).GetVariantNames()
        if variant not in names:
            _refuse(place, choice, f"no such variant; {_list('variants', names)}")
        try:
            with Usd.EditContext(stage, stage.GetSessionLayer()):
                sets.GetVariantSet(name).SetVariantSelection(variant)
        except Tf.ErrorException:
            _refuse(place, choice, "cannot be selected here")


def _refuse(place: SourceRef, choice: str, problem: str) -> NoReturn:
    raise InputError(place, f"--variant {choice}: {problem}")


def _list(what: str, names: Iterable[str]) -> str:
    known: list[str] = []
    for name in names:
        if len(known) == _LISTED:
            known.append("...")
            break
        known.append(name)
    return f"{what}: {', '.join(known) or 'none'}"
