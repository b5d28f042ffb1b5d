"""Whose eye it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from hdrusd.eye.profiles import Range, Rules, check, named, parse

#: What sets the pupil: Moon and Spencer 1944, or Watson and Yellott 2012 with field and age.
Pupil = Literal["moon-spencer", "watson-yellott"]

#: How bleaching desensitises rods: by 1.2 log units per 10 % (Alpern, Rushton and Torii 1970),
#: or by the photons lost alone (Irawan et al. 2005).
RodBleach = Literal["alpern", "photon"]

#: The names that ``Observer.parse`` knows.
PROFILES = Path(__file__).with_name("observers.toml")

#: Pupils are known from 20 to 83 years (Watson and Yellott 2012), scattered light from 20 to 80.
#: Beyond that the formulas go on smoothly, as far as here.
_RULES: Rules = {
    "age": Range(10.0, 100.0),
    "pigment": Range(0.0, 1.2),
    "pupil": get_args(Pupil),
    "slow": Range(0.1, 1000.0),
    "rod_bleach": get_args(RodBleach),
}


@dataclass(frozen=True, slots=True)
class Observer:
    """The observer's eyes.

    ``age`` in years; ``pigment`` of the iris as CIE 135/1-6 has it: 0 very dark, 0.5 brown,
    1 green to blue-green, 1.2 light blue. ``slow`` is the time constant of the slow neural
    process, s. Raises ParameterError, UnknownNameError for what no eye has.
    """

    age: float = 35.0
    pigment: float = 0.5
    pupil: Pupil = "watson-yellott"
    slow: float = 10.0
    rod_bleach: RodBleach = "alpern"

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        for key, value in asdict(self).items():
            check("observer", key, value, _RULES)

    @classmethod
    def parse(cls, text: str) -> Observer:
        """``elderly``, ``age=70,pigment=1.2``, ``elderly,pigment=1.2`` or a TOML file's name.

        Raises UnknownNameError, ParameterError, InputError.
        """
        return cls(**parse("observer", text, PROFILES, _RULES))

    @staticmethod
    def profiles() -> Mapping[str, Mapping[str, Any]]:
        """The known observers by name: their keys, and a ``title`` for people."""
        return named(PROFILES)
