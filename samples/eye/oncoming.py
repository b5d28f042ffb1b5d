"""A country road at night, an oncoming car, and somebody at the roadside: 8 s at 72 km/h.

Both cars have passing beams after a formula (low_beam.ies). They meet after 6 s; one and a
half seconds later the own car is where a person in dark clothes stands on the verge.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from eye_stage import EyeStage, Finish
from eye_surfaces import (
    conifers,
    dashes,
    finishes,
    flat,
    grain,
    grainy,
    in_finishes,
    sky,
    write_picture,
    write_street_textures,
)
from street_cars import HATCHBACK, HEADLAMP, HEADLAMP_HEIGHT, bonnet, car
from street_shapes import Kit

SECONDS, SPEED = 8.0, 20.0  # s, m/s of either car
LANE, EYE = 1.75, (-0.37, 0.10, 1.30)  # m: middle of a lane; the eye from the middle of the car
START = 240.0  # m between the cars' middles at the start
PERSON = (4.3, 150.0, 0.0)

ROAD = 0.08  # reflectance of worn asphalt
MOON = 0.02  # lx from everywhere: a clear night without much moon
LAMP = 0.55  # m from the middle of the car to either lamp
AIM = -0.57  # degrees: the cut-off falls by 1 % (10 cm in 10 m)
GLARE = 350.0  # cd above the cut-off, towards oncoming eyes

_SOURCE = "low_beam.ies, a formula within the points of UN R112, class B"


def passing_beam(across: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Candela of a passing beam; degrees to the right and up from the cut-off's left half.

    A spot just below the cut-off, a wide and weaker foreground, and GLARE above. The
    cut-off rises by 15 degrees to the right, up to 2.5 degrees.
    """
    edge = np.clip(across * math.tan(math.radians(15.0)), 0.0, 2.5)
    below = edge - up  # degrees below the cut-off
    aside = (across - 2.5) / np.where(across < 2.5, 3.5, 7.0)
    spot = 20_000.0 * np.exp(-(aside**2) - ((below - 0.9) / 1.5) ** 2)
    wide = 4000.0 * np.exp(-((across / 24.0) ** 2) - np.abs(below - 1.5) / 3.0)
    lit = 1.0 / (1.0 + np.exp(-below / 0.12))  # the cut-off is half a degree wide
    stray = GLARE * np.exp(-((across / 30.0) ** 2) - (np.maximum(-below, 0.0) / 6.0) ** 2)
    return (spot + wide) * lit + stray * (1.0 - lit)


def write_beam(path: Path) -> None:
    """LM-63-2002 of type A: planes from left to right, degrees up and down within each."""
    across = np.concatenate([np.arange(-45.0, -12.0, 3.0), np.arange(-12.0, 12.1, 0.5)])
    across = np.concatenate([across, np.arange(15.0, 45.1, 3.0)])
    up = np.concatenate([np.arange(-20.0, -4.0, 1.0), np.arange(-4.0, 4.1, 0.125)])
    up = np.concatenate([up, np.arange(5.0, 12.1, 1.0)])
    candela = passing_beam(across[:, None], up[None, :])
    rows = [
        "IESNA:LM-63-2002",
        "[TEST] none: a formula",
        "[MANUFAC] hdrusd sample",
        "[LUMINAIRE] passing beam, right-hand traffic",
        "TILT=NONE",
        f"1 -1 1 {len(up)} {len(across)} 3 2 {HEADLAMP[0]} 0 {HEADLAMP[1]}",
        "1 1 0",
        *_lines(up, "{:g}"),
        *_lines(across, "{:g}"),
    ]
    for plane in candela:
        rows += _lines(plane, "{:.1f}")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\r\n".join(rows) + "\r\n", encoding="ascii", newline="")


def _lines(values: np.ndarray, form: str) -> list[str]:
    words = [form.format(float(value)) for value in values]
    return [" ".join(words[i : i + 12]) for i in range(0, len(words), 12)]


def write(out: Path) -> Path:
    """The stage, its textures and its photometric file."""
    stage = EyeStage(out / "oncoming.usda", SECONDS)
    write_picture(out / "textures/grain.png", grain())
    write_street_textures(out, "plate")
    write_beam(out / "low_beam.ies")
    _road(stage)
    _person(stage)
    stage.ambient(MOON, (0.75, 1.0, 1.5))
    sky(stage, Finish("NightSky", luminance=0.002, colour=(0.8, 1.0, 1.4), source="no moon"))

    own = [(t, (LANE, SPEED * t, 0.0)) for t in (0.0, SECONDS)]
    other = [(t, (-LANE, START - SPEED * t, 0.0)) for t in (0.0, SECONDS)]
    for name, path, heading, body in (
        ("OwnCar", own, 0.0, bonnet(HATCHBACK, "Blue")),
        ("OncomingCar", other, 180.0, car(HATCHBACK, "Silver", lit=True)),
    ):
        place = stage.place(name, path, heading=heading)
        stage.tree(place, in_finishes(body))
        for side, word in ((-1.0, "Left"), (1.0, "Right")):
            stage.beam(
                f"{place}/Headlamp{word}",
                (side * LAMP, HATCHBACK.length / 2.0 + 0.03, HEADLAMP_HEIGHT),
                0.108, "low_beam.ies", kelvin=3200.0, tilt=AIM, source=_SOURCE,
            )  # fmt: skip
    eye = [(t, (x + EYE[0], y + EYE[1], EYE[2])) for t, (x, y, _) in own]
    stage.camera("Driver", eye, 50.0)
    return stage.save()


def _road(stage: EyeStage) -> None:
    kit = finishes(
        grainy("Asphalt", ROAD, 6.0),
        flat("Paint", 0.5),
        grainy("Verge", (0.075, 0.095, 0.04), 3.0),
        flat("Fir", (0.035, 0.05, 0.03)),
        grainy("Leaves", (0.05, 0.07, 0.03), 2.5),
        flat("Post", 0.7),
        flat("PostBlack", 0.04),
        grainy("Trunk", (0.14, 0.11, 0.085), 1.0),
    )
    y0, y1 = -20.0, 700.0
    y = np.linspace(y0, y1, 181)  # short, as beams change quickly over it
    for name, a, b, z in (("Asphalt", -3.6, 3.6, 0.0), ("Verge", 3.6, 60.0, -0.01),
                          ("Verge", -60.0, -3.6, -0.01)):  # fmt: skip
        kit[name].grid([[(x, v, z) for x in np.linspace(a, b, 5)] for v in y])
    for x in (-3.4, 3.4):
        dashes(kit["Paint"], x, y0, y1, 36.0, 0.0)
    dashes(kit["Paint"], 0.0, y0, y1, 3.0, 9.0)
    for at in np.arange(10.0, 500.0, 40.0):
        for side in (-4.4, 4.4):
            kit["Post"].box((side - 0.06, at - 0.05, 0.0), (side + 0.06, at + 0.05, 1.0), "xXyYZ")
            kit["PostBlack"].box(
                (side - 0.062, at - 0.052, 0.72), (side + 0.062, at + 0.052, 0.9), "xXyY"
            )
    rng = np.random.default_rng(9)
    for at in np.arange(4.0, 420.0, 13.0):  # an avenue
        for side in (-1.0, 1.0):
            x, v = side * (6.6 + 0.6 * rng.random()), at + 3.0 * rng.random()
            _tree(kit, float(x), float(v), rng)
    places = [
        (side * (14.0 + 30.0 * rng.random()), v, 0.0)
        for side in (-1.0, 1.0)
        for v in rng.uniform(0.0, 400.0, 70)
    ]
    conifers(kit["Fir"], np.array(places), rng)
    stage.surfaces(stage.place("Ground"), kit.meshes("Ground"))


def _tree(kit: Kit, x: float, y: float, rng: np.random.Generator) -> None:
    high = 3.0 + rng.random()
    kit["Trunk"].revolve(((0.26, 0.0), (0.19, 0.5), (0.15, high)), 9, (x, y, 0.0))
    wide, tall = 1.7 + 0.6 * rng.random(), 2.2 + rng.random()
    up, turn = np.meshgrid(np.linspace(0.0, np.pi, 10), np.linspace(0.0, 2.0 * np.pi, 15))
    bulge = 0.82 + 0.36 * rng.random(up.shape)
    bulge[-1], bulge[:, 0], bulge[:, -1] = bulge[0], 1.0, 1.0  # closed
    crown = bulge[..., None] * np.stack(
        (wide * np.sin(up) * np.cos(turn), wide * np.sin(up) * np.sin(turn), -tall * np.cos(up)),
        axis=2,
    )
    kit["Leaves"].grid((crown + np.array((x, y, high + 0.9 * tall))).transpose(1, 0, 2))


def _person(stage: EyeStage) -> None:
    """1.75 m tall, dark coat and trousers: reflectance 0.05; hands and face 0.35."""
    kit = finishes(flat("Coat", 0.05), flat("Trousers", 0.04), flat("Skin", (0.42, 0.33, 0.26)))
    for side in (-0.11, 0.11):
        legs = ((0.075, 0.0), (0.085, 0.5), (0.1, 0.86))
        kit["Trousers"].revolve(legs, 10, (side, 0.0, 0.0))
        arm = ((0.05, 0.80), (0.06, 1.1), (0.065, 1.34), (0.05, 1.40), (0.0, 1.42))
        kit["Coat"].revolve(arm, 10, (side * 2.2, 0.0, 0.0))
        kit["Skin"].revolve(((0.0, 0.70), (0.045, 0.74), (0.04, 0.80)), 8, (side * 2.2, 0.0, 0.0))
    coat = ((0.23, 0.62), (0.19, 0.95), (0.21, 1.28), (0.19, 1.38), (0.09, 1.46), (0.06, 1.54))
    kit["Coat"].revolve(coat, 14)
    angle = np.linspace(0.0, np.pi, 8)
    head = np.stack((0.1 * np.sin(angle), 1.63 - 0.13 * np.cos(angle)), axis=1)
    kit["Skin"].revolve(head, 12)
    stage.surfaces(stage.place("Person", PERSON), kit.meshes("Person"))
