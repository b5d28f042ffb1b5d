"""The door through which readers open files: roots, search, refusals."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.importer import Limits, Resolver, read, resolver_of
from hdrusd.report import Report


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """``model/meshes/car.obj`` with textures beside the folder of the meshes, as Gazebo has it."""
    (tmp_path / "model" / "meshes").mkdir(parents=True)
    textures = tmp_path / "model" / "materials" / "textures"
    textures.mkdir(parents=True)
    (textures / "Paint.png").write_bytes(b"paint")
    (tmp_path / "secret.png").write_bytes(b"secret")
    source = tmp_path / "model" / "meshes" / "car.obj"
    source.write_bytes(b"v 0 0 0\n")
    return source


def find(resolver: Resolver, reference: str) -> Path | None:
    """The file that a reference in the source names."""
    return resolver.find(reference, SourceRef(resolver.source, 1))


def test_a_folder_beside_needs_a_root(model: Path) -> None:
    report = Report()
    assert find(Resolver(model, report), "Paint.png") is None
    assert report.codes() == {"file-refused"}
    found = find(Resolver(model, report, roots=[model.parents[1]]), "Paint.png")
    assert found is not None
    assert found.read_bytes() == b"paint"


@pytest.mark.parametrize(
    "name", ["paint.PNG", "C:\\maps\\Paint.png", "Paint.png  ", "gone/Paint.png"]
)
def test_a_name_is_mended_and_that_is_told(model: Path, name: str) -> None:
    report = Report()
    found = find(Resolver(model, report, roots=[model.parents[1]]), name)
    assert found is not None
    assert found.name == "Paint.png"
    assert report.codes() == {"file-found-elsewhere"}


@pytest.mark.parametrize("name", ["../../secret.png", "{outside}", "link.png", "/dev/zero"])
def test_nothing_outside_the_roots_is_named(model: Path, name: str) -> None:
    outside = model.parents[2] / "secret.png"
    (model.parent / "link.png").symlink_to(outside)
    report = Report()
    resolver = Resolver(model, report, roots=[model.parents[1]])
    assert find(resolver, name.format(outside=outside)) is None
    assert report.codes() == {"file-refused"}


@pytest.mark.parametrize(
    "name", ["", "  ", "a\0b", "x" * 5000 + ".png", "loop.png", "LOOP.png", "."]
)
def test_a_name_that_is_none_is_missing(model: Path, name: str) -> None:
    (model.parent / "loop.png").symlink_to("loop.png")
    report = Report()
    assert find(Resolver(model, report), name) is None
    assert report.codes() <= {"file-missing", "file-refused"}
    assert len(report) == 1


@pytest.mark.parametrize("name", ["maps.png", "MAPS.PNG", "pipe.png"])
def test_what_is_no_file_is_said(model: Path, name: str) -> None:
    """No root would help."""
    (model.parent / "maps.png").mkdir()
    os.mkfifo(model.parent / "pipe.png")
    report = Report()
    for roots in ([], [model.parent]):
        assert find(Resolver(model, report, roots=roots), name) is None
    (finding,) = report
    kind = "not a regular file" if "pipe" in name else "a folder"
    assert (finding.code, finding.text) == ("file-missing", f"{name}: {kind}; want a file")


def test_a_file_goes_before_a_folder_of_its_name(model: Path) -> None:
    (model.parent / "Paint.png").mkdir()
    report = Report()
    found = find(Resolver(model, report, roots=[model.parents[1]]), "Paint.png")
    assert found is not None
    assert found.read_bytes() == b"paint"


def test_names_that_differ_in_case_alone_are_told_apart(model: Path) -> None:
    """As written where that is there, else the first by code points."""
    for name in ("WALL.png", "Wall.png", "wall.png"):
        (model.parent / name).write_bytes(name.encode())
    report = Report()
    resolver = Resolver(model, report)
    for name, wanted in (("wALL.png", "WALL.png"), ("wall.png", "wall.png"), ("Wall.png",) * 2):
        found = find(resolver, name)
        assert found is not None
        assert found.read_bytes() == wanted.encode()
    assert len(report) == 1


def test_a_folder_is_listed_once_for_all_that_is_not_there(
    model: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    listed = []
    iterdir = Path.iterdir

    def counted(self: Path) -> Iterator[Path]:
        listed.append(self.resolve())
        return iterdir(self)

    monkeypatch.setattr(Path, "iterdir", counted)
    (model.parent / "link").symlink_to(".")
    report = Report()
    above = Resolver(model, report, roots=[model.parents[1]])
    for resolver in (above, resolver_of(model.parent / "part.obj", above)):
        for name in ("gone.png", "link/gone.png", "link/link/lost.png", "../meshes/lost.png"):
            assert find(resolver, name) is None
    textures = model.parents[1] / "materials" / "textures"
    assert sorted(listed) == sorted([model.parent, textures])
    assert report.codes() == {"file-missing"}


def test_a_file_that_lies_as_written_needs_no_word(model: Path) -> None:
    (model.parent / "Paint.png").write_bytes(b"beside")
    (model.parent / "link.png").symlink_to("Paint.png")
    report = Report()
    resolver = Resolver(model, report)
    for name in ("Paint.png", "./Paint.png", "..\\meshes\\Paint.png", "link.png"):
        found = find(resolver, name)
        assert found is not None
        assert found.read_bytes() == b"beside"
    assert len(report) == 0


def test_a_pipe_and_a_folder_are_not_read(model: Path) -> None:
    resolver = Resolver(model, Report())
    pipe = model.parent / "pipe.obj"
    os.mkfifo(pipe)
    for path in (pipe, model.parent):
        with pytest.raises(InputError, match="not a regular file"):
            resolver.read(path)


def test_a_file_that_is_not_there_or_too_big_is_an_input_error(model: Path) -> None:
    resolver = Resolver(model, Report(), limits=Limits(file_bytes=7))
    with pytest.raises(InputError, match="no such file"):
        resolver.read(model.parent / "gone.obj")
    with pytest.raises(InputError, match="8 bytes; at most 7"):
        resolver.read()


@pytest.mark.parametrize("call", ["exists", "read_bytes"])
def test_a_file_that_may_not_be_read_is_an_input_error(
    model: Path, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    def refuse(self: Path) -> None:
        raise PermissionError(13, "Permission denied", str(self))

    resolver = Resolver(model, Report())
    monkeypatch.setattr(Path, call, refuse)  # permissions do not bind every user that runs tests
    with pytest.raises(InputError, match=r"car\.obj: cannot be read: Permission denied") as caught:
        resolver.read()
    assert caught.value.exit_code == 3


def test_a_suffix_without_a_reader_is_an_input_error(model: Path) -> None:
    other = model.with_suffix(".blend")
    other.write_bytes(b"")
    with pytest.raises(InputError, match=r"\.blend: no reader; want .*\.gltf"):
        read(Resolver(other, Report()), Report())


def test_the_whole_disk_is_never_advised_as_a_root(tmp_path: Path) -> None:
    """/usr and the test's folder have nothing but / in common."""
    outside = Path("/usr/bin/env")
    if tmp_path.resolve().parts[1] == "usr" or not outside.exists():
        pytest.skip("no file beyond the top folder that the tests' folder is in")
    source = tmp_path / "a.obj"
    source.touch()
    report = Report()
    resolver = Resolver(source, report)
    assert resolver.find(str(outside), SourceRef(source)) is None
    (finding,) = report
    assert finding.code == "file-refused"
    assert "--root" not in finding.text
