"""What assimp makes of a file, as a LegacyScene; runs in a worker process.

The file is given to assimp as bytes, so that it opens no other. assimp turns what it reads into
right-handed axes with Y up, but not what a format leaves open (PLY, STL). The formats that come
this way have no cameras.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers import assimp_library as ai
from hdrusd.importers.assimp_animations import read_animation
from hdrusd.importers.assimp_materials import MaterialReader
from hdrusd.importers.assimp_meshes import MeshReader
from hdrusd.importers.importer import Resolver
from hdrusd.importers.left_open import leave_open
from hdrusd.legacy.scene import RGB, LegacyScene, Light, Node, Vec3
from hdrusd.report import Kind, Report

#: The attenuations of an aiLight that nobody set; the second is what AC3D's reader leaves.
_UNSAID = ((0.0, 1.0, 0.0), (1.0, 1.0, 0.0))
#: aiProcess_JoinIdenticalVertices | aiProcess_ValidateDataStructure: polygons stay polygons.
_FLAGS = 0x2 | 0x400
_KINDS: dict[int, Literal["directional", "point", "spot", "ambient"]] = {
    1: "directional",
    2: "point",
    3: "spot",
    4: "ambient",
}


def read(resolver: Resolver, report: Report) -> LegacyScene:
    """Read ``resolver.source``. Raises InputError when nothing can be used."""
    source = resolver.source
    data = resolver.read()
    if not data:
        raise InputError(source, "empty; want a 3D file")
    if data.startswith(b"version https://git-lfs"):
        raise InputError(source, "a Git LFS pointer; want the file itself (git lfs pull)")
    library = ai.find_library()
    assert library is not None  # the parent looked
    try:
        found = ai.load(library, data, source.suffix.lower(), _FLAGS)
    except ValueError as error:
        raise InputError(source, f"assimp: {error}; want a whole file of its kind") from None
    return _SceneReader(found, resolver, report).read()


@dataclass(slots=True)
class _SceneReader:
    found: Any
    resolver: Resolver
    report: Report

    def read(self) -> LegacyScene:
        """The whole scene. Raises InputError where nothing came in."""
        source, found = self.resolver.source, self.found
        scene = LegacyScene(source, source.suffix.lower().removeprefix("."), generator="assimp")
        taken = {"unit": "1 unit = 1 m", "up": "Y up"}
        leave_open(scene, self.resolver, self.report, "assimp-axes", "assimp", **taken)
        textures = ai.records(found["textures"], found["textures_count"], ai.TEXTURE)
        materials = MaterialReader(source, self.report, textures)
        scene.materials = [
            materials.read(record, number)
            for number, record in enumerate(
                ai.records(found["materials"], found["materials_count"], ai.MATERIAL)
            )
        ]
        meshes = MeshReader(source, self.report, self.resolver.limits, scene.materials)
        numbers: dict[int, int] = {}
        for number, record in enumerate(
            ai.records(found["meshes"], found["meshes_count"], ai.MESH)
        ):
            made = meshes.read(record, number)
            if made is not None:
                numbers[number] = len(scene.meshes)
                scene.meshes.append(made)
        named = self._nodes(scene, numbers)
        self._lights(scene, named)
        self._animations(named)
        if not (scene.meshes or scene.lights):
            text = "assimp found no mesh and no light; want a 3D file"
            raise InputError(source, text)
        return scene

    def _nodes(self, scene: LegacyScene, numbers: Mapping[int, int]) -> dict[str, list[Node]]:
        """Fill in the tree; its nodes by name, in order of the walk."""
        limits, source = self.resolver.limits, self.resolver.source
        named: dict[str, list[Node]] = defaultdict(list)
        root = int(self.found["root"])
        stack = [(root, scene.roots, 1)] if root else []
        count = 0
        while stack:
            address, into, depth = stack.pop()
            record = ai.view(address, ai.NODE, 1)[0]
            count += 1
            if count > limits.nodes:
                raise InputError(source, f"more than {limits.nodes} nodes")
            name = ai.text(record["name"])
            place = SourceRef(source, f"node {count - 1}")
            if depth > limits.depth:
                raise InputError(place, f"nodes deeper than {limits.depth}")
            matrix = record["transform"].astype(np.float64).T.copy()
            if not np.isfinite(matrix).all():
                self.report.add(
                    Kind.INVALID, "assimp-number", place, name, "its place is no number"
                )
                matrix = np.eye(4)
            node = Node(name, place, None if np.array_equal(matrix, np.eye(4)) else matrix)
            meshes = ai.view(record["meshes"], "u4", int(record["meshes_count"])).tolist()
            node.meshes = [numbers[mesh] for mesh in meshes if mesh in numbers]
            into.append(node)
            named[name].append(node)
            children = ai.view(record["children"], "u8", int(record["children_count"]))
            stack.extend((child, node.children, depth + 1) for child in children[::-1].tolist())
        return named

    def _node(
        self, scene: LegacyScene, named: Mapping[str, list[Node]], name: str, turn: int
    ) -> Node:
        """The ``turn``-th node of a name: assimp ties lights and cameras to nodes by names."""
        nodes = named.get(name) or scene.roots
        if not nodes:
            scene.roots.append(Node(name, SourceRef(self.resolver.source)))
            nodes = scene.roots
        return nodes[min(turn, len(nodes) - 1)]

    def _lights(self, scene: LegacyScene, named: Mapping[str, list[Node]]) -> None:
        turns: dict[str, int] = defaultdict(int)
        records = ai.records(self.found["lights"], self.found["lights_count"], ai.LIGHT)
        for number, record in enumerate(records):
            name = ai.text(record["name"])
            place = SourceRef(self.resolver.source, f"light {number}")
            kind = _KINDS.get(int(record["type"]))
            if kind is None:
                text = "neither point, spot, directional nor ambient; left out"
                self.report.add(Kind.DROPPED, "assimp-light", place, name, text)
                continue
            keys = ("position", "direction", "diffuse", "attenuation", "inner", "outer")
            numbers = [record[key] for key in keys]
            if not all(np.isfinite(values).all() for values in numbers):
                text = "a light with numbers that are none; left out"
                self.report.add(Kind.INVALID, "assimp-number", place, name, text)
                continue
            self._node(scene, named, name, turns[name]).lights.append(len(scene.lights))
            turns[name] += 1
            scene.lights.append(_light(record, name, place, kind))

    def _animations(self, named: Mapping[str, list[Node]]) -> None:
        records = ai.records(self.found["animations"], self.found["animations_count"], ai.ANIMATION)
        if len(records) > 1:
            text = f"{len(records)} animations; the first is kept"
            self.report.add(
                Kind.DROPPED, "assimp-animation", SourceRef(self.resolver.source), "", text
            )
        for record in records[:1]:
            read_animation(record, named, self.resolver.source, self.report)


def _light(
    record: Any,
    name: str,
    place: SourceRef,
    kind: Literal["directional", "point", "spot", "ambient"],
) -> Light:
    full = kind == "spot"
    attenuation = _three(record["attenuation"])
    return Light(
        name,
        place,
        kind,
        position=_three(record["position"]),
        direction=_three(record["direction"]) if kind in ("spot", "directional") else (0, 0, -1),
        ambient=_color(record["ambient"]),
        diffuse=_color(record["diffuse"]),
        specular=_color(record["specular"]),
        attenuation=None if attenuation in _UNSAID else attenuation,
        spot_cutoff=min(math.degrees(float(record["outer"])) / 2.0, 90.0) if full else 180.0,
        spot_inner=min(math.degrees(float(record["inner"])) / 2.0, 90.0) if full else None,
    )


def _three(values: Any) -> Vec3:
    a, b, c = (float(value) for value in values)
    return a, b, c


def _color(values: Any) -> RGB:
    return _three(np.nan_to_num(values, posinf=0.0, neginf=0.0))
