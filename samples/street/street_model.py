"""The street as plain records: what both writers read.

Everything is metres, Z up, the street running along +Y; node-local where a node
has a transform. Matrices do not appear: a node has a translation and a unit
quaternion (x, y, z, w), which both formats can hold exactly as they stand.
Texture coordinates have t = 0 at the bottom of the image (OpenGL).

Coordinates are rounded here, once, to what six significant digits of ASCII can
hold, so that the two files carry the same numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]
Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

UNTURNED: Quat = (0.0, 0.0, 0.0, 1.0)


def turn(axis: Literal["x", "y", "z"], degrees: float) -> Quat:
    """The quaternion of a right-handed turn about one axis."""
    half = math.radians(degrees) / 2.0
    x, y, z = (math.sin(half) if axis == a else 0.0 for a in "xyz")
    return (x, y, z, math.cos(half))


def compose(a: Quat, b: Quat) -> Quat:
    """The turn ``b`` followed by the turn ``a``, both about the axes of the outer space."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate(q: Quat, v: Vec3) -> Vec3:
    """``v`` turned by the unit quaternion ``q``: v + 2 w (u x v) + 2 u x (u x v)."""
    u = np.array(q[:3])
    once = np.cross(u, v)
    x, y, z = np.asarray(v) + 2.0 * (q[3] * once + np.cross(u, once))
    return (float(x), float(y), float(z))


@dataclass(frozen=True, slots=True)
class Material:
    """An OpenGL material with at most one texture (GL_MODULATE), in daylight colours."""

    name: str
    diffuse: Vec3 = (1.0, 1.0, 1.0)
    texture: str | None = None  # file name in textures/
    specular: Vec3 = (0.0, 0.0, 0.0)
    shininess: float = 0.0  # OpenGL exponent, 0 to 128
    emission: Vec3 = (0.0, 0.0, 0.0)  # multiplied by the texture, as OpenGL does
    two_sided: bool = False
    tile: float = 2.0  # m that one repeat of the texture covers


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Quadrangles and triangles of one material; one normal and one uv a vertex."""

    name: str
    material: Material
    points: Array  # (n, 3)
    normals: Array  # (n, 3), unit
    uvs: Array  # (n, 2)
    quads: Index  # (q, 4), counter-clockwise from outside
    tris: Index  # (t, 3)

    @property
    def triangles(self) -> int:
        """How many triangles the mesh is when each quadrangle is cut in two."""
        return 2 * len(self.quads) + len(self.tris)


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """A light at its node's origin that shines along the node's -Z, in OpenGL's terms."""

    name: str
    kind: Literal["point", "spot", "directional"]
    colour: Vec3
    cutoff: float = 180.0  # half-angle, degrees
    exponent: float = 0.0
    attenuation: Vec3 = (1.0, 0.0, 0.0)  # constant, linear (1/m), quadratic (1/m2)


@dataclass(frozen=True, slots=True)
class Camera:
    """A perspective camera at its node's origin, looking along -Z with +Y up."""

    fov: float  # degrees, vertical


@dataclass(frozen=True, slots=True)
class Path:
    """Motion of a node in its parent's space, linear between keys, played in a loop."""

    times: Array  # (k,) s, rising from 0
    positions: Array  # (k, 3)
    rotation: Quat = UNTURNED


@dataclass(slots=True, eq=False)
class Node:
    """A node of the tree. One node object below two parents is one shared subtree.

    ``kind`` says how the OSG file writes it: a Group, MatrixTransform ("matrix"),
    PositionAttitudeTransform ("pat"), LOD (children from fine to coarse, seen up
    to ``lod_ends`` metres) or Switch (``switch_on`` for each child).
    """

    name: str
    kind: Literal["group", "matrix", "pat", "lod", "switch"] = "group"
    translation: Vec3 = (0.0, 0.0, 0.0)
    rotation: Quat = UNTURNED
    children: list[Node] = field(default_factory=list)
    meshes: list[Mesh] = field(default_factory=list)
    light: Light | None = None
    camera: Camera | None = None
    path: Path | None = None
    lod_ends: tuple[float, ...] = ()
    switch_on: tuple[bool, ...] = ()

    def shown(self) -> list[Node]:
        """The children that are drawn close by: the finest of a LOD, the "on" of a Switch."""
        if self.kind == "lod":
            return self.children[:1]
        if self.kind == "switch":
            return [c for c, on in zip(self.children, self.switch_on, strict=True) if on]
        return self.children


def instances(root: Node) -> Iterator[Node]:
    """Each node that is drawn, a shared one once for every time it is drawn."""
    stack = [root]
    while stack:
        node = stack.pop()
        yield node
        stack.extend(reversed(node.shown()))


def count_triangles(root: Node) -> int:
    """How many triangles a frame draws, shared subtrees counted every time."""
    return sum(mesh.triangles for node in instances(root) for mesh in node.meshes)
