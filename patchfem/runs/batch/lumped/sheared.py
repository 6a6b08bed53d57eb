"""Batch of patches with partial slip and one mode, computed from event to event.

In: models of a group. Out: `CaseResults`. The friction elements of each patch, and those of a
coarser mesh for the error, are simulated without histories (`pieces`). A case that sticks, or rings
during stick, is computed by a single run.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ....model.model import Model
from ....response.errors import convergence_errors
from .. import solved_patches
from ..case_results import CaseResults, has_unreadable_measurements
from . import pieces
from .case_engines import PIECES, choose_engine
from .columns import assemble_results
from .event_driven import YieldingElements
from .lumped import reason_not_single_sine

# Largest number of cases in one compiled call, limited by the memory of elements and cycle extremes.
MAX_CASES_PER_CALL = 128
# Smallest number of cases per thread: a patch takes as long as hundreds of single points.
MIN_CASES_PER_THREAD = 2


def refusal_reason(model: Model) -> str:
    """Return why a model is not a patch with partial slip for this batch, or ""."""
    if (
        model.patch is None
        or not model.partial_slip
        or model.patch.interface.strips is not None
        or model.grooves is not None
    ):
        return "the case is not a patch that slips part by part"
    if model.wear is not None or model.heat is not None or has_unreadable_measurements(model):
        return "the case has [wear] or [friction.temperature], or its table of measured responses cannot be read"
    if why := reason_not_single_sine(model.rig):
        return why
    if model.friction.law != "elastic-plastic" and not pieces.is_rigid_law(model):
        return "the points of the patch have no slip force"
    if not pieces.MIN_CYCLES <= model.rig.drive.cycles <= pieces.MAX_CYCLES:
        return "the case has too few or too many cycles"
    if choose_engine(model) is not PIECES:
        return "the case is not computed by the engine from yield to yield"
    return ""


def group_key(model: Model) -> tuple:
    """Return a hashable key; models with equal keys can be computed in one kernel call."""
    return int(model.rig.drive.cycles), model.friction.law


def solve(models: Sequence[Model], report=None) -> CaseResults:
    """Compute the case results of a group of patches with partial slip."""
    batch = solved_patches.PatchBatch(
        PIECES.name, YieldingElements, compute_motions, MAX_CASES_PER_CALL
    )
    return solved_patches.solve(models, batch, report)


def compute_motions(
    models: Sequence[Model], solved_cases: list, report=None
) -> tuple[CaseResults, np.ndarray]:
    """Compute the motions of solved cases; return the results and a mask (n,) of needed single runs.

    Parameters
    ----------
    models : sequence of Model
    solved_cases : list of solved_patches.SolvedCase
        Cases whose contact models are YieldingElements.
    report : callable, optional
        Callback for progress messages.
    """
    cycles = int(models[0].rig.drive.cycles)
    window = min(10, cycles // 10)
    fine_cases = []
    coarse_cases = []
    numerics = []
    for model, case in zip(models, solved_cases):
        load = case.patch.pressure.load
        fine_cases.append(pieces.Case(model, case.fine.groups, case.fine.stick_tolerance, load))
        coarse_cases.append(fine_cases[-1]._replace(groups=case.coarse.groups))
        numerics.append(size_settings(case))
    fine = pieces.simulate_cases(fine_cases, cycles, window, report, MIN_CASES_PER_THREAD)
    coarse = pieces.simulate_cases(
        coarse_cases, cycles, window, report, MIN_CASES_PER_THREAD, steady=False
    )
    runs = pieces.add_coarser_errors(fine, [coarse], convergence_errors)
    runs = replace(runs, case_settings=tuple(numerics), refines_steps=False)
    results, needs_single_run, _ = assemble_results(
        models, runs, {"engine": PIECES.name, "window_cycles": window}
    )
    needs_single_run = needs_single_run | runs.is_stuck | coarse.needs_single_run
    for case in np.flatnonzero(~needs_single_run).tolist():
        reach = np.abs(runs.extremes[case]).max()
        add_patch_results(results, case, models[case], solved_cases[case], reach)
    return results, needs_single_run


def size_settings(case: solved_patches.SolvedCase) -> dict:
    """Return the numbers of friction elements and interface nodes of a case."""
    return {
        "elements": int(case.fine.contact.reduction.stiffness.size),
        "interface_nodes": int(case.patch.x.size),
    }


def add_patch_results(
    results: CaseResults,
    case: int,
    model: Model,
    solved_case: solved_patches.SolvedCase,
    reach: float,
) -> None:
    """Add the static measures, warnings and notes of the patch to the results of a case.

    Parameters
    ----------
    results : CaseResults
    case : int
    model : Model
    solved_case : solved_patches.SolvedCase
    reach : float
        Largest absolute output [m].
    """
    modes = model.rig.modes
    slide = reach * abs(float(modes.interfaces[0, 0]) / float(modes.output[0]))
    solved_patches.add_patch_results(results, case, model, solved_case, slide)
