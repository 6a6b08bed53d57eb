"""Independent version of the exact engine: DOP853 with events, in which every combination of slip directions is tried."""

from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp


class DrivePiece(NamedTuple):
    """Smooth piece of a drive that begins at `start` [s].

    value: function of t; amplitude: largest value; omega: largest angular frequency.
    """

    start: float
    value: Callable
    amplitude: float
    omega: float
    constant: float = 0.0


def choose_directions(
    interfaces, mass, pull, active, signs, static, kinetic, tol, most_sliding=False
):
    """Return the slip directions of all interfaces; those in `active` have zero slip velocity.

    `pull` (n,) is the acceleration without friction. Among consistent combinations the one with the
    fewest sliding interfaces is chosen, or with the most if `most_sliding` is set.
    """
    options = sorted(
        product((0, 1, -1), repeat=len(active)),
        key=lambda c: sum(map(abs, c)),
        reverse=most_sliding,
    )
    for option in options:
        trial = np.array(signs)
        trial[active] = option
        stuck = np.flatnonzero(trial == 0)
        without_stuck = pull - interfaces.T @ (np.abs(trial) * trial * kinetic) / mass
        force = np.zeros(len(interfaces))
        if stuck.size:
            rows = interfaces[stuck]
            force[stuck] = np.linalg.lstsq(rows @ rows.T / mass, rows @ without_stuck, rcond=1e-10)[
                0
            ]
        accel = interfaces @ (without_stuck - interfaces.T @ force / mass)
        is_consistent = all(
            abs(force[c]) <= static[c] * (1 + tol)
            if trial[c] == 0
            else trial[c] * accel[c] > -tol * static[c]
            for c in active
        )
        if is_consistent:
            return trial
    raise AssertionError("no choice")


def run_reference(modes, segments, static, kinetic, end, z, v, rtol=1e-12, most_sliding=False):
    """Return [(time, directions, z, v)] at the start of every smooth piece and at the end."""
    interfaces = np.asarray(modes.interfaces)
    mass = modes.mass
    n = modes.omega.size
    static, kinetic = (
        np.broadcast_to(np.asarray(x, float), (len(interfaces),)) for x in (static, kinetic)
    )
    square = modes.omega**2
    dampers = modes.damping_matrix
    scale = max(abs(s.constant) + abs(s.amplitude) for s in segments) or 1.0

    def base_acceleration(part, t):
        """Return the base acceleration in a piece of the drive."""
        if isinstance(part, DrivePiece):
            return part.value(t)
        return part.constant + part.amplitude * np.sin(part.omega * (t - part.start) + part.phase)

    def free_acceleration(part, t, z, v):
        """Return the modal accelerations without friction."""
        return -square * z - dampers @ v - modes.base * base_acceleration(part, t)

    def friction_forces(signs, part, t, z, v):
        """Return the friction forces of all interfaces for given slip directions."""
        known = free_acceleration(part, t, z, v) - interfaces.T @ (signs * kinetic) / mass
        out = signs * kinetic
        stuck = np.flatnonzero(signs == 0)
        if stuck.size:
            rows = interfaces[stuck]
            out = out.astype(float)
            out[stuck] = np.linalg.lstsq(rows @ rows.T / mass, rows @ known, rcond=1e-10)[0]
        return out

    t = 0.0
    number = 0
    states = []
    y = np.concatenate([z, v])
    signs = np.sign(np.where(np.abs(interfaces @ v) > 1e-13, interfaces @ v, 0.0)).astype(int)
    active = list(np.flatnonzero(signs == 0))
    max_rate = max(modes.omega.max(), *(s.omega for s in segments), np.linalg.norm(dampers, 2))
    while t < end:
        part = segments[number]
        stop = min(end, segments[number + 1].start if number + 1 < len(segments) else end)
        if active:
            signs = choose_directions(
                interfaces,
                mass,
                free_acceleration(part, t, y[:n], y[n:]),
                active,
                signs,
                static,
                kinetic,
                1e-9,
                most_sliding,
            )
        states.append((t, tuple(signs), y[:n].copy(), y[n:].copy()))

        def slope(t, y, signs=signs, part=part):
            """Return the time derivative of the state."""
            force = friction_forces(signs, part, t, y[:n], y[n:])
            return np.concatenate(
                [y[n:], free_acceleration(part, t, y[:n], y[n:]) - interfaces.T @ force / mass]
            )

        events = []
        for c, s in enumerate(signs):
            if s:
                events.append((lambda t, y, c=c, s=s: s * (interfaces[c] @ y[n:])))
            else:
                for side in (1, -1):
                    events.append(
                        (
                            lambda t, y, c=c, side=side, signs=signs, part=part: (
                                static[c] - side * friction_forces(signs, part, t, y[:n], y[n:])[c]
                            )
                        )
                    )
        for f in events:
            f.terminal = True
            f.direction = -1
        solution = solve_ivp(
            slope,
            (t, stop),
            y,
            "DOP853",
            events=events,
            rtol=rtol,
            atol=1e-15 * scale / max_rate**2,
            max_step=0.1 / max_rate,
        )
        t = solution.t[-1]
        y = solution.y[:, -1].copy()
        active = list(np.flatnonzero(signs == 0))
        if solution.status == 0:
            number += t >= stop and number + 1 < len(segments)
            continue
        k = next(i for i, hit in enumerate(solution.t_events) if hit.size)
        names = [(c, side) for c, s in enumerate(signs) for side in ((0,) if s else (1, -1))]
        face, side = names[k]
        force = friction_forces(signs, part, t, y[:n], y[n:])
        if side == 0:
            active = sorted({*active, face})
        speed = interfaces @ y[n:]
        speed_scale = np.abs(interfaces) @ np.abs(y[n:])
        active = sorted(
            {
                *active,
                *(c for c, s in enumerate(signs) if s and abs(speed[c]) < 1e-11 * speed_scale[c]),
            }
        )
        rows = interfaces[active]
        y[n:] -= np.linalg.pinv(rows) @ (rows @ y[n:])
        signs = np.array(signs)
        if side:
            signs[face] = side
            active = [c for c in active if c != face]
            if abs(force[face]) < static[face] * (1 - 1e-9):
                raise AssertionError("released below its limit")
    states.append((end, tuple(signs), y[:n].copy(), y[n:].copy()))
    return states


def march_reference(modes, drive, limit, end, z, v, steps):
    """Return (time, z) of Moreau's time stepping with theta = 1/2, solved by Gauss-Seidel iteration.

    Impulses within +-limit h either prevent the mean slip of an interface or oppose it; static and
    kinetic friction equal limit (i,).
    """
    interfaces = np.asarray(modes.interfaces)
    n = modes.omega.size
    h = end / steps
    inverse = np.linalg.inv(
        np.eye(n) + h / 2 * modes.damping_matrix + h * h / 4 * np.diag(modes.omega**2)
    )
    gram = interfaces @ inverse @ interfaces.T / modes.mass
    force = np.zeros(len(interfaces))
    t = h * (np.arange(steps) + 0.5)
    drives = drive.values(t)
    out = [z]
    for k in range(steps):
        free = inverse @ (
            v
            + h
            * (
                -modes.base * drives[k]
                - modes.omega**2 * (z + h / 4 * v)
                - modes.damping_matrix @ v / 2
            )
        )
        mean_speed = interfaces @ (free + v) / 2
        for _ in range(200):
            previous = force.copy()
            for c in range(len(interfaces)):
                force[c] = np.clip(
                    force[c] + (mean_speed[c] - h / 2 * gram[c] @ force) / (h / 2 * gram[c, c]),
                    -limit[c],
                    limit[c],
                )
            if np.abs(force - previous).max() < 1e-13 * limit.max():
                break
        new = free - h * inverse @ (interfaces.T @ force) / modes.mass
        z = z + h * (v + new) / 2
        v = new
        out.append(z)
    return np.linspace(0, end, steps + 1), np.array(out)
