"""What lighting engineers read off a candela distribution: zones, beams, codes, luminance.

All of them hold for candela that are linear between the file's angles, as ``Luminaire.value``
has them. Zones and fans of type C are about the nadir, those of A and B about the aim.
Sources: ANSI/IES LS-1 (beam and field angle), CIE 52-1982 (flux code).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.luminaire import Doubles, Luminaire
from hdrusd.photometry.profile import profile_angles

#: Degrees from nadir or aim between which flux is told.
ZONES = (0.0, 30.0, 60.0, 90.0, 180.0)

#: Steps of the sum over a sphere about the aim of types A and B, degrees.
_STEP = 0.5

#: Degrees; bounds nearer than this to an angle of the file are there.
_SAME = 1e-6

#: Degrees between which nothing ends: nadir and zenith, and once round the aim.
_FALL, _TURN = (0.0, 180.0), (-180.0, 180.0)

#: Share of the peak by which two sides of a symmetric luminaire may differ.
ALIKE = 1e-3


class Peak(NamedTuple):
    """The largest candela of a file and where it is: plane and angle, degrees."""

    candela: float
    plane: float
    angle: float


def peak(luminaire: Luminaire) -> Peak:
    """The first of the largest values."""
    row, column = divmod(int(luminaire.candela.argmax()), len(luminaire.angles))
    value = float(luminaire.candela[row, column])
    return Peak(value, float(luminaire.planes[row]), float(luminaire.angles[column]))


def cumulative_flux(luminaire: Luminaire, angles: npt.ArrayLike) -> Doubles:
    """Lumens within cones of half ``angles``, degrees (k,), about the nadir or the aim.

    Type C in closed form; types A and B summed over steps of half a degree and scaled to
    ``Luminaire.flux``.
    """
    bounds = np.asarray(angles, np.float64)
    if luminaire.type != "C":
        return _summed_flux(luminaire, bounds)
    planes, candela = luminaire.unfolded()
    round_axis = np.trapezoid(candela, np.radians(planes), axis=0)
    inner = bounds[(bounds > luminaire.angles[0]) & (bounds < luminaire.angles[-1])]
    inner = inner[np.abs(inner[:, None] - luminaire.angles).min(axis=1) > _SAME]
    nodes = np.union1d(luminaire.angles, inner)
    x, y = np.radians(nodes), np.interp(nodes, luminaire.angles, round_axis)
    # A line from y0 to y1 times sin x, by parts with the mean of cos x over the interval.
    mean = np.diff(np.sin(x)) / np.diff(x)
    cells = y[:-1] * (np.cos(x[:-1]) - mean) + y[1:] * (mean - np.cos(x[1:]))
    return np.asarray(np.interp(bounds, nodes, np.append(0.0, np.cumsum(cells))))


def _summed_flux(luminaire: Luminaire, bounds: Doubles) -> Doubles:
    edges = np.radians(np.arange(0.0, 180.0 + _STEP, _STEP))
    from_aim = (edges[:-1] + edges[1:])[:, None] / 2.0
    about = np.radians(np.arange(0.0, 360.0, _STEP) + _STEP / 2.0)
    right, up = np.sin(from_aim) * np.cos(about), np.sin(from_aim) * np.sin(about)
    ahead = np.broadcast_to(np.cos(from_aim), right.shape)
    kind = np.array("CAB".index(luminaire.type))
    grid = np.degrees(profile_angles(np.stack([right, up, ahead], axis=-1), kind))
    rings = luminaire.value(grid[..., 0], grid[..., 1]).mean(axis=1)
    solid = 2.0 * np.pi * (np.cos(edges[:-1]) - np.cos(edges[1:]))
    within = np.append(0.0, np.cumsum(rings * solid))
    scale = luminaire.flux() / within[-1] if within[-1] > 0.0 else 0.0
    return np.asarray(np.interp(np.radians(bounds), edges, within * scale))


def zonal_flux(luminaire: Luminaire) -> Doubles:
    """Lumens between ``ZONES``."""
    return np.diff(cumulative_flux(luminaire, ZONES))


def upward_share(luminaire: Luminaire) -> float | None:
    """ULR, the share of the flux above the horizontal; None without flux or a nadir (A, B)."""
    if luminaire.type != "C":
        return None
    down, total = cumulative_flux(luminaire, [90.0, 180.0]).tolist()
    return None if total <= 0.0 else max(1.0 - down / total, 0.0)


def flux_code(luminaire: Luminaire) -> tuple[float, ...] | None:
    """CIE flux code N1 to N5, percent; None without flux or a nadir (A, B).

    Flux in the solid angles pi/2, pi and 3 pi/2 about the nadir to that of the lower half,
    that to all, and all to the lamps' (100 where their lumens are not stated). CIE 52-1982.
    """
    if luminaire.type != "C":
        return None
    cones = np.degrees(np.arccos([0.75, 0.5, 0.25, 0.0, -1.0]))
    *inner, down, total = cumulative_flux(luminaire, cones).tolist()
    if down <= 0.0:
        return None
    efficiency = total / luminaire.lumens if luminaire.lumens else 1.0
    return *(100.0 * flux / down for flux in inner), 100.0 * down / total, 100.0 * efficiency


class Section(NamedTuple):
    """Candela over the signed angle from the nadir or the aim, through both sides of a plane.

    Where the file's angles end the last one stands twice, the second time dark.
    """

    name: str
    angles: Doubles  # (k,) degrees, ascending, -180 to 180
    candela: Doubles  # (k,)


def sections(luminaire: Luminaire) -> tuple[Section, Section]:
    """The two planes that a luminaire is drawn by.

    Type C: C 0 to 180 and C 90 to 270, the first side positive. Types A and B: H at V = 0,
    right positive, and V at H = 0, up positive.
    """
    angles = luminaire.angles
    if luminaire.type == "C":
        return _through_nadir(luminaire, 0.0), _through_nadir(luminaire, 90.0)
    planes = luminaire.unfolded()[0]
    across = _framed(planes, luminaire.value(planes, 0.0), _TURN)
    return (
        Section("H (V = 0)", *across),
        Section("V (H = 0)", *_framed(angles, luminaire.value(0.0, angles), _TURN)),
    )


def _through_nadir(luminaire: Luminaire, plane: float) -> Section:
    name = f"C {plane:g}-{plane + 180.0:g}"
    x, y = _framed(luminaire.angles, luminaire.value(plane, luminaire.angles), _FALL)
    _, far = _framed(luminaire.angles, luminaire.value(plane + 180.0, luminaire.angles), _FALL)
    return Section(name, np.concatenate([-x[::-1], x]), np.concatenate([far[::-1], y]))


def _framed(x: Doubles, y: Doubles, whole: tuple[float, float]) -> tuple[Doubles, Doubles]:
    """Nodes and values with the dark beyond their ends, but for where a turn is ``whole``."""
    ends = int(x[0] != whole[0]), int(x[-1] != whole[1])
    return np.pad(x, ends, mode="edge"), np.pad(y, ends)


def fan(section: Section, share: float) -> float | None:
    """Degrees of a plane within which candela reach ``share`` of the plane's largest.

    ANSI/IES LS-1: beam angle for 1/2, field angle for 1/10. From edge to edge, whatever is
    darker in between. The edges are the last within 90 degrees of the axis: the nadir or the
    aim, or the zenith where the largest value is above the horizontal. What is bright enough
    at 90 degrees goes on until it is not. None for a dark plane.
    """
    x, y = section.angles, section.candela
    level = share * float(y.max())
    if level <= 0.0:
        return None
    if y[np.abs(x) <= 90.0].max(initial=0.0) < y.max():
        right = x > 0.0
        x, y = np.append(x[right] - 180.0, x[~right] + 180.0), np.append(y[right], y[~right])
    return _edge(x, y, level) + _edge(-x[::-1], y[::-1], level)


def _edge(x: Doubles, y: Doubles, level: float) -> float:
    """Where a section falls below ``level`` for good, to the right; 180 if it never does."""
    (ends,) = np.nonzero((y[:-1] >= level) & (y[1:] < level))
    share = (y[ends] - level) / (y[ends] - y[ends + 1])
    falls = x[ends] + share * (x[ends + 1] - x[ends])
    after = int(np.searchsorted(x, 90.0))  # the first node there, before any darkness
    if after < len(x):
        width = x[after] - x[after - 1]
        part = (90.0 - x[after - 1]) / width if width > 0.0 else 1.0
        if y[after - 1] * (1.0 - part) + y[after] * part >= level:
            return float(falls[falls >= 90.0].min(initial=180.0))
    return float(falls[falls <= 90.0].max())


def nadir_luminance(luminaire: Luminaire) -> float | None:
    """cd/m2 of the luminous opening seen from straight below; None where it has no area.

    Candela at gamma 0 over the opening's area, as LM-63 and EULUMDAT state its sides; a
    mean, as which part of the opening shines is not in a file.
    """
    opening = luminaire.opening
    area = opening.x * opening.y * (np.pi / 4.0 if opening.round else 1.0)
    if luminaire.type != "C" or area <= 0.0:
        return None
    return float(luminaire.value(0.0, 0.0)) / area


def stated_symmetry(luminaire: Luminaire) -> str:
    """What the planes that a file has say of the others."""
    first, last = float(luminaire.planes[0]), float(luminaire.planes[-1])
    if luminaire.type != "C":
        return "mirrored in H" if first == 0.0 else "none"
    if len(luminaire.planes) == 1:
        return "rotational"
    sides = {(0.0, 90.0): "C 0-180 and C 90-270", (0.0, 180.0): "C 0-180"}
    sides |= {(90.0, 270.0): "C 90-270", (-90.0, 90.0): "C 90-270"}
    return sides.get((first, last), "none")


def found_symmetry(luminaire: Luminaire) -> str:
    """What symmetry the candela have, to ``ALIKE`` of the peak, whatever the file says."""
    planes, candela = luminaire.unfolded()
    room = ALIKE * float(candela.max())

    def alike(turned: Doubles) -> bool:
        return bool(
            np.abs(luminaire.value(turned[:, None], luminaire.angles) - candela).max() <= room
        )

    if luminaire.type != "C":
        return "mirrored in H" if -planes[0] == planes[-1] and alike(-planes) else "none"
    if np.ptp(candela, axis=0).max() <= room:
        return "rotational"
    about = [name for name, turned in _MIRRORS.items() if alike(turned - planes)]
    return " and ".join(about) or "none"


#: Planes of symmetry and the sum of the angles of two planes that mirror one another.
_MIRRORS = {"C 0-180": 360.0, "C 90-270": 540.0}
