"""The street's materials, in daylight colours.

Diffuse colours are reflectances: with a texture T the reflectance is
T^2.2 * diffuse (Petit and Bremond 2010, section 3), and the textures are drawn so
that its mean is that of the real surface (asphalt about 0.1, limestone about 0.45).
Emission is what an author of an OpenGL database writes: a number between 0 and 1
that looks right beside a sunlit wall. It says nothing about cd/m2; photometry.toml does.
"""

from __future__ import annotations

from street_model import Material, Vec3


def _plain(name: str, diffuse: Vec3, specular: float = 0.0, shininess: float = 0.0) -> Material:
    return Material(name, diffuse, specular=(specular,) * 3, shininess=shininess)


def _glowing(name: str, diffuse: Vec3, emission: Vec3) -> Material:
    return Material(name, diffuse, emission=emission)


def _picture(name: str, texture: str, emission: float = 0.0) -> Material:
    return Material(name, texture=texture, emission=(emission,) * 3)


_CAR_COLOURS: dict[str, Vec3] = {
    "Red": (0.48, 0.03, 0.03),
    "Blue": (0.05, 0.10, 0.30),
    "Silver": (0.50, 0.51, 0.53),
    "White": (0.78, 0.78, 0.76),
    "Black": (0.03, 0.03, 0.035),
    "Green": (0.06, 0.20, 0.13),
}

_ALL = [
    # ground
    Material("Asphalt", texture="asphalt.png", tile=7.0),
    Material("Puddle", texture="asphalt.png", tile=7.0),  # by day as dry as the road
    Material("Marking", texture="marking.png", tile=1.5),
    Material("Kerb", texture="granite.png", tile=1.0),
    Material("Pavement", texture="pavement.png", tile=2.4),
    Material("ArcadeFloor", texture="arcade_floor.png", tile=2.0),
    # walls and roofs
    Material("StoneCream", texture="stone_ashlar.png", tile=3.0),
    Material("StoneGrey", (0.80, 0.82, 0.84), "stone_ashlar.png", tile=3.0),
    Material("StoneRusticated", texture="stone_rusticated.png", tile=2.4),
    Material("Brick", texture="brick.png", tile=2.0),
    Material("PlasterOchre", (0.95, 0.74, 0.46), "plaster.png", tile=4.0),
    Material("PlasterRose", (0.90, 0.66, 0.58), "plaster.png", tile=4.0),
    Material("Trim", texture="stone_smooth.png", tile=2.0),
    Material("Ceiling", (0.95, 0.93, 0.88), "plaster.png", tile=4.0),
    Material("PartyWall", (0.62, 0.58, 0.50), "plaster.png", tile=4.0),
    Material("Slate", texture="slate.png", tile=2.0),
    _plain("Zinc", (0.36, 0.39, 0.42), 0.15, 20.0),
    _plain("Chimney", (0.42, 0.20, 0.13)),
    # openings
    _picture("WindowDark_Curtain", "window_curtain.png"),
    _picture("WindowDark_Bare", "window_bare.png"),
    _picture("WindowLit_Warm", "window_warm.png", 0.35),
    _picture("WindowLit_Cool", "window_cool.png", 0.35),
    _picture("ShopLit_Books", "shop_books.png", 0.35),
    _picture("ShopLit_Fashion", "shop_fashion.png", 0.35),
    _picture("ShopLit_Cafe", "shop_cafe.png", 0.35),
    _picture("ShopDark", "shop_dark.png"),
    _picture("Door", "door.png"),
    _picture("Sign", "signs.png"),
    _picture("SignLit", "signs.png", 0.5),
    _picture("PosterLit", "poster.png", 0.3),
    _plain("WoodGreen", (0.05, 0.13, 0.09), 0.1, 30.0),
    _plain("WoodRed", (0.24, 0.03, 0.03), 0.1, 30.0),
    _plain("WoodNavy", (0.04, 0.06, 0.14), 0.1, 30.0),
    Material("Awning", texture="awning.png", two_sided=True, tile=1.2),
    # metal and lamps
    _plain("Iron", (0.04, 0.05, 0.045), 0.2, 20.0),
    _plain("PoleGreen", (0.05, 0.10, 0.08), 0.3, 30.0),
    _glowing("LampGlass", (0.60, 0.58, 0.50), (0.9, 0.75, 0.5)),
    _glowing("LanternGlass", (0.70, 0.68, 0.60), (0.9, 0.8, 0.6)),
    _glowing("DownlightGlass", (0.70, 0.68, 0.60), (0.9, 0.8, 0.6)),
    _plain("SignalHousing", (0.03, 0.03, 0.03)),
    _plain("SignalRedOff", (0.20, 0.01, 0.01), 0.3, 40.0),
    _plain("SignalAmberOff", (0.22, 0.12, 0.01), 0.3, 40.0),
    _plain("SignalGreenOff", (0.01, 0.14, 0.08), 0.3, 40.0),
    _glowing("CrossLit", (0.03, 0.25, 0.08), (0.1, 1.0, 0.3)),
    _glowing("SignalRedLit", (0.20, 0.01, 0.01), (1.0, 0.08, 0.05)),
    _glowing("SignalGreenLit", (0.01, 0.14, 0.08), (0.05, 1.0, 0.6)),
    # cars
    *(_plain(f"CarPaint{name}", rgb, 0.2, 60.0) for name, rgb in _CAR_COLOURS.items()),
    _plain("CarGlass", (0.04, 0.05, 0.06), 0.6, 90.0),
    _plain("CarTrim", (0.025, 0.025, 0.025)),
    _plain("Tyre", (0.03, 0.03, 0.03)),
    _plain("Rim", (0.45, 0.46, 0.48), 0.4, 40.0),
    Material("Plate", texture="plate.png"),
    _plain("HeadlampOff", (0.50, 0.52, 0.55), 0.4, 90.0),
    _glowing("HeadlampLit", (0.50, 0.52, 0.55), (1.0, 0.97, 0.85)),
    _plain("TailLampOff", (0.30, 0.01, 0.01), 0.4, 60.0),
    _glowing("TailLampLit", (0.30, 0.01, 0.01), (0.8, 0.04, 0.03)),
]

#: Every material by its name.
MATERIALS: dict[str, Material] = {material.name: material for material in _ALL}
