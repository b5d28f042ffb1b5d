"""osgSim::LightPointNode of an OpenSceneGraph file: strings of lamps.

A sector says from where a point is seen. A cone is a beam, and so is a directional sector,
whose two full angles make a round one; ranges of azimuth and elevation are no beam. Angles
are radians.

Sources: OpenSceneGraph 3.6, src/osgWrappers/serializers/osgSim (LightPointNode.cpp,
ConeSector.cpp, DirectionalSector.cpp), src/osgWrappers/deprecated-dotosg/osgSim
(IO_LightPoint.cpp, IO_Sector.cpp), src/osgSim/Sector.cpp.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdrusd.importers.light_points import ALL_SIDES, LightPoints, lobe_cone, strings
from hdrusd.importers.osg_text import Document, Statement
from hdrusd.legacy.scene import Light, Vec3
from hdrusd.report import Kind

_BEAMS = ("ConeSector", "DirectionalSector")
_SECTORS = (*_BEAMS, "AzimSector", "ElevationSector", "AzimElevationSector")
_DOWN: Vec3 = (0.0, 0.0, -1.0)


@dataclass(frozen=True, slots=True)
class _Sector:
    """A beam, degrees; ``notes``: as the file has it."""

    cutoff: float = ALL_SIDES
    inner: float = ALL_SIDES
    direction: Vec3 = _DOWN
    notes: tuple[Any, ...] = ()


class LightPointReader:
    """Reads the light point nodes of one file into ``lights``; a shared node has its lamps once."""

    def __init__(self, document: Document, lights: list[Light]) -> None:
        self.document = document
        self.lights = lights
        self._known: dict[int, list[int]] = {}
        self._sectors: dict[int, _Sector] = {}
        self._said: set[tuple[str, str]] = set()  # of which node what has been said of a sector

    def read(self, node: Statement, name: str) -> list[int]:
        """The numbers of a node's strings of lamps."""
        if id(node) not in self._known:
            found = self._strings(node, name)
            self._known[id(node)] = list(range(len(self.lights), len(self.lights) + len(found)))
            self.lights += found
        return self._known[id(node)]

    def _strings(self, node: Statement, name: str) -> list[Light]:
        document = self.document
        listed = document.field(node, "lightpointlist")
        holder = listed if listed is not None else node
        places = holder.block.statements if holder.block is not None else []
        places = [place for place in places if place.key == "lightpoint"]
        if not places:
            return []
        rows = [self._attributes(place) for place in places]
        sectors = [self._sector(place, name) for place in places]
        blinking = sum(self._blinks(place) for place in places)
        if blinking:
            text = f"{blinking} of {len(places)} light points blink; lit all the time"
            document.add(Kind.DROPPED, "light-point-animation", node, name, text)
        values = np.array(rows, np.float64)
        points = LightPoints(
            np.array([document.numbers(p, 3, "position") or (0.0,) * 3 for p in places]),
            np.array([(document.numbers(p, 4, "color") or (1.0,) * 4)[:3] for p in places]),
            np.maximum(values[:, 1], 0.0),
            np.maximum(values[:, 2], 0.0),
            np.array([sector.cutoff for sector in sectors]),
            np.array([sector.inner for sector in sectors]),
            np.array([sector.direction for sector in sectors]),
            values[:, 0] > 0.0,
        )

        def notes(row: int) -> dict[str, Any]:
            sector = sectors[row].notes
            return {"sector": sector} if sector else {}

        made, rounded = strings(points, name, document.ref(node), notes)
        if rounded:
            text = f"light points of more looks than lamps have; rounded to {len(made)}"
            document.add(Kind.REPLACED, "light-point-colours", node, name, text)
        return made

    def _attributes(self, place: Statement) -> tuple[float, float, float]:
        """1 if on, intensity, radius; ``Attributes TRUE 1 0.4 0.05`` in .osgt, 1 a blend mode."""
        found = self.document.field(place, "attributes")
        if found is None:
            on = self.document.word(place, "ison") != "FALSE"
            intensity = self.document.number(place, 1.0, "intensity")
            return float(on), intensity, self.document.number(place, 1.0, "radius")
        values = [_finite(word, 1.0) for word in found.words[3:5]]
        values += [1.0] * (2 - len(values))
        return float(found.words[1:2] != ["FALSE"]), values[0], values[1]

    def _blinks(self, place: Statement) -> bool:
        """BlinkSequence, in .osgt on the line of the sector where that is FALSE."""
        if self.document.object(place, "blinksequence") is not None:
            return True
        field = self.document.field(place, "sector")
        words = [] if field is None else [word.lower() for word in field.words]
        return (
            "true" in words[words.index("blinksequence") :] if "blinksequence" in words else False
        )

    def _sector(self, place: Statement, name: str) -> _Sector:
        found = self._sector_object(place)
        if found is None:
            return _Sector()
        if id(found) not in self._sectors:
            self._sectors[id(found)] = self._beam(found, name)
        return self._sectors[id(found)]

    def _sector_object(self, place: Statement) -> Statement | None:
        if self.document.new:  # which may be the blink sequence, where there is no sector
            found = self.document.object(place, "sector")
            return found if found is not None and found.class_name in _SECTORS else None
        objects = self.document.objects(place.block)
        return next((found for found in objects if found.class_name in _SECTORS), None)

    def _beam(self, sector: Statement, name: str) -> _Sector:
        """What a sector says, with findings for what a round beam does not hold."""
        document, kind = self.document, sector.class_name
        if kind not in _BEAMS:
            text = f"{kind} has no beam; the points shine to all sides"
            self._say(Kind.DROPPED, "light-point-sector", sector, name, text)
            return _Sector(notes=(kind,))
        way = document.numbers(sector, 3, "axis" if kind == "ConeSector" else "direction") or _DOWN
        length = math.hypot(*way)
        if kind == "ConeSector":
            half, fade = document.numbers(sector, 2, "angle") or (math.pi, 0.0)
            across = half
        else:
            across, half, fade = self._lobe(sector)
        if not (half > 0.0 and across > 0.0 and 0.0 < length < math.inf):
            text = f"{kind} without an angle or a direction; the points shine to all sides"
            self._say(Kind.INVALID, "light-point-lobe", sector, name, text)
            return _Sector(notes=(kind,))
        cone = lobe_cone(math.degrees(across), math.degrees(half))
        if across != half:
            text = (
                f"lobe of {math.degrees(2.0 * across):g} x {math.degrees(2.0 * half):g} degrees; "
                f"a round one of {2.0 * cone:.3g}, as large"
            )
            self._say(Kind.REPLACED, "light-point-lobe", sector, name, text)
        x, y, z = (value / length for value in way)
        outer = min(cone + math.degrees(max(fade, 0.0)), ALL_SIDES)
        return _Sector(outer, min(cone, outer), (x, y, z), (kind, across, half, fade, way))

    def _say(self, kind: Kind, code: str, sector: Statement, name: str, text: str) -> None:
        """Once for all points of a node: each has a sector of its own."""
        if (name, text) not in self._said:
            self._said.add((name, text))
            self.document.add(kind, code, sector, name, text)

    def _lobe(self, sector: Statement) -> tuple[float, float, float]:
        """Half-angles across and up, and the fade of a directional sector, radians."""
        document = self.document
        if not document.new:
            found = document.numbers(sector, 4, "angles") or (
                2.0 * math.pi,
                2.0 * math.pi,
                0.0,
                0.0,
            )
            return 0.5 * found[0], 0.5 * found[1], found[3]
        across = document.number(sector, -1.0, "horizlobeangle")
        up = document.number(sector, -1.0, "vertlobeangle")
        return 0.5 * across, 0.5 * up, max(document.number(sector, 0.0, "fadeangle"), 0.0)


def _finite(word: str, default: float) -> float:
    try:
        value = float(word)
    except ValueError:
        return default
    return value if math.isfinite(value) else default
