"""The main job, end to end: street.osgt -> photometric stage -> frames -> video, contact sheet.

    python samples/street/demo.py OUTDIR

runs, and prints, the commands that a user would type. The video and the sheet have the same
columns: the night by a camera's exposure, by Reinhard 2002, by Irawan 2005, and by Irawan 2005
with the glare in the eye. The sheet's last row is one moment by other eyes: the database by
day as OpenGL shows it, the luminance, an observer of 70 years, and night vision.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from pxr import Sdf, Usd, UsdGeom, UsdLux

from hdrusd.contact_sheet import contact_sheet
from hdrusd.errors import HdrusdError
from hdrusd.video import VideoWriter, check_video

HERE = Path(__file__).resolve().parent
HDRUSD = Path(sys.executable).parent / "hdrusd"

#: 24 moments, six a second, of the four seconds of the drive.
FRAMES, FPS = range(1, 94, 4), 6
TIME_CODES = 24  # a second

#: A car overtakes, its tail lamps are near, the oncoming car dazzles.
ROWS = (45, 65, 93)
CAMERA, SIZE = "WetRoad", (960, 540)
WIDTH = SIZE[0] // 2  # of a picture in the video and on the sheet

#: Operators of the columns: name of the files, heading, options.
COLUMNS = (
    ("exposure", "exposure, EV 4", ("--operator", "exposure", "--set", "ev100=4")),
    ("reinhard", "Reinhard 2002, key 0.09", ("--operator", "reinhard02", "--set", "key=0.09")),
    ("irawan", "Irawan 2005", ("--operator", "irawan05")),
    ("glare", "Irawan 2005 + glare", ("--operator", "irawan05", "--glare", "cie135")),
)
#: The same of the sheet's last row, of the last of ROWS; "daylight" is rendered.
OTHERS = (
    ("daylight", "the database by day", ()),
    (
        "falsecolour",
        "luminance",
        ("--operator", "falsecolour", "--set", "scale=10000", "--set", "decades=5"),
    ),
    (
        "elderly",
        "Irawan + glare, 70 years old",
        ("--operator", "irawan05", "--glare", "cie135", "--observer", "elderly"),
    ),
    (
        "night_vision",
        "Irawan + glare + night vision",
        ("--operator", "irawan05", "--glare", "cie135", "--night-vision", "all"),
    ),
)

#: Exit code after Ctrl-C, as of hdrusd.
INTERRUPTED = 130

#: Daylight for the look as it was: lux of the sun and of the sky.
SUN, SKY = 50_000.0, 10_000.0


def run(*command: object) -> None:
    """Print a command and run it. Raises CalledProcessError, the command's own words said."""
    words = [str(word) for word in command]
    shown = " ".join(Path(words[0]).name if i == 0 else w for i, w in enumerate(words))
    print("$", shown, flush=True)  # before what the command says on standard error
    with subprocess.Popen(words, stdout=subprocess.DEVNULL) as command_line:
        try:
            code = command_line.wait()
        except KeyboardInterrupt:  # Ctrl-C reaches the command too, which tidies up and says so
            code = command_line.wait()
            if code == 0:
                raise
    if code != 0:
        raise subprocess.CalledProcessError(code, words)


def write_daylight(out: Path) -> Path:
    """The same database without its photometry layer, under a sun and a sky."""
    night = Sdf.Layer.FindOrOpen(str(out / "stage" / "street.usda"))
    path = out / "stage" / "street.daylight.usda"
    path.unlink(missing_ok=True)
    layer = Sdf.Layer.CreateNew(str(path))
    layer.subLayerPaths[:] = [p for p in night.subLayerPaths if "photometry" not in p]
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    stage.SetTimeCodesPerSecond(night.timeCodesPerSecond)
    sun = UsdLux.DistantLight.Define(stage, "/Day/Sun")
    sun.CreateNormalizeAttr(True)
    sun.CreateIntensityAttr(SUN)
    UsdGeom.Xformable(sun).AddRotateXYZOp().Set((40.0, 15.0, 0.0))
    UsdLux.DomeLight.Define(stage, "/Day/Sky").CreateIntensityAttr(SKY / np.pi)
    layer.Save()
    return path


def read_pictures(out: Path, looks: Iterable[str], frame: int) -> list[np.ndarray]:
    """(h / 2, w / 2, 3) uint8 of each look at a frame."""
    files = [out / "frames" / f"{look}.{frame:04d}.png" for look in looks]
    pictures = [oiio.ImageBuf(str(file)).get_pixels(oiio.UINT8) for file in files]
    return [halve(np.asarray(picture)[..., :3]) for picture in pictures]


def halve(picture: np.ndarray) -> np.ndarray:
    """Half the size, each pixel the mean of four: quicker than a filter, 96 times."""
    h, w = picture.shape[0] // 2, picture.shape[1] // 2
    blocks = picture[: 2 * h, : 2 * w].reshape(h, 2, w, 2, 3)
    return (blocks.mean(axis=(1, 3)) + 0.5).astype(np.uint8)


def moment(frame: int) -> str:
    """Name of a row: seconds of the drive."""
    return f"{frame / TIME_CODES:.2f} s"


def write_video(out: Path) -> Path | None:
    """The columns side by side as they move; None without PyAV, which is said."""
    try:
        check_video()
    except HdrusdError as missing:
        print(f"demo: no video: {missing}", file=sys.stderr)
        return None
    looks, headings, _ = zip(*COLUMNS, strict=True)
    path = out / "street.mp4"
    with VideoWriter(path, FPS) as video:
        for frame in FRAMES:
            row = read_pictures(out, looks, frame)
            video.add(contact_sheet([row], headings, [moment(frame)], width=WIDTH))
    return path


def write_sheet(out: Path) -> Path:
    """Rows of moments, columns of looks; below them one moment's other looks."""
    looks, headings, _ = zip(*COLUMNS, strict=True)
    rows = [read_pictures(out, looks, frame) for frame in ROWS]
    others, names, _ = zip(*OTHERS, strict=True)
    last = [read_pictures(out, others, ROWS[-1])]
    moments = [moment(frame) for frame in ROWS]
    parts = (
        contact_sheet(rows, headings, moments, width=WIDTH),
        contact_sheet(last, names, moments[-1:], width=WIDTH),
    )
    sheet = np.ascontiguousarray(np.concatenate(parts))
    path = out / "contact_sheet.png"
    picture = oiio.ImageBuf(oiio.ImageSpec(sheet.shape[1], sheet.shape[0], 3, oiio.UINT8))
    picture.set_pixels(oiio.ROI(), sheet)
    if not picture.write(str(path)):
        raise HdrusdError(f"{path}: cannot be written ({picture.geterror()})")
    return path


def main() -> int:
    """Run the demo; returns the exit code, that of the command that failed if one did."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("outdir", type=Path, metavar="OUTDIR", help="folder for all that is made")
    out = parser.parse_args().outdir
    try:
        demo(out)
    except subprocess.CalledProcessError as failed:
        # A signal is a negative number here, 128 and more for a shell.
        code = failed.returncode if failed.returncode > 0 else 128 - failed.returncode
        if code != INTERRUPTED:
            name = " ".join(Path(word).name for word in failed.cmd[:2])
            print(f"demo: {name} ended with exit code {code}", file=sys.stderr)
        return code
    except HdrusdError as failed:
        print(f"demo: {failed}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    return 0


def demo(out: Path) -> None:
    """Make the database, convert it, render it, lay out the video and the sheet."""
    started = time.perf_counter()
    frames, stage = out / "frames", out / "stage" / "street.usda"
    view = ("--camera", CAMERA, "--imageWidth", SIZE[0], "--imageHeight", SIZE[1], "-q")
    drive = f"{FRAMES[0]}:{FRAMES[-1]}x{FRAMES.step}"
    run(sys.executable, HERE / "make_street.py", out / "database")
    run(HDRUSD, "convert", out / "database/street.osgt", stage, "-q",
        "--report", out / "report.json")  # fmt: skip
    night = frames / "night.####.exr"
    run(HDRUSD, "render", stage, night, "--frames", drive, *view)
    for look, _, options in COLUMNS:
        run(HDRUSD, "tonemap", night, frames / f"{look}.####.png", "-q", *options)
    last = ("--frames", ROWS[-1])
    for look, _, options in OTHERS[1:]:
        run(HDRUSD, "tonemap", night, frames / f"{look}.####.png", "-q", *last, *options)
    day = write_daylight(out)
    run(HDRUSD, "render", day, frames / "daylight.####.png", *last, *view,
        "--operator", "exposure", "--enableDomeLightVisibility")  # fmt: skip
    video, sheet = write_video(out), write_sheet(out)
    print(f"{sheet}: three moments, four looks; the last moment by other eyes")
    if video is not None:
        print(f"{video}: the four looks as they move")
    print(f"{frames}: 24 frames in cd/m2 and tone-mapped; {time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    sys.exit(main())
