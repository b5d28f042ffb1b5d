"""The geometry that casts shadows, as few buffers and boxes to look for it in.

What stands still and stands once is merged into one buffer of world positions, cut into
chunks of neighbouring triangles; what moves or is drawn many times keeps its own buffer and
its matrices. A call draws a chunk into all tiles that see it.

Nothing is cast by what a Draw or a shadow link excludes, by what blends, by the glass of a
lamp (gpu/lamp_glass.py), and by what is so far off that float32 and the depths of a map
would be of no use to the rest: the finding "shadow-far".
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef
from hdrusd.gpu.buffers import weld
from hdrusd.gpu.lamp_glass import LampGlass, box_of, placed_boxes
from hdrusd.gpu.program import Programs
from hdrusd.gpu.release import release
from hdrusd.gpu.textures import TextureCache
from hdrusd.report import Kind, Report
from hdrusd.scene import Draw, Geometry, Material, RenderScene, TextureUse

Doubles = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]
Booleans = npt.NDArray[np.bool_]

#: Triangles of a chunk of merged geometry.
CHUNK = 1024

#: Logarithm of the width of the tables that shadow.vert reads.
TABLE = 12

#: Corners of all copies of a geometry up to which they are merged.
_MERGED = 200_000

#: m; a caster farther out than this is broken.
_FARTHEST = 1e9

#: How far from the middle of the scene a caster may be, in m and, in a large scene, in median
#: distances of what is in it.
_REACH, _DISTANCES = 20_000.0, 1000.0

#: Frames for which a buffer that nothing draws is kept.
_KEEP = 2


@dataclass(frozen=True, slots=True)
class Cutout:
    """A surface with holes: opacity = scale * texel[channel] + bias, a hole below threshold."""

    use: TextureUse
    texture: moderngl.Texture
    channel: int
    scale: float
    bias: float
    threshold: float


class _Nothing:
    """In place of holes: all of it lets light through."""


@dataclass(frozen=True, slots=True, eq=False)
class _Caster:
    draw: Draw
    cutout: Cutout | None


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """One draw call: part of a buffer, once for each of ``matrices`` or ``tiles``."""

    vao: moderngl.VertexArray
    first: int
    count: int
    tiles: npt.NDArray[np.intp]  # (n,)
    matrices: Doubles | None  # (n, 4, 4) into the clip space of each; None: the tile's own
    cutout: Cutout | None


@dataclass(slots=True, eq=False)
class _Mesh:
    """The buffer of one geometry."""

    geometry: Geometry
    vao: moderngl.VertexArray
    buffers: tuple[moderngl.Buffer, ...]
    count: int
    box: Doubles  # (2, 3) middle and half size in its own space
    used: int

    def release(self) -> None:
        self.vao.release()
        for buffer in self.buffers:
            buffer.release()


@dataclass(slots=True, eq=False)
class Group:
    """Casters in one buffer, each with a box; ``transforms`` None: merged chunks.

    ``named`` (n + 1, s): whether shadow link n names a caster of the s-th kind; 0 names all.
    """

    named: Booleans
    kinds: npt.NDArray[np.intp]  # (b,) of each box
    cutout: Cutout | None
    vao: moderngl.VertexArray
    boxes: Doubles  # (b, 2, 3) middle and half size, m from the origin
    starts: npt.NDArray[np.intp]  # (b + 1,) first index of each chunk, merged ones
    transforms: Doubles | None = None  # (b, 4, 4) to m from the origin
    owned: tuple[moderngl.Buffer, ...] = ()
    mesh: _Mesh | None = None

    def runs(self, seen: Booleans, matrices: Doubles) -> Iterator[Run]:
        """Draw calls where ``seen`` (t, b): a tile of ``matrices`` (t, 4, 4) sees a box."""
        if self.transforms is not None:
            tiles, which = np.nonzero(seen)
            if len(tiles):
                own = self.transforms[which] @ matrices[tiles]
                yield Run(self.vao, 0, int(self.starts[-1]), tiles, own, self.cutout)
            return
        # Neighbouring chunks that the same tiles see are one call.
        change = np.flatnonzero(np.any(seen[:, 1:] != seen[:, :-1], axis=0)) + 1
        ends = [*change, seen.shape[1]]
        for first, end in zip([0, *change], ends, strict=True):
            tiles = np.flatnonzero(seen[:, first])
            if len(tiles):
                start, stop = int(self.starts[first]), int(self.starts[end])
                yield Run(self.vao, start, stop - start, tiles, None, self.cutout)

    def release(self) -> None:
        if self.owned:
            self.vao.release()
            for buffer in self.owned:
                buffer.release()


class Casters:
    """The casters of the current moment; keeps what was uploaded.

    ``report`` takes one finding when some are too far off.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        programs: Programs,
        textures: TextureCache,
        report: Report | None = None,
        place: SourceRef | None = None,
    ) -> None:
        self.ctx = ctx
        self.programs = programs
        self.textures = textures
        self.origin: Doubles = np.zeros(3)
        self.reach = _REACH  # m from the origin, along each axis
        self.still: list[Group] = []
        self.moving: list[Group] = []
        self._links = 0
        self._known: list[_Caster] | None = None
        self._meshes: dict[tuple[str, Cutout | None], _Mesh] = {}
        self._glass = LampGlass()
        self._report, self._place = report, place or SourceRef(Path())
        self._far = 0
        self._frame = 0

    def update(self, scene: RenderScene) -> bool:
        """Take a moment's casters; True where what stands still is not what it was."""
        self._frame += 1
        links = int(scene.lights["shadow_link"].max(initial=0))
        holes = [self._holes(material) for material in scene.materials]
        cast = [
            _Caster(draw, hole)
            for draw in self._glass.removed(scene)
            if draw.casts and not isinstance(hole := holes[draw.material], _Nothing)
            if len(draw.geometry.points) > 0 and len(draw.transforms) > 0
        ]
        still = [caster for caster in cast if not caster.draw.moving]
        moving = [caster for caster in cast if caster.draw.moving]
        changed = self._known is None or links != self._links or not _same(self._known, still)
        self._links = links
        if changed:
            for group in self.still:
                group.release()
            self._known = still
            self.origin, self.reach = _middle(scene, still or moving)
            self.still = self._still(still)
        self.moving = [self._placed(caster) for caster in moving]
        for group in self.still:
            if group.mesh is not None:
                group.mesh.used = self._frame
        for key in [k for k, mesh in self._meshes.items() if mesh.used < self._frame - _KEEP]:
            self._meshes.pop(key).release()
        self._say_far()
        return changed

    def release(self) -> None:
        """Give the GPU's memory back."""
        release(self.still, self._meshes)
        self.still, self.moving, self._known = [], [], None
        self._meshes.clear()

    def bounds(self, *, moving: bool = True) -> Doubles:
        """(2, 3) lowest and highest corner of all casters within ``reach``; zeros for none.

        In m from the origin.
        """
        groups = [*self.still, *(self.moving if moving else [])]
        boxes = [g.boxes for g in groups if len(g.boxes)]
        if not boxes:
            return np.zeros((2, 3))
        middle, half = np.concatenate(boxes).transpose(1, 0, 2)
        ends: Doubles = np.array([np.min(middle - half, axis=0), np.max(middle + half, axis=0)])
        return ends.clip(-self.reach, self.reach)

    def _say_far(self) -> None:
        """Once, at the first frame in which something is beyond ``reach``."""
        if self._far and self._report is not None:
            text = (
                f"{self._far} triangles and copies cast no shadows: they are farther than "
                f"{self.reach:.3g} m from the middle of the scene"
            )
            self._report.add(Kind.DROPPED, "shadow-far", self._place, "", text)
            self._report = None

    def _holes(self, material: Material) -> Cutout | _Nothing | None:
        """What of a material lets light through; None: nothing."""
        if material.blend:
            return _Nothing()
        use, threshold = material.opacity_map, material.opacity_threshold
        if use is None:
            return None if material.opacity >= threshold else _Nothing()
        if threshold <= 0.0:
            return None
        channel = max(use.channel, 0)
        scale, bias = float(use.scale[channel]), float(use.bias[channel])
        uploaded = self.textures.get(use.texture)
        if uploaded is None:
            return None if use.fallback[channel] * scale + bias >= threshold else _Nothing()
        return Cutout(use, uploaded.texture, channel, scale, bias, material.least_texel)

    def _named(self, kinds: Sequence[int]) -> Booleans:
        """``Group.named`` of kinds of ``Draw.shadow_links``."""
        size = (self._links + 7) // 8
        whole = b"".join((k & ((1 << 8 * size) - 1)).to_bytes(size, "little") for k in kinds)
        bits = np.frombuffer(whole, np.uint8).reshape(len(kinds), size).T
        table = np.unpackbits(bits, axis=0, count=self._links, bitorder="little")
        return np.concatenate([np.ones((1, len(kinds)), np.bool_), table.astype(np.bool_)])

    def _still(self, casters: Sequence[_Caster]) -> list[Group]:
        """Merged geometry by what holes it has; and what is drawn often."""
        groups: list[Group] = []
        merged: dict[Cutout | None, list[_Caster]] = {}
        for caster in casters:
            draw = caster.draw
            copies = len(draw.transforms)
            if copies > 1 and copies * len(draw.geometry.points) > _MERGED:
                groups.append(self._placed(caster))
            else:
                merged.setdefault(caster.cutout, []).append(caster)
        found = [self._merged(cutout, members) for cutout, members in merged.items()]
        return groups + [group for group in found if group is not None]

    def _merged(self, cutout: Cutout | None, members: Sequence[_Caster]) -> Group | None:
        corners = []
        names: dict[int, int] = {}  # number of each kind
        for member in members:
            draw = member.draw
            points = draw.geometry.points.astype(np.float64)
            moved = points @ draw.transforms[:, :3, :3]
            moved += draw.transforms[:, None, 3, :3] - self.origin
            flat = moved.reshape(-1, 3)
            if cutout is not None:
                uv = np.tile(self._uvs(draw.geometry, cutout), (len(moved), 1))
                flat = np.concatenate([flat, uv], axis=1)
            corners.append(_sound(flat))
        kinds = [names.setdefault(m.draw.shadow_links, len(names)) for m in members]
        kind = np.repeat(kinds, [len(flat) // 3 for flat in corners])
        triangles = np.concatenate(corners).reshape(-1, 3, 3 if cutout is None else 5)
        places = triangles[..., :3]
        inside = (places.min(axis=1) <= self.reach) & (places.max(axis=1) >= -self.reach)
        within = np.all(inside, axis=1)
        self._far += int(np.sum(~within))
        triangles, kind = triangles[within], kind[within]
        if len(triangles) == 0:
            return None
        order = _neighbours(triangles[..., :3])
        order = order[np.argsort(kind[order], kind="stable")]
        triangles, kind = triangles[order], kind[order]
        # A chunk is of one kind.
        first = np.flatnonzero(np.diff(kind, prepend=-1))
        ends = np.append(first[1:], len(kind))
        starts = np.concatenate([np.arange(a, b, CHUNK) for a, b in zip(first, ends, strict=True)])
        low = np.minimum.reduceat(triangles[..., :3].min(axis=1), starts).astype(np.float64)
        high = np.maximum.reduceat(triangles[..., :3].max(axis=1), starts).astype(np.float64)
        vertices, indices = weld(np.ascontiguousarray(triangles.reshape(-1, triangles.shape[2])))
        vao, buffers = self._buffers(vertices, indices, cutout is not None)
        return Group(
            named=self._named(list(names)),
            kinds=kind[starts],
            cutout=cutout,
            vao=vao,
            boxes=np.stack([(low + high) / 2.0, (high - low) / 2.0], axis=1),
            starts=3 * np.append(starts, len(triangles)),
            owned=buffers,
        )

    def _placed(self, caster: _Caster) -> Group:
        """A draw with its own buffer; one box for each of its places."""
        draw, cutout = caster.draw, caster.cutout
        mesh = self._mesh(draw.geometry, cutout)
        places = draw.transforms.copy()
        places[:, 3, :3] -= self.origin
        good = np.isfinite(places).all(axis=(1, 2)) & (np.abs(places).max(axis=(1, 2)) < _FARTHEST)
        places = places[good]
        boxes = placed_boxes(mesh.box, places)
        within = np.all(np.abs(boxes[:, 0]) - boxes[:, 1] <= self.reach, axis=1)
        self._far += int(np.sum(~within))
        places, boxes = places[within], boxes[within]
        return Group(
            named=self._named([draw.shadow_links]),
            kinds=np.zeros(len(boxes), np.intp),
            cutout=cutout,
            vao=mesh.vao,
            boxes=boxes,
            starts=np.array([0, mesh.count]),
            transforms=places,
            mesh=mesh,
        )

    def _mesh(self, geometry: Geometry, cutout: Cutout | None) -> _Mesh:
        key = geometry.key, cutout
        kept = self._meshes.get(key)
        if kept is not None and kept.geometry is geometry:
            kept.used = self._frame
            return kept
        points = geometry.points
        if cutout is not None:
            points = np.concatenate([points, self._uvs(geometry, cutout)], axis=1)
        corners = _sound(points.astype(np.float64))
        # What changes from frame to frame is not worth the time that finding equal corners takes.
        if kept is None:
            vertices, indices = weld(corners)
        else:
            vertices, indices = corners, np.arange(len(corners), dtype=np.uint32)
            kept.release()
        vao, buffers = self._buffers(vertices, indices, cutout is not None)
        box = box_of(corners[:, :3])
        self._meshes[key] = _Mesh(geometry, vao, buffers, len(indices), box, self._frame)
        return self._meshes[key]

    def _uvs(self, geometry: Geometry, cutout: Cutout) -> Floats:
        """(3 t, 2) coordinates in the texture of the opacity."""
        use = cutout.use
        uploaded = self.textures.get(use.texture)
        assert uploaded is not None
        st = geometry.uvs.get(use.uv_set)
        if st is None:
            st = np.zeros((len(geometry.points), 2), np.float32)
        matrix = np.reshape(use.matrix, (2, 3))
        uv = st @ matrix[:, :2].T + matrix[:, 2]
        return np.asarray(uv * uploaded.scale + uploaded.offset, np.float32)

    def _buffers(
        self, vertices: Floats, indices: npt.NDArray[np.uint32], textured: bool
    ) -> tuple[moderngl.VertexArray, tuple[moderngl.Buffer, ...]]:
        defines = {"TABLE": TABLE} | ({"CUTOUT": 1} if textured else {})
        program = self.programs.get("gpu/shaders/shadow.vert", "gpu/shaders/shadow.frag", defines)
        # An empty buffer is an error of OpenGL.
        buffers = tuple(
            self.ctx.buffer(data) if len(data) else self.ctx.buffer(reserve=20)
            for data in (vertices, indices)
        )
        names = ("3f 2f", "in_position", "in_uv") if textured else ("3f", "in_position")
        return self.ctx.vertex_array(program, [(buffers[0], *names)], buffers[1]), buffers


def _same(known: Sequence[_Caster], casters: Sequence[_Caster]) -> bool:
    return len(known) == len(casters) and all(
        a.draw.geometry is b.draw.geometry
        and a.cutout == b.cutout
        and a.draw.shadow_links == b.draw.shadow_links
        and np.array_equal(a.draw.transforms, b.draw.transforms)
        for a, b in zip(known, casters, strict=True)
    )


def _middle(scene: RenderScene, casters: Sequence[_Caster]) -> tuple[Doubles, float]:
    """(3,) the median place of the draws within reach, and that reach in m.

    One draw that stands far off moves neither: beside eye and lamps it is a minority.
    """
    placed = [
        np.array([*d.geometry.points[0].astype(np.float64), 1.0]) @ d.transforms[:, :, :3]
        for d in (caster.draw for caster in casters)
    ]
    draws = _numbers(np.concatenate([np.zeros((0, 3)), *placed]))
    lamps = scene.lights["position"][scene.lights["w"] > 0.0]
    everything = _numbers(np.concatenate([draws, lamps, np.asarray(scene.camera.eye)[None]]))
    if not len(draws) or not len(everything):
        return np.zeros(3), _REACH
    middle = np.median(everything, axis=0)
    away = np.linalg.norm(everything - middle, axis=1)
    reach = max(_REACH, _DISTANCES * float(np.median(away)))
    near = draws[np.linalg.norm(draws - middle, axis=1) <= reach]
    return np.round(np.median(near, axis=0) if len(near) else middle), reach


def _numbers(places: Doubles) -> Doubles:
    return places[np.isfinite(places).all(axis=1)]


def _sound(corners: Doubles) -> Floats:
    """The triangles whose corners are numbers of a reasonable size, as float32."""
    triangles = corners.reshape(-1, 3 * corners.shape[1])
    with np.errstate(invalid="ignore"):
        good = np.all(np.abs(triangles) < _FARTHEST, axis=1)
    return np.ascontiguousarray(triangles[good].reshape(-1, corners.shape[1]), np.float32)


def _neighbours(triangles: Floats) -> npt.NDArray[np.intp]:
    """(t,) an order in which those of like size and place follow one another."""
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    least, most = low.min(axis=0), high.max(axis=0)
    extent = max(float(np.max(most - least)), 1e-9)
    size = np.maximum(np.max(high - low, axis=1) / extent, 1e-9)
    octave = np.clip(-np.log2(size) / 2.0, 0, 5).astype(np.uint64)
    cell = np.clip(((low + high) / 2.0 - least) / extent * 1023.0, 0, 1023).astype(np.uint64)
    key = octave << np.uint64(32)
    for axis in range(3):
        bits = cell[:, axis]
        for shift, mask in ((16, 0x30000FF), (8, 0x300F00F), (4, 0x30C30C3), (2, 0x9249249)):
            bits = (bits | (bits << np.uint64(shift))) & np.uint64(mask)
        key |= bits << np.uint64(axis)
    return np.argsort(key, kind="stable")
