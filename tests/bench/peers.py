"""``python -m tests.bench.peers``: hdrusd beside its peers on one street, in one run.

The peers (Filament, three.js, OpenSceneGraph), their scripts and the street belong to the
extended test data ($HDRUSD_TESTDATA/bench; its README says how each is installed, into
$PEERS, by default ``.peers``). A peer that is not installed is skipped and named. No shadows
anywhere, for the peers draw none. Each job is a fresh process; CPU-ms are the steadier figure.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import click

from hdrusd.conversion import Options
from hdrusd.convert import convert

HERE = Path(__file__).parent


@click.command()
@click.option("--lights", default="1,20,100,400", show_default=True, help="Numbers of lights.")
@click.option("--size", default="1280x720", show_default=True, help="Pixels.")
@click.option("--rounds", default=2, show_default=True, help="Rounds, peers interleaved.")
@click.option("--frames", default=10, show_default=True, help="Frames timed a job.")
@click.option("--seq", default=0, show_default=True, help="Frames of a sequence on disk.")
@click.option("--exact/--no-exact", default=True, help="A row for --lights exact, too.")
def main(lights: str, size: str, rounds: int, frames: int, seq: int, exact: bool) -> None:
    """Print one table of frame times, start-up, memory and, with --seq, frames a second."""
    testdata = os.environ.get("HDRUSD_TESTDATA")
    if not testdata:
        raise click.UsageError("HDRUSD_TESTDATA is not set: the peers and their street lie there")
    bench = Path(testdata).resolve() / "bench"
    peers = Path(os.environ.get("PEERS", ".peers")).absolute()
    scene = peers / "scene"
    if not (scene / "lights_400.json").is_file():
        maker = peers / "core" / "bin" / "python"
        if not maker.is_file():
            raise click.UsageError(f"{peers}: no peers; {bench / 'README.md'} says how to install")
        subprocess.run([str(maker), str(bench / "make_scene.py"), str(scene)], check=True)
    for count in lights.split(","):
        stage = scene / "hdrusd" / f"street_{count}.usda"
        if not stage.is_file():
            stage.parent.mkdir(exist_ok=True)
            convert(scene / f"street_{count}.glb", stage, Options())
    jobs = []
    for mode in ("auto", "exact") if exact else ("auto",):
        script = f"{sys.executable} {HERE / 'street_peer.py'} --mode {mode}"
        jobs += ["--extra", f"hdrusd-{mode}={script}"]
    environment = {**os.environ, "PEERS": str(peers), "BENCH_SCENE": str(scene)}
    environment |= {"HDRUSD_PEERS_BENCH": str(bench), "THREE_DIR": str(peers / "threejs")}
    command = [sys.executable, str(bench / "run_all.py"), "--lights", lights, "--size", size]
    command += ["--rounds", str(rounds), "--frames", str(frames), "--seq", str(seq)]
    # Some of the peers' scripts take their own folders from where they are started.
    run = subprocess.run(
        [*command, "--out", str(peers / f"runs-{os.getpid()}"), "--timeout", "300", *jobs],
        env=environment,
        cwd=peers.parent,
        check=False,
    )
    sys.exit(run.returncode)


if __name__ == "__main__":
    main()
