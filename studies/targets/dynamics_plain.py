"""The march in NumPy: what the compiled loop is compared with, step by step and in time."""

import sys
from collections.abc import Callable
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from dynamics_march import DRIVE, STEPS, basis, elements

from patchfem.core import ModalBasis
from patchfem.dynamics.propagator import propagator
from patchfem.friction.bonds.parameters import Bonds
from patchfem.friction.bonds.recursion import advance


def sharp(count: int) -> tuple:
    """(trial, memory) of parallel elements for `plain`."""
    k, y = elements(count)

    def trial(memory, dq):
        after = np.clip(memory + dq, -y, y)
        return 0.5 * (k @ memory + k @ after), 0.5 * k @ (after == memory + dq), after

    return trial, np.zeros(count)


def soft(count: int) -> tuple:
    """The same of the bonds of `bonded`."""
    law, sigma = Bonds(0.3, 0.2), np.full(count, 4.0)
    weight = np.full(count, law.static / law.length / count)

    def trial(memory, dq):
        after, mean, slope, _ = advance(memory, dq, sigma, law.length)
        return weight @ mean, weight @ slope, after

    return trial, np.stack([sigma, 0 * sigma, 0 * sigma])


def plain(modes: ModalBasis, law: tuple, steps: int = STEPS) -> tuple:
    """(seconds per step, slides (steps + 1,)) of the march in NumPy: the same propagator, Newton's method on the mean
    force of the step."""
    (trial, memory), n, drive = law, modes.omega.size, DRIVE
    prop = propagator(modes, drive, STEPS)
    table, beta = prop.tables(drive, 0, STEPS), float(prop.beta[0, 0])
    zz, zv, vz, vv = prop.free
    z, v, force, out = np.zeros(n), np.zeros(n), 0.0, [0.0]
    start = process_time()
    for row in np.resize(table, (steps, table.shape[1])):
        free = zz * z + zv * v + row[:n], vz * z + vv * v + row[n:2 * n]
        reach = modes.slide @ (free[0] - z)
        dq = reach - beta * force
        for _ in range(50):
            force, slope, after = trial(memory, dq)
            miss = dq - reach + beta * force
            if abs(miss) <= 1e-12:
                break
            dq -= miss / (1 + beta * slope)
        push = force / modes.mass * modes.slide
        z, v, memory = free[0] - prop.push[0] * push, free[1] - prop.push[1] * push, after
        out.append(float(modes.slide @ z))
    return (process_time() - start) / steps, np.array(out)


def per_step(modes: int, law: tuple) -> Callable:
    """The NumPy form of a march per step."""
    return lambda: min(plain(basis(modes), law)[0] for _ in range(2))
