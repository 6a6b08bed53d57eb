"""Error estimates from coarser runs of the same model, equal for every engine.

In: a ladder, i.e. the list of `CoarserRuns` of an engine (coarser in time, in space, in modes
or in the sum over bonds), and a function that solves a variant. Each `CoarserRuns` names its
runs and the rule that turns their measures into an error (`errors`). A run that several of them
need is solved once. Out: errors by measure name.
"""

from collections.abc import Callable
from functools import partial
from time import perf_counter
from typing import NamedTuple

from .errors import coarser_errors, observed_orders


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


def estimate_errors(solve: Callable, fine: dict, ladder, solved_runs: dict | None = None) -> tuple:
    """Solve coarser runs, and estimate from them the errors of the measures by kind of run.

    Parameters
    ----------
    solve : callable
        Returns the run of a variant; a run has `values`.
    fine : dict
        Measures of the run itself by name.
    ladder : sequence of CoarserRuns
    solved_runs : dict, optional
        Runs by variant that are solved already; the new ones are added.

    Returns
    -------
    errors : list of dict
    seconds : float
    """
    begin = perf_counter()
    solved_runs = {} if solved_runs is None else solved_runs

    def solve_values(variant) -> dict:
        """Return the measures with given settings, solving them on the first call."""
        if variant not in solved_runs:
            solved_runs[variant] = solve(variant)
        return solved_runs[variant].values

    errors = []
    for coarser in ladder:
        reference = fine if coarser.beside is None else solve_values(coarser.beside)
        errors.append(coarser.rule(reference, *map(solve_values, coarser.runs)))
    return errors, perf_counter() - begin


def find_open_kinds(kinds, errors, runs) -> dict:
    """Sum the errors of measures by kind of coarser run, and compute the observed orders.

    Parameters
    ----------
    kinds : sequence of str
        What each entry of the ladder makes coarser; "end" for a run that does not end exactly at
        the requested time.
    errors : sequence of dict
        Errors by measure name, one dict per kind.
    runs : sequence of dict
        Measures of the run, and of those with half and a quarter of its steps; fewer for a method
        without steps.

    Returns
    -------
    dict
        "parts": errors by kind and name; "orders": observed orders by name.
    """
    parts: dict = {}
    for kind, errors_by_name in zip(kinds, errors, strict=True):
        sums = parts.setdefault(kind, {})
        for name, error in errors_by_name.items():
            sums[name] = sums.get(name, 0.0) + error
    return {"parts": parts, "orders": observed_orders(*runs) if len(runs) == 3 else {}}


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
