"""Runs from event to event of Coulomb friction and elastic-plastic elements, many at once.

In: models with one mode under a sine. Out: `Runs` with the measures of all cases as arrays,
without histories.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ....dynamics.events import histories
from ....dynamics.events.elements import CELL_MERGES, merge_elements
from ....dynamics.events.positions_kernels import InterfaceMeasure, RunMeasure
from ....dynamics.events.reading import join_readings
from ....effects import law_has_trait
from ....friction.record import make_law
from ....response import run_events
from ....response.errors import merged_cell_errors
from ....response.measures import COORDINATE_ROUND_OFF, energy_balance
from ....response.ringing import make_ringing_measures
from ....structure.drive_sizes import find_max_acceleration, find_min_decay_rate
from ...rig.costs import count_merges
from ...rig.engines import EXACT, PIECES, choose_engine
from ...rig.event_driven import (
    RigidElements,
    compute_event_measures,
    convert_to_elements,
    find_steady_motion,
    may_still_change,
)
from .columns import MAIN_MEASURE, N_FINAL_WINDOWS, Runs
from .threads import run_in_threads

# Number of cycles that contain every stick interval of a periodic motion completely.
N_STICK_CYCLES = 3
MIN_CYCLES = 20  # smallest number of cycles of a run
MAX_CYCLES = 4000  # largest number of cycles of a run, whose extremes are all kept
# relative error of the drift of rigid elements, which is the round-off of two means
DRIFT_ROUND_OFF = 1e-14


class Case(NamedTuple):
    """One case of an event-driven batch: its model, friction elements and load.

    - model: its Model.
    - groups: Elements of its interface.
    - held: slip in a cycle [m] below which it sticks.
    - load: normal load [N].
    """

    model: object
    groups: tuple
    held: float
    load: float


def refuses(model) -> str:
    """Return the reason why law, cycles or engine of a model exclude this batch, or ""."""
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
    """Return whether the friction law of a model is Coulomb's, without elastic stick."""
    law = model.friction.law
    return law_has_trait(law, "set-valued") and not law_has_trait(law, "averaged")


def count_first_merges(model) -> int:
    """Return how often neighbouring slider cells are merged in pairs for the first run."""
    return 0 if is_rigid_law(model) else count_merges(model)


def make_case(model, n_merges: int = 0) -> Case:
    """Return the event-driven case of a model with a single point."""
    if is_rigid_law(model):
        return Case(model, RigidElements(model, None, None).groups, 0.0, model.point.load)
    element = make_law(model.friction, model.point.load).element(model.point.load)
    group = convert_to_elements(element)
    for _ in range(n_merges):
        group = merge_elements(group)
    return Case(model, (group,), 1e-3 * element.length, model.point.load)


def run_pieces(models, cycles: int, window: int, say=None, n_merges: int = 0) -> Runs:
    """Run models from event to event, with coarse runs for the error of their cells.

    Parameters
    ----------
    models : sequence of Model
    cycles, window : int
        Cycles of the run, and at its end those that are evaluated.
    say : callable, optional
        Callback for a line of text.
    n_merges : int
        How often neighbouring cells are merged in pairs.
    """
    cases = [make_case(model, n_merges) for model in models]
    fine = run_cases(cases, cycles, window, say)
    if not law_has_trait(models[0].friction.law, "cells"):
        return fine
    coarse_runs = []
    for merge in CELL_MERGES:
        coarse_cases = []
        for case in cases:
            groups = tuple(merge_elements(group, *merge) for group in case.groups)
            coarse_cases.append(case._replace(groups=groups))
        coarse_runs.append(run_cases(coarse_cases, cycles, window, say, steady=False))
    return add_coarser_errors(fine, coarse_runs, merged_cell_errors)


def run_cases(
    cases: list, cycles: int, window: int, say=None, least: int = 0, steady: bool = True
) -> Runs:
    """Run cases from event to event without storing their histories.

    Parameters
    ----------
    cases : list of Case
    cycles, window : int
        Cycles of the run, and at its end those that are evaluated.
    say : callable, optional
        Callback for a line of text.
    least : int
        Cases of a thread (see `run_in_threads`).
    steady : bool
        Whether the steady motion and the ringing are computed; a coarse run does not need them.
    """
    histories.load_event_kernels(say)
    rig = cases[0].model.rig
    histories.announce_runs(
        rig.modes, rig.drive.signal, cases[0].groups, cycles, window, len(cases)
    )
    finished = [None] * len(cases)

    def simulate(part: slice) -> None:
        """Run a slice of the cases, and store the finished runs."""
        rigs = [(case.model.rig, case.groups) for case in cases[part]]
        finished[part] = histories.simulate_batch(
            ((rig.modes, rig.drive.signal, groups, rig.start) for rig, groups in rigs),
            cycles,
            window,
        )

    run_in_threads(simulate, len(cases), least)
    return _read_runs(cases, finished, cycles, window, steady)


def _read_runs(cases: list, finished: list, cycles: int, window: int, steady: bool) -> Runs:
    """Evaluate finished event-driven runs, and return their measures as columns.

    Work on rigid elements is all dissipated. They keep a single mode at rest during stick, so that
    nothing rings, and their drift has the round-off of two means.
    """
    reading = join_readings([run.reading for run in finished])
    models = [case.model for case in cases]
    ledgers = [run.ledger for run in finished]
    energies = {name: np.array([ledger[name] for ledger in ledgers]) for name in ledgers[0]}
    tolerance = np.array([model.accuracy.tolerance for model in models])
    loop = reading.loop()
    is_rigid = cases[0].groups[0].static > 0
    is_stuck = loop.slip_range / 2 <= np.maximum(
        [case.held for case in cases],
        COORDINATE_ROUND_OFF * reading.run[:, RunMeasure.MAX_COORDINATE],
    )
    is_lost = np.zeros(len(finished), bool)
    rings = {name: np.full(len(finished), np.nan) for name in ("ring_frequency", "ring_damping")}
    steady_motions = np.full((2, len(finished)), np.nan)
    for k, (case, run) in enumerate(zip(cases, finished)):
        ring = {} if is_rigid else _find_ringing(case, run, steady)
        is_lost[k] = ring is None
        for name, value in (ring or {}).items():
            rings[name][k] = value
        rig = case.model.rig
        decay = find_min_decay_rate(rig.modes) * rig.drive.signal.period
        if (
            steady
            and not is_rigid
            and not is_stuck[k]
            and may_still_change(run.amplitudes, window, tolerance[k], decay)
        ):
            motion = find_steady_motion(rig.modes, rig.drive.signal, case.groups, run)
            is_lost[k] |= motion is None
            if motion is not None:
                steady_motions[:, k] = motion
    stiffness = np.array([model.rig.first_mode.stiffness for model in models])
    acceleration = np.array([find_max_acceleration(model.rig.drive.signal) for model in models])
    with np.errstate(all="ignore"):
        values = compute_event_measures(
            reading, energies, sine=True, whole=True, stiffness=stiffness, size=acceleration
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
        energies,
        np.array([run.amplitudes for run in finished]),
        np.array([run.phasors[ends] for run in finished]),
        is_stuck,
        is_lost,
        errors,
        PIECES.min_relative_error,
        PIECES.max_balance_error,
        is_stuck & (reading.rise > max_rise),
        tuple(steady_motions),
    )


def _find_ringing(case: Case, run, steady: bool) -> dict | None:
    """Find the ringing of a run: {} for none, None if a single run is needed.

    The ringing is that of the run itself or, if `steady`, of a few more cycles with samples.
    """
    if run.ring is not None:
        return make_ringing_measures(*run.ring, run.acceleration)
    if not steady or not run.slips:  # an interface that never slips as a whole excites no ringing
        return {}
    modes = case.model.rig.modes
    drive = case.model.rig.drive.signal
    is_stuck = run.reading.loop().stuck_time >= run.reading.span * (1 - 1e-12)
    if run.repeats and is_stuck:  # in a periodic motion that always sticks, the ringing has decayed
        return {}
    if not run.repeats:
        return None
    start, memory = run.end
    more = histories.simulate(
        modes, drive, case.groups, N_STICK_CYCLES, N_STICK_CYCLES, start=start, memory=memory
    )
    rings = run_events.measure_ringing_in_sticks(more.window, modes, drive, more.log, repeats=True)
    return {} if rings == ({}, {}) else None


def add_coarser_errors(fine: Runs, coarse_runs: list, estimate: Callable) -> Runs:
    """Estimate the errors of runs from coarser runs, and add them to the runs.

    Parameters
    ----------
    fine : Runs
        Runs whose errors are set.
    coarse_runs : list of Runs
    estimate : callable
        Function (fine, *coarse) of values by name that returns errors by name.
    """
    columns = []
    for runs in (fine, *coarse_runs):
        others = {MAIN_MEASURE: runs.amplitudes, "energy_balance": energy_balance(runs.book)}
        columns.append(runs.values | others)
    n = len(fine.stuck)
    for case in range(n):
        values, *coarse = (select_known_values(measures, case) for measures in columns)
        errors = estimate(values, *coarse)
        for name, value in values.items():
            column = fine.errors.setdefault(name, np.zeros(n))
            column[case] = errors.get(name, abs(value))
    return fine


def select_known_values(measures: dict, case: int) -> dict:
    """Select the finite values of one case from a dict of columns."""
    values = {name: float(column[case]) for name, column in measures.items()}
    return {name: value for name, value in values.items() if not np.isnan(value)}
