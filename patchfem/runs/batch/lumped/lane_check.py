"""Comparison of some cases in lanes with the exact engine.

In: `LaneCases` of models, and a function that computes cases exactly. Out: `CheckedCases`. If a case
differs, more cases are checked. If only a few differ, these are computed exactly, else all.
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
from .lane_refinement import march_with_refinement
from .lane_steps import STRETCH_STEPS

CHECK_INTERVAL = 200  # mean number of cases per checked case
MIN_CHECKED = 2  # smallest number of checked cases in a batch
N_MORE_CHECKED = 70  # number of additional cases to check if a checked case differs
# Largest fraction of differing checked cases for which the other cases keep their results: stated errors are
# meant to hold in 19 of 20 cases.
MAX_WRONG_FRACTION = 0.05


class CheckedCases(NamedTuple):
    """Results of n cases in lanes, some of them compared with the exact engine.

    - results: CaseResults.
    - is_exact: mask (n,) of the cases that were computed by the exact engine.
    - reach: largest absolute output (n,) [m].
    """

    results: CaseResults
    is_exact: np.ndarray
    reach: np.ndarray


def solve_and_check(
    models: Sequence[Model], cases: LaneCases, steps, solve_exactly: Callable
) -> CheckedCases:
    """Compute cases in lanes, and compare some of them with the exact engine.

    If checked cases of a stretch law differ, all cases are integrated again with twice the steps. If
    cases still differ, more are checked. If more than MAX_WRONG_FRACTION of them differ, all cases are
    computed exactly.

    Parameters
    ----------
    models : sequence of Model
    cases : LaneCases
    steps : (n,)
        Steps per cycle.
    solve_exactly : callable
        Function (indices, is_check) that returns the exact results of selected cases.
    """
    begin = perf_counter()
    law = find_lane_law(models[0])
    results, is_exact, steps, reach = march_with_refinement(models, cases, steps)
    results.seconds[:] = (perf_counter() - begin) / len(models)
    numbers = np.column_stack(cases.cases)
    checked = select_checked_cases(numbers, ~is_exact)
    exact_results = solve_exactly(checked, True) if checked else None
    differing = _find_differences(results, exact_results, checked, is_exact)
    finer = np.flatnonzero(~is_exact & (2 * steps <= STRETCH_STEPS[-1]))
    if differing and finer.size and march.has_one_stretch(law):
        refined = march_with_refinement(
            select_models(models, finer), select_rows(cases, finer), 2 * steps[finer]
        )
        is_exact[finer] = refined.needs_exact
        results.remove(finer)
        results.insert(finer, refined.results)
        differing = _find_differences(results, exact_results, checked, is_exact)
    if differing:  # check more cases to see whether the differing ones are exceptions
        is_free = ~is_exact
        is_free[checked] = False
        more_checked = select_checked_cases(numbers, is_free, N_MORE_CHECKED)
        exact_results = solve_exactly(more_checked, True) if more_checked else None
        differing |= _find_differences(results, exact_results, more_checked, is_exact)
        checked = [*checked, *more_checked]
    all_exact = len(differing) > MAX_WRONG_FRACTION * len(checked)
    is_exact[list(differing)] = True
    is_exact |= all_exact
    exact_cases = np.flatnonzero(is_exact).tolist()
    if exact_cases:
        results.remove(exact_cases)
        results.insert(exact_cases, solve_exactly(exact_cases, False))
    counts = (
        f"in {len(checked)} cases the fast engine was checked against the exact engine and differed "
        f"from it in {len(differing)}, in "
    )
    if all_exact:
        example = next(iter(differing.values()))
        sentence = f"{example} for example, so all cases were computed by the exact engine"
        sentences = dict.fromkeys(exact_cases, sentence)
    else:
        consequence = "of this case, so this case was computed by the exact engine"
        sentences = {case: f"{measure} {consequence}" for case, measure in differing.items()}
    for case, sentence in sentences.items():
        results.notes[case] = [*results.notes.get(case, ()), counts + sentence]
    return CheckedCases(results, is_exact, reach)


def select_checked_cases(parameters, is_free, min_count: int = MIN_CHECKED) -> list:
    """Select the cases for the check by a hash of their parameters.

    With a hash, the choice of a case does not depend on the other cases.

    Parameters
    ----------
    parameters : (n, k)
        Parameters of the cases.
    is_free : (n,) of bool
        Mask of the cases that may be checked.
    min_count : int
        Smallest number of checked cases, if enough cases are free.
    """
    hashes = np.array([crc32(row.tobytes()) for row in parameters])
    order = [case for case in np.argsort(hashes, kind="stable").tolist() if is_free[case]]
    count = sum(hashes[case] < 2**32 // CHECK_INTERVAL for case in order)
    return order[: max(count, min_count)]


def _find_differences(
    results: CaseResults,
    exact_results: CaseResults | None,
    checked: list,
    is_exact,
) -> dict[int, str]:
    """Return the first deviating measure of each case that differs from the exact engine.

    A measure deviates if the difference exceeds the sum of both errors and the floor.

    Parameters
    ----------
    results : CaseResults
    exact_results : CaseResults or None
        Exact results of the checked cases.
    checked : list
        Indices of the checked cases.
    is_exact : (n,) of bool
        Mask of the cases that were not computed in lanes.
    """
    differing: dict[int, str] = {}
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
            if change > error + exact_error + results.floors[name][case]:
                differing.setdefault(case, name)
    return differing
