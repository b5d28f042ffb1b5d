"""Binary OpenSceneGraph files for tests: put together from bytes.

The order of the fields is that of OpenSceneGraph's serializers, written down here once more and
not taken from the reader.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

from osg_builder import Loaded

from hdrusd.importers import importer
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.report import Report

MAGIC = 0x6C910EA1, 0x1AFB4545
ALL = 0xFFFFFFFF

#: A unit square and a triangle over its lower right half.
SQUARE = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]
CORNERS = [0, 1, 2]


@dataclass(frozen=True)
class Writer:
    """What a program of one version writes; ``sizes``: whether blocks state theirs."""

    version: int = 161
    order: str = "<"
    sizes: bool = True

    # -- bytes -----------------------------------------------------------------------------

    def pack(self, code: str, *values: float) -> bytes:
        """Numbers of one type of ``struct``."""
        return struct.pack(f"{self.order}{len(values)}{code}", *values)

    def text(self, text: str | bytes) -> bytes:
        """A text after its length."""
        data = text if isinstance(text, bytes) else text.encode()
        return self.pack("I", len(data)) + data

    def block(self, body: bytes) -> bytes:
        """A block, whose size counts itself: 8 bytes since version 149."""
        if not self.sizes:
            return body
        code = "Q" if self.version > 148 else "I"
        return self.pack(code, len(body) + struct.calcsize(f"<{code}")) + body

    def object(self, label: str, number: int, *fields: bytes) -> bytes:
        """An object; a reference to one if it has no fields."""
        return self.text(label) + self.block(self.pack("I", number) + b"".join(fields))

    # -- fields of base classes ----------------------------------------------------------------

    def named(self, name: str = "", container: bytes = b"") -> bytes:
        """osg::Object: Name, DataVariance, UserData or its container."""
        there = b"\1" + container if container else b"\0"
        return self.text(name) + self.pack("i", 2) + there

    def node(
        self, name: str = "", state: bytes = b"", mask: int = ALL, update: bytes = b""
    ) -> bytes:
        """osg::Object and osg::Node."""
        called = b"\1" + update if update else b"\0"
        shown = b"\1" + self.pack("I", mask)
        old = b"\0" if self.version < 77 else b""  # Descriptions
        return (
            self.named(name)
            + bytes(2)  # InitialBound, ComputeBoundingSphereCallback
            + called
            + bytes(2)  # EventCallback, CullCallback
            + shown
            + old
            + (b"\1" + state if state else b"\0")
        )

    def group(
        self,
        number: int,
        *children: bytes,
        name: str = "",
        label: str = "osg::Group",
        state: bytes = b"",
        more: bytes = b"",
        update: bytes = b"",
    ) -> bytes:
        """A node with children; ``more`` are the fields of the class itself."""
        inside = self.pack("I", len(children)) + self.block(b"".join(children))
        own = b"\1" + inside if children else b"\0"
        return self.object(label, number, self.node(name, state, update=update), own, more)

    def geode(self, number: int, *drawables: bytes, name: str = "", state: bytes = b"") -> bytes:
        """A Geode."""
        inside = self.pack("I", len(drawables)) + self.block(b"".join(drawables))
        return self.object("osg::Geode", number, self.node(name, state), b"\1", inside)

    def drawable(self, name: str = "", state: bytes = b"") -> bytes:
        """osg::Object, osg::Node since version 154, and osg::Drawable."""
        there = b"\1" + state if state else b"\0"
        if self.version >= 154:
            first, own, calls = self.node(name, state), b"", b""
        else:
            first, own, calls = self.named(name), there, bytes(4)
        if 154 <= self.version <= 155:
            own, calls = b"\0", bytes(4)
        masks = self.pack("I", ALL) if self.version >= 142 else b""
        masks += b"\1" if self.version >= 145 else b""
        # InitialBound, ComputeBoundingBoxCallback, Shape; three hints; callbacks
        return first + own + bytes(3) + b"\1\1\0" + calls + masks

    # -- geometry ------------------------------------------------------------------------------

    def _held(self) -> bytes:
        """osg::Object and osg::BufferData of arrays and primitive sets, since version 112."""
        return self.named() + (b"\0" if self.version >= 147 else b"")

    def array(
        self, label: str, number: int, code: str, width: int, values: list[float], binding: int = 4
    ) -> bytes:
        """An array that is an object: Binding, Normalize, PreserveDataType, vector."""
        rows = self.pack("I", len(values) // width) + self.pack(code, *values)
        fields = self.pack("i", binding) + b"\0\0" + rows
        return self.object(label, number, self._held(), fields)

    def elements(self, number: int, corners: list[int], mode: int = 4) -> bytes:
        """DrawElementsUShort: NumInstances, Mode, vector."""
        own = self.pack("i", 0, mode) + self.pack("I", len(corners)) + self.pack("H", *corners)
        return self.object("osg::DrawElementsUShort", number, self._held(), own)

    def old_array(self, number: int, kind: int, width: int, values: list[float]) -> bytes:
        """An array before version 112, of floating point."""
        rows = self.pack("I", len(values) // width)
        return self.pack("I", number, kind) + rows + self.block(self.pack("f", *values))

    def geometry(
        self,
        number: int,
        name: str = "",
        state: bytes = b"",
        points: list[float] = SQUARE,
        corners: list[int] = CORNERS,
        colours: list[float] | None = None,
    ) -> bytes:
        """A Geometry of triangles with one normal for all; its objects are numbered on."""
        head = self.drawable(name, state)
        if self.version < 112:
            return self.object("osg::Geometry", number, head, self._old(number, points, corners))
        arrays = [b"\1" + self.array("osg::Vec3Array", number + 2, "f", 3, points)]
        arrays += [b"\1" + self.array("osg::Vec3Array", number + 3, "f", 3, [0.0, 0.0, 1.0], 1)]
        tint = b"\0"
        if colours is not None:
            tint = b"\1" + self.array("osg::Vec4Array", number + 4, "f", 4, colours)
        sets = self.pack("I", 1) + self.elements(number + 1, corners)
        lists = self.pack("I", 0, 0)  # texture coordinates, attributes
        body = sets + b"".join(arrays) + tint + bytes(2) + lists
        return self.object("osg::Geometry", number, head, body)

    def _old(self, number: int, points: list[float], corners: list[int]) -> bytes:
        sets = self.pack("I", 1, 53, 4)  # one; DrawElementsUShort of triangles
        sets += self.pack("I", 0) if self.version > 96 else b""  # instances
        sets += self.pack("I", len(corners)) + self.block(self.pack("H", *corners))
        data = []
        for array, (values, binding) in enumerate(((points, 4), ([0.0, 0.0, 1.0], 1))):
            inside = b"\1" + self.old_array(number + array, 16, 3, values)
            inside += b"\0" + self.pack("i", binding, 0)  # no indices; Binding, Normalize
            data.append(b"\1" + self.block(inside))
        # colours, secondary colours, fog, texture coordinates, attributes, FastPathHint
        return sets + b"".join(data) + bytes(6)

    # -- state ---------------------------------------------------------------------------------

    def state(
        self,
        number: int,
        *attributes: bytes,
        modes: tuple[tuple[int, int], ...] = (),
        unit: bytes = b"",
    ) -> bytes:
        """A StateSet; ``unit`` is the texture of unit 0, which is switched on."""
        on = self.pack("I", len(modes)) + self.block(b"".join(self.pack("I", *m) for m in modes))
        listed = b"".join(attribute + self.pack("i", 1) for attribute in attributes)
        held = self.pack("I", len(attributes)) + self.block(listed)
        units = b"\0\0"
        if unit:
            mode = self.pack("I", 1) + self.block(
                self.pack("I", 1) + self.block(self.pack("I", 0x0DE1, 1))
            )
            worn = self.pack("I", 1) + self.block(unit + self.pack("i", 1))
            units = b"\1" + mode + b"\1" + self.pack("I", 1) + self.block(worn)
        return self.object(
            "osg::StateSet",
            number,
            self.named(),
            b"\1" + on if modes else b"\0",
            b"\1" + held if attributes else b"\0",
            units,
            b"\0",  # uniforms
            self.pack("i", 0, 0, 0),
            self.text(""),
            b"\1",  # render bin
            bytes(2),
            b"\0" if self.version >= 151 else b"",  # callbacks, defines
        )

    def material(self, number: int, name: str, **colours: list[float]) -> bytes:
        """A Material; ColorMode is OFF."""
        sides = [
            self.pack("f", *colours.get(key, [0.0, 0.0, 0.0, 1.0]))
            for key in ("ambient", "diffuse", "specular", "emission")
        ]
        sides.append(self.pack("f", 32.0))
        own = self.pack("I", 5635) + b"".join(b"\1\1" + side + side for side in sides)
        return self.object("osg::Material", number, self.named(name), bytes(2), own)

    def texture(self, number: int, image: bytes) -> bytes:
        """A Texture2D that repeats."""
        repeat = b"\1" + self.pack("I", 0x2901)
        linear = b"\1" + self.pack("I", 0x2601)
        own = repeat * 3 + linear * 2 + self.pack("f", 1.0) + b"\1\0\0\1"
        own += self.pack("d", 0.0, 0.0, 0.0, 0.0) + self.pack("i", 0, 0)  # border, format mode
        own += bytes(3) + b"\0" + self.pack("i", 515, 6409) + self.pack("f", 0.0)  # shadows
        own += b"\0" if 95 <= self.version <= 153 else b""  # ImageAttachment
        own += b"\0" if self.version >= 98 else b""  # Swizzle
        own += self.pack("f", 0.0, -1.0, 0.0) if self.version >= 155 else b""  # levels
        own += b"\1" + image + self.pack("i", 0, 0)
        return self.object("osg::Texture2D", number, self.named(), bytes(2), own)

    def image(self, number: int, name: str, how: int = 2, held: bytes = b"") -> bytes:
        """An Image: 0 with pixels, 1 with a picture file, 2 by name."""
        label = self.text("osg::Image") if self.version > 94 else b""
        head = self.pack("I", number) + self.text(name) + self.pack("i", 0, how)
        return label + head + held + self.named()

    def pixels(self, width: int, height: int, form: int, data: bytes) -> bytes:
        """What an Image holds: origin, size, formats, packing, bytes, no smaller levels."""
        head = self.pack("i", 0, width, height, 1, form, form, 0x1401, 1, 1)
        return head + self.pack("I", len(data)) + data + self.pack("I", 0)

    def light_source(self, number: int, **given: list[float]) -> bytes:
        """A LightSource with Light 0, a lamp at (1, 2, 3) unless told otherwise."""
        defaults = {
            "ambient": [0.0, 0.0, 0.0, 1.0],
            "diffuse": [1.0, 0.8, 0.5, 1.0],
            "specular": [0.0, 0.0, 0.0, 1.0],
            "position": [1.0, 2.0, 3.0, 1.0],
            "direction": [0.0, 0.0, -1.0],
            "attenuation": [1.0, 0.0, 0.25],
            "spot": [2.0, 60.0],
        }
        own = b"".join(self.pack("f", *given.get(key, value)) for key, value in defaults.items())
        light = self.object(
            "osg::Light", number + 1, self.named("lamp"), bytes(2), self.pack("i", 0), own
        )
        more = b"\1" + light + self.pack("i", 0)
        return self.group(number, label="osg::LightSource", name="source", more=more)

    # -- files ---------------------------------------------------------------------------------

    def file(
        self,
        root: bytes,
        packed: str = "0",
        schema: str | None = None,
        domains: dict[str, int] | None = None,
    ) -> bytes:
        """A whole file."""
        attributes = (4 if self.sizes else 0) | (0 if schema is None else 2) | bool(domains)
        head = self.pack("I", *MAGIC, 1, self.version, attributes)
        if domains:
            head += self.pack("I", len(domains))
            head += b"".join(self.text(name) + self.pack("i", v) for name, v in domains.items())
        body = (b"" if schema is None else self.text(schema)) + root
        if packed == "zlib":
            packer = zlib.compressobj(wbits=zlib.MAX_WBITS | 16)
            body = packer.compress(body) + packer.flush()
        elif packed == "null":
            body = self.pack("I", len(body)) + body
        return head + self.text(packed) + body


def load(folder: Path, data: bytes, limits: Limits | None = None) -> Loaded:
    """Write the bytes as .osgb and read them."""
    path = folder / "scene.osgb"
    path.write_bytes(data)
    report = Report()
    scene = importer.read(Resolver(path, report, limits=limits or Limits()), report)
    return Loaded(scene, report)
