"""Samples to keep, extremes and phasors of the cycles of a march."""

from functools import lru_cache

import numpy as np

from ..core import STICK_SPEED_RATIO

SIGNS = np.array([[1.0], [-1.0]])  # signs of both roots of a quadratic equation
# product of two rates over the square of the largest rate of the cycle, below which it is round-off
REST = 1e-12
MOST_TURNS = 100  # largest number of samples that are kept of a cycle before the last ones


def thinned(rows, run, even: int = 0) -> list:
    """Return the indices of the samples to keep of each cycle.

    They are the first sample, every reversal of the output and of a slide, and every stop and release, where the slip
    speed falls below or rises above 1e-2 of its peak in the cycle.

    rows: (c, k, width) samples of c cycles; even: smallest number of equally spaced samples of a cycle that are kept in
    addition.
    """
    n = run.modes.omega.size
    output = run.modes.output
    count, size = rows.shape[:2]
    flat = rows.reshape(-1, rows.shape[2])
    speeds, slips = run.watched(flat)
    speeds = np.concatenate([speeds.T, (flat[:, n : 2 * n] @ output)[None]]).reshape(
        -1, count, size
    )
    low = 1e-13 * np.maximum(speeds.max(axis=(0, 2)), -speeds.min(axis=(0, 2)))[:, None]
    way = (speeds > low).view(np.int8) - (speeds < -low).view(np.int8)
    moved = np.abs(np.diff(slips.T.reshape(-1, count, size), axis=2))
    low = 1e-13 * np.abs((flat[:, :n] @ output).reshape(count, size)).max(axis=1)[:, None]
    slipping = moved > np.maximum(STICK_SPEED_RATIO * moved.max(axis=2, keepdims=True), low)
    kept = (way[:, :, 1:] != way[:, :, :-1]).any(axis=0)
    kept[:, 1:] |= (slipping[:, :, 1:] != slipping[:, :, :-1]).any(axis=0)
    kept[:, 0] = True
    picks = [np.flatnonzero(one)[:MOST_TURNS] for one in kept]
    beside = np.arange(0, size - 1, max(1, run.prop.steps // even)) if even else None
    return [np.union1d(one, beside) for one in picks] if even else picks


def extremes_of(rows, modes, dt) -> list:
    """Return the smallest and largest output [m] of each cycle, by cubics between the samples.

    rows: (c, k, >= 2n) of a march, modal displacements and velocities first; dt [s] between them.
    """
    n = modes.omega.size
    return list(
        zip(
            *(
                one.tolist()
                for one in hermite_extremes(
                    rows[..., :n] @ modes.output, rows[..., n : 2 * n] @ modes.output, dt
                )
            )
        )
    )


def phasors_of(rows, modes, first: int, around: int) -> list:
    """Return the phasor c [m] of the output Re(c exp(i omega t)) in each cycle of the drive.

    rows: (c, k, >= n), modal displacements first; the last row belongs to the next cycle. first: number of the first
    step, whose phase is 2 pi first/around; around: steps in a cycle. Without samples the phasor is 0.
    """
    y = rows[:, :-1, : modes.omega.size] @ modes.output
    return (2 * (y @ _carrier(first % around, y.shape[1], around)) / max(y.shape[1], 1)).tolist()


@lru_cache(maxsize=4)
def _carrier(first: int, count: int, around: int) -> np.ndarray:
    """Return exp(-i phase) of `count` samples from number `first` on, `around` per cycle."""
    return np.exp(-2j * np.pi * (first + np.arange(count)) / around)


def hermite_extremes(y, v, dt) -> tuple:
    """Return the minimum and maximum (...) of the piecewise cubic through samples of a function.

    y, v: values and rates (..., k); dt: spacing [s].
    """
    before = y.shape[:-1]
    y = y.reshape(-1, y.shape[-1])
    v = v.reshape(-1, y.shape[-1])
    low = y.min(axis=1)
    high = y.max(axis=1)
    # where a rate is zero within round-off, as at a stop, its sign is no reversal, and the cubic would overshoot
    row, at = np.nonzero(v[:, :-1] * v[:, 1:] < -REST * (v**2).max(axis=1, keepdims=True))
    if at.size:
        a = y[row, at]
        b = y[row, at + 1]
        p = v[row, at] * dt
        q = v[row, at + 1] * dt
        # derivative 3 s^2 A + 2 s B + p of a + p s + B s^2 + A s^3
        big = 2 * (a - b) + p + q
        mid = 3 * (b - a) - 2 * p - q
        root = np.sqrt(np.maximum(mid**2 - 3 * big * p, 0))
        denominator = mid + SIGNS * root
        there = denominator != 0
        s = np.where(there, -p / np.where(there, denominator, 1), -1.0)
        value = np.where((s >= 0) & (s <= 1), a + p * s + mid * s**2 + big * s**3, a)
        np.minimum.at(low, row, value.min(axis=0))
        np.maximum.at(high, row, value.max(axis=0))
    return low.reshape(before), high.reshape(before)
