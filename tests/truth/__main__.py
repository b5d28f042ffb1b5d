"""``python -m tests.truth [TRUTH_DIR] [--out DIR]``: render truth cases and check them.

TRUTH_DIR is by default the set of tests/truth_stages, and that of $HDRUSD_TESTDATA/truth
where the variable is set. Exit code 0 when every supported case passes; what is not
supported is said.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

from hdrusd.gpu.context import create_context
from hdrusd.report import Report

from .cases import blinn_phong_session, check, read_cases, render_case

_OWN = Path(__file__).parent.parent / "truth_stages"


def main() -> int:
    """Run; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.truth", description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, metavar="TRUTH_DIR")
    parser.add_argument("--out", type=Path, help="keep the frames here")
    arguments = parser.parse_args()
    folders = [arguments.folder]
    if arguments.folder is None:
        testdata = os.environ.get("HDRUSD_TESTDATA")
        folders = [_OWN, Path(testdata) / "truth"] if testdata else [_OWN]
    for folder in folders:
        if not (folder / "expected.json").is_file():
            parser.error(f"{folder}: no expected.json; want a folder of truth cases")
    with tempfile.TemporaryDirectory() as temporary:
        output = arguments.out or Path(temporary)
        several = len(folders) > 1  # whose frames may have the same names
        # A list, so that a failure in one set does not hide those of the next.
        codes = [run(each, output / each.name if several else output) for each in folders]
    return max(codes)


def run(folder: Path, output: Path) -> int:
    """Render and check all cases of ``folder``; returns the exit code."""
    output.mkdir(parents=True, exist_ok=True)
    cases = read_cases(folder)
    supported = [case for case in cases if not case.unsupported]
    ctx = create_context()
    failed = False
    for case in supported:
        report = Report()
        render_case(ctx, case, output, report)
        for finding in report:
            print(f"      {case.id}: {finding.kind}: {finding}")
    for variant in dict.fromkeys(case.variant for case in supported):
        group = [case for case in supported if case.variant == variant]
        good, text = check(folder, output, group, variant)
        print(text if variant is None else f"{text} ({variant})")
        failed |= not good
    for case in supported:
        if "Blinn-Phong" in case.covers and "photometry" in case.entry:
            render_case(ctx, case, output, Report(), blinn_phong_session(case, output))
            good, text = check(folder, output, [case], None)
            print(f"{text} (with its own Blinn-Phong numbers)")
            failed |= not good
    for case in cases:
        if case.unsupported:
            kind = "core" if case.core else "optional"
            print(f"skip  {case.id} [{kind}]: {case.unsupported}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
