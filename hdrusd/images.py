"""Pictures in and out: textures by OpenImageIO, frames by OpenEXR, in cd/m2.

An EXR that we write holds linear Rec. 709 RGB, float32 (half on request), 1.0 =
1 cd/m2, and says so: ``whiteLuminance`` 1 and ``chromaticities`` (OpenEXR standard
attributes). Files appear under their name only when they are whole.
"""

from __future__ import annotations

import contextlib
import errno
import mmap
import os
import re
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import OpenEXR
import OpenImageIO as oiio

from hdrusd.errors import HdrusdError, InputError, OutputError
from hdrusd.input_file import check_input
from hdrusd.leftovers import clear_files, private_name
from hdrusd.scene import ImageData

#: Rec. 709 primaries and D65, CIE 1931 xy: red, green, blue, white.
REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)

#: A declared size is not believed beyond this many pixels.
MAX_PIXELS = 16384 * 16384

#: Nor beyond this many a byte of the file: no codec packs that tight.
_PIXELS_A_BYTE = 10_000

#: The last chunk's name and checksum (PNG, ISO/IEC 15948, 11.2.5).
_PNG_END = b"IEND\xaeB`\x82"

#: The first bytes of a JPEG, and its next marker with a meaning of its own: neither a stuffed
#: byte of entropy-coded data, a restart nor a fill byte (ITU-T T.81, B.1.1).
_JPEG = b"\xff\xd8\xff"
_JPEG_MARKER = re.compile(rb"\xff[\x02-\xcf\xd9-\xfe]")
_JPEG_SCAN, _JPEG_END = b"\xff\xda", b"\xff\xd9"

#: Segments of a JPEG that are gone through; an ICC profile has up to 255.
_JPEG_SEGMENTS = 65536

#: What libjpeg warns of where it makes texels up, in small letters.
_MADE_UP = ("premature end", "bad huffman code", "instead of rst")

#: libpng's PNG_FILTER_SUB: each byte less that of the pixel to the left.
_PNG_SUB = 16

#: Lossless compressions: zip for every reader; htj2k for small files soon, which readers
#: before OpenEXR 3.4 do not know.
Compression = Literal["zip", "piz", "htj2k", "none"]
_COMPRESSIONS: dict[str, Any] = {
    "zip": OpenEXR.ZIP_COMPRESSION,
    "piz": OpenEXR.PIZ_COMPRESSION,
    "htj2k": OpenEXR.HTJ2K256_COMPRESSION,
    "none": OpenEXR.NO_COMPRESSION,
}

#: Rec. 2020 primaries, PQ, no matrix, full range (ITU-T H.273).
_PQ = (9, 16, 0, 1)

#: What OpenImageIO calls pictures of six sides, which it lays out in one.
_OTHER_LAYOUTS = ("CubeFace Environment", "CubeFace Shadow")

#: Formats in which a channel's name says what it holds; those of others go by their number.
_NAMED_CHANNELS = ("openexr", "dds")

#: The largest finite half float.
HALF_MAX = 65504.0


def read_image(path: Path, data: bytes | None = None) -> ImageData:
    """Decode a texture: (h, w, 1 to 4) uint8, float16 or float32, top row first.

    ``data``: the encoded bytes, when the file lies in a package or another file;
    ``path`` then only names it. 16-bit integers come back as float32 in [0, 1].
    Two channels are grey and alpha, four are colour and alpha: of a file with more, or others,
    what is neither is ``dropped``, and a colour of two has no third. Colours are as the file has
    them, not multiplied by alpha. Raises InputError, also for a JPEG that is not whole.
    """
    found = read_small_image(path, data, MAX_PIXELS)
    assert found is not None  # more pixels are refused
    return found


def read_small_image(path: Path, data: bytes | None, most: int) -> ImageData | None:
    """As ``read_image``; None, with nothing decoded, for a picture of more than ``most`` pixels."""
    if data is None:
        check_input(path)
    with tempfile.TemporaryDirectory() as folder:
        real = path
        if data is not None:  # OpenImageIO's memory reader knows few formats
            real = Path(folder) / Path(path.name.rstrip("]")).name
            real.write_bytes(data)
        return _decode(real, path, most)


def _decode(real: Path, named: Path, most: int) -> ImageData | None:
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    picture = oiio.ImageInput.open(str(real), config)
    if picture is None:
        raise InputError(named, f"not a readable image ({_first_line(oiio.geterror())})")
    try:
        spec = picture.spec()
        check_size(named, spec.width, spec.height, real.stat().st_size)
        if spec.depth > 1 or spec.getattribute("textureformat") in _OTHER_LAYOUTS:
            raise InputError(named, "a cube or a volume of pictures; want one picture")
        if spec.width * spec.height > most:
            return None
        if not jpeg_ends(real):
            raise InputError(named, "broken image (JPEG data without an end); want a whole file")
        channels = _channels(spec, picture.format_name())
        array = _pixels(picture, spec, channels, named)
        dropped = _others([n for i, n in enumerate(spec.channelnames) if i not in channels])
        return ImageData(array, named, integers="int" in str(spec.format), dropped=dropped)
    finally:
        picture.close()


def _pixels(
    picture: oiio.ImageInput, spec: oiio.ImageSpec, channels: list[int | None], named: Path
) -> npt.NDArray[np.generic]:
    """Those channels, (h, w, n); zeros for None. Raises InputError."""
    kind = {"uint8": oiio.UINT8, "half": oiio.HALF}.get(str(spec.format), oiio.FLOAT)

    def read(first: int, count: int) -> npt.NDArray[np.generic]:
        pixels = picture.read_image(0, 0, first, first + count, kind)
        said = picture.geterror()
        if pixels is None or made_up(said):
            why = _first_line(said).partition(' ("')[0]  # libjpeg ends with a name, perhaps ours
            raise InputError(named, f"broken image ({why})")
        array: npt.NDArray[np.generic] = np.asarray(pixels).reshape(spec.height, spec.width, count)
        return array

    if channels == list(range(len(channels))):
        return read(0, len(channels))
    planes = {channel: read(channel, 1) for channel in channels if channel is not None}
    nothing = np.zeros_like(next(iter(planes.values())))
    return np.concatenate([nothing if c is None else planes[c] for c in channels], axis=-1)


def _channels(spec: oiio.ImageSpec, form: str) -> list[int | None]:
    """Which channels are the colour, one or three, and alpha if there is one; None: a black one.

    The colour is that of the first layer.
    """
    names = [name.lower() for name in spec.channelnames]
    layer = names[0].rpartition(".")[0]
    within = {name.removeprefix(f"{layer}."): i for i, name in reversed([*enumerate(names)])}
    alpha: int | None = within.get("a", within.get("alpha"))
    if alpha is None and form not in _NAMED_CHANNELS and 0 <= spec.alpha_channel < len(names):
        alpha = spec.alpha_channel
    if len(names) == 2 and form not in _NAMED_CHANNELS:
        return [0, 1] if form != "tiff" or alpha == 1 else [0]  # OpenImageIO may say R and G
    color: list[int | None] = [within.get(letter) for letter in "rgb"]
    known = sum(channel is not None for channel in color)
    if known < 2:
        apart = alpha, spec.z_channel if "x" not in within else None  # a vector's Z is no depth
        others = [i for i in range(len(names)) if i not in apart] or [0]
        color = [*others[:3]] if len(others) > 2 else [others[0]]
    return color if alpha in (None, *color) else [*color, alpha]


def _others(names: list[str]) -> str:
    """In words, for a finding; nothing for none. What is no text in them comes as surrogates."""
    if not names:
        return ""
    more = f" and {len(names) - 8} more" if len(names) > 8 else ""
    shown = ", ".join(n[:40].encode(errors="replace").decode() for n in names[:8])
    return f"channels {shown}{more}: neither colour nor alpha; not read"


def jpeg_ends(path: Path) -> bool:
    """Whether a file is no JPEG, or one whose scans are ended.

    Decoders fill in what is missing. An end within a segment is that of a thumbnail, and what
    follows the end is another picture or a film.
    """
    with path.open("rb") as file:
        if file.read(len(_JPEG)) != _JPEG:
            return True
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            at, scans = len(_JPEG) - 1, 0
            for _ in range(_JPEG_SEGMENTS):
                found = _JPEG_MARKER.search(data, at)
                if found is None:
                    return False
                if found[0] == _JPEG_END:
                    return scans > 0
                scans += found[0] == _JPEG_SCAN
                at = found.end() + int.from_bytes(data[found.end() : found.end() + 2], "big")
    return False


def made_up(said: str) -> bool:
    """Whether a decoder's words mean that texels are its own invention."""
    return any(words in said.lower() for words in _MADE_UP)


def check_size(named: Path, width: int, height: int, size: int) -> None:
    """Refuse a declared size that is absurd, or more than ``size`` bytes of file can hold."""
    if not (width >= 1 and height >= 1 and width * height <= MAX_PIXELS):
        raise InputError(named, f"{width} x {height} pixels; want 1 to {MAX_PIXELS}")
    if size * _PIXELS_A_BYTE < width * height:
        raise InputError(named, f"{width} x {height} pixels declared, not there")


def _first_line(text: str) -> str:
    return (text.strip().splitlines() or ["unknown format"])[0]


def write_atomically(path: Path, write: Callable[[Path], None]) -> None:
    """Let ``write`` fill a temporary file beside ``path``, then rename it to ``path``.

    The temporary name keeps the suffix, by which libraries choose the format. On
    any failure it is removed and ``path`` stays as it was. Raises OSError, OutputError for
    what a library says, and HdrusdError for a path that is no place for a file.
    """
    path = place_for(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    clear_files(path.parent.absolute())
    temporary = path.with_name(private_name(path.suffix))
    try:
        write(temporary)
        temporary.replace(path)
    except BaseException as problem:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        # Nobody knows the temporary name.
        if isinstance(problem, RuntimeError):
            said = str(problem).replace(str(temporary), path.name)
            raise OutputError(path, _first_line(said)) from None
        if isinstance(problem, OSError) and problem.filename in (None, str(temporary)):
            text = f"cannot be written ({problem.strerror or problem})"
            raise OSError(problem.errno or errno.EIO, text, str(path)) from problem
        raise


def place_for(path: Path) -> Path:
    """Where a file of that name is to be written: where a link leads, and else ``path``.

    Raises HdrusdError for what is there and no file: a rename would put one in the place of a
    device or a pipe.
    """
    if path.is_symlink():
        path = Path(os.path.realpath(path))
    if path.exists() and not path.is_file():
        raise HdrusdError(f"{path}: not a regular file; want a name to write to")
    return path


def write_exr(
    path: Path,
    rgb: npt.NDArray[np.floating[Any]],
    attributes: Mapping[str, Any] | None = None,
    *,
    half: bool = False,
    luminance: bool = True,
    compression: Compression = "zip",
    layers: Mapping[str, npt.NDArray[np.floating[Any]]] | None = None,
    tile: int | None = None,
) -> None:
    """Write linear Rec. 709 RGB or RGBA, (h, w, 3 or 4), top row first.

    ``luminance``: the values are cd/m2 and the header says so; False for
    reflectance maps. ``attributes``: further header entries (str, int, float,
    NumPy arrays of 9 or 16 floats). ``half``: half floats; what is beyond +-65504 is
    written as that (``half_clipped`` counts it), halves as they are. ``compression`` loses
    nothing. ``layers``: channels beside the colour, (h, w), by names as "scotopic.Y"; always
    as float32. ``tile``: in squares of so many pixels, as a texture, instead of scan lines.
    """
    dtype = np.float16 if half else np.float32
    if half and rgb.dtype != np.float16:  # slow in halves, which come from tables
        rgb = np.clip(rgb, -HALF_MAX, HALF_MAX)
    pixels = np.ascontiguousarray(rgb, dtype)
    header: dict[str, Any] = {
        "compression": _COMPRESSIONS[compression],
        "type": OpenEXR.scanlineimage,
        "chromaticities": REC709,
        "software": "hdrusd",
    }
    if tile:
        squares = OpenEXR.TileDescription()
        squares.ySize, squares.xSize = (min(tile, side) for side in pixels.shape[:2])
        header |= {"type": OpenEXR.tiledimage, "tiles": squares}
    if luminance:
        header["whiteLuminance"] = 1.0
    header.update(attributes or {})
    channels = {"RGBA" if pixels.shape[2] == 4 else "RGB": pixels}
    for name, values in (layers or {}).items():
        channels[name] = np.ascontiguousarray(values, np.float32)

    def write(temporary: Path) -> None:
        with OpenEXR.File(header, channels) as file:
            file.write(str(temporary))

    write_atomically(path, write)


def half_clipped(rgb: npt.NDArray[np.floating[Any]]) -> int:
    """How many pixels have a value that a half float cannot hold."""
    return int(np.count_nonzero(np.any(np.abs(rgb) > HALF_MAX, axis=-1)))


def read_exr(path: Path) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
    """RGB as (h, w, 3) float32 and the header; grey is spread over three channels.

    Values are multiplied by ``whiteLuminance`` where a file has another than 1,
    so that 1.0 is 1 cd/m2. The first part of a file is read, its data window.
    Raises InputError.
    """
    rgb, header, _ = read_exr_layers(path)
    return rgb, header


def read_exr_layers(
    path: Path,
) -> tuple[npt.NDArray[np.float32], dict[str, Any], dict[str, npt.NDArray[np.float32]]]:
    """As ``read_exr``, and the channels in layers ("scotopic.Y"), (h, w) float32 by name.

    They are multiplied by ``whiteLuminance`` too. One of another size than the picture is not
    given. Raises InputError.
    """
    check_input(path)
    try:
        with OpenEXR.File(str(path), header_only=True) as file:
            low, high = (np.asarray(v, np.int64) for v in file.header()["dataWindow"])
        width, height = (int(v) for v in high - low + 1)
        check_size(path, width, height, path.stat().st_size)
        with OpenEXR.File(str(path), separate_channels=True) as file:
            header = dict(file.header())
            channels = {name: np.asarray(c.pixels) for name, c in file.channels().items()}
    except (RuntimeError, ValueError, TypeError, KeyError) as problem:
        raise InputError(path, f"not a readable EXR ({_first_line(str(problem))})") from problem
    names = [n for n in ("R", "G", "B") if n in channels] or [n for n in ("Y",) if n in channels]
    if len(names) not in (1, 3):
        raise InputError(path, f"channels {', '.join(sorted(channels))}; want R, G, B or Y")
    if any(channels[name].shape != (height, width) for name in names):
        raise InputError(path, "channels of different sizes; want whole ones")
    planes = [channels[names[i % len(names)]].astype(np.float32, copy=False) for i in range(3)]
    rgb = np.stack(planes, axis=-1)
    white: Any = header.get("whiteLuminance", 1.0)
    if not isinstance(white, (int, float)) or not 0.0 < white < np.inf:
        raise InputError(path, f"whiteLuminance {white!s:.40}; want a positive number")
    layers = {
        name: channel.astype(np.float32)
        for name, channel in channels.items()
        if "." in name and channel.shape == (height, width)
    }
    if white != 1.0:
        rgb = (rgb * white).astype(np.float32)
        layers = {name: (layer * white).astype(np.float32) for name, layer in layers.items()}
    return rgb, header, layers


def read_exr_header(path: Path) -> dict[str, Any]:
    """What an EXR says of itself, without its pixels. Raises InputError."""
    check_input(path)
    try:
        with OpenEXR.File(str(path), header_only=True) as file:
            return dict(file.header())
    except (RuntimeError, ValueError, TypeError, KeyError) as problem:
        raise InputError(path, f"not a readable EXR ({_first_line(str(problem))})") from problem


def read_png_text(path: Path, name: str) -> str | None:
    """The text ``name`` of a PNG; None where it has none, and for what is no picture."""
    source = oiio.ImageInput.open(str(path))
    if source is None:
        oiio.geterror()  # else it is the next one's
        return None
    said = source.spec().get_string_attribute(name)
    source.close()
    return str(said) or None


def write_png(
    path: Path,
    pixels: npt.NDArray[Any],
    comment: str = "",
    *,
    pq: bool = False,
    texts: Mapping[str, str] | None = None,
) -> None:
    """Write code values, (h, w, 1 to 4) uint8 or uint16, top row first, alpha apart.

    sRGB, or with ``pq`` Rec. 2020 by SMPTE ST 2084, which the chunk cICP then says. ``texts``
    by name, as ``read_png_text`` finds them.
    """
    h, w, channels = pixels.shape

    def write(temporary: Path) -> None:
        spec = oiio.ImageSpec(
            w, h, channels, oiio.UINT16 if pixels.dtype == np.uint16 else oiio.UINT8
        )
        if pq:
            spec.attribute("CICP", "int[4]", _PQ)
        else:
            spec.attribute("oiio:ColorSpace", "sRGB")
        spec.attribute("oiio:UnassociatedAlpha", 1)  # else colours are divided by alpha
        # One filter for all rows: libpng tries all on each row, for 7 % less and 1.6 times as long.
        spec.attribute("png:filter", _PNG_SUB)
        spec.attribute("png:compressionLevel", 4)
        if comment:
            spec.attribute("ImageDescription", comment)
        for name, text in (texts or {}).items():
            spec.attribute(name, text)
        out = oiio.ImageOutput.create(str(temporary))
        if out is None or not out.open(str(temporary), spec):
            raise RuntimeError(out.geterror() if out else oiio.geterror())
        whole = out.write_image(np.ascontiguousarray(pixels))
        if not out.close() or not whole:
            raise RuntimeError(out.geterror())
        # OpenImageIO 3.2 says nothing when the disk is full.
        if not temporary.read_bytes().endswith(_PNG_END):
            raise RuntimeError("it is not whole; is the disk full?")

    write_atomically(path, write)
