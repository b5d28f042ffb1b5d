"""What a file defines and no node has: it is in no place, so a stage cannot show it."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from hdrusd.errors import SourceRef
from hdrusd.legacy.scene import Camera, LegacyScene, Light, Mesh, Node
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
    _note(scene, report, f"meshes, of {triangles} triangles,", scene.meshes, meshes)
    _note(scene, report, "lights", scene.lights, lights)
    _note(scene, report, "cameras", scene.cameras, cameras)


def _note(
    scene: LegacyScene,
    report: Report,
    what: str,
    table: Sequence[Mesh] | Sequence[Light] | Sequence[Camera],
    placed: Collection[int],
) -> None:
    lost = [thing for index, thing in enumerate(table) if index not in placed]
    if not lost:
        return
    names = ", ".join(dict.fromkeys(thing.name[:60] for thing in lost[:_NAMED]))
    more = ", ..." if len(lost) > _NAMED else ""
    text = f"{len(lost)} {what} that no node has: {names}{more}; they have no place, not written"
    report.add(Kind.DROPPED, "unplaced", SourceRef(scene.source), "", text)
