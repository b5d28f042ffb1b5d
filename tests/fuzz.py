"""Coverage-guided fuzzing of the readers that run in our own process, by atheris.

    pip install atheris                       # Linux, Python 3.11 to 3.13
    python -m tests.fuzz ies|ldt|obj|mtl|gltf|glb|osgt|dae|3ds|flt|toml [SEEDS...] [-- LIBFUZZER...]

    python -m tests.fuzz ies samples/street/luminaires -- -max_total_time=60

SEEDS are folders of files to begin with. Only InputError, the documented answer to bad input,
may leave a reader; anything else, a hang of more than 10 s on one input, or more than 2 GB ends
the run with the input in a file ``crash-*``, ``timeout-*`` or ``oom-*`` of this folder. What was
found so is a test in tests/importers and tests/facts. The limits of a file are made small, so
that a run does not wait for what large files may take.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

try:
    import atheris
except ImportError:
    sys.exit("tests.fuzz: atheris is not installed; want pip install atheris")

with atheris.instrument_imports(include=["hdrusd"]):
    from hdrusd.errors import InputError, SourceRef
    from hdrusd.importers.importer import Limits, Resolver, read
    from hdrusd.photometry.eulumdat import read_eulumdat
    from hdrusd.photometry.ies import read_ies
    from hdrusd.photometry.sidecar import read_sidecar
    from hdrusd.report import Report

LIMITS = Limits(file_bytes=1 << 20, pixels=1 << 20, vertices=100_000, nodes=10_000, depth=64)

FOLDER = Path(tempfile.mkdtemp(prefix="hdrusd-fuzz-"))


def scene(suffix: str, beside: str = "") -> Callable[[bytes], object]:
    """A reader of 3D files; the bytes become ``beside``, a file that the source names, or it."""
    source = FOLDER / f"a{suffix}"
    if beside:
        source.write_text(f"mtllib {beside}\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl a\nf 1 2 3\n")
    target = FOLDER / beside if beside else source

    def one(data: bytes) -> object:
        target.write_bytes(data)
        report = Report()
        return read(Resolver(source, report, limits=LIMITS), report)

    return one


def photometric(reader: Callable[..., object]) -> Callable[[bytes], object]:
    """A reader of luminaires."""
    place = SourceRef(FOLDER / "a")
    return lambda data: reader(data, place, Report())


def recipe(data: bytes) -> object:
    """The photometry file."""
    file = FOLDER / "photometry.toml"
    file.write_bytes(data)
    return read_sidecar(file, Report())


TARGETS: dict[str, Callable[[bytes], object]] = {
    "ies": photometric(read_ies),
    "ldt": photometric(read_eulumdat),
    "mtl": scene(".obj", "a.mtl"),
    "toml": recipe,
} | {name: scene(f".{name}") for name in ("obj", "gltf", "glb", "osgt", "osg", "dae", "3ds", "flt")}


def main() -> None:
    """Fuzz one target until libFuzzer's limits are reached."""
    words = sys.argv[1:]
    cut = words.index("--") if "--" in words else len(words)
    target, *seeds = words[:cut] or [""]
    if target not in TARGETS:
        sys.exit(f"tests.fuzz: {target or 'nothing'}; want one of {', '.join(TARGETS)}")
    run = TARGETS[target]

    def one(data: bytes) -> None:
        with suppress(InputError):
            run(data)

    corpus = FOLDER / "corpus"
    corpus.mkdir()
    options = ["-timeout=10", "-rss_limit_mb=2048", "-max_len=20000", *words[cut + 1 :]]
    atheris.Setup(["tests.fuzz", str(corpus), *seeds, *options], one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
