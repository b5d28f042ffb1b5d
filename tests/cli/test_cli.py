"""The group: help, exit codes, lists, plug-ins, the doctor."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click
import pytest
from command_line import CommandLine, process
from stage_text import GROUND, SKY, write_stage

from hdrusd import __version__
from hdrusd.cli.main import COMMANDS
from hdrusd.cli.main import hdrusd as group
from hdrusd.errors import ContextError, InputError, UnknownNameError, ValidationError
from hdrusd.tonemap.operator import OPERATORS


@pytest.fixture
def hdrusd(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    return CommandLine(monkeypatch, capsys, None)


def test_help_lists_the_commands(hdrusd: CommandLine) -> None:
    said = hdrusd.run("--help")
    for name, text in COMMANDS.items():
        assert name in said.out
        assert text.split(":")[0] in " ".join(said.out.split())
    for code in ("0 done", "1 error", "2 wrong use", "3 input", "4 validation", "5 no OpenGL"):
        assert code in said.out
    assert "6 findings under --strict" in " ".join(said.out.split())
    assert "130 interrupted" in " ".join(said.out.split())


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_option_has_help(hdrusd: CommandLine, name: str) -> None:
    said = hdrusd.run(name, "--help")
    assert said.out.startswith(f"Usage: hdrusd {name}")
    command = group.get_command(click.Context(group), name)
    assert command is not None
    assert command.help
    for option in command.params:
        if isinstance(option, click.Option):
            assert option.help, option.name
    # the line in the group's list is about the same thing as the command's own first line
    assert hdrusd.run(name, "-h").out == said.out


def test_help_of_the_group_imports_nothing_heavy() -> None:
    """Start-up below 0.3 s: usd-core, NumPy and the image libraries take longer than that."""
    code = (
        "import sys\nfrom hdrusd.cli import main\nsys.argv = ['hdrusd', '--help']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "print([m for m in ('pxr', 'numpy', 'OpenEXR', 'OpenImageIO', 'moderngl') "
        "if m in sys.modules], file=sys.stderr)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stderr.strip() == "[]"


def test_version(hdrusd: CommandLine) -> None:
    assert __version__ in hdrusd.run("--version").out


def test_exit_codes_are_those_of_the_help() -> None:
    codes = {InputError: 3, ValidationError: 4, ContextError: 5, UnknownNameError: 2}
    assert {kind: kind.exit_code for kind in codes} == codes


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["rendr"], "No such command 'rendr'. Did you mean 'render'?"),
        (["xyzzy"], "No such command 'xyzzy'."),
        (["--nope"], "No such option"),
        (["render", "--frmes", "1"], "'--frames'"),
    ],
)
def test_misspelt(hdrusd: CommandLine, arguments: list[str], line: str) -> None:
    assert line in hdrusd.refused(*arguments, code=2)


def test_no_command_shows_the_help(hdrusd: CommandLine) -> None:
    assert "Commands:" in hdrusd.run(code=2).err


def test_unexpected_errors_keep_their_traceback(
    hdrusd: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bug is not dressed up as the user's mistake."""
    monkeypatch.setattr("hdrusd.cli.operators.command.callback", lambda name: 1 / 0)
    monkeypatch.setattr(sys, "argv", ["hdrusd", "operators"])
    from hdrusd.cli import main

    with pytest.raises(ZeroDivisionError):
        main()


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, click.Abort])
def test_interrupt(hdrusd: CommandLine, monkeypatch: pytest.MonkeyPatch, interruption: Any) -> None:
    def stop(name: str | None) -> None:
        raise interruption

    monkeypatch.setattr("hdrusd.cli.operators.command.callback", stop)
    assert hdrusd.run("operators", code=130).err.strip() == "interrupted"


def test_operators_are_listed_and_explained(hdrusd: CommandLine) -> None:
    said = hdrusd.run("operators")
    assert [line.split()[0] for line in said.out.splitlines()] == OPERATORS.names()
    for name in OPERATORS.names():
        told = hdrusd.run("operators", name).out
        assert OPERATORS[name].cite in told
        for parameter in OPERATORS[name].parameters:
            assert f"--set {parameter.name}=" in told
            assert parameter.meaning in told
    assert "nope: unknown; known:" in hdrusd.refused("operators", "nope", code=2)


def test_every_default_shown_can_be_given_back(hdrusd: CommandLine) -> None:
    """``--set NAME=DEFAULT`` as ``hdrusd operators`` prints it is accepted."""
    from hdrusd.cli.options import chosen_operator, parse_settings

    for name in OPERATORS.names():
        if name == "ocio" and find_spec("PyOpenColorIO") is None:
            continue  # an extra
        shown = hdrusd.run("operators", name).out.split("--set ")[1:]
        chosen_operator(name, parse_settings(tuple(s.split(":")[0].split()[0] for s in shown)))


def test_schemas_prints_the_plugin_folder(hdrusd: CommandLine) -> None:
    assert (Path(hdrusd.run("schemas").out.strip()) / "plugInfo.json").is_file()


def test_doctor(gl: Any) -> None:
    said = process("doctor", "--json")
    facts = json.loads(said.out)
    assert said.code == 0
    assert facts["hdrusd"] == __version__
    assert facts["OpenGL version_code"] >= 330
    for package in ("usd-core", "numpy", "OpenImageIO", "OpenEXR", "moderngl"):
        assert facts[package][0].isdigit()


def test_doctor_without_a_driver(stage: Path) -> None:
    said = process("doctor", __EGL_VENDOR_LIBRARY_FILENAMES="/dev/null")
    if said.code == 0:
        pytest.skip("this machine's EGL is not libglvnd's")
    assert said.code == 5
    assert "apt-get install libegl1 libgl1-mesa-dri" in said.out
    assert "usd-core" in said.out
    assert said.err == ""


@pytest.fixture
def stage(tmp_path: Path) -> Path:
    return write_stage(tmp_path / "a.usda", GROUND, SKY)


def test_plug_in_that_cannot_be_imported_spares_the_rest(
    hdrusd: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Hdrusd --help works; the broken command says so itself, once it is called."""

    class Broken:
        name = "lamp"
        value = "lamp_plugin:command"

        def load(self) -> Any:
            raise ImportError("no module named lamp_core")

    def entries(group: str, name: str | None = None) -> list[Any]:
        return [Broken()] if group == "hdrusd.commands" and name in (None, "lamp") else []

    # ``hdrusd.cli.main`` by name is the function of that name.
    monkeypatch.setattr(sys.modules["hdrusd.cli.main"], "entry_points", entries)
    assert "lamp" in hdrusd.run("--help").out
    said = hdrusd.run("lamp", "in.usda", "--speed", "3", code=1)
    assert "no module named lamp_core" in said.err
    assert said.err.splitlines()[-1] == "lamp: the plug-in lamp_plugin:command cannot be loaded"


@pytest.mark.parametrize("name", ["a.usdc", "a", "a.usda.zip"])
def test_output_of_convert_that_is_no_usda_is_wrong_use(
    hdrusd: CommandLine, tmp_path: Path, name: str
) -> None:
    source = tmp_path / "in.obj"
    source.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    line = hdrusd.refused("convert", source, tmp_path / name, code=2)
    assert line.endswith(f"{name}: want a name that ends in .usda")
    assert [path.name for path in tmp_path.iterdir()] == ["in.obj"]


def test_check_tells_warnings_of_usd_as_findings(tmp_path: Path) -> None:
    """USD writes them from C++, with the place in its own source; seen in a process alone."""
    stage = write_stage(tmp_path / "a.usda", 'def "Far" (references = @gone.usda@) {}', SKY)
    said = process("check", stage)
    assert said.code == 4
    assert "gone.usda" in said.out
    assert "Warning: in" not in said.err
    # one of opening and one of USD's validators
    assert said.err.count("invalid: a.usda: ") == 2


def test_closed_pipe_is_no_error(stage: Path) -> None:
    """As in ``hdrusd operators | true``: nobody listens, nothing is said."""
    run = subprocess.run(
        [
            "bash",
            "-c",
            f"{sys.executable} -c 'from hdrusd.cli import main; main()' operators | true",
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.stderr == ""


_SWALLOWS = """
import os, signal, time
try:
    os.kill(os.getpid(), signal.{name})
    time.sleep(0.02)
except KeyboardInterrupt:
    print("swallowed")
"""


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_interrupt_inside_an_import_comes_after_it(tmp_path: Path, name: str) -> None:
    """USD's libraries import Python modules of theirs, and go on where one of these fails."""
    (tmp_path / "swallows.py").write_text(_SWALLOWS.format(name=name))
    lines = [
        "import sys, time",
        "sys.path.insert(0, sys.argv.pop())",
        "from hdrusd.cli.main import hdrusd, main",
        "hdrusd.get_command = lambda *_: (__import__('swallows'), time.sleep(30))",
        "main()",
    ]
    job = subprocess.run(
        [sys.executable, "-c", "\n".join(lines), "doctor", tmp_path],
        capture_output=True,
        text=True,
        timeout=25,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert (job.returncode, job.stdout, job.stderr.strip()) == (130, "", "interrupted")


@pytest.mark.parametrize("name", ["", "-"])
def test_what_is_no_name_of_a_file_is_wrong_use(hdrusd: CommandLine, name: str) -> None:
    for arguments in (
        ("convert", name, "a.usda"),
        ("convert", "a.obj", "a.usda", "--report", name),
    ):
        assert f"{name!r} is no name of a file" in hdrusd.refused(*arguments, code=2)
