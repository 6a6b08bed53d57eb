"""Rigid slide under a pressure that moves with the upper piece, by the compiled engines.

In: a model, its patch and a path. Out: `SlideHistories`. Every point has the same slide, and the laws are
linear in the pressure, so that the traction of a point is that of a single point with the whole
load, times the fraction of the load at the point.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from ...dynamics.events.elements import CELL_MERGES, join_cells
from ...dynamics.grooves import climbing as flank_climbing
from ...dynamics.march import varying_load
from ...dynamics.march.models import ContactModel, bond_list_model, element_model, points_model
from ...effects import law_has_trait
from ...friction.laws.elastic_plastic import parallel_element
from ...friction.record import make_law
from ...response.coarser import CoarserRuns
from ...response.errors import merged_cell_errors
from .engine import ELEMENTS, BenchEngine
from .follow import follow_path
from .law import nodal_pressure
from .ledger import PassOptions, SlideHistories, elastic_slip, local_slip


def rigid(
    model, patch, path: tuple, frames: int, engine: BenchEngine, watch: PassOptions
) -> SlideHistories:
    """Slide the interface rigidly along a path by a compiled engine.

    Parameters
    ----------
    model : Model
    patch : Patch or None
    path : tuple
        time (k,) [s] and slide (k,) [m].
    frames : int
        Number of frames of the tractions.
    engine : BenchEngine
    watch : PassOptions

    Returns
    -------
    SlideHistories
    """
    (time, slide), f = path, model.friction
    sigma, weight = nodal_pressure(model, patch)
    load = float(weight @ sigma)
    paced = (
        f.rest_growth is not None
        or model.load_varies
        or not (law_has_trait(f.law, "bonds") or law_has_trait(f.law, "timeless"))
    )
    done = follow_path(
        one_point(model, load, engine, watch.springs), time, slide, frames, watch, paced
    )
    tau = np.outer(done.force[done.at] / load if load > 0 else np.zeros(done.at.size), sigma)
    loads = model.point.evaluate(time) if model.load_varies else np.full(time.size, load)
    if engine.kind == ELEMENTS or model.grooves is not None:
        slip = done.slip
        local = np.where(sigma > 0, done.slip[done.at, None], slide[done.at, None])
    else:
        slip = elastic_slip(model, slide, done.force, loads)
        local = local_slip(model, slide[done.at], tau, sigma)
    return SlideHistories(done.force, loads, slip, done.ledger, done.at, tau, local)


def climbing(model, load: float, patch=None, count: int | None = None):
    """Return the contact model of a law with memory along the flanks of grooves.

    In a bench no mass is lifted.

    Parameters
    ----------
    model : Model
    load : float
        Normal load [N].
    patch : Patch, optional
        Pressed patch whose pieces deform in shear.
    count : int, optional
        Number of shear modes of the pieces; None: by the tolerance.
    """
    f = model.friction
    if law_has_trait(f.law, "bonds"):
        law = varying_load.make_bonds_law(model.bonds)
    else:
        law = varying_load.make_elastic_plastic_law(f.static, f.bond_length or 0.0)
    if model.rig is None:
        found = flank_climbing.make_model(replace(model.grooves, lifted_mass=0.0), load, law, None)
    else:
        found = flank_climbing.make_model(model.grooves, load, law, model.rig.modes)
    return (
        flank_climbing.with_shear_modes(found, patch, count, model.accuracy.tolerance)
        if model.partial_slip
        else found
    )


def one_point(model, load: float, engine: BenchEngine, springs=None) -> ContactModel:
    """Return one point with the whole load as a contact of the compiled loops.

    Parameters
    ----------
    model : Model
    load : float
        Normal load [N].
    engine : BenchEngine
    springs : callable, optional
        See `PassOptions`.
    """
    f = model.friction
    if model.grooves is not None:
        return climbing(model, load)
    if engine.kind == ELEMENTS:
        one = make_law(f, load).element(load)
        return element_model(
            one if springs is None else parallel_element(*springs(*np.split(one.numbers[2:], 2)))
        )
    law = model.bonds
    found = engine.choice
    if found.engine == "recursion":
        return points_model(law, [1.0], [load])
    return bond_list_model(law, f.static * load, found.reach(law.order), found.merge)


def coarser_cells(few) -> CoarserRuns:
    """Return the coarse runs in which groups of four cells of a density of sliders are merged.

    few: the Pass with which they are compared.
    """
    runs = tuple(few._replace(springs=partial(join_cells, *one)) for one in CELL_MERGES)
    return CoarserRuns(runs, merged_cell_errors, few, "cells")
