"""--variant: selections in the session layer, and one line that says what there is."""

from __future__ import annotations

from pathlib import Path

import pytest

from hdrusd.errors import InputError
from hdrusd.usd.opening import open_stage

STAGE = """#usda 1.0
def Xform "Car" (
    variants = { string paint = "red" }
    prepend variantSets = ["paint", "wheels"]
)
{
    variantSet "paint" = {
        "red" {
            double which = 1
        }
        "blue" (
            prepend variantSets = "finish"
        ) {
            double which = 2
            variantSet "finish" = {
                "matt" {
                    double finish = 3
                }
            }
        }
    }
    variantSet "wheels" = {
        "four" {
            double wheels = 4
        }
    }
}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    made = tmp_path / "car.usda"
    made.write_text(STAGE)
    return made


def value(file: Path, *variants: str, session: Path | None = None, name: str = "which") -> object:
    stage = open_stage(file, session=session, variants=variants)
    return stage.GetAttributeAtPath(f"/Car.{name}").Get()


def test_a_variant_is_selected_and_the_file_left_alone(file: Path) -> None:
    assert value(file) == 1.0
    assert value(file, "/Car:paint=blue") == 2.0
    assert file.read_text() == STAGE
    assert value(file) == 1.0  # nor does it stay in the layer that is open


def test_one_variant_may_bring_the_set_of_the_next(file: Path) -> None:
    assert value(file, "/Car:paint=blue", "/Car:finish=matt", name="finish") == 3.0


def test_the_users_session_layer_is_weaker_and_left_alone(file: Path, tmp_path: Path) -> None:
    session = tmp_path / "session.usda"
    text = '#usda 1.0\nover "Car" (\n    variants = { string paint = "red" }\n)\n{\n}\n'
    session.write_text(text)
    assert value(file, "/Car:paint=blue", session=session) == 2.0
    assert value(file, session=session) == 1.0
    assert session.read_text() == text


@pytest.mark.parametrize(
    ("choice", "wanted"),
    [
        ("/Car:paint=green", "--variant /Car:paint=green: no such variant; variants: blue, red"),
        ("/Car:hat=top", "--variant /Car:hat=top: no such variant set; sets: paint, wheels"),
        ("/Bus:paint=red", "no such prim; prims with variants: /Car"),
        ("paint=red", "want PRIM:SET=NAME, like /World/Car:paint=red"),
        ("/Car:paint", "want PRIM:SET=NAME"),
        ("/Car:paint=", "want PRIM:SET=NAME"),
        ("/C ar:paint=red", "want PRIM:SET=NAME"),
    ],
)
def test_what_is_not_there_is_one_line_that_says_what_is(
    file: Path, choice: str, wanted: str
) -> None:
    with pytest.raises(InputError) as caught:
        value(file, choice)
    assert str(caught.value).startswith("car.usda: --variant")
    assert wanted in str(caught.value)
    assert "\n" not in str(caught.value)
