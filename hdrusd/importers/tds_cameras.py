"""Cameras of 3D Studio: a place, a target, a roll and a lens.

The lens is in millimetres of 35 mm film by 3D Studio's own count: the picture is
2400 / lens degrees wide. It has no clipping planes; CAM_RANGES is where fog begins and
ends.

Source: Autodesk, 3D Studio File Toolkit for release 3, "3DS Chunk Definitions"
(N_CAMERA); files of 3ds Max, which state the angle too (FOV_TRACK_TAG).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hdrusd.importers.tds_chunks import Chunk, Document
from hdrusd.legacy.scene import Camera, Vec3
from hdrusd.report import Kind

_DEGREES_BY_LENS = 2400.0
#: 3D Studio's own lens, as near as can be to the eye's field.
_LENS = 48.24
#: Width over height of the picture that a stage asks for; a camera says only its width.
_ASPECT = 16.0 / 9.0
#: The drawn cone, and the range of fog.
_SILENT = frozenset({0x4710, 0x4720})
#: Of the scene's size: what is nearer than this or farther than that is not seen.
_NEAR, _FAR = 1e-4, 10.0


@dataclass(frozen=True, slots=True)
class RawCamera:
    """A camera as it stands in the file, in the world. Angles in degrees."""

    name: str
    chunk: Chunk
    place: Vec3
    target: Vec3
    roll: float
    width: float  # of the field of view


def read_camera(document: Document, chunk: Chunk, name: str) -> RawCamera | None:
    """An N_CAMERA; None, with a finding, where it has no place."""
    values = document.floats(chunk, 8, name)
    if values is None:
        return None
    for child in document.children(chunk, chunk.begin + 32):
        document.unread(child, name, _SILENT)
    lens = values[7]
    width = _DEGREES_BY_LENS / lens if lens > 0.0 else _DEGREES_BY_LENS / _LENS
    if not lens > 0.0:
        text = f"lens of {lens:g} mm; want more than 0; {_LENS} is used"
        document.note(Kind.INVALID, "3ds-camera", chunk, name, text)
    place, target = (values[0], values[1], values[2]), (values[3], values[4], values[5])
    return RawCamera(name, chunk, place, target, math.fmod(values[6], 360.0), width)


def camera(document: Document, raw: RawCamera, width: float, size: float) -> Camera:
    """The camera with a field ``width`` degrees wide; ``size``: of the scene, source units."""
    if not 0.0 < width < 180.0:
        kept = 45.0 if width <= 0.0 else 179.0
        text = f"field of view {width:g} degrees; want 0 to 180; {kept:g} is used"
        document.note(Kind.INVALID, "3ds-camera", raw.chunk, raw.name, text)
        width = kept
    half = math.tan(math.radians(width) / 2.0)
    near, far = _NEAR * size, _FAR * size
    text = f"{width:g} degrees across a picture of 16:9; sees from {near:g} to {far:g} units"
    document.note(Kind.ASSUMED, "3ds-camera-frame", raw.chunk, raw.name, text)
    return Camera(
        raw.name,
        document.ref(raw.chunk),
        fov_y=math.degrees(2.0 * math.atan(half / _ASPECT)),
        aspect=_ASPECT,
        near=near,
        far=far,
    )
