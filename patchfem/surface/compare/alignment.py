"""Alignment of two traces: cleaning, choice of the place, fit to the unworn heights, and its checks."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from ...core import PatchfemError
from ..profile import Profile, remove_spikes
from . import changes
from .fit import Fit, fit_unworn
from .statistics import (
    MAX_GAINS,
    UNWORN_LIMIT,
    WAVES_PER_TRACE,
    estimate_gain,
    find_mirror_finish,
    find_mode,
    is_other_gain,
    remove_long_waves,
)
from .traces import (
    MIN_SIGNIFICANCE,
    Place,
    TraceModel,
    find_places,
    mirror,
)

MIN_SAMPLES = 40  # smallest number of heights of a trace that is compared
SURE_SIGNIFICANCE = 12.0  # significance of a place although others are nearly as significant
LIKELY_SIGNIFICANCE = 6.0  # significance of a clear place that suffices if enough heights agree
MIN_EXCESS = 0.2  # fraction of the heights, beyond those by chance, that agree at such a place
MIN_AGREEMENT = 3.0  # heights that agree, relative to those of unrelated traces
MIN_AGREEING = 0.05  # fraction of heights that agree, in addition to that
CLEAR_MISFIT = 0.9  # misfit of a place relative to that of a more significant one that it replaces
BEND_GAIN = (
    0.8  # noise about a parabola relative to that about a line, from which on it is subtracted
)
MAX_NEW_GROWTH = 0.01  # fraction of the heights above the first trace that a parabola may add
MAX_STRETCH = 0.015  # largest error of length of a place
N_OTHER_PLACES = 15  # number of other places that show how many heights agree by chance
MIN_NOISE = 1e-15  # smallest standard deviation of a depth [m]; flat traces have none
EVEN_DEVIATION = 1 / np.sqrt(12)  # standard deviation of a uniform error of one digit
MAX_MORE_CHANGED = (
    1.1  # changed heights with a gain relative to those without it; less noise shows more
)
MAX_GAIN_ERROR = 0.01  # standard deviation of the gain of two calibrated measurements


@dataclass(frozen=True, eq=False)
class Aligned:
    """Two traces after alignment, or the code of the reason why they cannot be compared.

    - gain: factor by which the heights of the second trace were divided.
    - gain_error: standard deviation of the gain, as far as the valleys show it.
    """

    model: TraceModel | None = None
    fit: Fit | None = None
    reason: str = ""
    is_mirrored: bool = False
    gain: float = 1.0
    gain_error: float = MAX_GAIN_ERROR


def clean_trace(trace: Profile, *, keep_spikes: bool = False) -> Profile:
    """Return the known heights of a trace, without spikes, dropouts and dust."""
    clean = trace if keep_spikes else remove_spikes(trace)
    known = ~clean.missing
    if not keep_spikes:
        known &= ~_find_saturated(trace.z)
    if known.sum() < MIN_SAMPLES:
        raise PatchfemError(
            f"compare: {trace.source}: {known.sum()} heights; a comparison needs at least {MIN_SAMPLES}"
        )
    return replace(clean, x=clean.x[known], z=clean.z[known])


def _find_saturated(z) -> np.ndarray:
    """Return the heights (n,) bool at the end of the range of the instrument, far from all others."""
    levels = np.unique(z[~np.isnan(z)])
    is_saturated = np.zeros(z.size, bool)
    if levels.size > 3:
        for extreme, inner, span in (
            (levels[0], levels[1], levels[-1] - levels[1]),
            (levels[-1], levels[-2], levels[-2] - levels[0]),
        ):
            is_extreme = z == extreme
            if is_extreme.sum() > 1 and abs(extreme - inner) > span / 2:
                is_saturated |= is_extreme
    return is_saturated


def align_traces(
    first: Profile, second: Profile, shift: float | None = None, *, is_straight: bool = False
) -> Aligned:
    """Place the second trace on the first, and fit place and datum to the unworn heights.

    Parameters
    ----------
    first, second : Profile
        Traces without missing heights.
    shift : float, optional
        Known shift of the second trace [m].
    is_straight : bool
        Whether the datum is known to be straight.
    """
    places = [Place(shift, 0.0, False, np.inf)] if shift is not None else find_places(first, second)
    best = None
    for place in places:
        trace = mirror(second) if place.is_mirrored else second
        model = TraceModel(first, trace, place)
        if model.x.size < MIN_SAMPLES:
            continue
        state, misfit = model.refine_place()
        if abs(state[1]) > MAX_STRETCH:
            continue
        if best is None or misfit < CLEAR_MISFIT * best[3]:
            best = place, model, state, misfit
    if best is None:
        return Aligned(reason="elsewhere")
    place, model, state, _ = best

    digit = EVEN_DEVIATION * float(np.hypot(_find_digit(first.z), _find_digit(second.z)))
    digit = max(digit, MIN_NOISE)
    fit = _fit_datum(model, state, digit, is_straight=is_straight)
    gain, calibrated, gain_error = _calibrate(model, fit, digit, is_straight=is_straight)
    if gain != 1.0:
        error = min(gain_error, MAX_GAIN_ERROR)
        return Aligned(model, calibrated, "", place.is_mirrored, gain, error)
    is_speck = changes.find_specks(
        model.x, model.second + fit.depth, model.second, fit.worn, fit.grown
    )
    if is_speck.any():
        model.keep(~is_speck)
        fit = fit_unworn(model, fit.state, slice(0, fit.jacobian.shape[1]), digit)

    agreeing = fit.unworn.mean()
    if shift is None and not _is_same_place(places, place, model, fit):
        reason = "mirror_finish" if find_mirror_finish((first.z, second.z)) else "elsewhere"
        return Aligned(model, fit, reason, place.is_mirrored)
    reason = "" if agreeing > MIN_AGREEING else "no_datum"
    error = min(gain_error, MAX_GAIN_ERROR)
    return Aligned(model, fit, reason, place.is_mirrored, gain_error=error)


def _is_same_place(places: list[Place], place: Place, model: TraceModel, fit: Fit) -> bool:
    """Return whether the traces have a place in common: by its significance, or by the heights that agree."""
    chance = _estimate_chance(model.second + fit.depth, model.second, float(np.median(fit.noise)))
    agreeing = fit.unworn.mean()
    waves = remove_long_waves(model.second)
    if abs(fit.state[1]) > MAX_STRETCH or np.median(fit.noise) > waves.std():
        return False
    is_clear = len(places) == 1
    if place.significance > (MIN_SIGNIFICANCE if is_clear else SURE_SIGNIFICANCE):
        return True
    is_likely = is_clear and place.significance > LIKELY_SIGNIFICANCE
    if is_likely and agreeing - chance > MIN_EXCESS * (1 - chance):
        return True
    return agreeing > MIN_AGREEMENT * chance + MIN_AGREEING


def _fit_datum(model: TraceModel, state, digit: float, *, is_straight: bool) -> Fit:
    """Fit a straight and a parabolic datum, and return the better one."""
    fits = []
    for degree in (1,) if is_straight else (1, 2):
        start = model.find_datum(state, degree)
        fits.append(fit_unworn(model, start, slice(0, 3 + degree), digit))
    return fits[-1] if len(fits) > 1 and _is_bent(*fits) else fits[0]


def _is_bent(straight: Fit, bent: Fit) -> bool:
    """Return whether a parabolic datum explains the depths better than a straight one."""
    n_changed = [(fit.worn | fit.grown).sum() for fit in (straight, bent)]
    is_quieter = np.median(bent.noise) < BEND_GAIN * np.median(straight.noise)
    has_grown = bent.grown.mean() > straight.grown.mean() + MAX_NEW_GROWTH
    return bool((is_quieter or n_changed[1] < n_changed[0] / 2) and not has_grown)


def _estimate_chance(first, second, noise: float) -> float:
    """Return the fraction of heights of unrelated traces that agree within the noise.

    They are those of both traces at other places, without their long waves.
    """
    waves = [remove_long_waves(z) for z in (first, second)]
    fractions = []
    for k in range(1, N_OTHER_PLACES + 1):
        depth = np.roll(waves[0], k * first.size // (N_OTHER_PLACES + 1)) - waves[1]
        fractions.append((np.abs(depth - find_mode(depth)) < UNWORN_LIMIT * noise).mean())
    return float(np.median(fractions))


def _measure_gain(model: TraceModel, fit: Fit) -> tuple[float, float]:
    """Return the ratio of the depths of valleys, second to first trace, and its error.

    Tops may be worn, which an error of the gain resembles, so they do not count.
    """
    # The mean line is that of the unworn heights, so that a track does not bend it.
    smooth = model.second.size / WAVES_PER_TRACE
    weight = fit.unworn.astype(float)
    total = np.maximum(ndimage.gaussian_filter1d(weight, smooth), 1e-12)
    first, second = (
        z - ndimage.gaussian_filter1d(weight * z, smooth) / total
        for z in (model.second + fit.depth, model.second)
    )
    noise = float(np.median(fit.noise))
    use = (np.abs(fit.depth) < 4 * UNWORN_LIMIT * noise) & (first + second < 0)
    use &= ~fit.worn & ~fit.grown
    return estimate_gain(first[use], second[use], noise)


def _calibrate(
    model: TraceModel, fit: Fit, digit: float, *, is_straight: bool
) -> tuple[float, Fit, float]:
    """Divide the second trace by its gain, if that explains the depths better; return gain, fit and error of the gain.

    Heights that agree show only a part of a large gain, so gains are measured in turn until none is left.
    """
    uncalibrated = model.second, fit
    total = 1.0
    for _ in range(MAX_GAINS):
        gain, error = _measure_gain(model, fit)
        if not is_other_gain(gain, error):
            return total, fit, float(np.hypot(error, gain - 1))
        total *= gain
        mean = model.second.mean()
        model.second = mean + (model.second - mean) / gain
        state = np.append(fit.state[:2], [0.0, 0.0, 0.0])
        scaled = _fit_datum(model, state, digit, is_straight=is_straight)
        is_quieter = np.median(scaled.noise) < np.median(fit.noise)
        changed, before = ((each.worn | each.grown).sum() for each in (scaled, fit))
        fit = scaled
        if not is_quieter or changed > MAX_MORE_CHANGED * before:
            break
    model.second, fit = uncalibrated
    return 1.0, fit, float(np.hypot(error, gain - 1))


def _find_digit(z) -> float:
    """Return the smallest difference of two heights [m], at most their range over 100."""
    steps = np.diff(np.unique(z))
    return float(min(steps.min(), np.ptp(z) / 100)) if steps.size else 0.0
