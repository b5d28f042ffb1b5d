"""#include, #define and the way back from a driver's line number to ours."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from hdrusd.errors import ShaderError
from hdrusd.gpu.source import from_text, load

Write = Callable[..., str]


def test_include_is_replaced_by_the_file() -> None:
    source = from_text('// first\n#include "colour.glsl"\n// last', "x.frag")
    lines = source.text.splitlines()
    assert lines[0].split()[:2] == ["#version", "330"]
    assert lines[1] == "// first"
    assert lines[-1] == "// last"
    assert "float luminance(vec3 rgb)" in lines
    assert source.files == ("x.frag", "colour.glsl")


def test_line_table_names_every_line(write_shader: Write) -> None:
    write_shader("inner.glsl", "// inner 1", "// inner 2")
    text = '// outer 1\n#include "lamp_shaders:inner.glsl"\n// outer 3'
    source = from_text(text, "outer", {"LIGHTS": 20})
    table = dict(zip(source.text.splitlines(), source.lines, strict=True))
    assert table["// outer 1"] == ("outer", 1)
    assert table["// inner 2"] == ("lamp_shaders:inner.glsl", 2)
    assert table["// outer 3"] == ("outer", 3)
    assert table["#define LIGHTS 20"] == ("<define>", 1)


def test_text_in_place_of_a_file() -> None:
    made = '// made at run time\n#include "colour.glsl"\nfloat two() { return 2.0; }\n'
    source = from_text("// outer\n#include MADE", "outer", {"MADE": f'"{made}"'})
    table = dict(zip(source.text.splitlines(), source.lines, strict=True))
    assert table["float two() { return 2.0; }"] == ("// made at run time", 3)
    assert source.files == ("outer", "// made at run time", "colour.glsl")


def test_each_file_once(write_shader: Write) -> None:
    common = write_shader("common.glsl", "float one() { return 1.0; }")
    first = write_shader("first.glsl", f'#include "{common}"', "// first")
    second = write_shader("second.glsl", f'#include "{common}"', "// second")
    source = from_text(f'#include "{first}"\n#include "{second}"\n#include "{common}"', "x")
    assert source.text.count("float one()") == 1
    assert source.text.index("float one()") < source.text.index("// first")


def test_circle(write_shader: Write) -> None:
    write_shader("a.glsl", '#include "lamp_shaders:b.glsl"')
    write_shader("b.glsl", "// b", '#include "lamp_shaders:a.glsl"')
    with pytest.raises(ShaderError) as caught:
        load("lamp_shaders:a.glsl")
    assert str(caught.value) == (
        "lamp_shaders:b.glsl:2: #include goes in a circle: "
        "lamp_shaders:a.glsl -> lamp_shaders:b.glsl -> lamp_shaders:a.glsl"
    )


def test_long_chain_of_includes(write_shader: Write) -> None:
    count = 2000  # more than Python's recursion limit
    for i in range(count):
        write_shader(f"f{i}.glsl", f'#include "lamp_shaders:f{i + 1}.glsl"')
    write_shader(f"f{count}.glsl", "// the end")
    assert "// the end" in load("lamp_shaders:f0.glsl").text


def test_defines_come_after_the_version() -> None:
    lines = from_text("#version 330\nvoid main() {}", "x", {"ROWS": 4, "CONES": 1}).text.split("\n")
    assert lines[0].startswith("#version 330")
    assert lines[1:3] == ["#define ROWS 4", "#define CONES 1"]
    assert sum(line.startswith("#version") for line in lines) == 1


def test_include_of_a_macro() -> None:
    text = "#include OPERATOR_GLSL"
    source = from_text(text, "x", {"OPERATOR_GLSL": '"tonemap/exposure.glsl"'})
    assert "vec3 exposure(vec3 rgb)" in source.text
    assert '"' not in "".join(line for line in source.text.splitlines() if "define" in line)


def test_commented_include_is_a_comment() -> None:
    assert from_text('// #include "nothing.glsl"', "x").files == ("x",)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('#include "nothing.glsl"', "x:2: nothing.glsl: no such file in hdrusd"),
        ('#include "no_such_package:a.glsl"', "no such file in no_such_package"),
        ('#include "../secret.glsl"', "not a path from the root of a package"),
        ('#include "/etc/passwd"', "not a path from the root of a package"),
        ('#include "a//b.glsl"', "not a path from the root of a package"),
        ('#include ""', "x:2: #include .*want"),
        ("#include <colour.glsl>", "x:2: #include .*want"),
        ("#include UNKNOWN", "x:2: #include .*want"),
        ('#include "colour.glsl" twice', "x:2: #include .*want"),
        ("#version 120", "x:2: #version 120; want #version 330"),
    ],
)
def test_bad_directive(line: str, message: str) -> None:
    with pytest.raises(ShaderError, match=message):
        from_text(f"// 1\n{line}", "x")


@pytest.mark.parametrize(
    ("log", "wanted"),
    [
        ("0:3(14): error: `foo' undeclared", "x:2(14): error: `foo' undeclared"),  # Mesa
        ("0(3) : error C1503: undefined", "x:2 : error C1503: undefined"),  # NVIDIA
        ("ERROR: 0:3: 'foo' : undeclared", "ERROR: x:2: 'foo' : undeclared"),  # Apple, AMD
        ("0:999(1): error: beyond the text", "0:999(1): error: beyond the text"),
        ("error: 10:3 is no place of ours", "error: 10:3 is no place of ours"),
    ],
)
def test_rewrite_log(log: str, wanted: str) -> None:
    source = from_text("// 1\n// 2\n// 3", "x")
    assert source.rewrite_log(log) == wanted
