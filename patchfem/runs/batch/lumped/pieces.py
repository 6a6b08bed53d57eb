"""Event-driven runs of many cases with Coulomb friction or elastic-plastic elements.

In: models with one mode under sinusoidal drive. Out: `Runs`, the measures of all cases as columns,
without histories.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ....dynamics.events import histories
from ....dynamics.events.elements import merge_elements
from ....dynamics.events.positions_kernels import InterfaceMeasure, RunMeasure
from ....dynamics.events.reading import join_readings
from ....effects import law_has_trait
from ....friction.cells import CELL_MERGES
from ....friction.record import make_law
from ....hybrid import cases as hybrid_cases
from ....hybrid import periodic
from ....hybrid.laws import masing
from ....response import run_events
from ....response.errors import merged_cell_errors
from ....response.measures import COORDINATE_ROUND_OFF, energy_balance
from ....response.ringing import make_ringing_measures
from ....structure.drive_sizes import find_max_acceleration, find_min_decay_rate
from ...rig.costs import count_cell_merges
from ...rig.event_to_event import STEADY_RTOL, find_stable_amplitude, may_still_change
from .case_engines import EXACT, PIECES, choose_engine
from .columns import N_FINAL_WINDOWS, Runs
from .event_driven import (
    RigidElements,
    compute_event_measures,
    convert_to_elements,
)
from .threads import apply_in_threads

# Number of computed cycles of a periodic motion, such that they contain each of its stick intervals
# without interruption.
N_STICK_CYCLES = 3
MIN_CYCLES = 20  # smallest number of cycles of a run
MAX_CYCLES = 4000  # largest number of cycles of a run, limited by the memory of the extremes
# Relative error of the drift of rigid elements: the round-off of two mean values.
DRIFT_ROUND_OFF = 1e-14


class Case(NamedTuple):
    """One case of an event-driven batch: its model, friction elements and load.

    - model: Model.
    - groups: Elements of the interface.
    - max_stick_slip: largest slip amplitude of a sticking interface [m].
    - load: normal load [N].
    """

    model: object
    groups: tuple
    max_stick_slip: float
    load: float


def refusal_reason(model) -> str:
    """Return why law, cycles or engine of a model exclude the event-driven batch, or ""."""
    friction = model.friction
    is_rigid = is_rigid_law(model)
    if (
        not is_rigid
        and not law_has_trait(friction.law, "cells")
        and friction.law != "elastic-plastic"
    ):
        return "the friction law of the case is not a set of friction elements"
    if not MIN_CYCLES <= model.rig.drive.cycles <= MAX_CYCLES:
        return "the case has too few or too many cycles"
    if is_rigid and not friction.static > 0:
        return "nothing rubs"
    if choose_engine(model) is not (EXACT if is_rigid else PIECES):
        return "the case is not computed by the engine from yield to yield"
    return ""


def is_rigid_law(model) -> bool:
    """Return whether the friction law of a model is Coulomb friction without elastic stick."""
    law = model.friction.law
    return law_has_trait(law, "set-valued") and not law_has_trait(law, "averaged")


def count_initial_merges(model) -> int:
    """Return the number of pairwise merges of slider cells for the first run."""
    return 0 if is_rigid_law(model) else count_cell_merges(model)


def make_case(model, n_merges: int = 0) -> Case:
    """Return a model with a single point as a case of the event-driven batch."""
    load = model.point.load
    if is_rigid_law(model):
        return Case(model, RigidElements(model, None, None).groups, 0.0, load)
    element = make_law(model.friction, load).element(load)
    group = convert_to_elements(element)
    for _ in range(n_merges):
        group = merge_elements(group)
    return Case(model, (group,), 1e-3 * element.length, load)


def simulate_models(models, cycles: int, window: int, report=None, n_merges: int = 0) -> Runs:
    """Simulate models from event to event, with coarse runs for the error of their cells.

    Parameters
    ----------
    models : sequence of Model
    cycles, window : int
        Number of cycles of the run, and of evaluated cycles at its end.
    report : callable, optional
        Callback for progress messages.
    n_merges : int
        Number of times that neighbouring cells are merged in pairs.
    """
    cases = [make_case(model, n_merges) for model in models]
    fine = simulate_cases(cases, cycles, window, report)
    if not law_has_trait(models[0].friction.law, "cells"):
        return fine
    coarse_runs = []
    for merge in CELL_MERGES:
        coarse_cases = []
        for case in cases:
            groups = tuple(merge_elements(group, *merge) for group in case.groups)
            coarse_cases.append(case._replace(groups=groups))
        coarse_runs.append(simulate_cases(coarse_cases, cycles, window, report, steady=False))
    return add_coarser_errors(fine, coarse_runs, merged_cell_errors)


def simulate_cases(
    cases: list,
    cycles: int,
    window: int,
    report=None,
    min_cases_per_thread: int = 0,
    steady: bool = True,
) -> Runs:
    """Simulate cases from event to event without storing histories.

    Parameters
    ----------
    cases : list of Case
    cycles, window : int
        Number of cycles of the run, and of evaluated cycles at its end.
    report : callable, optional
        Callback for progress messages.
    min_cases_per_thread : int
        Smallest number of cases per thread (see `apply_in_threads`).
    steady : bool
        Whether the steady state and the ringing are computed; coarse runs do not need them.
    """
    histories.load_event_kernels(report)
    rig = cases[0].model.rig
    histories.announce_runs(
        rig.modes, rig.drive.signal, cases[0].groups, cycles, window, len(cases)
    )
    finished = [None] * len(cases)

    def simulate(part: slice) -> None:
        """Simulate a slice of the cases and store the finished runs."""
        rigs = [(case.model.rig, case.groups) for case in cases[part]]
        finished[part] = histories.simulate_batch(
            ((rig.modes, rig.drive.signal, groups, rig.start) for rig, groups in rigs),
            cycles,
            window,
        )

    apply_in_threads(simulate, len(cases), min_cases_per_thread)
    return _evaluate_runs(cases, finished, cycles, window, steady)


def _evaluate_runs(cases: list, finished: list, cycles: int, window: int, steady: bool) -> Runs:
    """Return the measures of finished event-driven runs as columns.

    Rigid elements dissipate all work of the friction force. During stick they hold the single mode at
    rest, so that there is no ringing.
    """
    reading = join_readings([run.reading for run in finished])
    models = [case.model for case in cases]
    ledgers = [run.ledger for run in finished]
    energies = {name: np.array([ledger[name] for ledger in ledgers]) for name in ledgers[0]}
    tolerance = np.array([model.accuracy.tolerance for model in models])
    loop = reading.loop()
    is_rigid = cases[0].groups[0].static > 0
    is_stuck = loop.slip_range / 2 <= np.maximum(
        [case.max_stick_slip for case in cases],
        COORDINATE_ROUND_OFF * reading.run[:, RunMeasure.MAX_COORDINATE],
    )
    needs_single_run = np.zeros(len(finished), bool)
    rings = {name: np.full(len(finished), np.nan) for name in ("ring_frequency", "ring_damping")}
    steady_motions = np.full((2, len(finished)), np.nan)
    for k, (case, run) in enumerate(zip(cases, finished)):
        ringing = {} if is_rigid else _find_ringing(case, run, steady)
        needs_single_run[k] = ringing is None
        for name, value in (ringing or {}).items():
            rings[name][k] = value
        rig = case.model.rig
        decay = find_min_decay_rate(rig.modes) * rig.drive.signal.period
        if (
            steady
            and not is_rigid
            and not is_stuck[k]
            and may_still_change(run.extremes, window, tolerance[k], decay)
        ):
            motion = _find_steady_motion(case)
            needs_single_run[k] |= motion is None
            if motion is not None:
                steady_motions[:, k] = motion
    stiffness = np.array([model.rig.first_mode.stiffness for model in models])
    acceleration = np.array([find_max_acceleration(model.rig.drive.signal) for model in models])
    with np.errstate(all="ignore"):
        values = compute_event_measures(
            reading,
            energies,
            is_sine=True,
            is_complete=True,
            stiffness=stiffness,
            acceleration=acceleration,
        )
    work = energies["friction"]
    loss = work
    if not is_rigid:
        work = np.array([run.end[1].work.sum() for run in finished])
        loss = np.array([run.end[1].loss.sum() for run in finished])
    values |= rings | {
        "normal_load": np.array([case.load for case in cases]),
        "energy_created": np.zeros(len(finished)),
        "friction_work": work,
        "energy_dissipated": loss,
        "energy_balance": energy_balance(energies),
    }
    errors = {name: np.zeros(len(finished)) for name in values}
    if is_rigid:
        errors["drift_per_cycle"] = DRIFT_ROUND_OFF * np.maximum(
            np.abs(reading.interface_value(InterfaceMeasure.MIN_SLIDE)),
            np.abs(reading.interface_value(InterfaceMeasure.MAX_SLIDE)),
        )
    ends = np.arange(cycles - 1, -1, -window)[::-1][-N_FINAL_WINDOWS:]
    max_rise = tolerance * reading.interface_value(InterfaceMeasure.MAX_FORCE)
    return Runs(
        cycles,
        window,
        values,
        np.array([run.extremes for run in finished]),
        np.array([run.phasors[ends] for run in finished]),
        is_stuck,
        needs_single_run,
        errors,
        PIECES.min_relative_error,
        PIECES.max_balance_error,
        is_stuck & (reading.force_increase > max_rise),
        tuple(steady_motions),
    )


def _find_steady_motion(case: Case) -> tuple[float, float] | None:
    """Return the amplitude [m] of the steady motion of a case and its error, or None if no stable one is found."""
    laws = [
        (
            masing.from_elements(group.stiffness, group.yield_displacement),
            hybrid_cases.Load(case.load),
        )
        for group in case.groups
    ]
    schedule = hybrid_cases.Schedule(1.0, 1, np.zeros(0))
    start = hybrid_cases.make_rig_case(case.model.rig, laws, schedule, rtol=STEADY_RTOL)
    return find_stable_amplitude(periodic.find_periodic_motion(start))


def _find_ringing(case: Case, run, steady: bool) -> dict | None:
    """Return the ringing measures of a run; {} without ringing, None if they are unknown.

    The ringing is taken from the run or, if `steady`, from a continuation of a few cycles with
    samples. If the result is None, the case must be run again outside the batch.
    """
    if run.ring is not None:
        return make_ringing_measures(*run.ring, run.acceleration)
    if not steady or not run.slips:  # ringing is excited only when the whole interface slips
        return {}
    modes = case.model.rig.modes
    drive = case.model.rig.drive.signal
    is_stuck = run.reading.loop().stuck_time >= run.reading.span * (1 - 1e-12)
    if run.repeats and is_stuck:  # the ringing of a periodic motion in permanent stick has decayed
        return {}
    if not run.repeats:
        return None
    start, memory = run.end
    continuation = histories.simulate(
        modes, drive, case.groups, N_STICK_CYCLES, N_STICK_CYCLES, start=start, memory=memory
    )
    ringing = run_events.measure_ringing_in_sticks(
        continuation.window, modes, drive, continuation.log, repeats=True
    )
    return {} if ringing == ({}, {}) else None


def add_coarser_errors(fine: Runs, coarse_runs: list, estimate: Callable) -> Runs:
    """Estimate the errors of runs from coarser runs, and add them to the runs.

    Parameters
    ----------
    fine : Runs
        Runs whose errors are changed in place.
    coarse_runs : list of Runs
    estimate : callable
        Function (fine, *coarse) of dicts of columns that returns a dict of errors. The error of a measure
        that a coarser run does not have is its absolute value.
    """
    errors = estimate(fine.values, *(runs.values for runs in coarse_runs))
    for name, value in fine.values.items():
        error = errors.get(name, np.nan)
        fine.errors[name] = np.where(np.isnan(error), np.abs(value), error)
    return fine
