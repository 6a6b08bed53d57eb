"""Measures of a motion that several engines have: of what they observe in their steps, and of samples.

In: `Observations` of one run or of many, energies, or samples. Out: values by name, NaN where a run does not have the
measure. `measures.rows` has the names, units and definitions of the measures.

An interface sticks while less than STICKING_SLIP_FRACTION of the change of its relative displacement is irreversible. Three
observers add up the time of stick and the starts of slip: `event_driven.window_kernels.add_stick` over the steps of this
engine, `points.observer_kernels.observe_motion` in sweeps, and `measures.measures.observe_stick` over samples. All measures
of stick follow from these sums by `measure_stick`.
"""

from typing import NamedTuple

import numpy as np

# Irreversible part of a change of the relative displacement from which an interface slips; kernels use it too.
STICKING_SLIP_FRACTION = 0.5
FULL_STICK = 1e-12  # fraction by which a time of stick may miss the whole window, or no time at all
MIN_ACCELERATION = 1e-9  # first harmonic [m s-2] below which there is no distortion
MAX_RESTING_SLIDE_RANGE = 1e-15  # largest range of the slide [m] of an interface at rest
# Smallest mean resultant length of the doubled phases of slip starts that are one phase.
MIN_ALIGNMENT = 0.95
MIN_ENERGY_DIFFERENCE = 1e-18  # smallest significant difference of energies [J]

# Values by name, each a number or an array (...) with a value for each run
Values = dict[str, np.ndarray]


class Observations(NamedTuple):
    """What an engine observes of an interface in the last cycles; numbers, or arrays (...) for several runs or interfaces.

    - span, period: duration of these cycles and of one of them [s]
    - force, slip (..., k): extremes of the friction force [N] and of the irreversible slide [m]
    - stick (4, ...): time of stick [s], number of starts of slip, and sums of cosine and sine of twice their phases
    - work: friction work [J]
    - harmonics (2, ...): integrals of slide and friction force times exp(-i omega t) [m s], [N s]
    - cycles (..., n, 5): of every cycle the integral of the slide [m s], the smallest slide [m] and the force there [N],
      the largest slide and the force there; NaN in a cycle that is not observed, and for a force that is not known
    """

    span: np.ndarray
    period: np.ndarray
    force: np.ndarray
    slip: np.ndarray
    stick: np.ndarray
    work: np.ndarray
    harmonics: np.ndarray
    cycles: np.ndarray


def measure_interface(observations: Observations, stiffness) -> Values:
    """Return the measures of an interface in the last cycles by name.

    `stiffness` is that of the first mode at the contact [N/m], 0 if no damping is computed.
    """
    values = {
        "slip_amplitude": np.ptp(observations.slip, axis=-1) / 2,
        "friction_force_peak": np.abs(observations.force).max(axis=-1),
    }
    values |= measure_stick(observations.stick, observations.span)
    area = observations.work * observations.period / observations.span
    values |= measure_loop(observations.cycles[..., 1:], *observations.harmonics, area, stiffness)

    # Change of the mean slide from the first observed cycle to the last one.
    slides = observations.cycles[..., 0]
    if slides.shape[-1] > 1:
        is_known = np.isfinite(slides)
        first = np.take_along_axis(slides, is_known.argmax(axis=-1)[..., None], axis=-1)[..., 0]
        change = (slides[..., -1] - first) / observations.period
        values["drift_per_cycle"] = change / (is_known.sum(axis=-1) - 1)
    return values


def measure_stick(stick, span) -> Values:
    """Return the fraction of stick [1] and the mean phase [rad], modulo pi, at which slip starts after stick.

    The phase is NaN if there is no start, and if the starts differ by more than MIN_ALIGNMENT allows: the mean of several
    phases in a half cycle is the phase of none.

    Parameters
    ----------
    stick : (4, ...) array_like
        Time of stick [s], number of starts of slip, and sums of cosine and sine of twice their phases.
    span : float or (...)
        Time in which they were observed [s].
    """
    time, count, cosine, sine = stick
    # A reversal without stick takes a time of the size of round-off.
    fraction = time / span
    nearest = np.round(fraction)
    have_common_phase = (count > 0) & (np.hypot(cosine, sine) >= MIN_ALIGNMENT * count)
    phase = np.where(have_common_phase, np.arctan2(sine, cosine) / 2 % np.pi, np.nan)
    return {
        "stick_fraction": np.where(np.abs(fraction - nearest) <= FULL_STICK, nearest, fraction)[()],
        "slip_start_phase": phase[()],
    }


def measure_loop(reversals, slide, force, work, stiffness) -> Values:
    """Return loop area, equivalent and secant stiffness, and equivalent damping of an interface.

    The equivalent stiffness is Re(F1/q1), as in harmonic balance. An interface at rest has neither stiffness nor damping.

    Parameters
    ----------
    reversals : (..., n, 4)
        In each of n cycles the smallest slide [m] and the friction force there [N], and the largest slide and the force
        there; NaN if they are unknown. Half the range A of the slide is the mean over the cycles.
    slide, force : complex or (...)
        First harmonics q1 and F1 of relative displacement and friction force, with one factor common to both.
    work : float or (...)
        Friction work W per cycle [J].
    stiffness : float or (...)
        Stiffness K = moving_mass omega_1^2/slide_1^2 of the first mode at the contact [N/m]; 0 if no damping is computed.

    Returns
    -------
    dict
        "loop_area" [J], "secant_stiffness" (F(q_max) - F(q_min))/2A, "equivalent_stiffness" and "harmonic_force_ratio"
        |F1/q1| [N/m], and "equivalent_damping" W/(2 pi K A^2) [1].
    """
    low, force_at_low, high, force_at_high = np.moveaxis(reversals, -1, 0)
    half_range = _average_finite(high - low) / 2
    moves = (half_range > MAX_RESTING_SLIDE_RANGE / 2) & (np.abs(slide) > 0)
    with np.errstate(all="ignore"):
        secant = _average_finite((force_at_high - force_at_low) / (high - low))
        ratio = np.where(moves, force, np.nan) / slide
        damping = np.divide(work, 2 * np.pi * stiffness * half_range**2)
    return {
        "loop_area": work,
        "secant_stiffness": np.where(half_range > MAX_RESTING_SLIDE_RANGE / 2, secant, np.nan),
        "equivalent_stiffness": ratio.real,
        "harmonic_force_ratio": np.abs(ratio),
        "equivalent_damping": np.where(moves & np.greater(stiffness, 0), damping, np.nan),
    }


def measure_acceleration(first, third, span) -> Values:
    """Return the first harmonic of the acceleration [m s-2], and the third relative to it [1].

    Parameters
    ----------
    first, third : complex or (...)
        Integrals of the absolute acceleration times exp(-i omega t) and exp(-3 i omega t) [m/s].
    span : float or (...)
        Duration of the integrals [s].
    """
    fundamental = np.abs(first) * 2 / span
    distortion = np.abs(third) * 2 / span / fundamental
    return {
        "absolute_acceleration_fundamental": fundamental,
        "acceleration_distortion": np.where(fundamental > MIN_ACCELERATION, distortion, np.nan),
    }


def energy_balance(energies: dict[str, float], round_off: float = MIN_ENERGY_DIFFERENCE):
    """Return the relative error of the energy balance [1] of one run, or (n,) of n runs.

    The error is |work in - stored - dissipated| / (integral |power in| + peak stored). Without energy, the result is 0.

    Parameters
    ----------
    energies : dict
        Energies by name [J].
    round_off : float
        Largest difference [J] that counts as 0.
    """
    imbalance = np.abs(
        energies["work_in"] - energies["stored"] - energies["friction"] - energies["viscous"]
    )
    return ratio_or_zero(
        imbalance * (imbalance > round_off), energies["power"] + energies["peak_stored"]
    )


def ratio_or_zero(part, total):
    """Return the ratio of two numbers or arrays, 0 where the denominator is not positive."""
    is_positive = np.asarray(total) > 0
    return (part / np.where(is_positive, total, 1.0) * is_positive)[()]


def _average_finite(values):
    """Return the means (...) of those values (..., n) that are finite numbers; NaN without any."""
    is_known = np.isfinite(values)
    with np.errstate(all="ignore"):
        return np.where(is_known, values, 0.0).sum(axis=-1) / is_known.sum(axis=-1)


class StepReversals(NamedTuple):
    """Reversals of a motion within time steps.

    - step (r,): indices of the steps.
    - fraction (r,): time of the reversal as a fraction of the step [1].
    - position (r,): position at the reversal [m].
    """

    step: np.ndarray
    fraction: np.ndarray
    position: np.ndarray


def find_reversal_steps(time, position, rate) -> StepReversals:
    """Find the reversals of a motion on the cubics through its positions and rates.

    Parameters
    ----------
    time, position, rate : (k,)
        Samples of time [s], position [m] and rate [m/s].

    Returns
    -------
    StepReversals
    """
    step = np.diff(time)
    # Two samples at the same time, at a jump of the force, have no cubic between them. The cubic is scaled by its larger
    # slope, so that squares of tiny motions do not vanish.
    slopes = np.maximum(np.abs(rate[:-1]), np.abs(rate[1:])) * step
    k = np.flatnonzero((rate[:-1] * rate[1:] < 0) & (slopes > 0))
    p = rate[k] * step[k] / slopes[k]
    q = rate[k + 1] * step[k] / slopes[k]
    rise = (position[k + 1] - position[k]) / slopes[k]
    quadratic = 3 * rise - 2 * p - q
    cubic = p + q - 2 * rise
    # The slope is zero where p + 2 quadratic s + 3 cubic s^2 = 0. Neither root cancels if the cubic is nearly a parabola, or
    # if one slope is round-off beside the other.
    root = np.sqrt(np.maximum(quadratic**2 - 3 * cubic * p, 0.0))
    scaled_root = -(quadratic + np.copysign(root, quadratic))
    with np.errstate(divide="ignore", invalid="ignore"):
        first = p / scaled_root
        second = scaled_root / (3 * cubic)
    # Round-off of a fraction of a step
    is_first = np.abs(first - 0.5) <= 0.5 + 1e-9
    s = np.clip(np.where(is_first, first, second), 0.0, 1.0)
    height = slopes[k] * s * (p + s * (quadratic + s * cubic))
    return StepReversals(k, s, position[k] + height)


def find_extremes(time, position, rate) -> tuple[float, float]:
    """Return the smallest and the largest value [m] of the cubics through positions and rates.

    Parameters
    ----------
    time, position, rate : (k,)
        Samples of time [s], position [m] and rate [m/s].
    """
    reversals = find_reversal_steps(time, position, rate)
    values = np.append(position, reversals.position)
    return float(values.min()), float(values.max())
