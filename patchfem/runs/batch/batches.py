"""Assignment of models to batches, and the results of all cases.

In: a sequence of models. Out: `CaseResults`. Each model is computed by the first batch that
supports it, together with the other models of its group.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from importlib import import_module
from typing import NamedTuple

import numpy as np

from ... import compiled
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
    - kind: kind of scene that the batch computes.
    - cost_fraction: computing time of a case relative to that of a single run; 0 if negligible.
    - compile_seconds: CPU time to compile the kernels for the first group [s].
    - min_cases: smallest number of cases for which the batch is used. A batch with such a limit has
      its own error estimates, which do not depend on the other cases of the group.
    - takes_columns: whether the batch accepts similar models as columns of numbers.
    - min_chunk_cases: smallest number of cases in a chunk of a sweep for which batching pays.
    """

    name: str
    kind: str
    cost_fraction: float = 0.0
    compile_seconds: float = 0.0
    min_cases: int = 0
    takes_columns: bool = False
    min_chunk_cases: int = 1

    @property
    def _implementation(self):
        """Module with the functions of the batch."""
        return import_module(f"patchfem.runs.batch.{self.name}")

    def refusal_reason(self, model: Model) -> str:
        """Return the reason why the batch cannot compute a model, or ""."""
        if model.kind != self.kind:
            return f"it is a {model.kind}"
        if model.has_bolted_patch:
            return "its joint is subtracted from bolted modes with the error of its stiffness"
        return _reason_for_single_runs(self.kind) or self._implementation.refusal_reason(model)

    def group_key(self, model: Model) -> Hashable:
        """Return a hashable key; models with equal keys are computed together."""
        return self._implementation.group_key(model)

    def solve(self, models: Sequence[Model], report: Callable | None) -> CaseResults:
        """Compute the case results of models with equal group keys.

        Values and errors equal those of single runs to 1e-12, independently of the rest of the group.
        """
        return self._implementation.solve(models, report)

    def group_models(self, models: Sequence) -> dict:
        """Return the indices of the models whose numbers the batch takes as columns, by group key."""
        candidates = [models.first] if isinstance(models, SimilarModels) else models
        if not self.takes_columns or _reason_for_single_runs(self.kind):
            return {}
        if not any(getattr(model, "kind", "") == self.kind for model in candidates):
            return {}
        return self._implementation.group_models(models)


@cache
def _reason_for_single_runs(kind: str) -> str:
    """Return why cases of a kind of scene cannot be computed in a batch, or "".

    No batch is used if a measure is requested that only single runs compute.
    """
    rows = import_module("patchfem.response.rows").SINGLE_RUN_ROWS if kind == "rig" else ()
    return f"the measure {rows[0].name} is computed only by single runs" if rows else ""


# Beginning of the note on a case whose batch failed.
BATCH_FAILURE_NOTE = (
    "this case was run by itself, because computing it together with other cases failed with an "
    "internal fault; its results are not affected, but please report it"
)
# Batches in order of preference: the first one that supports a model computes it.
BATCHES: tuple[Batch, ...] = (
    Batch(
        "lumped.lanes",
        "rig",
        compile_seconds=6.0,
        min_cases=64,
        takes_columns=True,
        min_chunk_cases=1024,
    ),
    Batch("lumped.lumped", "rig", compile_seconds=12.0),
    Batch(
        "lumped.tabled",
        "rig",
        cost_fraction=0.2,
        compile_seconds=18.0,
        min_cases=64,
        min_chunk_cases=512,
    ),
    Batch("lumped.sheared", "rig", cost_fraction=0.4, compile_seconds=12.0, min_chunk_cases=64),
    Batch(
        "gathered",
        "rig",
        cost_fraction=0.05,
        compile_seconds=10.0,
        min_cases=32,
        min_chunk_cases=128,
    ),
)


def batch_compile_seconds(batch: Batch, model: Model) -> float:
    """Return the CPU time to compile the kernels of a batch for a model [s]; 0 if they are cached."""
    if batch.compile_seconds and not compiled.has_run(_kernel_label(batch, model)):
        return batch.compile_seconds
    return 0.0


def _kernel_label(batch: Batch, model: Model) -> str:
    """Return a label of the compiled kernels that a batch needs for a model."""
    rig = model.rig
    if rig is None:
        return batch.name
    laws = [interface.numbers.law for interface in rig.friction.interfaces]
    return " ".join([batch.name, rig.drive.waveform.name, *laws, str(bool(model.partial_slip))])


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
        Callback for progress messages, e.g. before a compilation.
    estimate : bool
        If False, single runs omit the coarse runs and the error estimates. Batches always estimate
        errors.
    n_study_cases : int
        Number of cases of the whole study, if the models are a part of it; 0 for len(models).
    """
    results = CaseResults.blank(len(models))
    n_study_cases = n_study_cases or len(models)
    groups = {}
    remaining = np.arange(len(models))
    if on_result is None:
        remaining, groups = _assign_similar_models(models, n_study_cases)
    for case in remaining.tolist():
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


def _assign_similar_models(models: Sequence, n_study_cases: int) -> tuple[np.ndarray, dict]:
    """Assign models that differ only in numbers to batches that take the numbers as columns.

    Returns the indices of the models that are not assigned, and the indices of the others as a dict
    by Assignment.
    """
    groups = {}
    remaining = np.arange(len(models))
    for batch in BATCHES:
        if n_study_cases < batch.min_cases or not remaining.size:
            continue
        try:
            parts = batch.group_models(select_models(models, remaining))
        except one_by_one.CASE_ERRORS:  # a single run of the case reports its error
            continue
        except Exception as error:
            cases = [case for case in remaining.tolist() if isinstance(models[case], Model)]
            groups[Assignment(failure=_describe_failure(batch, error))] = cases
            return np.setdiff1d(remaining, cases), groups
        assigned = [remaining[np.asarray(indices)] for indices in parts.values()]
        for group, cases in zip(parts, assigned):
            groups[Assignment(batch, group)] = cases.tolist()
        remaining = np.setdiff1d(remaining, np.concatenate([[], *assigned]))
    return remaining, groups


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


def _forward_result(on_result: Callable, case_indices: list, index: int, result) -> None:
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
            results = batch.solve(models, report)
            if batch.compile_seconds and batch_compile_seconds(batch, models[0]):
                compiled.record_run(_kernel_label(batch, models[0]))
            return results
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
