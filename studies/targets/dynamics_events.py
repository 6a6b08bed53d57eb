"""The event engine of one Coulomb mode at its resonance, beside other programs: damping .003, friction .8 of the drive,
200 cycles."""

import sys
from dataclasses import replace
from functools import cache
from math import inf
from pathlib import Path
from time import process_time

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
sys.path.insert(0, str(Path(__file__).parents[1] / "integrators"))
from engine_peers import PEERS, cvode
from engine_problems import exact, problem
from engines import dop853
from peer import Peer

from patchfem.dynamics.events import histories, stick_steady
from patchfem.dynamics.events.elements import coulomb

PEAK = 0.28704671337871602595  # of stick-slip at resonance, by a 40-digit computation
CYCLES = 200
BATCH = 50  # runs of a batch


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
    """(seconds per drive cycle of the event engine in a batch of long runs, relative error of the peak)."""
    one = problem("block")
    cases = [(one.modes, one.drive, [coulomb(one.limit)], one.start)] * BATCH
    seconds = least(lambda: histories.briefly(cases, CYCLES, 10)) / (BATCH * CYCLES)
    done, = histories.briefly(cases[:1], CYCLES, 10)
    return seconds, abs(done.swing / PEAK - 1)


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


@cache
def steady_point() -> tuple:
    """(seconds of a steady point by the event map, the larger of its residual and the relative error of its peak)."""
    one = problem("block")
    given = one.modes, one.drive, [coulomb(one.limit)]
    found = stick_steady.steady(*given)
    return least(lambda: stick_steady.steady(*given)), max(found.residual, abs(found.amplitude / PEAK - 1))
