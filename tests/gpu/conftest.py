"""A package of shaders beside hdrusd, as a plug-in has it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest


@pytest.fixture
def write_shader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    """Function (file, *lines) that writes a file of the package and returns its name."""
    folder = tmp_path / "lamp_shaders"
    folder.mkdir()
    (folder / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    # Not the package of the test before.
    monkeypatch.delitem(sys.modules, "lamp_shaders", raising=False)

    def write(name: str, *lines: str) -> str:
        (folder / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
        return f"lamp_shaders:{name}"

    return write
