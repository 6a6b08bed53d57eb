"""Batch of patches that slip in part, with one mode under a sine, marched in lanes.

In: models of a group. Out: `CaseResults`. Under a constant load such a patch is a set of
Jenkins elements, whose force follows from one curve by Masing's rule. The curves of each case
and of its coarser mesh are marched as tables (`lanes.solve_and_check`). Cases that lanes cannot finish
go to `sheared`.
"""

from collections.abc import Sequence

import numpy as np

from ....compiled import load
from ....dynamics.lanes import run as march
from ....model.model import Model
from .. import one_by_one
from ..case_results import CaseResults
from . import lanes, sheared

MAX_CASES_PER_CALL = 512  # cases of one compiled call, whose tables are in memory together


def refuses(model: Model) -> str:
    """Return why lanes do not take a model; "" if they do."""
    return sheared.refuses(model) or lanes.asks_more(model)


def group(model: Model) -> tuple:
    """Return a key that is equal for models of one compiled call."""
    return sheared.group(model)


def solve(models: Sequence[Model], say=None) -> CaseResults:
    """Return the case results of models of one group."""
    return sheared.solve_cases(models, say, move_cases, MAX_CASES_PER_CALL)


def move_cases(models, held: list, say) -> tuple:
    """Return the results of pressed cases, and which (n,) must be run by themselves.

    Parameters
    ----------
    models : sequence of Model
    held : list of PressedCase
    say : callable or None
        Callback for a line of text.
    """
    sets = [[one.groups[0] for one in (pressed.fine, pressed.coarse)] for pressed in held]
    rates = [
        lanes.fastest_rate(model, fine.stiffness.sum()) for model, (fine, _) in zip(models, sets)
    ]
    steps = lanes.steps_at_rate(rates, lanes.OF_TABLE)
    most = load(f"{march.HERE}.table_curve_kernels").N_YIELDS - 1
    fit = (steps > 0) & [max(one.stiffness.size for one in pair) < most for pair in sets]
    found = CaseResults.blank(len(models))
    lost = np.zeros(len(models), bool)

    def exactly(places) -> CaseResults:
        """Return the results of some cases by the exact batch or by single runs."""
        answers, alone = sheared.move_cases(
            [models[k] for k in places], [held[k] for k in places], say
        )
        answers.place(
            np.flatnonzero(alone),
            one_by_one.solve([models[places[k]] for k in np.flatnonzero(alone)], say),
        )
        return answers

    if rest := np.flatnonzero(~fit).tolist():
        found.place(rest, exactly(rest))
    if here := np.flatnonzero(fit).tolist():
        these = [models[k] for k in here]
        cases = [
            lanes.make_cases(
                these, _contacts([sets[k][mesh] for k in here], [held[k] for k in here])
            )
            for mesh in range(2)
        ]
        answers, exact, reach = lanes.solve_and_check(
            these,
            (*cases[0], cases[1]),
            steps[here],
            lambda places, _: exactly([here[k] for k in places]),
        )
        for place in np.flatnonzero(~exact).tolist():
            case = here[place]
            answers.numerics[place] = answers.numerics[place] | {
                "elements": int(sets[case][0].stiffness.size),
                "interface_nodes": int(held[case].patch.x.size),
            }
            sheared.add_patch_results(answers, place, models[case], held[case], reach[place])
        found.place(here, answers)
    return found, lost


def _contacts(sets: list, held: list) -> np.ndarray:
    """Return the numbers (m, n) of the contacts of patches, as `lanes.make_cases` takes them."""
    rows = [
        (
            one.limit,
            one.limit,
            pressed.patch.pressure.load,
            one.stiffness.sum(),
            one.yield_displacement[-1],
        )
        for one, pressed in zip(sets, held)
    ]
    tables = march.curve_tables([(one.stiffness, one.yield_displacement) for one in sets])
    return np.column_stack([rows, tables]).T
