"""What legacy materials become: reflectance, cd/m2 and the texture files that hold them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.legacy.scene import COVERING, DATA_MAPS, RGB, LegacyScene, Material, Texture
from hdrusd.legacy.texels import texels
from hdrusd.maps import MapWriter
from hdrusd.photometry.confidence import confidence
from hdrusd.photometry.interpret import Interpreter, luminance
from hdrusd.photometry.lamp_area import LampArea
from hdrusd.photometry.sidecar import Rule, Sidecar
from hdrusd.report import Kind, Report
from hdrusd.units import TEXTURE_GAMMA
from hdrusd.usd.material import Map, Surface
from hdrusd.usd.mesh import COLOR_PRIMVAR, OPACITY_PRIMVAR
from hdrusd.usd.preview import roughness_from_shininess

Array = npt.NDArray[Any]

#: Keys of a photometry rule that say how a surface reflects.
_REFLECTION = frozenset({"diffuse", "gamma", "specular", "roughness", "shininess"})

#: The brightest surface that is written, cd/m2; 32-bit floats end at 3e38.
_BRIGHTEST = 1e30


@dataclass(frozen=True, slots=True)
class SurfaceMaker:
    """Interprets the materials of one conversion. ``gamma``: of the command line, if given."""

    maps: MapWriter
    interpreter: Interpreter
    sidecar: Sidecar
    gamma: float | None
    report: Report

    def look(self, material: Material) -> dict[str, Map]:
        """The textures of the look as it was, by "diffuse", "normal": as the fields."""
        peak = max(*material.emission, 1.0) if material.emission_cd_m2 else 1.0
        emission: RGB = tuple(c / peak for c in material.emission)  # type: ignore[assignment]
        covered = material.diffuse_map is not None and material.diffuse_map.mode in COVERING
        diffuse = (1.0, 1.0, 1.0) if covered else material.diffuse
        uses = {
            "diffuse": (material.diffuse_map, diffuse),
            "emission": (material.emission_map, emission),
            "specular": (material.specular_map, material.specular),
        }
        maps = {
            role: replace(made, scale=factor)  # the LDR picture is the texture times the factor
            for role, (texture, factor) in uses.items()
            if texture is not None and (made := self.maps.look(texture)) is not None
        }
        maps |= self._data(material)
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
        if specular is not None:
            material = replace(material, specular_map=None, metallic_map=None)
        if roughness is not None or shininess is not None:
            material = replace(material, roughness_map=None)
        if material.pbr is None and roughness is None:
            shininess = material.shininess if shininess is None else shininess
            return replace(material, specular=specular or material.specular, shininess=shininess)
        if roughness is None and shininess is not None:
            roughness = roughness_from_shininess(shininess)
        pbr = dict(material.pbr or {"glossiness": 0.0})
        if specular is not None and "glossiness" not in pbr:
            coat = {name: value for name, value in pbr.items() if name.startswith("clearcoat")}
            pbr = {"glossiness": 1.0 - pbr.get("roughness", 1.0), **coat}
        if roughness is not None and "glossiness" in pbr:
            pbr["glossiness"] = 1.0 - roughness
        elif roughness is not None:
            pbr["roughness"] = roughness
        return replace(material, specular=specular or material.specular, pbr=pbr)

    def surface(
        self,
        material: Material,
        *,
        colored: bool,
        faded: bool = False,
        area: Callable[[], LampArea | None] = lambda: None,
        places: Callable[[Texture], Array | None] = lambda texture: None,
    ) -> Surface:
        """A material of ``glossed`` in photometric terms.

        ``colored``, ``faded``: worn by meshes with vertex colours, with vertex alpha that counts.
        ``area``: of a lamp that wears it, asked where the photometry file does not say.
        ``places``: texture coordinates (n, 2) spread evenly over all that wears it, None where
        that is not known.
        """
        rule = self.sidecar.match("material", material.name)
        gamma = self._gamma(rule)
        stated_d = rule.three("diffuse") if rule is not None else None
        diffuse = stated_d or material.diffuse
        textured = material.diffuse_map
        if stated_d is None and textured is not None and textured.mode in COVERING:
            diffuse = (1.0, 1.0, 1.0)
        hdr = bool(rule and rule.values.get("hdr_texture"))
        mean, how = self._mean_luminance(material, rule, area)
        emission, provenance, name, source = self.interpreter.emission(material, rule, mean)
        name += how
        stated = rule.number("luminance") if rule is not None and mean is None else mean
        lamp = stated is not None and stated > 0.0
        if lamp and mean is not None:
            emission = self._at_one(material, emission, gamma, places, hdr=hdr)
        emission_map = self._emission_map(material, emission, gamma, hdr=hdr)
        # What glows by a map of its own reflects, as a post does below its glass.
        dark = lamp and (emission_map is None or material.emission_map is None)
        reflectance = None
        if textured is not None and not dark:
            reflectance = self.maps.reflectance(
                textured, diffuse, gamma, material.source, material.name
            )
        shine = material.specular_map
        specular_map = None
        if shine is not None and not dark:
            specular_map = self.maps.reflectance(
                shine, material.specular, gamma, material.source, material.name
            )
        diffuse = self._clipped(material, "diffuse", diffuse)
        specular = self._clipped(material, "specular", material.specular)
        if not dark:
            self._note_differences(material, diffuse, specular, colored=colored)
        if faded:
            self._note_fading(material)
        bright = any(emission)
        if rule is not None and not bright and _REFLECTION & rule.values.keys():
            provenance, name, source = rule.provenance, str(rule.place), rule.source
        elif not bright and not name:
            name = f"R = T^{gamma:g} D" if reflectance is not None else "R = D"
            provenance, source = "estimated", "Petit and Bremond 2010, section 3"
        return Surface(
            diffuse=diffuse,
            gamma=gamma,
            specular=specular,
            diffuse_map=reflectance,
            source_texture=self._look_file(textured),
            emission=emission,
            luminance=luminance(emission),
            peak=hdr,
            emission_map=emission_map,
            replaces_reflection=dark,
            opacity_map=self._opacity(material),
            specular_map=specular_map,
            data_maps={} if dark else self._data(material),
            vertex_color=COLOR_PRIMVAR if colored else "",
            vertex_opacity=OPACITY_PRIMVAR if faded else "",
            provenance=provenance,
            rule=name,
            source=source,
        )

    def _gamma(self, rule: Rule | None) -> float:
        own = rule.number("gamma") if rule is not None else None
        stated = (self.gamma, own, self.sidecar.gamma)
        return next((gamma for gamma in stated if gamma is not None), TEXTURE_GAMMA)

    def _mean_luminance(
        self, material: Material, rule: Rule | None, area: Callable[[], LampArea | None]
    ) -> tuple[float | None, str]:
        """cd/m2 over all of a lamp and how they came about; None where nothing says.

        L = I / A, A as seen from the axis, or L = Phi / (pi S), S the luminous surface, of a
        Lambert emitter.
        """
        keys = ("candela", "lumens")
        if rule is None or "luminance" in rule.values or not set(keys) & rule.values.keys():
            return None, ""
        key = next(key for key in keys if key in rule.values)
        amount, size = rule.number(key), rule.number("area")
        assert amount is not None
        if size is None:
            lamp = area()
            if lamp is None:
                text = f"{rule.place} says {key}, and no mesh that wears it has an area; want area"
                self._note(material, Kind.MISSING, "emission-area", text)
                return None, ""
            seen = key == "candela"
            size = lamp.seen if seen else lamp.surface
            what = "seen along its mean normal" if seen else "of surface"
            places = f", the mean of {lamp.places} meshes" if lamp.places > 1 else ""
            if lamp.most - lamp.least > 1e-3 * lamp.most:
                places += f" of {lamp.least:.4g} to {lamp.most:.4g} m2 seen"
            text = f"{size:.4g} m2 {what}{places}, each taken for one lamp; area says otherwise"
            self._note(material, Kind.ASSUMED, "emission-area", text)
        nits = amount / size if key == "candela" else amount / (pi * size)
        if nits > _BRIGHTEST:
            text = f"{rule.place}: {nits:g} cd/m2 is beyond 32-bit floats; not used"
            self._note(material, Kind.INVALID, "emission-area", text)
            return None, ""
        return nits, f", {amount:g} {'cd' if key == 'candela' else 'lm'} of {size:.4g} m2"

    def _at_one(
        self,
        material: Material,
        emission: RGB,
        gamma: float,
        places: Callable[[Texture], Array | None],
        *,
        hdr: bool,
    ) -> RGB:
        """Emission at 1.0 of its texture, so that its mean over the lamp is as stated.

        I = A mean(L), and L = L1 t with t of the texture: L1 = I / (A mean(t)). Of an HDR texture,
        whose brightest texel is 1, mean(t) is mean / peak and L1 the peak of the lamp.
        """
        texture = self._glow(material, hdr=hdr)
        if texture is None:
            return emission
        values = self.maps.relative_luminance(texture, gamma, emission, peak=hdr)
        if values is None:
            return emission
        uv = places(texture)
        mean = _mean(values, texture, uv)
        if not mean or max(emission) > _BRIGHTEST * mean:
            text = "black in the lamp's colour; the lamp would not shine, so its mean is not held"
            self._note(material, Kind.INVALID, "emission-texture", text)
            return emission
        where = "over the whole picture, as where the lamp shows it is not known"
        if uv is not None:
            where = "where the lamp shows it"
        text = f"the picture has {mean:.4g} of its full luminance on average {where}"
        self._note(material, Kind.ASSUMED, "emission-texture", text)
        red, green, blue = (c / mean for c in emission)
        return red, green, blue

    @staticmethod
    def _glow(material: Material, *, hdr: bool) -> Texture | None:
        return material.emission_map or (material.diffuse_map if hdr else None)

    def _emission_map(
        self, material: Material, emission: RGB, gamma: float, *, hdr: bool
    ) -> Map | None:
        texture = self._glow(material, hdr=hdr)
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
        """Opacity stays as it was, read raw: alpha is that of the look's own file."""
        texture = material.opacity_map
        if texture is None or material.alpha_mode == "opaque":
            return None
        made = self.maps.look(texture) if texture.channel == "a" else self.maps.data(texture)
        return replace(made, raw=True) if made else None

    def _data(self, material: Material) -> dict[str, Map]:
        """Maps whose texels are data, by what they give; copies that are read raw."""
        maps = material.maps()
        normal = maps.get("normal_map")
        if normal is not None and self.maps.grey(normal.image):
            text = f"{normal.image.name} is grey, so heights and no directions; left out"
            self._note(material, Kind.DROPPED, "normal-grey", text)
            del maps["normal_map"]
        made = {name: self.maps.data(maps[name]) for name in DATA_MAPS if name in maps}
        return {name.removesuffix("_map"): used for name, used in made.items() if used is not None}

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

    def _note_fading(self, material: Material) -> None:
        """Vertex alpha times another opacity, which no UsdPreviewSurface multiplies."""
        if material.opacity_map is not None:
            text = "vertex alpha dropped; the opacity of its picture counts"
            self._note(material, Kind.DROPPED, "vertex-alpha", text)
        elif material.alpha < 1.0:
            text = f"vertex alpha counts, without the material's {material.alpha:.3g}"
            self._note(material, Kind.REPLACED, "vertex-alpha", text)

    def _note(self, material: Material, kind: Kind, code: str, text: str) -> None:
        self.report.add(kind, code, material.source, material.name, text)


def _mean(values: Array, texture: Texture, uv: Array | None) -> float:
    """Of a picture (h, w), where it is shown."""
    if uv is None:
        return float(values.mean())
    row, column, there = texels(texture, uv, values.shape[1], values.shape[0])
    return float(np.where(there, values[row, column], 0.0).mean())


def colored_materials(scene: LegacyScene) -> set[int]:
    """Materials worn by a mesh with vertex colours that are not all white."""
    return _worn(scene, lambda colors: not bool((colors[:, :3] == 1.0).all()))


def faded_materials(scene: LegacyScene) -> set[int]:
    """Materials that let something through, worn by a mesh with vertex alpha below 1."""
    worn = _worn(scene, lambda colors: float(colors[:, 3].min(initial=1.0)) < 1.0)
    return {number for number in worn if scene.materials[number].alpha_mode != "opaque"}


def _worn(scene: LegacyScene, test: Callable[[Array], bool]) -> set[int]:
    """Materials of the meshes whose vertex colours (n, 4) pass a test."""
    found: set[int] = set()
    for mesh in scene.meshes:
        if mesh.colors is not None and test(mesh.colors):
            found.update(subset.material for subset in mesh.subsets)
            if mesh.material is not None:
                found.add(mesh.material)
    return found


def _luminance_of(surface: Surface) -> str:
    """Where a surface has its ``luminance``."""
    if surface.emission_map is None:
        return "surface"
    return "brightest texel" if surface.peak else "full code"


def material_rows(
    materials: Sequence[Material], paths: Sequence[object], surfaces: Sequence[Surface]
) -> list[dict[str, Any]]:
    """The account of the materials for the report, but for where they are worn."""
    return [
        {
            "name": material.name,
            "path": str(path),
            "gamma": surface.gamma,
            "diffuse": list(surface.diffuse),
            "specular": list(surface.specular),
            "reflectance_map": surface.diffuse_map.file if surface.diffuse_map else None,
            "luminance_cd_m2": surface.luminance,
            "luminance_of": _luminance_of(surface),
            "replaces_reflection": surface.replaces_reflection,
            "faces": 0,  # these five: account/reflectances.py, where the faces are known
            "area_m2": 0.0,
            "surface_class": None,
            "reflectance": None,
            "doubts": [],
            "place": str(material.source),
            "provenance": surface.provenance,
            "rule": surface.rule,
            "source": surface.source,
            "confidence": confidence(surface.provenance, surface.rule, surface.source),
        }
        for material, path, surface in zip(materials, paths, surfaces, strict=True)
    ]
