"""Alignment of a second trace to a first one: unworn reference surface, worn parts and final fit."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...core import PatchfemError, frozen_array
from ..profile import Profile, find_runs
from .boxes import N_PARTS
from .errors import DrawnErrors, correlation_length, draw_errors, estimate_noise
from .model import (
    BENT_PARAMETERS,
    DATUM,
    MIN_HEIGHTS,
    RIGID_PARAMETERS,
    STRAIGHT_PARAMETERS,
    Parameter,
    TraceModel,
)
from .robust import MAX_UNWORN, MIN_UNWORN, find_floors, fit_biweight, solve_weighted
from .search import MIN_OVERLAP
from .section import find_flank_ends, find_shallow_track, find_worn_heights

# Largest scale of a floor relative to that of the quietest floor; rougher floors are dropped.
MAX_SCALE_RATIO = 1.5
# Largest scale of a fit with a bend of the datum relative to one without it,
# for which the bend is subtracted.
BEND_GAIN = 0.8
# Smallest fraction of unworn heights at an end of the trace that counts as unworn.
MIN_UNWORN_FRACTION = 0.7
# Length of a flank relative to the trace, from which on a scar is distinguished from a bent datum.
LONG_FLANK = 0.05
SHORT_FLANK = 0.02  # length of a flank relative to the trace, below which a scar is excluded
# Length of each outermost end, relative to the trace. The median depth of such an end shows whether it stands above the
# floor of a scar.
OUTERMOST_FLANK = 0.005
MAX_CHI2 = 30.0  # largest chi-squared of the bow of a flank, with two or three degrees of freedom
# Number of samples in the subset that refines the starting points of a fit.
N_THINNED = 2000
# Smallest number of samples of a worn run whose flanks may leave the floor gradually.
MIN_WIDE_RUN = 64
# Width of the margin beside a worn run relative to the run; slight wear
# there would be taken for a drift.
MARGIN_FRACTION = 0.2
MARGIN_SAMPLES = 8  # smallest number of samples in the margin beside a worn run
# Largest number of alternating fits and detections of wear; they end earlier if the
# worn heights no longer change.
MAX_ROUNDS = 4


@dataclass(frozen=True, eq=False)
class Alignment:
    """Alignment of a second trace with a first one, and the depth between them.

    - x, first, depth: samples of the second trace on the first one, heights of the first trace
      there, and depths of the second trace below it, (n,) [m].
    - curvature: how far heights of the first trace there lie off a smooth line, (n,) [m].
    - unworn: heights on the floor and outside of worn parts, (n,) bool.
    - jacobian: derivatives of the depth by the fitted parameters, (n, k).
    - state: parameters of the model (`model.Parameter`), (5,).
    - free: parameters that were fitted.
    - half, middle: half of the length [m] of the first trace, to which slope and bend refer,
      and the place [m] in the second trace where they are zero.
    - noise, min_scale: standard deviation [m] of the unworn depths, and rounding.
    - clear: unworn heights at a distance from worn ones, which show the drift of the datum,
      (n,) bool.
    - rival: alignment with another floor that explains the traces as well, or None.
    - is_straight: whether the datum was declared straight.
    """

    x: np.ndarray
    first: np.ndarray
    depth: np.ndarray
    curvature: np.ndarray
    unworn: np.ndarray
    jacobian: np.ndarray
    state: np.ndarray
    free: tuple
    half: float
    middle: float
    noise: float
    min_scale: float
    clear: np.ndarray
    rival: "Alignment | None" = field(default=None, repr=False)
    is_straight: bool = False

    @property
    def shift(self) -> float:
        """Shift [m] of the second trace."""
        return float(self.state[Parameter.SHIFT])

    @property
    def slope(self) -> float:
        """Tilt [rad] of the second trace against the first."""
        return float(self.state[Parameter.SLOPE]) / self.half

    @property
    def stretch(self) -> float:
        """Relative difference between the lengths of the second and the first trace of the same surface."""
        return float(self.state[Parameter.STRETCH])

    @property
    def bend(self) -> float:
        """Sag [m] of the second datum over the common length, which is subtracted from the depth."""
        return float(self.state[Parameter.BEND]) * (np.ptp(self.x) / 2 / self.half) ** 2

    @cached_property
    def noise_at(self) -> np.ndarray:
        """Standard deviation (n,) [m] of each depth."""
        slope = np.abs(np.gradient(self.first, self.x))
        return estimate_noise(self.depth, self.unworn, slope, self.curvature, self.min_scale)

    @cached_property
    def errors(self) -> DrawnErrors:
        """Predicted drift of the datum, with bootstrap errors of corrected depth and parameters."""
        degree = 2 if Parameter.BEND in self.free else 1
        return draw_errors(
            self.depth, self.noise_at, self.unworn, self.clear, self.jacobian, degree
        )

    @property
    def worn_depth(self) -> np.ndarray:
        """Depth (n,) [m] with the drift of the datum subtracted."""
        return self.depth - self.errors.drift

    @property
    def agreed_fraction(self) -> float:
        """Fraction of the heights that agree in both traces, on this reference surface or on the rival one."""
        other = self if self.rival is None else self.rival
        return float(max(self.unworn.mean(), other.unworn.mean()))

    @property
    def detection_limit(self) -> float | None:
        """Detection limit: mean depth [m] of a track over the middle third, or None for short traces."""
        threshold = find_shallow_track(np.asarray(self.depth), self.noise)[1]
        return threshold if np.isfinite(threshold) else None

    def error_of(self, parameter: Parameter) -> float:
        """Return the standard deviation of a fitted parameter, or NaN if it was not fitted."""
        if parameter not in self.free:
            return float("nan")
        return float(self.errors.parameters[:, self.free.index(parameter)].std())

    def map_to_first(self, place: float) -> float:
        """Map a position [m] along the second trace to the first one."""
        return self.middle + (place - self.middle) / (1 + self.stretch) - self.shift

    def has_unworn_ends(self) -> tuple:
        """Return whether the first and the last twentieth of the trace are unworn."""
        count = max(int(LONG_FLANK * self.x.size), min(40, self.x.size // 4))
        return tuple(
            bool(self.unworn[part].mean() > MIN_UNWORN_FRACTION)
            for part in (slice(count), slice(-count, None))
        )


def align(before: Profile, after: Profile, shift: float, is_straight: bool = False) -> Alignment:
    """Align the second trace with the unworn heights of the first one.

    Floors with a small scale are found from elemental subsets of blocks, without and, unless the datum
    is declared straight, with a bend. Of those, a floor with an unworn end of the trace and with few
    heights above it is chosen. A bend is subtracted if the scale falls by a fifth. If the line through
    both ends has as small a scale and everything between the ends lies below it, the trace has a wide
    scar: the line is the floor if both ends are long, and a rival if they are short.

    Parameters
    ----------
    before, after : Profile
    shift : float
        First guess [m], right within a quarter of a wave.
    is_straight : bool
        Whether the datum of the instrument is known to be straight.

    Raises
    ------
    PatchfemError
        If too few heights lie on the first trace, or if the fit moves most of them off it.
    """
    model = TraceModel(before, after, shift)
    thin = model.thin(N_THINNED)
    floor = _choose_floor(
        find_floors(thin, model.start(shift), list(STRAIGHT_PARAMETERS), [0, 1]), thin
    )
    if floor is None:
        raise PatchfemError(f"{after.source}: no heights of this trace agree with {before.source}")
    model.smooth_slope(floor.scale)
    thin.slope = model.slope
    best = _fit_all_heights(model, floor.state, STRAIGHT_PARAMETERS)
    if model.overlap(model.places(best.state)).sum() < MIN_OVERLAP * best.x.size:
        raise PatchfemError(f"{after.source}: the best fit leaves {before.source}")
    if is_straight:
        return replace(_align_straight_datum(model, best), is_straight=True)
    bent = _choose_floor(
        find_floors(thin, best.state * [1, 1, 1, 1, 0], list(BENT_PARAMETERS), [0, 1, 4]), thin
    )
    if bent is not None and bent.scale < BEND_GAIN * max(best.noise, model.min_scale):
        curved = _fit_all_heights(model, bent.state, BENT_PARAMETERS)
        # A bend without an unworn end fits the inside of a round scar, if both ends lie on a line far above the scar.
        is_inside = all(best.has_unworn_ends()) and not any(curved.has_unworn_ends())
        is_inside &= np.quantile(best.depth, 0.9) > 2 * MAX_UNWORN * best.noise
        if curved.noise < BEND_GAIN * best.noise and not is_inside:
            best = curved
    return _check_for_wide_scar(model, best)


def _choose_floor(floors: list, model):
    """Choose the unworn reference surface: quiet, unworn at an end, few heights above it and many on it."""
    known = [floor for floor in floors if floor.unworn >= MIN_UNWORN] or floors
    if not known:
        return None
    quietest = min(floor.scale for floor in known)
    quiet = [floor for floor in known if floor.scale <= MAX_SCALE_RATIO * quietest]

    def rank(floor) -> tuple:
        depth, _ = model.linearize(floor.state)
        count = max(int(LONG_FLANK * depth.size), 4)
        is_on_floor = np.abs(depth) <= MAX_UNWORN * floor.scale
        has_end = max(is_on_floor[:count].mean(), is_on_floor[-count:].mean()) > MIN_UNWORN_FRACTION
        return not has_end, round(floor.grown, 1), -floor.unworn

    return min(quiet, key=rank)


def _fit_all_heights(model, state, free) -> Alignment:
    """Fit the chosen reference surface to all heights outside the worn parts until these parts no longer change.

    Then the worn parts are widened to the ends of their flanks, and the fit is repeated.
    """
    model = model.cut(state)
    worn = None
    for has_feet in (False, True):
        for _ in range(MAX_ROUNDS):
            fit = fit_biweight(model, state, list(free), worn)
            state = fit.state
            depth, _ = model.linearize(state)
            new = find_worn_samples(depth, fit.scale)
            if has_feet:
                new = widen_to_flank_ends(depth, fit.scale, new)
            if (~new).sum() < MIN_HEIGHTS or (worn is not None and (new == worn).all()):
                break
            worn = new
    worn = np.zeros(depth.size, bool) if worn is None else worn
    return _make_alignment(model, state, free, fit.scale, worn)


def _make_alignment(model, state, free, scale: float, worn) -> Alignment:
    """Make the alignment for given parameters, and select the heights that show the drift of the datum."""
    depth, jacobian = model.linearize(state)
    unworn = (np.abs(depth) <= MAX_UNWORN * scale) & ~worn
    clear = unworn.copy()
    for first, last in find_runs(worn):
        margin = max(MARGIN_SAMPLES, int(MARGIN_FRACTION * (last - first)))
        clear[max(first - margin, 0) : last + margin + 1] = False
    if clear.sum() < unworn.sum() / 2:
        clear = unworn
    return Alignment(
        x=frozen_array(model.x),
        first=frozen_array(model.spline(model.places(state))),
        depth=frozen_array(depth),
        curvature=frozen_array(model.curvature(model.places(state))),
        unworn=unworn,
        jacobian=frozen_array(jacobian[:, list(free)]),
        state=frozen_array(state),
        free=tuple(free),
        half=model.half,
        middle=model.middle,
        noise=scale,
        min_scale=model.min_scale,
        clear=clear,
    )


def find_worn_samples(depth, scale: float) -> np.ndarray:
    """Find the worn heights (n,) bool, with the sample on either side of them, where wear fades out."""
    quiet = np.abs(depth) <= MAX_UNWORN * scale
    correlation = correlation_length(depth, quiet, depth.size // N_PARTS)
    worn = find_worn_heights(depth, np.full(depth.size, scale), correlation)
    return np.convolve(worn, np.ones(3), "same") > 0.5


def widen_to_flank_ends(depth, scale: float, worn) -> np.ndarray:
    """Widen wide worn runs (n,) bool to the positions where their flanks leave the reference surface."""
    out = worn.copy()
    noise = np.full(depth.size, scale)
    quiet = ~worn & (np.abs(depth) <= MAX_UNWORN * scale)
    correlation = correlation_length(depth, quiet, depth.size // N_PARTS)
    for first, last in find_runs(worn):
        if last - first < MIN_WIDE_RUN:
            continue
        start, end = find_flank_ends(depth, noise, correlation, first, last)
        out[start.first : first] = True
        out[last : depth.size - end.first] = True
    return out


def _fit_line_through_ends(
    model, best: Alignment, state, free: tuple, flank: float, min_samples: int = 40
) -> Alignment | None:
    """Fit a line through the ends of a trace, or return None unless all worn heights lie between them.

    Parameters
    ----------
    model : TraceModel
    best : Alignment
        Alignment on another floor, whose noise is the measure.
    state : (5,) array
        Start.
    free : tuple
        Parameters that are fitted.
    flank : float
        Length of each end / length of the trace.
    min_samples : int
        Smallest number of samples of each end, in a trace of four times as many or more.
    """
    model = model.cut(state)
    count = model.x.size
    n_end = max(int(flank * count), min(min_samples, count // 4))
    ends = np.minimum(np.arange(count), np.arange(count)[::-1]) < n_end
    for _ in range(8):
        depth, jacobian = model.linearize(state)
        step = solve_weighted(jacobian[ends][:, free], depth[ends], np.ones(ends.sum()))
        state = state.copy()
        state[list(free)] += model.limit_step(step, free)
    depth, _ = model.linearize(state)
    scale = float(np.std(depth[ends]))
    if scale > 1.3 * best.noise or not _are_straight(depth, ends):
        return None
    between = depth[~ends]
    if not between.mean() > MAX_UNWORN * scale or (between < -2 * MAX_UNWORN * scale).mean() > 0.01:
        return None
    worn = ~ends & (depth > MAX_UNWORN * scale)
    for _ in range(3):
        state, scale = fit_biweight(model, state, list(STRAIGHT_PARAMETERS), worn, rounds=20)
        depth, _ = model.linearize(state)
        worn = widen_to_flank_ends(depth, scale, find_worn_samples(depth, scale))
    alignment = _make_alignment(model, state, STRAIGHT_PARAMETERS, scale, worn)
    return alignment if alignment.unworn[ends].mean() >= MIN_UNWORN_FRACTION else None


def _are_straight(depth, ends) -> bool:
    """Return whether both ends follow the common line, with allowance for correlated noise."""
    for part in np.split(np.flatnonzero(ends), 2):
        depths = depth[part]
        base = np.linalg.qr(np.vander(np.linspace(-1, 1, part.size), 3, True))[0]
        coefficients = base.T @ depths
        residual = depths - base @ coefficients
        correlation = correlation_length(residual, np.ones(part.size, bool))
        if coefficients @ coefficients > MAX_CHI2 * correlation * float(np.mean(residual**2)):
            return False
    return True


def _check_for_wide_scar(model, best: Alignment) -> Alignment:
    """Compare the alignment with another one, in which the trace is worn everywhere except at its ends.

    In the other alignment, the unworn surface is a line through both ends. If the ends are long, the other alignment is
    returned, with the given one as its rival. If they are short, the given one is returned, with the other as its rival.
    If an end stands above the given surface, the outermost heights alone are tried as ends as well, because a wedge-shaped
    scar with a short flank at its deep end looks like a tilted surface with material that grew at this end.
    """
    count = max(int(OUTERMOST_FLANK * best.depth.size), MIN_HEIGHTS)
    ends = [
        float(np.median(best.depth[part])) / best.noise
        for part in (slice(count), slice(-count, None))
    ]
    has_bow = best.bend > 0 and min(ends) > 1
    if not has_bow and min(ends) >= -MAX_UNWORN:
        return best
    state = np.array(best.state)
    state[Parameter.BEND] = 0.0
    line = _fit_line_through_ends(model, best, state, DATUM, LONG_FLANK)
    if line is not None:
        return replace(line, rival=best)
    line = _fit_line_through_ends(model, best, state, DATUM, SHORT_FLANK)
    if line is None and not has_bow:
        line = _fit_line_through_ends(model, best, state, DATUM, OUTERMOST_FLANK, MIN_HEIGHTS)
    return best if line is None else replace(best, rival=line)


def _align_straight_datum(model, best: Alignment) -> Alignment:
    """Align traces whose datum is straight, where short flanks on a common line count as unworn."""
    line = _fit_line_through_ends(
        model, best, model.start(model.guess), RIGID_PARAMETERS, SHORT_FLANK
    )
    if line is None:
        return best
    is_quieter = MAX_SCALE_RATIO * line.noise < best.noise
    return replace(line, rival=best) if is_quieter or not all(best.has_unworn_ends()) else best
