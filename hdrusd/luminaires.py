"""The photometric files of a conversion: found, read, and copied beside the stage."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path, PurePosixPath

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.importer import Resolver
from hdrusd.photometry.eulumdat import read_eulumdat
from hdrusd.photometry.ies import is_ies, parse_ies, with_tilt
from hdrusd.photometry.interpret import LuminaireFile
from hdrusd.photometry.luminaire import MOST_BYTES
from hdrusd.photometry.recipe_keys import note_file_rivals
from hdrusd.photometry.sidecar import Rule
from hdrusd.report import Kind, Report


class LuminaireFiles:
    """Copies into ``folder``, which the layers call ``prefix``; each file is read once.

    ``resolver``: of the photometry file, whose names are relative to it.
    """

    def __init__(self, folder: Path, prefix: str, resolver: Resolver, report: Report) -> None:
        self.folder = folder
        self.prefix = prefix
        self.resolver = resolver
        self.report = report
        self.written: dict[str, dict[str, object]] = {}  # file -> what it is, for the report
        self._known: dict[str, LuminaireFile | None] = {}
        self._told: set[SourceRef] = set()  # the rules whose rivals are findings

    def use(self, rule: Rule) -> LuminaireFile | None:
        """The luminaire that a rule's ``ies`` names; None, with a finding, without it."""
        reference, place = str(rule.values["ies"]), rule.place
        if reference not in self._known:
            path = self.resolver.find(reference, place, thing="ies")
            self._known[reference] = None if path is None else self._read(path, place)
        file = self._known[reference]
        if place not in self._told:
            self._told.add(place)
            note_file_rivals(rule.values, file is not None, place, self.report)
        return file

    def _read(self, path: Path, place: SourceRef) -> LuminaireFile | None:
        def tilt(name: str) -> bytes | None:
            beside = path.parent / PurePosixPath(name.replace("\\", "/")).name
            try:
                return self._bytes(beside) if self.resolver.allowed(beside) else None
            except (OSError, ValueError):  # a name too long or unspeakable
                return None

        source = SourceRef(path)
        try:
            data = self._bytes(path)
            lamp = is_ies(data) or path.suffix.lower() == ".ies"
            if lamp:
                file = parse_ies(data, source, self.report, tilt)
                luminaire = file.luminaire(source, self.report)
                data = with_tilt(data, file)
            else:
                luminaire = read_eulumdat(data, source, self.report)
        except InputError as problem:
            text = f"{problem}; not used"
            self.report.add(Kind.INVALID, "profile-invalid", place, "ies", text)
            return None
        if not lamp:
            text = "EULUMDAT, which UsdLux does not name: other renderers may not read it"
            self.report.add(Kind.ASSUMED, "profile-eulumdat", source, luminaire.name, text)
        name = _name(path, data, ".ies" if lamp else ".ldt")
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / name).write_bytes(data)
        self.written[name] = {
            "kind": "photometric",
            "image": path.name,
            "luminaire": luminaire.name,
            "flux_lm": luminaire.flux(),
        }
        return LuminaireFile(f"{self.prefix}/{name}", luminaire)

    def _bytes(self, path: Path) -> bytes:
        """Raises InputError."""
        if path.stat().st_size > MOST_BYTES:
            raise InputError(path, f"want at most {MOST_BYTES} bytes")
        return self.resolver.read(path)


def _name(path: Path, data: bytes, suffix: str) -> str:
    stem = re.sub(r"[^A-Za-z0-9_-]+", "_", path.stem)[:48].strip("_") or "luminaire"
    return f"{stem}_{hashlib.sha256(data).hexdigest()[:8]}{suffix}"
