"""Error estimates from coarser runs of the same model, for all engines.

In: a list of `CoarserRuns` of an engine (coarser in time, in space, in modes or in the sum over bonds),
and a function that computes a run with given settings. Each `CoarserRuns` contains the settings of its
runs and the rule that estimates errors from their measures (`errors`). Each run is computed only once.
Out: errors by source and measure name.
"""

from collections.abc import Callable, Hashable
from functools import partial
from typing import NamedTuple

from ..convergence import MAX_CONVERGENCE_ORDER, MIN_CONVERGENCE_ORDER
from .errors import convergence_errors
from .measures import Values

# Rule of CoarserRuns for a coarser mesh or fewer shear modes.
second_order_errors = partial(convergence_errors, order=MAX_CONVERGENCE_ORDER)
# Rule of CoarserRuns for a coarser mesh under points that pass an edge of contact. The place of the edge between the points
# has an error of a part of their distance that varies irregularly from mesh to mesh; a higher order shows by chance.
edge_errors = partial(convergence_errors, max_order=MIN_CONVERGENCE_ORDER)


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
