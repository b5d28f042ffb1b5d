"""Small legacy scenes, source files and pictures in code, each with a name."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd, UsdGeom

import hdrusd.usd  # noqa: F401 (registers the schemas before the first stage)
from hdrusd.errors import SourceRef
from hdrusd.images import write_png
from hdrusd.legacy.scene import Image, LegacyScene, Light, Material, Mesh, Node, Texture
from hdrusd.scene import light_rows
from hdrusd.usd.specs import define

#: Where everything made here says that it comes from.
HERE = SourceRef(Path("street.osgt"), 7)

#: Four texels whose codes are facts to check against: black, half, white, and a red.
CODES = np.array([[[0, 0, 0], [128, 128, 128]], [[255, 255, 255], [200, 50, 0]]], np.uint8)


def lamp(**changes: Any) -> Light:
    """A white point light of OpenGL's defaults."""
    return Light(**{"name": "lamp_07", "source": HERE, "kind": "point"} | changes)


def paint(**changes: Any) -> Material:
    """A grey material without texture, highlight or emission."""
    return Material(**{"name": "paint", "source": HERE, "diffuse": (0.5, 0.5, 0.5)} | changes)


def picture(pixels: npt.NDArray[np.uint8] = CODES, name: str = "wall.png") -> Image:
    """An image that lies in the source file itself."""
    return Image(name, HERE, pixels=pixels)


def texture(pixels: npt.NDArray[np.uint8] = CODES, **changes: Any) -> Texture:
    """A texture of ``pixels``."""
    return Texture(picture(pixels), **changes)


def square(**changes: Any) -> Mesh:
    """A unit square in the plane z = 0 that faces +Z, one polygon, with texture coordinates."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    values: dict[str, Any] = {
        "name": "square",
        "source": HERE,
        "points": corners,
        "face_counts": np.array([4], np.int32),
        "face_indices": np.arange(4, dtype=np.int32),
        "uvs": {"st": (np.ascontiguousarray(corners[:, :2]), "vertex")},
        "material": 0,
    }
    return Mesh(**values | changes)


def node(name: str = "node", **changes: Any) -> Node:
    """A node without contents."""
    return Node(name, HERE, **changes)


def one_square(**parts: Any) -> LegacyScene:
    """A square in grey paint at one node; ``parts`` replace what is there."""
    values: dict[str, Any] = {
        "source": Path("street.osgt"),
        "format": "osg",
        "roots": [node("Wall", meshes=[0])],
        "meshes": [square()],
        "materials": [paint()],
    }
    return LegacyScene(**values | parts)


def light_row(intensity: float | tuple[float, float, float] = 1.0, **changes: Any) -> Any:
    """A (1,) array of ``scene.LIGHT``: at the origin, 5 cm, no cone, shining along -Z."""
    row = light_rows(1)
    row["radius"], row["intensity"] = 0.05, intensity
    for name, value in changes.items():
        row[name] = value
    return row


# A prim does not keep its stage alive.
_STAGES: deque[Usd.Stage] = deque(maxlen=4)


def new_stage(unit: float = 1.0, up: str = "Y") -> Usd.Stage:
    """An empty stage in memory, one of the last four that are kept."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    UsdGeom.SetStageUpAxis(stage, up)
    _STAGES.append(stage)
    return stage


def new_spec(stage: Usd.Stage, path: str, kind: str) -> Sdf.PrimSpec:
    """A prim of a type that says nothing yet, in the stage's root layer."""
    return define(stage.GetRootLayer(), Sdf.Path(path), kind)


# -- source files -------------------------------------------------------------------------


def png(path: Path, pixels: npt.NDArray[np.uint8] = CODES) -> Path:
    """Write a PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_png(path, pixels)
    return path


def obj(path: Path, mtl: str, *, uvs: bool = True) -> Path:
    """A square in material ``paint``; ``mtl`` holds the statements below ``newmtl paint``."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.with_suffix(".mtl").write_text(f"newmtl paint\n{mtl}\n")
    corners = " ".join(f"{i}/{i}" if uvs else f"{i}" for i in range(1, 5))
    path.write_text(
        f"mtllib {path.stem}.mtl\no Wall\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
        f"vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl paint\nf {corners}\n"
    )
    return path


def gltf_lights(
    path: Path, lights: list[dict[str, Any]], nodes: list[dict[str, Any]] | None = None, **more: Any
) -> Path:
    """Lights of KHR_lights_punctual, a node each unless ``nodes`` says otherwise; no mesh."""
    name = "KHR_lights_punctual"
    if nodes is None:
        nodes = [
            {"name": light.get("name", f"light{i}"), "extensions": {name: {"light": i}}}
            for i, light in enumerate(lights)
        ]
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [name],
        "extensions": {name: {"lights": lights}},
        "nodes": nodes,
        "scenes": [{"nodes": _roots(nodes)}],
        "scene": 0,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(document | more))
    return path


def _roots(nodes: list[dict[str, Any]]) -> list[int]:
    children = {child for each in nodes for child in each.get("children", [])}
    return [index for index in range(len(nodes)) if index not in children]


def osgt_light(
    path: Path, light: Mapping[str, str] = {}, *, name: str = "lamp", above: str = ""
) -> Path:
    """One osg::LightSource below a group; ``light`` has .osgt fields; ``above``: of the group."""
    fields = {
        "LightNum": "0",
        "Ambient": "0 0 0 1",
        "Diffuse": "1 1 1 1",
        "Specular": "1 1 1 1",
        "Position": "0 0 0 1",
        "Direction": "0 0 -1",
        "ConstantAttenuation": "1",
        "LinearAttenuation": "0",
        "QuadraticAttenuation": "0",
        "SpotExponent": "0",
        "SpotCutoff": "180",
    } | dict(light)
    inside = "\n".join(f"{key} {value}" for key, value in fields.items())
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        "#Ascii Scene\n#Version 161\n#Generator OpenSceneGraph 3.6.5\n\n"
        f'osg::Group {{\n UniqueID 1\n Name "{name}"\n{above}\n Children 1 {{\n'
        f'  osg::LightSource {{\n   UniqueID 2\n   Name "{name}"\n   Light TRUE {{\n'
        f"    osg::Light {{\n     UniqueID 3\n{inside}\n    }}\n   }}\n  }}\n }}\n}}\n"
    )
    return path
