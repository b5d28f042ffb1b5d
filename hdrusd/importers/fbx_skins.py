"""Skins of FBX: clusters of points, each held by a bone.

FBX SDK, ``FbxSkin`` and ``FbxCluster``. Of dual quaternions the linear blend is kept.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hdrusd.importers.fbx_document import Document
from hdrusd.importers.fbx_held import Held
from hdrusd.legacy.scene import Floats, Ints, Node, Skin
from hdrusd.legacy.skinning import influences
from hdrusd.report import Kind

#: Bones that hold one point, at most; the strongest are kept.
_MOST = 8
_LINEAR_METHODS = (0, 1)  # linear, rigid


def matrix(columns: tuple[tuple[float, float, float], ...]) -> npt.NDArray[np.float64]:
    """A matrix of ufbx, four columns, as (4, 4) for row vectors."""
    made = np.eye(4)
    made[:, :3] = np.array([tuple(column) for column in columns], np.float64)
    return made


@dataclass(slots=True)
class Weights:
    """Which bones hold the points of each mesh, and how much."""

    document: Document
    _skins: dict[int, list[Held]] = field(default_factory=dict)  # mesh to its clusters

    def clusters(self, mesh: Held) -> list[Held]:
        """The clusters with a bone of a mesh's first skin, in the order of the joints."""
        number = int(mesh.typed_id)
        if number not in self._skins:
            self._skins[number] = self._clusters(mesh)
        return self._skins[number]

    def _clusters(self, mesh: Held) -> list[Held]:
        if not len(mesh.skin_deformers):
            return []
        place, name = self.document.ref("mesh", mesh.name), mesh.name
        skin = mesh.skin_deformers[0]
        if len(mesh.skin_deformers) > 1:
            text = f"{len(mesh.skin_deformers)} skins on a mesh; the first bends it"
            self.document.note(Kind.DROPPED, "fbx-skin", place, name, text)
        if int(skin.skinning_method) not in _LINEAR_METHODS:
            text = "skinned by dual quaternions; the matrices are blended"
            self.document.note(Kind.REPLACED, "fbx-skin", place, name, text)
        found = [cluster for cluster in skin.clusters if cluster.bone_node is not None]
        good = [c for c in found if np.isfinite(matrix(c.geometry_to_bone)).all()]
        if len(good) < len(skin.clusters):
            text = f"{len(skin.clusters) - len(good)} clusters without a usable bone; dropped"
            self.document.note(Kind.INVALID, "fbx-skin", place, name, text)
        return good

    def of(self, mesh: Held, points: int) -> tuple[Ints | None, Floats | None]:
        """Joints and weights of each point, (points, k), sums of 1; None for no skin.

        A weight of 0 in all would take a point to the origin.
        """
        clusters = self.clusters(mesh)
        if not clusters:
            return None, None
        held = [c.vertices.integers() for c in clusters]
        strength = [c.weights.rows(1) for c in clusters]
        joint = np.repeat(np.arange(len(clusters)), [len(h) for h in held])
        point, weight = np.concatenate(held), np.concatenate(strength)
        good = (point >= 0) & (point < points) & (weight >= 0.0) & (weight < np.inf)
        broken = int((~good).sum())
        good &= weight > 0.0
        joint, point, weight = joint[good], point[good], weight[good]
        order = np.lexsort((-weight, point))
        joint, point, weight = joint[order], point[order], weight[order]
        first = np.searchsorted(point, np.arange(points))
        rank = np.arange(len(point)) - first[point]
        width = min(int(rank.max(initial=0)) + 1, _MOST)
        if int(rank.max(initial=0)) >= _MOST:
            text = f"points held by {int(rank.max()) + 1} bones; the strongest {_MOST} are kept"
            place = self.document.ref("mesh", mesh.name)
            self.document.note(Kind.DROPPED, "fbx-skin", place, mesh.name, text)
        strongest = rank < width
        rows, columns = point[strongest], rank[strongest]
        joints = np.zeros((points, width), np.int32)
        weights = np.zeros((points, width), np.float64)
        joints[rows, columns] = joint[strongest]
        weights[rows, columns] = weight[strongest]
        found = influences(joints, weights, len(clusters))
        if broken or found.free:
            text = f"{broken} influences on points that are not there, negative or not finite; "
            text += f"{found.free} of {points} points without any are on joint 0"
            place = self.document.ref("mesh", mesh.name)
            self.document.note(Kind.INVALID, "skin-weights", place, mesh.name, text)
        return found.indices, found.weights


def read_skin(
    document: Document, weights: Weights, mesh: Held, nodes: Mapping[int, Node]
) -> Skin | None:
    """The skin of a mesh; ``nodes`` by ufbx's number of them. None where it has none."""
    clusters = weights.clusters(mesh)
    if not clusters:
        return None
    skin = mesh.skin_deformers[0]
    name = skin.name or mesh.name or f"skin_{mesh.typed_id}"
    return Skin(
        name,
        document.ref("skin", name),
        tuple(nodes[int(cluster.bone_node.typed_id)] for cluster in clusters),
        np.array([matrix(cluster.geometry_to_bone) for cluster in clusters]),
    )
