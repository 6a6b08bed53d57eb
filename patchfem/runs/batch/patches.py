"""Batch of static patches with equal pieces, which are solved together on each mesh.

In: models of a group. Out: `CaseResults`, or models with solved patches.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...core import Outcome, compute_allowed_error
from ...model.model import Model
from ...model.similar_models import SimilarModels, select_models
from ..accuracy_warnings import AccuracyContext, tolerance_warnings
from ..patch import result as of_patch
from ..patch import static_batch, store
from ..patch.strength import note_on_yielding_faces
from ..patch.sweep_meshes import geometry_key
from ..results.patch_rows import POSITIVE_MESH_MEASURES, TABLE
from ..results.result import make_file_name_shortener, shorten_file_names
from . import one_by_one
from .case_results import CaseResults, solve_in_parts

# Largest number of cases whose nodal forces are held in memory at the same time.
MAX_CASES_PER_CALL = 2048
# Absolute error that is always accepted, so that a value of 0 meets the tolerance.
MIN_ALLOWED_ERROR = 1e-300


class _NodePositions(NamedTuple):
    """Node positions [m], the only data of a Patch that the accuracy warnings need."""

    x: np.ndarray


def refusal_reason(model: Model) -> str:
    """Return why a static patch cannot be solved together with others, or ""."""
    if model.kind != "patch":
        return "the case is no static patch"
    return static_batch.reason_not_batched(model.patch)


def group_key(model: Model) -> Hashable:
    """Return a hashable key; patches of models with equal keys can be solved together."""
    return geometry_key(model.patch), static_batch.batch_key(model.patch), model.accuracy.tolerance


def attach_solved_patches(models: Sequence[Model]) -> list[Model]:
    """Solve the patches of models in batches, and return the models with the solved patches.

    Equal patches, e.g. for several drive levels or friction laws, are solved once and share their
    shear modes.
    """
    solved_models = list(models)
    groups = {}
    for case, model in enumerate(models):
        if not static_batch.reason_not_batched(model.patch):
            key = store.content_key(model.patch) if store.can_share_results(model.patch) else case
            groups.setdefault(group_key(model), {}).setdefault(key, []).append(case)
    for cases_by_content in groups.values():
        first = [models[cases[0]] for cases in cases_by_content.values()]
        solutions = static_batch.solve_similar_patches(
            [model.patch for model in first], first[0].accuracy.tolerance
        )
        for cases, solved in zip(cases_by_content.values(), solutions):
            for case in cases if solved is not None else ():
                solved_models[case] = replace(
                    models[case], patch=replace(models[case].patch, solved=solved)
                )
    return solved_models


def solve(models: Sequence[Model], report: Callable | None = None) -> CaseResults:
    """Compute the case results of a group of static patches."""
    return solve_in_parts(models, MAX_CASES_PER_CALL, partial(_solve_cases, report=report))


def _solve_cases(models: Sequence[Model], report: Callable | None) -> CaseResults:
    """Compute the case results of static patches in one batch."""
    begin = perf_counter()
    first = models[0]
    is_columns = isinstance(models, SimilarModels)
    loads = (
        static_batch.patch_loads_from_arrays(models.columns().patch, len(models))
        if is_columns
        else static_batch.collect_patch_loads([model.patch for model in models])
    )
    solution = static_batch.solve_patch_batch(loads, first.accuracy.tolerance)
    results = CaseResults.blank(len(models))
    is_solved = solution.is_solved
    is_wide = ~is_solved
    tolerance = first.accuracy.tolerance
    values_by_name = {name: estimate.value for name, estimate in solution.estimates.items()}
    decisive_estimates = [solution.estimates[name] for name in POSITIVE_MESH_MEASURES]
    is_unresolved = np.any(
        [estimate.error >= estimate.value for estimate in decisive_estimates], axis=0
    )
    floors = of_patch.measure_floors(first.patch, tolerance, values_by_name)
    floors = {name: np.broadcast_to(floor, is_solved.shape) for name, floor in floors.items()}
    for name, estimate in solution.estimates.items():
        results.add_measure(name, TABLE[name].unit)
        for columns, column in (
            (results.values, estimate.value),
            (results.errors, estimate.error),
            (results.floors, floors[name]),
        ):
            columns[name][:] = np.where(is_solved, column, np.nan)
        is_wide = is_wide | (
            estimate.error
            > np.maximum(
                compute_allowed_error(tolerance, estimate.value, floors[name]), MIN_ALLOWED_ERROR
            )
        )
    results.outcome[is_solved] = str(Outcome.DONE)
    results.outcome[is_solved & is_unresolved] = str(Outcome.NOT_CONVERGED)
    nodes = {"interface_nodes": solution.levels[0].x.size}
    results.numerics.update(dict.fromkeys(np.flatnonzero(is_solved).tolist(), nodes))
    largest_pressure = solution.largest_pressure
    is_strained = of_patch.exceeds_small_strains(first.patch, largest_pressure, solution.approach)
    pieces = first.patch.pieces
    mean_pressure = values_by_name["normal_load"] / (pieces.length * pieces.width * pieces.pairs)
    peak = solution.estimates["pressure_peak"]
    min_peak = peak.value - peak.error
    has_remarks = bool(first.source.remarks) or not is_columns
    shorten = make_file_name_shortener(first.source.path)
    for case in np.flatnonzero(is_solved & (is_wide | is_strained | has_remarks)).tolist():
        model = models[case]
        measures = solution.measures(case, floors)
        warnings = [
            *model.source.remarks,
            *of_patch.strain_warnings(
                model.patch, float(largest_pressure[case]), float(solution.approach[case])
            ),
            *tolerance_warnings(
                AccuracyContext(model, measures, _NodePositions(solution.levels[0].x))
            ),
        ]
        if warnings:
            results.warnings[case] = shorten_file_names(warnings, model.source.path)
    for case in np.flatnonzero(is_solved).tolist():
        notes = [
            *of_patch.notes_on_tall_pieces(first.patch, mean_pressure[case]),
            *solution.plane_sentences(first.patch, case),
            *note_on_yielding_faces(first.patch, min_peak[case]).values(),
        ]
        if notes:
            results.notes[case] = shorten(notes)
    unsolved = np.flatnonzero(~is_solved)
    results.seconds[:] = (perf_counter() - begin) / len(models)
    if unsolved.size:
        results.insert(unsolved, one_by_one.solve(select_models(models, unsolved), report))
    return results
