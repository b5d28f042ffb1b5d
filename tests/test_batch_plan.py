"""Which files of a folder are converted, to which stages, by which photometry file."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from hdrusd.account.many import Converted, parts_of_others
from hdrusd.batch.plan import plan
from hdrusd.errors import InputError


def _touch(*paths: Path) -> None:
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()


def _stages(folder: Path, *sources: Path) -> dict[str, str]:
    """Sources to stages, both relative."""
    tasks = plan(sources or [folder], folder / "out")
    return {
        str(task.source.relative_to(folder)): str(task.output.relative_to(folder / "out"))
        for task in tasks
    }


def test_the_tree_is_kept_and_other_files_are_none(tmp_path: Path) -> None:
    _touch(tmp_path / "a.flt", tmp_path / "deep/er/B.OBJ", tmp_path / "deep/b.mtl")
    _touch(tmp_path / "deep/picture.png", tmp_path / "s.usda")
    assert _stages(tmp_path) == {
        "a.flt": "a.usda",
        "deep/er/B.OBJ": "deep/er/B.usda",
        "s.usda": "s.usda",
    }


def test_two_sources_of_one_name_keep_their_suffix(tmp_path: Path) -> None:
    _touch(tmp_path / "lamp.3ds", tmp_path / "Lamp.obj", tmp_path / "post.flt")
    assert _stages(tmp_path) == {
        "Lamp.obj": "Lamp_obj.usda",
        "lamp.3ds": "lamp_3ds.usda",
        "post.flt": "post.usda",
    }


def test_a_suffix_that_makes_another_files_name_gets_a_number(tmp_path: Path) -> None:
    _touch(tmp_path / "x.gltf", tmp_path / "x.dae", tmp_path / "x_gltf.gltf", tmp_path / "y.flt")
    _touch(tmp_path / "x_gltf_2.flt")
    assert _stages(tmp_path) == {
        "x.dae": "x_dae.usda",
        "x.gltf": "x_gltf_3.usda",
        "x_gltf.gltf": "x_gltf.usda",  # their own names
        "x_gltf_2.flt": "x_gltf_2.usda",
        "y.flt": "y.usda",
    }


def test_folders_that_differ_in_case_alone_do_not_share_a_stage(tmp_path: Path) -> None:
    _touch(tmp_path / "A/x.obj", tmp_path / "a/x.obj", tmp_path / "a/y.obj")
    assert _stages(tmp_path) == {
        "A/x.obj": "A/x_obj.usda",
        "a/x.obj": "a/x_obj_2.usda",
        "a/y.obj": "a/y.usda",
    }


def test_no_stage_stands_where_a_folder_will(tmp_path: Path) -> None:
    _touch(tmp_path / "x.obj", tmp_path / "x.usda/a.obj", tmp_path / "y.obj")
    _touch(tmp_path / "y.textures/b.obj")
    assert _stages(tmp_path) == {
        "x.obj": "x_2.usda",
        "x.usda/a.obj": "x.usda/a.usda",
        "y.obj": "y_2.usda",
        "y.textures/b.obj": "y.textures/b.usda",
    }


def test_no_stage_replaces_another_source(tmp_path: Path) -> None:
    """In the folder of the sources: a.usda wants a_usda.usda, which somebody wrote."""
    _touch(tmp_path / "a.obj", tmp_path / "a.usda", tmp_path / "a_usda.usda")
    tasks = plan([tmp_path], tmp_path)
    assert {task.source.name: task.output.name for task in tasks} == {
        "a.obj": "a_obj.usda",
        "a.usda": "a_usda_2.usda",
        "a_usda.usda": "a_usda.usda",  # which convert refuses, as ever
    }


def test_sources_above_the_working_folder_stay_below_the_output(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _touch(tmp_path / "here/two.obj", tmp_path / "proj/scene.obj")
    monkeypatch.chdir(tmp_path / "here")
    named = [Path("two.obj"), Path("../proj/scene.obj"), Path("../here/two.obj")]
    tasks = plan(named, Path("out"))
    assert {str(task.source): str(task.output) for task in tasks} == {
        "../here/two.obj": "out/here/two.usda",  # one file with two.obj
        "../proj/scene.obj": "out/proj/scene.usda",
    }
    assert plan([Path("..")], Path("out"))[0].output == Path("out/here/two.usda")
    # Two steps up from where a link leads.
    (tmp_path / "here/link").symlink_to(tmp_path / "proj")
    tasks = plan([Path("two.obj"), Path("link/../proj/scene.obj")], Path("out"))
    assert [str(task.output) for task in tasks] == ["out/proj/scene.usda", "out/here/two.usda"]


def test_a_link_below_the_output_leads_nothing_out_of_it(tmp_path: Path) -> None:
    _touch(tmp_path / "src/a/x.obj", tmp_path / "src/b/x.obj", tmp_path / "elsewhere/x.usda")
    (tmp_path / "out").mkdir()
    (tmp_path / "out/b").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match=r"elsewhere, outside .*out; want"):
        plan([tmp_path / "src"], tmp_path / "out")


def test_no_stage_is_called_like_a_layer_of_another(tmp_path: Path) -> None:
    _touch(tmp_path / "lamp.flt", tmp_path / "lamp.look.obj")
    assert _stages(tmp_path) == {"lamp.flt": "lamp.usda", "lamp.look.obj": "lamp_look_obj.usda"}


def test_hidden_files_the_output_and_links_out_are_passed_over(tmp_path: Path) -> None:
    folder, other = tmp_path / "folder", tmp_path / "other"
    _touch(folder / "a.flt", folder / ".b.flt", folder / ".git/c.flt", folder / "out/d.usda")
    _touch(other / "e.flt")
    (folder / "link.flt").symlink_to(other / "e.flt")
    (folder / "linked").symlink_to(other)
    assert _stages(folder) == {"a.flt": "a.usda"}
    said: list[str] = []
    plan([folder], folder / "out", tell=said.append)
    assert said == [
        f"{folder}: passed over, links to folders: 1 (linked)",
        f"{folder}: passed over, links that lead out of it: 1 (link.flt)",
    ]


def test_what_earlier_conversions_wrote_is_passed_over(tmp_path: Path) -> None:
    mark = '#usda 1.0\nover "a" {\n uniform string authorship:hdrusd:softwarePackage = "hdrusd"\n}'
    _touch(tmp_path / "a.flt", tmp_path / "old/a.usda", tmp_path / "old/a.geometry.usdc")
    _touch(tmp_path / "old/a.look.usda", tmp_path / "old/a.usdz")
    (tmp_path / "old/a.photometry.usda").write_text(mark)
    _touch(tmp_path / "c.usda")
    os.mkfifo(tmp_path / "c.photometry.usda")  # nobody writes into it
    # Layers of those names that somebody else wrote are a database like others.
    _touch(tmp_path / "b.usda", tmp_path / "b.photometry.usda")
    said: list[str] = []
    tasks = plan([tmp_path], tmp_path / "out", tell=said.append)
    assert [str(task.source.relative_to(tmp_path)) for task in tasks] == [
        "a.flt",
        "b.photometry.usda",
        "b.usda",
        "c.photometry.usda",
        "c.usda",
        "old/a.usdz",
    ]
    assert said == [
        f"{tmp_path}: passed over, stages and layers that hdrusd wrote: 4 "
        "(old/a.geometry.usdc, old/a.look.usda, old/a.photometry.usda, ...)"
    ]
    named = tmp_path / "old/a.usda"  # who names one means it
    assert [task.source for task in plan([named], tmp_path / "out")] == [named]


def test_named_files_keep_the_tree_below_their_common_folder(tmp_path: Path) -> None:
    named = [tmp_path / "cars/red/asset.usda", tmp_path / "cars/blue/asset.usda"]
    _touch(*named, tmp_path / "cars/blue/geo.usda")
    assert _stages(tmp_path, *named) == {
        "cars/red/asset.usda": "red/asset.usda",
        "cars/blue/asset.usda": "blue/asset.usda",
    }


def test_a_file_that_is_named_twice_is_converted_once(tmp_path: Path) -> None:
    _touch(tmp_path / "a/b.flt")
    tasks = plan([tmp_path / "a", tmp_path / "a/b.flt"], tmp_path / "out")
    assert [task.source for task in tasks] == [tmp_path / "a/b.flt"]


def test_the_nearest_photometry_file_counts(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    _touch(tmp_path / "photometry.toml", folder / "photometry.toml", folder / "a.flt")
    _touch(folder / "b/b.flt", folder / "c/photometry.toml", folder / "c/d/d.flt")
    tasks = {task.source.name: task for task in plan([folder], tmp_path / "out")}
    own, near = folder / "photometry.toml", folder / "c/photometry.toml"
    assert [tasks[n].photometry for n in ("a.flt", "b.flt", "d.flt")] == [own, own, near]
    assert [tasks[n].shared for n in ("a.flt", "b.flt", "d.flt")] == [True, True, False]
    (folder / "photometry.toml").unlink()
    assert plan([folder / "b"], tmp_path / "out")[0].photometry is None  # not above the folder
    given = tmp_path / "photometry.toml"
    assert {task.photometry for task in plan([folder], tmp_path / "out", given)} == {given}


def test_a_folder_without_a_database_is_refused(tmp_path: Path) -> None:
    _touch(tmp_path / "readme.txt")
    with pytest.raises(InputError, match="no database in it"):
        plan([tmp_path], tmp_path / "out")


def test_of_a_circle_one_file_counts(tmp_path: Path) -> None:
    a, b, c = (tmp_path / f"{name}.usda" for name in "abc")
    rows = [
        Converted(a, a, {}, parts={b}),
        Converted(b, b, {}, parts={a, b}),
        Converted(c, c, {}, parts={c}),
    ]
    assert parts_of_others(rows) == {b}
