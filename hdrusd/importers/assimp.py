"""Reader for formats without one of ours, by assimp: AC3D, B3D, LWO, MS3D, OFF, PLY, STL, X.

assimp (``pip install 'hdrusd[assimp]'``) runs in a worker; see ``assimp_worker``. Formats that
light matters for have readers of their own: what assimp gives is what it has made of the file.
"""

from __future__ import annotations

from hdrusd.errors import InputError
from hdrusd.importers import worker
from hdrusd.importers.assimp_library import find_library
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import LegacyScene
from hdrusd.report import Report


def read(resolver: Resolver, report: Report) -> LegacyScene:
    """Read ``resolver.source``. Raises InputError when nothing can be used."""
    if find_library() is None:
        suffix = resolver.source.suffix.lower()
        text = f"{suffix} is read by assimp, which is missing; pip install 'hdrusd[assimp]'"
        raise InputError(resolver.source, f"{text} (Linux and macOS)")
    return worker.read("hdrusd.importers.assimp_worker:read", resolver, report)
