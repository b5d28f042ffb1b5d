"""Two pictures of one name are two in all that is told of them; one of two names is one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from builders import paint, png
from converted import run

from hdrusd.account.images import image_rows
from hdrusd.errors import SourceRef
from hdrusd.importers.importer import Resolver, read
from hdrusd.inspection import inspect
from hdrusd.legacy.pictures import picture_names
from hdrusd.legacy.scene import Image, Texture
from hdrusd.report import Report
from hdrusd.usd.material import Surface

PLACE = SourceRef(Path("/db/a.gltf"), "images[0]")


def two_woods(folder: Path) -> Path:
    """Triangles of 0.5 m2 and 1.5 m2 in materials of two libraries that name their own wood.png."""
    for name, code in (("a", 100), ("b", 200)):
        (folder / name).mkdir()
        png(folder / name / "wood.png", np.full((4, 4, 3), code, np.uint8))
        (folder / name / "x.mtl").write_text(f"newmtl {name}\nKd 1 1 1\nmap_Kd wood.png\n")
    (folder / "m.obj").write_text(
        "mtllib a/x.mtl\nmtllib b/x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 3 0 0\n"
        "vt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 4/2 3/3\n"
    )
    return folder / "m.obj"


def test_pictures_of_one_name_are_told_apart(tmp_path: Path) -> None:
    document = run(two_woods(tmp_path)).as_dict()
    assert document["counts"]["textures"] == 2
    rows = {row["name"]: row for row in document["images"]}
    assert rows.keys() == {"a/wood.png", "b/wood.png"}
    assert {name: row["share"] for name, row in rows.items()} == {
        "a/wood.png": pytest.approx(0.25),
        "b/wood.png": pytest.approx(0.75),
    }
    assert [row["materials"] for row in rows.values()] == [["a"], ["b"]]
    made = [(row["name"], file) for row in rows.values() for file in row["files"]]
    assert len(made) == len(document["textures"]) == 4  # a copy and a reflectance map of each
    assert {file: name for name, file in made} == {
        file: texture["image"] for file, texture in document["textures"].items()
    }


def test_inspect_tells_them_apart_too(tmp_path: Path) -> None:
    report = Report()
    document = inspect(read(Resolver(two_woods(tmp_path), report), report), report)
    told = {row["name"]: (row["file"], row["uses"]) for row in document["textures"]}
    assert told == {
        f"{name}/wood.png": (str(tmp_path / name / "wood.png"), [f"{name}:diffuse"])
        for name in ("a", "b")
    }
    said = [material["diffuse_map"]["image"] for material in document["materials"]]
    assert said == ["a/wood.png", "b/wood.png"]
    json.dumps(document)


def test_one_picture_of_two_names_has_its_files_once() -> None:
    first, second = (Image(name, PLACE, data=b"one") for name in ("a/wood.png", "b/wood.png"))
    materials = [paint(diffuse_map=Texture(first)), paint(diffuse_map=Texture(second))]
    surfaces = [Surface(diffuse=(1.0, 1.0, 1.0), gamma=2.2)] * 2
    made_of = {"wood_R.exr": first}
    (row,) = image_rows(materials, surfaces, [1.0, 3.0], made_of, lambda image: False)
    assert (row["name"], row["also_called"]) == ("a/wood.png", ["b/wood.png"])
    assert (row["share"], row["files"]) == (1.0, ["wood_R.exr"])


def named(*images: Image) -> list[str]:
    return list(picture_names(images).values())


def test_names_are_as_short_as_they_can_be() -> None:
    def at(path: str, name: str = "") -> Image:
        return Image(name or Path(path).name, PLACE, path=Path(path))

    assert named(at("/db/x/wood.png"), at("/db/x/stone.png")) == ["wood.png", "stone.png"]
    assert named(at("/db/x/wood.png"), at("/db/x/wood.png", "WOOD.PNG")) == ["wood.png"]
    alike = [at(f"/{top}/tex/wood.png") for top in ("a", "b")]
    assert named(*alike) == ["a/tex/wood.png", "b/tex/wood.png"]
    assert named(at("/wood.png"), at("/a/wood.png")) == ["/wood.png", "a/wood.png"]
    # The third is called so in the source: the first has to be longer.
    third = at("/c/a/wood.png", "a/wood.png")
    names = named(at("/x/a/wood.png"), at("/x/b/wood.png"), third)
    assert names == ["x/a/wood.png", "b/wood.png", "a/wood.png"]


def test_pictures_without_a_file_have_their_place() -> None:
    other = SourceRef(PLACE.file, "images[1]")
    held = [Image("wood", PLACE, data=b"a"), Image("wood", other, data=b"b")]
    assert named(*held) == ["wood (a.gltf:images[0])", "wood (a.gltf:images[1])"]
    code = np.zeros((2, 2, 3), np.uint8)
    drawn = [Image("wood", PLACE, pixels=code), Image("wood", PLACE, pixels=code + np.uint8(1))]
    names = named(*drawn, Image("again", PLACE, pixels=code.copy()))
    assert names == ["wood (a.gltf:images[0], 1)", "wood (a.gltf:images[0], 2)"]


def test_missing_pictures_are_one_where_they_would_be_one_file() -> None:
    places = [SourceRef(Path(f"/db/{file}"), 2) for file in ("a/x.mtl", "a/y.mtl", "b/x.mtl")]
    assert named(*(Image("wood.png", place) for place in places)) == ["a/wood.png", "b/wood.png"]
