"""Prims as specs of a layer: what the schemas' own calls author, without a stage.

Each such call on a stage costs a notice, and one that makes or types a prim a composition, which
for ten thousand below one parent costs the square of their number. Specs that are made inside one
``Sdf.ChangeBlock`` cost the stage one composition for all of them. The layer says the same to the
letter.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from pxr import Sdf, Usd, Vt

_SCHEMAS, _ORDER = "apiSchemas", "xformOpOrder"


def define(layer: Sdf.Layer, path: Sdf.Path, kind: str) -> Sdf.PrimSpec:
    """A prim of a type; what is above it and not in the layer yet becomes an over."""
    prim: Sdf.PrimSpec = Sdf.CreatePrimInLayer(layer, path)
    prim.specifier = Sdf.SpecifierDef
    prim.typeName = kind
    return prim


def define_on(stage: Usd.Stage, path: Sdf.Path, kind: str) -> Sdf.PrimSpec:
    """A prim of a type where the stage's edit target is."""
    target = stage.GetEditTarget()
    return define(target.GetLayer(), target.MapToSpecPath(path), kind)


def attribute(
    prim: Sdf.PrimSpec, name: str, kind: Sdf.ValueTypeName, value: Any, *, uniform: bool = False
) -> Sdf.AttributeSpec:
    """An attribute of a schema with its value at the default time; None: without one."""
    varies = Sdf.VariabilityUniform if uniform else Sdf.VariabilityVarying
    made = Sdf.AttributeSpec(prim, name, kind, varies, declaresCustom=False)
    if value is not None:
        made.default = value
    return made


def primvar(
    prim: Sdf.PrimSpec, name: str, kind: Sdf.ValueTypeName, values: Any, interpolation: str
) -> None:
    """Values of a gprim, ``name`` with its namespace, if it has one."""
    made = attribute(prim, name, kind, values)
    made.SetInfo("interpolation", interpolation)


def bind(prim: Sdf.PrimSpec, material: Sdf.Path) -> None:
    """Bind a material by path; its prim may stand in another layer."""
    apply(prim, "MaterialBindingAPI")
    binding = Sdf.RelationshipSpec(prim, "material:binding", custom=True)
    binding.targetPathList.explicitItems = [material]


def bind_faces(mesh: Sdf.PrimSpec, name: str, faces: Vt.IntArray, material: Sdf.Path) -> None:
    """Bind a material to some faces of a mesh."""
    types = Sdf.ValueTypeNames
    subset = Sdf.PrimSpec(mesh, name, Sdf.SpecifierDef, "GeomSubset")
    attribute(subset, "elementType", types.Token, "face", uniform=True)
    attribute(subset, "indices", types.IntArray, faces)
    attribute(subset, "familyName", types.Token, "materialBind", uniform=True)
    bind(subset, material)
    family = "subsetFamily:materialBind:familyType"
    if family not in mesh.attributes:
        attribute(mesh, family, types.Token, "nonOverlapping", uniform=True)


def apply(prim: Sdf.PrimSpec, *schemas: str) -> None:
    """Applied API schemas, behind those that the prim has."""
    known = prim.GetInfo(_SCHEMAS).prependedItems if prim.HasInfo(_SCHEMAS) else []
    items = [*known, *(schema for schema in schemas if schema not in known)]
    prim.SetInfo(_SCHEMAS, Sdf.TokenListOp.Create(prependedItems=items))


def move(
    prim: Sdf.PrimSpec, op: str, kind: Sdf.ValueTypeName, value: Any = None
) -> Sdf.AttributeSpec:
    """One more transform, innermost of those that the prim has. ``op``: "translate", ..."""
    made = attribute(prim, f"xformOp:{op}", kind, value)
    order = prim.attributes.get(_ORDER)
    if order is None:
        _order(prim, made.name)
    else:
        order.default = Vt.TokenArray([*order.default, made.name])
    return made


def reset_moves(prim: Sdf.PrimSpec) -> None:
    """Leave the transforms of what is above the prim; to be said before its own."""
    _order(prim, "!resetXformStack!")


def _order(prim: Sdf.PrimSpec, first: str) -> None:
    attribute(prim, _ORDER, Sdf.ValueTypeNames.TokenArray, Vt.TokenArray([first]), uniform=True)


def hide(prim: Sdf.PrimSpec) -> None:
    """Invisible, with all below it."""
    attribute(prim, "visibility", Sdf.ValueTypeNames.Token, "invisible")


def display_name(prim: Sdf.PrimSpec, name: str) -> None:
    """Keep a source's name where the prim's differs."""
    if name and prim.name != name:
        prim.SetInfo("displayName", name[:200])


def keep(prim: Sdf.PrimSpec, extras: Mapping[str, Any], **facts: Mapping[str, Any]) -> None:
    """What a source says beyond its format, as JSON in the prim's metadata, and facts beside it."""
    told: dict[str, Any] = dict(facts)
    if extras:
        told["extras"] = json.dumps(dict(extras), default=str)
    if told:
        prim.SetInfo("customData", {"hdrusd": told})
