"""What the pictures of a scene are called, so that no two have one name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterable, Iterator
from itertools import count
from pathlib import Path

from hdrusd.legacy.scene import Image


def picture_names(images: Iterable[Image]) -> dict[Hashable, str]:
    """A name for each picture, by its ``key()``: what the source calls it first.

    Pictures that are called alike have as much of their path before it as tells them apart, or
    behind it the place where they are named.
    """
    pictures: dict[Hashable, Image] = {}
    for image in images:
        pictures.setdefault(image.key(), image)
    ways = {
        key: _ways(image, number, len(pictures))
        for number, (key, image) in enumerate(pictures.items(), start=1)
    }
    names = {key: next(way) for key, way in ways.items()}
    while True:
        uses = Counter(names.values())
        alike = [key for key, name in names.items() if uses[name] > 1]
        if not alike:
            return names
        for key in alike:
            names[key] = next(ways[key])


def _ways(image: Image, number: int, step: int) -> Iterator[str]:
    """Names from the shortest on, of which the last are no other picture's."""
    yield image.name
    path = image.path
    if image.missing:
        path = image.source.file.parent / image.name.replace("\\", "/")
    parts = () if path is None else path.parts
    for most in range(2, len(parts) + 1):
        yield Path(*parts[-most:]).as_posix()
    yield f"{image.name} ({image.source})"
    for each in count(number, step):
        yield f"{image.name} ({image.source}, {each})"
