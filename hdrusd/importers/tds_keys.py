"""Tracks of the keyframer: keys, and the curve through them as samples.

Positions and scales are splines of Kochanek and Bartels (Interpolating splines with
local tension, continuity, and bias control, 1984), on frames that need not be evenly
spaced. Turns are the same spline of the rotation vectors from key to key, put together on the
sphere (M.-J. Kim, M.-S. Kim and S. Y. Shin, A general construction scheme for unit
quaternion curves with simple high order derivatives, 1995), so that a turn of more
than half a circle is made as it is said. Ends, which the paper leaves open, have no
curvature.

A rotation key says how far and about which axis to turn on from the key before,
clockwise as the axis points.

Source: Autodesk, 3D Studio File Toolkit for release 3, "3DS Chunk Definitions"
(KFDATA); files of 3ds Max, whose matrices at the current frame are those of their keys.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError
from hdrusd.importers.tds_chunks import Chunk, Document
from hdrusd.report import Kind

#: 3D Studio plays 30 frames a second; the file does not say so.
RATE = 30.0

#: A span between keys is cut into at most so many samples a key, however long it claims to be.
_SAMPLES_A_KEY = 64
#: A turn between two keys up to which the shortest arc is the turn itself, radians.
_SHORT = 3.0
#: Track, then frame and use of spline parameters of each key.
_TRACK, _KEY = struct.Struct("<H8xI"), struct.Struct("<IH")
_PARAMETERS = 5  # tension, continuity, bias, ease to, ease from

Doubles = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Track:
    """Keys in rising order. frames: (k,); values: (k, n); parameters: (k, 5), 0 where unsaid."""

    chunk: Chunk
    flags: int
    frames: Doubles
    values: Doubles
    parameters: Doubles

    @property
    def loops(self) -> bool:
        """Whether it starts again behind its last key."""
        return bool(self.flags & 0x2)

    @property
    def moves(self) -> bool:
        """Whether there is more than one key."""
        return len(self.frames) > 1


@dataclass(slots=True)
class TrackReader:
    """Reads the tracks of one file, at most ``limits.vertices`` keys in all."""

    document: Document
    keys: int = 0

    def read(self, chunk: Chunk, width: int, thing: str) -> Track | None:
        """A track of ``width`` floats a key; None, with a finding, where none can be used."""
        document = self.document
        if chunk.begin + _TRACK.size > chunk.end:
            document.note(Kind.INVALID, "3ds-track", chunk, thing, "cut off; left out")
            return None
        flags, declared = _TRACK.unpack_from(document.data, chunk.begin)
        rows = self._rows(chunk, declared, width)
        self.keys += len(rows)
        if self.keys > document.limits.vertices:
            text = f"more than {document.limits.vertices} keys up to here"
            raise InputError(document.ref(chunk), text)
        if len(rows) < declared:
            text = f"{declared} keys declared, {len(rows)} are there"
            document.note(Kind.INVALID, "3ds-track", chunk, thing, text)
        good = np.isfinite(rows).all(axis=1)
        rising = np.append(True, np.diff(rows[:, 0]) > 0.0)[: len(rows)]
        usable = int(np.argmin(np.append(good & rising, False)))
        if usable < len(rows):
            text = f"key {usable + 1} is not finite or not later than the one before; cut there"
            document.note(Kind.INVALID, "3ds-track", chunk, thing, text)
        if not usable:
            return None
        rows = rows[:usable]
        parameters = self._parameters(chunk, rows[:, 1 : 1 + _PARAMETERS], thing)
        return Track(chunk, flags, rows[:, 0], rows[:, 1 + _PARAMETERS :], parameters)

    def _rows(self, chunk: Chunk, declared: int, width: int) -> Doubles:
        """Frame, parameters, values of each key that is there."""
        data, at = self.document.data, chunk.begin + _TRACK.size
        plain = np.dtype([("frame", "<u4"), ("use", "<u2"), ("values", "<f4", (width,))])
        if declared * plain.itemsize == chunk.end - at:
            keys = np.frombuffer(data, plain, declared, at)
            if not keys["use"].any():
                rows = np.zeros((declared, 1 + _PARAMETERS + width))
                rows[:, 0] = keys["frame"]
                with np.errstate(invalid="ignore"):  # a NaN that signals
                    rows[:, 1 + _PARAMETERS :] = keys["values"]
                return rows
        # A key is as long as its parameters say, so that it must be known for the next one.
        found: list[tuple[float, ...]] = []
        while len(found) < declared and at + _KEY.size <= chunk.end:
            frame, use = _KEY.unpack_from(data, at)
            used = [bit for bit in range(_PARAMETERS) if use >> bit & 1]
            size = 4 * (len(used) + width)
            at += _KEY.size
            if at + size > chunk.end:
                break
            values = struct.unpack_from(f"<{len(used) + width}f", data, at)
            parameters = dict(zip(used, values, strict=False))
            said = (parameters.get(bit, 0.0) for bit in range(_PARAMETERS))
            found.append((frame, *said, *values[len(used) :]))
            at += size
        return np.array(found, np.float64).reshape(-1, 1 + _PARAMETERS + width)

    def _parameters(self, chunk: Chunk, said: Doubles, thing: str) -> Doubles:
        """-1 to 1 for the three of the spline, 0 to 1 for easing."""
        kept = np.clip(said, (-1.0, -1.0, -1.0, 0.0, 0.0), 1.0)
        if not np.array_equal(kept, said):
            text = "tension, continuity, bias or easing out of its range; clamped"
            self.document.note(Kind.CLAMPED, "3ds-key-range", chunk, thing, text)
        return np.asarray(kept)


def vectors(track: Track) -> tuple[Doubles, Doubles]:
    """Frames (m,) and values (m, n) between which straight lines follow the spline."""
    if not track.moves:
        return track.frames, track.values
    chords = np.diff(track.values, axis=0)
    into, out = _tangents(track, chords)
    if _even(track) and np.allclose(out[:-1], chords) and np.allclose(into[1:], chords):
        return track.frames, track.values
    frames, span, s = _grid(track)
    s = s[:, None]
    s2, s3 = s * s, s * s * s
    at = track.values
    values = (
        (2.0 * s3 - 3.0 * s2 + 1.0) * at[span]
        + (s3 - 2.0 * s2 + s) * out[span]
        + (3.0 * s2 - 2.0 * s3) * at[span + 1]
        + (s3 - s2) * into[span + 1]
    )
    return frames, values


def turns(track: Track) -> tuple[Doubles, Doubles]:
    """Frames (m,) and unit quaternions (m, 4), x y z w, of a track of angles and axes."""
    axes = track.values[:, 1:]
    length = np.linalg.norm(axes, axis=1, keepdims=True)
    unit = axes / np.where(length > 0.0, length, 1.0)
    steps = -track.values[:, :1] * unit  # rotation vectors; clockwise, hence the sign
    keys = _exp(steps)
    for number in range(1, len(keys)):
        keys[number] = _product(keys[number], keys[number - 1])
    if not track.moves:
        return track.frames, keys
    chords = steps[1:]
    into, out = _tangents(track, chords)
    straight = np.allclose(out[:-1], chords) and np.allclose(into[1:], chords)
    short = bool((np.linalg.norm(chords, axis=1) <= _SHORT).all())
    if _even(track) and straight and short:
        return track.frames, keys
    frames, span, s = _grid(track)
    s = s[:, None]
    first, last = out[:-1] / 3.0, into[1:] / 3.0
    middle = _log_near(
        _product(_exp(-last), _product(_exp(chords), _exp(-first))), chords - first - last
    )
    weights = (1.0 - (1.0 - s) ** 3, 3.0 * s * s - 2.0 * s**3, s**3)
    found = keys[span]
    for weight, turn in zip(weights, (first, middle, last), strict=True):
        found = _product(_exp(weight * turn[span]), found)
    return frames, found / np.linalg.norm(found, axis=1, keepdims=True)


def _even(track: Track) -> bool:
    """Whether nothing is eased."""
    return not track.parameters[:, 3:].any()


def _tangents(track: Track, chords: Doubles) -> tuple[Doubles, Doubles]:
    """Into and out of each key, (k, n), in values a span (equations 8, 9 and 11 of 1984)."""
    tension, continuity, bias = (track.parameters[:, [i]] for i in range(3))
    into, out = np.zeros((2, len(chords) + 1, chords.shape[1]))
    t, c, b = tension[1:-1], continuity[1:-1], bias[1:-1]
    before, after = chords[:-1], chords[1:]
    length = np.diff(track.frames)[:, None]
    share = 2.0 * length[:-1] / (length[:-1] + length[1:])
    blend = 1.0 - np.abs(c)
    slow, fast = 1.0 + blend * (share - 1.0), 1.0 + blend * ((2.0 - share) - 1.0)
    half = 0.5 * (1.0 - t)
    into[1:-1] = half * slow * ((1.0 - c) * (1.0 + b) * before + (1.0 + c) * (1.0 - b) * after)
    out[1:-1] = half * fast * ((1.0 + c) * (1.0 + b) * before + (1.0 - c) * (1.0 - b) * after)
    if len(chords) == 1:
        out[0], into[-1] = (1.0 - tension[0]) * chords[0], (1.0 - tension[-1]) * chords[0]
    else:
        out[0] = (1.0 - tension[0]) * (1.5 * chords[0] - 0.5 * into[1])
        into[-1] = (1.0 - tension[-1]) * (1.5 * chords[-1] - 0.5 * out[-2])
    return into, out


def _grid(track: Track) -> tuple[Doubles, npt.NDArray[np.int64], Doubles]:
    """Frames, of each the span that it lies in, and the eased share of it that is over."""
    frames = samples(track.frames)
    span = np.clip(
        np.searchsorted(track.frames, frames, side="right") - 1, 0, len(track.frames) - 2
    )
    s = (frames - track.frames[span]) / np.diff(track.frames)[span]
    leave, reach = track.parameters[span, 4], track.parameters[span + 1, 3]
    both = np.maximum(leave + reach, 1.0)
    leave, reach = leave / both, reach / both
    top = 1.0 / (2.0 - leave - reach)
    eased = (2.0 * s - leave) * top
    eased = np.where(s < leave, top * s * s / np.where(leave > 0.0, leave, 1.0), eased)
    rest = 1.0 - s
    slowing = 1.0 - top * rest * rest / np.where(reach > 0.0, reach, 1.0)
    return frames, span, np.where(rest < reach, slowing, eased)


def samples(keys: Doubles) -> Doubles:
    """Keys (k,) in frames, and every frame between them, or every so many where they are too many.

    All are whole numbers, so that no two are the same but for rounding.
    """
    step = max(1.0, np.ceil(float(keys[-1] - keys[0]) / (_SAMPLES_A_KEY * len(keys))))
    return np.union1d(keys, np.arange(keys[0], keys[-1], step))


def _exp(vector: Doubles) -> Doubles:
    """Unit quaternions of rotation vectors, (k, 3), radians."""
    angle = np.linalg.norm(vector, axis=1, keepdims=True)
    axis = vector / np.where(angle > 0.0, angle, 1.0)
    return np.concatenate([np.sin(0.5 * angle) * axis, np.cos(0.5 * angle)], axis=1)


def _log_near(turn: Doubles, wanted: Doubles) -> Doubles:
    """Of the rotation vectors of unit quaternions those nearest to ``wanted``, (k, 3)."""
    sine = np.linalg.norm(turn[:, :3], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, turn[:, 3:])
    length = np.linalg.norm(wanted, axis=1, keepdims=True)
    aside = wanted / np.where(length > 0.0, length, 1.0)
    axis = np.where(sine > 1e-9, turn[:, :3] / np.where(sine > 0.0, sine, 1.0), aside)
    along = np.sum(axis * wanted, axis=1, keepdims=True)
    return np.asarray(axis * (angle + 2.0 * np.pi * np.round((along - angle) / (2.0 * np.pi))))


def _product(a: Doubles, b: Doubles) -> Doubles:
    """Turn by b, then by a: the product a b of quaternions, x y z w in the last axis."""
    ax, ay, az, aw = np.moveaxis(a, -1, 0)
    bx, by, bz, bw = np.moveaxis(b, -1, 0)
    parts = (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
    return np.stack(parts, axis=-1)
