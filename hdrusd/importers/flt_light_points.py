"""Light points of an OpenFlight file (111, 130, faces drawn as lights): notes of their nodes.

They glow and light nothing, and have no home in a scene yet, as with OpenSceneGraph's.

Source: OpenFlight Specification 16.5, "Light Point Records", "Light Point Appearance
Palette Record", "Light Point Animation Palette Record", "Face Record" (draw types 8 to 10).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hdrusd.importers.flt_faces import POINTS, Faces, Polygons, list_offsets
from hdrusd.importers.flt_palettes import Animation, Appearance, Palettes, appearance
from hdrusd.importers.flt_records import (
    INDEXED_LIGHT_POINT,
    LIGHT_POINT,
    MORPH_LIST,
    VERTEX_LIST,
    Document,
    Grouped,
    Integers,
)
from hdrusd.importers.flt_vertices import Vertices, palette_vertices
from hdrusd.report import Kind

#: Points of one file that are noted with their place; a note is as large as 100 of their records.
_NOTED = 100_000

_WAYS = ("omnidirectional", "unidirectional", "bidirectional")
_DAY, _DUSK, _NIGHT = 0x10000, 0x8000, 0x4000
_FLASHES, _ROTATES, _NO_BACK_COLOR = 0x400000, 0x200000, 0x40000000
_ANIMATIONS = ("flashing sequence", "rotating", "strobe", "Morse code")


class LightPointReader:
    """Notes of the light points of one file, by the record that they are notes of."""

    def __init__(self, document: Document, palettes: Palettes) -> None:
        self.document = document
        self.palettes = palettes
        self._left = _NOTED
        lists = document.records.of(VERTEX_LIST, MORPH_LIST)
        parents = document.records.parent[lists]
        of_point = parents >= 0
        of_point[of_point] = np.isin(
            document.records.op[parents[of_point]], (LIGHT_POINT, INDEXED_LIGHT_POINT)
        )
        offsets, count = list_offsets(document, lists[of_point])
        self._vertices, row = palette_vertices(document, palettes, offsets)
        self._rows = Grouped(np.repeat(parents[of_point], count), row)

    def read(self, record: int, name: str) -> dict[str, Any]:
        """The notes for a light point record, with a finding; nothing where it has no points."""
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
        return self._notes(record, name, self._vertices, rows, look, animation)

    def of_faces(
        self, faces: Faces, polygons: Polygons, owner: Integers
    ) -> dict[int, dict[str, Any]]:
        """The notes for faces that are drawn as lights, by the record of their node."""
        drawn = np.isin(faces.draw[polygons.face], POINTS)
        corner = np.repeat(drawn, polygons.count)
        at = np.repeat(owner[polygons.face], polygons.count)[corner]
        vertices = Grouped(at, polygons.vertex[corner])
        made = {}
        for record in np.unique(at).tolist():
            name = self.document.text(record, 4, 8)
            found = vertices[record]
            made[record] = self._notes(record, name, polygons.vertices, found, None, None)
        return made

    def _notes(
        self,
        record: int,
        name: str,
        vertices: Vertices,
        rows: Integers,
        look: Appearance | None,
        animation: Animation | None,
    ) -> dict[str, Any]:
        rows = rows[rows >= 0]
        if not len(rows):
            return {}
        look = look or Appearance("", -1, 1.0, 0.0, 0.0, 0, (360.0, 360.0, 0.0), 0)
        times = [
            word
            for word, flag in (("day", _DAY), ("dusk", _DUSK), ("night", _NIGHT))
            if look.flags & flag
        ]
        colored = vertices.has_color[rows][:, None]
        colors = np.where(colored, vertices.color[rows], np.float32(1.0)).astype(np.float64)
        noted = min(len(rows), self._left)
        self._left -= noted
        points = tuple(
            {
                "on": not times or "night" in times,
                "position": tuple(vertices.position[row].tolist()),
                "color": (*color, 1.0),
                "intensity": look.intensity,
                "radius": 0.5 * look.size,
            }
            for row, color in zip(rows[:noted].tolist(), colors[:noted].tolist(), strict=True)
        )
        different = np.unique(colors, axis=0)
        shown = "; ".join(", ".join(f"{c:.3g}" for c in color) for color in different[:4].tolist())
        more = f" and {len(different) - 4} more" if len(different) > 4 else ""
        text = (
            f"light points have no home yet: {len(rows)} of colour {shown}{more}; "
            "kept as notes of their node"
        )
        if noted < len(rows):
            text += f", {noted} of them"
        self.document.add(Kind.DROPPED, "flt-light-points", record, name, text)
        return {"light_points": points, "light_point_look": self._look(look, animation, times)}

    def _look(
        self, look: Appearance, animation: Animation | None, times: list[str]
    ) -> dict[str, Any]:
        way = look.directionality if 0 <= look.directionality < len(_WAYS) else 0
        made: dict[str, Any] = {"directionality": _WAYS[way], "visible": times}
        if way:
            made["lobe_degrees"] = look.lobe
        if way == _WAYS.index("bidirectional"):
            made["back_intensity"] = look.back_intensity
            if not look.flags & _NO_BACK_COLOR:
                back = self.palettes.color(np.array([look.back]))[0]
                made["back_color"] = tuple(back.astype(np.float64).tolist())
        if animation is not None and 0 <= animation.type < len(_ANIMATIONS):
            made["animation"] = _ANIMATIONS[animation.type]
            made["period_s"] = animation.period
        elif look.flags & (_FLASHES | _ROTATES):
            made["animation"] = "flashing" if look.flags & _FLASHES else "rotating"
        return made
