"""Which reflectance a surface can have, and whether a converted one is plausible.

A photograph's texture times a material's colour is a reflectance only if its exposure was
right. Classes of surfaces have known ranges, found by the words of a material's or a
texture's name; whatever the class, nothing a road scene shows sends back much more than 0.9
or less than 0.02. Nothing here changes a number.

Ranges are of visible light where the source has them, rounded outwards. Oke's and Pon's are of
all sunlight: of what is grey they hold for visible light too; of plants, which are bright in the
infrared only, they are not used.
"""

from __future__ import annotations

import math
import re
import unicodedata
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from hdrusd.photometry.lamp_words import LAMP_WORDS
from hdrusd.units import LUMINANCE_WEIGHTS

Array = npt.NDArray[Any]

#: Above this only snow; below it only velvet and soot: the white and the black of a ColorChecker
#: have 0.90 and 0.03.
BRIGHTEST, DARKEST = 0.9, 0.02

#: How far beyond a bound is still on it: codes of 8 bits are steps of 2.2/255 at white.
_SLACK = 0.01

#: "Unconfirmed": nobody has read that source.
_OKE = "Oke 1987, Boundary Layer Climates, tables 1.1 and 7.4, unconfirmed"
_IES = "IESNA Lighting Handbook, 9th ed. (2000), outside surfaces, unconfirmed"
_PON = "Pon 1999, Pavement albedo"
_MCCAMY = "McCamy, Marcus and Davidson 1976, A color-rendition chart"
_EN1436 = "EN 1436:2018, luminance factor beta, unconfirmed"
_LEKNER = "half of dry, Lekner and Dorf 1988, Why some things are darker when wet"


@dataclass(frozen=True, slots=True)
class SurfaceClass:
    """Surfaces of one kind, the reflectance they can have, and the words that name them.

    A phrase of several words fits a name that has all of them, in any order.
    """

    name: str
    low: float
    high: float
    citation: str
    words: tuple[str, ...]

    @property
    def range(self) -> str:
        """The range as a message has it."""
        return f"{self.low:g} to {self.high:g}"


def _class(name: str, low: float, high: float, citation: str, words: str) -> SurfaceClass:
    phrases = tuple(phrase.strip() for phrase in words.split(","))
    return SurfaceClass(name, low, high, citation, phrases)


#: Words of things that are no surface, besides lamps (a street lamp is no street), and of stuffs
#: of any colour: sand is one of cloth.
_THINGS = """
    sign signs signal signpost billboard screen sky skybox cloud clouds fire flame smoke logo decal
    car suv truck bus van vehicle tank post pole schild ampel himmel
    panneau ciel nuage senal cielo nube segnale
    fabric cloth tissue textile leather plastic rubber velvet carpet curtain stoff leder
    kunststoff gummi tissu cuir plastique tela cuero plastico
"""

#: English, German, French, Spanish and Italian words; the first class that fits counts.
CLASSES: tuple[SurfaceClass, ...] = (
    _class(
        "yellow road marking",
        0.15,
        0.60,
        _EN1436,
        "yellow marking, yellow line, yellow roadpaint,"
        " gelbe markierung, ligne jaune, marquage jaune, linea amarilla, linea gialla",
    ),
    _class(
        "white road marking",
        0.25,
        0.80,
        _EN1436 + " (worn 0.30, new paint 0.80)",
        "marking, markings, roadmarking, roadmarkings, lanemarking, roadline, roadlines,"
        " road line, road lines, road paint, lane line, crosswalk, zebra, whiteline,"
        " fahrbahnmarkierung, markierung, zebrastreifen, marquage, passage pieton, paso cebra,"
        " marca vial, segnaletica, strisce",
    ),
    _class(
        "white paint",
        0.50,
        0.90,
        _OKE,
        "white paint, whitewash, weisse farbe, peinture blanche, pintura blanca, vernice bianca",
    ),
    _class(
        "snow", 0.40, 0.98, _OKE + " (old 0.40, fresh 0.95)", "snow, schnee, neige, nieve, neve"
    ),
    _class(
        "wet asphalt",
        0.02,
        0.10,
        _LEKNER,
        "wet asphalt, wet road, wet street, wet tarmac, wetroad,"
        " wetasphalt, nasser asphalt, nasse strasse, route mouillee, asfalto mojado",
    ),
    _class(
        "asphalt",
        0.04,
        0.20,
        _PON + " (new 0.04, old 0.12); " + _OKE + "; " + _IES + " (macadam 0.18)",
        "asphalt, tarmac, road, roads, street, bitumen, macadam, highway, motorway, roadway,"
        " blacktop, carriageway, parking lot, runway, strasse, fahrbahn, autobahn, route,"
        " chaussee, enrobe, bitume, carretera, calzada, asfalto, strada, carreggiata",
    ),
    _class(
        "concrete",
        0.10,
        0.55,
        _PON + " (new 0.55); " + _OKE + "; " + _IES + " (0.40)",
        "concrete, cement, sidewalk, pavement, kerb, curb, beton, zement, gehweg, bordstein,"
        " ciment, trottoir, bordure, hormigon, cemento, acera, bordillo, calcestruzzo,"
        " marciapiede",
    ),
    _class(
        "brick",
        0.15,
        0.50,
        _OKE + "; " + _IES,
        "brick, bricks, ziegel, backstein, klinker,"
        " brique, briques, ladrillo, ladrillos, mattone, mattoni",
    ),
    _class(
        "roof tiles or slate",
        0.07,
        0.35,
        _OKE,
        "roof, rooftile, rooftiles, shingle, shingles,"
        " slate, dach, dachziegel, schiefer, toit, tuile, tuiles, ardoise, tejado, teja, tejas,"
        " pizarra, tetto, tegola",
    ),
    _class("gravel", 0.07, 0.30, _IES, "gravel, ballast, kies, schotter, gravier, grava, ghiaia"),
    _class(
        "stone",
        0.15,
        0.50,
        _OKE + "; " + _IES + " (marble 0.45)",
        "stone, stones, cobble,"
        " cobblestone, rock, granite, marble, limestone, sandstone, stein, pflaster, fels,"
        " granit, marmor, kalkstein, sandstein, pierre, pave, roche, marbre, piedra, adoquin,"
        " roca, granito, marmol, pietra, roccia, marmo",
    ),
    _class(
        "sand",
        0.15,
        0.45,
        _OKE,
        "sand, beach, desert, dune, strand, sable, plage, arena, playa, sabbia, spiaggia",
    ),
    _class(
        "grass",
        0.03,
        0.20,
        _IES + " (dark green 0.06); " + _MCCAMY + " (foliage 0.13)",
        "grass, lawn, meadow, turf, gras, rasen, wiese, herbe, gazon, pelouse, pre, hierba,"
        " cesped, prado, erba, prato",
    ),
    _class(
        "foliage",
        0.03,
        0.25,
        _IES + " (vegetation 0.25); " + _MCCAMY + " (0.13)",
        "foliage, leaf, leaves, tree, trees, bush, bushes, hedge, shrub, ivy, palm, pine, laub,"
        " blatt, blaetter, baum, baeume, busch, hecke, feuille, feuilles, feuillage, arbre,"
        " arbres, haie, hoja, hojas, arbol, arboles, seto, foglia, foglie, albero, alberi, siepe",
    ),
    _class(
        "soil",
        0.04,
        0.40,
        _OKE + "; " + _IES + " (moist 0.07)",
        "soil, dirt, earth, mud,"
        " ground, erde, boden, schlamm, terre, sol, boue, tierra, suelo, barro, terra, fango",
    ),
    _class(
        "water",
        0.0,
        0.10,
        _OKE,
        "water, river, lake, sea, ocean, wasser, fluss, see, meer,"
        " eau, riviere, lac, mer, agua, rio, lago, mar, acqua, fiume, mare",
    ),
    _class(
        "window glass",
        0.0,
        0.30,
        _IES + " (clear 0.07, reflective 0.30)",
        "glass, window, windows, windshield, windscreen, glazing, glas, fenster, scheibe,"
        " windschutzscheibe, verre, vitre, fenetre, vitrage, cristal, vidrio, ventana, vetro,"
        " finestra",
    ),
    _class(
        "car paint",
        0.03,
        0.90,
        _MCCAMY + " (its black and white)",
        "car paint, carpaint, bodywork, autolack, karosserie, carrosserie, carroceria, carrozzeria",
    ),
    _class("white paper", 0.60, 0.90, _MCCAMY + " (its white 0.90)", "paper, papier, papel, carta"),
    _class(
        "skin",
        0.06,
        0.50,
        _MCCAMY + " (dark 0.10, light 0.36)",
        "human skin, skin face,"
        " skin hand, skin hands, skin body, haut gesicht, peau visage, piel cara",
    ),
)


def words(name: str) -> list[str]:
    """The words of a name, lower case and without accents: ``Straße_02-WetRoad`` has three."""
    plain = unicodedata.normalize("NFKD", name.replace("ß", "ss"))
    plain = "".join(c for c in plain if not unicodedata.combining(c))
    # Camel case: a capital after a small letter, or before one after capitals.
    split = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", plain[:400])
    return re.findall(r"[a-z]+", split.lower())


def surface_class(*names: str) -> SurfaceClass | None:
    """The class that the first telling name has: the material's, then its texture's."""
    several, single, things = _vocabulary()
    for name in names:
        found = set(words(name))
        # Several words say more than one: car paint is no car.
        for surface, phrase in several:
            if phrase <= found:
                return surface
        if found & things:
            return None
        ranks = [single[word] for word in found & single.keys()]
        if ranks:
            return CLASSES[min(ranks)]
    return None


@cache
def _vocabulary() -> tuple[list[tuple[SurfaceClass, set[str]]], dict[str, int], set[str]]:
    """Phrases of several words with their classes; the first class of single words; things."""
    phrases = [(rank, p.split()) for rank, c in enumerate(CLASSES) for p in c.words]
    several = [(CLASSES[rank], set(phrase)) for rank, phrase in phrases if len(phrase) > 1]
    single = {phrase[0]: rank for rank, phrase in reversed(phrases) if len(phrase) == 1}
    return several, single, set(_THINGS.split()) | LAMP_WORDS


@dataclass(frozen=True, slots=True)
class Reflectance:
    """Luminous reflectance of a surface: its mean, and what 5 % of it exceed."""

    mean: float
    p95: float


def reflectance(rgb: Array, weights: Array) -> Reflectance | None:
    """Of R per channel, (n, 3), clipped to 0 to 1 as it is written; ``weights``, (n,): area.

    The luminance of R under white light. None where nothing has weight.
    """
    total = float(weights.sum())
    if not total > 0.0:
        return None
    values = np.clip(rgb, 0.0, 1.0) @ np.asarray(LUMINANCE_WEIGHTS)
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    rank = min(int(np.searchsorted(below, 0.95 * below[-1])), len(order) - 1)
    return Reflectance(float(values @ weights) / total, float(values[order[rank]]))


@dataclass(frozen=True, slots=True)
class Doubt:
    """A reflectance that cannot be: where it should lie, and the factor on D that brings it there.

    ``statistic``: which of a reflectance lies outside; ``decades``: log10 of how far out it is.
    """

    code: str
    statistic: Literal["mean", "p95"]
    low: float
    high: float
    factor: float | None  # None: it is 0, which no factor changes
    decades: float
    text: str
    citation: str


def doubt(found: Reflectance, surface: SurfaceClass | None, *, dark: bool = False) -> Doubt | None:
    """What is not plausible about a reflectance, or None.

    The mean is held against the class's range; lines and joints may leave it, so the 95th
    percentile is held against ``BRIGHTEST`` alone. ``dark``: what is clear or mirrors may
    scatter nothing.
    """
    high = BRIGHTEST if surface is None else surface.high
    low = DARKEST if surface is None else surface.low
    shown = f"mean reflectance {found.mean:.3g} (95th percentile {found.p95:.3g})"
    if found.mean > high + _SLACK or (found.mean < low - _SLACK and surface and not dark):
        if surface is not None:
            text = f"{shown}; {surface.name} has {surface.range} ({surface.citation})"
            return _doubt("reflectance-range", low, high, found.mean, text, surface.citation)
        text = f"{shown}; nothing but fresh snow has more than {BRIGHTEST:g} ({_MCCAMY})"
        return _doubt("reflectance-high", low, high, found.mean, text, _MCCAMY)
    if found.p95 > max(high, BRIGHTEST) + _SLACK:
        shown = f"95th percentile of the reflectance {found.p95:.3g} (mean {found.mean:.3g})"
        text = f"{shown}; nothing but fresh snow has more than {BRIGHTEST:g} ({_MCCAMY})"
        limits = low, max(high, BRIGHTEST)
        return _doubt("reflectance-high", *limits, found.p95, text, _MCCAMY, "p95")
    if surface is None and found.mean < DARKEST and not dark:
        text = f"{shown}; black paint has {DARKEST:g} and more ({_OKE})"
        return _doubt("reflectance-low", DARKEST, high, found.mean, text, _OKE)
    return None


def _doubt(
    code: str,
    low: float,
    high: float,
    value: float,
    text: str,
    citation: str,
    statistic: Literal["mean", "p95"] = "mean",
) -> Doubt:
    bound = high if value > high else low
    if value <= 0.0:
        return Doubt(code, statistic, low, high, None, 1.0, text, citation)
    factor = bound / value
    return Doubt(code, statistic, low, high, factor, abs(math.log10(factor)), text, citation)


def inwards(value: float, factor: float) -> float:
    """``value * factor`` to three digits, rounded towards what the factor aims at."""
    wanted = value * factor
    if wanted <= 0.0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(wanted)) - 2)
    count = math.floor(wanted / step) if factor < 1.0 else math.ceil(wanted / step)
    return round(count * step, 12)
