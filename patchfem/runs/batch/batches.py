"""Assignment of models to batches, and the results of all cases.

In: a sequence of models. Out: `CaseResults`. Each model is computed by the first batch that supports it, together with
the other models of its group.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import NamedTuple

from ...core import PatchfemError
from ...model.model import Model
from ...model.similar_models import SimilarModels, select_models
from . import one_by_one
from .case_results import CaseResults


@dataclass(frozen=True, eq=False)
class Batch:
    """Method that computes many models together, implemented by a module of this folder.

    The module is imported lazily. Its functions implement the methods of this class.

    - name: name of the module.
    - min_cases: smallest number of cases for which the batch is used.
    - min_chunk_cases: smallest number of cases in a chunk of a sweep for which batching pays.
    """

    name: str
    min_cases: int = 0
    min_chunk_cases: int = 1

    @property
    def _implementation(self):
        """Module with the functions of the batch."""
        return import_module(f"patchfem.runs.batch.{self.name}")

    def refusal_reason(self, model: Model) -> str:
        """Return the reason why the batch cannot compute a model, or ""."""
        if model.has_bolted_patch:
            return "its joint is subtracted from bolted modes with the error of its stiffness"
        return self._implementation.refusal_reason(model)

    def group_key(self, model: Model) -> Hashable:
        """Return a hashable key; models with equal keys are computed together."""
        return self._implementation.group_key(model)

    def solve(self, models: Sequence[Model], report: Callable | None) -> CaseResults:
        """Compute the case results of models with equal group keys.

        The results of a case do not depend on the rest of the group.
        """
        return self._implementation.solve(models, report)


# Beginning of the note on a case whose batch failed.
BATCH_FAILURE_NOTE = (
    "this case was run by itself, because computing it together with other cases failed with an "
    "internal fault; its results are not affected, but please report it"
)
# Batches in order of preference: the first one that supports a model computes it.
BATCHES: tuple[Batch, ...] = (
    Batch("patches", min_chunk_cases=2048),
    Batch("lumped", min_cases=32, min_chunk_cases=256),
    Batch("pressed", min_chunk_cases=64),
)


def choose_batch(model: Model, n_study_cases: int = 1) -> Batch | None:
    """Return the first batch that supports a model, or None if the model needs a single run."""
    for batch in BATCHES:
        if n_study_cases >= batch.min_cases and not batch.refusal_reason(model):
            return batch
    return None


class Assignment(NamedTuple):
    """Batch and group of a model, or a single run.

    - batch, group: batch and group key; None for a single run.
    - failure: description of the error, if the assignment failed; else "".
    """

    batch: Batch | None = None
    group: Hashable = None
    failure: str = ""


def solve_models(
    models: Sequence[Model | PatchfemError],
    on_result: Callable | None = None,
    report: Callable | None = None,
    estimate: bool = True,
    n_study_cases: int = 0,
) -> CaseResults:
    """Compute the case results of a sequence of models.

    If a batch fails, its cases are computed one by one, and a note of each case names the batch and
    the error. Errors of single cases (`one_by_one.CASE_ERRORS`) cause no note.

    Parameters
    ----------
    models : sequence of Model or PatchfemError
        An error in place of a model becomes the message of a failed case.
    on_result : callable, optional
        Called with the case index and the Result after each run. Batches create no Result, so all
        cases are then computed one by one.
    report : callable, optional
        Callback for progress messages.
    estimate : bool
        If False, single runs omit the coarse runs and the error estimates. Batches always estimate
        errors.
    n_study_cases : int
        Number of cases of the whole study, if the models are a part of it; 0 for len(models).
    """
    results = CaseResults.blank(len(models))
    n_study_cases = n_study_cases or len(models)
    groups: dict[Assignment, Sequence[int]] = {}
    cases = range(len(models))
    if isinstance(models, SimilarModels) and on_result is None:
        # No rule depends on the numbers in which these models differ.
        assignment = _assign_model(models.first, n_study_cases)
        if assignment.batch is not None:
            groups[assignment] = cases
            cases = range(0)
    for case in cases:
        model = models[case]
        if isinstance(model, PatchfemError):
            results.fail(case, str(model))
            continue
        assignment = _assign_model(model, n_study_cases) if on_result is None else Assignment()
        groups.setdefault(assignment, []).append(case)
    for assignment, cases in groups.items():
        forward = on_result and partial(_forward_result, on_result, cases)
        solve_one_by_one = partial(
            one_by_one.solve, report=report, on_result=forward, estimate=estimate
        )
        part = _solve_group(assignment, select_models(models, cases), solve_one_by_one, report)
        results.insert(cases, part)
    return results


def _assign_model(model: Model, n_study_cases: int) -> Assignment:
    """Return the batch and the group key of a model."""
    batch = None
    try:
        batch = choose_batch(model, n_study_cases)
        return Assignment() if batch is None else Assignment(batch, batch.group_key(model))
    except one_by_one.CASE_ERRORS:  # a single run of the case reports its error
        return Assignment()
    except Exception as error:
        return Assignment(failure=_describe_failure(batch, error))


def _describe_failure(batch: Batch | None, error: Exception) -> str:
    """Return the text of an error in a batch, preceded by the name of the batch if it is known."""
    name = "" if batch is None else f"{batch.name}: "
    return f"{name}{type(error).__name__}: {error}"


def _forward_result(on_result: Callable, case_indices: Sequence[int], index: int, result) -> None:
    """Call `on_result` with the index of a case in the whole study."""
    on_result(case_indices[index], result)


def _solve_group(
    assignment: Assignment,
    models: Sequence[Model],
    solve_one_by_one: Callable,
    report: Callable | None,
) -> CaseResults:
    """Compute the results of a group in its batch, or by single runs if the batch fails."""
    batch, _, failure = assignment
    if batch is not None:
        try:
            return batch.solve(models, report)
        except one_by_one.CASE_ERRORS:  # a single run of the case reports its error
            pass
        except Exception as error:
            failure = _describe_failure(batch, error)
    if failure and report is not None:
        report(
            f"{len(models)} cases are run one by one, because running them together failed: {failure}"
        )
    results = solve_one_by_one(models)
    if failure:
        for case in range(len(models)):
            results.notes[case] = [
                *results.notes.get(case, ()),
                f"{BATCH_FAILURE_NOTE} ({failure})",
            ]
    return results
