"""MTL materials: numbers, opacity, illumination models, texture statements, broken files.

Facts come from the MTL material format, version 4.2; defaults are those of the OpenGL record.
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from obj_builder import SQUARE, Loaded, load, load_material, load_text, quick

from hdrusd.errors import InputError
from hdrusd.legacy.scene import Texture, UVTransform
from hdrusd.report import Kind

PNG = b"\x89PNG"  # a reader of scenes looks for the file, not into it


def diffuse_map(loaded: Loaded) -> Texture:
    """The texture of map_Kd."""
    assert loaded.material.diffuse_map is not None
    return loaded.material.diffuse_map


# Numbers


def test_numbers_are_kept_as_they_stand(tmp_path: Path) -> None:
    colors = "\tKa 1 1 1\n\tKd 0.25 2.5 -1\n\tKs 0.5 0.5 0.5\n\tKe 20 10 5\n"
    loaded = load_material(tmp_path, f"{colors}\tNs 900\n\td 0.5\n\tillum 2")
    material = loaded.material
    assert material.name == "m"
    assert material.source.place == 1
    assert material.source.file == tmp_path / "model.mtl"
    assert material.ambient == (1, 1, 1)
    assert material.diffuse == (0.25, 2.5, -1)
    assert material.specular == (0.5, 0.5, 0.5)
    assert material.emission == (20, 10, 5)
    assert material.shininess == 900
    assert material.alpha == 0.5
    assert material.alpha_mode == "blend"
    assert material.lit
    assert not material.emission_cd_m2
    assert material.defaults == frozenset()
    assert material.pbr is None
    assert loaded.report.codes() == {"obj-units"}


def test_ambient_is_never_emission(tmp_path: Path) -> None:
    material = load_material(tmp_path, "Ka 1 1 1").material
    assert material.emission == (0, 0, 0)
    assert "emission" in material.defaults


def test_what_is_not_said_is_named(tmp_path: Path) -> None:
    material = load_material(tmp_path, "Kd 1 1 1").material
    assert material.defaults == {"ambient", "specular", "emission", "shininess", "alpha"}
    assert (material.ambient, material.specular) == ((0.2, 0.2, 0.2), (0, 0, 0))
    assert (material.shininess, material.alpha, material.alpha_mode) == (0, 1, "opaque")


@pytest.mark.parametrize(
    ("statement", "code"),
    [
        ("Kd nan 0 0", "mtl-number"),
        ("Kd 1 1e999 0", "mtl-number"),
        ("Kd", "mtl-number"),
        ("Kd 1 1", "mtl-number"),
        ("Kd red", "mtl-number"),
        ("Kd spectral paint.rfl 1.0", "mtl-color-form"),
        ("Kd xyz 0.5 0.5 0.5", "mtl-color-form"),
    ],
)
def test_a_color_that_cannot_be_used_is_the_default(
    tmp_path: Path, statement: str, code: str
) -> None:
    loaded = load_material(tmp_path, statement)
    assert loaded.material.diffuse == (0.8, 0.8, 0.8)
    assert "diffuse" in loaded.material.defaults
    finding = loaded.finding(code)
    assert finding.thing == "m"
    assert (finding.source.file.name, finding.source.place) == ("model.mtl", 2)


@pytest.mark.parametrize(
    ("statement", "color", "codes"),
    [
        ("Kd 0.5", (0.5, 0.5, 0.5), set()),  # "if only r is given, g and b are equal to r"
        ("kd 1 0 0", (1, 0, 0), set()),
        ("Kd 1 0 0 # red", (1, 0, 0), set()),
        ("Kd 1 \\\n 0 0", (1, 0, 0), set()),
        ("Kd 1 0 0 0.5", (1, 0, 0), {"mtl-extra-numbers"}),
        ("Kd 0,5 0 0", (0.5, 0, 0), {"decimal-comma"}),
        ("Kd 1 1 1\nKd 0 1 0", (0, 1, 0), {"mtl-repeated"}),
    ],
)
def test_forms_of_a_color(
    tmp_path: Path, statement: str, color: tuple[float, ...], codes: set[str]
) -> None:
    loaded = load_material(tmp_path, statement)
    assert loaded.material.diffuse == color
    assert loaded.report.codes() == {"obj-units"} | codes


@pytest.mark.parametrize(
    ("statements", "alpha", "codes"),
    [
        ("d 0.25", 0.25, set()),
        ("Tr 0.25", 0.75, set()),
        ("d 0.1000\nTr 0.9000", 0.1, set()),
        ("d 0.333\nTr 0.667", 0.333, set()),
        ("d 0.75\nTr 0.5", 0.75, {"mtl-opacity-conflict"}),
        ("Tr 0.5\nd 0.75", 0.75, {"mtl-opacity-conflict"}),
        ("d 1\nTr 1", 1, {"mtl-opacity-conflict"}),
        ("d -halo 0.5", 0.5, {"mtl-halo"}),
        ("d 1.5", 1, {"mtl-opacity"}),
        ("Tr 2", 0, {"mtl-opacity"}),
        ("d nan", 1, {"mtl-number"}),
        ("d nan\nTr 0.5", 0.5, {"mtl-number"}),
    ],
)
def test_opacity(tmp_path: Path, statements: str, alpha: float, codes: set[str]) -> None:
    loaded = load_material(tmp_path, f"Kd 1 1 1\n{statements}")
    assert loaded.material.alpha == alpha
    assert loaded.material.alpha_mode == ("opaque" if alpha == 1 else "blend")
    assert loaded.report.codes() == {"obj-units"} | codes


@pytest.mark.parametrize(
    ("illum", "lit", "specular", "kind"),
    [
        ("0", False, 1, None),  # color on and ambient off: constant colour
        ("1", True, 0, Kind.REPLACED),  # colour and ambient on, no highlight
        ("2", True, 1, None),
        ("3", True, 1, Kind.DROPPED),  # reflection
        ("10", True, 1, Kind.DROPPED),  # casts shadows onto invisible surfaces
        ("11", True, 1, Kind.INVALID),
        ("1.5", True, 1, Kind.INVALID),
    ],
)
def test_illumination_models(
    tmp_path: Path, illum: str, lit: bool, specular: float, kind: Kind | None
) -> None:
    loaded = load_material(tmp_path, f"Ks 1 1 1\nillum {illum}")
    assert loaded.material.lit == lit
    assert loaded.material.specular == (specular,) * 3
    assert [finding.kind for finding in loaded.findings("mtl-illum")] == ([kind] if kind else [])


@pytest.mark.parametrize(("text", "value"), [("-5", 0), ("nan", 0), ("1000", 1000), ("0.5", 0.5)])
def test_the_exponent(tmp_path: Path, text: str, value: float) -> None:
    loaded = load_material(tmp_path, f"Ns {text}")
    assert loaded.material.shininess == value
    assert ("mtl-number" in loaded.report.codes()) == (value == 0)


def test_pbr_beside_the_record(tmp_path: Path) -> None:
    loaded = load_material(tmp_path, "Kd 1 1 1\nPr 0.3\nPm 1\nPc 0.5\nPs 0.1")
    assert loaded.material.pbr == {"roughness": 0.3, "metallic": 1.0, "clearcoat": 0.5}
    assert loaded.finding("mtl-dropped").text.startswith("Ps:")
    coat = load_material(tmp_path, "Kd 1 1 1\nKs 1 1 1\nNs 20\nPc 0.5")  # of Phong's
    assert coat.material.pbr is None
    assert coat.finding("mtl-dropped").text.startswith("Pc:")


# Textures


@pytest.mark.parametrize(
    ("reference", "file"),
    [
        ("a.png", "a.png"),
        ("my wall  2.png", "my wall  2.png"),
        ("a.png   ", "a.png"),
        ('"my wall.png"', "my wall.png"),
        ("tex\\a.png", "tex/a.png"),
        (".\\tex\\a.png", "tex/a.png"),
        ("A.PNG", "a.png"),
        ("C:\\work\\a.png", "textures/a.png"),
    ],
)
def test_file_names(tmp_path: Path, reference: str, file: str) -> None:
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).write_bytes(PNG)
    loaded = load_material(tmp_path, f"Kd 1 1 1\nmap_Kd {reference}")
    image = diffuse_map(loaded).image
    assert image.path == (tmp_path / file).resolve()
    assert image.name == reference.strip().strip('"')
    assert image.source.place == 3


def test_a_missing_texture_keeps_its_reference(tmp_path: Path) -> None:
    loaded = load_material(tmp_path, "Kd 1 1 1\nmap_Kd gone.tga\nmap_Ke gone.tga")
    image = diffuse_map(loaded).image
    assert image.missing
    assert image.name == "gone.tga"
    finding = loaded.finding("file-missing")
    assert (finding.source.file.name, finding.source.place, finding.thing) == ("model.mtl", 3, "m")
    assert loaded.material.emission == (0, 0, 0)  # nothing shines for want of a file


@pytest.mark.parametrize("reference", ["/dev/zero", "/etc/passwd", "../" * 9 + "etc/passwd"])
def test_a_texture_outside_the_roots_is_refused(tmp_path: Path, reference: str) -> None:
    loaded = load_material(tmp_path, f"Kd 1 1 1\nmap_Kd {reference}")
    assert diffuse_map(loaded).image.missing
    assert loaded.finding("file-refused").source.place == 3


def test_textures_beside_the_obj_go_before_those_beside_the_mtl(tmp_path: Path) -> None:
    library = tmp_path / "mats"
    library.mkdir()
    statements = "newmtl m\nKd 1 1 1\nmap_Kd both.png\nmap_Ke own.png\nKe 1 1 1\nmap_d none.png\n"
    (library / "m.mtl").write_text(statements)
    for file in (tmp_path / "both.png", library / "both.png", library / "own.png"):
        file.write_bytes(PNG)
    loaded = load_text(tmp_path, f"mtllib mats/m.mtl\n{SQUARE}usemtl m\nf 1 2 3\n")
    assert diffuse_map(loaded).image.path == (tmp_path / "both.png").resolve()
    assert loaded.material.emission_map is not None
    assert loaded.material.emission_map.image.path == (library / "own.png").resolve()
    assert loaded.finding("file-missing").source.place == 6


def test_the_exact_place_beside_the_mtl_goes_before_a_guess_beside_the_obj(tmp_path: Path) -> None:
    exact, guess = tmp_path / "mats" / "sub" / "a.png", tmp_path / "textures" / "A.PNG"
    for file in (exact, guess):
        file.parent.mkdir(parents=True)
        file.write_bytes(PNG)
    (tmp_path / "mats" / "m.mtl").write_text("newmtl m\nKd 1 1 1\nmap_Kd sub/a.png\n")
    loaded = load_text(tmp_path, f"mtllib mats/m.mtl\n{SQUARE}usemtl m\nf 1 2 3\n")
    assert diffuse_map(loaded).image.path == exact.resolve()
    assert loaded.report.codes() == {"obj-units"}
    exact.unlink()
    loaded = load(tmp_path / "model.obj")
    assert diffuse_map(loaded).image.path == guess.resolve()
    assert loaded.finding("file-found-elsewhere").thing == "m"


@pytest.mark.parametrize(
    ("options", "transform", "wrap", "lost"),
    [
        ("", None, "repeat", ""),
        ("-s 2 3 1", UVTransform(scale=(2, 3)), "repeat", ""),
        ("-s 2", UVTransform(scale=(2, 1)), "repeat", ""),
        ("-o 0.5 -0.25", UVTransform(translation=(0.5, -0.25)), "repeat", ""),
        (
            "-S 2 2 1 -O .5 .5 0 -clamp ON",
            UVTransform(scale=(2, 2), translation=(0.5, 0.5)),
            "clamp",
            "",
        ),
        ("-s 1 1 1 -o 0 0 0 -clamp off", None, "repeat", ""),
        ("-clamp on", None, "clamp", ""),
        ("-mm 0 1 -t 0 0 0 -blendu on -blendv on -cc off -bm 1.0", None, "repeat", ""),
        ("-mm 0.1 2", None, "repeat", "-mm 0.1 2"),
        ("-t 1 1 1 -blendu off", None, "repeat", "-t 1 1 1, -blendu off"),
        ("-texres 512 -type sphere", None, "repeat", "-texres 512, -type sphere"),
        ("-s 2 2 2", UVTransform(scale=(2, 2)), "repeat", "-s 2 in depth"),
        ("-imfchan r -boost 2", None, "repeat", "-imfchan r, -boost 2"),
        ("-colorspace sRGB", None, "repeat", ""),
        ("-s 1e999", None, "repeat", "-s 1e999"),
    ],
)
def test_options(
    tmp_path: Path, options: str, transform: UVTransform | None, wrap: str, lost: str
) -> None:
    (tmp_path / "my wall.png").write_bytes(PNG)
    for text in (f"{options} my wall.png", f"my wall.png {options}"):
        loaded = load_material(tmp_path, f"Kd 1 1 1\nmap_Kd {text}")
        texture = diffuse_map(loaded)
        assert texture.image.path is not None
        assert texture.transform == transform
        assert (texture.wrap_s, texture.wrap_t) == (wrap, wrap)
        said = [finding.text for finding in loaded.findings("mtl-map-option")]
        assert said == ([f"map_Kd {lost}: no home for the options"] if lost else [])


@pytest.mark.parametrize("statement", ["map_Kd", "map_Kd -s 1 1 1", "map_Kd -clamp on"])
def test_a_texture_without_a_name(tmp_path: Path, statement: str) -> None:
    loaded = load_material(tmp_path, f"Kd 1 1 1\n{statement}")
    assert loaded.material.diffuse_map is None
    assert loaded.finding("mtl-map").source.place == 3


@pytest.mark.parametrize(
    ("statements", "channel"),
    [
        ("map_d mask.png", "r"),  # luminance is the default, and that of grey is its red
        ("map_d -imfchan l mask.png", "r"),
        ("map_d -imfchan m mask.png", "a"),
        ("map_d -imfchan g mask.png", "g"),
        ("map_Kd leaf.png\nmap_d leaf.png", "a"),
        ("map_Kd leaf.png\nmap_d -imfchan b leaf.png", "b"),
    ],
)
def test_the_channel_of_opacity(tmp_path: Path, statements: str, channel: str) -> None:
    loaded = load_material(tmp_path, f"Kd 1 1 1\n{statements}")
    assert loaded.material.opacity_map is not None
    assert loaded.material.opacity_map.channel == channel
    assert loaded.material.alpha_mode == "blend"
    guessed = "leaf" in statements and "imfchan" not in statements
    assert ("mtl-opacity-channel" in loaded.report.codes()) == guessed
    assert "mtl-map-option" not in loaded.report.codes()


def test_an_emission_map_without_a_factor_is_the_emission(tmp_path: Path) -> None:
    (tmp_path / "lamp.png").write_bytes(PNG)
    loaded = load_material(tmp_path, "Kd 1 1 1\nmap_Ke lamp.png")
    assert loaded.material.emission == (1, 1, 1)
    assert "emission" in loaded.material.defaults
    assert loaded.finding("mtl-emission-factor").kind is Kind.ASSUMED


@pytest.mark.parametrize(
    ("statements", "diffuse", "codes"),
    [
        ("map_Kd x.png", (1, 1, 1), {"mtl-diffuse-factor"}),
        ("Kd 0.5 0.5 0.5\nmap_Kd x.png", (0.5, 0.5, 0.5), set()),
        ("map_Kd gone.png", (0.8, 0.8, 0.8), {"mtl-diffuse-default", "file-missing"}),
        ("Ks 0 0 0", (0.8, 0.8, 0.8), {"mtl-diffuse-default"}),  # OpenGL 1.1, glMaterial
        ("Kd x\nmap_Kd x.png", (0.8, 0.8, 0.8), {"mtl-number"}),
    ],
)
def test_a_diffuse_map_without_a_factor_is_the_reflectance(
    tmp_path: Path, statements: str, diffuse: tuple[float, ...], codes: set[str]
) -> None:
    """Blender writes map_Kd alone, and means its texels."""
    (tmp_path / "x.png").write_bytes(PNG)
    loaded = load_material(tmp_path, statements)
    assert loaded.material.diffuse == diffuse
    assert loaded.report.codes() == codes | {"obj-units"}
    assert ("diffuse" in loaded.material.defaults) == bool(codes)


@pytest.mark.parametrize("statements", ["Ke 0 0 0\nmap_Ke x.png", "Kd 0 0 0\nmap_Kd x.png"])
def test_a_factor_of_zero_stays_and_is_said(tmp_path: Path, statements: str) -> None:
    (tmp_path / "x.png").write_bytes(PNG)
    loaded = load_material(tmp_path, statements)
    assert not any(loaded.material.emission)
    assert loaded.finding("mtl-zero-factor").text.startswith(statements[:2])


# What has no home, and broken libraries


def test_what_has_no_home_is_one_finding_and_metadata(tmp_path: Path) -> None:
    statements = {
        "Ni": "1.5",
        "Tf": "0.5 1 1",
        "Ps": "0.1",
        "bump": "-bm 2 b.png",
        "map_Ks": "s.png",
        "map_Ns": "n.png",
        "disp": "d.png",
        "refl": "-type sphere r.png",
    }
    loaded = load_material(tmp_path, "\n".join(" ".join(pair) for pair in statements.items()))
    assert loaded.material.extras == statements
    finding = loaded.finding("mtl-dropped")
    assert finding.kind is Kind.DROPPED
    assert finding.thing == "m"
    assert all(keyword in finding.text for keyword in statements)
    assert "file-missing" not in loaded.report.codes()


def test_a_filter_that_lets_all_through_loses_nothing(tmp_path: Path) -> None:
    assert load_material(tmp_path, "Kd 1 1 1\nTf 1 1 1.0").report.codes() == {"obj-units"}


def test_unknown_statements(tmp_path: Path) -> None:
    loaded = load_material(tmp_path, "glow 5\nglow2 6")
    assert loaded.finding("mtl-unknown").text.startswith("glow, glow2")
    assert loaded.material.extras == {"glow": "5", "glow2": "6"}


def test_statements_outside_a_material_and_double_names(tmp_path: Path) -> None:
    (tmp_path / "model.mtl").write_text(
        "Kd 1 1 1\nKs 1 1 1\nnewmtl m\nKd 1 0 0\nnewmtl m\nKd 0 1 0\nnewmtl\nKd 0 0 1\n"
    )
    loaded = load_text(tmp_path, f"mtllib model.mtl\n{SQUARE}usemtl m\nf 1 2 3\n")
    assert loaded.material.diffuse == (1, 0, 0)
    assert loaded.finding("mtl-stray").text.startswith("2 ")
    assert loaded.finding("mtl-duplicate").source.place == 5
    assert loaded.finding("mtl-nameless").source.place == 7


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_names_agree_across_encodings(tmp_path: Path, encoding: str) -> None:
    (tmp_path / "model.mtl").write_bytes("newmtl métal\r\nKd 1 0 0\r\n".encode(encoding))
    loaded = load_text(tmp_path, f"mtllib model.mtl\n{SQUARE}usemtl métal\nf 1 2 3\n")
    assert loaded.material.diffuse == (1, 0, 0)


def test_a_binary_library_gives_default_materials(tmp_path: Path) -> None:
    (tmp_path / "model.mtl").write_bytes(b"newmtl m\nKd 1 0 0\n\0")
    loaded = load_text(tmp_path, f"mtllib model.mtl\n{SQUARE}usemtl m\nf 1 2 3\n")
    assert loaded.material.diffuse == (0.8, 0.8, 0.8)
    assert loaded.finding("mtl-unreadable").source.file.name == "model.mtl"


VALID = b"""newmtl m
\tKa 0.2 0.2 0.2
\tKd 0.5 \\
 0.5 0.5
Ke 0 0 0
Ns 10
d 0.5
Tr 0.5
illum 2
map_Kd -s 2 2 1 -o 0.5 0 0 -clamp on a b.png
map_Ke lamp.png
map_d -imfchan m a.png
newmtl n
Kd spectral x.rfl
Pr 0.5
"""


@quick
@given(st.data())
def test_mutated_bytes_give_finite_materials(tmp_path: Path, data: st.DataObject) -> None:
    content = bytearray(VALID)
    for _ in range(data.draw(st.integers(1, 6))):
        begin = data.draw(st.integers(0, len(content)))
        end = data.draw(st.integers(begin, min(len(content), begin + 4)))
        piece = st.binary(max_size=4) | st.sampled_from(
            [b"\n", b"\\\n", b"nan", b"-", b"/dev/zero"]
        )
        content[begin:end] = data.draw(piece)
    (tmp_path / "model.mtl").write_bytes(bytes(content))
    obj = f"mtllib model.mtl\n{SQUARE}usemtl m\nf 1 2 3\n"
    try:
        scene = load_text(tmp_path, obj).scene
    except InputError as error:
        pytest.fail(f"the geometry was good: {error}")
    assert "m" in {material.name for material in scene.materials}
    for material in scene.materials:
        colors = (material.ambient, material.diffuse, material.specular, material.emission)
        assert all(math.isfinite(value) for color in colors for value in color)
        assert math.isfinite(material.shininess)
        assert 0.0 <= material.alpha <= 1.0
        assert all(math.isfinite(value) for value in (material.pbr or {}).values())
