"""Do NLvib and TMDSimPy, given what `patchfem export` writes, find the steady motion that patchfem finds?

Yes: within what half of their harmonics and samples changes theirs by, and within the error stated here. Half the
peak-to-peak of the output (TMDSimPy at commit 17d5fc3f, NLvib at 69598c5e under Octave 7.3, 21 harmonics and 1024
samples):

| scene | patchfem | TMDSimPy | NLvib |
|---|---|---|---|
| three blades, 5544 unknowns, reduced | 2.0066673e-4 +- 1.3e-6 m | 2.0066710e-4 +- 3.6e-7 | 2.0066711e-4 +- 3.6e-7 |
| TMDSimPy's mass on Iwan's law, 0.25 rad/s | 4.44520929 +- 5.7e-7 m | 4.4451913 +- 4.1e-6 | 4.4451924 +- 3.2e-6 |
| NLvib's beam under tanh, 123.4 rad/s | 1.752135576e-6 +- 1.5e-14 m | no tanh | 1.752135576e-6 +- 2e-17 |

patchfem's error of the blades is that of the modes left out, which the exported matrices share; with 41 harmonics and
4096 samples TMDSimPy gives 2.00666507e-4 m. Iwan's law is exported as 48 elements at a tolerance of 1e-3, patchfem
balances the law itself: TMDSimPy gives 4.4452072 m with 192 and 4.4452082 m with 768 elements (tolerances of 1e-4 and
1e-5; 41 harmonics and 4096 samples).

Run: PATCHFEM_NLVIB=.../NLvib/SRC PATCHFEM_TMDSIMPY_PYTHON=... PATCHFEM_DATA=... python studies/substructures/readers.py
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import large
from peer import Peer, run

import patchfem as pf
from patchfem.core import Missing, NotConverged

HARMONICS, SAMPLES = 21, 1024
NLVIB = "PATCHFEM_NLVIB"
BLADES = {"force": 20.0, "frequency": 655.0}  # near the second of three frequencies
IWAN = """\
[normal]
load = "1 N"
[friction]
law = "iwan"
static = 0.2
stiffness = "0.25 N/m"
chi = -0.5
beta = 0.0
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "x"
frequency = "0.13783222385544802 Hz"
damping = 0.0057735026918962576
slide = 1.0
[drive]
kind = "force"
frequency = "0.039788735772973836 Hz"
force = "3.3 N"
cycles = 20
[accuracy]
method = "harmonic"
"""
BEAM = """\
[structure]
output_mass = 2
[structure.reduced]
stiffness = "beam.mat"
mass = "beam.mat"
damping = "beam.mat"
boundary = [5, 15]
modes = 14
[[structure.interface]]
between = [1, 0]
law = "tanh"
static = 1.0
load = "1.5 N"
reference_speed = "7.404e-5 m/s"
[drive]
kind = "force"
force = "0.2 N"
mass = 2
frequency = "19.639719967679255 Hz"
cycles = 5
[accuracy]
method = "harmonic"
"""


class Row(NamedTuple):
    """A scene, who solved it, half the peak-to-peak of the output [m], and its error: that which patchfem states, or
    what half the harmonics and samples change a peer's by."""

    scene: str
    program: str
    value: float
    error: float


def blades(folder: Path) -> Path:
    """Three blades of 5544 unknowns that rub at two places, reduced."""
    make, pairs, pushed, watched, _, coarse = large.STRUCTURES["three blades"]
    model = make(coarse)
    rows, _ = large.rows_of(model, pairs, pushed, watched)
    model.write(folder)
    interfaces = "".join(large.INTERFACE.format(between=(2 * k + 1, 2 * k + 2), load=load, stretch=stretch)
                         for k, (load, stretch) in enumerate(((20.0, 1e-6), (35.0, 2e-6))))
    return _written(folder, large.SCENE.format(boundary=[row + 1 for row in rows], modes=12, method="free-interface",
                                               pushed=5, watched=6, interfaces=interfaces, **BLADES))


def iwan(folder: Path) -> Path:
    """A mass on Iwan's law, example sdof_iwan_hysteresis of TMDSimPy, at 0.25 rad/s."""
    return _written(folder, IWAN)


def beam(folder: Path) -> Path:
    """A clamped beam with a regularized law, example 08 of NLvib, at 123.4 rad/s; its matrices are read from
    PATCHFEM_DATA. Missing where they are not there."""
    file = Path(os.environ.get("PATCHFEM_DATA", ".")) / "nlvib-beam.mat"
    if not file.is_file():
        raise Missing("PATCHFEM_DATA has no nlvib-beam.mat, the matrices of example 08 of NLvib")
    shutil.copy(file, folder / "beam.mat")
    return _written(folder, BEAM)


def _written(folder: Path, text: str) -> Path:
    (folder / "scene.toml").write_text(text)
    return folder / "scene.toml"


SCENES = {"three blades": blades, "mass on Iwan's law": iwan, "beam under tanh": beam}


def by_patchfem(scene: Path, folder: Path) -> tuple:
    """(value, error); the scene is exported to rig.mat and rig.npz."""
    one = pf.run(scene).measures["relative_displacement_amplitude"]
    for ending in (".mat", ".npz"):
        pf.export(scene, folder / f"rig{ending}")
    return one.value, one.error


def by_tmdsimpy(folder: Path, harmonics: int, samples: int) -> float:
    """Missing where TMDSimPy is not there, or has no such element."""
    with np.load(folder / "rig.npz") as file:
        if str(file["form"]) != "elements":
            raise Missing("TMDSimPy has no tanh element")
    with Peer("TMDSimPy", "substructures/tmdsimpy_child.py", "PATCHFEM_TMDSIMPY_PYTHON", sys.executable,
              "clone github.com/tmd-lab/tmdsimpy and put it on the path") as peer:
        return peer.ask(file=str(folder / "rig.npz"), harmonics=harmonics, samples=samples)["amplitude"]


def by_nlvib(folder: Path, harmonics: int, samples: int) -> float:
    """Missing where Octave or NLvib are not there."""
    octave, source = shutil.which("octave-cli") or shutil.which("octave"), os.environ.get(NLVIB, "")
    if octave is None or not (Path(source) / "HB_residual.m").is_file():
        raise Missing(f"install Octave, clone github.com/maltekrack/NLvib and name its folder SRC in {NLVIB} (now "
                      f"'{source}')")
    child = Path(__file__).parent / "nlvib_child.m"
    words = child, Path(source).resolve(), folder / "rig.mat", harmonics, samples
    found = subprocess.run([octave, "--no-gui", "--quiet", *map(str, words)], capture_output=True, text=True,
                           cwd=folder)  # where Octave leaves its workspace if it is killed
    if found.returncode or not found.stdout.strip().startswith("{"):
        raise NotConverged(f"NLvib: {found.stderr[-300:]}")
    return json.loads(found.stdout)["amplitude"]


PEERS = {"TMDSimPy": by_tmdsimpy, "NLvib": by_nlvib}


def compare(name: str) -> list:
    """Rows of patchfem and of the peers that are there; Missing where the scene's matrices are not."""
    with TemporaryDirectory() as folder:
        folder = Path(folder)
        value, error = by_patchfem(SCENES[name](folder), folder)
        rows = [Row(name, "patchfem", value, error)]
        for program, solve in PEERS.items():
            try:
                fine, coarse = (solve(folder, HARMONICS // k, SAMPLES // k) for k in (1, 2))
                rows.append(Row(name, program, fine, abs(fine - coarse)))
            except Missing as absent:
                print(f"{name}: {absent}", file=sys.stderr)
    return rows


def main(names=tuple(SCENES)) -> list:
    """Rows of all scenes, printed."""
    rows = []
    for name in names:
        try:
            new = compare(name)
        except Missing as absent:
            print(f"{name}: {absent}", file=sys.stderr)
            continue
        rows += new
        for row in new:
            print(f"| {row.scene} | {row.program} | {row.value:.9e} | {row.error:.1e} | "
                  f"{abs(row.value / new[0].value - 1):.1e} |", flush=True)
    return rows


if __name__ == "__main__":
    raise SystemExit(run(main))
