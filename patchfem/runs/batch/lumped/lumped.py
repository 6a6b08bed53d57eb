"""Batch of lumped cases, with one mode and one contact point, computed from event to event.

In: models of a group. Out: `CaseResults`.
"""

from collections.abc import Sequence
from time import perf_counter

import numpy as np

from ....core import SineDrive
from ....model.model import Model
from .. import one_by_one
from ..case_results import CaseResults, has_unreadable_measurements
from . import pieces
from .case_engines import choose_engine
from .columns import assemble_results

# Largest number of cases in one compiled call, limited by the memory of the histories.
MAX_CASES_PER_CALL = 1024


def refusal_reason(model: Model) -> str:
    """Return why the event-driven batch of single points cannot compute a model, or ""."""
    return reason_not_single_point(model) or pieces.refusal_reason(model)


def reason_not_single_point(model: Model) -> str:
    """Return why a model is not one mode with one contact point under constant load, or ""."""
    rig = model.rig
    if (
        model.kind != "rig"
        or model.patch is not None
        or model.wear is not None
        or has_unreadable_measurements(model)
    ):
        return "the contact of the case is not a single point, or its table of measured responses cannot be read"
    if (
        model.heat is not None
        or rig.friction.load_varies
        or rig.friction.names
        or rig.springs.is_nonlinear
        or len(rig.friction.interfaces) != 1
        or not model.point.load > 0
    ):
        return "the interface of the case is not one point under a constant load"
    return reason_not_single_sine(rig)


def reason_not_single_sine(rig) -> str:
    """Return why a rig is not one mode with one sensor under sinusoidal drive, or ""."""
    if rig.modes.gauge is not None:
        return "the gauge and the accelerometer of the case move differently"
    if rig.structure.richer_rig is not None:
        return "its structure is reduced"
    if (
        rig.modes.omega.size != 1
        or not isinstance(rig.drive.signal, SineDrive)
        or rig.drive.levels.amplitudes
    ):
        return "the case is not one mode driven by one sine"
    if np.isfinite(rig.springs.travel):
        return "the flexure of the case has an end stop, or the motion of the case may gain energy"
    if (
        rig.drive.cycles != int(rig.drive.cycles)
        or not rig.modes.base[0]
        or not rig.modes.slide[0]
        or not rig.modes.output[0]
    ):
        return "the number of cycles of the case is not whole, or the case has no drive, slide or output"
    return ""


def group_key(model: Model) -> tuple[int, str, int]:
    """Return a hashable key; models with equal keys can be computed in one kernel call."""
    return int(model.rig.drive.cycles), model.friction.law, pieces.count_initial_merges(model)


def solve(models: Sequence[Model], report=None, n_finer: int = 0) -> CaseResults:
    """Compute the case results of a group of single-point models from event to event.

    Parameters
    ----------
    models : sequence of Model
    report : callable, optional
        Callback for progress messages.
    n_finer : int
        Number of doublings of the slider cells, for a check of other results; 0 for a regular run. In a
        check, the ringing is omitted and the cells are not refined further.
    """
    results = CaseResults.blank(len(models))
    for first in range(0, len(models), MAX_CASES_PER_CALL):
        some_models = models[first : first + MAX_CASES_PER_CALL]
        n_merges = max(0, pieces.count_initial_merges(some_models[0]) - n_finer)
        cases = range(first, first + len(some_models))
        results.insert(cases, _solve_cases(some_models, report, n_merges, n_finer > 0))
    return results


def _solve_cases(models, report, n_merges: int, is_check: bool = False) -> CaseResults:
    """Compute the case results of models in one call of the event-driven kernel."""
    begin = perf_counter()
    cycles = int(models[0].rig.drive.cycles)
    window = min(10, cycles // 10)
    runs = pieces.simulate_models(models, cycles, window, report, n_merges)
    numerics = {"engine": choose_engine(models[0]).name, "window_cycles": window}
    results, needs_single_run, is_resolved = assemble_results(models, runs, numerics)
    results.seconds[:] = (perf_counter() - begin) / len(models)
    needs_more_cells = ~is_resolved & ~runs.needs_single_run & (n_merges > 0)
    one_by_one.replace_by_single_runs(
        results,
        models,
        needs_single_run & ~needs_more_cells & ~(runs.needs_single_run & is_check),
        report,
    )
    cases = np.flatnonzero(needs_more_cells).tolist()
    if cases and not is_check:
        results.remove(cases)
        finer_models = [models[case] for case in cases]
        results.insert(cases, _solve_cases(finer_models, report, max(0, n_merges - 2)))
    return results
