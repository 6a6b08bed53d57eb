"""Batch of patches that slip in part, with one mode under a sine, marched in lanes.

In: models of a group. Out: `CaseResults`. Under a constant load such a patch is a set of
Jenkins elements, whose force follows from one curve by Masing's rule. The curves of each case
and of its coarser mesh are marched as tables (`lane_check.solve_and_check`). Cases that lanes
cannot finish go to `sheared`.
"""

from collections.abc import Sequence

import numpy as np

from ....compiled import load
from ....dynamics.lanes import run as march
from ....model.model import Model
from ...rig.engines import PIECES
from ...rig.event_driven import YieldingElements
from .. import one_by_one, pressed
from ..case_results import CaseResults
from . import lane_check, lane_numbers, lane_steps, lanes, sheared

# Largest number of cases in one compiled call, whose tables are in memory together.
MAX_CASES_PER_CALL = 512


def refuses(model: Model) -> str:
    """Return the reason why a patch with partial slip cannot be integrated in lanes, or ""."""
    return sheared.refuses(model) or lanes.needs_other_accuracy(model)


def group(model: Model) -> tuple:
    """Return a hashable key that is equal for models that one kernel call can compute."""
    return sheared.group(model)


def solve(models: Sequence[Model], say=None) -> CaseResults:
    """Compute the case results of a group of patches with partial slip by a vectorized march."""
    batch = pressed.PatchBatch(PIECES.name, YieldingElements, compute_motions, MAX_CASES_PER_CALL)
    return pressed.solve(models, batch, say)


def compute_motions(
    models: Sequence[Model], pressed_cases: list, say=None
) -> tuple[CaseResults, np.ndarray]:
    """Compute the motions of solved patches in lanes, and find cases that need a single run.

    Parameters
    ----------
    models, pressed_cases, say
        See `sheared.compute_motions`.
    """
    fine = [case.fine.groups[0] for case in pressed_cases]
    coarse = [case.coarse.groups[0] for case in pressed_cases]
    rates = [
        lane_steps.fastest_rate(model, elements.stiffness.sum())
        for model, elements in zip(models, fine)
    ]
    steps = lane_steps.select_steps_for_rates(rates, lane_steps.PATCH_STEPS)
    max_size = load(f"{march.LANES_PACKAGE}.rows_kernels").N_YIELDS - 1
    sizes = [max(a.stiffness.size, b.stiffness.size) for a, b in zip(fine, coarse)]
    fits = (steps > 0) & (np.array(sizes) < max_size)
    results = CaseResults.blank(len(models))

    def solve_exactly(cases: list, is_check: bool = False) -> CaseResults:
        """Compute some cases by the event-driven batch or by single runs."""
        some_models = [models[case] for case in cases]
        part, runs_singly = sheared.compute_motions(
            some_models, [pressed_cases[case] for case in cases], say
        )
        one_by_one.solve_singly(part, some_models, runs_singly, say)
        return part

    if exact_cases := np.flatnonzero(~fits).tolist():
        results.insert(exact_cases, solve_exactly(exact_cases))
    if lane_cases := np.flatnonzero(fits).tolist():
        lane_models = [models[case] for case in lane_cases]
        lane_pressed = [pressed_cases[case] for case in lane_cases]
        contacts = [
            _contact_numbers([elements[case] for case in lane_cases], lane_pressed)
            for elements in (fine, coarse)
        ]
        checked = lane_check.solve_and_check(
            lane_models,
            lane_numbers.LaneCases(
                *lane_numbers.make_cases(lane_models, contacts[0]),
                lane_numbers.make_cases(lane_models, contacts[1]),
            ),
            steps[lane_cases],
            lambda indices, is_check: solve_exactly([lane_cases[index] for index in indices]),
        )
        for index in np.flatnonzero(~checked.is_exact).tolist():
            numerics = checked.results.numerics[index]
            sizes = sheared.describe_sizes(lane_pressed[index])
            checked.results.numerics[index] = numerics | sizes
            sheared.add_patch_results(
                checked.results,
                index,
                lane_models[index],
                lane_pressed[index],
                checked.reach[index],
            )
        results.insert(lane_cases, checked.results)
    return results, np.zeros(len(models), bool)


def _contact_numbers(elements: list, pressed_cases: list) -> np.ndarray:
    """Return the contact parameters (m, n) of n patches with tables of their friction elements."""
    rows = [
        (
            group.limit,
            group.limit,
            case.patch.pressure.load,
            group.stiffness.sum(),
            group.yield_displacement[-1],
        )
        for group, case in zip(elements, pressed_cases)
    ]
    tables = march.make_curve_tables(
        [(group.stiffness, group.yield_displacement) for group in elements]
    )
    return np.column_stack([rows, tables]).T
