"""Friction law of a bench run as an object, and the pressure at the interface nodes.

In: a model with friction and its Patch. Out: a law object for any value of friction.law, nodal
pressures and areas.
"""

import numpy as np

from ...effects import law_has_trait
from ...friction.bonds import points
from ...friction.record import make_law
from . import averaged_law
from .engine import uses_parallel_elements


def make_numpy_law(model, patch=None, choice=None):
    """Return the friction law of a model as an object whose steps NumPy calls.

    Parameters
    ----------
    model : Model
    patch : Patch, optional
        Patch of an averaged law.
    choice : EngineChoice, optional
        Method of the sum over bonds of the nonlocal law.
    """
    f = model.friction
    if law_has_trait(f.law, "averaged"):
        return averaged_law.make_averaged_law(model, patch)
    if not law_has_trait(f.law, "bonds"):
        return make_law(f, patch.pressure.load if patch is not None else model.point.load)
    if choice.engine == "recursion":
        return points.FirstOrderBonds(model.bonds)
    return points.ListedBonds(model.bonds, choice.tail, choice.merge)


def nodal_pressure(model, patch) -> tuple:
    """Return the pressures (m,) [Pa] and the areas (m,) [m2] of the interface nodes.

    Without a patch, a single point carries the load.
    """
    if patch is None:
        return np.array([model.point.load]), np.ones(1)
    return patch.pressure.sigma_n, patch.pieces.interface.weight


def find_rest_ends(model, slide) -> dict:
    """Return the samples at which sliding starts from rest, with the sign of the motion.

    These are the first sample of the path and the last sample of each rest. The dict is empty
    unless the static Coulomb coefficient exceeds the kinetic one.
    """
    f = model.friction
    if not law_has_trait(f.law, "set-valued") or f.kinetic is None or not f.kinetic < f.static:
        return {}
    moves = np.sign(np.diff(slide))
    ends = np.flatnonzero((moves != 0) & np.append(True, moves[:-1] == 0))
    return {int(k): float(moves[k]) for k in ends}


def nodal_element_limit(model, patch):
    """Return the nodal friction limits (m,) [Pa] of parallel elements; None for other methods."""
    return model.friction.static * patch.pressure.sigma_n if uses_parallel_elements(model) else None
