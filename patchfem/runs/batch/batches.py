"""Results of all cases of a study.

In: a sequence of models. Out: `CaseResults`. Lumped cases of large studies are computed together (`lumped`), all others
one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import partial
from typing import NamedTuple

from ...core import PatchfemError
from ...model.model import Model
from ...model.similar_models import SimilarModels, select_models
from . import lumped, one_by_one
from .case_results import CaseResults

# Smallest number of cases of a study of which lumped cases are computed together, and of a chunk of such a study.
MIN_CASES = 32
MIN_CHUNK_CASES = 256
# Beginning of the note on cases that could not be computed together.
FAILURE_NOTE = (
    "this case was run by itself, because computing it together with other cases failed with an "
    "internal fault; its results are not affected, but please report it"
)


class Group(NamedTuple):
    """Models that are computed together, or one by one.

    - key: hashable key of models that are computed together; None for single runs.
    - failure: description of the error, if the key could not be found; else "".
    """

    key: Hashable = None
    failure: str = ""


def find_group(model: Model, n_study_cases: int) -> Group:
    """Return the group of a model in a study with a number of cases."""
    if n_study_cases < MIN_CASES or model.kind != "rig":
        return Group()
    try:
        return Group() if lumped.refusal_reason(model) else Group(lumped.group_key(model))
    except one_by_one.CASE_ERRORS:  # a single run of the case reports its error
        return Group()
    except Exception as error:
        return Group(failure=_describe(error))


def _describe(error: Exception) -> str:
    """Return the text of an error."""
    return f"{type(error).__name__}: {error}"


def solve_models(
    models: Sequence[Model | PatchfemError],
    on_result: Callable | None = None,
    report: Callable | None = None,
    estimate: bool = True,
    n_study_cases: int = 0,
) -> CaseResults:
    """Compute the case results of a sequence of models.

    If cases cannot be computed together because of a fault, they are computed one by one, and a note of each names the
    error. Errors of single cases (`one_by_one.CASE_ERRORS`) cause no note.

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
    groups: dict[Group, Sequence[int]] = {}
    cases = range(len(models))
    if isinstance(models, SimilarModels) and on_result is None:
        # No rule depends on the numbers in which these models differ.
        group = find_group(models.first, n_study_cases)
        if group.key is not None:
            groups[group] = cases
            cases = range(0)

    # Cases of one group are computed together; with a callback each case needs a run of its own.
    for case in cases:
        model = models[case]
        if isinstance(model, PatchfemError):
            results.fail(case, str(model))
            continue
        group = find_group(model, n_study_cases) if on_result is None else Group()
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


def _forward_result(on_result: Callable, case_indices: Sequence[int], index: int, result) -> None:
    """Call `on_result` with the index of a case in the whole study."""
    on_result(case_indices[index], result)


def _solve_group(
    group: Group,
    models: Sequence[Model],
    solve_one_by_one: Callable,
    report: Callable | None,
) -> CaseResults:
    """Compute the results of a group together, or by single runs if this fails."""
    failure = group.failure
    if group.key is not None:
        try:
            return lumped.solve(models, report)
        except one_by_one.CASE_ERRORS:  # a single run of the case reports its error
            pass
        except Exception as error:
            failure = _describe(error)
    if failure and report is not None:
        report(
            f"{len(models)} cases are run one by one, because running them together failed: {failure}"
        )
    results = solve_one_by_one(models)
    if failure:
        for case in range(len(models)):
            notes = results.notes.get(case, ())
            results.notes[case] = [*notes, f"{FAILURE_NOTE} ({failure})"]
    return results
