"""Materials of OpenFlight faces: palette material times colour, texture, transparency.

The format multiplies: a lit face reflects material x colour x texture, the colour being
that of the face or of its vertices. A face that is not illuminated (light modes 0 and 1)
shows its colour as it is, whatever its material's.

Colours of faces go into the materials as long as a look has few of them; beyond that
they are vertex colours, so that a database coloured face by face does not become as
many materials.

Source: OpenFlight Specification 16.5, "Face Record", "Material Palette Record".
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import PurePosixPath
from typing import Literal, NamedTuple

import numpy as np

from hdrusd.errors import SourceRef
from hdrusd.importers.flt_faces import BLENDED, CULLED, Faces
from hdrusd.importers.flt_palettes import PaletteMaterial, Palettes, PaletteTexture, rgb
from hdrusd.importers.flt_records import Document, Integers
from hdrusd.importers.flt_textures import TextureReader
from hdrusd.importers.flt_vertices import Flags
from hdrusd.legacy.scene import RGB, Material
from hdrusd.report import Kind, Report

#: Colours of faces that one look has materials for.
_COLORS = 8

#: Below this the opacity of a material is meant: many files say 0.999.
_OPAQUE = 0.99

#: What a face without a material leaves to the format: white and matt, times its colour.
_FIELDS = frozenset({"ambient", "diffuse", "specular", "emission", "shininess"})


class _Look(NamedTuple):
    """All that makes a material; equal ones are one."""

    material: PaletteMaterial | None
    texture: PaletteTexture | None
    lit: bool
    blended: bool
    two_sided: bool
    alpha: float
    color: RGB


@dataclass(slots=True)
class MaterialReader:
    """Adds materials to ``materials`` for the faces of one file after the other."""

    report: Report
    materials: list[Material]
    textures: TextureReader
    _known: dict[_Look, int] = field(default_factory=dict)

    def assign(
        self, document: Document, palettes: Palettes, faces: Faces, gouraud: Flags, shown: Flags
    ) -> tuple[Integers, Flags]:
        """Of each face its material, and whether its colour comes as vertex colours.

        ``gouraud``: faces with vertex colours; ``shown``: faces that have polygons at all.
        """
        material = _in_palette(faces.material, palettes.materials.keys())
        texture = _in_palette(faces.texture, palettes.textures.keys())
        self._unknown(document, faces, faces.material, material, shown, "material")
        self._unknown(document, faces, faces.texture, texture, shown, "texture")
        blended = np.isin(faces.template, BLENDED)
        two_sided = faces.draw != CULLED
        parts = (material + 1, texture + 1, faces.alpha, faces.lit, blended, two_sided)
        look = np.zeros(len(faces.record), np.int64)
        for part, size in zip(parts, (1 << 16, 1 << 16, 256, 2, 2, 2), strict=True):
            look = look * size + part.astype(np.int64)
        codes = np.rint(faces.color * np.float32(255.0)).astype(np.int64)
        color = (codes[:, 0] << 16) | (codes[:, 1] << 8) | codes[:, 2]
        colored = gouraud | self._many_colors(look, color, shown & ~gouraud)
        color[colored] = 0xFFFFFF
        # Both at once: rows of equal look and colour.
        _, look_row = np.unique(look, return_inverse=True)
        _, first, row = np.unique(
            look_row.astype(np.int64) << 24 | color, return_index=True, return_inverse=True
        )
        used = np.zeros(len(first), np.bool_)
        used[row[shown]] = True
        numbers = np.full(len(first), -1, np.int64)
        for number in np.flatnonzero(used)[np.argsort(first[used], kind="stable")].tolist():
            face = int(first[number])
            numbers[number] = self._material(
                document.ref(int(faces.record[face])),
                _Look(
                    palettes.materials.get(int(material[face])),
                    palettes.textures.get(int(texture[face])),
                    bool(faces.lit[face]),
                    bool(blended[face]),
                    bool(two_sided[face]),
                    int(faces.alpha[face]) / 255.0,
                    (1.0, 1.0, 1.0) if colored[face] else rgb(tuple(faces.color[face].tolist())),
                ),
            )
        return numbers[row], colored

    def _many_colors(self, look: Integers, color: Integers, some: Flags) -> Flags:
        """Faces whose look has more colours than it gets materials for."""
        many = np.zeros(len(look), np.bool_)
        looks, row = np.unique(look, return_inverse=True)
        pairs = np.unique(row[some].astype(np.int64) << 24 | color[some])
        count = np.bincount(pairs >> 24, minlength=len(looks))
        many[some] = (count > _COLORS)[row[some]]
        return many

    def _unknown(
        self,
        document: Document,
        faces: Faces,
        wanted: Integers,
        found: Integers,
        shown: Flags,
        what: str,
    ) -> None:
        lost = np.flatnonzero(shown & (wanted >= 0) & (found < 0))
        indices, first, count = np.unique(wanted[lost], return_index=True, return_counts=True)
        for index, at, faces_of in zip(indices, lost[first], count, strict=True):
            record = int(faces.record[at])
            text = f"{what} {index} is not in the palette; {faces_of} faces are without"
            thing = document.text(record, 4, 8)
            document.add(Kind.MISSING, "flt-palette-entry", record, thing, text)

    def _material(self, source: SourceRef, look: _Look) -> int:
        if look not in self._known:
            self._known[look] = len(self.materials)
            self.materials.append(self._made(source, look))
        return self._known[look]

    def _made(self, source: SourceRef, look: _Look) -> Material:
        made = self._colors(source, look)
        texture, alpha_in_picture = None, False
        if look.texture is not None:
            texture, alpha_in_picture = self.textures.read(look.texture)
        mode: Literal["opaque", "mask", "blend"] = "opaque"
        if look.blended or made.alpha < _OPAQUE:
            mode = "blend"
        elif alpha_in_picture:
            mode = "mask"
            text = "a template without blending, and a picture with alpha; cut out at one half"
            name = "" if texture is None else texture.image.name
            self.report.add(Kind.ASSUMED, "flt-alpha", source, name, text)
        opacity = texture if texture is not None and alpha_in_picture else None
        stem = "" if texture is None else PurePosixPath(texture.image.name.replace("\\", "/")).stem
        codes = "".join(f"{round(255.0 * c):02x}" for c in look.color)
        return replace(
            made,
            name=made.name or stem or f"color_{codes}",
            diffuse_map=texture,
            opacity_map=None if opacity is None else replace(opacity, channel="a"),
            alpha_mode=mode,
            two_sided=look.two_sided,
            lit=look.lit,
        )

    def _colors(self, source: SourceRef, look: _Look) -> Material:
        base, color = look.material, look.color
        if base is None:
            return Material(
                "", source, ambient=color, diffuse=color, alpha=look.alpha, defaults=_FIELDS
            )
        return Material(
            base.name,
            base.source,
            ambient=_times(base.ambient, color),
            diffuse=_times(base.diffuse, color) if look.lit else color,
            specular=base.specular,
            emission=base.emission,
            shininess=base.shininess,
            alpha=base.alpha * look.alpha,
        )


def _in_palette(index: Integers, known: object) -> Integers:
    """Indices that a palette has; -1 for the others."""
    return np.where(np.isin(index, list(known)), index, -1)  # type: ignore[call-overload]


def _times(a: RGB, b: RGB) -> RGB:
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]
