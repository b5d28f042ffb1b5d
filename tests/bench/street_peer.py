"""hdrusd on the peers' street, in the protocol of their benchmark (``common.args``).

Run by ``python -m tests.bench peers``, as a fresh process a job. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import importlib
import math
import os
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from hdrusd.frame_io import Writer
from hdrusd.gpu.context import create_context, describe
from hdrusd.images import write_exr
from hdrusd.job import Job
from hdrusd.render import Renderer
from hdrusd.report import Report
from hdrusd.scene import Camera


def main() -> None:
    """One job: N lights, frames of a moving camera, perhaps a sequence on disk."""
    sys.path.insert(0, os.environ["HDRUSD_PEERS_BENCH"])
    common: Any = importlib.import_module("common")

    def more(parser: argparse.ArgumentParser) -> None:
        parser.add_argument("--mode", choices=("auto", "exact", "merged"), default="auto")

    arguments = common.args(more)
    size = arguments.width, arguments.height
    # Converted from the glTF file that the peers read, so that the same faces are culled.
    stage = Path(arguments.scene) / "hdrusd" / f"street_{arguments.lights}.usda"
    job = Job(stage=stage, width=size[0], height=size[1], shadows=False, lights=arguments.mode)
    context = create_context()
    renderer = Renderer(context, job, Report())
    half = math.tan(math.radians(common.CAM["fov_y"]) / 2)
    wide = half * size[0] / size[1]

    def render(frame: int) -> np.ndarray:
        camera = Camera(
            eye=common.camera_z(frame),
            window=(-wide, wide, -half, half),
            near=common.CAM["near"],
            far=common.CAM["far"],
        )
        renderer.hdr.render(renderer.reader.read(1.0, camera))
        return renderer.hdr.read()

    writer = Writer().__enter__()

    def write(number: int, image: np.ndarray, folder: str) -> None:
        path = Path(folder) / f"hdrusd.{number:04d}.exr"
        writer.submit(write_exr, path, image, half=True, compression="htj2k")

    write.finish = lambda: writer.__exit__(None, None, None)  # type: ignore[attr-defined]

    loop = common.Loop(arguments).run(render, write, "half EXR, HTJ2K")
    loop.result(
        peer=f"hdrusd-{arguments.mode}",
        version=version("hdrusd"),
        renderer=describe(context)["renderer"],
        lights_used=arguments.lights,
        readback="float32 RGB, cd/m2",
        units="cd/m2",
        hdr="yes",
        shadows="off",
    )


if __name__ == "__main__":
    main()
