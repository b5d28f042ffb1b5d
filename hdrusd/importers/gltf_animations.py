"""Node animations of glTF: samplers to channels (glTF 2.0, section 3.11 and appendix C)."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError
from hdrusd.importers.gltf_accessors import Accessors
from hdrusd.importers.gltf_document import Document, Item
from hdrusd.legacy.scene import Channel
from hdrusd.report import Kind

#: Samples a second of a resampled cubic spline, beside its own keys. No USD curve of
#: transforms is cubic; 60 is above the frame rates of driving simulators' replays.
CUBIC_RATE = 60.0

#: A span between two keys is never cut finer, however long it claims to last.
_SAMPLES_A_KEY = 64

_WIDTHS: dict[str, int] = {"translation": 3, "rotation": 4, "scale": 3}

Doubles = npt.NDArray[np.float64]


def read_animations(document: Document, accessors: Accessors) -> dict[int, tuple[Channel, ...]]:
    """The channels of each animated node. Raises InputError past the limit of samples.

    Where several channels drive one path of one node the first of the file wins.
    """
    reader = _Reader(document, accessors)
    for animation in document.table("animations"):
        samplers = animation.children("samplers")
        for item in animation.children("channels"):
            reader.add(item, animation.name, samplers)
    return {node: tuple(paths.values()) for node, paths in reader.by_node.items()}


class _Reader:
    def __init__(self, document: Document, accessors: Accessors) -> None:
        self.by_node: dict[int, dict[str, Channel]] = {}
        self._document = document
        self._accessors = accessors
        self._samples = 0

    def add(self, item: Item, animation: str, samplers: list[Item]) -> None:
        """Add one channel, or a finding that says why not."""
        target = item.child("target")
        path = target.text("path")
        if path not in _WIDTHS:
            text = f"animation of {path[:40]!r} dropped; want translation, rotation or scale"
            target.note(Kind.DROPPED, "animation-path", text)
            return
        node = target.index("node", "nodes")
        if node is None:
            target.note(Kind.DROPPED, "animation-target", "no usable node; channel dropped")
            return
        if path in self.by_node.get(node, {}):
            text = f"{path} of node {node} is driven already; channel of {animation!r} dropped"
            target.note(Kind.DROPPED, "animation-second", text)
            return
        try:
            channel = self._channel(item, path, samplers)
        except InputError as error:
            self._document.keep_going(error, "animation-dropped", animation, "channel dropped")
            return
        self._samples += len(channel.times)
        if self._samples > self._document.limits.vertices:
            raise item.error(f"more than {self._document.limits.vertices} samples up to here")
        self.by_node.setdefault(node, {})[path] = channel

    def _channel(self, item: Item, path: str, samplers: list[Item]) -> Channel:
        number = item.integer("sampler")
        if number is None or number >= len(samplers):
            raise item.error(f"sampler {number}; want one of {len(samplers)}")
        sampler = samplers[number]
        inputs = sampler.index("input", "accessors")
        outputs = sampler.index("output", "accessors")
        if inputs is None or outputs is None:
            raise sampler.error("no usable input and output")
        times = self._accessors.floats(inputs, 1)[:, 0].astype(np.float64)
        values = self._accessors.floats(outputs, _WIDTHS[path]).astype(np.float64)
        mode = sampler.text("interpolation", "LINEAR")
        if mode not in ("LINEAR", "STEP", "CUBICSPLINE"):
            text = f"interpolation {mode[:40]!r}; LINEAR is used"
            sampler.note(Kind.INVALID, "animation-interpolation", text)
        cubic = mode == "CUBICSPLINE"
        wanted = len(times) * (3 if cubic else 1)
        if len(values) != wanted:
            raise sampler.error(f"{len(values)} values for {len(times)} times; want {wanted}")
        if not (np.isfinite(times).all() and np.isfinite(values).all()):
            raise sampler.error("times or values that are not finite")
        if (np.diff(times) <= 0.0).any():
            raise sampler.error("times that do not rise")
        if cubic:
            times, values, rate = _resampled(times, values)
            text = f"cubic spline resampled at its keys and {rate:g} times a second"
            sampler.note(Kind.REPLACED, "animation-cubic", text)
        if path == "rotation":
            values = _unit(sampler, values)
        return Channel(_path(path), times, values, "step" if mode == "STEP" else "linear")


def _path(path: str) -> Literal["translation", "rotation", "scale"]:
    if path == "translation":
        return "translation"
    return "rotation" if path == "rotation" else "scale"


def _resampled(keys: Doubles, values: Doubles) -> tuple[Doubles, Doubles, float]:
    """A Hermite spline (appendix C.5) at its keys and on a regular grid between them.

    keys: (k,) seconds; values: (3 k, n), of each key the in-tangent, the value and the
    out-tangent, tangents per second. Returns times, values and the grid's rate in Hz.
    """
    into, at, out = values[0::3], values[1::3], values[2::3]
    length = float(keys[-1] - keys[0])
    if length == 0.0:
        return keys, at, CUBIC_RATE
    rate = min(CUBIC_RATE, _SAMPLES_A_KEY * len(keys) / length)
    grid = keys[0] + np.arange(1, int(length * rate) + 1) / rate
    times = np.union1d(keys, grid[grid < keys[-1]])
    span = np.clip(np.searchsorted(keys, times, side="right") - 1, 0, len(keys) - 2)
    duration = (keys[span + 1] - keys[span])[:, None]
    s = (times - keys[span])[:, None] / duration
    s2, s3 = s * s, s * s * s
    spline = (
        (2.0 * s3 - 3.0 * s2 + 1.0) * at[span]
        + (s3 - 2.0 * s2 + s) * duration * out[span]
        + (3.0 * s2 - 2.0 * s3) * at[span + 1]
        + (s3 - s2) * duration * into[span + 1]
    )
    return times, spline, rate


def _unit(sampler: Item, quaternions: Doubles) -> Doubles:
    """Quaternions of length 1. Raises InputError where one has no direction."""
    lengths = np.sqrt((quaternions * quaternions).sum(axis=1, keepdims=True))
    if not (lengths > 1e-6).all():
        raise sampler.error("a rotation of length 0")
    unit: Doubles = quaternions / lengths
    return unit
