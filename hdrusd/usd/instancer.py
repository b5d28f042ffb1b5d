"""PointInstancers: what each draws, and the matrices of its copies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pxr import Usd, UsdGeom

from hdrusd.errors import SourceRef
from hdrusd.report import Kind, Report
from hdrusd.usd.lux import is_light


def instancer_content(
    prim: Usd.Prim, time: Usd.TimeCode, purposes: Iterable[str], report: Report
) -> Iterator[tuple[Usd.Prim, npt.NDArray[np.float64]]]:
    """Each gprim and light of the prototypes, with (k, 4, 4) row-vector matrices of its copies.

    The matrices lead to the instancer's space. Copies masked out or invisible are
    left out. Instancers inside instancers are findings.
    """
    instancer = UsdGeom.PointInstancer(prim)
    place = SourceRef(Path(prim.GetStage().GetRootLayer().identifier))
    indices = np.asarray(instancer.GetProtoIndicesAttr().Get(time) or [], np.int64)
    matrices = instancer.ComputeInstanceTransformsAtTime(
        time, time, UsdGeom.PointInstancer.IncludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
    )
    transforms = np.asarray(matrices, np.float64).reshape(-1, 4, 4)
    if len(transforms) != len(indices):
        report.add(
            Kind.INVALID,
            "instancer-arrays",
            place,
            str(prim.GetPath()),
            f"{len(indices)} prototype indices, {len(transforms)} positions; not drawn",
        )
        return
    mask = instancer.ComputeMaskAtTime(time)
    shown = np.asarray(mask, np.bool_) if mask else np.ones(len(indices), np.bool_)
    cache = UsdGeom.XformCache(time)
    for number, target in enumerate(instancer.GetPrototypesRel().GetForwardedTargets()):
        copies = transforms[(indices == number) & shown]
        root = prim.GetStage().GetPrimAtPath(target)
        if not root:
            report.add(
                Kind.MISSING,
                "instancer-prototype",
                place,
                str(prim.GetPath()),
                f"prototype {target} is not there",
            )
        if not root or not len(copies):
            continue
        for source in Usd.PrimRange(root, Usd.TraverseInstanceProxies()):
            imageable = UsdGeom.Imageable(source)
            if source.IsA(UsdGeom.PointInstancer):
                report.add(
                    Kind.DROPPED,
                    "instancer-content",
                    place,
                    str(source.GetPath()),
                    f"{source.GetTypeName()} inside a PointInstancer is not shown",
                )
            elif (
                (source.IsA(UsdGeom.Gprim) or is_light(source))
                and imageable.ComputePurpose() in purposes
                and imageable.ComputeVisibility(time) != UsdGeom.Tokens.invisible
            ):
                # IncludeProtoXform has put the root's own transform into the copies.
                inside, _ = cache.ComputeRelativeTransform(source, root)
                yield source, np.array(inside, np.float64) @ copies
