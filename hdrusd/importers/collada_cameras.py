"""Cameras of COLLADA 1.4.1, chapter 5, ``camera``: angles of the whole field, half magnitudes."""

from __future__ import annotations

import math

from hdrusd.importers.collada_document import Document, named
from hdrusd.importers.collada_xml import Element
from hdrusd.legacy.scene import Camera
from hdrusd.report import Kind

#: Where only the horizontal angle is stated; the width over the height of hdrusd's own frames.
_ASPECT = 16.0 / 9.0
#: An angle whose tangent is still a number to work with, degrees.
_WIDEST = 179.0


class CameraReader:
    """Reads the cameras of one file into ``cameras``; one in many places has one record."""

    def __init__(self, document: Document) -> None:
        self.cameras: list[Camera] = []
        self._document = document
        self._known: dict[int, int | None] = {}

    def read(self, element: Element) -> int | None:
        """The number of a camera; None, with a finding, where it has no lens."""
        if id(element) not in self._known:
            camera = self._read(element)
            self._known[id(element)] = None if camera is None else len(self.cameras)
            if camera is not None:
                self.cameras.append(camera)
        return self._known[id(element)]

    def _read(self, element: Element) -> Camera | None:
        document, name = self._document, named(element, "camera")
        common = element.path("optics", "technique_common")
        lens = None if common is None else common.child("perspective", "orthographic")
        if lens is None:
            text = "camera without a perspective or orthographic lens; dropped"
            document.note(Kind.INVALID, "camera-type", element, name, text)
            return None
        near = document.number(lens, "znear", 0.1, low=0.0)
        far = document.number(lens, "zfar", near + 1000.0)
        if near <= 0.0 and lens.tag == "perspective":
            document.note(
                Kind.INVALID, "camera-value", lens, name, "znear 0; want more than 0; 0.1 is used"
            )
            near = 0.1
        if far <= near:
            text = f"zfar {far:g} is not beyond znear {near:g}; {near + 1000.0:g} is used"
            document.note(Kind.INVALID, "camera-value", lens, name, text)
            far = near + 1000.0
        aspect = self._positive(lens, "aspect_ratio")
        ref = document.ref(element)
        if lens.tag == "orthographic":
            x, y = self._positive(lens, "xmag"), self._positive(lens, "ymag")
            if y is None:
                y = self._from_width(lens, name, x if x is not None else 1.0, aspect)
            if aspect is None and x is not None:
                aspect = x / y
            return Camera(
                name, ref, "orthographic", height=2.0 * y, aspect=aspect, near=near, far=far
            )
        x, y = self._angle(lens, "xfov"), self._angle(lens, "yfov")
        if y is None and x is not None:
            half = math.tan(math.radians(x) / 2.0)
            y = math.degrees(2.0 * math.atan(self._from_width(lens, name, half, aspect)))
        if aspect is None and x is not None and y is not None:
            aspect = math.tan(math.radians(x) / 2.0) / math.tan(math.radians(y) / 2.0)
        if y is None:
            y = Camera(name, ref).fov_y
            text = f"neither xfov nor yfov; {y:g} degrees are used"
            document.note(Kind.INVALID, "camera-value", lens, name, text)
        return Camera(name, ref, "perspective", y, 1.0, aspect, near, far)

    def _from_width(self, lens: Element, name: str, width: float, aspect: float | None) -> float:
        """The height to a width, by the aspect or a stated guess."""
        if aspect is None:
            text = f"the height is not stated; {_ASPECT:.4g} is taken for the aspect_ratio"
            self._document.note(Kind.ASSUMED, "collada-camera-aspect", lens, name, text)
        return width / (aspect or _ASPECT)

    def _positive(self, lens: Element, tag: str) -> float | None:
        """A length or ratio; None where it is not stated or, with a finding, no such."""
        if lens.child(tag) is None:
            return None
        value = self._document.number(lens, tag, 1.0)
        if 1e-6 <= value <= 1e6:
            return value
        text = f"{tag} {value:g}; want more than 0; not used"
        self._document.note(Kind.INVALID, "camera-value", lens, "", text)
        return None

    def _angle(self, lens: Element, tag: str) -> float | None:
        if lens.child(tag) is None:
            return None
        value = self._document.number(lens, tag, 45.0)
        if 1e-3 <= value <= _WIDEST:
            return value
        text = f"{tag} {value:g}; want degrees between 0 and {_WIDEST:g}; not used"
        self._document.note(Kind.INVALID, "camera-value", lens, "", text)
        return None
