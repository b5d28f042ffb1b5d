"""A database in, a first photometry file out: ``write_recipe``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from hdrusd.errors import InputError
from hdrusd.images import read_image, write_atomically
from hdrusd.importers.importer import Resolver, read
from hdrusd.legacy.scene import Image
from hdrusd.photometry.baked import OVERVIEW
from hdrusd.photometry.reflectance import reflectance_table
from hdrusd.recipe.evidence import leads
from hdrusd.recipe.places import Doubles, note_unseen
from hdrusd.recipe.stage_scene import stage_scene
from hdrusd.recipe.text import recipe
from hdrusd.units import TEXTURE_GAMMA
from hdrusd.usd.source_stage import STAGES


@dataclass(frozen=True, slots=True)
class Recipe:
    """The text, and how many of its entries count and how many are commented out."""

    text: str
    entries: int
    suspicions: int


def write_recipe(
    resolver: Resolver,
    output: Path | None,
    *,
    source_unit: float | None = None,
    up: Literal["Y", "Z"] | None = None,
) -> Recipe:
    """Read the resolver's source, write ``output`` (None: do not). Raises InputError.

    ``source_unit``, metres, and ``up``: where the source does not say, or is wrong.
    """
    source, report = resolver.source, resolver.report
    if source.suffix.lower() in STAGES:
        scene = stage_scene(source, resolver.allowed, report)
    else:
        said = {"unit": source_unit, "up": up}
        resolver.stated = frozenset(key for key, value in said.items() if value)
        scene = read(resolver, report)
    scene.unit_m, scene.up = source_unit or scene.unit_m, up or scene.up
    note_unseen(scene, report)
    found = leads(scene, _picture)
    counted = sum(lead.counts for lead in found)
    text = recipe(source.name, found, unit_m=source_unit, up=up)
    if output is not None:
        write_atomically(output, lambda path: _write(path, text))
    return Recipe(text, counted + 1, len(found) - counted)


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _picture(image: Image) -> Doubles | None:
    """8-bit pictures in linear values, as ``MapWriter.overview`` has them; others hold no painted
    lamps.
    """
    if image.missing:
        return None
    pixels: npt.NDArray[Any] | None = image.pixels
    if pixels is None:
        try:
            pixels = read_image(image.path or Path(image.name), image.data).pixels
        except InputError:  # convert tells it
            return None
    if pixels.dtype != "uint8":
        return None
    step = -(-max(pixels.shape[:2]) // OVERVIEW)
    pixels = pixels[::step, ::step]
    color = pixels[..., :3] if pixels.shape[2] >= 3 else pixels[..., :1].repeat(3, axis=2)
    return np.asarray(reflectance_table(TEXTURE_GAMMA, 1.0)[color])
