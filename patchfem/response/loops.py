"""Friction loop of the last cycles: displacement range, stiffness, damping and drift.

In: samples of slide, its rate and force, at any spacing; those of an exact run contain both
sides of every event. Out: reversals, secant stiffness, the measures of the loop, and the drift
per cycle. Values and rates define a cubic between samples. For a law with memory the force
reverses at a sample: between the two samples at a reversal it may change by its full range, so
the force is not interpolated there.
"""

from typing import NamedTuple

import numpy as np

from ..effects import law_has_trait
from .measures import COORDINATE_ROUND_OFF

EVENT_TIME_TOL = 1e-9  # Fraction of a period below which two samples are the two sides of an event.
REST_RATE_TOL = 1e-9  # Ratio of the rate to the largest rate below which the interface is at rest.
# Ratio of a displacement step to the largest one above which a rest ends, because round-off is smaller.
MIN_REST_END_STEP = 1e-3


class Reversal(NamedTuple):
    """Displacement [m] at an extreme of a cycle, and the friction force [N] there.

    force is None if the displacement rests at this value over an end of the window, so that one
    side of a jump is not known.
    """

    slide: float
    force: float | None


def cycle_spans(time, period: float) -> list:
    """Return the complete cycles [(start, end)] [s] that sampled times (k,) cover, oldest first.

    They are measured from the end, so that a partial cycle at the start is left out.
    """
    count = int((time[-1] - time[0]) / period * (1 + 1e-9) + 1e-6)
    return [
        (time[-1] - (count - k) * period, time[-1] - (count - k - 1) * period) for k in range(count)
    ]


def reversal_evaluation(model) -> str:
    """Return the name of the rule by which the friction force at a reversal is evaluated."""
    law = model.friction.law
    soft = model.partial_slip or (
        model.rig is not None and model.rig.friction.interfaces[0].partial_slip
    )
    if law_has_trait(law, "memoryless") and not soft:
        return "jumps"
    return (
        "slide" if soft or law_has_trait(law, "timeless") or law_has_trait(law, "bonds") else "rate"
    )


def find_reversals(time, slide, rate, force, period: float, by: str = "rate") -> list:
    """Return the smallest and the largest `Reversal` of the displacement in every cycle.

    Parameters
    ----------
    time, slide, rate, force : (k,)
        Samples [s], [m], [m/s], [N].
    period : float
        Period [s].
    by : str
        Force at the reversal. "jumps": mean of the forces before and after the rest; "slide": force
        at the sample of the largest slide, extrapolated linearly in the slide; "rate": interpolated
        linearly in time. It is None if the slide is largest at an end of the cycle and the reversal
        is more than one sample away, because the force there is not that of a reversal.
    """
    out = []
    near = EVENT_TIME_TOL * period
    for begin, end in cycle_spans(time, period):
        part = slice(*np.searchsorted(time, [begin - near, end + near]))
        pair = []
        for sign in (-1, 1):
            sample, value, share = _find_largest(
                time[part], sign * slide[part], sign * rate[part], near
            )
            sample += part.start
            if by != "jumps" and share == 0.0 and sample in (part.start, part.stop - 1):
                sample, share = _find_rate_zero(sign * rate, sample, first=sample == part.start)
            force_there = None
            if sample is not None:
                force_there = _force_at_reversal(sign * slide, force, sample, share, value, by)
            pair.append(Reversal(sign * value, force_there))
        out.append(tuple(pair))
    return out


def _find_largest(time, y, v, time_tolerance: float) -> tuple:
    """Find the maximum of a sampled quantity on the cubics through its values and rates.

    Returns the index of the sample before it, its value, and the fraction of the step to the next
    sample.
    """
    top = int(np.argmax(y))
    best = (top, float(y[top]), 0.0)
    step = np.diff(time)
    # The maximum may lie on the cubic on either side of the largest sample.
    for k in (top - 1, top):
        if not 0 <= k < step.size or step[k] <= time_tolerance or v[k] <= 0 or v[k + 1] >= 0:
            continue
        a = y[k]
        p = v[k] * step[k]
        q = v[k + 1] * step[k]
        rise = y[k + 1] - y[k]
        mid = 3 * rise - 2 * p - q
        big = p + q - 2 * rise
        root = np.sqrt(max(mid**2 - 3 * big * p, 0.0))
        s = p / (root - mid) if root > mid else 0.0
        value = a + s * (p + s * (mid + s * big))
        if 0 <= s <= 1 and value > best[1]:
            best = (k, float(value), float(s))
    return best


def _find_rate_zero(v, sample: int, *, first: bool) -> tuple:
    """Find the zero of a decreasing sampled rate (k,) next to a given sample.

    The step before the sample `at` is used if `first`, else the step after it.

    Returns the index of a sample and the fraction of the step to the next one; (None, 0) if there
    is no such point.
    """
    k = sample - 1 if first else sample
    if abs(v[sample]) <= REST_RATE_TOL * np.abs(v).max(initial=0.0):
        return sample, 0.0
    if 0 <= k < v.size - 1 and v[k] > 0 >= v[k + 1]:
        return k, float(v[k] / (v[k] - v[k + 1]))
    return None, 0.0


def _force_at_reversal(
    slide, force, sample: int, fraction: float, value: float, by: str
) -> float | None:
    """Return the friction force [N] at the largest displacement; None if it is unknown.

    The largest slide lies at the fraction `share` of the step after sample `at`; `by` as in
    `find_reversals`.
    """
    if by == "rate":
        return float(
            force[sample] + fraction * (force[min(sample + 1, len(force) - 1)] - force[sample])
        )
    top = sample + int(fraction > 0 and slide[sample + 1] > slide[sample])
    if by == "jumps":
        return _force_around_rest(slide, force, top, value)
    rise = slide[top] - slide[sample - 1] if fraction > 0 and sample > 0 else 0.0
    if rise <= 0:
        return float(force[top])
    return float(force[top] + (force[top] - force[sample - 1]) * (value - slide[top]) / rise)


def _force_around_rest(slide, force, sample: int, value: float) -> float | None:
    """Return the mean friction force [N] before and after an interval of rest; None if unknown."""
    step = np.abs(np.diff(slide))
    moves = step > MIN_REST_END_STEP * step.max(initial=0.0)
    moves &= np.maximum(
        np.abs(slide[1:] - value), np.abs(slide[:-1] - value)
    ) > COORDINATE_ROUND_OFF * np.abs(slide).max(initial=0.0)
    before = np.flatnonzero(moves[:sample])
    after = np.flatnonzero(moves[sample:])
    if not before.size or not after.size:
        return None
    return float(force[before[-1]] + force[sample + after[0] + 1]) / 2


def mean_half_range(reversals) -> float:
    """Return half the range of the displacement [m], averaged over the cycles."""
    if not reversals:
        return 0.0
    return float(np.mean([high.slide - low.slide for low, high in reversals])) / 2


def secant_stiffness(reversals) -> float | None:
    """Return the secant stiffness (F(q_max) - F(q_min))/2A [N/m], averaged over the cycles.

    It is None if the displacement changes in no cycle, or if no cycle has both forces.
    """
    stiffnesses = []
    for low, high in reversals:
        if high.slide > low.slide and None not in (low.force, high.force):
            stiffnesses.append((high.force - low.force) / (high.slide - low.slide))
    return float(np.mean(stiffnesses)) if stiffnesses else None


def interface_loop(amplitude: float, q: complex, f: complex, work: float, stiffness: float) -> dict:
    """Return loop area, equivalent stiffness and equivalent damping of an interface as a dict.

    The stiffness Re(F1/q1) refers to the first harmonic of the slide, as in harmonic balance.

    Parameters
    ----------
    amplitude : float
        Half the range A of the slide in a cycle [m].
    q, f : complex
        First Fourier coefficients of slide [m] and force [N].
    work : float
        Friction work W per cycle [J].
    stiffness : float
        K = moving_mass omega_1^2/slide_1^2 of the first mode as seen by the contact [N/m]; 0 omits
        the damping.

    Returns
    -------
    dict
        "loop_area" [J], "equivalent_stiffness" [N/m] and "equivalent_damping" W/(2 pi K A^2) [1];
        only those that have a value.
    """
    found = interface_loops(amplitude, q, f, work, stiffness)
    return {name: float(value) for name, value in found.items() if not np.isnan(value)}


def interface_loops(amplitude, q, f, work, stiffness) -> dict:
    """Return the measures of one friction loop, or of n loops as columns (n,).

    Parameters
    ----------
    amplitude, q, f, work, stiffness
        See `interface_loop`; numbers or (n,).
    """
    moves = (np.asarray(amplitude) > 0) & (np.abs(q) > 0)
    energy = 2 * np.pi * stiffness * np.square(amplitude)
    has_damping = moves & (np.asarray(stiffness) > 0)
    damping = np.where(has_damping, work / np.where(has_damping, energy, 1.0), np.nan)
    return {
        "loop_area": work,
        "equivalent_stiffness": np.where(moves, (f / np.where(moves, q, 1.0)).real, np.nan),
        "equivalent_damping": damping,
    }


def mean_drift(time, slide, rate, period: float) -> float:
    """Return the displacement per cycle [m] by which the mean position moves in a window.

    It is the difference between the time means of the last and the first cycle, divided by the
    number of cycles between them; below 1.5 cycles, the motion between the ends of the window per
    cycle.

    Parameters
    ----------
    time, slide, rate : (k,)
        Samples [s], [m], [m/s].
    period : float
        Period [s].
    """
    end = time[-1]
    start = time[0]
    cycles = (end - start) / period
    if cycles < 1.5:
        return float(slide[-1] - slide[0]) / max(cycles, 1e-9)
    first, last = (
        time_mean(time, slide, rate, begin, begin + period) for begin in (start, end - period)
    )
    return float(last - first) / (cycles - 1)


def time_mean(time, value, rate, begin: float, end: float) -> float:
    """Return the time average of a quantity from cubics through its values and rates.

    Each step contributes h (y0 + y1)/2 + h^2 (v0 - v1)/12, of fourth order at any spacing.

    Parameters
    ----------
    time, value, rate : (k,)
        Samples.
    begin, end : float
        Time span [s].
    """
    near = EVENT_TIME_TOL * (end - begin)
    part = slice(
        np.searchsorted(time, begin - near), np.searchsorted(time, end + near, side="right")
    )
    t = time[part]
    y = value[part]
    v = rate[part]
    step = np.diff(t)
    middle = t[0]
    y = y - y[0]
    area = float(np.sum(step * (y[1:] + y[:-1]) / 2 + step**2 * (v[:-1] - v[1:]) / 12))
    # The gaps between the ends of the span and the nearest samples have the values of these
    # samples.
    area += float(y[-1]) * (end - t[-1]) + float(y[0]) * (middle - begin)
    return float(value[part][0]) + area / (end - begin)
