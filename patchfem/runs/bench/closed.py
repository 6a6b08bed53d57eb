"""A rigid slide of a law without memory, in closed form: a pressure that rides on the upper piece, a constant load,
over grooves one that swings too.

In every step such a law carries a share of its limit, and the limit is that of the way it slides.
"""

import numpy as np

from .law import ends_of_rest, law_for, pressure_of
from .ledger import Slid, Watch, elastic_slip, frame_numbers, ledger_of, local_slip

GAUSS = 8  # points in a step over a flank


def closed_form(model, patch, path: tuple, frames: int, watch: Watch) -> Slid:
    """Slide the interface of a law without memory along path = (time (k,) [s], slide (k,) [m]), in closed form.

    patch: the solved Patch or None; frames: how many frames of tractions are kept.
    """
    if model.grooves is not None:
        return climbed_form(model, patch, path, frames, watch)
    (time, slide), (sigma, weight), law = path, pressure_of(model, patch), law_for(model, patch)
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


def climbed_form(model, patch, path: tuple, frames: int, watch: Watch) -> Slid:
    """As `closed_form`, of a slow slide over grooves: the force is N (t + phi)/(1 - phi t), phi = f/R along the flank.

    The height of the load is stored, friction's own work along the flank is dissipated; no mass is lifted. Under a load
    N(time) on a point what counts as stored is the work done against it, int N dz.
    """
    (time, slide), (sigma, weight), law, grooves = path, pressure_of(model, patch), law_for(model, patch), model.grooves
    move, f, varies = np.diff(slide), model.friction, model.load_varies
    load = model.point.at(time) if varies else np.full(time.size, float(weight @ sigma))
    pace = np.divide(move, np.diff(time), out=np.zeros_like(move), where=np.diff(time) > 0)
    if law.holds:
        last = np.maximum.accumulate(np.where(move != 0, np.arange(move.size), -1))
        way = np.append(0.0, np.where(last < 0, 0.0, np.sign(move)[last]))
        ratio = grooves.ratio(slide, way, law.kinetic)
        rests = np.append(True, move == 0)
        if varies:
            _held(grooves, slide, load, ratio, np.flatnonzero(rests & (way != 0)), f.static)
        at_first = way == 0
        least, most = (grooves.ratio(slide[0], side, f.static) for side in (-1.0, 1.0))
        ratio[at_first] = np.clip(0.0, least, most)  # at rest before the motion the flank holds what it must

        def share(q, speed):
            return law.kinetic * np.sign(speed)
    else:
        def share(q, speed):
            return law.static * law.share(np.sqrt(1 + grooves.slope(q)**2) * speed, 1.0)

        ratio = _ratio(grooves, slide, share(slide, np.append(0.0, pace)))
    if law.holds and not varies:
        own = load[0] * grooves.lost(slide[:-1], slide[1:], law.kinetic)
    else:
        own = over_steps(load, slide, move, lambda q: _own(grooves, q, share(q, pace)))
    height = load[0] * grooves.height(slide)
    if varies:
        height = height[0] + np.append(0.0, np.cumsum(over_steps(load, slide, move, grooves.slope)))
    rise = np.diff(height) if varies else load[0] * grooves.rise(slide[:-1], slide[1:])
    for k, side in ends_of_rest(model, slide).items():
        ratio[k] = grooves.ratio(slide[k], side, f.static)
    at = frame_numbers(slide.size, frames)
    watch.tell(1.0)
    return Slid(load * ratio, load, slide.copy(), ledger_of(np.append(0.0, np.cumsum(rise + own)), height,
                np.stack([np.zeros(slide.size), np.append(0.0, own)], axis=1)), at,
                (load[at] / model.point.load * ratio[at] if varies else ratio[at])[:, None] * sigma,
                np.repeat(slide[at, None], sigma.size, axis=1))


def _ratio(grooves, q, phi):
    """Force over vertical force [1] of a share phi = f/R along the flank at slides q [m]."""
    t = grooves.slope(q)
    return (t + phi) / (1 - phi * t)


def _own(grooves, q, phi):
    """Friction's own work per slide and vertical force [1], phi (1 + t^2)/(1 - phi t), at slides q [m]."""
    t = grooves.slope(q)
    return phi * (1 + t**2) / (1 - phi * t)


def over_steps(load, slide, move, part) -> np.ndarray:
    """int N part(q) dq [J] of every step of the slide (k,) [m], move (k - 1,) [m], under a load (k,) [N] that changes
    evenly in it; part: function of slides (k - 1,) [m]."""
    out = np.zeros_like(move)
    for place, weight in zip(*np.polynomial.legendre.leggauss(GAUSS)):
        share = 0.5 * (1 + place)
        out += 0.5 * weight * (load[:-1] + share * np.diff(load)) * part(slide[:-1] + share * move) * move
    return out


def _held(grooves, slide, load, ratio, rests, static: float) -> None:
    """Write the ratios of force to load at the samples `rests`, at which a slide has stopped while the load changes.

    The friction f along the flank stays, as it does where the load is constant, or is the limit mu R of the normal
    force R = N sqrt(1 + t^2) + f t.
    """
    for k in rests:
        t = grooves.slope(slide[k])
        long = np.sqrt(1 + t * t)
        f = (ratio[k - 1] * load[k - 1] - load[k - 1] * t) / long
        least, most = (load[k] * long * side * static / (1 - side * static * t) for side in (-1.0, 1.0))
        ratio[k] = t + min(max(f, least), most) * long / load[k]
