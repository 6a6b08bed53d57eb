"""Error estimates from coarser runs of the same model, equal for every engine.

In: a ladder, i.e. the list of `CoarserRuns` of an engine (coarser in time, in space, in modes
or in the sum over bonds), and a function that solves a variant. Each `CoarserRuns` names its
runs and the rule that turns their measures into an error (`errors`). A run that several of them
need is solved once. Out: what is coarser, with errors by measure name.
"""

from collections.abc import Callable
from functools import partial
from time import perf_counter
from typing import NamedTuple

from .errors import coarser_errors


class CoarserRuns(NamedTuple):
    """Coarser runs of one kind, with the rule that estimates errors from their measures.

    - runs: variants (hashable arguments of `solve`), from fine to coarse.
    - rule: function (values of the reference run, *values of the coarse runs) -> error by measure
      name.
    - beside: variant of the reference run with which they are compared; None: the run itself.
    - of: what is coarser: "steps", "mesh", "modes", "bonds" or "cells"; "own" for anything that no
      key of a scene sets.
    """

    runs: tuple
    rule: Callable
    beside: object = None
    of: str = "own"


class StepRun(NamedTuple):
    """Run of a motion at some number of time steps.

    - steps: steps per cycle.
    - seconds: CPU seconds.
    - values: measures by name.
    """

    steps: int
    seconds: float
    values: dict


def estimate_errors(solve: Callable, fine: dict, ladder, solved_runs: dict) -> tuple:
    """Solve coarser runs, and estimate from them the errors of the measures by kind of run.

    Parameters
    ----------
    solve : callable
        Returns the run of a variant; a run has `values`.
    fine : dict
        Measures of the run itself by name.
    ladder : sequence of CoarserRuns
    solved_runs : dict
        Runs by variant that are solved already; the new ones are added.

    Returns
    -------
    errors : list of (str, dict)
        What is coarser, and errors by measure name, for each entry of the ladder.
    seconds : float
    """
    begin = perf_counter()

    def solve_values(variant) -> dict:
        """Return the measures with given settings, solving them on the first call."""
        if variant not in solved_runs:
            solved_runs[variant] = solve(variant)
        return solved_runs[variant].values

    errors = []
    for coarser in ladder:
        reference = fine if coarser.beside is None else solve_values(coarser.beside)
        errors.append((coarser.of, coarser.rule(reference, *map(solve_values, coarser.runs))))
    return errors, perf_counter() - begin


def make_spatial_coarsening(coarser, beside=None, of: str = "mesh") -> CoarserRuns:
    """Return the rule that estimates second-order errors from a run on a coarser mesh.

    Parameters
    ----------
    coarser : hashable
        Variant of that run.
    beside, of
        Fields of `CoarserRuns`.

    Returns
    -------
    CoarserRuns
    """
    return CoarserRuns((coarser,), partial(coarser_errors, order=2.0), beside, of)
