"""Computation of cases one after the other by single runs, the reference for all batches.

In: models. Out: `CaseResults`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import process_time

import numpy as np

from ...core import Outcome, PatchfemError
from ...model.model import Model
from ...model.similar_models import select_models
from ..plan import plan
from ..results.result import collect_used_settings
from ..run import run
from .case_results import CaseResults

# Errors that a case causes, and not a fault of the program.
FAILED_CASE_ERRORS = (PatchfemError, MemoryError)
NO_MEMORY_MESSAGE = "not enough memory; make contact.element_size larger, or make the run shorter"


def solve(
    models: Sequence[Model | PatchfemError],
    report: Callable | None = None,
    on_result: Callable | None = None,
) -> CaseResults:
    """Compute the case results of models by single runs, one after the other.

    An error of one case is stored as its message and does not stop the other cases.

    Parameters
    ----------
    models : sequence of Model or PatchfemError
        Models in the order of the results, or errors in place of models that could not be built.
    report : callable, optional
        Callback for progress messages.
    on_result : callable, optional
        Called with the case index and the Result after each run.
    """
    results = CaseResults.blank(len(models))
    for case, model in enumerate(models):
        begin = process_time()
        try:
            if isinstance(model, PatchfemError):
                raise model
            case_plan = replace(plan(model), draws_curve=on_result is not None)
            result = run(case_plan, report, tells_passes=False)
            if on_result is not None:
                on_result(case, result)
        except FAILED_CASE_ERRORS as error:
            results.fail(case, str(error) or NO_MEMORY_MESSAGE)
        # An unexpected exception in one case must not discard the results of the other cases.
        except Exception as error:
            results.fail(case, f"internal fault, please report it: {type(error).__name__}: {error}")
        else:
            results.put(case, result.outcome, result.measures, 0.0)
            results.numerics[case] = collect_used_settings(result)

            # The warnings of a run that found no motion are all that it found
            findings = [finding.sentence for finding in result.findings]
            if result.outcome is Outcome.NOT_CONVERGED:
                findings = result.warnings
            if findings:
                results.findings[case] = " ".join(findings)
            if result.warnings:
                results.warnings[case] = list(result.warnings)
            if result.notes:
                results.notes[case] = list(result.notes)
        results.seconds[case] = process_time() - begin
    return results


def replace_by_single_runs(
    results: CaseResults, models: Sequence[Model], cases: np.ndarray, report: Callable | None = None
) -> None:
    """Replace the results of selected cases by those of single runs.

    Parameters
    ----------
    results : CaseResults
        Results of all models; changed in place.
    models : sequence of Model
        All models, in the order of the results.
    cases : (n,) of bool
        Mask of the cases to be replaced.
    report : callable, optional
        Callback for progress messages.
    """
    indices = np.flatnonzero(cases)
    if indices.size:
        results.insert(indices, solve(select_models(models, indices), report))
