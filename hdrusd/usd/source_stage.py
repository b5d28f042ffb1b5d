"""A stage as the source of a conversion: opened below its roots, laid under an overlay.

USD opens whatever a layer names, wherever it lies. A conversion reads only below the
declared roots, so the layers outside are muted before the stage is composed. Muting alone
does not keep USD from opening them (a muted sublayer is opened as the stage learns of it, value
clips cannot be muted, validators compose anew): an empty layer in memory has the place of each
as long as the stage lives.
"""

from __future__ import annotations

import contextlib
import weakref
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from pxr import Ar, Sdf, Tf, Usd, UsdGeom, UsdUtils

from hdrusd.errors import InputError, SourceRef
from hdrusd.report import Kind, Report
from hdrusd.usd.assets import file_on_disk
from hdrusd.usd.opening import open_layer, usd_warnings

#: Suffixes of the sources that are stages already.
STAGES = (".usda", ".usdc", ".usd", ".usdz")

#: What of a root layer is not its stage's: how it is put together, and notes about the file.
_OF_THE_LAYER = frozenset(
    {"subLayers", "subLayerOffsets", "layerRelocates", "comment", "documentation"}
    | {"primChildren", "primOrder", "owner", "sessionOwner", "hasOwnedSubLayers"}
)


def open_source(path: Path, allowed: Callable[[Path], bool], report: Report) -> Usd.Stage:
    """The stage at ``path``, as a sublayer of an anonymous one; edits of it touch no file.

    ``allowed``: whether a file lies below the roots; layers elsewhere are muted and not opened,
    with a finding each. Raises InputError where ``path`` is no layer.
    """
    with usd_warnings(path, report):
        layer = open_layer(path)
        root = Sdf.Layer.CreateAnonymous("source.usda")
        copy_stage_metadata(layer, root)
        stage = Usd.Stage.Open(root, Sdf.Layer.CreateAnonymous("source-session.usda"))
        refused = _outside(layer, allowed)
        stand_ins = [_stand_in(path, identifier) for identifier in refused]
        weakref.finalize(stage, stand_ins.clear)
        stage.MuteAndUnmuteLayers(refused, [])
        root.subLayerPaths.append(layer.identifier)
        # An expression may name something else where it is composed than where it stands.
        late = [x.identifier for x in stage.GetUsedLayers() if not _inside(x, allowed)]
        stage.MuteAndUnmuteLayers(late, [])
    for identifier in (*refused, *sorted(late)):
        folder = file_on_disk(Sdf.Layer.SplitIdentifier(identifier)[0]).parent
        text = f"{identifier}: outside the declared roots; not converted; --root {folder} would "
        text += "allow it"
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
    return sorted({file_on_disk(layer.realPath or layer.identifier) for layer in layers})


def _inside(layer: Sdf.Layer, allowed: Callable[[Path], bool]) -> bool:
    return layer.anonymous or allowed(file_on_disk(layer.realPath or layer.identifier))


def _outside(layer: Sdf.Layer, allowed: Callable[[Path], bool]) -> list[str]:
    """Identifiers of existing layers outside the roots that the layers inside name."""
    refused: list[str] = []
    known = {layer.identifier}
    pending: list[tuple[Sdf.Layer, Mapping[str, Any]]] = [(layer, {})]
    while pending:
        above, stated = pending.pop()
        variables = {**above.expressionVariables, **stated}
        for asset in _named_layers(above, variables):
            identifier = Sdf.ComputeAssetPathRelativeToLayer(above, asset)
            if not identifier or identifier in known:
                continue
            known.add(identifier)
            location, _ = Sdf.Layer.SplitIdentifier(identifier)  # arguments for its format
            resolved = str(Ar.GetResolver().Resolve(location))
            if not resolved:
                continue  # USD says so
            if not allowed(file_on_disk(resolved)):
                refused.append(identifier)
                continue
            with contextlib.suppress(Tf.ErrorException):  # USD says so where it is used
                found = Sdf.Layer.FindOrOpen(identifier)
                if found is not None:
                    pending.append((found, variables))
    return refused


def _named_layers(layer: Sdf.Layer, variables: Mapping[str, Any]) -> Iterator[str]:
    """What a layer is composed with, in any variant, and its value clips; as it writes them.

    ``variables``: values for its expressions.
    """
    _, everything, _ = UsdUtils.ExtractExternalReferences(layer.identifier)
    inmost = {asset: Ar.SplitPackageRelativePathInner(asset)[1] or asset for asset in everything}
    clips = [asset for asset, name in inmost.items() if Path(name).suffix.lower() in STAGES]
    for asset in sorted({*layer.GetCompositionAssetDependencies(), *clips}):
        if Sdf.VariableExpression.IsExpression(asset):
            value = Sdf.VariableExpression(asset).Evaluate(dict(variables)).value
            if isinstance(value, str) and value:
                yield value
        elif asset:
            yield asset


def _stand_in(path: Path, identifier: str) -> Sdf.Layer:
    """An empty layer of memory that USD finds in the place of a file. Raises InputError."""
    found = Sdf.Layer.Find(identifier)  # of another stage of this process
    if found is not None:
        return found
    try:
        return Sdf.Layer.New(Sdf.FileFormat.FindById("usda"), identifier)
    except Tf.ErrorException as problem:  # within a package, or with arguments for its format
        text = f"{identifier}: outside the declared roots; want it inside, or --root"
        raise InputError(path, text) from problem
