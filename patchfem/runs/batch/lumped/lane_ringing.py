"""Ringing of cases in lanes during permanent stick.

In: a march in lanes. Out: `LaneRinging`. The ringing is computed in closed form for a linear spring,
else by the same fit as in a single run. The error of a fit is its own error plus that of the time
steps, as in a single run.
"""

from typing import NamedTuple

import numpy as np

from ....dynamics.lanes import run as march
from ....dynamics.lanes.rows_kernels import Row
from ....response.errors import convergence_error
from ....response.ringing import (
    MAX_DAMPING_RATIO,
    MIN_SINUSOID,
    SAMPLES_PER_PERIOD,
    measure_ringing,
)
from .lane_numbers import Scales, select_rows

RINGING_MEASURES = ("ring_frequency", "ring_damping")
# Smallest number of steps per cycle of a stretch law at which all ringing is detected.
MIN_RINGING_STEPS = 512
# Smallest phase of the free vibration in a stick interval [rad] for a search for ringing.
MIN_STICK_PHASE = 0.9 * 3 * np.pi
# Smallest phase of a vibration that counts as ringing in closed form [rad]: three half periods.
MIN_FREE_PHASE = 3 * np.pi
# Largest damping ratio, and largest distance from a harmonic of the drive relative to the drive frequency, at
# which a vibration counts as forced.
FORCED_DAMPING = 1e-3
FORCED_DISTANCE = 1e-2


class LaneRinging(NamedTuple):
    """Free vibration of n cases during stick, and masks of cases that need another run.

    - values, errors: ring_frequency [Hz] and ring_damping [1] by name, (n,) each.
    - needs_single_run: mask (n,) of the cases whose ringing cannot be computed in lanes.
    - needs_more_steps: mask (n,) of the cases with too few steps to detect ringing.
    """

    values: dict
    errors: dict
    needs_single_run: np.ndarray
    needs_more_steps: np.ndarray


def find_ringing(law: str, cases, scales: Scales, measured, is_stuck) -> LaneRinging:
    """Compute the free vibration of cases in permanent stick, and find cases that need another run.

    Parameters
    ----------
    law : str
        Name of the law in `dynamics.lanes`.
    cases : Cases
    scales : Scales
    measured : lane_runs.MeasuredMarch
    is_stuck : (n,)
        Mask of the cases that stick in all evaluated cycles.
    """
    marched = measured.marched
    n = len(is_stuck)
    ringing = LaneRinging(
        {name: np.full(n, np.nan) for name in RINGING_MEASURES},
        {name: np.full(n, np.nan) for name in RINGING_MEASURES},
        np.zeros(n, bool),
        np.zeros(n, bool),
    )
    if law == "rigid":  # a rigid interface holds the only mode at rest during stick
        return ringing
    may_ring = has_long_stick(cases, marched)
    sticks_always = marched.get_measure("STICK_ANGLE") > 2 * np.pi * (marched.n_observed - 1e-6)
    is_unsteady = marched.n_before >= marched.history.shape[1] - measured.window
    if law == "yielding":
        _compute_spring_ringing(
            cases, scales, marched, sticks_always & may_ring & is_unsteady, ringing
        )
        return ringing._replace(needs_single_run=may_ring & ~sticks_always)
    # a periodic motion does not ring, but a transient may remain in permanent stick
    may_vibrate = may_contain_transient(cases, marched)
    if law in march.MASING_LAWS:
        has_slipped = march.law_state(law, marched.motion, "EVER_SLIPPED") > 0
        may_ring = (may_ring & is_unsteady & has_slipped) | (may_vibrate & is_stuck)
    else:
        may_ring = may_vibrate & (is_stuck | may_ring)
    _fit_ringing(law, cases, scales, measured, np.flatnonzero(may_ring & sticks_always), ringing)
    return ringing._replace(needs_single_run=may_ring & ~sticks_always)


def has_long_stick(cases, marched) -> np.ndarray:
    """Return a mask (n,) of the cases with a stick interval long enough for a ringing fit."""
    omega = np.sqrt(np.maximum(cases.stiffness + cases.spring - cases.damping**2 / 4, 0.0))
    return marched.get_measure("LONGEST_STICK") * omega >= MIN_STICK_PHASE


def may_contain_transient(cases, marched) -> np.ndarray:
    """Return a mask (n,) of runs whose last cycles may still contain a transient.

    The remaining transient is at most the change between the last two cycles divided by the relative decay
    per cycle.
    """
    last = marched.history[:, -2:, :2]
    change = np.abs(last[:, 1] - last[:, 0]).max(axis=1) / np.maximum(
        -np.expm1(-np.pi * cases.damping), 1e-300
    )
    acceleration = np.abs(cases.output_gain) * (cases.stiffness + cases.spring) * change
    return acceleration > MIN_SINUSOID / 3 * marched.get_measure("MAX_ACCELERATION")


def _fit_ringing(
    law: str, cases, scales: Scales, measured, case_indices, ringing: LaneRinging
) -> None:
    """Fit the ringing of selected cases, with all and with half of the steps for its error."""
    steps = measured.steps
    fits = _fit_window(law, cases, scales, measured, case_indices, steps)
    for case, (values, errors) in fits.items():
        # with few steps, ringing may have been missed
        ringing.needs_more_steps[case] = (
            not values and march.has_one_stretch(law) and steps < MIN_RINGING_STEPS
        )
        for name, value in values.items():
            ringing.values[name][case] = value
            ringing.errors[name][case] = errors[name]
    ringing_cases = np.array([case for case, (values, _) in fits.items() if values], int)
    coarse_fits = _fit_window(law, cases, scales, measured, ringing_cases, steps // 2)
    for case, (coarse_values, _) in coarse_fits.items():
        for name in RINGING_MEASURES:
            value = ringing.values[name][case]
            if name in coarse_values:
                ringing.errors[name][case] += convergence_error(value - coarse_values[name])
            else:  # as for every measure that a coarser run lacks
                ringing.errors[name][case] = abs(value)


def _fit_window(law: str, cases, scales: Scales, measured, case_indices, steps: int) -> dict:
    """Integrate the evaluated cycles of selected cases (k,) again, with `steps` per cycle, and fit their ringing.

    Returns a dict by case index of the values and errors of `measure_ringing`. The other parameters are
    those of `find_ringing`.
    """
    if not case_indices.size:
        return {}
    stick_omega = np.sqrt(np.maximum(cases.stiffness + cases.spring, 1.0))
    strides = np.maximum(steps / (SAMPLES_PER_PERIOD * stick_omega), 1.0)
    # the stride is a power of 2 and does not depend on other cases
    strides = 2 ** np.log2(strides).astype(int)
    start = measured.marched.observed_start[case_indices]
    signals = march.output_accelerations(
        law, select_rows(cases, case_indices), start, measured.window, steps
    )
    fits = {}
    for case, signal in zip(case_indices.tolist(), signals):
        omega = float(scales.omega[case])
        samples = signal[:: strides[case]]
        time = np.linspace(0, 2 * np.pi * measured.window / omega, len(samples))
        fits[case] = measure_ringing(time, samples, [(0.0, time[-1])], omega)
    return fits


def _compute_spring_ringing(
    cases, scales: Scales, marched, sticks_always, ringing: LaneRinging
) -> None:
    """Compute the free vibration of cases that stick on a linear spring in closed form.

    The cases of the mask `sticks_always` (n,) stick in all evaluated cycles. Results that meet the criteria of
    `response.ringing` are stored in `ringing`.
    """
    stiffness = cases.stiffness + cases.spring
    half_damping = cases.damping / 2
    omega = np.sqrt(np.maximum(stiffness - half_damping**2, 0.0))
    # the dynamic stiffness at the drive frequency is detuning + 1j * damping
    detuning = stiffness - 1
    squared_dynamic_stiffness = detuning**2 + cases.damping**2
    start = marched.observed_start
    phase = 2 * np.pi * marched.n_observed * omega
    with np.errstate(all="ignore"):
        # free motion: total motion minus forced motion and static stretch of the spring
        cosine_amplitude = (
            start[:, Row.SLIDE]
            - cases.spring * start[:, Row.MEMORY] / stiffness
            + cases.drive * cases.damping / squared_dynamic_stiffness
        )
        sine_amplitude = (
            start[:, Row.SPEED]
            - cases.drive * detuning / squared_dynamic_stiffness
            + half_damping * cosine_amplitude
        ) / omega
        damping = half_damping / np.sqrt(stiffness)
        is_forced = (
            (2 * np.pi * marched.n_observed > MIN_FREE_PHASE)
            & (damping < FORCED_DAMPING)
            & (np.abs(omega - np.round(omega)) < FORCED_DISTANCE)
        )
        amplitude = (
            np.abs(cases.output_gain) * stiffness * np.hypot(cosine_amplitude, sine_amplitude)
        )
        is_ringing = (
            sticks_always
            & (phase >= MIN_FREE_PHASE)
            & (damping < MAX_DAMPING_RATIO)
            & ~is_forced
            & (squared_dynamic_stiffness > 1e-18 * stiffness**2)
            & (amplitude > MIN_SINUSOID * marched.get_measure("MAX_ACCELERATION"))
        )
    for name, values in zip(RINGING_MEASURES, (omega * scales.omega / (2 * np.pi), damping)):
        ringing.values[name][is_ringing] = values[is_ringing]
        ringing.errors[name][is_ringing] = 0.0
