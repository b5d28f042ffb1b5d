"""Photometric files made to break a reader: an InputError or a sound luminaire, soon."""

from __future__ import annotations

import time

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from photometric_files import IES, LDT, ies_text, ldt_text

from hdrusd.errors import InputError
from hdrusd.photometry.eulumdat import read_eulumdat
from hdrusd.photometry.ies import is_ies, read_ies
from hdrusd.photometry.profile import MOST_ANGLES, MOST_PLANES, even_profile
from hdrusd.report import Report

SEEDS = [
    ies_text().encode(),
    ies_text(label="", tilt="TILT=INCLUDE\n1\n2\n0 90\n1 0.5").encode(),
    ies_text([1, 2, 3, 4], planes=(-5, 5), angles=(-3, 3), type="A").encode(),
    ldt_text().encode(),
    ldt_text([[1, 2]] * 3, symmetry=2, planes=(0, 90, 180, 270), angles=(0, 90)).encode(),
    ies_text([[1, 2]] * 4, planes=(-180, -90, 0, 90), angles=(0, 90)).encode("utf-8-sig"),
    ldt_text([[1, 2]] * 3, symmetry=0, planes=(5, 120, 240), angles=(0, 90)).encode(),
    ldt_text([[1, 2]] * 3, symmetry=3, planes=(-90, 0, 90), angles=(0, 90)).encode(),
]

#: What a number may become.
WORDS = [
    b"0",
    b"-1",
    b"1e308",
    b"-1e308",
    b"1e-308",
    b"nan",
    b"inf",
    b"999999999",
    b"",
    b"x",
    b",",
    b"2",
]


def read(data: bytes) -> None:
    """As an extension that lies would have it, too."""
    for reader in (read_ies, read_eulumdat):
        place = IES if reader is read_ies else LDT
        try:
            lamp = reader(data, place, Report())
        except InputError:
            continue
        assert lamp.candela.shape == (len(lamp.planes), len(lamp.angles))
        assert (lamp.candela >= 0.0).all()
        assert np.isfinite(lamp.flux())
        profile, lost = even_profile(lamp)
        assert np.isfinite(profile.candela).all()
        assert np.isfinite(lost)
        assert profile.candela.shape[0] <= MOST_PLANES
        assert profile.candela.shape[1] <= MOST_ANGLES
    is_ies(data)


@given(st.binary(max_size=400))
def test_any_bytes(data: bytes) -> None:
    read(data)
    read(b"TILT=NONE\n" + data)


@given(
    st.sampled_from(SEEDS),
    st.lists(st.tuples(st.integers(0, 100), st.sampled_from(WORDS)), min_size=1, max_size=4),
)
def test_a_word_replaced(seed: bytes, changes: list[tuple[int, bytes]]) -> None:
    breaks = b"\r\n" if b"\r\n" in seed else b" "
    parts = seed.replace(b"\n", b" \n ").split(b" ") if breaks == b" " else seed.split(breaks)
    for index, word in changes:
        parts[index % len(parts)] = word
    read(breaks.join(parts))


@given(st.sampled_from(SEEDS), st.integers(0, 400), st.binary(max_size=6), st.integers(0, 40))
def test_bytes_replaced(seed: bytes, start: int, new: bytes, cut: int) -> None:
    start %= len(seed)
    read(seed[:start] + new + seed[start + cut :])


def test_large_files_end_soon() -> None:
    head = b"IESNA:LM-63-2002\n"
    body = b"\nTILT=NONE\n1 1 1 4096 512 1 1 0 0 0 1 1 1\n"
    hostile = [
        b"\n" * (16 << 20),
        b"TILT=NONE\n" + b"1 " * (8 << 20),
        head + b"[A]\n" + b"[MORE] x\n" * 1_500_000 + b"TILT=NONE\n",
        b" " * (15 << 20) + b"TILT",
        b"[" * (15 << 20) + b"\nTILT=NONE\n",
        head + body + b"1e-5 " * 2_200_000,
        b"1\n" * (7 << 20),
        bytes((16 << 20) + 1),
    ]
    start = time.perf_counter()
    for data in hostile:
        read(data)
    assert time.perf_counter() - start < 60.0
