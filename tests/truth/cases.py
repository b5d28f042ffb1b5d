"""Folders of truth cases (format hdrusd-truth/1): what is supported, rendering, checking.

A folder has an ``expected.json`` and, for sets made elsewhere, the checker that belongs to
it (``check_exr.py``); without one the probes are compared here.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import moderngl
import numpy as np

from hdrusd.images import read_exr
from hdrusd.render import Job, render_sequence
from hdrusd.report import Report
from hdrusd.units import LUMINANCE_WEIGHTS

#: What a case may cover or need that this version does not have, and why not.
UNSUPPORTED = {
    "IES LM-63": "photometric files are not read",
    "EULUMDAT": "photometric files are not read",
    "rect": "area lights shine from their centre",
    "disk": "area lights shine from their centre",
    "GGX": "the highlight is Blinn-Phong's",
    "lat-long texture": "dome textures are not read",
    "occlusion": "nothing occludes the sky",
}

#: What a case may cover that this version leaves out by a stated convention: the variant of
#: the expected values that holds then.
VARIANTS = {"shadow": "no_shadows"}


@dataclass(frozen=True)
class Case:
    """One entry of expected.json."""

    id: str
    stage: Path
    core: bool
    covers: tuple[str, ...]
    frames: tuple[tuple[float, str], ...]  # time code, file
    camera: str
    entry: dict[str, Any]

    @property
    def unsupported(self) -> str:
        """Why this version cannot pass the case; empty where it can."""
        return "; ".join(dict.fromkeys(UNSUPPORTED[c] for c in self.covers if c in UNSUPPORTED))

    @property
    def variant(self) -> str | None:
        """The variant to compare with, None for the expected values.

        A case that covers a thing left out has it only where its probes have the variant
        and differ from it.
        """
        for word in self.covers:
            name = VARIANTS.get(word)
            if name and any(
                probe.get("variants", {}).get(name, probe["expect"]) != probe["expect"]
                for probe in self.entry["probes"]
            ):
                return name
        return None


def read_cases(folder: Path) -> list[Case]:
    """The cases of a folder. ValueError for another format."""
    document = json.loads((folder / "expected.json").read_text(encoding="utf-8"))
    if document["format"] != "hdrusd-truth/1":
        raise ValueError(f"{folder}: format {document['format']}; want hdrusd-truth/1")
    return [
        Case(
            id=entry["id"],
            stage=folder / entry["stage"],
            core=entry["class"] == "core",
            covers=tuple(entry["covers"]),
            frames=tuple((float(f["time"]), f["exr"]) for f in entry["frames"]),
            camera=entry["camera"],
            entry=entry,
        )
        for entry in document["cases"]
    ]


def render_case(
    ctx: moderngl.Context, case: Case, output: Path, report: Report, session: Path | None = None
) -> None:
    """Render every frame of a case under the name that its checker looks for."""
    for time, name in case.frames:
        job = Job(case.stage, [time], str(output / name), camera=case.camera, session_layer=session)
        for _ in render_sequence(ctx, job, report):
            pass


def check(
    folder: Path, output: Path, cases: Sequence[Case], variant: str | None
) -> tuple[bool, str]:
    """Whether the rendered cases are right, and a line a case that says so."""
    checker = folder / "check_exr.py"
    if not checker.is_file():
        lines = [line for case in cases for line in _judge(output, case)]
        return not any(line.startswith("FAIL") for line in lines), "\n".join(lines)
    arguments = [argument for case in cases for argument in ("--case", case.id)]
    arguments += ["--variant", variant] if variant else []
    run = subprocess.run(
        [sys.executable, str(checker), str(folder / "expected.json"), str(output), *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    return run.returncode == 0, (run.stdout + run.stderr).strip()


def _judge(output: Path, case: Case) -> Iterable[str]:
    pictures = {time: read_exr(output / name)[0] for time, name in case.frames}
    worst, bad = 0.0, 0
    for probe in case.entry["probes"]:
        x, y = probe["pixel"]
        got = pictures[probe["frame"]][y, x].astype(np.float64)
        wanted = np.array(probe["expect"]["RGB"])
        limit = np.maximum(probe["rel_tol"] * np.abs(wanted), probe["abs_tol"])
        if not np.all(np.abs(got - wanted) <= limit):
            bad += 1
            yield f"FAIL  {case.id} {probe['id']} [{x}, {y}]: {got}; want {wanted}"
        bright = float(wanted @ LUMINANCE_WEIGHTS)
        if bright > 0.0:
            worst = max(worst, abs(float(got @ LUMINANCE_WEIGHTS) / bright - 1.0))
    if not bad:
        yield f"pass  {case.id} {len(case.entry['probes'])} probes, worst |err Y| {worst:.5%}"


def blinn_phong_session(case: Case, output: Path) -> Path:
    """A session layer with the Blinn-Phong numbers of a case's lights.json in our attributes."""
    plain = json.loads((case.stage.parent.parent / case.entry["photometry"]).read_text("utf-8"))
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
    layer = output / f"{case.id}.session.usda"
    layer.write_text(
        f'#usda 1.0\n\nover "World"\n{{\n    over "Looks"\n    {{{overs}    }}\n}}\n',
        encoding="utf-8",
    )
    return layer
