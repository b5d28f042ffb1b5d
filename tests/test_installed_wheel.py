"""The product: sdist, wheel from the sdist, a fresh environment, the command line from elsewhere.

Nothing is downloaded: the dependencies are those of the running environment,
reached by a path file, which does not bring its editable hdrusd along.
"""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import hdrusd

pytestmark = pytest.mark.product

ROOT = Path(__file__).parents[1]
DATA_SUFFIXES = {".glsl", ".vert", ".frag", ".usda", ".toml"}

#: A white square of 2 m that faces +Z, with reflectance 0.5.
PLANE_OBJ = """\
mtllib plane.mtl
v -1 -1 0
v 1 -1 0
v 1 1 0
v -1 1 0
vn 0 0 1
usemtl grey
f 1//1 2//1 3//1 4//1
"""
PLANE_MTL = """\
newmtl grey
Ka 0 0 0
Kd 0.5 0.5 0.5
Ks 0 0 0
illum 1
"""
#: Looked at from 5 m under 100 lx, head on: a distant light of no size is lux (UsdLux).
VIEW_USDA = """\
#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Y"
    subLayers = [@./plane.usda@]
)

def Camera "Eye"
{
    float focalLength = 50
    float horizontalAperture = 20
    float verticalAperture = 20
    float2 clippingRange = (0.1, 100)
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}

def DistantLight "Lamp" (
    prepend apiSchemas = ["LightAPI"]
)
{
    float inputs:angle = 0
    float inputs:intensity = 100
}
"""


@dataclass(frozen=True, slots=True)
class Product:
    """The built files and an environment with the wheel in it."""

    sdist: Path
    wheel: Path
    environment: Path
    folder: Path  # empty at first, away from the checkout

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """``hdrusd`` with these arguments, in ``folder``."""
        script = self.environment / "bin" / "hdrusd"
        clean = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "PXR_"))}
        return subprocess.run(
            [str(script), *arguments], cwd=self.folder, env=clean, capture_output=True, text=True
        )

    def succeed(self, *arguments: str) -> str:
        """Standard output of a command that must end with 0."""
        done = self.run(*arguments)
        assert done.returncode == 0, f"{arguments}: {done.returncode}\n{done.stdout}{done.stderr}"
        return done.stdout


def quiet(*command: str | Path, cwd: Path) -> None:
    done = subprocess.run(list(map(str, command)), cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Product:
    base = tmp_path_factory.mktemp("product")
    # A copy: an egg-info left in the checkout would add files that are gone to the sdist.
    source = base / "source"
    unwanted = shutil.ignore_patterns(".*", "__pycache__", "*.egg-info", "build", "dist", "out")
    shutil.copytree(ROOT, source, ignore=unwanted)
    quiet(sys.executable, "-m", "build", "--no-isolation", "--outdir", base / "dist", cwd=source)
    shutil.rmtree(source)
    (wheel,) = (base / "dist").glob("*.whl")
    (sdist,) = (base / "dist").glob("*.tar.gz")

    environment = base / "environment"
    venv.create(environment, with_pip=False, symlinks=True)
    pip = (sys.executable, "-m", "pip", "--python", environment / "bin" / "python")
    quiet(*pip, "install", "--quiet", "--no-deps", "--no-index", wheel, cwd=base)
    packages = environment / Path(sysconfig.get_path("purelib")).relative_to(sys.prefix)
    reused = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    (packages / "dependencies.pth").write_text("\n".join(reused))

    folder = base / "elsewhere"
    folder.mkdir()
    return Product(sdist, wheel, environment, folder)


@pytest.fixture(scope="module")
def plane(product: Product) -> Product:
    """The product, with ``plane.usda`` converted and ``view.usda`` around it."""
    (product.folder / "plane.obj").write_text(PLANE_OBJ)
    (product.folder / "plane.mtl").write_text(PLANE_MTL)
    (product.folder / "view.usda").write_text(VIEW_USDA)
    product.succeed("convert", "plane.obj", "plane.usda")
    return product


@pytest.fixture(scope="module")
def frame(plane: Product) -> Path:
    """One frame of 32 x 32 pixels."""
    arguments = ("render", "view.usda", "frame.####.exr", "--frames", "1", "--camera", "/Eye")
    done = plane.run(*arguments, "--imageWidth", "32")
    if done.returncode == 5 and not os.environ.get("HDRUSD_REQUIRE_GL"):
        pytest.skip(f"no OpenGL here: {done.stderr.strip()}")
    assert done.returncode == 0, done.stdout + done.stderr
    return plane.folder / "frame.0001.exr"


def test_wheel_has_every_shader_and_schema(product: Product) -> None:
    with zipfile.ZipFile(product.wheel) as wheel:
        shipped = set(wheel.namelist())
    wanted = {
        file.relative_to(ROOT).as_posix()
        for file in (ROOT / "hdrusd").rglob("*")
        if file.suffix in DATA_SUFFIXES | {".py"}
    }
    schemas = (*(ROOT / "schemas").rglob("*.usda"), *(ROOT / "schemas").rglob("plugInfo.json"))
    wanted |= {f"hdrusd/{file.relative_to(ROOT).as_posix()}" for file in schemas}
    assert any(name.endswith(".frag") for name in wanted)
    assert wanted - shipped == set()


def test_wheel_has_one_top_level_package(product: Product) -> None:
    with zipfile.ZipFile(product.wheel) as wheel:
        tops = {name.split("/")[0] for name in wheel.namelist()}
    assert tops == {"hdrusd", f"hdrusd-{hdrusd.__version__}.dist-info"}
    assert product.wheel.name.endswith("-py3-none-any.whl")


def test_installed_package_is_the_one_that_runs(product: Product) -> None:
    python = product.environment / "bin" / "python"
    program = (
        "import hdrusd, hdrusd.schemas; print(hdrusd.__file__); print(hdrusd.schemas.__file__)"
    )
    done = subprocess.run(
        [str(python), "-I", "-c", program], cwd=product.folder, capture_output=True, text=True
    )
    files = [Path(line) for line in done.stdout.splitlines()]
    assert len(files) == 2, done.stderr
    assert all(file.is_relative_to(product.environment) for file in files)


def test_version(product: Product) -> None:
    assert hdrusd.__version__ in product.succeed("--version")


def test_operators_and_doctor(product: Product) -> None:
    assert "reinhard02" in product.succeed("operators")
    assert "elderly" in product.succeed("observers")
    assert "peak=1000 cd/m2" in product.succeed("screens", "hdr")
    done = product.run("doctor")
    if os.environ.get("HDRUSD_REQUIRE_GL"):
        assert done.returncode == 0, done.stdout + done.stderr
    assert done.returncode in (0, 5), done.stdout + done.stderr


def test_schemas_command_names_the_installed_plugin(product: Product) -> None:
    folder = Path(product.succeed("schemas").strip())
    assert folder.is_relative_to(product.environment)
    assert (folder / "plugInfo.json").is_file()


def test_converted_stage_passes_its_checks(plane: Product) -> None:
    plane.succeed("check", "plane.usda")


def test_luminance_of_a_plane_under_a_known_light(frame: Path) -> None:
    import OpenEXR

    with OpenEXR.File(str(frame)) as file:
        rgb = np.asarray(file.channels()["RGB"].pixels)
    assert rgb.shape == (32, 32, 3)
    # Lambert: L = R E / pi, in some ten roundings of float32 (6e-8 each).
    assert rgb[16, 16] == pytest.approx(0.5 * 100 / math.pi, rel=1e-6)


def test_tone_mapped_picture(plane: Product, frame: Path) -> None:
    assert frame.is_file()
    plane.succeed("tonemap", "frame.####.exr", "frame.####.png", "--operator", "reinhard02")
    assert (plane.folder / "frame.0001.png").read_bytes().startswith(b"\x89PNG\r\n\x1a\n")


def test_unreadable_input_is_exit_code_3(product: Product) -> None:
    (product.folder / "broken.gltf").write_bytes(b"\x00\x01 not JSON")
    done = product.run("convert", "broken.gltf", "broken.usda")
    assert done.returncode == 3
    assert "broken.gltf" in done.stderr
    assert "Traceback" not in done.stderr
