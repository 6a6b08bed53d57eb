"""Batch of lanes: lumped cases of one friction law marched side by side.

In: models of a group. Out: `CaseResults`. The errors come from a march with half the steps.

- Numbers and steps (`lane_numbers`, `lane_steps`): a case is a few numbers in units of its drive,
  and marches with the steps that its fastest rate needs.
- Refinement (`lane_refinement`): if an error of a case with a stretch law (tanh, Bouc-Wen, LuGre,
  bonds of constant length) misses the tolerance, a quarter of the steps is marched too, which
  shows how its errors fall. If errors still miss it, the case is marched with twice the steps,
  and its previous march serves the error.
- Settling (`lane_settling`): a case of the Iwan or the elastic-plastic law that has not settled
  marches on.
- Ringing (`lane_ringing`) in a permanent stick is computed in closed form for a single spring,
  else by a fit.
- Exact engine: a case goes to the exact batch `lumped`, or with a stretch law to a single run,
  if an error still misses its tolerance, if shorter sticks may ring, or if its motion grows.
- Check (`lane_check`): a few cases are compared with the exact engine (with a stretch law twice,
  with its steps and with twice as many).
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from ....effects import is_bond_list, law_has_trait
from ....model.model import Model
from ....model.similar_models import SimilarModels, collect_columns, select_models
from ....scene.rules.accuracy import list_fixed_settings
from ...rig.motion_warnings import note_on_creep
from .. import one_by_one
from ..case_results import CaseResults
from . import lumped
from .lane_check import solve_and_check
from .lane_numbers import LANE_LAWS, LaneCases, make_cases
from .lane_settling import MIN_TOLERANCE
from .lane_steps import steps_per_cycle
from .pieces import MAX_CYCLES, MIN_CYCLES

MAX_CASES_PER_CALL = 4096  # largest number of cases in one compiled call
N_FINER_CELLS = 2  # number of doublings of the cells of the Iwan law in the exact engine of a check


def refuses(model: Model) -> str:
    """Return the reason why a model cannot be integrated in a vectorized batch, or ""."""
    if why := why_no_lanes(model):
        return why
    if not steps_per_cycle([model])[0]:
        return "its free vibration is too fast for the time steps of its drive"
    return ""


def why_no_lanes(model: Model) -> str:
    """Return the reason why options of a model exclude a vectorized batch, or ""."""
    friction = model.friction
    if why := lumped.why_not_one_point(model):
        return why
    if not MIN_CYCLES <= model.rig.drive.cycles <= MAX_CYCLES or not friction.static > 0:
        return "its cycles are too few or too many, or it has no friction"
    if friction.law not in LANE_LAWS:
        return "its law cannot be computed for many cases at once"
    if law_has_trait(friction.law, "bonds") and (
        is_bond_list(friction) or friction.slip_growth is not None
    ):
        return "its bonds grow, or are computed as a list of bonds"
    return needs_other_accuracy(model)


def needs_other_accuracy(model: Model) -> str:
    """Return the reason why the requested method or accuracy excludes a vectorized batch, or ""."""
    if (
        model.accuracy.method != "auto"
        or list_fixed_settings(model.accuracy)
        or model.accuracy.tolerance < MIN_TOLERANCE
    ):
        return "the case asks for another method, or for an accuracy beyond that of a batch"
    return ""


def group(model: Model) -> tuple:
    """Return a hashable key that is equal for models that one kernel call can compute."""
    return int(model.rig.drive.cycles), model.friction.law


def parts(models: Sequence) -> dict[tuple, list]:
    """Group the indices of the models that can be integrated in vectorized batches."""
    groups: dict = {}
    if isinstance(models, SimilarModels):
        if not why_no_lanes(models.first):
            groups[group(models.first)] = range(len(models))
    else:
        for case, model in enumerate(models):
            if isinstance(model, Model) and not why_no_lanes(model):
                groups.setdefault(group(model), []).append(case)
    fitting = {}
    for key, cases in groups.items():
        steps = steps_per_cycle(select_models(models, cases))
        if steps.any():
            fitting[key] = np.array(cases)[steps > 0].tolist()
    return fitting


def solve(models: Sequence[Model], say=None) -> CaseResults:
    """Compute the case results of a group of models by a vectorized march."""
    results = CaseResults.blank(len(models))
    for first in range(0, len(models), MAX_CASES_PER_CALL):
        cases = range(first, min(first + MAX_CASES_PER_CALL, len(models)))
        results.insert(cases, _solve_cases(select_models(models, cases), say))
    return results


def _solve_cases(models: Sequence[Model], say) -> CaseResults:
    """Compute the case results of models in one call of the vectorized kernel."""
    checked = solve_and_check(
        models,
        LaneCases(*make_cases(models)),
        steps_per_cycle(models),
        partial(_solve_exactly, models, say),
    )
    results = checked.results
    lane_cases = np.flatnonzero(~checked.is_exact)
    if models[0].friction.law == "tanh":
        speeds = collect_columns(models, lambda model: (model.friction.reference_speed,))[0]
        friction = models[0].friction
        notes = {}
        for case in lane_cases.tolist():
            speed = float(speeds[case])
            if speed not in notes:
                changed = friction.model_copy(update={"reference_speed": speed})
                notes[speed] = note_on_creep(changed)
            results.notes[case] = [*notes[speed]]
    return results


def _solve_exactly(models: Sequence[Model], say, indices: list, is_check: bool) -> CaseResults:
    """Compute some cases by the event-driven batch, or by single runs if it refuses them."""
    some_models = list(select_models(models, indices))
    is_check = is_check and models[0].friction.law == "iwan"
    results = CaseResults.blank(len(some_models))
    fits = np.array([not lumped.refuses(model) for model in some_models])
    if fits.any():
        cases = np.flatnonzero(fits)
        n_finer = N_FINER_CELLS if is_check else 0
        results.insert(cases, lumped.solve(select_models(some_models, cases), say, n_finer))
    one_by_one.solve_singly(results, some_models, ~fits, say)
    return results
