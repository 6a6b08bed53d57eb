"""Rigid slide of a law without memory in closed form, under a constant load.

In: a model whose pressure moves with the upper piece, and a path. Out: `SlideHistories`. In every step,
the force of such a law is a fraction of its limit, and the limit depends only on the direction
of the slide.
"""

import numpy as np

from .law import ends_of_rest, law_for, nodal_pressure
from .ledger import (
    PassOptions,
    SlideHistories,
    elastic_slip,
    frame_numbers,
    local_slip,
    make_ledger,
)

GAUSS = 8  # Gauss points in a step over a flank


def closed_form(model, patch, path: tuple, frames: int, watch: PassOptions) -> SlideHistories:
    """Slide the interface of a law without memory along a path, in closed form.

    Parameters
    ----------
    model : Model
    patch : Patch or None
    path : tuple
        time (k,) [s] and slide (k,) [m].
    frames : int
        Number of frames of the tractions.
    watch : PassOptions

    Returns
    -------
    SlideHistories
    """
    if model.grooves is not None:
        return closed_form_on_grooves(model, patch, path, frames, watch)
    (time, slide), (sigma, weight), law = path, nodal_pressure(model, patch), law_for(model, patch)
    limits = np.stack([law.limit(sigma, -1.0), law.limit(sigma, 1.0)])
    move = np.diff(slide)
    share = law.limit_fraction(move, np.diff(time))
    if law.has_force_at_rest:  # the last traction persists during rest
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
        broken = law.breakaway_traction(sigma, side)
        force[k] = weight @ broken
        tau[at == k] = broken
    watch.tell(1.0)
    load = np.full(slide.size, float(weight @ sigma))
    return SlideHistories(
        force,
        load,
        elastic_slip(model, slide, force, load),
        make_ledger(np.cumsum(spent), np.zeros(share.size), losses),
        at,
        tau,
        local_slip(model, slide[at], tau, sigma),
    )


def closed_form_on_grooves(
    model, patch, path: tuple, frames: int, watch: PassOptions
) -> SlideHistories:
    """Slide a law without memory slowly over grooves, in closed form.

    The force is N (t + phi)/(1 - phi t), with the slope t and phi = f/R along the flank. The lift
    of the load is stored energy, the friction work along the flank is dissipated; no mass is
    lifted. The parameters are those of `closed_form`.
    """
    (time, slide), (sigma, weight), law, grooves = (
        path,
        nodal_pressure(model, patch),
        law_for(model, patch),
        model.grooves,
    )
    load = float(weight @ sigma)
    move = np.diff(slide)
    if law.has_force_at_rest:
        last = np.maximum.accumulate(np.where(move != 0, np.arange(move.size), -1))
        way = np.append(0.0, np.where(last < 0, 0.0, np.sign(move)[last]))
        ratio = grooves.force_ratio(slide, way, law.kinetic)
        lowest, highest = (
            grooves.force_ratio(slide[0], side, model.friction.static) for side in (-1.0, 1.0)
        )
        # at rest before the motion, friction on the flank takes the value that balances the load
        ratio[way == 0] = np.clip(0.0, lowest, highest)
        own = load * grooves.friction_loss(slide[:-1], slide[1:], law.kinetic)
    else:
        duration = np.diff(time)
        speed = np.divide(move, duration, out=np.zeros_like(move), where=duration > 0)
        t, phi = _along_flank(grooves, law, slide, np.append(0.0, speed))
        ratio = (t + phi) / (1 - phi * t)

        def own_force(q):
            """Return the dissipated work per slide [N] at slides (k - 1,) [m]."""
            t, phi = _along_flank(grooves, law, q, speed)
            return load * phi * (1 + t**2) / (1 - phi * t)

        own = integrate_steps(slide, own_force)
    rise = load * grooves.height_difference(slide[:-1], slide[1:])
    for k, side in ends_of_rest(model, slide).items():
        ratio[k] = grooves.force_ratio(slide[k], side, model.friction.static)
    at = frame_numbers(slide.size, frames)
    watch.tell(1.0)
    losses = np.stack([np.zeros(slide.size), np.append(0.0, own)], axis=1)
    ledger = make_ledger(
        np.append(0.0, np.cumsum(rise + own)), load * grooves.height(slide), losses
    )
    return SlideHistories(
        load * ratio,
        np.full(time.size, load),
        slide.copy(),
        ledger,
        at,
        ratio[at, None] * sigma,
        np.repeat(slide[at, None], sigma.size, axis=1),
    )


def integrate_steps(slide, integrand) -> np.ndarray:
    """Integrate integrand(q) over q in every step of a slide by Gauss quadrature, (k - 1,).

    Parameters
    ----------
    slide : (k,)
        [m].
    integrand : callable
        Function of slides (k - 1,) [m].
    """
    move = np.diff(slide)
    out = np.zeros_like(move)
    for place, weight in zip(*np.polynomial.legendre.leggauss(GAUSS)):
        out += 0.5 * weight * integrand(slide[:-1] + 0.5 * (1 + place) * move) * move
    return out


def _along_flank(grooves, law, slide, speed) -> tuple:
    """Return slope t and friction ratio f/R along the flank [1] of a law of the speed.

    At slides [m] with speeds [m/s].
    """
    t = grooves.slope(slide)
    return t, law.static * law.limit_fraction(np.sqrt(1 + t**2) * speed, 1.0)
