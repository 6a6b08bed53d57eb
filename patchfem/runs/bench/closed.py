"""A rigid slide of a law without memory, in closed form: a pressure that rides on the upper piece, a constant load.

In every step such a law carries a share of its limit, and the limit is that of the way it slides.
"""

import numpy as np

from .law import ends_of_rest, law_for, pressed
from .ledger import Slid, elastic_slip, frame_numbers, ledger_of, local_slip
from .watch import Watch

GAUSS = 8  # points in a step over a flank


def closed(model, patch, path: tuple, frames: int, watch: Watch) -> Slid:
    """Slide the interface of a law without memory along path = (time (k,) [s], slide (k,) [m]), in closed form.

    patch: the solved Patch or None; frames: how many frames of tractions are kept.
    """
    if model.grooves is not None:
        return climbed(model, patch, path, frames, watch)
    (time, slide), (sigma, weight), law = path, pressed(model, patch), law_for(model, patch)
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
    watch.tell(1.0)
    load = np.full(slide.size, float(weight @ sigma))
    return Slid(force, load, elastic_slip(model, slide, force, load),
                ledger_of(np.cumsum(spent), np.zeros(share.size), losses), at, tau,
                local_slip(model, slide[at], tau, sigma))


def climbed(model, patch, path: tuple, frames: int, watch: Watch) -> Slid:
    """As `closed`, of a slow slide over grooves: the force is N (t + phi)/(1 - phi t), phi = f/R along the flank.

    The height of the load is stored, friction's own work along the flank is dissipated; no mass is lifted.
    """
    (time, slide), (sigma, weight), law, grooves = path, pressed(model, patch), law_for(model, patch), model.grooves
    load, move, f = float(weight @ sigma), np.diff(slide), model.friction
    pace = np.divide(move, np.diff(time), out=np.zeros_like(move), where=np.diff(time) > 0)
    if law.holds:
        last = np.maximum.accumulate(np.where(move != 0, np.arange(move.size), -1))
        way = np.append(0.0, np.where(last < 0, 0.0, np.sign(move)[last]))
        least, most = (grooves.ratio(slide[0], side, f.static) for side in (-1.0, 1.0))
        ratio = grooves.ratio(slide, way, law.kinetic)
        ratio[way == 0] = np.clip(0.0, least, most)  # at rest before the motion the flank holds what it must
        own = grooves.lost(slide[:-1], slide[1:], law.kinetic)
    else:
        ratio, own = _paced(law, grooves, slide, move, pace)
    work = np.append(0.0, np.cumsum(load * (grooves.rise(slide[:-1], slide[1:]) + own)))
    losses = np.stack([np.zeros(slide.size), np.append(0.0, load * own)], axis=1)
    for k, side in ends_of_rest(model, slide).items():
        ratio[k] = grooves.ratio(slide[k], side, f.static)
    at, force, loads = frame_numbers(slide.size, frames), load * ratio, np.full(slide.size, load)
    watch.tell(1.0)
    tau = ratio[at, None] * sigma
    return Slid(force, loads, slide.copy(), ledger_of(work, load * grooves.height(slide), losses), at, tau,
                np.repeat(slide[at, None], sigma.size, axis=1))


def _paced(law, grooves, slide, move, pace) -> tuple:
    """(force over load (k,) [1], friction's own work per load (k - 1,) [J/N]) of a law of the speed along the flank."""
    def share(q, speed):
        along = np.sqrt(1 + grooves.slope(q)**2)
        return law.static * law.share(along * speed, 1.0)

    before = np.append(0.0, pace)
    t, phi = grooves.slope(slide), share(slide, before)
    own = np.zeros_like(move)
    for place, part in zip(*np.polynomial.legendre.leggauss(GAUSS)):
        q = slide[:-1] + 0.5 * (1 + place) * move
        steep, held = grooves.slope(q), share(q, pace)
        own += 0.5 * part * held * (1 + steep**2) / (1 - held * steep) * move
    return (t + phi) / (1 - phi * t), own
