"""Periodic motion of modes behind elastic-plastic elements, by Newton's method on the map from event to event.

The law is odd and a sine turns over after half a period, so there is a motion that does: it is the fixed point of half
a period turned over, its elements are those that a slowly rising drive leaves behind, and its multipliers are the
squares of those of the half. Elements that never slip within a cycle are springs; their own memory, an offset that no
cycle changes (multiplier 1), is no number of the state and is left out.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgesv

from ...core import ModalBasis, NotConverged, Start, frozen_array
from .elements import Memory
from .period import Map, PeriodMap, Point, copied

EARLY = 4  # periods of the run that brings Newton's method near
LATER = 10, 160  # periods more where it leads away: at first, and at most
GROWN = 1e-6  # of what the drive moves a free mass: the most that a motion misses when it closes
FAR = 1e9  # its largest size: that of a mode with a damping of 5e-10
MOST = 40  # steps of Newton's method
SHARES = 1.0, 0.5, 0.2, 0.05  # of a step that are tried
ROUND = 1e-14  # a miss that a step more would not make smaller


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


class Lap(NamedTuple):
    """A Point and its Map. width [m]: size of the motion; alike: the turning places are of the same kind; scale: size
    of every number; gap: what the numbers miss over it, of the motions alone where they are not alike; miss: its
    largest size."""

    point: Point
    found: Map
    width: float
    alike: bool
    scale: np.ndarray
    gap: np.ndarray
    miss: float


def steady(modes: ModalBasis, drive, groups, near: Point | None = None, tolerance: float = 1e-12) -> Steady:
    """The periodic response to a sine that turns over after half a period, from a Point `near` it or from rest.

    drive: one Segment of a sine; groups: Elements of every interface. NotConverged where MOST steps of Newton's
    method and more of the run between them do not settle, PatchfemError for a drive that does not repeat.
    """
    one = PeriodMap(modes, groups)
    return _result(one, *turning(one, drive, near, tolerance), True)


def settled(modes: ModalBasis, drive, groups, start: Start, memory: Memory, tolerance: float = 1e-12) -> Steady:
    """The periodic motion that the run from a state at phase 0 of the drive settles to, as far as its elements have
    slipped for the last time. NotConverged as in `steady`."""
    one, point = PeriodMap(modes, groups), Point(np.concatenate([start.z, start.v]), memory)
    return _result(one, *_shot(one, drive, point, False, tolerance), False)


def turning(one: PeriodMap, drive, near: Point | None = None, tolerance: float = 1e-12) -> tuple:
    """(Lap of the motion that turns over, steps of Newton's method); arguments and errors as `steady`."""
    return _shot(one, drive, near or _early(one, drive, one.rest(), EARLY, True), True, tolerance)


def _early(one: PeriodMap, drive, point: Point, periods: int, half: bool) -> Point:
    """The Point after some periods of the run, `_next` after each."""
    for _ in range(2 * periods if half else periods):
        point = _next(one(drive, point, half, False), one.table.count, half)
    return point


def _next(found: Map, count, half: bool) -> Point:
    """The end of a Map; of a motion that turns over without the turning places that nothing slipped past, as if these
    elements, of count (i,), had never slipped."""
    if not half or not found.least.any():
        return found.end
    memory = copied(found.end.memory)
    for f, least in enumerate(found.least):
        if least:
            for part in (memory.upto, memory.at, memory.side):
                part[f, 1:1 + memory.depth[f] - least] = part[f, least:memory.depth[f]].copy()
            memory.upto[f, 0], memory.at[f, 0], memory.side[f, 0] = count[f], 0.0, 0.0
            memory.depth[f] += 1 - least
    return Point(found.end.motion, memory)


def _lap(one: PeriodMap, drive, point: Point, half: bool) -> Lap:
    """The Lap of a Point. NotConverged where events pile up."""
    found, n, omega = one(drive, point, half), one.n, drive.segments[0].omega
    a, b = point.motion, found.end.motion
    both = np.abs([a, b])
    width = max(float(both[:, :n].max()), float(both[:, n:].max()) / omega, 1e-300)
    scale = np.repeat([width, width * omega], n)
    alike = _alike(point, found.end)
    if alike:
        rows = np.maximum(np.abs(one.faces).sum(axis=1), 1e-300)
        scale = np.concatenate([scale, width * rows[point.turned[0]]])
        a, b = point.numbers, found.end.numbers
    gap = (a - b) / scale
    return Lap(point, found, width, alike, scale, gap, float(np.abs(gap).max()))


def _alike(point: Point, end: Point) -> bool:
    """Whether two Points have the same numbers: turning places of the same kind."""
    a, b = point.memory, end.memory
    deep = a.depth.tolist()
    return deep == b.depth.tolist() and all(x[:d].tolist() == y[:d].tolist() for x, y, d in zip(a.side, b.side, deep))


def _same(point: Point, end: Point) -> bool:
    """Whether two Points that are alike hold the same elements in every group, and let the same ones slip."""
    a, b = point.memory, end.memory
    return a.slipping.tolist() == b.slipping.tolist() and a.way.tolist() == b.way.tolist() and all(
        x[:d].tolist() == y[:d].tolist() for x, y, d in zip(a.upto, b.upto, a.depth.tolist()))


def _shot(one: PeriodMap, drive, point: Point, half: bool, tolerance: float) -> tuple:
    """Newton's method from a Point, and more of the run where it leads away: (Lap of the motion, steps)."""
    periods, lap, reach = LATER[0], _lap(one, drive, point, half), moved_by(one, drive)
    for used in range(MOST):
        size = lap.width / reach
        if size > FAR:  # nothing bounds it: it misses ever less of its size
            break
        closed = lap.miss <= tolerance and lap.miss * size <= GROWN and lap.alike and _same(point, lap.found.end)
        if closed and lap.miss <= ROUND:
            return lap, used
        better = _newton(one, drive, lap, half, SHARES[:1] if closed else SHARES)
        if closed:  # the last step squares what is left, where it keeps the turning places
            return (better if better is not None and better.alike else lap), used
        if better is None:
            point = _early(one, drive, _next(lap.found, one.table.count, half), periods, half)
            periods, lap = min(2 * periods, LATER[1]), _lap(one, drive, point, half)
        else:
            point, lap = better.point, better
    raise NotConverged("dynamics: no periodic motion by the map from yield to yield; march")


def moved_by(one: PeriodMap, drive) -> float:
    """How far a sine moves a free mass [m]."""
    part = drive.segments[0]
    return max(abs(part.amplitude) / part.omega**2 * float(np.abs(one.plant.base).max()), 1e-300)


def _newton(one: PeriodMap, drive, lap: Lap, half: bool, shares) -> Lap | None:
    """A better Lap by the first of some shares of Newton's step that leads to one, None where none does.

    The elements of every group are those at the end of the run: they follow the motion.
    """
    if not lap.alike:
        return None
    step, start = _direction(lap), lap.point.numbers
    for share in shares:
        try:
            other = _lap(one, drive, lap.found.end.moved(start + share * step), half)
        except NotConverged:
            continue
        if other.miss < (1 - 0.4 * share) * lap.miss:
            return other
    return None


def _direction(lap: Lap) -> np.ndarray:
    """Newton's step (numbers,) of a Lap whose ends are alike."""
    scale, found = lap.scale, lap.found
    left, right = (found.slope - np.eye(scale.size)) * scale / scale[:, None], lap.gap
    if not found.kept.size:
        return solved(left, right) * scale
    free, step = np.ones(scale.size, bool), np.zeros(scale.size)
    free[found.kept] = False  # nothing slips past them: they stay whatever the rest does
    step[free] = solved(left[np.ix_(free, free)], right[free]) * scale[free]
    return step


def solved(left, right) -> np.ndarray:
    """x (n,) of left x = right; least squares where the matrix is singular to round-off, of a slide without any spring,
    which may rest anywhere."""
    factors, _, out, info = dgesv(left, right)
    sizes = np.abs(factors.diagonal())
    if info == 0 and sizes.min() > 1e-13 * sizes.max():
        return out
    return np.linalg.lstsq(left, right, rcond=1e-13)[0]


def multipliers_of(found: Map, half: bool) -> np.ndarray:
    """Multipliers over a whole period of a Map at its fixed point, the offsets that no cycle changes left out."""
    free = np.ones(len(found.slope), bool)
    free[found.kept] = False
    values = np.linalg.eigvals(found.slope[np.ix_(free, free)])
    values = values**2 if half else values
    return values[np.argsort(-np.abs(values))]


def _result(one: PeriodMap, lap: Lap, used: int, half: bool) -> Steady:
    point, found = lap.point, lap.found
    low, high = found.extremes
    limit, n = one.table.limit, one.n
    share = sum(row[k] for row, k in zip(limit, found.most)) / max(limit[:, -1].sum(), 1e-300)
    start = Start(frozen_array(point.motion[:n]), frozen_array(point.motion[n:]))
    return Steady(point, start, one.placed(point), lap.miss,
                  frozen_array(multipliers_of(found, half), complex),
                  float(max(high, -low) if half else (high - low) / 2), float(share), half, used)
