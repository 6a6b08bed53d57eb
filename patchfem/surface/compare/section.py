"""Section through a worn surface: ends of a track, and its dimensions with their intervals.

A trace is a single section; a scan gives several across its track. The ends are places at which the
worn depth leaves zero: change points between unworn heights and a flank, by profile likelihood.
"""

from typing import NamedTuple

import numpy as np

from ...formatting import format_length
from ..profile import find_runs, robust_deviation
from ..quantity import LEVEL, SIDE, Quantity, make_quantity, make_unknown
from .boxes import N_PARTS, average_parts, make_boxes, part_edges
from .errors import block_length, correlation_length, draw_blocks, student_factor
from .robust import MAX_NOISE, MAX_OUTLIER, MAX_UNWORN

# Number of parts of the trace, out of N_PARTS, that remain on either side of a shallow track.
FLANK_PARTS = 6
MIN_PARTS = 3  # smallest number of parts in a shallow track
DATUM_DEGREE = 3  # degree of the polynomial that a datum may add to shallow depths
# Smallest depth of a shallow track in standard deviations; 2 % of random walks have a deeper one.
MIN_STEP = 8.0
# Fraction of unworn traces in which noise alone is reported as wear.
FALSE_POSITIVE_RATE = 1e-3
N_TESTS = 4  # number of tests of each height: the height itself, and means of 4, 16 and 64 samples
# Depth to which a flank is fitted, in standard deviations; below 10, a straight flank cannot be
# told from one that fades out; above half of the depth, the floor begins.
FLANK_HEIGHT = 25.0
# Smallest height of a cliff, and smallest depth to which any flank is
# fitted, in standard deviations.
MIN_CLIFF = 10.0
MIN_FITTED_DEPTHS = 2  # smallest number of depths to which a flank of two parameters can be fitted
MIN_FLANK_SAMPLES = 12  # smallest number of samples of a flank, and of the unworn heights beside it
# Largest number of samples that are tried as the first worn one, which limits the time.
MAX_CANDIDATES = 160
MIN_PILE_UP = 3.0  # smallest height of a pile-up above the first trace, in standard deviations
# Distances, in samples, from the point where a straight or round flank leaves zero to its first worn
# sample.
OFFSETS = (1 / 3, 2 / 3, 1.0)
# Smallest decrease of the deviance (-2 log likelihood) by which one kind of flank excludes another.
MIN_CLEAR_DEVIANCE = 12.0
# Deviance of the true change point above the smallest one that 95 % of traces do not exceed (Hinkley, Biometrika 57
# (1970) 1): the square root of 0.95 is the chance that neither side of it exceeds this value.
MAX_DEVIANCE = -2 * np.log(1 - np.sqrt(LEVEL))
# Largest number of bootstrap blocks of a mean section; more would not show its long-wave errors.
MAX_BLOCKS = 8
N_FIFTHS = 5  # number of parts of a track; the deepest part is the floor
# Largest number of samples between a track and the end of the section at
# which the track may be cut off.
MAX_CUT_SAMPLES = 5
# Smallest fraction of heights above the first surface in a track whose floor has new roughness.
MIN_GROWN_FRACTION = 0.02
# Smallest fraction of worn heights in a track; worn tops between valleys have a smaller one.
MIN_WORN_FRACTION = 0.85
# Largest unworn gap relative to the width of the track for which both sides belong to one track.
MAX_GAP_FRACTION = 0.05
MIN_WAVES_PER_TRACK = 3.0  # smallest length of a track relative to the longest wave of the band
# Largest distance of two neighbouring heights relative to the median distance; above it,
# heights are missing between them.
MISSING_DISTANCE = 1.5

_ONE_SIDE = "area above the first trace (before wear) within one track width"
TEXTS = {
    "from": "x in the second trace (after wear) at which the longest track begins",
    "to": "x in the second trace (after wear) at which the longest track ends",
    "width": "width of the longest track on these traces, not its mean width over several places",
    "depth_mean": "mean depth of the longest track: lost area divided by width",
    "depth_floor": "floor of the longest track: bottom of the parabola through the deepest fifth of its width",
    "step": "step: mean depth over the middle third of the longest track, as ISO 5436-1 defines for a groove of "
    "type A1",
    "area_net": "lost area less pile-up",
    "area_gross": "area lost in the longest track",
    "pile_up": "pile-up on both sides: area above the first trace (before wear), on each side within one track width "
    "of the longest track",
    "pile_up_left": f"pile-up before the longest track: {_ONE_SIDE}",
    "pile_up_right": f"pile-up behind the longest track: {_ONE_SIDE}",
}


class Section(NamedTuple):
    """Cross-section of the worn depth, with its errors.

    - x, depth, noise: position, worn depth and its standard deviation, (n,) [m].
    - draws: bootstrap errors of the depth, (draws, n) [m].
    - correlation: number of neighbouring depths whose errors are fully correlated.
    """

    x: np.ndarray
    depth: np.ndarray
    noise: np.ndarray
    draws: np.ndarray
    correlation: float

    @property
    def widths(self) -> np.ndarray:
        """Length (n,) [m] that each sample represents."""
        return sample_lengths(self.x)

    @property
    def worn_heights(self) -> np.ndarray:
        """Worn heights (n,) bool."""
        return find_worn_heights(self.depth, self.noise, self.correlation)

    @property
    def grown_heights(self) -> np.ndarray:
        """Heights (n,) bool with material above the first surface, by the same tests as worn ones."""
        return find_worn_heights(-self.depth, self.noise, self.correlation)

    @property
    def gap_errors(self) -> np.ndarray:
        """Standard deviation (n - 1,) [m2] of the area between neighbours where heights are missing.

        The depth may fall from that of one neighbour to that of the other anywhere in the gap. The
        area is then uniformly distributed over a range of the gap times the difference in depth.
        """
        distance = np.diff(self.x)
        median = np.median(distance)
        gap = np.where(distance > MISSING_DISTANCE * median, distance - median, 0.0)
        return gap * np.abs(np.diff(self.depth)) / np.sqrt(12)

    def integrate(self, inside) -> tuple:
        """Integrate the depth over samples (n,) bool; return the area [m2] and its standard deviation."""
        part = np.flatnonzero(inside)
        if not part.size:
            return 0.0, 0.0
        weight = np.where(inside, self.widths, 0.0)
        low = part[0]
        high = part[-1] + 1
        errors = self.draws[:, low:high] @ weight[low:high]
        gap_errors = self.gap_errors[inside[1:] | inside[:-1]]
        variance = np.var(errors) + gap_errors @ gap_errors
        return float(weight @ self.depth), float(np.sqrt(variance))


def noise_threshold(count: int, n_tests: int = N_TESTS) -> float:
    """Return the number of standard deviations that noise exceeds in 1 of 1000 traces.

    Parameters
    ----------
    count : int
        Heights of a trace.
    n_tests : int
        Tests of each height.
    """
    from scipy.special import ndtri

    return float(-ndtri(FALSE_POSITIVE_RATE / max(count * n_tests, 1)))


def section_from_depths(x, depth, outside) -> Section:
    """Make a section whose noise is estimated from the depths outside the track.

    Parameters
    ----------
    x, depth : (n,) array [m]
    outside : (n,) bool array
        Samples outside of the track.
    """
    residual = depth[outside] - np.median(depth[outside])
    noise = max(robust_deviation(residual), 1e-300)
    clipped = np.where(outside, np.clip(depth, -MAX_NOISE * noise, MAX_NOISE * noise), 0.0)
    correlation = correlation_length(clipped, outside)
    values = np.clip(residual / noise, -MAX_NOISE, MAX_NOISE)
    length = max(block_length(correlation, values.size), values.size // MAX_BLOCKS)
    draws = noise * draw_blocks(values, length, depth.size) * student_factor(values.size / length)
    return Section(x, depth, np.full(depth.size, noise), draws, correlation)


class FlankEnd(NamedTuple):
    """Beginning of a flank, in depths that are ordered from outside to inside of the track.

    - first: first worn sample.
    - place, low, high: place where the flank leaves zero, and the bounds of its 95 % interval, in
      samples; 2.5 is half-way between the samples 2 and 3.
    """

    first: int
    place: float
    low: float
    high: float


class FlankShape(NamedTuple):
    """Smooth flank b t^power + c t^(power + 1); t is zero `offset` samples before the first worn sample."""

    power: float
    offset: float


STRAIGHT_FLANKS = tuple(FlankShape(1.0, offset) for offset in OFFSETS)
FLAT_FLANKS = (FlankShape(2.0, 1.0),)
ROUND_FLANKS = tuple(FlankShape(0.5, offset) for offset in OFFSETS)
SMOOTH_FLANKS = (*STRAIGHT_FLANKS, *FLAT_FLANKS, *ROUND_FLANKS)
STEP_OFFSET = 0.5  # same distance for a flank that begins with a step between two samples


def sample_lengths(x) -> np.ndarray:
    """Return the length (n,) [m] of each sample: half of the distances to its neighbours."""
    edges = np.concatenate(
        [[1.5 * x[0] - x[1] / 2], (x[1:] + x[:-1]) / 2, [1.5 * x[-1] - x[-2] / 2]]
    )
    return np.diff(edges)


def median_of_five(values) -> np.ndarray:
    """Return the running median (n,) of five values."""
    return np.median(np.lib.stride_tricks.sliding_window_view(np.pad(values, 2, "edge"), 5), axis=1)


def find_worn_heights(depth, noise, correlation: float) -> np.ndarray:
    """Find the worn heights (n,) bool.

    Running medians of 5 show deep wear, running means of 4, 16 and 64 wear of a few standard deviations, and a
    box over parts of the trace a track that is shallower than the noise.

    Parameters
    ----------
    depth, noise : (n,) array [m]
        Depth and its standard deviation.
    correlation : float
        Number of neighbouring depths whose errors are fully correlated.
    """
    relative = depth / noise
    threshold = noise_threshold(relative.size)
    worn = median_of_five(relative) > threshold
    for window in (4, 16, 64):
        if window > relative.size // 4:
            break
        # Deep heights would raise the means next to them.
        shallow = np.clip(np.where(worn, 0.0, relative), -MAX_OUTLIER, MAX_OUTLIER)
        mean = np.convolve(shallow, np.full(window, 1 / window), "valid")
        for k in np.flatnonzero(mean > threshold * np.sqrt(correlation / window)):
            worn[k + window // 4 : k + window - window // 4] = True
    track, _ = find_shallow_track(depth, float(np.median(noise)))
    if track is not None:
        worn[track[0] : track[1] + 1] = True
    return worn


def find_shallow_track(depth, scale: float) -> tuple:
    """Find a track that is shallower than the noise of single heights, from averages over 60 parts.

    Each box is fitted together with a cubic, which a datum may add. The best box is a track if its depth
    is eight times its standard deviation, which follows from the residuals and their correlation, so
    that a slow drift is no track (generalized likelihood ratio test).

    Returns
    -------
    run : tuple of first and last sample, or None
    threshold : float
        Mean depth [m] from which a track over the middle third would have been found; inf for short
        traces.
    """
    if depth.size < 8 * N_PARTS:
        return None, np.inf
    edges = part_edges(depth.size, N_PARTS)
    clipped = np.clip(depth, -MAX_NOISE * scale, MAX_NOISE * scale)
    # Depths are measured from a supposed surface, which may be the floor of a wide scar. The flanks of such a scar stand
    # clearly above the floor and are left out, because the floor between them would look like a shallow track. If most
    # heights stand above the supposed surface, they are the real surface, and the part at zero depth is a track.
    is_above = depth < -MAX_NOISE * scale
    if 2 * np.count_nonzero(is_above) < depth.size:
        clipped[is_above] = 0.0
    means = average_parts(clipped, edges)
    boxes = make_boxes(N_PARTS, FLANK_PARTS, MIN_PARTS, DATUM_DEGREE)
    means = means - boxes.datum @ (boxes.datum.T @ means)
    heights = boxes.shapes @ means
    best = int(np.argmax(heights))
    residual = means - heights[best] * boxes.shapes[best]
    freedom = N_PARTS - DATUM_DEGREE - 4
    correlation = correlation_length(residual, np.ones(N_PARTS, bool))
    spread = float(np.sqrt(residual @ residual / freedom * correlation))
    spread = max(spread, 1e-3 * scale)
    third = boxes.spans.index((N_PARTS // 3, N_PARTS - N_PARTS // 3))
    threshold = MIN_STEP * spread / float(boxes.sizes[third])
    if heights[best] <= MIN_STEP * spread:
        return None, threshold
    first, last = boxes.spans[best]
    return (int(edges[first]), int(edges[last]) - 1), threshold


def find_end(depth, noise, correlation: float, worn: int) -> FlankEnd:
    """Find where a flank begins, in depths that are ordered from outside to inside of a track.

    Outside, depths are noise about zero, or pile-up. Inside they follow a flank with a scatter of its
    own: straight (b t + c t^2), round with a vertical tangent at its end (b t^(1/2) + c t^(3/2)), or
    with a step (a + b t + c t^2). The interval holds all ends whose likelihood is high enough, with the
    best of these flanks or of one that runs out flat as b t^2 + c t^3 (profile likelihood). It has no
    part for an error of the level outside. At a cliff, where the depth falls between two samples from a
    value that noise explains to more than ten standard deviations, the end is half-way between them,
    with an interval of one sample to each side.

    Parameters
    ----------
    depth, noise : (n,) array [m]
        Depth and its standard deviation.
    correlation : float
        Number of neighbouring depths whose errors are fully correlated.
    worn : int
        First sample that is known as worn.
    """
    relative = depth / noise
    half_depth = float(relative[worn:].max(initial=0.0)) / 2
    height = min(FLANK_HEIGHT, max(half_depth, MIN_CLIFF))
    deep = np.flatnonzero(relative[worn:] > height)
    reach = max(int(deep[0]) if deep.size else depth.size - worn, MIN_FLANK_SAMPLES)
    high = min(worn + reach, depth.size)
    is_certain = relative > noise_threshold(depth.size)
    # The first deep height counts too: at a cliff, no height before it is certainly worn.
    inside = is_certain[worn : high + 1]
    first_certain = worn + (int(np.argmax(inside)) if inside.any() else reach // 2)
    uncertain = np.flatnonzero(~is_certain[:first_certain])
    if inside.any() and uncertain.size:
        last_uncertain = int(uncertain[-1])
        first_deep = last_uncertain + 1
        if relative[last_uncertain] <= MAX_UNWORN and relative[first_deep] > MIN_CLIFF:
            middle = first_deep - STEP_OFFSET
            return FlankEnd(first_deep, middle, middle - 1, middle + 1)
    if depth.size < MIN_FITTED_DEPTHS:  # the worn height is the last one of the section
        middle = worn - STEP_OFFSET
        return FlankEnd(worn, middle, middle, middle)
    low = max(worn - 2 * reach, 0)
    part = depth[low:high]
    sigma = noise[low:high]
    last = max(min(part.size - 4, first_certain - low), 0)
    candidates = np.unique(np.linspace(0, last, min(last + 1, MAX_CANDIDATES)).astype(int))
    outside = _outside_deviances(part, sigma)[candidates]
    flanks = np.array([_flank_deviances(part[k:], sigma[k:]) for k in candidates]).T
    deviances = (outside + flanks) / max(correlation, 1.0)
    return _select_end(deviances, low + candidates)


def _select_end(deviances, candidates) -> FlankEnd:
    """Select the most likely beginning of a flank and its interval.

    A step is taken if it fits clearly better than all smooth flanks. Otherwise the interval holds the
    likely ends of straight and flat flanks and those of round ones, unless one of these two kinds
    fits clearly better. The end is that of a straight flank if its likelihood is in the interval of
    all smooth flanks, else that of a round one.

    Parameters
    ----------
    deviances : (flanks, m) array
        Of the flanks of `_flank_deviances` from each candidate on.
    candidates : (m,) int array
        First worn samples.
    """
    offsets = np.array([*(shape.offset for shape in SMOOTH_FLANKS), STEP_OFFSET])
    places = candidates - offsets[:, None]
    n_straight = len(STRAIGHT_FLANKS)
    straight = slice(0, n_straight)
    straight_or_flat = slice(0, n_straight + len(FLAT_FLANKS))
    rounded = slice(straight_or_flat.stop, -1)
    step = slice(-1, None)
    best = float(deviances[:-1].min())
    if deviances[step].min() < best - MIN_CLEAR_DEVIANCE:
        chosen = step
        kinds = [step]
    else:
        is_straight = deviances[straight_or_flat].min() <= best + MAX_DEVIANCE
        chosen = straight if is_straight else rounded
        kinds = [straight_or_flat, rounded]
        kinds = [kind for kind in kinds if deviances[kind].min() <= best + MIN_CLEAR_DEVIANCE]
    row, column = np.unravel_index(np.argmin(deviances[chosen]), deviances[chosen].shape)
    place = float(places[chosen][row, column])
    tried = [candidates[0] - 1.0, candidates[-1] + 1.0]
    likely = [place]
    for kind in kinds:
        is_likely = deviances[kind] <= deviances[kind].min() + MAX_DEVIANCE
        likely.extend(places[kind][is_likely])
        tried.extend(places[kind].ravel())
    # The likelihood falls below the bound between a likely place and the next one that was tried.
    tried = np.unique(tried)
    outer, inner = np.searchsorted(tried, (min(likely), max(likely)))
    return FlankEnd(
        first=int(candidates[column]),
        place=place,
        low=float(tried[max(outer - 1, 0)]),
        high=float(tried[min(inner + 1, tried.size - 1)]),
    )


def _widen_by_level_error(flank: FlankEnd, depth, noise, draws, correlation, worn) -> FlankEnd:
    """Widen the interval for the end of a flank by the error of the reference level.

    The ends are found again with the depths raised and lowered by this error. A flank of slope s moves
    by error / s, and one of curvature c that runs out flat by the square root of 2 error / c. The error
    is that of the mean depth over the samples in which the end may lie, less the part of the noise,
    which the likelihood contains.

    Parameters
    ----------
    flank : FlankEnd
        Result of `find_end` for the other arguments.
    depth, noise : (n,) array [m]
        Depth and its standard deviation.
    draws : (draws, n) array [m]
        Bootstrap errors of the depth.
    correlation : float
        Number of neighbouring depths whose errors are fully correlated.
    worn : int
        First sample that is known as worn.
    """
    outermost = min(int(flank.low), worn - MIN_FLANK_SAMPLES)
    near = slice(max(outermost, 0), max(worn, 1))
    noise_variance = float(np.mean(noise[near] ** 2)) * correlation / noise[near].size
    level_variance = float(np.var(draws[:, near].mean(axis=1))) - noise_variance
    level_error = SIDE * np.sqrt(max(level_variance, 0.0))
    place = flank.place
    raised = find_end(depth + level_error, noise, correlation, worn).place
    lowered = find_end(depth - level_error, noise, correlation, worn).place
    outward = float(np.hypot(place - flank.low, place - min(place, raised, lowered)))
    inward = float(np.hypot(flank.high - place, max(place, raised, lowered) - place))
    return flank._replace(low=place - outward, high=place + inward)


def _outside_deviances(depth, noise) -> np.ndarray:
    """Return the deviances (n + 1,) of the first 0, 1, ..., n depths from pure noise."""
    squares = np.where(depth < -MIN_PILE_UP * noise, 1.0, (depth / noise) ** 2)
    terms = np.minimum(squares, MAX_NOISE**2) + 2 * np.log(noise)
    sums = np.concatenate([[0.0], np.cumsum(terms)])
    # The last unworn height counts in full, because a speck would not be next to a flank.
    sums[1:] += np.maximum(squares - MAX_NOISE**2, 0.0)
    return sums


def _flank_deviances(depth, noise) -> np.ndarray:
    """Return the deviances of fits to depths (n,): SMOOTH_FLANKS, and a flank with a step.

    The scatter of a flank is at least that of the noise.
    """
    weighted = depth / noise
    samples = np.arange(depth.size)
    squares = [_fit_smooth_flank(weighted, noise, samples, shape) for shape in SMOOTH_FLANKS]
    t = samples / depth.size
    base = np.column_stack([np.ones(depth.size), t, t * t]) / noise[:, None]
    coefficients = np.linalg.lstsq(base, weighted, rcond=None)[0]
    is_down = coefficients[0] >= 0  # an upward step is pile-up, where no track begins
    squares.append(float(((weighted - base @ coefficients) ** 2).sum()) if is_down else np.inf)
    squares = np.array(squares)
    mean_square = squares / depth.size
    scattered = depth.size * (1 + np.log(np.maximum(mean_square, 1.0)))
    deviances = np.where(mean_square <= 1, squares, scattered)
    return deviances + 2 * float(np.log(noise).sum())


def _fit_smooth_flank(weighted, noise, samples, shape: FlankShape) -> float:
    """Fit b t^p + c t^(p + 1) to depths by least squares; return the sum of (residual / noise)^2.

    Parameters
    ----------
    weighted, noise : (n,) array
        Depth / noise, and the noise [m].
    samples : (n,) int array
        Sample numbers from the first worn one on.
    shape : FlankShape
    """
    t = (samples + shape.offset) / samples.size
    first = t**shape.power / noise
    second = first * t
    products = first @ first, first @ second, second @ second
    determinant = products[0] * products[2] - products[1] ** 2
    sides = first @ weighted, second @ weighted
    slope = (products[2] * sides[0] - products[1] * sides[1]) / determinant
    curvature = (products[0] * sides[1] - products[1] * sides[0]) / determinant
    if slope < 0:  # the flank would rise above the surface at first
        slope = 0.0
        curvature = max(sides[1] / products[2], 0.0)
    residual = weighted - slope * first - curvature * second
    return float(residual @ residual)


def find_tracks(section: Section, longest: float) -> list:
    """Find the tracks: worn parts that are longer than three of the longest waves.

    Gaps of a twentieth of the width are bridged, and wider ones in which most heights changed: new roughness
    in a track may stand above the first surface. Worn tops between unworn valleys are no track.

    Parameters
    ----------
    section : Section
    longest : float
        Longest wave [m] of the band.

    Returns
    -------
    list
        First and last sample of each track.
    """
    worn = section.worn_heights
    changed = worn | (np.abs(median_of_five(section.depth / section.noise)) > MAX_UNWORN)
    runs = find_runs(worn)
    tracks = []
    while runs:
        at = max(range(len(runs)), key=lambda k: runs[k][1] - runs[k][0])
        first, last = runs[at]
        low = high = at
        while low > 0 and _is_bridged(changed, runs[low - 1][1], first, last - first):
            low -= 1
            first = runs[low][0]
        while high < len(runs) - 1 and _is_bridged(changed, last, runs[high + 1][0], last - first):
            high += 1
            last = runs[high][1]
        runs = runs[:low] + runs[high + 1 :]
        is_long = section.x[last] - section.x[first] > MIN_WAVES_PER_TRACK * longest
        if is_long and changed[first : last + 1].mean() > MIN_WORN_FRACTION:
            tracks.append((first, last))
    return sorted(tracks)


def _is_bridged(changed, first: int, last: int, width: int) -> bool:
    """Return whether a gap between two worn samples belongs to a track of a width [samples]."""
    gap = last - first
    is_short = gap <= max(MAX_GAP_FRACTION * width, MAX_CUT_SAMPLES)
    return is_short or (gap <= width and changed[first : last + 1].mean() > MIN_WORN_FRACTION)


class TrackEnds(NamedTuple):
    """Both ends of a track as `Quantity`, and whether the section ends at each of them."""

    start: Quantity
    end: Quantity
    is_cut: tuple


def find_ends(section: Section, span: tuple, free: tuple) -> TrackEnds:
    """Find both ends of a track.

    Parameters
    ----------
    section : Section
    span : tuple
        First and last sample that are worn.
    free : tuple
        First sample, and last sample + 1, without another track.
    """
    low, high = free
    part = slice(low, high)
    first = max(span[0], low) - low
    last = min(span[1], high - 1) - low
    flanks = find_flank_ends(
        section.depth[part],
        section.noise[part],
        section.correlation,
        first,
        last,
        draws=section.draws[:, part],
    )
    flanks = _reach_over_growth(section.depth[part] / section.noise[part], flanks, first, last)
    x = section.x[part]
    is_at_border = (low == 0, high == section.x.size)
    return TrackEnds(
        start=_locate_end(x, flanks[0], "from"),
        end=_locate_end(x[::-1], flanks[1], "to"),
        is_cut=tuple(
            border and flank.first < MAX_CUT_SAMPLES for border, flank in zip(is_at_border, flanks)
        ),
    )


def find_flank_ends(depth, noise, correlation: float, first: int, last: int, draws=None) -> tuple:
    """Find where both flanks of a track begin, as the `FlankEnd` of each, measured from outside.

    Parameters
    ----------
    depth, noise : (n,) array [m]
        Depth and its standard deviation.
    correlation : float
        Number of neighbouring depths whose errors are fully correlated.
    first, last : int
        Samples between which the track is known as worn.
    draws : (draws, n) array [m], optional
        Bootstrap errors of the depth; without them the intervals have no error of the level.
    """
    centre = (first + last) // 2
    sides = (
        (slice(0, centre + 1), 1, first),
        (slice(centre, None), -1, depth.size - 1 - last),
    )
    flanks = []
    for half, direction, worn in sides:
        outer_depth = depth[half][::direction]
        outer_noise = noise[half][::direction]
        flank = find_end(outer_depth, outer_noise, correlation, worn)
        if draws is not None:
            outer_draws = draws[:, half][:, ::direction]
            flank = _widen_by_level_error(
                flank, outer_depth, outer_noise, outer_draws, correlation, worn
            )
        flanks.append(flank)
    return tuple(flanks)


def _reach_over_growth(relative, flanks: tuple, first: int, last: int) -> tuple:
    """Lower the outer bounds of both ends to where the surface beside them begins to differ.

    This is done if the surface inside the track crosses the first one, as new roughness does: what stands
    above the first surface beside the track may then belong to it.

    Parameters
    ----------
    relative : (n,) array
        Depth in standard deviations.
    flanks : tuple of FlankEnd
        Both ends, each counted from outside.
    first, last : int
        Samples between which the track is known as worn.
    """
    smooth = median_of_five(relative)
    if not (smooth[first : last + 1] < -MAX_UNWORN).mean() > MIN_GROWN_FRACTION:
        return flanks
    agrees = np.abs(smooth) <= MAX_UNWORN
    out = []
    for flank, outside in zip(flanks, (agrees[:first], agrees[:last:-1])):
        runs = [end for start, end in find_runs(outside) if end - start >= MAX_CUT_SAMPLES]
        out.append(flank._replace(low=min(flank.low, runs[-1] if runs else 0)))
    return tuple(out)


def _locate_end(x, flank: FlankEnd, name: str) -> Quantity:
    """Return the position where a flank begins; x (n,) [m] is ordered from outside to inside."""
    # An end may be up to a sample outside of the section.
    samples = np.arange(-1, x.size + 1)
    positions = np.concatenate([[2 * x[0] - x[1]], x, [2 * x[-1] - x[-2]]])
    places = np.interp((flank.place, flank.low, flank.high), samples, positions)
    value, *bounds = places.tolist()
    return Quantity(value, min(bounds), max(bounds), "m", TEXTS[name])


def measure_track(section: Section, span: tuple, free: tuple) -> dict:
    """Measure a track: ends, width, depths, lost area and pile-up, each as a `Quantity`.

    Parameters
    ----------
    section : Section
    span : tuple
        First and last sample that are worn.
    free : tuple
        First sample, and last sample + 1, without another track.
    """
    start, end, is_cut = find_ends(section, span, free)
    x = section.x
    width = max(end.value - start.value, 1e-300)
    area, own_error = section.integrate((x > start.value) & (x < end.value))
    end_errors = [
        section.integrate((x >= place.low) & (x <= place.high))[0] / (2 * SIDE)
        for place in (start, end)
    ]
    area_error = float(np.sqrt(own_error**2 + end_errors[0] ** 2 + end_errors[1] ** 2))
    shorter = float(np.hypot(start.high - start.value, end.value - end.low))
    longer = float(np.hypot(start.value - start.low, end.high - end.value))
    width_error = max(shorter, longer) / SIDE
    depth = area / width
    depth_error = float(np.hypot(area_error / width, depth * width_error / width))
    third = np.abs(x - (start.value + end.value) / 2) <= width / 6
    step, step_error = section.integrate(third)
    third_length = max(float(section.widths[third].sum()), 1e-300)
    left = _measure_pile_up(section, (start.value - width, start.value), "pile_up_left")
    right = _measure_pile_up(section, (end.value, end.value + width), "pile_up_right")
    piled = left.value + right.value
    sides = [max(part.high - part.value, part.value - part.low) for part in (left, right)]
    piled_error = float(np.hypot(*sides)) / SIDE
    net_error = float(np.hypot(area_error, piled_error))
    values = {
        "from": start,
        "to": end,
        "width": Quantity(width, max(width - shorter, 0.0), width + longer, "m", TEXTS["width"]),
        "depth_mean": make_quantity(depth, depth_error, "m", TEXTS["depth_mean"], 0.0),
        "depth_floor": _measure_floor(section, start.value, width),
        "step": make_quantity(
            step / third_length, step_error / third_length, "m", TEXTS["step"], 0.0
        ),
        "area_net": make_quantity(area - piled, net_error, "m2", TEXTS["area_net"]),
        "area_gross": make_quantity(area, area_error, "m2", TEXTS["area_gross"], 0.0),
        "pile_up": make_quantity(piled, piled_error, "m2", TEXTS["pile_up"], 0.0),
        "pile_up_left": left,
        "pile_up_right": right,
    }
    return _mark_unknown_if_cut(values, x, is_cut) if any(is_cut) else values


def _mark_unknown_if_cut(values: dict, x, is_cut: tuple) -> dict:
    """Mark quantities as unknown or as lower bounds if the track extends beyond the section."""
    ends = [format_length(float(x[k]), 4) for k, is_end in zip((0, -1), is_cut) if is_end]
    reason = (
        "the track reaches the end of the common part of the traces at "
        f"{' and '.join(f'x = {end}' for end in ends)} and may be longer"
    )
    unknown = {"from": is_cut[0], "to": is_cut[1], "step": True, "area_net": True, "pile_up": True}
    unknown |= {"pile_up_left": is_cut[0], "pile_up_right": is_cut[1]}
    known = {
        name: make_unknown(size.unit, size.text, reason) if unknown.get(name) else size
        for name, size in values.items()
    }
    for name in ("width", "area_gross"):
        text = f"{known[name].text}, at least: {reason}"
        known[name] = known[name]._replace(high=None, text=text)
    for name in ("depth_mean", "depth_floor"):
        text = f"{known[name].text}, of the part that the traces show"
        known[name] = known[name]._replace(text=text)
    return known


def _measure_pile_up(section: Section, span: tuple, name: str) -> Quantity:
    """Measure the area above the first surface beside a track, between two positions [m]."""
    near = np.flatnonzero((section.x > span[0]) & (section.x < span[1]))
    inward = near if name == "pile_up_left" else near[::-1]
    outer_edge = None
    if near.size > 8:
        height = -section.depth[inward]
        noise = section.noise[inward]
        is_high = median_of_five(height / noise) > noise_threshold(section.x.size)
        if is_high.any():
            first = int(np.argmax(is_high))
            outer_edge = find_end(height, noise, section.correlation, first).first
    inside = np.zeros(section.x.size, bool)
    inside[inward[0 if outer_edge is None else outer_edge :]] = True
    area, error = section.integrate(inside)
    if outer_edge is None or area >= 0:
        return Quantity(0.0, 0.0, max(-area, 0.0) + SIDE * error, "m2", TEXTS[name])
    return make_quantity(-area, error, "m2", TEXTS[name], 0.0)


def _measure_floor(section: Section, start: float, width: float) -> Quantity:
    """Measure the floor of a track: largest depth of the parabola through the deepest fifth of the width.

    All fifths whose mean depth differs from the largest one by noise alone count, and their floors
    are averaged. The interval is that of the same parabolas through the drawn errors, together with
    the roughness of the floor.

    Parameters
    ----------
    section : Section
    start, width : float
        Beginning and width of the track [m].
    """
    x = section.x
    noise = float(np.median(section.noise))
    text = TEXTS["depth_floor"]
    starts = np.linspace(start, start + (1 - 1 / N_FIFTHS) * width, 8 * N_FIFTHS)
    parts = [np.flatnonzero((x >= place) & (x <= place + width / N_FIFTHS)) for place in starts]
    parts = [part for part in parts if part.size > 3]
    if not parts:
        inside = (x >= start) & (x <= start + width)
        return make_quantity(float(section.depth[inside].max(initial=0.0)), noise, "m", text, 0.0)
    means = np.array([float(section.depth[part].mean()) for part in parts])
    lowest = means.max() - 2 * noise * np.sqrt(section.correlation / parts[0].size)
    deepest = [part for part, mean in zip(parts, means) if mean >= lowest]
    floors = [_fit_vertex(section.depth[part]) for part in deepest]
    drawn = [section.draws[:, part] @ floor.weights for part, floor in zip(deepest, floors)]
    error = float(np.var(np.mean(drawn, axis=0)))
    scatter = float(np.mean([floor.scatter for floor in floors]))
    roughness = max(scatter**2 - noise**2, 0.0)
    # A parabola through n independent values has at most 9 / n times their
    # variance, which occurs at its ends.
    correlated = min(9.0 * section.correlation / deepest[0].size, 1.0)
    value = float(np.mean([floor.depth for floor in floors]))
    return make_quantity(value, float(np.sqrt(error + roughness * correlated)), "m", text, 0.0)


class _Vertex(NamedTuple):
    """Largest depth of a parabola through values (n,), the weights (n,) of these, and their scatter."""

    depth: float
    weights: np.ndarray
    scatter: float


def _fit_vertex(values) -> _Vertex:
    """Fit a parabola to values (n,), and find its largest depth within them."""
    base = np.vander(np.linspace(-1, 1, values.size), 3)
    inverse = np.linalg.pinv(base)
    shape = inverse @ values
    peak = float(np.clip(-shape[1] / (2 * shape[0]), -1, 1)) if shape[0] < 0 else 0.0
    row = np.array([peak**2, peak, 1.0])
    return _Vertex(float(row @ shape), row @ inverse, float(np.std(values - base @ shape)))
