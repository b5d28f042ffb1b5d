"""The operator ocio: OpenColorIO's CPU processor against the GLSL that it writes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hdrusd.colour import srgb_encode
from hdrusd.errors import HdrusdError, ParameterError, UnknownNameError
from hdrusd.gpu.evaluate import evaluate
from hdrusd.gpu.ldr import ToneMapper
from hdrusd.gpu.program import Programs
from hdrusd.testing import check_operator
from hdrusd.tonemap import ocio
from hdrusd.tonemap.ocio import OPERATOR

#: A configuration that says nothing but what its view does.
CONFIG = """ocio_profile_version: 2
search_path: .
roles: {{default: linear, scene_linear: linear}}
displays:
  screen:
    - !<View> {{name: plain, colorspace: shown}}
colorspaces:
  - !<ColorSpace> {{name: linear, aliases: [lin_rec709]}}
  - !<ColorSpace>
    name: shown
    from_scene_reference: {transform}
"""

EXPOSED = np.random.default_rng(4).uniform(0.0, 1.3, (400, 3)).astype(np.float32)


@pytest.fixture
def library() -> Any:
    return pytest.importorskip("PyOpenColorIO", reason="the extra ocio is not installed")


def config_of(folder: Path, transform: str) -> dict[str, Any]:
    file = folder / "config.ocio"
    file.write_text(CONFIG.format(transform=transform), encoding="utf-8")
    return {"config": str(file), "scale": 1.0}


def on_gpu(gl: Any, params: dict[str, Any], rgb: np.ndarray) -> np.ndarray:
    moment = OPERATOR.moment(params)
    built = OPERATOR.built(moment.parameters)
    return evaluate(
        gl, built.glsl, built.function, {"rgb": rgb}, "vec3", uniforms=built.uniforms(moment)
    )


@pytest.mark.parametrize(
    "params",
    [
        {},
        {"view": "Un-tone-mapped", "ev100": -3.0},
        {"display": "Rec.2100-PQ - Display", "ev100": 2.0},
        {"config": "cg-config-v2.2.0_aces-v1.3_ocio-v2.4"},
    ],
)
def test_built_in_configurations(library: Any, gl: Any, params: dict) -> None:
    check_operator(OPERATOR, gl, params)


def test_view_without_tone_mapping_is_the_srgb_standard(library: Any) -> None:
    params = {"display": "sRGB - Display", "view": "Un-tone-mapped", "scale": 1.0}
    grey = np.linspace(0.0, 1.0, 50)[:, None] * np.ones(3)
    got = OPERATOR.apply(grey, None, params)
    # Matrices to ACES primaries and back in float32.
    np.testing.assert_allclose(got, srgb_encode(grey), rtol=0, atol=2e-6)


def test_grey_of_aces_2(library: Any) -> None:
    # Academy, ACES 2 output transform: 18 % grey is shown as 10 cd/m2 of 100, so 0.349 in sRGB.
    got = OPERATOR.apply(np.full((1, 3), 0.18), None, {"scale": 1.0})
    np.testing.assert_allclose(got, srgb_encode(0.1), rtol=0, atol=2e-3)


@pytest.mark.parametrize("size", [17, 1024, 5000])
def test_table_of_one_dimension(library: Any, gl: Any, tmp_path: Path, size: int) -> None:
    # 5000 entries do not fit into one row of a texture.
    curve = np.sqrt(np.linspace(0.0, 1.0, size))
    lines = ["Version 1", "From 0.0 1.0", f"Length {size}", "Components 1", "{"]
    lines += [*(f"{value:.8f}" for value in curve), "}"]
    (tmp_path / "curve.spi1d").write_text("\n".join(lines) + "\n", encoding="ascii")
    params = config_of(tmp_path, "!<FileTransform> {src: curve.spi1d, interpolation: linear}")
    got = on_gpu(gl, params, EXPOSED)
    wanted = np.interp(np.minimum(EXPOSED, 1.0), np.linspace(0.0, 1.0, size), curve)
    # The steepest step, near black, is sqrt(1 / size): times the rounding of its place.
    np.testing.assert_allclose(got, wanted, rtol=0, atol=2e-5)
    np.testing.assert_allclose(OPERATOR.apply(EXPOSED, None, params), wanted, rtol=0, atol=2e-5)


@pytest.mark.parametrize("interpolation", ["linear", "tetrahedral"])
def test_table_of_three_dimensions(
    library: Any, gl: Any, tmp_path: Path, interpolation: str
) -> None:
    n = 9
    values = np.random.default_rng(8).uniform(0.0, 1.0, (n**3, 3))
    text = f"LUT_3D_SIZE {n}\n" + "\n".join(" ".join(f"{v:.7f}" for v in row) for row in values)
    (tmp_path / "look.cube").write_text(text + "\n", encoding="ascii")
    transform = f"!<FileTransform> {{src: look.cube, interpolation: {interpolation}}}"
    params = config_of(tmp_path, transform)
    got, wanted = on_gpu(gl, params, EXPOSED), OPERATOR.apply(EXPOSED, None, params)
    # Eight cells a unit of random colours: a rounding of the place counts eightfold.
    np.testing.assert_allclose(got, wanted, rtol=0, atol=2e-5)
    # The corners of the cube are its first and last entries.
    corners = OPERATOR.apply(np.array([[0.0] * 3, [1.0] * 3]), None, params)
    np.testing.assert_allclose(corners, values[[0, -1]], rtol=0, atol=1e-6)


def test_picture_has_the_code_values(library: Any, gl: Any) -> None:
    mapper = ToneMapper(gl, Programs(gl))
    rgb = np.tile(EXPOSED[:64, None], (1, 48, 1))
    moment = OPERATOR.moment({"scale": 1.0})
    picture = mapper.apply_array(rgb, OPERATOR, moment)
    mapper.release()
    wanted = 255.0 * OPERATOR.apply(rgb, moment=moment)
    # Half a step of dither and half a step of rounding; nothing is encoded once more.
    assert np.abs(picture - wanted).max() <= 1.0


@pytest.mark.parametrize(
    ("params", "error", "message"),
    [
        ({"config": "aces"}, ParameterError, "ocio: config: aces: .*aces"),
        ({"config": "/no/such.ocio"}, ParameterError, "ocio: config: /no/such.ocio: "),
        ({"display": "sRGB"}, UnknownNameError, "ocio: display: sRGB: unknown; known: .*sRGB - "),
        ({"view": "Filmic"}, UnknownNameError, "ocio: view: Filmic: unknown; known: "),
        ({"source": "log"}, UnknownNameError, "ocio: source: log: unknown"),
    ],
)
def test_what_is_not_there(library: Any, params: dict, error: type, message: str) -> None:
    with pytest.raises(error, match=message) as caught:
        OPERATOR.check(params)
    assert "\n" not in str(caught.value)


def test_configuration_that_is_none(library: Any, tmp_path: Path) -> None:
    file = tmp_path / "broken.ocio"
    file.write_text("displays: [1, 2\n", encoding="utf-8")
    with pytest.raises(ParameterError, match="ocio: config: ") as caught:
        OPERATOR.check({"config": str(file)})
    assert "\n" not in str(caught.value)


def test_table_that_is_missing(library: Any, tmp_path: Path) -> None:
    params = config_of(tmp_path, "!<FileTransform> {src: gone.spi1d}")
    with pytest.raises(ParameterError, match=r"ocio: view: screen, plain: .*gone\.spi1d") as caught:
        OPERATOR.check(params)
    assert "\n" not in str(caught.value)


def test_configuration_without_linear_rec709(library: Any, tmp_path: Path) -> None:
    file = tmp_path / "other.ocio"
    text = CONFIG.format(transform="!<MatrixTransform> {}").replace("lin_rec709", "something")
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ParameterError, match=r"ocio: source: .* want a name"):
        OPERATOR.check({"config": str(file)})
    OPERATOR.check({"config": str(file), "source": "linear"})


def test_without_the_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "PyOpenColorIO", None)
    ocio._built.cache_clear()
    message = r"^ocio: PyOpenColorIO: not installed; want pip install hdrusd\[ocio\]$"
    with pytest.raises(HdrusdError, match=message):
        OPERATOR.check({})
