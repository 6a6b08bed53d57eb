"""Slide of pieces that deform in shear: parallel elements, or bond points with shear modes.

In: a model with [contact.shear], its pressed patch and a path. Out: `SlideHistories`, and the coarse
passes that show the error of the mesh of elements.
"""

import numpy as np

from ...core import NotConverged
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
from .ledger import PassOptions, SlideHistories
from .rigid import climbing

# fraction of the mean pressure assumed at nodes that the lower piece does not press at first
OPEN = 1e-3


def with_shear(
    model, patch, time, slide, frames: int, watch: PassOptions, engine=None
) -> SlideHistories:
    """Slide the holders along samples of time and slide.

    Parameters
    ----------
    model : Model
    patch : Patch
    time, slide : (k,)
        [s], [m].
    frames : int
        Number of frames of the tractions.
    watch : PassOptions
    engine : BenchEngine, optional
        Needed for bonds.

    Raises
    ------
    NotConverged
        If the residual of a step is too large.
    """
    if model.grooves is not None:
        return _climbing(model, patch, time, slide, frames, watch)
    if law_has_trait(model.friction.law, "bonds"):
        return _points(model, patch, time, slide, frames, watch, engine)
    return _elements(model, patch, time, slide, frames, watch)


def _elements(model, patch, time, slide, frames, watch) -> SlideHistories:
    """Slide Coulomb and elastic-plastic points as parallel elements."""
    f = model.friction
    length = make_law(f).element(1.0).length
    found = elements(patch, f.static, length)
    springs = found.stiffness, found.yield_displacement
    model = jenkins_model(*(watch.springs(*springs) if watch.springs else springs))
    done = follow_path(model, time, slide, frames, watch)
    tau, local = element_fields(patch, found, done.states, length)
    return SlideHistories(
        done.force,
        np.full(time.size, patch.pressure.load),
        done.slip,
        done.ledger,
        done.at,
        tau,
        local,
    )


def _climbing(model, patch, time, slide, frames, watch) -> SlideHistories:
    """Slide pieces over grooves, with points that share the height and have shear modes."""
    load = patch.pressure.load
    contact = climbing(model, load, patch, model.accuracy.shear_modes)
    done = follow_path(
        contact, time, slide, frames, watch, not law_has_trait(model.friction.law, "timeless")
    )
    refuse_missed(done)
    tau, local = climbed_fields(patch, contact, done.states)
    return SlideHistories(
        done.force, np.full(time.size, load), done.slip, done.ledger, done.at, tau, local
    )


def refuse_missed(done) -> None:
    """Raise NotConverged if the residual of a step was too large."""
    if done.missed:
        raise NotConverged(
            f"in {done.missed} time steps of the prescribed slide the friction force has an error "
            "above the limit; raise accuracy.steps_per_cycle",
            "",
        )


def climbed_fields(patch, contact, states) -> tuple:
    """Return traction (f, m) [Pa] with climbing, and slip (f, m) [m], of points over grooves.

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


def _points(model, patch, time, slide, frames, watch, engine) -> SlideHistories:
    """Slide bond points, or lists of bonds, with shear modes."""
    law = model.bonds
    shear = shear_modes_of_points(model, patch, watch.modes)
    found = engine.choice
    if model.side == "lower":
        contact = lists_on_lower_piece(model, patch, found, shear)
    else:
        weight = patch.pieces.interface.weight
        sigma = patch.pressure.sigma_n
        contact = (
            points_model(law, weight, sigma, shear)
            if found is None
            else sheared_lists(patch, law, shear, found)
        )
    done = follow_path(contact, time, slide, frames, watch, law.has_growth)
    refuse_missed(done)
    tau, local = point_fields(patch, law, contact.reduction, done.states)
    return SlideHistories(
        done.force,
        np.full(time.size, patch.pressure.load),
        done.slip,
        done.ledger,
        done.at,
        tau,
        local,
    )


def shear_modes_of_points(model, patch, count: int | None = None):
    """Return the ShearModes of the points of a sum over bonds.

    If the pressure belongs to the lower piece, the points are all nodes; a node without pressure at
    first counts as if under OPEN times the mean pressure of the others.

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
    # this call refuses a patch that could jump without a slide
    bond_shear_modes(patch, law, 1, 1.0)
    return bond_shear_modes(
        patch, law, count, tolerance, sigma=np.maximum(sigma, OPEN * mean_pressure(patch))
    )


def mean_pressure(patch) -> float:
    """Return the load over the nodal areas that carry it [Pa]."""
    return patch.pressure.load / float(patch.pieces.interface.weight @ (patch.pressure.sigma_n > 0))


def count_shear_modes(model, patch) -> int | None:
    """Return the number of shear modes of a bench with bonds; None if there are none."""
    behind = (
        model.partial_slip and law_has_trait(model.friction.law, "bonds") and model.grooves is None
    )
    return shear_modes_of_points(model, patch).stiffness.size if behind else None


def lists_on_lower_piece(model, patch, found, shear):
    """Return lists of bonds, one per node, under the pressure of the lower piece.

    Parameters
    ----------
    model : Model
    patch : Patch
    found : Choice
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
        found.reach(law.order),
        found.merge,
        lower_pressure_fields(patch.x, sigma, mean),
    )


def sheared_lists(patch, law, shear, found, force=None):
    """Return lists of bonds with the ShearModes of a pressed patch.

    Parameters
    ----------
    patch : Patch
    law
        Bond parameters.
    shear : ShearModes
    found : Choice
        Method of the sum over bonds.
    force : (k,), optional
        Normal forces [N] of the points, if few points represent all.
    """
    sigma = patch.pressure.sigma_n[shear.points] if force is None else np.ones_like(force)
    force = patch.pieces.interface.weight[shear.points] * sigma if force is None else force
    return point_lists_model(
        law, law.static * force, sigma, shear, found.reach(law.order), found.merge
    )


def coarser_elements(count: int, few) -> CoarserRuns:
    """Return the coarse runs of a bench with parallel elements, on coarser meshes.

    Parameters
    ----------
    count : int
        Number of coarser meshes.
    few : Pass
        Pass with which they are compared.
    """
    runs = tuple(few._replace(level=level) for level in range(1, count + 1))
    return CoarserRuns(runs, mesh_errors, few, "mesh")


def mesh_errors(*values: dict) -> dict:
    """Return the error of each measure from its values on nested meshes, fine to coarse.

    The residual of a balance is an error itself; its change is used.
    """
    missed = absolute_change(values[0], values[1])
    return convergence_errors(*values) | {
        name: missed[name] for name in ERROR_MEASURES if name in missed
    }
