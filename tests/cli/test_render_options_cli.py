"""``hdrusd render --complexity`` and ``--variant``: what they do and what they refuse."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import CommandLine
from stage_text import GROUND, SKY, panel, write_stage

from hdrusd.images import read_exr

#: A square of 2 m, by default a subdivision cage: refined, its corners come inwards.
CAGE = panel("Cage", (-1, 1), inside='uniform token interpolateBoundary = "edgeOnly"').replace(
    '    uniform token subdivisionScheme = "none"\n', ""
)
CHOICE = f"""\
def Xform "Sign" (
    prepend variantSets = "shown"
)
{{
    variantSet "shown" = {{
        "no" {{
        }}
        "yes" {{
            {panel("Panel")}
        }}
    }}
}}
"""


@pytest.fixture
def hdrusd(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], gl: Any
) -> CommandLine:
    return CommandLine(monkeypatch, capsys, gl)


def green(hdrusd: CommandLine, stage: Path, *options: object) -> int:
    """Pixels that show the panel, which reflects no red."""
    exr = stage.with_suffix(".exr")
    hdrusd.run("render", stage, exr, "--imageWidth", 64, *options)
    rgb, _ = read_exr(exr)
    return int(np.count_nonzero(rgb[..., 0] < 5.0))


@pytest.mark.parametrize(("name", "number"), [("medium", "1.1"), ("high", "1.2")])
def test_complexity_by_name_and_by_number(
    hdrusd: CommandLine, tmp_path: Path, name: str, number: str
) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY, CAGE)
    low = green(hdrusd, stage)
    refined = green(hdrusd, stage, "--complexity", name)
    assert 0 < refined < low
    assert green(hdrusd, stage, "-c", number) == refined


def test_low_is_the_default_and_other_names_are_refused(
    hdrusd: CommandLine, tmp_path: Path
) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY, CAGE)
    assert green(hdrusd, stage) == green(hdrusd, stage, "-c", "low")
    line = hdrusd.refused("render", stage, tmp_path / "a.exr", "-c", "extreme", code=2)
    assert "'extreme' is not one of" in line


def test_variants(hdrusd: CommandLine, tmp_path: Path) -> None:
    stage = write_stage(tmp_path / "a.usda", GROUND, SKY, CHOICE)
    assert green(hdrusd, stage) == 0
    assert green(hdrusd, stage, "--variant", "/Sign:shown=yes") > 0
    # The last of several for one set holds.
    both = ("--variant", "/Sign:shown=yes", "--variant", "/Sign:shown=no")
    assert green(hdrusd, stage, *both) == 0
    line = hdrusd.refused(
        "render", stage, tmp_path / "a.exr", "--variant", "/Sign:shown=maybe", code=3
    )
    assert line.endswith("--variant /Sign:shown=maybe: no such variant; variants: no, yes")
