"""Results of all cases of a study.

In: a sequence of models. Out: `CaseResults`. Lumped cases of large studies are computed together (`lumped`), all others
one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import partial

from ...core import PatchfemError
from ...model.model import Model
from ...model.similar_models import SimilarModels, select_models
from . import lumped, one_by_one
from .case_results import CaseResults

# Smallest number of cases of a study of which lumped cases are computed together, and of a chunk of such a study.
MIN_CASES_TO_GROUP = 32
MIN_CHUNK_CASES = 256


def find_group(model: Model, n_study_cases: int) -> Hashable | None:
    """Return a key that is equal for all models that are computed together; None for a model that a single run computes.

    `n_study_cases` is the number of cases of the study; small studies are computed one by one.
    """
    if n_study_cases < MIN_CASES_TO_GROUP or model.kind != "rig":
        return None
    try:
        return None if lumped.refusal_reason(model) else lumped.group_key(model)
    except one_by_one.FAILED_CASE_ERRORS:  # a single run of the case reports its error
        return None


def solve_models(
    models: Sequence[Model | PatchfemError],
    on_result: Callable | None = None,
    report: Callable | None = None,
    estimate: bool = True,
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
    estimate : bool
        If False, single runs omit the coarse runs and the error estimates; cases computed together have errors.
    n_study_cases : int
        Number of cases of the whole study, if the models are a part of it; 0 for len(models).
    """
    results = CaseResults.blank(len(models))
    n_study_cases = n_study_cases or len(models)
    groups: dict[Hashable, Sequence[int]] = {}
    cases = range(len(models))
    if isinstance(models, SimilarModels) and on_result is None:
        # No rule depends on the numbers in which these models differ.
        group = find_group(models.first, n_study_cases)
        if group is not None:
            groups[group] = cases
            cases = range(0)

    # Cases of one group are computed together; with a callback each case needs a run of its own.
    for case in cases:
        model = models[case]
        if isinstance(model, PatchfemError):
            results.fail(case, str(model))
            continue
        group = find_group(model, n_study_cases) if on_result is None else None
        groups.setdefault(group, []).append(case)

    # Each group falls back to single runs if its common computation fails.
    for group, cases in groups.items():
        forward = on_result and partial(_forward_result, on_result, cases)
        solve_one_by_one = partial(
            one_by_one.solve, report=report, on_result=forward, estimate=estimate
        )
        part = _solve_group(group, select_models(models, cases), solve_one_by_one, report)
        results.insert(cases, part)
    return results


def _forward_result(on_result, case_indices: Sequence[int], index: int, result) -> None:
    """Call `on_result`, the callback of a study, with the index that a case of a group has in the study, and its result.

    `case_indices` are the indices in the study of the cases of the group, and `index` is that of the case in the group.
    """
    on_result(case_indices[index], result)


def _solve_group(
    group: Hashable | None,
    models: Sequence[Model],
    solve_one_by_one: Callable[[Sequence[Model]], CaseResults],
    report: Callable | None,
) -> CaseResults:
    """Compute the results of a group of cases together, or by single runs.

    Parameters
    ----------
    group : hashable or None
        What the cases have in common, or None for cases that must be run one by one.
    models : sequence of Model
        Models of the cases.
    solve_one_by_one : callable
        Function that takes models and returns their results by single runs. It is also used if the common computation
        fails.
    report : callable or None
        Function that reports the progress.
    """
    faults = []
    if group is not None:
        try:
            return lumped.solve(models, report)
        except one_by_one.FAILED_CASE_ERRORS:  # a single run of the case reports its error
            pass
        except Exception as error:
            # without a number, so that the same fault of many groups is one warning of a sweep
            faults.append(
                "cases are run one by one, because running them together failed with an internal fault, please report "
                f"it: {type(error).__name__}: {error}"
            )
            if report is not None:
                report(faults[0])
    results = solve_one_by_one(models)
    results.faults += faults
    return results
