"""Photometric files for the street, from formulas of our own: no lamp was measured.

    python samples/street/luminaires/make_luminaires.py [FOLDER]

| file | what |
| --- | --- |
| road_cutoff.ies | road luminaire, 10,000 lm: far along the road, most of it before the pole |
| road_lantern.ies | lantern over a narrow street, 4,000 lm: alike to both sides |
| shop_downlight.ldt | downlight of a shop front, 1,200 lm, a figure of rotation |

C = 0 is along the road, C = 90 from the pole to the road; a light's -Z looks down, its +X
along the road, its +Y to the road.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

GAMMA = np.arange(0.0, 90.1, 2.5)
SOURCE = "hdrusd sample street, a formula"


def smooth(x: Array, start: float, end: float) -> Array:
    """0 before ``start``, 1 behind ``end``, a cubic between them; either may be the larger."""
    t = np.clip((x - start) / (end - start), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def bell(x: Array, middle: Array | float, width: float) -> Array:
    """1 in the middle, 1/e a width away."""
    return np.asarray(np.exp(-(((x - middle) / width) ** 2)))


def road_cutoff(c: Array, gamma: Array) -> Array:
    """Two wings at 63 degrees, 14 degrees before the line of the poles, dark from 82 degrees."""
    # From the line of the poles towards the road, -90 to 90.
    ahead = np.degrees(np.arctan2(np.sin(np.radians(c)), np.abs(np.cos(np.radians(c)))))
    wings = bell(gamma, 63.0 - 0.25 * np.abs(ahead - 14.0), 12.0) * bell(ahead, 14.0, 30.0)
    across = np.sin(np.radians(c)) * np.sin(np.radians(gamma))
    below = np.cos(np.radians(gamma)) * (1.0 + 0.5 * across)
    behind = 1.0 - 0.7 * smooth(ahead, -5.0, -60.0) * smooth(gamma, 15.0, 45.0)
    return np.asarray((below + 1.6 * wings) * behind * smooth(gamma, 82.0, 68.0))


def road_lantern(c: Array, gamma: Array) -> Array:
    """Two weaker wings at 55 degrees, dark from 90."""
    along = np.cos(np.radians(c)) ** 2
    wings = bell(gamma, 55.0, 16.0) * along**2
    return np.asarray((np.cos(np.radians(gamma)) ** 0.8 + 0.9 * wings) * smooth(gamma, 90.0, 65.0))


def shop_downlight(c: Array, gamma: Array) -> Array:
    """A beam of 40 degrees to half its candela, and a little around it."""
    return np.asarray(bell(gamma, 0.0, 24.0) + 0.03 * smooth(gamma, 70.0, 30.0) + 0.0 * c)


def candela(of: Callable[[Array, Array], Array], planes: Array, lumens: float) -> Array:
    """Rows of planes at GAMMA, scaled to the flux that a sum over a quarter degree gives."""
    turn, fall = np.arange(0.125, 360.0, 0.25), np.arange(0.125, 90.0, 0.25)
    ring = np.sin(np.radians(fall)) * np.radians(0.25) ** 2
    flux = np.sum(of(turn[:, None], fall[None, :]) * ring)
    return np.asarray(of(planes[:, None], GAMMA[None, :]) * lumens / flux)


def wrapped(values: Iterable[float], digits: int) -> str:
    """Numbers, ten a line."""
    shown = [f"{value:.{digits}f}".rstrip("0").rstrip(".") for value in values]
    return "\n".join(" ".join(shown[i : i + 10]) for i in range(0, len(shown), 10))


def ies(name: str, of: Callable[[Array, Array], Array], planes: Array, lumens: float) -> str:
    """An LM-63 file of absolute candela, for a small opening."""
    rows = candela(of, planes, lumens)
    lines = [
        "IESNA:LM-63-2002",
        f"[TEST] {of.__name__}",
        f"[TESTLAB] {SOURCE}",
        "[ISSUEDATE] 2026-01-01",
        "[MANUFAC] none",
        f"[LUMINAIRE] {name}",
        "TILT=NONE",
        f"1 -1 1 {len(GAMMA)} {len(planes)} 1 2 0.3 0.4 0",
        "1 1 80",
        wrapped(GAMMA, 1),
        wrapped(planes, 1),
        *(wrapped(row, 1) for row in rows),
    ]
    return "\n".join(lines) + "\n"


def ldt(name: str, of: Callable[[Array, Array], Array], lumens: float) -> str:
    """An EULUMDAT file of a figure of rotation 10 cm across."""
    row = candela(of, np.zeros(1), lumens)[0] * 1000.0 / lumens
    head = [SOURCE, 1, 1, 1, 0, len(GAMMA), 2.5, "none", name, of.__name__, f"{of.__name__}.ldt"]
    size = ["2026-01-01", 100, 0, 120, 100, 0, 0, 0, 0, 0]
    lamp = [100, 100, 1, 0, 1, 1, "LED", lumens, 3000, 90, 12]
    lines = [*head, *size, *lamp, *[0] * 10, 0, *GAMMA, *np.round(row, 2)]
    return "\r\n".join(f"{x:g}" if isinstance(x, float) else str(x) for x in lines) + "\r\n"


def files() -> dict[str, str]:
    """Names and texts."""
    half, quadrant = np.arange(90.0, 270.1, 5.0), np.arange(0.0, 90.1, 7.5)
    return {
        "road_cutoff.ies": ies("Road luminaire, cut-off", road_cutoff, half, 10_000.0),
        "road_lantern.ies": ies("Road lantern", road_lantern, quadrant, 4_000.0),
        "shop_downlight.ldt": ldt("Shop front downlight", shop_downlight, 1_200.0),
    }


def main() -> None:
    """Write all files."""
    parser = argparse.ArgumentParser(description="Write the street's photometric files.")
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).parent)
    folder: Path = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files().items():
        (folder / name).write_bytes(text.encode("ascii"))


if __name__ == "__main__":
    main()
