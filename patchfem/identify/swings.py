"""Half swings of a measured free decay; a sine is fitted to each of them in turn.

A half swing lies between two reversals. About its middle t_k it is a sine beside a mean m of its own. Under dry
friction it is exactly m + S/2 sin(w (t - t_k)); in a viscous decay the sine has the factor exp(-s (t - t_k)).
Both forms are followed through the record from its beginning, and the one with the smaller residual is taken.
"""

from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from ..response.decay_curve import HalfSwings, smooth_slopes

MIN_SAMPLES = 5  # smallest number of samples in a half swing
# fraction of a half period and of the amplitude; error of a sine that is fitted to few samples
SINE_FIT_ERROR = 3e-5
# standard deviation / amplitude; a half swing with a larger ratio is lost in the noise
MAX_NOISE_RATIO = 0.25
N_PASSES = 3  # number of passes over all half swings; each starts from the half periods and rates of the pass before
MAX_ITERATIONS = 4  # largest number of iterations that move the middle of a half swing
MAX_MIDDLE_SHIFT = 0.35  # largest distance of a middle from the predicted one, in half periods
# number of half swings on each side whose residuals give the noise of a half swing
N_NEIGHBOURS = 8
# frequencies of the first cycle that are tried, over that of the highest spectral line
FREQUENCY_RATIOS = np.linspace(0.75, 1.3, 56)
MAX_STEP_RATIO = 10.0  # time step / 10 % quantile of the time steps; messages name a larger step
# largest difference of the second half period from the first, as a fraction of the first
MAX_PERIOD_CHANGE = 0.3
PADDING_FACTOR = 8  # factor by which zeros lengthen the record for its spectrum


class _HalfSwing(NamedTuple):
    """Half swing of a record.

    - middle: time [s] of its middle.
    - size: peak-to-peak motion, with the sign of the half swing.
    - length: half period [s].
    - middle_error, size_error: standard deviations of both per unit of noise.
    - sum_of_squares: of the residual.
    - n_free: degrees of freedom of the residual.
    """

    middle: float
    size: float
    length: float
    middle_error: float
    size_error: float
    sum_of_squares: float
    n_free: int


def find_half_swings(time, value) -> HalfSwings:
    """Find the half swings of a free decay.

    Parameters
    ----------
    time : (k,) ndarray
        Times [s], from the moment on at which nothing drives the motion.
    value : (k,) ndarray
        Displacement, velocity or acceleration; the sizes have its unit.

    Returns
    -------
    HalfSwings

    Raises
    ------
    PatchfemError
        If nothing oscillates, or if fewer than three half swings have enough samples.
    """
    if time.size < 4 * MIN_SAMPLES:
        raise PatchfemError(
            f"the free decay has {time.size} samples; at least {4 * MIN_SAMPLES} are needed"
        )
    first = _find_first(time, value)
    followed = _follow_half_swings(time, value, *first)
    dry = viscous = followed
    if len(followed) > 2:
        for _ in range(N_PASSES):
            dry = _refine_half_swings(time, value, dry, is_viscous=False)
            viscous = _refine_half_swings(time, value, viscous, is_viscous=True)
    best = min(dry, viscous, key=_compute_mean_noise)
    if len(best) < 3:
        _refuse_short_decay(time, *first)
    noise = _compute_noise(best)
    half_period = np.array([swing.length for swing in best])
    size = np.abs([swing.size for swing in best])
    middle_error = np.array([swing.middle_error for swing in best])
    size_error = np.array([swing.size_error for swing in best])
    return HalfSwings(
        np.array([swing.middle for swing in best]),
        size,
        np.maximum(noise * middle_error, SINE_FIT_ERROR * half_period),
        np.maximum(noise * size_error, SINE_FIT_ERROR * size),
    )


def _refuse_short_decay(time, middle: float, length: float) -> None:
    """Raise PatchfemError that says why a decay has fewer than three half swings."""
    reasons = [_describe_sparse(time, middle + k * length, length) for k in range(3)]
    reasons.append(_describe_uneven(time))
    for reason in reasons:
        if reason:
            raise PatchfemError(
                f"fewer than three half cycles of a free decay have samples enough: {reason}"
            )
    raise PatchfemError(
        "fewer than three half cycles of a free decay rise above the noise; begin the record after "
        "the drive has ended (--begin), and take at least 10 samples per cycle"
    )


def describe_sparse_end(time, swings: HalfSwings) -> str:
    """Describe a lack of samples after the last half swing, "" at the end of the record."""
    length = swings.middle[-1] - swings.middle[-2]
    return _describe_sparse(time, float(swings.middle[-1] + length), float(length))


def _describe_sparse(time, middle: float, length: float) -> str:
    """Describe a half cycle with too few samples; "" if it has enough or exceeds the record."""
    low = middle - length / 2
    high = middle + length / 2
    count = int(np.diff(np.searchsorted(time, (low, high)))[0])
    if count >= MIN_SAMPLES or high > time[-1]:
        return ""
    return f"the half cycle from {low:.4g} s to {high:.4g} s has {count} samples, and at least {MIN_SAMPLES} are needed"


def _describe_uneven(time) -> str:
    """Describe a record with gaps between its samples; "" if it has none."""
    near, far = np.quantile(np.diff(time), (0.1, 1.0))
    if far <= MAX_STEP_RATIO * near:
        return ""
    return f"the samples lie up to {far:.3g} s apart, elsewhere {near:.3g} s"


def _find_first(time, value) -> tuple:
    """Find the first half swing; return its middle [s] and its half period [s]."""
    frequency = _find_main_frequency(time, value)
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
        x = np.linalg.lstsq(columns, value[is_first_cycle], rcond=None)[0]
        square = float(np.mean((columns @ x - value[is_first_cycle]) ** 2))
        if best is None or square < best[0]:
            phase = float(np.arctan2(-x[1], x[2]))
            best = (square, f, phase)
    _, f, phase = best
    half_period = 0.5 / f
    start = phase / (2 * np.pi * f) % half_period
    # the first half swing lies completely in the record
    if start < 0.24 / f:
        start += half_period
    return time[0] + start, half_period


def _find_main_frequency(time, value) -> float:
    """Return the frequency [Hz] of the highest spectral line.

    Raises PatchfemError if nothing oscillates.
    """
    n = time.size
    even = np.linspace(time[0], time[-1], n)
    # half of a Hann window gives most weight to the beginning of the decay
    weighted = np.interp(even, time, value - value.mean()) * np.hanning(2 * n)[n:]
    lines = np.abs(np.fft.rfft(weighted, PADDING_FACTOR * n))
    lines[:PADDING_FACTOR] = 0.0
    frequency = int(np.argmax(lines)) / (PADDING_FACTOR * n * (even[1] - even[0]))
    if not frequency > 0 or not np.ptp(value) > 0:
        raise PatchfemError("the record contains no oscillation")
    return frequency


def _follow_half_swings(time, value, middle: float, length: float) -> list:
    """Fit half swings from the first one on, until one is lost in the noise."""
    swings = []
    while middle + length / 2 <= time[-1]:
        swing = _fit_half_swing(time, value, middle, length, 0.0)
        if swing is None or (swings and swing.size * swings[-1].size > 0):
            break
        noise = np.sqrt(swing.sum_of_squares / swing.n_free) * swing.size_error
        if noise > MAX_NOISE_RATIO * abs(swing.size):
            break
        swings.append(swing)
        if len(swings) > 2:
            near = swings[-6:]
            length = (near[-1].middle - near[0].middle) / (len(near) - 1)
        elif len(swings) == 2:
            distance = swings[1].middle - swings[0].middle
            if abs(distance - length) < MAX_PERIOD_CHANGE * length:
                length = distance
        middle = swing.middle + length
    return swings


def _refine_half_swings(time, value, swings: list, *, is_viscous: bool) -> list:
    """Fit half swings again, with half periods and decay rates from their neighbours."""
    if len(swings) < 3:
        return swings
    noise = _compute_noise(swings)
    middle = np.array([swing.middle for swing in swings])
    size = np.abs([swing.size for swing in swings])
    middle_noise = noise * np.array([swing.middle_error for swing in swings])
    size_noise = noise * np.array([swing.size_error for swing in swings])
    lengths = smooth_slopes(middle, middle_noise)
    rates = np.zeros(len(swings))
    if is_viscous:
        rates = -smooth_slopes(np.log(size), size_noise / size) / lengths
    refined = []
    for swing, length, rate in zip(swings, lengths, rates):
        new_swing = _fit_half_swing(time, value, swing.middle, length, rate)
        if new_swing is None:
            break
        refined.append(new_swing)
    return refined


def _fit_half_swing(time, value, middle: float, length: float, rate: float) -> _HalfSwing | None:
    """Fit a half swing near a predicted middle; None if it has too few samples or moves too far.

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
        x = np.linalg.lstsq(columns, value[low:high], rcond=None)[0]
        move = -float(np.arctan2(x[2] * np.sign(x[1]), abs(x[1]))) * length / np.pi
        if not abs(middle + move - predicted) <= MAX_MIDDLE_SHIFT * length:
            return None
        if abs(move) < 1e-9 * length:
            break
        middle += move
    errors = np.sqrt(np.diag(np.linalg.pinv(columns.T @ columns)))
    residual = columns @ x - value[low:high]
    amplitude = float(np.hypot(x[1], x[2]) * np.sign(x[1]))
    return _HalfSwing(
        middle=middle,
        size=2 * amplitude,
        length=length,
        middle_error=float(errors[2]) / max(abs(amplitude), 1e-300) * length / np.pi,
        size_error=2 * float(errors[1]),
        sum_of_squares=float(residual @ residual),
        n_free=t.size - 3,
    )


def _compute_noise(swings: list) -> np.ndarray:
    """Compute the standard deviation (k,) of the noise around each half swing."""
    n = len(swings)
    index = np.arange(n)
    low = np.maximum(index - N_NEIGHBOURS, 0)
    high = np.minimum(index + N_NEIGHBOURS + 1, n)
    squares = np.cumsum([0.0, *(swing.sum_of_squares for swing in swings)])
    n_free = np.cumsum([0.0, *(swing.n_free for swing in swings)])
    return np.sqrt((squares[high] - squares[low]) / (n_free[high] - n_free[low]))


def _compute_mean_noise(swings: list) -> float:
    """Return the mean noise of half swings, infinite if there are fewer than three."""
    return _compute_noise(swings).mean() if len(swings) > 2 else np.inf
