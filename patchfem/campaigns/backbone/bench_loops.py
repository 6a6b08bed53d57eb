"""Steady friction loops of the contact of a rig under a sinusoidal displacement."""

from dataclasses import replace
from typing import NamedTuple

from ...model.model import Model
from ...model.slide import SlidePath
from ...runs.bench import bench
from ...runs.bench.engine import steps_per_cycle
from ...runs.rig import decays

FIRST_CYCLES = 3.0  # Number of cycles of the first loop, of which the last one is evaluated.
# Largest number of cycles: most laws are steady after a few, growing bonds after tens.
MAX_CYCLES = 192.0
LOOP_MEASURES = ("secant_stiffness", "loop_area")


class BenchLoop(NamedTuple):
    """Run of a contact under a sinusoidal displacement, with its model and number of steps."""

    run: object
    model: Model
    steps: int


class SteadyLoop(NamedTuple):
    """Steady run of a contact under a sinusoidal displacement.

    It has its model and its number of steps.

    change: change of each of LOOP_MEASURES by the later half of the cycles.
    """

    run: object
    model: Model
    steps: int
    change: list


def run_friction_loop(
    model: Model, patch, slide: float, frequency: float, cycles: float
) -> BenchLoop:
    """Compute the friction loop of a contact under a sinusoidal displacement.

    Parameters
    ----------
    model : Model
        Model of the rig.
    patch : Patch or None
        Pressed patch.
    slide : float
        Amplitude of the sinusoidal displacement [m].
    frequency : float
        Frequency of the displacement [Hz].
    cycles : float

    Returns
    -------
    BenchLoop
    """
    path = SlidePath("sine", slide, frequency, None, 0.0, cycles, None)
    contact = replace(decays.with_automatic_method(model), kind="bench", rig=None, slide=path)
    steps = steps_per_cycle(contact)
    return BenchLoop(bench.run_bench(contact, patch, steps), contact, steps)


def compute_steady_loop(model: Model, patch, slide: float, frequency: float) -> SteadyLoop:
    """Compute a friction loop with a doubled number of cycles until it is steady within the tolerance.

    Parameters
    ----------
    model : Model
        Model of the rig.
    patch : Patch or None
        Pressed patch.
    slide : float
        Amplitude of the sinusoidal displacement [m].
    frequency : float
        Frequency of the displacement [Hz].

    Returns
    -------
    SteadyLoop
    """
    tolerance = model.accuracy.tolerance
    cycles = FIRST_CYCLES
    loop = run_friction_loop(model, patch, slide, frequency, cycles)
    while True:
        cycles *= 2
        before = loop.run.values
        loop = run_friction_loop(model, patch, slide, frequency, cycles)
        values = loop.run.values
        change = [abs(values[name] - before[name]) for name in LOOP_MEASURES]
        limits = [tolerance * abs(values[name]) for name in LOOP_MEASURES]
        is_steady = all(step <= limit for step, limit in zip(change, limits))
        if cycles >= MAX_CYCLES or is_steady:
            return SteadyLoop(*loop, change)
