"""A scene of known cd/m2 and a camera that photographs it, exposure by exposure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio

Array = npt.NDArray[Any]

#: Exposures in stops, 2 apart, such that 0.1 cd/m2 is well exposed in the last of them and
#: 10,000 cd/m2 in the first.
STOPS = np.arange(-12.0, 1.0, 2.0)

APERTURE, SPEED = 4.0, 100.0


def film(exposure: Array) -> Array:
    """A response with a toe and a shoulder, far from sRGB: code share by relative exposure."""
    y = np.sqrt((1.0 - np.exp(-1.6 * np.clip(exposure, 0.0, None))) / (1.0 - np.exp(-1.6)))
    return np.minimum(0.35 * y * y + 0.65 * y, 1.0)


def film_inverse(share: Array) -> Array:
    """Undo ``film``, in closed form."""
    y = (np.sqrt(0.65**2 + 4.0 * 0.35 * share) - 0.65) / 0.7
    return np.asarray(-np.log(1.0 - y * y * (1.0 - np.exp(-1.6))) / 1.6)


def scene(height: int = 120, width: int = 200) -> Array:
    """(h, w, 3) cd/m2 from 0.1 to 10,000 a channel, each decade as wide as the others."""
    down, right = np.mgrid[:height, :width] / np.array([height, width])[:, None, None]
    share = 0.5 * right + 0.25 * (1.0 + np.sin(4.0 * down) * np.sin(6.0 * right))
    share = (share - share.min()) / (share.max() - share.min())
    shift = np.array([0.0, 0.06, -0.05])
    return np.asarray(10.0 ** (-1.0 + 5.0 * np.clip(share[..., None] + shift, 0.0, 1.0)))


def shoot(
    light: Array,
    stops: float,
    *,
    response: Callable[[Array], Array] = film,
    seed: int | None = 1,
    top: int = 255,
) -> Array:
    """Codes of ``light`` at ``stops``, where stop 0 makes 0.1 cd/m2 0.02 of full exposure.

    Sensor noise before the response: photons (variance 2e-5 of full exposure) and reading (3e-4
    of it); none with ``seed`` None.
    """
    exposure = light * 0.2 * 2.0**stops
    if seed is not None:
        rng = np.random.default_rng([seed, int(100 + stops)])
        exposure = exposure + rng.normal(size=light.shape) * np.sqrt(2e-5 * exposure + 3e-4**2)
    codes = np.rint(top * response(exposure))
    return codes.astype(np.uint8 if top == 255 else np.uint16)


def seconds(stops: float) -> float:
    """The shutter time of ``shoot``; 1/64 s to 64 s."""
    return float(64.0 * 2.0**stops)


def write_photograph(path: Path, codes: Array, tags: dict[str, Any] | None = None) -> Path:
    """Codes as the suffix says, with ``tags`` as OpenImageIO names them."""
    h, w, c = codes.shape
    spec = oiio.ImageSpec(w, h, c, str(codes.dtype).replace("float32", "float"))
    spec.attribute("CompressionQuality", 98)
    spec.attribute("jpeg:subsampling", "4:4:4")
    for name, value in (tags or {}).items():
        if name == "tile":
            spec.tile_width = spec.tile_height = value
        else:
            spec.attribute(name, value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    assert out.write_image(np.ascontiguousarray(codes)), out.geterror()
    out.close()
    return path


def exif(stops: float) -> dict[str, Any]:
    """What the camera writes beside the picture."""
    return {
        "ExposureTime": seconds(stops),
        "FNumber": APERTURE,
        "Exif:PhotographicSensitivity": int(SPEED),
    }


def write_bracket(
    folder: Path,
    light: Array,
    stops: Sequence[float] | Array = STOPS,
    suffix: str = ".png",
    **how: Any,
) -> list[Path]:
    """A file an exposure, with Exif."""
    return [
        write_photograph(folder / f"im{i}{suffix}", shoot(light, s, **how), exif(s))
        for i, s in enumerate(stops)
    ]
