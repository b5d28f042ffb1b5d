"""The candela of a luminaire as a picture: a polar diagram and a Cartesian plot, one PNG.

In candela, or in cd/klm where the lumens of the lamps are stated, as data sheets have it.
Made by matplotlib, which only those need who want it (extra "plot").
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdrusd.photometry.distribution import Section, fan, peak, sections
from hdrusd.photometry.luminaire import Luminaire
from hdrusd.plots import COLOURS, write_plot

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import PolarAxes

_DASHES = ("-", (0, (5, 2)))

#: Degrees between two points of a drawn curve: lines of a polar diagram are curved.
_STEP = 0.5


def write_candela_plot(luminaire: Luminaire, path: Path) -> None:
    """Draw the two ``sections`` of a luminaire. Raises HdrusdError, OSError."""
    write_plot(path, lambda: _figure(luminaire))


def _figure(luminaire: Luminaire) -> Figure:
    from matplotlib.figure import Figure

    scale, unit = 1.0, "cd"
    if luminaire.lumens:
        scale, unit = 1000.0 / luminaire.lumens, "cd/klm"
    drawn = [Section(s.name, *_dense(s.angles, s.candela * scale)) for s in sections(luminaire)]
    figure = Figure(figsize=(10.0, 4.9), layout="constrained")
    grid = figure.add_gridspec(1, 2, width_ratios=[1.0, 1.15])
    polar: Any = figure.add_subplot(grid[0], projection="polar")
    plain = figure.add_subplot(grid[1])
    _draw_polar(polar, drawn, luminaire.type == "C", unit)
    _draw_plain(plain, drawn, luminaire.type == "C", unit)
    figure.suptitle(_title(luminaire), x=0.01, ha="left", fontweight="bold", parse_math=False)
    return figure


def _dense(angles: np.ndarray, candela: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A curve with points enough to be drawn in polar axes; its jumps stay jumps."""
    parts = [
        np.linspace(low, high, max(int((high - low) / _STEP), 1), endpoint=False)
        for low, high in pairwise(angles.tolist())
    ]
    shares = [np.arange(len(part)) / len(part) for part in parts]
    values = [
        first + (last - first) * share
        for (first, last), share in zip(pairwise(candela.tolist()), shares, strict=True)
    ]
    return (
        np.concatenate([*parts, angles[-1:]]),
        np.concatenate([*values, candela[-1:]]),
    )


def _draw_polar(panel: PolarAxes, drawn: Sequence[Section], nadir: bool, unit: str) -> None:
    """Nadir at the bottom, C 0 and C 90 to the right; the aim of types A and B at the top."""
    from matplotlib.ticker import MaxNLocator

    panel.set_theta_zero_location("S" if nadir else "N")
    panel.set_theta_direction(1 if nadir else -1)
    for section, colour, dashes in zip(drawn, COLOURS[:2], _DASHES, strict=True):
        panel.plot(
            np.radians(section.angles),
            section.candela,
            color=colour,
            linestyle=dashes,
            linewidth=1.6,
            label=section.name,
        )
    marks = np.arange(0.0, 360.0, 30.0)
    names = [f"{mark if mark <= 180.0 else 360.0 - mark:.0f}°" for mark in marks]
    panel.set_thetagrids(marks, names)
    top = max(float(section.candela.max()) for section in drawn) or 1.0
    panel.set_rticks([r for r in MaxNLocator(5).tick_values(0.0, top) if 0.0 < r <= 1.1 * top])
    panel.set_rlim(0.0, 1.1 * top)
    panel.set_rlabel_position(_darkest(drawn))
    panel.tick_params(axis="y", labelsize=7.5)
    sides = "C 0 and C 90 to the right" if nadir else "H right and V up to the right"
    panel.set_title(f"Luminous intensity ({unit}), {sides}", fontsize=9.0, pad=12.0)


def _darkest(drawn: Sequence[Section]) -> float:
    """Between which rays the radii are written: where no curve runs through them."""
    places = np.arange(-165.0, 180.0, 30.0)[::-1]
    candela = [
        np.interp(places, section.angles, section.candela, left=0.0, right=0.0) for section in drawn
    ]
    return float(places[np.max(candela, axis=0).argmin()]) % 360.0


def _draw_plain(panel: Axes, drawn: Sequence[Section], nadir: bool, unit: str) -> None:
    for section, colour, dashes in zip(drawn, COLOURS[:2], _DASHES, strict=True):
        beam = fan(section, 0.5)
        note = "dark" if beam is None else f"beam angle {beam:.4g}°"
        panel.plot(
            section.angles,
            section.candela,
            color=colour,
            linestyle=dashes,
            linewidth=1.6,
            label=f"{section.name}, {note}",
        )
    ends = [abs(float(section.angles[i])) for section in drawn for i in (0, -1)]
    limit = min(180.0, max(30.0 * np.ceil(max(ends) / 30.0), 30.0))
    panel.set_xlim(-limit, limit)
    panel.set_xticks(np.linspace(-limit, limit, 13 if limit % 90.0 == 0.0 else 9))
    if not any(section.candela.any() for section in drawn):
        panel.set_ylim(0.0, 1.0)
    panel.set_ylim(0.0)
    panel.spines[["top", "right"]].set_visible(False)
    panel.set_xlabel("Angle γ from the nadir (°)" if nadir else "Angle from the aim (°)")
    panel.set_ylabel(f"Luminous intensity ({unit})")
    panel.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def _title(luminaire: Luminaire) -> str:
    name = " ".join(luminaire.name.split())
    name = name if len(name) <= 60 else f"{name[:59]}…"
    largest = peak(luminaire)
    plane, angle = ("C", "γ") if luminaire.type == "C" else ("H", "V")
    where = f"{plane} {largest.plane:g}°, {angle} {largest.angle:g}°"
    return f"{name}: {luminaire.flux():.5g} lm, peak {largest.candela:.5g} cd at {where}"
