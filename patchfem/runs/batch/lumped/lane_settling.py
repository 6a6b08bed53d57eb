"""Steady amplitude of cases in lanes, from continued marches of unsteady cases.

In: the march of cases of the Iwan or the elastic-plastic law. Out: `SteadyRanges`.
"""

from typing import NamedTuple

import numpy as np

from ....dynamics.lanes import run as march
from ....dynamics.lanes.rows_kernels import Row
from ....response.settling import extrapolate_steady_amplitudes
from .event_driven import MAX_CHANGE_RATIO
from .lane_numbers import count_evaluated_cycles, select_rows

SETTLING_LAWS = (
    "yielding",
    *march.MASING_LAWS,
)  # laws whose unsteady marches are continued
MIN_TOLERANCE = 1e-4  # smallest tolerance that the lanes can meet
# Largest ratio of the cycles of a continued march to the cycles of the case.
MAX_EXTENSION = 10
# Lengths of successive continuations relative to the first march. The motion is tested after each of them,
# and the first ones are short because many cases settle early.
EXTENSION_FRACTIONS = (0.25, 0.25, 0.5, *(MAX_EXTENSION - 1) * (1.0,))
SETTLED_TOL = 1e-5  # largest relative change of a steady amplitude over the cycles of the case
LATE_TOL_FACTOR = 100  # factor on SETTLED_TOL after the longest continuation


class SteadyRanges(NamedTuple):
    """Steady amplitudes of n cases, their errors, and a mask of the cases without a result.

    - value, error: steady amplitude of the slide and its error, (n,) each [m]; NaN if not needed.
    - is_open: mask (n,) of the cases whose steady amplitude remains unknown.
    """

    value: np.ndarray
    error: np.ndarray
    is_open: np.ndarray


def march_until_settled(law: str, cases, measured, amplitudes, is_free) -> SteadyRanges:
    """Continue the marches of unsteady cases until their steady amplitudes are known.

    Parameters
    ----------
    law : str
        Name of the law in `dynamics.lanes`.
    cases : Cases
    measured : lane_runs.MeasuredMarch
    amplitudes : (n, w)
        Amplitudes of the output per window [m].
    is_free : (n,) of bool
        Mask of the cases that may be continued.
    """
    marched = measured.marched
    cycles = marched.history.shape[1]
    if amplitudes.shape[1] > 2:
        change = np.ptp(amplitudes[:, -3:], axis=1)
        is_free = is_free & (change > MAX_CHANGE_RATIO * MIN_TOLERANCE * amplitudes[:, -1])
    steady = SteadyRanges(
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
        more_history, motion = march.continue_march(
            law, some_cases, before, more_cycles, measured.steps
        )
        history = np.concatenate([history, more_history], axis=1)
        is_late = history.shape[1] > MAX_EXTENSION * cycles
        free_motion = _bound_free_motion(some_cases, before, motion, more_history.shape[1])
        tolerance = (LATE_TOL_FACTOR if is_late else 1) * SETTLED_TOL
        value, error = _estimate_steady_amplitude(history, cycles, free_motion, tolerance)
        ranges = np.ptp(history[:, -cycles:, :2], axis=2) / 2
        is_known = error < (LATE_TOL_FACTOR if is_late else 2) * SETTLED_TOL * ranges[:, -1]
        if law == "yielding":
            length = cases.yield_length[open_cases]
            is_known &= _slips_until_steady(ranges, length, value, error)
        known = open_cases[is_known]
        steady.value[known] = value[is_known]
        steady.error[known] = error[is_known]
        steady.is_open[known] = False
        open_cases = open_cases[~is_known]
        motion = motion[~is_known]
        history = history[~is_known]
    return steady


def _slips_until_steady(amplitudes, yield_stretch, value, error) -> np.ndarray:
    """Return a mask (n,) of the motions that slip in all cycles up to the steady state, or in none.

    Otherwise the decay of the free motion changes before the steady state, and it cannot be extrapolated.

    Parameters
    ----------
    amplitudes : (n, c)
        Amplitude of the slide in each of the last cycles [m].
    yield_stretch : (n,)
        Stretch at the friction limit [m].
    value, error : (n,)
        Steady amplitude and its error [m].
    """
    smallest = np.minimum(amplitudes.min(axis=1), value - error)
    largest = np.maximum(amplitudes.max(axis=1), value + error)
    return (smallest > yield_stretch) | (largest < yield_stretch)


def _bound_free_motion(cases, before, motion, cycles: int) -> np.ndarray:
    """Return an upper bound of the remaining free motion (n,) [m].

    The bound follows from the change of the motion in `cycles` cycles and the smallest decay in these
    cycles. The extremes alone give no bound, because those of a slow beat hardly change near its maximum.
    """
    omega = np.sqrt(cases.stiffness + cases.spring)
    half_damping = cases.damping / 2
    change = np.hypot(
        motion[:, Row.SLIDE] - before[:, Row.SLIDE],
        (motion[:, Row.SPEED] - before[:, Row.SPEED]) / omega,
    )
    rate = half_damping - np.sqrt(np.maximum(half_damping**2 - cases.stiffness, 0.0))
    decayed_fraction = -np.expm1(-2 * np.pi * cycles * rate)
    return change * (1 - decayed_fraction) / np.maximum(decayed_fraction, 1e-300)


def _estimate_steady_amplitude(history, cycles: int, free_motion, tolerance: float) -> tuple:
    """Estimate the steady amplitude of the slide and its error, (n,) each [m].

    The result is the last amplitude if it and the remaining free motion change by less than `tolerance`,
    relative to the amplitude, and not more than in the preceding `cycles` cycles. Otherwise it is
    extrapolated from window to window as in a single run, with the same error; NaN if that fails.

    Parameters
    ----------
    history : (n, c, 4)
        Extremes and phasors of the cycles.
    cycles : int
        Number of cycles of the first march.
    free_motion : (n,)
        Upper bound of the remaining free motion [m].
    tolerance : float
        Largest relative change.
    """
    amplitudes = np.ptp(history[:, :, :2], axis=2) / 2
    count = history.shape[1]
    last = amplitudes[:, -1]
    change = 2 * np.ptp(amplitudes[:, -cycles:], axis=1)
    change_before = np.inf
    if count >= 2 * cycles:
        change_before = 2 * np.ptp(amplitudes[:, -2 * cycles : -cycles], axis=1)
    remainder = np.maximum(change, free_motion)
    is_settled = (remainder < tolerance * last) & (change <= np.maximum(change_before, 1e-9 * last))
    window = cycles if count > MAX_EXTENSION * cycles else count_evaluated_cycles(cycles)
    ends = np.arange(count - 1, 0, -window)[::-1]
    with np.errstate(all="ignore"):
        value, error = extrapolate_steady_amplitudes(
            amplitudes[:, ends], history[:, ends, 2:] @ [1, 1j]
        )
    return np.where(is_settled, last, value), np.where(is_settled, remainder + 1e-9 * last, error)
