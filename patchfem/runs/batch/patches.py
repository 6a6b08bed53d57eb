"""Batch of static patches that share their pieces, pressed together on each mesh.

In: models of a group. Out: `CaseResults`, or models whose patches are solved.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...core import Outcome, compute_allowed_error
from ...elasticity.lapack import one_thread
from ...model.model import Model
from ...model.similar_models import SimilarModels, select_models
from ..accuracy_warnings import Finding, tolerance_warnings
from ..patch import result as of_patch
from ..patch import static_batch, store
from ..patch.strength import yielding_faces
from ..patch.sweep_meshes import geometry_key
from ..results.patch_rows import POSITIVE_MESH_MEASURES, TABLE
from ..results.result import file_name_shortener, shorten_file_names
from . import one_by_one
from .case_results import CaseResults

# Largest number of cases whose nodal forces are in memory at the same time.
MAX_CASES_PER_CALL = 2048
# Absolute error that is always allowed, so that a value of 0 meets the tolerance.
MIN_ALLOWED_ERROR = 1e-300


class _NodePositions(NamedTuple):
    """Positions of interface nodes [m], which replace a Patch in the text of a warning."""

    x: np.ndarray


def refuses(model: Model) -> str:
    """Return the reason why a static patch cannot be solved in a batch with others, or ""."""
    if model.kind != "patch":
        return "the case is no static patch"
    return static_batch.reason_not_batched(model.patch)


def group(model: Model) -> Hashable:
    """Return a hashable key that is equal for models whose patches can be solved in one batch."""
    return geometry_key(model.patch), static_batch.batch_key(model.patch), model.accuracy.tolerance


def parts(models: Sequence[Model]) -> dict:
    """Group the indices of models whose patches differ in plain numbers only."""
    alike = (
        isinstance(models, SimilarModels)
        and models.first.kind == "patch"
        and not refuses(models.first)
    )
    return {group(models.first): range(len(models))} if alike else {}


def press_together(models: Sequence[Model]) -> list[Model]:
    """Return the models with the solutions of their patches, which are solved in batches.

    Of patches that are equal, e.g. for several drive levels or friction laws, one is pressed for
    all, so that they share its shear modes.
    """
    out = list(models)
    groups = {}
    for case, model in enumerate(models):
        if not static_batch.reason_not_batched(model.patch):
            content = store.content_key(model.patch) if store.may_be_shared(model.patch) else case
            groups.setdefault(group(model), {}).setdefault(content, []).append(case)
    for alike in groups.values():
        first = [models[cases[0]] for cases in alike.values()]
        solutions = static_batch.solve_alike_patches(
            [model.patch for model in first], first[0].accuracy.tolerance
        )
        for cases, one in zip(alike.values(), solutions):
            for case in cases if one is not None else ():
                out[case] = replace(models[case], patch=replace(models[case].patch, solved=one))
    return out


def press_and_solve(models: Sequence[Model], together: int, solve: Callable) -> CaseResults:
    """Solve the patches of models in one batch, then compute the motions of the models.

    Parameters
    ----------
    models : sequence of Model
    together : int
        Number of cases per call.
    solve : callable
        Function of a part of the models that returns its CaseResults.
    """
    out = CaseResults.blank(len(models))
    for first in range(0, len(models), together):
        # in these small systems, BLAS threads wait longer for each other than the solution takes
        with one_thread():
            part = press_together(models[first : first + together])
            out.insert(range(first, first + len(part)), solve(part))
    return out


def solve(models: Sequence[Model], say: Callable | None = None) -> CaseResults:
    """Compute the case results of a group of static patches."""
    out = CaseResults.blank(len(models))
    for start in range(0, len(models), MAX_CASES_PER_CALL):
        cases = range(start, min(start + MAX_CASES_PER_CALL, len(models)))
        out.insert(cases, _solve_cases(select_models(models, cases), say))
    return out


def _solve_cases(models: Sequence[Model], say: Callable | None) -> CaseResults:
    """Compute the case results of static patches that fit in memory together."""
    begin = perf_counter()
    first = models[0]
    alike = isinstance(models, SimilarModels)
    asked = (
        static_batch.loads_from_columns(models.columns().patch, len(models))
        if alike
        else static_batch.collect_loads([model.patch for model in models])
    )
    found = static_batch.solve_batch(asked, first.accuracy.tolerance)
    out = CaseResults.blank(len(models))
    good = found.is_solved
    wide = ~good
    tolerance = first.accuracy.tolerance
    values_by_name = {name: estimate.value for name, estimate in found.estimates.items()}
    decisive = [found.estimates[name] for name in POSITIVE_MESH_MEASURES]
    unknown = np.any([estimate.error >= estimate.value for estimate in decisive], axis=0)
    floors = {
        name: np.broadcast_to(least, good.shape)
        for name, least in of_patch.measure_floors(first.patch, tolerance, values_by_name).items()
    }
    for name, estimate in found.estimates.items():
        out.measure(name, TABLE[name].unit)
        for columns, given in (
            (out.values, estimate.value),
            (out.errors, estimate.error),
            (out.floors, floors[name]),
        ):
            columns[name][:] = np.where(good, given, np.nan)
        wide = wide | (
            estimate.error
            > np.maximum(
                compute_allowed_error(tolerance, estimate.value, floors[name]), MIN_ALLOWED_ERROR
            )
        )
    out.outcome[good] = str(Outcome.DONE)
    out.outcome[good & unknown] = str(Outcome.NOT_CONVERGED)
    nodes = {"interface_nodes": found.levels[0].x.size}
    out.numerics.update(dict.fromkeys(np.flatnonzero(good).tolist(), nodes))
    largest_pressure = found.largest_pressure
    strained = of_patch.exceeds_small_strains(first.patch, largest_pressure, found.approach)
    pieces = first.patch.pieces
    mean = values_by_name["normal_load"] / (pieces.length * pieces.width * pieces.pairs)
    peak = found.estimates["pressure_peak"]
    least_peak = peak.value - peak.error
    always = bool(first.source.remarks) or not alike
    told = file_name_shortener(first.source.path)
    for case in np.flatnonzero(good & (wide | strained | always)).tolist():
        model = models[case]
        measures = found.measures(case, floors)
        warned = [
            *model.source.remarks,
            *of_patch.strain_warnings(
                model.patch, float(largest_pressure[case]), float(found.approach[case])
            ),
            *tolerance_warnings(Finding(model, measures, _NodePositions(found.levels[0].x))),
        ]
        if warned:
            out.warnings[case] = shorten_file_names(warned, model.source.path)
    for case in np.flatnonzero(good).tolist():
        notes = [
            *of_patch.notes_on_tall_pieces(first.patch, mean[case]),
            *found.plane_sentences(first.patch, case),
            *yielding_faces(first.patch, least_peak[case]).values(),
        ]
        if notes:
            out.notes[case] = told(notes)
    single = np.flatnonzero(~good)
    out.seconds[:] = (perf_counter() - begin) / len(models)
    if single.size:
        out.insert(single, one_by_one.solve(select_models(models, single), say))
    return out
