"""A slide behind the pieces' own shear: the exact set of elements, or bond points behind the shear modes."""

import numpy as np

from ...core import NotConverged
from ...dynamics.march.models import jenkins_model, points_model
from ...effects import has
from ...friction.record import law_from
from ...slip.fields import element_fields, point_fields, shear_of
from ..patch.shared.kept import elements
from .follow import follow
from .ledger import Slid
from .watch import Watch


def with_shear(model, patch, time, slide, frames: int, watch: Watch) -> Slid:
    """Slide the holders along the samples time [s], slide [m] (k,). NotConverged where a step misses its residual."""
    if has(model.friction.law, "bonds"):
        return _points(model, patch, time, slide, frames, watch)
    return _elements(model, patch, time, slide, frames, watch)


def _elements(model, patch, time, slide, frames, watch) -> Slid:
    """Coulomb and elastic-plastic points: parallel elements."""
    f = model.friction
    length = law_from(f).element(1.0).length
    found = elements(patch, f.static, length)
    done = follow(jenkins_model(found.stiffness, found.yield_slide), time, slide, frames, watch)
    tau, local = element_fields(patch, found, done.states, length)
    return Slid(done.force, np.full(time.size, patch.pressure.load), done.slip, done.ledger, done.at, tau, local)


def _points(model, patch, time, slide, frames, watch) -> Slid:
    """Bond points behind the shear modes."""
    law = model.bonds
    weight, sigma = patch.pieces.interface.weight, patch.pressure.sigma_n
    shear = shear_of(patch, law, model.accuracy.shear_modes, model.accuracy.tolerance)
    done = follow(points_model(law, weight, sigma, shear), time, slide, frames, watch, law.grows)
    if done.missed:
        raise NotConverged(f"{done.missed} steps of the bench missed the force residual; raise "
                           "accuracy.steps_per_cycle", "")
    tau, local = point_fields(patch, law, shear, done.states)
    return Slid(done.force, np.full(time.size, patch.pressure.load), done.slip, done.ledger, done.at, tau, local)
