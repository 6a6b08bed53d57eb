"""Batch of lumped cases with one friction law, integrated in parallel lanes of a kernel.

In: models of a group. Out: `CaseResults`. Errors are estimated from a march with half the steps.

- Parameters and steps (`lane_numbers`, `lane_steps`): each case is made dimensionless with its
  drive. The number of steps per cycle follows from its fastest rate.
- Refinement (`lane_refinement`): if an error of a case with a stretch law (tanh, Bouc-Wen, LuGre,
  bonds of constant length) exceeds the tolerance, a march with a quarter of the steps shows the
  order of convergence. If the error is still too large, the number of steps is doubled.
- Settling (`lane_settling`): a case of the Iwan or the elastic-plastic law that has not reached its
  steady state is continued.
- Ringing (`lane_ringing`) in permanent stick is computed in closed form for a single spring, else
  by a fit.
- Exact engine: a case is computed by the event-driven batch `lumped`, or with a stretch law by a
  single run, if an error still exceeds the tolerance, if it may ring in shorter stick intervals, or
  if its motion grows.
- Check (`lane_check`): a few cases are compared with the exact engine; with a stretch law, also
  after doubling the steps.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from ....effects import law_has_trait, needs_bond_list
from ....model.model import Model
from ....model.similar_models import SimilarModels, collect_columns, select_models
from ....scene.rules.accuracy import list_fixed_settings
from ...rig.motion_warnings import note_on_creep
from .. import one_by_one
from ..case_results import CaseResults, solve_in_parts
from . import lumped
from .lane_check import solve_and_check
from .lane_numbers import LANE_LAWS, LaneCases, make_cases
from .lane_settling import MIN_TOLERANCE
from .lane_steps import steps_per_cycle
from .pieces import MAX_CYCLES, MIN_CYCLES

MAX_CASES_PER_CALL = 4096  # largest number of cases in one compiled call
N_FINER_CELLS = 2  # number of doublings of the cells of the Iwan law in a check


def refusal_reason(model: Model) -> str:
    """Return why a model cannot be integrated in lanes, or ""."""
    if why := reason_not_in_lanes(model):
        return why
    if not steps_per_cycle([model])[0]:
        return "its free vibration is too fast for the time steps of its drive"
    return ""


def reason_not_in_lanes(model: Model) -> str:
    """Return why the options of a model exclude the lanes, or ""."""
    friction = model.friction
    if why := lumped.reason_not_single_point(model):
        return why
    if not MIN_CYCLES <= model.rig.drive.cycles <= MAX_CYCLES or not friction.static > 0:
        return "its cycles are too few or too many, or it has no friction"
    if friction.law not in LANE_LAWS:
        return "its law cannot be computed for many cases at once"
    if law_has_trait(friction.law, "bonds") and (
        needs_bond_list(friction) or friction.slip_growth is not None
    ):
        return "its bonds grow, or are computed as a list of bonds"
    return reason_in_accuracy_settings(model)


def reason_in_accuracy_settings(model: Model) -> str:
    """Return why the accuracy settings of a model exclude the lanes, or ""."""
    if (
        model.accuracy.method != "auto"
        or list_fixed_settings(model.accuracy)
        or model.accuracy.tolerance < MIN_TOLERANCE
    ):
        return "the case asks for another method, or for an accuracy beyond that of a batch"
    return ""


def group_key(model: Model) -> tuple:
    """Return a hashable key; models with equal keys can be computed in one kernel call."""
    return int(model.rig.drive.cycles), model.friction.law


def group_models(models: Sequence) -> dict[tuple, list]:
    """Return the indices of the models that can be integrated in lanes, by group key."""
    groups: dict = {}
    if isinstance(models, SimilarModels):
        if not reason_not_in_lanes(models.first):
            groups[group_key(models.first)] = range(len(models))
    else:
        for case, model in enumerate(models):
            if isinstance(model, Model) and not reason_not_in_lanes(model):
                groups.setdefault(group_key(model), []).append(case)
    groups_with_steps = {}
    for key, cases in groups.items():
        steps = steps_per_cycle(select_models(models, cases))
        if steps.any():
            groups_with_steps[key] = np.array(cases)[steps > 0].tolist()
    return groups_with_steps


def solve(models: Sequence[Model], report=None) -> CaseResults:
    """Compute the case results of a group of models in lanes."""
    return solve_in_parts(models, MAX_CASES_PER_CALL, partial(_solve_cases, report=report))


def _solve_cases(models: Sequence[Model], report) -> CaseResults:
    """Compute the case results of models in one call of the lane kernel."""
    checked = solve_and_check(
        models,
        LaneCases(*make_cases(models)),
        steps_per_cycle(models),
        partial(_solve_exactly, models, report),
    )
    results = checked.results
    lane_cases = np.flatnonzero(~checked.is_exact)
    if models[0].friction.law == "tanh":
        reference_speeds = collect_columns(models, lambda model: (model.friction.reference_speed,))[
            0
        ]
        friction = models[0].friction
        notes = {}
        for case in lane_cases.tolist():
            reference_speed = float(reference_speeds[case])
            if reference_speed not in notes:
                law = friction.model_copy(update={"reference_speed": reference_speed})
                notes[reference_speed] = note_on_creep(law)
            results.notes[case] = [*notes[reference_speed]]
    return results


def _solve_exactly(models: Sequence[Model], report, indices: list, is_check: bool) -> CaseResults:
    """Compute selected cases by the event-driven batch if possible, else by single runs."""
    some_models = list(select_models(models, indices))
    is_check = is_check and models[0].friction.law == "iwan"
    results = CaseResults.blank(len(some_models))
    is_event_driven = np.array([not lumped.refusal_reason(model) for model in some_models])
    if is_event_driven.any():
        cases = np.flatnonzero(is_event_driven)
        n_finer = N_FINER_CELLS if is_check else 0
        results.insert(cases, lumped.solve(select_models(some_models, cases), report, n_finer))
    one_by_one.replace_by_single_runs(results, some_models, ~is_event_driven, report)
    return results
