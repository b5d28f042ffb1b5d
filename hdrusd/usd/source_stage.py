"""A stage as the source of a conversion: opened below its roots, laid under an overlay.

USD opens whatever a layer names, wherever it lies. A conversion reads only below the
declared roots, so the layers outside are muted before the stage is composed.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path

from pxr import Ar, Sdf, Tf, Usd, UsdGeom

from hdrusd.errors import InputError, SourceRef
from hdrusd.report import Kind, Report
from hdrusd.usd.opening import one_line_of, usd_warnings

#: Suffixes of the sources that are stages already.
STAGES = (".usda", ".usdc", ".usd", ".usdz")

#: What of a root layer is not its stage's: how it is put together, and notes about the file.
_OF_THE_LAYER = frozenset(
    {"subLayers", "subLayerOffsets", "layerRelocates", "comment", "documentation"}
    | {"primChildren", "primOrder", "owner", "sessionOwner", "hasOwnedSubLayers"}
)

#: A path inside a package: "car.usdz[textures/a.png]".
_PACKAGE = "["


def open_source(path: Path, allowed: Callable[[Path], bool], report: Report) -> Usd.Stage:
    """The stage at ``path``, as a sublayer of an anonymous one; edits of it touch no file.

    ``allowed``: whether a file lies below the roots; layers elsewhere are muted, with a
    finding each. Raises InputError where ``path`` is no layer.
    """
    with usd_warnings(path, report):
        layer = _opened(path)
        root = Sdf.Layer.CreateAnonymous("source.usda")
        copy_stage_metadata(layer, root)
        stage = Usd.Stage.Open(root, Sdf.Layer.CreateAnonymous("source-session.usda"))
        refused = _outside(layer, allowed)
        stage.MuteAndUnmuteLayers(refused, [])
        root.subLayerPaths.append(layer.identifier)
        # What an expression names is known only when it is composed.
        late = [x.identifier for x in stage.GetUsedLayers() if not _inside(x, allowed)]
        stage.MuteAndUnmuteLayers(late, [])
    for identifier in (*refused, *sorted(late)):
        text = f"{identifier}: outside the declared roots; not converted. See --root"
        report.add(Kind.MISSING, "file-refused", SourceRef(path), "layer", text)
    return stage


def source_layer(stage: Usd.Stage) -> Sdf.Layer:
    """The source's own root layer of a stage of ``open_source``."""
    return Sdf.Layer.Find(stage.GetRootLayer().subLayerPaths[0])


def copy_stage_metadata(source: Sdf.Layer, target: Sdf.Layer) -> None:
    """What USD reads of a stage's root layer alone: units, axis, times, settings, colours.

    Unit and axis are stated even where the source leaves them to USD's fallback, whose
    meaning is the same: a stage that does not say is not valid.
    """
    here, there = source.pseudoRoot, target.pseudoRoot
    for key in here.ListInfoKeys():
        if key not in _OF_THE_LAYER:
            there.SetInfo(key, here.GetInfo(key))
    if not there.HasInfo("metersPerUnit"):
        there.SetInfo("metersPerUnit", UsdGeom.LinearUnits.centimeters)
    if not there.HasInfo("upAxis"):
        there.SetInfo("upAxis", UsdGeom.GetFallbackUpAxis())


def copy_time_metadata(source: Sdf.Layer, target: Sdf.Layer) -> None:
    """The rate of a layer's time codes: where layers differ in it, USD stretches time."""
    here = source.pseudoRoot
    for key in ("timeCodesPerSecond", "framesPerSecond"):
        if here.HasInfo(key):
            target.pseudoRoot.SetInfo(key, here.GetInfo(key))


def files_of(stage: Usd.Stage) -> list[Path]:
    """The files of all layers that a stage is made of, packages once."""
    layers = (layer for layer in stage.GetUsedLayers() if not layer.anonymous)
    return sorted({_file(layer.realPath or layer.identifier) for layer in layers})


def _inside(layer: Sdf.Layer, allowed: Callable[[Path], bool]) -> bool:
    return layer.anonymous or allowed(_file(layer.realPath or layer.identifier))


def _outside(layer: Sdf.Layer, allowed: Callable[[Path], bool]) -> list[str]:
    """Identifiers of existing layers outside the roots that the layers inside name."""
    refused: list[str] = []
    known, pending = {layer.identifier}, [layer]
    while pending:
        above = pending.pop()
        for asset in sorted(above.GetCompositionAssetDependencies()):
            identifier = Sdf.ComputeAssetPathRelativeToLayer(above, asset) if asset else ""
            if not identifier or identifier in known:
                continue
            known.add(identifier)
            resolved = str(Ar.GetResolver().Resolve(identifier))
            if not resolved:
                continue  # USD says so
            if not allowed(_file(resolved)):
                refused.append(identifier)
                continue
            with contextlib.suppress(Tf.ErrorException):  # USD says so where it is used
                found = Sdf.Layer.FindOrOpen(identifier)
                if found is not None:
                    pending.append(found)
    return refused


def _opened(path: Path) -> Sdf.Layer:
    """The root layer. Raises InputError."""
    try:
        layer = Sdf.Layer.FindOrOpen(str(path))
    except Tf.ErrorException as problem:
        raise InputError(path, f"not a USD layer ({one_line_of(problem)})") from problem
    if layer is None:
        raise InputError(path, "not a USD layer")
    return layer


def _file(path: str) -> Path:
    return Path(path.split(_PACKAGE)[0])
