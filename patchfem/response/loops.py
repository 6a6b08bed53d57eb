"""The friction loop of the last cycles: range of the slide, stiffness and damping of the interface, mean motion.

Everything works on samples that may be unevenly spaced, as those of an exact run are, which have both sides of every
event. Between samples values and rates make a cubic. A law with a memory turns where its samples do: between the two
beside a turn it may give way by all it has, so nothing is read there.
"""

from typing import NamedTuple

import numpy as np

from ..effects import law_has_trait
from .measures import ROUND

CLOSE = 1e-9  # of a period: nearer samples are the two sides of an event
RESTS = 1e-9  # of the largest rate: slower is at rest
MOVES = 1e-3  # of the largest step of the slide: a rest has ended, whatever round-off moved in it


class Reversal(NamedTuple):
    """The largest or the smallest slide of a cycle: its value [m], and the force [N] there.

    force is None where the slide rests at it over an end of the window, so that one side of a jump is not known.
    """

    slide: float
    force: float | None


def cycle_spans(time, period: float) -> list:
    """Whole cycles [(from, to)] [s] of the times (k,) [s], counted back from their end, oldest first."""
    count = int((time[-1] - time[0]) / period * (1 + 1e-9) + 1e-6)
    return [
        (time[-1] - (count - k) * period, time[-1] - (count - k - 1) * period) for k in range(count)
    ]


def at_turns(model) -> str:
    """How the force is read where the slide of a Model turns, as `turns_of` takes it."""
    law, soft = (
        model.friction.law,
        model.partial_slip
        or (model.rig is not None and model.rig.friction.interfaces[0].partial_slip),
    )
    if law_has_trait(law, "memoryless") and not soft:
        return "jumps"
    return (
        "slide" if soft or law_has_trait(law, "timeless") or law_has_trait(law, "bonds") else "rate"
    )


def turns_of(time, slide, rate, force, period: float, by: str = "rate") -> list:
    """(smallest, largest) Turn of the slide of every whole cycle of a window, oldest first.

    time, slide, rate, force: (k,) samples [s, m, m/s, N]; period [s]. by: what the force there is: where it "jumps" the
    mean of the values before and after the rest; where the "slide" makes it that of the sample of the largest slide,
    and straight on along the slide; where its "rate" counts it is straight in time. The force is None where the slide
    is largest at a border of the cycle and turns farther than a sample from it: the force there is not that of a turn.
    """
    out, near = [], CLOSE * period
    for begin, end in cycle_spans(time, period):
        part = slice(*np.searchsorted(time, [begin - near, end + near]))
        pair = []
        for way in (-1, 1):
            at, value, share = _turn(time[part], way * slide[part], way * rate[part], near)
            at += part.start
            if by != "jumps" and share == 0.0 and at in (part.start, part.stop - 1):
                at, share = _crossed(way * rate, at, at == part.start)
            pair.append(
                Reversal(
                    way * value,
                    None if at is None else _pull(way * slide, force, at, share, value, by),
                )
            )
        out.append(tuple(pair))
    return out


def _turn(time, y, v, near: float) -> tuple:
    """(number of the sample before the largest y, that value, share of the way to the next sample)."""
    top = int(np.argmax(y))
    best, step = (top, float(y[top]), 0.0), np.diff(time)
    for k in (top - 1, top):  # the cubics on both sides of the largest sample
        if not 0 <= k < step.size or step[k] <= near or v[k] <= 0 or v[k + 1] >= 0:
            continue
        a, p, q, rise = y[k], v[k] * step[k], v[k + 1] * step[k], y[k + 1] - y[k]
        mid, big = 3 * rise - 2 * p - q, p + q - 2 * rise
        root = np.sqrt(max(mid**2 - 3 * big * p, 0.0))
        s = p / (root - mid) if root > mid else 0.0
        value = a + s * (p + s * (mid + s * big))
        if 0 <= s <= 1 and value > best[1]:
            best = (k, float(value), float(s))
    return best


def _crossed(v, at: int, first: bool) -> tuple:
    """(number of a sample, share of the way to the next one) at which the rate v (k,) falls through 0, in the last step
    before the sample `at` (first) or in the first one after it; (None, 0) where it does not."""
    k = at - 1 if first else at
    if abs(v[at]) <= RESTS * np.abs(v).max(initial=0.0):
        return at, 0.0
    if 0 <= k < v.size - 1 and v[k] > 0 >= v[k + 1]:
        return k, float(v[k] / (v[k] - v[k + 1]))
    return None, 0.0


def _pull(slide, force, at: int, share: float, value: float, by: str) -> float | None:
    """Force [N] at a largest slide `value`, `share` of the way from sample `at` to the next; by: as `turns_of`."""
    if by == "rate":
        return float(force[at] + share * (force[min(at + 1, len(force) - 1)] - force[at]))
    top = at + int(share > 0 and slide[at + 1] > slide[at])
    if by == "jumps":
        return _beside(slide, force, top, value)
    rise = slide[top] - slide[at - 1] if share > 0 and at > 0 else 0.0
    return float(
        force[top] + (force[top] - force[at - 1]) * (value - slide[top]) / rise
        if rise > 0
        else force[top]
    )


def _beside(slide, force, at: int, value: float) -> float | None:
    """Mean of the forces at the last sample before and the first after a rest at the slide `value`, or None."""
    step = np.abs(np.diff(slide))
    moves = step > MOVES * step.max(initial=0.0)
    moves &= np.maximum(np.abs(slide[1:] - value), np.abs(slide[:-1] - value)) > ROUND * np.abs(
        slide
    ).max(initial=0.0)
    before, after = np.flatnonzero(moves[:at]), np.flatnonzero(moves[at:])
    return (
        float(force[before[-1]] + force[at + after[0] + 1]) / 2
        if before.size and after.size
        else None
    )


def half_range(turns) -> float:
    """Half the range of the slide in a cycle, mean over the cycles [m]; 0 without one."""
    return float(np.mean([high.slide - low.slide for low, high in turns])) / 2 if turns else 0.0


def secant_stiffness(turns) -> float | None:
    """(F(q_max) - F(q_min))/2A [N/m], mean over the cycles; None where no cycle slides or none has both forces."""
    found = [
        (high.force - low.force) / (high.slide - low.slide)
        for low, high in turns
        if high.slide > low.slide and None not in (low.force, high.force)
    ]
    return float(np.mean(found)) if found else None


def interface_loop(amplitude: float, q: complex, f: complex, work: float, stiffness: float) -> dict:
    """Loop area per cycle [J], equivalent stiffness Re(F1/q1) [N/m] and damping W/(2 pi K A^2) [1] of the interface.

    amplitude A [m]: half the range of the slide in a cycle; q, f: first Fourier coefficients of
    slide and force; work: W, friction work per cycle [J]; stiffness K = moving_mass
    omega_1^2/slide_1^2 of the first mode as the contact meets it, 0 leaves the damping out. The
    part of the force in phase with the slide is taken over the slide's own first harmonic, as a
    balance of first harmonics does.
    """
    found = interface_loops(amplitude, q, f, work, stiffness)
    return {name: float(value) for name, value in found.items() if not np.isnan(value)}


def interface_loops(amplitude, q, f, work, stiffness) -> dict:
    """What `interface_loop` gives of one loop, numbers or (n,) of many; NaN where there is no value."""
    moves = (np.asarray(amplitude) > 0) & (np.abs(q) > 0)
    whole = 2 * np.pi * stiffness * np.square(amplitude)
    held = moves & (np.asarray(stiffness) > 0)
    return {
        "loop_area": work,
        "equivalent_stiffness": np.where(moves, (f / np.where(moves, q, 1.0)).real, np.nan),
        "equivalent_damping": np.where(held, work / np.where(held, whole, 1.0), np.nan),
    }


def drift(time, slide, rate, period: float) -> float:
    """Mean motion per cycle [m] over the window: time mean of the last cycle less that of the first, over the cycles
    between them.

    time: (k,) [s]; slide: (k,) [m]; rate: (k,) [m/s]; period [s]. In a window below 1.5 cycles it is the motion from
    end to end.
    """
    end, start = time[-1], time[0]
    cycles = (end - start) / period
    if cycles < 1.5:
        return float(slide[-1] - slide[0]) / max(cycles, 1e-9)
    first, last = (
        time_mean(time, slide, rate, begin, begin + period) for begin in (start, end - period)
    )
    return float(last - first) / (cycles - 1)


def time_mean(time, value, rate, begin: float, end: float) -> float:
    """Mean over the time from `begin` to `end` [s] of the cubics through samples and their rates.

    h (y0 + y1)/2 + h^2 (v0 - v1)/12 over each step, fourth order whatever the spacing.
    """
    near = CLOSE * (end - begin)
    part = slice(
        np.searchsorted(time, begin - near), np.searchsorted(time, end + near, side="right")
    )
    t, y, v = time[part], value[part], rate[part]
    step, middle = np.diff(t), t[0]
    y = y - y[0]
    area = float(np.sum(step * (y[1:] + y[:-1]) / 2 + step**2 * (v[:-1] - v[1:]) / 12))
    # what the borders miss of the span, at the value of the border
    area += float(y[-1]) * (end - t[-1]) + float(y[0]) * (middle - begin)
    return float(value[part][0]) + area / (end - begin)
