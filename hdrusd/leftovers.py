"""What is half done has a name that tells whose it is, so that what a dead process left can go.

A process that is killed clears nothing away. The hidden files and folders of a run have in their
names the kernel's boot and the PID namespace, the process and when it began: whoever writes into
the same folder later removes those of processes that are no more. What came from another machine
or container, with which a folder may be shared, nobody here can judge: it stays. So do links, and
what belongs to another user.
"""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import shutil
import stat
from contextlib import suppress
from functools import cache
from pathlib import Path

_NAME = re.compile(r"\.hdrusd-([0-9a-f]{12})-([0-9]{1,10})-([0-9]{1,20})-[0-9a-f]{8}(\.part.*)?")


def private_name(suffix: str | None = None) -> str:
    """A hidden name that nobody else takes; with ``suffix``, of a file that ends in it."""
    pid = os.getpid()
    own = f".hdrusd-{_here()}-{pid}-{_began(pid) or 0}-{secrets.token_hex(4)}"
    return own if suffix is None else f"{own}.part{suffix}"


def left_behind(folder: Path) -> list[Path]:
    """What dead processes of this user left in ``folder``: plain files and folders."""
    try:
        return [path for path in folder.iterdir() if _of_the_dead(path.name) and _ours(path)]
    except OSError:  # it may be written in and not listed
        return []


def remove(path: Path) -> None:
    """Remove a file or a folder with all in it; what somebody else removes meanwhile is fine."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)  # follows no links
    else:
        with suppress(OSError):
            path.unlink()


@cache
def clear_files(folder: Path) -> None:
    """Remove the files that dead processes left in ``folder``; looked at once, not every frame."""
    for path in left_behind(folder):
        if path.is_file():
            remove(path)


def _of_the_dead(name: str) -> bool:
    found = _NAME.fullmatch(name)
    if found is None or found[1] != _here():
        return False
    pid, began = int(found[2]), int(found[3])
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):  # there, and another user's; or no number of a process
        return False
    now = _began(pid)  # a number is given again
    return bool(began) and now is not None and now != began


def _ours(path: Path) -> bool:
    try:
        about = path.lstat()
    except OSError:
        return False
    plain = stat.S_ISDIR(about.st_mode) or stat.S_ISREG(about.st_mode)
    return plain and about.st_uid == os.geteuid()


@cache
def _here() -> str:
    """The kernel's boot and the PID namespace, which no other machine or container has."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii")
        text = boot + str(Path("/proc/self/ns/pid").readlink())
    except (OSError, ValueError):
        text = secrets.token_hex()  # nobody can tell, not even this user's next process
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def _began(pid: int) -> int | None:
    """When a process began, clock ticks since boot (proc(5), field 22); None where hidden."""
    try:
        text = Path(f"/proc/{pid}/stat").read_bytes()
        return int(text.rpartition(b")")[2].split()[19])
    except (OSError, ValueError, IndexError):
        return None
