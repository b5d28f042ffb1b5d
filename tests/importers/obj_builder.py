"""OBJ and MTL files for tests: written to a folder, read back."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from hypothesis import HealthCheck, settings

from hdrusd.importers.importer import Limits, Resolver
from hdrusd.importers.obj import read
from hdrusd.legacy.scene import LegacyScene, Material, Mesh
from hdrusd.report import Finding, Report

#: Four corners of a unit square in the XY plane, with texture corners and one normal.
SQUARE = """\
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
"""


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"

#: For hypothesis: files are written, so an example takes its time.
quick = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


class Loaded(NamedTuple):
    """A scene and what was said about it."""

    scene: LegacyScene
    report: Report

    @property
    def mesh(self) -> Mesh:
        """The only mesh."""
        (mesh,) = self.scene.meshes
        return mesh

    @property
    def corner_points(self) -> list[list[float]]:
        """Where the corners of the only mesh are, face by face."""
        return self.mesh.points[self.mesh.face_indices].tolist()

    @property
    def material(self) -> Material:
        """The only material."""
        (material,) = self.scene.materials
        return material

    def findings(self, code: str) -> list[Finding]:
        """The findings of one code."""
        return [finding for finding in self.report if finding.code == code]

    def finding(self, code: str) -> Finding:
        """The only finding of one code."""
        (finding,) = self.findings(code)
        return finding


def load(path: Path, limits: Limits | None = None, roots: tuple[Path, ...] = ()) -> Loaded:
    """Read an OBJ file."""
    report = Report()
    resolver = Resolver(path, report, roots=roots, limits=limits or Limits())
    return Loaded(read(resolver, report), report)


def load_text(tmp_path: Path, content: str | bytes, limits: Limits | None = None) -> Loaded:
    """Write ``content`` as model.obj and read it."""
    path = tmp_path / "model.obj"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return load(path, limits)


def load_material(tmp_path: Path, statements: str) -> Loaded:
    """A square that wears the one material "m" with these statements."""
    (tmp_path / "model.mtl").write_text(f"newmtl m\n{statements}\n", encoding="utf-8")
    return load_text(tmp_path, f"mtllib model.mtl\n{SQUARE}usemtl m\nf 1/1/1 2/2/1 3/3/1 4/4/1\n")
