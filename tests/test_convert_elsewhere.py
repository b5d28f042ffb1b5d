"""The same project in two folders: the same names, the same bytes."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from builders import CODES, png
from converted import run, sidecar
from overlaid import HEAD, lamp, paint, stage_file
from photometric_files import ies_text

from hdrusd.errors import SourceRef
from hdrusd.legacy.scene import Image, Texture
from hdrusd.maps import MapWriter
from hdrusd.report import Report


def project(folder: Path) -> None:
    """An OBJ file and a stage, with two pictures of one name, one outside, and a luminaire."""
    png(folder / "maps" / "a" / "wood.png")
    png(folder / "maps" / "b" / "wood.png", CODES[::-1].copy())
    png(folder.parent / "shared" / "stone.png", 255 - CODES)
    (folder / "lamp.ies").write_text(ies_text())
    sidecar(folder, '[[light]]\nmatch = "Lamp"\nies = "lamp.ies"\n')
    pictures = ("maps/a/wood.png", "maps/b/wood.png", "../shared/stone.png")
    names = ("red", "green", "blue")
    (folder / "town.mtl").write_text(
        "".join(f"newmtl {n}\nKd 1 1 1\nmap_Kd {p}\n" for n, p in zip(names, pictures, strict=True))
    )
    corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
    faces = "".join(f"usemtl {name}\nf 1/1 2/2 3/3\n" for name in names)
    (folder / "town.obj").write_text(f"mtllib town.mtl\n{corners}{faces}")
    paints = [
        paint(f"/World/{name}", f"asset inputs:file = @./{picture}@")
        for name, picture in zip(names, pictures, strict=True)
    ]
    bulb = lamp("SphereLight", "float inputs:intensity = 1\nfloat inputs:radius = 0.1")
    stage_file(folder / "town_by_day.usda", *paints, bulb, head=HEAD)


def files(folder: Path) -> dict[str, bytes]:
    """What lies below a folder, by name."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.parametrize("source", ["town.obj", "town_by_day.usda"])
def test_a_project_in_another_folder_makes_the_same_bytes(tmp_path: Path, source: str) -> None:
    project(tmp_path / "one" / "town")
    deeper = tmp_path / "another" / "and deeper" / "still"
    shutil.copytree(tmp_path / "one", deeper)
    made = []
    for home in (tmp_path / "one", deeper):
        result = run(home / "town" / source, home / "out" / "night.usda", roots=[home])
        assert len({name for name in result.textures if name.startswith("wood_R_")}) == 2
        assert sum(name.startswith("stone_") for name in result.textures) >= 1
        made.append(files(home / "out"))
    assert made[0].keys() == made[1].keys()
    assert [name for name in made[0] if made[0][name] != made[1][name]] == []


def test_pictures_of_one_name_have_names_of_their_own(tmp_path: Path) -> None:
    """In other folders, beside and above the source's; one file by two records has one name."""
    home, place = tmp_path / "town", SourceRef(tmp_path / "town" / "a.obj")
    folders = [home, home / "a", home / "a" / "b", home / "b", tmp_path, tmp_path / "a"]
    for number, folder in enumerate(folders):
        png(folder / "wood.png", CODES + number)
    maps = MapWriter(tmp_path / "maps", "maps", home, Report())
    named = []
    for folder in (*folders, *folders):
        image = Image("wood.png", place, path=folder / "wood.png")
        found = maps.look(Texture(image))
        assert found is not None
        named.append(found.file)
    assert named[: len(folders)] == named[len(folders) :]
    assert len(set(named)) == len(folders)
