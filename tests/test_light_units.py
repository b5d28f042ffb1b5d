"""samples/light_units: exact units by a reader that knows nothing of hdrusd, and in the frame."""

from __future__ import annotations

import importlib.util
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from converted import run
from pxr import Usd, UsdGeom

from hdrusd.job import Job
from hdrusd.render import render_sequence
from hdrusd.report import Report

FOLDER = Path(__file__).parents[1] / "samples" / "light_units"
SOURCE = FOLDER / "light_units.gltf"

#: What the file states, by the last word of the path that it becomes.
STATED = {
    "point_1000_cd": (1000.0, "cd"),
    "spot_30000_cd": (30_000.0, "cd"),
    "directional_0_25_lx": (0.25, "lx"),
    "glow_20000_cd_m2": (20_000.0, "cd/m2"),
}

WIDTH, HEIGHT = 320, 180


def sample(name: str) -> Any:
    """A script of the sample as a module."""
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_file_is_what_its_script_writes() -> None:
    written = sample("make_light_units").document()
    assert json.loads(SOURCE.read_text(encoding="utf-8")) == json.loads(json.dumps(written))


@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_every_unit_reads_back(tmp_path: Path, unit: float) -> None:
    result = run(SOURCE, tmp_path / "units.usda", meters_per_unit=unit)
    stage = Usd.Stage.Open(str(result.output))
    found = {
        path.rpartition("/")[2]: (value, name)
        for path, value, name in sample("read_units").readings(stage)
    }
    assert found.keys() == STATED.keys()
    for name, (value, word) in STATED.items():
        assert found[name][1] == word
        assert found[name][0] == pytest.approx(value, rel=1e-5)


def floor_points(stage: Usd.Stage) -> npt.NDArray[np.float64]:
    """(h, w, 3): where the ray through each pixel's centre meets y = 0, m."""
    prim = next(prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera))
    camera = UsdGeom.Camera(prim).GetCamera(Usd.TimeCode.EarliestTime())
    up = math.tan(math.radians(camera.GetFieldOfView(camera.FOVVertical)) / 2.0)
    x = (2.0 * (np.arange(WIDTH) + 0.5) / WIDTH - 1.0) * up * WIDTH / HEIGHT
    y = (1.0 - 2.0 * (np.arange(HEIGHT) + 0.5) / HEIGHT) * up
    local = np.stack([*np.broadcast_arrays(x[None, :], y[:, None]), -np.ones((HEIGHT, WIDTH))], -1)
    world = np.array(camera.transform)
    rays = local @ world[:3, :3]
    eye = world[3, :3]
    return np.asarray(eye - rays * (eye[1] / rays[..., 1:2]))


def test_the_floor_is_as_bright_as_its_formula(gl: Any, tmp_path: Path) -> None:
    result = run(SOURCE, tmp_path / "units.usda")
    job = Job(result.output, width=WIDTH, height=HEIGHT, shadows="none")
    (frame,) = render_sequence(gl, job, Report())
    places = floor_points(Usd.Stage.Open(str(result.output)))

    def illuminance(candela: float, lamp: tuple[float, float, float]) -> npt.NDArray[np.float64]:
        way = np.subtract(lamp, places)
        return np.asarray(candela * way[..., 1] / np.linalg.norm(way, axis=-1) ** 3)

    x, z = places[..., 0], places[..., 2]
    point = illuminance(1000.0, (-25.0, 10.0, 0.0))
    spot = illuminance(30_000.0, (0.0, 20.0, 0.0))
    off = np.hypot(x, z)
    inside = off < 20.0 * math.tan(0.1) - 0.05  # the inner cone, where nothing fades
    outside = off > 20.0 * math.tan(0.3) + 0.05
    floor = (np.abs(x) < 39.0) & (np.abs(z) < 14.0) & (np.hypot(x - 25.0, z) > 3.0)
    wanted = 0.5 / math.pi * (0.25 + point + np.where(inside, spot, 0.0))
    seen = floor & (inside | outside)
    assert seen.sum() > 3000
    assert (seen & inside).sum() > 30
    measured = frame.hdr[..., :3].astype(np.float64)
    # float32 sums of three lights: some 2^-24 each; positions from a 24-bit depth buffer.
    np.testing.assert_allclose(measured[seen], wanted[seen][:, None].repeat(3, 1), rtol=1e-4)
    panel = (np.abs(x - 25.0) < 1.5) & (np.abs(z) < 1.5)
    assert panel.sum() > 10
    np.testing.assert_allclose(measured[panel], 20_000.0, rtol=1e-5)
