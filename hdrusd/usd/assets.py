"""Where the files that a stage names are."""

from __future__ import annotations

from pathlib import Path

from pxr import Ar, Sdf, Usd, UsdShade


def resolved_asset(attribute: Usd.Attribute, asset: Sdf.AssetPath) -> str:
    """The path that an asset attribute resolves to; what it says when nothing is there.

    A path inside a package keeps USD's form, ``car.usdz[textures/a.png]``. One with
    ``<UDIM>`` names no file: it is what leads to its tiles.
    """
    if asset.resolvedPath:
        return str(asset.resolvedPath)
    tiled = UsdShade.UdimUtils.IsUdimIdentifier(asset.path)
    for spec in attribute.GetPropertyStack(Usd.TimeCode.Default()):
        if tiled and (found := UsdShade.UdimUtils.ResolveUdimPath(asset.path, spec.layer)):
            return str(found)
        anchored = Sdf.ComputeAssetPathRelativeToLayer(spec.layer, asset.path)
        resolved = Ar.GetResolver().Resolve(anchored)
        return str(resolved) if resolved else anchored
    return str(asset.path)


def in_package(path: str) -> bool:
    """Whether a path leads into a package; a bracket in a file's name does not make it one."""
    return bool(Ar.IsPackageRelativePath(path))


def file_on_disk(path: str) -> Path:
    """The file that a path leads to, or the package that it leads into."""
    return Path(Ar.SplitPackageRelativePathOuter(path)[0])


def asset_bytes(path: str) -> bytes | None:
    """The bytes of a file or of a file in a package; None when there is none."""
    if not in_package(path):
        file = Path(path)
        return file.read_bytes() if file.is_file() else None
    opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(path))
    if not opened:
        return None
    buffer = opened.GetBuffer()
    return bytes(buffer) if buffer is not None else None
