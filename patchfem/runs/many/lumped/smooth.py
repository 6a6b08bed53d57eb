"""Smooth laws on one mode under a sine: each motion as a run by itself has it, without what a run writes about it."""

from dataclasses import replace

import numpy as np

from ....dynamics.smooth import run as hub
from ....response.errors import tolerance_error
from ...rig.costs import smooth_element
from ...rig.engines import COARSER, SMOOTH, engine_of
from ...rig.numerics import choose
from ...rig.smooth import moved
from .columns import ENDS, Runs
from .threads import in_threads

LONGEST = 4000  # cycles of a run whose extremes are all held


def refuses(model) -> str:
    """Why the cases of this kind do not take a model; "" where they do."""
    if not 20 <= model.rig.cycles <= LONGEST:
        return "its cycles are too few or too many"
    if model.grooves is not None or not model.friction.static > 0 or engine_of(model) is not SMOOTH:
        return "its engine is not the smooth one"
    return ""


def coarsened(model) -> int:
    """Nothing is made coarser in a first run."""
    return 0


def runs_of(models, cycles: int, window: int, say=None, pairs: int = 0) -> Runs:
    """Runs of models of this kind, all of `cycles` cycles from their starts."""
    hub.loops_of(smooth_element(models[0]).kernels, say)
    solved = [None] * len(models)

    def go(part: slice) -> None:
        solved[part] = [_solved(model, window) for model in models[part]]

    in_threads(go, len(models))
    values, errors, fine, stuck, lost = zip(*solved)
    book = {name: np.array([one.ledger[name] for one in fine]) for name in fine[0].ledger}
    extremes, phasors = (np.array([getattr(one, name) for one in fine]) for name in ("amplitudes", "phasors"))
    chosen = tuple({"step_tolerance": one.tolerance, "steps": int(one.ledger["steps"])} for one in fine)
    return Runs(cycles, window, _columns(values), book, extremes, phasors[:, ::-1][:, ::window][:, ::-1][:, -ENDS:],
                np.array(stuck), np.array(lost), _columns(errors), SMOOTH.least, np.inf, chosen=chosen)


def _columns(rows) -> dict:
    """Numbers by name of n cases as columns (n,), NaN where one has none."""
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: np.array([row.get(name, np.nan) for row in rows], float) for name in names}


def _solved(model, window: int) -> tuple:
    """(measures and their errors by name, SmoothResult, whether it sticks, whether it must be run by itself)."""
    numerics = replace(choose(model), window=window)
    (found, done, reader), (other, *_) = (moved(model, replace(numerics, local=share * numerics.local), None)
                                          for share in (1.0, COARSER))
    values, coarse = ({name: value for name, value in one.values.items() if value is not None} for one in (
        found, other))
    coming, left = tolerance_error(values, coarse, model.rig.displacement), reader.left_open(done, values)
    errors = {name: coming.get(name, abs(value)) + left.get(name, 0.0) + found.own.get(name, 0.0)
              for name, value in values.items()}
    return values, errors, done, found.outcome is not None and str(found.outcome) == "stuck", done.outcome is not None
