"""Which targets of the dynamics are met, on this machine, now?

All of accuracy. Of the times (CPU seconds of one core, a busy machine, least of several turns) those of the event
engine: 1.6 us for a cycle of stick-slip in a long run (wanted 3), 1400 to 1600 times less than DOP853 with events at
1e-8 and 650 to 850 times less than the fastest CVODE run (300), 19 ms for 200 cycles in plain Python (20), 6.8 us for
a steady point (10, 80 times less than its plain form). Of the march 195 ns per step for 100 elements on five modes
(200; 300 with the samples and energies that a run keeps), 185 ns for 30 elements on ten modes (300), 0.74 us for 200
points of bonds on ten modes (3) and 11 us with 16 shear modes (15). Harmonic balance of 100 elements with 15 harmonics
takes 1.2 ms a point (5), 12 to 25 times less than 200 cycles of the march.

Run: python studies/targets/dynamics.py [--alone]      (--alone: without the peers that are not Python's own)
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from math import inf
from pathlib import Path
from time import process_time

import numpy as np
from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parents[1] / "peers"))
sys.path.insert(0, str(Path(__file__).parents[1] / "integrators"))
import engines
from common import Peer

from patchfem.compiled import load
from patchfem.core import BaseSine, Missing, ModalBasis
from patchfem.dynamics.harmonic.forces import Group
from patchfem.dynamics.harmonic.laws import Jenkins
from patchfem.dynamics.harmonic.point import point
from patchfem.dynamics.march.march import Run
from patchfem.dynamics.march.models import jenkins_model, load_kernels, points_model
from patchfem.dynamics.one_mode import orbit_kernels, sdof
from patchfem.dynamics.propagator import propagator
from patchfem.friction.bonds.parameters import Bonds
from patchfem.friction.bonds.recursion import advance
from patchfem.slip.shear_modes import shear_modes

PEAK = 0.28704671337871602595  # of stick-slip at resonance, by a 40-digit computation
CYCLES, STEPS = 200, 400
DRIVE = BaseSine(1.5, 1.0)
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


# ---- one mode with Coulomb friction at its resonance: damping .003, friction .8 of the drive, 200 cycles

def block():
    """Problem of `engines` of 200 cycles."""
    one = replace(engines.problem("block"), cycles=CYCLES)
    return replace(one, truth=engines.exact(one, 0))


@cache
def cycle_of_events() -> tuple:
    """(seconds per drive cycle of the compiled event engine in a batch of long runs, relative error of the peak)."""
    kernels = load("dynamics.one_mode.event_kernels")
    table = np.tile([1.0, 0.003, 0.8, 0.8, -1.0, 1.0, 0.0, 0.0, 0.0], (BATCH, 1))
    size, books, ends = np.zeros((BATCH, 2)), np.zeros((BATCH, 10)), np.zeros((BATCH, 2))
    seconds = least(lambda: kernels.batch(table, float(CYCLES), 10, size, books, ends)) / (BATCH * CYCLES)
    return seconds, float(abs(np.abs(size[0]).max() / PEAK - 1))


@cache
def cycle_of_peer(name: str) -> float:
    """The same by DOP853 with events at 1e-8, or by the fastest run of CVODE that gets the slide to 1e-3: per cycle.

    Missing where SUNDIALS is not installed."""
    one = block()
    if name == "DOP853":
        return least(lambda: engines.dop853(one, 1e-8), 2) / CYCLES
    _, _, _, script, variable, remedy = engines.PEERS["SUNDIALS CVODE"]
    best = inf
    with Peer("SUNDIALS CVODE", f"../integrators/{script}", variable, sys.executable, remedy) as peer:
        for method in ("Adams", "BDF"):
            for tolerance in (1e-4, 1e-6, 1e-8):
                for _ in range(2):
                    slide, seconds = engines.cvode(peer, one, tolerance, method)
                    if one.error(slide) < 1e-3:
                        best = min(best, seconds)
    return best / CYCLES


def twin() -> float:
    """200 cycles by the plain Python of the event engine, histories and measures included [s]."""
    one = engines.problem("block")
    return least(lambda: sdof.simulate(one.modes, one.drive, one.limit, one.limit, CYCLES))


@cache
def steady_point() -> tuple:
    """(seconds of a steady point by the event map, residual of its periodicity, seconds of the plain form)."""
    kernels = load("dynamics.one_mode.steady_kernels")
    row = [1.0, 0.003, 0.8, 0.8, -1.0, 1.0, 0.0, 0.0]
    count = 200
    table, found, phases = np.tile(row, (count, 1)), np.zeros((count, 12)), np.zeros((count, 16))
    seconds = least(lambda: kernels.points(table, 4000, found, phases)) / count
    room, answer = np.empty(orbit_kernels.OUT), np.zeros(12)
    plain = least(lambda: orbit_kernels.point(*row, 4000, room, phases[0], answer), 3, 5)
    return seconds, float(max(found[0, 9], abs(found[0, 2] / PEAK - 1))), plain


# ---- the march

def basis(count: int) -> ModalBasis:
    """Modes whose slides and base add up, the first at 1 rad/s."""
    k = np.arange(count)
    slide = np.array([1.0, 0.7, -0.5, 0.4, 0.3, -0.3, 0.2, 0.2, -0.1, 0.1])[:count]
    return ModalBasis(tuple(f"mode {i + 1}" for i in k), 1.0 + 1.4 * k + 0.1 * k**2, np.full(count, 0.02), slide,
                      0.6 * slide, slide, 1.0)


def elements(count: int) -> tuple:
    """(stiffness, yield slide) of parallel elements with a limit of 1.2 in all, a few of them stuck for ever."""
    k, y = np.full(count, 6.0 / count), np.linspace(0.2, 1.8, count)
    return k, y * 1.2 / (k @ y)


def step(modes: ModalBasis, model, whole: bool = False, cycles: int = 20, repeats: int = 5) -> float:
    """Seconds per step of the compiled loop of the march, cycles that follow one another; whole: with all that a run
    keeps of every step (samples, energies)."""
    run = Run(modes, DRIVE, model, STEPS, inf, load_kernels())
    rows = np.empty((STEPS + 1, run.width))

    def go():
        for _ in range(cycles):
            if whole:
                run.cycle(STEPS, 0, [])
            else:
                run._steps(STEPS, rows)

    return least(go, repeats) / (cycles * STEPS)


def bonded(count: int, shear: int = 0):
    """Model of bonds at so many points of equal load, limit 1.2 in all; with so many shear modes of a compliance that
    fades over a tenth of the length."""
    law, area, sigma = Bonds(0.3, 0.2), np.full(count, 1.0 / count), np.full(count, 4.0)
    if not shear:
        return points_model(law, area, sigma)
    x = np.linspace(0, 1, count)
    compliance = 0.05 * np.exp(-10 * np.abs(x[:, None] - x))
    return points_model(law, area, sigma, shear_modes(compliance, law.static * area * sigma, law.length, shear))


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


def marched(modes: ModalBasis, model, steps: int = STEPS) -> np.ndarray:
    """Slides (steps + 1,) of the compiled march from rest."""
    run = Run(modes, DRIVE, model, STEPS, inf, load_kernels())
    return run.cycle(steps, 0, [])[1][:, 2 * modes.omega.size]


def balance(count: int = 100, harmonics: int = 15) -> float:
    """Seconds per point of harmonic balance: 31 frequencies, each from its neighbour, five modes."""
    modes, group = basis(5), Group(basis(5), Jenkins(*elements(count)))

    def curve():
        last = None
        for omega in np.linspace(1.0, 1.6, 31):
            last = point(modes, BaseSine(1.5, omega), group, harmonics=harmonics, start=last)

    return least(curve, 3) / 31


# ---- the table

@dataclass(frozen=True, eq=False, slots=True)
class Target:
    """What is measured [s, or 1 where `unit` is empty], its limit, and what it is compared with in the same run;
    `ratio`: so many times faster than that is wanted."""

    text: str
    number: Callable
    limit: float
    unit: str = "s"
    beside: str = ""
    other: Callable | None = None
    ratio: float = 0.0


def per_step(modes: int, law: tuple) -> Callable:
    """The NumPy form of a march per step."""
    return lambda: min(plain(basis(modes), law)[0] for _ in range(2))


PEER = "SUNDIALS"
TARGETS = (
    Target("stick-slip, a cycle of a long run", lambda: cycle_of_events()[0], 3e-6, "s", "DOP853 + events, 1e-8",
           lambda: cycle_of_peer("DOP853"), 300),
    Target("the same", lambda: cycle_of_events()[0], 3e-6, "s", f"fastest {PEER} run to 1e-3",
           lambda: cycle_of_peer(PEER), 300),
    Target("its error, peak after 200 cycles", lambda: cycle_of_events()[1], 1e-12, ""),
    Target("200 cycles in plain Python", twin, 20e-3, "s", "compiled, events only",
           lambda: CYCLES * cycle_of_events()[0]),
    Target("steady point by the event map", lambda: steady_point()[0], 10e-6, "s", "plain Python",
           lambda: steady_point()[2]),
    Target("its error", lambda: steady_point()[1], 1e-10, ""),
    Target("step, 5 modes, 100 elements", lambda: step(basis(5), jenkins_model(*elements(100))), 200e-9, "s", "NumPy",
           per_step(5, sharp(100))),
    Target("the same, samples and energies kept", lambda: step(basis(5), jenkins_model(*elements(100)), True), 200e-9),
    Target("step, 10 modes, 30 elements", lambda: step(basis(10), jenkins_model(*elements(30))), 0.3e-6, "s", "NumPy",
           per_step(10, sharp(30))),
    Target("step, 10 modes, 200 points of bonds", lambda: step(basis(10), bonded(200)), 3e-6, "s", "NumPy",
           per_step(10, soft(200))),
    Target("the same with 16 shear modes", lambda: step(basis(10), bonded(200, 16)), 15e-6, "s", "without them",
           lambda: step(basis(10), bonded(200))),
    Target("harmonic balance, 100 elements, 15 harmonics", balance, 5e-3, "s", "200 marched cycles",
           lambda: CYCLES * STEPS * step(basis(5), jenkins_model(*elements(100)))))


def text_of(value: float, unit: str) -> str:
    """With the unit that suits its size."""
    if not unit:
        return f"{value:.2g}"
    size, name = next(((s, n) for s, n in ((1e-3, "ms"), (1e-6, "us"), (1e-9, "ns")) if value >= s), (1e-9, "ns"))
    return f"{value / size:.3g} {name}"


def main(targets=TARGETS) -> dict:
    """{(text, beside): (measured, ratio or None, met)}, printed as a table."""
    out = {}
    print(f"{'target':46} {'wanted':>10} {'seen':>9}  met   times faster than")
    with threadpool_limits(1):
        for one in targets:
            value, ratio, words = one.number(), None, ""
            if one.other is not None:
                try:
                    ratio = one.other() / value
                    words = f"{ratio:9.3g}  {one.beside}" + (f" (wanted {one.ratio:g})" if one.ratio else "")
                except Missing as missing:
                    words = f"        -  {one.beside}: {missing}"
            met = value <= one.limit and (ratio is None or ratio >= one.ratio)
            out[one.text, one.beside] = value, ratio, met
            print(f"{one.text:46} {'<= ' + text_of(one.limit, one.unit):>10} {text_of(value, one.unit):>9}  "
                  f"{'yes' if met else 'NO ':3} {words}", flush=True)
    return out


if __name__ == "__main__":
    main([one for one in TARGETS if PEER not in one.beside] if "--alone" in sys.argv[1:] else TARGETS)
