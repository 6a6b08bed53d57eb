"""Accuracy of a motion against its computing time, from the runs of its error estimate.

In: a Result whose `motion.step_runs` has the run and its runs with fewer steps. Out: `StepSetting`s; no further run
is needed. In contrast, `campaigns.cost` measures whole runs.
"""

from typing import NamedTuple

from .. import response
from .refine import is_main
from .results.patch_rows import Measures, Values

LONG_SUM_ROUND_OFF = 1e-9  # Largest relative error that counts as round-off in long sums.
# Smallest ratio of the errors with finer and coarser steps at which the steps do not matter.
INEFFECTIVE_STEPS_ERROR_RATIO = 0.9


class StepSetting(NamedTuple):
    """Number of time steps with the CPU time and the accuracy of the motion.

    - steps: steps per cycle.
    - seconds: CPU seconds of the motion: the steps times the smallest time per step of all runs.
    - error: largest ratio of the error of a main measure to its size [1]. It is the smallest value of
      `accuracy.tolerance` that these steps meet.
    """

    steps: int
    seconds: float
    error: float


def compute_accuracy_curve(result) -> list[StepSetting]:
    """Compute the accuracy of a motion as a function of its CPU time, from few steps to many.

    The error of a coarser run is its difference from the run plus the error of the run.

    Parameters
    ----------
    result : Result
        Result of the motion, with `motion.step_runs`.

    Returns
    -------
    list of StepSetting
        [] if there is no run with fewer steps, if no error exceeds round-off, or if the steps do not limit the accuracy.
    """
    step_runs = result.motion.step_runs
    if len(step_runs) < 2:
        return []
    measures = _select_measures(result.measures, step_runs)
    if not measures:
        return []
    present_run, *coarser_runs = step_runs
    tolerance = result.plan.model.accuracy.tolerance

    # The first run also loads compiled code, so that the smallest time per step is used.
    step_seconds = min(run.seconds / run.steps for run in step_runs)

    def make_setting(steps: int, errors: Values) -> StepSetting:
        """Return the StepSetting with the largest of the errors of all measures by name."""
        fractions = [0.0]
        for name, measure in measures.items():
            size = abs(measure.value) + measure.floor / tolerance
            fractions.append(float(errors[name] / size) if size else 0.0)
        return StepSetting(steps, steps * step_seconds, max(fractions))

    errors = {name: measure.error for name, measure in measures.items()}
    settings = [make_setting(present_run.steps, errors)]
    present = settings[0].error
    distances = errors
    for run in coarser_runs:
        change = response.errors.absolute_change(present_run.values, run.values)
        # A coarse run that is accurate by chance gets the error of the finer one.
        distances = {name: max(change[name] + errors[name], distances[name]) for name in measures}
        settings.insert(0, make_setting(run.steps, distances))
    has_effect = settings[0].error * INEFFECTIVE_STEPS_ERROR_RATIO >= present
    return settings if has_effect and present >= LONG_SUM_ROUND_OFF else []


def _select_measures(measures: Measures, step_runs) -> Measures:
    """Return the main measures that have errors and occur in all runs; else all such measures."""
    common = {}
    for name, measure in measures.items():
        is_known = None not in (measure.value, measure.error)
        is_in_all_runs = all(name in run.values for run in step_runs)
        if is_known and is_in_all_runs and name not in response.errors.ERROR_MEASURES:
            common[name] = measure
    main = {name: measure for name, measure in common.items() if is_main(name)}
    return main or common
