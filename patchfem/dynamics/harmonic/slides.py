"""Periodic relative displacements of interfaces at the nodes of a cycle.

The nodes are N equal samples and, between them, the reversals of all slides, which are found from the harmonics. A law
with memory turns at the reversals, so its memory is that of the continuous motion.
"""

from typing import NamedTuple

import numpy as np

from .series import evaluate_series

MIN_RATE = 1e-13  # smallest velocity that has a direction, relative to the largest of the cycle
MAX_REVERSAL_STEPS = 60  # largest number of steps to a reversal
ANGLE_TOL = 1e-14  # change of the angle of a reversal that is round-off [rad]


class Slides(NamedTuple):
    """Slides of interfaces at the M nodes of a cycle.

    - omega: frequency [rad/s]
    - harmonics: (i, H + 1) [m]
    - angle: (M,) increasing from 0 [rad]
    - q, rate: (i, M) slide and its derivative by the angle [m]
    - is_sample: (M,) whether a node is a sample
    - reversals: for each interface the nodes (r,) at which it turns
    """

    omega: float
    harmonics: np.ndarray
    angle: np.ndarray
    q: np.ndarray
    rate: np.ndarray
    is_sample: np.ndarray
    reversals: list[np.ndarray]

    @property
    def widths(self) -> np.ndarray:
        """Angle (M,) from each node to the next one [rad]."""
        return np.diff(self.angle, append=2 * np.pi)


def make_slides(x, omega: float, samples: int) -> Slides:
    """Evaluate slides at equal samples and at their reversals.

    Parameters
    ----------
    x : (i, H + 1) array_like
        Harmonics of the slides [m].
    omega : float
        [rad/s].
    samples : int
        Samples per cycle.
    """
    x = np.asarray(x, complex)
    k = np.arange(x.shape[1])
    q = evaluate_series(x, samples)
    rate = evaluate_series(1j * k * x, samples)
    turns = [find_reversals(*row) for row in zip(x, rate)]

    # Slides at the reversals of all interfaces, and the order of all nodes.
    between = np.concatenate(turns)
    waves = np.exp(1j * np.outer(k, between))
    angle = np.concatenate([np.arange(samples) * (2 * np.pi / samples), between])
    order = np.argsort(angle, kind="stable")
    q = np.concatenate([q, (x @ waves).real], axis=1)[:, order]
    rate = np.concatenate([rate, ((1j * k * x) @ waves).real], axis=1)[:, order]

    # An interface is at rest at its own reversals.
    place = np.argsort(order)
    ends = samples + np.cumsum([turn.size for turn in turns])
    reversals = [np.sort(place[end - turn.size : end]) for end, turn in zip(ends, turns)]
    for row, nodes in zip(rate, reversals):
        row[nodes] = 0.0
    return Slides(omega, x, angle[order], q, rate, order < samples, reversals)


def find_reversals(x, rate) -> np.ndarray:
    """Return the angles (r,) [rad] at which a slide turns.

    Parameters
    ----------
    x : (H + 1,) array
        Harmonics [m].
    rate : (N,) array
        Samples of the derivative by the angle [m].
    """
    floor = MIN_RATE * np.abs(rate).max()
    moving = np.flatnonzero(np.abs(rate) > floor)
    if not moving.size:
        return np.zeros(0)

    # Two successive moving samples of opposite sign have a reversal between them.
    signs = np.sign(rate[moving])
    turning = np.flatnonzero(signs != np.roll(signs, -1))
    before = moving[turning]
    after = np.roll(moving, -1)[turning]
    after = np.where(after > before, after, after + rate.size)
    width = 2 * np.pi / rate.size
    low = before * width
    high = after * width
    first = rate[before]
    angles = low + (high - low) * first / (first - rate[after % rate.size])

    # Newton's method on the velocity, or bisection where it leaves the interval.
    k = np.arange(x.size)
    for _ in range(MAX_REVERSAL_STEPS):
        waves = np.exp(1j * np.outer(angles, k)) * x
        speed = (waves @ (1j * k)).real
        bend = -(waves @ (k * k)).real
        is_before = speed * first > 0
        low = np.where(is_before, angles, low)
        high = np.where(is_before, high, angles)
        step = np.divide(speed, bend, out=np.full(angles.size, np.inf), where=bend != 0)
        new = angles - step
        new = np.where((low <= new) & (new <= high), new, (low + high) / 2)
        change = np.abs(new - angles).max(initial=0.0)
        angles = new
        if change <= ANGLE_TOL:
            break
    return angles % (2 * np.pi)
