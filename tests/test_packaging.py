"""What pyproject.toml says of the package against the folders and the installed project."""

from __future__ import annotations

import tomllib
from importlib.metadata import entry_points, version
from pathlib import Path
from typing import Any

import hdrusd

ROOT = Path(__file__).parents[1]


def project() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def package_folders() -> dict[str, Path]:
    """Dotted name to folder, for every folder with a module that must be shipped."""
    found = {}
    for folder, package in {"hdrusd": "hdrusd", "cli": "hdrusd.cli"}.items():
        for file in (ROOT / folder).rglob("*.py"):
            inside = file.parent.relative_to(ROOT / folder).parts
            found[".".join([package, *inside])] = file.parent
    return {**found, "hdrusd.schemas": ROOT / "schemas"}


def test_package_list_equals_the_folders() -> None:
    assert sorted(project()["tool"]["setuptools"]["packages"]) == sorted(package_folders())


def test_every_package_folder_has_an_init() -> None:
    # A namespace package is not found in setuptools' editable installation.
    assert [p for p in package_folders().values() if not (p / "__init__.py").is_file()] == []


def test_version_is_said_once() -> None:
    assert version("hdrusd") == hdrusd.__version__
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## [{hdrusd.__version__}]" in changelog


def test_console_script_is_there() -> None:
    (script,) = entry_points(group="console_scripts", name="hdrusd")
    assert callable(script.load())


def test_type_information_is_shipped() -> None:
    assert (ROOT / "hdrusd" / "py.typed").is_file()
    assert "py.typed" in project()["tool"]["setuptools"]["package-data"]["hdrusd"]
