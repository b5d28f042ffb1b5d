"""Our small truth stages: every pixel of every frame against its closed form."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from truth.cases import check, read_cases, render_case
from truth_stages.closed_forms import (
    FOLDER,
    LAMPS,
    TRUTHS,
    behind_plates,
    document,
    from_ball,
    luminaire,
    plane,
    png,
    point_plane,
    radiance,
    shaded,
)

from hdrusd.job import Job
from hdrusd.render import render_sequence
from hdrusd.report import Report

#: Interpolation in float32 over a triangle and some forty operations; half floats of 8-bit
#: texels (2^-11 = 5e-4) need the most.
RELATIVE = 1e-3

#: m at a caster: two texels of a shadow map of 2048 over 2 tan(65 degrees), 3 m away, as in
#: spot_shadow; of instances they are those of a cube map of 1024, 2 m away, and smaller.
EDGE = 2 * 3.0 * 2 * 2.1445 / 2048


def frames(gl: Any, name: str, **options: Any) -> dict[float, np.ndarray]:
    job = Job(FOLDER / f"{name}.usda", list(map(float, TRUTHS[name].frames)), **options)
    return {frame.time: frame.hdr for frame in render_sequence(gl, job, Report())}


def undecided(name: str) -> np.ndarray:
    """(h, w) bool: pixels whose centre lies on an edge: the pentagon's oblique ones, a shadow's."""
    at = plane()
    if name == "spot_shadow":
        return np.asarray(shaded(at, EDGE) != shaded(at, -EDGE))[..., 0]
    if name == "sphere_light":  # the outline of a lamp is that of a polygon
        return np.asarray(np.abs(from_ball() - 0.6) < 1e-3 * 0.6)[..., 0]
    if name == "instances":
        lit = [
            [behind_plates(plane(z), lamp, grow) for lamp in LAMPS for z in (0.0, 0.1)]
            for grow in (EDGE, -EDGE)
        ]
        return np.any(np.not_equal(*lit), axis=(0, -1))
    off = np.abs(at[..., 1] + np.abs(at[..., 0] - 1.5) - 1.25)
    return np.asarray((name == "mesh_parts") & (off < 1e-9))


@pytest.mark.parametrize("name", TRUTHS)
def test_every_pixel_is_its_closed_form(gl: Any, name: str) -> None:
    for time, got in frames(gl, name).items():
        wanted = TRUTHS[name].closed_form(time)
        clear = ~undecided(name)
        np.testing.assert_allclose(got[clear], wanted[clear], rtol=RELATIVE, atol=1e-6)


def test_edges_are_where_the_geometry_is(gl: Any) -> None:
    """Panels end at pixel borders, so that not one pixel may be off."""
    got = frames(gl, "emissive")[0.0][..., 0] > 0.0
    np.testing.assert_array_equal(got, TRUTHS["emissive"].closed_form(0.0)[..., 0] > 0.0)


def test_petit2010_is_brighter_by_pi(gl: Any) -> None:
    """L = R E, the paper's own; Lambert's is R E / pi."""
    got = frames(gl, "point_plane", reflection="petit2010")[0.0]
    np.testing.assert_allclose(got, point_plane(0.0) * np.pi, rtol=1e-5)


def test_petit2010_leaves_emission_alone(gl: Any) -> None:
    got = frames(gl, "emissive", reflection="petit2010")[0.0]
    np.testing.assert_allclose(got[24, 32], [20000.0, 10000.0, 5000.0], rtol=1e-6)


def test_gamma_decodes_pictures_and_not_maps(gl: Any) -> None:
    got = frames(gl, "texture_spaces", gamma=1.8)[0.0]
    code = 128.0 / 255.0
    wanted = np.where(plane()[..., :1] < 0.0, code**1.8, code) * np.full(3, 10.0)
    np.testing.assert_allclose(got, wanted, rtol=RELATIVE)


# -- the format, and the program that runs it -------------------------------------------------


def test_expected_json_is_what_the_closed_forms_say() -> None:
    assert (FOLDER / "expected.json").read_text(encoding="utf-8") == document()
    assert (FOLDER / "code128.png").read_bytes() == png(128)
    assert (FOLDER / "two_tone.hdr").read_bytes() == radiance()
    assert (FOLDER / "luminaire.ies").read_text(encoding="utf-8") == luminaire()


def test_every_stage_has_a_closed_form() -> None:
    assert {path.stem for path in FOLDER.glob("*.usda")} == set(TRUTHS)


def test_checker_passes_right_frames_and_fails_wrong_ones(gl: Any, tmp_path: Path) -> None:
    """Scaled by pi is the typical mistake."""
    from hdrusd.images import read_exr, write_exr

    (case,) = [case for case in read_cases(FOLDER) if case.id == "point_plane"]
    render_case(gl, case, tmp_path, Report())
    assert check(case, tmp_path)[0]
    rgb, _ = read_exr(tmp_path / "point_plane.exr")
    write_exr(tmp_path / "point_plane.exr", rgb * np.pi)
    good, text = check(case, tmp_path)
    assert not good
    assert text.count("FAIL") == 4


def test_another_format_is_refused(tmp_path: Path) -> None:
    (tmp_path / "expected.json").write_text(json.dumps({"format": "other/1", "cases": []}))
    with pytest.raises(ValueError, match="want hdrusd-truth/1"):
        read_cases(tmp_path)
