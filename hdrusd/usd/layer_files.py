"""Layers made and saved, with what the disk refuses as one OSError."""

from __future__ import annotations

import errno
import re
from pathlib import Path

from pxr import Sdf, Tf

#: What went wrong stands in quotes at the end of each line of USD's text.
_REASON = re.compile(r" : '(.*)'$", re.MULTILINE)


def new_layer(path: Path) -> Sdf.Layer:
    """An empty layer, which is a file at once. Raises OSError."""
    try:
        return Sdf.Layer.CreateNew(str(path))
    except Tf.ErrorException as problem:
        raise _refused(path, problem) from problem


def save_layer(layer: Sdf.Layer) -> None:
    """Write what changed. Raises OSError."""
    try:
        saved = layer.Save(force=True)
    except Tf.ErrorException as problem:
        raise _refused(Path(layer.identifier), problem) from problem
    if not saved:
        raise OSError(errno.EIO, "cannot be written", layer.identifier)


def _refused(path: Path, problem: Tf.ErrorException) -> OSError:
    reasons = _REASON.findall(str(problem))
    return OSError(errno.EIO, reasons[0] if reasons else "cannot be written", str(path))
