"""Who made a stage of what: a record of UsdMedia AuthorshipAPI on its default prim.

Without a date, so that the same input makes the same bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count
from pathlib import Path

from pxr import Sdf, Usd, Vt

from hdrusd import __version__

_SCHEMA = "AuthorshipAPI"


def authorship_inputs(source: Path, photometry: Path | None) -> dict[str, str]:
    """The files that a stage was made of, by their names: where they lay is nobody's business."""
    inputs = {"source": source.name}
    return inputs if photometry is None else inputs | {"photometry": photometry.name}


def write_authorship(
    layer: Sdf.Layer, path: Sdf.Path, inputs: Mapping[str, str], before: Usd.Prim | None = None
) -> None:
    """Note in ``layer`` that hdrusd made the prim at ``path`` of ``inputs``, by name.

    ``before``: the prim as it was, whose records stay: each step has its own.
    """
    schemas = set(before.GetAppliedSchemas()) if before else set()
    names = (f"hdrusd_{number}" if number > 1 else "hdrusd" for number in count(1))
    name = next(name for name in names if f"{_SCHEMA}:{name}" not in schemas)
    spec = Sdf.CreatePrimInLayer(layer, path)
    listed = spec.GetInfo("apiSchemas").prependedItems if spec.HasInfo("apiSchemas") else []
    applied = Sdf.TokenListOp.Create(prependedItems=[*listed, f"{_SCHEMA}:{name}"])
    spec.SetInfo("apiSchemas", applied)
    pairs = Vt.StringArray([text for pair in inputs.items() for text in pair])
    for field, kind, value in (
        ("softwarePackage", Sdf.ValueTypeNames.String, "hdrusd"),
        ("softwareVersion", Sdf.ValueTypeNames.String, __version__),
        ("inputs", Sdf.ValueTypeNames.StringArray, pairs),
    ):
        full = f"authorship:{name}:{field}"
        Sdf.AttributeSpec(spec, full, kind, Sdf.VariabilityUniform).default = value
