"""Reference for Coulomb friction on grooves whose flanks lift a mass: Newton's laws and DOP853 with events.

The closed form of the force is not used: normal force R and acceleration of the relative
displacement are the unknowns of two linear equations, along x and upwards, for each direction of
slip.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp


class GrooveCase(NamedTuple):
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


def draw_case(seed: int) -> GrooveCase:
    """Draw a random case that slips, with or without a lifted mass and a smaller kinetic coefficient."""
    rng = np.random.default_rng(seed)
    omega = 2 * np.pi * rng.uniform(80, 200)
    mass = rng.uniform(0.5, 2)
    load = rng.uniform(50, 200)
    wavelength = rng.uniform(40e-6, 120e-6)
    static = rng.uniform(0.1, 0.6)
    steep = rng.uniform(0.1, 0.7)
    acceleration = rng.uniform(0.8, 1.4) * load * (static + rng.uniform(0, 1) * steep) / mass
    return GrooveCase(
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


def flank_slope(case: GrooveCase, q: float) -> tuple:
    """Return the slope of the flank at q and its derivative, for the height z = A (1 - cos)."""
    k = 2 * np.pi / case.wavelength
    return case.amplitude * k * np.sin(k * q - case.phase), case.amplitude * k * k * np.cos(
        k * q - case.phase
    )


def sliding_forces(
    c: GrooveCase, t: float, q: float, v: float, direction: float, mu: float
) -> tuple:
    """Return the acceleration in slip, the normal force on the flank and the force along x."""
    slope, curvature = flank_slope(c, q)
    cosine = 1 / np.hypot(1, slope)
    sine = slope * cosine
    # Components of the contact force along x and upwards, per newton of normal force.
    horizontal = sine + direction * mu * cosine
    vertical = cosine - direction * mu * sine
    free = -2 * c.zeta * c.omega * v - c.omega**2 * q - c.acceleration * np.sin(c.drive * t)
    acceleration, normal_force = np.linalg.solve(
        [[c.mass, horizontal], [-c.lifted * slope, vertical]],
        [c.mass * free, c.load + c.lifted * curvature * v * v],
    )
    return acceleration, normal_force, normal_force * horizontal


def sticking_force(c: GrooveCase, t: float, q: float) -> tuple:
    """Return the force needed to stick and its inclination to the flank normal, which the angle of friction limits."""
    force = c.mass * (-(c.omega**2) * q - c.acceleration * np.sin(c.drive * t))
    return force, np.arctan2(force, c.load) - np.arctan(flank_slope(c, q)[0])


def integrate_case(c: GrooveCase, end: float, times) -> tuple:
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
    angle = sticking_force(c, 0.0, 0.0)[1]
    direction = 0.0 if abs(angle) <= cone else np.sign(angle)
    while t < end:
        if direction == 0.0:
            scan_times = np.arange(t, end + 1 / c.drive, 0.002 / c.drive)
            beyond = np.array([abs(sticking_force(c, s, y[0])[1]) - cone for s in scan_times]) > 0
            beyond[0] = False
            stop = end
            if beyond.any():
                low = scan_times[np.argmax(beyond) - 1]
                high = scan_times[np.argmax(beyond)]
                for _ in range(60):
                    mid = 0.5 * (low + high)
                    low, high = (
                        (low, mid) if abs(sticking_force(c, mid, y[0])[1]) > cone else (mid, high)
                    )
                stop = min(high, end)
            sample_times = times[(times >= t) & (times < stop)]
            out += [(s, *y) for s in sample_times]
            t = stop
            direction = np.sign(sticking_force(c, stop, y[0])[1])
            continue

        def derivatives(s, x, way=direction):
            """Return the derivatives of displacement, speed and the three energies."""
            gain, press, _ = sliding_forces(c, s, x[0], x[1], way, c.kinetic)
            friction_power = way * c.kinetic * press * np.hypot(1, flank_slope(c, x[0])[0]) * x[1]
            return [
                x[1],
                gain,
                friction_power,
                -c.mass * c.acceleration * np.sin(c.drive * s) * x[1],
                c.load * flank_slope(c, x[0])[0] * x[1],
            ]

        def slip_speed(s, x, way=direction, begin=t):
            """Return the speed in the direction of slip, whose zero ends the slip; positive just after a start."""
            return way * x[1] if s > begin + 1e-9 / c.drive else 1e-12

        def normal_force(s, x, way=direction):
            """Return the normal force on the flank, whose zero ends the contact."""
            return sliding_forces(c, s, x[0], x[1], way, c.kinetic)[1]

        slip_speed.terminal = True
        slip_speed.direction = -1
        normal_force.terminal = True
        solution = solve_ivp(
            derivatives,
            (t, end),
            y,
            "DOP853",
            dense_output=True,
            events=(slip_speed, normal_force),
            rtol=1e-12,
            atol=np.array([1e-17, 1e-14, 1e-17, 1e-17, 1e-17]),
            max_step=0.02 / c.drive,
        )
        stop = solution.t[-1]
        sample_times = times[(times >= t) & (times < stop)]
        out += [(s, *solution.sol(s)) for s in sample_times]
        t = stop
        y = solution.y[:, -1].copy()
        if solution.t_events[1].size:
            return np.array(out)[:, 1:], t
        if t >= end:
            break
        y[1] = 0.0
        angle = sticking_force(c, t, y[0])[1]
        direction = 0.0 if abs(angle) <= cone else np.sign(angle)
    return np.array([*out, (end, *y)])[:, 1:], np.inf
