"""The adaptation courses in docs/eye.md are what its own program prints."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs" / "eye.md"


def test_courses_are_printed_by_the_program_beside_them() -> None:
    section = PAGE.read_text(encoding="utf-8").split("## Adaptation courses")[1].split("\n## ")[0]
    program = re.search(r"```python\n(.*?)```", section, re.DOTALL)
    assert program
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(program[1], {})
    wanted = [line for line in section[program.end() :].splitlines() if line.startswith("|")]
    assert wanted == [line for line in printed.getvalue().splitlines() if line.startswith("|")]
