"""Batch of patches with partial slip and one mode, integrated in lanes with tabulated curves.

In: models of a group. Out: `CaseResults`. Under constant load, such a patch is a set of Jenkins
elements, whose force follows from its backbone curve by Masing's rules. The backbone curves on the
fine and the coarser mesh are tabulated (`lane_check.solve_and_check`). Cases that cannot be
completed in lanes are computed by `sheared`.
"""

from collections.abc import Sequence

import numpy as np

from ....compiled import load
from ....dynamics.lanes import run as march
from ....model.model import Model
from .. import one_by_one, solved_patches
from ..case_results import CaseResults
from . import lane_check, lane_numbers, lane_steps, lanes, sheared
from .case_engines import PIECES
from .event_driven import YieldingElements

# Largest number of cases in one compiled call, limited by the memory of the tables.
MAX_CASES_PER_CALL = 512


def refusal_reason(model: Model) -> str:
    """Return why a patch with partial slip cannot be integrated in lanes, or ""."""
    return sheared.refusal_reason(model) or lanes.reason_in_accuracy_settings(model)


def group_key(model: Model) -> tuple:
    """Return a hashable key; models with equal keys can be computed in one kernel call."""
    return sheared.group_key(model)


def solve(models: Sequence[Model], report=None) -> CaseResults:
    """Compute the case results of a group of patches with partial slip in lanes."""
    batch = solved_patches.PatchBatch(
        PIECES.name, YieldingElements, compute_motions, MAX_CASES_PER_CALL
    )
    return solved_patches.solve(models, batch, report)


def compute_motions(
    models: Sequence[Model], solved_cases: list, report=None
) -> tuple[CaseResults, np.ndarray]:
    """Compute the motions of solved cases in lanes; return the results and a mask of single runs.

    Parameters
    ----------
    models, solved_cases, report
        See `sheared.compute_motions`.
    """
    fine = [case.fine.groups[0] for case in solved_cases]
    coarse = [case.coarse.groups[0] for case in solved_cases]
    stiffnesses = [elements.stiffness.sum() for elements in fine]
    rates = list(map(lane_steps.relative_stick_rate, models, stiffnesses))
    steps = lane_steps.steps_for_rates(rates, lane_steps.PATCH_STEPS)
    max_size = load(f"{march.LANES_PACKAGE}.rows_kernels").N_YIELDS - 1
    sizes = [max(a.stiffness.size, b.stiffness.size) for a, b in zip(fine, coarse)]
    fits = (steps > 0) & (np.array(sizes) < max_size)
    results = CaseResults.blank(len(models))

    def solve_exactly(cases: list, is_check: bool = False) -> CaseResults:
        """Compute selected cases by the event-driven batch or by single runs."""
        some_models = [models[case] for case in cases]
        part, needs_single_run = sheared.compute_motions(
            some_models, [solved_cases[case] for case in cases], report
        )
        one_by_one.replace_by_single_runs(part, some_models, needs_single_run, report)
        return part

    if exact_cases := np.flatnonzero(~fits).tolist():
        results.insert(exact_cases, solve_exactly(exact_cases))
    if lane_cases := np.flatnonzero(fits).tolist():
        lane_models = [models[case] for case in lane_cases]
        lane_pressed = [solved_cases[case] for case in lane_cases]
        fine_contacts = _patch_contact_parameters([fine[case] for case in lane_cases], lane_pressed)
        coarse_contacts = _patch_contact_parameters(
            [coarse[case] for case in lane_cases], lane_pressed
        )
        checked = lane_check.solve_and_check(
            lane_models,
            lane_numbers.LaneCases(
                *lane_numbers.make_cases(lane_models, fine_contacts),
                lane_numbers.make_cases(lane_models, coarse_contacts),
            ),
            steps[lane_cases],
            lambda indices, is_check: solve_exactly([lane_cases[index] for index in indices]),
        )
        for index in np.flatnonzero(~checked.is_exact).tolist():
            numerics = checked.results.numerics[index]
            sizes = sheared.size_settings(lane_pressed[index])
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


def _patch_contact_parameters(element_groups: list, solved_cases: list) -> np.ndarray:
    """Return the contact parameters (m, n) of n patches, with tables of their backbone curves."""
    rows = []
    for elements, case in zip(element_groups, solved_cases):
        load = case.patch.pressure.load
        stiffness = elements.stiffness.sum()
        last_yield = elements.yield_displacement[-1]
        rows.append((elements.limit, elements.limit, load, stiffness, last_yield))
    tables = march.make_curve_tables(
        [(elements.stiffness, elements.yield_displacement) for elements in element_groups]
    )
    return np.column_stack([rows, tables]).T
