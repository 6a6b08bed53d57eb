"""What do elastic-plastic elements and Iwan's law cost from yield to yield, beside steps and integrators with events?

Thirty random rigs of 1 to 5 modes, half of them with elements (1 to 100), half with Iwan's law in cells (5 to 100),
three cycles of a sine from rest, CPU time of one core of a shared machine. The engine of events takes 1.8 to 5.8 ms
and is exact: DOP853 at 1e-12 from reversal to reversal differs by 5e-9 at most, which is its own error where it steps
over the bends of yields (restarted at every yield it agrees to 1e-9: tests/dynamics/events). For 1e-6 of the slide
the march takes 2.5 times as long (1.1 to 6.5), DOP853 14 to 40 times and CVODE 5 to 17 times, where they come so near:
at a tolerance of 1e-8 and steps of a hundredth of a cycle DOP853 does not in 4 rigs, CVODE not in 12. For 1e-4 it is
1.3, 20 and 4 times; there the march is faster on 2 of the 30 (0.6 and 0.97 times as long).

Run: python studies/integrators/thirty_rigs.py [--full]      (6 of the rigs; --full: all thirty)
"""

import sys
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from engine_peers import PEERS, cvode
from engine_problems import Problem, march
from engines import dop853
from peer import Peer, run, seconds_at

from patchfem.core import BaseSine, Missing, ModalBasis
from patchfem.dynamics.events.elements import elements_of
from patchfem.dynamics.events.histories import simulate

RIGS, CYCLES, EQUAL = 30, 3, (1e-4, 1e-6)  # errors at which times are compared
STEPS, TOLERANCES, TRUTH = (100, 400, 1600, 6400), (1e-4, 1e-6, 1e-8), 1e-12
OTHERS = "march", "DOP853", "CVODE"


def elements(r, iwan: bool) -> tuple:
    """(stiffness (t,), yield slide (t,)) of random elements, or of Iwan's law with chi in -0.7 .. 0 in equal cells."""
    if not iwan:
        count = int(np.exp(r.uniform(0, np.log(100))))
        k, y = np.exp(r.uniform(-1, 1.5, count)), np.exp(r.uniform(-3, 1, count))
    else:
        count, chi = int(np.exp(r.uniform(np.log(5), np.log(100)))), r.uniform(-0.7, 0.0)
        borders = np.linspace(0, 1, count + 1)
        k, y = np.diff(borders**(chi + 1)), (borders[1:] + borders[:-1]) / 2
    return k * np.exp(r.uniform(-1.5, 0)) / (k @ y), y


def rig(seed: int) -> Problem:
    """A random rig; seeds that are odd have Iwan's law."""
    r = np.random.default_rng(seed)
    n = int(r.integers(1, 6))
    omega, zeta = np.sort(np.exp(r.uniform(-0.7, 1.5, n))), np.exp(r.uniform(np.log(0.001), np.log(0.3), n))
    slide, base = (r.uniform(0.2, 1.0, n) * r.choice([-1, 1], n) for _ in range(2))
    k, y = elements(r, bool(seed % 2))
    modes = ModalBasis(tuple(map(str, range(n))), omega, zeta, slide, base, slide, 1.0)
    drive = BaseSine(1.0, float(np.exp(r.uniform(-0.7, 0.7))))
    numbers = {"omega": omega.tolist(), "zeta": zeta.tolist(), "slide": slide.tolist(), "base": base.tolist(),
               "mass": 1.0, "drive": 1.0, "drive_omega": drive.omega, "stiffness": k.tolist(), "yields": y.tolist()}
    return Problem("patch", modes, drive, float(k @ y), CYCLES, numbers, (k, y), 1.0, 1 / 100, 1)


def pieces(one: Problem) -> np.ndarray:
    """The event engine of elements, with all that a run keeps."""
    window = simulate(one.modes, one.drive, [elements_of(*one.elements)], one.cycles, window=one.last).window
    return np.interp(one.times, window.time, window.slide)  # at its samples: 400 a cycle and every event


def timed(work, one: Problem, *knob) -> tuple:
    """(slide, CPU seconds) of an engine of ours, the least of two turns."""
    seconds = []
    for _ in range(2):
        begin = process_time()
        slide = work(one, *knob)
        seconds.append(process_time() - begin)
    return slide, min(seconds)


def compared(seed: int, peer=None) -> dict:
    """Of a rig: its number of elements, seconds from yield to yield, what DOP853 at 1e-12 differs by, and by name of
    another engine its seconds over those at EQUAL errors, NaN where it never comes so near."""
    one = rig(seed)
    slide, own = timed(pieces, one)
    one = replace(one, truth=slide)
    out = {"seed": seed, "law": "iwan" if seed % 2 else "elastic-plastic", "elements": len(one.elements[0]),
           "seconds": own, "apart": one.error(dop853(one, TRUTH))}
    curves = {"march": [timed(march, one, steps) for steps in STEPS],
              "DOP853": [timed(dop853, one, tolerance) for tolerance in TOLERANCES]}
    if peer is not None:
        curves["CVODE"] = [cvode(peer, one, tolerance) for tolerance in TOLERANCES]
    for name, points in curves.items():
        errors, seconds = zip(*((one.error(np.asarray(found)), time) for found, time in points))
        found = [seconds_at(error, errors, seconds) for error in EQUAL]
        out[name] = [time / own if sign != ">" else np.nan for time, sign in found]
    return out


def main(seeds=range(RIGS)) -> list:
    """Rows of `compared`, printed with their medians."""
    _, _, _, script, variable, remedy = PEERS["SUNDIALS CVODE"]
    try:
        peer = Peer("SUNDIALS CVODE", script, variable, sys.executable, remedy)
    except Missing as missing:
        print(missing, file=sys.stderr)
        peer = None
    timed(pieces, rig(0))  # compiled
    rows = [compared(seed, peer) for seed in seeds]
    if peer is not None:
        peer.__exit__()
    for row in rows:
        others = "  ".join(f"{name} {row[name][0]:.3g} {row[name][1]:.3g}" for name in OTHERS if name in row)
        print(f"{row['seed']:3d} {row['law']:15s} {row['elements']:4d} elements {1e3 * row['seconds']:7.2f} ms, DOP853 "
              f"apart {row['apart']:.1e}; times that for {EQUAL[0]:g} and {EQUAL[1]:g}: {others}")
    for law in ("elastic-plastic", "iwan"):
        mine = [row for row in rows if row["law"] == law]
        for name in OTHERS:
            ratios = np.array([row[name] for row in mine if name in row])
            if ratios.size:
                ends = [of(ratios, axis=0) for of in (np.nanmedian, np.nanmin, np.nanmax)]
                print(f"{law}, {name}: median {ends[0]}, least {ends[1]}, largest {ends[2]}, never so near in "
                      f"{np.isnan(ratios).sum(axis=0)} of {len(ratios)}")
    return rows


if __name__ == "__main__":
    sys.exit(run(main if "--full" in sys.argv[1:] else lambda: main(range(0, RIGS, 5))))
