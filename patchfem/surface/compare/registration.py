"""Registration of two traces of the same place: shift, tilt and offset from the heights that no wear has moved.

The second trace is z_b(x - shift) - w(x) + offset + slope x + noise with a worn depth w >= 0 that is zero in the
valleys. Only heights within the noise of w = 0 enter the fit; a least-squares line through all of them would take the
mean of the worn depth away with the tilt.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array
from ..profile import Profile, even, level
from ..roughness.levelling import one_sided_line

REACH = 2.5  # standard deviations of the noise within which a height counts as unworn
TRIMMED = 1.10  # variance of a fit to normal noise cut off at REACH, over that of least squares
KEPT = 0.911  # share of the variance that normal noise cut off at REACH has
LOWEST = 1 / 3  # share of the first trace, its lowest heights, that the fit starts from
FEWEST = 12  # unworn heights
BESIDE = 1  # samples next to a worn one that do not count: the wear runs out in them
NOISY, MOST = 0.05, 51  # share of noise in a slope, and samples of a parabola
WIDER = 1.15  # the interval of the stretch, without it, holds 92 of 100
BENT, GROWN = 0.8, 0.5  # of the noise that a bend, or heights that grew, must leave at most to be taken
ALL = 0.8  # of the differences, at most, that one factor of the heights leaves
SIDES = 20  # parts of the trace whose low depths show a bend
ROUNDS, EIGHTHS = 100, 8
PARTS = 60  # of the trace, whose means show its slow differences
OUTERMOST = 0.005  # share of the length at an end that is looked at for wear or growth
ENDS = 0.05, 0.02  # share of the length of a flank that tells two readings apart, and of one that is too short for that
LEAST, BOTH = 40, 16  # samples of a flank, and of a mean that shows the foot of a scar
NOISIER, COLLINEAR = 1.3, 30.0  # noise of one reading over that of the other, and chi-squared of an end off its line
STEEPER = 1.2  # depth of the outer half of a straight end that leaves a bow, over that of its inner half
FILLED, FEW = 0.7, 0.01  # share of unworn heights in a flank, and of heights between the flanks that stand above them
DIGITS = 1e-5  # of the height: least noise that is counted with
LEVELS, EACH, TAILS, QUIETEST = 8, 64, 4.0, 0.3  # levels of roughness, heights of one, its deviations, least of noise


class Rival(NamedTuple):
    """found: the other `Registration`; told_apart: whether the flanks show that it is the less likely one."""

    found: "Registration"
    told_apart: bool


@dataclass(frozen=True, eq=False)
class Registration:
    """How a second trace lies on a first one.

    shift [m]: a place at x of the first stands at x + shift of the second; slope [rad] and offset [m] (at the middle
    of the common part) of the second against the first; noise [m] of a height difference; x (n,) [m]: samples of the
    second that lie on the first; first (n,) [m]: the first trace there; rest (n,) [m]: depth of the second below the
    first, moved by slope and offset: worn depth plus noise; used (n,): the unworn heights of the fit; gradient (n, 3)
    of rest by offset, slope and shift, (n, 4) or (n, 5) where stretch and bend were fitted too; covariance of these;
    stretch: length of the second over that of the first, less one, its standard deviation, and whether it was taken out
    of rest; doubt: change of offset, slope and shift where the deeper half of the unworn heights alone makes the fit,
    as slight wear of the higher half would bring it about; bend [m]: sag of the second against the first in the middle
    of the trace that was taken out, 0 where none was; track: first and last sample of a track that is shallower than
    the noise, each with the lowest and highest likely (`shallow`), None without one; rival: another registration that
    explains the traces too (`_with_flanks`), None without one; declared: whether the datum was declared straight, so
    that shorter flanks carry the registration.
    """

    shift: float
    slope: float
    offset: float
    noise: float
    x: np.ndarray
    first: np.ndarray
    rest: np.ndarray
    used: np.ndarray
    gradient: np.ndarray
    covariance: np.ndarray
    stretch: tuple
    doubt: np.ndarray
    bend: float = 0.0
    track: tuple | None = None
    rival: "Rival | None" = None
    declared: bool = False

    @property
    def errors(self) -> tuple:
        """Standard deviations of offset [m], slope [rad] and shift [m], with what the deeper half doubts."""
        return tuple(self.error(row) for row in np.eye(self.doubt.size)[:3])

    def error(self, pull: np.ndarray) -> float:
        """Standard deviation of pull @ (offset, slope, shift): that of the noise, and a doubt beyond twice as much."""
        noise = float(pull @ self.covariance @ pull)
        return float(np.sqrt(noise + max((pull @ self.doubt) ** 2 - 4 * noise, 0.0)))

    @property
    def agreed(self) -> float:
        """Share of the heights that agree in both traces, in one reading of them or in the other."""
        return float(max(one.used.mean() for one in (self, self.rival.found if self.rival else self)))

    @cached_property
    def loudest(self) -> float:
        """Largest noise [m] of an eighth of the unworn heights: what ends there must stand out from it.

        Digits of a file are coarser where its heights are larger, as along a tilt.
        """
        parts = np.array_split(np.asarray(self.rest)[self.used], EIGHTHS)
        return max(self.noise, *(float(np.sqrt(np.mean(one**2) / KEPT)) for one in parts if one.size >= EACH), 0.0)

    @property
    def middle(self) -> float:
        """Place [m] in the second trace at which the offset holds."""
        return float(self.x[0] + self.x[-1]) / 2

    @cached_property
    def scatter(self) -> np.ndarray:
        """Standard deviation (n,) [m] of each depth: noise, interpolation between samples, shift times slope.

        Interpolation errs where a height lies off the cubic through its neighbours, a shift where the trace is steep:
        the deviations are those of the depths of equal misfit, times those of equal slope.
        """
        z, rest = np.pad(self.first, 3, "edge"), np.asarray(self.rest)
        off = np.abs(z[3:-3] - (9 * (z[2:-4] + z[4:-2]) - z[:-6] - z[6:]) / 16)
        off = np.maximum(off, np.maximum(np.roll(off, 1), np.roll(off, -1)))
        out = _deviations(rest, off, QUIETEST * self.noise)
        return out * _deviations(rest / out, np.abs(self.gradient[:, 2]), QUIETEST)


def register(before: Profile, after: Profile, shift: float, lowest: float = LOWEST, bow: bool = True) -> Registration:
    """Register `after` on `before` from a first guess of the shift [m], right within a quarter of a wave (`place`).

    Between its samples the first trace is a cubic spline. The fit starts from the one-sided line over the lowest
    heights of the first trace, a share `lowest` of them: wear spares valleys, unless a track is deeper than they are.
    The noise is 1.4826 times the median of the depths below zero, which no wear makes; heights within 2.5 of it make
    the next offset, slope and shift, until they stay the same; the first rounds count with the noise of half a step of
    shift, halved from round to round. Slopes come from parabolas as long as the noise wants. A second fit lets the
    second trace be longer or shorter by a factor; where that halves the noise, the heights are compared with the factor
    taken out. A third one lets it be bent, from the parabola that most low depths lie on; where that takes a fifth of
    the noise away, the bend is taken out, unless bow is False. All of it is tried with heights that grew, too,
    and taken where that halves the noise, or where else both ends were worn and the middle not. What lies in a gap of
    the first trace does not count.
    PatchfemError where fewer than 12 heights are unworn.
    """
    fit = _Fit(before, after, shift)
    state, used = fit.start(shift, lowest)
    first = _settled(fit, state, used, 4)
    if first is not None:
        fit.smooth_slope(fit.noise(first))
    best = _straight(fit, *fit.start(shift, lowest))
    for side, bent, better in ((-1, False, GROWN), (1, True, BENT), (-1, True, GROWN)):
        if bent and not bow:
            continue
        fit.side = side
        start = fit.start(shift, lowest, bent)
        other = _bent(fit, *start) if bent else _straight(fit, *start)
        other = _as_given(fit, other, bent) if other is not None and side < 0 else other
        if other is not None and (best is None or other.noise < better * best.noise or _inside_out(best, other)):
            best = other
    if best is None:
        raise PatchfemError(f"{after.source}: fewer than {FEWEST} heights of this trace lie on the valleys of "
                            f"{before.source}, so there is no common reference")
    if not bow:
        fit.side = 1
        starts = (_bent(fit, *fit.start(shift, share, True)) for share in (lowest, 1.0))
        near = min((one for one in (best, *starts) if one is not None), key=lambda one: one.noise)
        return replace(_declared(fit, best, near), declared=True)
    return _with_flanks(fit, best)


def _declared(fit, best: Registration, near: Registration) -> Registration:
    """The registration where the datum is straight: short flanks on one line are unworn then, where most of the trace
    is no unworn floor beside flanks that grew. near: a bent fit where it is quieter, as a scar spoils neither its noise
    nor its shift."""
    if all(unworn_ends(best)) and not _ends_off(best) and best.noise < NOISIER * near.noise:
        return best
    line = _line_of_ends(fit, near, ENDS[1])
    if line is None or not _is_straight(line, ENDS[1]):
        return replace(best, rival=Rival(_chord(fit, best), False)) if _ends_off(best) else best
    clear = best.noise > NOISIER * line.noise
    return replace(line, rival=Rival(best, True)) if clear else replace(best, rival=Rival(line, False))


def _with_flanks(fit, best: Registration) -> Registration:
    """The registration with its rival, the line through both ends, where its own ends are worn or grew.

    A bow and a scar over most of the trace look alike but for the flanks of the scar: these lie on one straight line,
    and a bow would have to wear them off to just that line. A floor of most heights and its flanks look like flanks
    that grew. Flanks of a twentieth of the length each, straight and on one line within the noise, tell both apart.
    Shorter ones do not: the registration stays, with the line as its rival; with the line through both ends where a bow
    leaves wear at both of them, or an end grew: a wedge and the flank behind its deep end look like a tilt and growth.
    """
    if best.bend < 0 or (all(unworn_ends(best)) and not _ends_off(best)):
        return best
    line = _line_of_ends(fit, best, ENDS[0])
    if line is not None and _is_straight(line, ENDS[0]):
        return replace(line, rival=Rival(best, True))
    kinks = _kinks(best) if best.bend else 0
    if best.bend == 0 or kinks:
        line = _line_of_ends(fit, best, ENDS[1])
        if line is not None and _is_straight(line, ENDS[1]):
            return replace(best, rival=Rival(line, False))
    if kinks == 2 or _ends_off(best):
        return replace(best, rival=Rival(_chord(fit, best), False))
    return best



def slow_of(rest, used=None) -> np.ndarray:
    """Means (k,) [m] of depths (n,), or of the used ones of them, in `PARTS` parts, about the line through the means;
    parts without three such depths are left out."""
    edges = np.linspace(0, rest.size, PARTS + 1).astype(int)[:-1]
    used = np.ones(rest.size, bool) if used is None else used
    count = np.add.reduceat(used.astype(float), edges)
    means = (np.add.reduceat(np.where(used, rest, 0.0), edges) / np.maximum(count, 1))[count > 2]
    at = np.flatnonzero(count > 2)
    return means - np.polyval(np.polyfit(at, means, 1), at) if at.size > 2 else np.zeros(at.size)


def _ends_off(best: Registration) -> bool:
    """Whether a bow leaves both outermost ends worn, or either end stands above the first trace."""
    rest = np.asarray(best.rest)
    count = max(int(OUTERMOST * rest.size), min(FEWEST, rest.size))
    ends = [float(np.median(part)) / best.noise for part in (rest[:count], rest[-count:])]
    return (best.bend > 0 and min(ends) > 1) or min(ends) < -REACH


def _chord(fit, bent: Registration) -> Registration:
    """The line through both ends, whatever lies between: a scar beside flanks of a bent datum has no other."""
    fit.side = 1
    state = np.array([0.0, 0.0, bent.shift, bent.stretch[0] if bent.stretch[2] else 0.0, 0.0])
    seen = fit.rest(state)
    used = _ends_of(seen[0].size, ENDS[1])
    return fit.found(fit.improved(state, seen, used, 2), bent.stretch, used=used)


def _line_of_ends(fit, best: Registration, share: float) -> Registration | None:
    """The fit that starts from a share of the length at each end, with the stretch and the noise of another fit; None
    where worn heights do not lie between the ends."""
    fit.side, noise = 1, max(best.noise, fit.least)
    state = np.array([0.0, 0.0, best.shift, best.stretch[0] if best.stretch[2] else 0.0, 0.0])
    for turn in range(ROUNDS):
        seen = fit.rest(state)
        used = _ends_of(seen[0].size, share) if turn < 4 else _flat(seen[0], noise)
        if used.sum() < FEWEST:
            return None
        new = fit.improved(state, seen, used, 2 if turn < 2 else 3)
        small, state = np.abs(new - state) <= 1e-9 * fit.scales, new
        if turn > 4 and small.all():
            break
    line = fit.found(state, best.stretch, used=_flat(fit.rest(state)[0], noise))
    between = np.asarray(line.rest)[~_ends_of(line.rest.size, share)]
    worn = between.mean() > REACH * noise and (between < -2 * REACH * noise).mean() < FEW
    return line if worn and line.noise < NOISIER * noise else None


def _flat(rest, noise: float) -> np.ndarray:
    """Unworn heights (n,) without the feet of a scar, where means of `BOTH` neighbours stand out but single heights do
    not: three standard deviations of such a mean."""
    worn = np.convolve(rest, np.full(BOTH, 1 / BOTH), "same") > 3 * noise / np.sqrt(BOTH)
    return (np.abs(rest) <= REACH * noise) & ~(np.convolve(worn, np.ones(BOTH), "same") > 0.5)


def _ends_of(count: int, share: float) -> np.ndarray:
    """Samples (count,) of a share of them at each end."""
    many, at = max(int(share * count), min(LEAST, count // 4)), np.arange(count)
    return (at < many) | (at >= count - many)


def _is_straight(line: Registration, share: float) -> bool:
    """Whether both ends are unworn and lie on one line: own lines and bows of theirs leave hardly less."""
    for part in np.split(np.flatnonzero(_ends_of(line.rest.size, share)), 2):
        rest, every = np.asarray(line.rest)[part], np.ones(part.size, bool)
        base = np.linalg.qr(np.vander(np.linspace(-1, 1, part.size), 3, True))[0]
        own = base.T @ rest
        left = rest - base @ own
        if line.used[part].mean() < FILLED or own @ own > COLLINEAR * together(left, every) * float(np.mean(left**2)):
            return False
    return True


def _kinks(bent: Registration) -> int:
    """How many straight ends leave a bow: worn the more the nearer to the end, straight once the bow is put back."""
    along, count = np.linspace(-1, 1, bent.rest.size), 0
    for side in (1, -1):
        rest, put_back = np.asarray(bent.rest)[::side], (np.asarray(bent.rest) - bent.bend * along**2)[::side]
        first = int(np.argmax(np.convolve(bent.used[::side], np.ones(LEAST), "valid") > FILLED * LEAST))
        if first < FEWEST or not rest[:first // 2].mean() > STEEPER * rest[first // 2:first].mean() > 0:
            continue
        x = np.arange(first)
        off = put_back[:first] - np.polyval(np.polyfit(x, put_back[:first], 1), x)
        count += bool(np.median(np.abs(off)) * 1.4826 < NOISIER * bent.noise)
    return count


def _as_given(fit, grown: Registration, bent: bool) -> Registration:
    """The fit to the heights that stand above the first trace in another one, where they are as quiet and hold an end
    of the traces: the others are worn then, and nothing grew. Else the fit in which they grew."""
    high = np.asarray(grown.rest) < -2 * REACH * grown.noise
    if high.sum() < FEWEST:
        return grown
    fit.side, state = 1, fit.improved(fit.state, fit.rest(fit.state), high, 2)
    worn = (_bent if bent else _straight)(fit, state, high)
    if worn is not None and worn.noise < 1.5 * grown.noise and worn.used.mean() > 0.15 and any(unworn_ends(worn)):
        return worn
    return grown


def _inside_out(one: Registration, other: Registration) -> bool:
    """Whether no end of the traces is unworn in one registration, and both are in the other, with more heights.

    A trace between whose worn ends the middle is unworn is likelier one whose middle grew, or the files are exchanged.
    """
    if other.bend or other.noise > 1.5 * one.noise or other.used.mean() < one.used.mean():
        return False
    return not any(unworn_ends(one)) and all(unworn_ends(other))


def unworn_ends(found: Registration) -> tuple:
    """Whether the first and the last twentieth of a registration are unworn."""
    count = max(found.rest.size // 20, min(40, found.rest.size))
    return tuple(bool(found.used[part].mean() > FILLED) for part in (slice(None, count), slice(-count, None)))


def _straight(fit, state, used) -> Registration | None:
    """The fit without a bend, with the stretch where that halves the noise; None where too few heights are unworn."""
    free, held = (_settled(fit, state, used, count) for count in (4, 3))
    if free is None:
        return None if held is None else fit.found(held, (float("nan"), float("nan"), False))
    error = WIDER * fit.found(free, (0.0, 0.0, False), 4).covariance[3, 3] ** 0.5
    out = held is None or fit.noise(free) < 0.5 * fit.noise(held)
    return fit.found(free if out else held, (float(free[3]), float(error), bool(out)), 4 if out else 3)


def _bent(fit, state, used) -> Registration | None:
    """The fit with stretch and bend; None where too few heights are unworn."""
    bent = _settled(fit, state, used, 5)
    if bent is None:
        return None
    error = WIDER * fit.found(bent, (0.0, 0.0, False), 5).covariance[3, 3] ** 0.5
    return fit.found(bent, (float(bent[3]), float(error), True), 5)


def _settled(fit, state, used, free: int):
    """State of the fit of the first `free` numbers once its unworn heights stay the same, None where too few are."""
    for turn in range(ROUNDS):
        seen, least = fit.rest(state), max(fit.least, fit.blur * 0.5**turn)
        noise, now = _unworn(fit.side * seen[0], least)
        if now.sum() < FEWEST:
            return None
        same = used.size == now.size and bool((used == now).all())
        new, used = fit.improved(state, seen, now, free), now
        small = np.abs(new - state) <= 1e-9 * fit.scales
        state = new
        if same and small.all() and (noise > least or least == fit.least):
            break
    return state


def _unworn(rest, least: float) -> tuple:
    """Noise [m] and which heights count as unworn."""
    below = -rest[rest < 0]
    noise = max(1.4826 * float(np.median(below)) if below.size > 3 else 0.0, least)
    deep = rest > REACH * noise
    beside = np.convolve(deep, np.ones(2 * BESIDE + 1), "same") > 0.5
    return noise, (np.abs(rest) <= REACH * noise) & ~beside


class _Fit:
    """The two traces and the state of the second: offset, height of its slope at the end, shift, stretch, bend."""

    def __init__(self, before: Profile, after: Profile, shift: float):
        from scipy.interpolate import CubicSpline

        one, there = even(before), ~after.missing
        self.side = 1  # -1: heights that are not unworn stand above the first trace
        self.known, self.lost = before.x, before.missing
        self.one, self.x, self.z, self.source = one, after.x[there], after.z[there], after.source
        self.spline = CubicSpline(one.x, one.z)
        self.slope = self.spline.derivative()
        self.flat, self.half = level(one).z, one.length / 2
        height, step = float(self.flat.std()), one.length / (one.x.size - 1)
        self.least = max(DIGITS * height, 1e-13 * float(np.abs(self.z).max(initial=0.0)), 1e-300)
        tilt = max(height, 1e-12)
        self.scales = np.array([tilt, tilt, step, step / self.half, tilt])
        inside = self.inside(self.at(np.array([0.0, 0.0, shift, 0.0, 0.0]), 0.0))
        if inside.sum() < FEWEST:
            raise PatchfemError(f"{self.source}: only {inside.sum()} of its samples lie on {one.source}; at "
                                f"least {FEWEST} are needed")
        self.centre = float(self.x[inside][0] + self.x[inside][-1]) / 2

    def inside(self, at):
        """Which of some places lie on the first trace, and not in a gap of it."""
        edge = 1e-9 * self.half
        inside = (at >= self.one.x[0] - edge) & (at <= self.one.x[-1] + edge)
        if self.lost.any():
            after = np.clip(np.searchsorted(self.known, at), 1, self.known.size - 1)
            inside &= ~(self.lost[after] | self.lost[after - 1])
        return inside

    def at(self, state, centre=None):
        """Places in the first trace of the samples of the second."""
        centre = self.centre if centre is None else centre
        return centre + (self.x - centre) / (1 + state[3]) - state[2]

    def rest(self, state) -> tuple:
        """Depth below the first trace, its gradient (n, 5), and which samples of the second these are."""
        at = self.at(state)
        inside = self.inside(at)
        along, at = (self.x[inside] - self.centre) / self.half, at[inside]
        fall = -self.slope(at)
        rest = self.spline(at) - self.z[inside] + state[0] + state[1] * along + state[4] * along**2
        return rest, np.column_stack([np.ones(at.size), along, fall, fall * along * self.half, along**2]), inside

    def smooth_slope(self, noise: float) -> None:
        """Take slopes from parabolas through so many samples that the noise [m] leaves 5 % in them, three at least.

        A slope between noisy neighbours errs together with their heights and would draw the shift to places between
        samples.
        """
        from scipy.signal import savgol_filter

        step = self.scales[2]
        slope = float(np.std(savgol_filter(self.one.z, 5, 2, 1, delta=step)))
        wanted = (6 * (noise / (step * NOISY * max(slope, 1e-300))) ** 2) ** (1 / 3)
        count = int(np.clip(2 * np.ceil(wanted / 2) + 1, 3, MOST))
        smooth = savgol_filter(self.one.z, min(count, self.one.z.size // 2 * 2 - 1), 2, 1, delta=step)
        self.slope = lambda at: np.interp(at, self.one.x, smooth)

    def noise(self, state) -> float:
        return _unworn(self.side * self.rest(state)[0], self.least)[0]

    def start(self, shift: float, lowest: float, bent: bool = False) -> tuple:
        """State and the unworn heights of the one-sided line over a share of the heights, the lowest ones."""
        state = np.array([0.0, 0.0, shift, 0.0, 0.0])
        rest, gradient, inside = self.rest(state)
        x = self.x[inside]
        if bent:
            state[4] = -self.side * _bend((x - self.centre) / self.half, self.side * rest)
            rest = self.rest(state)[0]
        low = np.interp(x - shift, self.one.x, self.flat)
        low = low <= np.quantile(low, lowest if self.side > 0 else 1.0)
        self.blur = float(np.std(gradient[:, 2])) * self.scales[2] / 2  # half a step of shift left open
        line = one_sided_line(x[low], rest[low], "above" if self.side > 0 else "below", self.blur)
        state[:2] = -line.at(self.centre), -line.slope * self.half
        used = np.zeros(x.size, bool)
        used[np.flatnonzero(low)[line.used]] = True
        for _ in range(8):  # the shift of these heights alone, before others come in
            seen = self.rest(state)
            state = self.improved(state, seen, used, 3) if used.size == seen[0].size else state
        return state, used

    def improved(self, state, seen, used, free: int) -> np.ndarray:
        """The state after a step of least squares in its first `free` numbers over the heights `used`; seen: `rest` of
        the state."""
        rest, gradient, _ = seen
        step = np.linalg.lstsq(gradient[used, :free], -rest[used], rcond=1e-10)[0]
        most = 4 * self.scales[2:free]
        step[2:4] = np.clip(step[2:4], -most[:2], most[:2])
        new = state.copy()
        new[:free] += step
        return new

    def found(self, state, stretch: tuple, free: int = 3, used=None) -> Registration:
        """The registration of a state; used: its unworn heights where they are known."""
        rest, gradient, inside = self.rest(state)
        self.state = state
        noise, unworn = _unworn(self.side * rest, self.least)
        used = unworn if used is None else used
        part = gradient[used, :free]
        inverse = np.linalg.pinv(part.T @ part, rcond=1e-14, hermitian=True)
        spread = float(np.mean(rest[used] ** 2)) / KEPT
        covariance = inverse * max(spread, self.least**2 / 100) * TRIMMED * together(rest, used)
        turn = np.array([1.0, 1 / self.half, 1.0, 1.0, 1.0])[:free]  # slope [rad] from the height at the end
        x, at = self.x[inside], self.at(state)[inside]
        slope = float(state[1] / self.half)
        offset = float(state[0]) + slope * (float(x[0] + x[-1]) / 2 - self.centre)
        first = self.spline(at)
        height = first - np.polyval(np.polyfit(x, first, 1), x)
        deep = used & (height <= np.median(height[used]))
        doubt = np.linalg.lstsq(gradient[deep, :free], -rest[deep], rcond=1e-10)[0]
        return Registration(
            float(state[2]), slope, offset, noise, frozen_array(x),
            frozen_array(first), frozen_array(rest), used, frozen_array(gradient[:, :free] / turn),
            frozen_array(covariance * np.outer(turn, turn)), stretch, frozen_array(doubt * turn),
            float(state[4] * (np.ptp(x) / 2 / self.half) ** 2))


def gain_of(found: Registration) -> float | None:
    """Heights of the second trace over those of the first where one factor explains how they differ, None where not."""
    along = np.vander(np.linspace(-1, 1, found.x.size), 3)
    high, rest = (z - along @ np.linalg.lstsq(along, z, rcond=None)[0] for z in (found.first, found.rest))
    share = float(high @ rest) / max(float(high @ high), 1e-300)
    return 1 - share if float(np.std(rest - share * high)) < ALL * float(np.std(rest)) else None


def _deviations(rest, rough, least: float) -> np.ndarray:
    """Standard deviation (n,) of depths about zero as a rising function of the roughness (n,), `least` at least.

    Of the heights of a level of roughness the side of zero with the smaller median counts: no wear, or nothing that
    grew, and of that side what lies within four deviations.
    """
    parts = np.array_split(np.argsort(rough, kind="stable"), int(np.clip(rest.size // EACH, 1, LEVELS)))
    found = []
    for part in parts:
        sides = [np.abs(side) for side in (rest[part][rest[part] < 0], rest[part][rest[part] > 0]) if side.size > 3]
        side = min(sides, key=np.median, default=np.zeros(1))
        side = side[side <= TAILS * 1.4826 * np.median(side)]
        found.append(max(float(np.sqrt(np.mean(side**2))), least))
    return np.interp(rough, [float(np.median(rough[part])) for part in parts], np.maximum.accumulate(found))


def _bend(along, rest) -> float:
    """Bend [m] of the parabola through low depths of three of 20 parts on which most other low ones lie, none below.

    A point above costs r/(r + noise), one at most; a point below r/noise, as in `levelling`.
    """
    cell = np.clip(((along - along.min()) / max(float(np.ptp(along)), 1e-300) * SIDES).astype(int), 0, SIDES - 1)
    parts = [cell == k for k in range(SIDES) if (cell == k).sum() > 3]
    if len(parts) < 6:
        return 0.0
    at = np.array([along[one].mean() for one in parts])
    least, low = np.array([np.quantile(rest[one], (0.05, 0.25)) for one in parts]).T
    noise = 2 * float(np.quantile(low - least, 0.25)) + 1e-9 * float(np.ptp(rest)) + 1e-300
    chosen = np.array(list(combinations(range(at.size), 3)))
    chosen = chosen[at[chosen[:, 2]] - at[chosen[:, 0]] > 0.5 * np.ptp(at)]
    shapes = np.linalg.solve(np.vander(at, 3)[chosen], low[chosen][..., None])[..., 0]
    off = low - shapes @ np.vander(at, 3).T
    cost = np.where(off > 0, off / (off + noise), np.minimum(-off / noise, 1e6)).sum(axis=1)
    return float(shapes[int(np.argmin(cost)), 0])


def together(rest, used) -> float:
    """How many neighbouring heights err alike: 1 + 2 sum of the correlations of unworn neighbours, 1 at least."""
    total, power = 1.0, float(np.mean(rest[used] ** 2))
    if power == 0:
        return 1.0
    for lag in range(1, min(200, rest.size // 4)):
        both = used[lag:] & used[:-lag]
        if both.sum() < FEWEST:
            break
        found = float(np.mean(rest[lag:][both] * rest[:-lag][both])) / power
        if found < 2 / np.sqrt(both.sum()):
            break
        total += 2 * found
    return total
