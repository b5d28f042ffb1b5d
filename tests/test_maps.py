"""What the writer of maps keeps of pictures: once looked at, up to a bound, some places of them."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import picture

from hdrusd import maps as maps_module
from hdrusd import texture_names
from hdrusd.legacy.scene import Image, Texture
from hdrusd.maps import MapWriter
from hdrusd.report import Report


def writer(folder: Path) -> MapWriter:
    return MapWriter(folder, "./a.textures", folder, Report())


def noise(seed: int, channels: int = 3) -> Image:
    codes = np.random.default_rng(seed).integers(0, 256, (16, 24, channels), np.uint8)
    return picture(codes, f"{seed}.png")


def test_a_picture_in_memory_is_hashed_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hashed: list[int] = []
    plain = hashlib.sha256

    def sha256(data: bytes) -> Any:
        hashed.append(len(data))
        return plain(data)

    monkeypatch.setattr(texture_names.hashlib, "sha256", sha256)
    maps, image = writer(tmp_path), noise(1)
    for _ in range(5):
        maps.look(Texture(image))
        maps.overview(image, 2.2)
    # The 1152 bytes of its pixels and their shape; what is shorter are names.
    assert sum(size >= 1152 for size in hashed) == 1


def test_pictures_are_kept_up_to_a_bound(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(maps_module, "_KEPT", 3 * 1152)
    maps, images = writer(tmp_path), [noise(seed) for seed in range(8)]
    for image in (*images, *images):
        maps.overview(image, 2.2)
        kept = [p.pixels.nbytes for p in maps._pictures.values() if p is not None]
        assert sum(kept) == maps._kept <= 3 * 1152
    assert len(kept) == 3


@pytest.mark.parametrize("channels", [3, 4])
def test_an_overview_of_some_places_is_that_of_all_there(tmp_path: Path, channels: int) -> None:
    maps, image = writer(tmp_path), noise(2, channels)
    row, column = np.array([0, 15, 7, 7]), np.array([23, 0, 3, 3])
    whole, some = maps.overview(image, 2.2), maps.overview(image, 2.2, lambda w, h: (row, column))
    assert whole is not None
    assert some is not None
    np.testing.assert_array_equal(some[0], whole[0][row, column][None])
    if channels == 3:
        assert some[1] is whole[1] is None
    else:
        assert some[1] is not None
        assert whole[1] is not None
        np.testing.assert_array_equal(some[1], whole[1][row, column][None])
