"""Extremes, phasors and selected samples of the cycles in a march (time integration)."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..core import STICK_SPEED_RATIO

# Largest product of two successive rates, relative to the square of the largest rate,
# that is attributed to round-off.
REST_RATIO = 1e-12
# Round-off error of a speed relative to the largest speed, and of a slip increment
# relative to the largest output.
ROUND_OFF_RATIO = 1e-13
# Largest number of samples per cycle that are kept from before the last
# cycles, which limits the memory.
MAX_SAMPLES_PER_CYCLE = 100
# Number of samples per cycle in the last cycles, for methods that choose their own step length.
SAMPLES_PER_CYCLE = 400
# Smallest number of samples in the last cycles, for runs shorter than one cycle.
MIN_SAMPLES = 101


def select_cycle_samples(rows, run, n_equidistant: int = 0) -> list:
    """Return the indices of the samples that are kept in each marched cycle.

    These are the first sample, every reversal of the output and of an interface, and every stop and
    release, where the slip speed falls below or exceeds STICK_SPEED_RATIO of its maximum in the
    cycle.

    Parameters
    ----------
    rows : ndarray
        (c, k, width) samples of c cycles.
    run : march.Run
    n_equidistant : int, optional
        Smallest number of equidistant samples of a cycle that are kept in addition.

    Returns
    -------
    list of ndarray
    """
    n = run.modes.omega.size
    output = run.modes.output
    n_cycles, n_samples = rows.shape[:2]
    flat = rows.reshape(-1, rows.shape[2])
    speeds, slips = run.read_rates_and_slips(flat)
    speeds = np.concatenate([speeds.T, (flat[:, n : 2 * n] @ output)[None]])
    speeds = speeds.reshape(-1, n_cycles, n_samples)
    max_speed = np.maximum(speeds.max(axis=(0, 2)), -speeds.min(axis=(0, 2)))
    round_off = ROUND_OFF_RATIO * max_speed[:, None]
    directions = (speeds > round_off).view(np.int8) - (speeds < -round_off).view(np.int8)
    steps = np.abs(np.diff(slips.T.reshape(-1, n_cycles, n_samples), axis=2))
    max_output = np.abs((flat[:, :n] @ output).reshape(n_cycles, n_samples)).max(axis=1)
    round_off = ROUND_OFF_RATIO * max_output[:, None]
    is_slipping = steps > np.maximum(
        STICK_SPEED_RATIO * steps.max(axis=2, keepdims=True), round_off
    )
    is_kept = (directions[:, :, 1:] != directions[:, :, :-1]).any(axis=0)
    is_kept[:, 1:] |= (is_slipping[:, :, 1:] != is_slipping[:, :, :-1]).any(axis=0)
    is_kept[:, 0] = True
    indices = [np.flatnonzero(cycle)[:MAX_SAMPLES_PER_CYCLE] for cycle in is_kept]
    if not n_equidistant:
        return indices
    equidistant = np.arange(0, n_samples - 1, max(1, run.prop.steps // n_equidistant))
    return [np.union1d(cycle, equidistant) for cycle in indices]


def find_cycle_extremes(rows, modes, dt) -> list:
    """Find the smallest and largest output [m] in each cycle by cubic Hermite interpolation.

    Parameters
    ----------
    rows : ndarray
        (c, k, w) samples of c cycles; the first 2 n columns are modal displacements and rates.
    modes : ModalBasis
    dt : float
        Time between two samples [s].

    Returns
    -------
    list of tuple of float
    """
    n = modes.omega.size
    output = rows[..., :n] @ modes.output
    rate = rows[..., n : 2 * n] @ modes.output
    extremes = find_hermite_extremes(output, rate, dt)
    return list(zip(extremes.minimum.tolist(), extremes.maximum.tolist()))


def find_cycle_phasors(rows, modes, first: int, steps_per_cycle: int) -> list:
    """Compute the phasor [m] of the output at the drive frequency in each cycle.

    The phasor is c in the output Re(c exp(i omega t)).

    Parameters
    ----------
    rows : ndarray
        (c, k, w) samples of c cycles, the last of which belongs to the next cycle; the first n
        columns are modal displacements. Without samples the phasor is 0.
    modes : ModalBasis
    first : int
        Number of the first step, whose phase is 2 pi first/steps_per_cycle.
    steps_per_cycle : int

    Returns
    -------
    list of complex
    """
    output = rows[:, :-1, : modes.omega.size] @ modes.output
    n_samples = output.shape[1]
    carrier = _make_carrier(first % steps_per_cycle, n_samples, steps_per_cycle)
    return (2 * (output @ carrier) / max(n_samples, 1)).tolist()


@lru_cache(maxsize=4)
def _make_carrier(first: int, n_samples: int, steps_per_cycle: int) -> np.ndarray:
    """Return exp(-i phase) of the sinusoidal drive at successive samples, beginning with step `first`."""
    return np.exp(-2j * np.pi * (first + np.arange(n_samples)) / steps_per_cycle)


class Extremes(NamedTuple):
    """Minima and maxima of sampled functions, as arrays of any shape (...)."""

    minimum: np.ndarray
    maximum: np.ndarray


def find_hermite_extremes(values, rates, dt) -> Extremes:
    """Find the minima and maxima of piecewise cubic Hermite interpolants through samples.

    Parameters
    ----------
    values, rates : ndarray
        (..., k) samples of the functions and of their derivatives.
    dt : float
        Time between two samples [s].

    Returns
    -------
    Extremes
    """
    shape = values.shape[:-1]
    values = values.reshape(-1, values.shape[-1])
    rates = rates.reshape(-1, values.shape[-1])
    minimum = values.min(axis=1)
    maximum = values.max(axis=1)
    # A rate that changes sign within round-off, as at a stop, is not a reversal;
    # the cubic would overshoot there.
    max_square = (rates**2).max(axis=1, keepdims=True)
    row, column = np.nonzero(rates[:, :-1] * rates[:, 1:] < -REST_RATIO * max_square)
    if column.size:
        a = values[row, column]
        b = values[row, column + 1]
        p = rates[row, column] * dt
        q = rates[row, column + 1] * dt
        # With the fraction s of the step, the interpolant is a + p s + quadratic s^2 + cubic s^3,
        # and its derivative is p + 2 quadratic s + 3 cubic s^2.
        cubic = 2 * (a - b) + p + q
        quadratic = 3 * (b - a) - 2 * p - q
        root = np.sqrt(np.maximum(quadratic**2 - 3 * cubic * p, 0))
        denominator = np.stack([quadratic + root, quadratic - root])
        is_regular = denominator != 0
        s = np.where(is_regular, -p / np.where(is_regular, denominator, 1), -1.0)
        value = a + p * s + quadratic * s**2 + cubic * s**3
        value = np.where((s >= 0) & (s <= 1), value, a)
        np.minimum.at(minimum, row, value.min(axis=0))
        np.maximum.at(maximum, row, value.max(axis=0))
    return Extremes(minimum.reshape(shape), maximum.reshape(shape))
