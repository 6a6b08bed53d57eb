"""Errors of measures from coarser runs of the same scene, by the grid convergence index.

In a run that is coarser by a factor `ratio` (in steps, elements, cells of a density, harmonics, modes
or the tolerance of a step), a measure changes by ratio**p - 1 times its error, where p is the order of
convergence. The error estimate is therefore SAFETY_FACTOR times the change divided by ratio**p - 1
(Roache, J. Fluids Eng. 116, 405, 1994; ASME V&V 20). Three runs with successive factors of 2 show p if
the measure changes monotonically. For two runs, the assumed order depends on the kind of coarsening. No
factor depends on a measure, law or scene. tests/README.md gives the fraction of the error estimates of
random scenes that contain the true error.
"""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..core import ErrorCauses, Measure
from .rows import error_floor, find_definition

# Roache's safety factor for two runs; it also covers runs outside the asymptotic range.
SAFETY_FACTOR = 3.0
MIN_ORDER = 1.0  # Lowest order of convergence in an estimate.
# Highest order of convergence in an estimate, which is the order of the numerical methods.
MAX_ORDER = 2.0
# Largest plausible ratio of two successive changes (order 4); beyond it, the last change is accidentally
# small.
MAX_CHANGE_RATIO = 16.0
# Lowest observed order of convergence at which an error is assumed to decrease with the step size.
MIN_OBSERVED_ORDER = 0.5
SUM_ROUND_OFF = 1e-12  # Relative round-off error of a long sum.
# Round-off error of the mean position of a motion, relative to its amplitude.
MEAN_ROUND_OFF = 1e-13
# Measures that are errors of the solution, so that their own error is their value.
ERROR_MEASURES = ("energy_balance", "work_check")


def signed_change(fine: dict, coarse: dict) -> dict:
    """Return the difference of each measure, fine minus coarse; phases differ by at most pi/2."""
    changes = {name: fine[name] - coarse[name] for name in fine.keys() & coarse.keys()}
    if "slip_start_phase" in changes:
        changes["slip_start_phase"] = (changes["slip_start_phase"] + np.pi / 2) % np.pi - np.pi / 2
    return changes


def absolute_change(fine: dict, coarse: dict) -> dict:
    """Return the absolute difference of each measure between two runs; phases are modulo pi."""
    return {name: abs(difference) for name, difference in signed_change(fine, coarse).items()}


def error_of_change(difference, ratio: float = 2.0, order: float = MIN_ORDER):
    """Estimate the error of a value from its change in a coarser or finer run.

    Parameters
    ----------
    difference : float or (n,)
    ratio : float
        Ratio of the step or cell sizes of the two runs; below 1 for a finer run.
    order : float
        Order of convergence.

    Returns
    -------
    float or (n,)
    """
    return SAFETY_FACTOR * np.abs(difference) / abs(ratio**order - 1)


def convergence_error(last_change, previous_change=None):
    """Estimate the error of a value from its changes at successive refinements by a factor of 2.

    Parameters
    ----------
    last_change : float or (n,)
        Change from the second finest to the finest run.
    previous_change : float or (n,) or None
        Change from the third finest to the second finest run; None or nan if unknown.
    """
    change = np.abs(last_change)
    growth = 2.0**MIN_ORDER
    if previous_change is not None:
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.divide(previous_change, last_change)
        shows_order = (ratio > growth) & (ratio <= MAX_CHANGE_RATIO)
        growth = np.where(shows_order, np.minimum(ratio, 2.0**MAX_ORDER), growth)
        change = np.fmax(change, np.abs(previous_change) / 2.0**MAX_ORDER)
    return (SAFETY_FACTOR * change / (growth - 1))[()]


def convergence_errors(*values: dict) -> dict:
    """Estimate the error of each measure from runs with successive refinements by a factor of 2.

    With more than three runs, the estimate from the coarser runs is an upper limit for that from
    the finer ones if its interval contains the value. From run to run, the error is assumed to
    decrease by at most the factor of the highest order.

    Parameters
    ----------
    values : dict
        Measures by name of two or more runs, from fine to coarse.
    """
    changes = [signed_change(fine, coarse) for fine, coarse in pairwise(values)]
    errors = {}
    for name in changes[0]:
        errors[name] = _finest_error([change[name] for change in changes if name in change])
    return errors


def _finest_error(changes: list) -> float:
    """Estimate the error of a value from its changes between successive runs, finest first."""
    if len(changes) == 1:
        return convergence_error(changes[0])
    error = convergence_error(*changes[-2:])
    for last, before in reversed(list(pairwise(changes[:-1]))):
        next_error = convergence_error(last, before)
        if abs(last) <= error:  # the value lies in the error interval of the coarser run
            next_error = min(next_error, error)
        error = max(next_error, error / 2**MAX_ORDER)
    return error


def step_errors(*values: dict, steps: int) -> dict:
    """Estimate the time-step error of each measure from runs with fewer steps.

    The error of a measure that is resolved only to a sample is at least this resolution.

    Parameters
    ----------
    values : dict
        Measures by name of the runs with `steps`, a half and a quarter of them per cycle.
    steps : int
        Steps per cycle of the finest run.
    """
    errors = convergence_errors(*values)
    for name in errors:
        errors[name] += find_definition(name).sample_error / steps
    min_load = values[0].get("normal_load_least", 0.0)
    if values[0].get("open_fraction") == 0 and min_load > errors.get("normal_load_least", np.inf):
        errors["open_fraction"] = 0.0  # The normal load remains positive between the samples.
    return errors


def coarser_errors(fine: dict, *coarse: dict, ratio: float = 2.0, order: float = MIN_ORDER) -> dict:
    """Estimate the error of each measure from runs with larger steps or cells.

    Parameters
    ----------
    fine : dict
        Measures by name; floats or arrays (n,) of many runs.
    coarse : dict
        Measures of each coarser run; the largest change is used.
    ratio, order : float
        Ratio of the step or cell sizes, and order of convergence.
    """
    changes = [absolute_change(fine, values) for values in coarse]
    errors = {}
    for name in fine:
        if all(name in change for change in changes):
            largest = np.maximum.reduce([change[name] for change in changes])
            errors[name] = error_of_change(largest, ratio, order)
    return errors


def finer_errors(values: dict, finer: dict) -> dict:
    """Estimate the error of each measure from a run with more harmonics, modes or bond strips.

    The finer run has twice as many of them. The truncation error of the Fourier series of a friction
    force with corners is of second order.

    Parameters
    ----------
    values, finer : dict
        Measures by name of the run and of the finer run.
    """
    return coarser_errors(values, finer, ratio=0.5, order=2.0)


def merged_cell_errors(fine: dict, *coarse: dict) -> dict:
    """Estimate the error of each measure from runs with merged cells of a slider density.

    The force of a density divided into cells is exact at the ends of each cell; its error between them is
    of second order in the cell width. Measures that depend on the start or the end of slip have an error
    of first order, because the stiffness jumps from cell to cell. The merges are those of
    `dynamics.events.elements.CELL_MERGES`.

    Parameters
    ----------
    fine : dict
        Measures by name.
    coarse : dict
        Measures of each coarse run.
    """
    errors = coarser_errors(fine, *coarse, ratio=4.0, order=2.0)
    first_order_errors = coarser_errors(fine, *coarse, ratio=4.0, order=1.0)
    for name in errors:
        if find_definition(name).sample_error:
            errors[name] = first_order_errors[name]
    return errors


class FrictionScale(NamedTuple):
    """Reference values by which a relative force error is multiplied to obtain absolute errors.

    - static: coefficient of static friction [1].
    - limit: friction limit [N].
    - bond_length: stretch of a bond at the limit [m].
    - work, cycle_work: sum of the absolute friction work in the whole run and in a cycle [J].
    """

    static: float
    limit: float
    bond_length: float
    work: float
    cycle_work: float


def friction_errors(values: dict, fraction: float, scale: FrictionScale) -> dict:
    """Return the errors of the measures caused by a relative error of the friction force.

    The error of a measure is `fraction` times a reference value: the friction limit, the bond
    length, the exchanged work, or the energy of a bond at the limit. For other measures, it is
    `fraction` times the value.

    Parameters
    ----------
    values : dict
        Values of the measures by name.
    fraction : float
        Error of the friction force relative to the friction limit [1].
    scale : FrictionScale
    """
    ratio_error = fraction * scale.static
    force_error = fraction * scale.limit
    work_error = fraction * scale.work
    errors = {
        "friction_force_peak": force_error,
        "friction_ratio_end": ratio_error,
        "friction_ratio_peak": ratio_error,
        "slip_amplitude": fraction * scale.bond_length,
        "work_check": fraction,
        "energy_stored": force_error * scale.bond_length,
        "friction_work": work_error,
        "energy_dissipated": work_error,
        "loop_area": fraction * scale.cycle_work,
        "energy_balance": 0.0,
        "normal_load": 0.0,
    }
    return {name: errors.get(name, fraction * abs(value)) for name, value in values.items()}


def observed_orders(*values: dict) -> dict:
    """Return the observed order of convergence of each measure with the time step, at most 2.

    Parameters
    ----------
    values : dict
        Measures by name of three runs, with all, a half and a quarter of the steps; with fewer runs, the
        result is empty.

    Returns
    -------
    dict
        Orders by name, without measures whose order is below MIN_OBSERVED_ORDER, because more steps
        may not make these more accurate, or that are missing in a run.
    """
    if len(values) < 3:
        return {}
    fine, half, quarter = values
    last_changes = absolute_change(fine, half)
    previous_changes = absolute_change(half, quarter)
    orders = {}
    for name in last_changes:
        if last_changes[name] > 0 and previous_changes.get(name, 0.0) > 0:
            order = float(np.log2(previous_changes[name] / last_changes[name]))
            if order >= MIN_OBSERVED_ORDER:
                orders[name] = min(order, MAX_ORDER)
    return orders


def add_errors(
    values: dict,
    errors=(),
    step_values=(),
    *,
    min_relative_error: float = 0.0,
    size: float = np.inf,
) -> dict:
    """Return the measures with given values, with total errors from their errors by source.

    The error of a measure is the sum of the errors by source plus the fraction `min_relative_error`
    of the value.

    Parameters
    ----------
    values : dict
        Values by name.
    errors, step_values
        See `split_errors`.
    min_relative_error : float
        Relative error that is added [1].
    size : float
        Displacement caused by the drive alone [m], as in `rows.error_floor`.
    """
    measures = {}
    amplitude = values.get("relative_displacement_amplitude", 0.0)
    for name, causes in split_errors(values, errors, step_values).items():
        value = float(values[name])
        error = total_error(name, value, causes.parts.values(), min_relative_error, amplitude)
        floor = float(error_floor(name, size))
        measures[name] = Measure(
            value, find_definition(name).unit, float(error), floor, causes=causes
        )
    return measures


def split_errors(values: dict, errors, step_values=()) -> dict:
    """Return the contributions to the error of each measure, and its order of convergence.

    If a measure is missing in a coarse run, its error is its absolute value.

    Parameters
    ----------
    values : dict
        Values by name.
    errors : sequence of (str, dict)
        Error sources with errors by name (`coarser.estimate_errors`).
    step_values : sequence of dict
        Values of the runs with decreasing numbers of time steps, from fine to coarse.
    """
    orders = observed_orders(*step_values)
    causes = {}
    for name, value in values.items():
        parts: dict = {}
        for cause, errors_by_name in errors:
            parts[cause] = parts.get(cause, 0.0) + errors_by_name.get(name, abs(value))
        causes[name] = ErrorCauses(parts, orders.get(name))
    return causes


def add_run_error_estimates(measures: dict, error_estimates: dict, end_errors: dict) -> dict:
    """Add the error estimates of a run to those of its measures.

    Parameters
    ----------
    measures : dict
        Measure by name.
    error_estimates : dict
        Errors by name.
    end_errors : dict
        Part of these errors that is caused by a last sample before or after the requested end time.
    """
    updated = dict(measures)
    for name, measure in measures.items():
        causes = measure.causes
        if causes is not None and end_errors:
            causes = causes._replace(parts=causes.parts | {"end": end_errors.get(name, 0.0)})
        if measure.error is not None:
            error = measure.error + error_estimates.get(name, 0.0)
            updated[name] = replace(measure, error=error, causes=causes)
    return updated


def total_error(name: str, value, parts, min_relative_error: float, size):
    """Return the total error of a measure, of one run or of n runs.

    Parameters
    ----------
    name : str
    value : float or (n,)
        Value of the measure.
    parts : sequence
        Errors by source that are added.
    min_relative_error : float
        Relative error that is added [1].
    size : float or (n,)
        Amplitude of the output [m].
    """
    error = sum(parts) + np.abs(value) * min_relative_error
    if name == "slip_start_phase":  # a phase modulo pi has an error of at most pi/2
        return np.minimum(error, np.pi / 2)
    if name in ERROR_MEASURES:  # The value of such a measure is itself an error.
        return np.maximum(error, np.abs(value))
    if name == "drift_per_cycle":  # a difference of mean values has their round-off
        return error + max(MEAN_ROUND_OFF, min_relative_error) * np.abs(size)
    return error
