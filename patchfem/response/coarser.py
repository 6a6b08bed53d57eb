"""Errors of a run from coarser runs of the same model: one estimate for every engine.

An engine names its ladder: the ways in which a run is coarser, in time, in space, in modes or in its sum over bonds.
Each says which runs it takes and how their measures become an error. A run that several of them take is made once.
"""

from collections.abc import Callable
from functools import partial
from time import perf_counter
from typing import NamedTuple

from .errors import coarser_errors, orders


class CoarserRuns(NamedTuple):
    """One way in which a run can be coarser.

    runs: variants, hashable arguments of `solve`, coarse to coarser; rule(values of the run beside, *values of the
    runs) -> error by measure; beside: the variant that they are compared with, None: the run itself; of: what is
    coarser: "steps", "mesh", "modes", "bonds" or "cells", "own" where it is nothing that a scene names.
    """

    runs: tuple
    rule: Callable
    beside: object = None
    of: str = "own"


def estimate(solve: Callable, fine: dict, ladder, made: dict | None = None) -> tuple:
    """Errors by measure name, one dict per `CoarserRuns`, and the seconds of the coarser runs.

    solve(variant) -> a run with `values`; fine: measures of the run itself; ladder: of
    `CoarserRuns`; made: variant -> run, those that are made already; it is filled.
    """
    begin, made = perf_counter(), {} if made is None else made

    def values(variant) -> dict:
        if variant not in made:
            made[variant] = solve(variant)
        return made[variant].values

    errors = [
        way.rule(fine if way.beside is None else values(way.beside), *map(values, way.runs))
        for way in ladder
    ]
    return errors, perf_counter() - begin


def left_open(kinds, errors, runs) -> dict:
    """What leaves the measures of a run open: errors by name under each of `kinds`, and the `orders` of the steps.

    kinds: what each of the ladder makes coarser, "end" for a run that ends beside the asked end; errors: by name, one
    dict per kind; runs: measures of the run, at half and at a quarter of its steps, fewer where it has no steps.
    """
    out: dict = {}
    for kind, part in zip(kinds, errors, strict=True):
        mine = out.setdefault(kind, {})
        for name, error in part.items():
            mine[name] = mine.get(name, 0.0) + error
    return {"parts": out, "orders": orders(*runs) if len(runs) == 3 else {}}


def coarser_space(coarser, beside=None, of: str = "mesh") -> CoarserRuns:
    """Return the `CoarserRuns` whose one run has a mesh twice as coarse, or fewer modes, at second order.

    coarser, beside, of: as in `CoarserRuns`.
    """
    return CoarserRuns((coarser,), partial(coarser_errors, order=2.0), beside, of)
