"""Rigid sliding of a friction law without memory under constant load, in closed form.

In: a `SlideTask` whose pressure moves with the upper piece. Out: `SlideHistories`. In every step, the
friction force is a fraction of its limit, and the limit depends only on the direction of sliding.
"""

import numpy as np

from .law import find_rest_ends, make_numpy_law, nodal_pressure
from .ledger import (
    SlideHistories,
    SlideTask,
    compute_interface_slip,
    compute_local_slip,
    stack_energies,
)

N_GAUSS_POINTS = 8  # Number of Gauss points per time step along the flank of a groove.


def slide_in_closed_form(task: SlideTask) -> SlideHistories:
    """Compute the friction histories of rigid sliding with a law without memory."""
    model = task.model
    if model.grooves is not None:
        return _slide_over_grooves_in_closed_form(task)
    slide = task.slide
    sigma, weight = nodal_pressure(model, task.patch)
    law = make_numpy_law(model, task.patch)
    limits = np.stack([law.limit(sigma, -1.0), law.limit(sigma, 1.0)])
    increments = np.diff(slide)
    fraction = law.limit_fraction(increments, np.diff(task.time))
    if law.has_force_at_rest:  # The traction of the last motion persists at rest.
        last = _find_last_moving_steps(increments)
        fraction = np.where(last < 0, 0.0, fraction[last])
    fraction = np.concatenate([[0.0], fraction])
    direction = (fraction > 0).astype(int)
    force = fraction * (limits @ weight)[direction]
    work = np.append(0.0, force[1:] * increments)
    losses = np.stack([np.zeros(fraction.size), work], axis=1)
    frames = task.frame_indices
    tau = fraction[frames, None] * limits[direction[frames]]
    for sample, sign in find_rest_ends(model, slide).items():
        traction = law.static_traction(sigma, sign)
        force[sample] = weight @ traction
        tau[frames == sample] = traction
    task.options.report(1.0)
    load = np.full(slide.size, float(weight @ sigma))
    return SlideHistories(
        force,
        load,
        compute_interface_slip(model, slide, force, load),
        stack_energies(np.cumsum(work), np.zeros(fraction.size), losses),
        frames,
        tau,
        compute_local_slip(model, slide[frames], tau, sigma),
    )


def _slide_over_grooves_in_closed_form(task: SlideTask) -> SlideHistories:
    """Compute the friction histories of quasi-static rigid sliding over grooves.

    The force is N (t + phi)/(1 - phi t), with the slope t and the friction ratio phi = f/R along
    the flank. The work of lifting the load is stored energy; the friction work along the flank is
    dissipated. Inertia is neglected.
    """
    model = task.model
    slide = task.slide
    grooves = model.grooves
    sigma, weight = nodal_pressure(model, task.patch)
    law = make_numpy_law(model, task.patch)
    load = float(weight @ sigma)
    increments = np.diff(slide)
    if law.has_force_at_rest:
        last = _find_last_moving_steps(increments)
        direction = np.append(0.0, np.where(last < 0, 0.0, np.sign(increments)[last]))
        ratio = grooves.force_ratio(slide, direction, law.kinetic)
        lowest = grooves.force_ratio(slide[0], -1.0, model.friction.static)
        highest = grooves.force_ratio(slide[0], 1.0, model.friction.static)
        # Before the motion starts, the friction on the flank balances the load as far as its limit
        # allows.
        ratio[direction == 0] = np.clip(0.0, lowest, highest)
        loss = load * grooves.friction_loss(slide[:-1], slide[1:], law.kinetic)
    else:
        duration = np.diff(task.time)
        speed = np.divide(increments, duration, out=np.zeros_like(increments), where=duration > 0)
        slope, phi = _evaluate_flank_friction(grooves, law, slide, np.append(0.0, speed))
        ratio = (slope + phi) / (1 - phi * slope)

        def loss_per_displacement(displacement):
            """Return the dissipated energy per displacement [N] at displacements (k - 1,) [m]."""
            slope, phi = _evaluate_flank_friction(grooves, law, displacement, speed)
            return load * phi * (1 + slope**2) / (1 - phi * slope)

        loss = integrate_steps(slide, loss_per_displacement)
    rise = load * grooves.height_difference(slide[:-1], slide[1:])
    for sample, sign in find_rest_ends(model, slide).items():
        ratio[sample] = grooves.force_ratio(slide[sample], sign, model.friction.static)
    frames = task.frame_indices
    task.options.report(1.0)
    losses = np.stack([np.zeros(slide.size), np.append(0.0, loss)], axis=1)
    work = np.append(0.0, np.cumsum(rise + loss))
    return SlideHistories(
        load * ratio,
        np.full(slide.size, load),
        slide.copy(),
        stack_energies(work, load * grooves.height(slide), losses),
        frames,
        ratio[frames, None] * sigma,
        np.repeat(slide[frames, None], sigma.size, axis=1),
    )


def _find_last_moving_steps(increments) -> np.ndarray:
    """Return for each step the last index up to it with a nonzero increment; -1 if there is none."""
    steps = np.where(increments != 0, np.arange(increments.size), -1)
    return np.maximum.accumulate(steps)


def integrate_steps(slide, integrand) -> np.ndarray:
    """Integrate a function of the displacement over every time step by Gauss quadrature.

    Parameters
    ----------
    slide : (k,)
        [m].
    integrand : callable
        Function of the displacements (k - 1,) [m].
    """
    move = np.diff(slide)
    out = np.zeros_like(move)
    for place, weight in zip(*np.polynomial.legendre.leggauss(N_GAUSS_POINTS)):
        out += 0.5 * weight * integrand(slide[:-1] + 0.5 * (1 + place) * move) * move
    return out


def _evaluate_flank_friction(grooves, law, slide, speed) -> tuple:
    """Return the slope t of a groove flank and the friction ratio f/R along it.

    The arguments are displacements [m] and speeds [m/s].
    """
    t = grooves.slope(slide)
    return t, law.static * law.limit_fraction(np.sqrt(1 + t**2) * speed, 1.0)
