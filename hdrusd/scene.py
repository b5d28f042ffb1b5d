"""RenderScene: one moment of a stage as flat arrays, world space, metres, cd, lux, cd/m2.

The only thing that ``usd`` and ``gpu`` both know. Matrices act on row vectors
(``p' = p M``), as in USD; positions are float64 until the eye is subtracted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

RGB = tuple[float, float, float]
Doubles = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]

#: Shapes of a local light. A POINT shines as one, whatever its radius; the others are
#: area lights: Lambertian emitters of which every point counts.
POINT, SPHERE, DISK, RECT, CYLINDER = range(5)

#: One light a row; ``light_rows`` makes them with the values that change nothing. A
#: local light has ``w`` = 1 and stands at ``position``; a distant one has ``w`` = 0 and
#: ``position`` is the unit vector towards it.
LIGHT = np.dtype(
    [
        ("position", "f8", 3),  # m, or unit vector towards a distant light
        ("w", "f8"),
        # Per channel: cd on the axis, lux on a facing plane for a distant light. Of a
        # cylinder: cd square to it. With a profile: the factor on its candela.
        ("intensity", "f8", 3),
        ("radius", "f8"),  # m; the inverse square is not followed inside the lamp
        ("axis", "f8", 3),  # unit vector, the way the light travels (local -Z)
        ("exponent", "f8"),  # UsdLux focus, OpenGL spot exponent
        ("inner", "f8"),  # rad: full up to here
        ("outer", "f8"),  # rad: nothing beyond; more than pi is no cone
        # The light's local +X and +Y in the world. Area lights: half the sides of a
        # RECT, two conjugate radii of a DISK, half the length of a CYLINDER (x), in m.
        # Others: unit vectors; x is C = 0 of a profile, y is C = 90.
        ("x", "f8", 3),
        ("y", "f8", 3),
        ("shape", "i4"),
        ("profile", "i4"),  # number in RenderScene.profiles, or -1
        ("diffuse", "f8"),  # factors of UsdLux on what it adds to the two reflections
        ("specular", "f8"),
        ("angle", "f8"),  # rad: half the angle that a distant light fills
        ("link", "i4"),  # 0: shines on everything; n: on draws with bit n - 1 in ``links``
        ("shadow", "i4"),  # 1: casts shadows
        ("shadow_link", "i4"),  # 0: everything casts; n: draws with bit n - 1 set
        ("key", "i8"),  # the same lamp over time has the same; told apart within a scene
        ("sp", "f8"),  # scotopic over photopic light of the lamp; 0: as its colour has it
    ]
)

#: Outer cone angle of a light without a cone.
NO_CONE = 4.0


def light_rows(count: int) -> npt.NDArray[np.void]:
    """``count`` dark point lights without cone, profile or links, that cast shadows."""
    rows = np.zeros(count, LIGHT)
    rows["w"] = rows["diffuse"] = rows["specular"] = 1.0
    rows["inner"] = rows["outer"] = NO_CONE
    rows["axis"], rows["x"], rows["y"] = (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    rows["profile"], rows["shadow"] = -1, 1
    rows["key"] = np.arange(count)
    return rows


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """Candela of a luminaire over directions, on an even grid, (m, n) float32.

    Rows are planes, columns the angles within one. ``planes`` and ``angles``: first and
    last of each, rad. Outside them it is dark; a type C whose planes go all the way
    round repeats its first plane as its last. Directions by type as in
    photometry/profile.py.
    """

    candela: Floats
    planes: tuple[float, float]
    angles: tuple[float, float]
    type: Literal["A", "B", "C"] = "C"
    source: str = ""


@dataclass(frozen=True, slots=True)
class Sky:
    """A dome with a picture: cd/m2 of a direction = ``factor`` times the texel there."""

    texture: TextureRef
    factor: RGB
    rotation: tuple[float, ...]  # nine: the dome's X, Y, Z axes in the world, row by row
    visible: bool = False  # seen where there is no surface
    shadow: bool = True  # whether the suns in its picture cast shadows


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

    def leaves_shares(self) -> bool:
        """Whether scale and bias lead colours of 0 to 1 to what is no share any more."""
        ends = [
            *self.bias[:3],
            *(s + b for s, b in zip(self.scale[:3], self.bias[:3], strict=True)),
        ]
        return min(ends) < 0.0 or max(ends) > 1.0 + 1e-6


@dataclass(frozen=True, slots=True)
class Material:
    """What shader 1 needs of a surface. Reflectances in [0, 1], emission in cd/m2.

    A map replaces the value of its name. ``model`` is the highlight: "blinn" with
    ``shininess``, for legacy materials, or "ggx" with ``roughness``, for UsdPreviewSurface.
    """

    model: Literal["blinn", "ggx"] = "blinn"
    diffuse: RGB = (0.18, 0.18, 0.18)
    diffuse_map: TextureUse | None = None
    vertex_color: str = ""  # primvar that multiplies the diffuse reflectance
    # The next two are settled by ``usd`` for each gprim; ``gpu`` need not know them.
    vertex_absent: RGB = (1.0, 1.0, 1.0)  # in place of that primvar on a mesh without it
    vertex_opacity: str = ""  # primvar that replaces the opacity on a mesh that has it
    specular: RGB = (0.0, 0.0, 0.0)  # at normal incidence
    specular_map: TextureUse | None = None
    shininess: float = 0.0
    roughness: float = 0.5  # its square is the width of the GGX lobe
    roughness_map: TextureUse | None = None
    metallic: float = 0.0  # moves the diffuse reflectance into the specular one
    metallic_map: TextureUse | None = None
    clearcoat: float = 0.0  # weight of a second lobe of 4 % at normal incidence
    clearcoat_map: TextureUse | None = None
    clearcoat_roughness: float = 0.01
    clearcoat_roughness_map: TextureUse | None = None
    emission: RGB = (0.0, 0.0, 0.0)
    emission_map: TextureUse | None = None
    emission_sp: float = 0.0  # S/P of the emission, as LIGHT.sp
    opacity: float = 1.0
    opacity_map: TextureUse | None = None
    opacity_threshold: float = 0.0
    blend: bool = False  # lets through 1 - opacity of what is behind
    presence: bool = False  # its opacity takes the highlight away too (opacityMode)
    occlusion: float = 1.0  # share of the ambient light that arrives
    occlusion_map: TextureUse | None = None
    normal_map: TextureUse | None = None  # tangent space, after scale and bias

    @property
    def least_texel(self) -> float:
        """The least opacity that is there, of a map: textures hold 11 bits.

        What stands at the threshold is there (UsdPreviewSurface, glTF), also where a half float
        rounds it down, by less than 2^-11. A threshold above 1 lets nothing through.
        """
        threshold = self.opacity_threshold
        return threshold * (1.0 - 2.0**-11) if threshold <= 1.0 else threshold

    def maps(self) -> dict[str, TextureUse]:
        """The maps in use by the names of their fields, in the order of the fields."""
        found = {f.name: getattr(self, f.name) for f in fields(self) if f.name.endswith("_map")}
        return {name: use for name, use in found.items() if use is not None}

    def uv_sets(self) -> list[str]:
        """The texture coordinate sets in use, in slot order without repeats."""
        return list(dict.fromkeys(use.uv_set for use in self.maps().values()))


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
    moving: bool = False  # its points or its places may change from frame to frame
    links: int = 0  # bits of the light links that name it (LIGHT.link)
    shadow_links: int = 0  # bits of the shadow links that name it, in any number
    casts: bool = True  # whether it casts shadows


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
    profiles: tuple[Profile, ...] = ()
    skies: tuple[Sky, ...] = ()  # beside ``ambient``
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
    halvings: int = 0  # times its sides are to be halved, once linear: a device has limits
    #: Of a UDIM texture: images by column and row of the unit square that they cover, (0, 0)
    #: being tile 1001. Then ``pixels`` is empty.
    tiles: Mapping[tuple[int, int], ImageData] | None = None
    dropped: str = ""  # what else the file has, in words
