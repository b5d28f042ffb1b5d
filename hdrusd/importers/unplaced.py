"""What a file defines and no node has: it is in no place, so a stage cannot show it."""

from __future__ import annotations

from collections.abc import Sequence

from hdrusd.errors import SourceRef
from hdrusd.legacy.scene import LegacyScene, Node
from hdrusd.report import Kind, Report

#: Names that a finding gives.
_NAMED = 3


def note_unplaced(scene: LegacyScene, report: Report) -> None:
    """A finding for the meshes, one for the lights and one for the cameras that no node has."""
    meshes: set[int] = set()
    lights: set[int] = set()
    cameras: set[int] = set()
    seen: set[int] = set()
    stack: list[Node] = list(scene.roots)
    while stack:
        node = stack.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        meshes.update(node.meshes)
        lights.update(node.lights)
        cameras.update(node.cameras)
        stack.extend(node.children)
    lost = [mesh for index, mesh in enumerate(scene.meshes) if index not in meshes]
    triangles = sum(int((mesh.face_counts - 2).sum()) for mesh in lost)
    _note(scene, report, f"meshes, of {triangles} triangles,", [mesh.name for mesh in lost])
    away = [light.name for index, light in enumerate(scene.lights) if index not in lights]
    _note(scene, report, "lights", away)
    away = [camera.name for index, camera in enumerate(scene.cameras) if index not in cameras]
    _note(scene, report, "cameras", away)


def _note(scene: LegacyScene, report: Report, what: str, lost: Sequence[str]) -> None:
    if not lost:
        return
    names = ", ".join(dict.fromkeys(name[:60] for name in lost[:_NAMED]))
    more = ", ..." if len(lost) > _NAMED else ""
    text = f"{len(lost)} {what} that no node has: {names}{more}; they have no place, not written"
    report.add(Kind.DROPPED, "unplaced", SourceRef(scene.source), "", text)
