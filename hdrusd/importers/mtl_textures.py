"""Texture statements of MTL: options, file names with blanks, and where the file is.

Source: Alias|Wavefront, MTL material format, version 4.2, "Texture map statements".
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from hdrusd.errors import SourceRef
from hdrusd.importers.importer import Resolver
from hdrusd.importers.obj_text import shorten, to_float
from hdrusd.legacy.scene import Image, Texture, UVTransform, Wrap
from hdrusd.report import Kind, Report

Channel = Literal["rgb", "r", "g", "b", "a"]

#: No file system takes a longer path; what is longer is not looked for.
LONGEST = 4096

#: Option to the most arguments that it takes, of which the first is required.
_NUMBERS = {"-o": 3, "-s": 3, "-t": 3, "-mm": 2, "-bm": 1, "-boost": 1, "-texres": 1}
_WORDS = {
    "-clamp": {"on", "off"},
    "-blendu": {"on", "off"},
    "-blendv": {"on", "off"},
    "-cc": {"on", "off"},
    "-imfchan": {"r", "g", "b", "m", "l", "z"},
    "-type": None,
    "-colorspace": None,
}
#: Values that change nothing, so that nothing is lost with them.
_NEUTRAL = {
    "-t": ("0", "0 0", "0 0 0"),
    "-mm": ("0 1",),
    "-bm": ("1",),
    "-blendu": ("on",),
    "-blendv": ("on",),
    "-cc": ("off",),
    "-clamp": ("on", "off"),
    "-colorspace": ("srgb",),
}
#: m is the matte, and l the luminance: that of a grey picture is its red.
_CHANNELS: dict[str, Channel] = {"r": "r", "g": "g", "b": "b", "m": "a", "l": "r"}


@dataclass(frozen=True, slots=True)
class MapStatement:
    """``map_Kd -s 2 2 1 my file.png`` taken apart: the file, and words by option."""

    file: str
    options: dict[str, list[str]]

    @classmethod
    def parse(cls, text: str) -> MapStatement:
        """Options may stand on either side of the file name, and the name may have blanks."""
        words = list(re.finditer(r"\S+", text))
        options: dict[str, list[str]] = {}
        begin, end, at = 0, 0, 0
        while at < len(words):
            option = words[at][0].lower()
            if option not in _NUMBERS and option not in _WORDS:
                begin, end = (begin if end else words[at].start()), words[at].end()
                at += 1
                continue
            at += 1
            taken: list[str] = []
            while at < len(words) and _takes(option, len(taken), words[at][0]):
                taken.append(words[at][0])
                at += 1
            options[option] = taken
        return cls(text[begin:end].strip('"'), options)


def _takes(option: str, taken: int, word: str) -> bool:
    if option in _NUMBERS:
        return taken < _NUMBERS[option] and not math.isnan(to_float(word)[0])
    allowed = _WORDS[option]
    return taken == 0 and (allowed is None or word.lower() in allowed)


def texture(statement: MapStatement, image: Image) -> tuple[Texture, list[str]]:
    """The use of ``image``, and the options that have no home, as written.

    ``-s`` and ``-o`` are applied as exporters and viewers agree, uv' = s uv + o;
    the manual's own words ("expands or shrinks the pattern") can be read both ways.
    """
    lost = []
    for option, words in statement.options.items():
        if " ".join(_plain(word) for word in words) not in _NEUTRAL.get(option, ()):
            lost.append(" ".join([option, *words]))
    scale, offset = (1.0, 1.0), (0.0, 0.0)
    for option, neutral in (("-s", 1.0), ("-o", 0.0)):
        words = statement.options.get(option, [])
        numbers = [to_float(word)[0] for word in words] + [neutral] * (3 - len(words))
        if not words or not all(math.isfinite(number) for number in numbers):
            continue
        lost.remove(" ".join([option, *words]))
        if numbers[2] != neutral:
            lost.append(f"{option} {words[2]} in depth")
        if option == "-s":
            scale = (numbers[0], numbers[1])
        else:
            offset = (numbers[0], numbers[1])
    moved = scale != (1.0, 1.0) or offset != (0.0, 0.0)
    clamp = "".join(statement.options.get("-clamp", [])).lower() == "on"
    wrap: Wrap = "clamp" if clamp else "repeat"
    transform = UVTransform(scale=scale, translation=offset) if moved else None
    return Texture(image, wrap_s=wrap, wrap_t=wrap, transform=transform), lost


def _plain(word: str) -> str:
    """``0.000`` as ``0``, for comparison."""
    value = to_float(word)[0]
    return word.lower() if math.isnan(value) else f"{value:g}"


def opacity_channel(statement: MapStatement) -> Channel | None:
    """The channel that ``-imfchan`` asks for; None without it or for depth."""
    return _CHANNELS.get("".join(statement.options.get("-imfchan", [])).lower())


def locate(
    references: Sequence[str], resolver: Resolver, place: SourceRef, thing: str
) -> Path | None:
    """The file that the first of ``references`` names; one finding if none does.

    A file that is exactly where a later reference says goes before one that an
    earlier reference finds elsewhere by its base name.
    """
    if len(references[0]) > LONGEST:
        text = f"{shorten(references[0])}: not a file name"
        resolver.report.add(Kind.MISSING, "file-missing", place, thing, text)
        return None
    elsewhere: tuple[Path, Report] | None = None
    for reference in references:
        trial = replace(resolver, report=Report())
        found = trial.find(reference, place, thing=thing)
        if found is not None and _is_as_written(reference, found, resolver):
            return found
        if found is not None and elsewhere is None:
            elsewhere = found, trial.report
    if elsewhere is None:
        return resolver.find(references[0], place, thing=thing)
    for finding in elsewhere[1]:
        resolver.report.add(finding.kind, finding.code, finding.source, finding.thing, finding.text)
    return elsewhere[0]


def _is_as_written(reference: str, found: Path, resolver: Resolver) -> bool:
    written = resolver.source.parent / reference.strip().replace("\\", "/")
    try:
        return written.samefile(found)
    except (OSError, ValueError):  # not there, or no name for this file system
        return False
