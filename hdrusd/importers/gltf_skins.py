"""Skins of glTF: joints, inverse bind matrices, influences (glTF 2.0, section 3.7.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hdrusd.errors import InputError
from hdrusd.importers.gltf_accessors import Accessors
from hdrusd.importers.gltf_document import Document, Item
from hdrusd.legacy.scene import Floats, Ints, Node, Skin
from hdrusd.legacy.skinning import influences
from hdrusd.report import Kind

#: Sets of four influences that are looked for: JOINTS_0 to JOINTS_3.
SETS = 4


class SkinReader:
    """Reads the skins of a document, and the influences of its meshes."""

    def __init__(self, document: Document, accessors: Accessors) -> None:
        self._document = document
        self._accessors = accessors
        self._items = document.table("skins")
        self._joints = [item.indices("joints", "nodes") for item in self._items]
        #: Of each mesh that is skinned somewhere, the joints that all its skins have.
        self._of_mesh: dict[int, int] = {}
        for node in document.table("nodes"):
            mesh, skin = node.index("mesh", "meshes"), node.index("skin", "skins")
            if mesh is not None and skin is not None:
                count = len(self._joints[skin])
                self._of_mesh[mesh] = min(count, self._of_mesh.get(mesh, count))

    def influences(
        self, mesh: int, attributes: Item, points: int, name: str
    ) -> tuple[Ints, Floats] | None:
        """Joints and weights of a primitive's vertices; None, with a finding, if unusable."""
        joints = self._of_mesh.get(mesh, 0)
        if not joints or "JOINTS_0" not in attributes:
            return None
        indices, weights = [], []
        try:
            for number in range(SETS):
                keys = f"JOINTS_{number}", f"WEIGHTS_{number}"
                if number and keys[0] not in attributes:
                    break
                index, weight = (self._values(attributes, key, points) for key in keys)
                indices.append(index)
                weights.append(weight)
        except InputError as error:
            self._document.keep_going(error, "skin-dropped", name, "it is not skinned")
            return None
        every = np.concatenate(indices, axis=1)
        whole = np.where(np.isfinite(every), every, -1.0).astype(np.int64)
        found = influences(whole, np.concatenate(weights, axis=1), joints)
        if found.broken or found.free:
            text = f"{found.broken} influences of joints that are not there, negative or not finite"
            text = f"{text}; {found.free} of {points} points without any are on joint 0"
            attributes.note(Kind.INVALID, "skin-weights", text)
        return found.indices, found.weights

    def _values(self, attributes: Item, key: str, points: int) -> Floats:
        accessor = attributes.index(key, "accessors")
        if accessor is None:
            raise attributes.error(f"no usable {key}")
        values = self._accessors.floats(accessor, 4)
        if len(values) != points:
            raise attributes.error(f"{key} has {len(values)} elements, POSITION {points}")
        return values

    def finish(self, made: Mapping[int, Node], meshes: Sequence[Sequence[int]]) -> list[Skin]:
        """The skins of the nodes ``made``, by number; fills in ``skin`` of these.

        ``meshes``: those of each glTF mesh.
        """
        skins: list[Skin] = []
        numbers: dict[int, int | None] = {}
        for number, node in made.items():
            item = self._document.table("nodes")[number]
            if "skin" not in item:
                continue
            skin, mesh = item.index("skin", "skins"), item.index("mesh", "meshes")
            if skin is None or mesh is None or not meshes[mesh]:
                continue
            if skin not in numbers:
                found = self._skin(skin, made)
                numbers[skin] = None if found is None else len(skins)
                skins += [] if found is None else [found]
            node.skin = numbers[skin]
        return skins

    def _skin(self, number: int, made: Mapping[int, Node]) -> Skin | None:
        item, joints = self._items[number], self._joints[number]
        try:
            if not joints:
                raise item.error("no usable joints")
            if lost := [joint for joint in joints if joint not in made]:
                raise item.error(f"joint {lost[0]} is no node of the scene that is read")
            binds = np.tile(np.eye(4), (len(joints), 1, 1))
            if "inverseBindMatrices" in item:
                accessor = item.index("inverseBindMatrices", "accessors")
                if accessor is None:
                    raise item.error("no usable inverseBindMatrices")
                # Column-major for columns is, read by rows, the matrix for row vectors.
                values = self._accessors.floats(accessor, 16)
                if len(values) < len(joints):
                    raise item.error(f"{len(values)} bind matrices for {len(joints)} joints")
                binds = values[: len(joints)].astype(np.float64).reshape(-1, 4, 4)
                binds[:, :, 3] = (0.0, 0.0, 0.0, 1.0)
            if not np.isfinite(binds).all():
                raise item.error("bind matrices that are not finite")
        except InputError as error:
            self._document.keep_going(
                error, "skin-dropped", item.name, "meshes stay in their bind pose"
            )
            return None
        name = item.name or f"skin_{number}"
        return Skin(name, item.ref, tuple(made[joint] for joint in joints), binds)
