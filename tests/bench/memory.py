"""``python -m tests.bench.memory [FRAMES] [--size W H]``: what a long sequence holds on to.

A stage in which everything moves that can: a car with headlights, a walking figure of joints,
a cloth whose number of faces changes, lamps that are switched, a profile that opens and
closes, an area light and a sky that turns. Every hundred frames the resident memory of the
process is noted, how many buffers, textures, vertex arrays, framebuffers and programs it holds,
and how many of them were forgotten without being released, which OpenGL would keep for ever.
"""

from __future__ import annotations

import argparse
import gc
import math
import os
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import moderngl
import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, UsdSkel, Vt

from hdrusd.gpu.context import create_context
from hdrusd.images import write_exr, write_png
from hdrusd.job import Job
from hdrusd.render import render_sequence
from hdrusd.report import Report

EVERY = 100
KINDS = (
    moderngl.Buffer,
    moderngl.Texture,
    moderngl.VertexArray,
    moderngl.Framebuffer,
    moderngl.Program,
)
LAMPS = 80  # more than are drawn one by one

_LUMINAIRE = """IESNA:LM-63-2002
TILT=NONE
1 -1 1 4 1 1 2 0 0 0
1 1 10
0 20 40 60
0
500 400 200 0
"""


def write_stage(folder: Path, frames: int) -> Path:
    """A stage of ``frames`` time codes below ``folder``."""
    (folder / "lamp.ies").write_text(_LUMINAIRE, encoding="ascii")
    checks = np.indices((32, 32)).sum(axis=0) % 2 * 150 + 60
    write_png(folder / "checks.png", np.repeat(checks.astype(np.uint8)[..., None], 3, axis=2))
    sky = np.full((16, 32, 3), 0.2, np.float32)
    sky[3, 5] = 500.0
    write_exr(folder / "sky.exr", sky)
    path = folder / "stage.usda"
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(frames - 1)
    _camera(stage)
    _ground(stage)
    _car(stage, frames)
    _figure(stage, frames)
    _cloth(stage, frames)
    _lamps(stage, frames)
    stage.GetRootLayer().Save()
    return path


def _camera(stage: Usd.Stage) -> None:
    camera = UsdGeom.Camera.Define(stage, "/Camera")
    camera.AddTranslateOp().Set(Gf.Vec3d(0, -14, 5))
    camera.AddRotateXOp().Set(72.0)
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.1, 200.0))
    camera.CreateHorizontalApertureAttr(36.0)
    camera.CreateVerticalApertureAttr(20.25)
    camera.CreateFocalLengthAttr(24.0)


def _ground(stage: Usd.Stage) -> None:
    mesh = _mesh(stage, "/Ground", [(-20, -20, 0), (20, -20, 0), (20, 20, 0), (-20, 20, 0)], [4])
    st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex")
    st.Set([(0, 0), (20, 0), (20, 20), (0, 20)])
    material = UsdShade.Material.Define(stage, "/Looks/Checks")
    surface = UsdShade.Shader.Define(stage, "/Looks/Checks/Surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    texture = UsdShade.Shader.Define(stage, "/Looks/Checks/Texture")
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set("./checks.png")
    texture.CreateInput("wrapS", Sdf.ValueTypeNames.Token).Set("repeat")
    texture.CreateInput("wrapT", Sdf.ValueTypeNames.Token).Set("repeat")
    out = texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(out)
    output = surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput().ConnectToSource(output)
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)


def _car(stage: Usd.Stage, frames: int) -> None:
    car = UsdGeom.Xform.Define(stage, "/Car")
    place = car.AddTranslateOp()
    for t in range(0, frames, 50):
        place.Set(Gf.Vec3d(6.0 * math.sin(t / 40.0), 2.0, 0.6), t)
    body = UsdGeom.Cube.Define(stage, "/Car/Body")
    body.AddScaleOp().Set(Gf.Vec3f(2.0, 0.8, 0.5))
    glass = UsdGeom.Cube.Define(stage, "/Car/Glass")
    glass.AddTranslateOp().Set(Gf.Vec3d(0, 0, 0.9))
    glass.AddScaleOp().Set(Gf.Vec3f(1.0, 0.7, 0.4))
    glass.CreateDisplayOpacityAttr([0.4])
    for side in (-0.5, 0.5):
        lamp = UsdLux.SphereLight.Define(stage, f"/Car/Head{'L' if side < 0 else 'R'}")
        lamp.AddTranslateOp().Set(Gf.Vec3d(2.2, side, 0.2))
        lamp.AddRotateYOp().Set(-80.0)
        lamp.CreateIntensityAttr(500000.0)
        lamp.CreateRadiusAttr(0.05)
        UsdLux.ShapingAPI.Apply(lamp.GetPrim()).CreateShapingConeAngleAttr(25.0)


def _figure(stage: Usd.Stage, frames: int) -> None:
    UsdSkel.Root.Define(stage, "/Figure")
    skeleton = UsdSkel.Skeleton.Define(stage, "/Figure/Skeleton")
    skeleton.CreateJointsAttr(["A", "A/B"])
    up = Gf.Matrix4d().SetTranslate(Gf.Vec3d(0, 0, 1))
    skeleton.CreateBindTransformsAttr([Gf.Matrix4d(1), up])
    skeleton.CreateRestTransformsAttr([Gf.Matrix4d(1), up])
    animation = UsdSkel.Animation.Define(stage, "/Figure/Walk")
    animation.CreateJointsAttr(["A", "A/B"])
    animation.CreateTranslationsAttr([Gf.Vec3f(-3, 0, 0), Gf.Vec3f(0, 0, 1)])
    animation.CreateScalesAttr([Gf.Vec3h(1), Gf.Vec3h(1)])
    rotations = animation.CreateRotationsAttr()
    for t in range(0, frames, 10):
        half = 0.4 * math.sin(t / 7.0)
        bent = Gf.Quatf(math.cos(half), math.sin(half), 0, 0)
        rotations.Set([Gf.Quatf(1, 0, 0, 0), bent], t)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets(
        ["/Figure/Walk"]
    )
    x, z = (a.ravel() for a in np.meshgrid(np.linspace(-0.5, 0.5, 11), np.linspace(0, 2, 21)))
    points = np.stack([x, np.zeros_like(x), z], axis=1)
    at = np.arange(231).reshape(21, 11)
    faces = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1)
    mesh = _mesh(stage, "/Figure/Body", points.tolist(), [4] * 200, faces.tolist())
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets(["/Figure/Skeleton"])
    binding.CreateJointIndicesPrimvar(False, 1).Set((z > 1.0).astype(int).tolist())
    binding.CreateJointWeightsPrimvar(False, 1).Set([1.0] * 231)


def _cloth(stage: Usd.Stage, frames: int) -> None:
    mesh = _mesh(stage, "/Cloth", [(0, 0, 0)], [1], [0])
    for t in range(0, frames, 20):
        side = 2 + t // 20 % 12
        a, b = np.meshgrid(np.linspace(0, 2, side), np.linspace(0, 2, side))
        z = 1.0 + 0.2 * np.sin(3.0 * a + t / 5.0)
        points = np.stack([a.ravel() + 3.0, b.ravel() - 2.0, z.ravel()], axis=1)
        at = np.arange(side * side).reshape(side, side)
        faces = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1)
        mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)), t)
        mesh.GetFaceVertexCountsAttr().Set([4] * (side - 1) ** 2, t)
        mesh.GetFaceVertexIndicesAttr().Set(faces.reshape(-1).tolist(), t)


def _lamps(stage: Usd.Stage, frames: int) -> None:
    for i in range(LAMPS):
        lamp = UsdLux.SphereLight.Define(stage, f"/Lamps/Lamp{i}")
        lamp.AddTranslateOp().Set(Gf.Vec3d(-19 + 38 * (i % 10) / 9, -19 + 38 * (i // 10) / 7, 3))
        lamp.CreateIntensityAttr(8000.0)
        lamp.CreateRadiusAttr(0.05)
        visibility = lamp.CreateVisibilityAttr()
        for t in range(0, frames, 25):
            visibility.Set("inherited" if (t // 25 + i) % 3 else "invisible", t)
    profile = UsdLux.SphereLight.Define(stage, "/Lamps/Profile")
    profile.AddTranslateOp().Set(Gf.Vec3d(0, 0, 4))
    profile.CreateIntensityAttr(127.3)
    profile.CreateRadiusAttr(0.05)
    shaping = UsdLux.ShapingAPI.Apply(profile.GetPrim())
    shaping.CreateShapingConeAngleAttr(180.0)
    shaping.CreateShapingIesFileAttr("./lamp.ies")
    scale = shaping.CreateShapingIesAngleScaleAttr()
    for t in range(0, frames, 5):
        scale.Set(0.4 * math.sin(t / 9.0), t)
    area = UsdLux.RectLight.Define(stage, "/Lamps/Area")
    area.AddTranslateOp().Set(Gf.Vec3d(4, 4, 3))
    turn = area.AddRotateZOp()
    for t in range(0, frames, 10):
        turn.Set(float(t), t)
    area.CreateIntensityAttr(500.0)
    dome = UsdLux.DomeLight.Define(stage, "/Lamps/Sky")
    dome.CreateTextureFileAttr("./sky.exr")
    spin = dome.AddRotateXYZOp()
    spin.Set(Gf.Vec3f(90, 0, 0), 0)
    spin.Set(Gf.Vec3f(90, 0, 360), frames)


def _mesh(
    stage: Usd.Stage,
    path: str,
    points: list[tuple[float, ...]],
    counts: list[int],
    faces: list[int] | None = None,
) -> UsdGeom.Mesh:
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr([Gf.Vec3f(*map(float, p)) for p in points])
    mesh.CreateFaceVertexCountsAttr(counts)
    mesh.CreateFaceVertexIndicesAttr(list(range(counts[0])) if faces is None else faces)
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreateDoubleSidedAttr(True)
    return mesh


def resident() -> float:
    """MiB of this process in memory (Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def held() -> tuple[int, ...]:
    """How many of each of ``KINDS`` there are that were not released."""
    living = Counter(
        type(thing)
        for thing in gc.get_objects()
        if isinstance(thing, KINDS) and not isinstance(thing.mglo, moderngl.InvalidObject)
    )
    return tuple(living[kind] for kind in KINDS)


def forgotten(ctx: moderngl.Context) -> int:
    """How many objects were collected without having been released."""
    lost = [thing for thing in ctx.objects if not isinstance(thing, moderngl.InvalidObject)]
    ctx.objects.clear()  # what was released left an empty object here
    ctx.objects.extend(lost)
    return len(lost)


def watch(frames: int, size: tuple[int, int]) -> Iterator[tuple[int, float, tuple[int, ...], int]]:
    """(frame, MiB, ``held``, forgotten) every ``EVERY`` frames."""
    with tempfile.TemporaryDirectory() as folder:
        stage = write_stage(Path(folder), frames)
        ctx = create_context()
        ctx.gc_mode = "context_gc"  # what is forgotten is noted, and not freed
        job = Job(
            stage,
            [float(t) for t in range(frames)],
            str(Path(folder) / "frame.exr"),
            camera="/Camera",
            width=size[0],
            height=size[1],
        )
        report = Report()
        for number, _ in enumerate(render_sequence(ctx, job, report), 1):
            if number % EVERY == 0 or number == 1:
                gc.collect()
                yield number, resident(), held(), forgotten(ctx)
        print(f"findings: {', '.join(sorted(report.codes())) or 'none'}")


def main() -> None:
    """Print a table that grows."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.memory", description=__doc__)
    parser.add_argument("frames", nargs="?", type=int, default=1000)
    parser.add_argument("--size", nargs=2, type=int, default=(160, 90), metavar=("W", "H"))
    options = parser.parse_args()
    columns = ["frame", "resident MiB", *(kind.__name__ for kind in KINDS), "forgotten"]
    print(f"| {' | '.join(columns)} |\n| {' | '.join(['---'] * len(columns))} |")
    for number, memory, counts, lost in watch(options.frames, tuple(options.size)):
        row = map(str, (number, round(memory), *counts, lost))
        print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
