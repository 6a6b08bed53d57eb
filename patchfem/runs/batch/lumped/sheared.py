"""Batch of patches that slip in part, with one mode under a sine.

In: models of a group. Out: `CaseResults`. The elements of the pressed patches, and those of the
coarser mesh for the error, move without histories (`pieces`). A case that sticks, or rings
during stick, is run by itself.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ....model.model import Model
from ....response.errors import coarser_errors
from ...rig.engines import PIECES, choose_engine
from ...rig.event_driven import YieldingElements
from .. import pressed
from ..case_results import CaseResults, has_unreadable_table
from . import pieces
from .columns import assemble_results
from .lumped import why_not_one_sine

# largest number of cases in one compiled call, whose elements and cycle extremes are in memory together
MAX_CASES_PER_CALL = 128
# smallest number of cases of a thread: a patch takes as long as hundreds of single points
MIN_CASES_PER_THREAD = 2


def refuses(model: Model) -> str:
    """Return the reason why this batch (patches with partial slip) refuses a model, or ""."""
    if (
        model.patch is None
        or not model.partial_slip
        or model.patch.interface.strips is not None
        or model.grooves is not None
    ):
        return "the case is not a patch that slips part by part"
    if model.wear is not None or model.heat is not None or has_unreadable_table(model):
        return "the case has [wear] or [friction.temperature], or its table of measured responses cannot be read"
    if why := why_not_one_sine(model.rig):
        return why
    if model.friction.law != "elastic-plastic" and not pieces.is_rigid_law(model):
        return "the points of the patch have no slip force"
    if not pieces.MIN_CYCLES <= model.rig.drive.cycles <= pieces.MAX_CYCLES:
        return "the case has too few or too many cycles"
    if choose_engine(model) is not PIECES:
        return "the case is not computed by the engine from yield to yield"
    return ""


def group(model: Model) -> tuple:
    """Return a hashable key that is equal for models that one kernel call can compute."""
    return int(model.rig.drive.cycles), model.friction.law


def solve(models: Sequence[Model], say=None) -> CaseResults:
    """Compute the case results of a group of patches with partial slip."""
    batch = pressed.PatchBatch(PIECES.name, YieldingElements, compute_motions, MAX_CASES_PER_CALL)
    return pressed.solve(models, batch, say)


def compute_motions(
    models: Sequence[Model], pressed_cases: list, say=None
) -> tuple[CaseResults, np.ndarray]:
    """Compute the motions of solved patches, and the mask (n,) of cases that need a single run.

    Parameters
    ----------
    models : sequence of Model
    pressed_cases : list of pressed.PressedCase
        With YieldingElements as contacts.
    say : callable, optional
        Callback for a line of text.
    """
    cycles = int(models[0].rig.drive.cycles)
    window = min(10, cycles // 10)
    fine_cases = []
    coarse_cases = []
    numerics = []
    for model, case in zip(models, pressed_cases):
        load = case.patch.pressure.load
        fine_cases.append(pieces.Case(model, case.fine.groups, case.fine.held, load))
        coarse_cases.append(fine_cases[-1]._replace(groups=case.coarse.groups))
        numerics.append(describe_sizes(case))
    fine = pieces.run_cases(fine_cases, cycles, window, say, MIN_CASES_PER_THREAD)
    coarse = pieces.run_cases(coarse_cases, cycles, window, say, MIN_CASES_PER_THREAD, steady=False)
    runs = pieces.add_coarser_errors(fine, [coarse], coarser_errors)
    runs = replace(runs, chosen=tuple(numerics), again=False)
    results, runs_singly, _ = assemble_results(
        models, runs, {"engine": PIECES.name, "window_cycles": window}
    )
    runs_singly = runs_singly | runs.stuck | coarse.lost
    for case in np.flatnonzero(~runs_singly).tolist():
        reach = np.abs(runs.extremes[case]).max()
        add_patch_results(results, case, models[case], pressed_cases[case], reach)
    return results, runs_singly


def describe_sizes(case: pressed.PressedCase) -> dict:
    """Return the numbers of friction elements and interface nodes of a case, as settings."""
    return {
        "elements": int(case.fine.contact.reduction.stiffness.size),
        "interface_nodes": int(case.patch.x.size),
    }


def add_patch_results(
    results: CaseResults, case: int, model: Model, pressed_case: pressed.PressedCase, reach: float
) -> None:
    """Add the static measures and the notes of the solved patch to a case.

    Parameters
    ----------
    results : CaseResults
    case : int
    model : Model
    pressed_case : pressed.PressedCase
    reach : float
        Largest output [m].
    """
    modes = model.rig.modes
    slide = reach * abs(float(modes.interfaces[0, 0]) / float(modes.output[0]))
    pressed.add_patch_results(results, case, model, pressed_case, slide)
