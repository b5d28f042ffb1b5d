"""The command line as a user meets it, in this process or in one of its own."""

from __future__ import annotations

import ctypes
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


#: ``hdrusd`` in a process of its own; arguments follow.
HDRUSD = (sys.executable, "-c", "from hdrusd.cli import main; main()")


def process(*arguments: object, permitted: bool = True, **environment: str) -> Said:
    """Run ``hdrusd`` in a process of its own; not ``permitted``: file modes bind root too."""
    done = subprocess.run(
        [*HDRUSD, *map(str, arguments)],
        capture_output=True,
        text=True,
        env=os.environ | environment,
        preexec_fn=None if permitted else _bound_by_modes,
        check=False,
    )
    return Said(done.returncode, done.stdout, done.stderr)


def _bound_by_modes() -> None:
    """Without CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH (capability.h), in what is run next."""
    system, drop_bounding = ctypes.CDLL(None), 24  # PR_CAPBSET_DROP of prctl.h
    for capability in (1, 2):
        system.prctl(drop_bounding, capability, 0, 0, 0)  # refused to who has none anyway
