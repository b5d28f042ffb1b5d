"""Words of names that mean a lamp: one table for whoever looks for lamps or for what is none."""

from __future__ import annotations

#: English, German, French, Spanish and Italian, lower case and without accents.
_WORDS = """
    lamp lamps light lights bulb lantern led neon headlamp headlight taillight
    lampe leuchte laterne licht feu lampadaire farola lampara luz lampada
"""
LAMP_WORDS = frozenset(_WORDS.split())
