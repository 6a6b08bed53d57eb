"""A rigid slide under a pressure that rides on the upper piece, by the compiled engines.

Every point shares the slide and every law but the averaged one is linear in the pressure, so all points have the
traction of one that carries the load, times their own share of it.
"""

import numpy as np

from ...dynamics.march.models import ContactModel, jenkins_model, list_model, points_model
from ...friction.bonds.quadrature import cutoff
from .engine import CLOSED, ELEMENTS, Engine
from .follow import Watch, follow
from .law import law_for
from .ledger import Slid, elastic_slip, frame_numbers, ledger_of, local_slip
from .stepped import ends_of_rest


def rigid(model, patch, path: tuple, frames: int, engine: Engine, watch: Watch) -> Slid:
    """Slide the interface along path = (time [s], slide [m]), both (k,), with `frames` frames of its tractions."""
    time, slide = path
    sigma, weight = (np.array([model.point.load]), np.ones(1)) if patch is None else \
        (patch.pressure.sigma_n, patch.pieces.interface.weight)
    load = float(weight @ sigma)
    if engine.kind == CLOSED:
        force, ledger, at, tau = _closed(model, patch, time, slide, frames)
        watch.tell(1.0)
    else:
        ages = model.friction.rest_growth is not None
        done = follow(one_point(model, load, engine), time, slide, frames, watch, ages)
        force, ledger, at = done.force, done.ledger, done.at
        tau = np.outer(force[at] / load if load > 0 else np.zeros(at.size), sigma)
    loads = np.full(time.size, load)
    return Slid(force, loads, elastic_slip(model, slide, force, loads), ledger, at, tau,
                local_slip(model, slide[at], tau, sigma))


def one_point(model, load: float, engine: Engine) -> ContactModel:
    """One point that carries the whole load [N], as a contact of the compiled loops."""
    f = model.friction
    if engine.kind == ELEMENTS:
        return jenkins_model([f.static * load / f.bond_length], [f.bond_length])
    law, found = model.bonds, engine.choice
    if found.engine == "recursion":
        return points_model(law, [1.0], [load])
    reach = cutoff(law.order, found.tail) if found.tail > 0 else np.inf
    return list_model(law, f.static * load, reach, found.merge)


def _closed(model, patch, time, slide, frames: int) -> tuple:
    """(force (k,), ledger, numbers of the frames (f,), tau (f, m)) of a law without memory: in every step it carries a
    share of its limit, and the limit is that of the way it slides."""
    law = law_for(model, patch)
    weight, sigma = (np.ones(1), np.array([model.point.load])) if patch is None else \
        (patch.pieces.interface.weight, patch.pressure.sigma_n)
    limits = np.stack([law.limit(sigma, -1.0), law.limit(sigma, 1.0)])
    move = np.diff(slide)
    share = law.share(move, np.diff(time))
    if law.holds:  # the last traction stays at rest
        last = np.maximum.accumulate(np.where(move != 0, np.arange(move.size), -1))
        share = np.where(last < 0, 0.0, share[last])
    share = np.concatenate([[0.0], share])
    way = (share > 0).astype(int)
    force = share * (limits @ weight)[way]
    spent = np.append(0.0, force[1:] * move)
    losses = np.stack([np.zeros(share.size), spent], axis=1)
    at = frame_numbers(slide.size, frames)
    tau = share[at, None] * limits[way[at]]
    for k, side in ends_of_rest(model, slide).items():
        broken = law.breaking(sigma, side)
        force[k] = weight @ broken
        tau[at == k] = broken
    return force, ledger_of(np.cumsum(spent), np.zeros(share.size), losses), at, tau
