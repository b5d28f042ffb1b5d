"""The main job, end to end: street.osgt -> photometric stage -> frames -> contact sheet.

    python samples/street/demo.py OUTDIR

runs, and prints, the commands that a user would type. Rows of the contact sheet are
moments of the drive; columns are the database by day as OpenGL shows it, the night by
a camera's exposure, by Reinhard 2002, and its luminance in false colour.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from pxr import Sdf, Usd, UsdGeom, UsdLux

HERE = Path(__file__).resolve().parent
HDRUSD = Path(sys.executable).parent / "hdrusd"

#: 24 moments, six a second, of the four seconds of the drive.
FRAMES = "1:93x4"
ROWS = (1, 45, 93)
SIZE = (640, 360)

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
    sun = UsdLux.DistantLight.Define(stage, "/Day/Sun")
    sun.CreateNormalizeAttr(True)
    sun.CreateIntensityAttr(SUN)
    UsdGeom.Xformable(sun).AddRotateXYZOp().Set((40.0, 15.0, 0.0))
    UsdLux.DomeLight.Define(stage, "/Day/Sky").CreateIntensityAttr(SKY / np.pi)
    layer.Save()
    return path


def read_png(path: Path) -> np.ndarray:
    """(h, w, 3) uint8."""
    return np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.UINT8))[..., :3]


def halve(picture: np.ndarray) -> np.ndarray:
    """Half the size, each pixel the mean of four."""
    h, w = picture.shape[0] // 2, picture.shape[1] // 2
    blocks = picture[: 2 * h, : 2 * w].reshape(h, 2, w, 2, 3)
    return (blocks.mean(axis=(1, 3)) + 0.5).astype(np.uint8)


def write_sheet(out: Path, columns: list[str]) -> Path:
    """Rows of moments, columns of looks, at half size."""
    rows = []
    for frame in ROWS:
        pictures = [read_png(out / "frames" / f"{c}.{frame:04d}.png") for c in columns]
        rows.append(np.concatenate([halve(picture) for picture in pictures], axis=1))
    sheet = np.ascontiguousarray(np.concatenate(rows, axis=0))
    path = out / "contact_sheet.png"
    spec = oiio.ImageSpec(sheet.shape[1], sheet.shape[0], 3, oiio.UINT8)
    picture = oiio.ImageBuf(spec)
    picture.set_pixels(oiio.ROI(), sheet)
    picture.write(str(path))
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
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    return 0


def demo(out: Path) -> None:
    """Make the database, convert it, render it, lay out the sheet."""
    started = time.perf_counter()
    frames, stage = out / "frames", out / "stage" / "street.usda"
    width = ("--imageWidth", SIZE[0], "--imageHeight", SIZE[1], "-q")
    rows = ",".join(str(row) for row in ROWS)
    run(sys.executable, HERE / "make_street.py", out / "database")
    run(HDRUSD, "convert", out / "database/street.osgt", stage, "-q",
        "--report", out / "report.json")  # fmt: skip
    run(HDRUSD, "render", stage, frames / "night.####.exr", "--frames", FRAMES,
        "--png", frames / "reinhard.####.png", "--operator", "reinhard02", *width)  # fmt: skip
    night = frames / "night.####.exr"
    run(HDRUSD, "tonemap", night, frames / "exposure.####.png", "--frames", rows,
        "--operator", "exposure")  # fmt: skip
    run(HDRUSD, "tonemap", night, frames / "falsecolour.####.png", "--frames", rows,
        "--operator", "falsecolour", "--set", "scale=1000", "--set", "decades=4")  # fmt: skip
    day = write_daylight(out)
    run(HDRUSD, "render", day, frames / "daylight.####.png", "--frames", rows,
        "--camera", "Driver", "--operator", "exposure", "--enableDomeLightVisibility",
        *width)  # fmt: skip
    sheet = write_sheet(out, ["daylight", "exposure", "reinhard", "falsecolour"])
    print(f"{sheet}: daylight | exposure | Reinhard | false colour")
    print(f"{frames}: 24 frames in cd/m2 and tone-mapped; {time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    sys.exit(main())
