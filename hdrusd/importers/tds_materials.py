"""Materials of 3D Studio as OpenGL records.

Shininess and its strength are percentages: the exponent is 2^(10 shininess), as
3ds Max has it, and the strength is a factor on the specular colour. Self-illumination
is a share of the diffuse colour that does not need light: it is emission in that
colour, never white. The scene's ambient light is nobody's emission.

Sources: Autodesk, 3D Studio File Toolkit for release 3, "3DS Chunk Definitions"
(MAT_ENTRY); 3ds Max SDK, samples/materials (the exponent of a glossiness).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from hdrusd.errors import SourceRef
from hdrusd.importers.tds_chunks import Chunk, Document
from hdrusd.importers.tds_maps import Map, MapReader
from hdrusd.legacy.scene import RGB, Material, Texture
from hdrusd.report import Kind

#: The fields that a record has, said or not.
FIELDS = frozenset({"ambient", "diffuse", "specular", "emission", "shininess", "alpha"})

_NAME, _SHADING = 0xA000, 0xA100
_COLORS = {0xA010: "ambient", 0xA020: "diffuse", 0xA030: "specular"}
_SHARES = {
    0xA040: "shininess",
    0xA041: "strength",
    0xA050: "transparency",
    0xA052: "falloff",
    0xA053: "blur",
    0xA084: "self-illumination",
}
_SELF_ILLUMINATED, _TWO_SIDED, _FACE_MAP = 0xA080, 0xA081, 0xA088
#: Chunks that are there or not, to what they ask for and a stage does not have.
_SWITCHES = {
    0xA082: "decal",
    0xA083: "additive transparency",
    0xA085: "wire frame",
    _FACE_MAP: "face map (the picture on each face)",
    0xA240: "transparency falloff",
    0xA250: "reflection blur",
}
#: Maps with a home, and those that are kept as notes.
_MAPS = {0xA200: "texture", 0xA210: "opacity", 0xA33D: "self-illumination"}
_HOMELESS = {
    0xA204: "specular",
    0xA220: "reflection",
    0xA230: "bump",
    0xA33A: "texture 2",
    0xA33C: "shininess",
    0xA33E: "texture mask",
    0xA340: "texture 2 mask",
    0xA342: "opacity mask",
    0xA344: "bump mask",
    0xA346: "shininess mask",
    0xA348: "specular mask",
    0xA34A: "self-illumination mask",
    0xA34C: "reflection mask",
}
#: Settings of wires, antialiasing, soft highlights and of switches that have their own
#: chunk; the depth of a relief that is not kept; MAT_SHIN3PCT was never used.
_SILENT = frozenset({0xA042, 0xA086, 0xA087, 0xA08A, 0xA08C, 0xA08E, 0xA252})

_WIRE, _FLAT, _METAL = 0, 1, 4


@dataclass(frozen=True, slots=True)
class Entry:
    """A material of the file, and what of it meshes must know."""

    material: Material
    flat: bool = False  # faces are shown without smoothing


@dataclass(slots=True)
class _Said:
    """What a MAT_ENTRY says, by the names of the tables above."""

    chunk: Chunk
    name: str = ""
    colors: dict[str, RGB] = field(default_factory=dict)
    shares: dict[str, float] = field(default_factory=dict)
    maps: dict[str, Map] = field(default_factory=dict)
    homeless: dict[str, Map] = field(default_factory=dict)
    switches: list[str] = field(default_factory=list)
    two_sided: bool = False
    glows: bool = False
    shading: int = 3


@dataclass(slots=True)
class MaterialReader:
    """Reads materials into ``entries``, by name; of two with one name the first counts."""

    document: Document
    maps: MapReader
    entries: dict[str, Entry] = field(default_factory=dict)

    def read(self, chunk: Chunk) -> None:
        """One MAT_ENTRY."""
        said = self._said(chunk)
        if said.name in self.entries:
            first = self.entries[said.name].material.source.place
            text = f"a second material of this name; that at {first} counts"
            self._note(said, Kind.INVALID, "3ds-duplicate", text)
            return
        self._note_losses(said)
        self.entries[said.name] = Entry(self._material(said), flat=said.shading == _FLAT)

    def _said(self, chunk: Chunk) -> _Said:
        document = self.document
        said = _Said(chunk)
        for child in document.children(chunk):  # first, as findings are to have it
            if child.tag == _NAME:
                said.name, _ = document.text(child)
                break
        for child in document.children(chunk):
            tag, name = child.tag, said.name
            if tag in _COLORS:
                color = document.color(child, name)
                if color is not None:
                    said.colors[_COLORS[tag]] = color
            elif tag in _SHARES:
                said.shares[_SHARES[tag]] = document.share(child, 0.0, name)
            elif tag in _MAPS or tag in _HOMELESS:
                self._map(said, child)
            elif tag in _SWITCHES:
                said.switches.append(_SWITCHES[tag])
            elif tag == _SHADING:
                said.shading = document.word(child, 3, name)
            elif tag == _TWO_SIDED:
                said.two_sided = True
            elif tag == _SELF_ILLUMINATED:
                said.glows = True
            elif tag != _NAME:
                document.unread(child, name, _SILENT)
        return said

    def _map(self, said: _Said, chunk: Chunk) -> None:
        homed = chunk.tag in _MAPS
        found = self.maps.read(chunk, said.name, find=homed)
        if found is None:
            return
        if found.amount == 0.0:
            text = f"map with an amount of 0 %: {found.image.name} does not show"
            self.document.note(Kind.DROPPED, "3ds-map-amount", chunk, said.name, text)
        elif homed:
            said.maps[_MAPS[chunk.tag]] = found
        else:
            said.homeless[_HOMELESS[chunk.tag]] = found

    def _material(self, said: _Said) -> Material:
        record = Material(said.name, self.document.ref(said.chunk))
        diffuse = said.colors.get("diffuse", record.diffuse)
        strength = said.shares.get("strength", 1.0)
        r, g, b = (strength * c for c in said.colors.get("specular", record.specular))
        glossiness = said.shares.get("shininess")
        opacity_map, alpha = self._opacity(said)
        record = replace(
            record,
            ambient=said.colors.get("ambient", record.ambient),
            diffuse=diffuse,
            specular=(r, g, b),
            shininess=record.shininess if glossiness is None else 2.0 ** (10.0 * glossiness),
            alpha=alpha,
            diffuse_map=self._diffuse_map(said),
            opacity_map=opacity_map,
            alpha_mode="opaque" if alpha == 1.0 and opacity_map is None else "blend",
            two_sided=said.two_sided,
            defaults=self._defaults(said),
            extras=self._extras(said),
        )
        return self._glowing(said, record)

    def _diffuse_map(self, said: _Said) -> Texture | None:
        """At its full amount a texture stands in place of the diffuse colour."""
        found = said.maps.get("texture")
        if found is None:
            return None
        if found.amount < 1.0:
            text = f"{100.0 * found.amount:g} % of {found.image.name} over the colour; all is shown"
            self._note(said, Kind.REPLACED, "3ds-map-amount", text)
        texture = found.texture()
        return texture if texture.image.missing else replace(texture, mode="REPLACE")

    def _opacity(self, said: _Said) -> tuple[Texture | None, float]:
        alpha = 1.0 - said.shares.get("transparency", 0.0)
        found = said.maps.get("opacity")
        if found is None or found.image.missing:
            return None, alpha
        if found.amount < 1.0:
            text = f"{100.0 * found.amount:g} % of {found.image.name}; all of it is the opacity"
            self._note(said, Kind.REPLACED, "3ds-map-amount", text)
        return replace(found.texture(), channel="a" if found.uses_alpha else "r"), 1.0

    def _glowing(self, said: _Said, record: Material) -> Material:
        """With the emission: a share of the diffuse colour, in the picture that it has."""
        share = said.shares.get("self-illumination", 0.0)
        share = 1.0 if said.glows and share == 0.0 else share
        painted = record.diffuse_map is not None and not record.diffuse_map.image.missing
        found = said.maps.get("self-illumination")
        if found is not None and not found.image.missing:
            if painted:
                text = "glows in its texture where the map says; glows in its colour there"
                self._note(said, Kind.REPLACED, "3ds-self-illumination", text)
            if found.amount < 1.0:
                text = f"{100.0 * found.amount:g} % of {found.image.name}; its glow is scaled"
                self._note(said, Kind.REPLACED, "3ds-map-amount", text)
            r, g, b = (found.amount * c for c in record.diffuse)
            return replace(record, emission=(r, g, b), emission_map=found.texture())
        if share == 0.0:
            return record
        if painted:
            emission = (share, share, share)
            return replace(record, emission=emission, emission_map=record.diffuse_map)
        r, g, b = (share * c for c in record.diffuse)
        return replace(record, emission=(r, g, b))

    def _defaults(self, said: _Said) -> frozenset[str]:
        given = set(said.colors) | ({"shininess"} & said.shares.keys())
        given |= {"alpha"} if "transparency" in said.shares else set()
        given |= {"emission"} if "self-illumination" in said.shares or said.glows else set()
        return frozenset(FIELDS - given)

    def _extras(self, said: _Said) -> Mapping[str, Any]:
        """The file's own numbers, and the maps without a home."""
        percent = {name: round(100.0 * share, 4) for name, share in said.shares.items() if share}
        maps = {f"{name} map": str(found) for name, found in said.homeless.items()}
        return percent | maps

    def _note_losses(self, said: _Said) -> None:
        for name, found in said.homeless.items():
            text = f"{name} map {found.image.name}: no home, kept as metadata"
            self.document.note(Kind.DROPPED, "3ds-map-dropped", found.chunk, said.name, text)
        switches = list(said.switches)
        if said.shares.get("falloff"):
            switches.append(f"transparency falloff {100.0 * said.shares['falloff']:g} %")
        if said.shading == _WIRE:
            switches.append("wire frame shading")
        if switches:
            text = f"{', '.join(dict.fromkeys(switches))}: no home; dropped"
            self._note(said, Kind.DROPPED, "3ds-material-switch", text)
        if said.shading == _METAL:
            text = (
                "metal shading, which takes its highlight's colour from the diffuse one; as Phong"
            )
            self._note(said, Kind.REPLACED, "3ds-shading", text)
        elif said.shading > _METAL:
            text = f"shading {said.shading}; want 0 to 4; read as Phong"
            self._note(said, Kind.INVALID, "3ds-shading", text)

    def _note(self, said: _Said, kind: Kind, code: str, text: str) -> None:
        self.document.note(kind, code, said.chunk, said.name, text)


def default_material(place: SourceRef) -> Material:
    """What faces without a material wear."""
    return Material("3ds_default", place, defaults=FIELDS)
