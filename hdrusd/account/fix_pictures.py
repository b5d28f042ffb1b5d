"""What to fix first of the pictures: those that are not shown, or lie about unused."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from shlex import quote
from urllib.parse import unquote

from hdrusd.account.fix import COMMAND, SOURCE, Entry, Row, Scene, few, percent
from hdrusd.errors import SourceRef

#: White stands in for a picture that is not there: real surfaces have a third of it.
_LOST = 0.5

#: What a finding says of the root that would allow a file.
_ROOT = re.compile(r"--root (.+) would allow it$")


def lost(scene: Scene) -> Iterator[Entry]:
    """Pictures that are not there, lie outside the roots or cannot be decoded."""
    missing = [row for row in scene.images if row["missing"]]
    roots = _refused(scene, missing)
    refused = [row for row, root in zip(missing, roots, strict=True) if root is not None]
    gone = [row for row, root in zip(missing, roots, strict=True) if root is None]
    broken = [row for row in scene.images if row["broken"]]
    declare = " ".join(dict.fromkeys(root for root in roots if root)) or "--root FOLDER"
    for rows, said, where, write in (
        (gone, "missing texture", COMMAND, "--search-path FOLDER"),
        (refused, "texture outside the declared roots", COMMAND, declare),
        (broken, "broken texture", SOURCE, None),
    ):
        if not rows:
            continue
        share = min(sum(row["share"] for row in rows), 1.0)
        noun, _, rest = said.partition("texture")
        many = f"textures{rest}" if len(rows) > 1 else f"texture{rest}"
        what = f"{len(rows)} {noun}{many}: {few([row['name'] for row in rows])}"
        why = f"worn by {percent(share)} of the surface, which has its plain colour instead"
        yield Entry(max(share, 0.05) * _LOST, what, why, where, write)


def _refused(scene: Scene, rows: Sequence[Row]) -> list[str | None]:
    """Of missing pictures that lie outside the roots the option that allows them, "" where none
    can; None for the others.
    """
    said: dict[str, list[tuple[str, str]]] = defaultdict(list)
    unlisted = set()  # codes of findings of which there are more than are listed
    for finding in scene.findings:
        code, text = finding["code"], finding["text"]
        if code in ("file-refused", "file-missing"):
            place = str(SourceRef(Path(finding["file"]), finding["place"]))
            said[place].append((code, text))
            if not finding["thing"] and finding["place"] is None:
                unlisted.add(code)
    found: list[str | None] = []
    for row in rows:
        file = unquote(row["name"]).replace("\\", "/").rpartition("/")[2]
        told = [(code, text) for code, text in said[row["place"]] if file in unquote(text)]
        codes = {code for code, _ in told} or unlisted
        root = next((r[1] for _, text in told if (r := _ROOT.search(text))), None)
        option = f"--root {quote(root)}" if root else ""
        found.append(option if codes == {"file-refused"} else None)
    return found


def unused(scene: Scene) -> Iterator[Entry]:
    """Pictures that speak of light and are not used."""
    for row in scene.images:
        if row["class"] == "unused" and row["meant"] == "emission":
            what = f"{row['name']}: its name speaks of light, and nothing uses it"
            named = ", ".join(row["materials"][:3])
            why = f"lamps of {named} may be dark"
            yield Entry(0.5, what, why, SOURCE, None)
