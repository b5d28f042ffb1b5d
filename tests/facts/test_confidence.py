"""What a photometric number is worth by where it came from."""

from __future__ import annotations

import pytest

from hdrusd.photometry.confidence import (
    BY_CLASS,
    BY_LAMP_TYPE,
    LEVELS,
    MEANING,
    Confidence,
    confidence,
)
from hdrusd.photometry.estimate import LIGHT_POINT_RULE, RULES


@pytest.mark.parametrize(
    ("provenance", "rule", "source", "level"),
    [
        ("measured", "photometry.toml:light[1]", "", "high"),
        ("authored", "photometry.toml:light[1]", "data sheet 4711", "high"),
        ("authored", "source file", "", "medium"),
        ("estimated", f"{BY_LAMP_TYPE}led", "70 W", "medium"),
        ("estimated", f"{BY_CLASS}street-lamp", "", "low"),
        ("estimated", "photometry.toml:light[1]", "a guess", "low"),
        ("", "", "", "low"),
        (None, None, None, "low"),
        ("estimated", "photometry.toml:ambient", "", "low"),
        *(("estimated", name, "", "none") for name in (*RULES.names(), LIGHT_POINT_RULE)),
    ],
)
def test_level_follows_the_origin(
    provenance: str | None, rule: str | None, source: str | None, level: Confidence
) -> None:
    assert confidence(provenance, rule, source) == level


def test_each_level_says_what_it_means() -> None:
    assert tuple(MEANING) == LEVELS
