"""Errors of measures by source: coarser runs, sampling, and the friction force.

The error of a measure from coarser runs of the same scene follows from the grid convergence index (`convergence`). Three
runs with successive factors of 2 show the order of convergence if the measure changes monotonically. For two runs, the
assumed order depends on the kind of coarsening.

An engine lists its comparison runs as `CoarserRuns`: runs that are coarser in time, in space, in modes or in the sum over
bonds, and the rule that estimates errors from their measures. `estimate_errors` computes each run only once and returns the
errors by source and measure name.
"""

from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..convergence import (
    MAX_CONVERGENCE_ORDER,
    MIN_CONVERGENCE_ORDER,
    convergence_error,
)
from ..core import Measure
from .measures import Measures, Values
from .rows import (
    SLIP_START_PHASE,
    STICK_FRACTION,
    find_definition,
    find_error_floor,
    find_larger_term,
    find_subtracted_terms,
    select_names,
)

# Measures that are errors of the solution, so that their own error is their value.
ERROR_MEASURES = select_names("error")
PHASE_MEASURES = select_names("phase")  # Angles modulo pi.
# Round-off error of a difference relative to its larger terms: hundreds of additions of a loop or a motion, whose
# rounding errors of 2e-16 each were up to 15 times that together.
DIFFERENCE_ROUND_OFF = 1e-13


def compute_changes(fine: Values, coarse: Values) -> Values:
    """Return the difference of each measure, fine minus coarse; that of phases is reduced modulo pi."""
    changes = {name: fine[name] - coarse[name] for name in fine if name in coarse}
    for name in PHASE_MEASURES:
        if name in changes:
            changes[name] = (changes[name] + np.pi / 2) % np.pi - np.pi / 2
    return changes


def compute_absolute_changes(fine: Values, coarse: Values) -> Values:
    """Return the absolute difference of each measure between two runs; phases are modulo pi."""
    return {name: abs(change) for name, change in compute_changes(fine, coarse).items()}


def estimate_convergence_errors(
    *values: Values,
    ratio: float = 2.0,
    order: float = MIN_CONVERGENCE_ORDER,
    max_order: float = MAX_CONVERGENCE_ORDER,
    steps: int | None = None,
) -> Values:
    """Estimate the error of each measure from two or more successive runs (`convergence_error`).

    Parameters
    ----------
    *values : dict
        Measures by name of the runs, from fine to coarse; floats or arrays (n,) of many runs.
    ratio, order, max_order : float
        Ratio of the step or cell sizes of successive runs, order of convergence that is assumed, and the highest one that
        the changes can show.
    steps : int, optional
        Steps per cycle of the finest run, if the others have fewer steps. The error of a measure that
        is resolved only to a sample is then increased by this resolution.

    Returns
    -------
    dict
        Errors by name, for the measures of the two finest runs.
    """
    changes = [compute_changes(*pair) for pair in pairwise(values)]
    errors = {}
    for name in changes[0]:
        known = [change[name] for change in changes if name in change]
        errors[name] = convergence_error(*known, ratio=ratio, order=order, max_order=max_order)
        if steps is not None:
            errors[name] += find_definition(name).sample_error / steps
    min_load = values[0].get("normal_load_least", 0.0)
    if (
        steps is not None
        and values[0].get("open_fraction") == 0
        and min_load > errors.get("normal_load_least", np.inf)
    ):
        errors["open_fraction"] = 0.0  # The normal load remains positive between the samples.
    return errors


def estimate_errors_from_finer(values: Values, finer: Values, *coarser: Values) -> Values:
    """Estimate the error of each measure from a run with more modes or bond strips.

    The finer run has twice as many of them, and the coarser run half as many. Where the change to the
    finer run is small by accident, the error is that of the change from the coarser run, reduced by
    2**MAX_CONVERGENCE_ORDER.

    Parameters
    ----------
    values, finer : dict
        Measures by name of the run and of the finer run.
    coarser : dict, optional
        Measures by name of the coarser run.

    Returns
    -------
    dict
        Errors by name.
    """
    errors = estimate_convergence_errors(values, finer, ratio=0.5, order=MAX_CONVERGENCE_ORDER)
    for run in coarser:
        for name, error in estimate_convergence_errors(
            values, run, order=MAX_CONVERGENCE_ORDER
        ).items():
            if name in errors:
                errors[name] = np.maximum(errors[name], error / 2.0**MAX_CONVERGENCE_ORDER)
    return errors


def estimate_sampling_errors(values: Values) -> Values:
    """Estimate the errors of measures due to sampling with 400 samples per cycle."""
    errors = {}
    for name, value in values.items():
        definition = find_definition(name)
        if definition.has("loop"):
            # Relative error of loop measures from 400 samples per cycle.
            errors[name] = 1e-4 * abs(value)
        elif definition.sample_error:
            # Error of the stick fraction [1] and of the phase at slip start [rad] from 400 samples
            # per cycle.
            errors[name] = 0.005
        else:
            # Relative error of all other measures, which are interpolated.
            errors[name] = 1e-9 * abs(value)
    return errors


def compute_friction_errors(values: Values, fraction: float, law, load: float, works) -> Values:
    """Return the errors of the measures caused by a relative error of the friction force.

    The error of a measure is `fraction` times the size that its row names: the friction limit, the bond
    length, the exchanged work, or the energy of a bond at the limit. For other measures, it is
    `fraction` times the value.

    Parameters
    ----------
    values : dict
        Values of the measures by name.
    fraction : float
        Error of the friction force relative to the friction limit [1].
    law
        Law with its coefficient of static friction and its bond length [m].
    load : float
        Largest normal load [N].
    works : (2,)
        Sums of the absolute friction work in the whole run and in a cycle [J].
    """
    limit = law.static * load
    sizes = {
        "none": 0.0,
        "one": 1.0,
        "static": law.static,
        "limit": limit,
        "bond_length": law.bond_length,
        "bond_energy": limit * law.bond_length,
        "work": works[0],
        "cycle_work": works[1],
    }
    scales = {name: find_definition(name).friction_scale for name in values}
    return {name: fraction * sizes.get(scales[name], abs(values[name])) for name in values}


def add_errors(
    values: Values, errors=(), *, min_relative_error: float = 0.0, size: float = np.inf
) -> Measures:
    """Return the measures with given values, with total errors from their errors by source.

    The error of a measure is the sum of the errors by source plus the fraction `min_relative_error`
    of the value.

    Parameters
    ----------
    values : dict
        Values by name.
    errors : sequence of (str, dict)
        Error sources with errors by name (`estimate_errors`).
    min_relative_error : float
        Relative error that is added [1].
    size : float
        Displacement caused by the drive alone [m], which limits the floors of displacements.
    """
    parts_by_name = split_errors(values, errors)
    totals = {}
    for name, parts in parts_by_name.items():
        totals[name] = combine_errors(name, values, parts.values(), min_relative_error)

    measures = {}
    for name, error in include_phase_error(totals).items():
        unit = find_definition(name).unit
        floor = float(find_error_floor(name, values, size))
        measures[name] = Measure(
            float(values[name]), unit, float(error), floor, parts=parts_by_name[name]
        )
    return measures


def include_phase_error(errors: Values) -> Values:
    """Return errors by name, of which that of the stick fraction is at least that of the phase at which slip starts.

    Slip starts at the instants that end the time of stick, so that an error of pi of the phase is one of 1 of the fraction.

    Parameters
    ----------
    errors : dict
        Errors by name, each a float or (n,), NaN where it is unknown.
    """
    if STICK_FRACTION not in errors or SLIP_START_PHASE not in errors:
        return errors
    least = errors[SLIP_START_PHASE] / np.pi
    return errors | {STICK_FRACTION: np.fmax(errors[STICK_FRACTION], least)}


def split_errors(values: Values, errors) -> dict[str, Values]:
    """Return the contributions to the error of each measure by source.

    If a measure is missing in a coarse run, its error is its absolute value.

    Parameters
    ----------
    values : dict
        Values by name.
    errors : sequence of (str, dict)
        Error sources with errors by name (`estimate_errors`).
    """
    by_source: dict[str, Values] = {}
    for source, errors_by_name in errors:
        sums = by_source.setdefault(source, dict.fromkeys(values, 0.0))
        for name, value in values.items():
            sums[name] += errors_by_name.get(name, abs(value))

    by_source = {source: include_phase_error(sums) for source, sums in by_source.items()}
    return {name: {source: sums[name] for source, sums in by_source.items()} for name in values}


def add_run_error_estimates(measures: Measures, error_estimates: Values) -> Measures:
    """Add the error estimates of a run itself to the errors of its measures.

    Parameters
    ----------
    measures : dict
        Measure by name; a measure without an error is not changed.
    error_estimates : dict
        Errors by name, in the unit of each measure.

    Returns
    -------
    dict
        Measure by name.
    """
    totals = {}
    for name, measure in measures.items():
        if measure.error is not None:
            totals[name] = measure.error + error_estimates.get(name, 0.0)
    totals = include_phase_error(totals)
    return measures | {
        name: replace(measures[name], error=float(error)) for name, error in totals.items()
    }


def combine_errors(name: str, values: Values, parts, min_relative_error):
    """Return the total error of a measure, of one run or of n runs.

    The round-off of a small difference of large terms is added: of a friction force whose first harmonic lags the slide by
    a quarter cycle, the equivalent stiffness is nothing else.

    Parameters
    ----------
    name : str
        Name of the measure.
    values : dict
        Values by name, each a float or (n,).
    parts : sequence
        Errors by source that are added.
    min_relative_error : float or (n,)
        Relative error that is added [1].
    """
    value = values[name]
    error = sum(parts) + np.abs(value) * min_relative_error
    if name in PHASE_MEASURES:  # a phase modulo pi has an error of at most pi/2
        return np.minimum(error, np.pi / 2)
    if name in ERROR_MEASURES:  # The value of such a measure is itself an error.
        return np.maximum(error, np.abs(value))
    error = error + DIFFERENCE_ROUND_OFF * find_larger_term(name, values)
    return error + np.maximum(DIFFERENCE_ROUND_OFF, min_relative_error) * find_subtracted_terms(
        name, values
    )


# Rule of CoarserRuns for a coarser mesh or fewer shear modes.
second_order_errors = partial(estimate_convergence_errors, order=MAX_CONVERGENCE_ORDER)
# Rule of CoarserRuns for a coarser mesh under points that pass an edge of contact. The place of the edge between the points
# has an error of a part of their distance that varies irregularly from mesh to mesh; a higher order shows by chance.
edge_errors = partial(estimate_convergence_errors, max_order=MIN_CONVERGENCE_ORDER)


class CoarserRuns(NamedTuple):
    """Coarser runs for one source of error, with the rule that estimates this error.

    - runs: settings of the runs (hashable arguments of `solve`), from fine to coarse.
    - rule: function (values of the reference run, *values of the coarse runs) that returns errors by
      measure name.
    - reference: settings of the reference run to which they are compared; None: the fine run.
    - source: source of the error, i.e. what is coarser: "steps", "mesh", "modes", "bonds" or
      "samples"; "own" if no key of a scene sets it.
    """

    runs: tuple[Hashable, ...]
    rule: Callable[..., Values]
    reference: Hashable = None
    source: str = "own"


ComparisonRuns = list[CoarserRuns]  # one for each source of error
SourceErrors = tuple[str, Values]  # source of an error, and errors by measure name


class StepRun(NamedTuple):
    """Run with a given number of time steps per cycle.

    - steps: steps per cycle.
    - seconds: CPU time [s].
    - values: measures by name.
    """

    steps: int
    seconds: float
    values: Values


def estimate_errors(
    solve, fine: Values, coarse_runs: ComparisonRuns, solved_runs
) -> list[SourceErrors]:
    """Compute coarser runs, and estimate the errors of the measures by source.

    Parameters
    ----------
    solve : callable
        Function of the settings that returns a run with the attribute `values`.
    fine : dict
        Measures of the fine run by name.
    coarse_runs : list of CoarserRuns
        Settings of the coarse runs and rule of their error, by source.
    solved_runs : dict
        Known runs by settings; new runs are added.

    Returns
    -------
    list of (str, dict)
        Source of the error and errors by measure name, for each of the CoarserRuns.
    """

    def solve_values(settings) -> Values:
        """Return the measures of a run with given settings, computed only once."""
        if settings not in solved_runs:
            solved_runs[settings] = solve(settings)
        return solved_runs[settings].values

    errors = []
    for coarser in coarse_runs:
        reference_values = fine if coarser.reference is None else solve_values(coarser.reference)
        errors.append(
            (coarser.source, coarser.rule(reference_values, *map(solve_values, coarser.runs)))
        )
    return errors


def list_step_runs(steps: int, fine, coarse_runs: ComparisonRuns, solved_runs) -> list[StepRun]:
    """Return a StepRun of a run and of each run with fewer steps, from fine to coarse.

    Without coarse runs in time, the list contains only the run itself.

    Parameters
    ----------
    steps : int
        Steps per cycle of the run.
    fine
        The run, with its CPU time `seconds` [s] and its measures `values` by name.
    coarse_runs : list of CoarserRuns
        Settings of the coarse runs, those in time first.
    solved_runs : dict
        Coarse runs by settings.
    """
    runs = [StepRun(steps, fine.seconds, fine.values)]
    if coarse_runs and coarse_runs[0].source == "steps":
        for settings in coarse_runs[0].runs:
            run = solved_runs[settings]
            runs.append(StepRun(settings.steps, run.seconds, run.values))
    return runs
