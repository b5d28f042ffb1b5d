"""What a legacy database says, in its own numbers: ``inspect`` as data, ``lines`` as text.

Nothing is interpreted: colours have no unit, angles are degrees, lengths are source units.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from hdrusd.columns import columns, cut, padded
from hdrusd.errors import SourceRef, one_line
from hdrusd.legacy.pictures import picture_names
from hdrusd.legacy.scene import MAPS, Image, LegacyScene, Material, Mesh, Node
from hdrusd.report import Report

#: Rows of a table on the terminal; the data have all.
_ROWS = 30

#: Characters of a name in a table.
_NAME = 36

#: Units that a format may state of a light, and how they are written.
_UNITS = (("candela", "cd"), ("lux", "lx"))

_Row = dict[str, Any]


def inspect(scene: LegacyScene, report: Report) -> _Row:
    """The scene as JSON: arrays by their sizes, everything else whole."""
    nodes = list(_tree(scene))
    homes: dict[tuple[str, int], list[str]] = {}
    for row in nodes:
        for kind in ("lights", "cameras", "meshes"):
            for index in row[kind]:
                homes.setdefault((kind, index), []).append(row["name"])
    maps = (material.maps().values() for material in scene.materials)
    names = picture_names(texture.image for textures in maps for texture in textures)
    meshes = [_mesh(mesh) for mesh in scene.meshes]
    lights = [_plain(light) for light in scene.lights]
    cameras = [_plain(camera) for camera in scene.cameras]
    for kind, rows in (("meshes", meshes), ("lights", lights), ("cameras", cameras)):
        for index, row in enumerate(rows):
            row["nodes"] = homes.get((kind, index), [])
    return {
        "format": "hdrusd-inspect/1",
        "source": str(scene.source),
        "reader": scene.format,
        "generator": scene.generator,
        "unit_m": scene.unit_m,
        "up": scene.up,
        "ambient": _plain(scene.ambient),
        "counts": scene.counts(),
        "lights": lights,
        "materials": [_material(material, names) for material in scene.materials],
        "textures": _images(scene.materials, names),
        "cameras": cameras,
        "meshes": meshes,
        "nodes": nodes,
        "findings": report.as_dict()["findings"],
    }


def _plain(value: Any) -> Any:
    """Records as objects, arrays as their shape, places as text."""
    if isinstance(value, SourceRef):
        return str(value)
    if isinstance(value, np.ndarray):
        return f"{' x '.join(map(str, value.shape))} {value.dtype}"
    if isinstance(value, bytes):
        return f"{len(value)} bytes"
    if is_dataclass(value):
        return {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, frozenset):
        return sorted(value)
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    return value if isinstance(value, (str, int, float, bool, type(None))) else str(value)


def _material(material: Material, names: Mapping[Hashable, str]) -> _Row:
    row: _Row = _plain(material)
    for name, texture in material.maps().items():
        row[name]["image"] = names[texture.image.key()]
    return row


def _mesh(mesh: Mesh) -> _Row:
    return {
        "name": mesh.name,
        "source": str(mesh.source),
        "points": len(mesh.points),
        "faces": len(mesh.face_counts),
        "triangles": int((mesh.face_counts - 2).sum()),
        "normals": mesh.normals is not None,
        "colors": mesh.colors is not None,
        "uvs": list(mesh.uvs),
        "skinned": mesh.joint_indices is not None,
        "material": mesh.material,
        "subsets": [{"material": s.material, "faces": len(s.faces)} for s in mesh.subsets],
    }


def _state(image: Image) -> str:
    if image.missing:
        return "missing"
    return "file" if image.path is not None else "inside the database"


def _images(materials: Iterable[Material], names: Mapping[Hashable, str]) -> list[_Row]:
    """Each image once, with its uses."""
    rows: dict[Hashable, _Row] = {}
    for material in materials:
        for name, texture in material.maps().items():
            image, key = texture.image, texture.image.key()
            file = None if image.path is None else str(image.path)
            row: _Row = {"name": names[key], "state": _state(image), "file": file, "uses": []}
            row = rows.setdefault(key, row)
            row["uses"].append(f"{material.name}:{name.removesuffix('_map')}")
    return list(rows.values())


def _tree(scene: LegacyScene) -> Iterator[_Row]:
    """The nodes, parents first; what hangs in several places is opened at the first of them."""
    seen: set[int] = set()
    stack = [(node, 0) for node in reversed(scene.roots)]
    while stack:
        node, depth = stack.pop()
        again = id(node) in seen
        seen.add(id(node))
        yield _node(node, depth, again)
        if not again:
            stack.extend((child, depth + 1) for child in reversed(node.children))


def _node(node: Node, depth: int, again: bool) -> _Row:
    row: _Row = {
        "name": node.name,
        "depth": depth,
        "source": str(node.source),
        "kind": node.kind,
        "visible": node.visible,
        "seen_before": again,
        "children": len(node.children),
        "meshes": list(node.meshes),
        "lights": list(node.lights),
        "cameras": list(node.cameras),
        "animated": [channel.path for channel in node.animation],
        "skin": node.skin,
        "extras": _plain(node.extras),
    }
    if node.kind == "lod":
        row["lod_ranges"] = _plain(node.lod_ranges)
    if node.kind == "switch":
        row["switch_on"] = list(node.switch_on)
    return row


# -- text ----------------------------------------------------------------------------------


def lines(document: _Row) -> Iterator[str]:
    """What ``inspect`` found, for a terminal; long tables end with what they leave out."""
    generator = f", {document['generator']}" if document["generator"] else ""
    yield one_line(f"{document['source']}: {document['reader']}{generator}")
    yield f"unit {document['unit_m']:g} m, {document['up']} up"
    yield ", ".join(f"{count} {name}" for name, count in document["counts"].items())
    if document["ambient"] is not None:
        yield f"light model ambient {_color(document['ambient'])}"
    lights = document["lights"]
    yield from _table("lights", ("kind", "colour", "value", "falloff"), map(_light, lights))
    titles = ("diffuse", "specular", "emission", "textures")
    yield from _table("materials", titles, map(_surface, document["materials"]))
    textures = ((t["name"], t["state"], f"{len(t['uses'])} uses") for t in document["textures"])
    yield from _table("textures", ("where", "uses"), textures)
    cameras = ((c["name"], c["kind"], f"{c['fov_y']:g} degrees") for c in document["cameras"])
    yield from _table("cameras", ("kind", "angle"), cameras)
    yield from _table("nodes", ("kind", "holds"), map(_branch, document["nodes"]))


def _light(row: _Row) -> Sequence[str]:
    stated = [f"{row[unit]:g} {short}" for unit, short in _UNITS if row[unit] is not None]
    count = row["positions"]
    value = stated[0] if stated else "no unit"
    falloff = []
    if row["attenuation"] is not None:
        falloff.append(f"1/({', '.join(f'{k:g}' for k in row['attenuation'])})")
    if row["range"] is not None:
        falloff.append(f"range {row['range']:g}")
    if row["spot_cutoff"] < 180.0:
        falloff.append(f"cone {row['spot_cutoff']:g}")
    if row["spot_exponent"] > 0.0:
        falloff.append(f"exponent {row['spot_exponent']:g}")
    kind = row["kind"] if row["enabled"] else f"{row['kind']}, off"
    if count is not None:
        kind = f"{count.partition(' x ')[0]} {kind}"
    return row["name"], kind, _color(row["diffuse"]), value, ", ".join(falloff)


def _surface(row: _Row) -> Sequence[str]:
    maps = [row[name]["image"] for name in MAPS if row[name] is not None]
    emission = _color(row["emission"]) + (" cd/m2" if row["emission_cd_m2"] else "")
    gloss = f" ^{row['shininess']:g}" if row["shininess"] else ""
    specular = _color(row["specular"]) + gloss
    return row["name"], _color(row["diffuse"]), specular, emission, ", ".join(dict.fromkeys(maps))


def _branch(row: _Row) -> Sequence[str]:
    holds = [f"{kind} {len(row[kind])}" for kind in ("meshes", "lights", "cameras") if row[kind]]
    if row["seen_before"]:
        holds.append("as above")
    if row["animated"]:
        holds.append("moves")
    if not row["visible"]:
        holds.append("hidden")
    for key in ("lod_ranges", "switch_on"):
        if key in row:
            holds.append(f"{key.replace('_', ' ')} {row[key]}")
    kind = "" if row["kind"] == "group" else row["kind"]
    return "  " * row["depth"] + (row["name"] or "(no name)"), kind, ", ".join(holds)


def _color(rgb: Sequence[float]) -> str:
    if len(set(rgb)) == 1:
        return f"{rgb[0]:.4g}"
    return " ".join(f"{c:.3g}" for c in rgb)


def _table(title: str, more: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """A heading and aligned columns; nothing where there are no rows."""
    cells = [[cut(one_line(cell), _NAME) for cell in row] for row in rows]
    if not cells:
        return
    titles = (title, *more)
    shown = cells[:_ROWS]
    widths = [max(map(columns, column)) for column in zip(titles, *shown, strict=True)]

    def aligned(row: Sequence[str]) -> str:
        pairs = zip(row, widths, strict=True)
        return "  ".join(padded(cell, width) for cell, width in pairs).rstrip()

    yield ""
    yield aligned(titles)
    yield from map(aligned, shown)
    if len(cells) > len(shown):
        yield f"... and {len(cells) - len(shown)} more {title}; --json has them all"
