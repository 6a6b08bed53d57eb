"""Ringing of a rig while an interface sticks: a decaying sinusoid beside the forced sine and a constant.

The frequency and decay enter nonlinearly, all else linearly (variable projection, Golub and Pereyra 1973). Up to three
sinusoids are fitted together and the one with the most energy is kept.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .. import compiled

LEAST_PERIODS = 1.5  # of the ring in a stick; below them frequency and decay cannot be told apart
LEAST_SAMPLES = 16
MOST_SAMPLES, MOST_STICKS, MOST_TERMS = 600, 20, 3
PER_PERIOD = 24  # samples of a ring that are enough
FAINT = 1e-6  # of the largest value of the signal, below which nothing rings
MISSED = 0.1  # share of the ring that a fit may leave over
WIDEST = 0.5  # largest damping ratio of what is called a ring
WHOLE = 1e-9  # of what the forced sine leaves: a fit that leaves less has found the ring, no other start is tried
ROUNDING = float(np.finfo(float).eps)
# CPU seconds of a look at a fit as Python, per sample and square of columns; looks of a fit
LOOK, LOOKS = (
    8e-7,
    2.0,
)
KERNELS = "response.ringing_kernels"
STEPS = 60  # of a fit
SHORT = 0.9  # of LEAST_PERIODS; a WHOLE fit below it is refused, and its last digits are not sought


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
    if np.size(time) < LEAST_SAMPLES:
        return None
    time, value = _even(np.asarray(time, float), np.asarray(value, float))
    size = max(size or 0.0, float(np.abs(value).max(initial=0.0)))
    if time.size < LEAST_SAMPLES or size == 0:
        return None
    columns = _forced(time, omega)
    rest = value - columns @ np.linalg.lstsq(columns, value, rcond=1e-12)[0]
    if np.abs(rest).max() <= FAINT * size:
        return None
    if time.size > MOST_SAMPLES:  # of a long stick the first part: later less is left of the ring
        # no more samples than the ring needs
        stride = max(1, int(2 * np.pi / _highest(time, rest) / (time[1] - time[0]) / PER_PERIOD))
        time, value, columns, rest = (
            part[::stride][:MOST_SAMPLES].copy() for part in (time, value, columns, rest)
        )
    span = time[-1]
    found = _grown(time, value, columns, rest)
    if found is None:
        return None
    poles, sigma, _ = found
    left, shares = _share(time, value, columns, poles)
    k = int(np.argmax([np.sum(part**2) for part in shares]))
    own, rate = poles[2 * k : 2 * k + 2]
    amplitude, damping = float(np.abs(shares[k]).max()), float(rate / np.hypot(rate, own))
    seen = span * own >= 2 * np.pi * LEAST_PERIODS and own * np.diff(time).max() < np.pi / 2
    steady = (
        omega > 0
        and span * omega > 3 * np.pi
        and abs(damping) < 1e-3
        and abs(own / omega - round(own / omega)) < 1e-2
    )
    if (
        not seen
        or steady
        or amplitude <= FAINT * size
        or not -0.02 < damping < WIDEST
        or np.sqrt(np.mean(left**2)) > MISSED * np.sqrt(np.mean(shares[k] ** 2))
    ):
        return None
    few = poles
    if time.size >= 2 * LEAST_SAMPLES:
        few = _refined(time[::2].copy(), value[::2].copy(), columns[::2], poles).poles
    apart = np.abs(few - poles)[2 * k : 2 * k + 2] + 2 * sigma[2 * k : 2 * k + 2]
    return Ring(
        float(own / (2 * np.pi)),
        damping,
        amplitude,
        (float(apart[0] / (2 * np.pi)), float(apart[1] / own)),
    )


def held_ring(amplitude: float, own: float, damping: float, size: float) -> dict:
    """ring_frequency [Hz] and ring_damping [1] of a decaying sinusoid known in closed form; {} where it is too faint.

    amplitude [m s-2]: its largest, 0 where nothing rings; own [rad/s]; size [m s-2] of the whole signal.
    """
    if not amplitude > FAINT * size:
        return {}
    return {"ring_frequency": float(own / (2 * np.pi)), "ring_damping": float(damping)}


class HeldMode(NamedTuple):
    """A mode that rings while every interface holds: begin, end [s] of the stick; frequency [Hz] as seen, damping ratio
    [1], size at the output of its displacement [m] and of its acceleration [m s-2] at `begin`."""

    begin: float
    end: float
    frequency: float
    damping: float
    displacement: float
    acceleration: float


def held_modes(modes, stiffness, motion) -> list:
    """The HeldModes of a motion without a sine while every interface holds by a spring, of the eigenvalues of the rig.

    stiffness (i,) [N/m] of the interfaces; motion: Response of the stick. Two states h apart differ by c (e^(lambda h)
    - 1) in every mode, whatever the place it swings about, so each amplitude c follows from them alone.
    """
    n, rows = modes.omega.size, modes.interfaces
    whole = np.diag(modes.omega**2) + rows.T * stiffness @ rows / modes.mass
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-whole, -modes.damping_matrix]])
    values, shapes = np.linalg.eig(matrix)
    state = np.concatenate([motion.modal[:2], motion.modal_rate[:2]], axis=1)
    turned = np.expm1(values * (motion.time[1] - motion.time[0]))
    told = (values.imag > 0) & (np.abs(turned) > FAINT)
    sizes = np.linalg.solve(shapes, (state[1] - state[0]).astype(complex))[told] / turned[told]
    # a pair of eigenvalues makes one real sinusoid
    out = 2 * np.abs(modes.output @ shapes[:n, told] * sizes)
    return [
        HeldMode(
            float(motion.time[0]),
            float(motion.time[-1]),
            one.imag / (2 * np.pi),
            -one.real / abs(one),
            float(size),
            float(size * abs(one) ** 2),
        )
        for one, size in zip(values[told], out)
    ]


def strongest(held: list, kind: str) -> HeldMode:
    """The one of HeldModes with the most energy over the stick, by the square of its "displacement" or its
    "acceleration"."""

    def energy(one: HeldMode) -> float:
        fall = 4 * np.pi * one.damping * one.frequency * (one.end - one.begin)
        return getattr(one, kind) ** 2 * (-np.expm1(-fall) / fall if fall else 1.0)

    return max(held, key=energy)


def ringing(time, value, sticks, omega: float = 0.0) -> tuple:
    """Frequency [Hz] and damping ratio [1] of what rings in a signal, and their errors: medians over the sticks.

    Returns ({ring_frequency, ring_damping}, their errors); ({}, {}) where nothing rings. sticks: [(begin, end)] [s].
    The error is twice what the spread leaves of the median, and that of a fit.
    """
    size = float(np.abs(value).max(initial=0.0))
    found = []
    for begin, end in sticks[-MOST_STICKS:]:
        part = slice(
            np.searchsorted(time, begin, side="left"), np.searchsorted(time, end, side="right")
        )
        one = ring(time[part], value[part], omega, size)
        if one is not None:
            found.append(one)
    if not found:
        return {}, {}
    values, errors = {}, {}
    for k, name in enumerate(("frequency", "damping")):
        each, own = (
            np.array([getattr(one, name) for one in found]),
            np.array([one.errors[k] for one in found]),
        )
        middle = float(np.median(each))
        spread = 1.4826 * float(np.median(np.abs(each - middle))) / np.sqrt(each.size)
        values[f"ring_{name}"], errors[f"ring_{name}"] = middle, 2 * spread + float(np.median(own))
    return values, errors


def _even(time, value) -> tuple:
    """Samples at equal steps, times from 0; the ones that stand beside them (both sides of an event) are left out."""
    if time.size < 3:
        return time, value
    step = float(np.median(np.diff(time)))
    number = np.round((time - time[np.argmin(np.abs(np.diff(time) - step))]) / step)
    offset = time - number * step
    on = np.abs(offset - np.median(offset)) < 1e-6 * step
    if on.sum() < LEAST_SAMPLES:
        return np.empty(0), np.empty(0)
    time, value = time[on], value[on]
    return time - time[0], value


def _forced(time, omega: float) -> np.ndarray:
    parts = [np.ones(time.size)]
    if omega > 0:
        parts += [np.cos(omega * time), np.sin(omega * time)]
    return np.stack(parts, axis=1)


class _Fit(NamedTuple):
    """Sinusoids fitted to a signal: poles (2 r,), their standard errors, root mean square of what is left over."""

    poles: np.ndarray
    sigma: np.ndarray
    rms: float


def _fitted(time, value, forced, poles, *ends) -> tuple:
    """(times that a fit was looked at, the sum of squares that the best one leaves, its room as
    `ringing_kernels.fitted` has it, until the next call); poles (2 r,) move to the best ones, not at all without
    `ends`."""
    room = _room(forced.shape[1] + poles.size, poles.size, time.size)
    room[0][0, : forced.shape[1]] = forced.T
    fit = compiled.kernels(KERNELS).fitted
    fit.expect(LOOKS * LOOK * time.size * (forced.shape[1] + poles.size) ** 2)
    ends = np.array([*ends, STEPS] if ends else [0.0] * 4)
    return *fit(time, value, poles, np.abs(poles) + 1 / time[-1], ends, room), room


@lru_cache(maxsize=16)
def _room(count: int, many: int, samples: int) -> tuple:
    """The room of a fit of `many` poles; the same at every call, which spares the time to make and describe it."""
    return (
        np.empty((3, count, samples)),
        np.empty((count + 2, count)),
        np.empty((many, samples)),
        np.zeros((many, many + 1)),
        np.empty((many + 2, many)),
    )


def _share(time, value, forced, poles) -> tuple:
    """Part of each sinusoid: (what is left over (k,), the sinusoids [(k,)])."""
    n, (columns, few, *_) = forced.shape[1], _fitted(time, value, forced, poles)[2]
    return columns[2, 0].copy(), [
        few[-1, at : at + 2] @ columns[0, at : at + 2] for at in range(n, n + poles.size, 2)
    ]


def _grown(time, value, forced, rest) -> _Fit | None:
    """The fit of the sinusoids that there are: one is added after the other while each halves what is left."""
    scale = last = np.sqrt(np.mean(rest**2))
    best = None
    for _ in range(MOST_TERMS):
        poles = best.poles if best is not None else np.empty(0)
        tries = []
        for start in _starts(time, value, forced, poles, rest):
            tries.append(_refined(time, value, forced, np.append(poles, start), WHOLE * scale))
            if tries[-1].rms < WHOLE * scale:
                break
        new = min(tries, key=lambda one: one.rms)
        if not np.isfinite(new.rms) or new.rms > last / 2:  # less gain is noise
            break
        best, last = new, new.rms
        if last < 1e-6 * scale or time.size < 8 * (len(best.poles) + 2):
            break
        rest = _share(time, value, forced, best.poles)[0]
    return best


def _highest(time, rest) -> float:
    """Frequency [rad/s] of the highest line of `rest` (k,)."""
    window, size = np.hanning(time.size + 2)[1:-1], 4 * time.size
    lines = np.abs(np.fft.rfft(rest * window, size))
    lines[:2] = 0.0
    return 2 * np.pi * int(np.argmax(lines)) / (size * (time[1] - time[0]))


def _starts(time, value, forced, poles, rest) -> list:
    """Starting values around the highest line of what is left: the best of them by projection, with two decays."""
    span, top = time[-1], _highest(time, rest)
    near = [own for own in top + np.linspace(-1.2, 1.2, 7) * 2 * np.pi / span if own > np.pi / span]
    sizes = [_fitted(time, value, forced, np.append(poles, (own, 0.5 / span)))[1] for own in near]
    own = near[int(np.argmin(sizes))] if near else top
    return [np.array([own, decay / span]) for decay in (0.1, 2.0)]


def _refined(time, value, forced, poles, whole: float = 0.0) -> _Fit:
    """The fit to which `poles` lead, by Levenberg and Marquardt's method on the projected residual.

    It ends where the residual is rounding of the signal, where a step gains less than the rounding of the sum of
    squares it lowers, or where less than `whole` (rms) is left by sinusoids too slow to be a ring.
    """
    poles, scale, short = (
        poles.copy(),
        np.abs(poles) + 1 / time[-1],
        SHORT * 2 * np.pi * LEAST_PERIODS / time[-1],
    )
    _, size, (*_, normal, _) = _fitted(
        time,
        value,
        forced,
        poles,
        (4 * ROUNDING) ** 2 * (value @ value),
        time.size * whole**2,
        short,
    )
    rms = float(np.sqrt(size / time.size))
    return _Fit(
        poles, np.sqrt(np.maximum(np.diag(np.linalg.pinv(normal[:, :-1])), 0)) * rms * scale, rms
    )
