"""Convert: layers of their own, and whole or nothing."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import obj, png
from converted import (
    lights,
    material,
    opened,
    run,
    sidecar,
    surface,
    texture_file,
    texture_node,
)
from pxr import Gf, Usd, UsdGeom, UsdShade

from hdrusd import convert as convert_module
from hdrusd.checking import validate
from hdrusd.conversion import Result
from hdrusd.errors import InputError, UnknownNameError, ValidationError

# -- layers -------------------------------------------------------------------------------


@pytest.fixture
def street(tmp_path: Path) -> Result:
    """A textured, glowing wall; the photometry file gives it numbers."""
    png(tmp_path / "src" / "wall.png")
    source = obj(tmp_path / "src" / "wall.obj", "Kd 0.5 0.5 0.5\nKe 0.5 0 0\nmap_Kd wall.png")
    sidecar(tmp_path / "src", "[ambient]\nilluminance = 1\n")
    return run(source, tmp_path / "out" / "street.usda")


def mute(stage: Usd.Stage, role: str) -> None:
    (layer,) = [x for x in stage.GetLayerStack() if f".{role}." in x.identifier]
    stage.MuteLayer(layer.identifier)


def test_muting_the_look_leaves_the_photometry_whole(street: Result) -> None:
    stage = opened(street)
    before = texture_file(surface(stage), "diffuseColor")
    mute(stage, "look")
    assert texture_file(surface(stage), "diffuseColor") == before
    assert before.is_file()
    assert material(stage).GetPrim().HasAPI("HdrusdPhotometricMaterialAPI")
    assert [p for p in validate(stage) if p.severity == "error"] == []
    wall = next(p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh))
    bound, _ = UsdShade.MaterialBindingAPI(wall).ComputeBoundMaterial()
    assert bound.GetPath() == material(stage).GetPath()


def test_muting_the_photometry_leaves_the_original_look(street: Result, tmp_path: Path) -> None:
    stage = opened(street)
    mute(stage, "photometry")
    assert lights(stage) == {}
    shader = surface(stage)
    file = texture_file(shader, "diffuseColor")
    assert file.read_bytes() == (tmp_path / "src" / "wall.png").read_bytes()
    node = texture_node(shader, "diffuseColor")
    assert node is not None
    assert node.GetInput("sourceColorSpace").Get() == "sRGB"
    assert np.array(node.GetInput("scale").Get()) == pytest.approx([0.5, 0.5, 0.5, 1.0])
    assert shader.GetInput("emissiveColor").Get() == Gf.Vec3f(0.5, 0.0, 0.0)
    assert not material(stage).GetPrim().HasAPI("HdrusdPhotometricMaterialAPI")
    assert [p for p in validate(stage) if p.severity == "error"] == []


def test_the_stage_names_only_what_lies_beside_it(street: Result, tmp_path: Path) -> None:
    moved = tmp_path / "moved"
    street.output.parent.rename(moved)
    stage = Usd.Stage.Open(str(moved / "street.usda"))
    assert texture_file(surface(stage), "diffuseColor").is_relative_to(moved)
    assert [p for p in validate(stage) if p.severity == "error"] == []
    for layer in stage.GetLayerStack(includeSessionLayers=False):
        text = layer.ExportToString()
        assert str(tmp_path) not in text
        assert ".hdrusd-" not in text


def test_the_stage_opens_without_the_plug_in(street: Result) -> None:
    program = (
        "import sys; from pxr import Usd, UsdLux\n"
        "stage = Usd.Stage.Open(sys.argv[1])\n"
        "assert Usd.SchemaRegistry().FindAppliedAPIPrimDefinition("
        "'HdrusdPhotometricMaterialAPI') is None\n"
        "print(sum(1 for p in stage.Traverse()), stage.GetDefaultPrim().GetName())\n"
    )
    environment = {k: v for k, v in os.environ.items() if k != "PXR_PLUGINPATH_NAME"}
    done = subprocess.run(
        [sys.executable, "-c", program, str(street.output)],
        capture_output=True,
        text=True,
        env=environment,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.split()[1] == "street"


# -- whole or nothing ---------------------------------------------------------------------


def everything(folder: Path) -> dict[str, bytes | None]:
    return {
        str(p.relative_to(folder)): p.read_bytes() if p.is_file() else None
        for p in sorted(folder.rglob("*"))
    }


def test_nothing_is_written_outside_the_output_folder(tmp_path: Path) -> None:
    source = obj(tmp_path / "src" / "wall.obj", "Kd 0.5 0.5 0.5\nmap_Kd wall.png")
    png(tmp_path / "src" / "wall.png")
    before = everything(tmp_path)
    run(source, tmp_path / "new" / "deeper" / "wall.usda")
    after = everything(tmp_path)
    new = set(after) - set(before)
    assert all(name.startswith("new") for name in new)
    assert {name: after[name] for name in before} == before
    made = {name.removeprefix("new/deeper/").split("/")[0] for name in new if "deeper/" in name}
    assert made == {
        "wall.usda",
        "wall.geometry.usdc",
        "wall.look.usda",
        "wall.photometry.usda",
        "wall.textures",
    }


def test_a_second_run_replaces_the_first_one_whole(tmp_path: Path) -> None:
    png(tmp_path / "wall.png")
    source = obj(tmp_path / "wall.obj", "Kd 0.5 0.5 0.5\nmap_Kd wall.png")
    output = tmp_path / "out" / "wall.usda"
    first = run(source, output)
    obj(tmp_path / "wall.obj", "Kd 0.25 0.5 0.5\nmap_Kd wall.png")
    second = run(source, output)
    assert set(second.textures) != set(first.textures)
    assert {p.name for p in (tmp_path / "out" / "wall.textures").iterdir()} == set(second.textures)
    assert len(list((tmp_path / "out").iterdir())) == 5


def failing(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Any]:
    """A source that cannot be converted, and the error to expect."""
    if kind == "broken":
        (tmp_path / "bad.gltf").write_text("{")
        return tmp_path / "bad.gltf", InputError
    if kind == "empty":
        (tmp_path / "bad.obj").write_text("# nothing\n")
        return tmp_path / "bad.obj", InputError
    if kind == "missing":
        return tmp_path / "none.obj", InputError
    if kind == "suffix":
        (tmp_path / "bad.xyz").write_text("?")
        return tmp_path / "bad.xyz", InputError
    source = obj(tmp_path / "wall.obj", "Kd 0.5 0.5 0.5")
    if kind == "invalid":
        problem = type("P", (), {"severity": "error", "path": "/x", "text": "wrong"})()
        monkeypatch.setattr(convert_module, "validate", lambda stage: [problem])
        return source, ValidationError
    if kind == "rename":
        rename = Path.rename

        def fails(self: Path, target: Path) -> Path:
            if self.suffixes[:1] == [".photometry"] and self.parent.name.startswith(".hdrusd-"):
                raise OSError(28, "No space left on device", str(target))
            return rename(self, target)

        monkeypatch.setattr(Path, "rename", fails)
        return source, OSError
    monkeypatch.setattr(convert_module, "write_look", lambda *rest: 1 / 0)
    return source, ZeroDivisionError


KINDS = ["broken", "empty", "missing", "suffix", "invalid", "bug", "rename"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_failure_leaves_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    source, error = failing(kind, tmp_path / "", monkeypatch)
    before = everything(tmp_path)
    with pytest.raises(error):
        run(source, tmp_path / "new" / "out" / "wall.usda")
    assert everything(tmp_path) == before


@pytest.mark.parametrize("kind", KINDS)
def test_a_failure_leaves_an_existing_output_untouched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    png(tmp_path / "wall.png")
    good = obj(tmp_path / "good.obj", "Kd 0.5 0.5 0.5\nmap_Kd wall.png")
    output = tmp_path / "out" / "wall.usda"
    run(good, output)
    source, error = failing(kind, tmp_path, monkeypatch)
    before = everything(tmp_path)
    with pytest.raises(error):
        run(source, output)
    assert everything(tmp_path) == before


def test_an_output_that_is_a_folder_or_no_stage_is_refused(tmp_path: Path) -> None:
    source = obj(tmp_path / "wall.obj", "Kd 0.5 0.5 0.5")
    (tmp_path / "folder.usda").mkdir()
    before = everything(tmp_path)
    for name, text in (("folder.usda", "a folder"), ("a.usdc", "want .usda"), ("a", "no suffix")):
        with pytest.raises(InputError, match=text):
            run(source, tmp_path / name)
    with pytest.raises(InputError, match="want a shorter one"):
        run(source, tmp_path / ("x" * 245 + ".usda"))
    assert everything(tmp_path) == before


@pytest.mark.parametrize("beside", [(), ("wall.usda",)])
def test_a_folder_of_textures_that_is_not_ours_is_not_touched(
    tmp_path: Path, beside: tuple[str, ...]
) -> None:
    png(tmp_path / "wall.textures" / "brick.png")
    for name in beside:  # a stage of somebody else
        (tmp_path / name).write_text("#usda 1.0\n")
    source = obj(tmp_path / "wall.obj", "Kd 1 1 1\nmap_Kd wall.textures/brick.png")
    before = everything(tmp_path)
    with pytest.raises(InputError, match="not of an earlier conversion"):
        run(source)
    assert everything(tmp_path) == before
    assert run(source, tmp_path / "night.usda").textures


def test_a_file_in_the_way_of_a_folder_is_one_os_error(tmp_path: Path) -> None:
    source = obj(tmp_path / "wall.obj", "Kd 0.5 0.5 0.5")
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        run(source, tmp_path / "file" / "wall.usda")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission_is_one_os_error(tmp_path: Path) -> None:
    source = obj(tmp_path / "wall.obj", "Kd 0.5 0.5 0.5")
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    with pytest.raises(PermissionError):
        run(source, closed / "wall.usda")


def test_an_unknown_estimate_rule_is_helped(tmp_path: Path) -> None:
    source = obj(tmp_path / "wall.obj", "Kd 0.5 0.5 0.5")
    with pytest.raises(UnknownNameError, match="known: day-10000lx, interior-100lx, night-20lx"):
        run(source, estimate="noon")
    assert not (tmp_path / "wall.usda").exists()


@pytest.mark.parametrize(
    "stem",
    [
        "my street (v2)",
        "1street",
        "straße 夜",
        "a@b",
        "Render",
        "__Prototypes",
        "Looks",
        "a.b",
        "%20",
    ],
)
def test_any_stem_will_do(tmp_path: Path, stem: str) -> None:
    png(tmp_path / "wall.png")
    source = obj(tmp_path / "wall.obj", "Kd 0.5 0.5 0.5\nmap_Kd wall.png")
    result = run(source, tmp_path / "out" / f"{stem}.usda", meters_per_unit=0.01)
    stage = opened(result)
    assert stage.GetDefaultPrim().GetTypeName() == "Xform"
    assert texture_file(surface(stage), "diffuseColor").is_file()
    wall = next(p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh))
    world = UsdGeom.Xformable(wall).ComputeLocalToWorldTransform(0)
    assert world.GetRow3(0).GetLength() == pytest.approx(100.0)
    assert stage.GetPrimAtPath("/Render/Settings")
