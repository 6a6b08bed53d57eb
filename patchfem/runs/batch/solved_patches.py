"""Batches in two stages: the static contact problems of the patches, then the motions.

In: models of a group, and the functions of a batch that build the contact models and compute the
motions. Out: `CaseResults`. A case that the batch cannot complete is computed by a single run.
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
from ..accuracy_warnings import AccuracyContext, tolerance_warnings
from ..patch import result as patch_result
from ..results.result import shorten_file_names
from ..results.travel import check_pieces_overlap, warn_of_large_slide
from ..rig.engines import describe_unused_settings
from ..rig.motion_warnings import warn_of_law
from ..rig.numerics import choose_numerics
from . import one_by_one
from .case_results import CaseResults

NONE: Mapping = MappingProxyType({})  # no settings or error sources to report


class SolvedCase(NamedTuple):
    """Case of a batch with a solved patch, ready for the computation of its motion.

    - fine, coarse: contact models on the mesh of the patch and on the coarser mesh.
    - measures, warnings, notes: static measures and messages of the patch.
    - patch: solved Patch.
    - numerics: Numerics of a single run of the case.
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
    - make_contact: function (model, numerics, patch) that returns the contact model of the batch, or
      None if the case needs a single run.
    - compute_motions: function (models, solved cases, report) that returns CaseResults and a mask
      (n,) of the cases that need a single run.
    - cases_per_call: number of cases that are held in memory at the same time.
    """

    engine: str
    make_contact: Callable
    compute_motions: Callable
    cases_per_call: int


def solve(
    models: Sequence[Model], batch: PatchBatch, report: Callable | None = None
) -> CaseResults:
    """Solve the patches of a group of models, then compute their motions in one batch.

    Parameters
    ----------
    models : sequence of Model
    batch : PatchBatch
    report : callable, optional
        Callback for progress messages.
    """
    results = CaseResults.blank(len(models))
    for first in range(0, len(models), batch.cases_per_call):
        part = list(models[first : first + batch.cases_per_call])
        results.insert(range(first, first + len(part)), _solve_cases(part, batch, report))
    return results


def _solve_cases(models: list, batch: PatchBatch, report: Callable | None) -> CaseResults:
    """Solve the patches of models, then compute their motions."""
    begin = perf_counter()
    results = CaseResults.blank(len(models))
    solved_cases = {}
    for case, model in enumerate(models):
        pressed = _solve_patch_of_case(model, batch)
        if pressed is not None:
            solved_cases[case] = pressed
    needs_single_run = np.ones(len(models), bool)
    if solved_cases:
        cases = list(solved_cases)
        part, needs_single_run[cases] = batch.compute_motions(
            [models[case] for case in cases], list(solved_cases.values()), report
        )
        part.seconds[:] = (perf_counter() - begin) / len(models)
        results.insert(cases, part)
    one_by_one.replace_by_single_runs(results, models, needs_single_run, report)
    return results


def _solve_patch_of_case(model: Model, batch: PatchBatch) -> SolvedCase | None:
    """Return a case with its solved patch and contact models, or None if it needs a single run."""
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
                *describe_unused_settings(model, "hybrid"),
                *patch_result.patch_warnings(model.patch, patch),
            ]
            return SolvedCase(
                *contacts,
                patch_result.static_measures(model, patch, coarse),
                warnings,
                patch_result.notes_on_neglected_effects(model, patch, coarse),
                patch,
                numerics,
            )
    except one_by_one.CASE_ERRORS:  # the single run of the case reports its error
        return None


def add_patch_results(
    results: CaseResults,
    case: int,
    model: Model,
    pressed: SolvedCase,
    slide: float,
    *,
    extra: Mapping = NONE,
    causes: Mapping = NONE,
) -> None:
    """Add the static measures, warnings and notes of the patch to the results of a case.

    Parameters
    ----------
    results : CaseResults
        Results that already contain the measures of the motion.
    case : int
    model : Model
    pressed : SolvedCase
    slide : float
        Largest relative displacement of the interface [m].
    extra : Mapping
        Settings of the run that the accuracy warnings mention (`accuracy_warnings.AccuracyContext`).
    causes : Mapping
        ErrorCauses of the motion measures by name.
    """
    slides = np.array([slide])
    motion = results.measures_with_errors(case)
    for name, measure in motion.items():
        motion[name] = replace(measure, causes=causes.get(name))
    outcome = check_pieces_overlap(
        Outcome(results.outcome[case]), model.patch, pressed.patch, slides
    )
    results.outcome[case] = str(outcome)
    results.fill(case, pressed.measures)
    drift = {name: motion[name] for name in ("drift_per_cycle",) if name in motion}
    motion.pop("normal_load", None)
    finding = AccuracyContext(model, pressed.measures | motion, pressed.patch, extra)
    warnings = [
        *pressed.warnings,
        *model.rig.structure.notes,
        *warn_of_law(model, outcome, drift, 0.0),
        *warn_of_large_slide(pressed.patch, slides),
        *tolerance_warnings(finding),
    ]
    notes = [*model.source.notes, *pressed.notes]
    for texts, case_texts in ((results.warnings, warnings), (results.notes, notes)):
        texts.pop(case, None)
        if case_texts:
            texts[case] = shorten_file_names(case_texts, model.source.path)
