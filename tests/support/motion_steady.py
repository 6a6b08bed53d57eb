"""Steady motion of a spec under a sine by the independent program: a long run, then Newton's method over a period."""

import numpy as np
from motion_reference import Motion

SETTLED = 40  # Cycles before Newton's method.
CLOSE = 1e-10  # Change over a period, relative to the state, at which Newton's method ends.


def find_periodic_state(
    motion: Motion, period: float, rtol: float = 1e-11, max_steps: float = 8000
):
    """Return the state (x, x', states of the law) that repeats after a period [s]; None if Newton's method fails.

    Only for laws that are differential equations of a state.
    """
    if motion.laws[0].set_valued or motion.laws[0].split_by_mode or motion.s["law"] == "iwan":
        return None
    size = motion.size
    y = _final_state(motion, motion.run(SETTLED * period, rtol, max_steps=max_steps))
    scale = np.abs(y) + 1e-3 * np.abs(y).max()
    scale[: motion.n] = np.abs(y[: motion.n]).max()
    scale[motion.n : 2 * motion.n] = np.abs(y[motion.n : 2 * motion.n]).max()
    for _ in range(8):
        residual = _final_state(motion, motion.run(period, rtol, y, max_steps)) - y
        if np.all(np.abs(residual) <= CLOSE * scale):
            return y
        jacobian = np.empty((size, size))
        for k in range(size):
            perturbed = y.copy()
            perturbed[k] += 1e-5 * scale[k]
            jacobian[:, k] = (
                _final_state(motion, motion.run(period, rtol, perturbed, max_steps))
                - perturbed
                - residual
            ) / (1e-5 * scale[k])
        y = y - np.linalg.solve(jacobian, residual)
    return None


def _final_state(motion: Motion, stretches) -> np.ndarray:
    """Return the last state of a motion, without the friction work."""
    return stretches[-1].solution(stretches[-1].times[-1])[: motion.size]
