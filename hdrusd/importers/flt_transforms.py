"""Where OpenFlight nodes stand: their matrix or its parts, replication, degrees of freedom.

Row vectors, as everywhere here: ``p' = p M``. A matrix record (49) is the product of the
records behind it (76 to 82, 94), which an editor keeps, so they count only without it.

Source: OpenFlight Specification 16.5, "Transformation Records", "Degree of Freedom
Record". The order of a degree of freedom's turns is OpenSceneGraph's
(osgSim::DOFTransform): about z, y, x, in the frame that the record gives.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hdrusd.importers.flt_records import Document
from hdrusd.report import Kind

Doubles = npt.NDArray[np.float64]

MATRIX, _EDGE, _TRANSLATE, _SCALE, _ABOUT, _TO_POINT, _PUT, _GENERAL = (
    49,
    76,
    78,
    79,
    80,
    81,
    82,
    94,
)
#: Those that change a place, in whatever part.
TRANSFORMS = (MATRIX, _EDGE, 77, _TRANSLATE, _SCALE, _ABOUT, _TO_POINT, _PUT, _GENERAL)

_IDENTITY = tuple(np.eye(4).ravel().tolist())
_NO_POINT = -1.0e8  # what some editors write for a point of a frame that nobody set


def read_transform(document: Document, records: Sequence[int], name: str) -> Doubles | None:
    """The matrix (4, 4) of the transform records of a node; None for the identity."""
    whole = [record for record in records if document.records.op[record] == MATRIX]
    matrix = np.eye(4)
    with np.errstate(all="ignore"):  # numbers out of range are found in the end
        for record in whole[:1] or records:
            matrix = matrix @ _part(document, record, name)
    if len(whole) > 1:
        text = f"{len(whole)} matrices; the first is used"
        document.add(Kind.INVALID, "flt-matrix", whole[1], name, text)
    return checked(document, records[0], name, matrix) if records else None


def checked(document: Document, record: int, name: str, matrix: Doubles) -> Doubles | None:
    """A matrix that can be written, None for the identity; what is wrong is a finding."""
    if not (np.abs(matrix) < 1e30).all():
        text = "matrix with numbers out of range; the node stands where its parent does"
        document.add(Kind.INVALID, "flt-matrix", record, name, text)
        return None
    if not np.array_equal(matrix[:, 3], (0.0, 0.0, 0.0, 1.0)):
        text = "matrix with perspective; its last column is replaced by 0 0 0 1"
        document.add(Kind.REPLACED, "flt-matrix", record, name, text)
        matrix = matrix.copy()
        matrix[:, 3] = (0.0, 0.0, 0.0, 1.0)
    return None if np.array_equal(matrix, np.eye(4)) else matrix


def _part(document: Document, record: int, name: str) -> Doubles:
    op = int(document.records.op[record])

    def numbers(offset: int, layout: str, default: tuple[float, ...]) -> Doubles:
        return np.array(document.numbers(record, offset, layout, default, name))

    if op in (MATRIX, _GENERAL):
        return numbers(4, "16f", _IDENTITY).reshape(4, 4)
    points = numbers(8, "6d" if op in (_EDGE, _TRANSLATE) else "3d", (0.0,) * 6)
    center, second = points[:3], points[3:6]
    if op == _TRANSLATE:
        return moved(second)
    if op == _EDGE:
        (angle,) = numbers(56, "f", (0.0,))
        return about(center, turned(second - center, angle))
    if op == _SCALE:
        return about(center, np.diag([*numbers(32, "3f", (1.0, 1.0, 1.0)), 1.0]))
    if op == _ABOUT:
        axis = numbers(32, "4f", (0.0, 0.0, 1.0, 0.0))
        return about(center, turned(axis[:3], axis[3]))
    if op == _PUT:
        return _put(numbers(8, "18d", (0.0,) * 18).reshape(6, 3))
    if op == _TO_POINT:
        text = "rotated and scaled to a point, and no matrix; composed from its parts"
        document.add(Kind.ASSUMED, "flt-transform", record, name, text)
        points = numbers(8, "9d", (0.0,) * 9).reshape(3, 3)
        factors = numbers(80, "3f", (1.0, 1.0, 0.0))
        start, goal = points[1] - points[0], points[2] - points[0]
        length = float(np.dot(start, start))
        along = np.eye(4)
        if length > 0.0:  # scaled in the direction of the reference point
            along[:3, :3] += (factors[1] - 1.0) * np.outer(start, start) / length
        along[:3, :3] *= factors[0]
        return about(points[0], along @ turned(np.cross(start, goal), factors[2]))
    text = "an obsolete transform; left out"
    document.add(Kind.DROPPED, "flt-transform", record, name, text)
    return np.eye(4)


def moved(by: Doubles) -> Doubles:
    """A translation."""
    matrix = np.eye(4)
    matrix[3, :3] = by
    return matrix


def about(center: Doubles, matrix: Doubles) -> Doubles:
    """A matrix applied about a point."""
    return moved(-center) @ matrix @ moved(center)


def turned(axis: Doubles, degrees: float) -> Doubles:
    """A rotation about an axis through the origin, counter-clockwise seen from its tip."""
    matrix = np.eye(4)
    length = float(np.linalg.norm(axis))
    if not 0.0 < length < math.inf:
        return matrix
    x, y, z = (axis / length).tolist()
    cross = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])  # p cross = axis x p
    angle = math.radians(math.remainder(degrees, 360.0))
    matrix[:3, :3] += math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
    return matrix


def frame(points: Doubles) -> Doubles:
    """The frame of an origin, a point on its x axis and one in its xy plane, (3, 3)."""
    matrix = np.eye(4)
    x = points[1] - points[0]
    z = np.cross(x, points[2] - points[0])
    lengths = np.linalg.norm(x), np.linalg.norm(z)
    if all(0.0 < length < math.inf for length in lengths):
        x, z = x / lengths[0], z / lengths[1]
        matrix[:3, :3] = x, np.cross(z, x), z
    matrix[3, :3] = points[0]
    return matrix


def _put(points: Doubles) -> Doubles:
    """From a frame to a frame, of an origin, an align point and a track point each."""
    return np.linalg.inv(frame(points[:3])) @ frame(points[3:])


def degrees_of_freedom(document: Document, record: int, name: str) -> Doubles | None:
    """The matrix of a degree of freedom (14) where it stands now; None for the identity."""
    found = document.numbers(record, 16, "9d", (0.0,) * 9, name)
    points = np.array(found).reshape(3, 3)
    for row, stand_in in zip(points, ((0.0,) * 3, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), strict=True):
        if (row == _NO_POINT).all():
            row[:] = stand_in
    # Ranges of z, y, x, pitch, roll, yaw and the scales of z, y, x; each least, most, now, step.
    ranges = document.numbers(record, 88, "36d", (0.0,) * 36, name)
    z, y, x, pitch, roll, yaw, *scale = ranges[2::4]
    current = np.diag([*(s if s != 0.0 else 1.0 for s in reversed(scale)), 1.0])
    for axis, degrees in (((0, 0, 1), yaw), ((0, 1, 0), roll), ((1, 0, 0), pitch)):
        current = current @ turned(np.array(axis, np.float64), degrees)
    current = current @ moved(np.array([x, y, z]))
    if any(low != high for low, high in zip(ranges[0::4], ranges[1::4], strict=True)):
        text = "moves within limits; kept at its current position"
        document.add(Kind.DROPPED, "flt-degrees-of-freedom", record, name, text)
    own = frame(points)
    with np.errstate(all="ignore"):
        matrix = np.linalg.inv(own) @ current @ own
    matrix[:, 3] = (0.0, 0.0, 0.0, 1.0)
    if (np.abs(matrix - np.eye(4)) < 1e-12 * max(1.0, np.abs(points).max())).all():
        return None  # at rest: only roundings
    return checked(document, record, name, matrix)
