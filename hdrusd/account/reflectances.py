"""The reflectance of every material, held against what such a surface can have.

A doubt is a finding and changes nothing: the photometry file is where a person decides.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from hdrusd.account.wear import Worn
from hdrusd.errors import SourceRef
from hdrusd.legacy.scene import Image, Material, Texture
from hdrusd.legacy.texels import texels
from hdrusd.photometry.albedo import (
    Doubt,
    Reflectance,
    doubt,
    inwards,
    reflectance,
    surface_class,
)
from hdrusd.photometry.baked import baked_lamps, baked_shadow
from hdrusd.photometry.recipe_entry import toml_entry
from hdrusd.report import Kind, Report
from hdrusd.units import LUMINANCE_WEIGHTS
from hdrusd.usd.material import Surface

Array = npt.NDArray[Any]

#: Of a picture's width and height, rows and columns (n,) of the texels that are wanted.
Places = Callable[[int, int], tuple[Array, Array]]


class Picture(Protocol):
    """A picture in linear values (h, w, 3) with its alpha (h, w) or None; None where it is missing.

    With ``places`` (1, n) of these alone.
    """

    def __call__(
        self, image: Image, gamma: float, places: Places | None = None
    ) -> tuple[Array, Array | None] | None: ...


#: A highlight from which on a surface may be black without it.
_MIRRORS = 0.04


class Reflectances:
    """Judges the materials of one conversion."""

    def __init__(self, picture: Picture, report: Report) -> None:
        self.picture = picture
        self.report = report
        self._pictures: dict[tuple[int, float], tuple[float, int]] = {}

    def row(
        self, material: Material, surface: Surface, found: Worn, factor: Sequence[float] | None
    ) -> dict[str, Any]:
        """The account of one material. ``factor``: D of its reflectance map, unclipped."""
        row: dict[str, Any] = {
            "faces": found.faces,
            "area_m2": found.area,
            "surface_class": None,
            "reflectance": None,
            "doubts": [],
        }
        if surface.replaces_reflection or found.area <= 0.0 or _metallic(material) >= 0.5:
            return row
        names = [material.name]
        if material.diffuse_map is not None:
            names.append(Path(material.diffuse_map.image.name.replace("\\", "/")).stem)
        kind = surface_class(*names)
        row["surface_class"] = kind.name if kind else None
        measured = self._measured(material, surface, found, factor)
        if measured is None:
            return row
        row["reflectance"] = {"mean": measured.mean, "p95": measured.p95}
        wrong = doubt(measured, kind, dark=_may_be_black(material, surface))
        if wrong is not None:
            row["doubts"].append(self._told(material, surface, wrong, factor))
        if surface.diffuse_map is not None and not any(surface.emission):
            row["doubts"].extend(self._baked(material, surface.gamma))
        return row

    def _measured(
        self, material: Material, surface: Surface, found: Worn, factor: Sequence[float] | None
    ) -> Reflectance | None:
        diffuse = np.asarray(surface.diffuse if factor is None else factor)
        texture = material.diffuse_map
        color = found.color if surface.vertex_color and found.color is not None else None
        if texture is None:
            flat = np.broadcast_to(diffuse, (1 if color is None else len(color), 3))
            values = flat if color is None else flat * color
            return reflectance(values, np.ones(len(values)))
        if not surface.diffuse_map:  # what is missing is a finding of its own
            return None
        uv, shown = found.uv, np.ones(1)

        def places(width: int, height: int) -> tuple[Array, Array]:
            nonlocal shown
            assert uv is not None
            row, column, shown = texels(texture, uv, width, height)
            return row, column

        made = self.picture(texture.image, surface.gamma, None if uv is None else places)
        if made is None:
            return None
        pixels, _ = made
        values = pixels.reshape(-1, 3)
        if uv is not None:
            values = values * shown[:, None]
            values = values if color is None else values * color
        weights = self._weights(material, surface, texture, uv, pixels.shape[:2])
        return reflectance(values * diffuse, weights)

    def _weights(
        self,
        material: Material,
        surface: Surface,
        texture: Texture,
        uv: Array | None,
        shape: tuple[int, ...],
    ) -> Array:
        """How much of each of the places (n,) is there, by the material's opacity map.

        ``shape``: height and width of the reflectance's picture where ``uv`` is None: the places
        are its texels then.
        """
        whole = np.ones(shape[0] * shape[1])
        used = surface.opacity_map.texture if surface.opacity_map else None
        if used is None or (uv is not None and used.uv_set != texture.uv_set):
            return whole
        shown = whole

        def places(width: int, height: int) -> tuple[Array, Array]:
            nonlocal shown
            if uv is not None:
                row, column, shown = texels(used, uv, width, height)
                return row, column
            row, column = np.indices(shape)
            return row.ravel() * height // shape[0], column.ravel() * width // shape[1]

        made = self.picture(used.image, 1.0, places)  # read raw, as the stage has it
        if made is None:
            return whole
        pixels, alpha = made
        if used.channel == "a":
            opacity = whole if alpha is None else alpha.ravel()
        else:
            opacity = pixels.reshape(-1, 3)[:, "rgb".index(used.channel[0])]
        opacity = np.clip(opacity * shown * material.alpha, 0.0, 1.0)
        if material.alpha_mode == "mask":
            return np.asarray(opacity >= material.alpha_cutoff, np.float64)
        return np.asarray(opacity, np.float64)

    def _told(
        self, material: Material, surface: Surface, wrong: Doubt, factor: Sequence[float] | None
    ) -> dict[str, Any]:
        write = None
        diffuse = surface.diffuse if factor is None else factor
        if wrong.factor is not None and any(diffuse):
            stated = [inwards(c, wrong.factor) for c in diffuse]
            write = toml_entry("material", material.name, diffuse=stated)
        text = wrong.text
        if wrong.factor is not None:
            text += f"; D times {wrong.factor:.3g} would have it there"
        self.report.add(Kind.ASSUMED, wrong.code, material.source, material.name, text)
        return {
            "code": wrong.code,
            "statistic": wrong.statistic,
            "low": wrong.low,
            "high": wrong.high,
            "citation": wrong.citation,
            "factor": wrong.factor,
            "decades": wrong.decades,
            "text": text,
            "write": write,
        }

    def _baked(self, material: Material, gamma: float) -> list[dict[str, Any]]:
        assert material.diffuse_map is not None
        image = material.diffuse_map.image
        told = []
        ratio, lamps = self._light_in(image, gamma)
        if ratio:
            text = (
                f"{image.name}: bright over dark {ratio:.2g} with soft edges and one hue: "
                "a shadow in the picture? it stays where no lamp makes it"
            )
            told.append(self._suspected("baked-shadow", image.source, material, text))
        if lamps:
            text = (
                f"{image.name}: {lamps} texels at full code amid a glow: a lamp in the picture? "
                "it reflects there and does not shine; luminance in the photometry file lets it"
            )
            told.append(self._suspected("baked-lamp", image.source, material, text))
        return told

    def _light_in(self, image: Image, gamma: float) -> tuple[float, int]:
        """Ratio of a suspected shadow (0: none), texels of suspected lamps; once an image."""
        key = id(image), gamma
        if key not in self._pictures:
            made = self.picture(image, gamma)
            shade = None if made is None else baked_shadow(made[0])
            lamps = 0 if made is None else baked_lamps(made[0])
            self._pictures[key] = 0.0 if shade is None else shade.ratio, lamps
        return self._pictures[key]

    def _suspected(
        self, code: str, source: SourceRef, material: Material, text: str
    ) -> dict[str, Any]:
        self.report.add(Kind.ASSUMED, code, source, material.name, text)
        return {
            "code": code,
            "statistic": None,
            "low": None,
            "high": None,
            "citation": None,
            "factor": None,
            "decades": 0.3,  # a shadow halves the light, which is log10 2
            "text": text,
            "write": None,
        }


def _metallic(material: Material) -> float:
    return float((material.pbr or {}).get("metallic", 0.0))


def _may_be_black(material: Material, surface: Surface) -> bool:
    mirrors = float(np.dot(LUMINANCE_WEIGHTS, surface.specular)) > _MIRRORS
    clear = material.alpha < 1.0 or material.opacity_map is not None
    return mirrors or clear or any(surface.emission) or _metallic(material) > 0.0
