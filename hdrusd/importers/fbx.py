"""FBX by ufbx: the importer, which runs the reader in a process of its own.

ufbx reads every FBX from 5.0 on, but objects of its Python binding may outlive what they point
into, so that a file, or Python's own collector, can end the process. See ``fbx_held``.
"""

from __future__ import annotations

from importlib.util import find_spec

from hdrusd.errors import InputError
from hdrusd.importers import worker
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import LegacyScene
from hdrusd.report import Report


def read(resolver: Resolver, report: Report) -> LegacyScene:
    """Read ``resolver.source``, FBX 5.0 to 7.7, binary or text.

    Raises InputError where ufbx is not installed or refuses the file, and where it holds
    nothing that can be shown.
    """
    if find_spec("ufbx") is None:
        text = "FBX needs ufbx, which is not installed; want pip install 'hdrusd[fbx]'"
        raise InputError(resolver.source, text)
    return worker.read("hdrusd.importers.fbx_worker:read", resolver, report)
