"""Check of the cases that march in lanes: a few are compared with the exact engine.

In: `LaneCases` of models, and a function that computes cases exactly. Out: `CheckedCases`. If a
case differs, more are checked; if more than a few differ, all are computed exactly, else those
that differ.
"""

from collections.abc import Callable, Sequence
from time import perf_counter
from typing import NamedTuple
from zlib import crc32

import numpy as np

from ....dynamics.lanes import run as march
from ....model.model import Model
from ....model.similar_models import select_models
from ..case_results import CaseResults
from .columns import PHASE_MEASURE
from .lane_numbers import LaneCases, find_lane_law, select_rows
from .lane_refinement import march_side_by_side
from .lane_steps import STRETCH_STEPS

CHECK_INTERVAL = 200  # number of cases per case that is checked with the exact engine
MIN_CHECKED = 2  # smallest number of checked cases of a batch
N_MORE_CHECKED = 70  # number of further cases that are checked if a checked case differs
# Fraction of differing checked cases, above which all are computed exactly.
MAX_WRONG_FRACTION = 0.03
# Factor on the errors of a single run of the Iwan law in a check: 1 of 590 random cases differed by more
# than its error, by 1.9 times as much.
IWAN_ERROR_FACTOR = 2.0


class CheckedCases(NamedTuple):
    """Results of n cases from a vectorized march, some of them compared with the exact engine.

    - results: CaseResults.
    - is_exact: which cases (n,) were not computed by lanes.
    - reach: largest output (n,) [m].
    """

    results: CaseResults
    is_exact: np.ndarray
    reach: np.ndarray


def solve_and_check(
    models: Sequence[Model], cases: LaneCases, steps, solve_exactly: Callable
) -> CheckedCases:
    """Compute cases by a vectorized march, and compare some of them with the exact engine.

    If checked cases differ, those of a stretch law are marched with twice the steps, and more cases are
    checked; if more than a few still differ, all cases are computed exactly.

    Parameters
    ----------
    models : sequence of Model
    cases : LaneCases
    steps : (n,)
        Steps per cycle.
    solve_exactly : callable
        Function (indices, is_check) that returns the exact results of some cases.
    """
    begin = perf_counter()
    law = find_lane_law(models[0])
    results, is_exact, steps, reach = march_side_by_side(models, cases, steps)
    results.seconds[:] = (perf_counter() - begin) / len(models)
    numbers = np.column_stack(cases.cases)
    factor = IWAN_ERROR_FACTOR if law == "masing" else 1.0
    checked = select_checked_cases(numbers, ~is_exact)
    exact_results = solve_exactly(checked, True) if checked else None
    wrong = _find_differences(results, exact_results, checked, is_exact, factor)
    finer = np.flatnonzero(~is_exact & (2 * steps <= STRETCH_STEPS[-1]))
    if wrong and finer.size and march.has_one_stretch(law):
        refined = march_side_by_side(
            select_models(models, finer), select_rows(cases, finer), 2 * steps[finer]
        )
        is_exact[finer] = refined.is_exact
        results.remove(finer)
        results.insert(finer, refined.results)
        wrong = _find_differences(results, exact_results, checked, is_exact, factor)
    if wrong:  # more checked cases show whether the differing ones are exceptions
        is_free = ~is_exact
        is_free[checked] = False
        more = select_checked_cases(numbers, is_free, N_MORE_CHECKED)
        exact_results = solve_exactly(more, True) if more else None
        wrong |= _find_differences(results, exact_results, more, is_exact, factor)
        checked = [*checked, *more]
    all_exact = len(wrong) > MAX_WRONG_FRACTION * len(checked)
    is_exact[list(wrong)] = True
    is_exact |= all_exact
    exact_cases = np.flatnonzero(is_exact).tolist()
    if exact_cases:
        results.remove(exact_cases)
        results.insert(exact_cases, solve_exactly(exact_cases, False))
    counts = (
        f"in {len(checked)} cases the fast engine was checked against the exact engine and differed "
        f"from it in {len(wrong)}, in "
    )
    if all_exact:
        example = next(iter(wrong.values()))
        sentence = f"{example} for example, so all cases were computed by the exact engine"
        sentences = dict.fromkeys(exact_cases, sentence)
    else:
        sentences = {
            case: f"{name} of this case, so this case was computed by the exact engine"
            for case, name in wrong.items()
        }
    for case, sentence in sentences.items():
        results.notes[case] = [*results.notes.get(case, ()), counts + sentence]
    return CheckedCases(results, is_exact, reach)


def select_checked_cases(numbers, is_free, min_count: int = MIN_CHECKED) -> list:
    """Select by a hash of their numbers the cases that are compared with the exact engine.

    The hash makes the choice of a case independent of other cases.

    Parameters
    ----------
    numbers : (n, k)
        Numbers that identify each case.
    is_free : (n,) of bool
        Cases that may be checked.
    min_count : int
        Smallest number of cases, if there are so many.
    """
    hashes = np.array([crc32(row.tobytes()) for row in numbers])
    order = [case for case in np.argsort(hashes, kind="stable").tolist() if is_free[case]]
    count = sum(hashes[case] < 2**32 // CHECK_INTERVAL for case in order)
    return order[: max(count, min_count)]


def _find_differences(
    results: CaseResults, exact_results: CaseResults | None, checked: list, is_exact, factor: float
) -> dict[int, str]:
    """Return for each differing case the first measure that deviates from the exact engine.

    A measure differs if the difference exceeds the sum of both errors and the floor.

    Parameters
    ----------
    results : CaseResults
    exact_results : CaseResults or None
        Exact results of some cases.
    checked : list
        Indices of these cases.
    is_exact : (n,) of bool
        Cases that lanes did not compute.
    factor : float
        Factor on the exact errors.
    """
    wrong: dict[int, str] = {}
    for index, case in enumerate(checked):
        for name, values in results.values.items():
            if is_exact[case] or name not in exact_results.values:
                continue
            if not exact_results.has(name, index):
                continue
            change = abs(values[case] - exact_results.values[name][index])
            if name == PHASE_MEASURE:
                change = min(change, np.pi - change)
            error, exact_error = np.nan_to_num(
                [results.errors[name][case], exact_results.errors[name][index]]
            )
            if change > error + factor * exact_error + results.floors[name][case]:
                wrong.setdefault(case, name)
    return wrong
