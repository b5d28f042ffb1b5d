"""Tone curves from the histogram of brightness: steep where much is to be seen.

G. Ward Larson, H. Rushmeier, C. Piatko, "A Visibility Matching Tone Reproduction Operator for
High Dynamic Range Scenes", IEEE TVCG 3(4), 1997: ln display luminance follows the cumulated
histogram of ln scene luminance, but nowhere rises faster than a ceiling, so that no contrast
appears on the display that the observer would not see in the scene. ``trimmed`` is the paper's
loop as Radiance's pcond runs it, which gives up where everything fits. ``fill`` finds the
curve that is at all ceilings it reaches, directly, for any observer, and always; it is what
operators use:

    h = histogram(foveal)
    curve = fill(h, low, high, scene_threshold, anchor)      # tonemap/curve.py

with ``scene_threshold`` (n,) in cd/m2 at the bins' centres ``exp(h.centres)``: tvi_ward there
for an adapted eye (Ward 1997), any other, infinity included, for one that is not (P. Irawan,
J. Ferwerda, S. Marschner, EGSR 2005). All in float64; brightness is ln of cd/m2.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from hdrusd.eye.foveal import VOID, Foveal
from hdrusd.eye.threshold import tvi_ward
from hdrusd.tonemap.curve import Curve

Array = npt.NDArray[Any]
Threshold = Callable[[Array], Array]

#: cd/m2 that the histogram spans at most: an eye sees nothing below, and no more above.
DARKEST_SEEN, BRIGHTEST_SEEN = 1e-7, 1e7

#: Bins, as pcond has.
BINS = 100

#: Share of the counts that a trimming pass of ``trimmed`` may still remove (Ward 1997).
TOLERANCE = 0.025

#: Passes of ``fill`` at most, those in large steps, and change in ln units at which it ends.
_PASSES, _QUICK, _CONVERGED = 40, 20, 1e-7

#: Width of the step from no expansion to free expansion of contrast, in display ranges.
_NARROW = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class Histogram:
    """Weights (n,) of equal bins of brightness between ``bmin`` and ``bmax``, ln cd/m2.

    ``mean``: the weighted mean of the samples' brightness.
    """

    counts: Array
    bmin: float
    bmax: float
    mean: float

    @property
    def width(self) -> float:
        """Of a bin, ln units."""
        return (self.bmax - self.bmin) / self.counts.size

    @property
    def edges(self) -> Array:
        """Brightness (n + 1,) at the bins' edges."""
        return np.linspace(self.bmin, self.bmax, self.counts.size + 1)

    @property
    def centres(self) -> Array:
        """Brightness (n,) at the bins' centres."""
        return self.bmin + self.width * (np.arange(self.counts.size) + 0.5)


def histogram(
    foveal: Foveal, weights: npt.ArrayLike | None = None, *, bins: int = BINS, pcond: bool = False
) -> Histogram:
    """Histogram of brightness of foveal samples and single pixels, half the weight each.

    ``weights`` (fh, fw) of the samples; the pixels share their sum. With ``pcond`` the lowest
    bin is split in two as there, so that its curve begins below it. What is darker than
    eye.foveal.VOID counts only where nothing else is there.
    """
    samples = foveal.luminance.ravel()
    points = np.asarray(foveal.points, np.float64)
    w = np.ones(samples.size) if weights is None else np.asarray(weights, np.float64).ravel()
    w = np.concatenate([w, np.full(points.size, w.sum() / max(points.size, 1))])
    y = np.concatenate([samples, points])
    counted = (y > VOID) & (w > 0.0)
    if counted.any() and not counted.all():
        y, w = y[counted], w[counted]
    darkest = min(max(float(y.min()), DARKEST_SEEN), BRIGHTEST_SEEN)
    bmin = math.log(darkest)
    # 1 % more, so that a frame of one luminance has a range too.
    bmax = math.log(max(min(float(y.max()), BRIGHTEST_SEEN), darkest)) + math.log(1.01)
    split = int(pcond and darkest > DARKEST_SEEN)
    bmin = bmax - (bmax - bmin) * bins / (bins - split)
    b = np.log(y.clip(DARKEST_SEEN, BRIGHTEST_SEEN))
    place = ((b - bmin) * (bins / (bmax - bmin))).clip(split, bins - 1.0).astype(np.intp)
    counts = np.bincount(place, weights=w, minlength=bins)
    if split:
        counts[1] *= 0.5
        counts[0] += counts[1]
    return Histogram(counts, bmin, bmax, float((b * w).sum()) / float(w.sum()))


class Anchor(NamedTuple):
    """A scene luminance, and the display luminance wanted for it, cd/m2 both.

    It decides where on the display a curve lies that does not fill its range.
    """

    scene: float
    display: float


def proportionate(y: Array) -> Array:
    """The threshold behind the paper's linear ceiling: display contrast <= scene contrast."""
    return np.asarray(y, np.float64)


def adapted_anchor(h: Histogram, low: float, high: float, threshold: Threshold) -> Anchor:
    """The mean brightness as far above threshold on the display as in the scene.

    For an observer adapted to the scene's mean and a viewer adapted to the middle of the
    display's range ``low`` to ``high``, cd/m2 (G. Ward, "A Contrast-Based Scalefactor for
    Luminance Display", Graphics Gems IV, 1994; pcond's linear map).
    """
    mean = math.exp(h.mean)
    seen, shown = threshold(np.array([mean, math.sqrt(low * high)]))
    return Anchor(mean, mean * float(shown / seen))


def trimmed(
    h: Histogram,
    low: float,
    high: float,
    threshold: Threshold = tvi_ward,
    *,
    tolerance: float = TOLERANCE,
) -> Curve | None:
    """The curve of Ward 1997, section 4.4, in the form that pcond gives it.

    Counts above the ceiling are cut until a pass cuts no more than ``tolerance`` of what is
    left; None where nothing much is left, since then all contrast fits the display and the
    scene is to be shown in proportion. ``low`` and ``high``: the display's range, cd/m2.
    """
    left, scene = h.counts, np.exp(h.centres)
    bottom, span = math.log(low), math.log(high / low)
    seen = threshold(scene) / scene
    while True:
        total = float(left.sum())
        # "Not more", so that a tolerance of 0 ends as well.
        if total <= TOLERANCE * float(h.counts.sum()):
            return None
        cumulated = np.concatenate([[0.0], np.cumsum(left)]) / total
        shown = np.exp(bottom + span * 0.5 * (cumulated[:-1] + cumulated[1:]))
        ceiling = (total * h.width / span) * (threshold(shown) / shown) / seen
        cut = np.minimum(left, ceiling)
        if float((left - cut).sum()) <= tolerance * total:
            # The curve of the pass's start: what it cut is within the tolerance.
            return Curve(h.bmin, h.bmax, bottom + span * cumulated, low, high)
        left = cut


def fill(
    h: Histogram,
    low: float,
    high: float,
    scene_threshold: Array,
    anchor: Anchor,
    *,
    display_threshold: Threshold = tvi_ward,
    floor: float = 1e-3,
    highlights: float = 0.0,
    start: Curve | None = None,
) -> Curve:
    """The steepest curve below its ceilings, by water-filling, for any scene's observer.

    With a linear ceiling it is what ``trimmed`` converges to. With a human one mostly, too;
    but the loop cuts by ceilings of curves that are not the last one, and gives nothing back,
    so that smooth histograms may differ by up to 0.14 in ln units.

    Its slope (ln by ln) is min(lambda x count, ceiling) in each bin, lambda such that the display
    from ``low`` to ``high`` cd/m2 is filled. The ceiling is the contrast just seen on the
    display, display_threshold(L)/L where the curve is, over the one just seen in the scene,
    ``scene_threshold`` (n,) at exp(h.centres) over that. Infinite thresholds are allowed: what is
    not seen gets no contrast. Where all ceilings together do not fill the display, slopes are
    the ceilings, and ``anchor`` says where the curve lies. A scene narrower than the display
    is not stretched.

    ``highlights``: contrast, as a share of the scene's, that what is brighter than the anchor
    keeps at least, as long as the display above such a curve has room: an eye that cannot tell
    lamps apart sees them bright all the same.

    ``floor``: share of the mean count that every bin gets in addition, so that empty ones keep
    some slope. ``start``: a curve to begin with, say the one before (the result is the same
    within the iteration's tolerance of 1e-7 in ln units).
    """
    n = h.counts.size
    bottom, span = math.log(low), math.log(high / low)
    counts = h.counts + floor * h.counts.mean()
    edges, width, scene = h.edges, h.width, np.exp(h.centres)
    seen = scene / scene_threshold
    # Contrast may grow without bound only in scenes of 1.25 display ranges and more.
    narrow = min(max(((h.bmax - h.bmin) / span - 1.0) / _NARROW, 0.0), 1.0)
    most = math.inf if narrow == 1.0 else 1.0 / (1.0 - narrow)
    wanted = math.log(anchor.display) - bottom
    goal = math.log(anchor.scene)
    bright = np.where(h.centres > goal, highlights, 0.0)
    if start is None:
        log_display = bottom + span * (np.arange(n) + 0.5) / n
    else:
        log_display = np.log(start.display(scene))
    u = np.zeros(n + 1)
    before = change = np.zeros(n)
    for number in range(_PASSES):
        shown = np.exp(log_display)
        ceiling = np.minimum(display_threshold(shown) / shown * seen, most)
        slope = level(counts, ceiling, span / width)
        np.cumsum(slope * width, out=u[1:])
        offset = min(max(wanted - float(np.interp(goal, edges, u)), 0.0), max(span - u[-1], 0.0))
        spare = span - offset - u[-1]
        if highlights > 0.0 and spare > 0.0:
            u[1:] += np.minimum(np.cumsum(np.maximum(bright - slope, 0.0) * width), spare)
        last, change = change, bottom + offset + 0.5 * (u[:-1] + u[1:]) - log_display
        if float(np.abs(change).max()) < _CONVERGED:
            break
        # D. Anderson, J. ACM 12, 1965, with one curve remembered: 6 passes, where half a step
        # each time takes 27. The published thresholds have steps of up to 2.8 %: where a bin
        # ends on one there is no solution, and half steps stay near.
        turn = change - last
        back = float(turn @ change) / max(float(turn @ turn), 1e-300) if number > 0 else 0.0
        after = log_display + change - back * (log_display - before + turn)
        if number >= _QUICK:
            after = log_display + 0.5 * change
        before, log_display = log_display, after.clip(bottom, bottom + span)
    return Curve(h.bmin, h.bmax, bottom + offset + u, low, high)


def level(counts: Array, ceiling: Array, total: float) -> Array:
    """min(lambda counts, ceiling) with lambda such that they add up to ``total``, exactly.

    The ceiling itself where all of it is not more than that. Sorting by the lambda at which
    a bin reaches its ceiling leaves one linear equation.
    """
    if float(ceiling.sum()) <= total:
        return ceiling
    # Bins of next to nothing would get full at a lambda past all numbers: they are empty.
    counts = np.where(counts > 1e-30 * counts.max(), counts, 0.0)
    # 1e300: empty bins come last, and their 0 counts times it are 0.
    full_at = np.divide(ceiling, counts, out=np.full(counts.size, 1e300), where=counts > 0.0)
    order = np.argsort(full_at)
    filled = np.concatenate([[0.0], np.cumsum(ceiling[order])])
    rising = np.cumsum(counts[order][::-1])[::-1]
    # Sum at the lambda where the k-th bin gets full, for all k.
    reached = filled[:-1] + full_at[order] * rising
    k = int(np.searchsorted(reached, total))
    if k == counts.size or rising[k] <= 0.0:  # empty bins alone have ceiling left
        return np.where(counts > 0.0, ceiling, 0.0)
    slopes: Array = np.minimum((total - filled[k]) / rising[k] * counts, ceiling)
    return slopes
