"""Results of all cases of a study.

In: a sequence of models. Out: `CaseResults`. Lumped cases of large studies are computed together (`lumped`), and so are
patches that differ in numbers alone (`static`); all others one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence

from ...core import PatchfemError
from ...model.model import Model
from ...model.similar_models import SimilarModels, select_models
from . import lumped, one_by_one, static
from .case_results import CaseResults

# Smallest number of cases of a study of which lumped cases are computed together, and of a chunk of such a study.
MIN_CASES_TO_GROUP = 32
MIN_CHUNK_CASES = 256
STATIC_GROUP = "static"  # key of patches that are solved together


def find_group(model: Model, n_study_cases: int) -> Hashable | None:
    """Return a key that is equal for all models that are computed together; None for a model that a single run computes.

    `n_study_cases` is the number of cases of the study; rigs of small studies are computed one by one.
    """
    if model.kind == "patch":
        return STATIC_GROUP if static.can_solve(model) else None
    if n_study_cases < MIN_CASES_TO_GROUP or model.kind != "rig":
        return None
    try:
        return lumped.find_group(model)
    except one_by_one.FAILED_CASE_ERRORS:  # a single run of the case reports its error
        return None


def solve_models(
    models: Sequence[Model | PatchfemError],
    on_result: Callable | None = None,
    report: Callable | None = None,
    n_study_cases: int = 0,
) -> CaseResults:
    """Compute the case results of a sequence of models.

    If cases cannot be computed together because of a fault, they are computed one by one, and a message names the
    error. Errors of single cases (`one_by_one.FAILED_CASE_ERRORS`) cause no message.

    Parameters
    ----------
    models : sequence of Model or PatchfemError
        An error in place of a model becomes the message of a failed case.
    on_result : callable, optional
        Called with the case index and the Result after each run. Cases are then computed one by one, because those that
        are computed together have no Result.
    report : callable, optional
        Callback for progress messages.
    n_study_cases : int
        Number of cases of the whole study, if the models are a part of it; 0 for len(models).
    """
    if on_result is not None:
        return one_by_one.solve(models, report, on_result)
    n_study_cases = n_study_cases or len(models)
    groups: dict[Hashable, Sequence[int]] = {}
    if isinstance(models, SimilarModels):
        # No rule depends on the numbers in which these models differ.
        groups[find_group(models.first, n_study_cases)] = range(len(models))
    else:
        for case, model in enumerate(models):
            is_rig = isinstance(model, Model) and model.kind == "rig"
            group = find_group(model, n_study_cases) if is_rig else None
            groups.setdefault(group, []).append(case)

    results = CaseResults.blank(len(models))
    for group, cases in groups.items():
        results.insert(cases, _solve_group(group, select_models(models, cases), report))
    return results


def _solve_group(
    group: Hashable | None, models: Sequence[Model | PatchfemError], report: Callable | None
) -> CaseResults:
    """Compute the results of a group of cases together, or by single runs if this fails.

    `group` is what the cases have in common, or None for cases that must be run one by one. `report` takes a line of
    text on the progress.
    """
    faults = []
    if group is not None:
        try:
            return static.solve(models) if group == STATIC_GROUP else lumped.solve(models, report)
        except one_by_one.FAILED_CASE_ERRORS:  # a single run of the case reports its error
            pass
        except Exception as error:
            # without a number, so that the same fault of many groups is one warning of a sweep
            faults.append(
                "cases are run one by one, because running them together failed with an internal fault; please report "
                f"this fault: {type(error).__name__}: {error}"
            )
            if report is not None:
                report(faults[0])
    results = one_by_one.solve(models, report)
    results.faults += faults
    return results
