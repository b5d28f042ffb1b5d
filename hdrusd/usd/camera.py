"""Cameras: ``write_camera`` from the legacy record, ``read_camera`` into a pinhole in metres."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom

from hdrusd.errors import InputError
from hdrusd.legacy import scene as legacy
from hdrusd.scene import Camera, Doubles
from hdrusd.usd.specs import attribute

#: Width of the film that we write, in tenths of a scene unit (36 mm in a metre stage: 0.36).
_FILM_WIDTH = 36.0

#: Surplus of surface to one side of an axis that decides on which side a framing camera stands.
_CLEAR = 0.1

Conform = Literal[
    "expandAperture",
    "cropAperture",
    "adjustApertureWidth",
    "adjustApertureHeight",
    "adjustPixelAspectRatio",
]


def write_camera(prim: Sdf.PrimSpec, camera: legacy.Camera, *, unit: float) -> None:
    """What a UsdGeomCamera says. ``unit``: scene units a source unit, for the clipping range.

    Only the ratio of aperture and focal length means anything to a pinhole; the
    usual 36 mm film is written, so that a focal length reads as people expect.
    """
    types = Sdf.ValueTypeNames
    aspect = camera.aspect or 16.0 / 9.0
    width = _FILM_WIDTH
    if camera.kind == "orthographic":
        attribute(prim, "projection", types.Token, "orthographic")
        width = camera.height * aspect * unit * 10.0  # apertures are tenths of a scene unit
    else:
        half = math.tan(math.radians(camera.fov_y) / 2.0)
        attribute(prim, "focalLength", types.Float, _FILM_WIDTH / aspect / 2.0 / half)
    height = camera.height * unit * 10.0 if camera.kind == "orthographic" else width / aspect
    attribute(prim, "horizontalAperture", types.Float, width)
    attribute(prim, "verticalAperture", types.Float, height)
    clipping = Gf.Vec2f(camera.near * unit, camera.far * unit)
    attribute(prim, "clippingRange", types.Float2, clipping)


def read_camera(
    prim: Usd.Prim,
    time: Usd.TimeCode,
    world: Gf.Matrix4d,
    *,
    meters_per_unit: float,
    aspect: float,
    conform: Conform = "expandAperture",
) -> Camera:
    """The camera at ``time``. ``aspect``: image width / height, to which the window is conformed.

    ``world``: the prim's local to world matrix in scene units; its scale is
    ignored, as UsdGeomCamera says. Raises InputError where no picture can be made.
    """
    camera = UsdGeom.Camera(prim)
    rotation = np.array(world.ExtractRotationMatrix().GetOrthonormalized(), np.float64)
    eye = np.array(world.ExtractTranslation()) * meters_per_unit
    width = float(camera.GetHorizontalApertureAttr().Get(time))
    height = float(camera.GetVerticalApertureAttr().Get(time))
    x = float(camera.GetHorizontalApertureOffsetAttr().Get(time))
    y = float(camera.GetVerticalApertureOffsetAttr().Get(time))
    orthographic = camera.GetProjectionAttr().Get(time) == UsdGeom.Tokens.orthographic
    # The window at distance 1; orthographic apertures are tenths of a scene unit.
    focal = float(camera.GetFocalLengthAttr().Get(time))
    divisor = 10.0 / meters_per_unit if orthographic else focal or math.nan
    near, far = (float(v) * meters_per_unit for v in camera.GetClippingRangeAttr().Get(time))
    if not (min(width, height, divisor) > 0.0 and math.isfinite(width + height + x + y + divisor)):
        raise InputError(
            Path(prim.GetStage().GetRootLayer().identifier),
            f"{prim.GetPath()}: aperture {width:g} x {height:g}, focal length {divisor:g}; "
            "want finite numbers above 0",
        )
    if not math.isfinite(near + far + eye.sum() + rotation.sum()):
        raise InputError(
            Path(prim.GetStage().GetRootLayer().identifier),
            f"{prim.GetPath()}: place or clipping range is not finite",
        )
    width, height = conform_aperture(width, height, aspect, conform)
    window = (x - width / 2, x + width / 2, y - height / 2, y + height / 2)
    return Camera(
        eye=_vec(eye),
        right=_vec(rotation[0]),
        up=_vec(rotation[1]),
        back=_vec(rotation[2]),
        window=(
            window[0] / divisor,
            window[1] / divisor,
            window[2] / divisor,
            window[3] / divisor,
        ),
        near=max(near, 1e-4),
        far=far if far > max(near, 1e-4) else max(near, 1e-4) * 1e5,  # nothing is cut off
        orthographic=bool(orthographic),
        exposure_scale=_exposure_scale(camera, time),
        name=str(prim.GetPath()),
    )


def conform_aperture(
    width: float, height: float, aspect: float, policy: Conform
) -> tuple[float, float]:
    """Film size for an image of ``aspect``; UsdRender's aspectRatioConformPolicy."""
    if policy == "adjustPixelAspectRatio" or height <= 0.0 or width <= 0.0:
        return width, height
    wider = width / height > aspect
    fit_width = {
        "adjustApertureHeight": True,
        "adjustApertureWidth": False,
        "expandAperture": wider,
        "cropAperture": not wider,
    }[policy]
    return (width, width / aspect) if fit_width else (height * aspect, height)


def framing_camera(
    low: Doubles, high: Doubles, up: str, aspect: float, front: Doubles | None = None
) -> Camera:
    """A camera that sees a whole box (m), for stages without one, as usdrecord makes one.

    60 degrees wide or high, whichever is less, from the front and somewhat above.
    ``front``: where the surfaces face, 0 to 1 long (``facing``); along an axis where that is
    clear the camera stands on their side, so that a sheet is not seen from its dark back.
    """
    centre = (low + high) / 2
    radius = max(float(np.linalg.norm(high - low)) / 2, 1e-3)
    half = math.tan(math.radians(30.0))
    direction = np.array([0.45, 0.35, 1.0]) if up == "Y" else np.array([0.45, -1.0, 0.35])
    if front is not None:
        direction = np.where(np.abs(front) > _CLEAR, np.copysign(direction, front), direction)
    back = direction / np.linalg.norm(direction)
    vertical = np.array([0.0, 1.0, 0.0] if up == "Y" else [0.0, 0.0, 1.0])
    right = np.cross(vertical, back)
    right /= np.linalg.norm(right)
    eye = centre + back * radius / math.sin(math.radians(30.0))
    w, h = (half * aspect, half) if aspect > 1.0 else (half, half / aspect)
    return Camera(
        eye=_vec(eye),
        right=_vec(right),
        up=_vec(np.cross(back, right)),
        back=_vec(back),
        window=(-w, w, -h, h),
        near=radius / 100.0,
        far=radius * 10.0,
        name="(frames the stage)",
        framing=True,
    )


def _exposure_scale(camera: UsdGeom.Camera, time: Usd.TimeCode) -> float | None:
    names = ("exposure", "exposure:iso", "exposure:time", "exposure:fStop", "exposure:responsivity")
    prim = camera.GetPrim()
    if not any(a.HasAuthoredValue() for n in names if (a := prim.GetAttribute(n))):
        return None
    return float(camera.ComputeLinearExposureScale(time))


def _vec(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z
