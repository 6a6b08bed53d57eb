"""Accuracy of a motion against its computing time, from the runs of its error estimate.

In: a Result whose `extra["step_runs"]` has the run and its runs with fewer steps. Out: an
`AccuracyCurve`; no further run is needed. In contrast, `campaigns.cost` measures whole runs.
"""

from typing import NamedTuple

from ..response.errors import ERROR_MEASURES, MIN_ORDER, absolute_change
from .refine import is_main

ROUND_OFF = 1e-9  # Largest relative error that counts as round-off in long sums.
# Smallest ratio of the errors with finer and coarser steps at which the steps do not matter.
NO_EFFECT_RATIO = 0.9


class StepSetting(NamedTuple):
    """Number of time steps with the CPU time and the accuracy of the motion.

    - steps: steps per cycle.
    - seconds: CPU seconds of the motion: the steps times the smallest time per step of all runs.
    - error: largest error of the main measures, as the smallest tolerance that it meets [1].
    - measure: name of the measure with this error.
    """

    steps: int
    seconds: float
    error: float
    measure: str


class AccuracyCurve(NamedTuple):
    """Accuracy of a motion for several numbers of steps per cycle.

    - coarser: StepSettings of the runs with fewer steps, from fine to coarse.
    - present: StepSetting of the run.
    - finer: predicted StepSetting for twice the steps; None if they would not reduce the largest
      error.
    - limiting_measure: measure with the largest error for twice the steps.
    - cause: kind of coarsening, other than the steps, that contributes most to this error, as in
      `CoarserRuns.source`; "" if there is none.
    - tolerance: tolerance of the scene.
    """

    coarser: list
    present: StepSetting
    finer: StepSetting | None
    limiting_measure: str
    cause: str
    tolerance: float


def compute_accuracy_curve(result) -> AccuracyCurve | None:
    """Compute the accuracy of a motion as a function of its CPU time.

    The error of a coarser run is its difference from the run plus the error of the run. The error
    for twice the steps is predicted from the observed order of convergence.

    Parameters
    ----------
    result : Result

    Returns
    -------
    AccuracyCurve or None
        None if there is no run with fewer steps, if no error exceeds round-off, or if the steps do
        not limit the accuracy.
    """
    step_runs = result.extra.get("step_runs", ())
    if len(step_runs) < 2:
        return None
    present_run, *coarser_runs = step_runs
    measures = _select_measures(result.measures, step_runs)
    tolerance = result.plan.model.accuracy.tolerance
    errors = {name: measure.error for name, measure in measures.items()}

    # The first run also loads compiled code, so that the smallest time per step is used.
    step_seconds = min(run.seconds / run.steps for run in step_runs)

    def make_setting(steps: int, errors_by_name: dict) -> StepSetting:
        """Return the StepSetting with the largest error of all measures."""
        fractions = {}
        for name, measure in measures.items():
            size = abs(measure.value) + measure.floor / tolerance
            fractions[name] = float(errors_by_name[name] / size) if size else 0.0
        worst = max(fractions, key=fractions.get)
        return StepSetting(steps, steps * step_seconds, fractions[worst], worst)

    if not measures:
        return None
    present = make_setting(present_run.steps, errors)
    if present.error < ROUND_OFF:
        return None
    coarser = []
    distances = errors
    for run in coarser_runs:
        change = absolute_change(present_run.values, run.values)
        # A coarse run that is accurate by chance gets the error of the finer one.
        distances = {name: max(change[name] + errors[name], distances[name]) for name in measures}
        coarser.append(make_setting(run.steps, distances))
    if coarser[-1].error * NO_EFFECT_RATIO < present.error:
        return None
    expected = make_setting(2 * present.steps, _predict_errors(measures))
    limiting = measures[expected.measure]
    other_errors = dict(limiting.causes.parts)
    # The remainder is estimated by the run itself, for example the error between samples.
    other_errors["own"] = limiting.error - sum(other_errors.values())
    other_errors.pop("steps", None)
    cause = max(other_errors, key=other_errors.get, default="")
    finer = expected if expected.error <= NO_EFFECT_RATIO * present.error else None
    return AccuracyCurve(coarser, present, finer, expected.measure, cause, tolerance)


def _select_measures(measures: dict, step_runs) -> dict:
    """Return the main measures that have errors and occur in all runs; else all such measures."""
    common = {}
    for name, measure in measures.items():
        is_known = None not in (measure.value, measure.error, measure.causes)
        is_in_all_runs = all(name in run.values for run in step_runs)
        if is_known and is_in_all_runs and name not in ERROR_MEASURES:
            common[name] = measure
    main = {name: measure for name, measure in common.items() if is_main(name)}
    return main or common


def _predict_errors(measures: dict) -> dict:
    """Predict the errors of all measures for a run with twice as many steps."""
    expected = {}
    for name, measure in measures.items():
        parts, order = measure.causes
        reduction = 1 - 2.0 ** -(order or MIN_ORDER)
        expected[name] = measure.error - min(parts.get("steps", 0.0), measure.error) * reduction
    return expected
