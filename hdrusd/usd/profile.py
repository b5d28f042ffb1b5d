"""Photometric files of lights, ``inputs:shaping:ies:*`` of UsdLux: LM-63, and EULUMDAT too.

By the schema text of OpenUSD 26.11 the file's candela in a direction multiply what the light
gives without it: with intensity m / (pi r^2), r in metres, a sphere light gives m times the
file. Three things it leaves to be decided:

``ies:angleScale`` stretches gamma as the text says, about gamma 0 for numbers above 0, about
180 below; the profile's range of angles is stretched in its place. It has no meaning for the
planes of types A and B.

``ies:normalize``: the formula multiplies by the profile's power, the sentence before it wants
the light's output preserved, and OpenUSD's hdEmbree divides by the mean intensity. Read here:
divided by the mean over the whole sphere, flux / 4 pi, so that the light gives as many lumens
as it would evenly, whatever the file.

A file that is missing or broken: a light with ``normalize`` shines evenly; any other is left
out, as its strength is a factor on numbers that are not known.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd, UsdLux

from hdrusd.errors import InputError, SourceRef
from hdrusd.photometry.eulumdat import read_eulumdat
from hdrusd.photometry.ies import is_ies, read_ies
from hdrusd.photometry.luminaire import MOST_BYTES, Luminaire
from hdrusd.photometry.profile import MOST_CELLS, cell_count, even_profile
from hdrusd.report import Kind, Report
from hdrusd.scene import Profile
from hdrusd.usd.assets import asset_bytes, in_package, resolved_asset
from hdrusd.usd.findings import prim_finding
from hdrusd.usd.lux import input_number, input_source

_FILE = "shaping:ies:file"


@dataclass(frozen=True, slots=True, eq=False)
class _File:
    """A photometric file that was read."""

    profile: Profile
    flux: float  # lm


class Profiles:
    """The profiles of a stage, each file read once; their numbers do not change."""

    def __init__(self, stage: Usd.Stage, report: Report) -> None:
        self.report = report
        self._files: dict[str, _File | None] = {}
        self._numbers: dict[tuple[str, float], int] = {}
        self._cells = 0
        self.all: tuple[Profile, ...] = ()  # RenderScene.profiles

    def assign(self, prim: Usd.Prim, rows: npt.NDArray[np.void], time: Usd.TimeCode) -> None:
        """Give rows of ``scene.LIGHT``, all of one light, its profile, and the strength with it."""
        asset = self._asset(prim, time)
        if asset is None:
            return
        if not rows["w"].any():
            text = "a distant light takes no photometric file"
            prim_finding(self.report, prim, Kind.DROPPED, "profile-unused", text)
            return
        source = input_source(prim, _FILE)
        path = resolved_asset(source, asset)
        file = self._file(path, prim)
        normalized = self._normalized(prim, time)
        if file is None:
            if not normalized:
                rows["intensity"] = 0.0
            return
        if normalized:
            rows["intensity"] *= 4.0 * math.pi / file.flux if file.flux > 0.0 else 0.0
            text = "ies:normalize divides by the mean candela of the file, flux / 4 pi"
            prim_finding(self.report, prim, Kind.ASSUMED, "profile-normalize", text)
        rows["profile"] = self._number(path, file.profile, prim, time)

    def _asset(self, prim: Usd.Prim, time: Usd.TimeCode) -> Sdf.AssetPath | None:
        source = input_source(prim, _FILE) if prim.HasAPI(UsdLux.ShapingAPI) else None
        asset = source.Get(time) if source else None
        return asset if isinstance(asset, Sdf.AssetPath) and asset.path else None

    def _normalized(self, prim: Usd.Prim, time: Usd.TimeCode) -> bool:
        source = input_source(prim, "shaping:ies:normalize")
        return bool(source) and source.Get(time) is True

    def _number(self, path: str, profile: Profile, prim: Usd.Prim, time: Usd.TimeCode) -> int:
        scale = input_number(prim, "shaping:ies:angleScale", time)
        if not math.isfinite(scale):
            prim_finding(
                self.report, prim, Kind.INVALID, "profile-angle-scale", "angleScale is no number"
            )
            scale = 0.0
        elif scale != 0.0 and profile.type != "C":
            text = f"angleScale has no meaning for the planes of type {profile.type}"
            prim_finding(self.report, prim, Kind.DROPPED, "profile-angle-scale", text)
            scale = 0.0
        key = path, scale
        if key not in self._numbers:
            self._numbers[key] = len(self.all)
            self.all = (*self.all, scaled(profile, scale))
        return self._numbers[key]

    def _file(self, path: str, prim: Usd.Prim) -> _File | None:
        if path not in self._files:
            try:
                self._files[path] = self._read(path)
            except InputError as error:
                self._files[path] = None
                text = f"{error}; {_CONSEQUENCE}"
                prim_finding(self.report, prim, Kind.INVALID, "profile-invalid", text)
            except OSError as error:
                self._files[path] = None
                text = f"{path}: {error.strerror or error}; {_CONSEQUENCE}"
                prim_finding(self.report, prim, Kind.MISSING, "profile-missing", text)
        return self._files[path]

    def _read(self, path: str) -> _File:
        place = SourceRef(Path(path))
        luminaire = read_luminaire(_bytes(path), path, self.report)
        profile, lost = even_profile(luminaire, path)
        self._cells += cell_count(profile.candela)
        if self._cells > MOST_CELLS:
            self._cells -= cell_count(profile.candela)
            raise InputError(place, f"the profiles of the stage have over {MOST_CELLS} cells")
        if lost > 0.0:
            peak = float(luminaire.candela.max())
            text = f"angles without a common step; up to {lost:.3g} cd of {peak:.5g} off"
            self.report.add(Kind.REPLACED, "profile-resampled", place, "", text)
        if luminaire.type != "C":
            text = f"type {luminaire.type}: its aim is the light's -Z, its right +X, its top +Y"
            self.report.add(Kind.ASSUMED, "profile-axes", place, "", text)
        return _File(profile, luminaire.flux())


_CONSEQUENCE = "left out; with ies:normalize the light would shine evenly"


def read_luminaire(data: bytes, path: str, report: Report) -> Luminaire:
    """A photometric file by what it looks like. Raises InputError."""
    place = SourceRef(Path(path))
    if not is_ies(data) and not path.lower().rstrip("]").endswith(".ies"):
        return read_eulumdat(data, place, report)

    def tilt(name: str) -> bytes | None:
        try:
            return _bytes(beside(path, name))
        except OSError:
            return None

    return read_ies(data, place, report, tilt)


def beside(path: str, name: str) -> str:
    """The path of a file in the folder of another, which may lie in a package."""
    name = PurePosixPath(name.replace("\\", "/")).name.rstrip("]")
    if not in_package(path):
        return path[: path.rfind("/") + 1] + name
    return path[: max(path.rfind("/"), path.rfind("[")) + 1] + name + "]"


def scaled(profile: Profile, scale: float) -> Profile:
    """A type C profile with gamma stretched as ``inputs:shaping:ies:angleScale`` says."""
    if scale == 0.0:
        return profile
    origin = 0.0 if scale > 0.0 else math.pi
    first, last = (origin + (angle - origin) * abs(scale) for angle in profile.angles)
    return replace(profile, angles=(first, last))


def _bytes(path: str) -> bytes:
    """Raises OSError where there is nothing, InputError for too much."""
    file = Path(path)
    if not in_package(path) and file.is_file() and file.stat().st_size > MOST_BYTES:
        raise InputError(file, f"want at most {MOST_BYTES} bytes")
    data = asset_bytes(path)
    if data is None:
        raise FileNotFoundError(2, "no such file", path)
    return data
