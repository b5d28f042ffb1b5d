"""Cameras of FBX: ufbx works angle and size out of film, gate fit, squeeze and focal length.

FBX SDK, ``FbxCamera``: a camera looks along its node's +X with +Y up. ``LOOK`` turns -Z there.
"""

from __future__ import annotations

import math

from hdrusd.importers.fbx_document import Document
from hdrusd.importers.fbx_held import Held
from hdrusd.legacy.scene import TRS, Camera
from hdrusd.report import Kind

#: From a camera that looks along -Z to FBX's: a turn of -90 degrees about Y.
LOOK = TRS(rotation=(0.0, -math.sqrt(0.5), 0.0, math.sqrt(0.5)))

_ORTHOGRAPHIC = 1
#: Near and far plane of a camera that states none: FBX SDK, ``FbxCamera``.
_PLANES = {"NearPlane": 10.0, "FarPlane": 4000.0}
#: Angles whose tangent is still a number to work with, degrees.
_NARROWEST, _WIDEST = 1e-3, 179.0


def read_camera(document: Document, camera: Held, name: str) -> Camera:
    """A camera; what it states badly is mended with a finding."""
    place = document.ref("camera", name)
    base = Camera(name, place)

    def mend(value: float, good: bool, instead: float, what: str) -> float:
        if good:
            return value
        text = f"{what} {value:g}; {instead:g} is used"
        document.note(Kind.INVALID, "camera-value", place, name, text)
        return instead

    near, far = (float(camera.props.find_real(word, default)) for word, default in _PLANES.items())
    flat = int(camera.projection_mode) == _ORTHOGRAPHIC
    good = math.isfinite(near) and (near > 0.0 or flat) and abs(near) < 1e9
    near = mend(near, good, 0.1, "near plane")
    far = mend(far, math.isfinite(far) and near < far < 1e12, near + 4000.0, "far plane")
    aspect: float | None = float(camera.aspect_ratio)
    if aspect is None or not 1e-3 < aspect < 1e3:
        aspect = None
    if flat:
        height = float(camera.orthographic_size.y)
        height = mend(height, 1e-9 < height < 1e9, base.height, "height")
        return Camera(name, place, "orthographic", height=height, aspect=aspect, near=near, far=far)
    angle = float(camera.field_of_view_deg.y)
    angle = mend(angle, _NARROWEST <= angle <= _WIDEST, base.fov_y, "vertical angle")
    return Camera(name, place, "perspective", angle, aspect=aspect, near=near, far=far)
