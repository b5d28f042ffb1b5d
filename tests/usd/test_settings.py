"""Render and eye settings there and back."""

from __future__ import annotations

import pytest
from builders import new_stage
from pxr import Gf, UsdGeom, UsdRender

from hdrusd.errors import InputError
from hdrusd.usd.settings import Settings, read_settings, write_settings

WHOLE = Settings(
    camera="/Street/Camera",
    resolution=(640, 360),
    operator="reinhard02",
    key=0.25,
    white=1024.0,
    peak=100.0,
    black=0.5,
)


def test_what_is_written_is_read() -> None:
    stage = new_stage()
    write_settings(stage, WHOLE)
    assert read_settings(stage) == WHOLE
    assert read_settings(stage, "/Render/Settings") == WHOLE
    prim = stage.GetPrimAtPath("/Render/Settings")
    assert prim.IsA(UsdRender.Settings)
    assert prim.HasAPI("HdrusdEyeAPI")
    assert stage.GetMetadata("renderSettingsPrimPath") == "/Render/Settings"


def test_what_is_not_said_is_none() -> None:
    stage = new_stage()
    assert read_settings(stage) == Settings()
    write_settings(stage, Settings())
    assert read_settings(stage) == Settings()
    assert not stage.GetPrimAtPath("/Render/Settings").HasAPI("HdrusdEyeAPI")


def test_a_white_of_zero_is_none() -> None:
    stage = new_stage()
    write_settings(stage, Settings(operator="reinhard02", white=0.0))
    assert read_settings(stage).white is None


def test_a_strangers_settings() -> None:
    stage = new_stage()
    UsdGeom.Camera.Define(stage, "/A")
    settings = UsdRender.Settings.Define(stage, "/Render/Wide")
    settings.CreateResolutionAttr(Gf.Vec2i(200, 100))
    settings.CreateCameraRel().SetTargets(["/A"])
    settings.CreateAspectRatioConformPolicyAttr("cropAperture")
    assert read_settings(stage) == Settings()  # nobody named it
    got = read_settings(stage, "/Render/Wide")
    assert got == Settings(camera="/A", resolution=(200, 100), conform="cropAperture")
    stage.SetMetadata("renderSettingsPrimPath", "/Render/Wide")
    assert read_settings(stage) == got


@pytest.mark.parametrize("path", ["/None", "/A"])
def test_a_path_that_is_no_settings_is_one_line(path: str) -> None:
    stage = new_stage()
    UsdGeom.Camera.Define(stage, "/A")
    with pytest.raises(InputError, match=f"{path}: no RenderSettings"):
        read_settings(stage, path)
