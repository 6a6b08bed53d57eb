"""Sliding of pieces that deform in shear: parallel elements or shear modes.

In: a `Slide` of a model with [contact.shear]. Out: `SlideHistories`, and the coarse passes that
show the error of the mesh of elements.
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
from .follow import follow_path
from .ledger import Slide, SlideHistories
from .rigid import make_climbing_model

# Fraction of the mean pressure assumed at nodes without initial pressure of the lower piece.
OPEN_PRESSURE_FRACTION = 1e-3


def slide_in_shear(task: Slide) -> SlideHistories:
    """Compute the bench histories of pieces that deform in shear.

    Raises
    ------
    NotConverged
        If the residual of a step is too large.
    """
    if task.model.grooves is not None:
        return _slide_over_grooves(task)
    if law_has_trait(task.model.friction.law, "bonds"):
        return _slide_bond_points(task)
    return _slide_elements(task)


def _slide_elements(task: Slide) -> SlideHistories:
    """Compute the histories of elastic pieces whose friction is a set of parallel elements."""
    patch = task.patch
    friction = task.model.friction
    length = make_law(friction).element(1.0).length
    reduction = elements(patch, friction.static, length)
    springs = reduction.stiffness, reduction.yield_displacement
    if task.options.springs:
        springs = task.options.springs(*springs)
    followed = follow_path(jenkins_model(*springs), task)
    tau, local = element_fields(patch, reduction, followed.states, length)
    return followed.histories(patch.pressure.load, tau, local)


def element_limit(model, patch):
    """Return the friction limit (m,) [Pa] of the nodes of parallel elements; None for other benches."""
    is_element_bench = (
        model.partial_slip
        and model.grooves is None
        and not law_has_trait(model.friction.law, "bonds")
    )
    return model.friction.static * patch.pressure.sigma_n if is_element_bench else None


def _slide_over_grooves(task: Slide) -> SlideHistories:
    """Compute the histories of deformable pieces over grooves, with shear modes."""
    model = task.model
    patch = task.patch
    load = patch.pressure.load
    contact = make_climbing_model(model, load, patch, model.accuracy.shear_modes)
    is_paced = not law_has_trait(model.friction.law, "timeless")
    followed = follow_path(contact, task, is_paced)
    followed.require_convergence()
    tau, local = groove_fields(patch, contact, followed.states)
    return followed.histories(load, tau, local)


def groove_fields(patch, contact, states) -> tuple:
    """Return the traction (f, m) [Pa] and the slip (f, m) [m] of points that climb grooves.

    The points have shear modes.

    Parameters
    ----------
    patch : Patch
    contact
        Contact model of the grooves.
    states : sequence
        f states (slide [m], `ClimbingModel.shown`).
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


def _slide_bond_points(task: Slide) -> SlideHistories:
    """Compute the bench histories of bonds at the points of elastic pieces, by shear modes."""
    model = task.model
    patch = task.patch
    law = model.bonds
    choice = task.engine.choice
    shear = shear_modes_of_points(model, patch, task.options.modes)
    if model.side == "lower":
        contact = make_lists_on_lower_piece(model, patch, choice, shear)
    elif choice is not None:
        contact = make_sheared_lists(patch, law, shear, choice)
    else:
        weight = patch.pieces.interface.weight
        contact = points_model(law, weight, patch.pressure.sigma_n, shear)
    followed = follow_path(contact, task, law.has_growth)
    followed.require_convergence()
    tau, local = point_fields(patch, law, contact.reduction, followed.states)
    return followed.histories(patch.pressure.load, tau, local)


def shear_modes_of_points(model, patch, count: int | None = None):
    """Return the shear modes of the contact points at which a bench sums over bonds.

    If the pressure belongs to the lower piece, the points are all nodes; a node without pressure at
    first counts as if under OPEN_PRESSURE_FRACTION times the mean pressure of the others.

    Parameters
    ----------
    model : Model
    patch : Patch
    count : int, optional
        Number of modes; None: by scene and tolerance.
    """
    law = model.bonds
    sigma = patch.pressure.sigma_n
    tolerance = 0.1 * model.accuracy.tolerance
    count = count or model.accuracy.shear_modes
    if model.side != "lower":
        return bond_shear_modes(patch, law, count, tolerance)
    # Computing a single mode first refuses a patch that could jump without a change of displacement.
    bond_shear_modes(patch, law, 1, 1.0)
    return bond_shear_modes(
        patch,
        law,
        count,
        tolerance,
        sigma=np.maximum(sigma, OPEN_PRESSURE_FRACTION * mean_pressure(patch)),
    )


def mean_pressure(patch) -> float:
    """Return the mean pressure [Pa] over the nodes that carry load."""
    return patch.pressure.load / float(patch.pieces.interface.weight @ (patch.pressure.sigma_n > 0))


def count_shear_modes(model, patch) -> int | None:
    """Return the number of shear modes of a bench with bonds, or None without shear modes."""
    if (
        not model.partial_slip
        or not law_has_trait(model.friction.law, "bonds")
        or model.grooves is not None
    ):
        return None
    return shear_modes_of_points(model, patch).stiffness.size


def make_lists_on_lower_piece(model, patch, choice, shear):
    """Return the model with a bond list per node, under the pressure of the lower piece.

    Parameters
    ----------
    model : Model
    patch : Patch
    choice : Choice
        Method of the sum over bonds.
    shear : ShearModes or None
        Modes on every node; None for pieces that are rigid in shear.
    """
    law = model.bonds
    sigma = patch.pressure.sigma_n
    mean = mean_pressure(patch)
    return point_lists_model(
        law,
        law.static * mean * patch.pieces.interface.weight,
        np.full(sigma.size, mean),
        shear,
        choice.reach(law.order),
        choice.merge,
        lower_pressure_fields(patch.x, sigma, mean),
    )


def make_sheared_lists(patch, law, shear, choice, force=None):
    """Return the model with bond lists at the points of the shear modes of a pressed patch.

    Parameters
    ----------
    patch : Patch
    law
        Bond parameters.
    shear : ShearModes
    choice : Choice
        Method of the sum over bonds.
    force : (k,), optional
        Normal forces [N] of the points, if few points represent all.
    """
    sigma = patch.pressure.sigma_n[shear.points] if force is None else np.ones_like(force)
    force = patch.pieces.interface.weight[shear.points] * sigma if force is None else force
    return point_lists_model(
        law, law.static * force, sigma, shear, choice.reach(law.order), choice.merge
    )


def list_coarser_element_runs(count: int, reference_pass) -> CoarserRuns:
    """List runs of a bench with parallel elements on coarser meshes.

    Parameters
    ----------
    count : int
        Number of coarser meshes.
    reference_pass : CoarsePass
        CoarsePass with which they are compared.
    """
    runs = tuple(reference_pass._replace(level=level) for level in range(1, count + 1))
    return CoarserRuns(runs, mesh_errors, reference_pass, "mesh")


def mesh_errors(*values: dict) -> dict:
    """Estimate the mesh error of each measure from its values on nested meshes.

    The residual of a balance is an error itself, so that its change is used.
    """
    changes = absolute_change(values[0], values[1])
    errors = convergence_errors(*values)
    errors.update({name: changes[name] for name in ERROR_MEASURES if name in changes})
    return errors
