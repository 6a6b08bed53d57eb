"""Computation of measures from the samples of the last cycles.

In: a `Response` of the last cycles of any engine. Out: values by name. `rows` has the names, units and
definitions of the measures.
"""

import numpy as np

from .. import friction
from ..core import Measure, Response, add_interface_number, max_abs
from ..motion_measures import (
    MAX_RESTING_SLIDE_RANGE,
    MIN_ENERGY_DIFFERENCE,
    STICKING_SLIP_FRACTION,
    measure_stick,
    ratio_or_zero,
)

Values = dict[str, float]  # values of measures or their errors by name, in SI units
Measures = dict[str, Measure]  # by name
ArrayPair = tuple[np.ndarray, np.ndarray]  # two arrays of one shape

MODAL_COORDINATE_ROUND_OFF = 1e-13  # Round-off error relative to the largest modal coordinate.


def compare_friction_works(sampled_work, balance_work, exchanged_work, energy=0.0):
    """Return the relative difference between sampled friction work and that in the balance.

    Parameters
    ----------
    sampled_work, balance_work : float or (n,) array
        Friction work [J] from samples and from the energy balance.
    exchanged_work : float or (n,) array
        Sum of the absolute values of the friction work of all steps [J].
    energy : float or (n,) array, optional
        Energy that is exchanged and stored in the whole run [J]. The fraction 1e-10 of
        it is added to `exchanged_work`, so that the result for a stuck interface is not dominated
        by round-off.

    Returns
    -------
    float or (n,) array
        Difference of the two works relative to the exchanged work [1]; 0 without exchanged work.
    """
    difference = np.abs(sampled_work - balance_work)
    return ratio_or_zero(
        difference * (difference > MIN_ENERGY_DIFFERENCE),
        exchanged_work + 1e-10 * energy,
    )


def compute_harmonic(time, weight, values, omega) -> complex:
    """Return the complex amplitude c of sampled values f(t) at the drive frequency: f(t) ~ Re(c exp(i omega t)).

    c = 2/T int f(t) exp(-i omega t) dt over the span T of the samples, by a quadrature.

    Parameters
    ----------
    time : (k,)
        Times [s], whole periods.
    weight : (k,)
        Weights of the quadrature; their sum is arbitrary.
    values : (k,)
        Samples; the result has the same unit.
    omega : float
        Angular frequency [rad/s].
    """
    return 2 * np.sum(weight * values * np.exp(-1j * omega * time)) / np.sum(weight)


def compute_step_harmonic(time, means, omega) -> complex:
    """Return the complex amplitude c [N] of a force F(t) from its means in the time steps: F(t) ~ Re(c exp(i omega t)).

    c = 2/T int F(t) exp(-i omega t) dt over the span T of the steps. It is exact for a force that is constant in each
    step, even if it jumps at a sample.

    Parameters
    ----------
    time : (k,)
        Times [s], from the first sample to the last one, whole periods.
    means : (k - 1,)
        Mean of the force in each step [N].
    omega : float
        Angular frequency [rad/s].
    """
    phase_factor = np.exp(-1j * omega * time)
    return complex(2 / (time[-1] - time[0]) * np.sum(means * np.diff(phase_factor)) / (-1j * omega))


def compute_slip_measures(window: Response, drive, slide_round_off: float = 0.0) -> Values:
    """Return slip amplitude [m], stick fraction [1] and phase of slip onset [rad].

    Parameters
    ----------
    window : Response
        Samples, equally many in each cycle.
    drive
        Drive with `period` [s].
    slide_round_off : float
        Largest half range of the slip that is round-off [m].
    """
    if interpolate_range(window.slide)[0] <= MAX_RESTING_SLIDE_RANGE:
        # The slip of a law without stiffness changes with its traction, even at constant displacement.
        return {"slip_amplitude": 0.0, "stick_fraction": 1.0}

    slip = window.slip
    amplitude = interpolate_range(slip)[0] / 2
    # A single sample, or a slip within round-off, counts as stick.
    round_off = max(estimate_slip_round_off(window), slide_round_off)
    if slip.size < 2 or amplitude <= round_off:
        return {"slip_amplitude": amplitude, "stick_fraction": 1.0}

    steps_per_cycle = max(1, round((window.time.size - 1) * drive.period / window.span))
    cycles = max(1, (slip.size - 1) // steps_per_cycle)
    last_cycles = window.select(slice(-min(slip.size, cycles * steps_per_cycle + 1), None))
    stick, span = observe_stick(last_cycles, 2 * np.pi / drive.period)
    values = {name: float(value) for name, value in measure_stick(stick, span).items()}
    if np.isnan(values["slip_start_phase"]):
        del values["slip_start_phase"]
    return {"slip_amplitude": amplitude} | values


def observe_stick(window: Response, omega: float) -> tuple[np.ndarray, float]:
    """Return sums (4,) over the stick of an interface for `motion_measures.measure_stick`, and their time span [s].

    The irreversible part of the motion is known at the midpoints of the steps, and is linear in between. A step at rest
    counts as one without slip. `motion_measures` names the other two observers and the rule of stick.

    Parameters
    ----------
    window : Response
        Samples of whole cycles.
    omega : float
        Angular frequency of the drive [rad/s].
    """
    slip_steps = np.abs(np.diff(window.slip))
    slide_steps = np.abs(np.diff(window.slide))
    is_moving = slide_steps > MODAL_COORDINATE_ROUND_OFF * max_abs(window.slide)
    ratio = np.divide(slip_steps, slide_steps, out=np.zeros(slip_steps.size), where=is_moving)
    excess = ratio - STICKING_SLIP_FRACTION
    if excess.size == 1:
        return np.array([float(excess[0] < 0), 0.0, 0.0, 0.0]), 1.0

    # Fraction of the time between two midpoints in which the interface sticks
    before = excess[:-1]
    after = excess[1:]
    middles = (window.time[1:] + window.time[:-1]) / 2
    size = np.maximum(np.abs(before) + np.abs(after), 1e-300)
    changes = before * after < 0
    below = np.where(changes, -np.minimum(before, after) / size, np.minimum(before, after) < 0)
    durations = np.diff(middles)

    starts = np.flatnonzero((before < 0) & (after >= 0))
    rise = (after - before)[starts]
    phases = omega * (middles[starts] - before[starts] / rise * durations[starts])
    stick = (below @ durations, starts.size, np.cos(2 * phases).sum(), np.sin(2 * phases).sum())
    return np.array(stick), float(durations.sum())


def estimate_slip_round_off(window: Response) -> float:
    """Return the slip [m] in the window of a run that may be round-off of the modal coordinates."""
    return MODAL_COORDINATE_ROUND_OFF * max_abs(window.modal)


def compute_ledger_measures(ledger) -> Values:
    """Return the last values of the friction work and the energies [J] of a run, by the names of their measures.

    Parameters
    ----------
    ledger : (4, k) array
        Histories [J] of the friction work and of the stored, dissipated and created energy, in this order.
    """
    names = ("friction_work", "energy_stored", "energy_dissipated", "energy_created")
    return {name: float(row[-1]) for name, row in zip(names, ledger)}


def compare_loop_work(work, loops, jumps: bool) -> float:
    """Return the relative difference [1] between the friction work of the engine and int F dx over the samples.

    |sum of int F dx over all directions by the trapezoidal rule - work| / (sum over all steps of |change of work|). It
    decreases with the square of the step size, and shows whether the samples resolve the loop.

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
        total += float(friction.path_work.sampled_work(slide, force, after).sum())
    return compare_friction_works(total, float(work[-1]), float(np.abs(works).sum()))


def compute_peak(values) -> float:
    """Return the largest magnitude of equally spaced samples (k,) (`interpolate_peak`)."""
    return interpolate_peak(np.abs(values))[0]


def interpolate_peak(samples) -> tuple[float, float]:
    """Return the largest value of a curve, and a bound on its error due to sampling.

    If the curve is smooth, its peak is the vertex of the parabola through the largest sample and its
    neighbours. It is smooth if neighbouring second differences around its largest sample differ by
    at most a factor of four; next to a jump, their signs differ. With a jump at the largest
    sample, the error is the change over one step on the smooth side. With a kink between two samples, it is the
    distance of the largest sample from the crossing of the lines through the samples on both sides.

    Parameters
    ----------
    samples : (k,)
        Equally spaced samples.
    """
    # A constant stretch, as of the slip of a contact that sticks, begins at its first sample, whatever its round-off.
    value = float(np.max(samples))
    # Difference of samples that count as equal, relative to the range of all.
    largest = int(np.argmax(samples >= value - 1e-12 * np.ptp(samples)))
    last = len(samples) - 1
    if last < 2:
        return value, 0.0

    # The peak beside an end of the window lies on the parabola through its last three samples.
    middle = min(max(largest, 1), last - 1)
    left, centre, right = samples[middle - 1 : middle + 2].tolist()
    curvature = left - 2 * centre + right
    curvatures = np.diff(samples[max(middle - 2, 0) : middle + 3], 2)
    if 4.0 * curvatures.max() <= curvatures.min():
        # The slope at the middle sample vanishes within one step of it.
        if curvature < 0 and abs(right - left) <= -2 * curvature:
            vertex = centre - (right - left) ** 2 / (8 * curvature)
            # a larger increase indicates a jump, not a smooth peak
            value = vertex if vertex < 1.01 * value else value
        return value, 0.0

    # Beside a jump or a kink, the largest sample is not the peak.
    if middle != largest:
        return value, 0.0
    jump = centre - max(left, right)
    kink_after = _extrapolate_to_kink(left, centre, right, float(samples[min(middle + 2, last)]))
    kink_before = _extrapolate_to_kink(right, centre, left, float(samples[max(middle - 2, 0)]))
    return value, max(jump, kink_after, kink_before)


def _extrapolate_to_kink(before: float, top: float, after: float, last: float) -> float:
    """Return by how much a kink exceeds the largest of four samples, if it lies in the step after it.

    The arguments are successive samples, of which `top` is the largest. The lines through the first two and through the
    last two samples cross at the kink. The result is 0 if they do not cross in this step.
    """
    rise = top - before
    fall = after - last
    crosses = rise > 0 and fall > 0 and 0 < after - top + fall < rise + fall
    return rise * (after - top + fall) / (rise + fall) if crosses else 0.0


def interpolate_range(values) -> tuple[float, float]:
    """Return the range of a curve between its peaks, and a bound on its error due to sampling.

    values (k,): equally spaced samples.
    """
    low = values.min()
    high = values.max()
    rise, rise_error = interpolate_peak(values - low)
    fall, fall_error = interpolate_peak(high - values)
    return float(rise + fall - (high - low)), rise_error + fall_error


def bound_sampling_errors(window: Response) -> Values:
    """Return bounds on the errors of peaks and ranges due to sampling, by measure.

    Runs with fewer steps may not show these errors, because they contain some of the same instants.

    - Acceleration, friction forces and slips: see `interpolate_peak`.
    - Variable normal load: an eighth of the second difference at the smallest and the largest sample.

    Parameters
    ----------
    window : Response
        Equally spaced samples.
    """
    errors = {"absolute_acceleration_peak": interpolate_peak(np.abs(window.acceleration))[1]}
    for k, (force, slip) in enumerate(zip(np.abs(window.forces).T, window.slips.T)):
        errors[add_interface_number("friction_force_peak", k)] = interpolate_peak(force)[1]
        errors[add_interface_number("slip_amplitude", k)] = interpolate_range(slip)[1] / 2
    errors = {name: error for name, error in errors.items() if error > 0}

    # A parabola through three samples of distance h exceeds the middle one by at most an eighth of h^2 y''.
    load = window.extra.get("normal_load")
    if load is not None and len(load) > 2:
        bends = np.abs(np.diff(load, 2)) / 8
        for name, index in (
            ("normal_load_least", np.argmin(load)),
            ("normal_load_peak", np.argmax(load)),
        ):
            errors[name] = float(bends[np.clip(index - 1, 0, bends.size - 1)])
    return errors
