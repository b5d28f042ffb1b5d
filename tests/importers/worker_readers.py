"""Readers for worker processes under test: a whole scene, and every way to go wrong."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import numpy as np

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.importer import Resolver
from hdrusd.legacy.scene import (
    TRS,
    Camera,
    Channel,
    Image,
    LegacyScene,
    Light,
    Material,
    Mesh,
    Node,
    Skin,
    Subset,
    Texture,
    UVTransform,
)
from hdrusd.report import Kind, Report


def everything(resolver: Resolver, report: Report) -> LegacyScene:
    """A scene with something in every kind of field."""
    source = resolver.source
    place = SourceRef(source, 7)
    report.add(Kind.DROPPED, "a-code", place, "a thing", "lost")
    report.add(Kind.MISSING, "b-code", SourceRef(source, "inside/it"), "", "not there")
    report.add(Kind.ASSUMED, "c-code", SourceRef(source), "", "so be it")
    pixels = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    named, drawn = Image("wall.png", place), Image("drawn", place, pixels=pixels)
    held = Image("held", SourceRef(source, "here"), data=b"\x89PNG held")
    paint = Material(
        "paint",
        place,
        diffuse=(0.5, 0.25, 0.125),
        diffuse_map=Texture(named, "st1", "mirror", transform=UVTransform((2.0, 3.0), 45.0)),
        emission_map=Texture(held),
        opacity_map=Texture(drawn, channel="a"),
        alpha_mode="blend",
        pbr={"metallic": 0.25},
        defaults=frozenset({"ambient", "shininess"}),
        extras={"note": "x", "list": (1, 2.5, None, True), "more": {"deep": ("y",)}},
    )
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    square = Mesh(
        "square",
        place,
        points,
        np.array([4, 3], np.int32),
        np.array([0, 1, 2, 3, 0, 2, 3], np.int32),
        normals=np.array([[0, 0, 1]], np.float32),
        normals_interpolation="constant",
        uvs={"st": (points[:, :2].copy(), "vertex"), "st1": (np.ones((7, 2), "f4"), "faceVarying")},
        colors=np.ones((2, 4), np.float32),
        colors_interpolation="uniform",
        subsets=(Subset(0, np.array([1], np.int32)),),
        joint_indices=np.array([[0, 1]] * 4, np.int32),
        joint_weights=np.array([[0.25, 0.75]] * 4, np.float32),
    )
    turns = np.array([[0, 0, 0, 1], [0, 0, 1, 0]], np.float64)
    tip = Node("tip", place, TRS((1.0, 2.0, 3.0)), lights=[0], visible=False)
    hip = Node(
        "hip",
        place,
        np.arange(16, dtype=np.float64).reshape(4, 4),
        children=[tip],
        animation=(Channel("rotation", np.array([0.0, 0.5]), turns, "step", "swing"),),
        kind="lod",
        lod_ranges=((0.0, 1e30),),
    )
    root = Node("root", place, children=[hip, Node("body", place, meshes=[0], skin=0)], cameras=[0])
    lamp = Light("lamp", place, "spot", spot_cutoff=30.0, attenuation=(1.0, 0.5, 0.25), candela=8.0)
    return LegacyScene(
        source,
        "test",
        [root, Node("second", place, switch_on=())],
        [square],
        [paint],
        [lamp],
        [Camera("eye", place, aspect=1.5)],
        skins=[Skin("skin", place, (tip, hip), np.stack([np.eye(4)] * 2))],
        up="Z",
        unit_m=0.0254,
        ambient=(0.1, 0.2, 0.3),
        generator="a test",
    )


def refusing(resolver: Resolver, report: Report) -> LegacyScene:
    """Raises InputError, as a reader does."""
    raise InputError(SourceRef(resolver.source, "byte 12"), "broken; want it whole")


def raising(resolver: Resolver, report: Report) -> LegacyScene:
    """Has a bug."""
    raise LookupError("no such thing")


def eating(resolver: Resolver, report: Report) -> LegacyScene:
    """Wants more memory than it may have."""
    return LegacyScene(resolver.source, str(len(bytearray(1 << 40))))


def dying(resolver: Resolver, report: Report) -> LegacyScene:
    """Crashes."""
    print("last words", flush=True)
    os.kill(os.getpid(), signal.SIGSEGV)
    raise AssertionError


def chatting(resolver: Resolver, report: Report) -> LegacyScene:
    """Prints 100 MB, then fails."""
    for _ in range(100):
        sys.stdout.write("x" * 1_000_000 + "\n")
    sys.stdout.flush()
    raise LookupError("said enough")


def garbage(resolver: Resolver, report: Report) -> LegacyScene:
    """Leaves something else than a scene."""
    Path("scene.json").write_bytes(b"\x00\xff{]")
    os._exit(0)


def nothing(resolver: Resolver, report: Report) -> LegacyScene:
    """Leaves nothing."""
    os._exit(0)


def telling(resolver: Resolver, report: Report) -> LegacyScene:
    """Says in its findings what it was given."""
    place = SourceRef(resolver.source)
    for name in sorted(os.environ):
        report.add(Kind.ASSUMED, "environment", place, name, os.environ[name])
    report.add(Kind.ASSUMED, "input", place, "", repr(sys.stdin.read()))
    report.add(Kind.ASSUMED, "group", place, "", str(os.getsid(0) == os.getpid()))
    outside = resolver.source.parents[1] / "outside.txt"
    try:
        report.add(Kind.ASSUMED, "outside", place, "", outside.read_text())
    except OSError as error:
        report.add(Kind.ASSUMED, "outside", place, "", type(error).__name__)
    try:
        resolver.source.with_name("written.txt").write_text("x")
    except OSError as error:
        report.add(Kind.ASSUMED, "written", place, "", type(error).__name__)
    return everything(resolver, report)
