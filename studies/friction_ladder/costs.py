"""What does a step of each law of the ladder cost? The least of several runs, A = 12.5 bond lengths, 200 steps a cycle.

Compiled, the constant bond length takes 16 ns with the energy of its bonds. Over it Coulomb takes 0.01, the
elastic-plastic law 0.5, the stretch 2.2, Iwan 0.9 (5 elements) to 2.9 (100), the report of constant length 38 and with
growth 460. In NumPy every law with a memory takes 0.03 to 0.06 ms, most of it calls. README.md has the whole table.

Run: python studies/friction_ladder/costs.py
"""

import sys
from pathlib import Path
from time import perf_counter

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import ladder_cycles as ladder
import path_kernels as loops
import today
from ladder_cycles import HERTZ, LENGTH

from patchfem.dynamics.march.models import list_model, load_kernels
from patchfem.friction.bonds.quadrature import Quadrature, cutoff
from patchfem.friction.bonds.recursion import Recursion
from patchfem.friction.laws.coulomb import Coulomb
from patchfem.friction.laws.elastic_plastic import ElasticPlastic, parallel
from patchfem.friction.laws.stretch import growth_numbers
from patchfem.friction.laws.tanh import Rate

STEPS, AMPLITUDE = 200, 12.5
BASE = "constant length (Dahl)"


def sine(cycles: int) -> np.ndarray:
    """Slide (k,) [m]."""
    return LENGTH * AMPLITUDE * np.sin(2 * np.pi * np.arange(cycles * STEPS + 1) / STEPS)


def compiled(cycles: int = 100, repeats: int = 7) -> dict:
    """name -> seconds per step, the least of `repeats`, of the compiled loops."""
    path, dt = sine(cycles), 1 / (HERTZ * STEPS)
    force = np.zeros(path.size)
    one = np.ones(1)
    runs = {"Coulomb": lambda: loops.coulomb(path, force), "tanh": lambda: loops.tanh(path, dt, 1e-3, force),
            "elastic-plastic": lambda: _elements(path, one / LENGTH, one * LENGTH, force)}
    laws = {BASE: ladder.bonds(), "LuGre": ladder.at_once(), "stretch": ladder.bonds(**ladder.GROWTH)}
    runs |= {name: lambda law=law: loops.bond(path, dt, growth_numbers(law), force) for name, law in laws.items()}
    soft = growth_numbers(ladder.bonds(breakaway=0.3))
    runs["constant, breakaway 0.3"] = lambda: loops.loose(path, soft, force)
    for n in (5, 10, 20, 50, 100):
        k, s = today.iwan_elements(n)
        runs[f"Iwan {n}"] = lambda k=k, s=s: _elements(path, k / LENGTH, s * LENGTH, force)
    runs |= {f"Bouc-Wen n = {n}, Runge-Kutta": lambda n=n: loops.bouc_wen(path / LENGTH, n, force) for n in (2, 5)}
    out = _least(runs, path.size - 1, repeats)
    short = sine(6)
    return out | _least({name: _list(law, short, dt) for name, law in {
        "report, constant": ladder.bonds(reading="report"),
        "report, growing": ladder.bonds(reading="report", **ladder.GROWTH)}.items()}, short.size - 1, 2)


def _elements(path, stiffness, yield_slide, force) -> None:
    one = parallel(stiffness, yield_slide)
    loops.jenkins(path, one.numbers[None], one.memory[None].copy(), force)


def _list(law, path, dt):
    def run():
        c, _ = list_model(law, 1.0, cutoff(1.0, 1e-6), 0.02).build(load_kernels())
        loops.listed(path, dt, c, np.zeros(path.size))
    return run


def _least(runs, steps, repeats) -> dict:
    best = dict.fromkeys(runs, np.inf)
    for turn in range(repeats + 1):  # the first turn compiles
        for name, run in runs.items():
            start = perf_counter()
            run()
            if turn:
                best[name] = min(best[name], (perf_counter() - start) / steps)
    return best


def plain(repeats: int = 3) -> dict:
    """name -> seconds per step of the NumPy forms of one point along two such cycles."""
    laws = {"Coulomb": Coulomb(1.0), "tanh": Rate(1.0, 1e-3), "elastic-plastic": ElasticPlastic(1.0, LENGTH),
            BASE: Recursion(ladder.bonds()), "LuGre": Recursion(ladder.at_once()),
            "stretch": Recursion(ladder.bonds(**ladder.GROWTH)),
            "sum over all bonds": Quadrature(ladder.bonds(**ladder.GROWTH), 1e-6)}
    path = sine(2)
    runs = {name: lambda law=law: _follow(law, path) for name, law in laws.items()}
    runs |= {f"Bouc-Wen n = {n}": lambda n=n: today.bouc_wen(path[:, None] / LENGTH, n) for n in (1, 2)}
    return _least(runs, path.size - 1, repeats)


def _follow(law, path) -> None:
    one, dt = np.ones(1), 1 / (HERTZ * STEPS)
    state = law.start(one)
    for dq in np.diff(path):
        state = law.step(state, dq, one, one, dt).state


def main() -> dict:
    """{"compiled" or "NumPy": {name: seconds per step}}, printed."""
    out = {"compiled": compiled(), "NumPy": plain()}
    for form, times in out.items():
        for name, time in times.items():
            print(f"{form:9} {name:28} {1e9 * time:10.1f} ns per step {time / times[BASE]:8.3f}")
    return out


if __name__ == "__main__":
    main()
