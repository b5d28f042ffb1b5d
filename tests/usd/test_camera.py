"""Cameras: field of view, windows, conform policies, units."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from builders import HERE, new_spec, new_stage
from hypothesis import given, settings
from hypothesis import strategies as st
from pxr import Gf, Usd, UsdGeom

from hdrusd.errors import InputError
from hdrusd.legacy import scene as legacy
from hdrusd.usd.camera import conform_aperture, framing_camera, read_camera, write_camera

TIME = Usd.TimeCode(0)


def read(prim: UsdGeom.Camera, aspect: float = 1.5, unit: float = 1.0, **more: Any) -> Any:
    world = prim.ComputeLocalToWorldTransform(TIME)
    return read_camera(prim.GetPrim(), TIME, world, meters_per_unit=unit, aspect=aspect, **more)


@settings(deadline=None)
@given(st.floats(1.0, 170.0), st.floats(0.2, 5.0), st.sampled_from([1.0, 0.01, 0.0254]))
def test_field_of_view_there_and_back(fov: float, aspect: float, unit: float) -> None:
    stage = new_stage(unit)
    source = legacy.Camera("Driver", HERE, fov_y=fov, aspect=aspect, near=0.5, far=100.0)
    write_camera(new_spec(stage, "/Driver", "Camera"), source, unit=1.0 / unit)
    prim = UsdGeom.Camera.Get(stage, "/Driver")
    back = read(prim, aspect, unit)
    left, right, bottom, top = back.window
    half = math.tan(math.radians(fov) / 2)
    # Aperture and focal length are float32: two roundings of 2^-24, and the division.
    assert top == pytest.approx(half, rel=2e-7)
    assert right == pytest.approx(half * aspect, rel=4e-7)
    assert (left, bottom) == (pytest.approx(-right), pytest.approx(-top))
    assert (back.near, back.far) == (pytest.approx(0.5, rel=1e-6), pytest.approx(100.0, rel=1e-6))
    lens = prim.GetCamera(TIME)
    assert lens.GetFieldOfView(Gf.Camera.FOVVertical) == pytest.approx(fov, rel=1e-5)


@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_an_orthographic_window_is_in_metres(unit: float) -> None:
    source = legacy.Camera("Plan", HERE, kind="orthographic", height=8.0, aspect=1.5)
    stage = new_stage(unit)
    write_camera(new_spec(stage, "/Plan", "Camera"), source, unit=1.0 / unit)
    prim = UsdGeom.Camera.Get(stage, "/Plan")
    back = read(prim, 1.5, unit)
    assert back.orthographic
    assert back.window == pytest.approx((-6.0, 6.0, -4.0, 4.0), rel=1e-6)


def test_place_and_axes_are_in_world_metres() -> None:
    stage = new_stage(0.01)
    parent = UsdGeom.Xform.Define(stage, "/Car")
    parent.AddScaleOp().Set(Gf.Vec3f(5.0))
    prim = UsdGeom.Camera.Define(stage, "/Car/Camera")
    prim.AddTranslateOp().Set(Gf.Vec3d(20, 40, 60))
    prim.AddRotateYOp().Set(90.0)  # looks along -X
    back = read(prim, 1.5, 0.01)
    assert back.eye == pytest.approx((1.0, 2.0, 3.0))
    assert back.back == pytest.approx((1.0, 0.0, 0.0), abs=1e-6)
    assert back.up == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)
    assert back.right == pytest.approx((0.0, 0.0, -1.0), abs=1e-6)


def test_an_offset_moves_the_window() -> None:
    prim = UsdGeom.Camera.Define(new_stage(), "/Camera")
    for name, value in (
        ("horizontalAperture", 30.0),
        ("verticalAperture", 20.0),
        ("horizontalApertureOffset", 3.0),
        ("verticalApertureOffset", -5.0),
        ("focalLength", 10.0),
    ):
        prim.GetPrim().GetAttribute(name).Set(value)
    assert read(prim, 1.5).window == pytest.approx((-1.2, 1.8, -1.5, 0.5))


@pytest.mark.parametrize(
    ("policy", "aspect", "wanted"),
    # Film of 30 x 20 in an image of another shape; UsdRenderSettings, aspectRatioConformPolicy.
    [
        ("expandAperture", 3.0, (60.0, 20.0)),
        ("expandAperture", 0.75, (30.0, 40.0)),
        ("cropAperture", 3.0, (30.0, 10.0)),
        ("cropAperture", 0.75, (15.0, 20.0)),
        ("adjustApertureWidth", 3.0, (60.0, 20.0)),
        ("adjustApertureHeight", 3.0, (30.0, 10.0)),
        ("adjustPixelAspectRatio", 3.0, (30.0, 20.0)),
    ],
)
def test_conform(policy: Any, aspect: float, wanted: tuple[float, float]) -> None:
    assert conform_aperture(30.0, 20.0, aspect, policy) == pytest.approx(wanted)


def test_exposure_only_where_somebody_wrote_it() -> None:
    prim = UsdGeom.Camera.Define(new_stage(), "/Camera")
    assert read(prim).exposure_scale is None
    prim.GetPrim().GetAttribute("exposure").Set(3.0)
    assert read(prim).exposure_scale == pytest.approx(8.0)


def test_an_animated_lens_is_read_at_its_time() -> None:
    prim = UsdGeom.Camera.Define(new_stage(), "/Camera")
    focal = prim.GetFocalLengthAttr()
    focal.Set(10.0, 0.0)
    focal.Set(30.0, 2.0)
    prim.CreateVerticalApertureAttr(20.0)
    prim.CreateHorizontalApertureAttr(30.0)
    back = read_camera(
        prim.GetPrim(), Usd.TimeCode(1.0), Gf.Matrix4d(1), meters_per_unit=1.0, aspect=1.5
    )
    assert back.window[3] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("focalLength", 0.0),
        ("focalLength", math.nan),
        ("horizontalAperture", 0.0),
        ("verticalAperture", -1.0),
        ("verticalApertureOffset", math.inf),
        ("clippingRange", Gf.Vec2f(math.nan, 1.0)),
    ],
)
def test_a_lens_that_makes_no_picture_is_one_line(name: str, value: Any) -> None:
    prim = UsdGeom.Camera.Define(new_stage(), "/Camera")
    prim.GetPrim().GetAttribute(name).Set(value)
    with pytest.raises(InputError, match="/Camera: "):
        read(prim)


@pytest.mark.parametrize("up", ["Y", "Z"])
@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
def test_a_camera_that_frames_sees_all_corners(up: str, aspect: float) -> None:
    low, high = np.array([-3.0, 10.0, -1.0]), np.array([4.0, 12.0, 60.0])
    camera = framing_camera(low, high, up, aspect)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    view = np.c_[low + corners * (high - low), np.ones(8)] @ camera.world_to_view()
    depth = -view[:, 2]
    assert (depth > camera.near).all()
    assert (depth < camera.far).all()
    left, right, bottom, top = camera.window
    assert ((view[:, 0] / depth > left) & (view[:, 0] / depth < right)).all()
    assert ((view[:, 1] / depth > bottom) & (view[:, 1] / depth < top)).all()
    assert np.dot(camera.up, (0, 1, 0) if up == "Y" else (0, 0, 1)) > 0.5


def test_a_stage_of_one_point_can_be_framed() -> None:
    camera = framing_camera(np.zeros(3), np.zeros(3), "Y", 1.5)
    assert np.isfinite(camera.eye).all()
    assert 0.0 < camera.near < camera.far
