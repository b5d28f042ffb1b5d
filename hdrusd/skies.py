"""The sky that a photometry file names by a preset: its numbers, and its picture as a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hdrusd.images import write_exr
from hdrusd.legacy.scene import RGB
from hdrusd.photometry.confidence import BY_CLASS
from hdrusd.photometry.light import PhotometricLight
from hdrusd.photometry.sidecar import Rule
from hdrusd.photometry.sky_presets import PRESETS
from hdrusd.report import Kind, Report


@dataclass(frozen=True, slots=True)
class Sky:
    """A sky to be written: lux on a level ground, a picture in cd/m2 if it has one, and its sun
    or moon, as ``body`` calls it.

    ``towards``: the sun or the moon, with +Y up, -Z north and +X east.
    """

    light: PhotometricLight
    picture: str = ""  # as the layers call it
    sun: PhotometricLight | None = None
    towards: tuple[float, float, float] = (0.0, 1.0, 0.0)
    body: str = ""


def even_sky(rule: Rule, color: RGB | None) -> Sky:
    """The sky of an ``[ambient]`` that states lux alone: alike from everywhere."""
    return Sky(
        PhotometricLight(
            "ambient",
            rule.number("illuminance") or 0.0,
            color or (1.0, 1.0, 1.0),
            provenance=rule.provenance,
            rule=str(rule.place),
            source=rule.source,
        )
    )


class SkyFiles:
    """Writes pictures into ``folder``, which the layers call ``prefix``."""

    def __init__(self, folder: Path, prefix: str, report: Report) -> None:
        self.folder = folder
        self.prefix = prefix
        self.report = report
        self.written: dict[str, dict[str, object]] = {}  # file -> what it is, for the report

    def make(self, rule: Rule, color: RGB | None) -> Sky:
        """The sky of an ``[ambient]`` that names a preset."""
        preset = PRESETS[rule.values["preset"]]
        altitude = rule.number("altitude")
        if altitude is not None and not self._takes(rule, altitude):
            altitude = None
        stated = rule.number("illuminance")
        made = preset.sky(altitude, rule.number("azimuth"), stated)
        hue = color or (1.0, 1.0, 1.0)
        text = f"{preset.name}: {made.illuminance:.4g} lx on a level ground ({preset.source})"
        if stated is None:
            self.report.add(Kind.ASSUMED, "sky-preset", rule.place, "preset", text)
        light = PhotometricLight(
            "ambient",
            made.lux,
            hue,
            provenance="estimated" if stated is None else rule.provenance,
            rule=f"{BY_CLASS}sky {preset.name}, {rule.place}"
            if stated is None
            else f"{rule.place}, sky {preset.name}",
            # A stated number is not the preset's, nor is its source.
            source="; ".join(part for part in (rule.source, preset.source) if part)
            if stated is None
            else rule.source,
        )
        sun = None
        if made.beam > 0.0:
            sun = PhotometricLight(
                "distant",
                made.beam,
                hue,
                provenance=light.provenance,
                rule=light.rule,
                source=light.source,
            )
        picture = ""
        if made.picture is not None and made.lux > 0.0:
            picture = self._write(f"sky_{preset.name}", made.picture[..., None] * np.array(hue))
        return Sky(light, picture, sun, made.towards, preset.body)

    def _takes(self, rule: Rule, altitude: float) -> bool:
        preset = PRESETS[rule.values["preset"]]
        if preset.altitude is not None and preset.least <= altitude <= preset.most:
            return True
        wanted = f"want {preset.least:g} to {preset.most:g}" if preset.altitude else "it has none"
        text = f"{altitude:g} degrees for {preset.name}; {wanted}; not used"
        self.report.add(Kind.INVALID, "sidecar-invalid", rule.place, "altitude", text)
        return False

    def _write(self, name: str, rgb: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
        self.folder.mkdir(parents=True, exist_ok=True)
        file = f"{name}.exr"
        write_exr(self.folder / file, rgb)
        self.written[file] = {"kind": "sky", "image": name, "unit": "cd/m2"}
        return f"{self.prefix}/{file}"
