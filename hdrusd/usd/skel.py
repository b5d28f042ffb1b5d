"""UsdSkel: points and normals of what a skeleton or blend shapes move.

All sums are USD's own functions (UsdSkel.SkinningQuery, SkinPoints, SkinNormals,
ApplyBlendShape), linear blending and dual quaternions alike; here is what they are fed
with. A skinned point is in the skeleton's space, so what a skeleton moves is placed where
the skeleton is and not where its own prim is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Tf, Usd, UsdGeom, UsdSkel, Vt

from hdrusd.report import Kind, Report
from hdrusd.usd.findings import prim_finding
from hdrusd.usd.varying import place_varies

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_PREDICATE = Usd.TraverseInstanceProxies()


@dataclass(slots=True)
class Skin:
    """What deforms one gprim: joints of a skeleton, blend shapes, or both."""

    query: UsdSkel.SkinningQuery
    skeleton: UsdSkel.SkeletonQuery
    bones: Usd.Prim  # the skeleton where it stands; the query has that of the prototype
    report: Report
    jointed: bool  # joints move it: its points come out in the skeleton's space
    rigid: bool  # joints move it as a whole
    varies: bool  # pose or shape weights may change in time
    _offsets: tuple[Any, Any] | None = None  # point indices and offsets of the blend shapes

    @property
    def points_vary(self) -> bool:
        """Whether points may change in time, and not only the place of them all."""
        return self.varies and (not self.rigid or bool(self.query.HasBlendShapes()))

    @property
    def moves_place(self) -> bool:
        """Whether the place of all points together may change in time."""
        if not self.jointed:
            return place_varies(self.query.GetPrim())
        return place_varies(self.bones) or (self.rigid and self.varies)

    def place(self, cache: UsdGeom.XformCache) -> Doubles:
        """(4, 4) from what ``points`` gives to the world, row vectors, scene units."""
        if not self.jointed:
            prim = self.query.GetPrim()
            return np.array(cache.GetLocalToWorldTransform(prim), np.float64)
        world = np.array(cache.GetLocalToWorldTransform(self.bones), np.float64)
        if not self.rigid:
            return world
        try:
            time = cache.GetTime()
            moved = self.query.ComputeSkinnedTransform(self._pose(time), time)
        except Tf.ErrorException as problem:
            self._broken(str(problem))
            moved = self.query.GetGeomBindTransform(cache.GetTime())
        return np.array(moved, np.float64) @ world

    def points(self, points: Floats, time: Usd.TimeCode) -> Floats:
        """(n, 3) deformed; in the bind pose, with a finding, where the binding is broken."""
        if self.query.HasBlendShapes():
            points = self._blended(points, time, normals=False)
        if not self.jointed or self.rigid:
            return points
        buffer = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points))
        try:
            done = self.query.ComputeSkinnedPoints(self._pose(time), buffer, time)
        except Tf.ErrorException:
            done = False
        if done:
            return np.array(buffer, np.float32).reshape(-1, 3)
        self._broken("joints, weights and points do not fit")
        bind = np.array(self.query.GetGeomBindTransform(time), np.float64)
        return (points @ bind[:3, :3] + bind[3, :3]).astype(np.float32)

    def normals(
        self, normals: Floats, vertices: Ints, count: int, time: Usd.TimeCode
    ) -> Floats | None:
        """(n, 3) turned with the points; None where they have to be computed from these.

        ``vertices`` (n,): the point that each normal belongs to, of ``count`` points.
        """
        if self.query.HasBlendShapes() and np.array_equal(vertices, np.arange(count)):
            normals = self._blended(normals, time, normals=True)
        if not self.jointed or self.rigid:
            return normals
        try:
            indices, weights = self.query.ComputeVaryingJointInfluences(count, time)
            each = int(self.query.GetNumInfluencesPerComponent())
            indices = np.asarray(indices, np.int32).reshape(count, each)[vertices].ravel()
            weights = np.asarray(weights, np.float32).reshape(count, each)[vertices].ravel()
            buffer = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(normals, np.float32))
            bind = _inverse_transpose(np.array(self.query.GetGeomBindTransform(time))[None])
            done = UsdSkel.SkinNormals(
                self.query.GetSkinningMethod(),
                bind[0],
                self._normal_pose(time),
                Vt.IntArray.FromNumpy(indices),
                Vt.FloatArray.FromNumpy(weights),
                each,
                buffer,
            )
        except (Tf.ErrorException, ValueError):
            return None
        return np.array(buffer, np.float32).reshape(-1, 3) if done else None

    def _pose(self, time: Usd.TimeCode) -> Vt.Matrix4dArray:
        return self.skeleton.ComputeSkinningTransforms(time)

    def _normal_pose(self, time: Usd.TimeCode) -> Vt.Matrix3dArray:
        pose, mapper = self._pose(time), self.query.GetJointMapper()
        if mapper is not None and not mapper.IsNull():  # the gprim has an order of its own
            pose = mapper.RemapTransforms(pose)
        return _inverse_transpose(np.asarray(pose, np.float64).reshape(-1, 4, 4))

    def _blended(self, values: Floats, time: Usd.TimeCode, *, normals: bool) -> Floats:
        """Points, or normals, with the offsets of the blend shapes added."""
        animation = self.skeleton.GetAnimQuery()
        if not animation:
            return values
        weights = animation.ComputeBlendShapeWeights(time)
        mapper = self.query.GetBlendShapeMapper()
        if mapper is not None and not mapper.IsIdentity():
            weights = mapper.Remap(weights)
        shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(self.query.GetPrim()))
        buffer = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, np.float32))
        try:
            parts = shapes.ComputeSubShapeWeights(Vt.FloatArray(weights))
            if normals:
                done = _offset_normals(shapes, parts, buffer)
            else:
                if self._offsets is None:
                    where = shapes.ComputeBlendShapePointIndices()
                    self._offsets = where, shapes.ComputeSubShapePointOffsets()
                done = shapes.ComputeDeformedPoints(*parts, *self._offsets, buffer)
        except Tf.ErrorException:
            done = False
        if done:
            return np.array(buffer, np.float32).reshape(-1, 3)
        self._broken("blend shapes, weights and points do not fit")
        return values

    def _broken(self, text: str) -> None:
        prim = self.query.GetPrim()
        text = f"{text}; shown without"
        prim_finding(self.report, prim, Kind.INVALID, "skel-binding", text)


class Skins:
    """The skins of one stage; each SkelRoot is searched once, when a gprim below it asks."""

    def __init__(self, report: Report) -> None:
        self.report = report
        self._cache = UsdSkel.Cache()
        self._roots: dict[Sdf.Path, dict[Sdf.Path, Skin]] = {}

    def of(self, prim: Usd.Prim) -> Skin | None:
        """What deforms the gprim; None where nothing does."""
        root = prim
        while root and not root.IsA(UsdSkel.Root):
            root = root.GetParent()
        if not root:
            return None
        path = root.GetPath()
        if path not in self._roots:
            self._roots[path] = self._search(UsdSkel.Root(root))
        skin = self._roots[path].get(prim.GetPath())
        if skin is None or prim.IsA(UsdGeom.Mesh) or (skin.rigid and not skin.points_vary):
            return skin
        text = f"{prim.GetTypeName()} follows its joints as a whole or not at all; shown without"
        prim_finding(self.report, prim, Kind.DROPPED, "skel-binding", text)
        return None

    def _search(self, root: UsdSkel.Root) -> dict[Sdf.Path, Skin]:
        self._cache.Populate(root, _PREDICATE)
        found = {}
        for binding in self._cache.ComputeSkelBindings(root, _PREDICATE):
            skeleton = self._cache.GetSkelQuery(binding.GetSkeleton())
            animation = skeleton.GetAnimQuery()
            for query in binding.GetSkinningTargets():
                jointed = bool(query.HasJointInfluences())
                if not (jointed or query.HasBlendShapes()):
                    continue
                varies = bool(animation) and (
                    (jointed and animation.JointTransformsMightBeTimeVarying())
                    or (query.HasBlendShapes() and animation.BlendShapeWeightsMightBeTimeVarying())
                )
                found[query.GetPrim().GetPath()] = Skin(
                    query,
                    skeleton,
                    binding.GetSkeleton().GetPrim(),
                    self.report,
                    jointed=jointed,
                    rigid=jointed and bool(query.IsRigidlyDeformed()),
                    varies=varies,
                )
        return found


def _offset_normals(shapes: UsdSkel.BlendShapeQuery, parts: Any, buffer: Vt.Vec3fArray) -> bool:
    """Add the normal offsets of the shapes and inbetweens in use; those without leave them."""
    for weight, index, part in zip(*parts, strict=True):
        shape, inbetween = shapes.GetBlendShape(index), shapes.GetInbetween(part)
        between = bool(inbetween.GetAttr())
        offsets = inbetween.GetNormalOffsets() if between else shape.GetNormalOffsetsAttr().Get()
        where = shape.GetPointIndicesAttr().Get() or Vt.IntArray()
        if offsets and not UsdSkel.ApplyBlendShape(weight, offsets, where, buffer):
            return False
    return True


def _inverse_transpose(matrices: Doubles) -> Vt.Matrix3dArray:
    """(n, 4, 4) to what turns normals; by cofactors, so that a flat one is no error."""
    m = matrices[:, :3, :3]
    cofactors = np.cross(m[:, [1, 2, 0]], m[:, [2, 0, 1]])
    determinant = np.linalg.det(m)[:, None, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.where(determinant == 0.0, cofactors, cofactors / determinant)
    return Vt.Matrix3dArray.FromNumpy(np.ascontiguousarray(turned))
