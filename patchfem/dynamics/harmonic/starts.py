"""Initial guesses for harmonic balance: all solutions of the balance with one harmonic."""

from itertools import pairwise

import numpy as np
from scipy.optimize import brentq, minimize_scalar

# Number of samples per cycle; it suffices for one harmonic.
N_SAMPLES = 512


def find_one_harmonic_roots(balance, omega: float, level: float, count: int = 240) -> list:
    """Find all solutions of the one-harmonic balance at one frequency and drive amplitude.

    The search covers 1e-7 to 1e4 times the linear motion in the absence of contact.

    The balance is sampled at amplitudes of that linear motion. The result is exact for one row and an
    initial guess for several. None is found if an undamped mode is driven at its natural
    frequency.

    Parameters
    ----------
    balance : HarmonicBalance
    omega, level : float
        Frequency [rad/s] and amplitude [m s-2] of the drive.
    count : int, optional
        Number of amplitudes that are scanned.

    Returns
    -------
    list of ndarray
    """
    linear_part = balance.get_linear_part(omega, 1)
    if any(k == 1 for k, *_ in linear_part.free):
        return []
    force_to_slide = balance.faces @ linear_part.inverse[1]
    linear = 1j * level * (force_to_slide @ balance.modes.base)
    size = float(np.linalg.norm(linear))
    if size == 0:
        return []
    direction = linear / size
    receptance = force_to_slide @ balance.rows.T / balance.modes.mass

    def find_linear_motion(log):
        q = np.zeros((balance.lift.shape[0], 2), complex)
        q[:, 1] = balance.lift @ direction * np.exp(log)
        force = balance.contact.compute_force_harmonics(q, omega, 1, N_SAMPLES)[:, 1]
        return np.exp(log) + direction.conj() @ (receptance @ force)

    def find_mismatch(log):
        return abs(find_linear_motion(log)) - size

    grid = np.log(size) + np.linspace(np.log(1e-7), np.log(1e4), count)
    values = [find_mismatch(g) for g in grid]
    roots = []
    for a, b in _bracket_roots(find_mismatch, grid, values):
        log = brentq(find_mismatch, a, b, xtol=1e-10)
        residual = find_linear_motion(log)
        y = direction * np.exp(log) * (residual.conjugate() / abs(residual))
        roots.append(
            np.concatenate([*([0.0, v.real, v.imag] for v in y), np.zeros(len(linear_part.free))])
        )
    return roots


def _bracket_roots(function, grid, values) -> list:
    """Return intervals (a, b) that enclose the sign changes of a function on a grid (k,).

    A sample closer to zero than its neighbours may hide two roots; its minimum is then located.
    """
    points = list(zip(grid, values))
    for k in range(1, len(grid) - 1):
        sign = np.sign(values[k])
        if all(0 < sign * values[k] < sign * v for v in (values[k - 1], values[k + 1])):
            low = minimize_scalar(
                lambda x, sign=sign: sign * function(x),
                bounds=(grid[k - 1], grid[k + 1]),
                method="bounded",
                options={"xatol": 1e-8},
            )
            if low.fun < 0:
                points.append((float(low.x), sign * low.fun))
    points.sort()
    return [(a, b) for (a, u), (b, v) in pairwise(points) if u * v <= 0]
