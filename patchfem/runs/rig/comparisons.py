"""Comparison runs from which the errors of a motion follow: in time, on other meshes, with other modes and bond sums.

In: a Model, and the Numerics and the Solution of its run. Out: `CoarserRuns`, one for each axis of the resolution. The same
lists and rules hold for all engines and for a prescribed slide. Runs in time steps have a quarter of the steps, and are
compared with a run that has as many.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from ... import slip
from ...effects import law_has_trait
from ...model.model import Model
from ...response.errors import (
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
from ...response.measures import Values
from ..bench.engine import Numerics
from ..patch import faces
from .engines import ENGINES, divide_steps, enlarge_hybrid_steps, estimate_hybrid_errors
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

    Time steps have runs with half and with a quarter of them, and the engine `hybrid` one with larger steps. The solver of
    steady motions estimates the errors of its steps itself.
    """
    engine = ENGINES[numerics.engine]
    if engine.finds_periodic_motion:
        return []
    if not engine.has_steps:
        coarse = enlarge_hybrid_steps(numerics)
        return [CoarserRuns((coarse,), partial(estimate_hybrid_errors, rtol=numerics.local))]
    runs = (divide_steps(numerics, 2), divide_steps(numerics, 4))
    return [
        CoarserRuns(
            runs, partial(estimate_convergence_errors, steps=numerics.steps), source="steps"
        )
    ]


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
    reduction = getattr(solution.contact, "reduction", None)
    has_modes = hasattr(reduction, "shape")  # parallel elements have none
    beside = None
    if engine.has_steps:
        numerics = beside = divide_steps(numerics, 4)

    coarser_runs = []
    if engine.finds_periodic_motion:
        coarser_runs.append(CoarserRuns((), partial(_get_own_errors, solution)))
    elif not engine.has_steps and model.rig.friction.bands_slide_apart:
        # The measures of bands have the error of the trapezoidal rule with 400 samples per cycle.
        coarser_runs.append(CoarserRuns((), estimate_sampling_errors, source="samples"))

    # On a coarser mesh the number of shear modes stays, so that only the mesh changes.
    n_modes = int(np.size(reduction.stiffness)) if has_modes else None
    coarser_runs += _list_mesh_runs(model, numerics, beside, n_coarse, n_modes)
    if has_modes:
        fewer = replace(numerics, shear_modes=slip.shear_modes.comparison_mode_count(n_modes))
        coarser_runs.append(CoarserRuns((fewer,), second_order_errors, beside, "modes"))

    # The cells of an Iwan model represent its continuous density to order 2.
    if engine.has_steps and solution.contact is not None and _has_cells(model):
        halved = replace(numerics, has_half_cells=True)
        coarser_runs.append(CoarserRuns((halved,), second_order_errors, beside))
    coarser_runs += _list_bond_sum_runs(model, numerics, patch, solution)

    # A reduced structure neglects its highest modes. One run has more modes, another one half of them.
    others = () if model.rig is None else model.rig.structure.other_rigs
    if others:
        runs = tuple(replace(numerics, other_rig=number) for number in range(len(others)))
        coarser_runs.append(CoarserRuns(runs, estimate_errors_from_finer, beside, "reduced"))
    return coarser_runs


def _get_own_errors(solution: Solution, values: Values) -> Values:
    """Return the errors that the solver of a motion knows by measure, 0 for others."""
    return {name: solution.errors.get(name, 0.0) for name in values}


def _has_cells(model: Model) -> bool:
    """Return whether the law of an interface is represented by cells."""
    laws = [model.friction]
    if model.rig is not None:
        laws = [interface.numbers for interface in model.rig.friction.interfaces]
    return any(law_has_trait(law.law, "cells") for law in laws)


def _list_mesh_runs(
    model: Model, numerics: Numerics, beside: Numerics | None, n_coarse: int, n_modes: int | None
) -> ComparisonRuns:
    """List the comparison runs in which one patch of a model has coarser meshes: that of [contact], or of an interface.

    Interfaces with equal patches are coarsened together. The error is of second order for shear modes, and for an interface
    that slips as a whole. The order of parallel elements, and of the cells of a face in time steps, is at least 1.

    Parameters
    ----------
    model : Model
        Model of the motion.
    numerics : Numerics
        Settings of a comparison run.
    beside : Numerics or None
        Settings of the run with which it is compared; None for the run itself.
    n_coarse : int
        Number of coarser meshes on which the patch of [contact] is solved.
    n_modes : int or None
        Number of shear modes of the run; None without shear modes.
    """
    has_cells = model.patch is not None and model.patch.area is not None and beside is not None
    is_averaged = model.friction is not None and law_has_trait(model.friction.law, "averaged")
    coarser_runs = []
    if n_coarse and (model.motion_depends_on_mesh or is_averaged):
        has_elements = bool(model.partial_slip) and n_modes is None
        rule = _choose_mesh_rule(model.side, has_elements=has_elements)
        if has_cells and rule is second_order_errors:
            rule = estimate_convergence_errors
        # A second coarser mesh shows the order. The elements of a rig have one, as those between masses.
        is_single = rule is second_order_errors or (has_elements and model.rig is not None)
        n_meshes = 1 if is_single or beside is None else 2
        levels = range(1, 1 + min(n_coarse, n_meshes))
        modes = numerics.shear_modes if n_modes is None else n_modes
        runs = tuple(replace(numerics, coarse_patch=k, shear_modes=modes) for k in levels)
        coarser_runs.append(CoarserRuns(runs, rule, beside, "mesh"))
    # The module of interfaces with patches is loaded only for them.
    groups = faces.group_interfaces_with_coarse_mesh(model) if model.has_interface_patches else []
    for interfaces in groups:
        interface = model.rig.friction.interfaces[interfaces[0]]
        rule = _choose_mesh_rule(
            interface.patch.gap.side, has_elements=bool(interface.partial_slip) and n_modes is None
        )
        coarse = replace(numerics, meshed=interfaces)
        coarser_runs.append(CoarserRuns((coarse,), rule, beside, "mesh"))
    return coarser_runs


def _choose_mesh_rule(side: str, *, has_elements: bool):
    """Return the rule of the error by the mesh of an interface, whose piece on a `side` has the pressure."""
    if side == "lower":
        return edge_errors
    return estimate_convergence_errors if has_elements else second_order_errors


def _list_bond_sum_runs(
    model: Model, beside: Numerics, patch, solution: Solution
) -> ComparisonRuns:
    """List the comparison runs from which the error of a bond list is estimated.

    The first entry is the error bound of the sum on forces and energies. If bonds are merged or a
    large tail is neglected, the second entry is the change of the motion with narrower strips and a
    smaller tail.

    Parameters
    ----------
    model : Model
        Model of the motion.
    beside : Numerics
        Settings of these runs, with a quarter of the steps of the run.
    patch : Patch or None
        Solved patch.
    solution : Solution
        Results of the run.
    """
    choice = solution.bond_summation
    error = 0.0 if choice is None else choice.find_error(solution.book.get("join_error", 0.0))
    if not error:
        return []

    def bound_errors(values: Values) -> Values:
        """Return a bound of the error of each measure in `values` due to bonds that the sum leaves out or merges.

        The bound follows from the relative error of the force and from the friction work of the run.
        """
        window = solution.window
        cycle_work = np.abs(np.diff(window.extra["ledger"][0])).sum()
        if model.rig is not None:
            span = max(window.time[-1] - window.time[0], 1e-300)
            cycle_work *= model.rig.drive.signal.period / span
        load = solution.book.get("peak_load", first_interface_load(model, patch))
        works = (solution.book["passed"], cycle_work)
        return compute_friction_errors(values, error, model.friction, load, works)

    # The change of the motion adds to the bound where strips or the tail are coarse.
    coarser_runs = [CoarserRuns((), bound_errors, source="bonds")]
    if choice.merge > 0 or choice.tail > MAX_UNCHECKED_TAIL_RATIO * model.accuracy.tolerance:
        finer = replace(
            choice,
            merge=COMPARISON_MERGE_WIDTH_FACTOR * choice.merge,
            tail=COMPARISON_TAIL_FACTOR * choice.tail,
        )
        narrow = replace(beside, choice=finer)
        same = replace(beside, choice=choice)
        coarser_runs.append(CoarserRuns((narrow,), estimate_errors_from_finer, same, "bonds"))
    return coarser_runs


def list_joint_runs(inputs, space_runs: ComparisonRuns) -> ComparisonRuns:
    """List the comparison run with a stiffer joint, if a joint was subtracted from the modes.

    Its stiffness is larger by the error of the stiffness that was subtracted, so that the change of a
    measure is its error. The run has the steps of the run on a coarser mesh, the first one of `space_runs`. `inputs` are the
    RunInputs of the run.
    """
    for coarser in space_runs if inputs.stiffer is not None else ():
        if coarser.runs and coarser.runs[0].coarse_patch:
            stiffer = replace(coarser.runs[0], coarse_patch=0, stiffer_joint=True)
            return [CoarserRuns((stiffer,), compute_absolute_changes, coarser.reference, "mesh")]
    return []
