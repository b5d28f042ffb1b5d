"""One LegacyScene made a part of another."""

from __future__ import annotations

from dataclasses import replace

from hdrusd.legacy.scene import LegacyScene, Light, Mesh, Node, Subset


def merge(scene: LegacyScene, part: LegacyScene) -> list[Node]:
    """Add the tables of ``part`` to those of ``scene``; its roots, which are put nowhere yet.

    ``part`` is used up: its nodes are changed. Its ambient light is taken where ``scene`` has
    none; axes and units are left as they are.
    """
    meshes, lights = len(scene.meshes), len(scene.lights)
    cameras, skins = len(scene.cameras), len(scene.skins)
    scene.meshes += [_moved(mesh, len(scene.materials)) for mesh in part.meshes]
    scene.materials += part.materials
    scene.lights += part.lights
    scene.cameras += part.cameras
    scene.skins += part.skins
    if scene.ambient is None:
        scene.ambient = part.ambient
    seen: set[int] = set()
    stack = list(part.roots)
    while stack:
        node = stack.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        node.meshes = [meshes + mesh for mesh in node.meshes]
        node.lights = [lights + light for light in node.lights]
        node.cameras = [cameras + camera for camera in node.cameras]
        node.skin = None if node.skin is None else skins + node.skin
        stack += node.children
    return part.roots


def rescaled(light: Light, factor: float) -> Light:
    """A light of a part whose unit is ``factor`` units of the whole, which its node scales by.

    OpenGL's attenuation is in no node's space, but by distances of the scene. The place and the
    size of a lamp are in its node's, and stay.
    """
    if light.attenuation is None:
        return light
    k0, k1, k2 = light.attenuation
    return replace(light, attenuation=(k0, k1 / factor, k2 / factor**2))


def _moved(mesh: Mesh, materials: int) -> Mesh:
    """A mesh whose materials stand behind so many others."""
    return replace(
        mesh,
        material=None if mesh.material is None else mesh.material + materials,
        subsets=tuple(Subset(part.material + materials, part.faces) for part in mesh.subsets),
    )
