"""Meshes that assimp read: polygons with all that their points carry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers import assimp_library as ai
from hdrusd.importers.importer import Limits
from hdrusd.legacy.scene import Floats, Interpolation, Ints, Material, Mesh
from hdrusd.report import Kind, Report


@dataclass(slots=True)
class MeshReader:
    """Reads the meshes of one file, at most ``limits.vertices`` points and faces in all."""

    source: Path
    report: Report
    limits: Limits
    materials: Sequence[Material]
    total: int = field(default=0)

    def read(self, record: Any, number: int) -> Mesh | None:
        """A mesh; None, with a finding, where it has no polygon."""
        place, name = SourceRef(self.source, f"mesh {number}"), ai.text(record["name"])
        count = int(record["points_count"])
        self.total += count + int(record["faces_count"])
        if self.total > self.limits.vertices:
            raise InputError(place, f"more than {self.limits.vertices} points and faces up to here")
        points = _floats(record["points"], 3, count)
        counts, indices = _faces(record)
        keep = counts >= 3
        if not keep.all():
            text = f"{int((~keep).sum())} points and lines are left out; want polygons"
            self.report.add(Kind.DROPPED, "assimp-faces", place, name, text)
        counts, indices = _kept(counts, indices, keep)
        whole = np.logical_and.reduce(np.isfinite(points), axis=1)
        inside = indices < count
        good = inside.copy()
        good[inside] = whole[indices[inside]]
        sound = np.logical_and.reduceat(good, _starts(counts)) if len(counts) else good[:0]
        if not sound.all():
            text = f"{int((~sound).sum())} faces with points that are none are left out"
            self.report.add(Kind.INVALID, "assimp-number", place, name, text)
            counts, indices = _kept(counts, indices, sound)
        if not len(counts):
            self.report.add(Kind.DROPPED, "assimp-faces", place, name, "a mesh without polygons")
            return None
        points[~whole] = 0.0  # no face has them
        if record["bones_count"] or record["morphs_count"]:
            text = "skin and morphs of a mesh are left out; it keeps its shape"
            self.report.add(Kind.DROPPED, "assimp-skin", place, name, text)
        material = int(record["material"])
        known = material < len(self.materials)
        return Mesh(
            name,
            place,
            points,
            counts.astype(np.int32),
            indices.astype(np.int32),
            normals=self._normals(record, count, place, name),
            uvs=self._uvs(record, count),
            colors=self._colors(record, count, place, name),
            material=material if known else None,
            two_sided=not known or self.materials[material].two_sided,
        )

    def _normals(self, record: Any, count: int, place: SourceRef, name: str) -> Floats | None:
        found = _floats(record["normals"], 3, count)
        if not len(found) or not np.isfinite(found).all():
            if len(found):
                text = "normals that are no numbers; faces are shown flat"
                self.report.add(Kind.INVALID, "assimp-number", place, name, text)
            return None
        return found

    def _uvs(self, record: Any, count: int) -> dict[str, tuple[Floats, Interpolation]]:
        made: dict[str, tuple[Floats, Interpolation]] = {}
        for number, address in enumerate(record["uvs"].tolist()):
            if address:
                found = _floats(address, 3, count)[:, :2]
                key = f"st{number}" if number else "st"
                made[key] = np.ascontiguousarray(np.where(np.isfinite(found), found, 0)), "vertex"
        return made

    def _colors(self, record: Any, count: int, place: SourceRef, name: str) -> Floats | None:
        addresses = [address for address in record["colors"].tolist() if address]
        if len(addresses) > 1:
            text = f"{len(addresses)} sets of vertex colours; the first is kept"
            self.report.add(Kind.DROPPED, "assimp-colors", place, name, text)
        if not addresses:
            return None
        found = _floats(addresses[0], 4, count)
        return np.where(np.isfinite(found), found, np.float32(1.0))


def _floats(address: int, width: int, count: int) -> Floats:
    """A copy of ``count`` rows of ``width`` numbers; no row where there is nothing."""
    return ai.view(address, "f4", count * width).reshape(-1, width).copy()


def _starts(counts: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
    """Where the corners of each face begin."""
    ends: npt.NDArray[np.int64] = np.cumsum(counts, dtype=np.int64)
    return ends - counts.astype(np.int64)


def _kept(counts: Ints, indices: Ints, keep: npt.NDArray[np.bool_]) -> tuple[Ints, Ints]:
    """The faces to keep, and their corners."""
    return counts[keep], indices[np.repeat(keep, counts)]


def _faces(record: Any) -> tuple[Any, Any]:
    """Corners a face, and the corners, int64 and uint32.

    Each face has its indices in a piece of memory of its own. All are gathered at once from a
    view that spans them; what lies between is never touched.
    """
    faces = ai.view(record["faces"], ai.FACE, int(record["faces_count"]))
    counts = np.where(faces["indices"] != 0, faces["count"], 0).astype(np.int64)
    if not counts.any():
        return counts, np.empty(0, np.uint32)
    addresses = faces["indices"].astype(np.int64)
    low = int(addresses[counts > 0].min())
    high = int((addresses + 4 * counts).max())
    memory = ai.view(low, "u4", (high - low) // 4)
    within = np.arange(counts.sum()) - np.repeat(_starts(counts), counts)
    return counts, memory[np.repeat((addresses - low) // 4, counts) + within]
