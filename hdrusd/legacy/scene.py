"""LegacyScene: what a legacy 3D file says, in its own numbers.

Readers fill these records and interpret nothing: colours are dimensionless as
OpenGL has them, angles are degrees, lengths are in units of ``unit_m`` metres.
Only what the source does not say is None. There is no photometry here but what
the format itself states (glTF candela and lux).

Frames and matrices: row vectors, as USD has them (``p' = p M``), so the
translation is row 3. Texture coordinates have t = 0 at the BOTTOM of the image
(OpenGL, USD); glTF's reader flips.
"""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef

RGB = tuple[float, float, float]
Four = tuple[float, float, float, float]
Vec3 = tuple[float, float, float]
Floats = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int32]
Interpolation = Literal["vertex", "faceVarying", "uniform", "constant"]
Wrap = Literal["repeat", "clamp", "mirror", "black"]


@dataclass(frozen=True, slots=True)
class Image:
    """A picture that a texture refers to.

    Exactly one of ``path`` (resolved, allowed, existing), ``data`` (the bytes of
    an encoded file: PNG, JPEG, DDS) and ``pixels`` (uint8, (h, w, 1 to 4), row 0
    at the TOP) is set, or none of them when the image is missing or refused.
    """

    name: str  # the reference as written, or a name made from the place
    source: SourceRef
    path: Path | None = None
    data: bytes | None = None
    pixels: npt.NDArray[np.uint8] | None = None

    @property
    def missing(self) -> bool:
        """True when there is nothing to show; the finding was made by the reader."""
        return self.path is None and self.data is None and self.pixels is None

    def key(self) -> Hashable:
        """Equal of two records of one picture: its file, else what it holds; of a missing one its
        name and where that is looked for.
        """
        if self.path is not None:
            return self.path
        if self.data is not None:
            return self.data
        if self.pixels is not None:
            held = hashlib.sha256(self.pixels.tobytes())
            return self.pixels.shape, held.digest()
        return self.name, self.source.file.parent


@dataclass(frozen=True, slots=True)
class UVTransform:
    """scale, then rotate (degrees, counter-clockwise), then translate: UsdTransform2d's order."""

    scale: tuple[float, float] = (1.0, 1.0)
    rotation: float = 0.0
    translation: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Texture:
    """One use of an image in a material."""

    image: Image
    uv_set: str = "st"  # key into Mesh.uvs
    wrap_s: Wrap = "repeat"
    wrap_t: Wrap = "repeat"
    transform: UVTransform | None = None
    mode: str = "MODULATE"  # TexEnv mode; others become findings
    channel: Literal["rgb", "r", "g", "b", "a"] = "rgb"  # of maps of one number: which is read
    # Of data: value = scale * texel + bias. A colour is multiplied by its factor instead.
    scale: Four = (1.0, 1.0, 1.0, 1.0)
    bias: Four = (0.0, 0.0, 0.0, 0.0)
    linear: bool = False  # of light: integer texels are values and no codes for a screen


@dataclass(frozen=True, slots=True)
class Material:
    """The OpenGL record; a PBR record beside it where the format has one, never instead.

    ``defaults`` names the fields that the source left out and the format's
    default filled in.
    """

    name: str
    source: SourceRef
    ambient: RGB = (0.2, 0.2, 0.2)
    diffuse: RGB = (0.8, 0.8, 0.8)
    specular: RGB = (0.0, 0.0, 0.0)
    emission: RGB = (0.0, 0.0, 0.0)
    shininess: float = 0.0  # OpenGL / MTL exponent
    alpha: float = 1.0
    diffuse_map: Texture | None = None
    emission_map: Texture | None = None
    opacity_map: Texture | None = None
    specular_map: Texture | None = None  # of a material with "glossiness"
    # Data, whose texels are taken as they are; their values stand in place of the numbers in
    # ``pbr``, so these maps but for normals and occlusion belong to a material that has it.
    metallic_map: Texture | None = None
    roughness_map: Texture | None = None
    clearcoat_map: Texture | None = None
    clearcoat_roughness_map: Texture | None = None
    occlusion_map: Texture | None = None  # share of the ambient light that arrives
    normal_map: Texture | None = None  # tangent space: x to where s grows, y to where t grows
    alpha_mode: Literal["opaque", "mask", "blend"] = "opaque"
    alpha_cutoff: float = 0.5
    two_sided: bool = False
    lit: bool = True  # False: GL_LIGHTING off, KHR_materials_unlit
    emission_cd_m2: bool = False  # emission is in cd/m2 already (glTF says so)
    # As the source has them: "metallic" or else "glossiness", which stands for a specular
    # reflectance of its own; "roughness", "ior", "clearcoat", "clearcoat_roughness".
    pbr: Mapping[str, float] | None = None
    defaults: frozenset[str] = frozenset()
    extras: Mapping[str, Any] = field(default_factory=dict)

    def maps(self) -> dict[str, Texture]:
        """Its textures by the names of their fields, in the order of the fields."""
        found = {name: getattr(self, name) for name in MAPS}
        return {name: texture for name, texture in found.items() if texture is not None}


#: The fields of a material that hold a texture.
MAPS = tuple(field.name for field in fields(Material) if field.name.endswith("_map"))

#: Those whose texels are data: no colour, and no opacity, which belongs to its colour.
DATA_MAPS = (
    *("metallic_map", "roughness_map", "clearcoat_map", "clearcoat_roughness_map"),
    *("occlusion_map", "normal_map"),
)


#: TexEnv modes in which the texture stands in the place of the material's colour.
COVERING = ("REPLACE", "DECAL")


def environment_note(mode: str) -> str:
    """What becomes of a TexEnv mode other than MODULATE, for a finding."""
    if mode in COVERING:
        return f"texture environment {mode}: in place of the material's colour; shown with D = 1"
    return f"texture environment {mode}; kept as a note, shown as MODULATE"


#: Of formats that do not say which way green points; half of all programs turn it over.
GREEN_UP = "normal map: green is taken to point up in the picture, as in OpenGL and glTF"


def normal_texels(strength: float = 1.0) -> tuple[Four, Four]:
    """Scale and bias that make directions of the texels 0 to 1 of a normal map.

    ``strength``: a factor on x and y.
    """
    s = float(strength)
    return (2.0 * s, 2.0 * s, 2.0, 1.0), (-s, -s, -1.0, 0.0)


@dataclass(frozen=True, slots=True)
class Subset:
    """The faces of a mesh (indices into face_counts) that wear one material."""

    material: int
    faces: Ints


@dataclass(frozen=True, slots=True)
class Mesh:
    """Polygons. Arrays: float32 / int32, C order, already checked against one another."""

    name: str
    source: SourceRef
    points: Floats  # (n, 3), source units
    face_counts: Ints  # (f,), each >= 3
    face_indices: Ints  # (sum of counts,), each in [0, n)
    normals: Floats | None = None  # (., 3)
    normals_interpolation: Interpolation = "vertex"
    uvs: Mapping[str, tuple[Floats, Interpolation]] = field(default_factory=dict)  # (., 2), t up
    colors: Floats | None = None  # (., 4), linear as OpenGL multiplies them
    colors_interpolation: Interpolation = "vertex"
    material: int | None = None  # index into LegacyScene.materials, for faces in no subset
    subsets: tuple[Subset, ...] = ()
    two_sided: bool = True
    left_handed: bool = False
    # Of a skinned mesh: k influences a point, (n, k); indices into ``Skin.joints``, weights of
    # sum 1 (``legacy.skinning.influences`` makes them so). What k lacks is index 0, weight 0.
    joint_indices: Ints | None = None
    joint_weights: Floats | None = None

    def face_materials(self) -> Ints:
        """(f,) the material that each face wears; -1: none."""
        worn = np.full(len(self.face_counts), -1 if self.material is None else self.material)
        for subset in self.subsets:
            worn[subset.faces] = subset.material
        return worn.astype(np.int32)

    def wears(self, material: int) -> npt.NDArray[np.bool_]:
        """(f,) which faces wear a material."""
        return np.asarray(self.face_materials() == material)


@dataclass(frozen=True, slots=True)
class Light:
    """A light as the file has it. It sits at its node's origin looking along the node's -Z
    unless ``position`` / ``direction`` (node space) say otherwise.
    """

    name: str
    source: SourceRef
    kind: Literal["point", "spot", "directional", "ambient"]
    position: Vec3 = (0.0, 0.0, 0.0)
    direction: Vec3 = (0.0, 0.0, -1.0)  # the way the light travels
    ambient: RGB = (0.0, 0.0, 0.0)
    diffuse: RGB = (1.0, 1.0, 1.0)  # for glTF: the linear colour
    specular: RGB = (1.0, 1.0, 1.0)
    attenuation: tuple[float, float, float] | None = None  # constant, linear, quadratic
    spot_cutoff: float = 180.0  # half-angle, degrees; 180 is no spot
    spot_inner: float | None = None  # half-angle of the full part, degrees (glTF)
    spot_exponent: float = 0.0
    range: float | None = None  # m; kept as metadata, never applied
    candela: float | None = None  # where the format has it; times diffuse, per channel
    lux: float | None = None  # likewise, for directional
    enabled: bool = True
    extras: Mapping[str, Any] = field(default_factory=dict)
    # Of a string: the same lamp, which is itself seen, at each place and, where it has a beam and
    # they differ, each its own way. ``position`` is not used, nor ``direction`` beside these.
    positions: npt.NDArray[np.float64] | None = None  # (n, 3), source units, node space
    directions: npt.NDArray[np.float64] | None = None  # (n, 3) unit vectors, node space
    radius: float | None = None  # of the lamp, source units, where the file says

    @property
    def lamps(self) -> int:
        """How many lamps it is."""
        return 1 if self.positions is None else len(self.positions)


@dataclass(frozen=True, slots=True)
class Camera:
    """A perspective or orthographic camera at the node's origin, looking along -Z, +Y up."""

    name: str
    source: SourceRef
    kind: Literal["perspective", "orthographic"] = "perspective"
    fov_y: float = 45.0  # degrees, vertical, perspective
    height: float = 1.0  # full height in source units, orthographic
    aspect: float | None = None  # width / height
    near: float = 0.1
    far: float = 1000.0


@dataclass(frozen=True, slots=True)
class Channel:
    """Sampled values over time. times: (k,) seconds, rising; values: (k, 3) or (k, 4) float64.

    ``rotation`` is quaternions (x, y, z, w). Curves that USD cannot hold (cubic
    spline) are resampled by the reader. Between samples a rotation turns on the
    shortest arc and the rest is linear; ``step`` holds the earlier value.
    """

    path: Literal["translation", "rotation", "scale"]
    times: npt.NDArray[np.float64]
    values: npt.NDArray[np.float64]
    interpolation: Literal["linear", "step"] = "linear"
    loop: Literal["none", "loop", "swing"] = "none"


@dataclass(frozen=True, slots=True)
class TRS:
    """pivot-free transform: scale, then rotate (quaternion x, y, z, w), then translate."""

    translation: Vec3 = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    scale: Vec3 = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Skin:
    """What bends the meshes of a node: joints, which are nodes of the tree.

    A point p of a mesh comes to stand at p sum_i w_i B_i J_i in the world, with the inverse
    bind matrix B_i and the world matrix J_i of joint i now (row vectors): the place of the
    node that has the mesh does not count.
    """

    name: str
    source: SourceRef
    joints: tuple[Node, ...]  # the very objects of the tree (identity), parents in any order
    inverse_binds: npt.NDArray[np.float64]  # (j, 4, 4), mesh space -> joint space at bind time


@dataclass(slots=True)
class Node:
    """One node of the tree. ``transform`` is a TRS, a (4, 4) float64 row-vector matrix or None.

    With ``animation`` the TRS gives the paths that no channel drives. The same object below
    several parents, or several times below one, is one thing in several places.
    """

    name: str
    source: SourceRef
    transform: TRS | npt.NDArray[np.float64] | None = None
    children: list[Node] = field(default_factory=list)
    meshes: list[int] = field(default_factory=list)  # indices into LegacyScene.meshes
    lights: list[int] = field(default_factory=list)
    cameras: list[int] = field(default_factory=list)
    animation: tuple[Channel, ...] = ()
    skin: int | None = None  # index into LegacyScene.skins: bends those meshes that have weights
    visible: bool = True
    kind: Literal["group", "lod", "switch", "sequence", "billboard"] = "group"
    #: For kind "lod": (min, max) distance of each child; for "switch": whether each child is on.
    lod_ranges: tuple[tuple[float, float], ...] = ()
    lod_on_screen: bool = False  # ranges are the inverse of sizes on the screen, in pixels
    switch_on: tuple[bool, ...] = ()
    #: All masks of a switch that has several, by name; ``switch_on`` is the current one.
    switch_masks: tuple[tuple[str, tuple[bool, ...]], ...] = ()
    extras: Mapping[str, Any] = field(default_factory=dict)


@dataclass(slots=True)
class LegacyScene:
    """A whole file. Tables are shared: a mesh used by 300 nodes stands here once."""

    source: Path
    format: str  # "3ds", "gltf", "obj", "osg"
    roots: list[Node] = field(default_factory=list)
    meshes: list[Mesh] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    cameras: list[Camera] = field(default_factory=list)
    skins: list[Skin] = field(default_factory=list)
    up: Literal["Y", "Z"] = "Y"
    unit_m: float = 1.0  # metres per source unit, as the format states or assumes
    unit_stated: bool = True  # by the file or its format; False: ``unit_m`` is only taken
    up_stated: bool = True
    ambient: RGB | None = None  # light model ambient, dimensionless, where the file sets it
    generator: str = ""

    def counts(self) -> dict[str, int]:
        """How many of each there are: for reports and ``hdrusd info``."""
        images = {
            texture.image.key()
            for material in self.materials
            for texture in material.maps().values()
        }
        points = sum(light.lamps for light in self.lights if light.positions is not None)
        found = {
            "meshes": len(self.meshes),
            "triangles": int(sum(int((m.face_counts - 2).sum()) for m in self.meshes)),
            "materials": len(self.materials),
            "textures": len(images),
            "lights": sum(light.positions is None for light in self.lights),
            "cameras": len(self.cameras),
        }
        return found | {"light_points": points} if points else found
