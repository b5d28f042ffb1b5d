"""Pictures become a video: H.264 in an MP4, by PyAV, which is the extra "video".

8-bit sRGB is stored as Y'CbCr with the matrix of ITU-R BT.709, in limited range, colours at half
the size (yuv420p), which every player knows; and the file says so: primaries BT.709, transfer
IEC 61966-2-1.
"""

from __future__ import annotations

import contextlib
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.errors import HdrusdError, OutputError, ParameterError
from hdrusd.images import place_for
from hdrusd.leftovers import clear_files, private_name

#: H.264 comes first; what is in the wheels of PyAV depends on the platform.
_CODECS = ("libx264", "libopenh264", "mpeg4")

#: Hard to tell from the pictures; night scenes show bands where there are fewer bits.
_QUALITY = {"libx264": {"crf": "14", "preset": "medium"}, "mpeg4": {"qscale": "2"}}

#: Of an MP4: the index in front, so that a player starts before it has the whole file.
_CONTAINER = {"movflags": "+faststart"}

_SLOWEST, _FASTEST = Fraction(1, 100), Fraction(1000)


def check_video() -> None:
    """Raise HdrusdError where PyAV is missing, before an hour's work rather than after."""
    try:
        import av  # noqa: F401
    except ImportError:
        raise HdrusdError(
            "video: PyAV is not installed; want pip install 'hdrusd[video]'"
        ) from None


def frame_rate(fps: float | str | Fraction) -> Fraction:
    """Frames a second as a ratio: 24, 29.97, "30000/1001". Raises ParameterError."""
    try:
        # As text 29.97 is 2997/100, not the double next to it.
        rate = Fraction(str(fps)).limit_denominator(100_000)
    except (ValueError, ZeroDivisionError):
        rate = Fraction(0)
    if not _SLOWEST <= rate <= _FASTEST:
        raise ParameterError(f"video: {fps!s:.40} frames a second; want 0.01 to 1000")
    return rate


class VideoWriter:
    """Writes pictures of one size into ``path`` (.mp4), each shown for 1 / ``fps`` seconds.

    To be used in a ``with`` block: the file appears under its name when the block is left,
    whole; when it is left by an exception (Ctrl-C), or without a picture, none does and what was
    there stays. Raises HdrusdError, OSError.
    """

    def __init__(self, path: Path, fps: float | str | Fraction) -> None:
        check_video()
        if path.suffix.lower() != ".mp4":
            raise ParameterError(f"video: {path.name}: want a name that ends in .mp4")
        self.path = path = place_for(path)
        self.rate = frame_rate(fps)
        self.frames = 0
        self._size: tuple[int, int] | None = None
        self._temporary = path.with_name(private_name(".mp4"))
        self._container: Any = None
        self._stream: Any = None

    def __enter__(self) -> VideoWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        whole = False
        try:
            if error is None and self._container is not None:
                self._encode(None)
                self._close()
                self._temporary.replace(self.path)
                whole = True
        finally:
            if not whole:
                with contextlib.suppress(Exception):  # there is a failure already, or no file
                    self._close()
                self._temporary.unlink(missing_ok=True)

    def add(self, picture: npt.NDArray[np.uint8]) -> None:
        """The next picture, (h, w, 3) sRGB, top row first; both sides even, as yuv420p needs it.

        Raises HdrusdError.
        """
        height, width = picture.shape[:2]
        if self._size is None:
            if height % 2 or width % 2:
                raise HdrusdError(
                    f"{self.path.name}: {width} x {height} pixels; want even numbers for a video"
                )
            self._size = height, width
            self._open(width, height)
        if (height, width) != self._size:
            was = f"{self._size[1]} x {self._size[0]}"
            raise HdrusdError(
                f"{self.path.name}: {width} x {height} pixels after {was}; want one size"
            )
        self._encode(picture)
        self.frames += 1

    def _open(self, width: int, height: int) -> None:
        import av
        from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc

        codec = next((name for name in _CODECS if name in av.codecs_available), None)
        if codec is None:
            raise HdrusdError(f"video: PyAV has no encoder; want one of {', '.join(_CODECS)}")
        self.path.parent.mkdir(parents=True, exist_ok=True)
        clear_files(self.path.parent.absolute())
        with self._told():
            self._container = av.open(str(self._temporary), "w", options=_CONTAINER)
            options = _QUALITY.get(codec, {})
            self._stream = self._container.add_stream(codec, rate=self.rate, options=options)
        self._stream.width, self._stream.height = width, height
        self._stream.pix_fmt = "yuv420p"
        context = self._stream.codec_context
        context.colorspace = Colorspace.ITU709
        context.color_range = ColorRange.MPEG
        context.color_primaries = ColorPrimaries.BT709
        context.color_trc = ColorTrc.IEC61966_2_1

    def _encode(self, picture: npt.NDArray[np.uint8] | None) -> None:
        """One picture, or None: what the encoder still holds."""
        frame = None
        if picture is not None:
            import av
            from av.video.reformatter import ColorRange, Colorspace

            rgb = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
            frame = rgb.reformat(
                format="yuv420p",
                src_colorspace=Colorspace.ITU709,
                dst_colorspace=Colorspace.ITU709,
                src_color_range=ColorRange.JPEG,
                dst_color_range=ColorRange.MPEG,
            )
            frame.pts = self.frames
            frame.time_base = 1 / self.rate
        with self._told():
            for packet in self._stream.encode(frame):
                self._container.mux(packet)

    def _close(self) -> None:
        container, self._container = self._container, None
        if container is not None:
            with self._told():
                container.close()

    @contextlib.contextmanager
    def _told(self) -> Any:
        """What FFmpeg says, as one line."""
        import av

        try:
            yield
        except av.FFmpegError as problem:
            text = problem.strerror or "FFmpeg"
            raise OutputError(self.path, text) from None
