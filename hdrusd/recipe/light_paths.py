"""Where lights will stand on the stage, for patterns that begin with "/"."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from hdrusd.legacy.scene import LegacyScene
from hdrusd.recipe.places import Place
from hdrusd.report import Report
from hdrusd.usd.tree import PROTOTYPES
from hdrusd.usd.writer import StageWriter


def light_paths(scene: LegacyScene, lit: Sequence[tuple[Place, int]]) -> list[str]:
    """The path of each light at a place, as a conversion has it but for its root's name.

    ``lit``: every place and light, in order. "" for a node that is written neither once nor in
    each of its places, and for ambient lights, which have none.
    """
    with TemporaryDirectory() as folder:
        units = {"meters_per_unit": 1.0, "source_unit": scene.unit_m, "up": scene.up}
        writer = StageWriter(Path(folder), "stage", scene, Report(), **units)  # type: ignore[arg-type]
        writer.write_geometry()
        written: dict[tuple[int, int], list[str]] = {}
        for place in writer.places:
            for index in place.node.lights:
                light = scene.lights[index]
                path = "" if light.kind == "ambient" else str(writer.light_path(place, light))
                written.setdefault((id(place.node), index), []).append(path)
    keys = [(id(place.node), index) for place, index in lit]
    stands, met = Counter(keys), Counter[tuple[int, int]]()
    found = []
    for key in keys:
        paths = written.get(key, [])
        if len(paths) == 1:
            found.append(paths[0])
        else:
            found.append(paths[met[key]] if len(paths) == stands[key] else "")
        met[key] += 1
    return found


def without_root(path: str) -> tuple[str, str]:
    """A pattern for the part of a path that the output's name decides, and the rest.

    Prototypes stand below a root that has always the same name.
    """
    if not path or path.startswith(f"{PROTOTYPES}/"):
        return "", path
    return "/*", path[path.index("/", 1) :]
