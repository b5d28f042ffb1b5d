"""Gives up rights, then becomes a program: how a worker process starts.

    python -I -S confine.py JSON PROGRAM ARGUMENT...

Run as a script, so that nothing of hdrusd is loaded, and not between fork and exec, where a
process with threads may lock up. The limits hold on every POSIX system (macOS takes no
RLIMIT_AS); Landlock, where the kernel of Linux has it (5.13, 2021), lets the program read its
own libraries, what it is given and nothing else, write into its folder alone, and open no TCP
connection (6.7, 2024).

Source: the Linux kernel's documentation, userspace-api/landlock; include/uapi/linux/landlock.h.
"""

from __future__ import annotations

import ctypes
import json
import os
import resource
import signal
import struct
import sys
from collections.abc import Iterable

#: System calls, of the same number on every machine since Linux 5.13.
_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_VERSION = 1  # flag: say which version of Landlock there is
_BENEATH = 1  # kind of a rule: what lies below a path
_NO_NEW_PRIVILEGES = 38  # prctl

_EXECUTE, _READ_FILE, _READ_FOLDER = 1 << 0, 1 << 2, 1 << 3
_FILE_RIGHTS = (
    _EXECUTE | 1 << 1 | _READ_FILE
)  # those that a rule for a file may name; 1 << 1: write
#: Every right of files that a version knows: 13 in the first, then REFER, TRUNCATE.
_RIGHTS = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1}
_TCP = 0b11  # bind and connect, since version 4

#: Where the libraries of a system lie.
_SYSTEM = ("/usr", "/lib", "/lib64", "/bin", "/opt", "/nix", "/etc/ld.so.cache", "/dev/urandom")
#: Seconds after the wall limit at which the worker dies by itself, should nobody kill it.
_GRACE = 10


def landlock_version() -> int:
    """The version of Landlock that this kernel has; 0 for none."""
    if not sys.platform.startswith("linux"):
        return 0
    return max(int(_libc().syscall(_CREATE_RULESET, None, ctypes.c_size_t(0), _VERSION)), 0)


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)


def _allow_only(readable: Iterable[str], folder: str) -> None:
    """Give up all files but ``readable``, to read, and ``folder``. Raises OSError."""
    version = landlock_version()
    if not version:
        return
    libc = _libc()

    def done(result: int) -> int:
        if result < 0:
            raise OSError(ctypes.get_errno(), "landlock")
        return result

    every = _RIGHTS[min(version, 3)]
    rules = struct.pack("QQ", every, _TCP) if version >= 4 else struct.pack("Q", every)
    ruleset = done(libc.syscall(_CREATE_RULESET, rules, ctypes.c_size_t(len(rules)), 0))
    reading = _EXECUTE | _READ_FILE | _READ_FOLDER
    for path, rights in [*((path, reading) for path in readable), (folder, every)]:
        try:
            place = os.open(path, os.O_PATH | os.O_CLOEXEC)
        except OSError:  # not on this system
            continue
        rights &= every if os.path.isdir(path) else _FILE_RIGHTS  # noqa: PTH112
        beneath = struct.pack("=Qi", rights, place)
        done(libc.syscall(_ADD_RULE, ruleset, _BENEATH, beneath, 0))
        os.close(place)
    done(libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0))
    done(libc.syscall(_RESTRICT_SELF, ruleset, 0))
    os.close(ruleset)


def _limit(what: int, value: int) -> None:
    hard = resource.getrlimit(what)[1]
    value = value if hard == resource.RLIM_INFINITY else min(value, hard)
    try:
        resource.setrlimit(what, (value, hard))
    except (OSError, ValueError):
        if sys.platform != "darwin":
            raise


def main() -> None:
    """Take the limits of the first argument, become the rest."""
    asked = json.loads(sys.argv[1])
    _limit(resource.RLIMIT_AS, asked["memory"])
    _limit(resource.RLIMIT_CPU, asked["seconds"])
    _limit(resource.RLIMIT_FSIZE, asked["file"])
    _limit(resource.RLIMIT_CORE, 0)
    signal.alarm(asked["seconds"] + _GRACE)  # survives exec
    program = sys.argv[2:]
    _allow_only((*_SYSTEM, *asked["readable"]), os.getcwd())  # noqa: PTH109
    os.execv(program[0], program)


if __name__ == "__main__":
    main()
