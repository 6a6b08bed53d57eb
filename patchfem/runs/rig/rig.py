"""Run of a rig: solution with refined numerical settings, and completion of its result.

In: the inputs of a run, i.e. its plan and its Patch. Out: a Result. `run_refined` solves the run
with finer and finer settings until its measures meet the tolerance; `run_rig` completes it by the
functions of `postprocessing`.
"""

from dataclasses import replace
from math import ceil

import numpy as np

from ...core import Outcome, PatchfemError
from ...response.coarser import CoarserRuns, ComparisonRuns
from ...response.errors import absolute_change, add_errors
from ...response.reasons import find_missing_unbounded
from ...response.rows import AMPLITUDE, set_final_floors
from ...response.settling import slip_period
from ...structure.drive_sizes import find_decay_rate, is_periodic
from ..results.result import Result, RunInputs
from . import bond_lists, levels, postprocessing
from .costs import MAX_MARCH_STEPS, MAX_RUN_STEPS
from .engines import ENGINES
from .fields import collect_interface_fields
from .motion_warnings import collect_notes, collect_warnings
from .numerics import Numerics, choose_numerics
from .postprocessing import CoupledRun
from .runner import Runner
from .solution import Solution, compute_peak_frequency
from .solve import refuse_long_run

# Outcomes of runs that ended early; more steps do not change them.
EARLY_OUTCOMES = (Outcome.EXCEEDS_TRAVEL, Outcome.LEAVES_GROOVES)
MIN_STEP_ERROR = 1e-12  # Smallest relative error per step; below it round-off dominates.
MIN_STEP_SHARE = 0.5  # Smallest share of the steps in an error that smaller steps reduce.
# Largest number of steps times nodes of a run that is repeated with twice the steps although its displacement meets the
# tolerance; it takes some 10 s of CPU time. The entries of a list of bonds count as nodes.
MAX_REFINED_WORK = 1e8
# Work of a step in which the pressure of a patch is solved, relative to that of another step.
PRESSING_WORK = 40.0


def run_rig(inputs: RunInputs) -> Result:
    """Compute the motion of a rig and return its Result.

    Parameters
    ----------
    inputs : RunInputs
        Plan, Patch with its coarser mesh, and callbacks of the run.

    Raises
    ------
    Missing
        If the run would take too much CPU time.
    PatchfemError
        If the drive excites no mode.
    """
    model = inputs.plan.model
    rig = model.rig
    if rig.start is None and rig.drive.kind != "free" and not np.any(rig.modes.base):
        raise PatchfemError(
            "the drive excites no mode, so nothing moves; give a mode the key `base` or `output`",
            "drive.kind",
        )

    numerics = choose_numerics(model)
    refuse_long_run(model, numerics)
    run = run_refined(inputs, numerics)

    # The reasons of missing values depend on the outcome, so that they come after it.
    if run.solution.levels and run.has_friction:
        run = postprocessing.add_onset_level(run)
    run = postprocessing.add_outcome_and_errors(run)
    run = postprocessing.add_missing_value_reasons(run)
    if rig.drive.kind == "free" and run.has_errors:
        run = postprocessing.add_decay_curve(run)
    if run.has_friction and find_decay_rate(rig.modes) < 0:
        run = postprocessing.add_flutter_amplitude(run)

    # Warnings and notes see the measures before their floors are raised to the tolerance.
    warnings = collect_warnings(run)
    notes = [*collect_notes(run), *run.notes]
    measures = set_final_floors(run.measures, model.accuracy.tolerance)
    if ENGINES[run.numerics.engine].finds_periodic_motion and run.outcome is Outcome.GROWS:
        measures = find_missing_unbounded(measures)

    solution = run.solution
    fields = {}
    if inputs.patch is not None:
        fields = collect_interface_fields(model, run.numerics, inputs.patch, solution)
    return Result(
        plan=inputs.plan,
        outcome=postprocessing.find_final_outcome(run),
        measures=measures,
        response=solution.response,
        window=solution.window,
        patch=inputs.patch,
        fields=fields,
        seconds=inputs.seconds,
        warnings=[*inputs.warnings, *warnings],
        extra=postprocessing.collect_summary_data(run, measures, notes),
    )


def run_refined(inputs: RunInputs, numerics: Numerics) -> CoupledRun:
    """Repeat a run with finer settings until the errors of its measures meet the tolerance.

    Only settings that the scene does not fix are refined. All coarse runs are stored in
    `Runner.solutions` by their settings. Runs that are coarser in space are compared with a run
    that is coarse in time, so that they need not be repeated: their errors are estimated once.

    The error of a measure is the sum of the errors by source (steps, mesh, modes, bonds), each from
    `response.errors.convergence_error`, plus `Engine.min_relative_error` of the value (`add_errors`).
    Afterwards `postprocessing.add_outcome_and_errors` adds the errors that the run itself shows.

    Parameters
    ----------
    inputs : RunInputs
        Plan, Patch with its coarser mesh, and callbacks of the run.
    numerics : Numerics
        Numerical settings of the first run.
    """
    model = inputs.plan.model
    engine = ENGINES[numerics.engine]
    size = model.rig.displacement_scale
    runner = Runner(inputs, numerics)
    solution = runner.solve(numerics)
    inputs.seconds.update({"march": solution.seconds} | (solution.prepare or {}))

    # On a belt, the window must contain a complete stick-slip period, which the first run shows.
    n_cycles = _count_slip_period_cycles(model, numerics, solution)
    if n_cycles > numerics.window:
        numerics = replace(numerics, window=n_cycles)
        solution = runner.solve(numerics)

    if not inputs.estimate or solution.outcome is Outcome.NOT_CONVERGED:
        measures = add_errors(solution.values, size=size) | compute_peak_frequency(solution)
        return CoupledRun(inputs, numerics, solution, measures)

    space_runs = [
        *engine.coarser_in_space(model, numerics, inputs.patch, inputs.coarse[0], solution),
        *engine.list_runs_with_other_modes(model, numerics),
    ]
    space_runs += _list_joint_runs(inputs, space_runs)
    space_errors = runner.estimate_errors(space_runs, solution)

    excesses = []  # Largest ratio of an error due to the steps to the allowed error, of each run.
    while True:
        time_runs = engine.coarser_in_time(model, numerics)
        errors = [*runner.estimate_errors(time_runs, solution), *space_errors]
        coarser_runs = [*time_runs, *space_runs]
        step_runs = runner.list_step_runs(numerics, solution, coarser_runs)
        measures = add_errors(
            solution.values,
            errors,
            [run.values for run in step_runs],
            min_relative_error=engine.min_relative_error,
            size=size,
        )

        if solution.levels or model.rig.drive.kind == "free":
            solution = _add_level_errors(solution, coarser_runs, runner.solutions)

        run = CoupledRun(inputs, numerics, solution, measures)
        if not time_runs or _is_finest(run):
            break
        # The run ends where two runs with smaller steps have not reduced the largest error, as those of some lists of
        # bonds, which depend on the steps.
        excesses.append(_find_step_excess(run))
        if excesses[-1] <= 1 or (len(excesses) > 2 and excesses[-1] >= excesses[-3]):
            break

        # A run with twice the steps is compared with this one.
        runner.solutions[numerics] = solution
        runner.error_seconds += solution.seconds
        numerics = numerics.finer()
        solution = runner.solve(numerics)
        inputs.seconds["march"] = solution.seconds

    if runner.error_seconds:
        inputs.seconds["error"] = runner.error_seconds
    measures |= compute_peak_frequency(solution, runner.solutions.values())
    solution = replace(solution, extra=solution.extra | {"step_runs": step_runs})
    return replace(run, solution=solution, measures=measures)


def _list_joint_runs(inputs: RunInputs, space_runs: ComparisonRuns) -> ComparisonRuns:
    """List the comparison run with a stiffer joint, if a joint was subtracted from the modes.

    Its stiffness is larger by the error of the stiffness that was subtracted, so that the change of a
    measure is its error. The run has the steps of the run on a coarser mesh.
    """
    if inputs.stiffer is None:
        return []
    joint_runs = []
    for kind in space_runs:
        if kind.runs and kind.runs[0].coarse_patch:
            stiffer = replace(kind.runs[0], coarse_patch=False, stiffer_joint=True)
            joint_runs.append(CoarserRuns((stiffer,), absolute_change, kind.reference, "mesh"))
    return joint_runs


def _count_slip_period_cycles(model, numerics, solution) -> int:
    """Return the number of cycles of a complete stick-slip period on a belt.

    Such a motion has its own period, because the drive is not periodic. The result is 0 if there is
    no period, or if the run is shorter than two windows.
    """
    drive = model.rig.drive.signal
    if model.friction is None or not drive.segments or is_periodic(drive):
        return 0
    response = solution.response
    n_cycles = ceil(slip_period(response.time, response.slide_rate) / drive.period)
    return n_cycles if 2 * n_cycles <= numerics.cycles else 0


def _find_step_excess(run: CoupledRun) -> float:
    """Return the largest ratio of error to allowed error of the measures whose error is mainly that of the steps.

    The errors are those of the completed run. If the run takes too much time (MAX_REFINED_WORK), the displacement alone
    counts. The result is 0 if no measure needs smaller steps.
    """
    nodes = max(1 if run.patch is None else run.patch.x.size, run.solution.book.get("strips", 0.0))
    work = run.numerics.steps * run.numerics.cycles * nodes
    if run.model.rig.friction.load_varies and run.patch is not None:
        work *= PRESSING_WORK

    # The engine `hybrid` estimates the error of its steps itself.
    axis = "own" if run.numerics.local else "steps"
    run = postprocessing.add_missing_value_reasons(postprocessing.add_outcome_and_errors(run))
    tolerance = run.model.accuracy.tolerance
    ratios = [0.0]
    for name, measure in set_final_floors(run.measures, tolerance).items():
        counts = name == AMPLITUDE or work <= MAX_REFINED_WORK
        if counts and measure.causes is not None and measure.error:
            share = measure.causes.parts.get(axis, 0.0) / measure.error
            if share > MIN_STEP_SHARE:
                ratios.append(measure.error_ratio(tolerance))
    return max(ratios)


def _is_finest(run: CoupledRun) -> bool:
    """Return whether no run with smaller steps is possible."""
    numerics = run.numerics
    if numerics.local:
        return 0.01 * numerics.local < MIN_STEP_ERROR
    steps = numerics.steps * 2
    return (
        "steps_per_cycle" in numerics.pinned
        or steps > MAX_MARCH_STEPS
        or steps * numerics.cycles > MAX_RUN_STEPS
        or bond_lists.is_bond_list_too_long(run.model, numerics, run.solution.book)
        or run.solution.outcome in EARLY_OUTCOMES
    )


def _add_level_errors(
    solution: Solution, coarser_runs: ComparisonRuns, solutions: dict[Numerics, Solution]
) -> Solution:
    """Add errors from coarse runs to the drive levels of a Solution.

    Parameters
    ----------
    solution : Solution
        Solution of the finest run.
    coarser_runs : list of CoarserRuns
        Settings of the coarse runs by source of error.
    solutions : dict
        Solution of each coarse run by its Numerics.
    """
    # An entry without coarse runs is skipped if the errors of the levels already include it.
    used_runs = [kind for kind in coarser_runs if kind.runs or solution.errors is None]
    pairs = []
    for kind in used_runs:
        # Runs with another bond summation are not used for the errors of decay curves and onsets.
        if kind.runs and kind.runs[0].choice is None:
            pairs.append((solutions[kind.runs[0]], kind.reference and solutions[kind.reference]))
    level_results = ()
    if solution.levels:
        level_results = levels.add_level_errors(solution.levels, used_runs, solutions)
    return replace(solution, levels=level_results, coarser=tuple(pairs))
