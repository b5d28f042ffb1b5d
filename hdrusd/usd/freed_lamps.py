"""Lamps freed of their fixtures in all their places.

A lamp in a prototype is written once and stands in many places; its fixture may stand in the
same prototype or, in one place or another, beside it. The first is left out of its shadows
once, in the prototype. For the second the instances about that one lamp are opened
(``instanceable`` false, in the photometry layer), so that it can be said of it alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pxr import Sdf, Usd

from hdrusd.legacy.scene import LegacyScene
from hdrusd.usd.fixtures import Lamp, PlacedMesh, find_fixtures, free_from
from hdrusd.usd.tree import TreeWriter


def free_lamps(
    stage: Usd.Stage, scene: LegacyScene, tree: TreeWriter, lamps: Sequence[Lamp]
) -> None:
    """Fill in the fixtures of lamps and leave them out of their shadows, in the edit target."""
    copies = tree.copies
    meshes = [
        replace(mesh, path=path, node=path.GetParentPath())
        for mesh in tree.meshes
        for path in copies.places(mesh.path)
    ]
    placed = [(lamp, path) for lamp in lamps for path in copies.places(lamp.prim.GetPath())]
    standing = [Lamp(stage.GetPrimAtPath(path), lamp.light) for lamp, path in placed]
    tree.show_all()
    find_fixtures(stage, scene, meshes, standing, tree.together)
    tree.preview()
    inside: dict[Sdf.Path, dict[Sdf.Path, PlacedMesh]] = {}
    beside: list[tuple[Sdf.Path, list[PlacedMesh]]] = []
    for (lamp, path), found in zip(placed, standing, strict=True):
        written = lamp.prim.GetPath()
        lamp.looked_at &= found.looked_at
        lamp.too_large = lamp.too_large or found.too_large
        prototype = copies.prototype(written)
        if prototype is None:
            lamp.fixtures = found.fixtures
            inside.setdefault(written, {mesh.path: mesh for mesh in found.fixtures})
            continue
        root = path
        for _ in range(written.pathElementCount - prototype.pathElementCount):
            root = root.GetParentPath()
        mine = inside.setdefault(written, {})
        others = []
        for mesh in found.fixtures:
            if mesh.path.HasPrefix(root):
                there = mesh.path.ReplacePrefix(root, prototype)
                mine.setdefault(there, replace(mesh, path=there))
            else:
                others.append(mesh)
        lamp.fixtures = [*mine.values()]
        if others:
            beside.append((path, others))
    for written, fixtures in inside.items():
        free_from(stage.GetPrimAtPath(written), fixtures.values())
    opened = {above for path, _ in beside for above in _instances(stage, path)}
    for above in sorted(opened):
        stage.OverridePrim(above).SetInstanceable(False)
    by_path = {path: lamp for lamp, path in placed}
    for path, others in beside:
        by_path[path].fixtures = by_path[path].fixtures + others
        free_from(stage.GetPrimAtPath(path), others)


def _instances(stage: Usd.Stage, path: Sdf.Path) -> list[Sdf.Path]:
    """The instances about something, the outermost first."""
    return [above for above in path.GetPrefixes() if stage.GetPrimAtPath(above).IsInstance()]
