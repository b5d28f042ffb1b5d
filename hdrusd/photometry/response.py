"""How a camera turns exposure into code values, recovered from exposures of one scene.

A pixel's code Z is f(E h): f rises, E is the light that the pixel gets and h the exposure. What
is recovered is the inverse g, from code to relative exposure, a curve for each channel, by

- P. E. Debevec and J. Malik, "Recovering High Dynamic Range Radiance Maps from Photographs",
  SIGGRAPH 1997, equation 3: least squares in the logarithm, smooth by a weight lambda;
- M. A. Robertson, S. Borman and R. L. Stevenson, "Estimation-theoretic approach to dynamic range
  enhancement using multiple exposures", Journal of Electronic Imaging 12(2), 2003: light and
  response are estimated in turn, each the likeliest given the other (their section 4).

A curve is known up to a factor. It is set to 1 at the middle code in all channels, so equal
middle codes are taken for grey (Debevec and Malik, section 2.6).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hdrusd.colour import srgb_decode
from hdrusd.errors import HdrusdError

Floats = npt.NDArray[np.float64]

#: Codes at which a curve is recovered; those of 16-bit pictures lie between them.
KNOTS = 256

#: The knot at which a curve is 1.
MIDDLE = 128

#: Shares of the code range: at or below the first a code is noise, at or above the second it
#: is saturated. A JPEG rings by some codes beside what is clipped.
DARK = {255: 4.0 / 255.0, 65535: 1.0 / 256.0}
SATURATED = 250.0 / 255.0

#: Debevec and Malik's lambda where nothing else is said, for one observation a code on average.
SMOOTHNESS = 16.0

#: Robertson's turns at most, the relative change of the curve at which they end, and the lambda
#: by which each turn is smoothed.
_TURNS, _SETTLED, _SMOOTHED = 5000, 1e-7, 32.0

#: A curve is no curve beyond this many values.
MOST_VALUES = 65536


@dataclass(frozen=True, slots=True)
class Response:
    """Relative exposure by code.

    ``curves``: (1 or 3, n) float64, value k at the share k / (n - 1) of the code range; rising,
    1 at the middle. ``spread``: the scatter of ln exposure between pictures that the fit leaves,
    rms; None where nothing was fitted.
    """

    method: str
    curves: Floats
    spread: float | None = None

    def table(self, top: int) -> Floats:
        """Relative exposure of every code 0 ... ``top``, (1 or 3, top + 1).

        Powers between the values, which straight lines and pure gammas pass exactly; the code 0
        has no exposure.
        """
        count = self.curves.shape[1]
        codes = np.log(np.arange(1, top + 1) / top)
        knots = np.log(np.arange(1, count) / (count - 1))
        out = np.zeros((len(self.curves), top + 1))
        for row, curve in zip(out, np.log(np.maximum(self.curves[:, 1:], 1e-30)), strict=True):
            row[1:] = np.interp(codes, knots, curve)
            below = codes < knots[0]
            if below.any() and count > 2:
                slope = (curve[1] - curve[0]) / (knots[1] - knots[0])
                row[1:][below] = curve[0] + max(slope, 0.0) * (codes[below] - knots[0])
            elif below.any():
                row[1:][below] = curve[0] + (codes[below] - knots[0])
        out[:, 1:] = np.exp(out[:, 1:])
        return out

    def at(self, share: float) -> Floats:
        """Relative exposure, (1 or 3), at a share of the code range."""
        return self.table(65535)[:, round(share * 65535)]

    def as_dict(self) -> dict[str, Any]:
        """What its JSON file holds."""
        return {
            "format": "hdrusd-response/1",
            "method": self.method,
            "spread": self.spread,
            "curves": [[float(f"{value:.9g}") for value in curve] for curve in self.curves],
        }


def parse_response(document: object) -> Response:
    """Undo ``Response.as_dict``. Raises HdrusdError, which says what is wrong."""
    if not isinstance(document, dict) or document.get("format") != "hdrusd-response/1":
        raise HdrusdError("no response; want format hdrusd-response/1")
    curves = document.get("curves")
    if not isinstance(curves, list) or len(curves) not in (1, 3):
        raise HdrusdError("curves: want 1 or 3 lists of numbers")
    sizes = {len(curve) if isinstance(curve, list) else 0 for curve in curves}
    if len(sizes) != 1 or not 3 <= min(sizes) <= MOST_VALUES:
        raise HdrusdError(f"curves: want lists of one length, 3 to {MOST_VALUES}")
    try:
        values = np.array(curves, np.float64)
    except (ValueError, TypeError, OverflowError):
        raise HdrusdError("curves: want numbers") from None
    if not np.isfinite(values).all() or (values < 0.0).any() or (values > 1e12).any():
        raise HdrusdError("curves: want numbers of 0 to 1e12")
    if (np.diff(values, axis=1) < 0.0).any() or (values[:, values.shape[1] // 2] <= 0.0).any():
        raise HdrusdError("curves: want values that rise, above 0 from the middle on")
    method = document.get("method")
    spread = document.get("spread")
    kept = float(spread) if isinstance(spread, (int, float)) and np.isfinite(spread) else None
    return Response(method[:80] if isinstance(method, str) else "file", values, kept)


def srgb_response() -> Response:
    """The inverse of IEC 61966-2-1, for pictures that follow it."""
    curve = srgb_decode(np.arange(MOST_VALUES) / (MOST_VALUES - 1.0))
    return Response("srgb", (curve / curve[round(MIDDLE / 255.0 * 65535)])[None])


def linear_response() -> Response:
    """Codes in proportion to exposure, as raw developers write them on request."""
    return Response("linear", np.linspace(0.0, 255.0 / MIDDLE, KNOTS)[None])


def hat(share: npt.ArrayLike) -> Floats:
    """Debevec and Malik's equation 4 over the codes that are neither noise nor saturated."""
    z = np.asarray(share, np.float64)
    low = DARK[255]
    return np.asarray(np.maximum(np.minimum(z - low, SATURATED - z), 0.0) * 2.0)


def bell(share: npt.ArrayLike) -> Floats:
    """Robertson's weight exp(-4 (2z - 1)^2), lowered to 0 at both ends, 1 in the middle."""
    z = np.asarray(share, np.float64)
    low = np.exp(-4.0)
    return np.asarray((np.exp(-4.0 * (2.0 * z - 1.0) ** 2) - low) / (1.0 - low))


def debevec97(
    shares: npt.ArrayLike, exposures: npt.ArrayLike, smoothness: float = SMOOTHNESS
) -> tuple[Floats, float]:
    """The curve (KNOTS) of one channel and the rms scatter of ln exposure that it leaves.

    ``shares`` (n, p): codes of n pixels in p pictures as shares of the range; ``exposures`` (p).
    Equation 3 is linear in ln g and ln E. Each pixel's ln E is the weighted mean of its row and
    taken out beforehand, so that KNOTS unknowns are left, and ln g of the middle is held at 0;
    solved by the normal equations. A code between knots counts for both. Raises HdrusdError
    where too few codes are seen.
    """
    z = np.asarray(shares, np.float64)
    weight = hat(z)
    used = np.count_nonzero(weight, axis=1) >= 2
    z, weight = z[used], weight[used]
    if len(z) < 16:
        raise HdrusdError(_TOO_FEW)
    times = np.broadcast_to(np.log(np.asarray(exposures, np.float64)), z.shape)
    square = weight * weight
    share = square / square.sum(axis=1, keepdims=True)
    n, p = z.shape
    place = np.clip(z * (KNOTS - 1), 0.0, KNOTS - 1.000001)
    low = place.astype(np.int64)
    part = place - low
    row = np.arange(n)[:, None]
    mean = np.zeros((n, KNOTS))
    np.add.at(mean, (row, low), share * (1.0 - part))
    np.add.at(mean, (row, low + 1), share * part)
    matrix = np.repeat(-mean, p, axis=0)
    each = np.arange(n * p)
    matrix[each, low.ravel()] += 1.0 - part.ravel()
    matrix[each, low.ravel() + 1] += part.ravel()
    matrix *= weight.reshape(-1, 1)
    wanted = (weight * (times - (share * times).sum(axis=1, keepdims=True))).ravel()
    seen = max(np.count_nonzero(weight) / KNOTS, 1.0)
    bend = smoothness * _bend(np.arange(KNOTS))
    normal = matrix.T @ matrix / seen + bend.T @ bend
    normal[MIDDLE, MIDDLE] += 1.0
    curve = np.linalg.solve(normal, matrix.T @ wanted / seen)
    left = matrix @ curve - wanted
    spread = float(np.sqrt((left * left).sum() / square.sum()))
    return _settle(np.exp(curve - curve[MIDDLE])), spread


def robertson03(shares: npt.ArrayLike, exposures: npt.ArrayLike) -> tuple[Floats, float]:
    """As ``debevec97``, by Robertson, Borman and Stevenson; better with many pixels.

    In turn: E = sum(w h g) / sum(w h^2) of each pixel over its pictures (their equation 8 with
    weights), and g of a code the mean of h E over all places where it is seen; g is scaled to 1
    at the middle. Begins with a straight line. A turn is linear in g: its matrix, codes by
    codes, is made once, and thousands of turns cost little.

    Not in the paper: each turn is smoothed as in equation 3 of Debevec and Malik, weighted by how
    often codes are seen. Without, exposures in equal steps leave ripples of that period open
    (Grossberg and Nayar 2002), which h^2 as a weight hardly dampens: 10 % and more at 2 stops.
    """
    z = np.asarray(shares, np.float64)
    codes = np.rint(z * (KNOTS - 1)).astype(np.int64)
    weight = np.where((z > DARK[255]) & (z < SATURATED), bell(z), 0.0)
    used = np.count_nonzero(weight, axis=1) >= 2
    codes, weight = codes[used], weight[used]
    if len(codes) < 16:
        raise HdrusdError(_TOO_FEW)
    h = np.broadcast_to(np.asarray(exposures, np.float64), codes.shape)
    held = weight > 0.0
    count = np.bincount(codes[held], minlength=KNOTS)
    pull = weight * h / (weight * h * h).sum(axis=1, keepdims=True)
    turn = np.zeros(KNOTS * KNOTS)
    for k in range(codes.shape[1]):  # what picture k's codes add to the E of all others
        cell = codes * KNOTS + codes[:, k : k + 1]
        turn += np.bincount(cell[held], (h * pull[:, k : k + 1])[held], minlength=turn.size)
    known = np.flatnonzero(count)
    matrix = turn.reshape(KNOTS, KNOTS)[np.ix_(known, known)] / count[known, None]
    if len(known) < 16:
        raise HdrusdError(_TOO_FEW)
    sure = np.diag(count[known] / count[known].mean())
    bend = _SMOOTHED * _bend(known)
    smooth = np.linalg.solve(sure + bend.T @ bend, sure)
    curve = known / MIDDLE
    for _ in range(_TURNS):
        new = np.exp(smooth @ np.log(matrix @ curve))
        new /= np.interp(MIDDLE, known, new)
        change = np.abs(new / curve - 1.0).max()
        curve = new
        if change < _SETTLED:
            break
    curve = _filled(known, curve)
    light = (pull * curve[codes]).sum(axis=1, keepdims=True)
    left = np.log(np.maximum(curve[codes], 1e-12) / np.maximum(h * light, 1e-12))
    spread = float(np.sqrt((weight * left * left).sum() / weight.sum()))
    return _settle(curve), spread


_TOO_FEW = "too few pixels are well exposed in two pictures; want exposures that overlap"


def _bend(codes: npt.NDArray[np.int64]) -> Floats:
    """Second differences of ln g at ``codes`` (n) as rows (n - 2, n), weighted by the hat."""
    stiff = np.maximum(hat(codes[1:-1] / (KNOTS - 1)), 1e-3)
    return np.asarray(np.diff(np.eye(len(codes)), 2, axis=0) * stiff[:, None])


def _filled(known: npt.NDArray[np.int64], values: Floats) -> Floats:
    """A curve from the codes that were seen: powers between them and past both ends."""
    ends = np.maximum(np.array([known[0], known[-1]], np.float64), 0.5)
    logs = np.log(np.maximum(values, 1e-12))
    places = np.log(np.maximum(np.arange(KNOTS), 0.5))
    curve = np.interp(places, np.log(np.maximum(known, 0.5)), logs)
    reach = min(8, len(known) - 1)
    if reach:
        for end, near, sign in ((0, reach, -1), (-1, -1 - reach, 1)):
            run = np.log(np.maximum(known[[near, end]], 0.5))
            slope = max((logs[end] - logs[near]) / (run[1] - run[0]), 0.0)
            past = sign * (places - np.log(ends[end])) > 0.0
            curve[past] = logs[end] + slope * (places[past] - np.log(ends[end]))
    return np.asarray(np.exp(curve))


def _settle(curve: Floats) -> Floats:
    """Rising, with no exposure at code 0, 1 at the middle."""
    rising = np.maximum.accumulate(curve)
    rising[0] = 0.0
    return np.asarray(rising / rising[MIDDLE])


def recover(
    codes: npt.ArrayLike, exposures: npt.ArrayLike, method: str, smoothness: float = SMOOTHNESS
) -> Response:
    """The response of all channels from ``codes`` (n, p, 1 or 3), as shares of the range.

    ``method``: "debevec" or "robertson". Raises HdrusdError.
    """
    shares = np.asarray(codes, np.float64)
    values = np.asarray(exposures, np.float64)
    curves, spreads = [], []
    for channel in range(shares.shape[2]):
        one = shares[..., channel]
        curve, spread = (
            robertson03(one, values)
            if method == "robertson"
            else debevec97(one, values, smoothness)
        )
        curves.append(curve)
        spreads.append(spread)
    return Response(method, np.array(curves), float(np.sqrt(np.mean(np.square(spreads)))))
