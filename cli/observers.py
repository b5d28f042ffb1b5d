"""``hdrusd observers``."""

from __future__ import annotations

import click

#: Key, unit and meaning of what an observer is made of.
KEYS = {
    "age": ("years", "scattered light and pupils change with it"),
    "pigment": ("", "of the iris: 0 very dark, 0.5 brown, 1 green to blue-green, 1.2 light blue"),
    "pupil": ("", "moon-spencer, or watson-yellott with age and field"),
    "slow": ("s", "time constant of the slow neural adaptation"),
    "rod_bleach": ("", "alpern: 1.2 log units per 10 %; photon: what the lost photons make"),
}


@click.command("observers")
@click.argument("observer", required=False)
def command(observer: str | None) -> None:
    """List the observers, or say what OBSERVER is: NAME or FILE.toml, then KEY=VALUE, by commas.

    As in: hdrusd observers elderly,pigment=1.2
    """
    from hdrusd.eye.observer import Observer

    from .options import list_profiles, tell_keys

    if observer is None:
        list_profiles(Observer.profiles())
    else:
        tell_keys(Observer.parse(observer), KEYS)
