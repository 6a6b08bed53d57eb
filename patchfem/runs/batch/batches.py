"""Case results of many models, each computed by the first batch that does not refuse it.

In: a sequence of models. Out: `CaseResults`. Models that can share work are computed together,
in groups.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Sequence
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


class Batch(NamedTuple):
    """Method that computes many models together.

    - name: name of its module.
    - refuses: function (model) -> "" or a sentence that says why it cannot compute the model.
    - group: function (model) -> key that is equal for models that can share work.
    - solve: function (models, say) -> CaseResults of a group, equal to those of single runs to
      1e-12, errors included, whatever else is in the group.
    - share: seconds of a case over those of a single run; 0 if negligible.
    - compile: CPU seconds of compiling for the first group.
    - least: smallest number of cases of a study that it takes; such a batch has its own error
      estimates, which do not depend on what else is in the group.
    - parts: function (models) -> {group: indices} of those that it takes, if it reads columns; else
      None.
    - together: smallest number of cases in a chunk of a sweep for which the shared work pays.
    """

    name: str
    refuses: Callable[[Model], str]
    group: Callable[[Model], Hashable]
    solve: Callable[..., CaseResults]
    share: float = 0.0
    compile: float = 0.0
    least: int = 0
    parts: Callable | None = None
    together: int = 1


def _batch(
    name: str,
    kind: str,
    share: float = 0.0,
    compile: float = 0.0,
    least: int = 0,
    columns: bool = False,
    together: int = 1,
) -> Batch:
    """Return the Batch of a module of this folder, which is imported when first needed.

    name: name of the module.

    kind: kind of the models that it takes; the other parameters are fields of `Batch`.
    """

    @cache
    def module():
        """Import and return the module of the batch."""
        return import_module(f"patchfem.runs.batch.{name}")

    def of(function: str) -> Callable:
        """Return a function that calls the function of this name in the module."""
        return lambda *given: getattr(module(), function)(*given)

    def parts(models: Sequence) -> dict:
        """Return {group: indices} of the models whose numbers the batch reads as columns."""
        some_of = [models.first] if isinstance(models, SimilarModels) else models
        if not any(getattr(one, "kind", "") == kind for one in some_of) or _why_run_singly(kind):
            return {}
        return module().parts(models)

    def refuses(model: Model) -> str:
        """Return why the batch does not take a model; "" if it does."""
        return (
            _why_run_singly(kind) or asked(model) if model.kind == kind else f"it is a {model.kind}"
        )

    asked = of("refuses")
    return Batch(
        name,
        refuses,
        of("group"),
        of("solve"),
        share,
        compile,
        least,
        parts if columns else None,
        together,
    )


@cache
def _why_run_singly(kind: str) -> str:
    """Return why no batch takes cases of a kind, or "".

    A measure that only single runs compute excludes all batches.
    """
    rows = import_module("patchfem.response.rows").SINGLE_RUN_ROWS if kind == "rig" else ()
    return f"the measure {rows[0].name} is computed only by single runs" if rows else ""


# the first batch that does not refuse a model takes it
BATCHES: tuple[Batch, ...] = (
    _batch("patches", "patch", compile=6.0, columns=True, together=2048),
    _batch("benches", "bench", 0.4, together=64),
    _batch("lumped.lanes", "rig", compile=6.0, least=64, columns=True, together=1024),
    _batch("lumped.lumped", "rig", compile=12.0),
    _batch("lumped.tabled", "rig", 0.2, 18.0, least=64, together=512),
    _batch("lumped.sheared", "rig", 0.4, 12.0, together=64),
    _batch("gathered", "rig", 0.05, 10.0, least=32, together=128),
)


def batch_compile_seconds(batch: Batch, model: Model) -> float:
    """Return the CPU seconds of compiling for a model; 0 if one of its kind has been computed."""
    if batch.compile:
        return 0.0 if compiled.has_run(_kind(batch, model)) else batch.compile
    return 0.0


def _kind(batch: Batch, model: Model) -> str:
    """Return the properties on which the compiled code of a batch depends, as text."""
    rig = model.rig
    if rig is None:
        return batch.name
    laws = [interface.numbers.law for interface in rig.friction.interfaces]
    return " ".join([batch.name, rig.drive.waveform.name, *laws, str(bool(model.partial_slip))])


def choose_batch(model: Model, study: int = 1) -> Batch | None:
    """Return the batch of a model in a study of `study` cases; None if it is run by itself."""
    return next((one for one in BATCHES if study >= one.least and not one.refuses(model)), None)


def solve_models(
    models: Sequence[Model | PatchfemError],
    keep: Callable | None = None,
    say: Callable | None = None,
    estimate: bool = True,
    study: int = 0,
) -> CaseResults:
    """Return the case results of models in their order.

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
    models = (
        models
        if isinstance(models, SimilarModels)
        else [_model_without_joint(one) for one in models]
    )
    found = CaseResults.blank(len(models))
    groups = {}
    failures = Counter()
    left = np.arange(len(models))
    study = study or len(models)
    if keep is None:
        left, groups = _by_columns(models, study)
    for case in left.tolist():
        model = models[case]
        if isinstance(model, PatchfemError):
            found.fail(case, str(model))
            continue
        place = _place(model, study) if keep is None else NO_BATCH
        groups.setdefault(place[:2], []).append(case)
        if place.failure:
            failures[place.failure] += 1
    for failure, count in failures.items():
        _say_failure(say, count, failure)
    for (batch, _), cases in groups.items():
        found.place(
            cases,
            _solve_cases(
                batch,
                select_models(models, cases),
                partial(one_by_one.solve, keep=_with_case_indices(keep, cases), estimate=estimate),
                say,
            ),
        )
    return found


def _model_without_joint(model: Model | PatchfemError) -> Model | PatchfemError:
    """Return a model whose modes do not contain the joint, or the error that there are none."""
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


def _by_columns(models: Sequence, study: int) -> tuple[np.ndarray, dict]:
    """Divide models by the batch that reads their numbers as columns.

    Return the indices of models that no batch reads as columns, and those of all others in a dict
    by batch and group.
    """
    out = {}
    left = np.arange(len(models))
    for batch in BATCHES:
        if batch.parts is None or study < batch.least or not left.size:
            continue
        try:
            parts = batch.parts(select_models(models, left))
        except Exception:  # the model is run again by itself, which reports its error
            continue
        out |= {(batch, group): left[np.asarray(cases)].tolist() for group, cases in parts.items()}
        left = np.setdiff1d(
            left, [case for cases in parts.values() for case in left[np.asarray(cases)].tolist()]
        )
    return left, out


class Place(NamedTuple):
    """Batch and group of a model.

    - batch, group: None if the model is run by itself.
    - failure: batch and error, if the search for the group failed; else "".
    """

    batch: Batch | None
    group: Hashable
    failure: str = ""


NO_BATCH = Place(None, None)


def _place(model: Model, study: int) -> Place:
    """Return the batch and the group of a model in a study of `study` cases."""
    batch = None
    try:
        batch = choose_batch(model, study)
        return NO_BATCH if batch is None else Place(batch, batch.group(model))
    except Exception as error:  # the model is run again by itself, which reports its error
        return NO_BATCH._replace(failure=_describe_failure(batch, error))


def _describe_failure(batch: Batch | None, error: Exception) -> str:
    """Return the name of a batch, if it is known, and the error that it raised."""
    name = "" if batch is None else f"{batch.name}: "
    return f"{name}{type(error).__name__}: {error}"


def _say_failure(say: Callable | None, count: int, failure: str) -> None:
    """Say that cases are run one by one, with the batch and the error that caused this."""
    if say is not None:
        say(f"{count} cases are run one by one, because running them together failed: {failure}")


def _with_case_indices(keep: Callable | None, cases: list) -> Callable | None:
    """Return a callback that calls `keep` with an index in all cases instead of one in `cases`."""
    return keep and (lambda case, result: keep(cases[case], result))


def _solve_cases(
    batch: Batch | None, models: list, alone: Callable, say: Callable | None
) -> CaseResults:
    """Return the results of a group by its batch, or one by one if the batch fails."""
    if batch is not None:
        try:
            out = batch.solve(models, say)
            if batch.compile and batch_compile_seconds(batch, models[0]):
                compiled.record_run(_kind(batch, models[0]))
            return out
        except Exception as error:  # each case is run again by itself, which names the one at fault
            _say_failure(say, len(models), _describe_failure(batch, error))
    return alone(models, say)
