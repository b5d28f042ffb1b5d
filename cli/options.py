"""Options that more than one command has, and how findings are told."""

from __future__ import annotations

import json
import math
import re
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from hdrusd.errors import HdrusdError
from hdrusd.report import Finding, Report

if TYPE_CHECKING:
    from hdrusd.tonemap.operator import Operator

F = TypeVar("F", bound=Callable[..., Any])

#: Exit code of a run with findings under --strict.
STRICT = 6

#: Findings told on the terminal, those with the same words once; the rest is in the report.
_SHOWN = 20


class Named(click.Path):
    """A path that a name says; "-" is no stream here, and nothing is not the folder we are in."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path. Raises BadParameter."""
        if str(value) in ("", "-"):
            self.fail(f"{str(value)!r} is no name of a file; want one.", param, ctx)
        return super().convert(value, param, ctx)


#: Whoever reads the file says that it cannot be read, with the exit code for that.
FILE = Named(path_type=Path, dir_okay=False, readable=False)
FOLDER = Named(path_type=Path, file_okay=False, exists=True)
#: A file or a folder.
PLACE = Named(path_type=Path, readable=False)


class NumberRange(click.FloatRange):
    """A range that NaN is not in, though it compares false with both ends."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """The number. Raises BadParameter."""
        number: float = super().convert(value, param, ctx)
        if math.isnan(number):
            self.fail(f"{value} is no number.", param, ctx)
        return number


def _spare(path: Path) -> None:
    """A slip of the hand must not cost a database, or the stage just made of it."""
    if not path.is_file():
        return
    with path.open("rb") as file:
        begun = file.read(64)
    if begun and not re.match(rb'\s*\{\s*"format": *"hdrusd-', begun):
        raise HdrusdError(f"{path}: not an earlier report; want another name for --report")


def _report_place(ctx: click.Context, option: click.Parameter, path: Path | None) -> Path | None:
    """Said before the work and not after it: that a report cannot be written there."""
    if path is None:
        return None
    if path.exists() and not path.is_file():
        raise HdrusdError(f"{path}: not a regular file; see --report")
    _spare(path)
    above = next(folder for folder in path.absolute().parents if folder.exists())
    try:
        with tempfile.TemporaryFile(dir=above):
            return path
    except OSError as problem:
        text = f"{path}: nothing can be written in {above} ({problem.strerror}); see --report"
        raise HdrusdError(text) from problem


def report_options(function: F) -> F:
    """--report, --strict, --json, --quiet."""
    for option in (
        click.option(
            "--report",
            "report_file",
            type=FILE,
            callback=_report_place,
            help="Write all findings as JSON.",
        ),
        click.option("--strict", is_flag=True, help=f"Exit with {STRICT} when there are findings."),
        click.option(
            "--json", "as_json", is_flag=True, help="Print the result as one JSON object."
        ),
        click.option("-q", "--quiet", is_flag=True, help="No findings on the terminal."),
    ):
        function = option(function)
    return function


def root_options(function: F) -> F:
    """--root, --search-path: where the files that a source names may lie."""
    for option in reversed(
        (
            click.option(
                "--root",
                "roots",
                type=FOLDER,
                multiple=True,
                help="Folder below which the source may name files; its own always counts.",
            ),
            click.option(
                "--search-path",
                "search",
                type=FOLDER,
                multiple=True,
                help="Folder where missing textures are looked for.",
            ),
        )
    ):
        function = option(function)
    return function


def measure_options(function: F) -> F:
    """--source-unit, --up: what a format leaves open."""
    for option in reversed(
        (
            click.option(
                "--source-unit",
                type=NumberRange(1e-9, 1e9),
                metavar="METERS",
                help="Metres a source unit, where the format does not say or is wrong.",
            ),
            click.option(
                "--up",
                type=click.Choice(["Y", "Z"]),
                help="Up axis of the source, where the format does not say or is wrong.",
            ),
        )
    ):
        function = option(function)
    return function


def operator_options(function: F) -> F:
    """--operator and --set name=value for its parameters."""
    for option in (
        click.option(
            "--set",
            "settings",
            metavar="NAME=VALUE",
            multiple=True,
            help="Parameter of the operator; repeatable. See: hdrusd operators NAME.",
        ),
        click.option(
            "--operator",
            "-op",
            metavar="NAME",
            help="Tone mapping operator. [default: reinhard02, or what the stage names]",
        ),
    ):
        function = option(function)
    return function


def parse_settings(settings: tuple[str, ...]) -> dict[str, Any]:
    """``name=value`` pairs; numbers become floats, "none" becomes None. Raises UsageError."""
    parsed: dict[str, Any] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals or not name:
            raise click.UsageError(f"--set {setting}: want NAME=VALUE")
        try:
            parsed[name] = float(text)
        except ValueError:
            parsed[name] = None if text == "none" else text
    return parsed


def chosen_operator(name: str | None, settings: dict[str, Any]) -> Operator:
    """The operator, its parameters tried on a frame of one luminance. Raises UsageError."""
    from hdrusd.tonemap.operator import DEFAULT_OPERATOR, OPERATORS

    operator = OPERATORS[name or DEFAULT_OPERATOR]
    try:
        operator.check(settings)
    except HdrusdError as problem:
        raise click.UsageError(f"--set: {problem}") from problem
    return operator


def tell(report: Report, quiet: bool) -> None:
    """Findings to standard error: guesses and losses first, the same words once, the count last."""
    if quiet or not len(report):
        return
    order = ["missing", "invalid", "clamped", "guessed", "dropped", "replaced", "assumed"]
    findings = sorted(report, key=lambda finding: order.index(str(finding.kind)))
    alike: dict[tuple[str, str, str], list[Finding]] = {}
    for finding in findings:
        alike.setdefault((finding.kind, finding.code, finding.text), []).append(finding)
    groups = list(alike.values())
    for group in groups[:_SHOWN]:
        more = f"; {len(group) - 1} more like this" if len(group) > 1 else ""
        click.echo(f"{group[0].kind}: {group[0]}{more}", err=True)
    if len(groups) > _SHOWN:
        left = sum(map(len, groups[_SHOWN:]))
        click.echo(f"... and {left} more; --report FILE has them all", err=True)
    click.echo(report.summary(), err=True)


def write_report(path: Path, document: dict[str, Any]) -> None:
    """Write JSON, all of it or nothing. Raises HdrusdError for what is no report, OSError."""
    from hdrusd.images import write_atomically

    _spare(path)
    text = json.dumps(document, indent=1) + "\n"

    def write(temporary: Path) -> None:
        temporary.write_text(text, encoding="utf-8")

    write_atomically(path, write)


def finish(report: Report, strict: bool) -> None:
    """Exit with STRICT where findings are not wanted."""
    if strict and len(report):
        sys.exit(STRICT)


def conclude(
    report: Report, document: dict[str, Any], lines: Iterable[str], options: Mapping[str, Any]
) -> None:
    """The end of a command with ``report_options`` and ``--json``.

    ``lines``, or with ``--json`` the ``document``, go to standard output.
    """
    if options["report_file"] is not None:
        write_report(options["report_file"], document)
    tell(report, options["quiet"])
    for line in [json.dumps(document)] if options["as_json"] else lines:
        click.echo(line)
    finish(report, options["strict"])


def list_profiles(profiles: Mapping[str, Mapping[str, Any]]) -> None:
    """Names and titles, a line each."""
    width = max(map(len, profiles))
    for name, keys in profiles.items():
        click.echo(f"{name:<{width}}  {keys['title']}")


def tell_keys(profile: object, keys: Mapping[str, tuple[str, str]]) -> None:
    """What a profile has for each key, with the key's unit and meaning."""
    for key, (unit, meaning) in keys.items():
        value = getattr(profile, key)
        shown = "none" if value is None else f"{value:g}" if isinstance(value, float) else value
        suffix = f" {unit}" if unit and value is not None else ""
        click.echo(f"{key}={shown}{suffix}: {meaning}")
