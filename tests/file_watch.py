"""Which files below a folder are touched, by any process: Linux's inotify, by the C library.

    with watched(folder) as touched:
        ...
    assert not touched()

Reading an entry's name or its status (``stat``) does not count; opening a file does, as do
changing, making and removing one.
"""

from __future__ import annotations

import ctypes
import os
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

_OPEN, _MODIFY, _ATTRIB = 0x20, 0x2, 0x4
_MOVED_FROM, _MOVED_TO, _CREATE, _DELETE = 0x40, 0x80, 0x100, 0x200
_EVENTS = _OPEN | _MODIFY | _ATTRIB | _MOVED_FROM | _MOVED_TO | _CREATE | _DELETE
_DIRECTORY, _OVERFLOW = 0x40000000, 0x4000


@contextmanager
def watched(folder: Path) -> Iterator[Callable[[], list[str]]]:
    """Watch ``folder`` and those below it that are there now; the result lists paths so far.

    Raises OSError where the system has no inotify.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    handle = libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
    if handle < 0:
        raise OSError(ctypes.get_errno(), "inotify_init1")
    folders: dict[int, Path] = {}
    seen: list[str] = []

    def touched() -> list[str]:
        while True:
            try:
                data = os.read(handle, 1 << 16)
            except BlockingIOError:
                return sorted(set(seen))
            at = 0
            while at < len(data):
                watch, mask, _, size = struct.unpack_from("iIII", data, at)
                name = data[at + 16 : at + 16 + size].rstrip(b"\0").decode()
                at += 16 + size
                assert not mask & _OVERFLOW
                # Listing a folder opens the folder; that tells nothing of its files.
                if not (mask & _DIRECTORY and mask & _OPEN):
                    seen.append(str((folders[watch] / name).relative_to(folder)))

    try:
        for path in (folder, *(path for path in folder.rglob("*") if path.is_dir())):
            watch = libc.inotify_add_watch(handle, os.fsencode(path), _EVENTS)
            if watch < 0:
                raise OSError(ctypes.get_errno(), "inotify_add_watch", str(path))
            folders[watch] = path
        yield touched
    finally:
        os.close(handle)
