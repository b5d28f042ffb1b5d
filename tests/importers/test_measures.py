"""The unit and the up axis of a source: what it states, what a person does, and what is said."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tds_builder
from converted import opened, run
from converted import sidecar as recipe
from flt_builder import one_square
from osg_builder import geode, geometry, scene
from overlaid import lamp, stage_file
from pxr import Usd, UsdGeom

from hdrusd.conversion import Result
from hdrusd.importers.importer import Resolver
from hdrusd.recipe.making import write_recipe
from hdrusd.report import Finding, Kind, Report

FOOT = 0.3048

OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
)
DAE = (
    '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">%s'
    '<library_lights><light id="l"><technique_common><point><color>1 1 1</color></point>'
    "</technique_common></light></library_lights><library_visual_scenes>"
    '<visual_scene id="s"><node><instance_light url="#l"/></node></visual_scene>'
    '</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>'
)


def osg(folder: Path) -> Path:
    path = folder / "a.osgt"
    path.write_text(scene(geode(geometry())))
    return path


def obj(folder: Path) -> Path:
    path = folder / "a.obj"
    path.write_text(OBJ)
    return path


def tds(folder: Path) -> Path:
    path = folder / "a.3ds"
    path.write_bytes(tds_builder.file(tds_builder.square()))
    return path


def ply(folder: Path) -> Path:
    path = folder / "a.ply"
    path.write_text(PLY)
    return path


def dae(folder: Path) -> Path:
    path = folder / "a.dae"
    path.write_text(DAE % "")
    return path


def flt(folder: Path, unit: int = 4) -> Path:
    path = folder / "a.flt"
    path.write_bytes(one_square(unit=unit))
    return path


def about(result: Result) -> list[Finding]:
    """The findings about units and axes."""
    codes = {"osg-axes", "obj-units", "3ds-units", "assimp-axes", "collada-asset", "flt-unit"}
    return [f for f in result.report if f.code in codes | {"source-measure"}]


Write = Callable[[Path], Path]
OPEN = [(osg, "osg-axes"), (obj, "obj-units"), (tds, "3ds-units"), (ply, "assimp-axes")]
OPEN += [(dae, "collada-asset")]


@pytest.mark.parametrize(("write", "code"), OPEN)
def test_what_nobody_states_is_said(tmp_path: Path, write: Write, code: str) -> None:
    source = write(tmp_path)
    (found,) = about(run(source))
    assert (found.kind, found.code) == (Kind.ASSUMED, code)
    assert "1 m" in found.text
    assert "up" in found.text
    (found,) = about(run(source, source_unit=0.01))
    assert "1 m" not in found.text
    assert "up" in found.text
    (found,) = about(run(source, up="Y"))
    assert "1 m" in found.text
    assert "up" not in found.text.replace("--up", "")


@pytest.mark.parametrize(("write", "code"), OPEN)
def test_what_is_stated_is_no_finding(tmp_path: Path, write: Write, code: str) -> None:
    """By options, by the photometry file, and by either the stage is what they say."""
    source = write(tmp_path)
    results = [run(source, source_unit=0.01, up="Y")]
    recipe(tmp_path, '[source]\nunit = 0.01\nup = "Y"\n')
    results += [run(source), run(source, shared=True)]
    recipe(tmp_path, "[source]\nunit = 0.01\n")
    results.append(run(source, up="Y"))
    for result in results:
        assert about(result) == []
        assert code not in result.report.codes()
        stage = opened(result)
        root = UsdGeom.Xformable(stage.GetDefaultPrim())
        assert root.ComputeLocalToWorldTransform(0).TransformDir((1, 0, 0))[0] == 0.01
        assert UsdGeom.GetStageUpAxis(stage) == "Y"


def test_an_unknown_unit_of_openflight_is_open(tmp_path: Path) -> None:
    source = flt(tmp_path, unit=3)
    assert [f.code for f in about(run(source))] == ["flt-unit"]
    assert about(run(source, source_unit=0.01)) == []


def test_the_recipe_of_a_source_with_its_measures(tmp_path: Path) -> None:
    report = Report()
    write_recipe(Resolver(osg(tmp_path), report), None, source_unit=0.01, up="Y")
    assert "osg-axes" not in report.codes()


# --- what the source states ---------------------------------------------------------------

ASKED: list[tuple[dict[str, Any], str, str]] = [
    ({"source_unit": 0.01}, "", "the file says 0.3048 m; 0.01 m is used, by option"),
    ({"up": "Y"}, "", "the file says Z up; Y up is used, by option"),
    ({}, "unit = 0.01", "the file says 0.3048 m; 0.01 m is used, by [source] unit"),
    ({}, 'up = "Y"', "the file says Z up; Y up is used, by [source] up"),
    ({"source_unit": 1.0}, "unit = 0.01", "the file says 0.3048 m; 1 m is used, by option"),
]


@pytest.mark.parametrize(("options", "said", "text"), ASKED)
def test_another_measure_than_the_files_is_used_and_said(
    tmp_path: Path, options: dict[str, Any], said: str, text: str
) -> None:
    recipe(tmp_path, f"[source]\n{said}\n")
    (found,) = about(run(flt(tmp_path), **options))
    assert (found.kind, found.code, found.text) == (Kind.REPLACED, "source-measure", text)


def test_the_files_own_measures_are_no_finding(tmp_path: Path) -> None:
    recipe(tmp_path, f'[source]\nunit = {FOOT}\nup = "Z"\n')
    source = flt(tmp_path)
    assert about(run(source, source_unit=FOOT, up="Z")) == []
    assert about(run(source, shared=True)) == []


def width(result: Result) -> float:
    """Of the scene, along X, in stage units."""
    stage = opened(result)
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"])
    return float(cache.ComputeWorldBound(stage.GetPseudoRoot()).ComputeAlignedRange().GetSize()[0])


def test_a_recipe_of_several_sources_replaces_nothing(tmp_path: Path) -> None:
    """A square of one foot keeps it; of several files' recipe that is no finding of one."""
    recipe(tmp_path, '[source]\nunit = 0.01\nup = "Y"\n')
    result = run(flt(tmp_path), shared=True)
    assert about(result) == []
    assert width(result) == pytest.approx(FOOT, rel=1e-6)
    assert UsdGeom.GetStageUpAxis(opened(result)) == "Z"
    assert [u.pattern for u in result.unmatched] == ["unit", "up"]
    (found,) = about(run(flt(tmp_path), shared=True, source_unit=0.01, up="Z"))
    assert found.code == "source-measure"


def test_the_measures_of_a_stage_are_its_own_too(tmp_path: Path) -> None:
    """It says metres and Z up; [source] of its own recipe, and options, go before it."""
    light = lamp("SphereLight", "float inputs:intensity = 100\nfloat inputs:radius = 0.1")
    source = stage_file(tmp_path / "town.usda", light)
    own = Usd.Stage.Open(str(source))
    unit, up = UsdGeom.GetStageMetersPerUnit(own), UsdGeom.GetStageUpAxis(own)
    other = "Y" if up == "Z" else "Z"
    recipe(tmp_path, f'[source]\nunit = {unit * 2}\nup = "{other}"\n')
    shared = run(source, tmp_path / "a.usda", shared=True)
    assert about(shared) == []
    assert UsdGeom.GetStageMetersPerUnit(opened(shared)) == unit
    alone = run(source, tmp_path / "b.usda")
    assert [f.code for f in about(alone)] == ["source-measure"] * 2
    assert UsdGeom.GetStageMetersPerUnit(opened(alone)) == unit * 2
    assert UsdGeom.GetStageUpAxis(opened(alone)) == other
