"""What the eye went through in a sequence: a table (CSV) and a plot (PNG) over time.

A column is named with its unit, "goal luminance [cd/m2]"; one without brackets is a plain
number. The plot has a panel for each unit, logarithmic for luminances and trolands, and is
made by matplotlib, which only those need who want it (extra "plot").
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.images import write_atomically
from hdrusd.plots import COLOURS, write_plot

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FRAME, TIME = "frame", "time [s]"

_NAME = re.compile(r"(?P<name>[^\[\]]+?)(?: \[(?P<unit>[^\[\]]+)\])?")

#: Quantity of a unit, and whether it spans decades.
_QUANTITIES = {
    "cd/m2": ("Luminance (cd/m²)", True),
    "td": ("Retinal illuminance (td)", True),
    "lx": ("Illuminance (lx)", True),
    "mm": ("Diameter (mm)", False),
    "": ("Share", False),
}

#: Thresholds are broken lines, so that they are not taken for what is seen.
_DASHES = ((0, (4, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2)))


@dataclass(slots=True)
class AdaptationLog:
    """Numbers by frame: ``rows[frame][column]``. The columns come in the order of their coming."""

    rows: dict[float, dict[str, float]] = field(default_factory=dict)

    def add(self, frame: float, time: float, values: Mapping[str, float]) -> None:
        """Note the numbers of the frame at ``time`` s; a frame noted again is replaced."""
        self.rows[frame] = {TIME: float(time), **{k: float(v) for k, v in values.items()}}

    def columns(self) -> list[str]:
        """Time and whatever any frame has."""
        return list(dict.fromkeys(name for row in self.rows.values() for name in row))

    def in_order(self) -> list[tuple[float, dict[str, float]]]:
        """Frames and their rows by time, as the eye went through them."""
        return sorted(self.rows.items(), key=lambda item: item[1].get(TIME, math.inf))

    def write_csv(self, path: Path) -> None:
        """A line for each frame, by time; every digit (repr), and empty where a frame has none.

        RFC 4180 with plain line feeds. Raises OSError.
        """
        columns = self.columns()

        def write(temporary: Path) -> None:
            with temporary.open("w", encoding="utf-8", newline="") as file:
                table = csv.writer(file, lineterminator="\n")
                table.writerow([FRAME, *columns])
                for frame, row in self.in_order():
                    cells = (repr(row[name]) if name in row else "" for name in columns)
                    table.writerow([f"{frame:.15g}", *cells])

        write_atomically(path, write)

    @classmethod
    def read_csv(cls, path: Path) -> AdaptationLog:
        """What ``write_csv`` wrote, so that an interrupted sequence goes on. Raises InputError."""
        log = cls()
        try:
            with path.open(encoding="utf-8", newline="") as file:
                table = csv.reader(file)
                first, *columns = next(table, [""])
                if first != FRAME or TIME not in columns:
                    raise ValueError(f"want the columns {FRAME} and {TIME}")
                for frame, *cells in table:
                    pairs = zip(columns, cells, strict=True)
                    log.rows[float(frame)] = {name: float(cell) for name, cell in pairs if cell}
        except (OSError, ValueError, csv.Error) as problem:
            raise InputError(
                SourceRef(path, len(log.rows) + 1), f"not a log of the eye ({problem})"
            ) from None
        return log

    def write_plot(self, path: Path, title: str = "") -> None:
        """The numbers over time as a PNG, a panel for each unit. Raises HdrusdError, OSError."""
        panels = self._panels()
        style = {"axes.spines.top": False, "axes.spines.right": False}
        write_plot(path, lambda: self._figure(panels, title), style)

    def _panels(self) -> dict[str, list[str]]:
        """Columns by unit; those without a number that can be drawn are left out."""
        panels: dict[str, list[str]] = {}
        for column in self.columns():
            if column != TIME and np.isfinite(self._series(column)).any():
                panels.setdefault(split(column)[1], []).append(column)
        return panels

    def _series(self, column: str) -> Any:
        """(frames,) in the order of time; NaN where there is no number, or an infinite one."""
        values = np.array([row.get(column, math.nan) for _, row in self.in_order()], np.float64)
        return np.where(np.isfinite(values), values, np.nan)

    def _figure(self, panels: Mapping[str, Sequence[str]], title: str) -> Figure:
        from matplotlib.figure import Figure

        # Tall panels for what spans decades.
        heights = [2.0 if _QUANTITIES.get(unit, ("", False))[1] else 1.2 for unit in panels]
        size = (7.2, 0.9 + 1.25 * sum(heights or [1.0]))
        figure = Figure(figsize=size, layout="constrained")
        grid = {"height_ratios": heights} if heights else None
        found = figure.subplots(max(len(panels), 1), sharex=True, squeeze=False, gridspec_kw=grid)
        axes: list[Axes] = list(found[:, 0])
        for panel, (unit, columns) in zip(axes, panels.items(), strict=False):
            self._draw(panel, unit, columns)
        axes[-1].set_xlabel("Time (s)")
        figure.align_ylabels(axes)
        if title:
            axes[0].set_title(title, loc="left", fontweight="bold")
        return figure

    def _draw(self, panel: Axes, unit: str, columns: Sequence[str]) -> None:
        time = self._series(TIME)
        label, decades = _QUANTITIES.get(unit, (unit, False))
        series = [self._series(column) for column in columns]
        if decades:
            panel.set_yscale("log")
            series = [np.where(np.nan_to_num(y) > 0.0, y, np.nan) for y in series]
        marker = "o" if len(time) == 1 else ""
        widths = 1.9 - 0.1 * np.arange(len(columns))  # of lines that coincide the lower show
        drawn = {True: 0, False: 0}
        for column, y, width in zip(columns, series, widths, strict=True):
            name = split(column)[0]
            broken = "threshold" in name
            count = drawn[broken]
            drawn[broken] += 1
            colours = COLOURS[::-1] if broken else COLOURS
            line = _DASHES[count % len(_DASHES)] if broken else "-"
            panel.plot(
                time,
                y,
                label=name,
                color=colours[count % len(colours)],
                linestyle=line,
                linewidth=max(width, 1.1),
                marker=marker,
            )
        panel.set_ylabel(label)
        panel.margins(x=0.0 if len(time) > 1 else 0.05)
        panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0)


def split(column: str) -> tuple[str, str]:
    """Name and unit of a column, "" for a plain number."""
    match = _NAME.fullmatch(column)
    return (match["name"], match["unit"] or "") if match else (column, "")
