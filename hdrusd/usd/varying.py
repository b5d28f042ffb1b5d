"""What of a prim may change from frame to frame, and whether it is seen in one."""

from __future__ import annotations

from pxr import Usd, UsdGeom


def visible(prim: Usd.Prim, code: Usd.TimeCode) -> bool:
    """Whether the prim and all above it are shown at a time."""
    return bool(UsdGeom.Imageable(prim).ComputeVisibility(code) != UsdGeom.Tokens.invisible)


def hides(prim: Usd.Prim) -> bool:
    """Whether the visibility of the prim or of one above it may change in time."""
    while prim and not prim.IsPseudoRoot():
        imageable = UsdGeom.Imageable(prim)
        if imageable and imageable.GetVisibilityAttr().ValueMightBeTimeVarying():
            return True
        prim = prim.GetParent()
    return False


def place_varies(prim: Usd.Prim) -> bool:
    """Whether any transform from the prim up to the root may change in time."""
    while prim and not prim.IsPseudoRoot():
        xformable = UsdGeom.Xformable(prim)
        if xformable and xformable.TransformMightBeTimeVarying():
            return True
        prim = prim.GetParent()
    return False
