"""Worker processes: what comes back, and what becomes of one that goes wrong."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from same_scene import differences
from worker_readers import everything

from hdrusd.errors import InputError
from hdrusd.importers import worker
from hdrusd.importers.confine import landlock_version
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.legacy.scene import LegacyScene
from hdrusd.report import Finding, Report

SOON = Limits(worker_seconds=3)


def ask(
    folder: Path, reader: str, limits: Limits | None = None
) -> tuple[LegacyScene, list[Finding]]:
    """What a reader of worker_readers makes of ``folder/model.fbx``, in a worker."""
    source = folder / "model.fbx"
    source.write_bytes(b"model")
    report = Report()
    resolver = Resolver(source, report, limits=limits or Limits())
    return worker.read(f"worker_readers:{reader}", resolver, report), list(report)


def test_a_scene_comes_back_whole_with_its_findings(tmp_path: Path) -> None:
    (tmp_path / "wall.png").touch()
    scene, findings = ask(tmp_path, "everything")
    report = Report()
    here = everything(Resolver(tmp_path / "model.fbx", report), report)
    assert differences(here, scene) == ["materials[0].diffuse_map.image.path"]
    assert findings == list(report)
    wall = scene.materials[0].diffuse_map
    assert wall is not None
    assert wall.image.path == tmp_path / "wall.png"
    hip = scene.roots[0].children[0]
    assert scene.skins[0].joints[1] is hip
    assert scene.skins[0].joints[0] is hip.children[0]


@pytest.mark.parametrize(
    ("reader", "said"),
    [
        ("refusing", "model.fbx:byte 12: broken; want it whole"),
        ("raising", "LookupError: no such thing"),
        ("eating", "needs more than 2048 MiB"),
        ("dying", "crashed with SIGSEGV (last words)"),
        ("chatting", "failed"),
        ("garbage", "answered nonsense"),
        ("nothing", "answered nonsense"),
        ("missing", "AttributeError"),
    ],
)
def test_a_worker_that_goes_wrong_is_one_line(tmp_path: Path, reader: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        ask(tmp_path, reader)
    text = str(caught.value)
    assert said in text
    assert text.startswith("model.fbx:")
    assert "want" in text
    assert "\n" not in text
    assert len(text) < 600
    assert sorted(path.name for path in tmp_path.iterdir()) == ["model.fbx"]


def alive(process: int) -> bool:
    """Whether a process runs; one that nobody has gathered yet is dead."""
    try:
        stat = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"


#: A child that outlives its parent, unless the group dies.
CHILD = "import os, time; child = os.fork(); child and open('child', 'w').write(str(child))"
SLEEP = f"{CHILD}; time.sleep(600)"


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="no /proc to see processes in")
def test_a_worker_that_hangs_ends_with_its_children(tmp_path: Path) -> None:
    began = time.monotonic()
    with pytest.raises(InputError, match="takes long took more than 3 s; want"):
        worker.run(
            [sys.executable, "-c", SLEEP],
            folder=tmp_path,
            limits=SOON,
            source=Path("a.ive"),
            reader="takes long",
            readable=[Path(sys.prefix), Path(sys.base_prefix)],
        )
    assert 2.5 < time.monotonic() - began < 60.0
    assert not alive(int((tmp_path / "child").read_text()))


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="no /proc to see processes in")
def test_an_interrupted_program_leaves_no_worker(tmp_path: Path) -> None:
    program = (
        "import signal, sys, threading\n"
        "from pathlib import Path\n"
        "from hdrusd.importers import worker\n"
        "from hdrusd.importers.importer import Limits\n"
        "def stop():\n"
        "    import time\n"
        f"    while not Path({str(tmp_path)!r}, 'child').exists(): time.sleep(0.05)\n"
        "    signal.raise_signal(signal.SIGINT)\n"
        # Who starts the tests in the background hands down an ignored SIGINT.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "threading.Thread(target=stop, daemon=True).start()\n"
        f"command = [sys.executable, '-c', {SLEEP!r}]\n"
        f"worker.run(command, folder=Path({str(tmp_path)!r}), limits=Limits(worker_seconds=60),\n"
        "    source=Path('a.ive'), reader='x',\n"
        "    readable=[Path(sys.prefix), Path(sys.base_prefix)])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=50
    )
    assert "KeyboardInterrupt" in done.stderr
    assert not alive(int((tmp_path / "child").read_text()))


def test_a_worker_sees_nothing_of_ours(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("A_SECRET", "42")
    (tmp_path / "outside.txt").write_text("secret")
    (tmp_path / "in").mkdir()
    # "" of python -c and -m is where the user is, which is no root.
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", ["", *sys.path])
    _, findings = ask(tmp_path / "in", "telling")
    said = {(finding.code, finding.thing): finding.text for finding in findings}
    assert str(tmp_path) not in said["environment", "PYTHONPATH"].split(os.pathsep)
    assert ("environment", "A_SECRET") not in said
    assert said["environment", "LANG"] == "C"
    assert said["input", ""] == "''"
    assert said["group", ""] == "True"
    assert os.environ["HOME"] != said["environment", "HOME"]
    if not landlock_version():
        pytest.skip("the rest needs Landlock, which this system has not")
    assert said["outside", ""] == "PermissionError"
    assert said["written", ""] == "PermissionError"
    assert not (tmp_path / "in" / "written.txt").exists()


def test_a_file_that_grows_too_long_is_cut_short(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="failed"):
        ask(tmp_path, "everything", Limits(file_bytes=100))
