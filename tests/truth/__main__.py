"""``python -m tests.truth [TRUTH_DIR] [--out DIR] [--markdown FILE]``: render cases, check them.

TRUTH_DIR is by default the set of tests/truth_stages, and that of $HDRUSD_TESTDATA/truth
where the variable is set. Every case is run. Exit code 0 when all pass.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import moderngl

from hdrusd.errors import HdrusdError
from hdrusd.gpu.context import create_context
from hdrusd.report import Report

from .cases import APPROXIMATED, Case, check, read_cases, render_case, worst

_OWN = Path(__file__).parent.parent / "truth_stages"


@dataclass(frozen=True)
class Result:
    """How a case came out: ``worst`` is the largest relative difference of luminance."""

    case: Case
    good: bool
    worst: float

    def cells(self) -> list[str]:
        """A row of the table: what is exact, what is not, what may differ and what does."""
        case, probes = self.case, self.case.entry["probes"]
        how = [f"{word} ({APPROXIMATED[word]})" for word in case.approximated]
        exact = [word for word in case.covers if word not in APPROXIMATED]
        tolerance = max(probe["rel_tol"] for probe in probes)
        name = case.id if self.good else f"**{case.id}**"
        limits = [f"{tolerance * 100:g} %", f"{self.worst:.3%}".replace("%", " %")]
        return [name, ", ".join(exact), "; ".join(how) or "nothing", str(len(probes)), *limits]


HEAD = ("case", "exact", "approximated", "probes", "tolerance", "largest difference")


def main() -> int:
    """Run; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.truth", description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, metavar="TRUTH_DIR")
    parser.add_argument("--out", type=Path, help="keep the frames here")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write a table")
    arguments = parser.parse_args()
    folders = [arguments.folder]
    if arguments.folder is None:
        testdata = os.environ.get("HDRUSD_TESTDATA")
        folders = [_OWN, Path(testdata) / "truth"] if testdata else [_OWN]
    for folder in folders:
        if not (folder / "expected.json").is_file():
            parser.error(f"{folder}: no expected.json; want a folder of truth cases")
    results = []
    ctx = create_context()
    with tempfile.TemporaryDirectory() as temporary:
        output = arguments.out or Path(temporary)
        several = len(folders) > 1  # whose frames may have the same names
        for each in folders:
            results += run(ctx, each, output / each.name if several else output)
    good = sum(result.good for result in results)
    print(f"{len(results)} cases: {good} pass, {len(results) - good} fail")
    if arguments.markdown is not None:
        arguments.markdown.write_text(markdown(results), encoding="utf-8")
    return int(good < len(results))


def run(ctx: moderngl.Context, folder: Path, output: Path) -> list[Result]:
    """Render and check all cases of ``folder``."""
    output.mkdir(parents=True, exist_ok=True)
    results = []
    for case in read_cases(folder):
        report = Report()
        try:
            render_case(ctx, case, output, report)
        except HdrusdError as problem:
            print(f"FAIL  {case.id}: {problem}")
            results.append(Result(case, good=False, worst=float("inf")))
            continue
        good, text = check(case, output)
        results.append(Result(case, good, worst(case, output)))
        _, exact, approximated, *_ = results[-1].cells()
        print(f"{text}\n      exact: {exact}; approximated: {approximated}")
        for finding in report:
            print(f"      {finding.kind}: {finding}")
    return results


def markdown(results: Sequence[Result]) -> str:
    """The results as a Markdown table."""
    rows = [HEAD, ["---"] * len(HEAD), *(result.cells() for result in results)]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


if __name__ == "__main__":
    sys.exit(main())
