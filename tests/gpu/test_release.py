"""After release() nothing that a renderer made is left on the GPU."""

from __future__ import annotations

import gc
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from sky_scenes import sky
from small_scenes import draw, lights, look, quad
from stage_text import GROUND, SKY, write_stage

from hdrusd.gpu.hdr import HdrRenderer, Options
from hdrusd.gpu.program import Programs
from hdrusd.gpu.release import release
from hdrusd.job import Job
from hdrusd.render import render_sequence
from hdrusd.report import Report
from hdrusd.scene import ImageData, Material, RenderScene, TextureRef, TextureUse

KINDS = (
    moderngl.Buffer,
    moderngl.Texture,
    moderngl.Framebuffer,
    moderngl.VertexArray,
    moderngl.Program,
    moderngl.Sampler,
)


def alive(gl: moderngl.Context) -> dict[int, Any]:
    """What of this context is not released, whoever holds it; by identity."""
    gc.collect()
    return {
        id(thing): thing
        for thing in gc.get_objects()
        if isinstance(thing, KINDS)
        and thing.ctx is gl
        and not isinstance(thing.mglo, moderngl.InvalidObject)
    }


def everything() -> RenderScene:
    """Lamps with and without shadows, a pane, a clear coat, a texture, a sky, links."""
    picture = TextureUse(TextureRef("wall.png", "gamma"))
    return RenderScene(
        lights=lights(
            {"position": (0.0, 0.0, 2.0), "shadow": 1},
            {"position": (1.0, 0.0, 2.0), "shadow": 0, "link": 1},
        ),
        draws=(
            draw(quad()),
            draw(quad((-0.5, -0.5, 0.5), (1, 0, 0), (0, 1, 0), key="pane"), 1),
            draw(quad((0.5, -0.5, 0.3), (1, 0, 0), (0, 1, 0), key="roof"), 2),
        ),
        materials=(
            Material(model="ggx", specular=(0.04,) * 3, clearcoat=1.0, diffuse_map=picture),
            Material(blend=True, opacity=0.5),
            Material(emission=(5.0,) * 3),
        ),
        skies=(sky(),),
        camera=look(),
    )


def load(ref: TextureRef) -> ImageData:
    size = (8, 16, 3) if ref.file == "sky.exr" else (4, 4, 3)
    dtype = np.float32 if ref.file == "sky.exr" else np.uint8
    return ImageData(np.ones(size, dtype))


@pytest.mark.parametrize("shadows", [True, False])
def test_a_renderer_gives_everything_back(gl: Any, shadows: bool) -> None:
    before = alive(gl)
    programs = Programs(gl)
    options = Options(samples=2, sky_samples=8, shadows=shadows)
    renderer = HdrRenderer(gl, programs, (32, 24), load, options)
    renderer.render(everything())
    assert renderer.read().max() > 0.0
    assert len(alive(gl).keys() - before.keys()) > 30
    renderer.release()
    renderer.release()
    programs.release()
    assert not alive(gl).keys() - before.keys()


@pytest.mark.parametrize("more", [{}, {"png": Path("frame.png"), "samples": 2}])
def test_a_sequence_does(gl: Any, tmp_path: Path, more: dict[str, Any]) -> None:
    before = alive(gl)
    stage = write_stage(tmp_path / "stage.usda", GROUND, SKY)
    if "png" in more:
        more = more | {"png": tmp_path / "frame.png"}
    for _ in render_sequence(gl, Job(stage, width=16, height=12, **more), Report()):
        assert alive(gl).keys() - before.keys()
    assert not alive(gl).keys() - before.keys()


def test_collections_and_nothing(gl: Any) -> None:
    buffers = [gl.buffer(reserve=4) for _ in range(4)]
    release(None, buffers[0], {"one": buffers[1]}, [(buffers[2],), {1: {2: buffers[3]}}], [])
    assert all(isinstance(buffer.mglo, moderngl.InvalidObject) for buffer in buffers)
