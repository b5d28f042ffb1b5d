"""Stages from files: what is opened of them, and what USD says about it."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from pxr import Sdf, Tf, Usd, UsdShade, UsdUtils

from hdrusd.errors import InputError, SourceRef
from hdrusd.input_file import check_input
from hdrusd.report import Kind, Report
from hdrusd.usd.variants import select_variants


def open_stage(
    path: Path,
    mask: Sequence[str] = (),
    session: Path | None = None,
    report: Report | None = None,
    variants: Sequence[str] = (),
) -> Usd.Stage:
    """Open a stage, all of it or what ``mask`` names, with these ``variants`` (PRIM:SET=NAME).

    ``report``: takes what USD warns of (arcs that lead nowhere or in a circle), which
    otherwise goes to standard error. Raises InputError.
    """
    paths = [_mask_path(path, name) for name in mask]
    root, over = open_layer(path), None if session is None else open_layer(session)
    if variants:  # over the user's session layer, which is a file and stays as it is
        choices = Sdf.Layer.CreateAnonymous("session.usda")
        choices.subLayerPaths = [] if over is None else [over.identifier]
        over = choices
    layers = [root, over] if over is not None else [root]
    with usd_warnings(path, report):
        try:
            if mask:
                stage = Usd.Stage.OpenMasked(*layers, Usd.StagePopulationMask(paths))
            else:
                stage = Usd.Stage.Open(*layers)
        except Tf.ErrorException as problem:
            raise InputError(path, f"not a USD stage ({one_line_of(problem)})") from problem
        select_variants(stage, variants, SourceRef(path))
    for target in paths:
        if report is not None and not stage.GetPrimAtPath(target):
            report.add(Kind.MISSING, "mask", SourceRef(path), str(target), "no such prim")
    return stage


@contextlib.contextmanager
def usd_warnings(path: Path, report: Report | None) -> Iterator[None]:
    """What USD warns of within the block becomes findings of the stage at ``path``."""
    if report is None:
        yield
        return
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        for said in delegate.TakeUncoalescedDiagnostics():
            if not _names_tiles(said.commentary):
                text = _warning(said.commentary)
                report.add(Kind.INVALID, "usd-warning", SourceRef(path), "", text)


def _names_tiles(text: str) -> bool:
    """Whether USD misses a file by a UDIM name, which none has, though its tiles are there."""
    found = re.search(r"@([^@]*<UDIM>[^@]*)@ found in layer @([^@]*)@", text)
    if found is None or (layer := Sdf.Layer.Find(found[2])) is None:
        return False
    return bool(UsdShade.UdimUtils.ResolveUdimPath(found[1], layer))


def open_layer(path: Path) -> Sdf.Layer:
    """The layer in a file. Raises InputError."""
    check_input(path)
    try:
        layer = Sdf.Layer.FindOrOpen(str(path))
    except Tf.ErrorException as problem:
        raise InputError(path, f"not a USD layer ({one_line_of(problem)})") from problem
    if layer is None:
        raise InputError(path, "not a USD layer")
    return layer


def _mask_path(stage: Path, name: str) -> Sdf.Path:
    path = Sdf.Path(name) if Sdf.Path.IsValidPathString(name) else Sdf.Path()
    if not (path.IsAbsolutePath() and path.IsAbsoluteRootOrPrimPath()):
        raise InputError(stage, f"--mask {name}: no prim path; want one like /World/Street")
    return path


def _warning(text: str) -> str:
    """A warning of USD in one line, without addresses of this process and how it came up."""
    text = re.sub(r"@anon:[^@]*@|\(instantiating stage on stage [^)]*\)", "", text)
    return " ".join(text.split())[:300]


def one_line_of(problem: Exception) -> str:
    """The first sentence that USD says, without its C++ places."""
    lines = [line.strip() for line in str(problem).splitlines() if "Error in" in line]
    text = lines[0].rpartition(" : ")[2] if lines else str(problem)
    return " ".join(text.split())[:200].strip("' ")
