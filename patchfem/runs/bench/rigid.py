"""Rigid sliding under a pressure that moves with the upper piece, by the march of one point.

In: a `SlideTask`. Out: `SlideHistories`. All points have the same displacement and the laws are linear
in the pressure. Therefore a single point under the whole load is computed, and its force is
distributed over the points in proportion to their pressure.
"""

from functools import partial

import numpy as np

from ...friction.cells import CELL_MERGES, join_cells
from ...friction.laws.elastic_plastic import parallel_element
from ...friction.record import make_law
from ...points import contacts
from ...response.coarser import CoarserRuns
from ...response.errors import merged_cell_errors
from . import shear
from .engine import Method
from .law import nodal_pressure
from .ledger import SlideHistories, SlideTask, compute_interface_slip, compute_local_slip
from .path_response import follow_slide, make_slide_histories


def slide_rigidly(task: SlideTask) -> SlideHistories:
    """Compute the friction histories of rigid sliding by the march of a single point."""
    model = task.model
    sigma, weight = nodal_pressure(model, task.patch)
    load = float(weight @ sigma)
    motion = follow_slide(_make_point(task, load), task)
    frames = task.frame_indices
    slide = task.slide
    ratio = motion.force[frames] / load if load > 0 else np.zeros(frames.size)
    tau = np.outer(ratio, sigma)
    if task.engine.method is Method.ELEMENTS or model.grooves is not None:
        slip = motion.slip
        local = np.where(sigma > 0, slip[frames, None], slide[frames, None])
    else:
        loads = np.full(slide.size, load)
        slip = compute_interface_slip(model, slide, motion.force, loads)
        local = compute_local_slip(model, slide[frames], tau, sigma)
    return make_slide_histories(task, motion, load, tau, local)._replace(slip=slip)


def _make_point(task: SlideTask, load: float) -> contacts.Contact:
    """Return a single point under the whole load [N]."""
    model = task.model
    friction = model.friction
    engine = task.engine
    row = np.zeros(0)
    if model.grooves is not None:
        return shear.make_flank_contact(model, load)
    if engine.method is Method.ELEMENTS:
        element = make_law(friction, load).element(load)
        if task.options.springs is not None:
            element = parallel_element(*task.options.springs(*np.split(element.numbers[2:], 2)))
        return contacts.make_contact([element], [row])
    bond_sum = shear.make_bond_sum(model.bonds, engine.choice)
    return contacts.make_bond_contact(model.bonds, load, row, None, bond_sum)


def list_merged_cell_runs(reference_run) -> CoarserRuns:
    """List coarser runs in which groups of four slider cells are merged into one.

    `reference_run` is the run with which they are compared.
    """
    joins = [partial(join_cells, *merge) for merge in CELL_MERGES]
    runs = tuple(reference_run._replace(springs=join) for join in joins)
    return CoarserRuns(runs, merged_cell_errors, reference_run, "cells")
