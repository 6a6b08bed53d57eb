"""Cases run one after the other, as single runs: the reference of all batches.

In: models. Out: `CaseResults`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter

import numpy as np

from ...core import PatchfemError
from ...model.model import Model
from ...model.similar_models import select_models
from ..plan import plan
from ..results.result import collect_used_settings
from ..run import run
from .case_results import CaseResults

CASE_ERRORS = (PatchfemError, MemoryError)  # errors of a case, as opposed to faults of the program
NO_MEMORY_MESSAGE = "not enough memory; make contact.element_size larger, or make the run shorter"


def solve(
    models: Sequence[Model],
    say: Callable | None = None,
    keep: Callable | None = None,
    estimate: bool = True,
) -> CaseResults:
    """Compute case results by single runs, one after the other.

    An error of one case becomes its message and does not stop the others.

    Parameters
    ----------
    models : sequence of Model
    say : callable, optional
        Callback for a line of text.
    keep : callable, optional
        Called with case and Result after each run.
    estimate : bool
        If False, coarse runs and errors are omitted.
    """
    results = CaseResults.blank(len(models))
    for case, model in enumerate(models):
        begin = perf_counter()
        try:
            result = run(plan(model), say, estimate=estimate)
            if keep is not None:
                keep(case, result)
        except CASE_ERRORS as error:
            results.fail(case, str(error) or NO_MEMORY_MESSAGE)
        # a fault of the program in one case must not lose the results of a thousand others
        except Exception as error:
            results.fail(case, f"internal fault, please report it: {type(error).__name__}: {error}")
        else:
            results.put(case, result.outcome, result.measures, 0.0)
            results.numerics[case] = collect_used_settings(result)
            if result.warnings:
                results.warnings[case] = list(result.warnings)
            if notes := result.extra.get("notes"):
                results.notes[case] = list(notes)
        results.seconds[case] = perf_counter() - begin
    return results


def solve_singly(
    results: CaseResults, models: Sequence[Model], cases: np.ndarray, say: Callable | None = None
) -> None:
    """Replace the results of some cases of a batch by those of single runs.

    Parameters
    ----------
    results : CaseResults
        Results of the models, which are changed.
    models : sequence of Model
    cases : (n,) of bool
        Cases that are run singly.
    say : callable, optional
        Callback for a line of text.
    """
    indices = np.flatnonzero(cases)
    if indices.size:
        results.remove(indices.tolist())
        results.insert(indices, solve(select_models(models, indices), say))
