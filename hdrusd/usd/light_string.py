"""Strings of lamps: one PointInstancer with one lamp as its prototype.

A lamp of a string is itself seen. One that shines to all sides is a ball at its luminance
I / (pi r^2). One with a beam has no one luminance (docs/decisions/0018): beside its light there
is a disk of the ball's area, the glass, at the luminance on the axis, seen from the front. With a
photometric file there is no glass. Lamps of a string cast no shadows: each would want a shadow
map, and most stand inside the housings that the database has for them.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, Vt

from hdrusd.legacy import scene as legacy
from hdrusd.photometry.light import PhotometricLight
from hdrusd.units import TEXTURE_GAMMA, sphere_luminance
from hdrusd.usd.light import write_light
from hdrusd.usd.material import Surface, bind, write_photometric
from hdrusd.usd.transform import aim, is_flat, rigid, uniform_scale

Doubles = npt.NDArray[np.float64]

#: Sides of the glass; it has the area of the circle.
_SIDES = 16

_DOWN = np.array([0.0, 0.0, -1.0])


def write_light_string(
    stage: Usd.Stage,
    path: Sdf.Path,
    source: legacy.Light,
    light: PhotometricLight,
    world: Gf.Matrix4d,
    meters_per_unit: float,
    right: legacy.Vec3 | None = None,
) -> Usd.Prim:
    """Define the instancer for the ``positions`` of ``source``, each of which is ``light``.

    ``world``: from the space of the node, the parent of ``path``, to that of the stage.
    ``right``: where +X goes, C = 0 of a photometric file.
    """
    assert source.positions is not None
    points, ways = source.positions, source.directions
    instancer = UsdGeom.PointInstancer.Define(stage, path)
    scale, even = uniform_scale(world)
    way = np.array(source.direction, np.float64)
    if not even:
        # Lamps are not squeezed by the space above them, which is undone; places are.
        scale, goal = 1.0, rigid(world)
        matrix = np.array(world * goal.GetInverse(), np.float64)
        points = points @ matrix[:3, :3] + matrix[3, :3]
        ways = None if ways is None else _unit(ways @ matrix[:3, :3])
        way = _unit(way[None] @ matrix[:3, :3])[0]
        if is_flat(world):
            instancer.SetResetXformStack(True)
        else:
            goal = goal * world.GetInverse()
        instancer.AddTransformOp().Set(goal)
    # Single precision about the middle of the string.
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    if middle.any():
        instancer.AddTranslateOp().Set(Gf.Vec3d(*middle.tolist()))
    lamp = path.AppendChild("Lamp")
    beam = light.kind == "spot" or bool(light.profile)
    if beam:
        form = UsdGeom.Xform.Define(stage, lamp)
        turn = aim((way[0], way[1], way[2]), right) if ways is None else None
        if turn is not None:
            form.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(turn))
        prim = write_light(stage, lamp.AppendChild("Light"), light, scale=scale * meters_per_unit)
        if not light.profile:
            radius = light.radius / (scale * meters_per_unit)
            _write_glass(stage, lamp.AppendChild("Glass"), source, light, radius)
    else:
        prim = write_light(stage, lamp, light, scale=scale * meters_per_unit)
        UsdLux.SphereLight(prim).CreateTreatAsPointAttr(False)
    UsdLux.ShadowAPI.Apply(prim).CreateShadowEnableAttr(False)
    instancer.CreatePrototypesRel().SetTargets([lamp])
    instancer.CreateProtoIndicesAttr(Vt.IntArray(len(points)))
    local = np.ascontiguousarray(points - middle, np.float32)
    instancer.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(local))
    if beam and ways is not None:
        turns = np.ascontiguousarray(_turns(ways, right), np.float32)
        instancer.CreateOrientationsfAttr(Vt.QuatfArray.FromNumpy(turns))
    reach = math.sqrt(3.0) * light.radius / (scale * meters_per_unit)
    box = np.array([local.min(axis=0) - reach, local.max(axis=0) + reach], np.float32)
    instancer.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(box))
    return instancer.GetPrim()


def _write_glass(
    stage: Usd.Stage,
    path: Sdf.Path,
    source: legacy.Light,
    light: PhotometricLight,
    radius: float,
) -> None:
    """A disk that faces -Z, as the light does, at the luminance on the axis."""
    angle = np.arange(_SIDES) * (-2.0 * np.pi / _SIDES)  # seen from -Z against the clock
    step = 2.0 * math.pi / _SIDES
    size = radius * math.sqrt(step / math.sin(step))
    corners = np.zeros((_SIDES, 3), np.float32)
    corners[:, 0], corners[:, 1] = size * np.cos(angle), size * np.sin(angle)
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(corners))
    mesh.CreateFaceVertexCountsAttr([_SIDES])
    mesh.CreateFaceVertexIndicesAttr(list(range(_SIDES)))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDoubleSidedAttr(False)
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(mesh.GetPointsAttr().Get()))
    luminance = sphere_luminance(light.intensity, light.radius)
    red, green, blue = light.chromaticity
    glow = path.AppendChild("Glow")
    material = legacy.Material("Glow", source.source, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    surface = Surface(
        diffuse=(0.0, 0.0, 0.0),
        gamma=TEXTURE_GAMMA,
        emission=(luminance * red, luminance * green, luminance * blue),
        luminance=luminance,
        replaces_reflection=True,
        provenance=light.provenance,
        rule=light.rule,
        source=light.source,
    )
    write_photometric(stage, glow, material, surface)
    bind(mesh.GetPrim(), glow)


def _unit(vectors: Doubles) -> Doubles:
    """Vectors of length 1, (n, 3); -Z for those without a direction."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    there = length > 0.0
    return np.where(there, vectors / np.where(there, length, 1.0), _DOWN)


def _turns(ways: Doubles, right: legacy.Vec3 | None) -> Doubles:
    """Quaternions (n, 4), imaginary part first, that turn -Z into unit vectors (n, 3).

    By the shortest turn, then about the vector so that +X goes to ``right`` as nearly as it can.
    """
    turns = np.zeros((len(ways), 4))
    turns[:, :3], turns[:, 3] = np.cross(_DOWN, ways), 1.0 + ways @ _DOWN
    turns[turns[:, 3] < 1e-12] = (1.0, 0.0, 0.0, 0.0)  # straight up: half a turn about X
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    if right is None:
        return turns
    x, y, z, w = turns.T
    side = np.stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)])
    target = np.array(right, np.float64)
    half = 0.5 * np.arctan2(np.einsum("ij,ij->i", np.cross(side.T, target), ways), target @ side)
    twist, cosine = ways * np.sin(half)[:, None], np.cos(half)
    real = cosine * w - np.einsum("ij,ij->i", twist, turns[:, :3])
    imaginary = cosine[:, None] * turns[:, :3] + w[:, None] * twist
    imaginary += np.cross(twist, turns[:, :3])
    return np.column_stack([imaginary, real])
