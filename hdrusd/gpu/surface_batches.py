"""Geometry on the GPU: what one call draws, and where it is.

What nothing moves is merged: all that shares a material and lies together becomes one
batch of vertices, relative to an origin of its own. The rest is drawn as it came, one
call for all places of a geometry; and so is what is large or copied often, for which a
call is cheap and memory is not.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.gpu.buffers import (
    Floats,
    Indices,
    corner_buffer,
    instance_rows,
    is_weld,
    mirrored,
    weld_rows,
)
from hdrusd.scene import Geometry

Doubles = npt.NDArray[np.float64]

#: Draws of more triangles than this, copies counted, are not merged.
MERGED_TRIANGLES = 20_000

#: A batch is divided until it has no more triangles than this, so that it can be left out
#: when it is not seen, and no larger radius (m): then its vertices lose 15 micrometres.
BATCH_TRIANGLES = 4096
BATCH_RADIUS = 256.0


@dataclass(frozen=True, slots=True)
class State:
    """What one call has in common beside its vertices."""

    material: int
    color: bool  # the geometry has the material's primvar of colour
    double_sided: bool
    links: int
    mirrored: bool = False


@dataclass(slots=True)
class Batch:
    """Vertices, and the places where one call draws them."""

    state: State
    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    content: list[tuple[str, str]]  # format and attribute of each part of a vertex
    rows: Floats  # (k, 16) instance_rows
    centres: Doubles  # (k, 3) m, of spheres around the places
    radii: Doubles  # (k,) m
    instances: moderngl.Buffer
    drawn: npt.NDArray[np.bool_]  # (k,) the places that ``instances`` holds now
    vaos: dict[moderngl.Program, moderngl.VertexArray] = field(default_factory=dict)

    def vertex_array(
        self, ctx: moderngl.Context, program: moderngl.Program
    ) -> moderngl.VertexArray:
        """For a program; attributes that it does not read are stepped over."""
        if program not in self.vaos:
            layout = " ".join(
                part if name in program else f"{4 * int(part[0])}x" for part, name in self.content
            )
            names = [name for _, name in self.content if name in program]
            rows = ("in_row0", "in_row1", "in_row2", "in_row3")
            content = [(self.vertices, layout, *names), (self.instances, "4f 4f 4f 4f /i", *rows)]
            self.vaos[program] = ctx.vertex_array(program, content, self.indices)
        return self.vaos[program]

    def show(self, seen: npt.NDArray[np.bool_]) -> int:
        """Keep the places ``seen`` (k,) ready to be drawn; returns how many."""
        if not np.array_equal(seen, self.drawn):
            self.instances.write(self.rows[seen])
            self.drawn = seen
        return int(np.count_nonzero(seen))

    def move(self, mesh: Mesh, transforms: Doubles) -> None:
        """Other places (k, 4, 4), k perhaps another one."""
        self.rows = instance_rows(transforms)
        self.centres, self.radii = spheres(mesh, transforms)
        if self.instances.size < self.rows.nbytes:
            self.instances.orphan(self.rows.nbytes)
        self.drawn = np.zeros(len(transforms), np.bool_)

    def release(self) -> None:
        """Give the GPU's memory back."""
        for vao in self.vaos.values():
            vao.release()
        for buffer in (self.vertices, self.indices, self.instances):
            buffer.release()


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """One geometry welded, as a batch wants it."""

    vertices: Floats  # (n, .) positions, normals, and what ``content`` says
    first: Indices  # (n,) the corners that they come from
    indices: Indices  # (3 t,)
    content: list[tuple[str, str]]
    centre: Doubles  # (3,) of a sphere around it, in its own space
    radius: float


def read_mesh(
    geometry: Geometry, uv_sets: Sequence[str], color: str, before: Mesh | None = None
) -> Mesh | None:
    """Weld a geometry; None without triangles. ``before``: the same at another time."""
    if len(geometry.points) == 0:
        return None
    data, content = corner_buffer(geometry, list(uv_sets), color)
    if before is not None and is_weld(data, before.first, before.indices):
        first, indices = before.first, before.indices
    else:
        first, indices = weld_rows(data)
    vertices = data[first]
    points = vertices[:, :3].astype(np.float64)
    centre = (points.min(axis=0) + points.max(axis=0)) / 2.0
    radius = float(np.sqrt(np.max(np.sum((points - centre) ** 2, axis=1))))
    return Mesh(vertices, first, indices, content, centre, radius)


def spheres(mesh: Mesh, transforms: Doubles) -> tuple[Doubles, Doubles]:
    """Centres (k, 3) and radii (k,), m, of spheres around a mesh at its places (k, 4, 4)."""
    linear = transforms[:, :3, :3]
    # No vector grows by more than the root of the largest row sum of |M M^T| (Gershgorin).
    squares = np.abs(linear @ linear.transpose(0, 2, 1)).sum(axis=2).max(axis=1)
    return mesh.centre @ linear + transforms[:, 3, :3], mesh.radius * np.sqrt(squares)


def instanced(
    ctx: moderngl.Context, mesh: Mesh, transforms: Doubles, state: State
) -> Iterator[Batch]:
    """A mesh at its places (k, 4, 4); a mirror's faces turn around, so that is its own call."""
    flipped = mirrored(transforms)
    for mirror in (False, True):
        chosen = transforms[flipped == mirror]
        if len(chosen):
            own = replace(state, mirrored=mirror)
            rows = instance_rows(chosen)
            yield _upload(
                ctx, own, mesh.vertices, mesh.indices, mesh.content, rows, spheres(mesh, chosen)
            )


def merged(
    ctx: moderngl.Context, draws: Sequence[tuple[Mesh, Doubles]], state: State
) -> Iterator[Batch]:
    """Meshes with their places (k, 4, 4) that share a state, in batches of what lies together."""
    meshes = [mesh for mesh, transforms in draws for _ in transforms]
    transforms = np.concatenate([places for _, places in draws])
    found = [spheres(mesh, places) for mesh, places in draws]
    centres = np.concatenate([centre for centre, _ in found])
    radii = np.concatenate([radius for _, radius in found])
    weights = np.array([len(mesh.indices) // 3 for mesh in meshes])
    for chosen in clusters(centres, radii, weights):
        own = [meshes[k] for k in chosen]
        if len(own) == 1:
            yield from instanced(ctx, own[0], transforms[chosen], state)
        else:
            yield _join(ctx, state, own, transforms[chosen], centres[chosen], radii[chosen])


def clusters(
    centres: Doubles, radii: Doubles, weights: npt.NDArray[np.int_]
) -> Iterator[npt.NDArray[np.intp]]:
    """Numbers of spheres that lie together, by halving along the longest side."""
    pending = [np.arange(len(centres))]
    while pending:
        chosen = pending.pop()
        _, radius = _around(centres[chosen], radii[chosen])
        if len(chosen) == 1 or (
            radius <= BATCH_RADIUS and weights[chosen].sum() <= BATCH_TRIANGLES
        ):
            yield chosen
            continue
        along = centres[chosen, np.argmax(np.ptp(centres[chosen], axis=0))]
        chosen = chosen[np.argsort(along, kind="stable")]
        share = np.cumsum(weights[chosen])
        half = int(np.searchsorted(share, share[-1] / 2.0))
        half = min(max(half, 1), len(chosen) - 1)
        pending += [chosen[half:], chosen[:half]]


def _around(centres: Doubles, radii: Doubles) -> tuple[Doubles, float]:
    """A sphere around spheres."""
    reach = radii[:, None]
    centre = ((centres - reach).min(axis=0) + (centres + reach).max(axis=0)) / 2.0
    return centre, float(np.max(np.sqrt(np.sum((centres - centre) ** 2, axis=1)) + radii))


def _join(
    ctx: moderngl.Context,
    state: State,
    meshes: Sequence[Mesh],
    transforms: Doubles,
    centres: Doubles,
    radii: Doubles,
) -> Batch:
    origin, radius = _around(centres, radii)
    linear = transforms[:, :3, :3]
    flipped = mirrored(transforms)
    # Cofactor matrices, as in gbuffer.vert.
    turned = np.roll(linear, -1, axis=1), np.roll(linear, -2, axis=1)
    normals = np.cross(*turned) * np.where(flipped, -1.0, 1.0)[:, None, None]
    vertices, indices, count = [], [], 0
    for mesh, places, turns, move, flip in zip(
        meshes, linear, normals, transforms[:, 3, :3] - origin, flipped, strict=True
    ):
        own = mesh.vertices.copy()
        own[:, :3] = mesh.vertices[:, :3] @ places + move
        own[:, 3:6] = mesh.vertices[:, 3:6] @ turns
        vertices.append(own)
        faces = mesh.indices.reshape(-1, 3) + np.uint32(count)
        indices.append(faces[:, ::-1] if flip else faces)
        count += len(own)
    place = np.eye(4)[None]
    place[0, 3, :3] = origin
    return _upload(
        ctx,
        state,
        np.concatenate(vertices),
        np.concatenate(indices),
        meshes[0].content,
        instance_rows(place),
        (origin[None], np.array([radius])),
    )


def _upload(
    ctx: moderngl.Context,
    state: State,
    vertices: Floats,
    indices: Indices,
    content: list[tuple[str, str]],
    rows: Floats,
    around: tuple[Doubles, Doubles],
) -> Batch:
    return Batch(
        state=state,
        vertices=ctx.buffer(vertices),
        indices=ctx.buffer(np.ascontiguousarray(indices)),
        content=content,
        rows=rows,
        centres=around[0],
        radii=around[1],
        instances=ctx.buffer(rows),
        drawn=np.ones(len(rows), np.bool_),
    )
