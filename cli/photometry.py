"""``hdrusd photometry``."""

from __future__ import annotations

import json
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

import click

from .options import FILE, finish, report_options, tell, write_report

if TYPE_CHECKING:
    from hdrusd.photometry.examine import Examined
    from hdrusd.report import Report

_FORMATS = (".ies", ".ldt")

#: Keywords told on the terminal; --json has them all.
_SHOWN_KEYWORDS = 40


@click.command("photometry")
@click.argument("file", type=FILE)
@click.option(
    "--output",
    "-o",
    type=FILE,
    metavar="OUT.ies|OUT.ldt",
    help="Write it as IES LM-63-2002 or as EULUMDAT.",
)
@click.option(
    "--plot",
    type=FILE,
    metavar="OUT.png",
    help="Draw the candela: polar and over the angle. Needs hdrusd[plot].",
)
@report_options
def command(
    file: Path,
    output: Path | None,
    plot: Path | None,
    report_file: Path | None,
    strict: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Check a photometric FILE (.ies or .ldt), and say what its luminaire does.

    Whatever differs from the format is a finding with its line. Flux is the integral of the
    candela, linear between the file's angles; beam and field angles reach from 50 and 10 % of
    the largest candela of a plane to the other side.
    """
    from hdrusd.errors import HdrusdError
    from hdrusd.report import Report

    _check_places(file, output, plot)
    report = Report()
    facts: dict[str, Any] = {}
    try:
        examined = _examined(file, report)
        from hdrusd.photometry.data_sheet import data_sheet

        facts = data_sheet(examined)
        if output is not None:
            _convert(examined, output, file, report)
        if plot is not None:
            from hdrusd.candela_plot import write_candela_plot

            write_candela_plot(examined.luminaire, plot)
    except HdrusdError:
        tell(report, quiet)
        raise
    finally:
        if report_file is not None:
            write_report(report_file, {**report.as_dict(), "luminaire": facts})
    facts["findings"] = report.summary()
    click.echo(json.dumps(facts) if as_json else "\n".join(_lines(facts)))
    tell(report, quiet)
    finish(report, strict)


def _check_places(file: Path, output: Path | None, plot: Path | None) -> None:
    """Wrong use, said before any work."""
    if output is not None and output.suffix.lower() not in _FORMATS:
        raise click.UsageError(f"--output {output}: want a name that ends in .ies or .ldt")
    if plot is not None:
        if plot.suffix.lower() != ".png":
            raise click.UsageError(f"--plot {plot}: want a name that ends in .png")
        from hdrusd.plots import check_plot

        check_plot()
    if output is not None and output.exists() and file.exists() and output.samefile(file):
        raise click.UsageError(f"--output {output}: the file that is read; want another name")


def _read(path: Path) -> bytes:
    """The bytes of a file, one too many of one too large. Raises InputError."""
    from hdrusd.input_file import check_input
    from hdrusd.photometry.luminaire import MOST_BYTES

    check_input(path)
    with path.open("rb") as stream:
        return stream.read(MOST_BYTES + 1)


def _examined(file: Path, report: Report) -> Examined:
    from hdrusd.errors import InputError, SourceRef
    from hdrusd.photometry.examine import examine

    def tilt(name: str) -> bytes | None:
        """Of a file beside this one, and nowhere else."""
        try:
            return _read(file.parent / PurePosixPath(name.replace("\\", "/")).name)
        except (InputError, ValueError):
            return None

    return examine(_read(file), SourceRef(file), report, tilt)


def _convert(examined: Examined, output: Path, file: Path, report: Report) -> None:
    from hdrusd.errors import SourceRef
    from hdrusd.images import write_atomically
    from hdrusd.photometry.conversion import to_eulumdat, to_ies
    from hdrusd.photometry.eulumdat import write_eulumdat
    from hdrusd.photometry.ies import write_ies

    place = SourceRef(file)
    if output.suffix.lower() == ".ies":
        data = write_ies(to_ies(examined.file, place, report))
    else:
        data = write_eulumdat(to_eulumdat(examined.file, place, report))

    def write(temporary: Path) -> None:
        temporary.write_bytes(data)

    write_atomically(output, write)


def _lines(facts: dict[str, Any]) -> list[str]:
    """The facts for a person, a line each."""
    rows = {
        "format": f"{facts['format']} {facts['version']}",
        **_keywords(facts["keywords"]),
        "factors": ", ".join(f"{name} {value:g}" for name, value in facts["factors"].items()),
        "photometry": f"type {facts['type']}",
        "symmetry": f"stated {facts['symmetry_stated']}, found {facts['symmetry_found']}",
        **{key: _span(facts[key]) for key in ("planes", "angles")},
        "peak": "{:.6g} cd at plane {:g}, angle {:g}".format(
            facts["peak_cd"], *facts["peak_at_deg"]
        ),
        "flux": f"{facts['flux_lm']:.6g} lm",
        **_zones(facts),
        "upward light": _shown(facts["upward_light_ratio"], "{:.2%}"),
        "lamps": _shown(facts["lamp_flux_lm"], "{:.6g} lm", "absolute photometry"),
        "output ratio": _shown(facts["light_output_ratio"], "{:.1%}"),
        "power": _shown(facts["watts"], "{:g} W"),
        "efficacy": _shown(facts["efficacy_lm_w"], "{:.4g} lm/W"),
        "beam angle": _fans(facts["beam_deg"]),
        "field angle": _fans(facts["field_deg"]),
        "opening": facts["opening"]
        + ", {:g} x {:g} x {:g} m along C 0, C 90 and up".format(*facts["opening_m"]),
        "luminance": _shown(facts["nadir_luminance_cd_m2"], "{:.5g} cd/m2 at nadir"),
        "cie flux code": _shown(facts["cie_flux_code"], "{}"),
        "findings": facts["findings"],
    }
    if isinstance(facts["cie_flux_code"], list):
        rows["cie flux code"] = " ".join(map(str, facts["cie_flux_code"]))
    width = max(map(len, rows))
    return [f"{name:<{width}}  {value}" for name, value in rows.items() if value]


def _keywords(keywords: dict[str, str]) -> dict[str, str]:
    """The first of them, without what a terminal would obey."""
    from hdrusd.errors import one_line

    rows = {f"[{one_line(key)}]": one_line(value) for key, value in keywords.items()}
    shown = dict(islice(rows.items(), _SHOWN_KEYWORDS))
    if len(rows) > len(shown):
        shown["[...]"] = f"{len(rows) - len(shown)} more"
    return shown


def _shown(value: object, form: str, otherwise: str = "") -> str:
    """A number in its form; "" of an unknown one leaves its line out."""
    return otherwise if value is None else form.format(value)


def _span(facts: dict[str, Any]) -> str:
    return "{count}, {from_deg:g} to {to_deg:g} degrees".format(**facts)


def _fans(fans: dict[str, float | None]) -> str:
    return ", ".join(
        _shown(value, f"{name} {{:.4g}}", f"{name} none") for name, value in fans.items()
    )


def _zones(facts: dict[str, Any]) -> dict[str, str]:
    bounds, flux, whole = facts["zones_deg"], facts["zonal_flux_lm"], facts["flux_lm"]
    return {
        f"  {low:g} to {high:g}": f"{value:.6g} lm, {value / whole if whole else 0.0:.1%}"
        for low, high, value in zip(bounds[:-1], bounds[1:], flux, strict=True)
    }
