"""What is uploaded for which material: channels, tiles, sizes."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt
import pytest

from hdrusd.gpu.textures import TextureCache, Uploaded, linear_texels
from hdrusd.scene import ImageData, Material, TextureRef, TextureUse

RNG = np.random.default_rng(11)
CODES = RNG.integers(0, 256, (4, 6, 4)).astype(np.uint8)
REF = TextureRef("a.png", "linear")

_VERTEX = """#version 330
void main() { gl_Position = vec4(0.0, 0.0, 0.0, 1.0); }"""
_FRAGMENT = """#version 330
uniform sampler2D image; uniform vec2 place; out vec4 value;
void main() { value = textureLod(image, place, 0.0); }"""


def sampled(gl: Any, uploaded: Uploaded, s: float, t: float) -> npt.NDArray[np.float32]:
    """What a shader reads at coordinates of the image, (4,)."""
    program = gl.program(vertex_shader=_VERTEX, fragment_shader=_FRAGMENT)
    target = gl.framebuffer([gl.texture((1, 1), 4, dtype="f4")])
    place = np.array([s, t]) * uploaded.scale + uploaded.offset
    with gl.scope(target):
        uploaded.texture.use(0)
        program["place"] = tuple(place)
        gl.vertex_array(program, []).render(moderngl.POINTS, 1)
        return np.frombuffer(target.read(components=4, dtype="f4"), np.float32)


def cache(gl: Any, image: ImageData, gamma: float = 2.2) -> TextureCache:
    return TextureCache(gl, lambda _: image, gamma)


def rough(channel: int, ref: TextureRef = REF) -> Material:
    return Material(roughness_map=TextureUse(ref, channel=channel))


@pytest.mark.parametrize("channel", [0, 1, 2, 3])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_one_channel_is_uploaded_alone(gl: Any, channel: int, channels: int) -> None:
    """UsdUVTexture: grey is repeated, alpha is 1 where there is none."""
    made = cache(gl, ImageData(CODES[..., :channels]))
    made.prepare([rough(channel)])
    uploaded = made.get(REF)
    assert uploaded is not None
    assert uploaded.texture.components == 1
    row, column = 3, 2  # the centre of a texel near the bottom
    got = sampled(gl, uploaded, (column + 0.5) / 6, (3 - row + 0.5) / 4)
    rgba = list(CODES[row, column, :channels] / 255.0)
    spread = {1: [*rgba * 3, 1.0], 2: [*rgba[:1] * 3, rgba[-1]], 3: [*rgba, 1.0], 4: rgba}
    np.testing.assert_allclose(got, np.repeat(spread[channels][channel], 4), rtol=2**-11)


def test_what_several_read_is_whole_and_decoded_once(gl: Any) -> None:
    calls: list[TextureRef] = []

    def load(ref: TextureRef) -> ImageData:
        calls.append(ref)
        return ImageData(CODES)

    made = TextureCache(gl, load, 2.2)
    made.prepare([rough(0), replace(rough(1), diffuse_map=TextureUse(REF))])
    made.prepare([rough(2)])
    uploaded = made.get(REF)
    assert uploaded is not None
    assert uploaded.texture.components == 4
    assert calls == [REF]


def test_a_channel_more_is_another_texture(gl: Any) -> None:
    made = cache(gl, ImageData(CODES))
    first, second = rough(0), rough(1)
    made.prepare([first])
    narrow = made.get(REF)
    made.prepare([first, second])
    wide = made.get(REF)
    assert narrow is not None
    assert wide is not None
    assert narrow is not wide
    np.testing.assert_allclose(
        sampled(gl, wide, 0.5 / 6, 0.5 / 4), CODES[3, 0] / 255.0, rtol=2**-11
    )
    # Whoever holds the first one may go on reading it.
    value = sampled(gl, narrow, 0.5 / 6, 0.5 / 4)[0]
    np.testing.assert_allclose(value, CODES[3, 0, 0] / 255.0, rtol=2**-11)


def test_what_no_material_names_is_released(gl: Any) -> None:
    """An animated file: of ten pictures two lists' are kept beside the present one's."""
    made = cache(gl, ImageData(CODES))
    refs = [TextureRef(f"{i}.png", "linear") for i in range(10)]
    for ref in refs:
        made.prepare((rough(0, ref),))
    assert list(made._kept) == refs[-3:]
    assert len(made._seen) == 3
    textures = [made.get(ref).texture for ref in refs[-3:]]  # type: ignore[union-attr]
    last = rough(0, refs[-1])
    for _ in range(4):
        made.prepare((last,))
    assert [isinstance(t.mglo, moderngl.mgl.InvalidObject) for t in textures] == [True, True, False]


def test_what_is_replaced_is_released_when_nobody_reads_it(gl: Any) -> None:
    made = cache(gl, ImageData(CODES))
    first, second = rough(0), rough(1)
    assert made.prepare((first,)) == frozenset()
    narrow = made.get(REF)
    assert narrow is not None
    assert made.prepare((first, second)) == {REF}
    assert narrow.texture.size == (6, 4)
    narrow.texture.use(0)  # still there
    for _ in range(3):
        assert made.prepare((first, second)) == frozenset()
    assert isinstance(narrow.texture.mglo, moderngl.mgl.InvalidObject)


def test_many_textures_are_decoded_in_threads_and_kept_apart(gl: Any) -> None:
    names: set[str] = set()

    def load(ref: TextureRef) -> ImageData | None:
        names.add(threading.current_thread().name)
        if ref.file == "7":
            return None
        return ImageData(np.full((2, 2, 1), int(ref.file) * 10, np.uint8))

    refs = [TextureRef(str(i), "linear") for i in range(12)]
    made = TextureCache(gl, load, 2.2)
    made.prepare([rough(0, ref) for ref in refs])
    assert threading.current_thread().name not in names
    for i, ref in enumerate(refs):
        uploaded = made.get(ref)
        if i == 7:
            assert uploaded is None
        else:
            assert uploaded is not None
            value = sampled(gl, uploaded, 0.5, 0.5)[0]
            assert value == pytest.approx(i * 10 / 255.0, rel=2**-11)


def test_one_channel_of_a_curve(gl: Any) -> None:
    """Colour is curved and alpha is not, alone as among others."""
    for channel, exponent in ((1, 2.2), (3, 1.0)):
        got = linear_texels(CODES, "gamma", 2.2, channel)[..., 0]
        whole = linear_texels(CODES, "gamma", 2.2)[..., channel]
        np.testing.assert_array_equal(got, whole)
        wanted = (CODES[::-1, :, channel] / 255.0) ** exponent
        np.testing.assert_allclose(got, wanted, rtol=2**-11, atol=2**-25)


# -- tiles --------------------------------------------------------------------------------


def flat(code: int, side: int = 4) -> ImageData:
    return ImageData(np.full((side, side, 3), code, np.uint8), integers=True)


def tiled(tiles: dict[tuple[int, int], ImageData]) -> ImageData:
    return ImageData(np.zeros((0, 0, 1), np.uint8), tiles=tiles)


def atlas(gl: Any, image: ImageData, fallback: tuple[float, ...] = (0, 0, 0, 1)) -> Uploaded:
    made = cache(gl, image)
    use = TextureUse(REF, fallback=fallback)  # type: ignore[arg-type]
    made.prepare([Material(diffuse_map=use)])
    uploaded = made.get(REF)
    assert uploaded is not None
    return uploaded


def test_tiles_lie_in_their_unit_squares(gl: Any) -> None:
    """Tile 1001 + u + 10 v covers [u, u + 1] x [v, v + 1]."""
    codes = {(2, 1): 50, (3, 1): 100, (2, 2): 150, (3, 2): 200}
    uploaded = atlas(gl, tiled({place: flat(code) for place, code in codes.items()}))
    for (u, v), code in codes.items():
        for s, t in ((0.2, 0.2), (0.8, 0.2), (0.2, 0.8), (0.8, 0.8)):
            got = sampled(gl, uploaded, u + s, v + t)[:3]
            np.testing.assert_allclose(got, code / 255.0, rtol=2**-11)


def test_no_tile_is_the_fallback(gl: Any) -> None:
    """Between the tiles and anywhere outside them."""
    fallback = (0.25, 0.5, 0.75, 0.125)
    uploaded = atlas(gl, tiled({(0, 0): flat(50), (1, 1): flat(100)}), fallback)
    for place in ((1.5, 0.5), (0.5, 1.5), (-0.5, 0.5), (7.5, 3.5), (0.5, -3.0)):
        np.testing.assert_array_equal(sampled(gl, uploaded, *place), fallback)


def test_smaller_tiles_are_as_large_as_the_others(gl: Any) -> None:
    picture = np.zeros((2, 2, 3), np.uint8)
    picture[0, 0] = 255  # top left
    uploaded = atlas(gl, tiled({(0, 0): flat(100, 8), (1, 0): ImageData(picture)}))
    assert uploaded.texture.size == (18, 10)
    assert sampled(gl, uploaded, 1.25, 0.75)[0] == 1.0
    assert sampled(gl, uploaded, 1.75, 0.75)[0] == 0.0
    assert sampled(gl, uploaded, 1.25, 0.25)[0] == 0.0


# -- size ---------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(8, 16), (7, 13), (1, 3)])
def test_halving_takes_the_mean_of_light(gl: Any, shape: tuple[int, int]) -> None:
    """Of reflectances, not of codes; an odd edge is repeated."""
    codes = RNG.integers(0, 256, (*shape, 3)).astype(np.uint8)
    made = cache(gl, ImageData(codes, halvings=2))
    uploaded = made.get(TextureRef("a.png", "gamma"))
    assert uploaded is not None
    h, w = shape
    padded = np.pad(codes, ((0, -h % 4), (0, -w % 4), (0, 0)), "edge") / 255.0
    wanted = (padded**2.2).reshape(-(-h // 4), 4, -(-w // 4), 4, 3).mean(axis=(1, 3))[::-1]
    data = np.frombuffer(uploaded.texture.read(), np.float16)
    got = data.reshape(*wanted.shape[:2], 4)[..., :3]
    # Half floats: 2^-11 for each of the 16, and for their mean once more.
    np.testing.assert_allclose(got, wanted, rtol=2**-10, atol=2**-24)


def test_a_large_texture_is_halved_in_strips(gl: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    codes = RNG.integers(0, 256, (21, 6, 1)).astype(np.uint8)
    ref = TextureRef("a.png", "linear")

    def texels(strip: int) -> bytes:
        monkeypatch.setattr("hdrusd.gpu.textures._STRIP", strip)
        uploaded = cache(gl, ImageData(codes, halvings=1)).get(ref)
        assert uploaded is not None
        return bytes(uploaded.texture.read())

    assert texels(1) == texels(10**6)


def test_a_software_device_filters_alike_in_all_directions(
    gl: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: Callable[[bool], Any] = lambda soft: lambda _: {"software": soft}  # noqa: E731
    for soft, wanted in ((True, 1.0), (False, min(16.0, gl.max_anisotropy))):
        monkeypatch.setattr("hdrusd.gpu.textures.describe", said(soft))
        uploaded = cache(gl, ImageData(CODES)).get(REF)
        assert uploaded is not None
        assert max(uploaded.texture.anisotropy, 1.0) == wanted  # moderngl: 0 as long as unset
