"""Fit of a computed worn depth to the measured one: wear coefficient, patch position, differences.

By Archard's law the worn depth depends on the product of wear coefficient and cycles alone. The depths that a run
passes through on its way are therefore those of smaller coefficients after all of its cycles, although the pressure
changes as the pieces wear. The coefficient and the place of the patch in the trace are fitted by least squares to
means of both depths over a hundredth of the patch. The interval contains the drawn errors of the measured depth
(`errors`), the scatter of the measured wear about the computed one with its correlation along x, and the numerical
error of the run. It also contains the coefficient that straight lines between the frames would give or, if the measured
depth is larger than that of the run, the last depth in proportion.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...formatting import format_length, format_number
from ..quantity import LEVEL, SIDE, Quantity
from .compare import Comparison
from .errors import correlation_length, student_factor
from .sentences import is_significant
from .worn import make_section

# Number of bins along the patch; their means are compared because the noise
# of single heights averages out.
N_BINS = 100
# Number of trial coefficients in the search.
N_RATIOS = 90
# Smallest fraction of the patch that the traces must show for its position to be known.
MIN_OVERLAP = 0.25
# Margin beyond each end of the patch relative to half its length; measured depths there take part
# in the fit, because unworn depths show where the wear ends.
END_MARGIN_RATIO = 0.1
# Largest ratio of the fitted wear coefficient to that of the run; above it,
# the computed shape is a guess.
MAX_RATIO = 2.0
# Upper limit of the ratio in the search; it exceeds MAX_RATIO so that an error message can propose
# a coefficient for the next run.
SEARCHED_RATIO = 1e4
# Largest ratio of measured to computed width of the wear; above it, the run does not
# describe the measured contact.
MAX_WIDTH_RATIO = 1.5
# Depth at the ends of the computed wear relative to the largest depth.
WORN_FRACTION = 0.05
# Largest increase of the sum of squares, in variances, of a position that explains
# the wear as well as the best one.
ACCEPTED_DEVIANCE = 4.0
# Largest number of positions that are tried in addition to the best one.
MAX_PLACES = 24
# Smallest distance between two different positions, in bins.
MIN_PLACE_DISTANCE = 1.5
# Smallest fraction of a variance left after the fit; smaller ones are too uncertain to divide by.
MIN_REMAINDER = 0.5
# Smallest number of degrees of freedom of Student's t; fewer give no useful interval.
MIN_BLOCKS = 3.0
# Smallest relative difference of the proportionally scaled coefficient that a note reports.
MIN_DEPARTURE = 0.01


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
        from scipy.interpolate import PchipInterpolator, make_interp_spline

        if self.is_linear:
            return make_interp_spline(self.work, self.depth, k=1)
        return PchipInterpolator(self.work, self.depth, axis=0)

    def interpolate_depth(self, ratio: float) -> np.ndarray:
        """Return the depth (m,) [m] for a coefficient of `ratio` times that of the run.

        Beyond the end of the run it grows at the rate of the last frames.
        """
        if ratio <= 1:
            return self._curve(ratio)
        rate = (self.depth[-1] - self.depth[-2]) / (self.work[-1] - self.work[-2])
        return self.depth[-1] + (ratio - 1) * rate

    @property
    def half(self) -> float:
        """Half of the patch length [m]."""
        return float(np.ptp(self.x)) / 2


class MeasuredDepth(NamedTuple):
    """Measured worn depth in bins along the second trace.

    - edges: (b + 1,) [m].
    - depth: means (b,) [m].
    - draws: errors of the means (draws, b) [m].
    - scale_error: relative standard deviation that is common to all depths.
    """

    edges: np.ndarray
    depth: np.ndarray
    draws: np.ndarray
    scale_error: float

    @property
    def width(self) -> float:
        """Width of a bin [m]."""
        return float(self.edges[1] - self.edges[0])

    def select_range(self, low: float, high: float) -> "MeasuredDepth":
        """Return the bins whose middle lies between two positions [m]."""
        middles = (self.edges[1:] + self.edges[:-1]) / 2
        inside = np.flatnonzero((middles >= low) & (middles <= high))
        first = inside[0]
        last = inside[-1] + 1
        return self._replace(
            edges=self.edges[first : last + 1],
            depth=self.depth[first:last],
            draws=self.draws[:, first:last],
        )


class Placement(NamedTuple):
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


class Difference(NamedTuple):
    """Part of the patch where the measured depth differs most from the computed one.

    - start, end: in x of the patch [m].
    - depth: mean measured less mean computed depth [m].
    - computed: mean computed depth [m].
    """

    start: float
    end: float
    depth: float
    computed: float


class ComparedDepths(NamedTuple):
    """Measured and computed worn depth in bins along the patch.

    - x: position on the patch (b,) [m].
    - measured, computed: mean depths (b,) [m].
    - noise: standard deviation (b,) [m] of the measured depth.
    """

    x: np.ndarray
    measured: np.ndarray
    computed: np.ndarray
    noise: np.ndarray

    @property
    def difference(self) -> np.ndarray:
        """Measured less computed depth (b,) [m]."""
        return self.measured - self.computed


@dataclass(frozen=True, eq=False)
class PredictedWear:
    """Computed worn depth, fitted to the measured one.

    - coefficient, centre: `Quantity` of the wear coefficient, and of the middle of the patch in x of the second trace.
    - is_mirrored: whether x of the patch runs against x of the trace; None where both fit.
    - depths: both depths along the patch.
    - difference: largest difference, or None where noise explains all.
    - proportional: coefficient [m2/N] for which the last depth of the run, in proportion, fits best.
    """

    history: WearHistory
    coefficient: Quantity
    centre: Quantity
    is_mirrored: bool | None
    depths: ComparedDepths
    difference: Difference | None
    proportional: float

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
        return float(np.sqrt(np.mean(self.depths.difference[self.on_patch] ** 2)))

    @property
    def sentence(self) -> str:
        """Sentence that states where the depths differ, and by how much."""
        mean = float(self.depths.computed[self.on_patch].mean())
        text = (
            f"With a wear coefficient of {_format_coefficient(self.coefficient, self.history.coefficient)}, the "
            "computed depth of the "
            f"{self.history.piece} piece differs from the measured depth by "
            f"{format_length(self.difference_rms, 3)} rms over the patch "
            f"({_format_percent(self.difference_rms, mean)} of its mean)"
        )
        if self.difference is None:
            return f"{text}; no part of the patch differs by more than the noise of the traces."
        start, end, depth, computed = self.difference
        word = "more" if depth > 0 else "less"
        percent = _format_percent(abs(depth), computed)
        return (
            f"{text}; they differ most from x = {format_length(start, 3)} to {format_length(end, 3)} of the patch, "
            f"where {format_length(abs(depth), 3)} {word} than computed wore off"
            f"{f' ({percent})' if percent else ''}."
        )

    @property
    def notes(self) -> tuple:
        """Sentences on the reliability of the fit."""
        out = []
        value = self.coefficient.value
        if self.is_extrapolated:
            out.append(
                f"the measured depth is larger than that of the run, so the coefficient is extrapolated from the last "
                f'frames; run the scene again with wear.coefficient = "{value * 1.2:.2g} m^2/N" and compare again'
            )
        if abs(self.proportional / value - 1) > MIN_DEPARTURE:
            out.append(
                "the computed depth is not proportional to the coefficient, because the pressure changes as the pieces "
                "wear; the coefficient is therefore fitted to the depths that the run passed through (at "
                f"{100 * min(value / self.history.coefficient, 1):.3g} % of its cycles); the last depth in proportion "
                f"would give {format_number(self.proportional, 4)} m^2/N"
            )
        if self.is_mirrored is None:
            out.append(
                "the computed wear fits as well with x of the patch against x of the traces, so the direction is not "
                "known; the interval of the coefficient contains both"
            )
        return tuple(out)


def _format_coefficient(coefficient: Quantity, run_coefficient: float) -> str:
    numbers = (*coefficient[:3], run_coefficient)
    value, low, high, run = (format_number(number, 4) for number in numbers)
    return f"{value} m^2/N ({low} to {high}; the run has {run})"


def _format_percent(part: float, total: float) -> str:
    return f"{100 * part / total:.2g} %" if total > 0 else ""


def fit_computed_wear(comparison: Comparison, history: WearHistory) -> PredictedWear:
    """Fit the computed worn depth of a run to the depth measured from two traces.

    Raises
    ------
    PatchfemError
        If the traces show no worn depth, or the run cannot be that of the measured contact.
    """
    measured = _average_measured_depth(comparison, 2 * history.half / N_BINS)
    _check_length(measured, comparison, history)
    start, others = _search_placements(measured, history)
    margin = (1 + END_MARGIN_RATIO) * history.half
    near = measured.select_range(start.centre - margin, start.centre + margin)
    best = _refine(near, history, start)
    others = [_refine(near, history, other, is_fixed=True) for other in others]
    opposite = best._replace(is_mirrored=not best.is_mirrored)
    others.append(_refine(near, history, opposite))
    _check_width(near, history, best, comparison)
    _check_ratio(best.ratio, history)
    return _make_result(near, history, best, others)


def _average_measured_depth(comparison: Comparison, width: float) -> MeasuredDepth:
    """Average the measured depth over bins of a width [m] along the second trace.

    Raises PatchfemError if the comparison has no worn depth.
    """
    mean = comparison.worn.mean
    if comparison.alignment is None and comparison.flanks is None:
        raise PatchfemError(f"compare --predicted: no worn depth was measured: {mean.reason}")
    if mean.value is None or not is_significant(mean):
        reason = mean.reason or (
            f"no wear was detected, at most {format_length(mean.high, 3)} on average"
        )
        raise PatchfemError(f"compare --predicted: no worn depth was measured: {reason}")
    if comparison.flanks is not None:
        flanks = comparison.flanks
        depth = np.asarray(flanks.depth)
        no_draws = np.zeros((2, depth.size))
        area, low, high = flanks.area
        scale_error = (high - low) / (2 * SIDE * area)
        return _average(flanks.x, depth, no_draws, width)._replace(scale_error=scale_error)
    section = make_section(comparison.alignment)
    return _average(section.x, section.depth, section.draws, width)


def _average(x, depth, draws, width: float) -> MeasuredDepth:
    """Average depths (n,) and draws (k, n) [m] at x (n,) over bins of a width [m]."""
    count = int(np.ptp(x) / width)
    if count < 2:
        raise PatchfemError(
            f"compare --predicted: the common part of the traces is {format_length(float(np.ptp(x)), 3)} long, and the "
            f"patch of the run {format_length(N_BINS * width, 3)}; the two do not overlap enough; check the units of x"
        )
    edges = x[0] + width * np.arange(count + 1)
    borders = np.concatenate([[x[0]], (x[1:] + x[:-1]) / 2, [x[-1]]])
    lengths = np.diff(borders)
    rows = []
    for values in (depth, *draws):
        area = np.concatenate([[0.0], np.cumsum(values * lengths)])
        rows.append(np.diff(np.interp(edges, borders, area)) / width)
    return MeasuredDepth(edges, rows[0], np.array(rows[1:]), 0.0)


def _average_computed_depth(history: WearHistory, edges, placement: Placement) -> np.ndarray:
    """Average the computed depth (b,) [m] over bins with edges (b + 1,) [m] along the trace."""
    x = history.x
    depth = history.interpolate_depth(placement.ratio)
    area = np.concatenate([[0.0], np.cumsum(np.diff(x) * (depth[1:] + depth[:-1]) / 2)])
    sign = -1 if placement.is_mirrored else 1
    places = sign * (edges - placement.centre)
    return sign * np.diff(np.interp(places, x, area)) / np.diff(edges)


def _check_length(measured: MeasuredDepth, comparison: Comparison, history: WearHistory) -> None:
    """Raise PatchfemError for traces that are too short for the patch or show a wider track than the patch."""
    patch = 2 * history.half
    length = float(measured.edges[-1] - measured.edges[0])
    if length < MIN_OVERLAP * patch:
        raise PatchfemError(
            f"compare --predicted: the common part of the traces is {format_length(length, 3)} long, and the patch of "
            f"{history.source} {format_length(patch, 3)}; at least {100 * MIN_OVERLAP:.0f} % of the patch must lie "
            f"within the traces{_describe_units(patch / length)}"
        )
    width = comparison.tracks.sizes.get("width")
    if width is not None and width.high is not None and width.value > MAX_WIDTH_RATIO * patch:
        raise _refuse_width(width.value, patch, history)


def _refuse_width(measured: float, computed: float, history: WearHistory) -> PatchfemError:
    ratio = max(measured / computed, computed / measured)
    return PatchfemError(
        f"compare --predicted: the measured track is {format_length(measured, 3)} wide, and the computed wear of "
        f"{history.source} {format_length(computed, 3)}; this run is not that of the measured contact"
        f"{_describe_units(ratio)}"
    )


def _describe_units(ratio: float) -> str:
    """Return the end of a message on lengths that differ by a large factor."""
    return "; check the units of x with --units" if ratio > 20 else ""


def _search_placements(measured: MeasuredDepth, history: WearHistory) -> tuple:
    """Find the best placement of the computed wear on a grid, and others that fit as well.

    For each trial coefficient, both directions and every shift by a bin, the sum of squares follows from
    two correlations.

    Returns
    -------
    best : Placement
    others : list of Placement
    """
    low = history.work[1]
    ratios = np.unique(np.concatenate([np.geomspace(low, SEARCHED_RATIO, N_RATIOS), [1.0]]))
    template_edges = np.linspace(-history.half, history.half, N_BINS + 1)
    n_shown = int(MIN_OVERLAP * N_BINS)
    first_shift = n_shown - N_BINS
    ones = np.ones(measured.depth.size)
    shape = (2, measured.depth.size + N_BINS - 1)
    squares = np.full(shape, np.inf)
    chosen = np.zeros(shape)
    for ratio in ratios:
        for side in (False, True):
            template = _average_computed_depth(history, template_edges, Placement(ratio, 0.0, side))
            total = np.correlate(ones, template**2, "full")
            total -= 2 * np.correlate(measured.depth, template, "full")
            better = total < squares[int(side)]
            squares[int(side), better] = total[better]
            chosen[int(side), better] = ratio
    shifts = np.arange(shape[1]) - (N_BINS - 1)
    is_shown = (shifts >= first_shift) & (shifts <= measured.depth.size - n_shown)
    squares[:, ~is_shown] = np.inf
    placements = []
    order = np.argsort(squares, axis=None)
    for number in order[: 4 * MAX_PLACES]:
        side, place = divmod(int(number), shape[1])
        centre = float(measured.edges[0] + measured.width * shifts[place] + history.half)
        total = float(squares[side, place] + measured.depth @ measured.depth)
        placements.append(Placement(float(chosen[side, place]), centre, bool(side), total))
    best = placements[0]
    distance = MIN_PLACE_DISTANCE * measured.width

    def is_apart(other: Placement) -> bool:
        return other.is_mirrored != best.is_mirrored or abs(other.centre - best.centre) > distance

    return best, list(filter(is_apart, placements))[:MAX_PLACES]


def _refine(
    measured: MeasuredDepth, history: WearHistory, start: Placement, *, is_fixed: bool = False
) -> Placement:
    """Refine the coefficient and the position by least squares; if `is_fixed`, the position is not changed."""
    from scipy.optimize import least_squares

    def make_placement(values) -> Placement:
        centre = start.centre if is_fixed else start.centre + values[1] * measured.width
        return Placement(float(start.ratio * values[0]), float(centre), start.is_mirrored)

    def differences(values):
        computed = _average_computed_depth(history, measured.edges, make_placement(values))
        return (computed - measured.depth) * 1e6

    values = [1.0] if is_fixed else [1.0, 0.0]
    bounds = ([0.2], [5.0]) if is_fixed else ([0.2, -5.0], [5.0, 5.0])
    fit = least_squares(differences, values, bounds=bounds, diff_step=1e-3)
    return make_placement(fit.x)._replace(squares=float(fit.fun @ fit.fun) * 1e-12)


def _check_ratio(ratio: float, history: WearHistory) -> None:
    """Raise PatchfemError if the measured depth is far above that of the run, or below that of its first frame."""
    if history.work[1] <= ratio <= MAX_RATIO:
        return
    size = f"{ratio:.3g} times" if ratio > 1 else f"1/{1 / ratio:.3g} of"
    cure = f'run the scene again with wear.coefficient = "{1.3 * ratio * history.coefficient:.2g} m^2/N" and compare again'
    units = "; or check the units of z with --units" if not 0.05 < ratio < 20 else ""
    raise PatchfemError(
        f"compare --predicted: the measured wear needs {size} the wear coefficient of {history.source}, for which the "
        f"run computed no depth; {cure}{units}"
    )


class _Spread(NamedTuple):
    """Standard deviations of ratio and centre, and variance and correlation of the differences."""

    ratio: float
    centre: float
    variance: float
    correlation: float


def _make_result(
    measured: MeasuredDepth,
    history: WearHistory,
    best: Placement,
    others: list,
) -> PredictedWear:
    """Make the result for the best placement; its interval contains the placements that fit as well."""
    computed = _average_computed_depth(history, measured.edges, best)
    jacobian = _compute_derivatives(measured, history, best)
    spread = _measure_spread(measured, computed, jacobian)
    final = _scale_last_depth(history)
    proportional = _refine(measured, final, best, is_fixed=True).ratio
    relative = np.hypot(SIDE * measured.scale_error, history.error)
    other = proportional
    if best.ratio <= 1:
        other = _refine(measured, replace(history, is_linear=True), best, is_fixed=True).ratio
    between_frames = abs(other - best.ratio)
    half = float(np.hypot(np.hypot(SIDE * spread.ratio, relative * best.ratio), between_frames))
    threshold = best.squares + ACCEPTED_DEVIANCE * spread.correlation * spread.variance
    accepted = [other for other in others if other.squares <= threshold]
    ratios = [best.ratio, *(other.ratio for other in accepted)]
    centres = [best.centre, *(other.centre for other in accepted)]
    coefficient = Quantity(
        best.ratio * history.coefficient,
        max(min(ratios) - half, 0.0) * history.coefficient,
        (max(ratios) + half) * history.coefficient,
        "m2 N-1",
        "wear coefficient with which the computed depth fits the measured one",
    )
    centre = Quantity(
        best.centre,
        min(centres) - SIDE * spread.centre,
        max(centres) + SIDE * spread.centre,
        "m",
        "middle of the patch, in x of the second trace (after wear)",
    )
    is_unknown = any(other.is_mirrored != best.is_mirrored for other in accepted)
    middles = (measured.edges[1:] + measured.edges[:-1]) / 2 - best.centre
    x = -middles if best.is_mirrored else middles
    order = np.argsort(x)
    draws = _project_out(measured.draws, jacobian)
    return PredictedWear(
        history=history,
        coefficient=coefficient,
        centre=centre,
        is_mirrored=None if is_unknown else best.is_mirrored,
        depths=ComparedDepths(
            x[order],
            measured.depth[order],
            computed[order],
            measured.draws.std(axis=0)[order],
        ),
        difference=_find_difference(x, measured, computed, draws, history),
        proportional=proportional * history.coefficient,
    )


def _scale_last_depth(history: WearHistory) -> WearHistory:
    """Return the history in which the last depth of a run grows in proportion to the work."""
    depth = np.array([np.zeros(history.x.size), history.depth[-1]])
    return replace(history, work=np.array([0.0, 1.0]), depth=depth)


def _check_width(
    measured: MeasuredDepth, history: WearHistory, best: Placement, comparison: Comparison
) -> None:
    """Raise PatchfemError if the width of the measured track differs from that of the computed wear.

    A track may be wider than the wear of a run that wore far less, as the contact grows.
    """
    width = comparison.tracks.sizes.get("width")
    if width is None or width.high is None or width.value is None:
        return
    computed = _average_computed_depth(history, measured.edges, best)
    computed_width = float((computed > WORN_FRACTION * computed.max()).sum()) * measured.width
    is_too_wide = width.value > MAX_WIDTH_RATIO * computed_width and best.ratio <= MAX_RATIO
    if is_too_wide or width.value < computed_width / MAX_WIDTH_RATIO:
        raise _refuse_width(width.value, computed_width, history)


def _compute_derivatives(
    measured: MeasuredDepth, history: WearHistory, best: Placement
) -> np.ndarray:
    """Return the derivatives (b, 2) of the computed depth with respect to ratio and centre."""

    def compute_depth(name: str, change: float) -> np.ndarray:
        placement = best._replace(**{name: getattr(best, name) + change})
        return _average_computed_depth(history, measured.edges, placement)

    columns = []
    for name, step in (("ratio", 0.01 * best.ratio), ("centre", measured.width / 2)):
        columns.append((compute_depth(name, step) - compute_depth(name, -step)) / (2 * step))
    return np.column_stack(columns)


def _project_out(draws, jacobian) -> np.ndarray:
    """Return random errors (k, b) [m] minus the part that the fitted coefficient and position absorb."""
    return draws - draws @ np.linalg.pinv(jacobian).T @ jacobian.T


def _measure_spread(measured: MeasuredDepth, computed, jacobian) -> _Spread:
    """Estimate the errors of ratio and centre from the random errors and from the differences."""
    gain = np.linalg.pinv(jacobian)
    residual = measured.depth - computed
    worn = np.flatnonzero(computed > WORN_FRACTION * computed.max())
    remainders = _project_out(measured.draws, jacobian)
    drawn = measured.draws @ gain.T
    deviations = []
    for number, row in enumerate(gain):
        weights = np.abs(row * jacobian[:, number])
        scatter = _sum_variance((row * residual)[worn], weights[worn])
        noise = float(np.mean([np.sum((row * draw)[worn] ** 2) for draw in remainders]))
        misfit = max(scatter - noise, 0.0)
        deviations.append(float(np.sqrt(np.var(drawn[:, number]) + misfit)))
    variance = float(residual @ residual) / max(residual.size - 2, 1)
    correlation = max(correlation_length(residual, np.ones(residual.size, bool)), 1.0)
    return _Spread(*deviations, variance, correlation)


def _sum_variance(terms, weights) -> float:
    """Estimate the variance of the sum of correlated terms (b,), widened by Student's t.

    The fit takes up about two correlation lengths of the terms, so the correlation length and the
    variance that the terms show are smaller than the true ones by the same part.

    Parameters
    ----------
    terms : (b,) array
        Contributions of the differences to a parameter.
    weights : (b,) array
        Contributions of the computed depth, whose scatter reduces the number of independent terms.
    """
    scale = float(np.sqrt(np.mean(terms**2)))
    if not scale > 0:
        return 0.0
    count = float(weights.sum() ** 2 / (weights @ weights))
    observed_length = max(correlation_length(terms / scale, np.ones(terms.size, bool)), 1.0)
    correlation = observed_length / max(1 - 2 * observed_length / count, MIN_REMAINDER)
    variance = float(terms @ terms) * correlation / max(1 - 2 * correlation / count, MIN_REMAINDER)
    return student_factor(max(count / correlation - 2, MIN_BLOCKS)) ** 2 * variance


def _find_difference(
    x, measured: MeasuredDepth, computed, draws, history: WearHistory
) -> Difference | None:
    """Find the part of the patch where both depths differ most, or return None if noise explains the difference.

    The sums over all parts, divided by the root of their length, are compared with those of the drawn
    errors (scan statistic).
    """
    inside = np.flatnonzero(np.abs(x) <= history.half)
    first = inside[0]
    last = inside[-1] + 1
    residual = (measured.depth - computed)[first:last]
    if measured.draws.any():
        peaks = [_find_scan_maximum(draw[first:last])[0] for draw in draws]
        limit = float(np.quantile(peaks, LEVEL))
    else:
        limit = 0.0
    peak, low, high = _find_scan_maximum(residual)
    if peak <= limit:
        return None
    ends = sorted(float(end) for end in (x[first + low], x[first + high - 1]))
    half_bin = measured.width / 2
    part = slice(low, high)
    return Difference(
        max(ends[0] - half_bin, -history.half),
        min(ends[1] + half_bin, history.half),
        float(residual[part].mean()),
        float(computed[first:last][part].mean()),
    )


class _ScanMaximum(NamedTuple):
    """Part of an array for which the sum divided by the square root of the length is largest.

    - peak: this quotient.
    - low, high: first bin of the part, and the bin after its last one.
    """

    peak: float
    low: int
    high: int


def _find_scan_maximum(values) -> _ScanMaximum:
    """Find the part of values (b,) whose sum divided by the square root of its length is largest."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    lengths = np.arange(sums.size)
    distance = lengths[None, :] - lengths[:, None]
    scores = np.abs(sums[None, :] - sums[:, None]) / np.sqrt(np.maximum(distance, 1))
    scores[distance < 1] = 0.0
    low, high = np.unravel_index(int(np.argmax(scores)), scores.shape)
    return _ScanMaximum(float(scores[low, high]), int(low), int(high))
