"""Cases run one after the other, as single runs: what every kind of model has, and what batches are held against."""

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
    """Answers of single runs of the models.

    keep(case, Result): called after each run; estimate: False leaves out the coarser runs and the errors. A
    PatchfemError of one case is its message, and so is any other fault: none stops the rest.
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
        ) as error:  # a defect of one case must not cost the answers of a thousand others
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
