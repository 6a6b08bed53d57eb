"""Half cycles of a measured free decay, with a sine fitted to each of them.

A half cycle lies between two reversals. With dry friction, it is m + S/2 sin(w (t - t_k)), with the midpoint
t_k and a different mean m in each half cycle. With viscous damping, the sine has the factor exp(-s (t - t_k)).
Both forms are fitted to all half cycles from the beginning of the record, and the one with the smaller
residual is used.
"""

from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from ..measures.decay_curve import HalfCycles, smooth_slopes
from .sinusoids import MAX_SINUSOID_EVALUATIONS, START_TOL, SinusoidProblem

MIN_HALF_CYCLE_SAMPLES = 5  # smallest number of samples in a half cycle
# Smallest relative standard deviation of the midpoint (relative to the half period) and the size of a half cycle,
# because a half cycle is not exactly a sine.
SINE_FIT_ERROR = 3e-5
# Half cycles on each side from which the noise of a half cycle is estimated
N_NEIGHBOUR_HALF_CYCLES = 8
# Cycles at the beginning of a decay to which the first sinusoid is fitted
N_CYCLES_OF_FIRST_SINE = 1.2
PADDING_FACTOR = 8  # length of the zero-padded record relative to the record, for a finer spectrum


class _FittedSines(NamedTuple):
    """Sines fitted to n half cycles.

    - middle, size, length (n,): midpoint [s], peak-to-peak value with its sign, and half period [s].
    - middle_error, size_error (n,): standard deviations of midpoint and size per unit of noise.
    - square, n_free (n,): sum of squares and degrees of freedom of the residual.
    """

    middle: np.ndarray
    size: np.ndarray
    length: np.ndarray
    middle_error: np.ndarray
    size_error: np.ndarray
    square: np.ndarray
    n_free: np.ndarray

    def compute_noise(self) -> np.ndarray:
        """Return the standard deviation (n,) of the noise in the neighbourhood of each half cycle."""
        window = np.ones(2 * N_NEIGHBOUR_HALF_CYCLES + 1)
        inner = slice(N_NEIGHBOUR_HALF_CYCLES, -N_NEIGHBOUR_HALF_CYCLES)
        square = np.convolve(self.square, window)[inner]
        n_free = np.convolve(self.n_free, window)[inner]
        return np.sqrt(np.maximum(square, 0.0) / n_free)


def find_half_cycles(time, value) -> HalfCycles:
    """Return the half cycles of a free decay, from a sine fitted to each of them.

    Parameters
    ----------
    time : (k,) ndarray
        Times [s] after the end of the drive.
    value : (k,) ndarray
        Displacement, velocity or acceleration; the sizes have the same unit.

    Returns
    -------
    HalfCycles

    Raises
    ------
    PatchfemError
        If there is no oscillation, or if fewer than three half cycles have enough samples.
    """
    if time.size < 4 * MIN_HALF_CYCLE_SAMPLES:
        raise PatchfemError(
            f"the free decay has {time.size} samples; at least {4 * MIN_HALF_CYCLE_SAMPLES} are needed; "
            "record it longer, or with a higher sampling rate"
        )

    middle, length = _find_first_half_cycle(time, value)
    followed = _follow_half_cycles(time, value, middle, length)

    # Sines without and with viscous decay are tried; the fit with less noise counts.
    candidates = []
    for is_viscous in (False, True):
        sines = followed
        # Number of fits of all half cycles, each with half periods and decay rates from the
        # previous fit.
        for _ in range(3):
            sines = _refine_half_cycles(time, value, sines, is_viscous=is_viscous)
        if len(sines) > 2:
            candidates.append(_FittedSines(*np.array(sines).T))
    if not candidates:
        reasons = [_describe_missing_samples(time, middle + k * length, length) for k in range(3)]
        reason = next(
            filter(None, reasons),
            "the others do not rise above the noise; begin the record after the drive has ended (--begin), and take at "
            "least 10 samples per cycle",
        )
        raise PatchfemError(f"fewer than three half cycles of a free decay are found: {reason}")

    # Errors due to noise are at least the error of a sine as the model of a half cycle.
    best = min(candidates, key=lambda sines: sines.compute_noise().mean())
    noise = best.compute_noise()
    size = np.abs(best.size)
    return HalfCycles(
        best.middle,
        size,
        np.maximum(noise * best.middle_error, SINE_FIT_ERROR * best.length),
        np.maximum(noise * best.size_error, SINE_FIT_ERROR * size),
    )


def describe_missing_samples_at_end(time: np.ndarray, half_cycles: HalfCycles) -> str:
    """Return a sentence if samples are missing after the last half cycle; "" at the end of the record."""
    before, last = half_cycles.middle[-2:].tolist()
    return _describe_missing_samples(time, 2 * last - before, last - before)


def _describe_missing_samples(time: np.ndarray, middle: float, length: float) -> str:
    """Return a sentence if a half cycle within the record has too few samples, else "".

    `time` (n,) [s] are the increasing times of the samples, `middle` [s] is the midpoint of the half cycle, and `length`
    [s] the half period.
    """
    low, high = middle - length / 2, middle + length / 2
    count = int(np.diff(np.searchsorted(time, (low, high)))[0])
    if count >= MIN_HALF_CYCLE_SAMPLES or high > time[-1]:
        return ""
    return (
        f"the half cycle from {low:.4g} s to {high:.4g} s has {count} samples, and at least {MIN_HALF_CYCLE_SAMPLES} "
        "are needed: use a higher sampling rate"
    )


def _find_first_half_cycle(time, value) -> tuple[float, float]:
    """Return the midpoint [s] and the half period [s] of the first half cycle of a decay.

    Raises PatchfemError if there is no oscillation or a cycle has too few samples.
    """
    # half of a Hann window emphasizes the beginning of the decay
    n = time.size
    even_times, step = np.linspace(time[0], time[-1], n, retstep=True)
    weighted = np.interp(even_times, time, value - value.mean()) * np.hanning(2 * n)[n:]
    spectrum = np.abs(np.fft.rfft(weighted, PADDING_FACTOR * n))
    spectrum[:PADDING_FACTOR] = 0.0
    frequency = np.argmax(spectrum) / (PADDING_FACTOR * n * step)
    if not frequency > 0 or not np.ptp(value) > 0:
        raise PatchfemError("the record contains no oscillation; give the record of a free decay")

    # a sinusoid that is fitted to the first cycle, and a little more for an inexact frequency
    is_first = time - time[0] <= N_CYCLES_OF_FIRST_SINE / frequency
    n_samples = round(np.count_nonzero(is_first) / N_CYCLES_OF_FIRST_SINE)
    if n_samples < 2 * MIN_HALF_CYCLE_SAMPLES:
        raise PatchfemError(
            f"the record has {n_samples} samples per cycle of {frequency:.4g} Hz; at least "
            f"{2 * MIN_HALF_CYCLE_SAMPLES} are needed; "
            "record it longer, or with a higher sampling rate"
        )
    omega = 2 * np.pi * frequency
    # Bounds of the frequency of the first cycle; its decay rate is free
    bounds = (np.array([0.75 * omega, -np.inf]), np.array([1.3 * omega, np.inf]))
    record = (time[is_first] - time[0], value[is_first])
    problem = SinusoidProblem(*record, [np.ones(record[0].size)], bounds=bounds)
    cycle = problem.refine([[omega, 0.0]], MAX_SINUSOID_EVALUATIONS, START_TOL)
    cosine, sine = cycle.coefficients[0]

    # A half cycle goes from peak to peak around a zero of the sinusoid, and must lie completely in the record.
    half_period = np.pi / cycle.poles[0, 0]
    middle = -np.arctan2(cosine, sine) / np.pi % 1.0 * half_period
    # Smallest place of the middle of the first half cycle, in half periods, one half less the error
    # of the fit
    if middle < 0.48 * half_period:
        middle += half_period
    return time[0] + middle, half_period


def _follow_half_cycles(time, value, middle: float, length: float) -> list[_FittedSines]:
    """Fit the half cycles of a decay one after the other, until the noise is too large.

    Parameters
    ----------
    time, value : (k,) array
        Times [s] and values of the decay.
    middle, length : float
        Predicted midpoint and half period of the first half cycle [s].
    """
    sines = []
    while middle + length / 2 <= time[-1]:
        sine = _fit_half_cycle(time, value, middle, length, 0.0)
        if sine is None or (sines and sine.size * sines[-1].size > 0):
            break
        noise = np.sqrt(sine.square / sine.n_free) * sine.size_error
        # Largest relative standard deviation of the size of a half cycle due to noise; the decay
        # ends where it is larger.
        if noise > 0.25 * abs(sine.size):
            break
        sines.append(sine)
        if len(sines) > 2:
            recent = [sine.middle for sine in sines[-6:]]
            length = (recent[-1] - recent[0]) / (len(recent) - 1)
        middle = sine.middle + length
    return sines


def _refine_half_cycles(
    time, value, sines: list[_FittedSines], *, is_viscous: bool
) -> list[_FittedSines]:
    """Refit half cycles with half periods and decay rates that follow from their neighbours.

    Parameters
    ----------
    time, value : (k,) array
        Times [s] and values of the decay.
    sines : list of _FittedSines
        First fits, a sine for each half cycle.
    is_viscous : bool
        Whether the amplitude decays within a half cycle.
    """
    if len(sines) < 3:
        return sines
    fitted = _FittedSines(*np.array(sines).T)
    noise = fitted.compute_noise()
    size = np.abs(fitted.size)
    lengths = smooth_slopes(fitted.middle, noise * fitted.middle_error)
    rates = np.zeros(len(sines))
    if is_viscous:
        rates = -smooth_slopes(np.log(size), noise * fitted.size_error / size) / lengths
    refined = []
    for middle, length, rate in zip(fitted.middle, lengths, rates):
        sine = _fit_half_cycle(time, value, middle, length, rate)
        if sine is None:
            break
        refined.append(sine)
    return refined


def _fit_half_cycle(time, value, middle: float, length: float, rate: float) -> _FittedSines | None:
    """Fit a sine to the samples around the predicted midpoint of one half cycle.

    Parameters
    ----------
    time, value : (k,) array
        Times [s] and values of the decay.
    middle, length : float
        Predicted midpoint and half period of the half cycle [s].
    rate : float
        Decay rate of the amplitude [1/s].

    Returns
    -------
    _FittedSines or None
        None if there are too few samples, or if the midpoint is too far from its prediction.
    """
    # c + exp(-rate t) (a sin + b cos) is fitted around the midpoint, which moves until b vanishes.
    predicted = middle
    # Largest number of iterations for the midpoint of a half cycle
    for _ in range(4):
        low, high = np.searchsorted(time, (middle - length / 2, middle + length / 2))
        t = time[low:high] - middle
        if t.size < MIN_HALF_CYCLE_SAMPLES:
            return None
        angle = np.pi * t / length
        envelope = np.exp(-rate * t)
        columns = np.stack(
            [np.ones(t.size), envelope * np.sin(angle), envelope * np.cos(angle)], axis=1
        )
        coefficients = np.linalg.lstsq(columns, value[low:high], rcond=None)[0]
        _, sine, cosine = coefficients
        correction = -np.arctan2(cosine * np.sign(sine), abs(sine)) * length / np.pi
        # Largest distance of a midpoint from its prediction, in half periods
        if not abs(middle + correction - predicted) <= 0.35 * length:
            return None
        if abs(correction) < 1e-9 * length:
            break
        middle += correction

    # standard deviations of the coefficients per unit of noise
    errors = np.sqrt(np.diag(np.linalg.pinv(columns.T @ columns)))
    residual = columns @ coefficients - value[low:high]
    amplitude = np.hypot(sine, cosine) * np.sign(sine)
    return _FittedSines(
        middle=middle,
        size=2 * amplitude,
        length=length,
        middle_error=errors[2] / max(abs(amplitude), 1e-300) * length / np.pi,
        size_error=2 * errors[1],
        square=residual @ residual,
        n_free=t.size - 3,
    )
