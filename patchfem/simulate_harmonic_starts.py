"""Starts for the balance: every motion that one harmonic would make."""

import numpy as np
from scipy.optimize import brentq

SAMPLES = 512  # of the cycle, enough for one harmonic


def one_harmonic(balance, omega: float, level: float, count: int = 240) -> list:
    """Unknowns of every root of the one-harmonic balance between 1e-7 and 1e4 of the free linear motion.

    The balance is scanned over the amplitude along the free linear motion: exact for one row, a start for more. None is
    found where a mode without receptance is driven at its own frequency.
    """
    here = balance.plant(omega, 1)
    if any(k == 1 for k, *_ in here.free):
        return []
    through = balance.faces @ here.inverse[1]
    linear = 1j * level * (through @ balance.modes.base)
    size = float(np.linalg.norm(linear))
    if size == 0:
        return []
    along, receptance = linear / size, through @ balance.rows.T / balance.modes.mass

    def left(log):
        q = np.zeros((balance.lift.shape[0], 2), complex)
        q[:, 1] = balance.lift @ along * np.exp(log)
        force = balance.contact.force(q, omega, 1, SAMPLES)[:, 1]
        return np.exp(log) + along.conj() @ (receptance @ force)

    def miss(log):
        return abs(left(log)) - size

    grid = np.log(size) + np.linspace(np.log(1e-7), np.log(1e4), count)
    values = [miss(g) for g in grid]
    out = []
    for a, b, va, vb in zip(grid[:-1], grid[1:], values[:-1], values[1:]):
        if va * vb > 0:
            continue
        log = brentq(miss, a, b, xtol=1e-10)
        turn = left(log)
        y = along * np.exp(log) * (turn.conjugate() / abs(turn))
        out.append(np.concatenate([*([0.0, v.real, v.imag] for v in y), np.zeros(len(here.free))]))
    return out
