"""Half cycles of a measured free decay; a sine is fitted to each of them in turn.

A half cycle lies between two reversals. About its middle t_k it is a sine beside a mean m of its own. Under dry
friction it is exactly m + S/2 sin(w (t - t_k)); in a viscous decay the sine has the factor exp(-s (t - t_k)).
Both forms are followed through the record from its beginning, and the one with the smaller residual is taken.
"""

from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from ..response.decay_curve import HalfCycles, smooth_slopes

MIN_SAMPLES = 5  # smallest number of samples in a half cycle
# smallest standard deviation of the middle of a half cycle / half period, and of its size / size: a sine that is fitted
# to few samples is not more exact
SINE_FIT_ERROR = 3e-5
# standard deviation of the size of a half cycle by noise / size; the decay ends at a half cycle with a larger ratio
MAX_NOISE_RATIO = 0.25
# Number of fits of all half cycles; each takes half periods and rates from the fit before.
N_PASSES = 3
MAX_ITERATIONS = 4  # largest number of iterations that move the middle of a half cycle
MAX_MIDDLE_SHIFT = 0.35  # largest distance of a middle from the predicted one, in half periods
# number of half cycles on each side whose residuals give the noise of a half cycle
N_NEIGHBOURS = 8
# frequencies that are tried for the first cycle / frequency of the highest spectral line
FREQUENCY_RATIOS = np.linspace(0.75, 1.3, 56)
MAX_STEP_RATIO = 10.0  # time step / 10 % quantile of the time steps; a larger step is a gap
# largest difference of the second half period from the first, as a fraction of the first
MAX_PERIOD_CHANGE = 0.3
PADDING_FACTOR = 8  # length of the record with appended zeros / its length, for a finer spectrum


class _HalfCycle(NamedTuple):
    """Half cycle of a free decay, with the parameters of the fitted sine.

    - middle: time [s] of its middle.
    - size: peak-to-peak motion, with the sign of the half cycle.
    - length: half period [s].
    - middle_error, size_error: standard deviations of middle and size per unit of noise.
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
    """Fit a sine to each half cycle of a free decay.

    Parameters
    ----------
    time : (k,) ndarray
        Times [s], from the moment on at which nothing drives the motion.
    value : (k,) ndarray
        Displacement, velocity or acceleration; the sizes have its unit.

    Returns
    -------
    HalfCycles

    Raises
    ------
    PatchfemError
        If nothing oscillates, or if fewer than three half cycles have enough samples.
    """
    if time.size < 4 * MIN_SAMPLES:
        raise PatchfemError(
            f"the free decay has {time.size} samples; at least {4 * MIN_SAMPLES} are needed"
        )
    first_half_cycle = _find_first_half_cycle(time, value)
    half_cycles = _follow_half_cycles(time, value, *first_half_cycle)
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
    """Raise PatchfemError that explains why a decay has fewer than three half cycles."""
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
    """Describe the lack of samples at the end of a decay; "" if the record ends there."""
    length = half_cycles.middle[-1] - half_cycles.middle[-2]
    return _describe_missing_samples(time, float(half_cycles.middle[-1] + length), float(length))


def _describe_missing_samples(time, middle: float, length: float) -> str:
    """Describe which half cycle of a decay has too few samples; "" if none has.

    A half cycle that ends after the record has the description "" as well.
    """
    low = middle - length / 2
    high = middle + length / 2
    count = int(np.diff(np.searchsorted(time, (low, high)))[0])
    if count >= MIN_SAMPLES or high > time[-1]:
        return ""
    return f"the half cycle from {low:.4g} s to {high:.4g} s has {count} samples, and at least {MIN_SAMPLES} are needed"


def _describe_gaps(time) -> str:
    """Describe the gaps between the samples of a record; "" if it has none."""
    usual_step, max_step = np.quantile(np.diff(time), (0.1, 1.0))
    if max_step <= MAX_STEP_RATIO * usual_step:
        return ""
    return f"the samples lie up to {max_step:.3g} s apart, elsewhere {usual_step:.3g} s"


def _find_first_half_cycle(time, value) -> tuple:
    """Find the first half cycle of a decay: the time [s] of its middle and its half period [s]."""
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
    # the first half cycle lies completely in the record
    if start < 0.24 / f:
        start += half_period
    return time[0] + start, half_period


def _find_dominant_frequency(time, value) -> float:
    """Return the frequency [Hz] of the highest spectral line.

    Raises PatchfemError if nothing oscillates.
    """
    n = time.size
    even_times = np.linspace(time[0], time[-1], n)
    # half of a Hann window gives most weight to the beginning of the decay
    weighted = np.interp(even_times, time, value - value.mean()) * np.hanning(2 * n)[n:]
    spectrum = np.abs(np.fft.rfft(weighted, PADDING_FACTOR * n))
    spectrum[:PADDING_FACTOR] = 0.0
    frequency = int(np.argmax(spectrum)) / (PADDING_FACTOR * n * (even_times[1] - even_times[0]))
    if not frequency > 0 or not np.ptp(value) > 0:
        raise PatchfemError("the record contains no oscillation")
    return frequency


def _follow_half_cycles(time, value, middle: float, length: float) -> list:
    """Fit the half cycles of a decay in order, until the noise exceeds a half cycle."""
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
    """Fit a sine to the samples around the predicted middle of a half cycle.

    Returns None if it has too few samples, or if its middle is too far from the prediction.
    `length` is its half period [s], `rate` its decay rate [1/s].
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
    """Estimate the standard deviation (k,) of the noise in the neighbourhood of each half cycle."""
    n = len(half_cycles)
    index = np.arange(n)
    low = np.maximum(index - N_NEIGHBOURS, 0)
    high = np.minimum(index + N_NEIGHBOURS + 1, n)
    squares = np.cumsum([0.0, *(half_cycle.sum_of_squares for half_cycle in half_cycles)])
    n_free = np.cumsum([0.0, *(half_cycle.n_free for half_cycle in half_cycles)])
    return np.sqrt((squares[high] - squares[low]) / (n_free[high] - n_free[low]))


def _compute_mean_noise(half_cycles: list) -> float:
    """Return the mean noise of half cycles; infinite if there are fewer than three."""
    return _compute_noise(half_cycles).mean() if len(half_cycles) > 2 else np.inf
