"""Light points of an OpenFlight file (111, 130, faces drawn as lights): strings of lamps.

A beam goes along the normal of its vertex; a bidirectional point is a lamp each way. Points
that are shown by day or at dusk alone are off: the stage is the night.

Source: OpenFlight Specification 16.5, "Light Point Records", "Light Point Appearance
Palette Record", "Light Point Animation Palette Record", "Light Point System Record", "Face
Record" (draw types 8 to 10).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.importers.flt_faces import POINTS, Faces, Polygons, list_offsets
from hdrusd.importers.flt_palettes import Animation, Appearance, Palettes, appearance
from hdrusd.importers.flt_records import (
    INDEXED_LIGHT_POINT,
    LIGHT_POINT,
    LIGHT_POINT_SYSTEM,
    MORPH_LIST,
    VERTEX_LIST,
    Document,
    Grouped,
    Integers,
)
from hdrusd.importers.flt_vertices import Vertices, palette_vertices
from hdrusd.importers.light_points import ALL_SIDES, LightPoints, lobe_cone, strings
from hdrusd.legacy.scene import Light
from hdrusd.report import Kind

#: Points of one file that become lamps: they are named by 4 bytes each, and take 200.
MOST_POINTS = 1 << 22

_WAYS = ("omnidirectional", "unidirectional", "bidirectional")
_ONE_WAY, _BOTH_WAYS = 1, 2
_DAY, _DUSK, _NIGHT = 0x10000, 0x8000, 0x4000
_FLASHES, _ROTATES, _NO_BACK_COLOR = 0x400000, 0x200000, 0x40000000
_ANIMATIONS = ("flashing sequence", "rotating", "strobe", "Morse code")
_ENABLED = 0x80000000

#: How a point looks of which nothing is said.
_PLAIN = Appearance("", -1, 1.0, 0.0, 0.0, 0, (360.0, 360.0, 0.0), 0)

Doubles = npt.NDArray[np.float64]


class LightPointReader:
    """The lamps of one file, by the record of the node that they belong to."""

    def __init__(self, document: Document, palettes: Palettes) -> None:
        self.document = document
        self.palettes = palettes
        self._left = MOST_POINTS
        lists = document.records.of(VERTEX_LIST, MORPH_LIST)
        parents = document.records.parent[lists]
        of_point = parents >= 0
        of_point[of_point] = np.isin(
            document.records.op[parents[of_point]], (LIGHT_POINT, INDEXED_LIGHT_POINT)
        )
        offsets, count = list_offsets(document, lists[of_point])
        self._vertices, row = palette_vertices(document, palettes, offsets)
        self._rows = Grouped(np.repeat(parents[of_point], count), row)

    def read(self, record: int, name: str) -> list[Light]:
        """The lamps of a light point record; none where it has no points."""
        rows = self._rows[record]
        if self.document.records.op[record] == LIGHT_POINT:
            look: Appearance | None = appearance(self.document, record, 12, name)
            animation = None
        else:
            first, second = self.document.integers(record, 12, "2i")
            look, animation = (
                self.palettes.appearances.get(first),
                self.palettes.animations.get(second),
            )
            if look is None:
                text = f"appearance {first} is not in the palette"
                self.document.add(Kind.MISSING, "flt-palette-entry", record, name, text)
            elif look.name:  # as a photometry file may call all lamps of a make
                name = look.name
        return self._lamps(record, name, self._vertices, rows, look or _PLAIN, animation)

    def of_faces(self, faces: Faces, polygons: Polygons, owner: Integers) -> dict[int, list[Light]]:
        """The lamps of faces that are drawn as lights, by the record of their node."""
        drawn = np.isin(faces.draw[polygons.face], POINTS)
        corner = np.repeat(drawn, polygons.count)
        at = np.repeat(owner[polygons.face], polygons.count)[corner]
        vertices = Grouped(at, polygons.vertex[corner])
        made = {}
        for record in np.unique(at).tolist():
            name = self.document.text(record, 4, 8)
            found = vertices[record]
            made[record] = self._lamps(record, name, polygons.vertices, found, _PLAIN, None)
        return made

    def _lamps(
        self,
        record: int,
        name: str,
        vertices: Vertices,
        rows: Integers,
        look: Appearance,
        animation: Animation | None,
    ) -> list[Light]:
        rows = rows[rows >= 0]
        if len(rows) > self._left:
            text = f"{len(rows)} light points, {self._left} of them kept: {MOST_POINTS} a file"
            self._add(Kind.DROPPED, "light-point-limit", record, name, text)
            rows = rows[: self._left]
        self._left -= len(rows)
        if not len(rows):
            return []
        times = [
            word
            for word, flag in (("day", _DAY), ("dusk", _DUSK), ("night", _NIGHT))
            if look.flags & flag
        ]
        power, enabled = self._system(record)
        on = enabled and (not times or "night" in times)
        notes = self._notes(record, name, look, animation, times)
        cutoff = self._beam(record, name, look, vertices, rows)
        colored = vertices.has_color[rows][:, None]
        colors = np.where(colored, vertices.color[rows], np.float32(1.0)).astype(np.float64)
        normals = vertices.normal[rows].astype(np.float64)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        ways = normals / np.where(length > 0.0, length, 1.0)
        front = self._points(vertices, rows, colors, look.intensity * power, look, cutoff, ways, on)
        both = look.directionality == _BOTH_WAYS and look.back_intensity > 0.0
        sides = [(name, front)]
        beamed = cutoff < ALL_SIDES
        if both and beamed.any():
            rows, back = rows[beamed], colors[beamed]
            if not look.flags & _NO_BACK_COLOR:
                shade = self.palettes.color(np.array([look.back]))[0].astype(np.float64)
                back = np.broadcast_to(shade, back.shape)
            strength = look.back_intensity * power
            behind = self._points(
                vertices, rows, back, strength, look, cutoff[beamed], -ways[beamed], on
            )
            sides.append((f"{name}_back", behind))
        made: list[Light] = []
        for side, points in sides:
            lights, rounded = strings(points, side, self.document.ref(record), lambda _: notes)
            made += lights
            if rounded:
                text = f"light points of more colours than lamps have; rounded to {len(lights)}"
                self._add(Kind.REPLACED, "light-point-colours", record, name, text)
        return made

    def _points(
        self,
        vertices: Vertices,
        rows: Integers,
        colors: Doubles,
        intensity: float,
        look: Appearance,
        cutoff: Doubles,
        ways: Doubles,
        on: bool,
    ) -> LightPoints:
        def each(value: float) -> Doubles:
            return np.full(len(rows), value)

        return LightPoints(
            vertices.position[rows],
            colors,
            each(max(intensity, 0.0)),
            each(max(0.5 * look.size, 0.0)),
            cutoff,
            cutoff,
            ways,
            np.full(len(rows), on),
        )

    def _beam(
        self, record: int, name: str, look: Appearance, vertices: Vertices, rows: Integers
    ) -> Doubles:
        """Half-angles of the beams, (n,) degrees; what has no normal shines to all sides."""
        cutoff = np.full(len(rows), ALL_SIDES)
        if look.directionality not in (_ONE_WAY, _BOTH_WAYS):
            return cutoff
        horizontal, vertical, _ = look.lobe
        if not min(horizontal, vertical) > 0.0:
            text = f"lobe of {horizontal:g} x {vertical:g} degrees; shines to all sides"
            self._add(Kind.INVALID, "light-point-lobe", record, name, text)
            return cutoff
        aimed = vertices.has_normal[rows]
        if not aimed.all():
            text = f"{np.count_nonzero(~aimed)} beams without a normal; they shine to all sides"
            self._add(Kind.ASSUMED, "light-point-beam", record, name, text)
        cone = lobe_cone(0.5 * horizontal, 0.5 * vertical)
        if horizontal != vertical:
            text = (
                f"lobe of {horizontal:g} x {vertical:g} degrees; "
                f"a round one of {2.0 * cone:.3g}, as large"
            )
            self._add(Kind.REPLACED, "light-point-lobe", record, name, text)
        cutoff[aimed] = cone
        return cutoff

    def _system(self, record: int) -> tuple[float, bool]:
        """Intensity of the light point system that a record stands in, and whether it is on."""
        above = int(self.document.records.parent[record])
        if above < 0 or self.document.records.op[above] != LIGHT_POINT_SYSTEM:
            return 1.0, True
        (intensity,) = self.document.numbers(above, 12, "f", (1.0,))
        (flags,) = self.document.integers(above, 20, "I")
        return max(intensity, 0.0), bool(flags & _ENABLED)

    def _notes(
        self,
        record: int,
        name: str,
        look: Appearance,
        animation: Animation | None,
        times: list[str],
    ) -> dict[str, Any]:
        """What the file says of the points and a lamp does not hold."""
        way = look.directionality if 0 <= look.directionality < len(_WAYS) else 0
        made: dict[str, Any] = {"directionality": _WAYS[way], "visible": times}
        if way:
            made["lobe_degrees"] = look.lobe
        if way == _BOTH_WAYS:
            made["back_intensity"] = look.back_intensity
        if animation is not None and 0 <= animation.type < len(_ANIMATIONS):
            made["animation"] = _ANIMATIONS[animation.type]
            made["period_s"] = animation.period
        elif look.flags & (_FLASHES | _ROTATES):
            made["animation"] = "flashing" if look.flags & _FLASHES else "rotating"
        if "animation" in made:
            text = f"{made['animation']}; lit all the time"
            self._add(Kind.DROPPED, "light-point-animation", record, name, text)
        return made

    def _add(self, kind: Kind, code: str, record: int, name: str, text: str) -> None:
        self.document.add(kind, code, record, name, text)
