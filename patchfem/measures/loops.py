"""Friction loop of the last cycles: displacement range, stiffness, damping and drift.

In: samples of the relative displacement (`slide`) of an interface, its rate and the friction force
at any spacing, with two samples at each event of an event-driven run. Out: reversals, secant
stiffness, the measures of the loop, and the drift per cycle. The displacement is interpolated by
cubics. The force is not interpolated at a reversal if it may change by its full range between two
samples there.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..core import max_abs
from ..effects import law_has_trait
from ..motion_measures import find_reversal_steps, measure_loop
from .measures import MODAL_COORDINATE_ROUND_OFF, Values, compute_harmonic


def find_cycle_spans(time, period: float) -> list[tuple[float, float]]:
    """Return the start and end times [s] of the complete cycles in a window, oldest first.

    Cycles are counted from the end, so that an incomplete cycle at the start is omitted.
    """
    count = int((time[-1] - time[0]) / period * (1 + 1e-9) + 1e-6)
    ends = [time[-1] - k * period for k in range(count, -1, -1)]
    return list(pairwise(ends))


def choose_reversal_force_rule(model) -> str:
    """Return by which rule `find_reversals` takes the friction force at a reversal: "jumps", "rate" or "slide".

    The force of the law jumps there, changes with time also at rest, or depends on the relative displacement alone.
    """
    law = model.friction.law
    friction = None if model.rig is None else model.rig.friction
    soft = model.partial_slip or (friction is not None and friction.interfaces[0].partial_slip)
    if law_has_trait(law, "memoryless") and not soft:
        return "jumps"
    # Under a load that varies, the force also changes while the interface is at rest.
    if friction is not None and friction.load_varies:
        return "rate"
    return (
        "slide" if soft or law_has_trait(law, "timeless") or law_has_trait(law, "bonds") else "rate"
    )


def find_reversals(time, slide, rate, force, period: float, rule: str = "rate") -> np.ndarray:
    """Return the smallest slide [m] with the force [N] there, and the largest slide with its force, in each cycle (c, 4).

    An unknown force is NaN, e.g. if the interface is at rest at an end of the window.

    Parameters
    ----------
    time, slide, rate, force : (k,)
        Samples [s], [m], [m/s], [N].
    period : float
        Period [s].
    rule : str
        Rule for the force at a reversal. "jumps": mean of the forces before and after the rest;
        "slide": force at the sample with the largest displacement, extrapolated linearly in the
        displacement; "rate": force interpolated linearly in time. The force is NaN if the
        displacement is largest at an end of the cycle and does not reverse within one step of it.
    """
    spans = find_cycle_spans(time, period)
    reversals = np.full((len(spans), 4), np.nan)
    # Largest time between two samples at the same event, in periods.
    time_tolerance = 1e-9 * period
    for row, (begin, end) in zip(reversals, spans):
        cycle = slice(*np.searchsorted(time, [begin - time_tolerance, end + time_tolerance]))
        # The smallest displacement is the largest one of the motion -q(t).
        for column, sign in ((0, -1), (2, 1)):
            sample, value, fraction = _find_largest(
                time[cycle], sign * slide[cycle], sign * rate[cycle], time_tolerance
            )
            sample += cycle.start
            if rule != "jumps" and fraction == 0.0 and sample in (cycle.start, cycle.stop - 1):
                sample, fraction = _find_velocity_zero(
                    sign * rate, sample, first=sample == cycle.start
                )
            row[column] = sign * value
            if sample is not None:
                row[column + 1] = _find_force_at_reversal(
                    sign * slide, force, sample, fraction, value, rule
                )
    return reversals


def _find_largest(time, y, v, time_tolerance: float) -> tuple[int, float, float]:
    """Find the maximum of a quantity on the cubics through its values and rates.

    Parameters
    ----------
    time, y, v : (k,) array
        Times [s], values and rates of the samples.
    time_tolerance : float
        Steps that are not longer than this time [s] are not searched.

    Returns
    -------
    tuple
        Index of the preceding sample, the maximum, and its position as a fraction of the step.
    """
    peak = int(np.argmax(y))
    best = (peak, float(y[peak]), 0.0)
    # The maximum may lie on the cubic before or after the largest sample.
    first = max(peak - 1, 0)
    near = slice(first, peak + 2)
    for step, fraction, value in zip(*find_reversal_steps(time[near], y[near], v[near])):
        k = first + int(step)
        if time[k + 1] - time[k] > time_tolerance and v[k] > 0 and value > best[1]:
            best = (k, float(value), float(fraction))
    return best


def _find_velocity_zero(v, sample: int, *, first: bool) -> tuple[int | None, float]:
    """Find the zero of a decreasing sampled velocity (k,) next to a given sample.

    The velocity `v` is in [m/s]. The zero is sought in the step before the sample if `first`, else in the step after it.
    Returns the index of the preceding sample and the position as a fraction of the step, or (None, 0) without a zero.
    """
    k = sample - 1 if first else sample
    # Largest rate at which an interface counts as at rest, relative to the largest rate.
    if abs(v[sample]) <= 1e-9 * max_abs(v):
        return sample, 0.0
    if 0 <= k < v.size - 1 and v[k] > 0 >= v[k + 1]:
        return k, float(v[k] / (v[k] - v[k + 1]))
    return None, 0.0


def _find_force_at_reversal(
    slide, force, sample: int, fraction: float, value: float, rule: str
) -> float:
    """Return the friction force [N] at the largest relative displacement, or NaN if it is unknown.

    `slide` (k,) [m] and `force` (k,) [N] are samples. The largest displacement `value` lies in the step after a sample,
    at the fraction `fraction` of the step. The rule is as in `find_reversals`.
    """
    if rule == "rate":
        return float(
            force[sample] + fraction * (force[min(sample + 1, len(force) - 1)] - force[sample])
        )
    peak = sample + int(fraction > 0 and slide[sample + 1] > slide[sample])
    if rule == "jumps":
        return _find_force_around_rest(slide, force, peak, value)
    rise = slide[peak] - slide[sample - 1] if fraction > 0 and sample > 0 else 0.0
    if rise <= 0:
        return float(force[peak])
    return float(force[peak] + (force[peak] - force[sample - 1]) * (value - slide[peak]) / rise)


def _find_force_around_rest(slide, force, sample: int, value: float) -> float:
    """Return the mean of the friction forces [N] before and after a rest at a reversal.

    Parameters
    ----------
    slide, force : (k,) array
        Relative displacements [m] and friction forces [N] of the samples.
    sample : int
        Index of a sample at rest.
    value : float
        Relative displacement of the reversal [m].

    Returns
    -------
    float
        NaN if there is no motion before or after the rest.
    """
    step = np.abs(np.diff(slide))
    # Largest displacement in a time step that counts as rest, relative to that in any step.
    is_moving = step > 1e-3 * step.max(initial=0.0)
    is_moving &= np.maximum(
        np.abs(slide[1:] - value), np.abs(slide[:-1] - value)
    ) > MODAL_COORDINATE_ROUND_OFF * max_abs(slide)
    before = np.flatnonzero(is_moving[:sample])
    after = np.flatnonzero(is_moving[sample:])
    if not before.size or not after.size:
        return np.nan
    return float(force[before[-1]] + force[sample + after[0] + 1]) / 2


class CycleLoop(NamedTuple):
    """First harmonics and work of the friction loop of one cycle.

    - slide, force: first harmonics of relative displacement [m] and friction force [N].
    - work: friction work per cycle [J].
    """

    slide: complex
    force: complex
    work: float


def sample_loop(time, slide, force, omega: float, work: float) -> CycleLoop:
    """Return the friction loop of samples over whole cycles at any spacing, by the trapezoidal rule.

    Parameters
    ----------
    time, slide : (k,)
        Samples of time [s] and relative displacement [m].
    force : (k,) or complex
        Samples of the friction force [N], or its first harmonic if it is known more accurately.
    omega : float
        Angular frequency of the drive [rad/s].
    work : float
        Friction work per cycle [J].
    """
    step = np.diff(time)
    weight = np.append(step, 0.0) + np.append(0.0, step)
    moved = slide - np.average(slide, weights=weight)
    if np.ndim(force):
        force = compute_harmonic(time, weight, force, omega)
    return CycleLoop(compute_harmonic(time, weight, moved, omega), force, work)


def measure_sampled_loop(reversals, loop: CycleLoop, stiffness: float) -> Values:
    """Return the measures of a friction loop by name (`motion_measures.measure_loop`), without those that have no value.

    Parameters
    ----------
    reversals : (c, 4) array
        Reversals in each cycle (`find_reversals`); those of an interface at rest are empty.
    loop : CycleLoop
        First harmonics and work of the loop.
    stiffness : float
        Stiffness K = moving_mass omega_1^2/slide_1^2 of the first mode at the contact [N/m]; 0 if no
        damping is computed.
    """
    values = measure_loop(reversals, *loop, stiffness)
    return {name: float(value) for name, value in values.items() if not np.isnan(value)}


def compute_mean_drift(time, slide, rate, period: float) -> float:
    """Return the change of the mean position per cycle (drift) [m].

    The drift is the difference between the time means of the last and the first cycle, divided by the number
    of cycles between them. For windows below 1.5 cycles, it is the displacement between the ends of the
    window, per cycle.

    Parameters
    ----------
    time, slide, rate : (k,)
        Samples [s], [m], [m/s].
    period : float
        Period [s].
    """
    cycles = (time[-1] - time[0]) / period
    if cycles < 1.5:
        return float(slide[-1] - slide[0]) / max(cycles, 1e-9)

    # The cubic of a step contributes h (y0 + y1)/2 + h^2 (v0 - v1)/12, which is of fourth order at any spacing.
    step = np.diff(time)
    y = slide - slide[0]
    areas = step * (y[1:] + y[:-1]) / 2 + step**2 * (rate[:-1] - rate[1:]) / 12
    area = np.append(0.0, np.cumsum(areas))
    first_end, last_begin = np.interp([time[0] + period, time[-1] - period], time, area)
    return float(area[-1] - last_begin - first_end) / period / (cycles - 1)
