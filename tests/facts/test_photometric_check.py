"""Each deviation of a photometric file is a finding at its line."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from photometric_files import IES, LDT, QUADRANT, ies_text, ldt_text
from test_photometric_conversion import STATED
from test_photometric_hostile import SEEDS, WORDS

from hdrusd.errors import InputError
from hdrusd.photometry.data_sheet import data_sheet
from hdrusd.photometry.examine import Examined, examine
from hdrusd.report import Report


def look(text: str, place: object = IES) -> tuple[Examined, set[str]]:
    """A file examined, and its findings as "code:line"."""
    report = Report()
    found = examine(text.encode("latin-1"), place, report)  # type: ignore[arg-type]
    return found, {f"{finding.code}:{finding.source.place}" for finding in report}


def good(candela: object = QUADRANT, **changes: object) -> str:
    return ies_text(candela, **{"keywords": STATED, **changes})  # type: ignore[arg-type]


def sound() -> list[str]:
    """Lines of a EULUMDAT file without any deviation."""
    lines = ldt_text(lumens=(2000.0,)).split("\r\n")
    lines[1], lines[22] = "3", "112.73"
    return lines


def test_sound_files_have_no_findings() -> None:
    assert look(good())[1] == set()
    assert look("\r\n".join(sound()), LDT)[1] == set()


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (good(keywords=STATED.replace("[MANUFAC] we", "[OWN] x")), "photometric-header:5"),
        (good(keywords=f"{STATED}\nnot a keyword"), "photometric-header:6"),
        (good(keywords=STATED.replace("[TEST] 1\n", "")), "photometric-header:5"),
        (good(keywords=f"{STATED}\n[OTHER] {'x' * 300}"), "photometric-header:6"),
        (good(keywords=f"{STATED}\n[_] x"), "photometric-header:6"),
        (good(label="IESNA: LM-63-2002"), "photometric-header:1"),
        (good(label="\n\nIESNA: LM-63-2002"), "photometric-header:3"),
        (good(label="\nIESNA:LM-63-2002"), "photometric-header:1"),
        (good(label="IES:LM-63-2031", photometric=1.0), "profile-edition:1"),
        (good(label=""), "profile-edition:1"),
        (good(lumens=-2.0), "photometric-number:7"),
        (good(lumens=0.0), "photometric-number:7"),
        (good().replace("\n1 -1 1 ", "\n0.5 -1 1 "), "photometric-number:7"),
        (good().replace("1 1 100", "1 1 0"), "photometric-number:8"),
        (good(photometric=0.9), "photometric-number:8"),
        (good(label="IES:LM-63-2019", photometric=0.9), "photometric-number:8"),
        (good(size=(-1, 2, 3)), "photometric-opening:7"),
        (good(angles=(1, 22.5, 45, 67.5, 90)), "photometric-angles:9"),
        (good(angles=(0, 22.5, 45, 67.5, 80)), "photometric-angles:9"),
        (good([[1, 2]] * 3, planes=(0, 120, 240), angles=(0, 90)), "photometric-angles:10"),
        (good(lumens=1000.0), "photometric-flux:7"),
        (good([[1, 2], [3, 2]], planes=(0, 90), angles=(0, 90)), "photometric-pole:11"),
        (good([[1, 2], [1, 1]], planes=(0, 360), angles=(0, 90)), "photometric-symmetry:10"),
        (good(np.subtract(QUADRANT, 7)), "profile-negative:13"),
        (good() + "9", "profile-trailing:14"),
        (good(tilt="TILT=gone.tlt"), "profile-tilt:6"),
        (good([[1, 1]] * 4, planes=(45, 135, 225, 315), angles=(0, 90)), "photometric-angles:10"),
    ],
)
def test_deviations_of_lm_63(text: str, found: str) -> None:
    assert found in look(text)[1]


@pytest.mark.parametrize(
    ("line", "value", "found"),
    [
        (1, "", "photometric-header:1"),
        (2, "x", "photometric-number:2"),
        (2, "7", "photometric-number:2"),
        (2, "1", "photometric-symmetry:2"),
        (5, "30", "photometric-angles:5"),
        (7, "10", "photometric-angles:7"),
        (9, "n" * 79, "photometric-header:9"),
        (13, "wide", "photometric-number:13"),
        (14, "-20", "photometric-opening:14"),
        (22, "60", "photometric-flux:22"),
        (23, "80", "photometric-flux:23"),
        (24, "1.1", "photometric-factor:24"),
        (25, "15", "photometric-factor:25"),
        (27, "0", "photometric-number:27"),
        (32, "-3", "photometric-number:32"),
        (33, "2", "photometric-number:33"),
        (51, "3", "photometric-angles:51"),
    ],
)
def test_deviations_of_eulumdat(line: int, value: str, found: str) -> None:
    lines = sound()
    lines[line - 1] = value
    assert found in look("\r\n".join(lines), LDT)[1]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (good(angles=(0, 45, 22.5, 60, 90)), 9),
        (good(planes=(0, 60, 30)), 10),
        (good(angles=(0, 45, 90, 135, 190)), 9),
        (good().replace("380", "abc"), 11),
        (good().replace("380", "nan"), 11),
        (good()[:-4], 13),
        (good().replace(" 5 3 1 2", " 5 4 1 2"), 13),
        (good(tilt="TILT=INCLUDE\n1\n2\n90 0\n1 1"), 9),
        (good(type="C").replace(" 5 3 1 2", " 5 3 4 2"), 7),
    ],
)
def test_what_cannot_be_used_is_one_line_with_its_number(text: str, line: int) -> None:
    with pytest.raises(InputError) as problem:
        look(text)
    assert str(problem.value).startswith(f"lamp.ies:{line}: ")


def test_findings_before_an_error_are_kept() -> None:
    report = Report()
    with pytest.raises(InputError):
        examine(ies_text(angles=(0, 45, 22.5, 60, 90)).encode(), IES, report)
    assert report.codes() == {"photometric-header"}


def test_a_data_sheet() -> None:
    sheet = data_sheet(look(good(lumens=2000.0, size=(0.5, 1.0, 0)))[0])
    assert (sheet["format"], sheet["version"], sheet["type"]) == ("IES LM-63", "2002", "C")
    assert sheet["symmetry_stated"] == sheet["symmetry_found"] == "C 0-180 and C 90-270"
    assert sheet["planes"] == {"count": 3, "from_deg": 0.0, "to_deg": 90.0}
    assert (sheet["peak_cd"], sheet["peak_at_deg"]) == (400.0, [0.0, 0.0])
    assert sheet["flux_lm"] == pytest.approx(1127.30, abs=0.005)
    assert sum(sheet["zonal_flux_lm"]) == pytest.approx(sheet["flux_lm"], rel=1e-6)
    assert sheet["light_output_ratio"] == pytest.approx(1127.3027 / 2000.0, rel=1e-5)
    assert sheet["efficacy_lm_w"] == pytest.approx(11.273027, rel=1e-5)
    assert (sheet["opening"], sheet["opening_m"]) == ("rectangle", [1.0, 0.5, 0.0])
    assert sheet["nadir_luminance_cd_m2"] == 800.0
    # C 0-180: 300 cd at 45 and 150 at 67.5 degrees; half of 400 is at 45 + 22.5 x 2 / 3.
    assert sheet["beam_deg"]["C 0-180"] == pytest.approx(120.0)
    # C 90-270: 220 cd at 45 and 90 at 67.5.
    assert sheet["beam_deg"]["C 90-270"] == pytest.approx(2 * (45.0 + 22.5 * 20.0 / 130.0))
    turned = data_sheet(look("\r\n".join(sound()), LDT)[0])
    assert (turned["format"], turned["lamp_flux_lm"]) == ("EULUMDAT", 2000.0)
    assert turned["flux_lm"] == pytest.approx(2 * sheet["flux_lm"], rel=1e-6)
    assert (turned["opening"], turned["opening_m"]) == ("rectangle", [0.25, 0.5, 0.04])


@pytest.mark.parametrize(
    ("size", "shape"),
    [
        ((0, 0, 0), "point"),
        ((1, 2, 3), "box"),
        ((-1, -1, 0), "circle"),
        ((-1, -2, 0), "ellipse"),
        ((-1, -1, -1), "sphere"),
        ((-1, 2, -1), "horizontal cylinder along C 0"),
        ((2, -1, -1), "horizontal cylinder along C 90"),
        ((-1, 0, 0), "circle"),
    ],
)
def test_shape_of_the_opening(size: tuple[float, ...], shape: str) -> None:
    assert data_sheet(look(good(size=size))[0])["opening"] == shape


def survives(data: bytes) -> None:
    """Only InputError, and a data sheet of plain numbers."""
    for place in (IES, LDT):
        try:
            sheet = data_sheet(examine(data, place, Report()))
        except InputError:
            continue
        assert np.isfinite([sheet["flux_lm"], sheet["peak_cd"], *sheet["zonal_flux_lm"]]).all()
        for angle in (*sheet["beam_deg"].values(), *sheet["field_deg"].values()):
            assert angle is None or 0.0 <= angle <= 360.0


@given(st.binary(max_size=300))
def test_any_bytes(data: bytes) -> None:
    survives(data)
    survives(b"TILT=NONE\n" + data)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("word", [b"1e-308", b"1e308"])
def test_each_word_replaced(seed: bytes, word: bytes) -> None:
    """By numbers whose quotients and products leave all that there are."""
    breaks = b"\r\n" if b"\r\n" in seed else b" "
    parts = seed.replace(b"\n", b" \n ").split(b" ") if breaks == b" " else seed.split(breaks)
    for index in range(min(len(parts), 60)):
        survives(breaks.join([*parts[:index], word, *parts[index + 1 :]]))


@settings(max_examples=60)
@given(
    st.sampled_from(SEEDS),
    st.lists(st.tuples(st.integers(0, 100), st.sampled_from(WORDS)), max_size=4),
)
def test_words_replaced(seed: bytes, changes: list[tuple[int, bytes]]) -> None:
    breaks = b"\r\n" if b"\r\n" in seed else b" "
    parts = seed.replace(b"\n", b" \n ").split(b" ") if breaks == b" " else seed.split(breaks)
    for index, word in changes:
        parts[index % len(parts)] = word
    survives(breaks.join(parts))


HOSTILE: list[Callable[[], bytes]] = [
    lambda: b"IESNA:LM-63-2002\n" + b"x\n" * 1_000_000 + b"TILT=NONE\n" + b"1 " * 100,
    lambda: b"IESNA:LM-63-2002\nTILT=NONE\n1 1 1 4096 512 1 1 0 0 0 1 1 1\n" + b"-5\n" * 2_200_000,
    lambda: good().encode() + b" 1" * (4 << 20),
    lambda: b"1\n" * (7 << 20),
]


@pytest.mark.parametrize("make", HOSTILE)
def test_large_files_end_soon(make: Callable[[], bytes]) -> None:
    data = make()
    start = time.perf_counter()
    survives(data)
    assert time.perf_counter() - start < 60.0
