"""Wavefront MTL material libraries as OpenGL records.

Source: Alias|Wavefront, MTL material format, version 4.2 (1995); Ke, map_Ke and
the PBR statements (Pr, Pm, norm, ...) are extensions that exporters agree on. Every
number is kept as it stands: Ka is never added to Ke, Ns stays the exponent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.importer import Resolver
from hdrusd.importers.mtl_textures import MapStatement, locate, opacity_channel, texture
from hdrusd.importers.obj_text import Tally, blocks, decode, lines_of, shorten, to_float
from hdrusd.legacy.scene import GREEN_UP, RGB, Image, Material, Texture, normal_texels
from hdrusd.report import Kind, Report

#: The fields that every MTL material has, said or not.
FIELDS = frozenset({"ambient", "diffuse", "specular", "emission", "shininess", "alpha"})

#: Statement in lower case to its name in Material.pbr.
_PBR = {"pr": "roughness", "pm": "metallic"}
#: A coat, which a surface of Phong's has not.
_COAT = {"pc": "clearcoat", "pcr": "clearcoat_roughness"}
_NORMALS = ("norm", "map_norm")
#: Maps of one number, of which -imfchan names the channel.
_ONE = {"map_d", *(f"map_{key}" for key in (*_PBR, *_COAT))}
_READ = {"ka", "kd", "ks", "ke", "ns", "d", "tr", "illum", "map_kd", "map_ke", "map_d", *_NORMALS}
#: Known statements that have no home in the record. Writers disagree on the channels of
#: map_RMA and map_ORM, whose names both stand for either.
_HOMELESS = {
    *("ni", "tf", "kt", "sharpness", "bump", "disp", "decal", "refl"),
    *("ps", "pc", "pcr", "aniso", "anisor", "map_ps", "map_pc", "map_pcr", "map_rma", "map_orm"),
    *("map_ka", "map_ks", "map_ns", "map_bump", "map_disp", "map_refl", "map_tr"),
    "map_aat",
}
#: d and Tr are each printed with three decimals or more, so they agree within that.
_AGREE = 1e-3


@dataclass(frozen=True, slots=True)
class _Statement:
    keyword: str  # as written
    text: str
    line: int


@dataclass(slots=True)
class _Entry:
    """One ``newmtl`` and what follows it, by keyword in lower case."""

    name: str
    line: int
    statements: dict[str, _Statement] = field(default_factory=dict)
    repeated: list[str] = field(default_factory=list)


def read(path: Path, resolver: Resolver, report: Report) -> list[Material]:
    """All materials of a library, in order; of two with one name the first counts.

    A library that cannot be read is a finding and gives none.
    """
    try:
        entries = _entries(lines_of(resolver.read(path), path), path, report)
    except InputError as error:
        text = f"{error.problem}; its materials become defaults"
        report.add(Kind.MISSING, "mtl-unreadable", error.source, "", text)
        return []
    images: dict[str, Image] = {}
    return [_Builder(entry, path, resolver, report, images).material() for entry in entries]


def _entries(data: bytes, path: Path, report: Report) -> list[_Entry]:
    tally = Tally()
    entries: dict[str, _Entry] = {}
    current: _Entry | None = None
    for block in blocks(data, path):
        for index in range(block.starts.size):
            words = block.line(index).split(None, 1)
            if not words or words[0].startswith(b"#"):
                continue
            line = int(block.numbers[index])
            text = decode(words[1].strip(), tally, line) if len(words) > 1 else ""
            keyword = decode(words[0], tally, line)
            key = keyword.lower()
            if key == "newmtl":
                current = _Entry(text, line)
                if not text:
                    tally.note("mtl-nameless", line)
                elif text in entries:
                    again = f"defined again; line {entries[text].line} counts"
                    place = SourceRef(path, line)
                    report.add(Kind.INVALID, "mtl-duplicate", place, shorten(text), again)
                else:
                    entries[text] = current
            elif current is None:
                tally.note("mtl-stray", line)
            else:
                if key in current.statements:
                    current.repeated.append(keyword)
                current.statements[key] = _Statement(keyword, text, line)
    texts = {
        "encoding": (Kind.ASSUMED, "words that are not UTF-8: read as Latin-1"),
        "mtl-nameless": (Kind.INVALID, "materials without a name: ignored"),
        "mtl-stray": (Kind.INVALID, "statements before any newmtl: ignored"),
    }
    tally.report(report, path, texts)
    return list(entries.values())


@dataclass(slots=True)
class _Builder:
    """Makes one material and says what it could not use."""

    entry: _Entry
    path: Path
    resolver: Resolver
    report: Report
    images: dict[str, Image]
    defaults: set[str] = field(default_factory=set)
    read: set[str] = field(default_factory=lambda: set(_READ))  # statements with a home

    def material(self) -> Material:
        said = self.entry.statements
        record = Material(self.entry.name, SourceRef(self.path, self.entry.line))
        diffuse_map, opacity_map = self._map("map_kd"), self._map("map_d")
        emission_map = self._map("map_ke")
        if opacity_map is not None:
            opacity_map = self._with_channel(opacity_map)
        alpha = self._alpha()
        diffuse = self._diffuse(record.diffuse, diffuse_map)
        specular, lit = self._illumination(self._color("ks", "specular", record.specular))
        emission = self._emission(record.emission, emission_map)
        for key, factor, used in (("kd", diffuse, diffuse_map), ("ke", emission, emission_map)):
            if used is not None and key in said and not any(factor):
                text = f"{said[key].keyword} is zero and multiplies its texture: nothing shows"
                self._note(Kind.ASSUMED, "mtl-zero-factor", text)
        pbr, maps = self._physical()
        ambient = self._color("ka", "ambient", record.ambient)
        shininess = self._shininess(record.shininess)
        return Material(
            name=record.name,
            source=record.source,
            ambient=ambient,
            diffuse=diffuse,
            specular=specular,
            emission=emission,
            shininess=shininess,
            alpha=alpha,
            diffuse_map=diffuse_map,
            emission_map=emission_map,
            opacity_map=opacity_map,
            alpha_mode="opaque" if alpha == 1.0 and opacity_map is None else "blend",
            lit=lit,
            pbr=pbr or None,
            defaults=frozenset(self.defaults),
            extras=self._extras(),
            **maps,
        )

    def _physical(self) -> tuple[dict[str, float], dict[str, Any]]:
        """The numbers of a physical surface, and its maps by the fields of ``Material``."""
        said = self.entry.statements
        physical = any(key in said or f"map_{key}" in said for key in _PBR)
        names = _PBR | _COAT if physical else {}
        self.read |= {*names, *(f"map_{key}" for key in names)}
        stated = {key: self._scalar(said[key], math.nan) for key in names if key in said}
        pbr = {
            names[key]: self._share(said[key], value)
            for key, value in stated.items()
            if not math.isnan(value)
        }
        maps: dict[str, Any] = {}
        for key, name in names.items():
            found = self._map(f"map_{key}")
            if found is None:
                continue
            if pbr.get(name, 1.0) != 1.0 and not found.image.missing:
                text = f"{said[key].keyword} {pbr[name]:g}: the map stands in its place, as Blender"
                self._note(Kind.ASSUMED, "mtl-map-factor", f"{text} writes it", said[key])
            pbr.setdefault(name, 1.0 if name == "roughness" else 0.0)  # if there is no picture
            maps[f"{name}_map"] = found if found.channel != "rgb" else replace(found, channel="r")
        if "clearcoat_roughness" in pbr:
            pbr.setdefault("clearcoat", 0.0)
        key, *again = [*(key for key in _NORMALS if key in said), ""]
        if again[1:] and said[key].text != said[again[0]].text:
            text = f"{said[again[0]].keyword} beside {said[key].keyword}, which counts"
            self._note(Kind.INVALID, "mtl-repeated", text, said[again[0]])
        normal = self._map(key)
        if normal is not None:
            scale, bias = normal_texels()
            maps["normal_map"] = replace(normal, scale=scale, bias=bias)
            if not normal.image.missing:
                self._note(Kind.ASSUMED, "normal-green", GREEN_UP, said[key])
        return pbr, maps

    def _note(self, kind: Kind, code: str, text: str, statement: _Statement | None = None) -> None:
        line = self.entry.line if statement is None else statement.line
        self.report.add(kind, code, SourceRef(self.path, line), shorten(self.entry.name), text)

    def _numbers(self, statement: _Statement) -> list[float]:
        words = statement.text.partition("#")[0].split()
        pairs = [to_float(word) for word in words]
        if any(comma for _, comma in pairs):
            text = f"{statement.keyword}: decimal commas read as points"
            self._note(Kind.REPLACED, "decimal-comma", text, statement)
        return [value for value, _ in pairs]

    def _broken(self, statement: _Statement, wanted: str, default: object) -> None:
        text = f"{statement.keyword} {shorten(statement.text)}: want {wanted}; {default} is used"
        self._note(Kind.INVALID, "mtl-number", text, statement)

    def _color(self, key: str, name: str, default: RGB) -> RGB:
        statement = self.entry.statements.get(key)
        if statement is None:
            self.defaults.add(name)
            return default
        form = statement.text.split(None, 1)[:1]
        if form and form[0].lower() in ("spectral", "xyz"):
            text = f"{statement.keyword} {form[0]}: only RGB is read; {default} is used"
            self._note(Kind.DROPPED, "mtl-color-form", text, statement)
        else:
            numbers = self._numbers(statement)
            if len(numbers) == 1:  # "Kd r" is grey
                numbers *= 3
            if len(numbers) >= 3 and all(math.isfinite(number) for number in numbers[:3]):
                if len(numbers) > 3:
                    text = f"{statement.keyword}: {len(numbers)} numbers, the first three are used"
                    self._note(Kind.DROPPED, "mtl-extra-numbers", text, statement)
                return numbers[0], numbers[1], numbers[2]
            self._broken(statement, "one or three finite numbers", default)
        self.defaults.add(name)
        return default

    def _scalar(self, statement: _Statement, default: float) -> float:
        """Its first number."""
        number = next(iter(self._numbers(statement)), math.nan)
        if math.isfinite(number):
            return number
        self._broken(statement, "a finite number", "the default")
        return default

    def _share(self, statement: _Statement, value: float) -> float:
        """A number from 0 to 1."""
        share = min(max(value, 0.0), 1.0)
        if share != value:
            self._broken(statement, "a number from 0 to 1", f"{share:g}")
        return share

    def _shininess(self, default: float) -> float:
        statement = self.entry.statements.get("ns")
        if statement is not None:
            shininess = self._scalar(statement, math.nan)
            if shininess >= 0.0:
                return shininess
            if shininess < 0.0:
                self._broken(statement, "an exponent of 0 or more", default)
        self.defaults.add("shininess")
        return default

    def _diffuse(self, default: RGB, diffuse_map: Texture | None) -> RGB:
        """Kd; not said, 1 beside a picture, and else OpenGL's default: the manual has none.

        Blender writes no Kd where there is a picture, and reads it as it is; so does three.js.
        Assimp and tinyobjloader dim it to 0.6.
        """
        diffuse = self._color("kd", "diffuse", default)
        said = self.entry.statements
        if "kd" in said:
            return diffuse
        if diffuse_map is None or diffuse_map.image.missing:
            text = f"no Kd; {list(default)} is used"
            self._note(Kind.ASSUMED, "mtl-diffuse-default", text)
            return diffuse
        text = "map_Kd without Kd: the picture is the reflectance by itself (Kd 1 1 1)"
        self._note(Kind.ASSUMED, "mtl-diffuse-factor", text, said["map_kd"])
        return 1.0, 1.0, 1.0

    def _emission(self, default: RGB, emission_map: Texture | None) -> RGB:
        emission = self._color("ke", "emission", default)
        if emission_map is None or emission_map.image.missing or "ke" in self.entry.statements:
            return emission
        text = "map_Ke without Ke: the texture is taken as the emission (Ke 1 1 1)"
        self._note(Kind.ASSUMED, "mtl-emission-factor", text)
        return 1.0, 1.0, 1.0

    def _alpha(self) -> float:
        said = self.entry.statements
        values: dict[str, float] = {}
        for key in ("d", "tr"):
            if key not in said:
                continue
            statement = said[key]
            words = statement.text.split(None, 1)
            if words and words[0].lower() == "-halo":
                self._note(Kind.DROPPED, "mtl-halo", "d -halo: read as plain d", statement)
                statement = replace(statement, text="".join(words[1:]))
            number = self._scalar(statement, math.nan)
            if not math.isnan(number):
                values[key] = number if key == "d" else 1.0 - number
        if not values:
            self.defaults.add("alpha")
            return 1.0
        alpha = values.get("d", values.get("tr", 1.0))
        if abs(alpha - values.get("tr", alpha)) > _AGREE:
            text = f"d {said['d'].text} and Tr {said['tr'].text} contradict; d is used"
            self._note(Kind.INVALID, "mtl-opacity-conflict", text, said["tr"])
        if not 0.0 <= alpha <= 1.0:
            self._note(Kind.CLAMPED, "mtl-opacity", f"opacity {alpha:g} is outside 0 to 1")
        return min(max(alpha, 0.0), 1.0)

    def _illumination(self, specular: RGB) -> tuple[RGB, bool]:
        """What ``illum`` makes of the specular colour, and whether light matters at all."""
        statement = self.entry.statements.get("illum")
        if statement is None:
            return specular, True
        model = self._scalar(statement, 2.0)
        if model == 0.0:
            return specular, False
        if model == 1.0:
            if any(specular):
                text = f"illum 1 has no highlight: Ks {specular} is set to zero"
                self._note(Kind.REPLACED, "mtl-illum", text, statement)
            return (0.0, 0.0, 0.0), True
        if model in range(3, 11):
            text = f"illum {model:g}: reflection and refraction are dropped; read as illum 2"
            self._note(Kind.DROPPED, "mtl-illum", text, statement)
        elif model != 2.0:
            text = f"illum {model:g}: want 0 to 10; read as illum 2"
            self._note(Kind.INVALID, "mtl-illum", text, statement)
        return specular, True

    def _map(self, key: str) -> Texture | None:
        statement = self.entry.statements.get(key)
        if statement is None:
            return None
        parsed = MapStatement.parse(statement.text)
        if not parsed.file:
            text = f"{statement.keyword} {shorten(statement.text)}: want a file name"
            self._note(Kind.INVALID, "mtl-map", text, statement)
            return None
        found, lost = texture(parsed, self._image(parsed.file, statement))
        channel = opacity_channel(parsed)
        if key in _ONE and channel is not None:
            found = replace(found, channel=channel)
            lost = [option for option in lost if not option.startswith("-imfchan")]
        if lost:
            text = f"{statement.keyword} {shorten(', '.join(lost), 200)}: no home for the options"
            self._note(Kind.DROPPED, "mtl-map-option", text, statement)
        return found

    def _image(self, reference: str, statement: _Statement) -> Image:
        if reference not in self.images:
            place = SourceRef(self.path, statement.line)
            beside = str(self.path.parent / reference.replace("\\", "/"))
            thing = shorten(self.entry.name)
            found = locate([reference, beside], self.resolver, place, thing)
            self.images[reference] = Image(reference, place, found)
        return self.images[reference]

    def _with_channel(self, opacity: Texture) -> Texture:
        """The manual's default is luminance; of a picture that is the colour too, it is alpha."""
        said = self.entry.statements
        parsed = MapStatement.parse(said["map_d"].text)
        channel = opacity_channel(parsed)
        color = MapStatement.parse(said["map_kd"].text).file if "map_kd" in said else ""
        if channel is None and color == parsed.file:
            channel = "a"
            text = "map_d is the picture of map_Kd: its alpha is read"
            self._note(Kind.ASSUMED, "mtl-opacity-channel", text, said["map_d"])
        return replace(opacity, channel=channel or "r")

    def _extras(self) -> dict[str, str]:
        """Statements without a home, as written, each said once in a finding."""
        said = self.entry.statements
        left = {key: statement for key, statement in said.items() if key not in self.read}
        known = [s.keyword for key, s in left.items() if key in _HOMELESS and not _neutral(s)]
        unknown = [s.keyword for key, s in left.items() if key not in _HOMELESS]
        for kind, code, words, text in (
            (Kind.DROPPED, "mtl-dropped", known, "no home, kept as metadata"),
            (Kind.INVALID, "mtl-unknown", unknown, "unknown statements, kept as metadata"),
            (Kind.INVALID, "mtl-repeated", self.entry.repeated, "said again, the last counts"),
        ):
            if words:
                self._note(kind, code, f"{shorten(', '.join(words), 200)}: {text}")
        return {statement.keyword: statement.text for statement in left.values()}


def _neutral(statement: _Statement) -> bool:
    """``Tf 1 1 1`` filters nothing."""
    words = statement.text.split()
    return statement.keyword.lower() == "tf" and bool(words) and {*map(_one, words)} == {True}


def _one(word: str) -> bool:
    return to_float(word)[0] == 1.0
