"""Cameras of an OpenSceneGraph file: CameraView, a marked viewpoint, and Camera, a render pass.

Sources: OpenSceneGraph 3.6, src/osgWrappers/serializers/osg/CameraView.cpp, Camera.cpp;
OpenGL 2.1, section 2.11 (projection matrices), here for row vectors.
"""

from __future__ import annotations

import math

import numpy as np

from hdrusd.importers.osg_text import Document, Doubles, Statement
from hdrusd.legacy.scene import Camera
from hdrusd.report import Kind


def camera_view(document: Document, node: Statement, name: str) -> Camera:
    """A CameraView's camera; its field of view is vertical unless the file says HORIZONTAL."""
    fov = document.number(node, 60.0, "fieldofview")
    mode = document.word(node, "fieldofviewmode") or "VERTICAL"
    if mode == "HORIZONTAL":
        text = f"horizontal field of view {fov:g} and no aspect; read as vertical"
        document.add(Kind.ASSUMED, "osg-camera", node, name, text)
    if not 0.0 < fov < 180.0:
        text = f"field of view {fov:g}; want 0 to 180; 60 is used"
        document.add(Kind.INVALID, "osg-camera", node, name, text)
        fov = 60.0
    return Camera(name, document.ref(node), fov_y=fov)


def render_camera(document: Document, node: Statement, name: str) -> tuple[Camera, Doubles] | None:
    """The camera of an osg::Camera and its matrix, the inverse of the view matrix.

    None, with a finding, where the matrices are none of a camera.
    """
    view = _matrix(document, node, "viewmatrix")
    p = _matrix(document, node, "projectionmatrix")
    try:
        with np.errstate(all="ignore"):
            placed: Doubles = np.linalg.inv(view).astype(np.float64)
    except np.linalg.LinAlgError:
        placed = np.full((4, 4), math.nan)
    camera = _projection(document, node, name, p)
    if camera is None or not np.isfinite(placed).all():
        text = "view or projection is no camera's; dropped"
        document.add(Kind.DROPPED, "osg-camera", node, name, text)
        return None
    placed[:, 3] = (0.0, 0.0, 0.0, 1.0)
    return camera, placed


def _projection(document: Document, node: Statement, name: str, p: Doubles) -> Camera | None:
    ref = document.ref(node)
    across, up, depth, shift = float(p[0, 0]), float(p[1, 1]), float(p[2, 2]), float(p[3, 2])
    if not across > 0.0 or not up > 0.0:
        return None
    if p[2, 3] == -1.0 and p[3, 3] == 0.0 and depth not in (1.0, -1.0):
        near, far = shift / (depth - 1.0), shift / (depth + 1.0)
        fov = math.degrees(2.0 * math.atan(1.0 / up))
        made = Camera(name, ref, fov_y=fov, aspect=up / across, near=near, far=far)
    elif p[3, 3] == 1.0 and depth != 0.0:
        near, far = (shift + 1.0) / depth, (shift - 1.0) / depth
        made = Camera(
            name, ref, "orthographic", height=2.0 / up, aspect=up / across, near=near, far=far
        )
    else:
        return None
    numbers = (made.fov_y, made.height, made.aspect or 0.0, made.near, made.far)
    return made if all(map(math.isfinite, numbers)) else None


def _matrix(document: Document, node: Statement, key: str) -> Doubles:
    values = document.numbers(node, 16, key)
    return np.eye(4) if values is None else np.array(values, dtype=np.float64).reshape(4, 4)
