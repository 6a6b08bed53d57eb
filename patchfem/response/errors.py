"""Errors of measures from coarser runs of the same scene, by the grid convergence index.

A run that is `ratio` times as coarse in one way (steps, elements, cells of a density, harmonics,
modes, tolerance of a step) changes a measure by ratio**p - 1 times its error, where p is the order
of the error. So the error is SAFETY_FACTOR times the change over ratio**p - 1 (Roache, J. Fluids Eng. 116,
405, 1994; ASME V&V 20). Three runs, each twice as coarse as the one before, show p where a measure
changes monotonically. The error from two runs takes the order that this way of being coarser
declares. No factor belongs to a single measure, law or scene. tests/README.md states which share of
the errors of random scenes holds.
"""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..core import ErrorCauses, Measure
from .rows import error_floor, find_definition

# Roache's safety factor for two runs; it covers runs that are too coarse to show the order.
SAFETY_FACTOR = 3.0
MIN_ORDER = 1.0  # Lowest order of convergence that an estimate assumes.
MAX_ORDER = 2.0  # Highest order of convergence that an estimate assumes, that of the methods.
# Largest ratio of two successive changes, at order 4; above it the last change is accidentally
# small.
MAX_CHANGE_RATIO = 16.0
# Lowest observed order at which an error counts as decreasing with the step.
MIN_OBSERVED_ORDER = 0.5
SUM_ROUND_OFF = 1e-12  # Relative round-off error of a long sum.
MEAN_ROUND_OFF = 1e-13  # Round-off error of a mean over the motion, relative to the amplitude.
ERROR_MEASURES = ("energy_balance", "work_check")  # These measures are errors themselves.


def signed_change(fine: dict, coarse: dict) -> dict:
    """Return the fine-minus-coarse difference of each measure; phase differences lie in +-pi/2."""
    out = {name: fine[name] - coarse[name] for name in fine.keys() & coarse.keys()}
    if "slip_start_phase" in out:
        out["slip_start_phase"] = (out["slip_start_phase"] + np.pi / 2) % np.pi - np.pi / 2
    return out


def absolute_change(fine: dict, coarse: dict) -> dict:
    """Return the absolute difference of each measure in two runs; phases are taken modulo pi."""
    return {name: abs(gap) for name, gap in signed_change(fine, coarse).items()}


def error_of_change(difference, ratio: float = 2.0, order: float = MIN_ORDER):
    """Return the error of a value from its change in a coarser run.

    Parameters
    ----------
    difference : float or (n,)
    ratio : float
        How many times as coarse the other run is; below 1 it is a finer run.
    order : float
        Order at which the error falls.

    Returns
    -------
    float or (n,)
    """
    return SAFETY_FACTOR * np.abs(difference) / abs(ratio**order - 1)


def convergence_error(last, before=None):
    """Return the error of a value from its changes at successive halvings of step or cell.

    Parameters
    ----------
    last : float or (n,)
        Change from the second finest run to the finest.
    before : float or (n,) or None
        Change from the third finest run to the second finest; None or nan if it is not known.
    """
    change = np.abs(last)
    growth = 2.0**MIN_ORDER
    if before is not None:
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.divide(before, last)
        shows_order = (ratio > growth) & (ratio <= MAX_CHANGE_RATIO)
        growth = np.where(shows_order, np.minimum(ratio, 2.0**MAX_ORDER), growth)
        change = np.fmax(change, np.abs(before) / 2.0**MAX_ORDER)
    return (SAFETY_FACTOR * change / (growth - 1))[()]


def convergence_errors(*values: dict) -> dict:
    """Return the error of each measure from its values at successive halvings of step or cell.

    If the interval of a further run contains the value, this run does not widen the error, and
    narrows it by no more than the highest order allows.

    Parameters
    ----------
    values : dict
        Measures by name of each run, fine to coarse; two runs or more.
    """
    changes = [signed_change(fine, coarse) for fine, coarse in pairwise(values)]
    out = {}
    for name in changes[0]:
        out[name] = _error_on_finest_mesh([change[name] for change in changes if name in change])
    return out


def _error_on_finest_mesh(changes: list) -> float:
    """Return the error of a value on the finest mesh from its changes between the meshes."""
    if len(changes) == 1:
        return convergence_error(changes[0])
    error = convergence_error(*changes[-2:])
    for last, before in reversed(list(pairwise(changes[:-1]))):
        next_error = convergence_error(last, before)
        if abs(last) <= error:  # The error interval of the coarser run contains the value.
            next_error = min(next_error, error)
        error = max(next_error, error / 2**MAX_ORDER)
    return error


def step_errors(*values: dict, steps: int) -> dict:
    """Return the time-step error of each measure from runs at halved numbers of steps.

    A measure that counts samples has at least their resolution.

    Parameters
    ----------
    values : dict
        Measures by name at `steps`, a half and a quarter of them per cycle.
    steps : int
        Steps per cycle of the finest run.
    """
    out = convergence_errors(*values)
    for name in out:
        out[name] += find_definition(name).sample_error / steps
    load = values[0].get("normal_load_least", 0.0)
    if values[0].get("open_fraction") == 0 and load > out.get("normal_load_least", np.inf):
        out["open_fraction"] = 0.0  # The load stays above 0 between the samples as well.
    return out


def coarser_errors(fine: dict, *coarse: dict, ratio: float = 2.0, order: float = MIN_ORDER) -> dict:
    """Return the error of each measure from runs with steps or cells `ratio` times as long.

    Parameters
    ----------
    fine : dict
        Measures by name; floats or arrays (n,) of many runs.
    coarse : dict
        The same of each coarser run; the largest change counts.
    ratio, order : float
        How much coarser these runs are, and the order at which their error falls.
    """
    changes = [absolute_change(fine, values) for values in coarse]
    out = {}
    for name in fine:
        if all(name in change for change in changes):
            largest = np.maximum.reduce([change[name] for change in changes])
            out[name] = error_of_change(largest, ratio, order)
    return out


def finer_errors(values: dict, finer: dict) -> dict:
    """Return the error of each measure from a run with more harmonics, modes or bond strips.

    The finer run has twice as many of them. The truncation error of the series of a friction force
    with
    corners is of second order.

    Parameters
    ----------
    values, finer : dict
        Measures by name of the run and of the finer one.
    """
    return coarser_errors(values, finer, ratio=0.5, order=2.0)


def merged_cell_errors(fine: dict, *coarse: dict) -> dict:
    """Return the error of each measure from runs with merged cells of a slider density.

    The force of a density in cells is exact at the ends of a cell and has its largest error, of
    second order in the width, in the middle. A measure that depends on the instants at which the
    interface starts or stops slipping has an error of first order, because the stiffness jumps from
    cell to cell. `dynamics.events.elements.CELL_MERGES` states where the merging starts.

    Parameters
    ----------
    fine : dict
        Measures by name.
    coarse : dict
        Measures of each coarse run.
    """
    errors = coarser_errors(fine, *coarse, ratio=4.0, order=2.0)
    at_instants = coarser_errors(fine, *coarse, ratio=4.0, order=1.0)
    return errors | {
        name: at_instants[name] for name in errors if find_definition(name).sample_error
    }


class FrictionScale(NamedTuple):
    """Reference values of friction (limit, bond length, work) for a relative force error.

    - static: coefficient of friction [1].
    - limit: friction limit [N].
    - bond_length: length of a bond at the limit [m].
    - work, cycle_work: sum of |work| that friction exchanges in the whole run and in a cycle [J].
    """

    static: float
    limit: float
    bond_length: float
    work: float
    cycle_work: float


def friction_errors(values: dict, fraction: float, scale: FrictionScale) -> dict:
    """Return the errors of the measures caused by a relative error of the friction force.

    Forces and slip change by this fraction of their own scale, work by this fraction of the
    exchanged work, the stored energy by this fraction of the energy of a bond at the limit, and
    every other measure by this fraction of its value.

    Parameters
    ----------
    values : dict
        Values of the measures by name.
    fraction : float
        Error of the friction force over the friction limit [1].
    scale : FrictionScale
    """
    ratio = fraction * scale.static
    force = fraction * scale.limit
    work = fraction * scale.work
    direct = {
        "friction_force_peak": force,
        "friction_ratio_end": ratio,
        "friction_ratio_peak": ratio,
        "slip_amplitude": fraction * scale.bond_length,
        "work_check": fraction,
        "energy_stored": force * scale.bond_length,
        "friction_work": work,
        "energy_dissipated": work,
        "loop_area": fraction * scale.cycle_work,
        "energy_balance": 0.0,
        "normal_load": 0.0,
    }
    return {name: direct.get(name, fraction * abs(value)) for name, value in values.items()}


def observed_orders(*values: dict) -> dict:
    """Return the observed convergence order [1] of each measure in the time step, at most 2.

    Parameters
    ----------
    values : dict
        Measures by name of runs with some number of steps per cycle, with a half and with a quarter
        of it; fewer runs show no order.

    Returns
    -------
    dict
        Orders by name. A measure whose change falls with an order below MIN_OBSERVED_ORDER, or that a run
        does not have, is left out: more steps are not known to make it more accurate.
    """
    if len(values) < 3:
        return {}
    fine, half, quarter = values
    last = absolute_change(fine, half)
    before = absolute_change(half, quarter)
    orders = {}
    for name in last:
        if last[name] > 0 and before.get(name, 0.0) > 0:
            order = float(np.log2(before[name] / last[name]))
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
    """Combine values and errors to measures, and add a relative error to each.

    The error of a measure is the sum of its parts plus `min_relative_error` of the value.

    Parameters
    ----------
    values : dict
        Values by name.
    errors, step_values
        See `split_errors`.
    min_relative_error : float
        Fraction of the value that is added [1].
    size : float
        Displacement that the drive itself causes [m], as in `rows.error_floor`.
    """
    out = {}
    amplitude = values.get("relative_displacement_amplitude", 0.0)
    for name, causes in split_errors(values, errors, step_values).items():
        value = float(values[name])
        error = total_error(name, value, causes.parts.values(), min_relative_error, amplitude)
        floor = float(error_floor(name, size))
        out[name] = Measure(value, find_definition(name).unit, float(error), floor, causes=causes)
    return out


def split_errors(values: dict, errors, step_values=()) -> dict:
    """Return the ErrorCauses of measures by name, in which the parts of each cause are summed.

    The part of a measure that a coarse run does not have is its absolute value.

    Parameters
    ----------
    values : dict
        Values by name.
    errors : sequence of (str, dict)
        What is coarser, and errors by name (`coarser.estimate_errors`).
    step_values : sequence of dict
        Values of the run and of its coarser runs in time, fine to coarse.
    """
    orders = observed_orders(*step_values)
    causes = {}
    for name, value in values.items():
        parts: dict = {}
        for cause, errors_by_name in errors:
            parts[cause] = parts.get(cause, 0.0) + errors_by_name.get(name, abs(value))
        causes[name] = ErrorCauses(parts, orders.get(name))
    return causes


def add_stated_errors(measures: dict, stated_errors: dict, end_errors: dict) -> dict:
    """Add the errors that a run itself states to the errors of its measures.

    Parameters
    ----------
    measures : dict
        Measure by name.
    stated_errors : dict
        Errors by name.
    end_errors : dict
        The part of them that is due to an end of the run beside the requested end.
    """
    out = dict(measures)
    for name, measure in measures.items():
        causes = measure.causes
        if causes is not None and end_errors:
            causes = causes._replace(parts=causes.parts | {"end": end_errors.get(name, 0.0)})
        if measure.error is not None:
            error = measure.error + stated_errors.get(name, 0.0)
            out[name] = replace(measure, error=error, causes=causes)
    return out


def total_error(name: str, value, parts, min_relative_error: float, size):
    """Sum the contributions to the error of a measure, of one run or of n runs.

    Parameters
    ----------
    name : str
    value : float or (n,)
        Value of the measure.
    parts : sequence
        Errors that add up.
    min_relative_error : float
        Fraction of the value that is added [1].
    size : float or (n,)
        Amplitude of the output [m].
    """
    error = sum(parts) + np.abs(value) * min_relative_error
    if name == "slip_start_phase":  # The error of a phase modulo pi is at most pi/2.
        return np.minimum(error, np.pi / 2)
    if name in ERROR_MEASURES:  # The value itself is an error.
        return np.maximum(error, np.abs(value))
    if name == "drift_per_cycle":  # The value is a difference of means, which has their round-off.
        return error + max(MEAN_ROUND_OFF, min_relative_error) * np.abs(size)
    return error
