"""Ringing during stick of the cases that march in lanes.

In: a march with steps per cycle. Out: `LaneRinging`. The ringing is computed if the interface
sticks all the time: in closed form for a spring, else by the fit of a single run.
"""

from typing import NamedTuple

import numpy as np

from ....dynamics.lanes import run as march
from ....dynamics.lanes.rows_kernels import Row
from ....response.ringing import (
    MAX_DAMPING_RATIO,
    MIN_SINUSOID,
    SAMPLES_PER_PERIOD,
    measure_ringing,
)
from .lane_numbers import Scales, select_rows

RINGING_MEASURES = ("ring_frequency", "ring_damping")
# smallest number of steps per cycle of a stretch law with which no ringing is missed
MIN_RINGING_STEPS = 512
# factor on the error of the fit of a ringing, because a march causes correlated errors in its samples
FIT_ERROR_FACTOR = 5.0
# smallest phase [rad] of the free vibration in a stick interval in which ringing is searched for
MIN_STICK_PHASE = 0.9 * 3 * np.pi
# smallest phase [rad] of a vibration that counts as ringing in closed form, three half periods
MIN_FREE_PHASE = 3 * np.pi
# damping ratio, and relative distance from a harmonic of the drive, below which a vibration counts as
# forced
FORCED_DAMPING = 1e-3
FORCED_DISTANCE = 1e-2


class LaneRinging(NamedTuple):
    """Free vibration of n cases during stick, and a mask of cases that need another run.

    - values, errors: ring_frequency [Hz] and ring_damping [1] by name, (n,) each.
    - needs_single_run: which cases (n,) may ring, but lanes cannot tell.
    - needs_more_steps: which cases (n,) may hide a ringing, because their steps are few.
    """

    values: dict
    errors: dict
    needs_single_run: np.ndarray
    needs_more_steps: np.ndarray


def find_ringing(law: str, cases, scales: Scales, measured, is_stuck) -> LaneRinging:
    """Fit the free vibration of cases during stick, and find cases that need another run.

    Parameters
    ----------
    law : str
        Law of `dynamics.lanes`.
    cases : Cases
    scales : Scales
    measured : lane_runs.MeasuredMarch
    is_stuck : (n,)
        Which cases stick.
    """
    marched = measured.marched
    n = len(is_stuck)
    ringing = LaneRinging(
        {name: np.full(n, np.nan) for name in RINGING_MEASURES},
        {name: np.full(n, np.nan) for name in RINGING_MEASURES},
        np.zeros(n, bool),
        np.zeros(n, bool),
    )
    if law == "rigid":  # a rigid interface with one mode does not move while it sticks
        return ringing
    may_ring = has_long_stick(cases, marched)
    is_held = marched.reading("STICK_ANGLE") > 2 * np.pi * (marched.n_observed - 1e-6)
    is_unsteady = marched.n_before >= marched.history.shape[1] - measured.window
    if law == "yielding":
        _ring_on_springs(cases, scales, marched, is_held & may_ring & is_unsteady, ringing)
        return ringing._replace(needs_single_run=may_ring & ~is_held)
    # a periodic motion does not ring, but a transient may remain if the interface always sticks
    may_vibrate = may_contain_transient(cases, marched)
    if law in march.MASING_LAWS:
        has_slipped = march.law_state(law, marched.motion, "EVER_SLIPPED") > 0
        may_ring = (may_ring & is_unsteady & has_slipped) | (may_vibrate & is_stuck)
    else:
        may_ring = may_vibrate & (is_stuck | may_ring)
    _fit_ringing(law, cases, scales, measured, np.flatnonzero(may_ring & is_held), ringing)
    return ringing._replace(needs_single_run=may_ring & ~is_held)


def has_long_stick(cases, marched) -> np.ndarray:
    """Return a mask (n,) of the cases that stick long enough for a free vibration to be fitted."""
    omega = np.sqrt(np.maximum(cases.stiffness + cases.spring - cases.damping**2 / 4, 0.0))
    return marched.reading("LONGEST_STICK") * omega >= MIN_STICK_PHASE


def may_contain_transient(cases, marched) -> np.ndarray:
    """Return a mask (n,) of runs whose last cycles may still contain a transient or ringing.

    The remaining transient is at most the change between the last two cycles over the fraction that the
    damper removes in one cycle.
    """
    last = marched.history[:, -2:, :2]
    change = np.abs(last[:, 1] - last[:, 0]).max(axis=1) / np.maximum(
        -np.expm1(-np.pi * cases.damping), 1e-300
    )
    acceleration = np.abs(cases.output_gain) * (cases.stiffness + cases.spring) * change
    return acceleration > MIN_SINUSOID / 3 * marched.reading("MAX_ACCELERATION")


def _fit_ringing(law: str, cases, scales: Scales, measured, fitted, ringing: LaneRinging) -> None:
    """Fit the ringing of some cases to samples of their acceleration."""
    if not fitted.size:
        return
    steps = measured.steps
    omega = np.sqrt(np.maximum(cases.stiffness + cases.spring, 1.0))
    strides = np.maximum(steps / (SAMPLES_PER_PERIOD * omega), 1.0)
    # the stride is a power of 2, so that it does not depend on other cases
    strides = 2 ** np.log2(strides).astype(int)
    start = measured.marched.observed_start[fitted]
    signals = march.output_accelerations(
        law, select_rows(cases, fitted), start, measured.window, steps
    )
    for case, signal in zip(fitted.tolist(), signals):
        omega = float(scales.omega[case])
        samples = signal[:: strides[case]]
        time = np.linspace(0, 2 * np.pi * measured.window / omega, len(samples))
        values, errors = measure_ringing(time, samples, [(0.0, time[-1])], omega)
        # a ringing that is not found with so few steps may have been missed
        ringing.needs_more_steps[case] = (
            not values and march.has_one_stretch(law) and steps < MIN_RINGING_STEPS
        )
        for name, value in values.items():
            ringing.values[name][case] = value
            ringing.errors[name][case] = FIT_ERROR_FACTOR * errors[name]


def _ring_on_springs(cases, scales: Scales, marched, is_held, ringing: LaneRinging) -> None:
    """Compute in closed form the free vibration of cases that stick on a linear spring.

    The spring holds the cases `is_held` (n,) in all evaluated cycles. The results are accepted by the
    criteria of `response.ringing`, and stored in `ringing`.
    """
    stiffness = cases.stiffness + cases.spring
    half_damping = cases.damping / 2
    omega = np.sqrt(np.maximum(stiffness - half_damping**2, 0.0))
    # the dynamic stiffness at the drive frequency is detuning + i damping
    detuning = stiffness - 1
    squared = detuning**2 + cases.damping**2
    start = marched.observed_start
    phase = 2 * np.pi * marched.n_observed * omega
    with np.errstate(all="ignore"):
        # the free motion is the motion without the forced part and without the stretch of the spring
        displacement = (
            start[:, Row.SLIDE]
            - cases.spring * start[:, Row.MEMORY] / stiffness
            + cases.drive * cases.damping / squared
        )
        quadrature = (
            start[:, Row.SPEED] - cases.drive * detuning / squared + half_damping * displacement
        ) / omega
        damping = half_damping / np.sqrt(stiffness)
        is_forced = (
            (2 * np.pi * marched.n_observed > MIN_FREE_PHASE)
            & (damping < FORCED_DAMPING)
            & (np.abs(omega - np.round(omega)) < FORCED_DISTANCE)
        )
        amplitude = np.abs(cases.output_gain) * stiffness * np.hypot(displacement, quadrature)
        rings = (
            is_held
            & (phase >= MIN_FREE_PHASE)
            & (damping < MAX_DAMPING_RATIO)
            & ~is_forced
            & (squared > 1e-18 * stiffness**2)
            & (amplitude > MIN_SINUSOID * marched.reading("MAX_ACCELERATION"))
        )
    for name, values in zip(RINGING_MEASURES, (omega * scales.omega / (2 * np.pi), damping)):
        ringing.values[name][rings] = values[rings]
        ringing.errors[name][rings] = 0.0
