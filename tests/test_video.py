"""Videos: colours through the whole chain, rates, tags, and no half files."""

from __future__ import annotations

import builtins
from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from hdrusd.errors import HdrusdError, ParameterError
from hdrusd.video import VideoWriter, frame_rate

Picture = npt.NDArray[np.uint8]


def patches(colours: npt.ArrayLike, size: int = 16) -> Picture:
    """(size, n size, 3): squares of the colours (n, 3)."""
    row = np.asarray(colours, np.uint8)[None]
    return np.repeat(np.repeat(row, size, axis=0), size, axis=1)


def write(path: Path, pictures: Iterable[Picture], fps: Any = 24) -> None:
    with VideoWriter(path, fps) as video:
        for picture in pictures:
            video.add(picture)


@pytest.fixture
def av() -> Any:
    """PyAV; skips where it is missing."""
    return pytest.importorskip("av", reason="videos need PyAV: pip install 'hdrusd[video]'")


def decode(av: Any, path: Path, form: str) -> list[npt.NDArray[Any]]:
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format=form) for frame in container.decode(video=0)]


def test_greys_come_back_within_two_codes(av: Any, tmp_path: Path) -> None:
    greys = np.arange(0, 256, 5)[:, None].repeat(3, axis=1)
    write(tmp_path / "greys.mp4", [patches(greys)] * 5)
    for frame in decode(av, tmp_path / "greys.mp4", "rgb24"):
        found = frame[8, 8::16].astype(int)  # in the middle of each patch
        # Limited range has 219 steps for 255: half a step is 0.6 codes, twice, and the encoder's.
        assert np.abs(found - greys).max() <= 2


def test_luma_is_that_of_bt709(av: Any, tmp_path: Path) -> None:
    # ITU-R BT.709-6, item 3.2 and 5: Y' = 16 + 219 (0.2126 R' + 0.7152 G' + 0.0722 B').
    colours = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [200, 120, 40], [255, 255, 255]])
    write(tmp_path / "colours.mp4", [patches(colours, 32)])
    (frame,) = decode(av, tmp_path / "colours.mp4", "yuv420p")
    want = 16 + 219 / 255 * (colours @ [0.2126, 0.7152, 0.0722])
    assert np.abs(frame[16, 16 : 32 * 5 : 32] - want).max() <= 1.5  # BT.601 is 26 off


def test_the_file_says_what_its_colours_are(av: Any, tmp_path: Path) -> None:
    from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc

    write(tmp_path / "tags.mp4", [patches([[9, 9, 9]])])
    with av.open(str(tmp_path / "tags.mp4")) as container:
        context = container.streams.video[0].codec_context
        assert context.pix_fmt == "yuv420p"
        assert context.colorspace == Colorspace.ITU709
        assert context.color_range == ColorRange.MPEG
        assert context.color_primaries == ColorPrimaries.BT709
        assert context.color_trc == ColorTrc.IEC61966_2_1


@pytest.mark.parametrize(
    ("fps", "rate"),
    [(24, Fraction(24)), (29.97, Fraction(2997, 100)), ("30000/1001", Fraction(30000, 1001))],
)
def test_frames_come_at_the_rate(av: Any, tmp_path: Path, fps: Any, rate: Fraction) -> None:
    assert frame_rate(fps) == rate
    pictures = [np.full((32, 48, 3), 10 * i, np.uint8) for i in range(7)]
    write(tmp_path / "rate.mp4", pictures, fps)
    with av.open(str(tmp_path / "rate.mp4")) as container:
        stream = container.streams.video[0]
        assert stream.average_rate == rate
        frames = list(container.decode(stream))
        assert [frame.pts * stream.time_base * rate for frame in frames] == list(range(7))
    means = [frame.to_ndarray(format="rgb24").mean() for frame in frames]
    np.testing.assert_allclose(means, [10 * i for i in range(7)], atol=2)


@pytest.mark.parametrize("fps", [0, -24, 1e9, "nan", "24/0", "fast", float("inf")])
def test_a_wrong_rate_is_one_line(fps: Any) -> None:
    with pytest.raises(ParameterError, match="frames a second; want"):
        frame_rate(fps)


@pytest.mark.usefixtures("av")
class TestFiles:
    """What stands in the folder afterwards."""

    def test_an_odd_size_is_refused(self, tmp_path: Path) -> None:
        with pytest.raises(HdrusdError, match="31 x 20 pixels; want even"):
            write(tmp_path / "odd.mp4", [np.zeros((20, 31, 3), np.uint8)])
        assert list(tmp_path.iterdir()) == []

    def test_pictures_of_two_sizes_are_refused(self, tmp_path: Path) -> None:
        pictures = [np.zeros((20, 32, 3), np.uint8), np.zeros((20, 34, 3), np.uint8)]
        with pytest.raises(HdrusdError, match="34 x 20 pixels after 32 x 20; want one size"):
            write(tmp_path / "two.mp4", pictures)
        assert list(tmp_path.iterdir()) == []

    def test_a_name_without_mp4_is_refused(self, tmp_path: Path) -> None:
        with pytest.raises(ParameterError, match=r"ends in \.mp4"):
            VideoWriter(tmp_path / "video.avi", 24)

    @pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
    def test_an_interrupted_video_leaves_the_old_one(
        self, tmp_path: Path, error: type[BaseException]
    ) -> None:
        path = tmp_path / "drive.mp4"
        path.write_bytes(b"the old one")

        def pictures() -> Iterator[Picture]:
            yield from [np.zeros((32, 32, 3), np.uint8)] * 40
            raise error

        with pytest.raises(error):
            write(path, pictures())
        assert [file.name for file in tmp_path.iterdir()] == ["drive.mp4"]
        assert path.read_bytes() == b"the old one"

    def test_without_a_picture_there_is_no_file(self, tmp_path: Path) -> None:
        write(tmp_path / "none.mp4", [])
        assert list(tmp_path.iterdir()) == []

    def test_it_appears_when_it_is_whole(self, tmp_path: Path) -> None:
        path = tmp_path / "new" / "drive.mp4"
        with VideoWriter(path, 24) as video:
            video.add(np.zeros((32, 32, 3), np.uint8))
            assert not path.exists()
        assert [file.name for file in path.parent.iterdir()] == ["drive.mp4"]
        assert video.frames == 1

    def test_a_full_disk_is_one_line(self, tmp_path: Path) -> None:
        full = Path("/dev/full")
        if not full.exists():
            pytest.skip("no /dev/full")
        path = tmp_path / "full.mp4"
        video = VideoWriter(path, 24)
        video._temporary.symlink_to(full)
        noise = np.random.default_rng(1).integers(0, 256, (256, 256, 3), np.uint8)

        def fill() -> None:
            with video:
                for _ in range(3):
                    video.add(noise)

        with pytest.raises(HdrusdError, match=r"full\.mp4: cannot be written"):
            fill()
        assert list(tmp_path.iterdir()) == []


def test_without_pyav_there_is_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def missing(name: str, *rest: Any, **more: Any) -> Any:
        if name == "av" or name.startswith("av."):
            raise ImportError(name)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(HdrusdError, match=r"pip install 'hdrusd\[video\]'"):
        VideoWriter(tmp_path / "drive.mp4", 24)
