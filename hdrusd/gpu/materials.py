"""A material as gbuffer.frag takes it: its variant, its uniforms, its textures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from hdrusd.gpu.source import Define
from hdrusd.gpu.textures import TextureCache
from hdrusd.gpu.uniforms import floats
from hdrusd.scene import Material, TextureRef, TextureUse

#: Texture coordinate sets that reach the shader.
UV_SETS = 4

#: Fields that a texture may give, and whether they are colours.
_FIELDS = {
    "diffuse": True,
    "specular": True,
    "emission": True,
    "normal": True,
    "metallic": False,
    "roughness": False,
    "clearcoat": False,
    "clearcoat_roughness": False,
    "opacity": False,
    "occlusion": False,
}

#: Where a field's uniform has another name: "normal" is the vertices'.
_UNIFORM = {"normal": "bump"}

#: What uniforms mostly are, and how GLSL says it: then they are no uniforms (gbuffer.frag).
_USUAL = {
    "diffuse": (0.0, "vec3(0.0)"),  # with a texture
    "diffuse_scale": (1.0, "vec3(1.0)"),
    "emission": (0.0, "vec3(0.0)"),
    "metallic": (0.0, "0.0"),
    "occlusion": (1.0, "1.0"),
}

#: Of texture coordinates to themselves.
_IDENTITY = np.eye(2, 3)


@dataclass(frozen=True, slots=True)
class MaterialInputs:
    """``defines`` of the variant, ``uniforms``, ``images`` by texture unit.

    ``layout``: what its geometry must bring, texture coordinate sets and primvar of colour.
    """

    material: Material
    defines: dict[str, Define]
    uniforms: dict[str, bytes]
    images: tuple[moderngl.Texture, ...]
    layout: tuple[tuple[str, ...], str]


@dataclass(slots=True)
class _Fetches:
    """The distinct texels of a material: maps often are channels of one texture."""

    known: dict[tuple[TextureRef, str, tuple[float, ...]], int]
    images: list[moderngl.Texture]
    matrices: list[Any]
    uv_sets: list[int]


def is_blended(material: Material) -> bool:
    """Whether something behind it may be seen through it."""
    return material.blend and (material.opacity < 1.0 or material.opacity_map is not None)


def material_inputs(material: Material, textures: TextureCache) -> MaterialInputs:
    """Uploads what it needs. A texture that cannot be had becomes its fallback value."""
    defines: dict[str, Define] = {f"{field.upper()}_MAP": "" for field in _FIELDS}
    if material.model == "ggx":
        defines["GGX"] = 1
    varies = material.opacity_map is not None
    if material.opacity < material.opacity_threshold or (varies and material.opacity_threshold > 0):
        defines["MASKED"] = 1  # only where needed: what may discard is hidden late
    if is_blended(material):
        defines["BLEND"] = 1
        # OpenGL's blending, which legacy materials mean, fades the highlight too.
        if material.presence or material.model == "blinn":
            defines["PRESENCE"] = 1
    uniforms = {
        "shininess": floats(material.shininess),
        "opacity_threshold": floats(material.least_texel if varies else material.opacity_threshold),
    }
    fetches = _Fetches({}, [], [], [])
    sets = material.uv_sets()
    del defines["NORMAL_MAP"]
    for field, is_color in _FIELDS.items():
        use: TextureUse | None = getattr(material, f"{field}_map")
        name = _UNIFORM.get(field, field)
        if use is None:
            if field != "normal":
                uniforms[name] = floats(getattr(material, field))
            continue
        if field in ("diffuse", "specular") and use.leaves_shares():
            defines[f"{field.upper()}_HELD"] = 1
        one = "rgba"[max(use.channel, 0)]
        part = one if not is_color else "rgb" if use.channel < 0 else 3 * one
        channels = ["rgba".index(letter) for letter in part]
        scale, bias = np.asarray(use.scale)[channels], np.asarray(use.bias)[channels]
        number = _fetch(fetches, use, textures, min(sets.index(use.uv_set), UV_SETS - 1))
        if number is None:
            if field != "normal":  # without its texture a surface is smooth
                uniforms[name] = floats(np.asarray(use.fallback)[channels] * scale + bias)
            continue
        uniforms[name], uniforms[f"{name}_scale"] = floats(bias), floats(scale)
        defines[f"{field.upper()}_MAP"] = f"+ texel({number}).{part} * {name}_scale"
        if field == "normal":
            defines["NORMAL_PLACE"] = number
    if fetches.images:
        defines["FETCHES"] = len(fetches.images)
        defines["UV_SETS"] = f"int[]({', '.join(map(str, fetches.uv_sets))})"
        matrices = np.array(fetches.matrices)
        uniforms["image_u"], uniforms["image_v"] = floats(matrices[:, 0]), floats(matrices[:, 1])
        if np.all(matrices == _IDENTITY):
            defines["PLAIN_PLACES"] = 1
        uniforms["images"] = np.arange(len(fetches.images), dtype=np.int32).tobytes()
    for name, (value, text) in _USUAL.items():
        if name in uniforms and np.all(np.frombuffer(uniforms[name], np.float32) == value):
            del uniforms[name]
            defines[name.upper()] = text
    layout = tuple(sets), material.vertex_color
    return MaterialInputs(material, defines, uniforms, tuple(fetches.images), layout)


def _fetch(fetches: _Fetches, use: TextureUse, textures: TextureCache, uv_set: int) -> int | None:
    """Number of the texel that ``use`` reads, or None where there is no texture."""
    key = use.texture, use.uv_set, use.matrix
    if key not in fetches.known:
        uploaded = textures.get(use.texture)
        if uploaded is None:
            return None
        matrix = np.reshape(use.matrix, (2, 3)) * np.reshape(uploaded.scale, (2, 1))
        matrix[:, 2] += uploaded.offset
        fetches.known[key] = len(fetches.images)
        fetches.images.append(uploaded.texture)
        fetches.matrices.append(matrix)
        fetches.uv_sets.append(uv_set)
    return fetches.known[key]
