"""Writes the street as glTF 2.0: ``street.gltf`` with ``street.bin`` beside it.

The geometry keeps its numbers: a root node turns Z up into Y up. Lights are
KHR_lights_punctual. That extension asks for candela and lux; like most exporters
this one writes the modeller's numbers instead (1, 0.9), which is what
photometry.toml is there to mend. glTF has no LOD and no switch, so it holds what
is seen close by; shared subtrees become separate nodes with shared meshes.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from street_model import UNTURNED, Camera, Light, Material, Mesh, Node
from street_model import Path as Motion

_FLOAT, _USHORT, _UINT = 5126, 5123, 5125
_VERTICES, _INDICES = 34962, 34963
_ASPECT = 16.0 / 9.0


class _Document:
    """The growing JSON and its binary buffer."""

    def __init__(self) -> None:
        self.bytes = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.meshes: list[dict[str, Any]] = []
        self.nodes: list[dict[str, Any]] = []
        self.materials: list[dict[str, Any]] = []
        self.images: list[str] = []
        self.lights: list[dict[str, Any]] = []
        self.cameras: list[dict[str, Any]] = []
        self.moving: list[tuple[int, Motion]] = []
        self._mesh_ids: dict[tuple[int, ...], int] = {}
        self._material_ids: dict[str, int] = {}
        self._light_ids: dict[int, int] = {}
        self._primitives: dict[int, dict[str, Any]] = {}

    def accessor(
        self,
        values: np.ndarray,
        component: int,
        kind: str,
        target: int | None,
        bounds: bool = False,
    ) -> int:
        """Append an array to the buffer; returns its accessor. ``bounds`` adds min and max."""
        dtype = {_FLOAT: "<f4", _USHORT: "<u2", _UINT: "<u4"}[component]
        data = np.ascontiguousarray(values, dtype=dtype)
        self.bytes.extend(b"\0" * (-len(self.bytes) % 4))
        view: dict[str, Any] = {
            "buffer": 0,
            "byteOffset": len(self.bytes),
            "byteLength": data.nbytes,
        }
        if target is not None:
            view["target"] = target
        self.bytes.extend(data.tobytes())
        self.views.append(view)
        entry: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": component,
            "count": len(data),
            "type": kind,
        }
        if bounds:
            entry["min"] = np.atleast_1d(data.min(axis=0)).tolist()
            entry["max"] = np.atleast_1d(data.max(axis=0)).tolist()
        self.accessors.append(entry)
        return len(self.accessors) - 1

    def material(self, material: Material) -> int:
        """The index of a material, written when first asked for."""
        if material.name in self._material_ids:
            return self._material_ids[material.name]
        # Blinn-Phong exponent to roughness, as alpha = roughness^2 = sqrt(2 / (n + 2)).
        shine = max(material.specular) > 0.0
        roughness = (2.0 / (material.shininess + 2.0)) ** 0.25 if shine else 1.0
        pbr: dict[str, Any] = {
            "baseColorFactor": [*material.diffuse, 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": round(roughness, 4),
        }
        entry: dict[str, Any] = {"name": material.name, "pbrMetallicRoughness": pbr}
        texture = None
        if material.texture is not None:
            if material.texture not in self.images:
                self.images.append(material.texture)
            texture = {"index": self.images.index(material.texture)}
            pbr["baseColorTexture"] = texture
        if any(material.emission):
            entry["emissiveFactor"] = list(material.emission)
            if texture is not None:
                entry["emissiveTexture"] = texture
        if material.two_sided:
            entry["doubleSided"] = True
        self.materials.append(entry)
        self._material_ids[material.name] = len(self.materials) - 1
        return len(self.materials) - 1

    def _primitive(self, mesh: Mesh) -> dict[str, Any]:
        if id(mesh) not in self._primitives:
            cut = mesh.quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
            index = np.concatenate((cut, mesh.tris)).reshape(-1)
            component = _USHORT if len(mesh.points) < 65535 else _UINT
            attributes = {
                "POSITION": self.accessor(mesh.points, _FLOAT, "VEC3", _VERTICES, bounds=True),
                "NORMAL": self.accessor(mesh.normals, _FLOAT, "VEC3", _VERTICES),
            }
            if mesh.material.texture is not None:
                uvs = np.stack((mesh.uvs[:, 0], 1.0 - mesh.uvs[:, 1]), axis=1)  # t = 0 at the top
                attributes["TEXCOORD_0"] = self.accessor(uvs, _FLOAT, "VEC2", _VERTICES)
            self._primitives[id(mesh)] = {
                "attributes": attributes,
                "indices": self.accessor(index, component, "SCALAR", _INDICES),
                "material": self.material(mesh.material),
            }
        return self._primitives[id(mesh)]

    def mesh(self, name: str, meshes: list[Mesh]) -> int:
        """The index of a mesh with a primitive for each of ``meshes``."""
        key = tuple(id(mesh) for mesh in meshes)
        if key not in self._mesh_ids:
            self.meshes.append({"name": name, "primitives": [self._primitive(m) for m in meshes]})
            self._mesh_ids[key] = len(self.meshes) - 1
        return self._mesh_ids[key]

    def light(self, light: Light) -> int:
        """The index of a light, written when first asked for."""
        if id(light) not in self._light_ids:
            self.lights.append(_light(light))
            self._light_ids[id(light)] = len(self.lights) - 1
        return self._light_ids[id(light)]

    def camera(self, name: str, camera: Camera) -> int:
        """The index of a new camera."""
        lens = {
            "yfov": math.radians(camera.fov),
            "aspectRatio": _ASPECT,
            "znear": 0.1,
            "zfar": 500.0,
        }
        self.cameras.append({"name": name, "type": "perspective", "perspective": lens})
        return len(self.cameras) - 1

    def node(self, node: Node) -> int:
        """Append a node and all below it; returns its index."""
        entry: dict[str, Any] = {"name": node.name}
        self.nodes.append(entry)
        number = len(self.nodes) - 1
        if any(node.translation):
            entry["translation"] = list(node.translation)
        if node.rotation != UNTURNED:
            entry["rotation"] = list(node.rotation)
        if node.path is not None:
            entry["translation"] = node.path.positions[0].tolist()
            entry["rotation"] = list(node.path.rotation)
            self.moving.append((number, node.path))
        if node.meshes:
            entry["mesh"] = self.mesh(node.name, node.meshes)
        if node.light is not None:
            entry["extensions"] = {"KHR_lights_punctual": {"light": self.light(node.light)}}
        if node.camera is not None:
            entry["camera"] = self.camera(node.name, node.camera)
        children = [self.node(child) for child in node.shown()]
        if children:
            entry["children"] = children
        return number

    def animation(self) -> dict[str, Any]:
        """One animation that moves every node with a path."""
        channels, samplers = [], []
        for number, path in self.moving:
            times = self.accessor(path.times, _FLOAT, "SCALAR", None, bounds=True)
            values = self.accessor(path.positions, _FLOAT, "VEC3", None)
            samplers.append({"input": times, "output": values, "interpolation": "LINEAR"})
            target = {"node": number, "path": "translation"}
            channels.append({"sampler": len(samplers) - 1, "target": target})
        return {"name": "Traffic", "channels": channels, "samplers": samplers}


def _light(light: Light) -> dict[str, Any]:
    """A KHR light. A spot's inner angle is set so that its flux is near the OpenGL spot's.

    cos^e inside the cut-off c gives 2 pi (1 - cos(c)^(e + 1)) / (e + 1) times the
    candela; KHR's square of a ramp in cos between the cones gives
    2 pi (1 - 2/3 cos(inner) - 1/3 cos(c)).
    """
    bright = max(light.colour) if light.kind == "directional" else 1.0
    entry: dict[str, Any] = {
        "name": light.name,
        "type": light.kind,
        "color": [round(c / bright, 4) for c in light.colour],
        "intensity": bright,
    }
    if light.kind == "spot":
        outer, e = math.cos(math.radians(light.cutoff)), light.exponent + 1.0
        inner = (1.0 - outer / 3.0 - (1.0 - outer**e) / e) * 1.5
        angle = min(math.acos(min(inner, 1.0)), 0.98 * math.radians(light.cutoff))
        entry["spot"] = {
            "innerConeAngle": round(angle, 6),
            "outerConeAngle": round(math.radians(light.cutoff), 6),
        }
    return entry


def write_gltf(root: Node, path: Path) -> None:
    """Write ``root`` to ``path`` and its buffer beside it, with textures in ``textures/``."""
    document = _Document()
    scene = document.node(root)
    # Z up to Y up: x, y, z become x, z, -y; columns, exactly, so that nothing is rounded.
    up = [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1]
    document.nodes.append({"name": "ZUpToYUp", "matrix": up, "children": [scene]})
    animation = document.animation()
    content = {
        "asset": {"version": "2.0", "generator": "hdrusd samples/street"},
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": document.lights}},
        "scene": 0,
        "scenes": [{"name": "Street", "nodes": [len(document.nodes) - 1]}],
        "nodes": document.nodes,
        "meshes": document.meshes,
        "materials": document.materials,
        "textures": [{"source": i, "sampler": 0} for i in range(len(document.images))],
        "images": [{"uri": f"textures/{name}"} for name in document.images],
        "samplers": [{"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497}],
        "cameras": document.cameras,
        "animations": [animation],
        "accessors": document.accessors,
        "bufferViews": document.views,
        "buffers": [{"uri": path.with_suffix(".bin").name, "byteLength": len(document.bytes)}],
    }
    path.with_suffix(".bin").write_bytes(document.bytes)
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
