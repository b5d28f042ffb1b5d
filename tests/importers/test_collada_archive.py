"""COLLADA in archives: which member a manifest and an image mean."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest
from collada_builder import document, material

from hdrusd.importers.collada import read
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import Image
from hdrusd.report import Report

SHADER = '<phong><diffuse><texture texture="i" texcoord="U"/></diffuse></phong>'


def painted(image: str, name: str = "m") -> str:
    """A document whose material ``name`` wears ``image``."""
    images = f'<library_images><image id="i"><init_from>{image}</init_from></image>'
    return document(f"{images}</library_images>{material(SHADER, name=name)}")


def load(path: Path, members: dict[str, str | bytes]) -> tuple[Image, str, Report]:
    """The image and the name of the first material of an archive, and what is found."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    report = Report()
    made = read(Resolver(path, report), report).materials[0]
    assert made.diffuse_map is not None
    return made.diffuse_map.image, made.name, report


@pytest.mark.parametrize("suffix", [".zae", ".kmz"])
@pytest.mark.parametrize(
    ("reference", "wanted"),
    [
        ("../a/wood.png", b"red"),
        ("../b/wood.png", b"green"),
        ("wood.png", b"blue"),
        ("./x/../..\\b\\wood.png", b"green"),
        ("../%62/wood.png", b"green"),
    ],
)
def test_a_picture_is_the_one_of_its_whole_path(
    tmp_path: Path, suffix: str, reference: str, wanted: bytes
) -> None:
    members = {
        "models/m.dae": painted(reference),
        "a/wood.png": b"red",
        "./b\\wood.png": b"green",
        "models/wood.png": b"blue",
    }
    image, _, report = load(tmp_path / f"m{suffix}", members)
    assert image.data == wanted
    assert not report.codes() & {"file-found-elsewhere", "file-missing"}


@pytest.mark.parametrize("reference", ["gone/wood.png", "file:///C:/maps/wood.png", "A/Wood.png"])
def test_a_picture_elsewhere_is_the_only_one_of_its_name_and_told(
    tmp_path: Path, reference: str
) -> None:
    members = {"m.dae": painted(reference), "a/wood.png": b"red", "a/other.png": b"blue"}
    image, _, report = load(tmp_path / "m.zae", members)
    assert image.data == b"red"
    (finding,) = [f for f in report if f.code == "file-found-elsewhere"]
    assert "a/wood.png is used" in finding.text


def test_a_picture_that_may_be_either_is_missing(tmp_path: Path) -> None:
    members = {"m.dae": painted("c/wood.png"), "a/wood.png": b"red", "b/wood.png": b"green"}
    image, _, report = load(tmp_path / "m.zae", members)
    assert image.missing
    assert "file-missing" in report.codes()


@pytest.mark.parametrize("chosen", ["a", "b"])
def test_the_manifest_names_a_document_by_its_whole_path(tmp_path: Path, chosen: str) -> None:
    members = {
        "manifest.xml": f"<dae_root>./{chosen}/my%20model.dae#v</dae_root>",
        "a/my model.dae": painted("wood.png", "first"),
        "b/my model.dae": painted("wood.png", "second"),
        "a/wood.png": b"red",
        "b/wood.png": b"green",
        "old/manifest.xml": "<dae_root>./gone.dae</dae_root>",
    }
    image, name, report = load(tmp_path / "m.zae", members)
    wanted = {"a": ("first", b"red"), "b": ("second", b"green")}
    assert (name, image.data) == wanted[chosen]
    assert "collada-archive" not in report.codes()


@pytest.mark.parametrize("manifest", ["", "<dae_root>./c/model.dae</dae_root>"])
def test_a_document_that_is_not_clear_is_told(tmp_path: Path, manifest: str) -> None:
    members: dict[str, str | bytes] = {
        "doc.kml" if not manifest else "manifest.xml": manifest,
        "a/model.dae": painted("wood.png", "first"),
        "b/model.dae": painted("wood.png", "second"),
        "a/wood.png": b"red",
        "b/wood.png": b"green",
    }
    image, name, report = load(tmp_path / "m.kmz", members)
    assert (name, image.data) == ("first", b"red")
    (finding,) = [f for f in report if f.code == "collada-archive"]
    assert "of 2, a/model.dae is read" in finding.text


def test_else_it_is_the_one_of_the_longest_end(tmp_path: Path) -> None:
    members = {"m.dae": painted("x/Wood.png"), "a/x/wood.png": b"red", "b/wood.png": b"green"}
    image, _, report = load(tmp_path / "m.zae", members)
    assert image.data == b"red"
    assert "file-found-elsewhere" in report.codes()
