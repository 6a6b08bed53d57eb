"""Does a large sweep that is killed twice end with the same bytes as one that is not?

A sweep of static patches over the load, and one of Coulomb blocks over friction, each run over two workers. A second run of
each is killed with all its processes when a third of its cases is stored, resumed, killed at two thirds, and resumed to its
end. `sweep.nc`, with all values and errors, must be that of the first run.

Run: python studies/cluster/killed.py [--cases 1000000] [--out FOLDER]      (1e5 cases: 2 CPU minutes)
"""

import argparse
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from tempfile import mkdtemp

STUDIES = Path(__file__).parents[1]
BLOCK = """[normal]
load = "1 N"
[friction]
law = "coulomb"
static = 0.5
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "block"
frequency = "0.15915494309189535 Hz"
damping = 0.01
slide = 1.0
[drive]
kind = "base"
acceleration = "1 m/s^2"
frequency = "0.15915494309189535 Hz"
cycles = 200
[accuracy]
tolerance = 1e-3
"""
PIECES = (STUDIES / "rig/pieces.toml").read_text("utf-8")
SWEEPS = {
    "static": (PIECES, "contact.load=10 N..1000 N:{n}"),
    "Coulomb": (BLOCK, "friction.static=0.15..1.1:{n}"),
}
KILLED_AT = (1 / 3, 2 / 3)  # stored part of the cases at which a run is killed
POLL_SECONDS = 0.05  # short beside the time of a chunk


def start(scene: Path, over: str, out: Path, *options: str) -> subprocess.Popen:
    """Start a sweep over two workers in a process group of its own."""
    command = [sys.executable, "-m", "patchfem", "sweep", scene, "--over", over, "-o", out]
    command += ["-j", "2", "--keep", "none", "--no-page", "-q", *options]
    return subprocess.Popen(command, start_new_session=True)


def count_stored(out: Path) -> int:
    """Return the number of cases in the stored chunks of a sweep, which their names contain."""
    names = [path.name for path in (out / "chunks").glob("[!.]*.nc")]
    return sum(int(re.search(r"(\d+)\.nc$", name)[1]) for name in names)


def kill_at(process: subprocess.Popen, out: Path, count: int) -> int:
    """Kill a sweep when `count` cases are stored, and return their number; the sweep must not end before."""
    while count_stored(out) < count:
        if process.poll() is not None:
            raise SystemExit(f"the sweep ended before {count} cases were stored")
        time.sleep(POLL_SECONDS)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return count_stored(out)


def compare(kind: str, n: int, folder: Path) -> bool:
    """Run a sweep of n cases whole and killed twice below a folder, and return whether both end with the same bytes."""
    text, over = SWEEPS[kind]
    over = over.format(n=n)
    scene = folder / f"{kind}.toml"
    scene.write_text(text, "utf-8")
    whole, killed = (folder / f"{kind}_{end}" for end in ("whole", "killed"))

    begin = time.perf_counter()
    whole_code = start(scene, over, whole).wait()
    print(f"{kind}: {n} cases in {time.perf_counter() - begin:.0f} s", flush=True)
    options = ()
    for part in KILLED_AT:
        count = kill_at(start(scene, over, killed, *options), killed, int(part * n))
        print(f"{kind}: killed with {count} cases stored", flush=True)
        options = ("--resume",)
    code = start(scene, over, killed, *options).wait()

    is_equal = code == whole_code
    is_equal &= (whole / "sweep.nc").read_bytes() == (killed / "sweep.nc").read_bytes()
    print(f"{kind}: the bytes are {'equal' if is_equal else 'different'}", flush=True)
    return is_equal


def main() -> int:
    """Compare both kinds of sweeps; return 0 if both end with the same bytes."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cases", type=int, default=100_000, help="number of cases [100000]")
    parser.add_argument("--out", type=Path, help="folder of the sweeps [a temporary one]")
    parser.add_argument("--kind", choices=list(SWEEPS), action="append", help="kinds [both]")
    asked = parser.parse_args()
    folder = asked.out or Path(mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    answers = [compare(kind, asked.cases, folder) for kind in asked.kind or SWEEPS]
    return 0 if all(answers) else 1


if __name__ == "__main__":
    sys.exit(main())
