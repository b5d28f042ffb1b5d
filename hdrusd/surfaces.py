"""What legacy materials become: reflectance, cd/m2 and the texture files that hold them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from hdrusd.legacy.scene import RGB, LegacyScene, Material, Texture
from hdrusd.maps import MapWriter
from hdrusd.photometry.interpret import Interpreter, luminance
from hdrusd.photometry.sidecar import Rule, Sidecar
from hdrusd.report import Kind, Report
from hdrusd.units import TEXTURE_GAMMA
from hdrusd.usd.material import Map, Surface
from hdrusd.usd.mesh import COLOR_PRIMVAR
from hdrusd.usd.preview import roughness_from_shininess

#: Keys of a photometry rule that say how a surface reflects.
_REFLECTION = frozenset({"diffuse", "gamma", "specular", "roughness", "shininess"})

#: TexEnv modes in which the texture covers the material's colour.
_COVERING = ("REPLACE", "DECAL")


@dataclass(frozen=True, slots=True)
class SurfaceMaker:
    """Interprets the materials of one conversion. ``gamma``: of the command line, if given."""

    maps: MapWriter
    interpreter: Interpreter
    sidecar: Sidecar
    gamma: float | None
    report: Report

    def look(self, material: Material) -> dict[str, Map]:
        """The textures of the look as it was, by "diffuse", "emission", "opacity"."""
        peak = max(*material.emission, 1.0) if material.emission_cd_m2 else 1.0
        emission: RGB = tuple(c / peak for c in material.emission)  # type: ignore[assignment]
        covered = material.diffuse_map is not None and material.diffuse_map.mode in _COVERING
        diffuse = (1.0, 1.0, 1.0) if covered else material.diffuse
        uses = {
            "diffuse": (material.diffuse_map, diffuse),
            "emission": (material.emission_map, emission),
        }
        maps = {
            role: replace(made, scale=factor)  # the LDR picture is the texture times the factor
            for role, (texture, factor) in uses.items()
            if texture is not None and (made := self.maps.look(texture)) is not None
        }
        opacity = self._opacity(material)
        return maps if opacity is None else maps | {"opacity": opacity}

    def glossed(self, material: Material) -> Material:
        """The material with the highlight that the photometry file states.

        A stated roughness is that of a GGX lobe, a stated shininess Blinn and Phong's. A
        material of metallic and roughness stays with GGX; a stated specular reflectance
        takes the place of its metallic.
        """
        rule = self.sidecar.match("material", material.name)
        if rule is None:
            return material
        specular = rule.three("specular")
        roughness, shininess = rule.number("roughness"), rule.number("shininess")
        if material.pbr is None and roughness is None:
            shininess = material.shininess if shininess is None else shininess
            return replace(material, specular=specular or material.specular, shininess=shininess)
        if roughness is None and shininess is not None:
            roughness = roughness_from_shininess(shininess)
        pbr = dict(material.pbr or {"glossiness": 0.0})
        if specular is not None and "glossiness" not in pbr:
            pbr = {"glossiness": 1.0 - pbr.get("roughness", 1.0)}
        if roughness is not None and "glossiness" in pbr:
            pbr["glossiness"] = 1.0 - roughness
        elif roughness is not None:
            pbr["roughness"] = roughness
        return replace(material, specular=specular or material.specular, pbr=pbr)

    def surface(self, material: Material, *, colored: bool) -> Surface:
        """A material of ``glossed`` in photometric terms.

        ``colored``: worn by meshes with vertex colours.
        """
        rule = self.sidecar.match("material", material.name)
        gamma = self._gamma(rule)
        diffuse = (rule and rule.three("diffuse")) or material.diffuse
        textured = material.diffuse_map
        if textured is not None and textured.mode in _COVERING:
            diffuse = (1.0, 1.0, 1.0)
        hdr = bool(rule and rule.values.get("hdr_texture"))
        emission, provenance, name, source = self.interpreter.emission(material, rule)
        stated = rule.number("luminance") if rule is not None else None
        lamp = stated is not None and stated > 0.0
        emission_map = self._emission_map(material, emission, gamma, hdr=hdr)
        reflectance = None
        if textured is not None and not lamp:
            reflectance = self.maps.reflectance(
                textured, diffuse, gamma, material.source, material.name
            )
        diffuse = self._clipped(material, "diffuse", diffuse)
        specular = self._clipped(material, "specular", material.specular)
        if not lamp:
            self._note_differences(material, diffuse, specular, colored=colored)
        bright = any(emission)
        if rule is not None and not bright and _REFLECTION & rule.values.keys():
            provenance, name, source = rule.provenance, str(rule.place), rule.source
        return Surface(
            diffuse=diffuse,
            gamma=gamma,
            specular=specular,
            diffuse_map=reflectance,
            source_texture=self._look_file(textured),
            emission=emission,
            luminance=luminance(emission),
            emission_map=emission_map,
            replaces_reflection=lamp,
            opacity_map=self._opacity(material),
            vertex_color=COLOR_PRIMVAR if colored else "",
            provenance=provenance if bright or name else "",
            rule=name,
            source=source,
        )

    def _gamma(self, rule: Rule | None) -> float:
        own = rule.number("gamma") if rule is not None else None
        stated = (self.gamma, own, self.sidecar.gamma)
        return next((gamma for gamma in stated if gamma is not None), TEXTURE_GAMMA)

    def _emission_map(
        self, material: Material, emission: RGB, gamma: float, *, hdr: bool
    ) -> Map | None:
        texture = material.emission_map or (material.diffuse_map if hdr else None)
        if texture is not None and any(emission):
            return self.maps.luminance(texture, gamma, emission, peak=hdr)
        if hdr:
            text = "hdr_texture asked for; the material has no texture or no luminance"
            self._note(material, Kind.MISSING, "hdr-texture-missing", text)
        return None

    def _look_file(self, texture: Texture | None) -> str:
        made = None if texture is None else self.maps.look(texture)
        return made.file if made else ""

    def _opacity(self, material: Material) -> Map | None:
        """Opacity stays as it was: the look's own file, read raw."""
        if material.opacity_map is None or material.alpha_mode == "opaque":
            return None
        made = self.maps.look(material.opacity_map)
        return replace(made, raw=True) if made else None

    def _clipped(self, material: Material, name: str, color: RGB) -> RGB:
        r, g, b = (min(max(c, 0.0), 1.0) for c in color)
        if (r, g, b) != color:
            shown = ", ".join(f"{c:.4g}" for c in color)
            text = f"{name} ({shown}); clipped to 0 to 1, as a surface makes no light"
            self._note(material, Kind.CLAMPED, f"{name}-clipped", text)
        return r, g, b

    def _note_differences(
        self, material: Material, diffuse: RGB, specular: RGB, *, colored: bool
    ) -> None:
        total = max(d + s for d, s in zip(diffuse, specular, strict=True))
        if material.pbr is None and total > 1.0 + 1e-6:
            text = f"diffuse and specular add up to {total:.3g}; more than falls in"
            self._note(material, Kind.ASSUMED, "energy", text)
        if any(specular) and material.pbr is not None and "glossiness" not in material.pbr:
            text = "specular colour beside metallic and roughness, which say the highlight"
            self._note(material, Kind.DROPPED, "specular-unused", text)
        if not material.lit:
            text = "lighting is off in the source; lit here, for it says no cd/m2"
            self._note(material, Kind.ASSUMED, "lighting-off", text)
        if colored and (material.diffuse_map is not None or diffuse != (1.0, 1.0, 1.0)):
            what = "a texture" if material.diffuse_map is not None else "a diffuse colour"
            text = f"vertex colours times {what}: only hdrusd multiplies both"
            self._note(material, Kind.REPLACED, "vertex-color", text)

    def _note(self, material: Material, kind: Kind, code: str, text: str) -> None:
        self.report.add(kind, code, material.source, material.name, text)


def colored_materials(scene: LegacyScene) -> set[int]:
    """Materials worn by a mesh with vertex colours that are not all white."""
    colored: set[int] = set()
    for mesh in scene.meshes:
        if mesh.colors is not None and not bool((mesh.colors[:, :3] == 1.0).all()):
            colored.update(subset.material for subset in mesh.subsets)
            if mesh.material is not None:
                colored.add(mesh.material)
    return colored


def material_rows(
    materials: Sequence[Material], paths: Sequence[object], surfaces: Sequence[Surface]
) -> list[dict[str, Any]]:
    """The account of the materials for the report."""
    return [
        {
            "name": material.name,
            "path": str(path),
            "gamma": surface.gamma,
            "diffuse": list(surface.diffuse),
            "specular": list(surface.specular),
            "reflectance_map": surface.diffuse_map.file if surface.diffuse_map else None,
            "luminance_cd_m2": surface.luminance,
            "provenance": surface.provenance or None,
            "rule": surface.rule or None,
        }
        for material, path, surface in zip(materials, paths, surfaces, strict=True)
    ]
