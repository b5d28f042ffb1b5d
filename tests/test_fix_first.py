"""What to fix first where no single thing weighs much, and of pictures that are not shown."""

from __future__ import annotations

import tomllib
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import gltf_lights, obj, png
from converted import run, sidecar

from hdrusd.account.fix import MOST, Scene
from hdrusd.account.fix_first import fix_first
from hdrusd.account.text import summary
from hdrusd.photometry.recipe_entry import toml_entry
from hdrusd.report import LISTED

#: Of which none begins as another.
NAMES = ["".join(letters) for letters in product("abcdefgh", "pqrstuvw")][:60]


def lamps(folder: Path, candela: list[float], **more: dict[str, Any]) -> Path:
    """Point lights of those candela, each with a name of its own."""
    made = [
        {"name": name, "type": "point", "intensity": value, **more.get(name, {})}
        for name, value in zip(NAMES, candela, strict=False)
    ]
    return gltf_lights(folder / "a.gltf", made)


def squares(folder: Path, materials: list[str]) -> Path:
    """A square of 1 m2 for each material m0, m1, ...; ``materials``: their statements."""
    texts = [f"newmtl m{n}\n{text}\n" for n, text in enumerate(materials)]
    (folder / "a.mtl").write_text("".join(texts))
    lines = ["mtllib a.mtl", "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1"]
    for n in range(len(materials)):
        lines += [f"v {x} {y} 0" for x, y in ((n, 0), (n + 1, 0), (n + 1, 1), (n, 1))]
        corners = " ".join(f"{4 * n + k}/{k}" for k in (1, 2, 3, 4))
        lines += [f"o q{n}", f"usemtl m{n}", f"f {corners}"]
    (folder / "a.obj").write_text("\n".join(lines) + "\n")
    return folder / "a.obj"


def test_many_small_guesses_are_one_entry(tmp_path: Path) -> None:
    """60 lights of one candela: a sixtieth of the light each, a tenth of a decade."""
    source = lamps(tmp_path, [100.0] * 60)
    before = run(source)
    (entry,) = before.as_dict()["fix_first"]
    assert entry["impact"] == pytest.approx(0.1)
    assert entry["what"].startswith("60 lights together, 100 cd each by source file: ap, aq, ar,")
    assert entry["why"].startswith("100 % of the scene's light")
    (stated,) = tomllib.loads(entry["write"])["light"]
    assert stated == {"match": "*", "candela": 100.0, "source": ""}
    sidecar(tmp_path, entry["write"].replace("100", "250"))
    after = run(source)
    assert [row["value"] for row in after.lights] == [250.0] * 60
    (entry,) = after.as_dict()["fix_first"]
    assert (entry["impact"], entry["write"]) == (pytest.approx(0.1), None)
    assert entry["why"].endswith("the numbers stand there, in light[1]")


def test_entries_of_a_photometry_file_are_summed_by_the_file(tmp_path: Path) -> None:
    source = lamps(tmp_path, [100.0] * 60)
    rules = [f'[[light]]\nmatch = "{name}"\ncandela = {n}\n' for n, name in enumerate(NAMES, 100)]
    sidecar(tmp_path, "".join(rules))
    (entry,) = run(source).as_dict()["fix_first"]
    assert entry["impact"] == pytest.approx(0.1)
    assert "60 lights together, 100 to 159 cd each by photometry.toml: " in entry["what"]
    assert entry["why"].endswith("in light[60], light[59], light[58], ...")


@pytest.mark.parametrize(
    ("candela", "more"),
    [
        ([100.0 + n for n in range(60)], {}),  # one number for all would change them
        ([100.0] * 59 + [0.0], {}),  # a dark one would shine
        ([100.0] * 59 + [100.0], {NAMES[59]: {"type": "spot", "spot": {}}}),
    ],
)
def test_lines_for_some_leave_all_others_as_they_are(
    tmp_path: Path, candela: list[float], more: dict[str, Any]
) -> None:
    source = lamps(tmp_path, candela, **more)
    before = run(source)
    entry = before.as_dict()["fix_first"][0]
    tables = tomllib.loads(entry["write"])["light"]
    assert len(tables) == MOST
    assert not any("*" in table["match"] for table in tables)
    assert entry["write"].splitlines()[-1].endswith(" more like these")
    sidecar(tmp_path, entry["write"])
    after = run(source)
    assert "sidecar-no-match" not in after.report.codes()
    values = {row["name"]: row["value"] for row in before.lights}
    assert {row["name"]: row["value"] for row in after.lights} == pytest.approx(values, rel=5e-4)
    stated = [row["name"] for row in after.lights if "light[" in row["rule"]]
    assert sorted(stated) == sorted(table["match"] for table in tables)


def test_many_small_doubts_are_one_entry(tmp_path: Path) -> None:
    """100 roads of reflectance 0.5, 1 % of the surface each; asphalt has 0.2 at most."""
    source = squares(tmp_path, ["Kd 0.5 0.5 0.5"] * 100)
    text = (tmp_path / "a.mtl").read_text().replace("newmtl m", "newmtl asphalt_m")
    (tmp_path / "a.mtl").write_text(text)
    (tmp_path / "a.obj").write_text(source.read_text().replace("usemtl m", "usemtl asphalt_m"))
    before = run(source).as_dict()
    (entry,) = (e for e in before["fix_first"] if "reflectance" in e["what"])
    assert entry["impact"] == pytest.approx(np.log10(0.5 / 0.2), abs=1e-4)
    wanted = "100 materials together: mean reflectance 0.5; asphalt has 0.04 to 0.2: asphalt_m0, "
    assert entry["what"].startswith(wanted)
    assert entry["write"].splitlines()[-1] == f"# and {100 - MOST} more like these"
    sidecar(tmp_path, entry["write"])
    assert run(source).as_dict()["totals"]["materials_doubted"] == 100 - MOST


def test_of_materials_of_one_name_a_line_is_written_once() -> None:
    """A second entry of a pattern would not count."""
    found = {"mean": 0.5, "p95": 0.5}
    rows = []
    for n in range(100):
        doubt = {"code": "reflectance-range", "statistic": "mean", "low": 0.04, "high": 0.2}
        doubt |= {"citation": "Pon 1999", "decades": 0.4, "text": ""}
        doubt["write"] = toml_entry("material", "ab"[n % 2], diffuse=[0.1, 0.1, n / 1000])
        row = {"name": "ab"[n % 2], "area_m2": 1.0, "luminance_cd_m2": 0.0, "doubts": [doubt]}
        rows.append(row | {"reflectance": found, "surface_class": "asphalt"})
    entries = fix_first(Scene([], rows, [], [], ground=9.0, diagonal=9.0))
    (entry,) = (e for e in entries if "reflectance" in e["what"])
    assert entry["impact"] == pytest.approx(0.4)
    assert [each["match"] for each in tomllib.loads(entry["write"])["material"]] == ["a", "b"]


def test_the_statistic_that_is_at_fault_is_named(tmp_path: Path) -> None:
    """A quarter of the picture is white, the mean is like a road's."""
    pixels = np.full((64, 64, 3), 120, np.uint8)
    pixels[::4] = 255
    png(tmp_path / "a.png", pixels)
    document = run(obj(tmp_path / "a.obj", "Kd 1 1 1\nmap_Kd a.png")).as_dict()
    (doubt,) = document["materials"][0]["doubts"]
    assert (doubt["statistic"], doubt["high"]) == ("p95", 0.9)
    assert doubt["text"].startswith("95th percentile of the reflectance 1 (mean 0.39")
    (entry,) = (e for e in document["fix_first"] if e["what"].startswith("paint"))
    wanted = "paint: 95th percentile of the reflectance 1; what is known has up to 0.9"
    assert entry["what"] == wanted
    white = run(obj(tmp_path / "b.obj", "Kd 1 1 1")).as_dict()["materials"][0]["doubts"]
    assert [doubt["statistic"] for doubt in white] == ["mean"]


def lost(document: dict[str, Any]) -> dict[str, tuple[float, str, str | None]]:
    """What is to be fixed of pictures: impact, where and what to write."""
    return {
        e["what"]: (e["impact"], e["where"], e["write"])
        for e in document["fix_first"]
        if "texture" in e["what"]
    }


def test_pictures_that_are_gone_refused_or_broken_are_mended_each_in_its_way(
    tmp_path: Path,
) -> None:
    inside = tmp_path / "in side"
    inside.mkdir()
    png(tmp_path / "there.png")
    (inside / "text.png").write_text("hello")
    png(inside / "good.png")
    names = ("../there.png", "gone.png", "text.png", "good.png")
    source = squares(inside, [f"Kd 1 1 1\nmap_Kd {name}" for name in names])
    document = run(source).as_dict()
    rows = {row["name"]: (row["missing"], row["broken"]) for row in document["images"]}
    assert rows == {
        "../there.png": (True, False),
        "gone.png": (True, False),
        "text.png": (False, True),
        "good.png": (False, False),
    }
    totals = document["totals"]
    assert (totals["textures_missing"], totals["textures_broken"]) == (2, 1)
    assert any("(2 missing, 1 broken)" in line for line in summary(document, 100))
    # A quarter of the surface each, white instead of what was there.
    assert lost(document) == {
        "1 missing texture: gone.png": (0.125, "command line", "--search-path FOLDER"),
        "1 texture outside the declared roots: ../there.png": (
            *(0.125, "command line"),
            f"--root {tmp_path.resolve()}",
        ),
        "1 broken texture: text.png": (0.125, "source", None),
    }
    allowed = lost(run(source, roots=[tmp_path]).as_dict())
    assert set(allowed) == {"1 missing texture: gone.png", "1 broken texture: text.png"}


def test_a_root_with_blanks_is_one_word_of_the_command_line(tmp_path: Path) -> None:
    source = tmp_path / "a b" / "c" / "a.obj"
    source.parent.mkdir(parents=True)
    png(tmp_path / "a b" / "there.png")
    document = run(squares(source.parent, ["Kd 1 1 1\nmap_Kd ../there.png"])).as_dict()
    ((_, _, write),) = lost(document).values()
    assert write == f"--root '{tmp_path.resolve() / 'a b'}'"


def test_more_refusals_than_are_listed_are_refusals(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    count = LISTED + 5
    for n in range(count):
        png(tmp_path / f"t{n}.png", np.full((1, 1, 3), n % 256, np.uint8))
    source = squares(inside, [f"Kd 1 1 1\nmap_Kd ../t{n}.png" for n in range(count)])
    (what,) = lost(run(source).as_dict())
    assert what.startswith(f"{count} textures outside the declared roots: ")


def test_what_is_broken_beyond_the_listed_findings_is_counted(tmp_path: Path) -> None:
    count = LISTED + 5
    for n in range(count):
        (tmp_path / f"t{n}.png").write_text(f"hello {n}")
    source = squares(tmp_path, [f"Kd 1 1 1\nmap_Kd t{n}.png" for n in range(count)])
    document = run(source).as_dict()
    assert document["totals"]["textures_broken"] == count
    assert f"{count} broken textures: t0.png, t1.png, t2.png, ..." in lost(document)
