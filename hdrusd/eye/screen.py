"""What a picture is looked at on, and in which light."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from hdrusd.errors import ParameterError
from hdrusd.eye.profiles import Range, Rules, check, named, parse

#: Code value to light: IEC 61966-2-1, a plain power of 2.2, ITU-R BT.1886, SMPTE ST 2084.
Eotf = Literal["srgb", "gamma22", "bt1886", "pq"]

#: The names that ``Screen.parse`` knows.
PROFILES = Path(__file__).with_name("screens.toml")

_RULES: Rules = {
    "peak": Range(0.1, 1e5),  # cd/m2; the sun on white paper has 3e4
    "black": Range(0.0, 1e4),
    "ambient": Range(0.0, 2e5),  # lx; the sun gives 1e5
    "reflectance": Range(0.0, 1.0),
    "eotf": get_args(Eotf),
    "field": Range(0.1, 179.0),  # degrees; a plane picture ends before 180
}


@dataclass(frozen=True, slots=True)
class Screen:
    """A display where it stands.

    ``peak`` and ``black`` are what the panel itself emits at white and black, cd/m2;
    ``ambient`` lx fall on it, of which it scatters ``reflectance``. ``field`` is how wide the
    viewer sees the picture, degrees; None: as wide as the camera did. Raises ParameterError,
    UnknownNameError for what no display has.
    """

    name: str = "desktop"
    peak: float = 100.0
    black: float = 1.0
    ambient: float = 0.0
    reflectance: float = 0.0
    eotf: Eotf = "srgb"
    field: float | None = None

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        for key in _RULES:
            if key != "field" or self.field is not None:
                check("screen", key, getattr(self, key), _RULES)
        if self.black >= self.peak:
            raise ParameterError(
                f"screen: black: {self.black:g} cd/m2; want less than the peak, {self.peak:g}"
            )

    @classmethod
    def parse(cls, text: str) -> Screen:
        """``hdr``, ``peak=250,black=0.3``, ``hdr,peak=600`` or a TOML file's name.

        Raises UnknownNameError, ParameterError, InputError.
        """
        return cls(name=text, **parse("screen", text, PROFILES, _RULES))

    @staticmethod
    def profiles() -> Mapping[str, Mapping[str, Any]]:
        """The known screens by name: their keys, and a ``title`` for people."""
        return named(PROFILES)

    @property
    def reflected(self) -> float:
        """Luminance that the room's light adds everywhere, cd/m2: rho E / pi."""
        return self.ambient * self.reflectance / math.pi

    @property
    def white_level(self) -> float:
        """Luminance that is seen at white, cd/m2."""
        return self.peak + self.reflected

    @property
    def black_level(self) -> float:
        """Luminance that is seen at black, cd/m2."""
        return self.black + self.reflected
