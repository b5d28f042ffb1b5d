"""The sample street: its generator, its two files against one another, its photometry."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO
import pytest
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade

from hdrusd.conversion import Options
from hdrusd.convert import convert
from hdrusd.errors import SourceRef
from hdrusd.photometry.ies import read_ies
from hdrusd.photometry.luminaire import Luminaire
from hdrusd.report import Report
from hdrusd.usd.light import read_light
from hdrusd.usd.lux import photometric_file
from hdrusd.usd.preview import MaterialReader

SCRIPT = Path(__file__).parents[1] / "samples" / "street" / "make_street.py"

pytestmark = pytest.mark.skipif(
    not SCRIPT.exists(), reason="the samples are not beside these tests"
)


def _make(folder: Path) -> Path:
    subprocess.run([sys.executable, str(SCRIPT), str(folder)], check=True, capture_output=True)
    return folder


@pytest.fixture(scope="module")
def street(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _make(tmp_path_factory.mktemp("street"))


# --- a reader of .osgt that is not the product's -------------------------------------------


@dataclass
class Block:
    """A braced block of an .osgt file: its heading's words, its plain lines, its blocks."""

    head: list[str]
    lines: list[str] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)

    def find(self, word: str) -> Block | None:
        return next((b for b in self.blocks if b.head[0] == word), None)

    def value(self, word: str) -> str | None:
        return next(
            (line[len(word) + 1 :] for line in self.lines if line.startswith(word + " ")), None
        )

    def numbers(self, word: str) -> list[float]:
        return [float(part) for part in (self.value(word) or "").split()]

    @property
    def name(self) -> str:
        return (self.value("Name") or "").strip('"')


class Osgt:
    """The tree of an .osgt file, its shared objects resolved."""

    def __init__(self, path: Path) -> None:
        root = Block(["file"])
        stack = [root]
        self.whole: dict[str, Block] = {}
        for raw in path.read_text("ascii").splitlines():
            line = raw.strip()
            if line.endswith("{"):
                block = Block(line[:-1].split())
                stack[-1].blocks.append(block)
                stack.append(block)
            elif line == "}":
                block = stack.pop()
                number = block.value("UniqueID")
                if number is not None and (len(block.lines) > 1 or block.blocks):
                    assert number not in self.whole, f"UniqueID {number} is written twice"
                    self.whole[number] = block
            elif line and not line.startswith("#"):
                stack[-1].lines.append(line)
        assert len(stack) == 1, "unbalanced braces"
        self.root = root.blocks[0]

    def resolve(self, block: Block) -> Block:
        number = block.value("UniqueID")
        return block if number is None else self.whole[number]

    def drawn(self) -> Iterator[Block]:
        """Each node that is drawn close by: the finest of a LOD, what a Switch has on."""
        stack = [self.root]
        while stack:
            node = self.resolve(stack.pop())
            yield node
            children = node.find("Children")
            below = children.blocks if children else []
            if node.head[0] == "osg::LOD":
                below = below[:1]
            elif node.head[0] == "osg::Switch":
                values = node.find("ValueList")
                assert values is not None
                on = values.lines[0].split()
                below = [b for b, v in zip(below, on, strict=True) if v == "TRUE"]
            stack.extend(reversed(below))

    def geometries(self) -> Iterator[Block]:
        for node in self.drawn():
            drawables = node.find("Drawables")
            yield from (self.resolve(b) for b in (drawables.blocks if drawables else []))

    def material(self, geometry: Block) -> str:
        state = geometry.find("StateSet")
        assert state is not None
        attributes = self.resolve(state.blocks[0]).find("AttributeList")
        assert attributes is not None
        return self.resolve(attributes.blocks[0]).name


def _triangles(geometry: Block) -> int:
    sets = geometry.find("PrimitiveSetList")
    assert sets is not None
    total = 0
    for primitive in sets.blocks:
        count = int(primitive.blocks[0].head[1])
        total += count // 4 * 2 if primitive.value("Mode") == "QUADS" else count // 3
    return total


def _osgt_positions(geometry: Block) -> bytes:
    array = geometry.find("VertexArray")
    assert array is not None
    return np.array(" ".join(array.blocks[0].blocks[0].lines).split(), dtype="<f4").tobytes()


# --- and of glTF ---------------------------------------------------------------------------


class Gltf:
    """A glTF document with its buffer."""

    def __init__(self, path: Path) -> None:
        self.document: dict[str, Any] = json.loads(path.read_text("utf-8"))
        self.buffer = path.with_suffix(".bin").read_bytes()

    def nodes(self) -> Iterator[dict[str, Any]]:
        nodes = self.document["nodes"]
        stack = list(self.document["scenes"][0]["nodes"])
        while stack:
            node = nodes[stack.pop()]
            yield node
            stack.extend(reversed(node.get("children", [])))

    def primitives(self) -> Iterator[dict[str, Any]]:
        for node in self.nodes():
            if "mesh" in node:
                yield from self.document["meshes"][node["mesh"]]["primitives"]

    def array(self, accessor: int) -> np.ndarray:
        entry = self.document["accessors"][accessor]
        view = self.document["bufferViews"][entry["bufferView"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[entry["type"]]
        dtype = {5123: "<u2", 5125: "<u4", 5126: "<f4"}[entry["componentType"]]
        values = np.frombuffer(self.buffer, dtype, entry["count"] * width, view["byteOffset"])
        return values.reshape(-1, width)

    def material(self, primitive: dict[str, Any]) -> str:
        name: str = self.document["materials"][primitive["material"]]["name"]
        return name

    def area_seen(self, material: str, direction: tuple[float, float, float]) -> float:
        """m2 of the first primitive of ``material`` as projected along ``direction``."""
        primitive = next(p for p in self.primitives() if self.material(p) == material)
        points = self.array(primitive["attributes"]["POSITION"]).astype(float)
        corners = points[self.array(primitive["indices"]).reshape(-1, 3)]
        edges = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return float(np.clip(edges @ np.array(direction), 0.0, None).sum() / 2.0)


@pytest.fixture(scope="module")
def osgt(street: Path) -> Osgt:
    return Osgt(street / "street.osgt")


@pytest.fixture(scope="module")
def gltf(street: Path) -> Gltf:
    return Gltf(street / "street.gltf")


@pytest.fixture(scope="module")
def photometry(street: Path) -> dict[str, Any]:
    return tomllib.loads((street / "photometry.toml").read_text("utf-8"))


def _entry(photometry: dict[str, Any], section: str, name: str) -> dict[str, Any]:
    found: dict[str, Any] = next(e for e in photometry[section] if fnmatchcase(name, e["match"]))
    return found


def test_generator_writes_the_same_bytes_each_time(street: Path, tmp_path: Path) -> None:
    again = _make(tmp_path / "again")
    files = sorted(p.relative_to(street) for p in street.rglob("*") if p.is_file())
    assert files == sorted(p.relative_to(again) for p in again.rglob("*") if p.is_file())
    for file in files:
        assert (street / file).read_bytes() == (again / file).read_bytes(), file


def test_twins_draw_the_same_triangles(osgt: Osgt, gltf: Gltf) -> None:
    in_osgt = sum(_triangles(g) for g in osgt.geometries())
    in_gltf = sum(len(gltf.array(p["indices"])) // 3 for p in gltf.primitives())
    assert in_osgt == in_gltf
    assert in_osgt > 20_000


def test_twins_have_the_same_vertices_in_the_same_materials(osgt: Osgt, gltf: Gltf) -> None:
    in_osgt = Counter((osgt.material(g), _osgt_positions(g)) for g in osgt.geometries())
    in_gltf = Counter(
        (gltf.material(p), gltf.array(p["attributes"]["POSITION"]).tobytes())
        for p in gltf.primitives()
    )
    assert in_osgt == in_gltf


def test_twins_have_the_same_lights(osgt: Osgt, gltf: Gltf) -> None:
    in_osgt = Counter(n.name for n in osgt.drawn() if n.head[0] == "osg::LightSource")
    in_gltf = Counter(
        n["name"] for n in gltf.nodes() if "KHR_lights_punctual" in n.get("extensions", {})
    )
    assert in_osgt == in_gltf
    assert sum(name.startswith("Luminaire_") for name in in_osgt) >= 16
    assert sum("_Headlamp" in name for name in in_osgt) == 6  # ahead, oncoming, own


def test_twins_move_alike(osgt: Osgt, gltf: Gltf) -> None:
    in_osgt = {}
    for node in osgt.drawn():
        callback = node.find("UpdateCallback")
        if callback is not None:
            path = callback.blocks[0].blocks[0].blocks[0].blocks[0]
            in_osgt[node.name] = [
                (float(key.head[1]), *key.numbers("Position")) for key in path.blocks
            ]
    (animation,) = gltf.document["animations"]
    in_gltf = {}
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        keys = np.hstack((gltf.array(sampler["input"]), gltf.array(sampler["output"])))
        in_gltf[gltf.document["nodes"][channel["target"]["node"]]["name"]] = keys
    assert set(in_osgt) == set(in_gltf) == {"CarAhead", "CarOncoming", "OwnCar", "Driver"}
    for name, keys in in_osgt.items():
        assert np.array_equal(np.array(keys, dtype="f4"), in_gltf[name]), name
        assert keys[-1][0] >= 2.0


def test_osgt_exercises_shared_and_special_nodes(osgt: Osgt) -> None:
    seen = Counter(node.value("UniqueID") for node in osgt.drawn())
    assert max(seen.values()) >= 16, "the luminaire is one subtree below sixteen places"
    classes = {node.head[0] for node in osgt.drawn()}
    assert classes >= {
        "osg::LOD",
        "osg::Switch",
        "osg::PositionAttitudeTransform",
        "osg::MatrixTransform",
        "osg::LightSource",
    }


def test_textures_are_there_small_and_8_bit(street: Path, osgt: Osgt, gltf: Gltf) -> None:
    named = {image["uri"] for image in gltf.document["images"]}
    text = (street / "street.osgt").read_text("ascii")
    assert named == set(re.findall(r'FileName "([^"]+)"', text))
    assert len(named) >= 8
    for uri in named:
        spec = OpenImageIO.ImageBuf(str(street / uri)).spec()
        assert spec.format == OpenImageIO.UINT8, uri
        assert max(spec.width, spec.height) <= 512, uri
    assert sum((street / uri).stat().st_size for uri in named) < 2_000_000


def test_every_pattern_of_the_photometry_matches_in_both_files(
    photometry: dict[str, Any], osgt: Osgt, gltf: Gltf
) -> None:
    osgt_nodes = {n.name for n in osgt.drawn()}
    gltf_nodes = {n["name"] for n in gltf.nodes()}
    lights = {n.name for n in osgt.drawn() if n.head[0] == "osg::LightSource"}
    materials = {osgt.material(g) for g in osgt.geometries()}
    gltf_materials = {m["name"] for m in gltf.document["materials"]}
    names = {
        "light": (lights, gltf_nodes),
        "material": (materials, gltf_materials),
        "camera": (osgt_nodes, gltf_nodes),
    }
    for section, both in names.items():
        for entry in photometry[section]:
            for there in both:
                assert any(fnmatchcase(n, entry["match"]) for n in there), entry["match"]


def test_every_light_and_every_glowing_material_has_an_entry(
    photometry: dict[str, Any], osgt: Osgt, gltf: Gltf
) -> None:
    for node in osgt.drawn():
        if node.head[0] == "osg::LightSource":
            entry = _entry(photometry, "light", node.name)
            assert entry.keys() & {"candela", "illuminance", "ies"}
            assert entry["source"]
    glowing = [m["name"] for m in gltf.document["materials"] if "emissiveFactor" in m]
    assert glowing
    for name in glowing:
        entry = _entry(photometry, "material", name)
        assert entry["luminance"] > 0
        assert entry["source"]


def _luminaire(street: Path, entry: dict[str, Any]) -> tuple[Luminaire, float]:
    """The photometric file of an entry, and the factor on its candela."""
    file = street / entry["ies"]
    lamp = read_ies(file.read_bytes(), SourceRef(file), Report())
    return lamp, entry["lumens"] / lamp.flux()


def test_a_lantern_is_as_bright_as_its_lamp(photometry: dict[str, Any], gltf: Gltf) -> None:
    """I = L A: a uniform glass sends its luminance times the area seen."""
    candela = _entry(photometry, "light", "ArcadeLantern_01_Lamp")["candela"]
    luminance = _entry(photometry, "material", "LanternGlass")["luminance"]
    # 1 %: areas and luminances are written to three digits.
    assert luminance * gltf.area_seen("LanternGlass", (0.0, -1.0, 0.0)) == pytest.approx(
        candela, rel=0.01
    )


def test_a_luminaire_is_as_bright_as_its_file_from_below(
    street: Path, photometry: dict[str, Any], gltf: Gltf
) -> None:
    lamp, factor = _luminaire(street, _entry(photometry, "light", "Luminaire_01_Lamp"))
    luminance = _entry(photometry, "material", "LampGlass")["luminance"]
    area = gltf.area_seen("LampGlass", (0.0, 0.0, -1.0))
    assert luminance * area == pytest.approx(factor * lamp.value(0.0, 0.0), rel=0.01)


@pytest.mark.parametrize(
    ("glass", "direction", "lamps", "least", "most"),
    [
        ("TailLampLit", (0.0, -1.0, 0.0), 2, 4.0, 17.0),  # UN R148, rear position lamp
        ("SignalGreenLit", (0.0, -1.0, 0.0), 1, 200.0, 800.0),  # EN 12368, level 2
    ],
)
def test_signal_lamps_keep_to_their_regulations(
    photometry: dict[str, Any],
    gltf: Gltf,
    glass: str,
    direction: tuple[float, float, float],
    lamps: int,
    least: float,
    most: float,
) -> None:
    luminance = _entry(photometry, "material", glass)["luminance"]
    # 2 %: the signal's luminance is written to two digits, 198.99 cd for 200.
    candela = luminance * gltf.area_seen(glass, direction) / lamps
    assert least * 0.98 <= candela <= most


def test_road_gets_the_25_lux_of_the_city_it_is_like(
    street: Path, photometry: dict[str, Any], osgt: Osgt
) -> None:
    """Mean over one field between luminaires: E = I(C, gamma) h / d^3 from each of them."""
    entry = _entry(photometry, "light", "Luminaire_01_Lamp")
    lamp, factor = _luminaire(street, entry)
    light = next(n for n in osgt.drawn() if n.name == "Luminaire_01_Lamp").find("Light")
    assert light is not None
    reach, _, height, _ = light.blocks[0].numbers("Position")
    x, y = np.meshgrid(np.arange(-5.25, 5.5, 0.5), np.arange(65.25, 85.0, 0.5))
    lux = np.zeros_like(x)
    for node in osgt.drawn():
        if re.fullmatch(r"Luminaire_\d+", node.name):
            matrix = node.find("Matrix")
            assert matrix is not None
            m = np.array([row.split() for row in matrix.lines], dtype=float)
            place = np.array((reach, 0.0, height, 1.0)) @ m
            c0 = np.array((*entry["c0"], 0.0)) @ m
            c90 = np.cross((0.0, 0.0, 1.0), c0[:3])
            way = np.stack((x - place[0], y - place[1], np.full_like(x, -place[2])), axis=2)
            distance = np.linalg.norm(way, axis=2)
            c = np.degrees(np.arctan2(way @ c90, way @ c0[:3]))
            gamma = np.degrees(np.arccos(place[2] / distance))
            lux += factor * lamp.value(c, gamma) * place[2] / distance**3
    assert lux.mean() == pytest.approx(25.0, rel=0.1)  # a class of EN 13201 is 25 to 50 % apart
    assert lux.min() / lux.mean() > 0.4  # EN 13201-2: overall uniformity of classes C
    # Before the lamp, not behind it: C = 90 is to the road.
    assert lamp.value(90.0, 45.0) > 2.0 * lamp.value(270.0, 45.0)


def test_the_twins_become_the_same_light_and_the_same_gloss(street: Path, tmp_path: Path) -> None:
    """Luminaires and wet surfaces are the photometry file's, whatever the format."""
    made = {}
    for file in ("street.osgt", "street.gltf"):
        stage = Usd.Stage.Open(
            str(convert(street / file, tmp_path / file[7:] / "a.usda", Options()).output)
        )
        rows, gloss = {}, {}
        for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
            name = prim.GetName()
            if prim.IsA(UsdLux.SphereLight) and photometric_file(prim):
                name = prim.GetParent().GetName()
                world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)
                if UsdGeom.GetStageUpAxis(stage) == "Y":
                    world *= Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(1, 0, 0), 90.0))
                lamp = read_light(prim)
                rows[name] = (*np.ravel(world), lamp.intensity, lamp.radius, *lamp.chromaticity)
                gloss[name] = Path(lamp.profile).name
            elif prim.IsA(UsdShade.Material) and name in ("Asphalt", "Puddle", "Pavement"):
                wet = MaterialReader(stage, Report()).read(UsdShade.Material(prim), 0)
                assert wet is not None
                gloss[name] = wet.model
                rows[name] = (*wet.specular, wet.roughness)
        made[file] = rows, gloss
    (rows, gloss), (others, same) = made.values()
    assert gloss == same
    assert sum(name.startswith("Luminaire") for name in rows) == 16
    for name, values in rows.items():
        assert values == pytest.approx(others[name], rel=1e-5, abs=1e-5), name
