"""What rings while an interface sticks: a decaying sinusoid beside the forced sine and a constant.

The frequency and decay enter nonlinearly, all else linearly (variable projection, Golub and Pereyra 1973); up to three
sinusoids are fitted together and the one with the most energy is kept.
"""

from dataclasses import dataclass

import numpy as np

LEAST_PERIODS = 1.5  # of the ring in a stick; below them frequency and decay cannot be told apart
LEAST_SAMPLES = 16
MOST_SAMPLES, MOST_STICKS, MOST_TERMS = 600, 40, 3
FAINT = 1e-6  # of the largest value of the signal, below which nothing rings
MISSED = 0.1  # share of the ring that a fit may leave over
WIDEST = 0.5  # largest damping ratio of what is called a ring


@dataclass(frozen=True, eq=False, slots=True)
class Ring:
    """A decaying sinusoid: frequency [Hz] as seen, damping ratio [1], amplitude at the start, and the errors of the
    first two."""

    frequency: float
    damping: float
    amplitude: float
    errors: tuple


def ring(time, value, omega: float = 0.0, size: float | None = None) -> Ring | None:
    """The ring in value (k,) at times (k,) [s] of one stick; None where none is seen.

    omega [rad/s] of a forced sine, 0 for none; size: largest value of the signal elsewhere. A line at a harmonic of the
    drive that does not decay is forced and no ring.
    """
    time, value = _even(np.asarray(time, float), np.asarray(value, float))
    size = max(size or 0.0, float(np.abs(value).max(initial=0.0)))
    if time.size < LEAST_SAMPLES or size == 0:
        return None
    span, columns = time[-1], _forced(time, omega)
    rest = value - columns @ np.linalg.lstsq(columns, value, rcond=None)[0]
    if np.abs(rest).max() <= FAINT * size:
        return None
    found = _grown(time, value, columns, rest)
    if found is None:
        return None
    poles, sigma = found
    left, shares = _share(time, value, columns, poles)
    k = int(np.argmax([np.sum(part**2) for part in shares]))
    own, rate = poles[2 * k:2 * k + 2]
    amplitude, damping = float(np.abs(shares[k]).max()), float(rate / np.hypot(rate, own))
    seen = span * own >= 2 * np.pi * LEAST_PERIODS and own * np.diff(time).max() < np.pi / 2
    steady = omega > 0 and span * omega > 3 * np.pi and abs(damping) < 1e-3 \
        and abs(own / omega - round(own / omega)) < 1e-2
    if not seen or steady or amplitude <= FAINT * size or not -0.02 < damping < WIDEST \
            or np.sqrt(np.mean(left**2)) > MISSED * np.sqrt(np.mean(shares[k]**2)):
        return None
    few = _refined(time[::2], value[::2], columns[::2], poles)[0] if time.size >= 2 * LEAST_SAMPLES else poles
    apart = np.abs(few - poles)[2 * k:2 * k + 2] + 2 * sigma[2 * k:2 * k + 2]
    return Ring(float(own / (2 * np.pi)), damping, amplitude, (float(apart[0] / (2 * np.pi)), float(apart[1] / own)))


def ringing(time, value, sticks, omega: float = 0.0) -> tuple:
    """({ring_frequency [Hz], ring_damping [1]}, their errors): medians over the sticks [(begin, end)] [s] of a signal;
    ({}, {}) where nothing rings. The error is twice what the spread leaves of the median, and that of a fit."""
    size = float(np.abs(value).max(initial=0.0))
    found = []
    for begin, end in sticks[-MOST_STICKS:]:
        part = slice(np.searchsorted(time, begin, side="left"), np.searchsorted(time, end, side="right"))
        one = ring(time[part], value[part], omega, size)
        if one is not None:
            found.append(one)
    if not found:
        return {}, {}
    values, errors = {}, {}
    for k, name in enumerate(("frequency", "damping")):
        each, own = np.array([getattr(one, name) for one in found]), np.array([one.errors[k] for one in found])
        middle = float(np.median(each))
        spread = 1.4826 * float(np.median(np.abs(each - middle))) / np.sqrt(each.size)
        values[f"ring_{name}"], errors[f"ring_{name}"] = middle, 2 * spread + float(np.median(own))
    return values, errors


def _even(time, value) -> tuple:
    """Samples at equal steps, times from 0: the ones that stand beside them (both sides of an event) left out."""
    if time.size < 3:
        return time, value
    step = float(np.median(np.diff(time)))
    number = np.round((time - time[np.argmin(np.abs(np.diff(time) - step))]) / step)
    offset = time - number * step
    on = np.abs(offset - np.median(offset)) < 1e-6 * step
    if on.sum() < LEAST_SAMPLES:
        return np.empty(0), np.empty(0)
    time, value = time[on], value[on]
    thin = -(-time.size // MOST_SAMPLES)
    if thin > 1:  # the first part of a long stick: what rings has decayed later
        time, value = time[:MOST_SAMPLES], value[:MOST_SAMPLES]
    return time - time[0], value


def _forced(time, omega: float) -> np.ndarray:
    parts = [np.ones(time.size)]
    if omega > 0:
        parts += [np.cos(omega * time), np.sin(omega * time)]
    return np.stack(parts, axis=1)


def _columns(time, forced, poles) -> np.ndarray:
    parts = [forced]
    for own, rate in poles.reshape(-1, 2):
        fall = np.exp(np.clip(-rate * time, -50, 50))
        parts.append(np.stack([fall * np.cos(own * time), fall * np.sin(own * time)], axis=1))
    return np.concatenate(parts, axis=1)


def _share(time, value, forced, poles) -> tuple:
    """(what is left over (k,), the sinusoids [(k,)])."""
    columns = _columns(time, forced, poles)
    numbers = np.linalg.lstsq(columns, value, rcond=1e-12)[0]
    n = forced.shape[1]
    shares = [columns[:, n + 2 * k:n + 2 * k + 2] @ numbers[n + 2 * k:n + 2 * k + 2] for k in range(len(poles) // 2)]
    return value - columns @ numbers, shares


def _grown(time, value, forced, rest) -> tuple | None:
    """(poles (2 r,) frequency [rad/s] and decay [1/s] in turn, their standard errors), one sinusoid after the other
    until little is left."""
    poles, scale, best = np.empty(0), np.sqrt(np.mean(rest**2)), None
    for _ in range(MOST_TERMS):
        starts = _starts(time, value, forced, poles, rest)
        tries = [_refined(time, value, forced, np.append(poles, start)) for start in starts]
        best = min(tries, key=lambda one: one[2])
        poles = best[0]
        rest = _share(time, value, forced, poles)[0]
        if best[2] < 1e-3 * scale or time.size < 8 * (len(poles) + 2):
            break
    return best[:2] if best is not None else None


def _starts(time, value, forced, poles, rest) -> list:
    """Starting values: around the highest line of what is left, the best of them by projection, with two decays."""
    step, span = time[1], time[-1]
    window = np.hanning(time.size + 2)[1:-1]
    lines = np.abs(np.fft.rfft(rest * window, 8 * time.size))
    lines[:4] = 0.0
    top = 2 * np.pi * np.fft.rfftfreq(8 * time.size, step)[int(np.argmax(lines))]
    near = [own for own in top + np.linspace(-1.5, 1.5, 13) * 2 * np.pi / span if own > np.pi / span]
    sizes = [np.sum(_share(time, value, forced, np.append(poles, (own, 0.5 / span)))[0]**2) for own in near]
    own = near[int(np.argmin(sizes))] if near else top
    return [np.array([own, decay / span]) for decay in (0.1, 2.0)]


def _refined(time, value, forced, poles) -> tuple:
    """(poles, their standard errors, rms of what is left) by least squares of the projected residual."""
    from scipy.optimize import least_squares

    scale = np.abs(poles) + 1 / time[-1]
    size = max(float(np.abs(value).max()), 1e-300)

    def left(x):
        return _share(time, value, forced, x * scale)[0] / size

    found = least_squares(left, poles / scale, method="lm", max_nfev=60 * poles.size, xtol=1e-13, ftol=1e-13,
                          gtol=1e-15)
    rms = float(np.sqrt(np.mean(found.fun**2)))
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * rms**2
    return found.x * scale, np.sqrt(np.maximum(np.diag(covariance), 0)) * scale, rms * size
