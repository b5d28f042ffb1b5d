"""Skins of a LegacyScene as UsdSkel: SkelRoot, Skeleton, SkelAnimation, bindings.

A legacy joint is a node, and where the skinned node stands does not count; in UsdSkel the
joints are names in a Skeleton, and points come out in its space. So below each skinned node
stands a SkelRoot with its meshes and a Skeleton, moved to where the lowest node above all
joints and the skinned node is. The Skeleton's joints are all nodes from there down to the
joints, each with its own transform and animation. It is below the skinned node, and not above
all of them, because a SkelRoot's extent hides all that is in it from bounding boxes, and what
hides or switches the node must hide the skin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from hdrusd.legacy.scene import LegacyScene, Mesh, Node, Skin
from hdrusd.report import Kind, Report
from hdrusd.usd.names import Taken, unique
from hdrusd.usd.transform import first_matrix, matrices, pose, samples

#: Times at which the box of a skinned mesh is looked at.
_BOX_TIMES = 64

#: Joints times time codes of one animation: each joint has a value at the keys of all.
_MOST_POSES = 4_000_000

#: A matrix with a smaller share of its largest axis has no inverse.
_FLAT = 1e-9

Doubles = npt.NDArray[np.float64]


@dataclass(slots=True)
class Bones:
    """The joints of one skin as seen from the lowest node above them and the skinned node."""

    skin: Skin
    top: Node | None  # None: the root of the stage
    chain: list[Node]  # from the skinned node up to below ``top``
    nodes: list[Node] = field(default_factory=list)  # parents first
    parents: list[int] = field(default_factory=list)  # -1: ``top``
    tokens: list[str] = field(default_factory=list)
    bound: list[int] = field(default_factory=list)  # of each joint of the skin, its number here

    def add(self, node: Node, parent: int, taken: dict[int, Taken]) -> int:
        """One more joint; its number."""
        name = unique(node.name, taken.setdefault(parent, {}))
        self.nodes.append(node)
        self.parents.append(parent)
        self.tokens.append(name if parent < 0 else f"{self.tokens[parent]}/{name}")
        return len(self.nodes) - 1


class Skeletons:
    """The skins of one scene. ``rate``: codes a second; ``end``: of the stage, s."""

    def __init__(self, scene: LegacyScene, report: Report, rate: float, end: float) -> None:
        self.scene = scene
        self.report = report
        self.rate, self.end = rate, end
        self.bones: dict[int, Bones] = {}  # by the id of the skinned node
        #: Ids of nodes that stand in no prototype of their own: the skin counts on their place.
        self.pinned: set[int] = set()
        self._written: dict[tuple[int, int], Sdf.Path] = {}
        self._above, order = _first_parents(scene.roots if scene.skins else ())
        for node in order:
            if node.skin is not None and any(map(self.bends, node.meshes)):
                self._plan(node)
        #: Ids of joints on which nothing hangs: the Skeleton has them.
        self.bare = _bare(order, {id(n) for bones in self.bones.values() for n in bones.nodes})

    def bends(self, mesh: int) -> bool:
        """Whether a mesh has weights."""
        return self.scene.meshes[mesh].joint_weights is not None

    # -- what has to be written ------------------------------------------------------------

    def _plan(self, node: Node) -> None:
        skin = self.scene.skins[node.skin or 0]
        lines = [self._line(joint) for joint in skin.joints]
        own = self._line(node)
        assert own is not None
        if not lines or any(line is None for line in lines):
            self._stays(node, "a joint that is no node of the scene")
            return
        # What is above every joint, but no joint itself.
        common = set(map(id, own))
        for line in lines:
            assert line is not None
            common &= {id(above) for above in line[1:]}
        common -= set(map(id, skin.joints))
        top = next((above for above in own if id(above) in common), None)
        chain = _below(own, top)
        bones = Bones(skin, top, chain)
        place = np.eye(4)
        for each in chain:
            place = place @ first_matrix(each)
        if not _invertible(place):
            self._stays(node, "its node has no volume")
            return
        taken: dict[int, Taken] = {}
        numbers: dict[int, int] = {}
        seen: set[int] = set()
        for line in lines:
            assert line is not None
            number = -1
            for each in reversed(_below(line, top)):
                if id(each) not in numbers:
                    numbers[id(each)] = bones.add(each, number, taken)
                parent, number = number, numbers[id(each)]
            if number in seen:  # named twice, with another bind pose each
                number = bones.add(line[0], parent, taken)
            seen.add(number)
            bones.bound.append(number)
        self.bones[id(node)] = bones
        self.pinned |= {id(each) for each in (*chain, *bones.nodes)}

    def _line(self, node: Node) -> list[Node] | None:
        """A node and all above it; None where it is not in the scene."""
        if id(node) not in self._above:
            return None
        line = [node]
        while (above := self._above[id(line[-1])]) is not None:
            line.append(above)
        return line

    def _stays(self, node: Node, why: str) -> None:
        text = f"{why}; the mesh stays in its bind pose"
        self.report.add(Kind.INVALID, "skin-bind", node.source, node.name, text)

    # -- writing -----------------------------------------------------------------------------

    def write(self, stage: Usd.Stage, path: Sdf.Path, node: Node) -> None:
        """Define the SkelRoot of a skinned node, with its Skeleton; meshes go below it."""
        bones = self.bones[id(node)]
        root = UsdSkel.Root.Define(stage, path)
        if bones.chain:
            self._move_to_top(root, bones)
        skeleton = path.AppendChild("Skeleton")
        key = id(bones.top), node.skin or 0
        if key in self._written:
            prim = UsdSkel.Skeleton.Define(stage, skeleton).GetPrim()
            prim.GetReferences().AddInternalReference(self._written[key])
            return
        self._written[key] = skeleton
        self._skeleton(UsdSkel.Skeleton.Define(stage, skeleton), bones)

    def _move_to_top(self, root: UsdSkel.Root, bones: Bones) -> None:
        codes = self._codes(bones.chain)
        place: Doubles = np.broadcast_to(np.eye(4), (max(len(codes), 1), 4, 4))
        for each in bones.chain:
            own = matrices(each, codes, self.rate, self.end) if len(codes) else first_matrix(each)
            place = place @ own
        if (place == np.eye(4)).all():
            return
        op = root.AddTransformOp()
        if not len(codes):
            op.Set(Gf.Matrix4d(np.linalg.inv(place[0])))
            return
        for code, matrix in zip(codes.tolist(), place, strict=True):
            if _invertible(matrix):
                op.Set(Gf.Matrix4d(np.linalg.inv(matrix)), code)

    def _skeleton(self, skeleton: UsdSkel.Skeleton, bones: Bones) -> None:
        local = [first_matrix(node) for node in bones.nodes]
        skeleton.CreateJointsAttr(bones.tokens)
        skeleton.CreateRestTransformsAttr(_matrices(local))
        binds = _in_skeleton(bones, np.array(local)[:, None])[:, 0]
        for number, inverse in zip(bones.bound, bones.skin.inverse_binds, strict=True):
            if _invertible(inverse):
                binds[number] = np.linalg.inv(inverse)
            else:
                text = f"the bind matrix of {bones.tokens[number]} has no inverse; its pose is used"
                skin = bones.skin
                self.report.add(Kind.INVALID, "skin-bind", skin.source, skin.name, text)
        skeleton.CreateBindTransformsAttr(_matrices(binds))
        skeleton.CreatePurposeAttr(UsdGeom.Tokens.guide)
        UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
        moving = [number for number, node in enumerate(bones.nodes) if node.animation]
        codes = self._codes([bones.nodes[number] for number in moving])
        if not len(codes):
            return
        if len(codes) * len(moving) > _MOST_POSES:
            most = max(_MOST_POSES // len(moving), 2)
            text = f"{len(codes)} different times of {len(moving)} joints; resampled at {most}"
            skin = bones.skin
            self.report.add(Kind.REPLACED, "skin-animation", skin.source, skin.name, text)
            codes = np.linspace(codes[0], codes[-1], most)
        path = skeleton.GetPath().AppendChild("Animation")
        animation = UsdSkel.Animation.Define(skeleton.GetPrim().GetStage(), path)
        # What stands still has its rest transform, in double precision.
        animation.CreateJointsAttr([bones.tokens[number] for number in moving])
        poses = [pose(bones.nodes[number], codes, self.rate, self.end) for number in moving]
        places, turns, scales = (np.stack(part, axis=1) for part in zip(*poses, strict=True))
        translations = animation.CreateTranslationsAttr()
        rotations = animation.CreateRotationsAttr()
        sizes = animation.CreateScalesAttr()
        for number, code in enumerate(codes.tolist()):
            translations.Set(Vt.Vec3fArray.FromNumpy(places[number].astype(np.float32)), code)
            # FromNumpy of quaternions takes x y z w, as they lie in memory.
            rotations.Set(Vt.QuatfArray.FromNumpy(turns[number].astype(np.float32)), code)
            sizes.Set(Vt.Vec3hArray.FromNumpy(_half(scales[number])), code)
        binding = UsdSkel.BindingAPI(skeleton.GetPrim())
        binding.CreateAnimationSourceRel().SetTargets([path])

    def _codes(self, nodes: Sequence[Node]) -> Doubles:
        """The time codes of all keys of some nodes; none where nothing moves."""
        keys = [
            samples(channel, self.rate, self.end)[0]
            for node in nodes
            for channel in node.animation
            if len(channel.times)
        ]
        return np.unique(np.concatenate(keys)) if keys else np.zeros(0)

    def bind(self, mesh: Usd.Prim, record: Mesh, root: Sdf.Path, node: Node) -> None:
        """Bind a mesh below the SkelRoot ``root`` to its Skeleton, and say how far it reaches."""
        bones = self.bones[id(node)]
        assert record.joint_indices is not None
        assert record.joint_weights is not None
        binding = UsdSkel.BindingAPI.Apply(mesh)
        binding.CreateSkeletonRel().SetTargets([root.AppendChild("Skeleton")])
        binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
        indices = np.array(bones.bound, np.int32)[record.joint_indices]
        each = indices.shape[1]
        flat = np.ascontiguousarray(indices.ravel())
        binding.CreateJointIndicesPrimvar(False, each).Set(Vt.IntArray.FromNumpy(flat))
        weights = np.ascontiguousarray(record.joint_weights.ravel(), np.float32)
        binding.CreateJointWeightsPrimvar(False, each).Set(Vt.FloatArray.FromNumpy(weights))
        low, high = self._box(bones, record, indices)
        boundable = UsdSkel.Root(mesh.GetStage().GetPrimAtPath(root))
        known = boundable.GetExtentAttr().Get()
        if known:
            low, high = np.minimum(low, known[0]), np.maximum(high, known[1])
        boundable.CreateExtentAttr([Gf.Vec3f(*low.tolist()), Gf.Vec3f(*high.tolist())])

    def _box(
        self, bones: Bones, mesh: Mesh, indices: npt.NDArray[np.int32]
    ) -> tuple[Doubles, Doubles]:
        """A box that holds the skinned points: a point lies between where its joints take it."""
        codes = self._codes(bones.nodes)
        if len(codes) > _BOX_TIMES:
            codes = codes[np.linspace(0, len(codes) - 1, _BOX_TIMES).astype(int)]
        codes = codes if len(codes) else np.zeros(1)
        local = np.stack([matrices(node, codes, self.rate, self.end) for node in bones.nodes])
        now = _in_skeleton(bones, local)
        inverse = dict(zip(bones.bound, bones.skin.inverse_binds, strict=True))
        corners, weights = [], mesh.joint_weights
        assert weights is not None
        low = np.full((len(bones.nodes), 3), np.inf)
        high = -low
        for joint, share in zip(indices.T, weights.T, strict=True):
            held = share > 0.0
            np.minimum.at(low, joint[held], mesh.points[held])
            np.maximum.at(high, joint[held], mesh.points[held])
        picks = np.indices((2, 2, 2)).reshape(3, 8).T
        for number in np.flatnonzero(low[:, 0] <= high[:, 0]).tolist():
            box = np.append(np.where(picks, high[number], low[number]), np.ones((8, 1)), axis=1)
            corners.append((box @ (inverse[number] @ now[number])).reshape(-1, 4)[:, :3])
        every = np.concatenate(corners)
        every = every[np.isfinite(every).all(axis=1)]
        if not len(every):
            return mesh.points.min(axis=0).astype(float), mesh.points.max(axis=0).astype(float)
        limit = float(np.finfo(np.float32).max)
        every = np.clip(every, -limit, limit)
        return every.min(axis=0), every.max(axis=0)


def _first_parents(roots: Sequence[Node]) -> tuple[dict[int, Node | None], list[Node]]:
    """The node above each, by id, where it is first met; all nodes, each once, parents first."""
    above: dict[int, Node | None] = {}
    order: list[Node] = []
    stack: list[tuple[Node, Node | None]] = [(root, None) for root in reversed(roots)]
    while stack:
        node, parent = stack.pop()
        if id(node) in above:
            continue
        above[id(node)] = parent
        order.append(node)
        stack += [(child, node) for child in reversed(node.children)]
    return above, order


def _below(line: list[Node], top: Node | None) -> list[Node]:
    """The part of a line, from a node upwards, that is below ``top``."""
    return line[: next((i for i, node in enumerate(line) if node is top), len(line))]


def _bare(order: Sequence[Node], joints: set[int]) -> set[int]:
    """The ids of joints with nothing in or below them but such joints."""
    bare: set[int] = set()
    for node in reversed(order):
        empty = not (node.meshes or node.lights or node.cameras or node.extras)
        alone = empty and node.kind == "group" and id(node) in joints
        if alone and all(id(child) in bare for child in node.children):
            bare.add(id(node))
    return bare


def _in_skeleton(bones: Bones, local: Doubles) -> Doubles:
    """(j, t, 4, 4) from each joint to the space of the skeleton. ``local``: to its parent."""
    made = np.array(local, np.float64)
    for number, parent in enumerate(bones.parents):
        if parent >= 0:
            made[number] = made[number] @ made[parent]
    return made


def _invertible(matrix: Doubles) -> bool:
    if not np.isfinite(matrix).all():
        return False
    values = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    return bool(values[-1] > _FLAT * values[0])


def _matrices(values: Sequence[Doubles] | Doubles) -> Vt.Matrix4dArray:
    return Vt.Matrix4dArray.FromNumpy(np.ascontiguousarray(np.array(values, np.float64)))


def _half(values: Doubles) -> npt.NDArray[np.float16]:
    """UsdSkel holds scales in half precision: 1 is exact, others to 1 in 2000."""
    limit = float(np.finfo(np.float16).max)
    return np.ascontiguousarray(np.clip(values, -limit, limit), np.float16)
