"""A first photometry file, as TOML with what speaks for each number beside it.

What is certain to be a lamp is an entry with the typical value of its class; what is only
suspected stands there as a comment. All of it is "estimated" until a person says better.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from textwrap import wrap

from hdrusd.errors import one_line
from hdrusd.photometry.lamp_classes import LampClass
from hdrusd.photometry.recipe_entry import quoted
from hdrusd.recipe.lead import Lead

_WIDTH = 96

_HEAD = """\
Photometry of {name}: a first proposal, to be edited.

What is known for sure, from a photometer, a data sheet or a plan, goes in place of these
numbers, with provenance = "measured" or "authored" and its source. Entries that begin with #
are suspicions; without the # they count. The first entry of a section that fits is used, but
every [[lamp]] adds its lamps. Keys: docs/concept-mapping.md of hdrusd."""

_SKY = """\
A night without a moon; or moonlit, dusk, overcast-day, clear-sun, ... or illuminance = lx."""

_UNITS = {"candela": "cd", "lumens": "lm", "luminance": "cd/m2"}


def recipe(
    name: str, found: Sequence[Lead], *, unit_m: float | None = None, up: str | None = None
) -> str:
    """The text of a photometry file for the database ``name``; its unit and axis where stated."""
    parts = [_comment(_HEAD.format(name=one_line(name)))]
    stated = [f"unit = {unit_m!r}  # m"] if unit_m else []
    stated += [f"up = {quoted(up)}"] if up else []
    if stated:
        parts.append("\n".join(["[source]", *stated]))
    parts.append(_comment(_SKY) + '\n[ambient]\npreset = "moonless"')
    parts.extend(_entry(lead) for lead in found)
    if not found:
        parts.append(_comment("Nothing in it looks like a lamp; [[lamp]] entries place some."))
    return "\n\n".join(parts) + "\n"


def _entry(lead: Lead) -> str:
    kind = lead.kind
    rows = [f"[[{lead.section}]]"]
    if lead.pattern:
        rows.append(f"match = {quoted(lead.pattern)}")
    elif lead.at:
        rows.append(f"at = {[list(point) for point in lead.at]}  # {lead.where}")
    else:
        return _comment(_why(lead))  # nothing that an entry could be for
    if lead.twin:
        rows.append("enabled = false")
    if lead.offset is not None:
        rows.append(f"offset = {list(lead.offset)}  # {lead.where}")
    if kind is None and not lead.twin:
        key = "luminance" if lead.section == "material" else "candela"
        key = "illuminance" if lead.found == "directional light" else key
        rows.append(f"{key} = 0  # want a number")
        if lead.section == "material" and not lead.certain:
            rows.append("hdr_texture = true  # it shines as its picture does")
    elif kind is not None:
        rows += _values(lead, kind)
    body = "\n".join(rows if lead.counts else [f"# {row}" for row in rows])
    return f"{_comment(_why(lead))}\n{body}"


def _values(lead: Lead, kind: LampClass) -> Iterator[str]:
    yield f"{kind.key} = {kind.typical:.10g}"
    if kind.lamp and lead.section != "material":
        yield f"lamp = {quoted(kind.lamp)}"
    elif kind.color is not None and lead.section != "material":
        yield f"color = [{', '.join(f'{c:g}' for c in kind.color)}]"
    yield 'provenance = "estimated"'
    yield f"source = {quoted(f'class {kind.name}: {kind.source}')}"


def _why(lead: Lead) -> str:
    count = f"{lead.count} x " if lead.count > 1 else ""
    kind = lead.kind
    if lead.twin:
        what = f"they stand where lights are; the same lamps? Then {lead.pattern} may go"
        return f"{count}{lead.found}: {what}."
    if kind is None:
        level = "what it is is not told" if lead.certain else "suspected"
        text = f"{count}{lead.found}: {lead.reason}; {level}."
    else:
        level = "low" if lead.certain else "none"
        text = (
            f"{count}{lead.found}, taken for {kind.name}: {lead.reason}. Such have "
            f"{kind.least:g} to {kind.most:g} {_UNITS[kind.key]} ({kind.source}). "
            f"Confidence: {level}."
        )
    if len(lead.strength) > 1:
        least, most = lead.strength[0], lead.strength[-1]
        text += f" Their colours differ, {least:.3g} to {most:.3g}: not all may be alike."
    return text


def _comment(text: str) -> str:
    """Comment lines; empty ones part paragraphs."""
    lines: list[str] = []
    for paragraph in text.split("\n\n"):
        if lines:
            lines.append("#")
        flat = one_line(" ".join(paragraph.split()))
        lines += [f"# {line}" for line in wrap(flat, _WIDTH - 2, break_long_words=False)]
    return "\n".join(lines)
