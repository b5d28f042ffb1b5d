"""The point spread of the eye after Spencer et al., by what the eye is adapted to.

G. Spencer, P. Shirley, K. Zimmerman, D. P. Greenberg, "Physically-based glare effects for
digital images", SIGGRAPH 1995. Sums of four parts, each of which comes to 1 over the
hemisphere: the core, two of lens and cornea, and the lenticular halo, a ring 3 degrees
wide at 568 nm. The printed halo lacks a factor 19.75 in its exponent (Durand and Dorsey 2000
point it out), without which it comes to 4.44.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from hdrusd.eye.observer import Observer
from hdrusd.glare.model import Array, GlareModel

Adaptation = Literal["photopic", "mesopic", "scotopic"]

#: Weights of the four parts.
WEIGHTS: dict[Adaptation, tuple[float, float, float, float]] = {
    "photopic": (0.384, 0.478, 0.138, 0.0),
    "mesopic": (0.368, 0.478, 0.138, 0.016),
    "scotopic": (0.282, 0.478, 0.207, 0.033),
}

#: nm that stand for red, green and blue of Rec. 709 in the halo: dominant wavelengths of its
#: primaries.
WAVELENGTHS = (611.0, 549.0, 464.0)


def parts(theta: npt.ArrayLike, wavelength: float = 568.0) -> Array:
    """(..., 4): core, 1/theta^3, 1/theta^2 and halo at ``theta`` degrees (...), sr^-1."""
    t = np.asarray(theta, np.float64)
    colour = 568.0 / wavelength
    return np.stack(
        [
            2.61e6 * np.exp(-((t / 0.02) ** 2)),
            20.91 / (t + 0.02) ** 3,
            72.37 / (t + 0.02) ** 2,
            436.9 * colour * np.exp(-19.75 * (t - 3.0 / colour) ** 2),
        ],
        axis=-1,
    )


def spread(
    theta: npt.ArrayLike, adaptation: Adaptation = "photopic", wavelength: float = 568.0
) -> Array:
    """The point spread at ``theta`` degrees (...), sr^-1; ``wavelength`` in nm moves the halo."""
    return np.asarray(parts(theta, wavelength) @ np.array(WEIGHTS[adaptation]))


def _psf(theta: npt.ArrayLike, _: Observer) -> Array:
    return spread(theta)


MODEL = GlareModel(
    name="spencer95",
    title="Point spread of the eye by day, any age",
    cite="Spencer, Shirley, Zimmerman, Greenberg, SIGGRAPH 1995",
    psf=_psf,
)
