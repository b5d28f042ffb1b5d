"""Photographs of a scene of known cd/m2 come back as that scene (hdrusd/bracket/)."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bracketed import STOPS, exif, film, scene, shoot, write_bracket, write_photograph

from hdrusd.bracket.calibration import Calibration, Spot
from hdrusd.bracket.merging import Bracket, merge_bracket
from hdrusd.bracket.photographs import Photograph, oriented
from hdrusd.colour import luminance, srgb_encode
from hdrusd.errors import HdrusdError, InputError, ParameterError
from hdrusd.images import read_exr
from hdrusd.report import Report

LIGHT = scene()


def measured(light: np.ndarray, x: int, y: int, radius: int = 0) -> Spot:
    """A spot with its true luminance."""
    down, right = np.ogrid[: light.shape[0], : light.shape[1]]
    inside = (down - y) ** 2 + (right - x) ** 2 <= radius * radius
    return Spot(x, y, radius, float(luminance(light[inside]).mean()))


def merged(files: list[Path], *, spot: Spot | None = None, **asked: Any) -> tuple[Any, Any, Report]:
    """The picture, what was said of it, and the findings."""
    report = Report()
    asked.setdefault("calibration", Calibration((spot,) if spot else ()))
    output = files[0].parent / "lamp.exr"
    said = merge_bracket(Bracket(tuple(files), output, **asked), report)
    return read_exr(output)[0], said, report


def decades(picture: np.ndarray, light: np.ndarray) -> list[np.ndarray]:
    """Errors in each decade of the scene, all channels together."""
    level = np.floor(np.log10(light * 1.000001)).clip(-1, 3)
    return [(picture / light)[level == k] - 1.0 for k in range(-1, 4)]


@pytest.mark.parametrize("response", ["debevec", "robertson"])
@pytest.mark.parametrize("suffix", [".png", ".jpg"])
def test_five_decades_come_back_within_five_percent(
    tmp_path: Path, response: str, suffix: str
) -> None:
    files = write_bracket(tmp_path, LIGHT, suffix=suffix)
    picture, said, report = merged(files, spot=measured(LIGHT, 100, 60, 4), response=response)
    assert picture.shape == LIGHT.shape
    for off in decades(picture, LIGHT):
        assert len(off) > 1000
        assert abs(np.median(off)) < 0.02
        # Noise and rounding of single pixels, to which JPEG adds its own.
        assert np.mean(np.abs(off) < 0.05) > (0.95 if suffix == ".png" else 0.9)
        assert np.sqrt(np.mean(off**2)) < 0.05
    assert report.codes() <= {"bracket-unheld"}
    assert said["response"]["method"] == response


def test_sixteen_bits_and_tiles_and_a_known_response(tmp_path: Path) -> None:
    files = [
        write_photograph(
            tmp_path / f"{i}.tif",
            shoot(LIGHT, s, response=lambda x: srgb_encode(np.clip(x, 0, 1)), seed=None, top=65535),
            {"tile": 16} if i % 2 else {},
        )
        for i, s in enumerate(STOPS)
    ]
    given = tuple(2.0**STOPS)
    picture, _, report = merged(
        files, spot=measured(LIGHT, 100, 60), response="srgb", exposures=given
    )
    # Half a code of 65535 above 1/256 of the range is 0.2 %, and times sRGB's slope of 2.4.
    assert picture == pytest.approx(LIGHT, rel=0.005)
    assert report.codes() == set()


@pytest.mark.parametrize("radius", [0, 3])
def test_a_spot_has_what_was_measured(tmp_path: Path, radius: int) -> None:
    files = write_bracket(tmp_path, LIGHT, seed=7)
    picture, said, _ = merged(files, spot=Spot(60, 20, radius, 1234.5))
    again = measured(picture.astype(np.float64), 60, 20, radius)
    assert again.luminance == pytest.approx(1234.5, rel=1e-6)
    assert said["calibration"] == f"spot 60,20,{radius} = 1234.5 cd/m2"


def test_spots_that_differ_are_averaged_and_told(tmp_path: Path) -> None:
    files = write_bracket(tmp_path, LIGHT)
    a, b = measured(LIGHT, 60, 20), measured(LIGHT, 140, 60)
    wrong = Spot(b.x, b.y, 0.0, 4.0 * b.luminance)
    right, _, report = merged(files, calibration=Calibration((a, b)))
    assert "bracket-spots" not in report.codes()
    picture, _, report = merged(files, calibration=Calibration((a, wrong)))
    assert "bracket-spots" in report.codes()
    assert np.median(picture / right) == pytest.approx(2.0, rel=1e-5)


def test_candela_and_area_are_the_mean_luminance(tmp_path: Path) -> None:
    files = write_bracket(tmp_path, LIGHT)
    lamp = Calibration(candela=320.0, area=0.04, region=(50, 10, 30, 40))
    picture, said, _ = merged(files, calibration=lamp)
    mean = luminance(picture[10:50, 50:80].astype(np.float64)).mean()
    assert mean == pytest.approx(320.0 / 0.04, rel=1e-5)
    assert said["calibration"] == "320 cd from 0.04 m2 in 50,10,30,40: 8000 cd/m2"


@pytest.mark.parametrize(
    ("stops", "level", "lost"),
    [
        (STOPS, 3000.0, 0),  # all of the lamp is held; a dark column beside it may stay
        (STOPS[3:], 3000.0, 32 * 31),  # saturated in all
        ((-14.0, 0.0), 10.0, 1),  # noise in one, saturated in the other
    ],
)
def test_a_lamp_that_no_exposure_holds_calibrates_nothing(
    tmp_path: Path, stops: Any, level: float, lost: int
) -> None:
    light = np.full((64, 64, 3), 1e-3)
    light[:8] = np.logspace(-0.9, 3.9, 64)[:, None]
    light[16:48, 16:47] = 3000.0
    light[20, 20] = level
    files = write_bracket(tmp_path, light, stops)
    lamp = Calibration(candela=10.0, area=0.01, region=(16, 16, 32, 32))
    if lost:
        text = f"region 16,16,32,32: {lost} of 1024 pixels are saturated"
        with pytest.raises(HdrusdError, match=text):
            merged(files, calibration=lamp, response="srgb")
    else:
        picture, _, _ = merged(files, calibration=lamp, response="srgb")
        assert luminance(picture[16:48, 16:48]).mean() == pytest.approx(1000.0, rel=1e-4)


def test_a_region_that_the_lamp_does_not_fill_is_told(tmp_path: Path) -> None:
    light = np.full((64, 64, 3), 0.3)
    light[16:48, 16:48] = 3000.0
    light[:8] = np.logspace(-0.9, 3.9, 64)[:, None]
    files = write_bracket(tmp_path, light)
    lamp = {"candela": 10.0, "area": 0.01}
    _, _, report = merged(files, calibration=Calibration(**lamp, region=(16, 16, 32, 32)))
    assert "bracket-region" not in report.codes()
    _, _, report = merged(files, calibration=Calibration(**lamp, region=(8, 12, 48, 44)))
    assert "bracket-region" in report.codes()


def test_the_camera_estimates_where_nothing_is_measured(tmp_path: Path) -> None:
    light = np.repeat(LIGHT[..., 1:2], 3, axis=2)
    files = write_bracket(tmp_path, light, suffix=".jpg")
    picture, said, report = merged(files)
    assert "bracket-camera" in report.codes()
    # Code 118 at stop 0: 64 s, f/4, ISO 100; 10/0.65 16 / 6400 cd/m2.
    code = shoot(light, 0.0, seed=None)
    grey = np.abs(code.astype(int) - 118).max(axis=-1) <= 2
    found = np.median(luminance(picture[grey].astype(np.float64)))
    assert found == pytest.approx(10.0 / 0.65 * 16.0 / 6400.0, rel=0.03)
    assert "ISO 12232" in said["calibration"]


def test_exposures_survive_a_jpeg(tmp_path: Path) -> None:
    for stops in STOPS:
        path = write_photograph(tmp_path / "a.jpg", shoot(LIGHT, stops), exif(stops))
        with Photograph(path) as photograph:
            said = photograph.exposure()
        # Exif has rationals, of which OpenImageIO writes six digits or more.
        assert said.time == pytest.approx(64.0 * 2.0**stops, rel=1e-5)
        assert said.aperture == pytest.approx(4.0, rel=1e-6)
        assert said.speed == 100.0


def test_apex_values_stand_in(tmp_path: Path) -> None:
    tags = {"Exif:ShutterSpeedValue": 5.0, "Exif:ApertureValue": 4.0}
    path = write_photograph(tmp_path / "a.jpg", shoot(LIGHT, 0.0), tags)
    with Photograph(path) as photograph:
        said = photograph.exposure()
    assert said.time == pytest.approx(1.0 / 32.0)  # t = 2^-Tv, N = 2^(Av/2)
    assert said.aperture == pytest.approx(4.0)
    assert said.speed is None


def test_the_order_of_files_does_not_matter(tmp_path: Path) -> None:
    files = write_bracket(tmp_path, LIGHT)
    one, _, _ = merged(files)
    other, _, _ = merged(files[::-1])
    assert np.array_equal(one, other)


def test_the_header_says_where_it_is_from(tmp_path: Path) -> None:
    files = write_bracket(tmp_path, LIGHT)
    merged(files, spot=measured(LIGHT, 100, 60))
    header = read_exr(tmp_path / "lamp.exr")[1]
    assert header["whiteLuminance"] == 1.0
    sources = json.loads(header["hdrusd:bracketSources"])
    assert [source["file"] for source in sources] == [file.name for file in files]
    assert sources[0]["exposure"] == pytest.approx(100.0 / 64.0 / 16.0, rel=1e-5)
    assert header["hdrusd:bracketResponse"].startswith("debevec")
    assert header["hdrusd:bracketCalibration"].startswith("spot 100,60")


def test_a_response_is_kept_and_used_again(tmp_path: Path) -> None:
    files = write_bracket(tmp_path, LIGHT)
    kept = tmp_path / "camera.json"
    one, _, _ = merged(files, response_out=kept)
    other, _, _ = merged(files, response=kept)
    assert other == pytest.approx(one, rel=1e-5)


def test_grey_photographs(tmp_path: Path) -> None:
    light = LIGHT[..., :1]
    files = write_bracket(tmp_path, light)
    spot = Spot(100, 60, 0.0, float(light[60, 100, 0]))
    picture, _, _ = merged(files, spot=spot)
    assert np.array_equal(picture[..., 0], picture[..., 2])
    assert np.median(picture / light) == pytest.approx(1.0, abs=0.05)


def test_photographs_stand_upright(tmp_path: Path) -> None:
    """Orientation 6: the first row is the right side of the scene, from top to bottom."""
    turned = np.rot90(LIGHT, 1)  # counterclockwise: the right side becomes the first row
    files = [
        write_photograph(tmp_path / f"{i}.jpg", shoot(turned, s), exif(s) | {"Orientation": 6})
        for i, s in enumerate(STOPS)
    ]
    picture, _, _ = merged(files, spot=measured(LIGHT, 100, 60, 4))
    assert picture.shape == LIGHT.shape
    assert np.median(np.abs(picture / LIGHT - 1.0)) < 0.05


@pytest.mark.parametrize(
    ("orientation", "rows"),
    [
        (1, ["ab", "cd", "ef"]),
        (2, ["ba", "dc", "fe"]),
        (3, ["fe", "dc", "ba"]),
        (4, ["ef", "cd", "ab"]),
        (5, ["ace", "bdf"]),
        (6, ["eca", "fdb"]),
        (7, ["fdb", "eca"]),
        (8, ["bdf", "ace"]),
    ],
)
def test_orientations_of_tiff(orientation: int, rows: list[str]) -> None:
    """TIFF 6.0, tag 274: which sides of the scene the first row and column are."""
    picture = np.array([list("ab"), list("cd"), list("ef")])
    assert ["".join(row) for row in oriented(picture, orientation)] == rows


def test_what_moved_is_told(tmp_path: Path) -> None:
    moved = LIGHT.copy()
    moved[40:70, 80:120] = 30.0
    files = write_bracket(tmp_path, LIGHT)
    for i in (4, 5, 6):
        write_photograph(files[i], shoot(moved, STOPS[i]), exif(STOPS[i]))
    report = merged(files)[2]
    (found,) = [finding for finding in report if finding.code == "bracket-ghost"]
    box = re.search(r"from (\d+),(\d+) to (\d+),(\d+) ", found.text)
    assert box is not None
    # What is as bright as before inside of the patch does not depart.
    assert np.all(np.abs(np.array(box.groups(), int) - [80, 40, 119, 69]) <= 3)


def test_a_camera_that_moved_is_told(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    light = LIGHT * np.kron(rng.choice([0.7, 1.4], (15, 25)), np.ones((8, 8)))[..., None]
    steady = write_bracket(tmp_path, light)
    assert "bracket-ghost" not in merged(steady)[2].codes()
    for i in (1, 4):
        shifted = np.roll(light, 3, axis=1)
        write_photograph(steady[i], shoot(shifted, STOPS[i]), exif(STOPS[i]))
    assert "bracket-ghost" in merged(steady)[2].codes()


def test_a_wrong_exposure_is_told(tmp_path: Path) -> None:
    files = write_bracket(tmp_path, LIGHT)
    exposures = 2.0**STOPS
    exposures[3] *= 1.5
    report = merged(
        files, spot=measured(LIGHT, 100, 60), response="srgb", exposures=tuple(exposures)
    )[2]
    assert "bracket-exposure" in report.codes()


def test_what_no_exposure_holds_is_counted(tmp_path: Path) -> None:
    light = LIGHT.copy()
    light[:10, :10] = 1e8
    light[-10:, -10:] = 0.0
    files = write_bracket(tmp_path, light, seed=None)
    picture, said, report = merged(files, spot=measured(LIGHT, 100, 60, 4))
    texts = [finding.text for finding in report if finding.code == "bracket-unheld"]
    assert any(text.startswith("100 pixels") and "saturated in all" in text for text in texts)
    assert any("noise in all" in text for text in texts)
    assert said["unheld"] >= 200
    # What saturates the shortest exposure: 16384 / 0.2 cd/m2 times film's exposure at code 250.
    bound = 2.0**12 / 0.2 * float(_exposure_at(250.0 / 255.0))
    assert np.median(picture[:10, :10]) == pytest.approx(bound, rel=0.1)
    assert picture[-10:, -10:].max() < 0.03


def _exposure_at(share: float) -> float:
    grid = np.linspace(0.0, 1.0, 100001)
    return float(np.interp(share, film(grid), grid))


def test_a_spot_that_is_clipped_is_one_line(tmp_path: Path) -> None:
    light = LIGHT.copy()
    light[:10, :10] = 1e8
    files = write_bracket(tmp_path, light)
    with pytest.raises(HdrusdError, match="want a spot that some exposure holds"):
        merged(files, spot=Spot(4, 4, 2.0, 1e6))
    with pytest.raises(HdrusdError, match="outside of the picture"):
        merged(files, spot=Spot(199, 4, 2.0, 1e6))


@pytest.mark.parametrize(("kept", "left"), [(0.5, 0), (0.98, 0), (0.5, 2000)])
def test_a_jpeg_that_is_not_whole_is_refused(tmp_path: Path, kept: float, left: int) -> None:
    """Cut short, or with a hole; decoders fill in what is missing."""
    files = write_bracket(tmp_path, LIGHT, suffix=".jpg")
    data = files[3].read_bytes()
    files[3].write_bytes(data[: int(kept * len(data))] + data[len(data) - left :] * bool(left))
    with pytest.raises(InputError, match=r"im3\.jpg: broken image"):
        merged(files)


def test_exposures_without_a_speed_name_what_is_missing(tmp_path: Path) -> None:
    for stop in STOPS:
        tags = exif(stop) | {"Exif:PhotographicSensitivity": 0}
        write_photograph(tmp_path / f"{stop}.png", shoot(LIGHT, stop), tags)
    files = list(tmp_path.iterdir())
    with pytest.raises(HdrusdError, match="no PhotographicSensitivity in any picture: nothing"):
        merged(files)


def test_without_exif_nothing_is_made_up(tmp_path: Path) -> None:
    files = [write_photograph(tmp_path / f"{i}.png", shoot(LIGHT, s)) for i, s in enumerate(STOPS)]
    with pytest.raises(InputError, match=r"no ExposureTime .* \(nor in 6 others\); want --ev"):
        merged(files)
    relative = "exposures are relative, as given: nothing .* want --spot, or --candela and --area"
    with pytest.raises(HdrusdError, match=relative):
        merged(files, exposures=tuple(2.0**STOPS))


def test_an_aperture_that_nobody_states_is_the_same(tmp_path: Path) -> None:
    files = [
        write_photograph(
            tmp_path / f"{i}.jpg", shoot(LIGHT, s), {"ExposureTime": exif(s)["ExposureTime"]}
        )
        for i, s in enumerate(STOPS)
    ]
    _, _, report = merged(files, spot=measured(LIGHT, 100, 60))
    assert "bracket-aperture" in report.codes()
    with pytest.raises(HdrusdError, match="want --spot"):
        merged(files)


@pytest.mark.parametrize(
    ("codes", "line"),
    [
        ([np.zeros((8, 8, 3), np.uint8)] * 3, "want exposures that overlap"),
        ([np.full((8, 8, 3), 255, np.uint8)] * 3, "want exposures that overlap"),
        ([np.full((1, 1, 3), 90, np.uint8)] * 3, "want exposures that overlap"),
        ([np.full((8, 8, 3), 90, np.uint8), np.full((8, 9, 3), 90, np.uint8)], "want 8 x 8"),
        ([np.full((8, 8, 3), 90, np.uint8), np.full((8, 8, 1), 90, np.uint8)], "want 8 x 8 of 3"),
        ([np.full((8, 8, 3), 90, np.uint8)], "want 2 to 64"),
    ],
    ids=["black", "white", "one pixel", "sizes", "channels", "one image"],
)
def test_pictures_that_make_no_bracket_are_one_line(
    tmp_path: Path, codes: list[np.ndarray], line: str
) -> None:
    files = [write_photograph(tmp_path / f"{i}.png", c, exif(2.0 * i)) for i, c in enumerate(codes)]
    with pytest.raises(HdrusdError, match=line):
        merged(files, spot=Spot(0, 0, 0.0, 1.0))
    assert not (tmp_path / "lamp.exr").exists()


def test_black_pictures_and_a_known_response_are_one_line(tmp_path: Path) -> None:
    black = np.zeros((8, 8, 3), np.uint8)
    files = [write_photograph(tmp_path / f"{i}.png", black, exif(2.0 * i)) for i in range(3)]
    with pytest.raises(InputError, match="no pixel is between dark and saturated"):
        merged(files, response="srgb")


def test_pictures_of_one_exposure_are_one_line(tmp_path: Path) -> None:
    files = write_bracket(tmp_path, LIGHT, [0.0, 0.0, 0.0])
    with pytest.raises(InputError, match="of one exposure; want a bracket"):
        merged(files)


@pytest.mark.parametrize("wrong", [float("nan"), float("inf"), 0.0, -1.0, 1e300])
def test_exposures_that_make_no_sense_are_one_line(tmp_path: Path, wrong: float) -> None:
    files = write_bracket(tmp_path, LIGHT, [0.0, 2.0])
    with pytest.raises(InputError, match="want numbers above 0"):
        merged(files, exposures=(1.0, wrong))
    with pytest.raises(InputError, match="3 exposures for 2 pictures"):
        merged(files, exposures=(1.0, 2.0, 4.0))


def test_values_that_are_not_finite_are_one_line(tmp_path: Path) -> None:
    sound = np.tile(np.linspace(0.0, 1.0, 64, dtype=np.float32), (64, 1))[..., None]
    broken = sound.copy()
    broken[3, 3] = np.nan
    files = [
        write_photograph(tmp_path / "a.tif", sound),
        write_photograph(tmp_path / "b.tif", broken),
    ]
    with pytest.raises(InputError, match="not finite"):
        merged(files, exposures=(1.0, 2.0), response="linear", spot=Spot(9, 9, 0.0, 1.0))


def test_files_that_are_no_pictures_are_one_line(tmp_path: Path) -> None:
    files = write_bracket(tmp_path, LIGHT, [0.0, 2.0], suffix=".jpg")
    files[1].write_bytes(b"\xff\xd8\xff\xe0 and no more")
    with pytest.raises(InputError):
        merged(files)
    files[1].unlink()
    with pytest.raises(InputError, match="no such file"):
        merged(files)


@pytest.mark.parametrize("text", ["", "{", "[" * 100000, '{"format": "other"}', "\x00\xff"])
def test_a_response_file_that_is_none_is_one_line(tmp_path: Path, text: str) -> None:
    files = write_bracket(tmp_path, LIGHT, [0.0, 2.0])
    path = tmp_path / "camera.json"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(InputError, match="want"):
        merged(files, response=path)


@pytest.mark.parametrize(
    "numbers",
    [
        {"candela": 1.0},
        {"area": 1.0},
        {"region": (0, 0, 1, 1)},
        {"candela": 0.0, "area": 1.0},
        {"candela": float("nan"), "area": 1.0},
        {"candela": 1.0, "area": -1.0},
        {"constant": 0.0},
        {"spots": (Spot(0, 0, 0.0, 0.0),)},
        {"spots": (Spot(0, 0, -1.0, 1.0),)},
        {"spots": (Spot(0, 0, float("nan"), 1.0),)},
        {"spots": (Spot(0, 0, 0.0, 1.0),), "candela": 1.0, "area": 1.0},
    ],
)
def test_calibrations_that_make_no_sense_are_one_line(numbers: dict[str, Any]) -> None:
    with pytest.raises(ParameterError, match="want"):
        Calibration(**numbers)
