"""A file that somebody else will open, looked at before: readers of USD, EXR and pictures do not
say why they could not.
"""

from __future__ import annotations

from pathlib import Path

from hdrusd.errors import InputError


def check_input(path: Path) -> None:
    """Refuse what cannot be read as a file: none there, a folder, a pipe, no permission.

    Raises InputError.
    """
    try:
        if not path.exists():
            raise InputError(path, "no such file")
        if not path.is_file():
            raise InputError(path, "not a regular file")
        with path.open("rb"):
            pass
    except OSError as problem:
        text = f"cannot be read: {problem.strerror or problem}; want a readable file"
        raise InputError(path, text) from problem
