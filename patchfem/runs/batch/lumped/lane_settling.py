"""Steady amplitude of cases that have not settled: they march on until their motion is steady.

In: the march of cases of the Iwan or the elastic-plastic law. Out: `SettledRanges`.
"""

from typing import NamedTuple

import numpy as np

from ....dynamics.lanes import run as march
from ....dynamics.lanes.rows_kernels import Row
from ....response.settling import extrapolate_steady_amplitudes
from ...rig.event_driven import MAX_CHANGE_RATIO
from .lane_numbers import count_evaluated_cycles, select_rows

SETTLING_LAWS = (
    "yielding",
    *march.MASING_LAWS,
)  # laws whose marches are continued until the motion is steady
MIN_TOLERANCE = 1e-4  # smallest tolerance that lanes can meet
# largest ratio of the cycles of a continued march to those of the case
MAX_EXTENSION = 10
# Lengths of the continuation marches relative to the first march. The motion is tested after each of them;
# the first ones are short, so that cases that settle early cost little.
EXTENSION_FRACTIONS = (0.25, 0.25, 0.5, *(MAX_EXTENSION - 1) * (1.0,))
SETTLED_TOL = 1e-5  # largest relative change of a steady motion over the cycles of the case [1]
LATE_TOL_FACTOR = 100  # factor on SETTLED_TOL at the end of the march
# Ratio of the error of an extrapolated range to the error that the extrapolation states, and smallest
# relative error of the range: 1 of 571 random cases erred more.
EXTRAPOLATION_ERROR_FACTOR = 2.5
MIN_EXTRAPOLATION_ERROR = 7e-6


class SettledRanges(NamedTuple):
    """Steady amplitudes of n cases with errors, and a mask of the cases that do not settle.

    - value, error: half the range of the slide in the steady state and its error, (n,) each [m];
      NaN if they are not needed.
    - is_open: which cases (n,) do not settle even by extrapolation.
    """

    value: np.ndarray
    error: np.ndarray
    is_open: np.ndarray


def march_until_settled(law: str, cases, measured, amplitudes, is_free) -> SettledRanges:
    """Continue the marches of cases until their motions are steady.

    Parameters
    ----------
    law : str
        Law of `dynamics.lanes`.
    cases : Cases
    measured : lane_runs.MeasuredMarch
    amplitudes : (n, w)
        Output per window [m].
    is_free : (n,) of bool
        Cases that may march on.
    """
    marched = measured.marched
    cycles = marched.history.shape[1]
    if amplitudes.shape[1] > 2:
        change = np.ptp(amplitudes[:, -3:], axis=1)
        is_free = is_free & (change > MAX_CHANGE_RATIO * MIN_TOLERANCE * amplitudes[:, -1])
    settled = SettledRanges(
        np.full(len(is_free), np.nan), np.full(len(is_free), np.nan), is_free.copy()
    )
    open_cases = np.flatnonzero(is_free)
    motion = marched.motion[is_free]
    history = marched.history[open_cases]
    for fraction in EXTENSION_FRACTIONS:
        if not open_cases.size:
            break
        before = motion
        some_cases = select_rows(cases, open_cases)
        more_cycles = max(1, int(fraction * cycles))
        more, motion = march.continue_march(law, some_cases, before, more_cycles, measured.steps)
        history = np.concatenate([history, more], axis=1)
        is_late = history.shape[1] > MAX_EXTENSION * cycles
        free_motion = _bound_free_motion(some_cases, before, motion, more.shape[1])
        tolerance = (LATE_TOL_FACTOR if is_late else 1) * SETTLED_TOL
        value, error = _steady_half_range(history, cycles, free_motion, tolerance)
        ranges = np.ptp(history[:, -cycles:, :2], axis=2) / 2
        is_known = error < (LATE_TOL_FACTOR if is_late else 2) * SETTLED_TOL * ranges[:, -1]
        if law == "yielding":
            length = cases.yield_length[open_cases]
            is_known &= _slips_until_steady(ranges, length, value, error)
        known = open_cases[is_known]
        settled.value[known] = value[is_known]
        settled.error[known] = error[is_known]
        settled.is_open[known] = False
        open_cases = open_cases[~is_known]
        motion = motion[~is_known]
        history = history[~is_known]
    return settled


def _slips_until_steady(ranges, length, value, error) -> np.ndarray:
    """Return which motions slip in all cycles up to the steady state, or in none, (n,).

    If the slip ceases before the steady state, the free motion decays differently from then on.

    Parameters
    ----------
    ranges : (n, c)
        Half the range of the slide in the last cycles [m].
    length : (n,)
        Stretch above which it slips [m].
    value, error : (n,)
        Half the range in the steady state and its error [m].
    """
    smallest = np.minimum(ranges.min(axis=1), value - error)
    largest = np.maximum(ranges.max(axis=1), value + error)
    return (smallest > length) | (largest < length)


def _bound_free_motion(cases, before, motion, cycles: int) -> np.ndarray:
    """Return an upper bound of the remaining free motion (n,) [m].

    The bound follows from the change in `cycles` cycles and the smallest decay by the damper in these
    cycles: the extremes of a slow beat hardly change while it is largest.
    """
    omega = np.sqrt(cases.stiffness + cases.spring)
    half_damping = cases.damping / 2
    change = np.hypot(
        motion[:, Row.SLIDE] - before[:, Row.SLIDE],
        (motion[:, Row.SPEED] - before[:, Row.SPEED]) / omega,
    )
    rate = half_damping - np.sqrt(np.maximum(half_damping**2 - cases.stiffness, 0.0))
    decayed = -np.expm1(-2 * np.pi * cycles * rate)
    return change * (1 - decayed) / np.maximum(decayed, 1e-300)


def _steady_half_range(history, cycles: int, free_motion, tolerance: float) -> tuple:
    """Estimate half the range of the slide in the steady state and its error, (n,) each [m].

    The result is the last range if it hardly changes in `cycles` cycles, not more than in those before, and
    if the remaining free motion is below the fraction `tolerance` of it; else an extrapolation of
    windows, at last of windows of `cycles` cycles. NaN means that it is unknown.

    Parameters
    ----------
    history : (n, c, 4)
        Cycles of the cases.
    cycles : int
        Cycles of the first march.
    free_motion : (n,)
        Upper bound of the remaining free motion [m].
    tolerance : float
        Largest relative change.
    """
    ranges = np.ptp(history[:, :, :2], axis=2) / 2
    count = history.shape[1]
    last = ranges[:, -1]
    change = 2 * np.ptp(ranges[:, -cycles:], axis=1)
    change_before = np.inf
    if count >= 2 * cycles:
        change_before = 2 * np.ptp(ranges[:, -2 * cycles : -cycles], axis=1)
    remainder = np.maximum(change, free_motion)
    is_settled = (remainder < tolerance * last) & (change <= np.maximum(change_before, 1e-9 * last))
    window = cycles if count > MAX_EXTENSION * cycles else count_evaluated_cycles(cycles)
    ends = np.arange(count - 1, 0, -window)[::-1]
    with np.errstate(all="ignore"):
        value, error = extrapolate_steady_amplitudes(
            ranges[:, ends], history[:, ends, 2:] @ [1, 1j]
        )
    error = np.maximum(EXTRAPOLATION_ERROR_FACTOR * error, MIN_EXTRAPOLATION_ERROR * value)
    return np.where(is_settled, last, value), np.where(is_settled, remainder + 1e-9 * last, error)
