"""Step one of shader 1: what each pixel shows, into the G-buffer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.buffers import mirrored, split
from hdrusd.gpu.culling import in_view
from hdrusd.gpu.materials import MaterialInputs, is_blended, material_inputs
from hdrusd.gpu.program import Programs
from hdrusd.gpu.release import release
from hdrusd.gpu.source import Define
from hdrusd.gpu.surface_batches import (
    MERGED_TRIANGLES,
    Batch,
    Mesh,
    State,
    instanced,
    merged,
    read_mesh,
)
from hdrusd.gpu.textures import TextureCache
from hdrusd.gpu.uniforms import Uniforms, floats
from hdrusd.scene import Draw, RenderScene

Doubles = npt.NDArray[np.float64]

#: Frames for which a buffer that nothing draws is kept.
_KEEP = 2

#: Texture units of the two layers that a peeled one lies between, after those of materials.
_OPAQUE_UNIT, _BEFORE_UNIT = 10, 11


@dataclass(frozen=True, slots=True)
class Between:
    """What a layer of blended surfaces lies between, both as their G-buffers' ``g_normal``.

    ``opaque``: what is not blended; ``before``: the layer in front, or a texel with a
    distance of minus infinity.
    """

    opaque: moderngl.Texture
    before: moderngl.Texture


@dataclass(slots=True)
class _Moving:
    """A draw that is kept apart because it may change."""

    draw: Draw
    mesh: Mesh
    batches: list[Batch]
    used: int


@dataclass(frozen=True, slots=True)
class _Call:
    batch: Batch
    instances: int


class SurfacePass:
    """Draws scenes into whatever framebuffer is bound; keeps what was uploaded."""

    def __init__(
        self, ctx: moderngl.Context, programs: Programs, textures: TextureCache, scale: float
    ) -> None:
        self.ctx = ctx
        self.programs = programs
        self.textures = textures
        self.scale = scale
        self._frame = 0
        self._scene: RenderScene | None = None
        self._inputs: list[MaterialInputs] = []
        self._still: tuple[Draw, ...] = ()
        self._batches: list[Batch] = []  # of what is still
        self._moving: dict[tuple[str, int, bool, int, int], _Moving] = {}
        self._calls: dict[bool, list[_Call]] = {}  # by whether they are blended
        self._shared: dict[str, bytes] = {}
        self._uniforms: dict[moderngl.Program, Uniforms] = {}
        self._programs: dict[tuple[int, bool, tuple[str, ...]], moderngl.Program] = {}

    def draw(
        self,
        scene: RenderScene,
        which: Literal["opaque", "blended"] = "opaque",
        *,
        sky: npt.NDArray[np.float32] | None = None,
        one_specular: bool = False,
        extra: bool = False,
        sky_apart: bool = False,
        between: Between | None = None,
    ) -> None:
        """The surfaces of a scene; depth test on, colour attachments as in gbuffer.frag.

        ``sky``: (18, 3) coefficients of ``ambient_lux`` (photometry/sky.py) instead of
        ``scene.ambient``. ``one_specular``: g_specular is not attached. ``extra``: g_extra
        is, and written. ``sky_apart``: so is g_scattered, and no light of the sky is added.
        ``between``: only the parts between two layers.
        """
        self._prepare(scene)
        defines: dict[str, Define] = {}
        shared = dict(self._shared)
        if sky is not None:
            defines["SKY"] = 1
            shared["sky"] = floats(sky)
        elif not any(scene.ambient):
            defines["DARK"] = 1
        attached = 4
        if one_specular:
            defines["ONE_SPECULAR"] = 1
            attached -= 1
        if extra:
            defines["EXTRA"] = attached
            attached += 1
        if sky_apart:
            defines["SKY_APART"] = attached
        if between is not None:
            defines["PEEL"] = 1
            between.opaque.use(_OPAQUE_UNIT)
            between.before.use(_BEFORE_UNIT)
            shared["opaque"] = np.int32(_OPAQUE_UNIT).tobytes()
            shared["before"] = np.int32(_BEFORE_UNIT).tobytes()
            shared["pixel"] = floats([1.0 / side for side in between.opaque.size])
        try:
            self._run(self._calls[which == "blended"], defines, shared)
        finally:
            self.ctx.disable(moderngl.CULL_FACE)
            self.ctx.front_face = "ccw"

    def release(self) -> None:
        """Give the GPU's memory back, but for that of the textures."""
        release(self._batches, [moving.batches for moving in self._moving.values()])
        self._batches, self._scene, self._still = [], None, ()
        self._moving.clear()

    def blended(self, scene: RenderScene) -> bool:
        """Whether anything is in view that something may be seen through."""
        self._prepare(scene)
        return bool(self._calls[True])

    # -- what is there, and what of it is seen -------------------------------------------

    def _prepare(self, scene: RenderScene) -> None:
        """Upload what is new, and choose what the camera may see; once a scene."""
        if scene is self._scene:
            return
        self._scene = scene
        self._frame += 1
        fits = self._read_materials(scene)
        still = tuple(draw for draw in scene.draws if not draw.moving)
        if not fits or not _same(still, self._still):
            self._build_still(still)
        batches = [*self._batches]
        counts: Counter[tuple[str, int, bool, int]] = Counter()
        for draw in scene.draws:
            if draw.moving:
                key = (draw.geometry.key, draw.material, draw.double_sided, draw.links)
                batches += self._move((*key, counts[key]), draw)
                counts[key] += 1
        for old in [k for k, v in self._moving.items() if v.used < self._frame - _KEEP]:
            release(self._moving.pop(old).batches)
        self._choose(scene, batches)
        self._shared = self._frame_uniforms(scene)

    def _read_materials(self, scene: RenderScene) -> bool:
        """Whether what was uploaded brings what the materials need."""
        inputs, fits = [], True
        replaced = self.textures.prepare(scene.materials)
        for number, material in enumerate(scene.materials):
            known = self._inputs[number] if number < len(self._inputs) else None
            if (
                known is None
                or known.material is not material
                or any(use.texture in replaced for use in material.maps().values())
            ):
                new = material_inputs(material, self.textures)
                fits &= known is not None and new.layout == known.layout
                self._programs.clear()
                known = new
            inputs.append(known)
        self._inputs = inputs
        if not fits:
            for moving in self._moving.values():
                release(moving.batches)
            self._moving.clear()
        return fits

    def _build_still(self, draws: tuple[Draw, ...]) -> None:
        release(self._batches)
        self._still, self._batches = draws, []
        groups: dict[State, list[tuple[Mesh, Doubles]]] = {}
        for draw in draws:
            mesh = self._mesh(draw)
            if mesh is None or not len(draw.transforms):
                continue
            state = self._state(draw)
            if len(mesh.indices) // 3 * len(draw.transforms) > MERGED_TRIANGLES:
                self._batches += instanced(self.ctx, mesh, draw.transforms, state)
            else:
                groups.setdefault(state, []).append((mesh, draw.transforms))
        for state, group in groups.items():
            self._batches += merged(self.ctx, group, state)

    def _move(self, key: tuple[str, int, bool, int, int], draw: Draw) -> list[Batch]:
        """The batches of a draw that may have changed since it was drawn last."""
        kept = self._moving.get(key)
        before = kept.draw if kept else None
        mesh = kept.mesh if kept else None
        if before is None or before.geometry is not draw.geometry:
            mesh = self._mesh(draw, mesh)
        if mesh is None or not len(draw.transforms):
            return []
        if kept is None or mesh is not kept.mesh or not self._moved(kept, draw):
            if kept is not None:
                release(kept.batches)
            batches = list(instanced(self.ctx, mesh, draw.transforms, self._state(draw)))
            kept = self._moving[key] = _Moving(draw, mesh, batches, self._frame)
        kept.draw, kept.used = draw, self._frame
        return kept.batches

    def _moved(self, kept: _Moving, draw: Draw) -> bool:
        """Whether the batches could follow: not where some turn into mirror images."""
        if np.array_equal(kept.draw.transforms, draw.transforms):
            return True
        flipped = mirrored(draw.transforms)
        if np.unique(flipped).tolist() != [batch.state.mirrored for batch in kept.batches]:
            return False
        for batch in kept.batches:
            batch.move(kept.mesh, draw.transforms[flipped == batch.state.mirrored])
        return True

    def _mesh(self, draw: Draw, before: Mesh | None = None) -> Mesh | None:
        uv_sets, color = self._inputs[draw.material].layout
        color = color if color in draw.geometry.colors else ""
        return read_mesh(draw.geometry, uv_sets, color, before)

    def _state(self, draw: Draw) -> State:
        color = self._inputs[draw.material].material.vertex_color in draw.geometry.colors
        return State(draw.material, color, draw.double_sided, draw.links)

    def _choose(self, scene: RenderScene, batches: list[Batch]) -> None:
        """The calls of a frame, in the order of their materials."""
        self._calls = {False: [], True: []}
        if not batches:
            return
        centres = np.concatenate([batch.centres for batch in batches])
        radii = np.concatenate([batch.radii for batch in batches])
        seen = in_view(scene.camera, centres, radii)
        away = np.linalg.norm(centres - np.asarray(scene.camera.eye), axis=1) - radii
        nearest: dict[int, float] = {}
        first = 0
        for batch in batches:
            own = seen[first : first + len(batch.radii)]
            first += len(own)
            if own.any():
                blended = is_blended(scene.materials[batch.state.material])
                self._calls[blended].append(_Call(batch, batch.show(own)))
                nearest[id(batch)] = float(away[first - len(own) : first][own].min())
        # What is near hides what is far, which then costs nothing.
        for calls in self._calls.values():
            calls.sort(key=lambda call: nearest[id(call.batch)])

    def _frame_uniforms(self, scene: RenderScene) -> dict[str, bytes]:
        camera = scene.camera
        rotation = np.eye(4)
        rotation[:3, :3] = camera.rotation()
        high, low = split(np.asarray(camera.eye, np.float64))
        return {
            "view_projection": floats(rotation @ camera.projection()),
            "forward": floats(-np.asarray(camera.back)),
            "eye_high": floats(high),
            "eye_low": floats(low),
            "ambient": floats(scene.ambient),
            "lambert_scale": floats(self.scale),
        }

    # -- drawing -------------------------------------------------------------------------

    def _run(
        self, calls: Sequence[_Call], defines: dict[str, Define], shared: dict[str, bytes]
    ) -> None:
        ctx = self.ctx
        variant = tuple(sorted(f"{name}{value}" for name, value in defines.items()))
        told: set[moderngl.Program] = set()
        bound = -1
        for call in calls:
            state = call.batch.state
            program = self._program(state, variant, defines)
            uniforms = self._uniforms[program]
            if program not in told:
                uniforms.write(shared)
                told.add(program)
            if state.material != bound:
                for unit, image in enumerate(self._inputs[state.material].images):
                    image.use(unit)
                bound = state.material
            uniforms.write(self._inputs[state.material].uniforms)
            uniforms.write(_SIDES[state.double_sided])
            if "EXTRA" in defines:
                uniforms.write({"links": floats(state.links)})
            if state.double_sided:
                ctx.disable(moderngl.CULL_FACE)
            else:
                ctx.enable(moderngl.CULL_FACE)
            ctx.front_face = "cw" if state.mirrored else "ccw"
            vao = call.batch.vertex_array(ctx, program)
            vao.render(moderngl.TRIANGLES, instances=call.instances)

    def _program(
        self, state: State, variant: tuple[str, ...], defines: dict[str, Define]
    ) -> moderngl.Program:
        key = state.material, state.color, variant
        if key not in self._programs:
            own = self._inputs[state.material].defines | defines
            if state.color:
                own["VERTEX_COLOR"] = 1
            files = "gpu/shaders/gbuffer.vert", "gpu/shaders/gbuffer.frag"
            program = self._programs[key] = self.programs.get(*files, own)
            if program not in self._uniforms:
                self._uniforms[program] = Uniforms(program)
        return self._programs[key]


#: What a back face does with its normal.
_SIDES = {False: {"back_sign": floats(1.0)}, True: {"back_sign": floats(-1.0)}}


def _same(a: Sequence[Draw], b: Sequence[Draw]) -> bool:
    """Whether two lists hold the very same draws."""
    return len(a) == len(b) and all(x is y for x, y in zip(a, b, strict=True))


def set_used(program: moderngl.Program, name: str, value: object) -> None:
    """Set a uniform, unless the compiler found it unused and removed it."""
    member = program.get(name, None)
    if member is not None:
        member.value = value  # type: ignore[union-attr]
