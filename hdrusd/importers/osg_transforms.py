"""Transforms of OpenSceneGraph nodes, at rest and along an AnimationPath.

OpenSceneGraph's matrices act on row vectors, as ours do, and its quaternions are
(x, y, z, w). A path takes the place of the matrix of its node.

Sources: OpenSceneGraph 3.6, src/osg/PositionAttitudeTransform.cpp, AnimationPath.cpp,
src/osgSim/DOFTransform.cpp, and their serializers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from hdrusd.errors import InputError
from hdrusd.importers.osg_text import Document, Doubles, Statement, listed, triple
from hdrusd.legacy.scene import TRS, Channel, Vec3
from hdrusd.report import Kind

_LOOPS: dict[str, Literal["none", "loop", "swing"]] = {
    "NO_LOOPING": "none",
    "LOOP": "loop",
    "SWING": "swing",
}
_ORIGIN: Vec3 = (0.0, 0.0, 0.0)
_ONE: Vec3 = (1.0, 1.0, 1.0)
#: Classes with a transform of their own to the name of their rotation's field.
_TRS_CLASSES = {
    "PositionAttitudeTransform": "attitude",
    "AutoTransform": "rotation",
    "CameraView": "attitude",
}
_TRANSFORMS = {"Transform", "MatrixTransform", "DOFTransform", "LightSource", *_TRS_CLASSES}
_CALLBACKS = ("updatecallback", "updatecallbacks")
_ANIMATED = {"MatrixTransform", "PositionAttitudeTransform", "CameraView"}


@dataclass(frozen=True, slots=True)
class Placement:
    """Where a node stands. ``pivot``, under an animation, is moved to the origin first."""

    transform: TRS | Doubles | None = None
    animation: tuple[Channel, ...] = ()
    pivot: Vec3 = _ORIGIN
    faces_viewer: bool = False


_NOWHERE = Placement()


class TransformReader:
    """Reads the transforms of one file; counts control points against ``limit`` over all of it.

    The count is needed because one path may stand for many by reference.
    """

    def __init__(self, document: Document, limit: int) -> None:
        self.document = document
        self.limit = limit
        self.points = 0

    def read(self, node: Statement, name: str) -> Placement:
        """The placement of any node; identity for those that are no transforms."""
        kind = node.class_name
        if kind in _TRANSFORMS:
            self._reference_frame(node, name)
        elif self.document.field(node, *_CALLBACKS) is None:
            return _NOWHERE
        animation, pivot = self._animation(node, name)
        if animation:
            return Placement(None, animation, pivot)
        if kind == "MatrixTransform":
            return Placement(self._matrix(node, name))
        if kind == "DOFTransform":
            return Placement(self._degrees_of_freedom(node, name))
        if kind in _TRS_CLASSES:
            return Placement(self._trs(node, name), faces_viewer=self._faces_viewer(node, name))
        return _NOWHERE

    def _reference_frame(self, node: Statement, name: str) -> None:
        frame = self.document.word(node, "referenceframe") or "RELATIVE"
        if frame.startswith("ABSOLUTE") or frame == "RELATIVE_TO_ABSOLUTE":
            text = f"reference frame {frame}: follows the viewer; placed among its parents here"
            self.document.add(Kind.REPLACED, "osg-reference-frame", node, name, text)

    def _matrix(self, node: Statement, name: str) -> Doubles | None:
        values = self.document.numbers(node, 16, "matrix")
        if values is None:
            return None
        matrix = np.array(values, dtype=np.float64).reshape(4, 4)
        if not np.array_equal(matrix[:, 3], (0.0, 0.0, 0.0, 1.0)):
            text = "matrix with perspective; its last column is replaced by 0 0 0 1"
            self.document.add(Kind.REPLACED, "osg-matrix", node, name, text)
            matrix[:, 3] = (0.0, 0.0, 0.0, 1.0)
        return None if np.array_equal(matrix, np.eye(4)) else matrix

    def _trs(self, node: Statement, name: str) -> TRS | Doubles | None:
        document = self.document
        position = document.numbers(node, 3, "position") or _ORIGIN
        scale = document.numbers(node, 3, "scale") or _ONE
        turn = document.numbers(node, 4, _TRS_CLASSES[node.class_name]) or (0.0, 0.0, 0.0, 1.0)
        length = math.hypot(*turn)
        if not 0.0 < length < math.inf:
            text = "rotation of no length; none is used"
            document.add(Kind.INVALID, "osg-rotation", node, name, text)
            turn, length = (0.0, 0.0, 0.0, 1.0), 1.0
        x, y, z, w = (part / length for part in turn)
        made = TRS(triple(position), (x, y, z, w), triple(scale))
        pivot = document.numbers(node, 3, "pivotpoint") or _ORIGIN
        if pivot != _ORIGIN:  # translate(-pivot) scale rotate translate
            matrix = np.diag((*scale, 1.0)) @ rotation_matrix(made.rotation)
            matrix[3, :3] = position
            with np.errstate(over="ignore", invalid="ignore"):
                matrix[3, :3] -= np.array(pivot) @ matrix[:3, :3]
            if not np.isfinite(matrix).all():
                text = "pivot out of range; left out"
                document.add(Kind.INVALID, "osg-pivot", node, name, text)
                return made
            return matrix
        return None if made == TRS() else made

    def _faces_viewer(self, node: Statement, name: str) -> bool:
        document = self.document
        mode = document.word(node, "autorotatemode") or "NO_ROTATION"
        turned = mode != "NO_ROTATION" or document.flag(node, "autorotatetoscreen")
        if turned:
            text = f"{mode}: turns with the viewer; kept as a billboard at rest"
            document.add(Kind.REPLACED, "osg-auto-rotate", node, name, text)
        if document.flag(node, "autoscaletoscreen"):
            text = "keeps its size on the screen; its scale is used as it stands"
            document.add(Kind.REPLACED, "osg-auto-scale", node, name, text)
        return turned

    def _degrees_of_freedom(self, node: Statement, name: str) -> Doubles | None:
        """A DOFTransform where it stands: Put, scale, three turns, translate, inverse Put."""
        document = self.document
        if document.flag(node, "animationon"):
            text = "moves by itself between its limits; kept at its current position"
            document.add(Kind.DROPPED, "osg-degrees-of-freedom", node, name, text)
        order = document.word(node, "hprmultorder", "multorder") or "PRH"
        heading, pitch, roll = document.numbers(node, 3, "currenthpr") or _ORIGIN
        scale = document.numbers(node, 3, "currentscale") or _ONE
        put = document.numbers(node, 16, "putmatrix")
        turns = {
            "H": (0.0, 0.0, math.sin(heading / 2.0), math.cos(heading / 2.0)),
            "P": (math.sin(pitch / 2.0), 0.0, 0.0, math.cos(pitch / 2.0)),
            "R": (0.0, math.sin(roll / 2.0), 0.0, math.cos(roll / 2.0)),
        }
        current = np.eye(4)
        current[3, :3] = document.numbers(node, 3, "currenttranslate") or _ORIGIN
        for letter in order if sorted(order) == ["H", "P", "R"] else "PRH":
            current = rotation_matrix(turns[letter]) @ current
        current = np.diag((*(scale if any(scale) else _ONE), 1.0)) @ current
        if put is not None:
            matrix = np.array(put, dtype=np.float64).reshape(4, 4)
            try:
                with np.errstate(all="ignore"):
                    current = matrix @ current @ np.linalg.inv(matrix)
            except np.linalg.LinAlgError:
                current = np.full((4, 4), math.nan)
            current[:, 3] = (0.0, 0.0, 0.0, 1.0)
        if not np.isfinite(current).all():
            text = "put matrix has no inverse; the node stands at its parent's origin"
            document.add(Kind.INVALID, "osg-matrix", node, name, text)
            return None
        return None if np.array_equal(current, np.eye(4)) else current

    def _animation(self, node: Statement, name: str) -> tuple[tuple[Channel, ...], Vec3]:
        document = self.document
        found: tuple[tuple[Channel, ...], Vec3] = (), _ORIGIN
        for callback in self._callbacks(node):
            if callback.class_name != "AnimationPathCallback" or found[0]:
                text = f"{callback.class_name}: behaviour of a program; dropped"
                document.add(Kind.DROPPED, "osg-callback", callback, name, text)
            elif node.class_name not in _ANIMATED:
                text = f"animation path on a {node.class_name}; it moves nothing; dropped"
                document.add(Kind.DROPPED, "osg-animation", callback, name, text)
            elif document.flag(callback, "useinversematrix"):
                text = "animation path used inverted; dropped"
                document.add(Kind.DROPPED, "osg-animation", callback, name, text)
            else:
                channels = self._channels(callback, name, scaled=node.class_name != "CameraView")
                pivot = document.numbers(callback, 3, "pivotpoint") or _ORIGIN
                if pivot != _ORIGIN and channels:
                    text = f"pivot {listed(pivot)}: kept as an inner node"
                    document.add(Kind.REPLACED, "osg-animation-pivot", callback, name, text)
                found = channels, triple(pivot)
        return found

    def _callbacks(self, node: Statement) -> Iterator[Statement]:
        """The update callbacks of a node and those nested in them."""
        document = self.document
        waiting = [document.field(node, *_CALLBACKS)]
        seen: set[int] = set()
        while waiting:
            holder = waiting.pop()
            for callback in document.objects(None if holder is None else holder.block):
                if id(callback) not in seen:
                    seen.add(id(callback))
                    yield callback
                    waiting.append(document.field(callback, "nestedcallback", "updatecallbacks"))

    def _channels(self, callback: Statement, name: str, *, scaled: bool) -> tuple[Channel, ...]:
        document = self.document
        path = document.object(callback, "animationpath")
        points = np.zeros((0, 11)) if path is None else self._control_points(path)
        self.points += len(points)
        if self.points > self.limit:
            raise InputError(
                document.ref(callback), f"more than {self.limit} control points in all"
            )
        with np.errstate(over="ignore"):
            lengths = np.sqrt((points[:, 4:8] ** 2).sum(axis=1))
        good = np.isfinite(points).all(axis=1) & (lengths > 0.0) & np.isfinite(lengths)
        if not good.all():
            text = f"{int((~good).sum())} control points are no numbers or do not turn; left out"
            document.add(Kind.INVALID, "osg-animation", callback, name, text)
        points, lengths = points[good], lengths[good]
        if path is None or not len(points):
            text = "animation path without control points; dropped"
            document.add(Kind.DROPPED, "osg-animation", callback, name, text)
            return ()
        word = document.word(path, "loopmode") or "LOOP"
        loop = _LOOPS.get(word)
        if loop is None:
            text = f"loop mode {word} is unknown; want {', '.join(_LOOPS)}; LOOP is used"
            document.add(Kind.INVALID, "osg-animation", path, name, text)
        times, points, lengths = self._times(callback, name, points, lengths)
        turns = points[:, 4:8] / lengths[:, None]
        kept = [
            Channel("translation", times, points[:, 1:4].copy(), loop=loop or "loop"),
            Channel("rotation", times, turns, loop=loop or "loop"),
        ]
        if scaled and not np.array_equal(points[:, 8:], np.ones((len(points), 3))):
            kept.append(Channel("scale", times, points[:, 8:].copy(), loop=loop or "loop"))
        return tuple(kept)

    def _times(
        self, callback: Statement, name: str, points: Doubles, lengths: Doubles
    ) -> tuple[Doubles, Doubles, Doubles]:
        """Scene times, rising, and the points in their order; a later point replaces an equal one.

        A path's time is (scene time - offset) x multiplier.
        """
        offset = self.document.number(callback, 0.0, "timeoffset")
        multiplier = self.document.number(callback, 1.0, "timemultiplier")
        with np.errstate(all="ignore"):
            times = points[:, 0] / multiplier + offset if multiplier else points[:, 0]
        if not multiplier or not np.isfinite(times).all():
            text = f"time multiplier {multiplier:g}, offset {offset:g}; want 1, 0; those are used"
            self.document.add(Kind.INVALID, "osg-animation", callback, name, text)
            times = points[:, 0]
        order = np.argsort(times, kind="stable")
        last = np.append(np.diff(times[order]) > 0.0, True)
        order = order[last]
        return times[order], points[order], lengths[order]

    def _control_points(self, path: Statement) -> Doubles:
        """Rows of time, position, rotation, scale. NaN in what a point leaves out or breaks."""
        document = self.document
        holder = document.field(path, "controlpoints", "timecontrolpointmap")
        if holder is None or holder.block is None:
            return np.zeros((0, 11))
        if holder.key == "controlpoints":
            numbers = holder.block.numbers()
            if len(numbers) % 11:
                text = (
                    f"{len(numbers)} numbers; want 11 for each control point; the rest is left out"
                )
                document.add(Kind.INVALID, "osg-animation", holder, "", text)
            return numbers[: len(numbers) // 11 * 11].reshape(-1, 11)
        rows = [
            (
                *_or_nan(None if len(s.words) < 2 else _float(s.words[1]), 1),
                *_or_nan(document.numbers(s, 3, "position"), 3),
                *_or_nan(document.numbers(s, 4, "rotation"), 4),
                *_or_nan(document.numbers(s, 3, "scale"), 3),
            )
            for s in holder.block.statements
            if s.key == "time"
        ]
        return np.array(rows, dtype=np.float64).reshape(-1, 11)


def _float(word: str) -> tuple[float, ...] | None:
    try:
        return (float(word),)
    except ValueError:
        return None


def _or_nan(values: tuple[float, ...] | None, count: int) -> tuple[float, ...]:
    return (math.nan,) * count if values is None else values


def rotation_matrix(turn: tuple[float, float, float, float]) -> Doubles:
    """The (4, 4) row-vector matrix of a unit quaternion (x, y, z, w)."""
    x, y, z, w = turn
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0.0],
            [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0.0],
            [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
