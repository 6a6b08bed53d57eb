"""Comparison runs from which the errors of a motion follow: in time, on other meshes, with other modes and bond sums.

In: a Model, and the Numerics and the Solution of its run. Out: `CoarserRuns`, one for each axis of the resolution. The same
lists and rules hold for all engines and for a prescribed slide. Runs in time steps have a quarter of the steps, and are
compared with a run that has as many.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ... import partial_slip
from ...effects import law_has_trait
from ...measures.errors import (
    CoarserRuns,
    ComparisonRuns,
    compute_absolute_changes,
    compute_friction_errors,
    edge_errors,
    estimate_convergence_errors,
    estimate_errors_from_finer,
    estimate_sampling_errors,
    second_order_errors,
)
from ...measures.measures import Values
from ...model.model import Model
from ..bench.engine import Numerics
from ..interfaces import bond_lists
from ..patch import faces
from .engines import ENGINES, divide_steps, enlarge_event_driven_steps, estimate_event_driven_errors
from .evaluation import Solution, first_interface_load

# Ratio of the width within which bonds are merged in the comparison run to that in the run itself.
COMPARISON_MERGE_WIDTH_FACTOR = 0.5
# Largest ratio of the neglected tail of a sum over bonds to the tolerance at which no run with a
# smaller tail is made; the automatic tail is a tenth of this.
MAX_UNCHECKED_TAIL_RATIO = 1e-2
# Ratio of the neglected tail in the comparison run to that in the run itself.
COMPARISON_TAIL_FACTOR = 0.1


def list_time_runs(numerics: Numerics) -> ComparisonRuns:
    """List the comparison runs that are coarser in time than the run with some Numerics.

    Time steps have runs with half and with a quarter of them, and the engine `event_driven` one with larger steps. The
    solver of steady motions estimates the errors of its steps itself.
    """
    engine = ENGINES[numerics.engine]
    if engine.finds_periodic_motion:
        return []
    if not engine.has_steps:
        rule = partial(estimate_event_driven_errors, rtol=numerics.local)
        return [CoarserRuns((enlarge_event_driven_steps(numerics),), rule)]
    rule = partial(estimate_convergence_errors, steps=numerics.steps)
    runs = (divide_steps(numerics, 2), divide_steps(numerics, 4))
    return [CoarserRuns(runs, rule, source="steps")]


def find_bond_summation(model: Model, numerics: Numerics):
    """Return the EngineChoice by which time steps sum the bonds of a motion; None for other engines and laws."""
    if model.rig is None or numerics.engine != "march":
        return numerics.space.choice
    if not _has_law_with(model, "bonds"):
        return None
    return bond_lists.choose_bond_summation(model, numerics)


def _has_law_with(model: Model, trait: str) -> bool:
    """Return whether the law of an interface of a bench or a rig has a trait, such as "cells"."""
    if model.rig is None:
        return law_has_trait(model.friction.law, trait)
    return any(law_has_trait(one.numbers.law, trait) for one in model.rig.friction.interfaces)


def list_space_runs(
    model: Model, numerics: Numerics, patch, n_coarse: int, solution: Solution
) -> ComparisonRuns:
    """List the comparison runs with another discretization of the interfaces and the structure.

    Parameters
    ----------
    model : Model
        Model of the motion.
    numerics : Numerics
        Settings of the run.
    patch : Patch or None
        Solved patch.
    n_coarse : int
        Number of coarser meshes on which the patch of [contact] is solved.
    solution : Solution
        Results of the run.
    """
    engine = ENGINES[numerics.engine]
    rig = model.rig
    # Shear modes of the run; parallel elements have no shape.
    n_modes = _count_shear_modes(solution)
    beside = divide_steps(numerics, 4) if engine.has_steps else None
    base = beside or numerics
    coarser_runs = []

    def add(source: str, rule, *changes: dict) -> None:
        """Add an axis: the rule of its error, and the changes of the settings in its runs."""
        runs = tuple(base.vary_space(**change) for change in changes)
        coarser_runs.append(CoarserRuns(runs, rule, beside if runs else None, source))

    if solution.steady is not None:
        add("own", solution.steady.get_errors)
    elif not engine.has_steps and rig.friction.bands_slide_apart:
        # The measures of bands have the error of the trapezoidal rule with 400 samples per cycle.
        add("samples", estimate_sampling_errors)

    # The patch of [contact] on coarser meshes, with the same number of shear modes, so that only the mesh changes.
    is_averaged = model.friction is not None and law_has_trait(model.friction.law, "averaged")
    if n_coarse and (model.motion_depends_on_mesh or is_averaged):
        rule, n_meshes = _choose_patch_meshes(model, n_modes, has_steps=beside is not None)
        modes = numerics.space.shear_modes if n_modes is None else n_modes
        levels = range(1, 1 + min(n_coarse, n_meshes))
        add("mesh", rule, *({"coarse_patch": k, "shear_modes": modes} for k in levels))

    # Interfaces with equal patches are coarsened together. The module of these patches is loaded only for them.
    for numbers in (
        faces.group_interfaces_with_coarse_mesh(model) if model.has_interface_patches else ()
    ):
        interface = rig.friction.interfaces[numbers[0]]
        has_elements = bool(interface.partial_slip) and n_modes is None
        rule = _choose_mesh_rule(interface.patch.gap.side, has_elements=has_elements)
        add("mesh", rule, {"meshed": numbers})
    if n_modes is not None:
        fewer = partial_slip.shear_modes.comparison_mode_count(n_modes)
        add("modes", second_order_errors, {"shear_modes": fewer})

    # The cells of an Iwan model represent its continuous density to order 2.
    if engine.has_steps and solution.contact is not None and _has_law_with(model, "cells"):
        add("own", second_order_errors, {"has_half_cells": True})

    # Bonds: the bound of the sum, and if strips or the tail are coarse, the change of the motion with finer ones.
    choice = find_bond_summation(model, numerics)
    ledger = solution.run.ledger
    if choice is not None and choice.find_error(ledger.get("join_error", 0.0)):
        add("bonds", partial(_bound_bond_errors, model, patch, solution, choice))
        if choice.merge > 0 or choice.tail > MAX_UNCHECKED_TAIL_RATIO * model.accuracy.tolerance:
            narrow = base.vary_space(choice=_refine_bond_sum(choice))
            same = base.vary_space(choice=choice)
            coarser_runs.append(CoarserRuns((narrow,), estimate_errors_from_finer, same, "bonds"))

    # A reduced structure neglects its highest modes. One run has more modes, another one half of them.
    others = () if rig is None else rig.structure.other_rigs
    if others:
        numbers = ({"other_rig": number} for number in range(len(others)))
        add("reduced", estimate_errors_from_finer, *numbers)
    return coarser_runs


def _count_shear_modes(solution: Solution) -> int | None:
    """Return the number of shear modes of a motion; None without modes. Parallel elements have no shape."""
    reduction = getattr(solution.contact, "reduction", None)
    return int(np.size(reduction.stiffness)) if hasattr(reduction, "shape") else None


def _choose_patch_meshes(
    model: Model, n_modes: int | None, *, has_steps: bool
) -> tuple[Callable[..., Values], int]:
    """Return the rule of the error by the mesh of [contact], and the number of coarser meshes that it uses.

    The order of the cells of a face in time steps is at least 1. A second coarser mesh shows the order; the elements of a
    rig have a single one, as those between masses.
    """
    has_elements = bool(model.partial_slip) and n_modes is None
    rule = _choose_mesh_rule(model.side, has_elements=has_elements)
    if model.area is not None and has_steps and rule is second_order_errors:
        rule = estimate_convergence_errors
    is_single = rule is second_order_errors or (has_elements and model.rig is not None)
    return rule, 1 if is_single or not has_steps else 2


def _refine_bond_sum(choice):
    """Return the EngineChoice of the comparison run of a sum over bonds, with narrower strips and a smaller tail."""
    return replace(
        choice,
        merge=COMPARISON_MERGE_WIDTH_FACTOR * choice.merge,
        tail=COMPARISON_TAIL_FACTOR * choice.tail,
    )


def _choose_mesh_rule(side: str, *, has_elements: bool):
    """Return the rule of the error by the mesh of an interface, whose piece on a `side` has the pressure.

    The error is of second order for shear modes, and for an interface that slips as a whole. The order of parallel
    elements is at least 1.
    """
    if side == "lower":
        return edge_errors
    return estimate_convergence_errors if has_elements else second_order_errors


def _bound_bond_errors(model: Model, patch, solution: Solution, choice, values: Values) -> Values:
    """Return a bound of the error of each measure due to bonds that the sum leaves out or merges.

    The bound follows from the relative error of the force and from the friction work of the run.

    Parameters
    ----------
    model : Model
        Model of the motion.
    patch : Patch or None
        Solved patch.
    solution : Solution
        Results of the run.
    choice : EngineChoice
        Method of the sum.
    values : dict
        Measures by name.
    """
    ledger = solution.run.ledger
    window = solution.run.window
    cycle_work = np.abs(np.diff(window.extra["ledger"][0])).sum()
    if model.rig is not None:
        span = max(window.time[-1] - window.time[0], 1e-300)
        cycle_work *= model.rig.drive.signal.period / span
    load = ledger.get("peak_load", first_interface_load(model, patch))
    error = choice.find_error(ledger.get("join_error", 0.0))
    works = (ledger["passed"], cycle_work)
    return compute_friction_errors(values, error, model.friction, load, works)


def list_joint_runs(inputs, space_runs: ComparisonRuns) -> ComparisonRuns:
    """List the comparison run with a stiffer joint, if a joint was subtracted from the modes.

    Its stiffness is larger by the error of the stiffness that was subtracted, so that the change of a
    measure is its error. The run has the steps of the run on a coarser mesh, the first one of `space_runs`. `inputs` are the
    RunInputs of the run.
    """
    for coarser in space_runs if inputs.stiffer is not None else ():
        if coarser.runs and coarser.runs[0].space.coarse_patch:
            stiffer = coarser.runs[0].vary_space(coarse_patch=0, stiffer_joint=True)
            return [CoarserRuns((stiffer,), compute_absolute_changes, coarser.reference, "mesh")]
    return []
