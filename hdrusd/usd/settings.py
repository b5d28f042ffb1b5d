"""Render, eye and display settings on the stage: ``write_settings``, ``read_settings``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pxr import Gf, Sdf, Usd, UsdRender

from hdrusd.errors import InputError
from hdrusd.usd.camera import Conform

_API = "HdrusdEyeAPI"


@dataclass(frozen=True, slots=True)
class Settings:
    """What the stage says about its own picture; None where it is silent."""

    camera: str | None = None
    resolution: tuple[int, int] | None = None
    conform: Conform = "expandAperture"
    operator: str | None = None
    key: float | None = None
    white: float | None = None
    peak: float | None = None  # of the display, cd/m2
    black: float | None = None


def write_settings(stage: Usd.Stage, settings: Settings) -> None:
    """Define /Render/Settings and name it in the layer's metadata."""
    stage.DefinePrim("/Render", "Scope")
    prim = UsdRender.Settings.Define(stage, "/Render/Settings")
    if settings.camera:
        prim.CreateCameraRel().SetTargets([Sdf.Path(settings.camera)])
    if settings.resolution:
        prim.CreateResolutionAttr(Gf.Vec2i(*settings.resolution))
    stage.SetMetadata("renderSettingsPrimPath", "/Render/Settings")
    if settings.operator:
        owner = prim.GetPrim()
        owner.ApplyAPI(_API)
        types = Sdf.ValueTypeNames
        numbers = {
            "hdrusd:tonemap:key": settings.key,
            "hdrusd:tonemap:white": settings.white,
            "hdrusd:display:peak": settings.peak,
            "hdrusd:display:black": settings.black,
        }
        uniform = Sdf.VariabilityUniform
        owner.CreateAttribute("hdrusd:tonemap:operator", types.Token, False, uniform).Set(
            settings.operator
        )
        for name, value in numbers.items():
            if value is not None:
                owner.CreateAttribute(name, types.Float, False, uniform).Set(value)


def read_settings(stage: Usd.Stage, path: str | None = None) -> Settings:
    """Settings at ``path``, else at the stage's renderSettingsPrimPath, else none.

    Raises InputError when ``path`` is given and no RenderSettings.
    """
    prim = UsdRender.Settings.GetStageRenderSettings(stage).GetPrim() if path is None else None
    if path is not None:
        prim = stage.GetPrimAtPath(path)
        if not prim or not prim.IsA(UsdRender.Settings):
            raise InputError(
                Path(stage.GetRootLayer().identifier),
                f"{path}: no RenderSettings; see --renderSettingsPrimPath",
            )
    if not prim:
        return Settings()
    settings = UsdRender.Settings(prim)
    targets = settings.GetCameraRel().GetForwardedTargets()
    resolution = settings.GetResolutionAttr()

    def number(name: str) -> float | None:
        attribute = prim.GetAttribute(name)
        value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
        return float(value) if isinstance(value, (int, float)) else None

    operator = prim.GetAttribute("hdrusd:tonemap:operator")
    size = resolution.Get() if resolution.HasAuthoredValue() else None
    return Settings(
        camera=str(targets[0]) if targets else None,
        resolution=(int(size[0]), int(size[1])) if size else None,
        conform=str(settings.GetAspectRatioConformPolicyAttr().Get()),  # type: ignore[arg-type]
        operator=str(operator.Get()) if operator and operator.HasAuthoredValue() else None,
        key=number("hdrusd:tonemap:key"),
        white=number("hdrusd:tonemap:white") or None,
        peak=number("hdrusd:display:peak"),
        black=number("hdrusd:display:black"),
    )
