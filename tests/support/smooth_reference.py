"""Modes under a smooth law by SciPy's DOP853 between located reversals: rate equations written out law by law."""

import numpy as np
from scipy.integrate import solve_ivp


def bonds(law, load):
    """Rate form of `Bonds` in the stretch reading, p = 1: (states at the start, rates(y, v, way), force(y, v, way))."""

    def rates(y, v, way):
        eps, m, z, _ = y
        grow = 0.0
        if law.grows:
            grow = law.rest_growth / max(abs(v), law.rest_speed) * (law.length - eps) + abs(
                v
            ) / law.slip_growth * (law.ratio * law.length - eps)
        return [
            grow,
            abs(v) * (1 - m) / eps,
            m * v - abs(v) * z / eps,
            2 * z * v - abs(v) * y[3] / eps,
        ]

    weight = law.static * load / law.length
    return [law.length, law.initial, 0.0, 0.0], rates, lambda y, v, way: weight * y[2]


def lugre(law, load):
    """Rate form of `LuGre`."""
    k = law.stiffness * load

    def rates(y, v, way):
        g = load * (law.kinetic + (law.static - law.kinetic) * np.exp(-((v / law.speed) ** 2)))
        return [v - k * abs(v) * y[0] / g]

    return (
        [0.0],
        rates,
        lambda y, v, way: (
            k * y[0] + load * (law.micro_damping * rates(y, v, way)[0] + law.viscous * v)
        ),
    )


def bouc_wen(law, load):
    """Rate form of `BoucWen`."""

    def rates(y, v, way):
        s = law.shape
        return [
            v / law.length * (1 - abs(y[0]) ** law.exponent * (s * np.sign(way * y[0]) + 1 - s))
        ]

    return [0.0], rates, lambda y, v, way: law.static * load * y[0]


def tanh(law, load):
    """Rate form of `Rate`."""
    return [], lambda y, v, way: [], lambda y, v, way: law.static * load * np.tanh(v / law.speed)


def integrate(modes, drive, form, end, times, start=None, kink=None, rtol=1e-12):
    """(coordinates (n, k), forces (k,)) at times (k,) [s], pieces: between reversals of the slide, kinks kink(y) of the
    law's states and borders of the drive's segments every piece is integrated by itself."""
    begin, rates, force = form
    n, period = modes.omega.size, drive.period
    borders = (
        [s.start for s in drive.segments[1:]]
        if drive.segments
        else list(getattr(drive, "time", []))
    )
    y = np.concatenate([np.zeros(2 * n) if start is None else [*start.z, *start.v], begin])
    damping, t, way = modes.dampers, 0.0, 0.0
    out, forces = np.zeros((n, len(times))), np.zeros(len(times))

    def slope(t, y, way, edge):
        z, v = y[:n], y[n : 2 * n]
        speed, push = modes.slide @ v, float(drive.values(min(t, np.nextafter(edge, -np.inf))))
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
        edge = min([b for b in borders if b > t + 1e-15] + [end])
        if way == 0:
            look = solve_ivp(
                slope, (t, t + 1e-6 * period), y, args=(1.0, edge), rtol=1e-10, atol=1e-18
            )
            way = np.sign(modes.slide @ look.y[n : 2 * n, -1]) or 1.0

        def stops(t, y, way, edge):
            return modes.slide @ y[n : 2 * n]

        def bends(t, y, way, edge):
            return kink(y[2 * n :], modes.slide @ y[n : 2 * n]) if kink is not None else 1.0

        stops.terminal, stops.direction, bends.terminal = True, -way, True
        first = min(1e-6 * period, edge - t)
        done = solve_ivp(
            slope,
            (t, edge),
            y,
            "DOP853",
            args=(way, edge),
            events=[stops, bends],
            dense_output=True,
            rtol=rtol,
            atol=np.maximum(1e-16, 1e-14 * np.abs(y)),
            first_step=first,
            max_step=period / 20,
        )
        here = (times >= t) & (times <= done.t[-1])
        states = done.sol(times[here]) if here.any() else np.zeros((y.size, 0))
        out[:, here] = states[:n]
        forces[here] = [force(s[2 * n :], modes.slide @ s[n : 2 * n], way) for s in states.T]
        turned = done.t_events[0].size > 0
        t, y = done.t[-1], done.y[:, -1].copy()
        if turned:
            way = -way
            if n == 1:
                y[1] = 0.0
        elif done.t_events[1].size:  # beyond the kink, which would end the next piece at once
            step = 1e-9 * period
            y, t = y + step * np.array(slope(t, y, way, edge)), t + step
    return out, forces
