"""The layers of docs/architecture.md, read from the syntax tree of every module."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

#: Folder of the checkout to the package that it becomes.
PACKAGES = {"hdrusd": "hdrusd", "cli": "hdrusd.cli", "schemas": "hdrusd.schemas"}

#: A module imports from its own package and from the rows above its own, nothing else.
#: "" is hdrusd/__init__ itself.
LAYERS = (
    {"", "errors", "units"},
    {"columns", "frames", "input_file", "leftovers", "registry", "report"},
    {"colour", "schemas", "legacy", "scene"},
    {"eye"},
    {"glare", "photometry", "tonemap"},
    {"importers", "images"},
    {"usd", "gpu", "bracket", "contact_sheet", "course", "plots", "video"}
    | {"frame_header", "frame_io", "map_threads", "texture_names"},
    {"account", "adaptation_log", "added_lamps", "candela_plot", "delivery", "inspection"}
    | {"job", "luminaires", "maps", "measures", "recipe", "skies", "validation", "viewing"},
    {"by_products", "checking", "conversion", "lamps", "resuming", "surfaces"},
    {"display", "overlay"},
    {"convert", "render"},
    {"batch", "testing"},
    {"cli"},
)

#: Who may import what does not come with Python; NumPy is everybody's.
THIRD_PARTY = {
    "pxr": {
        "schemas",
        "usd",
        "validation",
        "checking",
        "convert",
        "lamps",
        "overlay",
        "recipe",
        "render",
    },
    "moderngl": {"gpu", "render", "viewing"},
    "OpenEXR": {"images"},
    "OpenImageIO": {"bracket", "contact_sheet", "images"},
    "PyOpenColorIO": {"tonemap"},
    "av": {"video"},
    "matplotlib": {"adaptation_log", "candela_plot", "plots"},
    "click": {"cli"},
    "ufbx": {"importers"},  # in a worker process only: tests/importers/test_fbx.py
    "DracoPy": {"importers"},  # so too: tests/importers/test_gltf_draco.py
    "meshopt": {"importers"},  # and: tests/importers/test_gltf_meshopt.py
    "numpy": set().union(*LAYERS),
}

LEVEL = {name: level for level, names in enumerate(LAYERS) for name in names}


def shipped_modules() -> Iterator[tuple[str, Path]]:
    """Dotted name and file of each module that is shipped."""
    for folder, package in PACKAGES.items():
        for file in sorted((ROOT / folder).rglob("*.py")):
            inside = file.relative_to(ROOT / folder).with_suffix("").parts
            if inside[0] == "tools":  # schemas/tools is for developers and not installed
                continue
            yield ".".join([package, *(part for part in inside if part != "__init__")]), file


MODULES = dict(shipped_modules())


def imports(source: str, module: str, *, is_package: bool) -> Iterator[tuple[int, str]]:
    """Line and dotted name of everything that ``source`` imports, wherever in the text.

    ``"hdrusd.a.b:name"`` in a string is how a registry imports, so it counts.
    """
    package = module if is_package else module.rpartition(".")[0]
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package.rsplit(".", node.level - 1)[0] if node.level else ""
            origin = ".".join(filter(None, [base, node.module]))
            yield from ((node.lineno, f"{origin}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            target = re.fullmatch(r"(hdrusd(?:\.\w+)+):\w+", node.value)
            if target:
                yield node.lineno, target[1]


def part(module: str) -> str:
    """The name in LAYERS that a dotted name below hdrusd belongs to."""
    first = module.split(".")[1] if "." in module else ""
    return first if first in LEVEL else ""


def violations(source: str, module: str, *, is_package: bool = False) -> list[str]:
    """What ``source`` imports and may not, as lines for a person."""
    own = part(module)
    wrong = []
    for line, target in imports(source, module, is_package=is_package):
        top = target.split(".")[0]
        if top == "hdrusd":
            other = part(target)
            if other != own and LEVEL[other] >= LEVEL[own]:
                wrong.append(f"{module}:{line}: {target}: not in a layer below")
        elif top not in sys.stdlib_module_names and own not in THIRD_PARTY.get(top, set()):
            wrong.append(f"{module}:{line}: {target}: not for this part")
    return wrong


def test_every_module_has_a_layer() -> None:
    homeless = {name for name in MODULES if part(name) == "" and name != "hdrusd"}
    assert not homeless


@pytest.mark.parametrize(("module", "file"), MODULES.items(), ids=MODULES)
def test_imports_point_downwards(module: str, file: Path) -> None:
    source = file.read_text(encoding="utf-8")
    assert violations(source, module, is_package=file.name == "__init__.py") == []


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("hdrusd.photometry.light", "from hdrusd.usd import light"),
        ("hdrusd.gpu.hdr", "import hdrusd.usd.extract"),
        ("hdrusd.usd.light", "from ..gpu import hdr"),
        ("hdrusd.importers.obj", "def read():\n    from hdrusd.convert import convert"),
        ("hdrusd.registry", "X.add('osg', 'hdrusd.importers.osg:read')"),
        ("hdrusd.photometry.light", "import moderngl"),
        ("hdrusd.importers.gltf", "from pxr import Usd"),
        ("hdrusd.render", "import click.testing"),
        ("hdrusd.usd.mesh", "import scipy.sparse"),
    ],
)
def test_a_wrong_import_is_seen(module: str, source: str) -> None:
    assert len(violations(source, module)) == 1


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("hdrusd.usd.light", "from hdrusd.photometry.light import PhotometricLight"),
        ("hdrusd.usd.light", "from . import names\nfrom .names import X"),
        ("hdrusd.cli.convert", "from .options import source\nimport click\nimport hdrusd"),
        ("hdrusd.tonemap.reinhard02", "import math\nimport numpy as np"),
    ],
)
def test_a_right_import_is_let_through(module: str, source: str) -> None:
    assert violations(source, module) == []


def test_help_imports_nothing_heavy() -> None:
    heavy = sorted(THIRD_PARTY.keys() - {"click", "numpy"})
    program = (
        "import sys\n"
        "sys.argv = ['hdrusd', '--help']\n"
        "from hdrusd.cli import main\n"
        "try:\n"
        "    main()\n"
        "except SystemExit as stop:\n"
        "    assert not stop.code\n"
        f"found = set({heavy}) & set(sys.modules)\n"
        "sys.exit(f'imported: {sorted(found)}' if found else 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
