"""Light and shadow links: numbers of lights and bits of surfaces, by USD's membership."""

from __future__ import annotations

from pxr import Sdf, Usd, UsdGeom, UsdLux

import hdrusd.usd  # noqa: F401 (registers the schemas before the first stage)
from hdrusd.report import Report
from hdrusd.scene import RenderScene, light_rows
from hdrusd.usd.extract import StageReader
from hdrusd.usd.linking import MOST_LINKS, Links

STAGES: list[Usd.Stage] = []


def street(lamps: int = 1) -> tuple[Usd.Stage, list[UsdLux.LightAPI]]:
    """A car of two parts, a house and lamps."""
    stage = Usd.Stage.CreateInMemory()
    STAGES.append(stage)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    for name in ("Car/Body", "Car/Glass", "House"):
        UsdGeom.Cube.Define(stage, f"/{name}")
    lights = [UsdLux.SphereLight.Define(stage, f"/Lamp{i}").GetPrim() for i in range(lamps)]
    return stage, [UsdLux.LightAPI(light) for light in lights]


def bits(links: Links, *paths: str) -> list[tuple[int, int]]:
    return [links.bits(Sdf.Path(path)) for path in paths]


def test_a_light_without_links_reaches_all() -> None:
    stage, (lamp,) = street()
    links = Links(stage, Report())
    assert links.note(lamp.GetPrim()) == (0, 0)
    # Authored, and everything all the same.
    lamp.GetLightLinkCollectionAPI().IncludePath("/Car")
    assert Links(stage, Report()).note(lamp.GetPrim()) == (0, 0)


def test_bits_are_those_of_usd_s_membership() -> None:
    stage, (one, two) = street(2)
    only = one.GetLightLinkCollectionAPI()
    only.CreateIncludeRootAttr(False)
    only.IncludePath("/Car")
    only.ExcludePath("/Car/Glass")
    two.GetShadowLinkCollectionAPI().ExcludePath("/House")
    links = Links(stage, Report())
    assert links.note(one.GetPrim()) == (1, 0)
    assert links.note(two.GetPrim()) == (0, 1)
    assert bits(links, "/Car/Body", "/Car/Glass", "/House") == [(1, 1), (0, 1), (0, 0)]
    rows = light_rows(3)
    links.assign(two.GetPrim(), rows)
    assert rows["link"].tolist() == [0, 0, 0]
    assert rows["shadow_link"].tolist() == [1, 1, 1]


def test_links_that_say_the_same_share_a_number() -> None:
    stage, lamps = street(40)
    for lamp in lamps:
        lamp.GetLightLinkCollectionAPI().ExcludePath("/House")
    links = Links(stage, Report())
    assert {links.note(lamp.GetPrim()) for lamp in lamps} == {(1, 0)}


def test_there_are_as_many_links_as_a_float_holds_bits() -> None:
    stage, lamps = street(MOST_LINKS + 2)
    for index, lamp in enumerate(lamps):
        lamp.GetLightLinkCollectionAPI().ExcludePath(f"/Thing{index}")
    report = Report()
    links = Links(stage, report)
    numbers = [links.note(lamp.GetPrim())[0] for lamp in lamps]
    assert numbers == [*range(1, MOST_LINKS + 1), 0, 0]
    assert [f.code for f in report] == ["light-linking"] * 2
    assert links.bits(Sdf.Path("/Thing0")) == (2**MOST_LINKS - 2, 0)


def test_any_lamp_may_leave_out_its_own_pole() -> None:
    stage, lamps = street(100)
    for index, lamp in enumerate(lamps):
        lamp.GetShadowLinkCollectionAPI().ExcludePath(f"/Pole{index}")
    report = Report()
    links = Links(stage, report)
    assert [links.note(lamp.GetPrim())[1] for lamp in lamps] == [*range(1, 101)]
    assert bits(links, "/Pole7/Mesh", "/Pole") == [(0, 2**100 - 1 - 2**7), (0, 2**100 - 1)]
    assert not report


def test_an_include_inside_an_exclude() -> None:
    stage, (lamp,) = street()
    shade = lamp.GetShadowLinkCollectionAPI()
    shade.ExcludePath("/Car")
    shade.IncludePath("/Car/Glass")
    links = Links(stage, Report())
    assert links.note(lamp.GetPrim()) == (0, 1)
    assert bits(links, "/Car/Body", "/Car/Glass", "/House") == [(0, 0), (0, 1), (0, 1)]


def test_shadow_links_that_need_a_query_are_few() -> None:
    stage, lamps = street(MOST_LINKS + 1)
    for index, lamp in enumerate(lamps):
        shade = lamp.GetShadowLinkCollectionAPI()
        shade.CreateIncludeRootAttr(False)
        shade.IncludePath(f"/Thing{index}")
    report = Report()
    links = Links(stage, report)
    numbers = [links.note(lamp.GetPrim())[1] for lamp in lamps]
    assert numbers == [*range(1, MOST_LINKS + 1), 0]
    assert [f.code for f in report] == ["light-linking"]


def test_expressions() -> None:
    stage, (lamp,) = street()
    collection = lamp.GetLightLinkCollectionAPI()
    collection.CreateIncludeRootAttr(False)
    collection.CreateMembershipExpressionAttr().Set(Sdf.PathExpression("//Glass"))
    links = Links(stage, Report())
    assert links.note(lamp.GetPrim()) == (1, 0)
    assert bits(links, "/Car/Glass", "/Car/Body") == [(1, 0), (0, 0)]


def test_a_scene_has_links_on_lights_and_surfaces() -> None:
    stage, (lamp,) = street()
    lamp.GetLightLinkCollectionAPI().ExcludePath("/House")
    reader = StageReader(stage, Report())
    scene: RenderScene = reader.read(0.0, reader.camera(None, 0.0, 1.0))
    assert scene.lights["link"].tolist() == [1]
    named = {d.geometry.key.split("#")[0]: d.links for d in scene.draws if d.casts}
    assert named == {"/Car/Body": 1, "/Car/Glass": 1, "/House": 0}
