"""Plots as PNG files, in one style. Matplotlib makes them, which only those need who want plots
(extra "plot").
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hdrusd.errors import HdrusdError
from hdrusd.images import write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: M. Okabe, K. Ito, "Color Universal Design", 2008: told apart by colour-blind readers too.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")

_STYLE = {
    "font.family": "DejaVu Sans",  # comes with matplotlib
    "font.size": 9.0,
    "axes.linewidth": 0.8,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "#d8d8d8",
    "grid.linewidth": 0.5,
    "legend.frameon": False,
    "savefig.dpi": 150,
}


def check_plot() -> None:
    """Raise HdrusdError where matplotlib is missing, before an hour's work rather than after."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise HdrusdError(
            "plot: matplotlib is not installed; want pip install 'hdrusd[plot]'"
        ) from None


def write_plot(
    path: Path, figure: Callable[[], Figure], style: Mapping[str, Any] | None = None
) -> None:
    """Write what ``figure`` draws; ``style``: rcParams of its own. Raises HdrusdError, OSError."""
    check_plot()
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()  # not the user's own style
        matplotlib.rcParams.update(_STYLE | dict(style or {}))
        made = figure()
        write_atomically(path, lambda temporary: made.savefig(temporary, format="png"))
