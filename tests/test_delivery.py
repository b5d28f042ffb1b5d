"""What an earlier conversion into the same OUTPUT wrote goes with it, and nothing else does."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from builders import obj, png
from overlaid import lamp, stage_file
from pxr import Usd

from hdrusd import delivery
from hdrusd.conversion import Options
from hdrusd.convert import convert
from hdrusd.delivery import earlier_files, is_own
from hdrusd.errors import InputError

LAMP = lamp("SphereLight", "float inputs:intensity = 100\nfloat inputs:radius = 0.1")

#: Of a conversion of each kind into o.usda, without textures.
OVERLAID = {"o.usda", "o.photometry.usda"}
LEGACY = OVERLAID | {"o.geometry.usdc", "o.look.usda"}


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """Where the stage ``o.usda`` is to stand."""
    return tmp_path / "out"


def plain(folder: Path) -> Path:
    """A database without a texture."""
    return obj(folder / "plain.obj", "Kd 0.5 0.5 0.5")


def painted(folder: Path) -> Path:
    """A database with one."""
    png(folder / "wall.png")
    return obj(folder / "painted.obj", "Kd 1 1 1\nmap_Kd wall.png")


def stage(folder: Path, name: str = "lamps.usda") -> Path:
    """A stage that stays as it is."""
    folder.mkdir(parents=True, exist_ok=True)
    return stage_file(folder / name, LAMP)


def contents(folder: Path) -> dict[str, bytes]:
    """Files below a folder, hidden ones too."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def test_textures_that_nothing_names_any_more_go(tmp_path: Path, out: Path) -> None:
    convert(painted(tmp_path), out / "o.usda", Options())
    textures = {name for name in contents(out) if "/" in name}
    assert len(textures) == 2  # the copy and the reflectance map
    convert(plain(tmp_path), out / "o.usda", Options())
    assert set(contents(out)) == LEGACY
    assert not (out / "o.textures").exists()


def test_of_other_textures_the_new_ones_stay(tmp_path: Path, out: Path) -> None:
    convert(painted(tmp_path), out / "o.usda", Options())
    brighter = obj(tmp_path / "brighter.obj", "Kd 0.9 0.9 0.9\nmap_Kd wall.png")
    convert(brighter, out / "o.usda", Options())
    convert(brighter, out / "alone/o.usda", Options())
    both = contents(out)
    alone = {name.removeprefix("alone/") for name in both if name.startswith("alone/")}
    assert {name for name in both if not name.startswith("alone/")} == alone


def test_layers_of_another_kind_of_conversion_go(tmp_path: Path, out: Path) -> None:
    for source, written in ((plain, LEGACY), (stage, OVERLAID), (plain, LEGACY)):
        convert(source(tmp_path), out / "o.usda", Options())
        assert set(contents(out)) == written
        assert {path.name for path in earlier_files(out / "o.usda")} == written


def test_what_others_wrote_stays(tmp_path: Path, out: Path) -> None:
    convert(painted(tmp_path), out / "o.usda", Options())
    convert(painted(tmp_path), out / "p.usda", Options())
    before = contents(out)
    (out / "o.textures/layered").mkdir()
    others = {
        "o.textures/wall_0123abcd.png": b"mine",
        "o.textures/layered/wall.xcf": b"mine too",
        "o.notes.txt": b"and this",
    }
    for name, content in others.items():
        (out / name).write_bytes(content)
    for source in (painted, plain, stage, painted):
        convert(source(tmp_path), out / "o.usda", Options())
        assert others.items() <= contents(out).items()
    assert contents(out) == before | others


def test_a_stage_by_the_name_of_a_layer_is_no_layer(tmp_path: Path) -> None:
    source = stage_file(tmp_path / "o.look.usda", LAMP)
    kept = source.read_bytes()
    convert(source, tmp_path / "o.usda", Options())
    convert(stage(tmp_path), tmp_path / "o.usda", Options())
    assert source.read_bytes() == kept


def test_a_hand_written_stage_of_that_name_is_no_earlier_conversion(tmp_path: Path) -> None:
    names = [f"@./o.{layer}@" for layer in ("photometry.usda", "look.usda", "geometry.usdc")]
    (tmp_path / "o.usda").write_text(f"#usda 1.0\n(\n subLayers = [{', '.join(names)}]\n)\n")
    for name in ("o.photometry.usda", "o.look.usda"):
        (tmp_path / name).write_text('#usda 1.0\ndef "mine" {}\n')
    assert earlier_files(tmp_path / "o.usda") == []
    convert(stage(tmp_path), tmp_path / "o.usda", Options())
    assert (tmp_path / "o.look.usda").read_text() == '#usda 1.0\ndef "mine" {}\n'


@pytest.mark.parametrize("layer", ["geometry.usdc", "look.usda"])
def test_layers_that_nothing_says_hdrusd_wrote_stay(tmp_path: Path, out: Path, layer: str) -> None:
    out.mkdir()
    (out / f"o.{layer}").write_bytes(b"mine")
    (out / f"p.{layer}").mkdir()
    (out / "p.usda").touch()
    before = contents(out)
    for name in ("o", "p"):
        with pytest.raises(InputError, match=rf"{name}\.{layer}: not of an earlier conversion"):
            convert(plain(tmp_path), out / f"{name}.usda", Options())
    assert contents(out) == before


@pytest.mark.parametrize(
    "text",
    [
        '(framesPerSecond = 24)\ndef Sphere "Ball" {}',
        LAMP,  # no default prim
        '(defaultPrim = "End")\n'
        + "\n".join(LAMP.replace("Lamp", f"L{i}") for i in range(200))
        + '\ndef Xform "End" {}',
    ],
    ids=["frames per second", "no default prim", "a late default prim"],
)
def test_a_stage_without_a_mark_can_be_converted_again(
    tmp_path: Path, out: Path, text: str
) -> None:
    source = tmp_path / "source.usda"
    head = "#usda 1.0\n" if text.startswith("(") else "#usda 1.0\n(metersPerUnit = 1)\n"
    source.write_text(head + text)
    for _ in range(2):
        convert(source, out / "o.usda", Options())
        assert is_own(out / "o.usda")
        assert is_own(out / "o.photometry.usda")


class Killed(BaseException):
    """As by SIGKILL: what stands there stays, and nothing is put back."""


@pytest.mark.parametrize("first", [None, plain, stage])
@pytest.mark.parametrize("kind", [plain, stage])
def test_output_can_be_made_after_a_kill_at_any_rename(
    tmp_path: Path,
    out: Path,
    monkeypatch: pytest.MonkeyPatch,
    first: Callable[[Path], Path] | None,
    kind: Callable[[Path], Path],
) -> None:
    rename = Path.rename
    for turn in range(20):
        if first is not None:
            convert(first(tmp_path), out / "o.usda", Options())
        left = turn

        def killed(self: Path, target: Path) -> Path:
            nonlocal left
            left -= 1
            if left < 0:
                raise Killed if left == -1 else OSError
            return rename(self, target)

        with monkeypatch.context() as patched:
            patched.setattr(Path, "rename", killed)
            patched.setattr(delivery, "remove", lambda folder: None)
            patched.setattr(delivery, "_clear", lambda folder: None)
            try:
                convert(kind(tmp_path), out / "o.usda", Options())
            except Killed:
                done = False
            else:
                done = True
        convert(kind(tmp_path), out / "o.usda", Options())
        assert Usd.Stage.Open(str(out / "o.usda")).GetPseudoRoot().GetChildren()
        shutil.rmtree(out)
        if done:
            return
    pytest.fail("more renames than turns")


def test_a_source_made_of_what_would_go_is_refused(tmp_path: Path, out: Path) -> None:
    convert(plain(tmp_path), out / "o.usda", Options())
    before = contents(out)
    with pytest.raises(InputError, match=r"would replace .*o\.geometry\.usdc; want another name"):
        convert(out / "o.geometry.usdc", out / "o.usda", Options())
    assert contents(out) == before


@pytest.mark.parametrize("kind", [plain, painted, stage])
def test_an_interrupted_delivery_leaves_what_stood_there(
    tmp_path: Path, out: Path, monkeypatch: pytest.MonkeyPatch, kind: Callable[[Path], Path]
) -> None:
    """At whichever rename it comes: before it is done, and just after."""
    convert(painted(tmp_path), out / "o.usda", Options())
    (out / "o.textures/mine.png").write_bytes(b"mine")
    before = contents(out)
    rename = Path.rename
    done = False
    for turn in range(100):
        left = turn // 2

        def interrupted(self: Path, target: Path, late: bool = bool(turn % 2)) -> Path:
            nonlocal left
            left -= 1
            if left == -1 and not late:
                raise KeyboardInterrupt
            moved = rename(self, target)
            if left == -1:
                raise KeyboardInterrupt
            return moved

        with monkeypatch.context() as patch:
            patch.setattr(Path, "rename", interrupted)
            try:
                convert(kind(tmp_path), out / "o.usda", Options())
                done = True
            except KeyboardInterrupt:
                assert contents(out) == before
        if done:
            break
    assert turn // 2 > 4
    assert done
    assert (out / "o.textures/mine.png").read_bytes() == b"mine"
    assert Usd.Stage.Open(str(out / "o.usda"))


def test_a_linked_folder_of_textures_is_not_written_through(tmp_path: Path, out: Path) -> None:
    convert(painted(tmp_path), out / "o.usda", Options())
    elsewhere = (out / "o.textures").rename(tmp_path / "elsewhere")
    (out / "o.textures").symlink_to(elsewhere)
    before = contents(elsewhere)
    convert(painted(tmp_path), out / "o.usda", Options())
    assert not (out / "o.textures").is_symlink()
    assert contents(out / "o.textures") == contents(elsewhere) == before
