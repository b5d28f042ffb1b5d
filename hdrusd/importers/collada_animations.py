"""Node animations of COLLADA: channels that drive transform elements become sampled TRS.

COLLADA 1.4.1, chapter 5, ``animation`` and ``channel``; chapter 3 for the target's address:
``node/sid``, ``node/sid.ANGLE``, ``node/sid(3)``, ``node/sid(0)(3)``. Any element of a node may
move by itself, so the product of all is taken at the keys, and 60 times a second where keys
alone would not do, and taken apart into translation, rotation and scale.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from hdrusd.errors import InputError
from hdrusd.importers.collada_curves import Curve, read_curve
from hdrusd.importers.collada_document import LARGEST, Document, Doubles
from hdrusd.importers.collada_sources import Sources
from hdrusd.importers.collada_transforms import (
    WIDTHS,
    decompose,
    has_shear,
    matrices,
    product,
    read_transforms,
)
from hdrusd.importers.collada_xml import Element
from hdrusd.legacy.scene import TRS, Channel
from hdrusd.report import Kind

#: Samples a second between keys, as glTF's reader has for its cubic splines.
RATE = 60.0
#: A span between two keys is never cut finer, however long it claims to last.
_SAMPLES_A_KEY = 64
#: Between two keys a turn further than this, degrees, is no shortest arc to be sure of.
_FAR_TURN = 90.0

_TARGET = re.compile(r"([^/.(]+)/([^/.(]+)(?:\.(\w+)|((?:\(\d{1,4}\)){1,2}))?")
_MEMBERS = {"X": 0, "Y": 1, "Z": 2, "ANGLE": 3}


@dataclass(frozen=True, slots=True)
class _Drive:
    """A curve for some numbers of a transform element."""

    curve: Curve
    columns: tuple[int, ...]
    place: Element


class AnimationReader:
    """All channels of a document by the element that they drive."""

    def __init__(self, document: Document, sources: Sources) -> None:
        self._document = document
        self._sources = sources
        self._drives: dict[int, list[_Drive]] = {}
        self._curves: dict[int, Curve] = {}
        self._samples = 0
        self._made: dict[int, tuple[tuple[Channel, ...], TRS] | None] = {}
        for library in document.root.all("library_animations"):
            for element in library.walk():
                if element.tag == "channel":
                    self._add(element)

    def _add(self, channel: Element) -> None:
        document, target = self._document, channel.get("target")
        found = self._target(target)
        if found is None:
            text = f"animation of {target[:120]!r} dropped; want a node's transform"
            document.note(Kind.DROPPED, "animation-path", channel, "", text)
            return
        element, columns = found
        sampler = document.resolve(channel, "source", "sampler")
        if sampler is None:
            return
        try:
            curve = self._curve(sampler, target)
            if curve.values.shape[1] != len(columns):
                text = f"{curve.values.shape[1]} numbers for {len(columns)} of {target[:80]}"
                raise document.error(channel, text)
        except InputError as error:
            text = f"{error.problem}; channel dropped"
            document.report.add(Kind.INVALID, "animation-dropped", error.source, target, text)
            return
        drives = self._drives.setdefault(id(element), [])
        if any(set(drive.columns) & set(columns) for drive in drives):
            text = f"{target[:120]} is driven already; channel dropped"
            document.note(Kind.DROPPED, "animation-second", channel, "", text)
            return
        drives.append(_Drive(curve, columns, channel))

    def _curve(self, sampler: Element, thing: str) -> Curve:
        if id(sampler) not in self._curves:
            self._curves[id(sampler)] = read_curve(self._document, self._sources, sampler, thing)
        return self._curves[id(sampler)]

    def _target(self, target: str) -> tuple[Element, tuple[int, ...]] | None:
        """The transform element and which of its numbers; None for any other target."""
        match = _TARGET.fullmatch(target)
        node = None if match is None else self._document.ids.get(match[1])
        if match is None or node is None or node.tag != "node":
            return None
        sid, member, cells = match[2], match[3], match[4]
        element = next((c for c in node.children if c.get("sid") == sid), None)
        if element is None or element.tag not in WIDTHS:
            return None
        width = WIDTHS[element.tag]
        if member is None and cells is None:
            return element, tuple(range(width))
        if member is not None:
            column = _MEMBERS.get(member, width)
        else:
            numbers = [int(word) for word in re.findall(r"\d+", cells)]
            # of a matrix the column stands before the row; the file has it row by row
            column = numbers[0] if len(numbers) == 1 else 4 * numbers[1] + numbers[0]
        return (element, (column,)) if column < width else None

    # -- of one node -------------------------------------------------------------------------

    def read(self, node: Element, name: str) -> tuple[tuple[Channel, ...], TRS] | None:
        """The channels of a node and its place at the first key; None where nothing moves.

        Raises InputError past the limit of samples.
        """
        if id(node) not in self._made:
            self._made[id(node)] = self._read(node, name)
        return self._made[id(node)]

    def _read(self, node: Element, name: str) -> tuple[tuple[Channel, ...], TRS] | None:
        document = self._document
        found = read_transforms(document, node)
        drives = [drive for element, _ in found for drive in self._drives.get(id(element), ())]
        if not drives:
            return None
        times, resampled = self._times(found, drives)
        self._samples += len(times)
        if self._samples > document.limits.vertices:
            raise document.error(node, f"more than {document.limits.vertices} samples up to here")
        with np.errstate(over="ignore", invalid="ignore"):
            total = product([self._part(e, v, times) for e, v in found], len(times))
            good = (np.abs(total) <= LARGEST).all()
        if not good:
            text = "animation beyond 32-bit floats; dropped"
            document.note(Kind.INVALID, "animation-dropped", node, name, text)
            return None
        translations, rotations, scales, error = decompose(total)
        if has_shear(error):
            text = f"animated transforms with shear; off by {error:.2g} of their size at most"
            document.note(Kind.REPLACED, "collada-animation-shear", node, name, text)
        if resampled:
            text = f"curves and turns resampled at their keys and {RATE:g} times a second at most"
            document.note(Kind.REPLACED, "animation-cubic", node, name, text)
        step = all(drive.curve.stepped for drive in drives)
        return _channels(times, translations, rotations, scales, step=step), _rest(
            translations, rotations, scales
        )

    def _part(self, element: Element, values: Doubles, times: Doubles) -> Doubles:
        drives = self._drives.get(id(element))
        if not drives:
            return matrices(element.tag, values[None])
        moving = np.repeat(values[None], len(times), axis=0)
        for drive in drives:
            moving[:, drive.columns] = drive.curve.at(times)
        return matrices(element.tag, moving)

    def _times(
        self, found: list[tuple[Element, Doubles]], drives: list[_Drive]
    ) -> tuple[Doubles, bool]:
        """When to sample, and whether there is more than the keys."""
        keys = np.unique(np.concatenate([drive.curve.times for drive in drives]))
        turning = [
            drive
            for element, _ in found
            for drive in self._drives.get(id(element), ())
            if element.tag in ("rotate", "lookat", "skew")
        ]
        far = any(_turns_far(drive.curve) for drive in turning)
        curved = any(drive.curve.curved for drive in drives)
        stepped = [drive.curve.stepped for drive in drives]
        mixed = not all(stepped) and any("STEP" in drive.curve.modes[:-1] for drive in drives)
        # two turns at once, or a turn beside a mixed step, follow no shortest arc
        dense = curved or far or mixed or (len(turning) > 1 and not all(stepped))
        length = float(keys[-1] - keys[0])
        if not dense or length == 0.0:
            return keys, False
        rate = min(RATE, _SAMPLES_A_KEY * len(keys) / length)
        grid = keys[0] + np.arange(1, int(length * rate) + 1) / rate
        return np.union1d(keys, grid[grid < keys[-1]]), True


def _turns_far(curve: Curve) -> bool:
    if len(curve.times) < 2 or curve.stepped:
        return False
    return bool((np.abs(np.diff(curve.values[:, -1])) > _FAR_TURN).any())


def _channels(
    times: Doubles, translations: Doubles, rotations: Doubles, scales: Doubles, *, step: bool
) -> tuple[Channel, ...]:
    """Those of the three that change."""
    mode: Literal["linear", "step"] = "step" if step else "linear"
    made = []
    if (translations != translations[0]).any():
        made.append(Channel("translation", times, translations, mode))
    if np.abs(rotations - rotations[0]).max() > 1e-12:
        made.append(Channel("rotation", times, rotations, mode))
    if np.abs(scales - scales[0]).max() > 1e-9 * np.abs(scales).max():
        made.append(Channel("scale", times, scales, mode))
    return tuple(made)


def _rest(translations: Doubles, rotations: Doubles, scales: Doubles) -> TRS:
    x, y, z = translations[0].tolist()
    a, b, c, w = rotations[0].tolist()
    u, v, s = scales[0].tolist()
    return TRS((x, y, z), (a, b, c, w), (u, v, s))
