"""Animation curves of COLLADA: samplers read, and evaluated at any moments.

COLLADA 1.4.1, chapter 5, ``sampler``, and chapter 4, "Curve Interpolation": LINEAR, STEP, BEZIER
and HERMITE. A Bezier segment is a curve in time and value; its time is inverted by halving.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdrusd.errors import InputError
from hdrusd.importers.collada_document import LARGEST, Document, Doubles
from hdrusd.importers.collada_sources import Sources
from hdrusd.importers.collada_xml import Element
from hdrusd.report import Kind

#: Halvings of a Bezier segment's parameter: 2^-40 of it is left.
_HALVINGS = 40
_MODES = ("LINEAR", "STEP", "BEZIER", "HERMITE")


@dataclass(frozen=True, slots=True)
class Curve:
    """times: (k,) seconds, rising; values: (k, n); of each key the mode of what follows.

    ``into``, ``out``: (k, n, 2) control points, time and value; for HERMITE tangents of values.
    """

    times: Doubles
    values: Doubles
    modes: tuple[str, ...]
    into: Doubles | None = None
    out: Doubles | None = None

    @property
    def curved(self) -> bool:
        """Whether some segment is neither linear nor a step."""
        return any(mode in ("BEZIER", "HERMITE") for mode in self.modes[:-1])

    @property
    def stepped(self) -> bool:
        """Whether all segments are steps."""
        return len(self.modes) > 1 and all(mode == "STEP" for mode in self.modes[:-1])

    def at(self, times: Doubles) -> Doubles:
        """(m, n) values; before the first key and after the last, those of the keys."""
        times = np.clip(times, self.times[0], self.times[-1])
        if len(self.times) == 1:
            return np.repeat(self.values, len(times), axis=0)
        span = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.times) - 2)
        begin, end = self.times[span], self.times[span + 1]
        share = ((times - begin) / (end - begin))[:, None]
        first, last = self.values[span], self.values[span + 1]
        result = first + share * (last - first)
        modes = np.array(self.modes)[span]
        step = (modes == "STEP") & (share[:, 0] < 1.0)
        result[step] = first[step]
        if self.into is None or self.out is None:
            return result
        hermite = modes == "HERMITE"
        if hermite.any():
            s = share[hermite]
            out, into = self.out[span, :, 1][hermite], self.into[span + 1, :, 1][hermite]
            result[hermite] = (
                (2.0 * s**3 - 3.0 * s**2 + 1.0) * first[hermite]
                + (s**3 - 2.0 * s**2 + s) * out
                + (3.0 * s**2 - 2.0 * s**3) * last[hermite]
                + (s**3 - s**2) * into
            )
        bezier = modes == "BEZIER"
        if bezier.any():
            out, into = self.out[span][bezier], self.into[span + 1][bezier]
            result[bezier] = _bezier(
                times[bezier], begin[bezier], end[bezier], first[bezier], last[bezier], out, into
            )
        return result


def _bezier(
    times: Doubles,
    begin: Doubles,
    end: Doubles,
    first: Doubles,
    last: Doubles,
    out: Doubles,
    into: Doubles,
) -> Doubles:
    """(m, n) values of cubic Bezier segments; out, into: (m, n, 2) their inner points."""
    low, high = np.zeros_like(first), np.ones_like(first)
    t0, t3 = begin[:, None], end[:, None]
    # control points are held between the keys, so that time only runs forward
    t1, t2 = np.clip(out[:, :, 0], t0, t3), np.clip(into[:, :, 0], t0, t3)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        early = _cubic(middle, t0, t1, t2, t3) < times[:, None]
        low, high = np.where(early, middle, low), np.where(early, high, middle)
    return _cubic(0.5 * (low + high), first, out[:, :, 1], into[:, :, 1], last)


def _cubic(s: Doubles, a: Doubles, b: Doubles, c: Doubles, d: Doubles) -> Doubles:
    r = 1.0 - s
    return r * r * r * a + 3.0 * r * r * s * b + 3.0 * r * s * s * c + s * s * s * d


def read_curve(document: Document, sources: Sources, sampler: Element, thing: str) -> Curve:
    """The curve of a sampler. Raises InputError where times and values do not fit."""
    found: dict[str, Element] = {}
    for item in sampler.all("input"):
        source = document.resolve(item, "source", "source")
        if source is not None:
            found.setdefault(item.get("semantic"), source)
    if "INPUT" not in found or "OUTPUT" not in found:
        raise document.error(sampler, "no usable INPUT and OUTPUT")
    inputs = sources.table(found["INPUT"])
    values = sources.table(found["OUTPUT"])
    if inputs.shape[1] != 1 or not len(inputs):
        raise document.error(sampler, "INPUT without times")
    times = inputs[:, 0]
    if len(values) < len(times):
        text = f"{len(values)} values for {len(times)} times"
        raise document.error(sampler, f"{text}; want as many")
    values = values[: len(times)]
    finite = (np.abs(values) <= LARGEST).all() and (np.abs(times) <= 1e9).all()
    if not finite:
        raise document.error(sampler, "times or values that are not finite")
    if (np.diff(times) <= 0.0).any():
        raise document.error(sampler, "times that do not rise")
    modes = _modes(document, sources, sampler, found.get("INTERPOLATION"), len(times), thing)
    shape = len(times), values.shape[1]
    into = _tangents(document, sources, found.get("IN_TANGENT"), times, shape, -1.0)
    out = _tangents(document, sources, found.get("OUT_TANGENT"), times, shape, 1.0)
    if (into is None or out is None) and any(m in ("BEZIER", "HERMITE") for m in modes):
        text = "BEZIER or HERMITE without usable tangents; LINEAR is used"
        document.note(Kind.INVALID, "animation-interpolation", sampler, thing, text)
        modes = tuple("STEP" if mode == "STEP" else "LINEAR" for mode in modes)
        into = out = None
    return Curve(times, values, modes, into, out)


def _modes(
    document: Document,
    sources: Sources,
    sampler: Element,
    source: Element | None,
    count: int,
    thing: str,
) -> tuple[str, ...]:
    words = [] if source is None else sources.names(source)[:count]
    unknown = sorted({word for word in words if word not in _MODES})
    if unknown or len(words) < count:
        what = f"interpolation {', '.join(unknown)[:80]}" if unknown else "no interpolation stated"
        text = f"{what}; LINEAR is used"
        document.note(Kind.INVALID, "animation-interpolation", sampler, thing, text)
    words += ["LINEAR"] * (count - len(words))
    return tuple(word if word in _MODES else "LINEAR" for word in words)


def _tangents(
    document: Document,
    sources: Sources,
    source: Element | None,
    times: Doubles,
    shape: tuple[int, int],
    side: float,
) -> Doubles | None:
    """(k, n, 2); version 1.4.0 has values alone, whose times are a third of the segment."""
    if source is None:
        return None
    try:
        table = sources.table(source)
    except InputError:
        return None
    count, width = shape
    numbers = table[:count]
    if len(numbers) < count or not (np.abs(numbers) <= LARGEST).all():
        return None
    if numbers.shape[1] == 2 * width:
        return numbers.reshape(count, width, 2)
    if numbers.shape[1] != width:
        return None
    spans = np.diff(times)
    third = np.concatenate([spans, spans[-1:]] if side > 0.0 else [spans[:1], spans]) / 3.0
    if len(third) != count:  # a single key has no segment
        return None
    made = np.empty((count, width, 2))
    made[:, :, 0] = (times + side * third)[:, None]
    made[:, :, 1] = numbers
    return made
