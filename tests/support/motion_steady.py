"""Steady motion of a spec under a sine by the independent program: a long run, then Newton's method over a period."""

import numpy as np
from motion_reference import Motion

SETTLED = 40  # Cycles before Newton's method.
CLOSE = 1e-10  # Change over a period, relative to the state, at which Newton's method ends.


def periodic(motion: Motion, period: float, rtol: float = 1e-11, most: float = 8000):
    """Return the state (x, x', states of the law) that repeats after a period [s]; None if Newton's method fails.

    Only for laws that are differential equations of a state.
    """
    if motion.laws[0].set_valued or motion.laws[0].split_by_mode or motion.s["law"] == "iwan":
        return None
    size = motion.size
    y = _end(motion, motion.run(SETTLED * period, rtol, most=most))
    unit = np.abs(y) + 1e-3 * np.abs(y).max()
    unit[: motion.n] = np.abs(y[: motion.n]).max()
    unit[motion.n : 2 * motion.n] = np.abs(y[motion.n : 2 * motion.n]).max()
    for _ in range(8):
        gap = _end(motion, motion.run(period, rtol, y, most)) - y
        if np.all(np.abs(gap) <= CLOSE * unit):
            return y
        slope = np.empty((size, size))
        for k in range(size):
            other = y.copy()
            other[k] += 1e-5 * unit[k]
            slope[:, k] = (_end(motion, motion.run(period, rtol, other, most)) - other - gap) / (
                1e-5 * unit[k]
            )
        y = y - np.linalg.solve(slope, gap)
    return None


def _end(motion: Motion, stretches) -> np.ndarray:
    """Return the last state of a motion, without the friction work."""
    return stretches[-1].solution(stretches[-1].times[-1])[: motion.size]
