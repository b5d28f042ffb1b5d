"""Folders of truth cases (format hdrusd-truth/1): rendering, checking, what is exact.

A folder has an ``expected.json`` and, for sets made elsewhere, the checker that belongs to
it (``check_exr.py``); without one the probes are compared here. Every case is rendered,
whatever its words for what it covers.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import moderngl
import numpy as np

from hdrusd.images import read_exr
from hdrusd.job import Job
from hdrusd.render import render_sequence
from hdrusd.report import Report
from hdrusd.units import LUMINANCE_WEIGHTS

#: What a job does not do by itself, by the word for it among what a case covers or needs.
OPTIONS: Mapping[str, Mapping[str, Any]] = {
    "occlusion": {"sky_samples": 16384},
}

#: Words for what is not computed by its definition alone, and what stands in. The rest is
#: the closed form in float32.
APPROXIMATED = {
    "texture": "8-bit texels become half floats",
    "shadow": "edges are right to a texel of the shadow map",
    "disk": "a polygon of 64 sides stands for it",
    "cylinder": "strips by a quadrature of six points",
    "lat-long texture": "spherical harmonics of bands 0, 1, 2 and 4",
    "occlusion": "16384 directions are looked up in depth maps",
}


@dataclass(frozen=True)
class Case:
    """One entry of expected.json."""

    id: str
    folder: Path
    stage: Path
    core: bool
    covers: tuple[str, ...]
    frames: tuple[tuple[float, str], ...]  # time code, file
    camera: str | None
    entry: dict[str, Any]

    @property
    def approximated(self) -> list[str]:
        """Those of ``covers`` that are right only to an error of their own."""
        return [word for word in self.covers if word in APPROXIMATED]

    @property
    def options(self) -> dict[str, Any]:
        """The fields of a Job that this case sets beside its stage and camera."""
        width, height = self.entry.get("resolution", (None, None))
        found: dict[str, Any] = {"width": width, "height": height}
        for word, options in OPTIONS.items():
            if word in self.covers or word in self.entry.get("needs", ""):
                found |= options
        return found


def read_cases(folder: Path) -> list[Case]:
    """The cases of a folder. ValueError for another format."""
    document = json.loads((folder / "expected.json").read_text(encoding="utf-8"))
    if document["format"] != "hdrusd-truth/1":
        raise ValueError(f"{folder}: format {document['format']}; want hdrusd-truth/1")
    return [
        Case(
            id=entry["id"],
            folder=folder,
            stage=folder / entry["stage"],
            core=entry.get("class", "core") == "core",
            covers=tuple(entry.get("covers", ())),
            frames=tuple((float(f["time"]), f["exr"]) for f in entry["frames"]),
            camera=entry.get("camera"),
            entry=entry,
        )
        for entry in document["cases"]
    ]


def render_case(ctx: moderngl.Context, case: Case, output: Path, report: Report) -> None:
    """Render every frame of a case under the name that its checker looks for."""
    session = blinn_phong_session(case, output)
    for time, name in case.frames:
        job = Job(
            case.stage,
            [time],
            str(output / name),
            camera=case.camera,
            session_layer=session,
            **case.options,
        )
        for _ in render_sequence(ctx, job, report):
            pass


def check(case: Case, output: Path) -> tuple[bool, str]:
    """Whether the rendered case is right, and lines that say so."""
    checker = case.folder / "check_exr.py"
    if not checker.is_file():
        lines = list(_judge(output, case))
        return not any(line.startswith("FAIL") for line in lines), "\n".join(lines)
    arguments = [str(case.folder / "expected.json"), str(output), "--case", case.id]
    run = subprocess.run(
        [sys.executable, str(checker), *arguments], capture_output=True, text=True, check=False
    )
    lines = (run.stdout + run.stderr).strip().splitlines()
    return run.returncode == 0, "\n".join(line for line in lines if case.id in line)


def worst(case: Case, output: Path) -> float:
    """The largest difference of luminance of a rendered case at its probes, relative.

    Where nothing is expected it is infinite unless there is nothing within ``abs_tol``.
    """
    pictures = {time: read_exr(output / name)[0] for time, name in case.frames}
    found = 0.0
    for probe in case.entry["probes"]:
        x, y = probe["pixel"]
        got = float(pictures[probe["frame"]][y, x] @ LUMINANCE_WEIGHTS)
        wanted = probe["expect"]["Y"]
        if wanted > 0.0:
            found = max(found, abs(got / wanted - 1.0))
        elif abs(got) > probe["abs_tol"]:
            found = math.inf
    return found


def _judge(output: Path, case: Case) -> Iterable[str]:
    pictures = {time: read_exr(output / name)[0] for time, name in case.frames}
    bad = 0
    for probe in case.entry["probes"]:
        x, y = probe["pixel"]
        got = pictures[probe["frame"]][y, x].astype(np.float64)
        wanted = np.array(probe["expect"]["RGB"])
        limit = np.maximum(probe["rel_tol"] * np.abs(wanted), probe["abs_tol"])
        if not np.all(np.abs(got - wanted) <= limit):
            bad += 1
            yield f"FAIL  {case.id} {probe['id']} [{x}, {y}]: {got}; want {wanted}"
    if not bad:
        count = len(case.entry["probes"])
        yield f"pass  {case.id} {count} probes, worst |err Y| {worst(case, output):.5%}"


def blinn_phong_session(case: Case, output: Path) -> Path | None:
    """A session layer with the Blinn-Phong numbers of a case's lights.json in our attributes.

    None where it has no such materials: UsdPreviewSurface cannot say them.
    """
    if "photometry" not in case.entry:
        return None
    plain = json.loads((case.folder / case.entry["photometry"]).read_text("utf-8"))
    grey = "({0}, {0}, {0})"
    overs = "".join(
        f"""
        over "{material["name"]}" (
            prepend apiSchemas = ["HdrusdPhotometricMaterialAPI"]
        )
        {{
            uniform color3f legacy:specularColor = {grey.format(material["ks"])}
            uniform float legacy:shininess = {material["exponent"]}
        }}
"""
        for material in plain["materials"]
        if material["model"] == "blinn_phong"
    )
    if not overs:
        return None
    layer = output / f"{case.id}.session.usda"
    layer.write_text(
        f'#usda 1.0\n\nover "World"\n{{\n    over "Looks"\n    {{{overs}    }}\n}}\n',
        encoding="utf-8",
    )
    return layer
