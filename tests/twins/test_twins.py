"""Every x.glsl beside an x.py: each function of the first has a namesake in the second."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

import pytest

import hdrusd

ROOT = Path(hdrusd.__file__).parent
GLSL = sorted(ROOT.rglob("*.glsl"))
PAIRS = [path for path in GLSL if path.with_suffix(".py").is_file()]

_COMMENTS = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_FUNCTION = re.compile(r"^\s*(?:\w+\s+)+?(?P<name>\w+)\s*\([^()]*\)\s*\{", re.MULTILINE)


def functions(text: str) -> set[str]:
    """Names of the functions that GLSL text defines."""
    text = _COMMENTS.sub(" ", text)
    # What is not inside braces: definitions, and no statement that looks like one.
    outer, depth = [], 0
    for part in re.split(r"([{}])", text):
        if part == "{":
            outer.append("{" if depth == 0 else "")
            depth += 1
        elif part == "}":
            depth -= 1
            outer.append("}\n" if depth == 0 else "")
        elif depth == 0:
            outer.append(part)
    return {match["name"] for match in _FUNCTION.finditer("".join(outer))}


def place(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def test_the_search_finds_what_is_there() -> None:
    text = """
    // float commented(float x) {
    uniform float scale;
    const vec3 W = vec3(0.2, 0.7, 0.1);
    struct Cone { float inner; float outer; };
    float angle(float c) { if (c < 0.0) { return 1.0; } return acos(c); }
    highp vec3
    spread(vec3 a,
           const in float b)
    {
        for (int i = 0; i < 3; ++i) { a += b; }
        return a;
    }
    """
    assert functions(text) == {"angle", "spread"}


def test_there_are_pairs() -> None:
    assert {"colour.glsl", "tonemap/reinhard02.glsl"} <= {place(path) for path in PAIRS}


@pytest.mark.parametrize("path", PAIRS, ids=place)
def test_namesakes(path: Path) -> None:
    module = import_module("hdrusd." + ".".join(path.relative_to(ROOT).with_suffix("").parts))
    found = functions(path.read_text(encoding="utf-8"))
    assert found, f"{place(path)} defines nothing"
    missing = {name for name in found if not callable(getattr(module, name, None))}
    assert not missing, f"{place(path)}: no namesake in Python: {', '.join(sorted(missing))}"


@pytest.mark.parametrize("path", GLSL, ids=place)
def test_science_in_glsl_has_a_twin(path: Path) -> None:
    # Only shaders of gpu/ may stand alone: they are drawn, and compared as pictures.
    assert path in PAIRS or path.is_relative_to(ROOT / "gpu")


@pytest.mark.parametrize("path", PAIRS, ids=place)
def test_first_line_names_the_twin(path: Path) -> None:
    first = path.read_text(encoding="utf-8").splitlines()[0]
    assert first.startswith("// ")
    assert path.with_suffix(".py").name in first
