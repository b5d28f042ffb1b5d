"""Where the keyframer puts things: its nodes as transforms and channels.

A node scales, turns and moves its mesh about a pivot, and its children about its place.
Cameras and spotlights turn to their targets, which move on their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from hdrusd.errors import SourceRef
from hdrusd.importers.osg_transforms import rotation_matrix
from hdrusd.importers.tds_aim import aim
from hdrusd.importers.tds_chunks import Document
from hdrusd.importers.tds_keyframer import TARGET_OF, KeyNode
from hdrusd.importers.tds_keys import RATE, Track, samples, turns, vectors
from hdrusd.legacy.scene import TRS, Channel, Node, Vec3
from hdrusd.report import Kind

Doubles = npt.NDArray[np.float64]
_Path = Literal["translation", "rotation", "scale"]

_ORIGIN: Vec3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Aimed:
    """A camera or light as the mesh editor has it; ``target`` None: it looks nowhere."""

    place: Vec3
    target: Vec3 | None = None
    roll: float = 0.0  # degrees


def standing(name: str, source: SourceRef, aimed: Aimed) -> Node:
    """The node of a thing that the keyframer does not know."""
    trs = TRS(aimed.place)
    if aimed.target is not None:
        places, targets = np.array([aimed.place]), np.array([aimed.target])
        trs = replace(trs, rotation=_quaternion(aim(places, targets, np.array([aimed.roll]))[0]))
    return Node(name, source, trs)


@dataclass(slots=True)
class Placer:
    """Makes a node of each of ``keys``: the one of that number in ``nodes``.

    ``aims``: what cameras and lights among them have where their tracks say nothing.
    """

    document: Document
    keys: Sequence[KeyNode]
    aims: dict[int, Aimed]
    nodes: list[Node]

    def place(self) -> None:
        """Fill ``nodes``; their trees are for the caller to build."""
        self.nodes.extend(self._placed(number) for number in range(len(self.keys)))
        targets: dict[tuple[int, str], KeyNode] = {}
        for key in self.keys:
            targets.setdefault((key.kind, key.name), key)
        for number, aimed in self.aims.items():
            if aimed.target is not None:
                key = self.keys[number]
                self._turn(number, aimed, targets.get((TARGET_OF.get(key.kind, 0), key.name)))

    def _placed(self, number: int) -> Node:
        key = self.keys[number]
        aimed = self.aims.get(number)
        trs = TRS(_ORIGIN if aimed is None else aimed.place)
        channels: list[Channel] = []
        tracks = key.tracks
        if "position" in tracks:
            place = _channel("translation", tracks["position"], channels)
            trs = replace(trs, translation=place)
        if aimed is None and "rotation" in tracks:
            frames, values = turns(tracks["rotation"])
            _add("rotation", frames, values, tracks["rotation"].loops, channels)
            trs = replace(trs, rotation=_quaternion(values[0]))
        if aimed is None and "scale" in tracks:
            trs = replace(trs, scale=_channel("scale", tracks["scale"], channels))
        if 0.0 in trs.scale:
            text = f"scale {trs.scale} flattens what is below"
            self.document.note(Kind.ASSUMED, "3ds-flat", key.chunk, key.title, text)
        return Node(
            key.title,
            self.document.ref(key.chunk),
            trs,
            animation=tuple(channels),
            visible=not key.hidden,
        )

    def _turn(self, number: int, aimed: Aimed, target: KeyNode | None) -> None:
        """Turn a node to its target, at every frame where either moves."""
        assert aimed.target is not None
        key, node = self.keys[number], self.nodes[number]
        position, roll = key.tracks.get("position"), key.tracks.get("roll")
        goal = None if target is None else target.tracks.get("position")
        moving = [track for track in (position, goal, roll) if track is not None and track.moves]
        grids = [samples(track.frames) for track in moving]
        frames = np.unique(np.concatenate(grids)) if grids else np.zeros(1)
        looks = _at(goal, frames, aimed.target)
        above = target.parent if target is not None and goal is not None else None
        if above != key.parent:
            looks = self._between(number, looks, above)
        rolls = np.fmod(_at(roll, frames, (aimed.roll,))[:, 0], 360.0)
        turned = aim(_at(position, frames, aimed.place), looks, rolls)
        channels = list(node.animation)
        _add("rotation", frames, turned, any(track.loops for track in moving), channels)
        node.animation = tuple(channels)
        trs = node.transform if isinstance(node.transform, TRS) else TRS()
        node.transform = replace(trs, rotation=_quaternion(turned[0]))

    def _between(self, number: int, points: Doubles, above: int | None) -> Doubles:
        """Points below the node ``above`` as seen from where a node stands, at the first frame."""
        key = self.keys[number]
        if (above is not None and self._moves(above)) or self._moves(key.parent):
            text = "looks at what hangs on another node that moves; aimed as at the first frame"
            self.document.note(Kind.REPLACED, "3ds-target", key.chunk, key.title, text)
        there, here = self._world(above), self._world(key.parent)
        try:
            with np.errstate(all="ignore"):
                change = there @ np.linalg.inv(here)
                moved = points @ change[:3, :3] + change[3, :3]
        except np.linalg.LinAlgError:
            return points
        return moved if np.isfinite(moved).all() else points

    def _moves(self, number: int | None) -> bool:
        while number is not None:
            if self.nodes[number].animation:
                return True
            number = self.keys[number].parent
        return False

    def _world(self, number: int | None) -> Doubles:
        """(4, 4), row vectors, of a node at the first frame."""
        world = np.eye(4)
        with np.errstate(all="ignore"):
            while number is not None:
                world = world @ matrix(self.nodes[number])
                number = self.keys[number].parent
        return world


def matrix(node: Node) -> Doubles:
    """(4, 4), row vectors, of a node at rest or at its first frame."""
    if not isinstance(node.transform, TRS):
        return np.eye(4) if node.transform is None else node.transform
    made = np.diag((*node.transform.scale, 1.0)) @ rotation_matrix(node.transform.rotation)
    made[3, :3] = node.transform.translation
    return made


def _at(track: Track | None, frames: Doubles, default: Sequence[float]) -> Doubles:
    """Values at frames, (m, n), held before the first key and after the last."""
    if track is None:
        return np.broadcast_to(np.array(default, np.float64), (len(frames), len(default)))
    at, values = vectors(track)
    return np.stack([np.interp(frames, at, column) for column in values.T], axis=1)


def _channel(path: _Path, track: Track, channels: list[Channel]) -> Vec3:
    """The first value of a track of vectors; where it moves, a channel."""
    frames, values = vectors(track)
    _add(path, frames, values, track.loops, channels)
    x, y, z = values[0].tolist()
    return x, y, z


def _add(
    path: _Path, frames: Doubles, values: Doubles, loops: bool, channels: list[Channel]
) -> None:
    if len(frames) > 1:
        loop: Literal["none", "loop"] = "loop" if loops else "none"
        channels.append(Channel(path, frames / RATE, values.copy(), loop=loop))


def _quaternion(values: Doubles) -> tuple[float, float, float, float]:
    x, y, z, w = (values + 0.0).tolist()  # -0.0 is 0.0
    return x, y, z, w
