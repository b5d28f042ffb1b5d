"""Texts of decimal numbers in bulk: each as Python's own float, which rounds correctly."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from obj_builder import quick

from hdrusd.importers.number_text import decimals, wholes

#: Makes a text long enough for the way that long ones are read.
FILLING = " 1.5" * 400

#: As exporters write them: so many places, shortest, with an exponent.
FORMS: list[Callable[[float], str]] = [
    lambda x: f"{x:.4f}",
    lambda x: f"{x:.6g}",
    repr,
    lambda x: f"{x:.17e}",
    lambda x: f"{x:.3E}".replace("E+0", "E"),
    lambda x: f"{x:+.2f}".replace("0.", "."),
    lambda x: f"{x:.0f}.",
]
NUMBERS = st.one_of(
    st.floats(-1e4, 1e4), st.floats(allow_nan=False, allow_infinity=False), st.just(-0.0)
)
WORDS = st.builds(lambda x, form: form(x), NUMBERS, st.sampled_from(FORMS))
BLANKS = st.sampled_from([" ", "\n", "\t", "  ", "\r\n", " " * 40])


def bits(values: np.ndarray | list[float]) -> bytes:
    """Such that 0.0 and -0.0 differ."""
    return struct.pack(f"<{len(values)}d", *values)


@given(st.lists(WORDS, max_size=60), BLANKS, st.booleans())
@quick
def test_every_number_is_the_nearest_to_its_text(words: list[str], blank: str, long: bool) -> None:
    text = blank.join(words) + FILLING * long
    values = decimals(text.encode())
    assert values is not None
    assert bits(values) == bits([float(word) for word in text.split()])


@pytest.mark.parametrize(
    "word",
    [
        *("9007199254740993", "9007199254740993.0", "0.30000000000000004", "1" * 400),
        *("." + "1" * 400, "0" * 400 + "1.5", "1e400", "-1e400", "1e-400", "-1e-400", "4.9e-324"),
        *("1e99999999999999999999", "1e-99999999999999999999", "0e99", "1e22", "1e23", "123e-22"),
        *("123e-23", "-0", "-0.0", "-.0", "-0e5", "+0", "+.5", "-.5", "5.", "5.e1", "1E+5"),
    ],
)
def test_words_at_the_ends_of_what_is_exact(word: str) -> None:
    for text in (word, word + FILLING, FILLING + " " + word):
        values = decimals(text.encode())
        assert values is not None
        assert bits(values) == bits([float(each) for each in text.split()])


@pytest.mark.parametrize(
    "word",
    [
        *(".", "-.", ".-5", ".+5", "-.-5", "1.-5", "1.2.3", "1..2", "1-5", "--5", "+-1", "- 5"),
        *("e5", "-e5", ".e5", "1e", "1e-", "1e5.", "1e.5", "1e-.5", "1e5e3", "1e 5", "1e+-5"),
        *("1,5", "1_0", "0x10", "one", "1\x01", "\x01", "\u00e9", "\u0663", "1f"),
    ],
)
def test_a_word_that_is_no_number_is_never_read_as_one(word: str) -> None:
    for before, after in (("", FILLING), (FILLING, FILLING), ("1.5 " * 90_000, FILLING)):
        assert decimals(f"{before} {word} {after}".encode()) is None


def test_a_text_longer_than_is_read_at_a_time() -> None:
    expected = np.arange(-100_000, 100_000) / 8.0
    values = decimals(" ".join(map(repr, expected.tolist())).encode())
    assert values is not None
    assert np.array_equal(values, expected)


@pytest.mark.parametrize("text", ["", " ", "\n" * 5000])
def test_a_text_of_blanks_has_no_numbers(text: str) -> None:
    for values in (decimals(text.encode()), wholes(text.encode())):
        assert values is not None
        assert len(values) == 0


def test_whole_numbers() -> None:
    values = wholes(b"7 -3\n+2 9223372036854775808")
    assert values is not None
    assert values.tolist() == [7, -3, 2, 2**63 - 1]
    assert wholes(b"1.5") is None
    assert wholes(b"1/2") is None
