"""The bench along a slide in two directions: the `lateral` column of slide.file beside its displacement."""

import numpy as np

from ...friction.bonds.quadrature import Quadrature
from ...friction.bonds.recursion import Recursion
from .law import tail_of
from .ledger import Slid, frame_numbers, ledger_of, split
from .stepped import refuse_costly
from .watch import BLOCK, Watch


def run_plane(model, patch, time, slide, frames: int, watch: Watch) -> tuple:
    """(Slid along x, histories of the other direction by name; `pairs` are the (slide, force) of that direction).

    Pressure that rides on a rigid mover is constant at every point and the law is linear in it, so every point has the
    traction of one point under unit pressure times its own. yaw_moment [N m]: sum of y f_x - x f_y, about +z of the
    friction on the upper piece, f positive against its slip; strips have their places y over the width.
    """
    law = law_for(model)
    refuse_costly(model, law, time.size, 1, slide)
    across = np.interp(time, model.slide.corners[0], model.slide.across)
    q, one = np.stack([slide, across], axis=1), np.ones(1)
    state, unit = law.start(one, 2), np.zeros((time.size, 2))
    work, stored, losses = np.zeros(time.size), np.zeros(time.size), np.zeros((time.size, 2))
    for k in range(1, time.size):
        step = law.step(state, q[k] - q[k - 1], one, one, time[k] - time[k - 1])
        state = step.state
        unit[k], stored[k] = law.traction(state)[:, 0], law.stored(state)[0]
        work[k] = work[k - 1] + (q[k] - q[k - 1]) @ step.mean[:, 0]
        losses[k] = split(step.dissipated)
        if k % BLOCK == 0 or k == time.size - 1:
            watch.tell(k / (time.size - 1))
    load, moment, roll = _pressed(model, patch)
    at = frame_numbers(time.size, frames)
    sigma = patch.pressure.sigma_n if patch is not None else np.array([load])
    give = law.law.length / law.law.static if law.law.static > 0 else 0.0
    slip = slide - give * unit[:, 0]
    local = np.where(sigma > 0, slip[at, None], slide[at, None])
    more = {"lateral": across, "lateral_force": load * unit[:, 1], "pairs": [(across, load * unit[:, 1])]}
    if patch is not None:
        more["yaw_moment"] = roll * unit[:, 0] - moment * unit[:, 1]
    return Slid(load * unit[:, 0], np.full(time.size, load), slip, load * ledger_of(work, stored, losses), at,
                np.outer(unit[at, 0], sigma), local), more


def law_for(model):
    """The law object of a bench in two directions: the recursion, or the sum for other orders and readings."""
    law = model.bonds
    if law.reading == "stretch" and law.order == 1:
        return Recursion(law)
    return Quadrature(law, tail_of(model))


def _pressed(model, patch) -> tuple:
    """(load [N], sum f x, sum f y [N m]) of the pressure; y from the strips, 0 without them."""
    if patch is None:
        return model.point.load, 0.0, 0.0
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    roll = patch.strips.roll_moment if patch.strips is not None else 0.0
    return float(force.sum()), float(force @ patch.x), roll
