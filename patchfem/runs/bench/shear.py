"""Sliding of pieces that deform in shear, by parallel elements or shear modes.

In: a `SlideTask` of a model with [contact.shear]. Out: `SlideHistories`, and coarser runs that show the
mesh error of parallel elements.
"""

import numpy as np

from ...dynamics.march.models import (
    jenkins_model,
    lower_pressure_fields,
    point_lists_model,
    points_model,
)
from ...effects import law_has_trait
from ...friction.record import make_law
from ...response.coarser import CoarserRuns
from ...response.errors import ERROR_MEASURES, absolute_change, convergence_errors
from ...slip.fields import bond_shear_modes, element_fields, point_fields
from ..patch.jenkins_elements import elements
from .ledger import SlideHistories, SlideTask
from .path_response import follow_path
from .rigid import make_climbing_model

# Ratio of the assumed pressure of an initially unloaded node of the lower piece to the mean
# pressure.
OPEN_PRESSURE_FRACTION = 1e-3


def slide_in_shear(task: SlideTask) -> SlideHistories:
    """Compute the friction histories of pieces that deform in shear.

    Raises
    ------
    NotConverged
        If a time step has too large a residual.
    """
    if task.model.grooves is not None:
        return _slide_over_grooves(task)
    if law_has_trait(task.model.friction.law, "bonds"):
        return _slide_bond_points(task)
    return _slide_elements(task)


def _slide_elements(task: SlideTask) -> SlideHistories:
    """Compute the friction histories of elastic pieces that are replaced by parallel elements."""
    patch = task.patch
    friction = task.model.friction
    length = make_law(friction).element(1.0).length
    reduction = elements(patch, friction.static, length)
    springs = reduction.stiffness, reduction.yield_displacement
    if task.options.springs:
        springs = task.options.springs(*springs)
    response = follow_path(jenkins_model(*springs), task)
    tau, local = element_fields(patch, reduction, response.states, length)
    return response.to_slide_histories(patch.pressure.load, tau, local)


def _slide_over_grooves(task: SlideTask) -> SlideHistories:
    """Compute the friction histories of elastic pieces over grooves by shear modes."""
    model = task.model
    patch = task.patch
    load = patch.pressure.load
    contact = make_climbing_model(model, load, patch, model.accuracy.shear_modes)
    depends_on_speed = not law_has_trait(model.friction.law, "timeless")
    response = follow_path(contact, task, depends_on_speed)
    response.require_convergence()
    tau, local = compute_groove_fields(patch, contact, response.states)
    return response.to_slide_histories(load, tau, local)


def compute_groove_fields(patch, contact, states) -> tuple:
    """Return traction (f, m) [Pa] and slip (f, m) [m] at the nodes of a patch over grooves.

    Parameters
    ----------
    patch : Patch
    contact
        Contact model of the grooves.
    states : sequence
        f states as pairs (relative displacement [m], `ClimbingModel.shown`).
    """
    index = contact.shear.points
    m = patch.x.size
    tau = np.zeros((len(states), m))
    local = np.zeros((len(states), m))
    for i, (slide, (along, elastic, vertical)) in enumerate(states):
        t = float(contact.grooves.slope(slide))
        tau[i, index] = (vertical * t + along * np.hypot(1.0, t)) / patch.pieces.interface.weight[
            index
        ]
        local[i] = slide
        local[i, index] -= elastic / np.hypot(1.0, t)
    return tau, local


def _slide_bond_points(task: SlideTask) -> SlideHistories:
    """Compute the friction histories of bonds at points of elastic pieces, by shear modes."""
    model = task.model
    patch = task.patch
    law = model.bonds
    choice = task.engine.choice
    shear = compute_point_shear_modes(model, patch, task.options.modes)
    if model.side == "lower":
        contact = make_bond_lists_on_lower_piece(model, patch, choice, shear)
    elif choice is not None:
        contact = make_bond_lists_with_shear(patch, law, shear, choice)
    else:
        weight = patch.pieces.interface.weight
        contact = points_model(law, weight, patch.pressure.sigma_n, shear)
    response = follow_path(contact, task, law.has_growth)
    response.require_convergence()
    tau, local = point_fields(patch, law, contact.reduction, response.states)
    return response.to_slide_histories(patch.pressure.load, tau, local)


def compute_point_shear_modes(model, patch, n_modes: int | None = None):
    """Return the shear modes of the contact points of a nonlocal law.

    If the pressure is fixed to the lower piece, all nodes are contact points. An initially unloaded
    node then has OPEN_PRESSURE_FRACTION times the mean pressure of the loaded nodes.

    Parameters
    ----------
    model : Model
    patch : Patch
    n_modes : int, optional
        Number of modes; default: by the scene, otherwise by the tolerance.
    """
    law = model.bonds
    sigma = patch.pressure.sigma_n
    tolerance = 0.1 * model.accuracy.tolerance
    n_modes = n_modes or model.accuracy.shear_modes
    if model.side != "lower":
        return bond_shear_modes(patch, law, n_modes, tolerance)
    # A single mode is computed first, because this rejects a patch that could jump at constant
    # displacement.
    bond_shear_modes(patch, law, 1, 1.0)
    return bond_shear_modes(
        patch,
        law,
        n_modes,
        tolerance,
        sigma=np.maximum(sigma, OPEN_PRESSURE_FRACTION * mean_loaded_pressure(patch)),
    )


def mean_loaded_pressure(patch) -> float:
    """Return the mean pressure [Pa] over the loaded nodes."""
    return patch.pressure.load / float(patch.pieces.interface.weight @ (patch.pressure.sigma_n > 0))


def count_shear_modes(model, patch) -> int | None:
    """Return the number of shear modes of a bench run with bonds; None if it uses none."""
    if (
        not model.partial_slip
        or not law_has_trait(model.friction.law, "bonds")
        or model.grooves is not None
    ):
        return None
    return compute_point_shear_modes(model, patch).stiffness.size


def make_bond_lists_on_lower_piece(model, patch, choice, shear):
    """Return the contact model with a bond list per node, for a pressure fixed to the lower piece.

    Parameters
    ----------
    model : Model
    patch : Patch
    choice : Choice
        Method of bond summation.
    shear : ShearModes or None
        Shear modes at the nodes; None for pieces that are rigid in shear.
    """
    law = model.bonds
    sigma = patch.pressure.sigma_n
    mean = mean_loaded_pressure(patch)
    return point_lists_model(
        law,
        law.static * mean * patch.pieces.interface.weight,
        np.full(sigma.size, mean),
        shear,
        choice.reach(law.order),
        choice.merge,
        lower_pressure_fields(patch.x, sigma, mean),
    )


def make_bond_lists_with_shear(patch, law, shear, choice, force=None):
    """Return the contact model with a bond list at each point of the shear modes.

    Parameters
    ----------
    patch : Patch
    law
        Bond parameters.
    shear : ShearModes
    choice : Choice
        Method of bond summation.
    force : (k,), optional
        Normal forces [N] of the points, if a few points represent all nodes.
    """
    sigma = patch.pressure.sigma_n[shear.points] if force is None else np.ones_like(force)
    force = patch.pieces.interface.weight[shear.points] * sigma if force is None else force
    return point_lists_model(
        law, law.static * force, sigma, shear, choice.reach(law.order), choice.merge
    )


def list_coarser_element_runs(n_meshes: int, reference_run) -> CoarserRuns:
    """List bench runs with parallel elements on coarser meshes.

    Parameters
    ----------
    n_meshes : int
        Number of coarser meshes.
    reference_run : CoarseRun
        Run with which they are compared.
    """
    runs = tuple(reference_run._replace(level=level) for level in range(1, n_meshes + 1))
    return CoarserRuns(runs, estimate_mesh_errors, reference_run, "mesh")


def estimate_mesh_errors(*values: dict) -> dict:
    """Estimate the mesh errors of the measures from their values on nested meshes.

    Measures that are themselves errors, such as the energy balance, have their change as error.
    """
    changes = absolute_change(values[0], values[1])
    errors = convergence_errors(*values)
    errors.update({name: changes[name] for name in ERROR_MEASURES if name in changes})
    return errors
