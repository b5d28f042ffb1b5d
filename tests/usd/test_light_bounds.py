"""Lights whose numbers no float32 can be computed with are left out, and said to be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders import light_row, new_stage
from pxr import UsdGeom, UsdLux

from hdrusd.photometry.area import circle_illuminance
from hdrusd.report import Report
from hdrusd.scene import DISK, SPHERE, Camera
from hdrusd.usd.extract import StageReader
from hdrusd.usd.light_bounds import sound


@pytest.mark.parametrize(
    ("changes", "good"),
    [
        ({}, True),
        ({"position": [3.8e8, 0, 0]}, True),
        ({"position": [0, -2e9, 0]}, False),
        ({"radius": 2e8}, False),
        ({"shape": DISK, "x": [0, 0, 2e8]}, False),
        ({"intensity": 2e18}, False),
        ({"intensity": -1.0}, False),
        ({"intensity": [np.nan, 0, 0]}, False),
        ({"shape": SPHERE, "radius": 1e-10}, True),  # 3e19 cd/m2
        ({"shape": SPHERE, "radius": 1e-16}, False),  # 3e31
        ({"shape": SPHERE, "radius": 0.0}, False),
        ({"w": 0.0, "intensity": 1e5}, True),
    ],
)
def test_bounds(changes: dict[str, Any], good: bool) -> None:
    rows = np.concatenate([light_row(1.0), light_row(**({"intensity": 1.0} | changes))])
    assert sound(rows).tolist() == [True, good]


@pytest.mark.parametrize("kind", ["SphereLight", "RectLight", "DistantLight", "DomeLight"])
def test_two_to_the_200th_is_left_out(kind: str) -> None:
    stage, report = new_stage(), Report()
    UsdGeom.Cube.Define(stage, "/Box")
    light = getattr(UsdLux, kind).Define(stage, "/Lamp")
    light.CreateExposureAttr(200.0)
    scene = StageReader(stage, report).read(0.0, Camera())
    assert len(scene.lights) == 0
    assert scene.ambient == (0.0, 0.0, 0.0)
    assert {f.thing for f in report if f.code == "light-invalid"} == {"/Lamp"}


def test_a_disk_far_away_is_a_point_in_float32() -> None:
    """Cos cos / d^2 at 1e10 m, whose fourth power is beyond float32."""
    p = np.array([[6e9, 0.0, 8e9]], np.float32)
    z = np.array([[0.0, 0.0, 1.0]], np.float32)
    got = circle_illuminance(p, z, -z, np.ones(1, np.float32))
    assert got == pytest.approx(0.64 / 1e20, rel=20 * 2.0**-24)
