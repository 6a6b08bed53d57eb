"""Half cycles of a measured free decay, with a sine fitted to each of them.

A half cycle lies between two reversals. With dry friction, it is m + S/2 sin(w (t - t_k)), with the midpoint
t_k and a different mean m in each half cycle. With viscous damping, the sine has the factor exp(-s (t - t_k)).
Both forms are fitted to all half cycles from the beginning of the record, and the one with the smaller
residual is used.
"""

from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from ..response.decay_curve import HalfCycles, smooth_slopes

MIN_SAMPLES = 5  # smallest number of samples in a half cycle
# Smallest relative standard deviation of the midpoint (relative to the half period) and the size of a half cycle,
# because a half cycle is not exactly a sine.
SINE_FIT_ERROR = 3e-5
# Largest relative standard deviation of the size of a half cycle due to noise; the decay ends where it is larger.
MAX_NOISE_RATIO = 0.25
# Number of fits of all half cycles, each with half periods and decay rates from the previous fit.
N_PASSES = 3
MAX_ITERATIONS = 4  # largest number of iterations for the midpoint of a half cycle
MAX_MIDDLE_SHIFT = 0.35  # largest distance of a midpoint from its prediction, in half periods
# Number of half cycles on each side for the estimate of the noise of a half cycle.
N_NEIGHBOURS = 8
# Trial frequencies of the first cycle, relative to that of the highest spectral line.
FREQUENCY_RATIOS = np.linspace(0.75, 1.3, 56)
MAX_STEP_RATIO = 10.0  # smallest length of a gap, relative to the 10 % quantile of the time steps
# Largest relative difference between the first two half periods.
MAX_PERIOD_CHANGE = 0.3
PADDING_FACTOR = 8  # length of the zero-padded record relative to the record, for a finer spectrum


class _HalfCycle(NamedTuple):
    """Half cycle of a free decay, with the parameters of the fitted sine.

    - middle: time of the midpoint [s].
    - size: peak-to-peak value, with the sign of the half cycle.
    - length: half period [s].
    - middle_error, size_error: standard deviations of midpoint and size per unit of noise.
    - sum_of_squares: sum of squares of the residual.
    - n_free: degrees of freedom of the residual.
    """

    middle: float
    size: float
    length: float
    middle_error: float
    size_error: float
    sum_of_squares: float
    n_free: int


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
    if time.size < 4 * MIN_SAMPLES:
        raise PatchfemError(
            f"the free decay has {time.size} samples; at least {4 * MIN_SAMPLES} are needed"
        )
    first_half_cycle = _find_first_half_cycle(time, value)
    half_cycles = _fit_successive_half_cycles(time, value, *first_half_cycle)
    dry = viscous = half_cycles
    if len(half_cycles) > 2:
        for _ in range(N_PASSES):
            dry = _refine_half_cycles(time, value, dry, is_viscous=False)
            viscous = _refine_half_cycles(time, value, viscous, is_viscous=True)
    best = min(dry, viscous, key=_compute_mean_noise)
    if len(best) < 3:
        _raise_for_short_decay(time, *first_half_cycle)
    noise = _compute_noise(best)
    half_period = np.array([half_cycle.length for half_cycle in best])
    size = np.abs([half_cycle.size for half_cycle in best])
    middle_error = np.array([half_cycle.middle_error for half_cycle in best])
    size_error = np.array([half_cycle.size_error for half_cycle in best])
    return HalfCycles(
        np.array([half_cycle.middle for half_cycle in best]),
        size,
        np.maximum(noise * middle_error, SINE_FIT_ERROR * half_period),
        np.maximum(noise * size_error, SINE_FIT_ERROR * size),
    )


def _raise_for_short_decay(time, middle: float, length: float) -> None:
    """Raise a PatchfemError with the reason why a decay has fewer than three half cycles."""
    reasons = [_describe_missing_samples(time, middle + k * length, length) for k in range(3)]
    reasons.append(_describe_gaps(time))
    for reason in reasons:
        if reason:
            raise PatchfemError(
                f"fewer than three half cycles of a free decay have samples enough: {reason}"
            )
    raise PatchfemError(
        "fewer than three half cycles of a free decay rise above the noise; begin the record after "
        "the drive has ended (--begin), and take at least 10 samples per cycle"
    )


def describe_missing_samples_at_end(time, half_cycles: HalfCycles) -> str:
    """Return a sentence if samples are missing after the last half cycle; "" at the end of the record."""
    length = half_cycles.middle[-1] - half_cycles.middle[-2]
    return _describe_missing_samples(time, float(half_cycles.middle[-1] + length), float(length))


def _describe_missing_samples(time, middle: float, length: float) -> str:
    """Return a sentence if a half cycle has too few samples, else "".

    The result is also "" if the half cycle ends after the record.
    """
    low = middle - length / 2
    high = middle + length / 2
    count = int(np.diff(np.searchsorted(time, (low, high)))[0])
    if count >= MIN_SAMPLES or high > time[-1]:
        return ""
    return f"the half cycle from {low:.4g} s to {high:.4g} s has {count} samples, and at least {MIN_SAMPLES} are needed"


def _describe_gaps(time) -> str:
    """Return a sentence about gaps between the samples of a record; "" if there are none."""
    usual_step, max_step = np.quantile(np.diff(time), (0.1, 1.0))
    if max_step <= MAX_STEP_RATIO * usual_step:
        return ""
    return f"the samples lie up to {max_step:.3g} s apart, elsewhere {usual_step:.3g} s"


def _find_first_half_cycle(time, value) -> tuple:
    """Return the midpoint [s] and the half period [s] of the first half cycle of a decay."""
    frequency = _find_dominant_frequency(time, value)
    best = None
    for f in frequency * FREQUENCY_RATIOS:
        is_first_cycle = time - time[0] <= 1 / f
        n_samples = np.count_nonzero(is_first_cycle)
        if n_samples < 2 * MIN_SAMPLES:
            raise PatchfemError(
                f"the record has {n_samples} samples per cycle of {f:.4g} Hz; at least "
                f"{2 * MIN_SAMPLES} are needed"
            )
        angle = 2 * np.pi * f * (time[is_first_cycle] - time[0])
        columns = np.stack([np.ones(angle.size), np.cos(angle), np.sin(angle)], axis=1)
        coefficients = np.linalg.lstsq(columns, value[is_first_cycle], rcond=None)[0]
        mean_square = float(np.mean((columns @ coefficients - value[is_first_cycle]) ** 2))
        if best is None or mean_square < best[0]:
            phase = float(np.arctan2(-coefficients[1], coefficients[2]))
            best = (mean_square, f, phase)
    _, f, phase = best
    half_period = 0.5 / f
    start = phase / (2 * np.pi * f) % half_period
    # the first half cycle must lie completely in the record
    if start < 0.24 / f:
        start += half_period
    return time[0] + start, half_period


def _find_dominant_frequency(time, value) -> float:
    """Return the frequency [Hz] of the highest spectral line of a decay.

    Raises PatchfemError if there is no oscillation.
    """
    n = time.size
    even_times = np.linspace(time[0], time[-1], n)
    # half of a Hann window emphasizes the beginning of the decay
    weighted = np.interp(even_times, time, value - value.mean()) * np.hanning(2 * n)[n:]
    spectrum = np.abs(np.fft.rfft(weighted, PADDING_FACTOR * n))
    spectrum[:PADDING_FACTOR] = 0.0
    frequency = int(np.argmax(spectrum)) / (PADDING_FACTOR * n * (even_times[1] - even_times[0]))
    if not frequency > 0 or not np.ptp(value) > 0:
        raise PatchfemError("the record contains no oscillation")
    return frequency


def _fit_successive_half_cycles(time, value, middle: float, length: float) -> list:
    """Fit the half cycles of a decay one after the other, until the noise is too large."""
    half_cycles = []
    while middle + length / 2 <= time[-1]:
        half_cycle = _fit_half_cycle(time, value, middle, length, 0.0)
        if half_cycle is None or (half_cycles and half_cycle.size * half_cycles[-1].size > 0):
            break
        noise = np.sqrt(half_cycle.sum_of_squares / half_cycle.n_free) * half_cycle.size_error
        if noise > MAX_NOISE_RATIO * abs(half_cycle.size):
            break
        half_cycles.append(half_cycle)
        if len(half_cycles) > 2:
            last_half_cycles = half_cycles[-6:]
            length = (last_half_cycles[-1].middle - last_half_cycles[0].middle) / (
                len(last_half_cycles) - 1
            )
        elif len(half_cycles) == 2:
            distance = half_cycles[1].middle - half_cycles[0].middle
            if abs(distance - length) < MAX_PERIOD_CHANGE * length:
                length = distance
        middle = half_cycle.middle + length
    return half_cycles


def _refine_half_cycles(time, value, half_cycles: list, *, is_viscous: bool) -> list:
    """Refit half cycles with half periods and decay rates estimated from their neighbours."""
    if len(half_cycles) < 3:
        return half_cycles
    noise = _compute_noise(half_cycles)
    middle = np.array([half_cycle.middle for half_cycle in half_cycles])
    size = np.abs([half_cycle.size for half_cycle in half_cycles])
    middle_noise = noise * np.array([half_cycle.middle_error for half_cycle in half_cycles])
    size_noise = noise * np.array([half_cycle.size_error for half_cycle in half_cycles])
    lengths = smooth_slopes(middle, middle_noise)
    rates = np.zeros(len(half_cycles))
    if is_viscous:
        rates = -smooth_slopes(np.log(size), size_noise / size) / lengths
    refined = []
    for half_cycle, length, rate in zip(half_cycles, lengths, rates):
        new_half_cycle = _fit_half_cycle(time, value, half_cycle.middle, length, rate)
        if new_half_cycle is None:
            break
        refined.append(new_half_cycle)
    return refined


def _fit_half_cycle(time, value, middle: float, length: float, rate: float) -> _HalfCycle | None:
    """Fit a sine to the samples around the predicted midpoint of a half cycle.

    Returns None with too few samples, or if the midpoint is too far from its prediction. `length` is the half
    period [s], `rate` the decay rate [1/s].
    """
    predicted = middle
    for _ in range(MAX_ITERATIONS):
        low, high = np.searchsorted(time, (middle - length / 2, middle + length / 2))
        t = time[low:high] - middle
        if t.size < MIN_SAMPLES:
            return None
        angle = np.pi * t / length
        envelope = np.exp(-rate * t)
        columns = np.stack(
            [np.ones(t.size), envelope * np.sin(angle), envelope * np.cos(angle)], axis=1
        )
        coefficients = np.linalg.lstsq(columns, value[low:high], rcond=None)[0]
        correction = (
            -float(np.arctan2(coefficients[2] * np.sign(coefficients[1]), abs(coefficients[1])))
            * length
            / np.pi
        )
        if not abs(middle + correction - predicted) <= MAX_MIDDLE_SHIFT * length:
            return None
        if abs(correction) < 1e-9 * length:
            break
        middle += correction
    errors = np.sqrt(np.diag(np.linalg.pinv(columns.T @ columns)))
    residual = columns @ coefficients - value[low:high]
    amplitude = float(np.hypot(coefficients[1], coefficients[2]) * np.sign(coefficients[1]))
    return _HalfCycle(
        middle=middle,
        size=2 * amplitude,
        length=length,
        middle_error=float(errors[2]) / max(abs(amplitude), 1e-300) * length / np.pi,
        size_error=2 * float(errors[1]),
        sum_of_squares=float(residual @ residual),
        n_free=t.size - 3,
    )


def _compute_noise(half_cycles: list) -> np.ndarray:
    """Return the standard deviation (k,) of the noise in the neighbourhood of each half cycle."""
    n = len(half_cycles)
    index = np.arange(n)
    low = np.maximum(index - N_NEIGHBOURS, 0)
    high = np.minimum(index + N_NEIGHBOURS + 1, n)
    squares = np.cumsum([0.0, *(half_cycle.sum_of_squares for half_cycle in half_cycles)])
    n_free = np.cumsum([0.0, *(half_cycle.n_free for half_cycle in half_cycles)])
    return np.sqrt((squares[high] - squares[low]) / (n_free[high] - n_free[low]))


def _compute_mean_noise(half_cycles: list) -> float:
    """Return the mean noise of half cycles; inf if there are fewer than three."""
    return _compute_noise(half_cycles).mean() if len(half_cycles) > 2 else np.inf
