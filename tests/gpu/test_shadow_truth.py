"""The shared truth set's cases with shadows: probes, each light times what is seen of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shadow_scenes import maps, seen

from hdrusd.gpu.shadows import shadow_rows
from hdrusd.photometry.shading import shade
from hdrusd.report import Report
from hdrusd.usd.extract import StageReader


@pytest.mark.parametrize("name", ["shadow_box", "instanced_lamps"])
def test_probes(gl: Any, testdata: Path, name: str) -> None:
    from pxr import Usd

    folder = testdata / "truth"
    if not (folder / "expected.json").is_file():
        pytest.skip("the test data has no truth set")
    document = json.loads((folder / "expected.json").read_text("utf-8"))
    (case,) = [c for c in document["cases"] if c["id"] == name]
    width, height = case["resolution"]
    reader = StageReader(Usd.Stage.Open(str(folder / case["stage"])), Report())
    scene = reader.read(0.0, reader.camera(case["camera"], 0.0, width / height))
    shadows = maps(gl)
    kinds = shadows.update(scene).kind
    assert [shadow_rows(str(k)) for k in kinds] == [2] * len(scene.lights)
    reflectance = {"floor": 0.5, "road": 0.12, "stud": (0.7, 0.7, 0.6)}
    for probe in case["probes"]:
        point, normal = np.array(probe["point_m"]), np.array(probe["normal"])
        rho = np.broadcast_to(reflectance[probe["surface"].rstrip("012")], 3)
        total = np.zeros(3)
        for i in range(len(scene.lights)):
            share = seen(gl, scene, point[None], tuple(normal), light=i, shadows=shadows)
            lux = shade(
                point[None],
                normal[None],
                rho[None],
                np.zeros((1, 3)),
                np.zeros(1),
                scene.lights[i : i + 1],
                eye=np.asarray(scene.camera.eye),
            )
            total += share[0] * lux[0]
        assert total == pytest.approx(probe["expect"]["RGB"], rel=probe["rel_tol"], abs=1e-4)
