"""Static patches that differ in numbers alone, solved together.

In: `SimilarModels` of a pressed patch. Out: `CaseResults`, without the notes that only a single run makes.
"""

from __future__ import annotations

from time import process_time

import numpy as np

from ...core import Outcome, compute_allowed_error
from ...model.model import Model
from ...model.similar_models import SimilarModels
from .. import findings
from ..patch.case_meshes import solve_cases
from ..patch.cases import Batch, OutcomeCode
from ..results.patch_rows import PATCH_TABLE
from ..results.result import shorten_file_names
from .case_results import FAILED_OUTCOME, CaseResults, has_unreadable_measurements

# Number of consecutive cases of a sweep that are solved together. Their meshes depend on all of them, so that it is fixed.
CASES_PER_BLOCK = 4096
OUTCOMES = {
    OutcomeCode.DONE: str(Outcome.DONE),
    OutcomeCode.NO_CONTACT: str(Outcome.NO_CONTACT),
    OutcomeCode.NOT_CONVERGED: str(Outcome.NOT_CONVERGED),
    OutcomeCode.FAILED: FAILED_OUTCOME,
}


def can_solve(model: Model) -> bool:
    """Return whether similar models of `model` are solved together: those of a pressed patch without a measured profile."""
    return (
        model.kind == "patch"
        and model.patch.interface.strips is None
        and model.patch.gap.profile is None
        and not has_unreadable_measurements(model)
    )


def solve(models: SimilarModels) -> CaseResults:
    """Compute the case results of similar models of a pressed patch."""
    begin = process_time()
    model = models.first
    batch = solve_cases(models.columns().patch, len(models), model.accuracy.tolerance)

    results = CaseResults.blank(len(models))
    results.values.update(batch.values)
    results.errors.update(batch.errors)
    results.floors.update(batch.floors)
    results.units.update({name: PATCH_TABLE[name].unit for name in batch.values})
    for code, outcome in OUTCOMES.items():
        results.outcome[batch.outcome == code] = outcome
    for case, error in batch.messages.items():
        results.messages[case] = str(error)
    _insert_texts(model, batch, results)
    results.seconds[:] = (process_time() - begin) / len(models)
    return results


def _insert_texts(model: Model, batch: Batch, results: CaseResults) -> None:
    """Store the texts of cases that follow from the numbers of a batch: settings, remarks, and why a tolerance is missed."""
    for count in np.unique(batch.n_nodes):
        results.numerics[batch.n_nodes == count] = {"interface_nodes": int(count)}
    if model.source.remarks:
        results.warnings[:] = shorten_file_names(model.source.remarks, model.source.path)
    if model.source.notes:
        results.notes[:] = list(model.source.notes)

    # The measure with the largest ratio of error to allowed error is named.
    names = list(results.values)
    tolerance = model.accuracy.tolerance
    ratios = np.zeros((len(names), len(results)))
    for row, name in zip(ratios, names):
        allowed = compute_allowed_error(tolerance, results.values[name], results.floors[name])
        np.divide(results.errors[name], allowed, out=row, where=allowed > 0)
    ratios = np.nan_to_num(ratios)
    is_missed = (ratios > 1).any(axis=0) & (batch.outcome != OutcomeCode.FAILED)
    for case in np.flatnonzero(is_missed).tolist():
        name = names[ratios[:, case].argmax()]
        error = results.errors[name][case]
        size = abs(results.values[name][case])
        share = f"{error / size:.2g} of its value" if error < size else "at least its value"
        advice = f"a finer mesh does not reduce it or is too expensive; {findings.USE_ERROR_ADVICE}"
        if batch.excess[case] <= 1:
            finer = findings.PROPOSED_TOLERANCE_RATIO * tolerance
            advice = f"set accuracy.tolerance = {finer:.3g} for a finer mesh"
        results.findings[case] = (
            f"{name} has an estimated error of {share}; the tolerance is {tolerance:g}; {advice}"
        )
