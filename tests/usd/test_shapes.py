"""Implicit shapes against their closed forms: area, volume, extent, normals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from builders import new_stage
from pxr import Usd, UsdGeom

from hdrusd.report import Report
from hdrusd.usd.geometry import GeometryReader
from hdrusd.usd.shapes import SIDES, read_shape

TIME = Usd.TimeCode.Default()

#: Of an inscribed polygon of SIDES sides: perimeter and area relative to the circle's.
PERIMETER = SIDES / math.pi * math.sin(math.pi / SIDES)
AREA = SIDES / (2 * math.pi) * math.sin(2 * math.pi / SIDES)

R, H = 2.0, 3.0
SLANT = math.hypot(R, H)

#: (schema, attributes, area, volume, how far below the closed form a polygon of 48 sides may be)
SOLIDS: list[tuple[Any, dict[str, Any], float, float, float]] = [
    (UsdGeom.Cube, {"size": 3.0}, 54.0, 27.0, 0.0),
    (UsdGeom.Sphere, {"radius": R}, 4 * math.pi * R**2, 4 / 3 * math.pi * R**3, 0.006),
    (
        UsdGeom.Cylinder,
        {"radius": R, "height": H},
        2 * math.pi * R * (R + H),
        math.pi * R**2 * H,
        0.003,
    ),
    (
        UsdGeom.Cone,
        {"radius": R, "height": H},
        math.pi * R * (R + SLANT),
        math.pi * R**2 * H / 3,
        0.003,
    ),
    (
        UsdGeom.Capsule,
        {"radius": R, "height": H},
        2 * math.pi * R * (2 * R + H),
        math.pi * R**2 * (4 / 3 * R + H),
        0.006,
    ),
]


def define(schema: Any, **values: Any) -> Usd.Prim:
    prim = schema.Define(new_stage(), "/Shape").GetPrim()
    for name, value in values.items():
        prim.GetAttribute(name).Set(value)
    return prim


def triangles(prim: Usd.Prim) -> tuple[np.ndarray, np.ndarray]:
    """Corners (t, 3, 3) and normals (t, 3, 3) as the renderer gets them."""
    geometry = GeometryReader(prim, TIME, Report()).cut("shape", None, [], "", 0)
    assert geometry is not None
    return (
        geometry.points.reshape(-1, 3, 3).astype(np.float64),
        geometry.normals.reshape(-1, 3, 3).astype(np.float64),
    )


def usd_extent(prim: Usd.Prim) -> np.ndarray:
    """Low and high corner by USD itself."""
    return np.array(UsdGeom.Boundable.ComputeExtentFromPlugins(UsdGeom.Boundable(prim), TIME))


def area_and_volume(points: np.ndarray) -> tuple[float, float]:
    """Total area, and the signed volume, which is positive where faces look outwards."""
    a, b, c = points[:, 0], points[:, 1], points[:, 2]
    cross = np.cross(b - a, c - a)
    return (
        float(np.linalg.norm(cross, axis=1).sum() / 2),
        float(np.sum(a * np.cross(b, c)) / 6),
    )


@pytest.mark.parametrize(
    ("schema", "values", "area", "volume", "short"),
    [*SOLIDS, *[(s, v | {"axis": axis}, *rest) for s, v, *rest in SOLIDS[2:] for axis in "XYZ"]],
)
def test_area_and_volume(
    schema: Any, values: dict[str, Any], area: float, volume: float, short: float
) -> None:
    points, _ = triangles(define(schema, **values))
    got_area, got_volume = area_and_volume(points)
    # Inscribed: never more than the closed form, but for the rounding of points to float32.
    assert area * (1 - short - 1e-6) <= got_area <= area * (1 + 1e-6)
    assert volume * (1 - 1.5 * short - 1e-6) <= got_volume <= volume * (1 + 1e-6)


def test_a_cylinder_is_a_prism_of_48_sides() -> None:
    points, _ = triangles(define(UsdGeom.Cylinder, radius=R, height=H))
    area, volume = area_and_volume(points)
    assert area == pytest.approx(2 * math.pi * R * (R * AREA + H * PERIMETER), rel=1e-6)
    assert volume == pytest.approx(math.pi * R**2 * H * AREA, rel=1e-6)


@pytest.mark.parametrize(
    ("schema", "values", "area", "volume", "short"), SOLIDS, ids=[s[0].__name__ for s in SOLIDS]
)
def test_normals_look_outwards_and_are_unit(
    schema: Any, values: dict[str, Any], area: float, volume: float, short: float
) -> None:
    points, normals = triangles(define(schema, **values))
    cross = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    size = np.linalg.norm(cross, axis=1)
    real = size > 1e-9 * size.max()  # at the poles a side of the quads has no length
    assert np.linalg.norm(normals[real], axis=-1) == pytest.approx(1.0, abs=1e-6)
    flat = cross[real] / size[real][:, None]
    # A smooth normal leans from its facet by a step of the polygon at most, 7.5 degrees.
    lean = np.sum(normals[real] * flat[:, None], axis=-1)
    assert lean.min() > math.cos(math.radians(7.6)) - (0.35 if schema is UsdGeom.Cone else 0.0)


def test_a_sphere_s_normals_are_its_radii() -> None:
    points, normals = triangles(define(UsdGeom.Sphere, radius=R))
    assert normals * R == pytest.approx(points, abs=1e-6)


def test_a_cone_s_normals_lean_by_its_slope() -> None:
    # Square to the slant: height over slant outwards, radius over slant towards the apex.
    points, normals = triangles(define(UsdGeom.Cone, radius=R, height=H))
    side = normals[normals[:, 0, 2] > 0.0]
    assert side[..., 2] == pytest.approx(R / SLANT, abs=1e-6)
    assert np.hypot(side[..., 0], side[..., 1]) == pytest.approx(H / SLANT, abs=1e-6)
    assert points[..., 2].max() == pytest.approx(H / 2)
    apex = points[points[..., 2] > H / 2 - 1e-6]
    assert apex[:, :2] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("axis", "size", "normal"),
    # UsdGeomPlane: width is along x, or z where the axis is X; length along y, or z where it is Y.
    [
        ("X", [0.0, 5.0, 2.0], [1, 0, 0]),
        ("Y", [2.0, 0.0, 5.0], [0, 1, 0]),
        ("Z", [2.0, 5.0, 0.0], [0, 0, 1]),
    ],
)
def test_plane(axis: str, size: list[float], normal: list[int]) -> None:
    prim = define(UsdGeom.Plane, width=2.0, length=5.0, axis=axis)
    points, normals = triangles(prim)
    extent = points.reshape(-1, 3).max(axis=0) - points.reshape(-1, 3).min(axis=0)
    assert extent.tolist() == size
    assert normals.reshape(-1, 3) == pytest.approx(np.tile(normal, (6, 1)))
    usd = usd_extent(prim)
    assert extent == pytest.approx(usd[1] - usd[0])


@pytest.mark.parametrize("schema", [UsdGeom.Cylinder, UsdGeom.Cone, UsdGeom.Capsule])
@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
def test_extent_is_usd_s(schema: Any, axis: str) -> None:
    prim = define(schema, radius=1.0, height=5.0, axis=axis)
    points, _ = triangles(prim)
    usd = usd_extent(prim)
    assert points.reshape(-1, 3).min(axis=0) == pytest.approx(usd[0], abs=1e-6)
    assert points.reshape(-1, 3).max(axis=0) == pytest.approx(usd[1], abs=1e-6)


def test_left_handed_shapes_are_turned_inside_out() -> None:
    prim = define(UsdGeom.Cube, size=1.0)
    UsdGeom.Gprim(prim).CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    assert area_and_volume(triangles(prim)[0])[1] == pytest.approx(-1.0)


def test_other_prims_are_no_shapes() -> None:
    assert read_shape(define(UsdGeom.Mesh), TIME) is None
    assert read_shape(define(UsdGeom.Xform), TIME) is None


def test_an_animated_size_is_read_at_its_time() -> None:
    prim = define(UsdGeom.Cube)
    size = UsdGeom.Cube(prim).GetSizeAttr()
    size.Set(1.0, 0.0)
    size.Set(3.0, 2.0)
    shape = read_shape(prim, Usd.TimeCode(1.0))
    assert shape is not None
    assert shape.points.max() == 1.0
