"""Who made a stage of what: a record of UsdMedia AuthorshipAPI on its default prim.

Without a date, so that the same input makes the same bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pxr import Sdf, Vt

from hdrusd import __version__

#: The record's name; another program's stands beside it.
_API = "AuthorshipAPI:hdrusd"
_PREFIX = "authorship:hdrusd:"


def authorship_inputs(source: Path, photometry: Path | None) -> dict[str, str]:
    """The files that a stage was made of, by their names: where they lay is nobody's business."""
    inputs = {"source": source.name}
    return inputs if photometry is None else inputs | {"photometry": photometry.name}


def write_authorship(layer: Sdf.Layer, path: Sdf.Path, inputs: Mapping[str, str]) -> None:
    """Note in ``layer`` that hdrusd made the prim at ``path`` of ``inputs``, by name."""
    spec = Sdf.CreatePrimInLayer(layer, path)
    listed = spec.GetInfo("apiSchemas").prependedItems if spec.HasInfo("apiSchemas") else []
    if _API not in listed:
        spec.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=[*listed, _API]))
    pairs = Vt.StringArray([text for pair in inputs.items() for text in pair])
    for name, kind, value in (
        ("softwarePackage", Sdf.ValueTypeNames.String, "hdrusd"),
        ("softwareVersion", Sdf.ValueTypeNames.String, __version__),
        ("inputs", Sdf.ValueTypeNames.StringArray, pairs),
    ):
        made = spec.attributes.get(_PREFIX + name) or Sdf.AttributeSpec(
            spec, _PREFIX + name, kind, Sdf.VariabilityUniform
        )
        made.default = value
