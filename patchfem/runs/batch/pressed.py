"""Cases whose patches are pressed together, and whose interfaces then move together.

In: models of a group, and the functions of a batch that make contacts of patches and move them.
Out: `CaseResults`. Patches that share their pieces are pressed together (`runs.patch.static_batch`),
others as in single runs. A case that a batch cannot finish is run by itself.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from time import perf_counter
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from ...core import Outcome
from ...model.model import Model
from ...model.source import locate_errors
from ..accuracy_warnings import Finding, tolerance_warnings
from ..patch import result as patch_result
from ..results.result import shorten_file_names
from ..results.travel import judge_outcome_on_piece, warn_of_large_slide
from ..rig.engines import describe_unused_settings
from ..rig.motion_warnings import law_warnings
from ..rig.numerics import choose_numerics
from . import one_by_one, patches
from .case_results import CaseResults

NONE: Mapping = MappingProxyType({})  # no settings, and no causes of errors


class PressedCase(NamedTuple):
    """Case of a batch whose patch is solved and whose motion is not computed yet.

    - fine, coarse: contact model of the batch on the mesh of the patch and on the coarser one.
    - measures, warnings, notes: of its patch.
    - patch: the pressed Patch.
    - numerics: Numerics of its single run.
    """

    fine: Any
    coarse: Any
    measures: dict
    warnings: list
    notes: list
    patch: Any
    numerics: Any


class PatchBatch(NamedTuple):
    """Functions of a batch that computes the motions of cases with solved patches.

    - engine: name of the engine of a single run.
    - make_contact: function (model, numerics, patch) -> contact model of the batch, or None if the
      case is run by itself.
    - move: function (models, pressed cases, say) -> CaseResults, and which (n,) cases are run by
      themselves.
    - cases_per_call: number of cases that are in memory together.
    """

    engine: str
    make_contact: Callable
    move: Callable
    cases_per_call: int


def solve(models: Sequence[Model], batch: PatchBatch, say: Callable | None = None) -> CaseResults:
    """Solve the patches of a group of models, and compute their motions in one batch.

    Parameters
    ----------
    models : sequence of Model
    batch : PatchBatch
    say : callable, optional
        Callback for a line of text.
    """
    return patches.press_and_solve(
        models, batch.cases_per_call, lambda part: _solve_cases(part, batch, say)
    )


def _solve_cases(models: list, batch: PatchBatch, say: Callable | None) -> CaseResults:
    """Compute the case results of models whose patches are solved."""
    begin = perf_counter()
    results = CaseResults.blank(len(models))
    pressed_cases = {}
    for case, model in enumerate(models):
        pressed = _press_case(model, batch)
        if pressed is not None:
            pressed_cases[case] = pressed
    runs_singly = np.ones(len(models), bool)
    if pressed_cases:
        cases = list(pressed_cases)
        part, runs_singly[cases] = batch.move(
            [models[case] for case in cases], list(pressed_cases.values()), say
        )
        part.seconds[:] = (perf_counter() - begin) / len(models)
        results.insert(cases, part)
    one_by_one.solve_singly(results, models, runs_singly, say)
    return results


def _press_case(model: Model, batch: PatchBatch) -> PressedCase | None:
    """Solve the patch of a case and make its contact models; None if a single run is needed."""
    try:
        with locate_errors(model.source):
            patch, *coarse = patch_result.solve_with_coarser(model.patch, model.accuracy.tolerance)
            if coarse[0] is None or patch.pressure.outcome is Outcome.NO_CONTACT:
                return None
            numerics = choose_numerics(model)
            contacts = []
            for mesh in (patch, coarse[0]):
                contacts.append(batch.make_contact(model, numerics, mesh))
                if contacts[-1] is None:
                    return None
            warnings = [
                *model.source.remarks,
                *describe_unused_settings(model, batch.engine),
                *patch_result.warn_of_strains(model.patch, patch),
            ]
            return PressedCase(
                *contacts,
                patch_result.static_measures(model, patch, coarse),
                warnings,
                patch_result.notes_on_neglected_effects(model, patch, coarse),
                patch,
                numerics,
            )
    except one_by_one.CASE_ERRORS:  # a single run of the case reports the error
        return None


def add_patch_results(
    results: CaseResults,
    case: int,
    model: Model,
    pressed: PressedCase,
    slide: float,
    *,
    extra: Mapping = NONE,
    causes: Mapping = NONE,
) -> None:
    """Add the static measures and the notes of the solved patch to a case, as a single run does.

    Parameters
    ----------
    results : CaseResults
        With the measures of the motion.
    case : int
    model : Model
    pressed : PressedCase
    slide : float
        Largest slide [m].
    extra : Mapping
        Details of the run for the warnings of large errors (`accuracy_warnings.Finding`).
    causes : Mapping
        ErrorCauses of the measures of the motion by name.
    """
    slides = np.array([slide])
    motion = {
        name: replace(measure, causes=causes.get(name))
        for name, measure in results.known_measures(case).items()
    }
    outcome = judge_outcome_on_piece(
        Outcome(results.outcome[case]), model.patch, pressed.patch, slides
    )
    results.outcome[case] = str(outcome)
    results.fill(case, pressed.measures)
    drift = {name: motion[name] for name in ("drift_per_cycle",) if name in motion}
    motion.pop("normal_load", None)
    finding = Finding(model, pressed.measures | motion, pressed.patch, extra)
    warnings = [
        *pressed.warnings,
        *model.rig.structure.notes,
        *law_warnings(model, outcome, drift, 0.0),
        *warn_of_large_slide(pressed.patch, slides),
        *tolerance_warnings(finding),
    ]
    notes = [*model.source.notes, *pressed.notes]
    for texts, case_texts in ((results.warnings, warnings), (results.notes, notes)):
        texts.pop(case, None)
        if case_texts:
            texts[case] = shorten_file_names(case_texts, model.source.path)
