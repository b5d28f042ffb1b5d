"""Compressed meshes to arrays, inside the worker: nothing here may be imported by hdrusd itself.

    python -m hdrusd.importers.unpacking_worker FOLDER

``FOLDER`` holds what ``unpacking`` asks. What one piece of it is wrong with is its answer; the
others are not lost by it.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

TASK, PACKED, ANSWER, ARRAYS = "task.json", "packed.bin", "answer.json", "arrays.bin"
_LONGEST = 200


def meshopt_view(packed: bytes, *, count: int, stride: int, mode: str, filter: str) -> list[Array]:
    """The bytes of a buffer view: (count * stride,) uint8. Raises what meshopt does."""
    import meshopt

    rows = meshopt.decode_gltf_buffer(packed, count, stride, mode, filter)
    return [np.ascontiguousarray(rows).reshape(-1).view(np.uint8)]


def draco_mesh(packed: bytes, *, attributes: list[tuple[int, bool]]) -> list[Array | None]:
    """The triangles, (f, 3) uint32, and of each attribute its rows, (n, k).

    ``attributes`` are unique ids, and whether the integers of each are normalized; None stands
    for one that is not there. Raises what DracoPy does, ValueError for a point cloud.
    """
    import DracoPy

    mesh = DracoPy.decode(packed)
    if not isinstance(mesh, DracoPy.DracoMesh):
        raise ValueError("a point cloud; want triangles")
    found = {attribute["unique_id"]: attribute for attribute in mesh.attributes}
    signed: dict[int, np.dtype[Any]]
    signed = {DracoPy.DataType.DT_INT8: np.dtype("i1"), DracoPy.DataType.DT_INT16: np.dtype("i2")}
    arrays: list[Array | None] = [np.ascontiguousarray(mesh.faces, np.uint32)]
    for number, normalized in attributes:
        attribute = found.get(number)
        if attribute is None:
            arrays.append(None)
            continue
        kind = signed.get(attribute["data_type"])
        data = np.ascontiguousarray(attribute["data"])
        arrays.append(data if kind is None else _integers(data, kind, normalized))
    return arrays


def _integers(values: Array, kind: np.dtype[Any], normalized: bool) -> Array:
    """The signed integers that DracoPy gives as float32, divided by their largest or not.

    Draco divides where the attribute is marked as normalized, which DracoPy does not say.
    Whole numbers within -1 and 1 alone are both; the accessor decides between them.
    """
    divided = bool((values != np.rint(values)).any())
    divided |= normalized and bool((np.abs(values) <= 1.0).all())
    if divided:
        values = values * np.float32(np.iinfo(kind).max)
    return np.rint(values).astype(kind)


_CODECS: dict[str, Callable[..., Any]] = {"meshopt": meshopt_view, "draco": draco_mesh}


def serve(folder: Path) -> None:
    """Answer every piece of the task, one after another."""
    task = json.loads((folder / TASK).read_text(encoding="utf-8"))
    answers: list[Any] = []
    declared: list[tuple[str, tuple[int, ...]]] = []
    with open(folder / PACKED, "rb") as source, open(folder / ARRAYS, "wb") as target:
        for codec, start, length, options in task:
            source.seek(start)
            try:
                arrays = _CODECS[codec](source.read(length), **options)
            except Exception as error:  # whatever a library says of broken data
                answers.append(f"{type(error).__name__}: {error}"[:_LONGEST])
                continue
            answers.append([])
            for array in arrays:
                answers[-1].append(None if array is None else len(declared))
                if array is not None:
                    array = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
                    declared.append((array.dtype.str, array.shape))
                    target.write(array.data)
    text = json.dumps({"answers": answers, "arrays": declared})
    (folder / ANSWER).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
