"""Small stages for the validators, and what they find in them."""

from __future__ import annotations

import math

from pxr import Sdf, Usd

from hdrusd.checking import Problem, validate

METRES = '(defaultPrim = "World"\n metersPerUnit = 1\n upAxis = "Z")'

#: 1000 cd of a sphere of radius 0.05 m: 1000 / (pi 0.05^2) nits.
NITS = 1000.0 / (math.pi * 0.05**2)


def open_stage(text: str, head: str = METRES) -> Usd.Stage:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(f"#usda 1.0\n{head}\n{text}")
    return Usd.Stage.Open(layer)


def world(text: str, apis: str = "") -> Usd.Stage:
    return open_stage(f'def Xform "World" ({apis})\n{{\n{text}\n}}')


def light(kind: str, inputs: str, apis: str = '"HdrusdPhotometricLightAPI"') -> Usd.Stage:
    return world(f'def {kind}Light "Lamp" (prepend apiSchemas = [{apis}])\n{{\n{inputs}\n}}')


def found(stage: Usd.Stage) -> list[tuple[str, str, str]]:
    return [(problem.severity, problem.validator, problem.path) for problem in validate(stage)]


def only(stage: Usd.Stage) -> Problem:
    problems = validate(stage)
    assert len(problems) == 1, problems
    return problems[0]


AGREEING = {
    # Closed forms of the same number, for the radius, width and so on beside them.
    "Sphere": (
        f"float inputs:intensity = {NITS}\n float inputs:radius = 0.05\n"
        " float inputs:photometric:luminousIntensity = 1000"
    ),
    "Disk": (  # 100 nits of pi 0.5^2 m2
        "float inputs:intensity = 100\n float inputs:radius = 0.5\n"
        f" float inputs:photometric:luminousIntensity = {25 * math.pi}"
    ),
    "Rect": (  # 100 nits of 2 x 3 m
        "float inputs:intensity = 100\n float inputs:width = 2\n float inputs:height = 3\n"
        " float inputs:photometric:luminousIntensity = 600"
    ),
    "Cylinder": (  # 100 nits of 0.2 x 3 m seen from the side
        "float inputs:intensity = 100\n float inputs:radius = 0.1\n float inputs:length = 3\n"
        " float inputs:photometric:luminousIntensity = 60"
    ),
    "Distant": (  # 100 nits of pi sin^2(30 deg) sr
        "float inputs:intensity = 100\n float inputs:angle = 60\n"
        f" float inputs:photometric:illuminance = {25 * math.pi}"
    ),
    "Dome": (
        f"float inputs:intensity = 100\n float inputs:photometric:illuminance = {100 * math.pi}"
    ),
}
