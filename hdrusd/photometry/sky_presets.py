"""Skies by name: ``[ambient] preset`` of a photometry file, each with its source."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.photometry import sky_models
from hdrusd.photometry.sky import texel_directions, texel_solid_angles

Doubles = npt.NDArray[np.float64]

#: Rows of a sky's picture, half its columns.
_ROWS = 128

#: cd/m2 of a sky from which on eyes no longer adapt to the night (cities have up to 0.02), and of a
#: natural one: Falchi et al. 2016, "The new world atlas of artificial night sky brightness".
_CITY, _NATURAL = 3.0e-3, 1.7e-4

#: lx of a clear night without a moon: RCA, "Electro-Optics Handbook", 1974.
_STARS = 1.0e-3

_RP21 = "IES RP-21 (J. Illum. Eng. Soc. 13(4), 1984)"


@dataclass(frozen=True, slots=True, eq=False)
class PresetSky:
    """What a preset gives, in the axes of ``photometry.sky``: +Y up, -Z north, +X east."""

    lux: float  # on a level ground, of the sky alone
    picture: Doubles | None  # (h, 2 h) cd/m2, lat-long; None: alike from everywhere
    beam: float  # lx of sun or moon on a plane that faces it; 0: there is none
    towards: tuple[float, float, float]  # the sun or the moon

    @property
    def illuminance(self) -> float:
        """Lux on a level ground, of all of it."""
        return self.lux + self.beam * max(self.towards[1], 0.0)


@dataclass(frozen=True, slots=True)
class Preset:
    """A sky by name. ``altitude``: of sun or moon where none is stated, and which it may have.

    ``body``: which of them shines, "" where neither does.
    """

    name: str
    text: str
    source: str
    make: Callable[[float, tuple[float, float, float]], PresetSky]
    altitude: float | None = None  # degrees; None: it has none
    least: float = 0.0
    most: float = 90.0
    body: str = ""

    def sky(
        self,
        altitude: float | None = None,
        azimuth: float | None = None,
        illuminance: float | None = None,
    ) -> PresetSky:
        """The sky with sun or moon there, degrees; north 0, east 90, south if not said.

        ``illuminance``: lux on a level ground of all of it, in place of its own.
        """
        at = self.altitude or 0.0 if altitude is None else altitude
        high, turn = math.radians(at), math.radians(180.0 if azimuth is None else azimuth)
        level = math.cos(high)
        towards = (level * math.sin(turn), math.sin(high), -level * math.cos(turn))
        made = self.make(at, towards)
        return made if illuminance is None else _scaled(made, illuminance / made.illuminance)


def _scaled(sky: PresetSky, factor: float) -> PresetSky:
    picture = None if sky.picture is None else sky.picture * factor
    return PresetSky(sky.lux * factor, picture, sky.beam * factor, sky.towards)


def level_lux(picture: Doubles) -> float:
    """Lux on a level ground under a picture (h, w), cd/m2: the integral of L sin over it."""
    sine = np.maximum(texel_directions(*picture.shape)[..., 1], 0.0)
    return float(np.sum(picture * sine * texel_solid_angles(*picture.shape)))


def _uniform(lux: float) -> PresetSky:
    return PresetSky(lux, None, 0.0, (0.0, 1.0, 0.0))


def _directions() -> Any:
    return texel_directions(_ROWS, 2 * _ROWS)


def _pictured(
    luminance: Doubles, beam: float, towards: tuple[float, float, float], lux: float | None = None
) -> PresetSky:
    """``lux``: of the sky; None: as its luminance has it."""
    own = level_lux(luminance)
    if lux is not None:
        luminance = luminance * (lux / own)
    return PresetSky(own if lux is None else lux, luminance, beam, towards)


def _moonlit(altitude: float, towards: tuple[float, float, float]) -> PresetSky:
    ways = _directions()
    scattered = sky_models.moonlit_sky(ways[..., 1], ways @ np.array(towards), altitude)
    sky = scattered + np.where(ways[..., 1] > 0.0, _STARS / math.pi, 0.0)
    return _pictured(sky, sky_models.moon_lux(altitude), towards)


def _overcast(altitude: float, towards: tuple[float, float, float]) -> PresetSky:
    sky = sky_models.overcast_sky(_directions()[..., 1])
    return _pictured(sky, 0.0, towards, sky_models.overcast_lux(altitude))


def _clear(altitude: float, towards: tuple[float, float, float]) -> PresetSky:
    ways = _directions()
    sky = sky_models.clear_sky(ways[..., 1], ways @ np.array(towards), altitude)
    beam, lux = sky_models.sun_lux(altitude), sky_models.clear_sky_lux(altitude)
    return _pictured(sky, beam, towards, lux)


_ALL = (
    Preset(
        "moonless",
        "clear night without a moon, far from towns; alike from everywhere",
        "RCA, Electro-Optics Handbook, 1974",
        lambda altitude, towards: _uniform(_STARS),
    ),
    Preset(
        "starlit-city",
        "clear night over a town, where eyes no longer adapt to the dark; alike from everywhere",
        "3 and 0.17 mcd/m2: Falchi et al., Science Advances 2(6), 2016",
        lambda altitude, towards: _uniform(math.pi * (_CITY + _NATURAL)),
    ),
    Preset(
        "moonlit",
        "full moon in a clear sky",
        "Krisciunas and Schaefer, Publ. Astron. Soc. Pacific 103, 1991; stars 0.001 lx",
        _moonlit,
        altitude=45.0,
        least=5.0,
        body="Moon",
    ),
    Preset(
        "dusk",
        "clear sky after sunset; civil twilight ends at -6, nautical at -12; alike from everywhere",
        "Janiczek and DeYoung, US Naval Observatory Circular 171, 1987",
        lambda altitude, towards: _uniform(sky_models.sunlit_ground(altitude)),
        altitude=-6.0,
        least=-18.0,
        most=0.0,
    ),
    Preset(
        "overcast-day",
        "CIE overcast sky, L = Lz (1 + 2 sin) / 3",
        f"{_RP21}; ISO 15469:2004, type 16",
        _overcast,
        altitude=30.0,
    ),
    Preset(
        "clear-sun",
        "CIE clear sky of low turbidity, and the sun",
        f"{_RP21}; ISO 15469:2004, type 12",
        _clear,
        altitude=45.0,
        least=5.0,
        body="Sun",
    ),
)

#: Presets by name.
PRESETS: dict[str, Preset] = {preset.name: preset for preset in _ALL}
