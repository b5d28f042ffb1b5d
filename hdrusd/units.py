"""Named constants and conversions; inside hdrusd everything is SI.

Metres, seconds, candela (cd), lux (lx), cd/m2 (nit), radians in the science and
degrees only where a name says so. Conversions happen once, at the edge.
"""

from __future__ import annotations

import math

#: Relative luminance of linear Rec. 709 / D65 primaries (ITU-R BT.709-6, item 3.2).
LUMINANCE_WEIGHTS = (0.2126, 0.7152, 0.0722)

#: Gamma by which an 8-bit texture is read as reflectance, R = T^gamma * D
#: (Petit and Bremond 2010, section 3).
TEXTURE_GAMMA = 2.2


def sphere_luminance(candela: float, radius: float) -> float:
    """Luminance (cd/m2) of a uniform sphere of ``radius`` m that sends ``candela`` every way.

    I = L pi r^2, the projected area of a sphere being pi r^2.
    """
    return candela / (math.pi * radius * radius)


def sphere_intensity(luminance: float, radius: float) -> float:
    """Candela of a uniform sphere of ``luminance`` cd/m2 and ``radius`` m; undoes the above."""
    return luminance * math.pi * radius * radius


def distant_luminance(illuminance: float, angle: float) -> float:
    """Luminance (cd/m2) of a distant disc of full ``angle`` degrees that gives ``illuminance`` lx.

    E = L pi sin^2(angle/2) on a plane that faces it. A disc of no size has no
    luminance: the lux figure itself is returned, as UsdLux defines it.
    """
    if angle <= 0.0:
        return illuminance
    return illuminance / (math.pi * math.sin(math.radians(angle) / 2.0) ** 2)


def distant_illuminance(luminance: float, angle: float) -> float:
    """Lux from a distant disc of ``luminance`` cd/m2 and full ``angle`` degrees."""
    if angle <= 0.0:
        return luminance
    return luminance * math.pi * math.sin(math.radians(angle) / 2.0) ** 2


def dome_luminance(illuminance: float) -> float:
    """Luminance (cd/m2) of a uniform sky that gives ``illuminance`` lx unobstructed: E / pi."""
    return illuminance / math.pi


def dome_illuminance(luminance: float) -> float:
    """Lux under a uniform, unobstructed sky of ``luminance`` cd/m2: pi L."""
    return luminance * math.pi
