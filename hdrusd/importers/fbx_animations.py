"""Animation of FBX: curves of three numbers each, baked by ufbx into translation, turn and scale.

ufbx evaluates layers, pivots, rotation orders and inherited scales; where curves are no straight
lines it gives samples beside the keys.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from hdrusd.importers.fbx_document import Document
from hdrusd.importers.fbx_held import Held
from hdrusd.legacy.scene import TRS, Channel
from hdrusd.report import Kind

_Path = Literal["translation", "rotation", "scale"]

#: Samples a second where a curve is no straight line.
_RATE = 60.0
_KEYFRAME = 0x8
_PATHS: tuple[_Path, ...] = ("translation", "rotation", "scale")


@dataclass(slots=True)
class AnimationReader:
    """The animation that the file plays first, by ufbx's numbers of nodes."""

    document: Document
    _baked: dict[int, Held] = field(default_factory=dict)
    _visible: dict[int, bool] = field(default_factory=dict)  # by number of element
    _keys: int = 0

    def __post_init__(self) -> None:
        document, scene = self.document, self.document.scene
        if not len(scene.anim_stacks):
            return
        if len(scene.anim_stacks) > 1:
            names = [stack.name for stack in scene.anim_stacks][1:9]
            text = f"{len(scene.anim_stacks)} animation stacks; the first is read, without {names}"
            document.note(Kind.DROPPED, "fbx-animation-stack", document.ref(), "", text)
        try:
            baked = document.ufbx.bake_anim(scene, scene.anim, resample_rate=_RATE)
        except document.refusal as error:
            text = f"ufbx cannot evaluate the animation ({error}); dropped"
            document.note(Kind.INVALID, "animation-dropped", document.ref(), "", text)
            return
        self._baked = {int(node.typed_id): node for node in baked.nodes}
        for element in baked.elements:
            self._properties(element)

    def _properties(self, element: Held) -> None:
        """Visibility that does not change counts; what else moves has no home."""
        lost = []
        for prop in element.props:
            if prop.name == "Visibility" and len(prop.keys):
                self._visible[int(element.element_id)] = prop.keys[0].value.x > 0.0
            if not prop.constant_value:
                lost.append(prop.name)
        if lost:
            target = self.document.scene.elements[int(element.element_id)]
            name = target.name  # that of what hangs on a node is often empty
            if not name and len(target.instances):
                name = target.instances[0].name
            place = self.document.ref("element", name)
            text = f"animated {', '.join(lost)[:200]}; stays as the file has it at rest"
            self.document.note(Kind.DROPPED, "animation-path", place, name, text)

    def visible(self, node: Held, stated: bool) -> bool:
        """Visibility at the first key, else ``stated``."""
        return self._visible.get(int(node.element_id), stated)

    def read(self, node: Held, rest: TRS) -> tuple[TRS, tuple[Channel, ...]]:
        """The place of a node where nothing moves it, and what moves it."""
        baked = self._baked.get(int(node.typed_id))
        if baked is None:
            return rest, ()
        channels = []
        for path in _PATHS:
            keys = getattr(baked, f"{path}_keys")
            channel = self._channel(node, path, keys)
            if channel is None:
                continue
            if getattr(baked, f"constant_{path}"):
                rest = replace(rest, **{path: tuple(channel.values[0].tolist())})
            else:
                channels.append(channel)
        return rest, tuple(channels)

    def _channel(self, node: Held, path: _Path, keys: Held) -> Channel | None:
        place = self.document.ref("node", node.name)
        self._keys += len(keys)
        if self._keys > self.document.limits.vertices:
            text = f"more than {self.document.limits.vertices} keys up to here; the rest dropped"
            self.document.note(Kind.DROPPED, "animation-dropped", place, node.name, text)
            return None
        held = list(keys)
        times = np.array([key.time for key in held], np.float64)
        width = 4 if path == "rotation" else 3
        values = np.array([key.value for key in held], np.float64).reshape(-1, width)
        good = np.isfinite(times) & np.isfinite(values).all(axis=1)
        good[1:] &= np.diff(np.fmax.accumulate(times)) > 0.0
        if not good.all():
            text = f"{int((~good).sum())} of {len(times)} keys of {path} are out of order or no"
            text += " numbers; dropped"
            self.document.note(Kind.INVALID, "animation-dropped", place, node.name, text)
        times, values = times[good], values[good]
        if not len(times):
            return None
        between = sum(not int(key.flags) & _KEYFRAME for key in held[1:-1])
        if between:
            text = f"curves resampled at their keys and {_RATE:g} times a second"
            self.document.note(Kind.REPLACED, "animation-cubic", place, node.name, text)
        if path == "rotation":  # the shorter way round from each to the next
            turns = np.where((values[1:] * values[:-1]).sum(axis=1) < 0.0, -1.0, 1.0)
            values[1:] *= np.cumprod(turns)[:, None]
        return Channel(path, times, values)
