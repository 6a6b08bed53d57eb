"""Static patches that are pressed together, on meshes and contact sets that they share.

In: models of static patches with the same pieces. Out: `CaseResults`, as from single runs. Cases that cannot be pressed or
whose errors are unknown are computed by single runs, which name the reason.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from time import process_time

import numpy as np

from ...core import Measure, Outcome
from ...model.model import Model
from ...model.similar_models import SimilarModels
from ..findings import Missed
from ..patch import case_meshes, measures, result, strength
from ..patch.cases import Batch, OutcomeCode, group_key, split_columns, stack_patches
from ..results.patch_rows import MESH_MEASURES, PATCH_TABLE
from ..results.result import Advice, shorten_file_names
from . import one_by_one
from .case_results import CaseResults

# Outcomes of a run by the codes of a batch; cases with other codes are single runs
OUTCOMES = {OutcomeCode.DONE: Outcome.DONE, OutcomeCode.NO_CONTACT: Outcome.NO_CONTACT}
# Ratio of proposed to present tolerance for a measure for which the mesh is not refined
PROPOSED_TOLERANCE_RATIO = 0.1


def refusal_reason(model: Model) -> str:
    """Return why a model is not pressed together with others, or "" if it is.

    Only single runs state what these parts of a scene neglect, case by case.
    """
    patch = model.patch
    if patch is None or model.kind != "patch" or model.wear is not None or model.has_bolted_patch:
        return "the run is not that of a static patch"
    skin = patch.interface.skin
    reasons = {
        "[contact.strips]": patch.interface.strips is not None,
        "[contact.profile]": patch.gap.profile is not None,
        "contact.mesh": patch.mesh.file is not None,
        "pieces of different elasticity": not patch.pieces.are_alike,
        "end_radius": any(piece.end.kind == "radius" for piece in patch.pieces.both),
        "asperities of a trace": skin is not None and getattr(skin, "rms_height", None) is not None,
    }
    return next((words for words, is_refused in reasons.items() if is_refused), "")


def make_group_key(model: Model) -> Hashable:
    """Return a key that is equal for all models that are pressed together."""
    return group_key(model.patch), model.accuracy.tolerance


def solve(models: Sequence[Model], report: Callable | None = None) -> CaseResults:
    """Compute the case results of models with equal keys.

    Parameters
    ----------
    models : sequence of Model
        At least one model.
    report : callable, optional
        Callback for progress messages of single runs.
    """
    begin = process_time()
    if isinstance(models, SimilarModels):
        first = models.first
        group = split_columns(models.columns().patch, len(models))
    else:
        first = models[0]
        group = stack_patches([model.patch for model in models])
    batch = case_meshes.solve_cases(group, first.accuracy.tolerance)

    results = CaseResults.blank(len(batch))
    for code, outcome in OUTCOMES.items():
        results.outcome[batch.outcome == code] = str(outcome)
    for name, values in batch.values.items():
        results.units[name] = PATCH_TABLE[name].unit
        results.values[name] = values
        results.errors[name] = batch.errors[name]
        results.floors[name] = batch.floors[name]
    is_alone = ~np.isin(batch.outcome, list(OUTCOMES))
    is_alone |= np.isnan(batch.errors.get("normal_load", np.nan))
    _insert_texts(models, first, batch, np.flatnonzero(~is_alone), results)
    results.seconds[:] = (process_time() - begin) / len(batch)
    one_by_one.replace_by_single_runs(results, models, is_alone, report)
    return results


def _insert_texts(
    models: Sequence[Model], first: Model, batch: Batch, cases: np.ndarray, results: CaseResults
) -> None:
    """Store warnings, notes, reasons and settings of some cases.

    Parameters
    ----------
    models : sequence of Model
        Models of all cases.
    first : Model
        Model with the texts that all cases have in common.
    batch : Batch
        Measures of all cases.
    cases : (k,) ndarray
        Numbers of the cases.
    results : CaseResults
        Results, which get the texts.
    """
    path = first.source.path
    patch = first.patch
    warnings = [*first.source.remarks, *result.warn_of_locking(patch)]
    notes = list(first.source.notes)
    if assumption := measures.describe_assumed_plane_state(patch.pieces):
        notes.append(f"{assumption}; the run of a single case states how much the two differ")
    reason = "; or ".join(measures.list_unbounded_pressure_reasons(patch))
    peaks = batch.values["pressure_peak"]
    finite_peaks = np.nan_to_num(peaks - np.nan_to_num(batch.errors["pressure_peak"]))
    settings = {int(count): {"interface_nodes": int(count)} for count in np.unique(batch.n_nodes)}

    for case in cases.tolist():
        own_warnings = list(warnings)
        approach = batch.values["approach"][case]
        own_warnings += result.warn_of_strains(patch, np.nan_to_num(peaks[case]), approach)
        if batch.outcome[case] == OutcomeCode.NO_CONTACT:
            own_warnings.append(Outcome.NO_CONTACT.sentence)
        own_warnings += _warn_of_errors(first, batch, case)
        if own_warnings:
            results.warnings[case] = shorten_file_names(own_warnings, path)
        yielding = strength.note_on_yielding_faces(patch, finite_peaks[case])
        if notes or yielding:
            results.notes[case] = [*shorten_file_names(notes, path), *yielding.values()]
        results.numerics[case] = settings[int(batch.n_nodes[case])]
        if np.isnan(peaks[case]):
            for name in measures.PRESSURE_PEAK_MEASURES:
                results.fill(case, {name: _make_measure(batch, name, case, reason)})


def _make_measure(batch: Batch, name: str, case: int, reason: str = "") -> Measure:
    """Return the measure of a case; `reason` is why it has no value."""
    value, error, floor = (
        float(columns[name][case]) for columns in (batch.values, batch.errors, batch.floors)
    )
    unit = PATCH_TABLE[name].unit
    if np.isnan(value):
        return Measure(None, unit, None, PATCH_TABLE[name].floor, reason=reason)
    return Measure(value, unit, error, floor)


def _warn_of_errors(first: Model, batch: Batch, case: int) -> list[str]:
    """Return a list with a warning on the measures of a case that miss the tolerance.

    `first` is a model of the group, with its tolerance.
    """
    tolerance = first.accuracy.tolerance
    own = {name: _make_measure(batch, name, case) for name in batch.values}
    excess = {name: measure.error_ratio(tolerance) for name, measure in own.items()}
    excess = {name: ratio for name, ratio in excess.items() if ratio > 1}
    if not excess:
        return []

    # The mesh is refined for some of the measures; a smaller tolerance refines it for the others.
    advice = "leave out contact.element_size"
    if first.patch.mesh.is_automatic:
        advice = "a finer mesh does not reduce it or is too expensive; use the value with its stated error"
        if not excess.keys() <= set(MESH_MEASURES):
            advice = f"set accuracy.tolerance = {PROPOSED_TOLERANCE_RATIO * tolerance:.3g} for a finer mesh"
    cause = f"the mesh ({batch.n_nodes[case]} interface nodes) causes this error; "
    missed = Missed(None, (), first, own, excess)
    return [missed.make_finding(Advice(cause + advice)).sentence]
