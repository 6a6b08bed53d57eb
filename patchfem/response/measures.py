"""Computation of measures from the samples of the last cycles.

In: a `Response` of the last cycles of any engine. Out: values by name. `rows` has the names, units and
definitions of the measures.
"""

from typing import NamedTuple

import numpy as np

from ..core import Measure, Response
from ..friction import path_work

Values = dict[str, float]  # values of measures or their errors by name, in SI units
Measures = dict[str, Measure]  # by name
ArrayPair = tuple[np.ndarray, np.ndarray]  # two arrays of one shape

# Largest irreversible fraction of a change of displacement at which an interface counts as stuck.
SLIP_FRACTION = 0.5
COORDINATE_ROUND_OFF = 1e-13  # Round-off error relative to the largest modal coordinate.
MIN_ENERGY_GAP = 1e-18  # Smallest significant difference of energies [J].
# Round-off error of the friction work, relative to the energy that is exchanged and stored in the
# run.
WORK_ROUND_OFF = 1e-10
FRACTION_TOL = 1e-9  # Round-off of a fraction of a step.
MIN_SLIDE_RANGE = 1e-15  # Largest range of the relative displacement [m] of an interface at rest.
# Largest ratio of neighbouring second differences at which a curve counts as smooth.
MAX_SMOOTH_RATIO = 4.0


def energy_balance(energies: Values):
    """Return the relative error of the energy balance [1] of one run, or (n,) of n runs.

    The error is |work in - stored - dissipated| / (integral |power in| + peak stored). Differences up to
    MIN_ENERGY_GAP count as round-off; without energy, the result is 0.

    Parameters
    ----------
    energies : dict
        Energies by name [J].
    """
    imbalance = np.abs(
        energies["work_in"] - energies["stored"] - energies["friction"] - energies["viscous"]
    )
    return ratio_or_zero(
        imbalance * (imbalance > MIN_ENERGY_GAP), energies["power"] + energies["peak_stored"]
    )


def relative_gap(sampled_work, balance_work, exchanged_work, energy=0.0):
    """Return the relative difference between sampled friction work and that in the balance.

    Parameters
    ----------
    sampled_work, balance_work : float or (n,) array
        Friction work [J] from samples and from the energy balance.
    exchanged_work : float or (n,) array
        Sum of the absolute values of the friction work of all steps [J].
    energy : float or (n,) array, optional
        Energy that is exchanged and stored in the whole run [J]. The fraction `WORK_ROUND_OFF` of
        it is added to `exchanged_work`, so that the result for a stuck interface is not dominated
        by round-off.

    Returns
    -------
    float or (n,) array
        Difference of the two works relative to the exchanged work [1]; 0 without exchanged work.
    """
    difference = np.abs(sampled_work - balance_work)
    return ratio_or_zero(
        difference * (difference > MIN_ENERGY_GAP), exchanged_work + WORK_ROUND_OFF * energy
    )


def ratio_or_zero(part, total):
    """Return the ratio of two numbers or arrays, 0 where the denominator is not positive."""
    is_positive = np.asarray(total) > 0
    return (part / np.where(is_positive, total, 1.0) * is_positive)[()]


def compute_harmonic(time, weight, values, omega) -> complex:
    """Return the Fourier coefficient of sampled values at the drive frequency.

    Parameters
    ----------
    time : (k,)
        Times [s].
    weight : (k,)
        Weights of the quadrature.
    values : (k,)
        Samples; the result has the same unit.
    omega : float
        Angular frequency [rad/s].
    """
    return 2 * np.sum(weight * values * np.exp(-1j * omega * time)) / np.sum(weight)


def compute_step_harmonic(time, means, omega) -> complex:
    """Return the Fourier coefficient of a force from its mean value in each time step.

    The result is exact for a force that is constant in each step, even if it jumps at a sample.

    Parameters
    ----------
    time : (k,)
        Times [s].
    means : (k - 1,)
        Mean of the force in each step.
    omega : float
        Angular frequency [rad/s].
    """
    phase_factor = np.exp(-1j * omega * time)
    return complex(2 / (time[-1] - time[0]) * np.sum(means * np.diff(phase_factor)) / (-1j * omega))


def largest_distance(x) -> float:
    """Return the largest distance [m] between two points of equally spaced samples (k,) (`interpolate_ranges`)."""
    return float(interpolate_ranges(x[:, None])[0][0])


def compute_slip_measures(window: Response, drive, steps_per_cycle: int) -> Values:
    """Return slip amplitude [m], stick fraction [1] and phase of slip onset [rad].

    The interface sticks while less than SLIP_FRACTION of the change of its relative displacement is
    irreversible, or while it is at rest. The transition time is interpolated linearly between the
    midpoints of the steps. The phase, modulo pi, is that of the start of slip after stick.

    Parameters
    ----------
    window : Response
        Samples, equally many in each cycle.
    drive
        Drive with `period` [s].
    steps_per_cycle : int
        Number of samples per cycle.
    """
    if largest_distance(window.slide) <= MIN_SLIDE_RANGE:
        # The slip of a law without stiffness changes with its traction, even at constant displacement.
        return {"slip_amplitude": 0.0, "stick_fraction": 1.0}

    slip = window.slip
    measures = {"slip_amplitude": largest_distance(slip) / 2}
    # A single sample, or a slip within round-off, counts as stick.
    if slip.size < 2 or 2 * measures["slip_amplitude"] <= slip_round_off(window):
        return measures | {"stick_fraction": 1.0}

    cycles = max(1, (slip.size - 1) // steps_per_cycle)
    last_cycles = (
        slice(-cycles * steps_per_cycle - 1, None) if slip.size > steps_per_cycle else slice(None)
    )
    slip_steps = np.abs(np.diff(slip[last_cycles]))
    slide_steps = np.abs(np.diff(window.slide[last_cycles]))
    time = window.time[last_cycles]
    is_at_rest = slide_steps <= COORDINATE_ROUND_OFF * np.abs(window.slide).max(initial=0.0)
    excess = compute_slip_excess(slip_steps, slide_steps, is_at_rest)

    # The excess is known at the midpoints of the steps and linear in between.
    before = excess[:-1]
    after = excess[1:]
    below = compute_negative_fraction(before, after)
    middles = (time[1:] + time[:-1]) / 2
    measures["stick_fraction"] = (
        float(np.average(below, weights=np.diff(middles))) if below.size else float(excess[0] < 0)
    )

    onsets = np.flatnonzero((before < 0) & (after >= 0))
    if onsets.size:
        rise = (after - before)[onsets]
        onset_times = middles[onsets] - before[onsets] / rise * np.diff(middles)[onsets]
        measures |= slip_start_measure(2 * np.pi / drive.period * onset_times)
    return measures


def compute_slip_excess(slip_steps, slide_steps, is_at_rest) -> np.ndarray:
    """Return the excess of the ratio slip/displacement of each step over SLIP_FRACTION.

    A step at rest counts as a step without slip.

    Parameters
    ----------
    slip_steps, slide_steps : (k, ...)
        Absolute increments of slip and of relative displacement [m].
    is_at_rest : (k, ...)
        Mask of the steps without motion.
    """
    ratio = slip_steps / np.where(is_at_rest, 1.0, slide_steps)
    return np.where(is_at_rest, 0.0, ratio) - SLIP_FRACTION


def compute_negative_fraction(before, after) -> np.ndarray:
    """Return the fraction of each interval in which linearly interpolated values are negative."""
    rise = np.abs(after - before)
    low = np.minimum(before, after)
    high = np.maximum(before, after)
    return np.where(high < 0, 1.0, np.where(low >= 0, 0.0, -low / np.where(rise > 0, rise, 1.0)))


def slip_round_off(window: Response) -> float:
    """Return the round-off error of the slip [m]."""
    return COORDINATE_ROUND_OFF * float(np.abs(window.modal).max(initial=0.0))


def slip_start_measure(phases) -> Values:
    """Return the mean phase of the drive [rad] at the onsets of slip, as a dict.

    The dict is empty if the onsets have different phases.
    """
    phase = path_work.mean_slip_phase(
        len(phases), np.cos(2 * phases).sum(), np.sin(2 * phases).sum()
    )
    return {} if np.isnan(phase) else {"slip_start_phase": float(phase)}


def compute_ledger_measures(ledger) -> Values:
    """Return the last values of the friction work and the energies [J] of a run, by the names of their measures.

    Parameters
    ----------
    ledger : (4, k) array
        Histories [J] of the friction work and of the stored, dissipated and created energy, in this order.
    """
    names = ("friction_work", "energy_stored", "energy_dissipated", "energy_created")
    return {name: float(row[-1]) for name, row in zip(names, ledger)}


def work_difference(work, loops, jumps: bool = False) -> float:
    """Return the relative difference [1] between the friction works of energies and samples.

    The difference between the trapezoidal rule and `work` is divided by the sum of |work| over all steps.
    It decreases with the square of the step size.

    Parameters
    ----------
    work : (k,)
        Cumulative friction work of the energy balance [J].
    loops : sequence
        Relative displacement (k,) [m] and force (k,) [N] of every direction.
    jumps : bool
        Whether the force jumps where the relative motion starts or reverses. The samples contain
        the force before a jump; the force after it is computed from the work of the following step.
    """
    works = np.diff(work)
    total = 0.0
    for slide, force in loops:
        steps = np.diff(slide)
        after = (
            np.divide(works, steps, out=np.zeros_like(steps), where=steps != 0) if jumps else None
        )
        total += float(path_work.sampled_work(slide, force, after).sum())
    return relative_gap(total, float(work[-1]), float(np.abs(works).sum()))


def compute_peak(values) -> float:
    """Return the largest magnitude of equally spaced samples (k,) (`interpolate_peaks`)."""
    return float(interpolate_peaks(np.abs(values)[:, None])[0][0])


def interpolate_peaks(magnitude) -> ArrayPair:
    """Return the largest values of n curves, and bounds on the errors due to sampling.

    If a curve is smooth, its peak is the vertex of the parabola through the largest sample and its
    neighbours. A curve is smooth if neighbouring second differences around its largest sample differ by
    at most a factor of MAX_SMOOTH_RATIO; next to a jump, their signs differ. With a jump at the largest
    sample, the error is the change over one step on the smooth side. With a kink between two samples, it is the
    distance of the largest sample from the crossing of the lines through the samples on both sides.

    Parameters
    ----------
    magnitude : (k, n)
        Equally spaced samples.

    Returns
    -------
    tuple
        Peaks and errors, (n,) each.
    """
    columns = np.arange(magnitude.shape[1])
    last = len(magnitude) - 1
    largest = magnitude.argmax(axis=0)
    # The peak beside an end of the window lies on the parabola through its last three samples.
    middle = np.clip(largest, 1, max(last - 1, 1))
    samples = magnitude[np.clip(middle + np.arange(-2, 3)[:, None], 0, last), columns]
    curvatures = samples[:-2] - 2 * samples[1:-1] + samples[2:]

    # only second differences of samples inside the window are compared
    curvatures[0] = np.where(middle >= 2, curvatures[0], curvatures[1])
    curvatures[2] = np.where(middle <= last - 2, curvatures[2], curvatures[1])
    is_smooth = curvatures.max(axis=0) * MAX_SMOOTH_RATIO <= curvatures.min(axis=0)
    left, centre, right = samples[1:4]
    # The slope at the middle sample vanishes within one step of it.
    is_peak = is_smooth & (curvatures[1] < 0) & (np.abs(right - left) <= -2 * curvatures[1])
    is_peak &= last >= 2
    vertex = centre - (right - left) ** 2 / (8 * np.where(is_peak, curvatures[1], np.inf))
    value = magnitude[largest, columns]
    # a larger increase indicates a jump, not a smooth peak
    is_peak &= vertex < 1.01 * value

    # Beside a jump or a kink, the largest sample is not the peak.
    jump = centre - np.maximum(left, right)
    kink = np.maximum(
        _extrapolate_to_kink(left, centre, right, samples[4]),
        _extrapolate_to_kink(right, centre, left, samples[0]),
    )
    errors = np.where((middle == largest) & ~is_smooth, np.maximum(jump, kink), 0.0)
    return np.where(is_peak, vertex, value), errors


def _extrapolate_to_kink(before, top, after, last) -> np.ndarray:
    """Return by how much a kink exceeds the largest of four samples (n,), if it lies in the step after it.

    The lines through the first two and through the last two samples cross at the kink. The result is 0 if they do not
    cross in this step.
    """
    rise = top - before
    fall = after - last
    slopes = rise + fall
    fraction = (after - top + fall) / np.where(slopes > 0, slopes, 1.0)
    crosses = (slopes > 0) & (rise > 0) & (fall > 0) & (fraction > 0) & (fraction < 1)
    return np.where(crosses, rise * fraction, 0.0)


def interpolate_ranges(values) -> ArrayPair:
    """Return the ranges of n curves between their peaks, and bounds on the errors due to sampling.

    Parameters
    ----------
    values : (k, n)
        Equally spaced samples.

    Returns
    -------
    tuple
        Ranges and errors, (n,) each, in the unit of the values.
    """
    low = values.min(axis=0)
    high = values.max(axis=0)
    rises, rise_errors = interpolate_peaks(values - low)
    falls, fall_errors = interpolate_peaks(high - values)
    return rises + falls - (high - low), rise_errors + fall_errors


def peak_sampling_errors(window: Response) -> Values:
    """Return bounds on the errors of peaks and ranges due to sampling, by measure.

    Runs with fewer steps may not show these errors, because they contain some of the same instants.

    - Acceleration, friction forces and slips: see `interpolate_peaks`.
    - Variable normal load: an eighth of the second difference at the smallest and the largest sample.

    Parameters
    ----------
    window : Response
        Equally spaced samples.
    """
    forces = np.abs(window.forces)
    errors = {
        "absolute_acceleration_peak": interpolate_peaks(np.abs(window.acceleration)[:, None])[1][0]
    }

    for name, sampling_errors in (
        ("friction_force_peak", interpolate_peaks(forces)[1]),
        ("slip_amplitude", interpolate_ranges(window.slips)[1] / 2),
    ):
        for k, error in enumerate(sampling_errors):
            errors[f"{name}_{k + 1}" if k else name] = error
    errors = {name: float(error) for name, error in errors.items() if error > 0}

    # A parabola through three samples of distance h exceeds the middle one by at most an eighth of h^2 y''.
    load = window.extra.get("normal_load")
    if load is not None and len(load) > 2:
        for name, index in (
            ("normal_load_least", int(np.argmin(load))),
            ("normal_load_peak", int(np.argmax(load))),
        ):
            index = min(max(index, 1), len(load) - 2)
            errors[name] = abs(float(load[index - 1] - 2 * load[index] + load[index + 1])) / 8
    return errors


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
    is_first = np.abs(first - 0.5) <= 0.5 + FRACTION_TOL
    s = np.clip(np.where(is_first, first, second), 0.0, 1.0)
    height = slopes[k] * s * (p + s * (quadratic + s * cubic))
    return StepReversals(k, s, position[k] + height)


def measure_half_range(time, position, rate) -> float:
    """Return half the peak-to-peak value [m] of the cubics through positions and rates.

    Parameters
    ----------
    time, position, rate : (k,)
        Samples of time [s], position [m] and rate [m/s].
    """
    reversals = find_reversal_steps(time, position, rate)
    return float(np.ptp(np.concatenate([position, reversals.position]))) / 2
