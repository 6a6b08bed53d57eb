"""Conversion of the runs of a batch to case results with errors, outcomes and warnings.

In: `Runs` of a batch. Out: `CaseResults` equal to those that `runs.rig.rig` computes from a single
Solution, and a mask of the cases that need a single run.
"""

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from ....core import Outcome
from ....effects import law_has_trait
from ....model.similar_models import SimilarModels, collect_columns
from ....response.errors import total_error
from ....response.outcome import (
    AMPLITUDE_ROUND_OFF,
    classify_periodic,
    is_drifting,
    is_still_changing,
    remaining_ringing,
    steady_estimate_error,
    warn_of_ringing,
)
from ....response.reasons import (
    CHANGE_NOT_RESOLVED_REASON,
    CYCLE_MEASURES,
    STEADY_AMPLITUDE,
    STICKS_AT_REVERSAL_REASON,
    find_missing,
)
from ....response.rows import INTERNAL_VALUES, TABLE, error_floor, larger_term
from ....response.settling import (
    CLASSES,
    STEADY_CLASS,
    extrapolate_steady_amplitudes,
    window_amplitude_means,
)
from ....structure.drive_sizes import find_max_acceleration, find_min_decay_rate
from ...accuracy_warnings import AccuracyContext, tolerance_warnings
from ...results.notes import MAX_WORK_CHECK
from ...results.result import shorten_file_names
from ...rig.engines import describe_unused_settings
from ...rig.motion_warnings import warn_of_law
from ..case_results import CaseResults

# Number of windows from which the steady motion is extrapolated (response.settling).
N_FINAL_WINDOWS = 5
MAIN_MEASURE = "relative_displacement_amplitude"
PHASE_MEASURE = "slip_start_phase"


class CaseScales(NamedTuple):
    """Tolerances and reference quantities of n models, (n,) each.

    - tolerance: relative tolerance [1].
    - displacement: displacement scale of the rig [m].
    - acceleration: largest acceleration of the drive [m s-2].
    - period: period of the drive [s].
    - decay: smallest decay rate of all modes [1/s].
    """

    tolerance: np.ndarray
    displacement: np.ndarray
    acceleration: np.ndarray
    period: np.ndarray
    decay: np.ndarray


def collect_case_scales(models) -> CaseScales:
    """Return the tolerances and reference quantities of models as columns."""
    return CaseScales(
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
    """Results of an engine for n runs, as columns.

    - cycles, window: number of cycles of the run, and number of evaluated last cycles.
    - values: measures (n,) by name; NaN if a run does not have the measure.
    - extremes (n, c, 2): smallest and largest output in each cycle [m].
    - phasors (n, w): phasors of the output [m] in the last cycle of each of the last N_FINAL_WINDOWS
      windows, or of all windows.
    - is_stuck (n,): whether the interface sticks in all evaluated cycles.
    - needs_single_run (n,): whether the case must be computed by a single run.
    - errors: errors (n,) by name, in addition to `min_relative_error` times the value.
    - max_balance_error: largest energy balance error of a converged run.
    - is_loading (n,): whether the friction force of a stuck run still increases.
    - steady: amplitude of the known steady state and its error, (n,) each [m]; NaN if unknown.
    - case_settings: additional settings of each run.
    - refines_steps: whether a single run would refine its steps if its amplitude error exceeded the
      tolerance.

    Extremes and phasors are bitwise equal to those of a single run, because the extrapolation
    amplifies differences.
    """

    cycles: int
    window: int
    values: dict
    extremes: np.ndarray
    phasors: np.ndarray
    is_stuck: np.ndarray
    needs_single_run: np.ndarray
    errors: dict
    min_relative_error: float
    max_balance_error: float
    is_loading: np.ndarray | bool = False
    steady: tuple | None = None
    case_settings: tuple = ()
    refines_steps: bool = True


class AssembledRuns(NamedTuple):
    """Case results of n runs, with masks of cases that must be computed again.

    - results: CaseResults.
    - needs_single_run: mask (n,) of the cases that need a single run.
    - is_resolved: mask (n,) of the cases whose errors meet the tolerance; the error of the steady
      estimate is not considered.
    """

    results: CaseResults
    needs_single_run: np.ndarray
    is_resolved: np.ndarray


def assemble_results(
    models, runs: Runs, numerics: dict, is_repeated: Callable | None = None
) -> AssembledRuns:
    """Compute case results with errors, outcomes and warnings from the runs of models.

    Parameters
    ----------
    models : sequence of Model
    runs : Runs
    numerics : dict
        Settings as in `results.result.collect_used_settings`.
    is_repeated : callable, optional
        Function of the results that returns a mask (n,) of the cases that will be computed again;
        accuracy warnings are omitted for these.
    """
    n = len(models)
    scales = collect_case_scales(models)
    values, errors = _compute_values_and_errors(runs)
    outcomes, steady, steady_error = _judge_outcomes(
        scales,
        runs,
        is_drifting(
            values["drift_per_cycle"],
            errors["drift_per_cycle"],
            values[MAIN_MEASURE],
            scales.tolerance,
            error_floor("drift_per_cycle", scales.displacement),
        ),
    )
    results = CaseResults.blank(n)
    results.outcome[:] = [str(outcome) for outcome in outcomes]
    needs_single_run = (
        runs.needs_single_run
        | (values["energy_balance"] > runs.max_balance_error)
        | (values["work_check"] > MAX_WORK_CHECK)
    )
    is_transient = np.array([outcome is Outcome.TRANSIENT for outcome in outcomes])
    with np.errstate(invalid="ignore"):
        is_changing = np.array([outcome is Outcome.STEADY for outcome in outcomes])
        is_changing &= is_still_changing(
            steady, steady_error, values[MAIN_MEASURE], scales.tolerance
        )
    has_estimate = (is_changing | is_transient) & ~np.isnan(steady) & ~runs.is_stuck
    values[STEADY_AMPLITUDE] = np.where(has_estimate, steady, np.nan)
    errors[STEADY_AMPLITUDE] = steady_estimate_error(
        steady, steady_error, values[MAIN_MEASURE], errors[MAIN_MEASURE]
    )
    is_resolved, is_wide = _insert_measures(results, values, errors, scales)
    if runs.refines_steps:
        main_floor = error_floor(MAIN_MEASURE, scales.displacement)
        allowed = scales.tolerance * np.abs(values[MAIN_MEASURE]) + main_floor
        needs_single_run |= (errors[MAIN_MEASURE] > allowed) & (
            results.outcome != str(Outcome.GROWS)
        )
    _insert_reasons(models, scales, runs, results)
    is_unknown = np.isnan(values[STEADY_AMPLITUDE]) & is_transient
    if is_unknown.any():
        results.add_measure(STEADY_AMPLITUDE, TABLE[STEADY_AMPLITUDE].unit)
        results.floors[STEADY_AMPLITUDE][is_unknown] = TABLE[STEADY_AMPLITUDE].floor
        results.reasons.setdefault(STEADY_AMPLITUDE, {}).update(
            dict.fromkeys(np.flatnonzero(is_unknown).tolist(), CHANGE_NOT_RESOLVED_REASON)
        )
    if law_has_trait(models[0].friction.law, "set-valued") and not (
        models[0].partial_slip or models[0].rig.friction.has_partial_slip
    ):
        _remove_secant_of_rigid_stick(results)
    for case in range(n):
        results.numerics[case] = (
            numerics | runs.case_settings[case] if runs.case_settings else numerics
        )
    if is_repeated is not None:
        is_wide &= ~is_repeated(results)
    ringing_warnings = _list_ringing_warnings(
        scales, runs, outcomes, values[MAIN_MEASURE], errors[MAIN_MEASURE]
    )
    _insert_warnings(models, results, outcomes, is_wide, ringing_warnings)
    return AssembledRuns(results, needs_single_run, is_resolved)


def _compute_values_and_errors(runs: Runs) -> tuple[dict, dict]:
    """Return the measures of n runs and their total errors, as dicts of columns (n,)."""
    values = dict(runs.values)
    errors = {}
    for name, value in values.items():
        parts = [runs.errors.get(name, np.zeros(len(runs.is_stuck)))]
        errors[name] = total_error(
            name, value, parts, runs.min_relative_error, values[MAIN_MEASURE]
        )
    return values, errors


def _insert_measures(results: CaseResults, values: dict, errors: dict, scales: CaseScales) -> tuple:
    """Store measures and their errors in case results.

    Returns a mask (n,) of the cases whose errors meet the tolerance, without the steady estimate, and a
    mask of the cases that need an accuracy warning.
    """
    grows = results.outcome == str(Outcome.GROWS)
    is_resolved = np.ones(len(grows), bool)
    has_wide_error = np.zeros(len(grows), bool)
    for name, value in values.items():
        is_known = ~np.isnan(value)
        if name in INTERNAL_VALUES or not is_known.any():
            continue
        floor = error_floor(name, scales.displacement)
        allowed = scales.tolerance * np.abs(value)
        if not name.endswith("_steady"):
            is_resolved &= ~(is_known & (errors[name] > allowed + floor))
        final_floor = np.fmax(floor, scales.tolerance * larger_term(name, values))
        is_wide = is_known & (errors[name] > allowed + final_floor)
        has_wide_error |= is_wide & ~grows
        results.units[name] = TABLE[name].unit
        results.values[name] = value
        results.errors[name] = np.where(is_known & ~grows, errors[name], np.nan)
        results.floors[name] = np.where(is_known, final_floor, np.nan)
    return is_resolved, has_wide_error


def _insert_warnings(
    models, results: CaseResults, outcomes: list, is_wide: np.ndarray, ringing_warnings: dict
) -> None:
    """Store the warnings in case results that single runs would give.

    Parameters
    ----------
    models : sequence of Model
    results : CaseResults
    outcomes : list of Outcome
    is_wide : (n,) of bool
        Mask of the cases with an error above the tolerance.
    ringing_warnings : dict
        Warnings of `warn_of_ringing` by case.
    """
    engine = results.numerics[0]["engine"]
    first = models[0]
    if not isinstance(models, SimilarModels):
        cases = range(len(models))
    elif _list_model_warnings(first, engine):
        cases = range(len(models))
    else:
        is_warned = is_wide | _may_need_law_warnings(models, results)
        is_warned[list(ringing_warnings)] = True
        cases = np.flatnonzero(is_warned).tolist()
    for case in cases:
        model = models[case]
        warnings = _list_model_warnings(model, engine)
        if is_wide[case] or law_has_trait(model.friction.law, "bonds"):
            measures = results.measures_with_errors(case)
            drift = {name: measures[name] for name in ("drift_per_cycle",) if name in measures}
            warnings += warn_of_law(model, outcomes[case], drift, 0.0)
            warnings += ringing_warnings.get(case, ())
            warnings += tolerance_warnings(AccuracyContext(model, measures))
        else:
            warnings += ringing_warnings.get(case, ())
        if warnings:
            results.warnings[case] = shorten_file_names(warnings, model.source.path)


def _list_model_warnings(model, engine: str) -> list:
    """Return the warnings that follow from a model alone."""
    return [
        *model.source.remarks,
        *describe_unused_settings(model, "hybrid"),
        *model.rig.structure.notes,
    ]


class _SteadyOutcomes(NamedTuple):
    """Outcomes of n runs, and their steady amplitudes with errors (n,) [m]."""

    outcomes: list
    steady: np.ndarray
    error: np.ndarray


def _judge_outcomes(scales: CaseScales, runs: Runs, is_drifting_motion) -> _SteadyOutcomes:
    """Classify the motions of n runs, and estimate their steady amplitudes.

    is_drifting_motion: mask (n,) of the motions whose midpoint drifts and which are therefore not steady.
    """
    last_cycles = np.arange(runs.cycles - 1, -1, -runs.window)[::-1]
    amplitudes = (runs.extremes[:, last_cycles, 1] - runs.extremes[:, last_cycles, 0]) / 2
    floor = AMPLITUDE_ROUND_OFF * (scales.acceleration / (2 * np.pi / scales.period) ** 2)
    decay_per_window = scales.decay * runs.window * scales.period
    with np.errstate(all="ignore"):
        steady = extrapolate_steady_amplitudes(
            amplitudes[:, -N_FINAL_WINDOWS:], runs.phasors[:, -N_FINAL_WINDOWS:]
        )
        is_bounded = False
        if runs.steady is not None:
            is_bounded = ~np.isnan(runs.steady[0])
            steady = [np.where(is_bounded, *values) for values in zip(runs.steady, steady)]
        numbers, *steady = classify_periodic(
            window_amplitude_means(runs.extremes, runs.window)[0],
            runs.extremes,
            runs.window,
            steady,
            (scales.tolerance, floor, decay_per_window),
            is_bounded,
        )
    numbers = np.where((numbers == STEADY_CLASS) & is_drifting_motion, 0, numbers)
    is_loading_run = np.broadcast_to(runs.is_loading, len(numbers))
    outcomes = []
    for number, is_stuck, is_loading in zip(numbers, runs.is_stuck, is_loading_run):
        outcome = Outcome.STUCK if is_stuck else CLASSES[number]
        outcomes.append(Outcome.TRANSIENT if is_loading else outcome)
    return _SteadyOutcomes(outcomes, *steady)


def _list_ringing_warnings(
    scales: CaseScales, runs: Runs, outcomes: list, amplitude, error
) -> dict:
    """Return warnings by case for stuck interfaces whose structure still vibrates.

    amplitude, error: amplitudes (n,) [m] and their numerical errors (n,) [m].
    """
    floor = error_floor(MAIN_MEASURE, scales.displacement) + np.nan_to_num(error)
    decay = np.broadcast_to(scales.decay * scales.period, len(amplitude))
    is_stuck = np.array([outcome is Outcome.STUCK for outcome in outcomes], bool)
    cases = np.flatnonzero(is_stuck & (amplitude != 0))
    ringing = remaining_ringing(runs.extremes[cases], runs.window, decay[cases])
    warnings = {}
    for case, amplitude_left in zip(cases.tolist(), ringing.tolist()):
        sizes = float(amplitude[case]), float(floor[case])
        limits = [float(scales.tolerance[case]), float(decay[case])]
        warning = warn_of_ringing(amplitude_left, sizes, limits, runs.cycles)
        if warning:
            warnings[case] = warning
    return warnings


def _remove_secant_of_rigid_stick(results: CaseResults) -> None:
    """Replace the secant stiffness by a reason where rigid friction sticks at the largest slide.

    See `response.reasons.find_missing_secant`.
    """
    name = "secant_stiffness"
    if name not in results.values or "stick_fraction" not in results.values:
        return
    with np.errstate(invalid="ignore"):
        min_fraction = TABLE["stick_fraction"].floor + np.nan_to_num(
            results.errors["stick_fraction"]
        )
        sticks = ~np.isnan(results.values[name]) & (results.values["stick_fraction"] > min_fraction)
    if sticks.any():
        for columns in (results.values, results.errors):
            columns[name] = np.where(sticks, np.nan, columns[name])
        results.reasons.setdefault(name, {}).update(
            dict.fromkeys(np.flatnonzero(sticks).tolist(), STICKS_AT_REVERSAL_REASON)
        )


def _insert_reasons(models, scales: CaseScales, runs: Runs, results: CaseResults) -> None:
    """Store the reason for each measure without a value in case results."""
    names = [*CYCLE_MEASURES, PHASE_MEASURE]
    for name in names:
        results.add_measure(name, TABLE[name].unit)
    is_missing = np.array([np.isnan(results.values[name]) for name in names])
    stick_fraction = results.values.get("stick_fraction", np.zeros(len(models)))
    # under sinusoidal drive, the reason depends only on these properties
    properties = np.array(
        [*is_missing, stick_fraction == 1, stick_fraction > 0, scales.acceleration != 0]
    )
    patterns, pattern_of_case = np.unique(properties, axis=1, return_inverse=True)
    for pattern in np.flatnonzero(patterns[: len(names)].any(axis=0)).tolist():
        cases = np.flatnonzero(pattern_of_case.ravel() == pattern).tolist()
        drive = models[cases[0]].rig.drive.signal
        values = {name: column[cases[0]] for name, column in results.values.items()}
        values = {name: value for name, value in values.items() if not np.isnan(value)}
        window = SimpleNamespace(time=np.array([0.0, runs.window * drive.period]), extra={})
        for name, measure in find_missing(values, window, drive, True).items():
            results.reasons.setdefault(name, {}).update(dict.fromkeys(cases, measure.reason))
            results.floors[name][cases] = measure.floor


def _may_need_law_warnings(models: SimilarModels, results: CaseResults) -> np.ndarray:
    """Return a mask (n,) of the cases that may need a warning on their friction law.

    These are cases with bonds that grow, creep or have an infinite traction.
    """
    first = models.first
    if not law_has_trait(first.friction.law, "bonds"):
        return np.zeros(len(models), bool)
    if first.bonds.has_growth or first.bonds.order < 0 or first.bonds.reading != "stretch":
        return np.ones(len(models), bool)
    if "drift_per_cycle" not in results.values:  # runs shorter than a cycle have no drift
        return np.zeros(len(models), bool)
    drift = results.values["drift_per_cycle"]
    error = results.errors["drift_per_cycle"]
    return (np.abs(drift) > np.nan_to_num(error)) & (results.outcome != str(Outcome.TRANSIENT))
