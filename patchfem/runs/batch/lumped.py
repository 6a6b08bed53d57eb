"""Batch of lumped cases, with one mode and one contact point, by time steps of `points.cases`.

In: models of a group. Out: `CaseResults`. Each case has as many steps as its tolerance needs. A case that misses it
is computed by a single run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from time import process_time
from typing import NamedTuple

import numpy as np

from ...core import Outcome, SineDrive
from ...effects import law_has_trait, needs_bond_list
from ...friction.bonds.parameters import Bonds
from ...friction.record import make_law
from ...measures import rows
from ...measures.errors import (
    ERROR_MEASURES,
    combine_errors,
    estimate_convergence_errors,
    include_phase_error,
)
from ...measures.outcome import (
    AMPLITUDE_ROUND_OFF,
    describe_ringing,
    is_drifting,
    is_ringing_visible,
)
from ...measures.reasons import CHANGE_NOT_RESOLVED_REASON, STICKS_AT_REVERSAL_REASON, find_missing
from ...measures.rows import (
    AMPLITUDE,
    INTERNAL_VALUES,
    MOTION_TABLE,
    STEADY_AMPLITUDE,
    find_error_floor,
    find_larger_term,
    select_names,
)
from ...measures.settling import (
    MOTION_CLASSES,
    MotionEnds,
    estimate_ringing,
    judge_motions,
    measure_windows,
    select_reported,
)
from ...model.model import Model
from ...model.similar_models import SimilarModels, collect_columns, select_models
from ...motion_measures import ratio_or_zero
from ...points.cases import CaseMarch, is_linear_between_events, list_parameters, march_cases
from ...points.laws import MIN_LENGTH, N_NUMBERS, POINT_LAWS, list_point_law
from ...points.rows import Cases, Law, LawNumber, Number
from ...scene.rules.accuracy import list_fixed_settings
from ..refine import NO_LIMIT, Verdict, refine
from ..results.notes import MAX_WORK_CHECK
from ..results.result import shorten_file_names
from ..rig.motion_warnings import note_on_creep
from . import one_by_one
from .case_results import CaseResults, CodedColumn, has_unreadable_measurements

BATCH_ENGINE = "points"  # name of the engine in the settings of a case
# Longest steps per cycle of successive marches of smooth laws. With 20 steps the error of some motions is up to a hundred
# times that with 40 steps, so that the change between the two would not show the order of convergence.
BATCH_STEPS_PER_CYCLE = (28, 40, 56, 80, 112, 160, 224, 320, 448, 640)
BATCH_STEP_RATIO = 2**0.5  # ratio of the steps of two successive marches
# Factor between the errors of two successive marches, whose order of convergence is 4, as a power of 2
BATCH_ORDER = 2.0
DRIFT = "drift_per_cycle"  # name of the measure, which is the difference of two cycles
DISTORTION = "acceleration_distortion"  # name of the measure
# Measures whose error is not relative to their value
UNPOOLED_MEASURES = {DRIFT, *ERROR_MEASURES}
EXACT_STEPS_PER_CYCLE = 16  # steps of laws that are linear between events, which are exact
EXACT_ROUND_OFF = 1e-12  # round-off of their measures, relative to the value
# Smallest distance of the drive from the frequencies of an undamped mode, relative to the squared frequency of the drive,
# at which forced and free motion do not cancel to more than half the digits
MIN_DETUNING = 1e-6
MAX_CASES_PER_CALL = 1024  # cases whose cycles are held in memory
MIN_BATCH_CYCLES = 20  # smallest number of cycles of a run
MAX_BATCH_CYCLES = 4000  # largest number of cycles of a run, limited by the memory of the extremes
MIN_BATCH_TOLERANCE = 1e-4  # smallest tolerance that BATCH_STEPS_PER_CYCLE meet
# Largest slip amplitude of a sticking interface, relative to the stretch at the friction limit
MAX_STICKING_SLIP_RATIO = 1e-3
# Largest product of micro-damping and a typical speed relative to the kinetic friction, with which the power of the LuGre
# law is not negative
MAX_MICRO_DAMPING_RATIO = 4.0
# Error of a measure that two marches have alike but for round-off, such as a friction limit, relative to its value
MEASURE_CHANGE_ROUND_OFF = 1e-12
SECANT_STIFFNESS = "secant_stiffness"  # name of the measure
CREEP_KEY = "friction.reference_speed"  # key on which the note on creep depends


class Group(NamedTuple):
    """Cases with the same law and number of cycles, with what their errors are relative to, (n,) each.

    - cases: the n cases
    - tolerance: relative tolerance [1]
    - displacement: displacement scale of the rig [m]
    - length: stretch at the friction limit [m]; inf of rigid and of viscous laws
    - may_create: whether the law may create energy
    """

    cases: Cases
    tolerance: np.ndarray
    displacement: np.ndarray
    length: np.ndarray
    may_create: np.ndarray

    def read(self, number: Number) -> np.ndarray:
        """Return a parameter (n,) of the cases."""
        return self.cases.parameters[:, number]

    @property
    def stick_stiffness(self) -> np.ndarray:
        """Stiffness (n,) of the law during stick [N/m]; 0 of rigid and of viscous laws."""
        return self.cases.numbers[:, LawNumber.LIMIT] / self.length

    @property
    def period(self) -> np.ndarray:
        """Duration (n,) of a cycle [s]."""
        return 2 * np.pi / self.read(Number.OMEGA)

    @property
    def decay(self) -> np.ndarray:
        """Logarithmic decay (n,) of a free vibration in a cycle [1], 0 if it is not damped."""
        return np.maximum(0.5 * self.read(Number.DAMPING), 0.0) * self.period

    @property
    def window(self) -> int:
        """Number of the last cycles, which are measured."""
        return int(self.cases.parameters[0, Number.WINDOW])


class Refined(NamedTuple):
    """March of n cases with as many steps as their tolerances need.

    - march: results
    - errors: errors (n,) by name
    - steps: steps per cycle
    - is_met (n,): whether all measures meet the tolerance
    """

    march: CaseMarch
    errors: dict[str, np.ndarray]
    steps: int
    is_met: np.ndarray


class OpenMarch(NamedTuple):
    """Cases of a group that miss their tolerance, (n,) each.

    - level: index of the number of steps of the last march in BATCH_STEPS_PER_CYCLE.
    - numbers: indices of the cases.
    - coarser: values (n,) by name of the last march, and of the one before if there is one.
    """

    level: int
    numbers: np.ndarray
    coarser: list[dict[str, np.ndarray]]


def find_group(model: Model) -> tuple[int, str] | None:
    """Return a key that is equal for models that one call of the kernel computes, or None if it cannot compute a model.

    The kernel steps one mode with one contact point under a sine, and a constant load. The key has the number of cycles and
    the friction law.
    """
    rig = model.rig
    if rows.SINGLE_RUN_ROWS or model.kind != "rig" or model.patch is not None:
        return None

    friction = model.friction
    modes = rig.modes
    drive = rig.drive
    is_one_point = not (
        model.wear is not None
        or has_unreadable_measurements(model)
        or len(rig.friction.interfaces) != 1
        or rig.friction.load_varies
        or rig.friction.names
        or rig.springs.is_nonlinear
        or np.isfinite(rig.springs.travel)
        or friction.law not in POINT_LAWS
    )

    # A bond population is one state variable only if all bonds are alike and do not grow.
    is_one_state = not law_has_trait(friction.law, "bonds") or not (
        needs_bond_list(friction) or friction.slip_growth is not None or friction.initial_bonds != 1
    )

    is_one_mode = (
        modes.omega.size == 1
        and modes.gauge is None
        and rig.structure.richer_rig is None
        and isinstance(drive.signal, SineDrive)
        and not drive.levels.amplitudes
        and modes.base[0] * modes.slide[0] * modes.output[0] != 0
    )

    # The cycles of a group are whole and bounded, and its only setting is the number of steps.
    is_plain = (
        MIN_BATCH_CYCLES <= drive.cycles <= MAX_BATCH_CYCLES
        and drive.cycles == int(drive.cycles)
        and model.accuracy.method == "auto"
        and not list_fixed_settings(model.accuracy)
        and model.accuracy.tolerance >= MIN_BATCH_TOLERANCE
    )
    if not (is_one_point and is_one_state and is_one_mode and is_plain):
        return None
    return int(drive.cycles), friction.law


def solve(models: Sequence[Model], report: Callable | None = None) -> CaseResults:
    """Compute the case results of a group of models."""
    results = CaseResults.blank(len(models))
    for first in range(0, len(models), MAX_CASES_PER_CALL):
        part = range(first, min(first + MAX_CASES_PER_CALL, len(models)))
        results.insert(part, _solve_part(select_models(models, part), report))
    return results


def _solve_part(models: Sequence[Model], report: Callable | None) -> CaseResults:
    """Compute the case results of models by marches, each with more steps than the one before, or by single runs.

    A single run computes each case that `needs_single_run` names. `report` takes a line of text on its progress.
    """
    begin = process_time()
    group = collect_cases(models)
    results = CaseResults.blank(len(models))
    is_alone = np.ones(len(models), bool)
    for indices, refined in march_group(group):
        part = _select(group, indices)
        part_results = make_results(select_models(models, indices), part, refined)
        is_alone[indices] = needs_single_run(part, refined, part_results)
        results.insert(indices, part_results)
    _insert_texts(models, results)
    results.seconds[:] = (process_time() - begin) / len(models)
    one_by_one.replace_by_single_runs(results, models, is_alone, report)
    return results


def collect_cases(models: Sequence[Model]) -> Group:
    """Return the numbers of models with the same law and number of cycles as arrays over the models."""
    columns = collect_columns(models, _list_numbers)
    parameters, numbers, others = np.split(columns, [len(Number), len(Number) + N_NUMBERS])
    arrays = map(np.ascontiguousarray, (parameters.T, numbers.T))
    return Group(Cases(*arrays, others[0]), *others[1:])


def _list_numbers(model: Model) -> tuple[float, ...]:
    """Return the numbers of a model as a flat tuple, which `collect_cases` takes apart again.

    They are the parameters of the rig (`Number`), those of the friction law, the stiffness of the first mode at the
    contact, and the fields of `Group` after the cases.
    """
    rig, friction = model.rig, model.friction
    load = model.point.load
    # Bonds of a batch do not grow.
    has_bonds = law_has_trait(friction.law, "bonds")
    law = Bonds(friction.static, friction.bond_length) if has_bonds else make_law(friction, load)
    has_stiffness = not law_has_trait(friction.law, "memoryless")
    cycles = int(rig.drive.cycles)
    return (
        *list_parameters(rig.modes, rig.drive.signal, load, cycles, min(10, cycles // 10), rig.start),
        *list_point_law(friction.law, law, load),
        rig.first_mode.stiffness,
        model.accuracy.tolerance,
        rig.displacement_scale,
        np.maximum(law.length, MIN_LENGTH) if has_stiffness else np.inf,
        _may_create_energy(model),
    )  # fmt: skip


def _may_create_energy(model: Model):
    """Return whether the friction force may act along the motion, instead of against it, and so create energy."""
    friction = model.friction
    if friction.law == "lugre":
        kinetic = friction.static if friction.kinetic is None else friction.kinetic
        power = friction.micro_damping * model.rig.speed_scale
        return np.greater(power, MAX_MICRO_DAMPING_RATIO * kinetic * model.point.load)
    return np.less(friction.shape, 0.5) if friction.law == "bouc-wen" else False


def march_group(group: Group) -> list[tuple[np.ndarray, Refined]]:
    """March cases, and those that miss their tolerance again with more steps.

    Returns indices of cases and their march, for those that meet their tolerance after each march, and at the end for the
    others. The errors follow from the one or two marches before, with fewer steps. Exact steps need a single march; cases
    without a closed form are left out.
    """
    if is_linear_between_events(group.cases):
        numbers = np.flatnonzero(has_closed_form(group))
        if not numbers.size:
            return []
        part = _select(group, numbers)
        march = march_cases(part.cases, EXACT_STEPS_PER_CYCLE)
        errors = estimate_exact_errors(part, march)
        is_met = np.ones(numbers.size, bool)
        return [(numbers, Refined(march, errors, EXACT_STEPS_PER_CYCLE, is_met))]

    done = []

    def march(level: int, before: OpenMarch | None) -> OpenMarch:
        """March the open cases with more steps, and put those that end with it into the list."""
        before = before or start
        count = BATCH_STEPS_PER_CYCLE[level]
        part = _select(group, before.numbers)
        fine = march_cases(part.cases, count)
        errors = estimate_errors(part, fine, before.coarser)
        is_met = _find_met_cases(part, fine, errors, before.coarser[0])

        # Only cases beyond their tolerance are marched again.
        is_done = is_met | (count == BATCH_STEPS_PER_CYCLE[-1])
        if is_done.any():
            parts = (_select(one, is_done) for one in (fine, errors))
            done.append((before.numbers[is_done], Refined(*parts, count, is_met[is_done])))
        coarser = [_select(values, ~is_done) for values in (fine.values, before.coarser[0])]
        return OpenMarch(level, before.numbers[~is_done], coarser)

    def judge(left: OpenMarch, excesses: list[float]) -> Verdict:
        """Go on with the cases that are left."""
        n_left = left.numbers.size
        return Verdict(float(n_left), left.level + 1 if n_left else None)

    coarse = march_cases(group.cases, BATCH_STEPS_PER_CYCLE[0]).values
    start = OpenMarch(0, np.arange(len(group.tolerance)), [coarse])
    refine(march, 1, judge, NO_LIMIT)
    return done


def _find_met_cases(group: Group, fine: CaseMarch, errors, coarse) -> np.ndarray:
    """Return whether all measures of each case (n,) meet the tolerance.

    `errors` and `coarse` are the errors of the march and the values of the one before, (n,) by name.
    """
    is_met = np.ones(len(group.tolerance), bool)
    for name in fine.values.keys() - set(INTERNAL_VALUES):
        value = fine.values[name]
        allowed = group.tolerance * np.abs(value) + find_floor(name, fine.values, group)
        # A measure that only one of the two marches has shows an event that the other missed.
        is_absent = np.isnan(value) & np.isnan(coarse[name])
        is_met &= (errors[name] <= allowed) | is_absent
    return is_met


def find_repeat_error(group: Group, march: CaseMarch) -> np.ndarray:
    """Return the relative error (n,) that is due to the cycles which are not computed because the motion repeats.

    The last computed cycle differs from the one before by `march.repeat`, relative to the range of the motion. The
    differences of the others decrease at least as fast as the mode rings down, so that their sum is that of a geometric
    series.
    """
    decrease = -np.expm1(-np.pi * group.read(Number.DAMPING) / group.read(Number.OMEGA))
    return march.repeat / np.maximum(decrease, 1 / group.read(Number.CYCLES))


def find_size(name: str, values: dict[str, np.ndarray]) -> np.ndarray:
    """Return the size (n,) of a measure, or of the terms if it is a difference, to which its error is relative.

    `name` is that of the measure, and `values` (n,) are all measures of the cases by name.
    """
    return np.fmax(np.abs(values[name]), find_larger_term(name, values))


def find_distortion_size(group: Group, values: dict[str, np.ndarray]) -> np.ndarray:
    """Return the acceleration (n,) of the output by the largest friction force, relative to its first harmonic.

    The third harmonic of the acceleration is that of the friction force, most of which cancels in it. `values` (n,) are
    all measures of the cases by name.
    """
    push = values["friction_force_peak"] * group.read(Number.MOBILITY)
    push *= np.abs(group.read(Number.OUTPUT))
    return ratio_or_zero(push, values["absolute_acceleration_fundamental"])


def estimate_errors(
    group: Group, march: CaseMarch, coarser: Sequence[dict[str, np.ndarray]]
) -> dict[str, np.ndarray]:
    """Return the errors (n,) by name of a march from the values of one or two coarser ones.

    Parameters
    ----------
    group : Group
        The n cases.
    march : CaseMarch
        March of the cases.
    coarser : sequence of dict
        Values (n,) by name of the marches before, from fine to coarse.
    """
    fine = march.values
    repeat_error = find_repeat_error(group, march)
    with np.errstate(all="ignore"):
        errors = estimate_convergence_errors(
            fine, *coarser, order=BATCH_ORDER, max_order=BATCH_ORDER
        )
        # Two cycles differ by less than the errors of their events, so that a drift has no order of its own.
        drifts = ({DRIFT: values[DRIFT]} for values in (fine, *coarser))
        errors |= estimate_convergence_errors(*drifts, ratio=BATCH_STEP_RATIO)

        # A change that is small by accident does not give an error below the root mean square of those of all measures,
        # relative to the value of a measure or to the terms of a difference.
        names = errors.keys() - UNPOOLED_MEASURES
        sizes = {name: find_size(name, fine) for name in names}
        sizes[DISTORTION] = np.fmax(sizes[DISTORTION], find_distortion_size(group, fine))
        parts = np.array([errors[name] / sizes[name] for name in names])
        is_changed = parts > MEASURE_CHANGE_ROUND_OFF
        squares = np.where(is_changed & (parts < 1), parts, 0.0) ** 2
        pooled = np.sqrt(squares.sum(axis=0) / np.fmax(np.sign(squares).sum(axis=0), 1))
        for name, part in zip(names, pooled * is_changed):
            errors[name] = np.fmax(errors[name], part * sizes[name])
        for name, error in errors.items():
            left_out = march.repeat if name == DRIFT else repeat_error
            errors[name] = combine_errors(name, fine, [error], left_out)
        return include_phase_error(errors)


def estimate_exact_errors(group: Group, march: CaseMarch) -> dict[str, np.ndarray]:
    """Return the errors of the measures of a march by exact steps.

    The work of a motion that repeats may be wrong by the error of the motion times the work that the largest force does
    over the amplitude. While a point sticks, the work of a cycle is the change of the energy of its spring, so that it may
    be wrong only by the difference of two cycles.

    Parameters
    ----------
    group : Group
        The n cases.
    march : CaseMarch
        March of the cases, with the values of their measures.

    Returns
    -------
    dict of str to (n,) ndarray
        Error of each measure by name, in its unit.
    """
    values = march.values
    repeat_error = find_repeat_error(group, march)
    errors = {}
    for name in values:
        round_off = EXACT_ROUND_OFF * find_size(name, values)
        # A drift is the difference of two cycles.
        left_out = march.repeat if name == DRIFT else repeat_error
        errors[name] = combine_errors(name, values, [round_off], left_out)

    slide = values[AMPLITUDE] / np.abs(group.read(Number.OUTPUT))
    difference = np.where(values["slip_amplitude"] > 0, repeat_error, march.repeat)
    work = difference * values["friction_force_peak"] * slide
    errors["loop_area"] += work
    for name in select_names("run"):
        errors[name] += work * march.extremes.shape[1]
    # Without friction both are 0.
    with np.errstate(all="ignore"):
        damping, area = (np.abs(values[name]) for name in ("equivalent_damping", "loop_area"))
        errors["equivalent_damping"] += ratio_or_zero(damping, area) * work
    return include_phase_error(errors)


def has_closed_form(group: Group) -> np.ndarray:
    """Return a mask (n,) of the cases whose mode vibrates, and that have a forced motion.

    Parameters
    ----------
    group : Group
        The n cases.
    """
    columns = group.cases.parameters.T
    damping = columns[Number.DAMPING]
    square = columns[Number.OMEGA] ** 2
    has = columns[Number.STIFFNESS] > damping**2 / 4
    for added in (0.0, columns[Number.MOBILITY] * group.stick_stiffness):
        detuning = columns[Number.STIFFNESS] + added - square
        has &= np.hypot(detuning, damping * columns[Number.OMEGA]) > MIN_DETUNING * square
    return has


def find_floor(name: str, values: dict[str, np.ndarray], group: Group) -> np.ndarray:
    """Return the absolute part (n,) of the allowed error of a measure, in its unit.

    The allowed error is the tolerance times the value plus this floor. A small difference of large terms cannot have a
    small relative error, so that the floor is at least the tolerance times these terms (`measures.rows.find_larger_term`).

    Parameters
    ----------
    name : str
        Name of the measure.
    values : dict of str to (n,) array
        All measures of the cases.
    group : Group
        The n cases.
    """
    floor = find_error_floor(name, values, group.displacement)
    return np.fmax(floor, group.tolerance * find_larger_term(name, values))


def _select(record, rows):
    """Return the given rows of an array, or of all arrays in a record or dict."""
    if isinstance(record, dict):
        return {name: _select(value, rows) for name, value in record.items()}
    if isinstance(record, tuple):
        return type(record)(*(_select(field, rows) for field in record))
    return record[rows]


def make_results(models: Sequence[Model], group: Group, refined: Refined) -> CaseResults:
    """Return the measures of n cases as their single runs would have them, with errors, outcomes and reasons.

    Parameters
    ----------
    models : sequence of Model
        Models of the cases.
    group : Group
        The n cases.
    refined : Refined
        March of the cases with as many steps as their tolerances need.
    """
    values, errors = dict(refined.march.values), dict(refined.errors)
    results = CaseResults.blank(len(group.tolerance))
    classes, steady = _judge_motions(group, refined)
    is_stuck = values["slip_amplitude"] <= _stick_tolerance(group)

    # A mode that vibrates freely above a sticking interface is not steady, nor is one whose mean stretch increases.
    ringing = np.where(is_stuck, find_visible_ringing(group, refined), 0.0)
    is_ringing = ringing > 0
    force = np.diff(np.abs(refined.march.stretches), axis=1)[:, 0] * group.stick_stiffness
    is_loading = is_stuck & (force > group.tolerance * values["friction_force_peak"])
    is_changing = is_ringing | is_loading
    classes = np.where(is_changing, MOTION_CLASSES.index(Outcome.TRANSIENT), classes)
    names = np.array([*map(str, MOTION_CLASSES), str(Outcome.STUCK)], object)
    results.outcome[:] = names[np.where(is_stuck & ~is_changing, len(MOTION_CLASSES), classes)]
    for case in np.flatnonzero(is_ringing):
        limits = group.tolerance[case], group.decay[case]
        ratio = ringing[case] / values[AMPLITUDE][case]
        results.warnings[case] = [describe_ringing(ratio, limits, refined.march.extremes.shape[1])]

    # The steady amplitude is a measure if the motion still changes.
    with np.errstate(invalid="ignore"):
        values[STEADY_AMPLITUDE], errors[STEADY_AMPLITUDE] = select_reported(
            steady, results.outcome, values[AMPLITUDE], errors[AMPLITUDE], group.tolerance
        )
        values[STEADY_AMPLITUDE] = np.where(is_loading, np.nan, values[STEADY_AMPLITUDE])

    # A growing motion has no limit, so that no error is stated for its values.
    grows = results.outcome == str(Outcome.GROWS)
    for name, value in values.items():
        is_known = ~np.isnan(value)
        if name not in INTERNAL_VALUES and is_known.any():
            results.units[name] = MOTION_TABLE[name].unit
            results.values[name] = value
            results.errors[name] = np.where(is_known & ~grows, errors[name], np.nan)
            results.floors[name] = np.where(is_known, find_floor(name, values, group), np.nan)

    is_unresolved = np.isnan(values[STEADY_AMPLITUDE])
    is_unresolved &= results.outcome == str(Outcome.TRANSIENT)
    _put_reason(results, STEADY_AMPLITUDE, is_unresolved, CHANGE_NOT_RESOLVED_REASON)

    # The secant stiffness of a rigid stick is infinite at a reversal.
    first = models[0]
    if first.sticks_rigidly:
        least = MOTION_TABLE["stick_fraction"].floor + errors["stick_fraction"]
        is_infinite = (values["stick_fraction"] > least) & (values[AMPLITUDE] > 0)
        _put_reason(results, SECANT_STIFFNESS, is_infinite, STICKS_AT_REVERSAL_REASON)

    # Measures that a case lacks get the reasons that a single run states. They are the same for cases that lack the same
    # measures and stick alike.
    drive = first.rig.drive.signal
    sticking = values["stick_fraction"]
    patterns = np.vstack([results.find_known(), sticking == 1, sticking > 0])
    _, firsts, places = np.unique(patterns, axis=1, return_index=True, return_inverse=True)
    for pattern, case in enumerate(firsts):
        names = [name for name in results.values if results.has(name, case)]
        known = {name: results.values[name][case] for name in names}
        alike = np.flatnonzero(places.ravel() == pattern)
        results.fill(alike, find_missing(known, group.window * drive.period, drive, True))
    results.numerics[:] = {
        "engine": BATCH_ENGINE,
        "steps_per_cycle": refined.steps,
        "window_cycles": group.window,
    }
    return results


def _put_reason(results: CaseResults, name: str, is_missing: np.ndarray, reason: str) -> None:
    """Replace values of a measure by the reason why they are missing.

    `name` is that of the measure, and `is_missing` (n,) is a mask of the cases. `results` is changed.
    """
    if not is_missing.any():
        return
    results.add_measure(name, MOTION_TABLE[name].unit)
    for column in (results.values[name], results.errors[name]):
        column[is_missing] = np.nan
    results.floors[name][is_missing] = MOTION_TABLE[name].floor
    results.reasons.setdefault(name, CodedColumn(len(results)))[is_missing] = reason


def _stick_tolerance(group: Group) -> np.ndarray:
    """Return the largest slip amplitude (n,) [m] of a sticking interface; -1 of a law that never sticks."""
    is_rigid = group.cases.numbers[:, LawNumber.LAW] == Law.COULOMB
    return np.where(
        np.isfinite(group.length),
        MAX_STICKING_SLIP_RATIO * group.length,
        np.where(is_rigid, 0.0, -1.0),
    )


def _judge_motions(group: Group, refined: Refined) -> MotionEnds:
    """Classify the motions of n cases by their outcome, and estimate their steady amplitudes.

    Parameters
    ----------
    group : Group
        The n cases.
    refined : Refined
        March of the cases, with the smallest and largest output `extremes` (n, cycles, 2) [m] of each cycle.
    """
    march, values = refined.march, refined.march.values
    drive = np.abs(group.read(Number.DRIVE) * group.read(Number.OUTPUT))

    # The amplitudes of the final windows are extrapolated to infinite time.
    with np.errstate(all="ignore"):
        classes, steady = judge_motions(
            march.extremes,
            march.phasors,
            group.window,
            group.tolerance,
            AMPLITUDE_ROUND_OFF * drive / group.read(Number.OMEGA) ** 2,
            group.decay * group.window,
        )

    # A periodic motion about a moving mean is transient.
    drifts = is_drifting(
        values[DRIFT],
        refined.errors[DRIFT],
        values[AMPLITUDE],
        group.tolerance,
        find_error_floor(DRIFT, values, group.displacement),
    )
    is_steady = classes == MOTION_CLASSES.index(Outcome.STEADY)
    return MotionEnds(
        np.where(is_steady & drifts, MOTION_CLASSES.index(Outcome.TRANSIENT), classes), steady
    )


def find_visible_ringing(group: Group, refined: Refined) -> np.ndarray:
    """Return the free vibrations (n,) [m] of the modes of n cases whose points stick; 0 where none is visible.

    Parameters
    ----------
    group : Group
        The n cases.
    refined : Refined
        March of the cases.
    """
    march = refined.march
    windows = measure_windows(march.extremes, group.window)
    ringing = estimate_ringing(windows, group.decay * group.window)
    amplitude = march.values[AMPLITUDE]
    floor = find_floor(AMPLITUDE, march.values, group)
    sizes = amplitude, refined.errors[AMPLITUDE], floor
    is_visible = is_ringing_visible(ringing, *sizes, group.tolerance) & (amplitude > 0)
    return np.where(is_visible, ringing, 0.0)


def needs_single_run(group: Group, refined: Refined, results: CaseResults) -> np.ndarray:
    """Return a mask (n,) of the cases that only a single run can compute.

    Parameters
    ----------
    group : Group
        The n cases.
    refined : Refined
        March of the cases with as many steps as their tolerances need.
    results : CaseResults
        Results of the march.
    """
    values = refined.march.values
    is_alone = ~refined.is_met | (results.outcome == str(Outcome.GROWS))
    is_alone |= group.may_create > 0
    is_alone |= ~(group.read(Number.LOAD) > 0) | (group.read(Number.DRIVE) == 0)
    # Bonds and springs stretch although they carry no force
    is_alone |= (group.cases.numbers[:, LawNumber.LIMIT] == 0) & np.isfinite(group.length)

    with np.errstate(invalid="ignore"):
        is_alone |= ~(values["work_check"] <= MAX_WORK_CHECK)
    return is_alone


def _insert_texts(models: Sequence[Model], results: CaseResults) -> None:
    """Store the warnings and notes that follow from the models alone in `results`, by case.

    Similar models have them in common, except for a note on creep with the speed of each case.
    """
    creeps = law_has_trait(models[0].friction.law, "creeps")
    groups: Iterable[tuple] = enumerate(models)
    if isinstance(models, SimilarModels):
        has_own_notes = creeps and CREEP_KEY in models.plain_numbers.limits
        groups = groups if has_own_notes else [(slice(None), models.first)]

    own_warnings = dict(results.warnings)
    for cases, model in groups:
        texts = [*model.source.remarks, *model.rig.structure.notes]
        notes = [*model.source.notes, *(note_on_creep(model.friction) if creeps else ())]
        if texts:
            results.warnings[cases] = shorten_file_names(texts, model.source.path)
        if notes:
            results.notes[cases] = notes
    for case, texts in own_warnings.items():
        shared = results.warnings[case]
        results.warnings[case] = shared if shared == texts else [*shared, *texts]
