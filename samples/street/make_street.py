"""Makes the sample street: ``python samples/street/make_street.py OUTDIR``.

Writes ``street.osgt``, ``street.gltf`` with ``street.bin`` and ``textures/*.png``,
and copies ``photometry.toml`` and its luminaires beside them. The same bytes each time.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

from street_layout import street
from street_model import count_triangles, instances
from street_textures import write_textures
from write_gltf import write_gltf
from write_osgt import write_osgt

#: The photometric files that photometry.toml names.
LUMINAIRES = ("road_cutoff.ies", "shop_downlight.ldt")


def main() -> None:
    """Make the street in the folder that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("outdir", type=Path, help="folder to write into; made when missing")
    out: Path = parser.parse_args().outdir
    write_textures(out / "textures")
    root = street()
    write_osgt(root, out / "street.osgt")
    write_gltf(root, out / "street.gltf")
    here = Path(__file__).parent
    shutil.copyfile(here / "photometry.toml", out / "photometry.toml")
    (out / "luminaires").mkdir(exist_ok=True)
    for file in LUMINAIRES:
        shutil.copyfile(here / "luminaires" / file, out / "luminaires" / file)
    lights = sum(node.light is not None for node in instances(root))
    print(f"{out}: {count_triangles(root)} triangles, {lights} lights")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)
    except OSError as problem:
        sys.exit(f"{problem.filename or 'file'}: {problem.strerror or problem}")
