"""Static patches that differ in numbers alone, solved together.

In: `SimilarModels` of a pressed patch. Out: `CaseResults`, as from single runs, without the change between plane strain
and plane stress.
"""

from __future__ import annotations

from time import process_time

import numpy as np

from ...core import Measure, Outcome
from ...model.model import Model
from ...model.similar_models import SimilarModels
from .. import findings
from ..patch import case_meshes, measures, result, strength
from ..patch.cases import Batch, MeshFact, OutcomeCode
from ..results.patch_rows import PATCH_TABLE
from ..results.result import Advice, shorten_file_names
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
    """Return whether similar models of `model` are solved together.

    Single runs treat faces and measured profiles, and state what they neglect for the asperities of a trace.
    """
    if model.kind != "patch" or has_unreadable_measurements(model):
        return False
    patch = model.patch
    return (
        patch.area is None
        and patch.gap.profile is None
        and getattr(patch.interface.skin, "rms_height", None) is None
    )


def solve(models: SimilarModels) -> CaseResults:
    """Compute the case results of similar models of a pressed patch."""
    begin = process_time()
    model = models.first
    patch = models.columns().patch
    batch = case_meshes.solve_cases(patch, len(models), model.accuracy.tolerance)

    results = CaseResults.blank(len(models))
    results.values.update(batch.values)
    results.errors.update(batch.errors)
    results.floors.update(batch.floors)
    results.units.update({name: PATCH_TABLE[name].unit for name in batch.values})
    for code, outcome in OUTCOMES.items():
        results.outcome[batch.outcome == code] = outcome
    for case, error in batch.messages.items():
        results.messages[case] = str(error)
    if batch.values:
        _insert_texts(model, batch, results)
        _insert_findings(model, batch, results)
    results.seconds[:] = (process_time() - begin) / len(models)
    return results


def _insert_texts(model: Model, batch: Batch, results: CaseResults) -> None:
    """Store settings, reasons of missing values, warnings and notes of the cases of a batch.

    `model` is one of the models, with the texts that all of them have in common.
    """
    patch = model.patch
    is_solved = batch.outcome != OutcomeCode.FAILED
    counts = batch.facts[MeshFact.N_NODES]
    for count in np.unique(counts):
        results.numerics[counts == count] = {"interface_nodes": int(count)}
    reason = "; or ".join(measures.list_unbounded_pressure_reasons(patch))
    for name in measures.PRESSURE_PEAK_MEASURES:
        is_unbounded = np.isnan(batch.values[name]) & is_solved
        if is_unbounded.any():
            row = PATCH_TABLE[name]
            missing = Measure(None, row.unit, None, row.floor, reason=reason)
            results.fill(np.flatnonzero(is_unbounded), {name: missing})

    # Texts that all cases have in common
    path = model.source.path
    warnings = shorten_file_names([*model.source.remarks, *result.warn_of_locking(patch)], path)
    notes = shorten_file_names(model.source.notes, path)
    if assumption := measures.describe_assumed_plane_state(patch.pieces):
        notes.append(f"{assumption}; the run of a single case states how much the two differ")
    results.warnings[is_solved] = warnings
    results.notes[is_solved] = notes

    # Those of single cases; if the largest pressure and approach cause none, no other case has any.
    peak = measures.PRESSURE_PEAK_MEASURES[0]
    peaks = np.nan_to_num(batch.values[peak])
    certain = peaks - np.nan_to_num(batch.errors[peak])
    approaches = np.nan_to_num(batch.values["approach"])
    coupling = batch.facts[MeshFact.COUPLING]
    is_own = batch.outcome == OutcomeCode.NO_CONTACT
    is_own |= batch.facts[MeshFact.STEEP_END] > 0
    if (
        result.warn_of_strains(patch, peaks.max(), approaches.max())
        or strength.note_on_yielding_faces(patch, certain.max())
        or result.note_on_coupling(coupling.max())
    ):
        is_own = is_solved

    for case in np.flatnonzero(is_own).tolist():
        own = result.warn_of_strains(patch, peaks[case], approaches[case])
        if batch.facts[MeshFact.STEEP_END, case]:
            own.append(result.STEEP_END_WARNING)
        if batch.outcome[case] == OutcomeCode.NO_CONTACT:
            own.append(Outcome.NO_CONTACT.sentence)
        results.warnings[case] = [*warnings, *own]
        yielding = strength.note_on_yielding_faces(patch, certain[case])
        coupled = result.note_on_coupling(coupling[case])
        results.notes[case] = [*coupled, *notes, *yielding.values()]


def _insert_findings(model: Model, batch: Batch, results: CaseResults) -> None:
    """Store why cases miss their tolerance, with the measure that misses it most; `model` has the tolerance."""
    names = list(batch.values)
    tolerance = model.accuracy.tolerance
    columns = (batch.values, batch.errors, batch.floors)
    table = np.array([[part[name] for name in names] for part in columns])
    ratios = measures.compute_error_ratios(tolerance, *table)

    is_missed = (ratios > 1).any(axis=0) & (batch.outcome != OutcomeCode.FAILED)
    for case in np.flatnonzero(is_missed).tolist():
        # What misses, as for a single run, whose advice depends on why its mesh is no finer
        excess = {name: ratio for name, ratio in zip(names, ratios[:, case]) if ratio > 1}
        missed = {}
        for name in excess:
            unit = PATCH_TABLE[name].unit
            missed[name] = Measure(batch.values[name][case], unit, batch.errors[name][case])
        advice = f"a finer mesh does not reduce it or is too expensive; {findings.USE_ERROR_ADVICE}"
        if not model.patch.mesh.is_automatic:
            advice = f"leave out {findings.ELEMENT_SIZE_KEY}"
        elif batch.excess[case] <= 1:
            finer = findings.PROPOSED_TOLERANCE_RATIO * tolerance
            advice = f"set accuracy.tolerance = {finer:.3g} for a finer mesh"
        cause = f"the mesh ({int(batch.facts[MeshFact.N_NODES, case])} interface nodes) causes this error; "
        finding = findings.Missed(None, (), model, missed, excess).make_finding(
            Advice(cause + advice)
        )
        results.findings[case] = finding.sentence
        results.warnings[case] = [*results.warnings[case], finding.sentence]
