"""Fit of the computed worn depth of a run to a measured one: wear coefficient and position of the patch.

By Archard's law the worn depth depends on the product of wear coefficient and cycles alone. The depths that a run passes
through are therefore those of smaller coefficients after all of its cycles, although the pressure changes as the pieces
wear. Coefficient and position are fitted by least squares to means of both depths over a hundredth of the patch. The
interval contains the noise, the datum and the gain of the measured depth, the scatter of the measured wear about the
computed one, the numerical error of the run, and the change by another interpolation between the frames. Read `fit_wear`
first.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError, max_abs
from ..formatting import format_length
from ..surface.quantity import CONFIDENCE_LEVEL, HALF_WIDTH_95, Quantity

# Number of bins along the patch, in which the noise of single heights averages out
N_PATCH_BINS = 100
# Largest number of positions that are refined in addition to the best one
MAX_REFINED_POSITIONS = 24
# Smallest fraction of the patch on the traces for which its position is known
MIN_PATCH_OVERLAP = 0.25
MAX_WIDTH_RATIO = 1.5  # largest ratio of the widths of measured and computed wear
# Depth at the ends of the computed wear relative to its largest depth
WORN_END_DEPTH_FRACTION = 0.05
# Ratio of two lengths or depths from which on the units are likely to be wrong
WRONG_UNIT_RATIO = 20.0


class MeasuredDepth(NamedTuple):
    """Measured worn depth along the second trace.

    - x: positions (n,) [m].
    - depth, noise: worn depth and its standard deviation (n,) [m].
    - correlation: number of neighbouring samples that share an error.
    - datum_error: standard deviation [m] of an error that is common to all depths.
    - width: width [m] of the longest track, or None.
    - gain_error: standard deviation [1] of a factor that is common to all depths.
    """

    x: np.ndarray
    depth: np.ndarray
    noise: np.ndarray
    correlation: float
    datum_error: float
    width: float | None
    gain_error: float = 0.0


@dataclass(frozen=True, eq=False)
class WearHistory:
    """Worn depth of a piece in the course of a run.

    - x: position along the patch (m,) [m], 0 in the middle.
    - work: completed fraction of the cycles (f,), from 0 to 1.
    - depth: worn depth of the piece (f, m) [m].
    - coefficient: wear coefficient of the run [m2/N].
    - error: relative numerical error of the depth.
    - source, piece: folder of the run, and name of the piece.
    - is_linear: whether the depth between two frames lies on a straight line.
    """

    x: np.ndarray
    work: np.ndarray
    depth: np.ndarray
    coefficient: float
    error: float
    source: str
    piece: str
    is_linear: bool = False

    @cached_property
    def _curve(self):
        """Function of the completed fraction of the cycles that returns the depth (m,) [m]."""
        from scipy.interpolate import PchipInterpolator, make_interp_spline

        if self.is_linear:
            return make_interp_spline(self.work, self.depth, k=1)
        return PchipInterpolator(self.work, self.depth, axis=0)

    @property
    def half(self) -> float:
        """Half of the length of the patch [m]."""
        return float(np.ptp(self.x)) / 2

    def interpolate_depth(self, ratio: float) -> np.ndarray:
        """Return the depth (m,) [m] for `ratio` times the coefficient of the run, extrapolated beyond it."""
        if ratio <= 1:
            return self._curve(ratio)
        rate = (self.depth[-1] - self.depth[-2]) / (self.work[-1] - self.work[-2])
        return self.depth[-1] + (ratio - 1) * rate

    def average(self, edges: np.ndarray, place: "Place") -> np.ndarray:
        """Return the mean depths (b,) [m] in the bins with edges (b + 1,) [m] along the trace."""
        depth = self.interpolate_depth(place.ratio)
        area = np.concatenate([[0.0], np.cumsum(np.diff(self.x) * (depth[1:] + depth[:-1]) / 2)])
        sign = -1 if place.is_mirrored else 1
        ends = np.interp(sign * (edges - place.centre), self.x, area)
        return sign * np.diff(ends) / np.diff(edges)


class Place(NamedTuple):
    """Computed wear at a position in the trace.

    - ratio: coefficient divided by that of the run.
    - centre: middle of the patch in x of the second trace [m].
    - is_mirrored: whether x of the patch runs against x of the trace.
    - squares: sum of the squared differences [m2] over the bins.
    """

    ratio: float
    centre: float
    is_mirrored: bool
    squares: float = np.inf


class Bins(NamedTuple):
    """Measured depth in bins.

    - edges: (b + 1,) [m].
    - depth, noise: mean depth and its standard deviation (b,) [m].
    - datum_error: standard deviation [m] of an error that is common to all depths.
    - gain_error: standard deviation [1] of a factor that is common to all depths.
    """

    edges: np.ndarray
    depth: np.ndarray
    noise: np.ndarray
    datum_error: float
    gain_error: float

    @property
    def middles(self) -> np.ndarray:
        """Middles (b,) [m] of the bins."""
        return (self.edges[1:] + self.edges[:-1]) / 2

    @property
    def width(self) -> float:
        """Width [m] of a bin."""
        return float(self.edges[1] - self.edges[0])


class FittedDepths(NamedTuple):
    """Measured and computed depth in bins on the patch.

    - x: positions (b,) [m], 0 in the middle of the patch.
    - measured, computed, noise: mean depths (b,) [m], and standard deviation of the measured one.
    """

    x: np.ndarray
    measured: np.ndarray
    computed: np.ndarray
    noise: np.ndarray


@dataclass(frozen=True, eq=False)
class PredictedWear:
    """Computed worn depth, fitted to the measured one.

    - history: computed depth in the course of the run.
    - coefficient, centre: wear coefficient [m2/N], and middle of the patch in x of the second trace [m].
    - is_mirrored: whether x of the patch runs against x of the trace; None where both fit.
    - depths: both depths along the patch.
    - proportional: coefficient [m2/N] for which the last depth of the run fits in proportion.
    - n_blocks: number of independent blocks of the difference between both depths in the worn part.
    - datum_error: standard deviation [m] of an error that is common to all measured depths.
    """

    history: WearHistory
    coefficient: Quantity
    centre: Quantity
    is_mirrored: bool | None
    depths: FittedDepths
    proportional: float
    n_blocks: float
    datum_error: float

    @property
    def is_extrapolated(self) -> bool:
        """Whether the fitted coefficient is larger than that of the run."""
        return bool(self.coefficient.value > self.history.coefficient)

    @property
    def on_patch(self) -> np.ndarray:
        """Bins (b,) bool whose middle lies on the patch."""
        return np.abs(self.depths.x) <= self.history.half

    @property
    def difference_rms(self) -> float:
        """Root mean square [m] of the difference between both depths over the patch."""
        difference = self.depths.measured - self.depths.computed
        return float(np.sqrt(np.mean(difference[self.on_patch] ** 2)))

    @property
    def mean_computed(self) -> float:
        """Mean of the computed depth over the patch [m]."""
        return float(self.depths.computed[self.on_patch].mean())


def fit_wear(measured: MeasuredDepth, history: WearHistory) -> PredictedWear:
    """Fit the wear coefficient and the position of a computed worn depth to a measured one.

    Parameters
    ----------
    measured : MeasuredDepth
        Worn depth along the second trace.
    history : WearHistory
        Worn depth of one piece in the course of the run.

    Returns
    -------
    PredictedWear

    Raises
    ------
    PatchfemError
        If the run cannot be that of the measured contact.
    """
    bins = _average_measured(measured, history)
    start, others = _search(bins, history)

    # depths far from the patch tell nothing about its wear
    # Part of half the patch beyond its ends, whose unworn depths show where the wear ends
    near = np.abs(bins.middles - start.centre) <= (1 + 0.1) * history.half
    first, last = np.flatnonzero(near)[[0, -1]]
    bins = bins._replace(
        edges=bins.edges[first : last + 2],
        depth=bins.depth[first : last + 1],
        noise=bins.noise[first : last + 1],
    )
    best = _refine(bins, history, start)
    others = [_refine(bins, history, place, is_fixed=True) for place in others]
    others.append(_refine(bins, history, best._replace(is_mirrored=not best.is_mirrored)))
    _require_similar(measured.width, bins, history, best)
    return _make_result(bins, history, best, others)


def _average_measured(measured: MeasuredDepth, history: WearHistory) -> Bins:
    """Average the measured depth over bins, and draw random errors of the means."""
    width = 2 * history.half / N_PATCH_BINS
    length = float(np.ptp(measured.x))
    if length < MIN_PATCH_OVERLAP * 2 * history.half:
        raise PatchfemError(
            f"compare --predicted: the common part of the traces is {format_length(length, 3)} long, and the patch of "
            f"{history.source} {format_length(2 * history.half, 3)}; at least {100 * MIN_PATCH_OVERLAP:.0f} % of the patch "
            f"must lie within the traces{_suspect_units(2 * history.half / length, 'x')}"
        )

    # integral of the depth, whose differences over a bin give its mean
    edges = measured.x[0] + width * np.arange(int(length / width) + 1)
    borders = np.concatenate(
        [measured.x[:1], (measured.x[1:] + measured.x[:-1]) / 2, measured.x[-1:]]
    )
    area = np.concatenate([[0.0], np.cumsum(measured.depth * np.diff(borders))])
    depth = np.diff(np.interp(edges, borders, area)) / width

    # the noise of a bin falls with the number of its independent samples
    step = length / (measured.x.size - 1)
    count = max(width / (step * max(measured.correlation, 1.0)), 1.0)
    middles = (edges[1:] + edges[:-1]) / 2
    noise = np.interp(middles, measured.x, measured.noise) / np.sqrt(count)
    return Bins(edges, depth, noise, measured.datum_error, measured.gain_error)


def _suspect_units(ratio: float, axis: str) -> str:
    """Return the end of a message on two numbers, which suggests a wrong unit if their ratio is that of two units."""
    if 1 / WRONG_UNIT_RATIO < ratio < WRONG_UNIT_RATIO:
        return ""
    return f"; check the units of {axis} with --units"


def _require_similar(width: float | None, bins: Bins, history: WearHistory, best: Place) -> None:
    """Raise PatchfemError if the measured depth, or the width [m] of its track, is not that of the run.

    `width` is that of the measured track, or None without one, and `bins` have the measured depth. `history` is the
    computed depth over the cycles, and `best` its fitted place.
    """
    # Largest wear coefficient, relative to that of the computed run, for which the run has the
    # shape of the worn profile
    if not history.work[1] <= best.ratio <= 2.0:
        raise PatchfemError(
            f"compare --predicted: the measured wear needs {best.ratio:.3g} times the wear coefficient of {history.source}, "
            "for which the run computed no depth; run the scene again with wear.coefficient = "
            f'"{1.3 * best.ratio * history.coefficient:.2g} m^2/N" and compare again{_suspect_units(best.ratio, "z")}'
        )
    computed = history.average(bins.edges, best)
    worn = bins.width * float((computed > WORN_END_DEPTH_FRACTION * computed.max()).sum())
    if width is not None and not worn / MAX_WIDTH_RATIO <= width <= MAX_WIDTH_RATIO * worn:
        raise PatchfemError(
            f"compare --predicted: the measured track is {format_length(width, 3)} wide, and the computed wear of "
            f"{history.source} {format_length(worn, 3)}; this run is not that of the measured contact"
            f"{_suspect_units(width / worn, 'x')}"
        )


def _search(bins: Bins, history: WearHistory) -> tuple[Place, list[Place]]:
    """Find the best place on a grid, and others that may fit as well.

    For each trial coefficient and both directions, the sums of squares at all shifts by a bin follow from two
    correlations.
    """
    n_shown = int(MIN_PATCH_OVERLAP * N_PATCH_BINS)
    # The computed patch has N_PATCH_BINS bins of the same width as those of the measured depth.
    edges = np.linspace(-history.half, history.half, N_PATCH_BINS + 1)
    size = bins.depth.size
    squares = np.full((2, size + N_PATCH_BINS - 1), np.inf)
    ratios = np.ones(squares.shape)
    # Relative coefficients up to 1e4, so that a message can propose one
    for ratio in np.geomspace(history.work[1], 1e4, 90):
        for side in (0, 1):
            template = history.average(edges, Place(ratio, 0.0, bool(side)))
            # Sum of (d - t)^2 at each shift, for measured depths d and computed depths t, without the constant of d^2.
            total = np.correlate(np.ones(size), template**2, "full")
            total -= 2 * np.correlate(bins.depth, template, "full")
            ratios[side] = np.where(total < squares[side], ratio, ratios[side])
            squares[side] = np.minimum(total, squares[side])

    # enough of the patch must lie within the trace
    shifts = np.arange(squares.shape[1]) - (N_PATCH_BINS - 1)
    squares[:, (shifts < n_shown - N_PATCH_BINS) | (shifts > size - n_shown)] = np.inf
    places = []
    for number in np.argsort(squares, axis=None)[: 4 * MAX_REFINED_POSITIONS]:
        side, shift = np.unravel_index(int(number), squares.shape)
        centre = float(bins.edges[0] + bins.width * shifts[shift] + history.half)
        places.append(Place(float(ratios[side, shift]), centre, bool(side)))
    best = places[0]

    def is_apart(place: Place) -> bool:
        """Return whether a place lies more than its bin away from the best one, or runs the other way."""
        is_far = abs(place.centre - best.centre) > 1.5 * bins.width
        return is_far or place.is_mirrored != best.is_mirrored

    return best, list(filter(is_apart, places))[:MAX_REFINED_POSITIONS]


def _refine(bins: Bins, history: WearHistory, start: Place, *, is_fixed: bool = False) -> Place:
    """Fit coefficient and position by least squares from a start; with `is_fixed` the position stays.

    `bins` have the measured depth, and `history` is the computed depth over the cycles.
    """
    from scipy.optimize import least_squares

    scale = max_abs(bins.depth)

    def move(values) -> Place:
        """Return the place at a relative coefficient, and a shift in bins."""
        shift = 0.0 if is_fixed else values[1] * bins.width
        return start._replace(ratio=float(start.ratio * values[0]), centre=start.centre + shift)

    def residuals(values) -> np.ndarray:
        """Return the differences (b,) of both depths, relative to the largest measured one."""
        return (history.average(bins.edges, move(values)) - bins.depth) / scale

    bounds = [(0.2, 5.0)] if is_fixed else [(0.2, 5.0), (-5.0, 5.0)]
    values = [1.0, 0.0][: len(bounds)]
    fit = least_squares(residuals, values, bounds=tuple(zip(*bounds)), diff_step=1e-3)
    return move(fit.x)._replace(squares=float(fit.fun @ fit.fun) * scale**2)


def _make_result(
    bins: Bins, history: WearHistory, best: Place, others: list[Place]
) -> PredictedWear:
    """Return the fitted wear, with intervals that contain the other places that fit as well.

    Parameters
    ----------
    bins : Bins
        Measured depths.
    history : WearHistory
        Computed depths in the course of a run.
    best : Place
        Place with the smallest residual.
    others : list of Place
        Other places that fit as well.
    """
    computed = history.average(bins.edges, best)
    residual = bins.depth - computed
    jacobian = _differentiate(bins, history, best)
    spread, n_blocks = _measure_spread(bins, residual, computed, jacobian)

    # the last depth in proportion, and straight lines between the frames, give other coefficients
    in_proportion = replace(
        history,
        work=np.array([0.0, 1.0]),
        depth=np.array([0.0 * history.x, history.depth[-1]]),
        is_linear=True,
    )
    proportional = _refine(bins, in_proportion, best, is_fixed=True).ratio
    other = best._replace(ratio=proportional)
    if best.ratio <= 1:
        other = _refine(bins, replace(history, is_linear=True), best)
    half = np.sqrt(
        (HALF_WIDTH_95 * spread[0]) ** 2
        + (history.error * best.ratio) ** 2
        + (other.ratio - best.ratio) ** 2
    )
    half_centre = np.hypot(HALF_WIDTH_95 * spread[1], other.centre - best.centre)

    # places whose sum of squares is larger by less than some variances of an independent block
    # Increase of the sum of squares, in variances, of an equally good position
    limit = best.squares * (1 + 4.0 / n_blocks)
    accepted = [best, *(place for place in others if place.squares <= limit)]
    ratios = [place.ratio for place in accepted]
    centres = [place.centre for place in accepted]
    is_unknown = any(place.is_mirrored != best.is_mirrored for place in accepted)

    x = (bins.middles - best.centre) * (-1 if best.is_mirrored else 1)
    order = np.argsort(x)
    return PredictedWear(
        history=history,
        coefficient=Quantity(
            best.ratio * history.coefficient,
            max(min(ratios) - half, 0.0) * history.coefficient,
            (max(ratios) + half) * history.coefficient,
            "m2 N-1",
            "",
        ),
        centre=Quantity(
            best.centre, min(centres) - half_centre, max(centres) + half_centre, "m", ""
        ),
        is_mirrored=None if is_unknown else best.is_mirrored,
        depths=FittedDepths(x[order], bins.depth[order], computed[order], bins.noise[order]),
        proportional=proportional * history.coefficient,
        n_blocks=n_blocks,
        datum_error=bins.datum_error,
    )


def _differentiate(bins: Bins, history: WearHistory, best: Place) -> np.ndarray:
    """Return the derivatives (b, 2) of the computed depth by ratio and centre, from central differences.

    `bins` have the measured depth, `history` is the computed depth over the cycles, and `best` its fitted place.
    """
    columns = []
    for name, step in (("ratio", 0.01 * best.ratio), ("centre", bins.width / 2)):
        value = getattr(best, name)
        after = history.average(bins.edges, best._replace(**{name: value + step}))
        before = history.average(bins.edges, best._replace(**{name: value - step}))
        columns.append((after - before) / (2 * step))
    return np.column_stack(columns)


def _measure_spread(
    bins: Bins, residual: np.ndarray, computed: np.ndarray, jacobian: np.ndarray
) -> tuple[list[float], float]:
    """Return the standard deviations of ratio and centre, and the number of independent blocks.

    The measured wear scatters about the computed one with a correlation along x. The number of blocks is that of
    correlation lengths of the differences in the worn part. The fit takes up two of them, so that the variance is
    divided by the remainder, and Student's t replaces the normal quantile.

    `bins` have the measured depth with its noise, `residual` (b,) [m] are the differences of both depths, `computed`
    (b,) [m] is the computed depth, and `jacobian` (b, 2) its derivatives by ratio and centre.
    """
    from scipy.special import stdtrit

    worn = computed > WORN_END_DEPTH_FRACTION * computed.max()
    terms = residual[worn]
    count = terms.size

    # integral scale of the autocorrelation, up to its first zero
    correlation = np.correlate(terms, terms, "full")[count - 1 :]
    correlation = correlation / correlation[0] if correlation[0] > 0 else np.zeros(count)
    positive = int(np.argmax(correlation <= 0)) if (correlation <= 0).any() else count
    length = 1 + 2 * float(correlation[1:positive].sum())
    # Smallest number of degrees of freedom of Student's t
    n_blocks = max(count / length, 3.0 + 2)
    freedom = n_blocks - 2

    inverse = np.linalg.pinv(jacobian)
    scatter = residual @ residual / residual.size * n_blocks / freedom * length
    student = float(stdtrit(freedom, (1 + CONFIDENCE_LEVEL) / 2)) / HALF_WIDTH_95
    from_scatter = student * np.sqrt(scatter * (inverse**2).sum(axis=1))
    variance = inverse**2 @ bins.noise**2 + (bins.datum_error * inverse.sum(axis=1)) ** 2
    variance += (bins.gain_error * (inverse @ computed)) ** 2
    return np.sqrt(from_scatter**2 + variance).tolist(), n_blocks
