"""``hdrusd photometry``: told, converted, drawn, and refused in one line."""

from __future__ import annotations

import builtins
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import CommandLine
from photometric_files import ies_text, ldt_text

from hdrusd.images import read_image

STATED = "[TEST] 1\n[TESTLAB] us\n[ISSUEDATE] today\n[MANUFAC] we\n[LUMINAIRE] Spot $12"


@pytest.fixture
def hdrusd(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    return CommandLine(monkeypatch, capsys, None)


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    path = tmp_path / "lamp.ies"
    path.write_text(ies_text(keywords=STATED, lumens=2000.0))
    return path


def test_a_file_is_told(hdrusd: CommandLine, lamp: Path) -> None:
    said = hdrusd.run("photometry", lamp)
    rows = dict(line.split("  ", 1) for line in said.out.splitlines() if line[0] != " ")
    told = {name: value.strip() for name, value in rows.items()}
    assert told["format"] == "IES LM-63 2002"
    assert told["[LUMINAIRE]"] == "Spot $12"
    assert told["flux"] == "1127.3 lm"
    assert told["peak"] == "400 cd at plane 0, angle 0"
    assert told["output ratio"] == "56.4%"
    assert told["upward light"] == "0.00%"
    assert told["beam angle"].startswith("C 0-180 120, ")
    assert told["findings"] == "no findings"
    assert said.err == ""


def test_json_and_report(hdrusd: CommandLine, lamp: Path, tmp_path: Path) -> None:
    said = hdrusd.run("photometry", lamp, "--json", "--report", tmp_path / "r.json")
    facts = json.loads(said.out)
    assert facts["flux_lm"] == pytest.approx(1127.3, abs=0.01)
    written = json.loads((tmp_path / "r.json").read_text())
    assert written["luminaire"]["flux_lm"] == facts["flux_lm"]
    assert written["findings"] == []


def test_both_formats_and_back(hdrusd: CommandLine, lamp: Path, tmp_path: Path) -> None:
    ldt, back = tmp_path / "out" / "lamp.LDT", tmp_path / "back.ies"
    hdrusd.run("photometry", lamp, "-o", ldt)
    hdrusd.run("photometry", ldt, "-o", back, "-q")
    assert back.read_bytes().startswith(b"IESNA:LM-63-2002\r\n")
    sheets = [
        json.loads(hdrusd.run("photometry", f, "--json", "-q").out) for f in (lamp, ldt, back)
    ]
    for key in ("flux_lm", "peak_cd", "lamp_flux_lm"):
        assert [sheet[key] for sheet in sheets] == pytest.approx([sheets[0][key]] * 3, rel=2e-6)
    assert sheets[1]["format"] == "EULUMDAT"
    assert sorted(path.name for path in tmp_path.rglob("*")) == [
        "back.ies",
        "lamp.LDT",
        "lamp.ies",
        "out",
    ]


def test_a_plot(hdrusd: CommandLine, lamp: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    files = {
        "c.png": lamp.read_text(),
        "dark.png": ies_text([0, 0], planes=(0,), angles=(0, 180)),
        "b.png": ies_text([1, 2, 3, 4], planes=(-5, 5), angles=(-3, 3), type="B"),
    }
    for name, text in files.items():
        lamp.write_text(text)
        hdrusd.run("photometry", lamp, "--plot", tmp_path / name, "-q")
        pixels = read_image(tmp_path / name).pixels
        assert pixels.shape[:2] == (735, 1500)
        assert len(np.unique(pixels[..., :3].reshape(-1, 3), axis=0)) > 50  # lines and letters


def test_a_plot_without_matplotlib(
    hdrusd: CommandLine, lamp: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = builtins.__import__

    def missing(name: str, *rest: Any, **others: Any) -> Any:
        if name.split(".")[0] == "matplotlib":
            raise ImportError(name)
        return real(name, *rest, **others)

    monkeypatch.setattr(builtins, "__import__", missing)
    line = hdrusd.refused("photometry", lamp, "--plot", tmp_path / "x.png", code=1)
    assert line == "plot: matplotlib is not installed; want pip install 'hdrusd[plot]'"


def test_wrong_use(hdrusd: CommandLine, lamp: Path, tmp_path: Path) -> None:
    assert "ends in .ies or .ldt" in hdrusd.refused("photometry", lamp, "-o", "x.txt", code=2)
    assert "ends in .png" in hdrusd.refused("photometry", lamp, "--plot", "x.jpg", code=2)
    before = lamp.read_bytes()
    assert "want another name" in hdrusd.refused("photometry", lamp, "-o", lamp, code=2)
    assert lamp.read_bytes() == before
    hdrusd.refused("photometry", tmp_path / "gone.ies", code=3)


def test_what_cannot_be_read_still_has_its_report(
    hdrusd: CommandLine, lamp: Path, tmp_path: Path
) -> None:
    lamp.write_text(ies_text(angles=(0, 45, 22.5, 60, 90)))
    report = tmp_path / "r.json"
    line = hdrusd.refused(
        "photometry", lamp, "-q", "--report", report, "-o", tmp_path / "x.ldt", code=3
    )
    assert line == ("lamp.ies:6: angles within a plane: 22.5 after 45, not in ascending order")
    assert len(json.loads(report.read_text())["findings"]) == 4
    assert not (tmp_path / "x.ldt").exists()


def test_strict_and_terminal(hdrusd: CommandLine, lamp: Path) -> None:
    lamp.write_text(ies_text(keywords="[TEST] \x1b[31mred"))
    said = hdrusd.run("photometry", lamp, "--strict", code=6)
    assert "\x1b" not in said.out + said.err
    assert "missing: lamp.ies:3: no [TESTLAB], which LM-63-2002 requires" in said.err


def test_a_tilt_file_beside_it(hdrusd: CommandLine, lamp: Path) -> None:
    lamp.write_text(ies_text(keywords=STATED, tilt="TILT=..\\x\\lamp.tlt"))
    (lamp.parent / "lamp.tlt").write_text("1\n2\n0 90\n0.5 1")
    assert json.loads(hdrusd.run("photometry", lamp, "--json").out)["peak_cd"] == 200.0


def test_a_eulumdat_file(hdrusd: CommandLine, tmp_path: Path) -> None:
    path = tmp_path / "lamp.ldt"
    path.write_text(ldt_text())
    said = hdrusd.run("photometry", path)
    assert "[name]         Spot 12" in said.out
    assert "invalid: lamp.ldt:23: light output ratio 80 %" in said.err
