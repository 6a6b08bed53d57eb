"""Periodic motion of modes behind elastic-plastic elements, by Newton's method on the map from event to event.

The law is odd and a sine turns over after half a period, so there is a motion that does: it is the fixed point of half
a period turned over, its elements are those that a slowly rising drive leaves behind, and its multipliers are the
squares of those of the half. Elements that never slip within a cycle are springs; their own memory, an offset that no
cycle changes (multiplier 1), is no number of the state and is left out.
"""

from dataclasses import dataclass

import numpy as np

from ...core import ModalBasis, NotConverged, Start, frozen_array
from .elements import Memory
from .period import Map, PeriodMap, Point, copied

EARLY = 4  # periods of the run that brings Newton's method near
LATER = 10, 160  # periods more where it leads away: at first, and at most
GROWN = 1e-6  # of what the drive moves a free mass: the most that a motion misses when it closes
FAR = 1e9  # its largest size: that of a mode with a damping of 5e-10
MOST = 40  # steps of Newton's method


@dataclass(frozen=True, eq=False, slots=True)
class Steady:
    """A motion that repeats from period to period.

    point, start, memory: state at phase 0 of the drive; residual: |state after a period - start| over the size of the
    motion; multipliers (m,) complex, largest first, of motion and turning places over a period: stable where all are <
    1 in magnitude; amplitude [m]: half the peak-to-peak output; slipping: share of the friction limit of all interfaces
    that slips within a cycle; symmetric: it turns over after half a period; iterations of Newton's method.
    """

    point: Point
    start: Start
    memory: Memory
    residual: float
    multipliers: np.ndarray
    amplitude: float
    slipping: float
    symmetric: bool
    iterations: int

    @property
    def error(self) -> float:
        """Relative error that the residual leaves in the motion: over how far the multipliers are from 1."""
        return self.residual / max(float(np.abs(1 - self.multipliers).min(initial=1.0)), 1e-12)

    @property
    def regime(self) -> str:
        """How the interfaces move: stuck, in partial slip, or all of them slide."""
        return "stuck" if self.slipping == 0 else "slides" if self.slipping > 1 - 1e-12 else "partial slip"


def steady(modes: ModalBasis, drive, groups, near: Point | None = None, tolerance: float = 1e-12) -> Steady:
    """The periodic response to a sine that turns over after half a period, from a Point `near` it or from rest.

    drive: one Segment of a sine; groups: Elements of every interface. NotConverged where MOST steps of Newton's
    method and more of the run between them do not settle, PatchfemError for a drive that does not repeat.
    """
    one = PeriodMap(modes, groups)
    return _shot(one, drive, near or _early(one, drive, one.rest(), EARLY, True), True, tolerance)


def settled(modes: ModalBasis, drive, groups, start: Start, memory: Memory, tolerance: float = 1e-12) -> Steady:
    """The periodic motion that the run from a state at phase 0 of the drive settles to, as far as its elements have
    slipped for the last time. NotConverged as in `steady`."""
    point = Point(np.concatenate([start.z, start.v]), memory)
    return _shot(PeriodMap(modes, groups), drive, point, False, tolerance)


def _early(one: PeriodMap, drive, point: Point, periods: int, half: bool) -> Point:
    """The Point after some periods of the run, `_next` after each."""
    for _ in range(2 * periods if half else periods):
        point = _next(one(drive, point, half, False), one.table.count, half)
    return point


def _next(found: Map, count, half: bool) -> Point:
    """The end of a Map; of a motion that turns over without the turning places that nothing slipped past, as if these
    elements, of count (i,), had never slipped."""
    if not half:
        return found.end
    memory = copied(found.end.memory)
    for f, least in enumerate(found.least):
        if least:
            for part in (memory.upto, memory.at, memory.side):
                part[f, 1:1 + memory.depth[f] - least] = part[f, least:memory.depth[f]].copy()
            memory.upto[f, 0], memory.at[f, 0], memory.side[f, 0] = count[f], 0.0, 0.0
            memory.depth[f] += 1 - least
    return Point(found.end.motion, memory)


def _sizes(one: PeriodMap, drive, *points) -> np.ndarray:
    """Sizes (2,) of place [m] and rate [m/s] of the motion through Points."""
    omega, n = drive.segments[0].omega, one.n
    place = max(max(np.abs(p.motion[:n]).max(), np.abs(p.motion[n:]).max() / omega) for p in points)
    return max(place, 1e-300) * np.array([1.0, omega])


def _scale(one: PeriodMap, drive, point: Point, end: Point) -> np.ndarray:
    """Size of every number of a Point and its end."""
    place, rate = _sizes(one, drive, point, end)
    rows = np.maximum(np.abs(one.faces).sum(axis=1), 1e-300)
    return np.concatenate([np.full(one.n, place), np.full(one.n, rate), place * rows[point.turned[0]]])


def _alike(point: Point, end: Point) -> bool:
    """Whether two Points have the same numbers: turning places of the same kind."""
    return bool(np.all(point.memory.depth == end.memory.depth)) and all(
        np.all(a[:deep] == b[:deep])
        for a, b, deep in zip(point.memory.side, end.memory.side, point.memory.depth))


def _same(point: Point, end: Point) -> bool:
    """Whether two Points that are alike hold the same elements in every group, and let the same ones slip."""
    a, b = point.memory, end.memory
    return bool(np.all(a.slipping == b.slipping) and np.all(a.way == b.way)) and all(
        np.all(x[:deep] == y[:deep]) for x, y, deep in zip(a.upto, b.upto, a.depth))


def _miss(one: PeriodMap, drive, point: Point, end: Point) -> float:
    """Largest difference of two Points over the size of the motion, of the motions alone where they are not alike."""
    if _alike(point, end):
        return float(np.abs((end.numbers - point.numbers) / _scale(one, drive, point, end)).max())
    size = np.repeat(_sizes(one, drive, point, end), one.n)
    return float(np.abs((end.motion - point.motion) / size).max())


def _shot(one: PeriodMap, drive, point: Point, half: bool, tolerance: float) -> Steady:
    """Newton's method from a Point, and more of the run where it leads away."""
    periods, found = LATER[0], one(drive, point, half)
    for used in range(1, MOST + 1):
        miss = _miss(one, drive, point, found.end)
        size = _sizes(one, drive, point, found.end)[0] / moved_by(one, drive)
        if size > FAR:  # nothing bounds it: it misses ever less of its size
            break
        better = _newton(one, drive, point, found, miss, half)
        closed = miss <= tolerance and miss * size <= GROWN
        if closed and _alike(point, found.end) and _same(point, found.end):
            # the last step squares what is left, where it keeps the turning places
            last = better if better is not None and _alike(better[0], better[1].end) else (point, found)
            return _result(one, drive, *last, half, used)
        if better is None:
            point = _early(one, drive, _next(found, one.table.count, half), periods, half)
            periods, found = min(2 * periods, LATER[1]), one(drive, point, half)
        else:
            point, found = better
    raise NotConverged("dynamics: no periodic motion by the map from yield to yield; march")


def moved_by(one: PeriodMap, drive) -> float:
    """How far a sine moves a free mass [m]."""
    part = drive.segments[0]
    return max(abs(part.amplitude) / part.omega**2 * float(np.abs(one.plant.base).max()), 1e-300)


def _newton(one: PeriodMap, drive, point: Point, found: Map, miss: float, half: bool):
    """A better (Point, Map) along Newton's direction, None where there is none.

    The elements of every group are those at the end of the run: they follow the motion.
    """
    if not _alike(point, found.end):
        return None
    step = _direction(one, drive, point, found)
    for share in (1.0, 0.5, 0.2, 0.05):
        trial = found.end.moved(point.numbers + share * step)
        try:
            other = one(drive, trial, half)
        except NotConverged:
            continue
        if _miss(one, drive, trial, other.end) < (1 - 0.4 * share) * miss:
            return trial, other
    return None


def _direction(one: PeriodMap, drive, point: Point, found: Map):
    """Newton's step (numbers,) of a Point whose end is alike."""
    size, free = _scale(one, drive, point, found.end), np.ones(len(found.slope), bool)
    free[found.kept] = False  # nothing slips past them: they stay whatever the rest does
    left = ((found.slope - np.eye(size.size)) * size / size[:, None])[np.ix_(free, free)]
    right = ((point.numbers - found.end.numbers) / size)[free]
    step = np.zeros(size.size)
    # least squares: a slide without any spring may rest anywhere
    step[free] = np.linalg.lstsq(left, right, rcond=1e-13)[0] * size[free]
    return step


def multipliers_of(found: Map, half: bool) -> np.ndarray:
    """Multipliers over a whole period of a Map at its fixed point, the offsets that no cycle changes left out."""
    free = np.ones(len(found.slope), bool)
    free[found.kept] = False
    values = np.linalg.eigvals(found.slope[np.ix_(free, free)])
    values = values**2 if half else values
    return values[np.argsort(-np.abs(values))]


def _result(one: PeriodMap, drive, point: Point, found: Map, half: bool, used: int) -> Steady:
    low, high = found.extremes
    limit, n = one.table.limit, one.n
    share = sum(row[k] for row, k in zip(limit, found.most)) / max(limit[:, -1].sum(), 1e-300)
    start = Start(frozen_array(point.motion[:n]), frozen_array(point.motion[n:]))
    return Steady(point, start, one.placed(point), _miss(one, drive, point, found.end),
                  frozen_array(multipliers_of(found, half), complex),
                  float(max(high, -low) if half else (high - low) / 2), float(share), half, used - 1)
