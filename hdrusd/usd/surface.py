"""A gprim's surface, whatever schema it comes from: what ``geometry`` cuts pieces out of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hdrusd.report import Kind
from hdrusd.usd.triangles import Corners

Floats = npt.NDArray[np.float32]
Values = npt.NDArray[np.generic]

#: Says what is lost: kind, code, text.
Note = Callable[[Kind, str, str], None]


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Triangles over points, with the ways to its normals and primvars.

    ``triangles.face`` counts the faces as the prim has them, so that face sets find theirs.
    """

    points: Floats  # (n, 3)
    triangles: Corners
    normals: Callable[[Corners], Floats]  # (3 t, 3) of some of the triangles
    #: Values of a primvar (n, .) and their interpolation at the corners of some of the
    #: triangles, (3 t, .) float32; None where they do not fit.
    expand: Callable[[Values, str, Corners], Floats | None]
