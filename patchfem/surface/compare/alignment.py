"""Alignment of two surfaces: choice of the place, fit to the unworn heights, gain of the instrument, and checks."""

from dataclasses import dataclass, replace

import numpy as np

from ..quantity import HALF_WIDTH_95
from .depth_map import UNWORN_LIMIT_DEVIATIONS
from .fit import Fit, evaluate, fit_unworn
from .model import MAX_GAIN_CHANGE, Model
from .place import Place, find_place, order
from .raster import MIN_TRACE_HEIGHTS, Raster, fill_gaps
from .statistics import (
    MIN_DIVISOR,
    find_mirror_finish,
    find_mode,
    remove_long_waves,
    split_tiles,
    subtract_local_level,
)

# Significance of the correlation at a place above which the place is sure without other evidence
SURE_SIGNIFICANCE = 12.0
# Fraction of heights that must agree in addition to three times that of unrelated surfaces, at a place of low significance
MIN_EXTRA_AGREEMENT = 0.05
N_CHANCE_PLACES = 15  # number of other places that show how many heights agree by chance
CALIBRATED_GAIN_DEVIATION = 0.01  # standard deviation of the gain of two calibrated measurements


@dataclass(frozen=True, eq=False)
class Aligned:
    """Two surfaces after alignment, or the code of the reason why they cannot be compared.

    - numbers: values [m] by name that the sentence on the reason needs.
    - gain_error: standard deviation of the gain of the instrument [1], as far as the unworn heights show it.
    - model: common points of both surfaces.
    - fit: depths below the datum (the line, parabola or plane between both surfaces), with the position of the second
      surface.
    - place: position of the second surface where the search found it.
    """

    reason: str = ""
    numbers: dict[str, float] | None = None
    model: Model | None = None
    fit: Fit | None = None
    place: Place | None = None
    gain_error: float = CALIBRATED_GAIN_DEVIATION


def align(
    first: Raster, second: Raster, shift: float | None = None, *, is_straight: bool = False
) -> Aligned:
    """Place the second surface on the first, and fit place and datum to the unworn heights.

    Parameters
    ----------
    first, second : Raster
        Heights before and after wear, without spikes.
    shift : float, optional
        Known shift of the second trace [m].
    is_straight : bool
        Whether the datum of traces is known to be straight.

    Returns
    -------
    Aligned
        Model and fit, or the reason why the surfaces cannot be compared.
    """
    place = Place(-np.array([shift]), 0.0) if shift is not None else find_place(first, second)
    model = _make_model(first, second, place)
    if model is None:
        return _refuse(first, second)
    state = model.refine_place()
    model.keep_common(state)
    if model.known.sum() < MIN_TRACE_HEIGHTS:
        return _refuse(first, second)

    # Standard deviation of a uniform error of one digit
    digit = 1 / np.sqrt(12) * float(np.hypot(_find_digit(first.z), _find_digit(second.z)))
    # Smallest standard deviation of a depth [m]; flat surfaces have none
    digit = max(digit, 1e-15)
    fit = _fit_datum(model, state, digit, is_straight=is_straight)
    fit, gain_error = _fit_gain(model, fit, digit)
    aligned = Aligned("", None, model, fit, place, gain_error)

    if shift is None and not _is_same_place(aligned):
        return _refuse(first, second)
    unworn = float(fit.unworn.mean())
    if unworn < MIN_EXTRA_AGREEMENT:
        return Aligned("no_datum", {"unworn": unworn})
    return _use_all_points(aligned, first, second, digit)


def _refuse(first: Raster, second: Raster) -> Aligned:
    """Return why the second surface has no position on the first one: it is as smooth as a mirror, or shows another place.

    `first` and `second` are the surfaces before and after wear.
    """
    numbers = find_mirror_finish([fill_gaps(surface.z) for surface in (first, second)])
    return Aligned("mirror_finish" if numbers else "elsewhere", numbers)


def _make_model(first: Raster, second: Raster, place: Place, stride: int = 0) -> Model | None:
    """Return the model of two surfaces at a place, or None if they hardly overlap.

    `first` and `second` are the surfaces before and after wear. The model takes each `stride`-th point along every axis,
    by default so many that at most 40 000 are fitted.
    """
    sampled, other = order(first, second.mirror() if place.mirrored else second)
    if not stride:
        # More points would hardly improve the place
        stride = int(np.ceil((sampled.z.size / 40_000) ** (1 / sampled.z.ndim)))
    model = Model(sampled, other, place, stride)
    count = model.known.sum()
    # Smallest part of the sampled surface that both surfaces must show
    return model if count >= max(MIN_TRACE_HEIGHTS, 0.2 * model.known.size) else None


def _use_all_points(aligned: Aligned, first: Raster, second: Raster, digit: float) -> Aligned:
    """Compute the depths at all points, if the position was fitted to every k-th point only.

    Parameters
    ----------
    aligned : Aligned
        Fitted position and datum.
    first, second : Raster
        Surfaces before and after wear.
    digit : float
        Standard deviation [m] due to the printed digits of the heights.
    """
    fit = aligned.fit
    model = aligned.model
    if model.sampled.z.shape == order(first, second)[0].z.shape:
        return aligned
    shift = fit.state[: model.n_axes]
    place = aligned.place._replace(shift=shift, turn=float(fit.state[model.n_axes]))
    full_model = _make_model(first, second, place, stride=1)
    full_model.max_gain_change = model.max_gain_change
    return replace(aligned, model=full_model, fit=evaluate(full_model, fit.state, fit.free, digit))


def _is_same_place(aligned: Aligned) -> bool:
    """Return whether two aligned surfaces really show the same place.

    They do if their correlation there is significant enough, or if more of their heights agree than those of unrelated
    surfaces.
    """
    model = aligned.model
    fit = aligned.fit
    sampled = model.sampled.z[model.known]
    heights = (sampled, sampled - model.sign * fit.depth)
    waves = [remove_long_waves(fill_gaps(model.draw(z))) for z in heights]
    noise = float(np.median(fit.noise))
    # Largest relative difference in length of two traces at the same place
    is_stretched = model.n_axes == 1 and abs(fit.state[1]) > 0.015
    if is_stretched or noise > min(z[model.known].std() for z in waves):
        return False
    significance = aligned.place.significance
    if significance > SURE_SIGNIFICANCE:
        return True
    chance_fraction = _estimate_chance(*waves, noise)
    agreeing_fraction = fit.unworn.mean()
    # Smallest fraction, of the heights that do not agree by chance, that must agree at a likely
    # place
    min_excess = 0.2 * (1 - chance_fraction)
    # Significance of the correlation at a place that suffices if enough heights agree, too
    if significance > 6.0 and agreeing_fraction - chance_fraction > min_excess:
        return True
    return agreeing_fraction > 3.0 * chance_fraction + MIN_EXTRA_AGREEMENT


def _estimate_chance(first, second, noise: float) -> float:
    """Return the fraction of heights that agree within the noise by chance, at wrong positions of two surfaces.

    `first` and `second` are their heights (n,) or (m, n) [m] on the same points, without long waves. `noise` is the
    standard deviation [m] of an unworn depth.
    """
    count = first.shape[-1]
    fractions = []
    for k in range(1, N_CHANCE_PLACES + 1):
        depth = np.roll(first, k * count // (N_CHANCE_PLACES + 1), axis=-1) - second
        distance = np.abs(depth - find_mode(depth.ravel()))
        fractions.append((distance < UNWORN_LIMIT_DEVIATIONS * noise).mean())
    return float(np.median(fractions))


def _fit_datum(model: Model, state, digit: float, *, is_straight: bool) -> Fit:
    """Fit datums with more and more terms (line, parabola, plane), and return the last one that explains the depths better.

    Parameters
    ----------
    model : Model
        Model of the depths.
    state : (k,) array
        Parameters of the model at the start.
    digit : float
        Standard deviation [m] due to the printed digits of the heights.
    is_straight : bool
        Whether only the datum with the fewest terms is fitted.
    """
    best = None
    # Numbers of terms of the datums that are tried
    for n_terms in {1: (2, 3), 2: (3,)}[model.n_axes]:
        if best is not None and is_straight:
            break
        start = model.find_datum(state, n_terms)
        fit = fit_unworn(model, start, list(range(model.n_axes + 1 + n_terms)), digit)
        if best is None or _is_bent(best, fit):
            best = fit
    return best


def _is_bent(straight: Fit, bent: Fit) -> bool:
    """Return whether a parabolic datum, the fit `bent`, explains the depths better than a straight one."""
    gain = np.median(bent.noise) / np.median(straight.noise)
    # Noise about a parabola relative to that about a line below which the parabola is subtracted
    # even if it leaves heights above the first trace: then no line fits at all
    if gain < 0.2:
        return True
    # Fraction of the heights above the first trace that a parabola may add
    has_grown = bent.grown.mean() > straight.grown.mean() + 0.01
    # Noise about a parabola relative to that about a line above which the parabola takes worn
    # heights for the datum
    is_simpler = bent.n_changed < straight.n_changed / 2 and gain < 1.5
    # Noise about a parabola relative to that about a line, from which on the parabola is
    # subtracted.
    return bool((gain < 0.8 or is_simpler) and not has_grown)


def _fit_gain(model: Model, fit: Fit, digit: float) -> tuple[Fit, float]:
    """Fit the gain of the instrument (factor of the heights) too, and keep it if it clearly differs from 1.

    Parameters
    ----------
    model : Model
        Common points of both surfaces.
    fit : Fit
        Fit with a gain of 1.
    digit : float
        Standard deviation [m] due to the printed digits of the heights.

    Returns
    -------
    fit : Fit
        With the gain, if it is clear.
    error : float
        Standard deviation of the gain [1].
    """
    scaled = fit
    # Number of steps in which the gain is found
    for _ in range(2):
        change, error = _estimate_gain(model, scaled)
        state = scaled.state.copy()
        state[-1] = np.clip(state[-1] + change, -MAX_GAIN_CHANGE, MAX_GAIN_CHANGE)
        scaled = fit_unworn(model, state, fit.free, digit)
    gain = abs(float(scaled.state[-1]))
    # Smallest change of the gain that is corrected, in standard deviations
    is_clear = 3.0 * error < gain < MAX_GAIN_CHANGE
    error = min(error if is_clear else float(np.hypot(error, gain)), CALIBRATED_GAIN_DEVIATION)

    # With a known gain, tops that are a little deeper than the valleys are worn.
    model.max_gain_change = HALF_WIDTH_95 * error
    return fit_unworn(model, scaled.state if is_clear else fit.state, fit.free, digit), error


def _estimate_gain(model: Model, fit: Fit) -> tuple[float, float]:
    """Estimate by how much [1] the gain of a fit must change, and the standard deviation of this change.

    The change is the slope of depth against height in the short waves of the unworn valleys. A drift of the instrument
    has no short waves, and valleys wear last, so that neither is mistaken for a change of the gain.
    """
    unworn = model.draw(fit.unworn, False)
    columns = (fit.depth, model.compute_jacobian(fit.state)[:, -1])
    fields = [fill_gaps(model.draw(column)) for column in columns]
    depth, waves = (subtract_local_level(field, unworn) for field in fields)
    use = unworn & np.isfinite(depth)
    if use.sum() < MIN_TRACE_HEIGHTS:
        return 0.0, CALIBRATED_GAIN_DEVIATION
    use &= waves <= np.median(waves[use])
    waves = np.where(use, waves - waves[use].mean(), 0.0)
    depth = np.where(use, depth - depth[use].mean(), 0.0)
    power = (waves**2).sum() + MIN_DIVISOR
    slope = float((waves * depth).sum() / power)

    # The noise of the first surface, half of that of the depth, is part of its waves too.
    residual = depth - slope * waves
    dilution = float((residual**2).sum() / 2 / power)
    # Neighbouring heights share errors, tiles (40 of a trace, 8 x 8 of a scan) hardly do.
    influence = waves * residual / power
    tiles = split_tiles(influence.shape, {1: 40, 2: 8}[depth.ndim])
    sums = [influence[tile].sum() for tile in tiles]
    return dilution - slope, float(np.hypot(np.linalg.norm(sums), dilution))


def _find_digit(z) -> float:
    """Return the smallest difference [m] of two heights z [m], a printed digit; at most their range over 100."""
    levels = np.unique(z[np.isfinite(z)])
    steps = np.diff(levels)
    return float(min(steps.min(), np.ptp(levels) / 100)) if steps.size else 0.0
