"""Cameras of glTF 2.0, section 3.10."""

from __future__ import annotations

import math

from hdrusd.importers.gltf_document import Document, Item
from hdrusd.legacy.scene import Camera
from hdrusd.report import Kind

#: Stands in for the far plane of an infinite projection: beyond what is drawn on any road.
_FAR_INSTEAD_OF_INFINITE = 1e5


def read_cameras(document: Document) -> list[Camera]:
    """All cameras, in the file's order, so that its numbers stay valid."""
    return [
        _orthographic(item, item.name or f"camera_{number}")
        if item.text("type") == "orthographic"
        else _perspective(item, item.name or f"camera_{number}")
        for number, item in enumerate(document.table("cameras"))
    ]


def _perspective(item: Item, name: str) -> Camera:
    lens = item.child("perspective")
    default = Camera(name, item.ref)
    if item.text("type") != "perspective":
        text = "type is neither perspective nor orthographic; read as perspective"
        item.note(Kind.INVALID, "camera-type", text)
    angle = _positive(lens, "yfov", math.radians(default.fov_y))
    if angle >= math.pi:
        text = f"yfov {angle:g}; want radians below pi; {default.fov_y:g} degrees are used"
        lens.note(Kind.INVALID, "camera-value", text)
        angle = math.radians(default.fov_y)
    near = _positive(lens, "znear", default.near)
    if "zfar" in lens:
        far = _far(lens, near)
    else:
        far = max(_FAR_INSTEAD_OF_INFINITE, 2.0 * near)
        lens.note(Kind.REPLACED, "camera-infinite", f"no zfar: {far:g} m instead of infinity")
    aspect = _positive(lens, "aspectRatio", 1.0) if "aspectRatio" in lens else None
    return Camera(name, item.ref, "perspective", math.degrees(angle), 1.0, aspect, near, far)


def _orthographic(item: Item, name: str) -> Camera:
    lens = item.child("orthographic")
    width = 2.0 * _positive(lens, "xmag", 0.5)
    height = 2.0 * _positive(lens, "ymag", 0.5)
    near = lens.number("znear", 0.0, low=0.0)
    far = _far(lens, near)
    return Camera(
        name, item.ref, "orthographic", height=height, aspect=width / height, near=near, far=far
    )


def _far(lens: Item, near: float) -> float:
    far = lens.number("zfar", 1000.0)
    if far > near:
        return far
    instead = near + 1000.0
    text = f"zfar {far:g} is not beyond znear {near:g}; {instead:g} is used"
    lens.note(Kind.INVALID, "camera-value", text)
    return instead


def _positive(lens: Item, key: str, default: float) -> float:
    value = lens.number(key, default)
    if value > 0.0:
        return value
    text = f"{key} {value:g}; want more than 0; {default:g} is used"
    lens.note(Kind.INVALID, "camera-value", text)
    return default
