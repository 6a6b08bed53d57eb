"""Functions that compute measures from the samples of the last cycles.

In: a `Response` of the last cycles. Out: values by name; `rows` has their names, units and
definitions. The samples of an exact run and of a march are treated alike.
"""

from typing import NamedTuple

import numpy as np

from ..core import Response
from ..dynamics import integrated
from ..friction import path_work

# Irreversible fraction of the displacement change above which an interface slips [1]
SLIP_FRACTION = 0.5
COORDINATE_ROUND_OFF = 1e-13  # Round-off error relative to the largest modal coordinate.
MIN_ENERGY_GAP = 1e-18  # Smallest significant difference of energies [J].
# Friction work below this fraction of the energy that passes through a run is round-off.
WORK_ROUND_OFF = 1e-10
MIN_SLIDE_RANGE = 1e-15  # Range of the relative displacement [m] below which nothing moves.
# Largest ratio of second differences at neighbouring samples of a smooth curve.
MAX_SMOOTH_RATIO = 4.0


def energy_balance(energies: dict):
    """Return the relative error of the energy balance [1] of one run, or (n,) of n runs.

    |work in - stored - dissipated| / (integral |power in| + peak stored). A gap of MIN_ENERGY_GAP is the
    round-off of a system at rest; without energy the result is 0.

    Parameters
    ----------
    energies : dict
        Energies by name [J].
    """
    miss = np.abs(
        energies["work_in"] - energies["stored"] - energies["friction"] - energies["viscous"]
    )
    return ratio_or_zero(
        miss * (miss > MIN_ENERGY_GAP), energies["power"] + energies["peak_stored"]
    )


def relative_gap(sampled, balanced, passed, energy=0.0):
    """Return the relative difference of the friction work from samples and from energies.

    Parameters
    ----------
    sampled, balanced : float or (n,) array
        Friction work [J] from samples and from the energy balance.
    passed : float or (n,) array
        Sum of the absolute values of the friction work of all steps [J].
    energy : float or (n,) array, optional
        Energy that passes through the whole run [J]; `WORK_ROUND_OFF` of it is added to `passed`,
        so that a stuck interface shows no round-off.

    Returns
    -------
    float or (n,) array
        Difference of the two works over the exchanged work [1]; 0 if there is none.
    """
    difference = np.abs(sampled - balanced)
    return ratio_or_zero(
        difference * (difference > MIN_ENERGY_GAP), passed + WORK_ROUND_OFF * energy
    )


def ratio_or_zero(part, total):
    """Return part/total, or 0 where the total is not positive."""
    is_positive = np.asarray(total) > 0
    return (part / np.where(is_positive, total, 1.0) * is_positive)[()]


def compute_harmonic(time, weight, values, omega) -> complex:
    """Return the first Fourier coefficient of sampled values at the drive frequency.

    Parameters
    ----------
    time : (k,)
        Times [s].
    weight : (k,)
        Weights of the quadrature.
    values : (k,)
        Samples; the result has their unit.
    omega : float
        Angular frequency [rad/s].
    """
    return 2 * np.sum(weight * values * np.exp(-1j * omega * time)) / np.sum(weight)


def compute_step_harmonic(time, means, omega) -> complex:
    """Return the first Fourier coefficient of a force from its mean in each time step.

    It is exact for a force that is constant in each step, even if it jumps at a sample.

    Parameters
    ----------
    time : (k,)
        Times [s].
    means : (k - 1,)
        Mean of the force in each step.
    omega : float
        Angular frequency [rad/s].
    """
    turn = np.exp(-1j * omega * time)
    return complex(2 / (time[-1] - time[0]) * np.sum(means * np.diff(turn)) / (-1j * omega))


def lateral_history(window: Response, name: str, number: int = 0):
    """Return a history (k,) of an interface perpendicular to its main sliding direction.

    Parameters
    ----------
    window : Response
    name : str
        "slides", "slide_rates", "forces" or "slips".
    number : int
        Index of the interface.

    Returns
    -------
    (k,) array or None
        None if the interface does not move in the second direction.
    """
    found = window.extra.get(f"lateral_{name}")
    return None if found is None or not found[:, number].any() else found[:, number]


def largest_distance(x, y=None) -> float:
    """Return the largest distance [m] between two points of a path on a line or in a plane."""
    if y is None:
        return float(x.max() - x.min())
    best = 0.0
    angle = 0.0
    turns = np.pi * np.arange(180) / 180
    way = 0
    # The search starts with the width in each of 180 directions and continues in that of the widest
    # pair until it grows no more.
    while way < 200:
        turn = turns[way] if way < turns.size else angle
        along = x * np.cos(turn) + y * np.sin(turn)
        i = np.argmax(along)
        j = np.argmin(along)
        apart = float(np.hypot(x[i] - x[j], y[i] - y[j]))
        if apart > best:
            best = apart
            angle = np.arctan2(y[i] - y[j], x[i] - x[j])
        elif way >= turns.size:
            break
        way += 1
    return best


def path_increments(x, y=None) -> np.ndarray:
    """Return the lengths (k - 1,) [m] of the segments of a path."""
    return np.abs(np.diff(x)) if y is None else np.hypot(np.diff(x), np.diff(y))


def compute_slip_measures(
    window: Response, drive, steps_per_cycle: int, second=(None, None)
) -> dict:
    """Return slip amplitude [m], stick fraction [1] and phase at the start of slip [rad].

    The interface sticks while less than SLIP_FRACTION of the change of its slide is irreversible, or while
    it does not slide at all; the instant at which this fraction passes SLIP_FRACTION is interpolated
    linearly between the midpoints of the steps. The phase is that of the first slip after stick,
    modulo pi.

    Parameters
    ----------
    window : Response
        Samples, as many in every cycle.
    drive
        Drive with `period` [s].
    steps_per_cycle : int
    second : tuple
        Slide and slip (k,) [m] in a second direction; None without it.
    """
    across, beside = second
    if largest_distance(window.slide, across) <= MIN_SLIDE_RANGE:
        # The slip of a law without a stiffness follows its traction, even at constant displacement.
        return {"slip_amplitude": 0.0, "stick_fraction": 1.0}
    slip = window.slip
    out = {"slip_amplitude": largest_distance(slip, beside) / 2}
    # There is a single sample, or no slip above round-off.
    if slip.size < 2 or 2 * out["slip_amplitude"] <= slip_round_off(window):
        return out | {"stick_fraction": 1.0}
    cycles = max(1, (slip.size - 1) // steps_per_cycle)
    kept = (
        slice(-cycles * steps_per_cycle - 1, None) if slip.size > steps_per_cycle else slice(None)
    )
    across, beside = (None if one is None else one[kept] for one in second)
    slid = path_increments(slip[kept], beside)
    slide = path_increments(window.slide[kept], across)
    time = window.time[kept]
    still = slide <= COORDINATE_ROUND_OFF * np.abs(window.slide).max(initial=0.0)
    above = np.where(still, 0.0, slid / np.where(still, 1.0, slide)) - SLIP_FRACTION
    before = above[:-1]
    after = above[1:]
    rise = np.abs(after - before)
    # Fraction of the time between two midpoints in which the interpolant is below 0.
    low = np.minimum(before, after)
    high = np.maximum(before, after)
    below = np.where(high < 0, 1.0, np.where(low >= 0, 0.0, -low / np.where(rise > 0, rise, 1.0)))
    middles = (time[1:] + time[:-1]) / 2
    out["stick_fraction"] = (
        float(np.average(below, weights=np.diff(middles))) if below.size else float(above[0] < 0)
    )
    rises = np.flatnonzero((before < 0) & (after >= 0))
    if rises.size:
        at = middles[rises] - before[rises] / rise[rises] * np.diff(middles)[rises]
        out |= slip_start_measure(2 * np.pi / drive.period * at)
    return out


def slip_round_off(window: Response) -> float:
    """Return the round-off error of the slip [m], 1e-13 of the largest modal coordinate."""
    return COORDINATE_ROUND_OFF * float(np.abs(window.modal).max(initial=0.0))


def slip_start_measure(phases) -> dict:
    """Return the mean drive phase [rad] at which slip starts, as a dict.

    The dict is empty if the starts have no phase in common.
    """
    found = integrated.mean_slip_phase(
        len(phases), np.cos(2 * phases).sum(), np.sin(2 * phases).sum()
    )
    return {} if np.isnan(found) else {"slip_start_phase": float(found)}


def compute_ledger_measures(ledger) -> dict:
    """Return the friction work and the energies [J] at the end of a run, as a dict."""
    names = ("friction_work", "energy_stored", "energy_dissipated", "energy_created")
    return {name: float(row[-1]) for name, row in zip(names, ledger)}


def work_difference(work, pairs, jumps: bool = False) -> float:
    """Return the relative difference [1] of the friction work from energies and from samples.

    It is |trapezoidal rule of the forces over the slides - work| over the sum of |work| of all
    steps, and falls with the square of the step.

    Parameters
    ----------
    work : (k,)
        Cumulative friction work of the energy balance [J].
    pairs : sequence
        (slide (k,) [m], force (k,) [N]) of every direction.
    jumps : bool
        Whether the force jumps where the slide starts or reverses. The sample there contains the
        force before the jump, so the force after it is computed from the work of the following
        step.
    """
    parts = np.diff(work)
    total = 0.0
    for slide, force in pairs:
        move = np.diff(slide)
        after = np.divide(parts, move, out=np.zeros_like(move), where=move != 0) if jumps else None
        total += float(path_work.sampled_work(slide, force, after).sum())
    return relative_gap(total, float(work[-1]), float(np.abs(parts).sum()))


def compute_acceleration_peak(window: Response) -> float:
    """Return the peak absolute acceleration [m s-2] at the accelerometer in a window.

    The samples are equally spaced. The vertex of the parabola through the largest inner sample and
    its neighbours is used if the curve is smooth there.
    """
    size = np.abs(window.acceleration)
    top = int(np.argmax(size))
    if not 0 < top < len(size) - 1 or not _is_smooth(size, top):
        return float(size[top])
    left, mid, right = size[top - 1 : top + 2]
    bend = left - 2 * mid + right
    gain = -((right - left) ** 2) / (8 * bend) if bend < 0 else 0.0
    # A larger increase is a jump, not a smooth peak.
    return float(mid + (gain if gain < 0.01 * mid else 0.0))


def _is_smooth(size, top: int) -> bool:
    """Return whether samples (k,) are smooth around their largest value.

    The second difference there is at most MAX_SMOOTH_RATIO times that at the samples on both sides. Next to a
    jump, one of these has the opposite sign.
    """
    bends = -np.diff(size[max(top - 2, 0) : top + 3], 2)
    return bool(bends.min() * MAX_SMOOTH_RATIO >= bends.max())


def peak_sampling_errors(window: Response, climbs: bool = False) -> dict:
    """Return upper bounds on the peaks that the samples miss, as a dict of measures.

    - Acceleration: if it jumps at its largest sample, its change over a step on the smooth side.
    - Normal load that changes: an eighth of its second difference at its smallest and largest
      sample.
    - Friction force over grooves: the change to the neighbouring sample, because runs with fewer
      steps contain some of the same instants and need not show it.

    Parameters
    ----------
    window : Response
    climbs : bool
        Whether the surfaces have grooves, so that the peak of the force lies between samples.
    """
    size = np.abs(window.acceleration)
    out = {}
    top = int(np.argmax(size))
    if 0 < top < len(size) - 1:
        if not _is_smooth(size, top):
            out["absolute_acceleration_peak"] = float(size[top] - max(size[top - 1], size[top + 1]))
    if climbs and len(window.force) > 2:
        force = np.abs(window.force)
        top = min(max(int(np.argmax(force)), 1), len(force) - 2)
        out["friction_force_peak"] = float(force[top] - max(force[top - 1], force[top + 1]))
    load = window.extra.get("normal_load")
    if load is not None and len(load) > 2:
        for name, at in (
            ("normal_load_least", int(np.argmin(load))),
            ("normal_load_peak", int(np.argmax(load))),
        ):
            at = min(max(at, 1), len(load) - 2)
            out[name] = abs(float(load[at - 1] - 2 * load[at] + load[at + 1])) / 8
    return out


class StepReversals(NamedTuple):
    """Reversals of a motion inside time steps.

    - step (r,): indices of the steps.
    - fraction (r,): fractions of the steps at which they lie [1].
    - position (r,): positions there [m].
    """

    step: np.ndarray
    fraction: np.ndarray
    position: np.ndarray


def find_reversal_steps(time, position, rate) -> StepReversals:
    """Find the steps in which a rate changes its sign, on the cubics through samples and rates.

    Parameters
    ----------
    time, position, rate : (k,)
        Samples of time [s], position [m] and rate [m/s].

    Returns
    -------
    StepReversals
    """
    step = np.diff(time)
    k = np.flatnonzero(rate[:-1] * rate[1:] < 0)
    p = rate[k] * step[k]
    q = rate[k + 1] * step[k]
    rise = position[k + 1] - position[k]
    two = 3 * rise - 2 * p - q
    three = p + q - 2 * rise
    # The cubic has zero slope where p + 2 two s + 3 three s^2 = 0; this form of the root avoids
    # cancellation if the cubic is nearly a parabola.
    root = np.sqrt(np.maximum(two**2 - 3 * three * p, 0.0))
    s = np.clip(-p / (two - np.sign(p) * root), 0.0, 1.0)
    return StepReversals(k, s, position[k] + s * (p + s * (two + s * three)))


def measure_half_range(time, position, rate) -> float:
    """Return half the peak-to-peak value [m] of the cubics through samples and rates.

    Parameters
    ----------
    time, position, rate : (k,)
        Samples of time [s], position [m] and rate [m/s].
    """
    reversals = find_reversal_steps(time, position, rate)
    return float(np.ptp(np.concatenate([position, reversals.position]))) / 2


def window_amplitudes(extremes, window: int) -> np.ndarray:
    """Return half the peak-to-peak output [m] of each window, oldest first.

    Parameters
    ----------
    extremes : (c, 2)
        Smallest and largest output of each cycle [m].
    window : int
        Cycles of a window; a partial window at the start is left out, unless it is the only one.
    """
    count = len(extremes) // window
    if count == 0:
        return np.array([(extremes[:, 1].max() - extremes[:, 0].min()) / 2])
    tail = extremes[len(extremes) - count * window :].reshape(count, window, 2)
    return (tail[:, :, 1].max(axis=1) - tail[:, :, 0].min(axis=1)) / 2


def window_end_values(extremes, phasors, window: int) -> tuple:
    """Return amplitude [m] and Fourier coefficient [m] of the last cycle of each window.

    Parameters
    ----------
    extremes : (c, 2)
        Smallest and largest output of each cycle [m].
    phasors : (c,)
        Phasor of each cycle [m].
    window : int
        Cycles of a window.
    """
    pick = np.arange(len(phasors) - 1, -1, -window)[::-1]
    return (extremes[pick, 1] - extremes[pick, 0]) / 2, phasors[pick]
