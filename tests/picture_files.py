"""Picture files made byte by byte, so that what is in them is known without a library."""

from __future__ import annotations

import struct
import zlib

#: S3TC (OpenGL EXT_texture_compression_s3tc): red and blue as 5-6-5 bits, the larger first, so
#: that codes 2 and 3 are 2/3 and 1/3 of the way; the first row has codes 0 1 2 3, the others 0.
BLOCK = struct.pack("<HHI", 0xF800, 0x001F, 0b11100100)

#: The first row of it: thirds of 255.
BLOCK_ROW = [(255, 0, 0), (0, 0, 255), (170, 0, 85), (85, 0, 170)]

#: The same colours, the smaller first: code 2 is the middle, code 3 is black and clear.
CLEAR_BLOCK = struct.pack("<HHI", 0x001F, 0xF800, 0b11100100)


def dds(
    size: tuple[int, int],
    data: bytes,
    *,
    letters: bytes = b"",
    masks: tuple[int, int, int, int, int] = (0, 0, 0, 0, 0),
    levels: int = 0,
    depth: int = 0,
    sides: int = 0,
) -> bytes:
    """Microsoft's DDS: four letters of a compression, or bits a pixel and masks r, g, b, a."""
    flags = 0x1007 | (0x20000 if levels else 0) | (0x800000 if depth else 0)
    head = struct.pack("<7I44x", 124, flags, size[1], size[0], len(data), depth, levels)
    if letters:
        layout = struct.pack("<2I4s20x", 32, 0x4, letters)
    else:
        layout = struct.pack("<8I", 32, 0x41 if masks[4] else 0x40, 0, *masks)
    more = 0x1000 | (0x8 if levels or depth or sides else 0) | (0x400000 if levels else 0)
    return b"DDS " + head + layout + struct.pack("<5I", more, sides, 0, 0, 0) + data


def sgi(size: tuple[int, int], planes: list[bytes], *, packed: bool = False) -> bytes:
    """SGI's image file: a plane a channel, the bottom row first; rows packed by runs."""
    width, height = size
    layout = 474, int(packed), 1, 3 if len(planes) > 1 else 2, width, height, len(planes), 0, 255
    head = struct.pack(">HBBHHHHII", *layout).ljust(512, b"\0")
    if not packed:
        return head + b"".join(planes)
    rows = [plane[i * width : (i + 1) * width] for plane in planes for i in range(height)]
    coded = [bytes([0x80 | width, *row, 0]) for row in rows]  # one run of different bytes
    at, starts = 512 + 8 * len(rows), []
    for row in coded:
        starts.append(at)
        at += len(row)
    table = struct.pack(f">{2 * len(rows)}I", *starts, *map(len, coded))
    return head + table + b"".join(coded)


def tga(
    size: tuple[int, int],
    data: bytes,
    *,
    kind: int = 2,
    bits: int = 24,
    flags: int = 0,
    palette: bytes = b"",
) -> bytes:
    """Truevision's TGA: blue first, the bottom row first unless flag 0x20; kind 10 is packed."""
    entries = len(palette) // 3
    head = struct.pack("<3BHHB", 0, bool(palette), kind, 0, entries, 24 if palette else 0)
    return head + struct.pack("<4H2B", 0, 0, *size, bits, flags) + palette + data


def bmp(size: tuple[int, int], data: bytes, *, bits: int = 24, palette: bytes = b"") -> bytes:
    """Windows' BMP: blue first, rows of whole words, the bottom one first unless height < 0."""
    start = 54 + len(palette)
    head = b"BM" + struct.pack("<IHHI", start + len(data), 0, 0, start)
    info = 40, *size, 1, bits, 0, len(data), 0, 0, len(palette) // 4, 0
    return head + struct.pack("<IiiHHIIiiII", *info) + palette + data


def png(
    size: tuple[int, int], rows: bytes, *, bits: int = 8, kind: int = 2, more: bytes = b""
) -> bytes:
    """PNG (ISO/IEC 15948): rows each with a filter byte; ``more``: chunks before them."""
    head = png_chunk(b"IHDR", struct.pack(">IIBBBBB", *size, bits, kind, 0, 0, 0))
    end = png_chunk(b"IDAT", zlib.compress(rows)) + png_chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + head + more + end


def png_chunk(name: bytes, data: bytes) -> bytes:
    """A chunk with its checksum."""
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def tiff(size: tuple[int, int], data: bytes, *, channels: int = 3, bits: int = 8) -> bytes:
    """TIFF 6.0, little endian, one strip, top row first; a fourth channel is alpha apart."""
    extra = [(338, 3, 1, 2)] if channels == 4 else []
    depth = 8 + 12 * (8 + len(extra)) + 6
    entries = [
        (256, 4, 1, size[0]), (257, 4, 1, size[1]), (258, 3, channels, depth),
        (262, 3, 1, 2), (273, 4, 1, depth + 2 * channels), (277, 3, 1, channels),
        (278, 4, 1, size[1]), (279, 4, 1, len(data)), *extra,
    ]  # fmt: skip
    table = b"".join(struct.pack("<HHII", *entry) for entry in entries)
    head = b"II*\0" + struct.pack("<IH", 8, len(entries)) + table + bytes(4)
    return head + struct.pack(f"<{channels}H", *[bits] * channels) + data
