"""A USD stage in the terms of the other formats, as far as looking for lamps needs it.

Names, places, points, lights and glowing materials; what is photometric already is left out,
and what UsdLux's letter says in nits counts as without a unit, for LDR stages rarely mean it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from hdrusd.errors import SourceRef
from hdrusd.legacy.scene import Image, LegacyScene, Light, Mesh, Node, Texture
from hdrusd.recipe.places import REPEATS, count, note_left
from hdrusd.report import Report
from hdrusd.usd import light_overs, preview_overs
from hdrusd.usd.lux import is_light, light_kind
from hdrusd.usd.network import Findings
from hdrusd.usd.network import Node as ShaderNode
from hdrusd.usd.source_stage import open_source

_KINDS = {"distant": "directional", "dome": "ambient"}


def stage_scene(path: Path, allowed: Callable[[Path], bool], report: Report) -> LegacyScene:
    """Read ``path``; ``allowed``: whether a file lies below the roots. Raises InputError."""
    stage = open_source(path, allowed, report)
    up = "Y" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y else "Z"
    scene = LegacyScene(path, "usd", up=up)  # type: ignore[arg-type]
    scene.unit_m = UsdGeom.GetStageMetersPerUnit(stage)
    _Reader(stage, scene, SourceRef(path), report).read()
    return scene


class _Reader:
    """Fills a scene from a stage."""

    def __init__(
        self, stage: Usd.Stage, scene: LegacyScene, place: SourceRef, report: Report
    ) -> None:
        self.stage = stage
        self.scene = scene
        self.place = place
        self.report = report
        self._materials: dict[str, int | None] = {}

    def read(self) -> None:
        """Every prim, parents first; of prims in instances as many places as of nodes."""
        nodes: dict[str, Node] = {}
        for prim in self._prims():
            here = replace(self.place, place=str(prim.GetPath()))
            node = Node(prim.GetName(), here, _matrix(prim))
            nodes[str(prim.GetPath())] = node
            above = nodes.get(str(prim.GetParent().GetPath()))
            (self.scene.roots if above is None else above.children).append(node)
            if is_light(prim):
                self._light(prim, node)
            elif prim.IsA(UsdGeom.Mesh):
                self._mesh(UsdGeom.Mesh(prim), node)

    def _prims(self) -> Iterator[Usd.Prim]:
        everything = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
        prims = iter(Usd.PrimRange(self.stage.GetPseudoRoot(), everything))
        next(prims)  # the pseudo-root
        seen: set[Sdf.Path] = set()  # of prims in prototypes
        repeats, cut = 0, False
        for prim in prims:
            if prim.IsInstanceProxy():
                path = prim.GetPrimInPrototype().GetPath()
                if path in seen:
                    if repeats == REPEATS:
                        prims.PruneChildren()
                        cut = True
                        continue
                    repeats += 1
                seen.add(path)
            yield prim
        if cut:
            roots = self.stage.GetPseudoRoot().GetChildren()
            distinct, everywhere = count(roots, _below, Usd.Prim.GetPath)
            note_left(everywhere - distinct - REPEATS, self.place, self.report)

    def _light(self, prim: Usd.Prim, node: Node) -> None:
        kind = light_kind(prim)
        if kind == "other" or light_overs.is_photometric(prim):
            return
        cutoff = light_overs.shaping(prim)[0]
        plain = "spot" if cutoff < 180.0 else "point"
        node.lights.append(len(self.scene.lights))
        self.scene.lights.append(
            Light(prim.GetName(), node.source, _KINDS.get(kind, plain), spot_cutoff=cutoff)  # type: ignore[arg-type]
        )

    def _mesh(self, mesh: UsdGeom.Mesh, node: Node) -> None:
        code = Usd.TimeCode.EarliestTime()
        points = np.array(mesh.GetPointsAttr().Get(code) or [], np.float32).reshape(-1, 3)
        counts = np.array(mesh.GetFaceVertexCountsAttr().Get(code) or [], np.int32)
        indices = np.array(mesh.GetFaceVertexIndicesAttr().Get(code) or [], np.int32)
        whole = len(indices) == counts.sum() and np.isfinite(points).all()
        if not len(counts) or not whole or indices.min() < 0 or indices.max() >= len(points):
            return  # convert tells it
        material = self._material(mesh.GetPrim())
        node.meshes.append(len(self.scene.meshes))
        made = Mesh(node.name, node.source, points, counts, indices, material=material)
        self.scene.meshes.append(made)

    def _material(self, prim: Usd.Prim) -> int | None:
        """Of the whole mesh; parts of one are not told apart."""
        bound = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
        if not bound:
            return None
        path = str(bound.GetPath())
        if path not in self._materials:
            self._materials[path] = self._read_material(bound)
        return self._materials[path]

    def _read_material(self, material: UsdShade.Material) -> int | None:
        prim = material.GetPrim()
        surface = preview_overs.preview_surface(material)
        if surface is None or preview_overs.is_photometric(prim):
            return None

        def named(node: ShaderNode, thing: str) -> Texture:
            asset = node.value("file", None)
            name = asset.path if isinstance(asset, Sdf.AssetPath) else ""
            return Texture(Image(name, self.place))

        findings = Findings(Report(), self.place, prim)  # convert tells them
        read = preview_overs.read_source_surface(prim, surface, findings, named, emission_map=True)
        self.scene.materials.append(replace(read.material, emission_cd_m2=False))
        return len(self.scene.materials) - 1


def _below(prim: Usd.Prim) -> list[Usd.Prim]:
    return list((prim.GetPrototype() if prim.IsInstance() else prim).GetChildren())


def _matrix(prim: Usd.Prim) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]] | None:
    form = UsdGeom.Xformable(prim)
    if not form:
        return None
    return np.array(form.GetLocalTransformation(Usd.TimeCode.EarliestTime()), np.float64)
