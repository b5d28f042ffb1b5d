"""Third-party readers in processes of their own, under limits.

A library that reads FBX, .ive or .lwo may crash, hang or fill the memory over a file that
somebody made for that, or that merely broke. Here it does so in a process group of its own,
with an empty environment, without standard input, in a private folder; what is left of it is
one InputError.

Nothing here believes what a worker leaves: ``exchange`` checks it.
"""

from __future__ import annotations

import gc
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import IO, NoReturn

from hdrusd.errors import InputError
from hdrusd.importers import confine
from hdrusd.importers.exchange import load_scene, save_refusal, save_scene
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.legacy.scene import LegacyScene
from hdrusd.report import Report

#: Bytes of what a worker prints that are kept.
_KEPT = 1 << 16
#: The exit code of a Python reader that raised something else than InputError.
_FAILED = 70
_TASK = "task.json"
#: Where Python and hdrusd lie; an editable install is on no path.
_PYTHON = Path(sys.prefix), Path(sys.base_prefix), Path(__file__).resolve().parents[2]


def run(
    arguments: Sequence[str],
    *,
    folder: Path,
    limits: Limits,
    source: Path,
    reader: str,
    readable: Iterable[Path] = (),
    environment: Mapping[str, str] | None = None,
) -> str:
    """Run a program, given by its whole path, in ``folder``; what it printed.

    It writes there only, and reads there, from ``readable`` and its libraries, where the system
    can see to that (``confine``). ``environment`` is added to ``PATH`` and ``LANG=C``. The whole
    group is killed when the program ends, when it takes longer than ``limits.worker_seconds``
    and when we are interrupted. Raises InputError, which names ``reader``, unless the program
    ends with 0.
    """
    asked = {
        "memory": limits.worker_bytes,
        "seconds": limits.worker_seconds,
        "file": limits.file_bytes,
        "readable": [str(path) for path in readable],
    }
    own = {"PATH": os.defpath, "LANG": "C", "HOME": str(folder), "TMPDIR": str(folder)}
    process = subprocess.Popen(
        [sys.executable, "-I", "-S", confine.__file__, json.dumps(asked), *arguments],
        cwd=folder,
        env=own | dict(environment or {}),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    printed = bytearray()
    assert process.stdout is not None
    listener = threading.Thread(target=_listen, args=(process.stdout, printed), daemon=True)
    try:
        listener.start()
        code = process.wait(limits.worker_seconds)
    except subprocess.TimeoutExpired:
        text = f"{reader} took more than {limits.worker_seconds} s; want a smaller file"
        raise InputError(source, text) from None
    finally:
        _end(process)
        listener.join(10.0)
        process.stdout.close()
    text = printed.decode("utf-8", "replace")
    if code:
        raise InputError(source, _obituary(reader, code, text, limits))
    return text


def _listen(stream: IO[bytes], printed: bytearray) -> None:
    """Read to the end, so that nobody waits for us, and keep the start."""
    while chunk := os.read(stream.fileno(), _KEPT):
        printed += chunk[: _KEPT - len(printed)]


def _end(process: subprocess.Popen[bytes]) -> None:
    """Kill the group, and gather the dead."""
    with suppress(ProcessLookupError, PermissionError):  # gone; macOS says so of the dead
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _obituary(reader: str, code: int, text: str, limits: Limits) -> str:
    if code in (-signal.SIGXCPU, -signal.SIGALRM):
        return f"{reader} took more than {limits.worker_seconds} s; want a smaller file"
    if "MemoryError" in text or "bad_alloc" in text:
        return f"{reader} needs more than {limits.worker_bytes >> 20} MiB; want a smaller file"
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    told = [line for line in lines if "error" in line.lower()] or lines
    last = f" ({told[-1][:200]})" if told else ""
    if code < 0:
        names = {number.value: number.name for number in signal.Signals}
        name = names.get(-code, f"signal {-code}")
        return f"{reader} crashed with {name}{last}; want a file that it can read"
    return f"{reader} failed{last}; want a file that it can read"


def run_module(
    module: str, folder: Path, resolver: Resolver, *, reader: str, readable: Iterable[Path] = ()
) -> None:
    """Run ``python -m module folder`` so that it finds what we import. Raises InputError."""
    # "" is where the user happens to be: no root.
    modules = [*(Path(entry).absolute() for entry in sys.path if entry), _PYTHON[2]]
    run(
        [sys.executable, "-P", "-m", module, str(folder)],
        folder=folder,
        limits=resolver.limits,
        source=resolver.source,
        reader=reader,
        readable=[*modules, *_PYTHON, *readable],
        environment={
            "PYTHONPATH": os.pathsep.join(map(str, modules)),
            "OPENBLAS_NUM_THREADS": "1",  # each thread of OpenBLAS reserves address space
        },
    )


def read(function: str, resolver: Resolver, report: Report) -> LegacyScene:
    """What the reader ``"module:function"``, run in a worker, makes of ``resolver.source``.

    The function has the signature of an Importer. In the worker it reads with a Resolver of its
    own and gives pictures by name or as bytes; see ``exchange``. Raises InputError.
    """
    with tempfile.TemporaryDirectory(prefix="hdrusd-") as name:
        folder = Path(name).resolve()
        task = {
            "function": function,
            "source": str(resolver.source.absolute()),
            "roots": [str(path) for path in resolver.roots],
            "limits": asdict(resolver.limits),
            "stated": sorted(resolver.stated),
        }
        (folder / _TASK).write_text(json.dumps(task), encoding="utf-8")
        run_module(
            "hdrusd.importers.worker",
            folder,
            resolver,
            reader=f"the reader {function.partition(':')[0].rpartition('.')[2]}",
            readable=resolver.roots,
        )
        return load_scene(folder, resolver, report)


def _serve(folder: Path) -> NoReturn:
    """The worker: read, leave the scene or the refusal in ``folder``, and go at once.

    Bindings whose objects must not be collected (ufbx) need the collector off from the start
    and no destructor at the end.
    """
    gc.disable()
    task = json.loads((folder / _TASK).read_text(encoding="utf-8"))
    report = Report()
    limits = Limits(**task["limits"])
    roots = [Path(path) for path in task["roots"]]
    stated = frozenset(task["stated"])
    resolver = Resolver(Path(task["source"]), report, roots, limits=limits, stated=stated)
    module, _, name = task["function"].partition(":")
    code = 0
    try:
        scene = getattr(import_module(module), name)(resolver, report)
        save_scene(scene, folder, report)
    except InputError as error:
        save_refusal(error, folder)
    except Exception as error:  # a bug or a surprise of the library; the parent says so
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        code = _FAILED
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    _serve(Path(sys.argv[1]))
