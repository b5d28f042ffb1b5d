"""The C library of assimp 6 without its headers: where it lies, and how its records lie in memory.

Records are NumPy types of the same layout, read where they stand; what is kept must be copied.
A wrong pointer kills the process, so nothing of this runs outside a worker.

Source: assimp 6.0, include/assimp (scene.h, mesh.h, material.h, light.h, camera.h, anim.h).
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Records = npt.NDArray[Any]

PACKAGE = "cmeel-assimp"
_MAJOR = 6
_NAMES = ("libassimp.so", "libassimp.dylib")

#: Switched on: no triangles drawn in place of nodes where a file has no mesh.
_SETTINGS = (b"IMPORT_NO_SKELETON_MESHES",)

_POINTER = "u8"
STRING = np.dtype([("length", "u4"), ("text", "S1024")])


def _layout(*fields: tuple[Any, ...]) -> np.dtype[Any]:
    return np.dtype(list(fields), align=True)


SCENE = _layout(
    ("flags", "u4"),
    ("root", _POINTER),
    *(
        field
        for table in ("meshes", "materials", "animations", "textures", "lights", "cameras")
        for field in ((f"{table}_count", "u4"), (table, _POINTER))
    ),
    ("metadata", _POINTER),
)
NODE = _layout(
    ("name", STRING),
    ("transform", "f4", (4, 4)),  # of column vectors
    ("parent", _POINTER),
    ("children_count", "u4"),
    ("children", _POINTER),
    ("meshes_count", "u4"),
    ("meshes", _POINTER),
)
MESH = _layout(
    ("kinds", "u4"),
    ("points_count", "u4"),
    ("faces_count", "u4"),
    ("points", _POINTER),
    ("normals", _POINTER),
    ("tangents", _POINTER),
    ("bitangents", _POINTER),
    ("colors", _POINTER, (8,)),
    ("uvs", _POINTER, (8,)),
    ("uv_sizes", "u4", (8,)),
    ("faces", _POINTER),
    ("bones_count", "u4"),
    ("bones", _POINTER),
    ("material", "u4"),
    ("name", STRING),
    ("morphs_count", "u4"),
)
FACE = _layout(("count", "u4"), ("indices", _POINTER))
MATERIAL = _layout(("properties", _POINTER), ("count", "u4"), ("allocated", "u4"))
PROPERTY = _layout(
    ("key", STRING),
    ("role", "u4"),
    ("index", "u4"),
    ("size", "u4"),
    ("type", "u4"),
    ("data", _POINTER),
)
TEXTURE = _layout(
    ("width", "u4"), ("height", "u4"), ("hint", "S9"), ("data", _POINTER), ("file", STRING)
)
LIGHT = _layout(
    ("name", STRING),
    ("type", "u4"),
    ("position", "f4", (3,)),
    ("direction", "f4", (3,)),
    ("up", "f4", (3,)),
    ("attenuation", "f4", (3,)),
    ("diffuse", "f4", (3,)),
    ("specular", "f4", (3,)),
    ("ambient", "f4", (3,)),
    ("inner", "f4"),
    ("outer", "f4"),
    ("size", "f4", (2,)),
)
ANIMATION = _layout(
    ("name", STRING),
    ("duration", "f8"),
    ("rate", "f8"),
    ("channels_count", "u4"),
    ("channels", _POINTER),
    ("mesh_channels_count", "u4"),
    ("mesh_channels", _POINTER),
    ("morph_channels_count", "u4"),
    ("morph_channels", _POINTER),
)
CHANNEL = _layout(
    ("node", STRING),
    ("places_count", "u4"),
    ("places", _POINTER),
    ("turns_count", "u4"),
    ("turns", _POINTER),
    ("scales_count", "u4"),
    ("scales", _POINTER),
    ("before", "u4"),
    ("after", "u4"),
)
VECTOR_KEY = _layout(("time", "f8"), ("value", "f4", (3,)), ("interpolation", "u4"))
TURN_KEY = _layout(("time", "f8"), ("value", "f4", (4,)), ("interpolation", "u4"))  # w, x, y, z


@dataclass(frozen=True, slots=True)
class _Block:
    """Memory as NumPy takes it."""

    __array_interface__: dict[str, Any]


def view(address: int, dtype: npt.DTypeLike, count: int) -> Records:
    """``count`` records at an address, where they stand; none of them for 0."""
    kind = np.dtype(dtype)
    if not address or not count:
        return np.empty(0, kind)
    interface = {"version": 3, "shape": (count * kind.itemsize,), "typestr": "|u1"}
    block = _Block(interface | {"data": (int(address), True)})
    return np.asarray(block).view(kind)


def records(addresses: int, count: int, dtype: npt.DTypeLike) -> list[Any]:
    """The records that an array of ``count`` pointers leads to; nothing for a null pointer."""
    found = view(addresses, _POINTER, int(count)).tolist()
    return [view(address, dtype, 1)[0] for address in found if address]


def text(string: Any) -> str:
    """An aiString."""
    return bytes(string["text"])[: int(string["length"])].decode("utf-8", "replace")


def find_library() -> Path | None:
    """The library of the package cmeel-assimp, where it is installed."""
    try:
        files = distribution(PACKAGE).files or []
    except PackageNotFoundError:
        return None
    found = [Path(str(file.locate())) for file in files if file.name in _NAMES]
    return found[0].resolve() if found and found[0].exists() else None


def load(library: Path, data: bytes, suffix: str, flags: int) -> Any:
    """The aiScene of a file's content. Raises ValueError with assimp's own words."""
    assimp = ctypes.CDLL(str(library))
    if assimp.aiGetVersionMajor() != _MAJOR:
        raise ValueError(f"assimp {assimp.aiGetVersionMajor()} is installed; want assimp {_MAJOR}")
    assimp.aiCreatePropertyStore.restype = ctypes.c_void_p
    assimp.aiImportFileFromMemoryWithProperties.restype = ctypes.c_void_p
    assimp.aiGetErrorString.restype = ctypes.c_char_p
    settings = ctypes.c_void_p(assimp.aiCreatePropertyStore())
    for name in _SETTINGS:
        assimp.aiSetImportPropertyInteger(settings, name, 1)
    hint = suffix.removeprefix(".").encode()
    address = assimp.aiImportFileFromMemoryWithProperties(data, len(data), flags, hint, settings)
    if not address:
        raise ValueError((assimp.aiGetErrorString() or b"").decode("utf-8", "replace"))
    return view(address, SCENE, 1)[0]
