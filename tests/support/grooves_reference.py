"""Reference for Coulomb friction on grooves whose flanks lift a mass: Newton's laws and DOP853 with events.

The closed form of the force is not used: normal force R and acceleration of the relative
displacement are the unknowns of two linear equations, along x and upwards, for each direction of
slip.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp


class Case(NamedTuple):
    """Single mode on grooves.

    mass [kg], omega [rad/s], zeta; base acceleration [m s-2] and its angular frequency [rad/s];
    load [N]; wavelength [m], amplitude [m], phase [rad]; lifted mass [kg]; mu_s, mu_k.
    """

    mass: float
    omega: float
    zeta: float
    acceleration: float
    drive: float
    load: float
    wavelength: float
    amplitude: float
    phase: float
    lifted: float
    static: float
    kinetic: float


def case_of(seed: int) -> Case:
    """Draw a random case that slips, with or without a lifted mass and a smaller kinetic coefficient."""
    rng = np.random.default_rng(seed)
    omega = 2 * np.pi * rng.uniform(80, 200)
    mass = rng.uniform(0.5, 2)
    load = rng.uniform(50, 200)
    wavelength = rng.uniform(40e-6, 120e-6)
    static = rng.uniform(0.1, 0.6)
    steep = rng.uniform(0.1, 0.7)
    acceleration = rng.uniform(0.8, 1.4) * load * (static + rng.uniform(0, 1) * steep) / mass
    return Case(
        mass,
        omega,
        rng.uniform(0.001, 0.05),
        acceleration,
        omega * rng.uniform(0.9, 1.1),
        load,
        wavelength,
        steep * wavelength / (2 * np.pi),
        rng.uniform(0, 2 * np.pi),
        mass * rng.choice([0.0, 0.2, 0.6]),
        static,
        static * rng.choice([1.0, 0.8]),
    )


def flank(c: Case, q: float) -> tuple:
    """Return the slope of the flank at q and its derivative, for the height z = A (1 - cos)."""
    k = 2 * np.pi / c.wavelength
    return c.amplitude * k * np.sin(k * q - c.phase), c.amplitude * k * k * np.cos(k * q - c.phase)


def forces(c: Case, t: float, q: float, v: float, way: float, mu: float) -> tuple:
    """Return the acceleration in slip, the normal force on the flank and the force along x."""
    steep, bend = flank(c, q)
    cosine = 1 / np.hypot(1, steep)
    sine = steep * cosine
    # Components of the contact force along x and upwards, per newton of normal force.
    across = sine + way * mu * cosine
    up = cosine - way * mu * sine
    free = -2 * c.zeta * c.omega * v - c.omega**2 * q - c.acceleration * np.sin(c.drive * t)
    gain, press = np.linalg.solve(
        [[c.mass, across], [-c.lifted * steep, up]],
        [c.mass * free, c.load + c.lifted * bend * v * v],
    )
    return gain, press, press * across


def held(c: Case, t: float, q: float) -> tuple:
    """Return the force needed to stick and its inclination to the flank normal, which the angle of friction limits."""
    need = c.mass * (-(c.omega**2) * q - c.acceleration * np.sin(c.drive * t))
    return need, np.arctan2(need, c.load) - np.arctan(flank(c, q)[0])


def run(c: Case, end: float, times) -> tuple:
    """Integrate a case up to `end` [s].

    Returns samples (k, 5) at `times` (k,), which must end at `end`: displacement, speed, frictional
    loss, work of the drive, work against the load; and the time at which contact is lost, infinite
    if never.
    """
    cone = np.arctan(c.static)
    t = 0.0
    y = np.zeros(5)
    out = []
    times = np.asarray(times)
    angle = held(c, 0.0, 0.0)[1]
    way = 0.0 if abs(angle) <= cone else np.sign(angle)
    while t < end:
        if way == 0.0:
            find = np.arange(t, end + 1 / c.drive, 0.002 / c.drive)
            beyond = np.array([abs(held(c, s, y[0])[1]) - cone for s in find]) > 0
            beyond[0] = False
            stop = end
            if beyond.any():
                low = find[np.argmax(beyond) - 1]
                high = find[np.argmax(beyond)]
                for _ in range(60):
                    mid = 0.5 * (low + high)
                    low, high = (low, mid) if abs(held(c, mid, y[0])[1]) > cone else (mid, high)
                stop = min(high, end)
            inside = times[(times >= t) & (times < stop)]
            out += [(s, *y) for s in inside]
            t = stop
            way = np.sign(held(c, stop, y[0])[1])
            continue

        def slopes(s, x, way=way):
            """Return the derivatives of displacement, speed and the three energies."""
            gain, press, _ = forces(c, s, x[0], x[1], way, c.kinetic)
            own = way * c.kinetic * press * np.hypot(1, flank(c, x[0])[0]) * x[1]
            return [
                x[1],
                gain,
                own,
                -c.mass * c.acceleration * np.sin(c.drive * s) * x[1],
                c.load * flank(c, x[0])[0] * x[1],
            ]

        def turns(s, x, way=way, begin=t):
            """Return the speed in the direction of slip, whose zero ends the slip; positive just after a start."""
            return way * x[1] if s > begin + 1e-9 / c.drive else 1e-12

        def lifts(s, x, way=way):
            """Return the normal force on the flank, whose zero ends the contact."""
            return forces(c, s, x[0], x[1], way, c.kinetic)[1]

        turns.terminal = True
        turns.direction = -1
        lifts.terminal = True
        found = solve_ivp(
            slopes,
            (t, end),
            y,
            "DOP853",
            dense_output=True,
            events=(turns, lifts),
            rtol=1e-12,
            atol=np.array([1e-17, 1e-14, 1e-17, 1e-17, 1e-17]),
            max_step=0.02 / c.drive,
        )
        stop = found.t[-1]
        inside = times[(times >= t) & (times < stop)]
        out += [(s, *found.sol(s)) for s in inside]
        t = stop
        y = found.y[:, -1].copy()
        if found.t_events[1].size:
            return np.array(out)[:, 1:], t
        if t >= end:
            break
        y[1] = 0.0
        angle = held(c, t, y[0])[1]
        way = 0.0 if abs(angle) <= cone else np.sign(angle)
    return np.array([*out, (end, *y)])[:, 1:], np.inf
