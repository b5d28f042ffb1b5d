"""Maps by threads: the same files and findings as one after the other, and failures come out."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

from hdrusd import maps as maps_module
from hdrusd.errors import SourceRef
from hdrusd.images import write_png
from hdrusd.legacy.scene import Image, Texture
from hdrusd.map_threads import MapThreads
from hdrusd.maps import MapWriter
from hdrusd.report import Report

PLACE = SourceRef(Path("street.osgt"), 7)


def pictures(folder: Path, count: int = 12) -> list[Image]:
    """Pictures that differ, the fourth of them broken."""
    made = []
    for number in range(count):
        path = folder / f"p{number}.png"
        write_png(path, np.full((3, 5, 1 + number % 4), 10 * number, np.uint8))
        made.append(Image(path.name, PLACE, path=path))
    (folder / "p3.png").write_bytes(b"\x89PNG\r\n\x1a\n broken")
    return made


def written(folder: Path, images: list[Image], *, threads: bool) -> tuple[dict[str, bytes], Report]:
    """The files by name, and the findings."""
    report = Report()
    maps = MapWriter(folder, "maps", folder.parent, report)

    def write() -> None:
        for image in images:
            maps.reflectance(Texture(image), (0.5, 1.0, 0.25), 2.2, PLACE, "paint")
            maps.look(Texture(image))

    if threads:
        with maps.threaded(images):
            write()
    else:
        write()
    assert set(maps.written) == {path.name for path in folder.iterdir()}
    return {path.name: path.read_bytes() for path in folder.iterdir()}, report


def test_threads_write_the_same_files_and_findings(tmp_path: Path) -> None:
    images = pictures(tmp_path)
    one, alone = written(tmp_path / "one", images, threads=False)
    other, together = written(tmp_path / "other", images, threads=True)
    assert one == other
    assert len(one) == 2 * 11
    assert [str(finding) for finding in alone] == [str(finding) for finding in together]
    assert together.codes() == {"image-broken"}


def test_large_pictures_wait_for_their_turn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only the caller's own thread decodes what is too large to be decoded ahead."""
    images = pictures(tmp_path, 3)
    monkeypatch.setattr(maps_module, "_SMALL", 14)  # of 15 pixels each
    whole: list[threading.Thread] = []
    plain = maps_module.read_small_image

    def watched(path: Path, data: bytes | None, most: int) -> object:
        found = plain(path, data, most)
        if found is not None:
            whole.append(threading.current_thread())
        return found

    monkeypatch.setattr(maps_module, "read_small_image", watched)
    found, _ = written(tmp_path / "maps", images, threads=True)
    assert len(found) == 6
    assert whole == [threading.main_thread()] * 3


def test_what_cannot_be_written_comes_out(tmp_path: Path) -> None:
    images = pictures(tmp_path, 3)
    (tmp_path / "maps").write_text("no folder")
    maps = MapWriter(tmp_path / "maps", "maps", tmp_path, Report())
    with pytest.raises(OSError, match="maps"), maps.threaded(images):
        maps.reflectance(Texture(images[0]), (1.0, 1.0, 1.0), 2.2, PLACE, "paint")


def test_things_are_made_once_and_in_order() -> None:
    made: list[int] = []

    def make(number: int) -> int:
        made.append(number)
        return number

    wanted = [(str(number), lambda number=number: make(number)) for number in range(50)]
    with MapThreads(wanted + wanted) as threads:
        assert [threads.take(str(number)) for number in range(50)] == list(range(50))
        assert threads.take("7") is None  # once
        assert threads.take("other") is None
    assert sorted(made) == list(range(50))


def test_an_exception_drops_what_waits() -> None:
    done: list[int] = []
    gate = threading.Event()

    def work(number: int) -> None:
        gate.wait(30.0)
        done.append(number)

    def stopped() -> None:
        with MapThreads[int]([]) as threads:
            for number in range(100):
                threads.submit(1, lambda number=number: work(number))
            threading.Timer(0.2, gate.set).start()
            raise ValueError("stop")

    with pytest.raises(ValueError, match="stop"):
        stopped()
    assert len(done) < 100
