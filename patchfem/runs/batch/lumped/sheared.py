"""Batch of patches that slip in part, with one mode under a sine.

In: models of a group. Out: `CaseResults`. Patches that share their pieces are pressed together
(`runs.patch.static`), others as in single runs. Their elements, and those of the coarser mesh
for the error, then move without histories (`pieces`), or in lanes (`tabled`). A case that
sticks, or rings during stick, is run by itself.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ....core import Outcome
from ....effects import law_has_trait
from ....model.model import Model
from ....model.source import locate_errors
from ....response.errors import coarser_errors
from ...accuracy_warnings import Finding, tolerance_warnings
from ...patch import result as of_patch
from ...results.result import shorten_file_names
from ...results.travel import outcome_on_piece, warn_of_large_slide
from ...rig.engines import PIECES, choose_engine
from ...rig.numerics import choose
from ...rig.pieces import YieldingElements
from .. import one_by_one, patches
from ..case_results import CaseResults, has_unreadable_table
from . import pieces
from .columns import batch_answers, known_measures
from .lumped import not_one_sine, take_out

# cases of one compiled call, whose elements and histories of cycles are in memory together
MAX_CASES_PER_CALL = 128
MIN_CASES_PER_THREAD = (
    2  # cases of a thread: a single one takes as long as hundreds of single points
)


class PressedCase(NamedTuple):
    """Case whose patch is pressed.

    - fine, coarse: elements on its mesh and on the coarser one.
    - measures, warnings, notes: of its patch.
    - patch: the pressed Patch, for lengths and positions only.
    """

    fine: YieldingElements
    coarse: YieldingElements
    measures: dict
    warnings: list
    notes: list
    patch: Any


def refuses(model: Model) -> str:
    """Return why the batch does not take a model; "" if it does."""
    if (
        model.patch is None
        or not model.partial_slip
        or model.patch.interface.strips is not None
        or model.grooves is not None
    ):
        return "the case is not a patch that slips part by part"
    if model.wear is not None or model.heat is not None or has_unreadable_table(model):
        return "the case has [wear] or [friction.temperature], or its table of measured responses cannot be read"
    if why := not_one_sine(model.rig):
        return why
    if model.friction.law != "elastic-plastic" and (
        not law_has_trait(model.friction.law, "set-valued")
        or law_has_trait(model.friction.law, "averaged")
    ):
        return "the points of the patch have no slip force"
    if not pieces.SHORTEST <= model.rig.drive.cycles <= pieces.LONGEST:
        return "the case has too few or too many cycles"
    return (
        ""
        if choose_engine(model) is PIECES
        else "the case is not computed by the engine from yield to yield"
    )


def group(model: Model) -> tuple:
    """Return a key that is equal for models of one compiled call."""
    return int(model.rig.drive.cycles), model.friction.law


def solve(models: Sequence[Model], say=None) -> CaseResults:
    """Return the case results of models of one group; cases that need it are run by themselves."""
    return solve_cases(models, say, move_cases, MAX_CASES_PER_CALL)


def solve_cases(models: Sequence[Model], say, move: Callable, together: int) -> CaseResults:
    """Return the case results of models of one group.

    Parameters
    ----------
    models : sequence of Model
    say : callable, optional
        Callback for a line of text.
    move : callable
        Function like `move_cases`.
    together : int
        Number of cases per call.
    """
    return patches.pressed_first(
        models, together, lambda part: _solve_pressed_cases(part, say, move)
    )


def _solve_pressed_cases(models, say, move: Callable) -> CaseResults:
    """Return the case results of models whose patches are pressed."""
    begin = perf_counter()
    out = CaseResults.blank(len(models))
    held = dict.fromkeys(range(len(models)))
    for case in sorted(
        held, key=lambda case: id(models[case].patch.solved)
    ):  # cases of one patch are neighbours, because they share its elements
        held[case] = _press_case(models[case])
    moves = [case for case, one in held.items() if one is not None]
    alone = set(range(len(models))) - set(moves)
    if moves:
        these = [models[case] for case in moves]
        answers, lost = move(these, [held[case] for case in moves], say)
        answers.seconds[:] = (perf_counter() - begin) / len(models)
        alone |= {moves[k] for k in np.flatnonzero(lost)}
        take_out(answers, np.flatnonzero(lost).tolist())
        out.place(moves, answers)
    if alone:
        rest = sorted(alone)
        out.place(rest, one_by_one.solve([models[case] for case in rest], say))
    return out


def _press_case(model: Model) -> PressedCase | None:
    """Return a case with its pressed patch; None if it is run by itself."""
    try:
        with locate_errors(model.source):
            patch, *coarse = of_patch.solve_all(model.patch, model.accuracy.tolerance)
            if coarse[0] is None or patch.pressure.outcome is Outcome.NO_CONTACT:
                return None
            warnings = [*model.source.remarks, *of_patch.warn_of_strains(model.patch, patch)]
            numerics = choose(model)
            return PressedCase(
                YieldingElements(model, numerics, patch),
                YieldingElements(model, numerics, coarse[0]),
                of_patch.static_measures(model, patch, coarse),
                warnings,
                of_patch.notes_on_neglected_effects(model, patch, coarse),
                patch,
            )
    except Exception:  # the case is run by itself, which reports the error
        return None


def move_cases(models, held: list, say) -> tuple:
    """Return the results of pressed cases, and which (n,) must be run by themselves.

    Parameters
    ----------
    models : sequence of Model
    held : list of PressedCase
    say : callable or None
        Callback for a line of text.
    """
    cycles = int(models[0].rig.drive.cycles)
    window = min(10, cycles // 10)
    cases = [
        pieces.Case(model, one.fine.groups, one.fine.held, one.patch.pressure.load)
        for model, one in zip(models, held)
    ]
    fine = pieces.runs_of_cases(cases, cycles, window, say, MIN_CASES_PER_THREAD)
    coarser = [case._replace(groups=one.coarse.groups) for case, one in zip(cases, held)]
    coarse = pieces.runs_of_cases(coarser, cycles, window, say, MIN_CASES_PER_THREAD, steady=False)
    chosen = tuple(
        {
            "elements": int(one.fine.contact.reduction.stiffness.size),
            "interface_nodes": int(one.patch.x.size),
        }
        for one in held
    )
    runs = replace(
        pieces.with_coarser_errors(fine, [coarse], coarser_errors), chosen=chosen, again=False
    )
    found, alone, _ = batch_answers(models, runs, {"engine": PIECES.name, "window_cycles": window})
    alone = alone | runs.stuck | coarse.lost
    for case in np.flatnonzero(~alone).tolist():
        add_patch_results(found, case, models[case], held[case], np.abs(runs.extremes[case]).max())
    return found, alone


def add_patch_results(
    found: CaseResults, case: int, model: Model, one: PressedCase, reach: float
) -> None:
    """Add the measures of the patch, outcome, warnings and notes, as in a single run.

    Parameters
    ----------
    found : CaseResults
    case : int
    model : Model
    one : PressedCase
    reach : float
        Largest output [m].
    """
    modes = model.rig.modes
    slide = np.array([reach * abs(float(modes.interfaces[0, 0]) / float(modes.output[0]))])
    found.outcome[case] = str(
        outcome_on_piece(Outcome(found.outcome[case]), model.patch, one.patch, slide)
    )
    known = known_measures(found, case)
    found.fill(case, one.measures)
    seen = Finding(
        model,
        one.measures | {name: m for name, m in known.items() if name != "normal_load"},
        one.patch,
    )
    warned = shorten_file_names(
        [
            *one.warnings,
            *model.rig.structure.notes,
            *warn_of_large_slide(one.patch, slide),
            *tolerance_warnings(seen),
        ],
        model.source.path,
    )
    found.warnings.pop(case, None)
    if warned:
        found.warnings[case] = warned
    if noted := shorten_file_names(one.notes, model.source.path):
        found.notes[case] = noted
