"""The account of a conversion: reflectances, pictures, what to fix first, its text and schema."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from builders import gltf_lights, obj, one_square, osgt_light, paint, picture, png, square
from converted import POINT, SPOT, lights, material, opened, run, sidecar
from jsonschema import Draft202012Validator
from report_schema import SCHEMA, problems, undescribed

from hdrusd.account.fix import MOST, Scene
from hdrusd.account.fix_first import fix_first
from hdrusd.account.images import image_rows
from hdrusd.account.text import summary
from hdrusd.account.wear import wearers, worn
from hdrusd.conversion import Result
from hdrusd.legacy.scene import Subset, Texture
from hdrusd.photometry.recipe_entry import toml_entry
from hdrusd.usd.material import Surface
from hdrusd.usd.placed_area import PlacedArea

GREY = np.full((64, 64, 3), 100, np.uint8)

#: R of code 100 under D = 1.
R_100 = (100 / 255) ** 2.2


def road(folder: Path, pixels: npt.NDArray[np.uint8], mtl: str = "Kd 1 1 1") -> Path:
    """A square of 1 m2 in material ``paint`` with a texture that is called asphalt."""
    png(folder / "asphalt.png", pixels)
    return obj(folder / "road.obj", f"{mtl}\nmap_Kd asphalt.png")


def codes(result: Result) -> set[str]:
    return result.report.codes() & {
        "reflectance-range", "reflectance-high", "reflectance-low", "baked-shadow", "baked-lamp",
    }  # fmt: skip


def test_a_uniform_texture_has_its_reflectance_in_the_report(tmp_path: Path) -> None:
    (row,) = run(road(tmp_path, GREY, "Kd 0.8 0.8 0.8")).materials
    assert row["reflectance"]["mean"] == pytest.approx(R_100 * 0.8, rel=1e-12)
    assert row["reflectance"]["p95"] == pytest.approx(R_100 * 0.8, rel=1e-12)
    assert row["surface_class"] == "asphalt"
    assert row["doubts"] == []
    assert (row["faces"], row["area_m2"]) == (1, pytest.approx(1.0))


def test_the_line_that_is_proposed_ends_the_doubt(tmp_path: Path) -> None:
    bright = np.full((64, 64, 3), 200, np.uint8)  # R = 0.586, four times too bright for a road
    result = run(road(tmp_path, bright))
    assert codes(result) == {"reflectance-range"}
    (doubt,) = result.materials[0]["doubts"]
    assert doubt["factor"] == pytest.approx(0.2 / (200 / 255) ** 2.2)
    assert "Oke" in doubt["citation"]
    stated = tomllib.loads(doubt["write"])["material"][0]
    assert stated["match"] == "paint"
    sidecar(tmp_path, doubt["write"])
    again = run(tmp_path / "road.obj")
    assert codes(again) == set()
    mean = again.materials[0]["reflectance"]["mean"]
    assert 0.2 * 0.99 < mean <= 0.2  # three digits, rounded inwards
    assert again.materials[0]["confidence"] == "medium"


def test_a_doubt_changes_nothing(tmp_path: Path) -> None:
    result = run(road(tmp_path, np.full((64, 64, 3), 200, np.uint8)))
    prim = material(opened(result)).GetPrim()
    assert tuple(prim.GetAttribute("photometric:diffuse").Get()) == (1.0, 1.0, 1.0)


def test_only_what_is_shown_of_an_atlas_counts(tmp_path: Path) -> None:
    pixels = np.full((64, 64, 3), 255, np.uint8)
    pixels[32:, :32] = 100  # the lower left quarter, s and t below 1/2
    png(tmp_path / "asphalt.png", pixels)
    (tmp_path / "a.mtl").write_text("newmtl paint\nKd 1 1 1\nmap_Kd asphalt.png\n")
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"
        "vt 0.01 0.01\nvt 0.49 0.01\nvt 0.49 0.49\nvt 0.01 0.49\n"
        "usemtl paint\nf 1/1 2/2 3/3 4/4\n"
    )
    (row,) = run(tmp_path / "a.obj").materials
    assert row["reflectance"]["mean"] == pytest.approx(R_100, rel=1e-12)
    assert row["area_m2"] == pytest.approx(4.0)


def test_a_line_over_half_of_a_tile_counts_by_its_area(tmp_path: Path) -> None:
    pixels = GREY.copy()
    pixels[:, :16] = 255  # a quarter
    (row,) = run(road(tmp_path, pixels)).materials
    # 16,384 places spread evenly: their share of a quarter is known to 1 in 200.
    wanted = 0.25 + 0.75 * R_100
    assert row["reflectance"]["mean"] == pytest.approx(wanted, abs=0.005)


def test_shadows_are_suspected_and_lines_are_not(tmp_path: Path) -> None:
    across = (np.arange(256) + 0.5) / 256
    light = 0.25 + 0.75 * np.clip((across - 0.5) / 0.6 + 0.5, 0.0, 1.0)
    soft = np.broadcast_to((110 * light ** (1 / 2.2))[None, :, None], (256, 256, 3))
    (tmp_path / "a").mkdir()
    assert "baked-shadow" in codes(run(road(tmp_path / "a", soft.round().astype(np.uint8))))
    line = np.full((256, 256, 3), 90, np.uint8)
    line[:, 120:136] = 230
    (tmp_path / "b").mkdir()
    assert codes(run(road(tmp_path / "b", line))) == set()


@pytest.mark.parametrize(
    ("mtl", "code"),
    [
        ("Kd 1 1 1", "reflectance-high"),
        ("Kd 0 0 0", "reflectance-low"),
        ("Kd 0 0 0\nKs 0.5 0.5 0.5\nNs 50", None),  # a mirror
        ("Kd 0 0 0\nd 0.3", None),  # glass
        ("Kd 0 0 0\nKe 1 1 1", None),  # a lamp
        ("Kd 0.5 0.5 0.5", None),
    ],
)
def test_plain_colours_are_held_against_what_can_be(
    tmp_path: Path, mtl: str, code: str | None
) -> None:
    result = run(obj(tmp_path / "a.obj", mtl, uvs=False))
    assert codes(result) == ({code} if code else set())


def test_every_prim_carries_its_confidence(tmp_path: Path) -> None:
    sidecar(
        tmp_path, '[[light]]\nmatch = "spot"\ncandela = 9\nprovenance = "measured"\nsource = "x"\n'
    )
    result = run(gltf_lights(tmp_path / "a.gltf", [POINT, SPOT]))
    found = lights(opened(result))
    said = {n: p.GetAttribute("photometric:confidence").Get() for n, p in found.items()}
    assert said == {"point": "medium", "spot": "high"}
    assert {row["name"]: row["confidence"] for row in result.lights} == said
    made = run(road(tmp_path, GREY))
    prim = material(opened(made)).GetPrim()
    names = ("provenance", "rule", "source", "confidence")
    told = [prim.GetAttribute(f"photometric:{name}").Get() for name in names]
    assert told == ["estimated", "R = T^2.2 D", "Petit and Bremond 2010, section 3", "low"]
    assert [made.materials[0][name] for name in names] == told


def test_a_lights_row_holds_source_rule_and_result(tmp_path: Path) -> None:
    point, spot = run(gltf_lights(tmp_path / "a.gltf", [POINT, SPOT])).lights
    assert point["source_value"] | {"diffuse": None} == {
        "unit": "cd", "value": 1000.0, "diffuse": None, "candela": 1000.0, "lux": None,
    }  # fmt: skip
    # Luminance of (1, 0.8, 0.5) by Rec. 709: 0.2126 + 0.5722 + 0.0361 = 0.8209
    assert point["value"] == pytest.approx(820.86, abs=0.01)
    assert point["flux_lm"] == pytest.approx(4 * np.pi * point["value"])
    assert point["luminance_cd_m2"] == pytest.approx(point["value"] / (np.pi * 0.05**2))
    full = 2 * np.pi * 30_000 * (1 - np.cos(0.2)), 2 * np.pi * 30_000 * (1 - np.cos(0.5))
    assert full[0] < spot["flux_lm"] < full[1]


def test_pictures_by_class(tmp_path: Path) -> None:
    png(tmp_path / "asphalt.png", GREY)
    png(tmp_path / "glow.png", GREY)
    png(tmp_path / "hole.png", GREY)
    statements = (
        "Kd 1 1 1\nKe 1 1 1\nmap_Kd asphalt.png\nmap_Ke glow.png\nmap_d hole.png\n"
        "map_bump road_normal.png\nmap_Ks shine.png"
    )
    result = run(obj(tmp_path / "a.obj", statements))
    found = {row["name"]: (row["class"], row["meant"]) for row in result.images}
    assert found.pop("asphalt.png") == ("reflectance", None)
    assert found.pop("glow.png") == ("emission", None)
    assert found.pop("hole.png") == ("opacity", None)
    assert found == {"road_normal.png": ("unused", "data"), "shine.png": ("unused", "data")}
    totals = result.as_dict()["totals"]
    assert totals["textures_by_class"]["reflectance"] == 1
    (row,) = (row for row in result.images if row["name"] == "glow.png")
    assert len(row["files"]) == 2  # the look's copy and the map in cd/m2


def test_a_missing_picture_is_named_by_what_wears_it(tmp_path: Path) -> None:
    document = run(obj(tmp_path / "a.obj", "Kd 1 1 1\nmap_Kd gone.png")).as_dict()
    (image,) = document["images"]
    assert (image["missing"], image["share"], image["files"]) == (True, pytest.approx(1.0), [])
    (entry,) = (e for e in document["fix_first"] if "gone.png" in e["what"])
    assert (entry["impact"], entry["write"]) == (0.5, "--search-path FOLDER")


def street(folder: Path, candela: tuple[float, ...]) -> dict[str, Any]:
    """The document of lamps of a glTF with those candela; the second kind has other names."""
    names = ["lamp_1", "lamp_2", "lamp_3", "board"]
    made = [
        {"name": name, "type": "point", "intensity": value}
        for name, value in zip(names, candela, strict=True)
    ]
    return run(gltf_lights(folder / "a.gltf", made)).as_dict()


def test_lights_rank_by_their_share_of_the_flux(tmp_path: Path) -> None:
    document = street(tmp_path, (2000.0, 2000.0, 2000.0, 4000.0))
    first, second = document["fix_first"]
    # Stated without a source: a tenth of a decade, times the share of the lumens.
    assert (first["impact"], second["impact"]) == (0.06, 0.04)
    assert first["what"].startswith("lamp_1 ... lamp_3: 3 lamps, 2000 cd")
    entry = tomllib.loads(first["write"])["light"][0]
    assert (entry["match"], entry["candela"]) == ("lamp_*", 2000.0)
    assert document["totals"]["flux_lm"] == pytest.approx(4 * np.pi * 10_000)
    assert document["totals"]["lamps_by_confidence"] == {"medium": 4}


def test_nothing_that_shines_comes_first(tmp_path: Path) -> None:
    document = run(obj(tmp_path / "a.obj", "Kd 0.5 0.5 0.5")).as_dict()
    assert "no light" in document["fix_first"][0]["what"]
    assert tomllib.loads(document["fix_first"][0]["write"]) == {"ambient": {"illuminance": 0.05}}
    glowing = run(obj(tmp_path / "b.obj", "Kd 0 0 0\nKe 1 1 1")).as_dict()["fix_first"]
    assert {entry["impact"] for entry in glowing} == {1.0, 0.15}  # no light, a guess; the unit


@pytest.mark.parametrize(
    ("name", "side", "impact"),
    [("suv", 100.0, 2.0), ("suv", 3.0, 0.15), ("hill", 100.0, 0.15), ("hill", 0.01, 2.0)],
)
def test_units_are_doubted_by_the_size_of_what_the_file_is_called(
    tmp_path: Path, name: str, side: float, impact: float
) -> None:
    path = obj(tmp_path / f"{name}.obj", "Kd 0.5 0.5 0.5")
    lines = path.read_text().replace("v 1 ", f"v {side} ").replace(" 1 0\n", f" {side} 0\n")
    path.write_text(lines)
    document = run(path).as_dict()
    (entry,) = (e for e in document["fix_first"] if e["what"].startswith("unit of length"))
    assert entry["impact"] == impact
    stated = run(path, source_unit=0.01).as_dict()["fix_first"]
    assert not any(e["what"].startswith("unit of length") for e in stated)


def test_no_more_than_ten_entries(tmp_path: Path) -> None:
    lamps = [
        {"name": f"lamp{chr(97 + n)}", "type": "point", "intensity": 100.0 + n} for n in range(26)
    ]
    rules = "".join(f'[[light]]\nmatch = "nothing{n}"\n' for n in range(15))
    sidecar(tmp_path, rules)
    document = run(gltf_lights(tmp_path / "a.gltf", lamps)).as_dict()
    entries = document["fix_first"]
    assert [entry["rank"] for entry in entries] == list(range(1, MOST + 1))
    impacts = [entry["impact"] for entry in entries]
    assert impacts == sorted(impacts, reverse=True)


@pytest.mark.parametrize("columns", [20, 60, 80, 100, 120, 400])
def test_the_summary_fits_its_screen(tmp_path: Path, columns: int) -> None:
    lamps = [
        {"name": f"lamp {'long ' * 8}{chr(97 + n)}", "type": "point", "intensity": 100.0 + n}
        for n in range(26)
    ]
    sidecar(tmp_path, "".join(f'[[light]]\nmatch = "nothing{n}"\n' for n in range(15)))
    lines = summary(run(gltf_lights(tmp_path / "a.gltf", lamps)).as_dict(), columns)
    assert max(map(len, lines)) <= min(max(columns, 60), 120)
    assert len(lines) <= 36
    assert all(line.isprintable() for line in lines)
    assert "26" in lines[0]
    assert "  and 18 more; --report FILE has all" in lines


def test_names_of_a_file_cannot_steer_the_terminal(tmp_path: Path) -> None:
    lamp = {"name": "a\x1b[2Jb\nc", "type": "point", "intensity": 1.0}
    lines = summary(run(gltf_lights(tmp_path / "a.gltf", [lamp])).as_dict(), 80)
    assert all(line.isprintable() for line in lines)


def hdrusd(*arguments: str) -> subprocess.CompletedProcess[str]:
    program = (
        f"import sys; sys.argv = {['hdrusd', *arguments]!r}; from hdrusd.cli import main; main()"
    )
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)


def test_the_terminal_gets_the_summary_behind_the_findings(tmp_path: Path) -> None:
    source, output = str(road(tmp_path, GREY)), str(tmp_path / "o.usda")
    told = hdrusd("convert", source, output)
    assert told.returncode == 0
    lines = told.stderr.splitlines()
    assert lines.index("lights: none") > next(n for n, t in enumerate(lines) if "findings:" in t)
    assert "what to fix first:" in lines
    assert "\x1b" not in told.stderr
    assert len(told.stdout.splitlines()) == 1
    quiet = hdrusd("convert", source, output, "--quiet")
    assert quiet.stderr == ""
    document = json.loads(hdrusd("convert", source, output, "--json").stdout)
    assert problems(document) == []


def test_the_schema_is_one_and_describes_every_key(tmp_path: Path) -> None:
    Draft202012Validator.check_schema(SCHEMA)
    (tmp_path / "b").mkdir()
    documents = [
        street(tmp_path, (1.0, 1.0, 1.0, 1.0)),
        run(road(tmp_path, np.full((64, 64, 3), 250, np.uint8))).as_dict(),
        run(obj(tmp_path / "b" / "a.obj", "Kd 0 0 0\nKe 2 2 2\nmap_Kd gone.png")).as_dict(),
    ]
    for document in documents:
        assert undescribed(document) == set()


def test_the_schema_forbids_what_is_wrong(tmp_path: Path) -> None:
    document = street(tmp_path, (1.0, 1.0, 1.0, 1.0))
    document["lights"][0]["confidence"] = "surely"
    del document["lights"][1]["rule"]
    document["format"] = "hdrusd-report/0"
    assert len(problems(document)) == 3


@pytest.mark.parametrize(("unit", "levels"), [(True, ("medium",) * 2), (False, ("none", "low"))])
def test_a_copied_line_is_a_guess_where_it_was_one(
    tmp_path: Path, unit: bool, levels: tuple[str, str]
) -> None:
    lamp = gltf_lights(tmp_path / "a.gltf", [POINT])
    source = lamp if unit else osgt_light(tmp_path / "a.osgt")
    before = run(source)
    (entry,) = before.as_dict()["fix_first"]
    sidecar(tmp_path, entry["write"])
    after = run(source)
    assert (before.lights[0]["confidence"], after.lights[0]["confidence"]) == levels
    # Four digits are written.
    assert after.lights[0]["value"] == pytest.approx(before.lights[0]["value"], rel=5e-4)


def test_a_number_of_the_file_is_mended_in_its_entry(tmp_path: Path) -> None:
    text = "; the number stands in {}[1] there"
    sidecar(tmp_path, '[[light]]\nmatch = "spot"\ncandela = 2000\ntemperature = 3000\n')
    (entry,) = run(gltf_lights(tmp_path / "a.gltf", [SPOT])).as_dict()["fix_first"]
    assert (entry["write"], entry["why"].endswith(text.format("light"))) == (None, True)
    sidecar(tmp_path, '[[material]]\nmatch = "*"\nlumens = 9\nprovenance = "estimated"\n')
    glass = run(obj(tmp_path / "b.obj", "Kd 1 1 1"), source_unit=1.0).as_dict()["fix_first"]
    (entry,) = (e for e in glass if e["what"].startswith("paint"))
    assert (entry["write"], entry["why"].endswith(text.format("material"))) == (None, True)


def test_an_entry_is_toml_whatever_the_name() -> None:
    name = "".join(map(chr, range(1, 256))) + "\U0001f6a6"
    (entry,) = tomllib.loads(toml_entry("light", name, candela=1e30))["light"]
    assert fnmatchcase(name, entry["match"])
    assert entry["candela"] == 1e30


def test_a_material_is_looked_for_on_its_own_meshes_alone() -> None:
    parts = [Subset(1, np.array([0], np.int32))]
    scene = one_square(
        meshes=[square(), square(material=None, subsets=parts), square(material=1)],
        materials=[paint(), paint(name="b")],
    )
    meshes = wearers(scene)
    assert meshes == {0: [0], 1: [1, 2], None: [1]}
    placed = {mesh: PlacedArea(np.eye(3)[None], np.array([mesh + 1.0])) for mesh in range(3)}
    found = worn(scene, placed, 1, meshes[1])
    assert (found.faces, found.area) == (2, 5.0)


def test_faces_in_no_subset_wear_what_the_mesh_has() -> None:
    parts = (Subset(1, np.array([2], np.int32)), Subset(3, np.array([0], np.int32)))
    mesh = replace(
        square(material=7, subsets=parts),
        face_counts=np.array([4, 4, 4], np.int32),
        face_indices=np.tile(np.arange(4, dtype=np.int32), 3),
    )
    assert mesh.face_materials().tolist() == [3, 7, 1]
    assert mesh.wears(7).tolist() == [False, True, False]
    assert replace(mesh, material=None).face_materials().tolist() == [3, -1, 1]


def test_pictures_are_shared_by_materials_of_one_name(tmp_path: Path) -> None:
    image = picture()
    materials = [paint(diffuse_map=Texture(image)), paint(diffuse_map=Texture(image))]
    surfaces = [Surface(diffuse=(1.0, 1.0, 1.0), gamma=2.2)] * 2
    (row,) = image_rows(materials, surfaces, [1.0, 3.0], {}, lambda image: False)
    assert (row["materials"], row["share"]) == (["paint"], 1.0)


@pytest.mark.parametrize(
    ("code", "kind", "taken"),
    [
        ("obj-units", "assumed", "1 m"),
        ("fbx-unit", "assumed", "1 cm"),
        ("fbx-axes", "replaced", None),  # turned, which is no unit
        ("flt-unit", "assumed", "1 m"),
        ("flt-unit", "replaced", None),  # one file in another's unit, both stated
    ],
)
def test_a_unit_is_doubted_where_the_reader_took_one(
    code: str, kind: str, taken: str | None
) -> None:
    material = {"area_m2": 1.0, "luminance_cd_m2": 0.0, "doubts": []}
    finding = {"code": code, "kind": kind, "thing": "", "text": ""}
    entries = fix_first(Scene([], [material], [], [finding], ground=9.0, diagonal=9.0))
    said = [e["what"] for e in entries if e["what"].startswith("unit of length")]
    wanted = f"unit of length: the source has none, {taken} is taken; all is 9 m across"
    assert said == ([wanted] if taken else [])
