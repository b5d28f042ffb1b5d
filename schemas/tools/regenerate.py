"""Make generatedSchema.usda and plugInfo.json from schema.usda; ``--check`` only compares.

usdGenSchema is part of usd-core; it needs jinja2. Exit code 1 when ``--check`` finds
that the committed files are not what the source gives.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "hdrusd"

#: usdGenSchema leaves these for CMake. A codeless plug-in has no library, and its
#: resources lie beside its plugInfo.json.
PLACEHOLDERS = {
    "@PLUG_INFO_ROOT@": ".",
    "@PLUG_INFO_RESOURCE_PATH@": ".",
    "@PLUG_INFO_LIBRARY_PATH@": "",
}


def generate(source: Path) -> dict[str, str]:
    """The text of each generated file, by name."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pxr.Usd.usdGenSchema", "--quiet", str(source), folder]
        # Its warnings are about build files that a codeless plug-in has no use for.
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(done.stdout + done.stderr)
        schema = Path(folder, "generatedSchema.usda").read_text(encoding="utf-8")
        plug_info = Path(folder, "plugInfo.json").read_text(encoding="utf-8")
    for placeholder, value in PLACEHOLDERS.items():
        plug_info = plug_info.replace(placeholder, value)
    # The header of '#' lines is USD's own extension of JSON; without it any reader will do.
    lines = [line for line in plug_info.splitlines() if not line.startswith("#")]
    plain = json.dumps(json.loads("\n".join(lines)), indent=4) + "\n"
    return {"generatedSchema.usda": schema.rstrip("\n") + "\n", "plugInfo.json": plain}


def main() -> int:
    """Write the files, or name those that differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    check = parser.parse_args().check
    stale = []
    for name, text in generate(FOLDER / "schema.usda").items():
        path = FOLDER / name
        if path.is_file() and path.read_text(encoding="utf-8") == text:
            continue
        stale.append(name)
        if not check:
            path.write_text(text, encoding="utf-8")
    for name in stale:
        print(f"{name}: {'stale; run schemas/tools/regenerate.py' if check else 'written'}")
    return 1 if check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
