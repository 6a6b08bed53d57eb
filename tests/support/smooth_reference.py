"""Modes under a smooth law by SciPy's DOP853 between located reversals, with the rate equations of `motion_laws`."""

from collections.abc import Callable
from typing import NamedTuple

import motion_laws
import numpy as np
from scipy.integrate import solve_ivp


class RateForm(NamedTuple):
    """Law as rate equations: initial states, rates(y, v, way) of the states, force(y, v, way)."""

    start: list
    rates: Callable
    force: Callable


def make_rate_form(law: motion_laws.Law, start=(0.0,)) -> RateForm:
    """Return the rate equations of a law without a set-valued force."""

    def rates(y, v, way):
        """Return the rates of the states."""
        law.choose_branch(y, v, way)
        return law.rate(y, v, 0.0)

    def force(y, v, way):
        """Return the friction force."""
        law.choose_branch(y, v, way)
        return law.force(y, v, 0.0)

    return RateForm(list(start), rates, force)


def bonds_form(law, load) -> RateForm:
    """Return the rate form of `Bonds` in the stretch reading, p = 1."""
    keys = {"bond_length": law.length, "static": law.static, "kinetic": law.ratio * law.static}
    if law.has_growth:
        names = ("rest_growth", "slip_growth", "rest_speed")
        keys |= {name: getattr(law, name) for name in names}
    if law.initial < 1.0:
        reference = motion_laws.MaturingLaw(law.static * load, initial=law.initial, **keys)
    else:
        reference = motion_laws.StretchLaw(law.static * load, **keys)
    return make_rate_form(reference, reference.start())


def lugre_form(law, load) -> RateForm:
    """Return the rate form of `LuGre`."""
    per_newton = {
        name: load * getattr(law, name) for name in ("stiffness", "micro_damping", "viscous")
    }
    keys = {"static": law.static, "kinetic": law.kinetic, "stribeck_speed": law.speed}
    return make_rate_form(motion_laws.LuGreLaw(law.static * load, **keys, **per_newton))


def bouc_wen_form(law, load) -> RateForm:
    """Return the rate form of `BoucWen`."""
    limit = law.static * load
    keys = {"stiffness": limit / law.length, "exponent": law.exponent, "shape": law.shape}
    return make_rate_form(motion_laws.BoucWenLaw(limit, **keys))


def tanh_form(law, load) -> RateForm:
    """Return the rate form of `Rate`."""
    return make_rate_form(motion_laws.TanhLaw(law.static * load, reference_speed=law.speed), ())


def integrate_modes(modes, drive, form, end, times, start=None, kink=None, rtol=1e-12):
    """Return (coordinates (n, k), forces (k,)) at times (k,) [s].

    The integration is restarted at reversals, at zeros of kink(y, v), and at the limits of the
    drive's segments.
    """
    initial_states, rates, force = form
    n = modes.omega.size
    period = drive.period
    limits = (
        [s.start for s in drive.segments[1:]]
        if drive.segments
        else list(getattr(drive, "time", []))
    )
    y = np.concatenate([np.zeros(2 * n) if start is None else [*start.z, *start.v], initial_states])
    damping = modes.damping_matrix
    t = 0.0
    direction = 0.0
    out = np.zeros((n, len(times)))
    forces = np.zeros(len(times))

    def derivatives(t, y, way, edge):
        """Return the time derivative of the state."""
        z = y[:n]
        v = y[n : 2 * n]
        speed = modes.slide @ v
        push = float(drive.values(min(t, np.nextafter(edge, -np.inf))))
        pull = force(y[2 * n :], speed, way)
        return [
            *v,
            *(
                -damping @ v
                - modes.omega**2 * z
                - modes.base * push
                - modes.slide * pull / modes.mass
            ),
            *rates(y[2 * n :], speed, way),
        ]

    while t < end:
        edge = min([b for b in limits if b > t + 1e-15] + [end])
        if direction == 0:
            trial = solve_ivp(
                derivatives, (t, t + 1e-6 * period), y, args=(1.0, edge), rtol=1e-10, atol=1e-18
            )
            direction = np.sign(modes.slide @ trial.y[n : 2 * n, -1]) or 1.0

        def velocity(t, y, way, edge):
            """Return the velocity at the interface, whose zero is a reversal."""
            return modes.slide @ y[n : 2 * n]

        def kink_value(t, y, way, edge):
            """Return the value of kink, whose zero is a discontinuity of the law."""
            return kink(y[2 * n :], modes.slide @ y[n : 2 * n]) if kink is not None else 1.0

        velocity.terminal = True
        velocity.direction = -direction
        kink_value.terminal = True
        first = min(1e-6 * period, edge - t)
        solution = solve_ivp(
            derivatives,
            (t, edge),
            y,
            "DOP853",
            args=(direction, edge),
            events=[velocity, kink_value],
            dense_output=True,
            rtol=rtol,
            atol=np.maximum(1e-16, 1e-14 * np.abs(y)),
            first_step=first,
            max_step=period / 20,
        )
        is_inside = (times >= t) & (times <= solution.t[-1])
        states = solution.sol(times[is_inside]) if is_inside.any() else np.zeros((y.size, 0))
        out[:, is_inside] = states[:n]
        forces[is_inside] = [
            force(s[2 * n :], modes.slide @ s[n : 2 * n], direction) for s in states.T
        ]
        is_reversal = solution.t_events[0].size > 0
        t = solution.t[-1]
        y = solution.y[:, -1].copy()
        if is_reversal:
            direction = -direction
            if n == 1:
                y[1] = 0.0
        # A small step past the kink, which would otherwise end the next piece at once.
        elif solution.t_events[1].size:
            step = 1e-9 * period
            y = y + step * np.array(derivatives(t, y, direction, edge))
            t = t + step
    return out, forces
