"""What every test gets: strict arithmetic; on request an OpenGL context and the shared data."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from hypothesis import settings

from hdrusd.errors import ContextError
from hdrusd.gpu.context import create_context

# A busy machine is not a failure.
settings.register_profile("hdrusd", deadline=None)
settings.load_profile("hdrusd")


@pytest.fixture(autouse=True)
def _strict_numpy() -> Iterator[None]:
    # Underflow is not an error: a light far away gives nothing.
    with np.errstate(over="raise", divide="raise", invalid="raise"):
        yield


@pytest.fixture(scope="session")
def _context() -> Any:
    try:
        context = create_context()
    except ContextError as error:
        if os.environ.get("HDRUSD_REQUIRE_GL") == "1":
            pytest.fail(str(error))
        pytest.skip(str(error))
    context.gc_mode = "context_gc"
    return context


@pytest.fixture
def gl(_context: Any) -> Iterator[Any]:
    """The OpenGL context that all tests share; skips where there is none.

    A failed call leaves a zero buffer, not an exception, so the error flag is read
    before and after.
    """
    # Current in this thread whatever other contexts a test has made.
    with _context:
        assert _context.error == "GL_NO_ERROR", "an earlier test left an OpenGL error"
        yield _context
    with _context:
        assert _context.error == "GL_NO_ERROR"
        _context.extra["framebuffer"].use()
        # What a test let go of without release(); what it released is listed too.
        while _context.objects:
            thing = _context.objects.popleft()
            if not isinstance(thing, moderngl.InvalidObject):
                thing.release()


@pytest.fixture
def testdata() -> Path:
    """The folder that HDRUSD_TESTDATA names."""
    folder = os.environ.get("HDRUSD_TESTDATA")
    if not folder:
        pytest.skip("HDRUSD_TESTDATA is not set")
    return Path(folder)
