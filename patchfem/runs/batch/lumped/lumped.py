"""Batch of lumped cases: which models it takes, its groups, and their results.

In: models of a group with a single mode and a single point. Out: `CaseResults`.
"""

from collections.abc import Sequence
from time import perf_counter

import numpy as np

from ....core import SineDrive
from ....model.model import Model
from ...rig.engines import choose_engine
from .. import one_by_one
from ..case_results import CaseResults, has_unreadable_table
from . import pieces
from .columns import assemble_results

# Largest number of cases in one compiled call, to limit the memory of histories.
MAX_CASES_PER_CALL = 1024


def refuses(model: Model) -> str:
    """Return why the batch of event-driven single points refuses a model, or ""."""
    return why_not_one_point(model) or pieces.refuses(model)


def why_not_one_point(model: Model) -> str:
    """Return the reason why a model is not one mode with one point under constant load, or ""."""
    rig = model.rig
    if (
        model.kind != "rig"
        or model.patch is not None
        or model.wear is not None
        or has_unreadable_table(model)
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
    return why_not_one_sine(rig)


def why_not_one_sine(rig) -> str:
    """Return the reason why a rig is not one mode with one sensor under a sine, or ""."""
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


def group(model: Model) -> tuple[int, str, int]:
    """Return a hashable key that is equal for models that one kernel call can compute."""
    return int(model.rig.drive.cycles), model.friction.law, pieces.count_first_merges(model)


def solve(models: Sequence[Model], say=None, n_finer: int = 0) -> CaseResults:
    """Compute the case results of a group of single-point models from event to event.

    Parameters
    ----------
    models : sequence of Model
    say : callable, optional
        Callback for a line of text.
    n_finer : int
        How often the cells of a density are doubled, in a check. A check does not need the ringing,
        and does not use more cells if errors are too large.
    """
    results = CaseResults.blank(len(models))
    for first in range(0, len(models), MAX_CASES_PER_CALL):
        part = models[first : first + MAX_CASES_PER_CALL]
        n_merges = max(0, pieces.count_first_merges(part[0]) - n_finer)
        cases = range(first, first + len(part))
        results.insert(cases, _solve_cases(part, say, n_merges, n_finer > 0))
    return results


def _solve_cases(models, say, n_merges: int, is_check: bool = False) -> CaseResults:
    """Compute the case results of models in one call of the event-driven kernel."""
    begin = perf_counter()
    cycles = int(models[0].rig.drive.cycles)
    window = min(10, cycles // 10)
    runs = pieces.run_pieces(models, cycles, window, say, n_merges)
    numerics = {"engine": choose_engine(models[0]).name, "window_cycles": window}
    results, runs_singly, is_resolved = assemble_results(models, runs, numerics)
    results.seconds[:] = (perf_counter() - begin) / len(models)
    needs_cells = ~is_resolved & ~runs.lost & (n_merges > 0)
    one_by_one.solve_singly(
        results, models, runs_singly & ~needs_cells & ~(runs.lost & is_check), say
    )
    cases = np.flatnonzero(needs_cells).tolist()
    if cases and not is_check:
        results.remove(cases)
        finer_models = [models[case] for case in cases]
        results.insert(cases, _solve_cases(finer_models, say, max(0, n_merges - 2)))
    return results
