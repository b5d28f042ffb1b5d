"""RenderScene: one moment of a stage as flat arrays, world space, metres, cd, lux, cd/m2.

The only thing that ``usd`` and ``gpu`` both know. Matrices act on row vectors
(``p' = p M``), as in USD; positions are float64 until the eye is subtracted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

RGB = tuple[float, float, float]
Doubles = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]

#: One light a row. A local light has ``w`` = 1 and stands at ``position``; a
#: distant one has ``w`` = 0 and ``position`` is the unit vector towards it.
LIGHT = np.dtype(
    [
        ("position", "f8", 3),  # m, or unit vector towards a distant light
        ("w", "f8"),
        ("intensity", "f8", 3),  # per channel: cd on the axis; lux for a distant light
        ("radius", "f8"),  # m; the inverse square is not followed inside the lamp
        ("axis", "f8", 3),  # unit vector, the way the light travels
        ("exponent", "f8"),  # UsdLux focus, OpenGL spot exponent
        ("inner", "f8"),  # rad: full up to here
        ("outer", "f8"),  # rad: nothing beyond; more than pi is no cone
    ]
)

#: Outer cone angle of a light without a cone.
NO_CONE = 4.0


@dataclass(frozen=True, slots=True)
class TextureRef:
    """One image as the shader wants it.

    ``decode`` says what the file's numbers mean: "gamma" for 8-bit pictures that
    become T^gamma, "linear" for values taken as they are (reflectance maps, HDR,
    data), "auto" for gamma where an 8-bit file has three colours (UsdUVTexture).
    """

    file: str  # a path, or ``package.usdz[inside.png]``
    decode: Literal["gamma", "linear", "auto"]
    wrap_s: str = "repeat"  # repeat, clamp, mirror, black
    wrap_t: str = "repeat"


@dataclass(frozen=True, slots=True)
class TextureUse:
    """A texture in a material: value = scale * texel + bias, in the texture's order."""

    texture: TextureRef
    uv_set: str = "st"
    matrix: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)  # u' = a u + b v + c; v' = ...
    scale: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    bias: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    channel: int = -1  # 0 to 3: this channel alone; -1: rgb
    fallback: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class Material:
    """What shader 1 needs of a surface. Reflectances in [0, 1], emission in cd/m2."""

    diffuse: RGB = (0.18, 0.18, 0.18)
    diffuse_map: TextureUse | None = None  # replaces ``diffuse``
    vertex_color: str = ""  # primvar that multiplies the diffuse reflectance
    specular: RGB = (0.0, 0.0, 0.0)
    shininess: float = 0.0
    metallic: float = 0.0  # moves the diffuse reflectance into the specular one
    emission: RGB = (0.0, 0.0, 0.0)
    emission_map: TextureUse | None = None  # replaces ``emission``
    opacity: float = 1.0
    opacity_map: TextureUse | None = None
    opacity_threshold: float = 0.0

    def uv_sets(self) -> list[str]:
        """The texture coordinate sets in use, in slot order without repeats."""
        uses = (self.diffuse_map, self.emission_map, self.opacity_map)
        return list(dict.fromkeys(use.uv_set for use in uses if use is not None))


@dataclass(frozen=True, slots=True, eq=False)
class Geometry:
    """Triangles of one mesh and one material, unindexed attributes already expanded.

    All arrays have one row a corner: (3 t, .) float32, in the mesh's own space
    and scene units.
    """

    key: str  # stable over time: what is uploaded once is found again by it
    version: int  # changes when the arrays do
    points: Floats  # (3 t, 3)
    normals: Floats  # (3 t, 3), not necessarily unit length
    uvs: Mapping[str, Floats]  # each (3 t, 2), t up
    colors: Mapping[str, Floats]  # each (3 t, 3)


@dataclass(frozen=True, slots=True, eq=False)
class Draw:
    """One geometry drawn ``len(transforms)`` times with one material."""

    geometry: Geometry
    material: int
    transforms: Doubles  # (k, 4, 4), to world metres, row vectors
    double_sided: bool = False


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole. ``window`` is left, right, bottom, top at distance 1 (or in m, orthographic)."""

    eye: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m
    right: tuple[float, float, float] = (1.0, 0.0, 0.0)
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    back: tuple[float, float, float] = (0.0, 0.0, 1.0)  # the camera looks along -back
    window: tuple[float, float, float, float] = (-0.5, 0.5, -0.5, 0.5)
    near: float = 0.1  # m
    far: float = 1000.0
    orthographic: bool = False
    exposure_scale: float | None = None  # UsdGeomCamera exposure:*, where authored
    name: str = ""
    framing: bool = False  # made by us to show a stage that has no camera

    def projection(self) -> Doubles:
        """(4, 4) row-vector matrix from view space (m) to OpenGL clip space."""
        left, right, bottom, top = self.window
        near, far = self.near, self.far
        m = np.zeros((4, 4))
        if self.orthographic:
            m[0, 0], m[1, 1], m[2, 2] = 2 / (right - left), 2 / (top - bottom), -2 / (far - near)
            m[3] = (
                -(right + left) / (right - left),
                -(top + bottom) / (top - bottom),
                -(far + near) / (far - near),
                1.0,
            )
            return m
        m[0, 0], m[1, 1] = 2 / (right - left), 2 / (top - bottom)
        m[2] = (
            (right + left) / (right - left),
            (top + bottom) / (top - bottom),
            -(far + near) / (far - near),
            -1.0,
        )
        m[3, 2] = -2 * far * near / (far - near)
        return m

    def rotation(self) -> Doubles:
        """(3, 3) row-vector matrix from world directions to view directions."""
        return np.array([self.right, self.up, self.back], np.float64).T

    def world_to_view(self) -> Doubles:
        """(4, 4) row-vector matrix from world metres to view space."""
        m = np.eye(4)
        m[:3, :3] = self.rotation()
        m[3, :3] = -np.asarray(self.eye) @ m[:3, :3]
        return m


@dataclass(frozen=True, slots=True)
class RenderScene:
    """Everything one frame needs."""

    lights: npt.NDArray[np.void] = field(default_factory=lambda: np.zeros(0, LIGHT))
    draws: tuple[Draw, ...] = ()
    materials: tuple[Material, ...] = ()
    ambient: RGB = (0.0, 0.0, 0.0)  # lux, unobstructed, from everywhere alike
    background: RGB = (0.0, 0.0, 0.0)  # cd/m2 seen where there is no surface
    camera: Camera = field(default_factory=Camera)
    time: float = 0.0  # time code

    def triangles(self) -> int:
        """Triangles drawn, instances counted."""
        return sum(len(d.geometry.points) // 3 * len(d.transforms) for d in self.draws)


@dataclass(frozen=True, slots=True)
class ImageData:
    """A decoded image: (h, w, 1 to 4) uint8, float16 or float32, row 0 at the top."""

    pixels: npt.NDArray[np.generic]
    path: Path | None = None
    integers: bool = False  # the file has integer codes: a picture, not light
