"""Answers of many models: each goes, with those that share its work, to the first batch that does not refuse it."""

from __future__ import annotations

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
    """A way to answer many models together.

    refuses(model) -> "" or the sentence why not; group(model): equal for models that can share work; solve(models,
    say) -> Answers of a group, equal to single runs to 1e-12, bars too, whatever else is in the group; share: seconds
    of a case over those of its own run, 0 where they are next to nothing; compile: CPU seconds of the first group;
    least: fewest cases of a study that it serves: such a batch gives answers with bars of their own, each the same
    whatever else is in the group; parts(models) -> {group: places} of those that it takes, where it reads columns;
    together: fewest cases of a chunk of a sweep, where what they share is worth so many.
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
    """The batch of the module of this name, which takes models of this kind and is imported for the first of them."""

    @cache
    def module():
        return import_module(f"patchfem.runs.batch.{name}")

    def of(function: str) -> Callable:
        return lambda *given: getattr(module(), function)(*given)

    def parts(models: Sequence) -> dict:
        some_of = [models.first] if isinstance(models, SimilarModels) else models
        if not any(getattr(one, "kind", "") == kind for one in some_of) or _of_single_runs(kind):
            return {}
        return module().parts(models)

    def refuses(model: Model) -> str:
        return (
            _of_single_runs(kind) or asked(model) if model.kind == kind else f"it is a {model.kind}"
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
def _of_single_runs(kind: str) -> str:
    """Return why no batch takes cases of a kind: it lacks a measure of single runs; "" if there is no such measure."""
    rows = import_module("patchfem.response.rows").SINGLE_RUN_ROWS if kind == "rig" else ()
    return f"the measure {rows[0].name} is computed only by single runs" if rows else ""


# the first that does not refuse a model takes it
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
    """CPU seconds in which a batch compiles for a model like this; 0 where one like it has been answered."""
    if batch.compile:
        return 0.0 if compiled.has_run(_kind(batch, model)) else batch.compile
    return 0.0


def _kind(batch: Batch, model: Model) -> str:
    """What the compiled code of a batch hangs on, in words."""
    rig = model.rig
    if rig is None:
        return batch.name
    laws = [one.numbers.law for one in rig.friction.interfaces]
    return " ".join([batch.name, rig.drive.waveform.name, *laws, str(bool(model.partial_slip))])


def batch_of(model: Model, study: int = 1) -> Batch | None:
    """The batch that takes a model of a study of so many cases; None where it is run by itself."""
    return next((one for one in BATCHES if study >= one.least and not one.refuses(model)), None)


def answers(
    models: Sequence[Model | PatchfemError],
    keep: Callable | None = None,
    say: Callable | None = None,
    estimate: bool = True,
    study: int = 0,
) -> CaseResults:
    """Answers of the models in their order; an error in place of a model is the message of its failed case.

    keep(case, Result): called after each run; a batch has no Result, so all cases then run one by one. say: called with
    one line when compiled code has to be made; estimate: False leaves out the coarser runs of all models, and their
    errors, where they run one by one (a batch has its errors from the same work); study: cases of the whole that these
    are a part of, 0 where they are all of it.
    """
    models = models if isinstance(models, SimilarModels) else [_freed(one) for one in models]
    found, groups = CaseResults.blank(len(models)), {}
    left, study = np.arange(len(models)), study or len(models)
    if keep is None:
        left, groups = _by_columns(models, study)
    for case in left.tolist():
        model = models[case]
        if isinstance(model, PatchfemError):
            found.fail(case, str(model))
            continue
        groups.setdefault(_place(model, study) if keep is None else (None, None), []).append(case)
    for (batch, _), cases in groups.items():
        found.place(
            cases,
            _solved(
                batch,
                select_models(models, cases),
                partial(one_by_one.solve, keep=_of(keep, cases), estimate=estimate),
                say,
            ),
        )
    return found


def _freed(model: Model | PatchfemError) -> Model | PatchfemError:
    """A model whose modes are those without the joint, or why there is none."""
    if (
        isinstance(model, PatchfemError)
        or model.rig is None
        or model.rig.structure.without_joint is None
    ):
        return model
    try:
        return joint.freed(model)
    except PatchfemError as error:
        return error


def _by_columns(models: Sequence, study: int) -> tuple[np.ndarray, dict]:
    """(places of the models that no batch takes as columns, {(batch, group): places} of those that one does)."""
    out, left = {}, np.arange(len(models))
    for batch in BATCHES:
        if batch.parts is None or study < batch.least or not left.size:
            continue
        try:
            parts = batch.parts(select_models(models, left))
        except Exception:  # what is odd about a model is told by its own run
            continue
        out |= {(batch, group): left[np.asarray(cases)].tolist() for group, cases in parts.items()}
        left = np.setdiff1d(
            left, [case for cases in parts.values() for case in left[np.asarray(cases)].tolist()]
        )
    return left, out


def _place(model: Model, study: int) -> tuple:
    """(batch, group) of a model; (None, None) where it is run by itself."""
    try:
        batch = batch_of(model, study)
        return (batch, batch.group(model)) if batch is not None else (None, None)
    except Exception:  # what is odd about the model is told by its own run
        return None, None


def _of(keep: Callable | None, cases: list) -> Callable | None:
    """`keep` of a part of the cases, by their places in it."""
    return keep and (lambda case, result: keep(cases[case], result))


def _solved(
    batch: Batch | None, models: list, alone: Callable, say: Callable | None
) -> CaseResults:
    if batch is not None:
        try:
            out = batch.solve(models, say)
            if batch.compile and batch_compile_seconds(batch, models[0]):
                compiled.ran(_kind(batch, models[0]))
            return out
        except Exception as error:  # the case at fault is named by its own run
            if say is not None:
                say(
                    f"{len(models)} cases are run one by one, because running them together failed: {batch.name}: "
                    f"{type(error).__name__}: {error}"
                )
    return alone(models, say)
