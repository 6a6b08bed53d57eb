"""Measures of many runs as columns, with errors, outcomes and reasons.

In: `Runs` of a batch. Out: `CaseResults` equal to what `runs.rig.rig` makes of a single
Solution, and which cases must be run by themselves.
"""

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from ....core import Measure, Outcome
from ....effects import law_has_trait
from ....model.similar_models import SimilarModels, collect_columns
from ....response.errors import total_error
from ....response.measures import energy_balance
from ....response.outcome import (
    AMPLITUDE_ROUND_OFF,
    classify_periodic,
    error_of_steady,
    is_drifting,
    is_still_changing,
    remaining_ringing,
    warn_of_ringing,
)
from ....response.reasons import (
    CHANGE_NOT_RESOLVED,
    CYCLE_MEASURES,
    STEADY_AMPLITUDE,
    STICKS_AT_REVERSAL,
    find_missing,
)
from ....response.rows import TABLE, error_floor, larger_term
from ....response.settling import (
    CLASSES,
    STEADY_CLASS,
    extrapolate_steady_amplitudes,
    window_amplitude_means,
)
from ....structure.drive_sizes import find_max_acceleration, find_min_decay_rate
from ...accuracy_warnings import Finding, tolerance_warnings
from ...results.notes import MAX_WORK_CHECK
from ...results.result import shorten_file_names
from ...rig.engines import unused_settings
from ...rig.motion_warnings import law_warnings
from ..case_results import CaseResults

N_FINAL_WINDOWS = 5  # last windows whose phasors determine a steady motion (response.settling)
MAIN_MEASURE, PHASE_MEASURE = "relative_displacement_amplitude", "slip_start_phase"


class Sizes(NamedTuple):
    """Scales of n models from their scenes, (n,) each.

    - tolerance: [1].
    - moved: expected displacement [m].
    - largest: largest acceleration of the drive [m s-2].
    - period: of the drive [s].
    - decay: smallest decay rate of a mode [1/s].
    """

    tolerance: np.ndarray
    moved: np.ndarray
    largest: np.ndarray
    period: np.ndarray
    decay: np.ndarray


def collect_sizes(models) -> Sizes:
    """Return the Sizes of models."""
    return Sizes(
        *collect_columns(
            models,
            lambda model: (
                model.accuracy.tolerance,
                model.rig.displacement_scale,
                find_max_acceleration(model.rig.drive.signal),
                model.rig.drive.signal.period,
                find_min_decay_rate(model.rig.modes),
            ),
        )
    )


@dataclass(frozen=True, eq=False, slots=True)
class Runs:
    """Output of an engine for n runs of `cycles` cycles; the last `window` are evaluated.

    - values: measures (n,) by name; NaN for a run without the measure.
    - book: energies of the run (n,) by name [J].
    - extremes (n, c, 2): smallest and largest output of each cycle [m].
    - phasors (n, w): of the output in the last cycle of the last N_FINAL_WINDOWS windows, or of all [m].
    - stuck (n,): whether nothing slipped.
    - lost (n,): whether the case must be run by itself.
    - errors: (n,) by name, in addition to `min_relative_error` times the value.
    - max_balance_error: error of the energy balance above which a run has not converged.
    - loads (n,): whether the friction force of a stuck run still increases.
    - steady: amplitude and error (n,) [m] of the motion to which a run is known to settle; NaN if
      unknown.
    - chosen: further settings of each run.
    - again: whether a single run would be repeated with finer steps if its amplitude misses the
      tolerance.

    Extremes and phasors are bitwise those of a single run, because far extrapolation amplifies
    differences.
    """

    cycles: int
    window: int
    values: dict
    book: dict
    extremes: np.ndarray
    phasors: np.ndarray
    stuck: np.ndarray
    lost: np.ndarray
    errors: dict
    min_relative_error: float
    max_balance_error: float
    loads: np.ndarray | bool = False
    steady: tuple | None = None
    chosen: tuple = ()
    again: bool = True

    @property
    def amplitudes(self) -> np.ndarray:
        """Half the range of the output in the last cycles (n,) [m]."""
        last = self.extremes[:, -self.window :]
        return (last[:, :, 1].max(axis=1) - last[:, :, 0].min(axis=1)) / 2


def batch_answers(models, runs: Runs, numerics: dict, again: Callable | None = None) -> tuple:
    """Return the case results of models from their Runs.

    Parameters
    ----------
    models : sequence of Model
    runs : Runs
    numerics : dict
        Settings as in `results.result.choices`.
    again : callable, optional
        Function of the results that returns which cases (n,) are computed again; these have no
        warnings of large errors.

    Returns
    -------
    tuple
        CaseResults; which cases (n,) must be run by themselves; which (n,) have all errors, except
        that of the steady estimate, within the tolerance.
    """
    n = len(models)
    values = dict(runs.values)
    values[MAIN_MEASURE] = runs.values.get(MAIN_MEASURE, runs.amplitudes)
    values["energy_balance"] = energy_balance(runs.book)
    nothing = np.zeros(n)
    errors = {
        name: total_error(
            name,
            value,
            [runs.errors.get(name, nothing)],
            runs.min_relative_error,
            values[MAIN_MEASURE],
        )
        for name, value in values.items()
    }
    sizes = collect_sizes(models)
    tolerance = sizes.tolerance
    moved = sizes.moved
    outcome, (steady, error) = _outcome(
        sizes,
        runs,
        is_drifting(
            values["drift_per_cycle"],
            errors["drift_per_cycle"],
            values[MAIN_MEASURE],
            tolerance,
            error_floor("drift_per_cycle", moved),
        ),
    )
    found = CaseResults.blank(n)
    found.outcome[:] = [str(one) for one in outcome]
    alone = (
        runs.lost
        | (values["energy_balance"] > runs.max_balance_error)
        | (values["work_check"] > MAX_WORK_CHECK)
    )
    grows = np.array([one is Outcome.GROWS for one in outcome])
    with np.errstate(invalid="ignore"):
        on = is_still_changing(steady, error, values[MAIN_MEASURE], tolerance) & np.array(
            [one is Outcome.STEADY for one in outcome]
        )
    still = (
        (on | np.array([one is Outcome.TRANSIENT for one in outcome]))
        & ~np.isnan(steady)
        & ~runs.stuck
    )
    values[STEADY_AMPLITUDE] = np.where(still, steady, np.nan)
    errors[STEADY_AMPLITUDE] = error_of_steady(
        steady, error, values[MAIN_MEASURE], errors[MAIN_MEASURE]
    )
    resolved = np.ones(n, bool)
    wide_of = np.zeros(n, bool)
    for name, value in values.items():
        there = ~np.isnan(value)
        if not there.any():
            continue
        row = TABLE[name]
        floor = error_floor(name, moved)
        wide = there & (errors[name] > tolerance * np.abs(value) + floor)
        floor = np.fmax(floor, tolerance * larger_term(name, values))
        wide_of |= wide & (errors[name] > tolerance * np.abs(value) + floor) & ~grows
        if name == MAIN_MEASURE and runs.again:
            alone |= wide & ~grows
        if not name.endswith("_steady"):
            resolved &= ~wide
        found.units[name] = row.unit
        found.values[name] = value
        found.errors[name] = np.where(there & ~grows, errors[name], np.nan)
        found.floors[name] = np.where(there, floor, np.nan)
    _reasons(models, sizes, runs, found)
    unseen = np.isnan(values[STEADY_AMPLITUDE]) & np.array(
        [one is Outcome.TRANSIENT for one in outcome]
    )
    if unseen.any():
        found.measure(STEADY_AMPLITUDE, TABLE[STEADY_AMPLITUDE].unit)
        found.floors[STEADY_AMPLITUDE][unseen] = TABLE[STEADY_AMPLITUDE].floor
        found.reasons.setdefault(STEADY_AMPLITUDE, {}).update(
            dict.fromkeys(np.flatnonzero(unseen).tolist(), CHANGE_NOT_RESOLVED)
        )
    if law_has_trait(models[0].friction.law, "set-valued") and not (
        models[0].partial_slip or models[0].rig.friction.has_partial_slip
    ):
        _stops(found)
    found.numerics.update(
        {case: numerics | runs.chosen[case] for case in range(n)}
        if runs.chosen
        else dict.fromkeys(range(n), numerics)
    )
    wide_of &= True if again is None else ~again(found)
    alike = isinstance(models, SimilarModels)
    remarks = _remarks(models[0], numerics["engine"]) if alike else ()
    rings = _rings(sizes, runs, outcome, values[MAIN_MEASURE])
    told = wide_of | _by_law(models, found) if alike else wide_of
    told = told | np.isin(np.arange(n), list(rings))
    for case in range(n) if remarks or not alike else np.flatnonzero(told).tolist():
        model = models[case]
        said = remarks if alike else _remarks(model, numerics["engine"])
        if warnings := [
            *said,
            *warnings_of_case(
                model, outcome[case], found, case, wide_of[case], rings.get(case, ())
            ),
        ]:
            found.warnings[case] = shorten_file_names(warnings, model.source.path)
    return found, alone, resolved


def _remarks(model, engine: str) -> list:
    """Return the warnings on a model that do not depend on its run."""
    return [*model.source.remarks, *unused_settings(model, engine), *model.rig.structure.notes]


def _outcome(sizes: Sizes, runs: Runs, moves) -> tuple:
    """Return the outcomes (n), and the steady amplitudes and their errors (n,) [m].

    moves: which motions (n,) have a midpoint that drifts, so that they are not steady.
    """
    pick = np.arange(runs.cycles - 1, -1, -runs.window)[::-1]
    ends = (runs.extremes[:, pick, 1] - runs.extremes[:, pick, 0]) / 2
    floor = AMPLITUDE_ROUND_OFF * (sizes.largest / (2 * np.pi / sizes.period) ** 2)
    decay = sizes.decay * runs.window * sizes.period
    with np.errstate(all="ignore"):
        steady = extrapolate_steady_amplitudes(
            ends[:, -N_FINAL_WINDOWS:], runs.phasors[:, -N_FINAL_WINDOWS:]
        )
        bounded = False
        if runs.steady is not None:
            bounded = ~np.isnan(runs.steady[0])
            steady = [np.where(bounded, known, seen) for known, seen in zip(runs.steady, steady)]
        number, *steady = classify_periodic(
            window_amplitude_means(runs.extremes, runs.window)[0],
            runs.extremes,
            runs.window,
            steady,
            (sizes.tolerance, floor, decay),
            bounded,
        )
    number = np.where((number == STEADY_CLASS) & moves, 0, number)
    ends = [Outcome.STUCK if stuck else CLASSES[k] for stuck, k in zip(runs.stuck, number)]
    return [
        Outcome.TRANSIENT if loads else one
        for loads, one in zip(np.broadcast_to(runs.loads, len(ends)), ends)
    ], steady


def _rings(sizes: Sizes, runs: Runs, outcome, amplitude) -> dict:
    """Return the warnings of `warn_of_ringing` for the cases that stick but still vibrate, by case."""
    n = len(amplitude)
    cases = np.flatnonzero([one is Outcome.STUCK for one in outcome] & (amplitude != 0))
    tolerance, decay, floor = (
        np.broadcast_to(one, n)[cases]
        for one in (
            sizes.tolerance,
            sizes.decay * sizes.period,
            error_floor(MAIN_MEASURE, sizes.moved),
        )
    )
    left = remaining_ringing(runs.extremes[cases], runs.window, decay)
    columns = zip(
        cases.tolist(),
        left.tolist(),
        amplitude[cases].tolist(),
        floor.tolist(),
        tolerance.tolist(),
        decay.tolist(),
    )
    found = {
        case: warn_of_ringing(one, (size, least), limits, runs.cycles)
        for case, one, size, least, *limits in columns
    }
    return {case: one for case, one in found.items() if one}


def _stops(found: CaseResults) -> None:
    """Remove the secant stiffness of rigid friction that sticks at the largest slide.

    See `response.reasons.find_missing_secant`.
    """
    stuck, secant = (found.values.get(name) for name in ("stick_fraction", "secant_stiffness"))
    if stuck is None or secant is None:
        return
    with np.errstate(invalid="ignore"):
        holds = ~np.isnan(secant) & (
            stuck > TABLE["stick_fraction"].floor + np.nan_to_num(found.errors["stick_fraction"])
        )
    if not holds.any():
        return
    found.values["secant_stiffness"] = np.where(holds, np.nan, secant)
    found.errors["secant_stiffness"] = np.where(holds, np.nan, found.errors["secant_stiffness"])
    found.reasons.setdefault("secant_stiffness", {}).update(
        dict.fromkeys(np.flatnonzero(holds).tolist(), STICKS_AT_REVERSAL)
    )


def _reasons(models, sizes: Sizes, runs: Runs, found: CaseResults) -> None:
    """Add the reasons why measures of the cases lack a value."""
    names = [*CYCLE_MEASURES, PHASE_MEASURE]
    for name in names:
        found.measure(name, TABLE[name].unit)
    lacking = np.array([np.isnan(found.values[name]) for name in names])
    holds = (
        found.values["stick_fraction"] == 1
        if "stick_fraction" in found.values
        else lacking[0] & False
    )
    sticks = (
        found.values["stick_fraction"] > 0
        if "stick_fraction" in found.values
        else lacking[0] & False
    )
    # all properties on which a reason depends under a sine
    signs = np.array([*lacking, holds, sticks, sizes.largest != 0])
    patterns, which = np.unique(signs, axis=1, return_inverse=True)
    for place in np.flatnonzero(patterns[: len(names)].any(axis=0)).tolist():
        cases = np.flatnonzero(which.ravel() == place).tolist()
        drive = models[cases[0]].rig.drive.signal
        here = {
            name: values[cases[0]]
            for name, values in found.values.items()
            if not np.isnan(values[cases[0]])
        }
        window = SimpleNamespace(time=np.array([0.0, runs.window * drive.period]), extra={})
        for name, measure in find_missing(here, window, drive, True).items():
            found.reasons.setdefault(name, {}).update(dict.fromkeys(cases, measure.reason))
            found.floors[name][cases] = measure.floor


def warnings_of_case(model, outcome, found: CaseResults, case: int, wide: bool, rings=()) -> list:
    """Return the warnings of a case that a single run would give.

    They concern its friction law and, if `wide`, the errors that exceed the tolerance.

    Parameters
    ----------
    model : Model
    outcome : Outcome
    found : CaseResults
    case : int
    wide : bool
        Whether an error exceeds the tolerance.
    rings : sequence of str
        Warnings of `warn_of_ringing`.
    """
    if not wide and not law_has_trait(model.friction.law, "bonds"):
        return list(rings)
    known = known_measures(found, case)
    drift = {name: one for name, one in known.items() if name == "drift_per_cycle"}
    return [
        *law_warnings(model, outcome, drift, 0.0),
        *rings,
        *tolerance_warnings(Finding(model, known)),
    ]


def _by_law(models: SimilarModels, found: CaseResults) -> np.ndarray:
    """Return which cases (n,) may need a warning of `law_warnings`.

    These have bonds that grow, are unbounded or creep.
    """
    first = models.first
    if not law_has_trait(first.friction.law, "bonds"):
        return np.zeros(len(models), bool)
    if first.bonds.has_growth or first.bonds.order < 0 or first.bonds.reading != "stretch":
        return np.ones(len(models), bool)
    if "drift_per_cycle" not in found.values:  # runs of less than a cycle have no drift
        return np.zeros(len(models), bool)
    drift = found.values["drift_per_cycle"]
    error = found.errors["drift_per_cycle"]
    return (np.abs(drift) > np.nan_to_num(error)) & (found.outcome != str(Outcome.TRANSIENT))


def known_measures(found: CaseResults, case: int) -> dict:
    """Return the measures of a case whose errors are known, by name."""
    return {
        name: Measure(
            float(column[case]),
            found.units[name],
            float(found.errors[name][case]),
            float(found.floors[name][case]),
        )
        for name, column in found.values.items()
        if not np.isnan(found.errors[name][case])
    }
