"""Observers and screens: by name, in the user's words, from files, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from hdrusd.errors import HdrusdError, InputError, ParameterError, UnknownNameError
from hdrusd.eye.observer import Observer
from hdrusd.eye.screen import Screen

KINDS = [Observer, Screen]


def test_the_first_names_are_the_defaults() -> None:
    assert Observer.parse("standard") == Observer()
    assert Screen.parse("desktop") == Screen()


@pytest.mark.parametrize("kind", KINDS)
def test_every_profile_is_whole_and_has_a_title(kind: Any) -> None:
    for name, keys in kind.profiles().items():
        assert keys["title"]
        kind.parse(name)


def test_words_go_over_a_profile() -> None:
    assert Observer.parse("elderly") == Observer(age=70)
    assert Observer.parse("elderly,pigment=1.2") == Observer(age=70, pigment=1.2)
    assert Observer.parse("age=70, pigment=0.25") == Observer(age=70, pigment=0.25)
    assert Observer.parse("pupil=moon-spencer").pupil == "moon-spencer"
    assert Observer.parse("age=20,age=30").age == 30
    assert Screen.parse("hdr,peak=600").peak == 600
    assert Screen.parse("hdr,peak=600").eotf == "pq"


def test_the_reference_monitor_has_a_flare_of_a_hundredth() -> None:
    # IEC 61966-2-1: 80 cd/m2, 64 lx, encoding viewing flare 1.0 %.
    screen = Screen.parse("srgb")
    assert (screen.peak, screen.ambient) == (80, 64)
    assert screen.reflected / screen.peak == pytest.approx(0.01, rel=0.02)
    assert screen.white_level == screen.peak + screen.reflected
    assert screen.black_level == screen.black + screen.reflected


def test_the_hdr_monitor_is_that_of_bt2100() -> None:
    screen = Screen.parse("hdr")
    assert screen.peak >= 1000
    assert screen.black_level <= 0.005


def test_the_headset_fills_the_field() -> None:
    field = Screen.parse("headset").field
    assert field is not None
    assert 90 <= field <= 100


def test_a_file_of_ones_own(tmp_path: Path) -> None:
    (tmp_path / "anna.toml").write_text('title = "Anna"\nage = 61\npigment = 1.0\n')
    anna = str(tmp_path / "anna.toml")
    assert Observer.parse(anna) == Observer(age=61, pigment=1.0)
    assert Observer.parse(f"{anna},age=62").age == 62
    (tmp_path / "lab.TOML").write_text("peak = 350\nblack = 0.35\nambient = 20\n")
    screen = Screen.parse(str(tmp_path / "lab.TOML"))
    assert (screen.peak, screen.black, screen.ambient) == (350, 0.35, 20)


@pytest.mark.parametrize(
    ("kind", "text", "error", "words"),
    [
        (Observer, "eldery", UnknownNameError, "did you mean elderly?"),
        (Observer, "", UnknownNameError, "known: blue-eyed, elderly"),
        (Observer, "agee=70", UnknownNameError, "did you mean age?"),
        (Observer, "age=old", ParameterError, "observer: age: old; want 10 to 100"),
        (Observer, "age=nan", ParameterError, "age: nan; want"),
        (Observer, "age=inf", ParameterError, "age: inf; want"),
        (Observer, "age=200", ParameterError, "age: 200; want"),
        (Observer, "age=", ParameterError, "age: ; want"),
        (Observer, "standard,70", ParameterError, "'70'; want KEY=VALUE"),
        (Observer, "standard,", ParameterError, "want KEY=VALUE"),
        (Observer, "pupil=cat", UnknownNameError, "observer: pupil: cat: unknown"),
        (Observer, "nobody.toml", InputError, "nobody.toml: no such file"),
        (Screen, "oled", UnknownNameError, "screen: oled: unknown"),
        (Screen, "peak=0", ParameterError, "screen: peak: 0; want"),
        (Screen, "peak=50,black=50", ParameterError, "black: 50 cd/m2; want less than the peak"),
        (Screen, "name=mine", UnknownNameError, "screen: key: name: unknown"),
        (Screen, "eotf=linear", UnknownNameError, "eotf: linear: unknown"),
        (Screen, "field=360", ParameterError, "field: 360; want 0.1 to 179"),
    ],
)
def test_one_line_for_what_is_wrong(
    kind: Any, text: str, error: type[HdrusdError], words: str
) -> None:
    with pytest.raises(error) as caught:
        kind.parse(text)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("values", [{"age": 300.0}, {"pigment": float("nan")}, {"age": True}])
def test_no_observer_is_made_of_what_no_eye_has(values: dict[str, Any]) -> None:
    with pytest.raises(ParameterError):
        Observer(**values)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"age = [70]", "observer: age: [70]; want 10 to 100"),
        (b"age = true", "age: True; want"),
        (b"age = 0x" + b"f" * 10_000, "not TOML"),
        (b"age = " + b"9" * 400, "age: 9999"),
        (b"age = " + b"9" * 40_000, "not TOML"),
        (b"[elderly]\nage = 70", "observer: key: elderly: unknown"),
        (b"age = " + b"[" * 30_000, "not TOML"),
        (b"age = " + b"{a=" * 10_000, "not TOML"),
        (b"pupil = 3", "observer: pupil: 3: unknown"),
        (b"pupil = []", "observer: pupil: []: unknown"),
        (b"age 70", "not TOML"),
        (b"\xff\xfe\x00", "not TOML"),
        (b"#" * 70_000, "more than 65536 bytes"),
        (b'"age\\u001b[31m" = 3', "unknown"),
    ],
    ids=range(14),
)
def test_a_hostile_file_is_one_line(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "eye.toml"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        Observer.parse(str(path))
    assert words in str(caught.value)
    assert str(caught.value).startswith("eye.toml: ")
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < 500
