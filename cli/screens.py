"""``hdrusd screens``."""

from __future__ import annotations

import click

#: Key, unit and meaning of what a screen is made of.
KEYS = {
    "peak": ("cd/m2", "what the panel emits at white"),
    "black": ("cd/m2", "what the panel emits at black"),
    "ambient": ("lx", "what falls on it in its room"),
    "reflectance": ("", "share of that which it scatters back"),
    "eotf": ("", "from code values to light: srgb, gamma22, bt1886, pq"),
    "field": ("degrees", "width of the picture as seen; none: as wide as the camera saw the scene"),
}


@click.command("screens")
@click.argument("screen", required=False)
def command(screen: str | None) -> None:
    """List the screens, or say what SCREEN is: NAME or FILE.toml, then KEY=VALUE, by commas.

    As in: hdrusd screens hdr,peak=600
    """
    from hdrusd.eye.screen import Screen

    from .options import list_profiles, tell_keys

    if screen is None:
        list_profiles(Screen.profiles())
        return
    chosen = Screen.parse(screen)
    tell_keys(chosen, KEYS)
    seen = f"{chosen.black_level:g} to {chosen.white_level:g}"
    click.echo(f"seen: {seen} cd/m2, reflections included")
