"""Whether the tables of a LegacyScene fit together, where nobody vouches for it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError
from hdrusd.importers.importer import Limits
from hdrusd.legacy.scene import Channel, Image, Interpolation, LegacyScene, Mesh, Node

_Array = npt.NDArray[np.generic]


class BrokenSceneError(Exception):
    """What a worker answered is no scene; the text says what is wrong."""


def check_scene(scene: LegacyScene, limits: Limits) -> None:
    """Check sizes, shapes and indices. Raises BrokenSceneError, InputError past ``limits``."""
    if sum(len(mesh.points) + len(mesh.face_counts) for mesh in scene.meshes) > limits.vertices:
        raise InputError(scene.source, f"more than {limits.vertices} points and faces")
    for mesh in scene.meshes:
        _check_mesh(mesh, len(scene.materials))
    stack = list(scene.roots)
    while stack:
        node = stack.pop()
        stack.extend(node.children)
        _check_node(node, scene)
    _want(scene.unit_m > 0.0, "the unit of a scene")
    for light in scene.lights:
        _want(light.lamps > 0, "the places of a light")
        count = None if light.positions is None else len(light.positions)
        for array in (light.positions, light.directions):
            _want(array is None or _is(array, count, 3), "the places of a light")
    for skin in scene.skins:
        _want(_is(skin.inverse_binds, len(skin.joints), 4, 4), "the matrices of a skin")


def _want(good: bool, what: str) -> None:
    if not good:
        raise BrokenSceneError(f"{what} do not fit")


def _is(array: _Array, *shape: int | None) -> bool:
    """Whether an array has this shape; None is any size."""
    return array.ndim == len(shape) and all(
        want in (None, have) for want, have in zip(shape, array.shape, strict=True)
    )


def _within(indices: Iterable[int] | _Array, count: int) -> bool:
    """Whether all indices lie in [0, count)."""
    array = np.asarray(indices, dtype=np.int64)
    return not array.size or (int(array.min()) >= 0 and int(array.max()) < count)


def _check_mesh(mesh: Mesh, materials: int) -> None:
    points, faces, corners = len(mesh.points), len(mesh.face_counts), len(mesh.face_indices)
    sizes = {"vertex": points, "faceVarying": corners, "uniform": faces, "constant": 1}

    def fits(array: _Array | None, interpolation: Interpolation, width: int) -> bool:
        return array is None or _is(array, sizes[interpolation], width)

    _want(_is(mesh.points, None, 3), "the points of a mesh")
    counted = _is(mesh.face_counts, None) and _is(mesh.face_indices, None)
    _want(counted and int(mesh.face_counts.min(initial=3)) >= 3, "the faces of a mesh")
    _want(int(mesh.face_counts.sum(dtype=np.int64)) == corners, "the corners of a mesh")
    _want(_within(mesh.face_indices, points), "the indices of a mesh")
    _want(fits(mesh.normals, mesh.normals_interpolation, 3), "the normals of a mesh")
    _want(fits(mesh.colors, mesh.colors_interpolation, 4), "the colours of a mesh")
    for array, interpolation in mesh.uvs.values():
        _want(fits(array, interpolation, 2), "the texture coordinates of a mesh")
    used = [subset.material for subset in mesh.subsets]
    used += [] if mesh.material is None else [mesh.material]
    _want(_within(used, materials), "the materials of a mesh")
    for subset in mesh.subsets:
        _want(_is(subset.faces, None) and _within(subset.faces, faces), "the faces of a subset")
    if mesh.joint_indices is not None or mesh.joint_weights is not None:
        joints, weights = mesh.joint_indices, mesh.joint_weights
        both = joints is not None and weights is not None and joints.shape == weights.shape
        _want(both and joints is not None and _is(joints, points, None), "the joints of a mesh")


def check_image(image: Image, limits: Limits) -> None:
    """Check the shape and size of pixels. Raises BrokenSceneError."""
    if image.pixels is None:
        return
    shape = image.pixels.shape
    _want(len(shape) == 3 and 1 <= shape[2] <= 4 and shape[0] * shape[1] > 0, "pixels")
    _want(shape[0] * shape[1] <= limits.pixels, "pixels")


def _check_node(node: Node, scene: LegacyScene) -> None:
    for indices, table in (
        (node.meshes, scene.meshes),
        (node.lights, scene.lights),
        (node.cameras, scene.cameras),
        ([] if node.skin is None else [node.skin], scene.skins),
    ):
        _want(_within(indices, len(table)), "the numbers of a node")
    if isinstance(node.transform, np.ndarray):
        _want(_is(node.transform, 4, 4), "the matrix of a node")
    if node.skin is not None:
        joints = len(scene.skins[node.skin].joints)
        for index in node.meshes:
            bound = scene.meshes[index].joint_indices
            _want(bound is None or _within(bound, joints), "the joints of a mesh")
    for channel in node.animation:
        _check_channel(channel)
    children = len(node.children)
    _want(len(node.lod_ranges) in (0, children), "the ranges of a node")
    _want(len(node.switch_on) in (0, children), "the switch of a node")


def _check_channel(channel: Channel) -> None:
    width = 4 if channel.path == "rotation" else 3
    _want(_is(channel.times, None) and len(channel.times) > 0, "the times of a channel")
    _want(bool((np.diff(channel.times) > 0.0).all()), "the times of a channel")
    _want(_is(channel.values, len(channel.times), width), "the values of a channel")
