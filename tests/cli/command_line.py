"""The command line as a user meets it, in this process or in one of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any, NamedTuple

import pytest

from hdrusd.cli import main


class Said(NamedTuple):
    """How a command ended."""

    code: int
    out: str
    err: str


class CommandLine:
    """``run`` a command; ``refused`` wants it to end with one line and a code."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], gl: Any
    ) -> None:
        self._monkeypatch = monkeypatch
        self._capsys = capsys
        if gl is not None:  # a context of its own would become the current one
            for place in ("hdrusd.gpu.context", "hdrusd.display"):
                monkeypatch.setattr(f"{place}.create_context", lambda: gl)

    def run(self, *arguments: object, code: int = 0) -> Said:
        """Run ``hdrusd`` with these arguments; it has to end with ``code``."""
        self._capsys.readouterr()
        self._monkeypatch.setattr(sys, "argv", ["hdrusd", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        out, err = self._capsys.readouterr()
        said = Said(int(end.value.code or 0), out, err)
        assert said.code == code, said
        return said

    def refused(self, *arguments: object, code: int) -> str:
        """The line that a refusal says on standard error; nothing is on standard output."""
        said = self.run(*arguments, code=code)
        assert said.out == ""
        lines = said.err.strip().splitlines()
        if lines[0].startswith("Usage: "):  # click's usage and hint before the line
            lines = [line for line in lines if line.startswith("Error: ")]
        assert len(lines) == 1, said.err
        return lines[0]


def process(*arguments: object, **environment: str) -> Said:
    """Run ``hdrusd`` in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", "from hdrusd.cli import main; main()", *map(str, arguments)],
        capture_output=True,
        text=True,
        env=os.environ | environment,
        check=False,
    )
    return Said(done.returncode, done.stdout, done.stderr)
