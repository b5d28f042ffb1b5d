"""What the texture files of a conversion are called, wherever the project lies.

A file's name is the picture's own, what is made of it, and a digest of where it comes from.
"""

from __future__ import annotations

import hashlib
import os
import re
from pathlib import Path

from hdrusd.legacy.scene import Image

#: First bytes of a file by which its format is told.
_MAGIC = 8


def origin(image: Image, home: Path) -> str:
    """What tells a picture from others: where it lies from ``home``, or a hash of what it holds.

    ``home``: the source's folder, links followed. The image is not missing.
    """
    if image.path is not None:
        return Path(os.path.relpath(image.path, home)).as_posix()
    data = image.data
    if data is None and image.pixels is not None:
        data = f"{image.pixels.shape}".encode() + image.pixels.tobytes()
    return hashlib.sha256(data or b"").hexdigest()


def file_name(image: Image, role: str, key: str, suffix: str = ".exr") -> str:
    """The name for what is made of a picture; ``key``: its origin, and how it is made."""
    digest = hashlib.sha256(key.encode(errors="surrogatepass")).hexdigest()[:8]
    return "_".join(part for part in (_stem(image), role, digest) if part) + suffix


def named(image: Image) -> Path:
    """The picture's file; for one that is none, a name with a suffix that fits its bytes."""
    return image.path or Path(_stem(image) + (_suffix(image.data) or ".img"))


def format_of(image: Image) -> str:
    """The suffix of its format by its first bytes, as its own is not believed; "" for others."""
    if image.data is None and image.path is not None:
        with image.path.open("rb") as file:
            return _suffix(file.read(_MAGIC))
    return _suffix(image.data)


def _suffix(data: bytes | None) -> str:
    magic = (data or b"")[:_MAGIC]
    known = {b"\x89PNG": ".png", b"\xff\xd8\xff": ".jpg", b"v/1\x01": ".exr", b"DDS ": ".dds"}
    for start, suffix in known.items():
        if magic.startswith(start):
            return suffix
    return ""


def _stem(image: Image) -> str:
    name = image.path.stem if image.path is not None else Path(image.name.replace("\\", "/")).stem
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name)[:48].strip("_") or "image"
