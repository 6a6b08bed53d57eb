"""Case results of many models, each computed by the first batch that does not refuse it.

In: a sequence of models. Out: `CaseResults`. Models that can share work are computed together,
in groups.
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
from .. import joint
from . import one_by_one
from .case_results import CaseResults


@dataclass(frozen=True, eq=False)
class Batch:
    """Method that computes many models together, implemented by a module of this folder.

    The module is imported when it is first needed. Its functions are the methods of this class.

    - name: name of the module.
    - kind: kind of the models that it takes.
    - share: seconds of a case over those of a single run; 0 if negligible.
    - compile: CPU seconds of compiling for the first group.
    - least: smallest number of cases of a study that it takes; such a batch has its own error
      estimates, which do not depend on what else is in the group.
    - reads_columns: whether it reads the numbers of similar models as columns.
    - together: smallest number of cases in a chunk of a sweep for which the shared work pays.
    """

    name: str
    kind: str
    share: float = 0.0
    compile: float = 0.0
    least: int = 0
    reads_columns: bool = False
    together: int = 1

    @property
    def _module(self):
        """Module that implements the batch."""
        return import_module(f"patchfem.runs.batch.{self.name}")

    def refuses(self, model: Model) -> str:
        """Return the reason why the batch cannot compute a model, or ""."""
        if model.kind != self.kind:
            return f"it is a {model.kind}"
        return _why_run_singly(self.kind) or self._module.refuses(model)

    def group(self, model: Model) -> Hashable:
        """Return a hashable key that is equal for models that are computed together."""
        return self._module.group(model)

    def solve(self, models: Sequence[Model], say: Callable | None) -> CaseResults:
        """Compute the case results of a group of models that are computed together.

        They equal those of single runs to 1e-12, errors included, whatever else is in the group.
        """
        return self._module.solve(models, say)

    def parts(self, models: Sequence) -> dict:
        """Group the indices of models whose numbers the batch reads as columns of arrays."""
        candidates = [models.first] if isinstance(models, SimilarModels) else models
        if not self.reads_columns or _why_run_singly(self.kind):
            return {}
        if not any(getattr(model, "kind", "") == self.kind for model in candidates):
            return {}
        return self._module.parts(models)


@cache
def _why_run_singly(kind: str) -> str:
    """Return the reason why no batch computes cases of a kind of scene, or "".

    A measure that only single runs compute excludes all batches.
    """
    rows = import_module("patchfem.response.rows").SINGLE_RUN_ROWS if kind == "rig" else ()
    return f"the measure {rows[0].name} is computed only by single runs" if rows else ""


# beginning of the note on a case whose batch failed
BATCH_FAILED = (
    "this case was run by itself, because computing it together with other cases failed with an "
    "internal fault; its results are not affected, but please report it"
)
# batches in the order in which they are tried: the first that does not refuse a model computes it
BATCHES: tuple[Batch, ...] = (
    Batch("patches", "patch", compile=6.0, reads_columns=True, together=2048),
    Batch("benches", "bench", share=0.4, together=64),
    Batch("lumped.lanes", "rig", compile=6.0, least=64, reads_columns=True, together=1024),
    Batch("lumped.lumped", "rig", compile=12.0),
    Batch("lumped.tabled", "rig", share=0.2, compile=18.0, least=64, together=512),
    Batch("lumped.sheared", "rig", share=0.4, compile=12.0, together=64),
    Batch("gathered", "rig", share=0.05, compile=10.0, least=32, together=128),
)


def batch_compile_seconds(batch: Batch, model: Model) -> float:
    """Return the CPU time [s] to compile the batch for a model; 0 if its code is in the cache."""
    if batch.compile and not compiled.has_run(_compiled_kind(batch, model)):
        return batch.compile
    return 0.0


def _compiled_kind(batch: Batch, model: Model) -> str:
    """Return a text that identifies the compiled code that a batch needs for a model."""
    rig = model.rig
    if rig is None:
        return batch.name
    laws = [interface.numbers.law for interface in rig.friction.interfaces]
    return " ".join([batch.name, rig.drive.waveform.name, *laws, str(bool(model.partial_slip))])


def choose_batch(model: Model, study: int = 1) -> Batch | None:
    """Return the first batch that can compute a model, or None if the model needs a single run."""
    for batch in BATCHES:
        if study >= batch.least and not batch.refuses(model):
            return batch
    return None


class Assignment(NamedTuple):
    """Assignment of a model to a batch and a group, or to a single run.

    - batch, group: None if the model is run by itself.
    - failure: the batch and its error, if it failed to assign the model; else "".
    """

    batch: Batch | None = None
    group: Hashable = None
    failure: str = ""


def solve_models(
    models: Sequence[Model | PatchfemError],
    keep: Callable | None = None,
    say: Callable | None = None,
    estimate: bool = True,
    study: int = 0,
) -> CaseResults:
    """Compute the case results of many models, in the order of the models.

    If a batch fails, its cases are run one by one. A note of each of them names the batch and the
    error, unless the error is that of a case (`one_by_one.CASE_ERRORS`).

    Parameters
    ----------
    models : sequence of Model or PatchfemError
        An error in place of a model is the message of its failed case.
    keep : callable, optional
        Called with case and Result after each run. A batch has no Result, so that all cases are
        then run one by one.
    say : callable, optional
        Callback for a line of text when code has to be compiled.
    estimate : bool
        If False, the models that are run one by one have no coarse runs and no errors (a batch has
        its errors from the same work).
    study : int
        Number of cases of which these are a part; 0 if they are all.
    """
    if not isinstance(models, SimilarModels):
        models = [_model_without_joint(model) for model in models]
    results = CaseResults.blank(len(models))
    study = study or len(models)
    groups = {}
    remaining = np.arange(len(models))
    if keep is None:
        remaining, groups = _assign_columns(models, study)
    for case in remaining.tolist():
        model = models[case]
        if isinstance(model, PatchfemError):
            results.fail(case, str(model))
            continue
        assignment = _assign_model(model, study) if keep is None else Assignment()
        groups.setdefault(assignment, []).append(case)
    for assignment, cases in groups.items():
        keep_case = keep and partial(_report_case, keep, cases)
        run_singly = partial(one_by_one.solve, say=say, keep=keep_case, estimate=estimate)
        part = _solve_group(assignment, select_models(models, cases), run_singly, say)
        results.insert(cases, part)
    return results


def _model_without_joint(model: Model | PatchfemError) -> Model | PatchfemError:
    """Remove the joint from the measured modes of a model; return an error if that fails."""
    if (
        isinstance(model, PatchfemError)
        or model.rig is None
        or model.rig.structure.without_joint is None
    ):
        return model
    try:
        return joint.remove_joint(model)
    except PatchfemError as error:
        return error


def _assign_columns(models: Sequence, study: int) -> tuple[np.ndarray, dict]:
    """Assign models that differ in plain numbers to batches that read these numbers as columns.

    Returns the indices of the models that are not assigned, and a dict with those of all others by
    Assignment.
    """
    groups = {}
    remaining = np.arange(len(models))
    for batch in BATCHES:
        if study < batch.least or not remaining.size:
            continue
        try:
            parts = batch.parts(select_models(models, remaining))
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


def _assign_model(model: Model, study: int) -> Assignment:
    """Assign a model of a study to a batch and a group."""
    batch = None
    try:
        batch = choose_batch(model, study)
        return Assignment() if batch is None else Assignment(batch, batch.group(model))
    except one_by_one.CASE_ERRORS:  # a single run of the case reports its error
        return Assignment()
    except Exception as error:
        return Assignment(failure=_describe_failure(batch, error))


def _describe_failure(batch: Batch | None, error: Exception) -> str:
    """Describe the error of a batch, with the name of the batch if it is known."""
    name = "" if batch is None else f"{batch.name}: "
    return f"{name}{type(error).__name__}: {error}"


def _report_case(keep: Callable, cases: list, index: int, result) -> None:
    """Pass the index of a case and its Result to the callback of the caller."""
    keep(cases[index], result)


def _solve_group(
    assignment: Assignment, models: Sequence[Model], run_singly: Callable, say: Callable | None
) -> CaseResults:
    """Compute the results of a group in its batch, or by single runs if the batch fails."""
    batch, _, failure = assignment
    if batch is not None:
        try:
            results = batch.solve(models, say)
            if batch.compile and batch_compile_seconds(batch, models[0]):
                compiled.record_run(_compiled_kind(batch, models[0]))
            return results
        except one_by_one.CASE_ERRORS:  # a single run of the case reports its error
            pass
        except Exception as error:
            failure = _describe_failure(batch, error)
    if failure and say is not None:
        say(
            f"{len(models)} cases are run one by one, because running them together failed: {failure}"
        )
    results = run_singly(models)
    if failure:
        for case in range(len(models)):
            results.notes[case] = [*results.notes.get(case, ()), f"{BATCH_FAILED} ({failure})"]
    return results
