"""Local series of drives in NumPy, whose compiled form is `dynamics.events.drive_kernels`: the Taylor coefficients of
sines whose phase is itself a series, by their recurrence, and a record between its rows."""

from math import cos, sin, tau

import numpy as np


def waves(phase, terms: int) -> tuple:
    """Series (terms,) of sin and cos of a phase [rad] that is a series itself, coefficients from the constant one on.

    s' = phi' c and c' = -phi' s, so (k + 1) s_(k+1) = sum_j (j + 1) phi_(j+1) c_(k-j), and the like for c.
    """
    sine = [sin(phase[0])]
    cosine = [cos(phase[0])]
    slope = [(k + 1) * p for k, p in enumerate(phase[1:])]
    for k in range(terms - 1):
        s = c = 0.0
        for j, w in enumerate(slope[: k + 1]):
            s += w * cosine[k - j]
            c -= w * sine[k - j]
        sine.append(s / (k + 1))
        cosine.append(c / (k + 1))
    return np.array(sine), np.array(cosine)


def growth(rate: float, terms: int) -> list:
    """Series of exp(rate u), ended where a term is no longer seen beside the first; at most `terms` of it."""
    out = [1.0]
    while len(out) < terms and abs(out[-1]) > 1e-20:
        out.append(out[-1] * rate / len(out))
    return out


def chirp(sweep, time: float, unit: float, terms: int) -> np.ndarray:
    """Series (terms,) in (t - time)/unit of a Sweep that has not reached its end [m s-2]."""
    here = float(sweep.frequency(time))
    if sweep.logarithmic and sweep.high != sweep.low:
        rate = np.log(sweep.high / sweep.low) / sweep.duration * unit
        part = growth(rate, terms)
        turns = [0.0, *(here * unit * p / (k + 1) for k, p in enumerate(part[: terms - 1]))]
        square = growth(2 * rate, terms)
    else:
        slope = (sweep.high - sweep.low) / sweep.duration * unit
        turns = [0.0, here * unit, slope * unit / 2]
        square = [1.0, 2 * slope / here, (slope / here) ** 2]
    phase = [tau * x for x in turns]
    phase[0] = float(sweep.phase(time)) % tau
    sine = waves(phase, terms)[0]
    if sweep.displacement is None:
        return sweep.acceleration * sine
    return sweep.displacement * (tau * here) ** 2 * np.convolve(sine, square)[:terms]


def steady(sweep, time: float, unit: float, terms: int) -> np.ndarray:
    """Series (terms,) in (t - time)/unit of a Sweep that stays at its last frequency [m s-2]."""
    speed = tau * sweep.high
    size = sweep.acceleration if sweep.displacement is None else sweep.displacement * speed**2
    return size * waves([float(sweep.phase(time)) % tau, speed * unit], terms)[0]


def series(drive, number: int, time: float, unit: float, terms: int) -> np.ndarray:
    """Drive (terms,) [m s-2] as a series in (t - time)/unit.

    number: of a Sweep 0 during it and 1 after it; of a Recorded that of the row before, 0 after the last.
    """
    if not hasattr(drive, "value"):
        return (steady if number else chirp)(drive, time, unit, terms)
    out = np.zeros(terms)
    if number < len(drive.time) - 1:
        low, high = drive.value[number : number + 2]
        slope = (high - low) / (drive.time[number + 1] - drive.time[number])
        out[:2] = low + slope * (time - drive.time[number]), slope * unit
    return out
