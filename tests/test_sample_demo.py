"""The demo of the sample street: what becomes of pictures, of a failure and of Ctrl-C.

That it runs as a whole is the job of ``make demo``; here are the parts around its commands.
"""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import OpenImageIO as oiio
import pytest

SCRIPT = Path(__file__).parents[1] / "samples" / "street" / "demo.py"

pytestmark = pytest.mark.skipif(
    not SCRIPT.exists(), reason="the samples are not beside these tests"
)

#: A colour that no letter has.
PLAIN = (90, 40, 60)

#: A command that says it is ready, and ends with 130 on Ctrl-C, as hdrusd does.
PATIENT = """
import sys, time
try:
    print("ready", file=sys.stderr, flush=True)
    time.sleep(60)
except KeyboardInterrupt:
    print("interrupted", file=sys.stderr)
    sys.exit(130)
"""

#: The demo, with that command in place of its own.
DEMO = f"""
import importlib.util, sys
spec = importlib.util.spec_from_file_location("demo", {str(SCRIPT)!r})
demo = importlib.util.module_from_spec(spec)
spec.loader.exec_module(demo)
demo.demo = lambda out: demo.run(sys.executable, "-c", {PATIENT!r})
sys.argv = ["demo.py", "unused"]
sys.exit(demo.main())
"""


@pytest.fixture
def demo() -> ModuleType:
    spec = importlib.util.spec_from_file_location("demo", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def write_frames(demo: ModuleType, out: Path) -> None:
    """Pictures of one colour for every look and moment, at full size."""
    (out / "frames").mkdir()
    width, height = demo.SIZE
    plain = np.full((height, width, 3), PLAIN, np.uint8)
    picture = oiio.ImageBuf(oiio.ImageSpec(width, height, 3, oiio.UINT8))
    picture.set_pixels(oiio.ROI(), plain)
    source = out / "plain.png"
    assert picture.write(str(source))
    for look, *_ in (*demo.COLUMNS, *demo.OTHERS):
        for frame in demo.FRAMES:
            os.link(source, out / "frames" / f"{look}.{frame:04d}.png")


def test_rows_are_frames_of_the_drive(demo: ModuleType) -> None:
    assert len(demo.FRAMES) == 24
    assert set(demo.ROWS) <= set(demo.FRAMES)
    # The video runs as fast as the cars do.
    assert demo.FPS * demo.FRAMES.step == demo.TIME_CODES
    assert demo.moment(48) == "2.00 s"


def test_the_sheet_has_a_row_for_each_moment_and_one_of_other_eyes(
    demo: ModuleType, tmp_path: Path
) -> None:
    write_frames(demo, tmp_path)
    sheet = oiio.ImageBuf(str(demo.write_sheet(tmp_path))).get_pixels(oiio.UINT8)
    height = demo.WIDTH * demo.SIZE[1] // demo.SIZE[0]
    shown = np.all(np.asarray(sheet) == PLAIN, axis=2)
    assert shown.sum() == 4 * (len(demo.ROWS) + 1) * demo.WIDTH * height


def test_no_heading_is_cut(demo: ModuleType) -> None:
    for _, heading, _ in (*demo.COLUMNS, *demo.OTHERS):
        # 16 pixels high, as hdrusd/contact_sheet.py writes them.
        assert oiio.ImageBufAlgo.text_size(heading, 16).xend < demo.WIDTH, heading


def test_the_video_is_as_long_as_the_drive(demo: ModuleType, tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    write_frames(demo, tmp_path)
    path = demo.write_video(tmp_path)
    with av.open(str(path)) as container:
        (stream,) = container.streams.video
        assert stream.frames == 24
        assert stream.average_rate == demo.FPS
        assert stream.width > 4 * demo.WIDTH


def test_without_pyav_there_is_no_video_and_one_line(
    demo: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    assert demo.write_video(tmp_path) is None
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("demo: no video: ")
    assert "pip install" in line


def test_a_command_that_fails_ends_the_demo_with_its_code(
    demo: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    reached = []

    def failing(out: Path) -> None:
        demo.run(sys.executable, "-c", "raise SystemExit(5)")
        reached.append(out)

    monkeypatch.setattr(demo, "demo", failing)
    monkeypatch.setattr(sys, "argv", ["demo.py", "unused"])
    assert demo.main() == 5
    assert not reached
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("demo: python")
    assert line.endswith("ended with exit code 5")


def test_ctrl_c_waits_for_the_command_and_is_said_once() -> None:
    # Ctrl-C reaches every process of the terminal's group.
    with subprocess.Popen(
        [sys.executable, "-c", DEMO],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # Who starts the tests in the background hands down an ignored SIGINT.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as running:
        assert running.stderr is not None
        assert running.stderr.readline() == "ready\n"
        os.killpg(running.pid, signal.SIGINT)
        _, said = running.communicate(timeout=60)
    assert running.returncode == 130
    assert said == "interrupted\n"
