"""Rigid sliding under a pressure that moves with the upper piece, by compiled engines.

In: a `SlideTask`. Out: `SlideHistories`. All points have the same displacement and the laws are linear
in the pressure. Therefore a single point under the whole load is computed, and its force is
distributed over the points in proportion to their pressure.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from ...dynamics.grooves import climbing as flank_climbing
from ...dynamics.march import varying_load
from ...dynamics.march.models import ContactModel, bond_list_model, element_model, points_model
from ...effects import law_has_trait
from ...friction.cells import CELL_MERGES, join_cells
from ...friction.laws.elastic_plastic import parallel_element
from ...friction.record import make_law
from ...response.coarser import CoarserRuns
from ...response.errors import merged_cell_errors
from .engine import Method
from .law import nodal_pressure
from .ledger import SlideHistories, SlideTask, compute_interface_slip, compute_local_slip
from .path_response import follow_path


def slide_rigidly(task: SlideTask) -> SlideHistories:
    """Compute the friction histories of rigid sliding with a compiled kernel."""
    model = task.model
    law = model.friction.law
    sigma, weight = nodal_pressure(model, task.patch)
    load = float(weight @ sigma)
    depends_on_speed = (
        model.friction.rest_growth is not None
        or model.load_varies
        or not (law_has_trait(law, "bonds") or law_has_trait(law, "timeless"))
    )
    response = follow_path(_make_point_model(task, load), task, depends_on_speed)
    frames = response.frames
    slide = task.slide
    ratio = response.force[frames] / load if load > 0 else np.zeros(frames.size)
    tau = np.outer(ratio, sigma)
    loads = np.full(slide.size, load)
    if model.load_varies:
        loads = model.point.evaluate(task.time)
    if task.engine.method is Method.ELEMENTS or model.grooves is not None:
        slip = response.slip
        local = np.where(sigma > 0, slip[frames, None], slide[frames, None])
    else:
        slip = compute_interface_slip(model, slide, response.force, loads)
        local = compute_local_slip(model, slide[frames], tau, sigma)
    return SlideHistories(response.force, loads, slip, response.ledger, frames, tau, local)


def make_climbing_model(model, load: float, patch=None, n_modes: int | None = None):
    """Return the contact model of a law with memory on the flanks of grooves.

    A bench run has no lifted mass.

    Parameters
    ----------
    model : Model
    load : float
        Normal load [N].
    patch : Patch, optional
        Patch whose pieces deform in shear.
    n_modes : int, optional
        Number of shear modes of the pieces; default: by the tolerance.
    """
    f = model.friction
    if law_has_trait(f.law, "bonds"):
        law = varying_load.make_bonds_law(model.bonds)
    else:
        law = varying_load.make_elastic_plastic_law(f.static, f.bond_length or 0.0)
    grooves = model.grooves
    modes = None
    if model.rig is None:
        grooves = replace(grooves, lifted_mass=0.0)
    else:
        modes = model.rig.modes
    contact = flank_climbing.make_model(grooves, load, law, modes)
    if not model.partial_slip:
        return contact
    return flank_climbing.with_shear_modes(contact, patch, n_modes, model.accuracy.tolerance)


def _make_point_model(task: SlideTask, load: float) -> ContactModel:
    """Return the contact model of a single point under the whole load [N]."""
    model = task.model
    friction = model.friction
    engine = task.engine
    if model.grooves is not None:
        return make_climbing_model(model, load)
    if engine.method is Method.ELEMENTS:
        element = make_law(friction, load).element(load)
        if task.options.springs is not None:
            element = parallel_element(*task.options.springs(*np.split(element.numbers[2:], 2)))
        return element_model(element)
    law = model.bonds
    if engine.choice.engine == "recursion":
        return points_model(law, [1.0], [load])
    choice = engine.choice
    return bond_list_model(law, friction.static * load, choice.reach(law.order), choice.merge)


def list_merged_cell_runs(reference_run) -> CoarserRuns:
    """List coarser runs in which groups of four slider cells are merged into one.

    `reference_run` is the run with which they are compared.
    """
    joins = [partial(join_cells, *merge) for merge in CELL_MERGES]
    runs = tuple(reference_run._replace(springs=join) for join in joins)
    return CoarserRuns(runs, merged_cell_errors, reference_run, "cells")
