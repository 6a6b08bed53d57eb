"""Friction law that a bench evaluates, and the pressure under which its interface slides.

In: a model with friction and its patch. Out: a NumPy law object for any value of friction.law,
nodal pressures and areas.
"""

import numpy as np

from ...effects import law_has_trait
from ...friction.bonds import quadrature, recursion
from ...friction.record import make_law
from . import averaged


def make_numpy_law(model, patch=None):
    """Return the NumPy object of the friction law of a model.

    Only an averaged law depends on the patch.
    """
    f = model.friction
    if law_has_trait(f.law, "averaged"):
        return averaged.make_averaged_law(model, patch)
    if not law_has_trait(f.law, "bonds"):
        return make_law(f, patch.pressure.load if patch is not None else model.point.load)

    law = model.bonds
    engine = model.accuracy.quadrature
    if engine == "recursion" or (engine == "auto" and law.reading == "stretch" and law.order == 1):
        return recursion.FirstOrderBonds(law)

    return quadrature.Quadrature(law, estimate_tail_loss(model))


def estimate_tail_loss(model) -> float:
    """Return the cut-off error of the NumPy sum over bonds relative to the friction limit [1]."""
    accuracy = model.accuracy
    if accuracy.quadrature == "direct":
        return 0.0
    return accuracy.tail if accuracy.tail is not None else 1e-3 * accuracy.tolerance


def nodal_pressure(model, patch) -> tuple:
    """Return pressure (m,) [Pa] and area (m,) [m2] of the interface nodes.

    Without a patch there is a single point that carries the load.
    """
    if patch is None:
        return np.array([model.point.load]), np.ones(1)
    return patch.pressure.sigma_n, patch.pieces.interface.weight


def find_rest_ends(model, slide) -> dict:
    """Return the samples where motion starts from rest with static above kinetic friction.

    They are the first sample of the path and the last one of every rest; the values are the signs
    of the motion that starts there. The dict is empty unless static exceeds kinetic Coulomb
    friction.
    """
    f = model.friction
    if not law_has_trait(f.law, "set-valued") or f.kinetic is None or not f.kinetic < f.static:
        return {}
    moves = np.sign(np.diff(slide))
    ends = np.flatnonzero((moves != 0) & np.append(True, moves[:-1] == 0))
    return {int(k): float(moves[k]) for k in ends}
