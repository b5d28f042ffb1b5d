"""The photometric profiles of a scene as one texture, and what each light keeps of its own."""

from __future__ import annotations

import moderngl
import numpy as np
import numpy.typing as npt

from hdrusd.photometry.profile import pack_profiles
from hdrusd.scene import Profile

Floats = npt.NDArray[np.float32]

#: The #define of a light with a profile.
PROFILE = "PROFILE"


class ProfileAtlas:
    """The texture that ``profile_candela`` reads, made anew where the profiles are others."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self.texture: moderngl.Texture | None = None  # RGBA32F; None without profiles
        self._profiles: tuple[Profile, ...] = ()
        self._placements: Floats = np.zeros((0, 2, 4), np.float32)

    def update(self, profiles: tuple[Profile, ...]) -> None:
        """Keep what there is while the profiles are the same objects. Raises ParameterError."""
        same = len(profiles) == len(self._profiles)
        if same and all(a is b for a, b in zip(profiles, self._profiles, strict=True)):
            return
        atlas, self._placements = pack_profiles(profiles)
        self.release()
        if profiles:
            height, width = atlas.shape[:2]
            self.texture = self.ctx.texture((width, height), 4, atlas, dtype="f4")
            self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._profiles = profiles

    def of_lights(self, lights: npt.NDArray[np.void]) -> tuple[Floats, npt.NDArray[np.str_]]:
        """(n, 2, 4) texels of ``scene.LIGHT`` rows, and (n,) their #define or ""."""
        numbers = lights["profile"]
        texels = np.zeros((len(lights), 2, 4), np.float32)
        texels[:, 0, 1:3] = 1.0  # a cell, so that a light without a profile reads a texel too
        shaped = numbers >= 0
        texels[shaped] = self._placements[numbers[shaped]]
        return texels, np.where(shaped, PROFILE, "")

    def release(self) -> None:
        """Give the texture back."""
        if self.texture is not None:
            self.texture.release()
            self.texture = None
        self._profiles = ()
