"""An FBX file as ufbx opens it, and what all of its readers need: notes, checks of numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from hdrusd.errors import InputError, SourceRef
from hdrusd.importers.fbx_held import Held, hold
from hdrusd.importers.importer import Limits, Resolver
from hdrusd.report import Kind, Report

#: Largest magnitude that single precision holds with room to work.
LARGEST = 1e30
#: Of user properties: how many are kept, and how long their words may be.
_EXTRAS = 64
_EXTRA_TEXT = 200
_USER_DEFINED = 0x2
_NO_AXIS = 6


@dataclass(slots=True)
class Document:
    """One open file.

    ``up`` and ``unit_m`` are the file's; ``ufbx`` is the module, held, ``refusal`` what it raises.
    """

    resolver: Resolver
    report: Report
    ufbx: Held
    refusal: type[Exception]
    scene: Held
    up: Literal["Y", "Z"] = "Y"
    unit_m: float = 0.01
    up_stated: bool = True
    unit_stated: bool = True

    @property
    def limits(self) -> Limits:
        """What a hostile file may cost."""
        return self.resolver.limits

    def ref(self, *places: str) -> SourceRef:
        """A place by what it is called: FBX has neither lines nor paths that a user sees."""
        return SourceRef(self.resolver.source, "/".join(places) or None)

    def note(self, kind: Kind, code: str, place: SourceRef, thing: str, text: str) -> None:
        """A finding."""
        self.report.add(kind, code, place, thing, text)

    def number(self, value: float, default: float, place: SourceRef, what: str) -> float:
        """``value``, or ``default`` with a finding where it is no number to work with."""
        if math.isfinite(value) and abs(value) <= LARGEST:
            return value
        text = f"{what} is {value:g}; {default:g} is used"
        self.note(Kind.INVALID, "fbx-number", place, "", text)
        return default

    def numbers(
        self, values: tuple[float, ...], default: tuple[float, ...], place: SourceRef, what: str
    ) -> tuple[float, ...]:
        """As ``number``, for all or none of them."""
        if all(math.isfinite(v) and abs(v) <= LARGEST for v in values):
            return tuple(values)
        self.note(Kind.INVALID, "fbx-number", place, "", f"{what} is no number; not used")
        return default

    def application(self) -> str:
        """Which program made the file, as far as it says."""
        metadata = self.scene.metadata
        program = metadata.original_application
        return " ".join((f"{program.name} {program.version}".strip() or metadata.creator).split())


def open_document(resolver: Resolver, report: Report) -> Document:
    """Load ``resolver.source``. Raises InputError, with the reason that ufbx gives."""
    import ufbx  # only ever in a worker: see fbx_held

    module = hold(ufbx)
    data = resolver.read()
    options: dict[str, Any] = {
        "filename": resolver.source.name,
        "file_format": ufbx.FileFormat.FBX,
        "no_format_from_content": True,
        "node_depth_limit": resolver.limits.depth,
        "generate_missing_normals": True,
        "use_blender_pbr_material": True,
        # What USD has no word for is worked into points, scales and, at the last, nodes between.
        "geometry_transform_handling": ufbx.GeometryTransformHandling.MODIFY_GEOMETRY,
        "inherit_mode_handling": ufbx.InheritModeHandling.COMPENSATE,
        "geometry_transform_helper_name": "geometry",
        "scale_helper_name": "scale",
    }
    scene = _load(resolver, module, ufbx.UfbxError, data, options)
    document = Document(resolver, report, module, ufbx.UfbxError, scene)
    document.up, turned = _up(document)
    if turned:
        options |= {
            "target_axes": ufbx.axes_right_handed_y_up,
            "handedness_conversion_axis": ufbx.MirrorAxis.Z,
            "space_conversion": ufbx.SpaceConversion.TRANSFORM_ROOT,
        }
        document.scene = _load(resolver, module, ufbx.UfbxError, data, options)
    document.unit_m = _unit(document)
    _count(document)
    for warning in document.scene.metadata.warnings:
        text = f"{warning.description} ({warning.count} times)"
        document.note(Kind.INVALID, "fbx-warning", document.ref(), "", text)
    return document


def _load(
    resolver: Resolver,
    module: Held,
    refusal: type[Exception],
    data: bytes,
    options: Mapping[str, Any],
) -> Held:
    try:
        scene = module.load_memory(data, **options)
    except refusal as error:
        reason = f"{type(error).__name__.removesuffix('Error')}: {error}".strip(": ")
        text = f"ufbx cannot read it ({reason}); want a whole FBX file, 5.0 or newer"
        raise InputError(resolver.source, text) from error
    assert isinstance(scene, Held)
    return scene


def _count(document: Document) -> None:
    limits, scene = document.limits, document.scene
    if len(scene.nodes) > limits.nodes:
        raise InputError(document.ref(), f"more than {limits.nodes} nodes")
    if sum(mesh.num_vertices + mesh.num_faces for mesh in scene.meshes) > limits.vertices:
        raise InputError(document.ref(), f"more than {limits.vertices} points and faces")


#: Unit vectors by the number of a CoordinateAxis: +X, -X, +Y, -Y, +Z, -Z.
_AXES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))


def _up(document: Document) -> tuple[Literal["Y", "Z"], bool]:
    """The up axis, and whether the scene must be turned for it."""
    axes = document.scene.settings.axes
    right, up, front = (int(axis) for axis in axes)
    if _NO_AXIS in (right, up, front):
        document.up_stated = False
        if "up" not in document.resolver.stated:
            text = "no axis system in the file; +Y is up, as exporters of that age turned it"
            document.note(Kind.ASSUMED, "fbx-axes", document.ref(), "", text)
        return "Y", False
    (a, b, c), (d, e, f) = _AXES[right], _AXES[up]
    right_handed = (b * f - c * e, c * d - a * f, a * e - b * d) == _AXES[front]
    if right_handed and _AXES[up] in ((0, 1, 0), (0, 0, 1)):
        return ("Y" if _AXES[up][1] else "Z"), False
    words = "".join("+-"[axis % 2] + "XYZ"[axis // 2] for axis in (right, up, front))
    text = f"axes {words} (right, up, front); the scene is turned to right-handed, +Y up"
    document.note(Kind.REPLACED, "fbx-axes", document.ref(), "", text)
    return "Y", True


def _unit(document: Document) -> float:
    settings = document.scene.settings
    document.unit_stated = settings.props.find_prop("UnitScaleFactor") is not None
    if not document.unit_stated and "unit" not in document.resolver.stated:
        text = "no unit in the file; 1 unit is 1 cm, FBX's own"
        document.note(Kind.ASSUMED, "fbx-unit", document.ref(), "", text)
    unit = float(settings.unit_meters)
    if not 1e-9 <= unit <= 1e9:
        text = f"a unit of {unit:g} m; 1 cm is used"
        document.note(Kind.INVALID, "fbx-unit", document.ref(), "", text)
        document.unit_stated = False
        return 0.01
    return unit


def own_properties(element: Held) -> dict[str, Held]:
    """What a file says of an element itself, without its templates."""
    return {prop.name: prop for prop in element.props.props}


def user_properties(document: Document, element: Held, place: SourceRef) -> dict[str, Any]:
    """Short properties that somebody gave the element by hand, as numbers and words."""
    kept: dict[str, Any] = {}
    lost = 0
    for name, prop in own_properties(element).items():
        if not int(prop.flags) & _USER_DEFINED:
            continue
        word = prop.value_str
        size = {0x200000: 2, 0x400000: 3, 0x800000: 4}.get(int(prop.flags) & 0xF00000, 1)
        values = tuple(float(v) for v in prop.value_vec4)[:size]
        finite = all(math.isfinite(v) for v in values)
        if len(kept) >= _EXTRAS or max(len(word), len(name)) > _EXTRA_TEXT or not finite:
            lost += 1
        else:
            kept[name] = word or (values[0] if size == 1 else values)
    if lost:
        text = f"{lost} user properties dropped; {_EXTRAS} short ones are kept"
        document.note(Kind.DROPPED, "extras-dropped", place, element.name, text)
    return kept
