"""The search for unreachable cycles is put off for a while, and comes back."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest

from hdrusd.importers.cycle_search import put_off


@pytest.fixture(autouse=True)
def searching() -> Iterator[None]:
    """Each test begins with the search on, and leaves it on."""
    gc.enable()
    yield
    gc.enable()


def test_it_is_off_meanwhile_and_on_again() -> None:
    with put_off():
        with put_off():
            assert not gc.isenabled()
        assert not gc.isenabled()
    assert gc.isenabled()


def test_it_is_on_again_after_an_error() -> None:
    with pytest.raises(ValueError, match="broken"), put_off():
        raise ValueError("broken")
    assert gc.isenabled()


def test_it_stays_off_where_the_program_has_it_off() -> None:
    gc.disable()
    with put_off():
        pass
    assert not gc.isenabled()
