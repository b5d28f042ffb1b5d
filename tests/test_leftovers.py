"""What a kill -9 leaves is cleared away by the next run, and nothing else is."""

from __future__ import annotations

import fcntl
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from builders import obj

from hdrusd.conversion import Options
from hdrusd.convert import convert
from hdrusd.delivery import move_into_place, work_folder
from hdrusd.errors import InputError
from hdrusd.images import write_exr
from hdrusd.leftovers import left_behind, private_name

PARTS = {"wall.usda", "wall.geometry.usdc", "wall.look.usda", "wall.photometry.usda"}

CONVERTS = "import hdrusd.cli, sys; sys.argv[1:1] = ['convert']; hdrusd.cli.main()"

#: Converts argv[1] into argv[2] and dies at the rename of a name that ends in argv[3].
DIES_IN_A_RENAME = """
import os, signal, sys
from pathlib import Path
from hdrusd.conversion import Options
from hdrusd.convert import convert
rename = Path.rename
def dies(self, target):
    if str(target).endswith(sys.argv[3]) and not str(target).count("/replaced/"):
        os.kill(os.getpid(), signal.SIGKILL)
    return rename(self, target)
Path.rename = dies
convert(Path(sys.argv[1]), Path(sys.argv[2]), Options())
"""

DIES_WRITING_A_FRAME = """
import os, signal, sys
from pathlib import Path
import numpy as np
from hdrusd.images import write_exr
Path.replace = lambda self, target: os.kill(os.getpid(), signal.SIGKILL)
write_exr(Path(sys.argv[1]), np.ones((2, 2, 3)))
"""

#: Has a work folder for argv[1] until its standard input ends.
WORKS = """
import sys
from pathlib import Path
from hdrusd.delivery import work_folder
with work_folder(Path(sys.argv[1])) as folder:
    (folder / "half").write_text("done")
    print(folder, flush=True)
    sys.stdin.read()
"""


def killed(script: str, *arguments: object) -> None:
    """Run a script that has to die by SIGKILL."""
    done = subprocess.run([sys.executable, "-c", script, *map(str, arguments)], check=False)
    assert done.returncode == -signal.SIGKILL


@contextmanager
def working(output: Path) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    """Another process with a work folder for ``output``, and that folder."""
    with subprocess.Popen(
        [sys.executable, "-c", WORKS, str(output)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as other:
        assert other.stdout is not None
        try:
            yield other, Path(other.stdout.readline().strip())
        finally:
            other.kill()


def names(folder: Path) -> set[str]:
    """Of all that is in a folder, hidden or not."""
    return {path.name for path in folder.iterdir()}


def of_the_dead(folder: Path, suffix: str | None = None) -> Path:
    """The name that a process which is no more would have taken in ``folder``."""
    with subprocess.Popen([sys.executable, "-c", ""]) as gone:
        pass
    parts = private_name(suffix).split("-", 3)
    return folder / "-".join([*parts[:2], str(gone.pid), parts[3]])


def test_a_killed_conversion_is_cleared_by_the_next_one(tmp_path: Path) -> None:
    large = tmp_path / "large.obj"
    large.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "f 1 2 3\n" * 1_000_000)
    out = tmp_path / "out"
    with subprocess.Popen(
        [sys.executable, "-c", CONVERTS, str(large), str(out / "wall.usda")]
    ) as run:
        while not (out.is_dir() and names(out)) and run.poll() is None:
            time.sleep(0.001)
        run.kill()
    assert run.returncode == -signal.SIGKILL
    (left,) = out.iterdir()
    assert left.is_dir()
    assert left.name.startswith(".hdrusd-")
    convert(obj(tmp_path / "wall.obj", "Kd 0.5 0.5 0.5"), out / "wall.usda", Options())
    assert names(out) == PARTS


def test_a_stage_set_aside_stays_until_its_successor_is_there(tmp_path: Path) -> None:
    source = obj(tmp_path / "wall.obj", "Kd 0.5 0.5 0.5")
    output = tmp_path / "out" / "wall.usda"
    convert(source, output, Options())
    first = (tmp_path / "out" / "wall.look.usda").read_bytes()
    killed(DIES_IN_A_RENAME, source, output, "wall.look.usda")
    (left,) = left_behind(output.parent)
    assert (left / "replaced" / "wall.look.usda").read_bytes() == first
    (tmp_path / "broken.gltf").write_text("{")
    with pytest.raises(InputError):
        convert(tmp_path / "broken.gltf", output, Options())
    convert(source, output.with_name("other.usda"), Options())
    assert left.is_dir()  # neither has replaced it
    convert(source, output, Options())
    assert names(output.parent) == PARTS | {p.replace("wall", "other") for p in PARTS}


def test_one_at_a_time_renames_into_a_folder(tmp_path: Path) -> None:
    output = tmp_path / "wall.usda"
    handle = os.open(tmp_path, os.O_RDONLY)
    with work_folder(output) as folder:
        (folder / output.name).write_text("done")
        move = threading.Thread(target=move_into_place, args=(folder, output))
        fcntl.flock(handle, fcntl.LOCK_EX)
        try:
            move.start()
            move.join(0.2)
            assert not output.exists()
        finally:
            os.close(handle)
            move.join()
        assert output.read_text() == "done"


def test_who_works_in_the_same_folder_is_left_alone(tmp_path: Path) -> None:
    source = obj(tmp_path / "wall.obj", "Kd 0.5 0.5 0.5")
    output = tmp_path / "out" / "wall.usda"
    with working(output) as (other, folder):
        convert(source, output, Options())
        assert (folder / "half").read_text() == "done"
        other.kill()
        other.wait()
        convert(source, output, Options())
        assert names(output.parent) == PARTS


def test_a_killed_frame_is_cleared_by_the_next_one(tmp_path: Path) -> None:
    killed(DIES_WRITING_A_FRAME, tmp_path / "a.0001.exr")
    (left,) = tmp_path.iterdir()
    assert left.name.endswith(".part.exr")
    write_exr(tmp_path / "a.0002.exr", np.ones((2, 2, 3)))
    assert names(tmp_path) == {"a.0002.exr"}


def test_links_are_neither_followed_nor_removed(tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    kept.mkdir()
    (kept / "file").write_text("dear")
    out = tmp_path / "out"
    out.mkdir()
    link = of_the_dead(out)
    link.symlink_to(kept)
    left = of_the_dead(out)
    left.mkdir()
    (left / "replaced").symlink_to(tmp_path / "none")
    (left / "inside").symlink_to(kept)
    with work_folder(out / "wall.usda"):
        pass
    assert names(out) == {link.name}
    assert (kept / "file").read_text() == "dear"


def test_what_cannot_be_judged_stays(tmp_path: Path) -> None:
    dead, mine = of_the_dead(tmp_path).name, private_name()
    where = dead.split("-")[1]
    elsewhere = dead.replace(where, f"{int(where, 16) ^ 1:012x}")  # another boot or container
    hidden, head, pid, began, end = mine.partition("-")[0], *mine.split("-")[1:]
    again = f"{hidden}-{head}-{pid}-{int(began) + 1}-{end}"  # a number that was given twice
    unknown = f"{hidden}-{head}-{pid}-0-{end}"  # when it began nobody could see
    others = [elsewhere, mine, unknown, ".hdrusd-abcd_123", ".hdrusd", f"x{dead}"]
    for name in (dead, again, *others):
        (tmp_path / name).mkdir()
    assert {path.name for path in left_behind(tmp_path)} == {dead, again}
