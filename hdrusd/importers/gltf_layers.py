"""What glTF lays over the highlight, or bends it by: clear coat, index of refraction, specular.

KHR_materials_clearcoat, KHR_materials_ior and KHR_materials_specular.
"""

from __future__ import annotations

from hdrusd.importers.gltf_document import Item
from hdrusd.importers.gltf_images import Textures, channel
from hdrusd.importers.refraction import index_of
from hdrusd.legacy.scene import RGB, Texture
from hdrusd.report import Kind
from hdrusd.units import LUMINANCE_WEIGHTS

#: Channels of a tint that differ by less are rounded grey.
_GREY = 1e-4


def clearcoat(item: Item, textures: Textures, pbr: dict[str, float]) -> dict[str, Texture | None]:
    """The maps of a clear coat; its numbers go into ``pbr``."""
    coat = item.extension("KHR_materials_clearcoat")
    if coat is None:
        return {}
    amount = coat.number("clearcoatFactor", 0.0, low=0.0, high=1.0)
    rough = coat.number("clearcoatRoughnessFactor", 0.0, low=0.0, high=1.0)
    if amount == 0.0:
        return {}
    pbr |= {"clearcoat": amount, "clearcoat_roughness": rough}
    if coat.child("clearcoatNormalTexture").data != item.child("normalTexture").data:
        text = "the clear coat has other normals than what is below; those of the latter are used"
        item.note(Kind.REPLACED, "clearcoat-normal", text)
    return {
        "clearcoat_map": channel(textures.get(coat, "clearcoatTexture"), "r", amount),
        "clearcoat_roughness_map": channel(
            textures.get(coat, "clearcoatRoughnessTexture"), "g", rough
        ),
    }


def reflectance(item: Item, pbr: dict[str, float]) -> tuple[RGB | None, dict[str, float]]:
    """The reflectance at normal incidence of what is no metal, where it has a colour, and the
    numbers that go with it: else as an index of refraction.

    F0 = min(((n - 1) / (n + 1))^2 colour, 1) factor (KHR_materials_specular, implementation).
    """
    ior, tint, factor = 1.5, (1.0, 1.0, 1.0), 1.0
    refraction = item.extension("KHR_materials_ior")
    if refraction is not None:
        ior = refraction.number("ior", 1.5, low=0.0)
    specular = item.extension("KHR_materials_specular")
    if specular is not None:
        factor = specular.number("specularFactor", 1.0, low=0.0, high=1.0)
        red, green, blue = specular.numbers("specularColorFactor", tint, low=0.0)
        tint = (red, green, blue)
        _note_lost(specular, factor)
    if refraction is None and specular is None:
        return None, pbr
    normal = ((ior - 1.0) / (ior + 1.0)) ** 2
    red, green, blue = (min(normal * c, 1.0) * factor for c in tint)
    if max(red, green, blue) - min(red, green, blue) <= _GREY * max(red, green, blue):
        return None, pbr | {"ior": index_of(red)}
    if pbr["metallic"] == 0.0:
        others = {name: value for name, value in pbr.items() if name != "metallic"}
        return (red, green, blue), others | {"glossiness": 1.0 - pbr["roughness"]}
    grey = sum(w * c for w, c in zip(LUMINANCE_WEIGHTS, (red, green, blue), strict=True))
    text = "a specular colour beside metal; the rest reflects its luminance, without colour"
    item.note(Kind.REPLACED, "gltf-specular", text)
    return None, pbr | {"ior": index_of(grey)}


def _note_lost(specular: Item, factor: float) -> None:
    lost = [key for key in ("specularTexture", "specularColorTexture") if key in specular]
    if lost:
        text = f"{' and '.join(lost)} dropped: the factors hold"
        specular.note(Kind.DROPPED, "gltf-specular", text)
    if 0.0 < factor < 1.0:
        text = f"specularFactor {factor:g}: less than that is reflected at grazing angles too"
        specular.note(Kind.REPLACED, "gltf-specular", f"{text}; as much as ever here")
