"""Convert: emission maps of a material that reflects too, as a post of one mesh with its glass."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from builders import CODES, obj, png
from converted import opened, run, sidecar, surface, texture_file, texture_node
from pxr import Gf

from hdrusd.images import read_exr


@pytest.mark.parametrize("hdr", ["", "hdr_texture = true\n"])
def test_a_surface_with_a_map_of_its_own_for_what_glows_reflects(tmp_path: Path, hdr: str) -> None:
    """The luminance is that of full texels; where the map is dark the post is seen by others."""
    png(tmp_path / "post.png", CODES[1:])
    png(tmp_path / "glow.png", np.array([[[0, 0, 0], [255, 255, 255]]], np.uint8))
    sidecar(tmp_path, f'[[material]]\nmatch = "paint"\nluminance = 12000\n{hdr}')
    text = "Kd 0.5 1 0.25\nmap_Kd post.png\nmap_Ke glow.png"
    shader = surface(opened(run(obj(tmp_path / "post.obj", text))))
    glow, _ = read_exr(texture_file(shader, "emissiveColor"))
    node = texture_node(shader, "emissiveColor")
    assert node is not None
    shown = glow * np.array(node.GetInput("scale").Get())[:3]
    assert shown[0] == pytest.approx(np.array([[0.0] * 3, [12_000.0] * 3]), rel=2**-11)
    reflectance, _ = read_exr(texture_file(shader, "diffuseColor"))
    wanted = (CODES[1:] / 255.0) ** 2.2 * [0.5, 1.0, 0.25]
    assert reflectance == pytest.approx(wanted, rel=2**-11, abs=2**-25)


def test_a_surface_without_one_does_not(tmp_path: Path) -> None:
    """Its one picture is of the lamp as it shines: that is its luminance."""
    png(tmp_path / "glass.png")
    sidecar(tmp_path, '[[material]]\nmatch = "paint"\nluminance = 12000\n')
    shader = surface(opened(run(obj(tmp_path / "glass.obj", "Kd 1 1 1\nmap_Kd glass.png"))))
    assert shader.GetInput("diffuseColor").Get() == Gf.Vec3f(0.0)
    assert texture_node(shader, "diffuseColor") is None


@pytest.mark.parametrize(
    ("keys", "where", "nits", "said"),
    [
        ("luminance = 300", "full code", 300.0, " at full code (255 of 8 bits) of its picture by "),
        (
            *("luminance = 300\nhdr_texture = true", "brightest texel", 300.0),
            " in its picture's brightest texel by ",
        ),
        # The square of 1 m2 sends 300 pi lm: 300 cd/m2 on average, where 200 has (200/255)^2.2.
        (
            *("lumens = 942.477796", "full code", 300.0 / (200 / 255) ** 2.2),
            " at full code (255 of 8 bits) of its picture by ",
        ),
    ],
)
def test_the_report_says_where_a_surface_has_its_luminance(
    tmp_path: Path, keys: str, where: str, nits: float, said: str
) -> None:
    """Of a picture that is code 200 everywhere."""
    png(tmp_path / "glow.png", np.full((2, 2, 3), 200, np.uint8))
    stated = f'[[material]]\nmatch = "paint"\nprovenance = "estimated"\n{keys}\n'
    sidecar(tmp_path, stated)
    document = run(obj(tmp_path / "a.obj", "Kd 0 0 0\nKe 1 1 1\nmap_Ke glow.png")).as_dict()
    (row,) = document["materials"]
    assert (row["luminance_of"], row["luminance_cd_m2"]) == (where, pytest.approx(nits))
    (entry,) = (e for e in document["fix_first"] if e["what"].startswith("paint: "))
    assert f" cd/m2{said}" in entry["what"]


def test_without_a_picture_all_of_it_has_its_luminance(tmp_path: Path) -> None:
    (row,) = run(obj(tmp_path / "a.obj", "Kd 0 0 0\nKe 1 1 1")).materials
    assert row["luminance_of"] == "surface"
