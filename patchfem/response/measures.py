"""Functions that read numbers off the last window of cycles; `rows` has their names, units and definitions.

Everything works on samples: values of an exact run and of a march differ only in how they were made.
"""

import numpy as np

from ..core import Response
from ..dynamics import integrated
from ..friction import path_work

SHARE = 0.5  # irreversible part of the slide from which an interface slips
ROUND = 1e-13  # of the largest coordinate
NOTHING = 1e-18  # J
# of the energy that passes through a run; less friction work than that is round-off
ROUND_OFF_WORK = 1e-10
REST = 1e-15  # m, range of a slide below which nothing moves
SMOOTH = 4.0  # ratio of the bends at three samples, up to which they are those of one curve


def energy_balance(book: dict):
    """Relative gap of the energy balance [1] of a run, or (n,) of many; 0 for a run without energy.

    |work in - stored - dissipated| / (integral |power in| + peak stored); a gap of NOTHING is the round-off of what
    holds still. book: energies [J] by name.
    """
    miss = np.abs(book["work_in"] - book["stored"] - book["friction"] - book["viscous"])
    return ratio_or_zero(miss * (miss > NOTHING), book["power"] + book["peak_stored"])


def relative_gap(sampled, balanced, passed, energy=0.0):
    """Compare the friction work from samples with that of the energy balance.

    Parameters
    ----------
    sampled, balanced : float or (n,) array
        Friction work [J] from samples and from the energy balance.
    passed : float or (n,) array
        Sum of the absolute values of the friction work of all steps [J].
    energy : float or (n,) array, optional
        Energy that passes through the whole run [J]; `ROUND_OFF_WORK` of it counts besides, so that a stuck interface
        shows no round-off.

    Returns
    -------
    float or (n,) array
        Difference of the two over the work that passed [1]; 0 where none did.
    """
    difference = np.abs(sampled - balanced)
    return ratio_or_zero(difference * (difference > NOTHING), passed + ROUND_OFF_WORK * energy)


def ratio_or_zero(part, whole):
    """Return part / whole, and 0 where the whole is not positive; numbers or (n,) arrays."""
    is_positive = np.asarray(whole) > 0
    return (part / np.where(is_positive, whole, 1.0) * is_positive)[()]


def harmonic(time, weight, values, omega) -> complex:
    """First Fourier coefficient 2/T int values exp(-i omega t) dt of samples, in the unit of the values.

    time: (k,) [s]; weight: (k,) of the quadrature; values: (k,); omega [rad/s].
    """
    return 2 * np.sum(weight * values * np.exp(-1j * omega * time)) / np.sum(weight)


def step_harmonic(time, means, omega) -> complex:
    """First Fourier coefficient of a force whose mean (k - 1,) over each step between `time` (k,) [s] is known.

    omega [rad/s]. It is exact for a force that is constant in each step, so a jump at a sample costs nothing.
    """
    turn = np.exp(-1j * omega * time)
    return complex(2 / (time[-1] - time[0]) * np.sum(means * np.diff(turn)) / (-1j * omega))


def lateral(window: Response, name: str, number: int = 0):
    """What moves in the second direction (k,) of an interface of this number that slides in a plane: its "slides",
    "slide_rates", "forces" or "slips"; None where it does not."""
    found = window.extra.get(f"lateral_{name}")
    return None if found is None or not found[:, number].any() else found[:, number]


def widest(x, y=None) -> float:
    """Largest distance between two places x (k,) [m], or (x, y) of a path in a plane."""
    if y is None:
        return float(x.max() - x.min())
    best, angle, turns, way = 0.0, 0.0, np.pi * np.arange(180) / 180, 0
    # the width in each direction, then in that of the widest pair until there is no wider one
    while way < 200:
        turn = turns[way] if way < turns.size else angle
        along = x * np.cos(turn) + y * np.sin(turn)
        i, j = np.argmax(along), np.argmin(along)
        apart = float(np.hypot(x[i] - x[j], y[i] - y[j]))
        if apart > best:
            best, angle = apart, np.arctan2(y[i] - y[j], x[i] - x[j])
        elif way >= turns.size:
            break
        way += 1
    return best


def moved(x, y=None) -> np.ndarray:
    """Distances (k - 1,) between successive places, as of `widest`."""
    return np.abs(np.diff(x)) if y is None else np.hypot(np.diff(x), np.diff(y))


def slip_measures(window: Response, drive, steps_per_cycle: int, second=(None, None)) -> dict:
    """Slip amplitude [m], stick fraction [1] and phase of the first slip after a stick [rad, modulo pi].

    From as many samples in every cycle. The interface sticks while less than SHARE of its slide is irreversible, or it
    does not slide at all; where that share passes SHARE is found between the middles of the steps. second: slide and
    slip (k,) [m] in a second direction, None without one.
    """
    across, beside = second
    if widest(window.slide, across) <= REST:
        # a law without a stiffness swings its traction, and so its slip, at a rest
        return {"slip_amplitude": 0.0, "stick_fraction": 1.0}
    slip = window.slip
    out = {"slip_amplitude": widest(slip, beside) / 2}
    # it ended where it began, or never slipped
    if slip.size < 2 or 2 * out["slip_amplitude"] <= slip_noise(window):
        return out | {"stick_fraction": 1.0}
    cycles = max(1, (slip.size - 1) // steps_per_cycle)
    kept = (
        slice(-cycles * steps_per_cycle - 1, None) if slip.size > steps_per_cycle else slice(None)
    )
    across, beside = (None if one is None else one[kept] for one in second)
    slid, slide, time = (
        moved(slip[kept], beside),
        moved(window.slide[kept], across),
        window.time[kept],
    )
    still = slide <= ROUND * np.abs(window.slide).max(initial=0.0)
    above = np.where(still, 0.0, slid / np.where(still, 1.0, slide)) - SHARE
    before, after = above[:-1], above[1:]
    rise = np.abs(after - before)
    # share of each stretch between two middles that lies below, along the line between them
    low, high = np.minimum(before, after), np.maximum(before, after)
    below = np.where(high < 0, 1.0, np.where(low >= 0, 0.0, -low / np.where(rise > 0, rise, 1.0)))
    middles = (time[1:] + time[:-1]) / 2
    out["stick_fraction"] = (
        float(np.average(below, weights=np.diff(middles))) if below.size else float(above[0] < 0)
    )
    rises = np.flatnonzero((before < 0) & (after >= 0))
    if rises.size:
        at = middles[rises] - before[rises] / rise[rises] * np.diff(middles)[rises]
        out |= slip_start(2 * np.pi / drive.period * at)
    return out


def slip_noise(window: Response) -> float:
    """Range [m] below which slip is no more than the last digit of the coordinates: 1e-13 of the largest one."""
    return ROUND * float(np.abs(window.modal).max(initial=0.0))


def slip_start(phases) -> dict:
    """slip_start_phase [rad] by name of starts of slip at phases (k,) [rad]; {} where they have no phase in common."""
    found = integrated.start_phase(len(phases), np.cos(2 * phases).sum(), np.sin(2 * phases).sum())
    return {} if np.isnan(found) else {"slip_start_phase": float(found)}


def ledger_measures(ledger) -> dict:
    """Work that went in and energy stored, dissipated and created [J], by name, at the end of a ledger (4, k) [J]."""
    names = ("friction_work", "energy_stored", "energy_dissipated", "energy_created")
    return {name: float(row[-1]) for name, row in zip(names, ledger)}


def work_check(work, pairs, jumps: bool = False) -> float:
    """Relative gap between the energy book and the run's own samples [1]; it falls with the square of the step.

    |trapezoid of the forces over the slides - work| over the work that went to and fro. work: (k,) [J] running sum of
    the book; pairs: (slide (k,) [m], force (k,) [N]) of every direction. jumps: whether the force jumps where the slide
    starts or turns. The sample there holds the force before the jump, so the force after it is taken from the work of
    the step that follows.
    """
    parts = np.diff(work)
    total = 0.0
    for slide, force in pairs:
        move = np.diff(slide)
        after = np.divide(parts, move, out=np.zeros_like(move), where=move != 0) if jumps else None
        total += float(path_work.sampled_work(slide, force, after).sum())
    return relative_gap(total, float(work[-1]), float(np.abs(parts).sum()))


def acceleration_peak(window: Response) -> float:
    """Largest |absolute acceleration| [m s-2] at the accelerometer over equally spaced samples of the window.

    Between samples the parabola through the largest inner one and its neighbours is used where it is smooth.
    """
    size = np.abs(window.acceleration)
    top = int(np.argmax(size))
    if not 0 < top < len(size) - 1 or not _smooth_at(size, top):
        return float(size[top])
    left, mid, right = size[top - 1 : top + 2]
    bend = left - 2 * mid + right
    gain = -((right - left) ** 2) / (8 * bend) if bend < 0 else 0.0
    # a larger gain is a jump, not a smooth peak
    return float(mid + (gain if gain < 0.01 * mid else 0.0))


def _smooth_at(size, top: int) -> bool:
    """Whether samples (k,) are smooth at the largest one: there they bend no more than SMOOTH times as much as at the
    samples on both sides. Beside a jump one of those bends the other way."""
    bends = -np.diff(size[max(top - 2, 0) : top + 3], 2)
    return bool(bends.min() * SMOOTH >= bends.max())


def peaks_between(window: Response, climbs: bool = False) -> dict:
    """What sampled peaks may lie above their samples, by name, beside what fewer steps show.

    Where the acceleration jumps at its largest sample, its change over a step on the smooth side; of a normal load that
    changes, an eighth of its second difference at either end of its range. climbs: over grooves the force has its peak
    between samples, which fewer steps need not show as they fall on some of the same instants: what it changes to the
    sample beside it.
    """
    size, out = np.abs(window.acceleration), {}
    top = int(np.argmax(size))
    if 0 < top < len(size) - 1:
        if not _smooth_at(size, top):
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


def turn_shares(time, place, rate) -> tuple:
    """(numbers of the steps in which the rate changes its sign, share of the step at which the cubic turns there).

    time (k,) [s]; place (k,) [m] and rate (k,) [m/s] of samples.
    """
    step = np.diff(time)
    k = np.flatnonzero(rate[:-1] * rate[1:] < 0)
    p, q, rise = rate[k] * step[k], rate[k + 1] * step[k], place[k + 1] - place[k]
    two, three = 3 * rise - 2 * p - q, p + q - 2 * rise
    # p + 2 two s + 3 three s^2 = 0, by the root that keeps its digits where the cubic is nearly a parabola
    root = np.sqrt(np.maximum(two**2 - 3 * three * p, 0.0))
    return k, np.clip(-p / (two - np.sign(p) * root), 0.0, 1.0)


def half_swing(time, place, rate) -> float:
    """Half peak-to-peak [m] of the cubics through samples of a place (k,) [m] and its rate [m/s] at times (k,) [s]."""
    h = np.diff(time)
    k, s = turn_shares(time, place, rate)
    p, q, rise = rate[k] * h[k], rate[k + 1] * h[k], place[k + 1] - place[k]
    two, three = 3 * rise - 2 * p - q, p + q - 2 * rise
    every = np.concatenate([place, place[k] + s * (p + s * (two + s * three))])
    return float(every.max() - every.min()) / 2


def window_amplitudes(extremes, window: int) -> np.ndarray:
    """Half peak-to-peak [m] of the output per window of `window` cycles, oldest first.

    extremes: (c, 2) [m] per cycle; a partial window at the head is left out, unless it is all there is.
    """
    count = len(extremes) // window
    if count == 0:
        return np.array([(extremes[:, 1].max() - extremes[:, 0].min()) / 2])
    tail = extremes[len(extremes) - count * window :].reshape(count, window, 2)
    return (tail[:, :, 1].max(axis=1) - tail[:, :, 0].min(axis=1)) / 2


def window_ends(extremes, phasors, window: int) -> tuple:
    """Amplitudes [m] and phasors [m] of the last cycle of each window of `window` cycles, oldest first.

    extremes: (c, 2) [m] and phasors: (c,) per cycle.
    """
    pick = np.arange(len(phasors) - 1, -1, -window)[::-1]
    return (extremes[pick, 1] - extremes[pick, 0]) / 2, phasors[pick]
