"""The law object that a bench steps, one per value of friction.law, and the pressure it rubs under."""

import numpy as np

from ...effects import law_has_trait
from ...friction.bonds import quadrature, recursion
from ...friction.record import law_from
from . import averaged


def law_for(model, patch=None):
    """The NumPy law object of a bench; only an averaged law looks at the patch."""
    f = model.friction
    if law_has_trait(f.law, "averaged"):
        return averaged.law_on(model, patch)
    if not law_has_trait(f.law, "bonds"):
        return law_from(f, patch.pressure.load if patch is not None else model.point.load)

    law = model.bonds
    engine = model.accuracy.quadrature
    if engine == "recursion" or (engine == "auto" and law.reading == "stretch" and law.order == 1):
        return recursion.Recursion(law)

    return quadrature.Quadrature(law, tail_of(model))


def tail_of(model) -> float:
    """What the cut-off of the NumPy sum over bonds may lose, as a share of the friction limit [1]."""
    accuracy = model.accuracy
    if accuracy.quadrature == "direct":
        return 0.0
    return accuracy.tail if accuracy.tail is not None else 1e-3 * accuracy.tolerance


def pressure_of(model, patch) -> tuple:
    """(pressure (m,) [Pa], nodal area (m,) [m2]) of the points; one point that carries the load without a patch."""
    if patch is None:
        return np.array([model.point.load]), np.ones(1)
    return patch.pressure.sigma_n, patch.pieces.interface.weight


def ends_of_rest(model, slide) -> dict:
    """Sample -> sign of the motion that starts there, where Coulomb friction holds more at rest than it does in motion:
    the first sample of a slide and the last of every rest."""
    f = model.friction
    if not law_has_trait(f.law, "set-valued") or f.kinetic is None or not f.kinetic < f.static:
        return {}
    moves = np.sign(np.diff(slide))
    ends = np.flatnonzero((moves != 0) & np.append(True, moves[:-1] == 0))
    return {int(k): float(moves[k]) for k in ends}
