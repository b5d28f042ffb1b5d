"""What a USD file's light intensities count in: the letter of UsdLux, or a known writer's unit.

Since OpenUSD 25.05 the text of UsdLux says nits. Stages are older than that, and writers go on
as they were; a file does not say which. Blender (``USDLightWriter`` of its source; measured with
5.0.1) writes watts: a lamp's power over pi with ``normalize`` 1, which by the letter is its watts
per steradian; a sun's W/m2 over 4. Its glTF reader and writer count 683 lm/W, so that candela
that came in by glTF come out again; the light of a real lamp has fewer.
"""

from __future__ import annotations

from dataclasses import dataclass

#: lm/W at 555 nm (SI brochure), which Blender's glTF exchange takes for all light.
LUMENS_PER_WATT = 683.0


@dataclass(frozen=True, slots=True)
class LightUnit:
    """``local``, ``distant``: what the cd and lx by the letter are multiplied by."""

    name: str
    local: float
    distant: float
    text: str


#: By the name in a photometry file, ``[usd] light_unit``.
LIGHT_UNITS = {
    unit.name: unit
    for unit in (
        LightUnit("nits", 1.0, 1.0, "UsdLux 25.05, nits"),
        LightUnit(
            "blender-watts",
            LUMENS_PER_WATT,
            4.0 * LUMENS_PER_WATT,
            "UsdLux, Blender's watts at 683 lm/W",
        ),
    )
}

#: Intensities that a converter writes for every lamp of a kind, whatever it was: NVIDIA's
#: usd-convert-asset 1.1.0.
CONSTANTS = {
    "sphere": (30_000.0,),
    "disk": (30_000.0,),
    "distant": (3_000.0,),
    "rect": (15_000.0,),
}
