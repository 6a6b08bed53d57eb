"""The event engine of one Coulomb mode at its resonance, beside other programs: damping .003, friction .8 of the drive,
200 cycles."""

import sys
from dataclasses import replace
from functools import cache
from math import inf
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
sys.path.insert(0, str(Path(__file__).parents[1] / "integrators"))
from engine_peers import PEERS, cvode
from engine_problems import exact, problem
from engines import dop853
from peer import Peer

from patchfem.compiled import load
from patchfem.dynamics.one_mode import orbit_kernels, sdof

PEAK = 0.28704671337871602595  # of stick-slip at resonance, by a 40-digit computation
CYCLES = 200
BATCH = 500  # runs of the compiled batch


def least(work, repeats: int = 5, inside: int = 1) -> float:
    """Least seconds of work() over several turns of `inside` calls; the first call of all compiles and is not taken."""
    work()
    best = inf
    for _ in range(repeats):
        start = process_time()
        for _ in range(inside):
            work()
        best = min(best, (process_time() - start) / inside)
    return best


def block():
    """The block of `engine_problems` over 200 cycles."""
    one = replace(problem("block"), cycles=CYCLES)
    return replace(one, truth=exact(one, 0))


@cache
def cycle_of_events() -> tuple:
    """(seconds per drive cycle of the compiled event engine in a batch of long runs, relative error of the peak)."""
    kernels = load("dynamics.one_mode.event_kernels")
    table = np.tile([1.0, 0.003, 0.8, 0.8, -1.0, 1.0, 0.0, 0.0, 0.0], (BATCH, 1))
    room = np.zeros((0, 10)), np.zeros(9), np.zeros((1, 6)), np.zeros((CYCLES, 2))
    size, books, ends = np.zeros((BATCH, 2)), np.zeros((BATCH, 10)), np.zeros((BATCH, 2))
    seconds = least(lambda: kernels.batch(table, float(CYCLES), 10, room, size, books, ends)) / (BATCH * CYCLES)
    return seconds, float(abs(np.abs(size[0]).max() / PEAK - 1))


@cache
def cycle_of_peer(name: str) -> float:
    """The same by DOP853 with events at 1e-8, or by the fastest run of CVODE that gets the slide to 1e-3: per cycle.

    Missing where SUNDIALS is not installed."""
    one = block()
    if name == "DOP853":
        return least(lambda: dop853(one, 1e-8), 2) / CYCLES
    _, _, _, script, variable, remedy = PEERS["SUNDIALS CVODE"]
    best = inf
    with Peer("SUNDIALS CVODE", script, variable, sys.executable, remedy) as peer:
        for method in ("Adams", "BDF"):
            for tolerance in (1e-4, 1e-6, 1e-8):
                for _ in range(2):
                    slide, seconds = cvode(peer, one, tolerance, method)
                    if one.error(slide) < 1e-3:
                        best = min(best, seconds)
    return best / CYCLES


def twin() -> float:
    """200 cycles by the plain Python of the event engine, histories and measures included [s]."""
    one = problem("block")
    return least(lambda: sdof.simulate(one.modes, one.drive, one.limit, one.limit, CYCLES))


@cache
def steady_point() -> tuple:
    """(seconds of a steady point by the event map, residual of its periodicity, seconds of the plain form)."""
    kernels = load("dynamics.one_mode.steady_kernels")
    row = [1.0, 0.003, 0.8, 0.8, -1.0, 1.0, 0.0, 0.0]
    count = 200
    table, found, phases = np.tile(row, (count, 1)), np.zeros((count, orbit_kernels.FOUND)), np.zeros((count, 16))
    room, answer = np.empty(orbit_kernels.OUT), np.zeros(orbit_kernels.FOUND)
    seconds = least(lambda: kernels.points(table, 4000, room, found, phases)) / count
    plain = least(lambda: orbit_kernels.point(*row, 4000, room, phases[0], answer), 3, 5)
    return seconds, float(max(found[0, 9], abs(found[0, 2] / PEAK - 1))), plain
