"""Makes the sequences for the eye: ``python samples/eye/make_sequences.py OUT``.

Writes ``tunnel.usda``, ``oncoming.usda``, ``lit_room.usda`` and what they refer to. The same
bytes each time.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import lit_room
import oncoming
import tunnel


def main() -> None:
    """Make the stages in the folder that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path, help="folder to write into; made when missing")
    out: Path = parser.parse_args().out
    for scene in (tunnel, oncoming, lit_room):
        print(scene.write(out))


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)
    except OSError as problem:
        sys.exit(f"{problem.filename or 'file'}: {problem.strerror or problem}")
