"""Cases run one after the other, as single runs: the reference of all batches.

In: models. Out: `CaseResults`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter

from ...core import PatchfemError
from ...model.model import Model
from ..plan import plan
from ..results.result import choices
from ..run import run
from .case_results import CaseResults


def solve(
    models: Sequence[Model],
    say: Callable | None = None,
    keep: Callable | None = None,
    estimate: bool = True,
) -> CaseResults:
    """Return the results of single runs of the models.

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
    found = CaseResults.blank(len(models))
    for case, model in enumerate(models):
        begin = perf_counter()
        try:
            result = run(plan(model), say, estimate=estimate)
            if keep is not None:
                keep(case, result)
        except (PatchfemError, MemoryError) as error:
            found.fail(
                case,
                str(error)
                or "not enough memory; make contact.element_size larger, or make the run shorter",
            )
        except (
            Exception
        ) as error:  # a defect of one case must not lose the results of a thousand others
            found.fail(case, f"internal fault, please report it: {type(error).__name__}: {error}")
        else:
            found.put(case, result.outcome, result.measures, 0.0)
            found.numerics[case] = choices(result)
            for kept, said in (
                (found.warnings, result.warnings),
                (found.notes, result.extra.get("notes")),
            ):
                if said:
                    kept[case] = list(said)
        found.seconds[case] = perf_counter() - begin
    return found
