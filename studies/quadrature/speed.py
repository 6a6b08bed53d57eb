"""How fast is each engine of the sum over bonds, and how much faster than its NumPy form in the same run?

Strokes of 5 bond lengths, 2000 steps a cycle, one core of a machine shared with little else, CPU time. A step holds the
mean force along it (two passes or more over the list) and the force and energy at its end (one). The recursion takes 29
ns a step, 2400 times less than its NumPy form, on a field of 2000 points as well (3300 times). Of the lists, merged
to 0.02 (0.05) takes 1.1 (0.8) us for the stretch of order 2, 3.4 (2.1) us for order 0.5 and 3.2 (2.5) us for the
growing bonds of the print; cutting off alone 5 to 22 us. A list costs 3 to 12 ns a strip and step, of two Gauss
points each: 1 ns for a power and an exponential.

Run: OPENBLAS_NUM_THREADS=1 python studies/quadrature/speed.py
"""

from time import process_time
from typing import NamedTuple

import numpy as np

from patchfem.dynamics.march.models import list_model, load_kernels, points_model
from patchfem.friction.bonds.parameters import Bonds
from patchfem.friction.bonds.quadrature import Quadrature, cutoff
from patchfem.friction.bonds.recursion import Recursion

STEPS, CYCLES = 2000, 10
LEAST = 0.02  # s that are timed together: the clock of a process may tick in milliseconds
GROWS = {"ratio": 0.7, "rest_growth": 1.5, "slip_growth": 0.05, "rest_speed": 1e-2}


class Speed(NamedTuple):
    """Nanoseconds per step, per step and strip (or point), and the same step by NumPy over it."""

    name: str
    step: float
    each: float
    ratio: float


def path_of(amplitude: float, cycles: int = CYCLES, steps: int = STEPS) -> np.ndarray:
    """A harmonic slide in bond lengths."""
    return amplitude * np.sin(2 * np.pi * np.arange(cycles * steps + 1) / steps)


def compiled(model, path, dt: float, repeats: int = 3) -> tuple:
    """(seconds per step, strips of the list at the end, 1 without one) of the compiled loop."""
    loops, best = load_kernels(), np.inf
    for _ in range(repeats):
        spent, runs = 0.0, 0
        while spent < LEAST:
            contact = model.build()
            energies, forces = np.zeros((path.size, 2)), np.zeros((path.size, 3))
            begin = process_time()
            loops.follow_path(path, dt, model.kind, contact, 1e-11, energies, forces)
            spent, runs = spent + process_time() - begin, runs + 1
        best = min(best, spent / runs)
    tally = getattr(contact, "tally", np.zeros(11))  # points keep no list
    return best / (path.size - 1), max(tally[10] or tally[1] - tally[0], 1.0)


def plain(law, path, dt: float, points: int = 1) -> float:
    """Seconds per step of a NumPy law object over the last fiftieth of the path, its bonds made before."""
    state, sigma = law.start(np.ones(points)), np.ones(points)
    steps = np.diff(path)
    split = len(steps) - max(len(steps) // 50, 20)
    for dq in steps[:split]:
        state = law.carried(state, dq, sigma, sigma, dt) if isinstance(law, Quadrature) else law.step(
            state, dq, sigma, sigma, dt).state
    begin = process_time()
    for dq in steps[split:]:
        step = law.step(state, float(dq), sigma, sigma, dt)
        law.traction(step.state)
        state = step.state
    return (process_time() - begin) / (len(steps) - split)


def main(cycles: int = CYCLES, steps: int = STEPS) -> list:
    """Rows of the engines at A = 5 bond lengths, 2000 steps a cycle."""
    rows, path, dt = [], path_of(5.0, cycles, steps), 2 * np.pi / steps
    short = path_of(5.0, max(1, cycles // 5), steps)
    for order, reading, growth in ((2.0, "stretch", {}), (0.5, "stretch", {}), (1.0, "report", {}),
                                   (1.0, "report", GROWS), (2.0, "report", GROWS)):
        law = Bonds(1.0, 1.0, order, reading, initial=0.0, **growth)
        name = f"{reading} p = {order:g}{', growing' if growth else ''}"
        slow = plain(Quadrature(law, 1e-6), short, dt)
        for engine, merge in (("truncated", 0.0), ("merged .02", 0.02), ("merged .05", 0.05)):
            seconds, count = compiled(list_model(law, 1.0, cutoff(order, 1e-6), merge), path, dt)
            rows.append(Speed(f"{engine}, {name}", 1e9 * seconds, 1e9 * seconds / count, slow / seconds))
    law = Bonds(1.0, 1.0)
    for points in (1, 2000):
        seconds, _ = compiled(points_model(law, np.full(points, 1 / points), np.ones(points)), short, dt)
        rows.append(Speed(f"recursion, {points} points", 1e9 * seconds, 1e9 * seconds / points,
                          plain(Recursion(law), short, dt, points) / seconds))
    return rows


if __name__ == "__main__":
    for row in main():
        print(f"{row.name:42s} {row.step:8.0f} ns a step {row.each:8.2f} ns a strip or point {row.ratio:6.0f} x NumPy")
