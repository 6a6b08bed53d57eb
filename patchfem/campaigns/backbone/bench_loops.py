"""Steady friction loops of the contact of a rig under a sinusoidal displacement."""

from dataclasses import replace
from math import inf
from typing import NamedTuple

from ...model.model import Model
from ...model.slide import SlidePath
from ...runs.bench import bench
from ...runs.bench.engine import steps_per_cycle
from ...runs.refine import NO_LIMIT, Verdict, refine
from ...runs.rig import decays

# Largest number of cycles: most laws are steady after a few, growing bonds after tens.
MAX_LOOP_CYCLES = 192.0
# Measures of a friction loop from which a backbone follows
LOOP_MEASURES = ("secant_stiffness", "loop_area")


class SteadyLoop(NamedTuple):
    """Run of a contact under a sinusoidal displacement whose friction loop is steady.

    - run: result of the bench (`BenchRun`), with histories and measures.
    - model: model of the run.
    - steps: number of steps per cycle.
    - change: change of each of LOOP_MEASURES from the run with half as many cycles.
    """

    run: bench.BenchRun
    model: Model
    steps: int
    change: list[float]


def compute_steady_loop(model: Model, patch, slide: float, frequency: float) -> SteadyLoop:
    """Run a contact under a sinusoidal displacement until its friction loop is steady within the tolerance.

    Each run has twice as many cycles as the one before, up to `MAX_LOOP_CYCLES`. A loop is steady if its stiffness and its
    area are those of the run with half as many cycles.

    Parameters
    ----------
    model : Model
        Model of the rig, whose contact and friction law are used.
    patch : Patch or None
        Pressed patch, or None for a contact at a point.
    slide : float
        Amplitude of the sinusoidal displacement [m].
    frequency : float
        Frequency of the displacement [Hz].

    Returns
    -------
    SteadyLoop
        The last run, its settings, and the change from the run with half as many cycles.
    """
    tolerance = model.accuracy.tolerance
    # The contact alone: a bench, on which the displacement is prescribed.
    bench_model = replace(decays.with_automatic_method(model), kind="bench", rig=None)

    def solve(cycles: float, before: SteadyLoop | None) -> SteadyLoop:
        """Run a number of cycles, and return the last one with its change from the run before."""
        path = SlidePath(
            kind="sine",
            amplitude=slide,
            frequency=frequency,
            speed=None,
            run_in=0.0,
            cycles=cycles,
            corners=None,
        )
        contact = replace(bench_model, slide=path)
        steps = steps_per_cycle(contact)
        run = bench.run_bench(contact, patch, steps)
        change = [inf] * len(LOOP_MEASURES)
        if before is not None:
            change = [abs(run.values[name] - before.run.values[name]) for name in LOOP_MEASURES]
        return SteadyLoop(run, contact, steps, change)

    def judge(loop: SteadyLoop, excesses: list[float]) -> Verdict:
        """Double the cycles until the last one is that of the run with half as many."""
        limits = [tolerance * abs(loop.run.values[name]) for name in LOOP_MEASURES]
        is_steady = all(step <= limit for step, limit in zip(loop.change, limits))
        cycles = loop.model.slide.cycles
        if is_steady or (excesses and cycles >= MAX_LOOP_CYCLES):
            return Verdict(0.0)
        return Verdict(inf, 2 * cycles)

    # The first run has three cycles, of which the last one is evaluated.
    return refine(solve, 3.0, judge, NO_LIMIT)[0]
