"""Runs from event to event of Coulomb friction and elastic-plastic elements, many at once.

In: models with one mode under a sine. Out: `Runs` with the measures of all cases as arrays,
without histories.
"""

from typing import NamedTuple

import numpy as np

from ....dynamics.events import histories
from ....dynamics.events.elements import CELL_MERGES, merge_elements
from ....dynamics.events.positions_kernels import INTERFACE, RUN
from ....dynamics.events.reading import join_readings
from ....effects import law_has_trait
from ....friction.record import make_law
from ....response import run_events
from ....response.errors import merged_cell_errors
from ....response.measures import COORDINATE_ROUND_OFF, energy_balance
from ....response.ringing import make_ring
from ....structure.drive_sizes import find_max_acceleration, find_min_decay_rate
from ...rig.costs import count_merges
from ...rig.engines import EXACT, PIECES, choose_engine
from ...rig.pieces import (
    RigidElements,
    elements_of_law,
    find_steady_motion,
    measures_from_reading,
    still_changes,
)
from .columns import MAIN_MEASURE, N_FINAL_WINDOWS, Runs
from .threads import in_threads

CYCLES = 3  # cycles that contain each stick interval of a cycle completely
# smallest and largest number of cycles of a run, whose extremes are all kept
SHORTEST, LONGEST = 20, 4000


class Case(NamedTuple):
    """Run of the batch.

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
    """Return why the law, the cycles or the engine of a model exclude it from the batch, or ""."""
    f = model.friction
    if not _holds(model) and not law_has_trait(f.law, "cells") and f.law != "elastic-plastic":
        return "the friction law of the case is not a set of friction elements"
    if not SHORTEST <= model.rig.drive.cycles <= LONGEST:
        return "the case has too few or too many cycles"
    if _holds(model) and not f.static > 0:
        return "nothing rubs"
    return (
        ""
        if choose_engine(model) is (EXACT if _holds(model) else PIECES)
        else "the case is not computed by the engine from yield to yield"
    )


def _holds(model) -> bool:
    """Return whether the law of a model is Coulomb's, i.e. a rigid element."""
    return law_has_trait(model.friction.law, "set-valued") and not law_has_trait(
        model.friction.law, "averaged"
    )


def count_first_merges(model) -> int:
    """Return how often neighbouring cells are merged in pairs in a first run."""
    return 0 if _holds(model) else count_merges(model)


def make_case(model, pairs: int = 0) -> Case:
    """Return the Case of a model with a single point; pairs: see `Numerics`."""
    if _holds(model):
        return Case(model, RigidElements(model, None, None).groups, 0.0, model.point.load)
    element = make_law(model.friction, model.point.load).element(model.point.load)
    group = elements_of_law(element)
    for _ in range(pairs):
        group = merge_elements(group)
    return Case(model, (group,), 1e-3 * element.length, model.point.load)


def run_pieces(models, cycles: int, window: int, say=None, pairs: int = 0) -> Runs:
    """Run models of this kind, each for `cycles` cycles from its initial state.

    Parameters
    ----------
    models : sequence of Model
    cycles, window : int
        Cycles of the run, and at its end those that are evaluated.
    say : callable, optional
        Callback for a line of text.
    pairs : int
        See `Numerics`.

    Returns
    -------
    Runs
    """
    cases = [make_case(model, pairs) for model in models]
    out = runs_of_cases(cases, cycles, window, say)
    if law_has_trait(models[0].friction.law, "cells"):
        fewer = [
            [
                case._replace(groups=tuple(merge_elements(part, *merge) for part in case.groups))
                for case in cases
            ]
            for merge in CELL_MERGES
        ]
        return with_coarser_errors(
            out,
            [runs_of_cases(part, cycles, window, say, steady=False) for part in fewer],
            merged_cell_errors,
        )
    return out


def runs_of_cases(
    cases: list, cycles: int, window: int, say=None, least: int = 0, steady: bool = True
) -> Runs:
    """Run cases without histories.

    Parameters
    ----------
    cases : list of Case
    cycles, window : int
        Cycles of the run, and at its end those that are evaluated.
    say : callable, optional
        Callback for a line of text.
    least : int
        Cases of a thread (see `in_threads`).
    steady : bool
        Whether the steady motion and the ringing are computed; a coarse run does not need them.

    Returns
    -------
    Runs
    """
    histories.load_event_kernels(say)
    rig = cases[0].model.rig
    histories.announce_runs(
        rig.modes, rig.drive.signal, cases[0].groups, cycles, window, len(cases)
    )
    done = [None] * len(cases)

    def go(part: slice) -> None:
        """Run the cases of a slice, and store their runs in `done`."""
        rigs = [(case.model.rig, case.groups) for case in cases[part]]
        done[part] = histories.simulate_batch(
            ((rig.modes, rig.drive.signal, groups, rig.start) for rig, groups in rigs),
            cycles,
            window,
        )

    in_threads(go, len(cases), least)
    return _read(cases, done, cycles, window, steady)


def _read(cases: list, done: list, cycles: int, window: int, steady: bool) -> Runs:
    """Return the Runs of finished runs, either all of rigid elements or none.

    Work on rigid elements is all dissipated. They keep a single mode at rest during stick, so that
    nothing rings, and their drift has the round-off of two means.
    """
    reading = join_readings([one.reading for one in done])
    models = [case.model for case in cases]
    book = {name: np.array([one.ledger[name] for one in done]) for name in done[0].ledger}
    stiffness, size, held, load, tolerance = (
        np.array(column)
        for column in zip(
            *(
                (
                    model.rig.first_mode.stiffness,
                    find_max_acceleration(model.rig.drive.signal),
                    case.held,
                    case.load,
                    model.accuracy.tolerance,
                )
                for model, case in zip(models, cases)
            )
        )
    )
    loop = reading.loop()
    rigid = cases[0].groups[0].static > 0
    stuck = loop.slip_range / 2 <= np.maximum(
        held, COORDINATE_ROUND_OFF * reading.run[:, RUN.max_coordinate]
    )
    lost = np.zeros(len(done), bool)
    rings = {name: np.full(len(done), np.nan) for name in ("ring_frequency", "ring_damping")}
    known = np.full((2, len(done)), np.nan)
    for k, (model, one) in enumerate(zip(models, done)):
        ring = (
            {}
            if rigid
            else make_ring(*one.ring, one.acceleration)
            if one.ring is not None
            else _rings(cases[k], one)
            if steady
            else {}
        )
        lost[k] = ring is None
        for name, value in (ring or {}).items():
            rings[name][k] = value
        decay = find_min_decay_rate(model.rig.modes) * model.rig.drive.signal.period
        if (
            steady
            and not rigid
            and not stuck[k]
            and still_changes(one.amplitudes, window, tolerance[k], decay)
        ):
            found = find_steady_motion(
                model.rig.modes, model.rig.drive.signal, cases[k].groups, one
            )
            lost[k] |= found is None
            known[:, k] = (np.nan, np.nan) if found is None else found
    with np.errstate(all="ignore"):
        values = measures_from_reading(reading, book, True, True, stiffness, size) | rings
    worked, lost_in = (
        np.array([getattr(one.end[1], name).sum() for one in done]) for name in ("work", "loss")
    )
    values |= {
        "normal_load": load,
        "energy_created": np.zeros(len(done)),
        "friction_work": book["friction"] if rigid else worked,
        "energy_dissipated": book["friction"] if rigid else lost_in,
    }
    errors = {name: np.zeros(len(done)) for name in values}
    if rigid:
        errors["drift_per_cycle"] = 1e-14 * np.maximum(
            np.abs(reading.interface_value(INTERFACE.min_slide)),
            np.abs(reading.interface_value(INTERFACE.max_slide)),
        )
    ends = np.arange(cycles - 1, -1, -window)[::-1][-N_FINAL_WINDOWS:]
    loads = stuck & (reading.rise > tolerance * reading.interface_value(INTERFACE.max_force))
    return Runs(
        cycles,
        window,
        values,
        book,
        np.array([one.amplitudes for one in done]),
        np.array([one.phasors[ends] for one in done]),
        stuck,
        lost,
        errors,
        PIECES.min_relative_error,
        PIECES.max_balance_error,
        loads,
        tuple(known),
    )


def _rings(case: Case, one) -> dict | None:
    """Return the ringing of a run from its samples: {} for none, None if a single run is needed."""
    modes = case.model.rig.modes
    drive = case.model.rig.drive.signal
    stuck = one.reading.loop().stuck_time >= one.reading.span * (1 - 1e-12)
    # without stick nothing rings, and in a periodic motion that sticks the ringing has decayed
    if not one.slips or (one.repeats and stuck):
        return {}
    if not one.repeats:
        return None
    start, memory = one.end
    more = histories.simulate(modes, drive, case.groups, CYCLES, CYCLES, start=start, memory=memory)
    return (
        None
        if run_events.measure_rings(more.window, modes, drive, more.log, repeats=True) != ({}, {})
        else {}
    )


def with_coarser_errors(fine: Runs, coarser: list, told_by) -> Runs:
    """Return Runs with the errors that follow from coarse Runs.

    told_by: function (fine, *coarse) of values by name that returns errors by name.
    """
    whole = [
        one.values | {MAIN_MEASURE: one.amplitudes, "energy_balance": energy_balance(one.book)}
        for one in (fine, *coarser)
    ]
    for case in range(len(fine.stuck)):
        a, *others = (
            {name: float(part[case]) for name, part in one.items() if not np.isnan(part[case])}
            for one in whole
        )
        told = told_by(a, *others)
        for name, value in a.items():
            fine.errors.setdefault(name, np.zeros(len(fine.stuck)))[case] = told.get(
                name, abs(value)
            )
    return fine
