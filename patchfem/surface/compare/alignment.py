"""Alignment of a second trace on a first one: its model, the floor that did not wear, and the errors of the depth."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...core import PatchfemError, frozen_array
from ..profile import Profile, runs_of
from .boxes import N_PARTS, make_boxes, part_means, split_edges
from .errors import DrawnErrors, correlation_length, draw_errors, noise_along
from .model import BENT, DATUM, MIN_HEIGHTS, RIGID, STRAIGHT, Parameter, TraceModel
from .robust import MIN_UNWORN, REACH, find_floors, fit_biweight, solve_weighted
from .section import find_end, sure_of

MAX_LOUDER = 1.5  # scale of a floor over that of the quietest one, beyond which it is no floor
BEND_GAIN = 0.8  # scale with / without a bend, below which the bend is subtracted
MIN_FILLED = 0.7  # fraction of unworn heights in an unworn end
LONG_END = 0.05  # fraction of the length of a flank that tells a scar from a bent datum
SHORT_END = 0.02  # fraction of the length of a flank that makes a scar possible
FLANK_PARTS = 6  # parts of the trace on either side of a shallow track
MIN_PARTS = 3  # parts of a shallow track
DATUM_DEGREE = 3  # degree of the polynomial that a datum may add to shallow depths
# threshold in standard deviations for the step of a shallow track; 2 % of random walks exceed it
CLEAR_STEP = 8.0
MAX_COUNTED = 4.0  # standard deviations beyond which a height counts no further in a mean
N_THINNED = 2000  # samples that the starts of a fit are refined on
NEIGHBOURS = (4, 16)  # samples of the means that show wear below the noise of a height
MIN_FOOT = 64  # samples of a worn run whose flanks may leave the floor slowly
# width beside a worn run, in which slight wear may be taken for a drift / width of the run
MARGIN = 0.2
MAX_ROUNDS = 4  # fits in which the worn parts settle
MARGIN_SAMPLES = 8  # samples of that margin, at least


@dataclass(frozen=True, eq=False)
class Alignment:
    """How a second trace lies on a first one.

    Attributes
    ----------
    x, first, depth : (n,) array [m]
        Samples of the second trace on the first one, height of the first there, depth below it.
    unworn : (n,) bool array
        Heights that the floor was fitted to.
    jacobian : (n, k) array
        Of the depth by the fitted parameters.
    state : (5,) array
        See `model.Parameter`; the slope is a height at the end of the trace.
    free : tuple
        Parameters that were fitted.
    half, middle : float
        Half of the length [m] that slope and bend refer to, and the place [m] in the second trace where
        they are zero.
    noise, least : float
        Standard deviation [m] of the unworn depths, and rounding.
    clear : (n,) bool array
        Unworn heights away from the worn ones, which show the drift of the datum.
    rival : Alignment or None
        Another floor that the traces lie on as well.
    is_straight : bool
        Whether the datum was declared straight.
    """

    x: np.ndarray
    first: np.ndarray
    depth: np.ndarray
    unworn: np.ndarray
    jacobian: np.ndarray
    state: np.ndarray
    free: tuple
    half: float
    middle: float
    noise: float
    least: float
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
        """Length of the second trace over that of the first for the same surface, less one."""
        return float(self.state[Parameter.STRETCH])

    @property
    def bend(self) -> float:
        """Sag [m] of the second datum over the common length that was taken out."""
        return float(self.state[Parameter.BEND]) * (np.ptp(self.x) / 2 / self.half) ** 2

    @cached_property
    def noise_at(self) -> np.ndarray:
        """Standard deviation (n,) [m] of each depth."""
        z = np.pad(self.first, 3, "edge")
        curvature = z[3:-3] - (9 * (z[2:-4] + z[4:-2]) - z[:-6] - z[6:]) / 16
        curvature = np.maximum.reduce([np.abs(np.roll(curvature, k)) for k in (-1, 0, 1)])
        slope = np.abs(np.gradient(self.first, self.x))
        return noise_along(self.depth, self.unworn, slope, curvature, self.least)

    @cached_property
    def errors(self) -> DrawnErrors:
        """Predicted drift of the datum, with bootstrap errors of the corrected depth and of the parameters."""
        degree = 2 if Parameter.BEND in self.free else 1
        return draw_errors(
            self.depth, self.noise_at, self.unworn, self.clear, self.jacobian, degree
        )

    @property
    def worn_depth(self) -> np.ndarray:
        """Depth (n,) [m] without the drift of the datum."""
        return self.depth - self.errors.drift

    @property
    def agreed(self) -> float:
        """Fraction of the heights that agree in both traces, on this floor or on the other one."""
        other = self if self.rival is None else self.rival
        return float(max(self.unworn.mean(), other.unworn.mean()))

    @property
    def visible(self) -> float | None:
        """Mean depth [m] from which a track over the middle third would have been found, None for short traces."""
        least = find_shallow_track(np.asarray(self.depth), self.noise)[1]
        return least if np.isfinite(least) else None

    def error_of(self, parameter: Parameter) -> float:
        """Standard deviation of a fitted parameter, NaN where it was not fitted."""
        if parameter not in self.free:
            return float("nan")
        return float(self.errors.parameters[:, self.free.index(parameter)].std())

    def back(self, place: float) -> float:
        """Place [m] in the first trace of a place [m] in the second one."""
        return self.middle + (place - self.middle) / (1 + self.stretch) - self.shift

    def unworn_ends(self, share: float = LONG_END) -> tuple:
        """Whether the first and the last part of the traces are unworn."""
        count = max(int(share * self.x.size), min(40, self.x.size // 4))
        return tuple(
            bool(self.unworn[part].mean() > MIN_FILLED)
            for part in (slice(count), slice(-count, None))
        )


def align(before: Profile, after: Profile, shift: float, is_straight: bool = False) -> Alignment:
    """Align the second trace on the unworn heights of the first one.

    The quietest floors are found from elemental subsets of blocks, without and, unless the datum is
    declared straight, with a bend. Of equally quiet floors the one is taken below which heights are
    missing; one that no end of the traces lies on is the last choice. A bend is taken out where the
    scale falls by a fifth. Where the line through both ends is as quiet and all heights between them
    are missing, it is the floor of a wide scar: taken if both ends are long, a rival if they are short.

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
        If too few heights lie on the first trace.
    """
    model = TraceModel(before, after, shift)
    thin = model.thinned(N_THINNED)
    found = _choose(find_floors(thin, model.start(shift), list(STRAIGHT), [0, 1]), thin)
    if found is None:
        raise PatchfemError(f"{after.source}: no heights of this trace agree with {before.source}")
    model.smooth_slope(found.scale)
    thin.slope = model.slope
    best = _complete(model, found.state, STRAIGHT)
    if is_straight:
        return replace(_of_straight_datum(model, best), is_straight=True)
    bent = _choose(find_floors(thin, best.state * [1, 1, 1, 1, 0], list(BENT), [0, 1, 4]), thin)
    if bent is not None and bent.scale < BEND_GAIN * max(best.noise, model.least):
        curved = _complete(model, bent.state, BENT)
        if curved.noise < BEND_GAIN * best.noise:
            best = curved
    return _with_flanks(model, best)


def _choose(floors: list, model):
    """Choose the floor that is unworn: quiet, with an unworn end, little above it, many heights on it."""
    known = [floor for floor in floors if floor.unworn >= MIN_UNWORN] or floors
    if not known:
        return None
    quietest = min(floor.scale for floor in known)
    quiet = [floor for floor in known if floor.scale <= MAX_LOUDER * quietest]

    def rank(floor) -> tuple:
        depth, _ = model.linearize(floor.state)
        count = max(int(LONG_END * depth.size), 4)
        on = np.abs(depth) <= REACH * floor.scale
        has_end = max(on[:count].mean(), on[-count:].mean()) > MIN_FILLED
        return not has_end, round(floor.grown, 1), -floor.unworn

    return min(quiet, key=rank)


def _complete(model, state, free) -> Alignment:
    """Fit the chosen floor to all heights; worn parts, shallow ones too, are left out.

    The feet of the worn parts are sought on the floor that is fitted without these parts.
    """
    model = model.cut(state)
    worn = None
    for has_feet in (False, True):
        for _ in range(MAX_ROUNDS):
            fit = fit_biweight(model, state, list(free), worn)
            state = fit.state
            depth, _ = model.linearize(state)
            new = find_worn(depth, fit.scale)
            if has_feet:
                new = with_feet(depth, fit.scale, new)
            if (~new).sum() < MIN_HEIGHTS or (worn is not None and (new == worn).all()):
                break
            worn = new
    worn = np.zeros(depth.size, bool) if worn is None else worn
    return _record(model, state, free, fit.scale, worn)


def _record(model, state, free, scale: float, worn) -> Alignment:
    """Record the alignment that a state stands for, with the heights that show the drift of the datum."""
    depth, jacobian = model.linearize(state)
    unworn = (np.abs(depth) <= REACH * scale) & ~worn
    clear = unworn.copy()
    for first, last in runs_of(worn):
        margin = max(MARGIN_SAMPLES, int(MARGIN * (last - first)))
        clear[max(first - margin, 0) : last + margin + 1] = False
    if clear.sum() < unworn.sum() / 2:
        clear = unworn
    return Alignment(
        x=frozen_array(model.x),
        first=frozen_array(model.spline(model.places(state))),
        depth=frozen_array(depth),
        unworn=unworn,
        jacobian=frozen_array(jacobian[:, list(free)]),
        state=frozen_array(state),
        free=tuple(free),
        half=model.half,
        middle=model.middle,
        noise=scale,
        least=model.least,
        clear=clear,
    )


def find_worn(depth, scale: float) -> np.ndarray:
    """Find heights (n,) that are worn, by their own depth or by the mean of their neighbours.

    Means of 4 and 16 samples count with their correlation; parts of a sixtieth of the trace count
    where a box of them stands out from a cubic datum.
    """
    quiet = np.abs(depth) <= REACH * scale
    alike = correlation_length(depth, quiet, depth.size // N_PARTS)
    sure = sure_of(depth.size)
    worn = depth > sure * scale
    for many in NEIGHBOURS:
        if many > depth.size // 10:
            break
        mean = np.convolve(np.clip(depth, -4 * scale, 4 * scale), np.full(many, 1 / many), "same")
        deep = mean > sure * scale * np.sqrt(alike / many)
        worn |= np.convolve(deep, np.ones(many), "same") > 0.5
    track, _ = find_shallow_track(depth, scale)
    if track is not None:
        worn[track[0] : track[1] + 1] = True
    return np.convolve(worn, np.ones(3), "same") > 0.5  # the wear runs out in the neighbours


def with_feet(depth, scale: float, worn) -> np.ndarray:
    """Widen worn runs (n,) to where their flanks leave the floor, which single heights do not show."""
    out = worn.copy()
    noise = np.full(depth.size, scale)
    quiet = ~worn & (np.abs(depth) <= REACH * scale)
    alike = correlation_length(depth, quiet, depth.size // N_PARTS)
    for first, last in runs_of(worn):
        if last - first < MIN_FOOT:
            continue
        centre = (first + last) // 2
        low = find_end(depth[: centre + 1], noise[: centre + 1], alike, first)[0]
        high = find_end(depth[centre:][::-1], noise[centre:], alike, depth.size - 1 - last)[0]
        out[low:first] = True
        out[last : depth.size - high] = True
    return out


def find_shallow_track(depth, scale: float) -> tuple:
    """Find a track that is shallower than the noise of a height by the means of 60 parts.

    Every box, from one part to another, is fitted together with a cubic, which is what a datum may
    add. The best box is a track where its height is eight times its standard deviation; this deviation
    comes from the residuals of the fit and their correlation, so that slow drift is no track
    (generalized likelihood ratio test).

    Returns
    -------
    run : tuple of first and last sample, or None
    threshold : float
        Mean depth [m] from which a track over the middle third would have been found, inf where
        too few heights are known.
    """
    if depth.size < 8 * N_PARTS:
        return None, np.inf
    edges = split_edges(depth.size, N_PARTS)
    means = part_means(np.clip(depth, -MAX_COUNTED * scale, MAX_COUNTED * scale), edges)
    boxes = make_boxes(N_PARTS, FLANK_PARTS, MIN_PARTS, DATUM_DEGREE)
    means = means - boxes.datum @ (boxes.datum.T @ means)
    heights = boxes.shapes @ means
    best = int(np.argmax(heights))
    left = means - heights[best] * boxes.shapes[best]
    freedom = N_PARTS - DATUM_DEGREE - 4
    correlation = correlation_length(left, np.ones(N_PARTS, bool))
    spread = float(np.sqrt(left @ left / freedom * correlation))
    spread = max(spread, 1e-3 * scale)
    third = boxes.spans.index((N_PARTS // 3, N_PARTS - N_PARTS // 3))
    threshold = CLEAR_STEP * spread / float(boxes.sizes[third])
    if heights[best] <= CLEAR_STEP * spread:
        return None, threshold
    first, last = boxes.spans[best]
    return (int(edges[first]), int(edges[last]) - 1), threshold


def _line_through_ends(
    model, best: Alignment, state, free: tuple, share: float
) -> Alignment | None:
    """Fit a line through both ends of the trace if they are unworn and material is lost between them."""
    model = model.cut(state)
    count = model.x.size
    many = max(int(share * count), min(40, count // 4))
    ends = np.minimum(np.arange(count), np.arange(count)[::-1]) < many
    for _ in range(8):
        depth, jacobian = model.linearize(state)
        step = solve_weighted(jacobian[ends][:, free], depth[ends], np.ones(ends.sum()))
        state = state.copy()
        state[list(free)] += model.limit(step, free)
    depth, _ = model.linearize(state)
    scale = float(np.std(depth[ends]))
    if scale > 1.3 * best.noise or not _are_straight(depth, ends):
        return None
    between = depth[~ends]
    if not between.mean() > REACH * scale or (between < -2 * REACH * scale).mean() > 0.01:
        return None
    worn = ~ends & (depth > REACH * scale)
    for _ in range(3):
        state, scale = fit_biweight(model, state, list(STRAIGHT), worn, rounds=20)
        depth, _ = model.linearize(state)
        worn = with_feet(depth, scale, find_worn(depth, scale))
    found = _record(model, state, STRAIGHT, scale, worn)
    return found if found.unworn[ends].mean() >= MIN_FILLED else None


def _are_straight(depth, ends) -> bool:
    """Whether both ends lie on a common line within their noise and its correlation."""
    for part in np.split(np.flatnonzero(ends), 2):
        rest = depth[part]
        base = np.linalg.qr(np.vander(np.linspace(-1, 1, part.size), 3, True))[0]
        own = base.T @ rest
        left = rest - base @ own
        alike = correlation_length(left, np.ones(part.size, bool))
        # chi-squared with three degrees of freedom
        if own @ own > 30.0 * alike * float(np.mean(left**2)):
            return False
    return True


def _with_flanks(model, best: Alignment) -> Alignment:
    """The alignment, or the line through both ends, where a wide scar explains the traces as well."""
    count = max(int(0.005 * best.depth.size), 12)
    ends = [
        float(np.median(best.depth[part])) / best.noise
        for part in (slice(count), slice(-count, None))
    ]
    has_bow = best.bend > 0 and min(ends) > 1
    if not has_bow and min(ends) >= -REACH:
        return best
    state = np.array(best.state)
    state[Parameter.BEND] = 0.0
    line = _line_through_ends(model, best, state, DATUM, LONG_END)
    if line is not None:
        return replace(line, rival=best)
    line = _line_through_ends(model, best, state, DATUM, SHORT_END)
    return best if line is None else replace(best, rival=line)


def _of_straight_datum(model, best: Alignment) -> Alignment:
    """Alignment under a straight datum: short flanks that lie on a common line count as unworn."""
    line = _line_through_ends(model, best, model.start(model.guess), RIGID, SHORT_END)
    if line is None:
        return best
    is_quieter = MAX_LOUDER * line.noise < best.noise
    return replace(line, rival=best) if is_quieter or not all(best.unworn_ends()) else best
