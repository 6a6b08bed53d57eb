"""Periodic motion of modes behind elastic-plastic elements, by Newton's method on the map from event to event.

The law is odd and a sine turns over after half a period, so there is a motion that does: it is the fixed point of half
a period turned over, its elements are those that a slowly rising drive leaves behind, and its multipliers are the
squares of those of the half. Elements that never slip within a cycle are springs; their own memory, an offset that no
cycle changes (multiplier 1), is no number of the state and is left out.
"""

from dataclasses import dataclass

import numpy as np

from ...core import InitialState, ModalBasis, frozen_array
from ..periodic import Mapped, Shooting, bound
from .elements import Memory
from .period import Map, PeriodMap, Point, copied

EARLY = 4  # periods of the run that brings Newton's method near


@dataclass(frozen=True, eq=False, slots=True)
class Steady:
    """A motion that repeats from period to period.

    point, start, memory: state at phase 0 of the drive; residual: |state after a period - start| over the size of the
    motion; multipliers (m,) complex, largest first, of motion and turning places over a period: stable where all are <
    1 in magnitude; amplitude [m]: half the peak-to-peak output; slipping: share of the friction limit of all interfaces
    that slips within a cycle; symmetric: it turns over after half a period; iterations of Newton's method.
    """

    point: Point
    start: InitialState
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
        return bound(self.residual, self.multipliers)

    @property
    def regime(self) -> str:
        """How the interfaces move: stuck, in partial slip, or all of them slide."""
        return (
            "stuck"
            if self.slipping == 0
            else "slides"
            if self.slipping > 1 - 1e-12
            else "partial slip"
        )


def steady(modes: ModalBasis, drive, groups, near: Point | None = None) -> Steady:
    """The periodic response to a sine that turns over after half a period, from a Point `near` it or from rest.

    drive: one Segment of a sine; groups: Elements of every interface. NotConverged as `periodic.Shooting.repeating`,
    PatchfemError for a drive that does not repeat.
    """
    one = PeriodMap(modes, groups)
    return _result(one, *turning(one, drive, near), True)


def settled(modes: ModalBasis, drive, groups, start: InitialState, memory: Memory) -> Steady:
    """The periodic motion that the run from a state at phase 0 of the drive settles to, as far as its elements have
    slipped for the last time. NotConverged as in `steady`."""
    one = PeriodMap(modes, groups)
    shooting = Yields(one, drive, False)
    point = Point(np.concatenate([start.z, start.v]), memory)
    return _result(one, *shooting.repeating(point), False)


def turning(one: PeriodMap, drive, near: Point | None = None) -> tuple:
    """(the map of the motion that turns over, steps of Newton's method); arguments and errors as `steady`."""
    shooting = Yields(one, drive, True)
    return shooting.repeating(near or shooting.run(one.rest(), EARLY))


class Yields(Shooting):
    """The map from yield to yield over a period of a drive, or over half of one turned over.

    The numbers of a Point are its motion and its turning places; they are alike where the turning places are of the
    same kind. The elements of every group are those at the end of the run: they follow the motion.
    """

    def __init__(self, one: PeriodMap, drive, half: bool):
        part = drive.segments[0]
        moved = abs(part.amplitude) / part.omega**2 * float(np.abs(one.modal_system.base).max())
        self.one = one
        self.drive = drive
        self.half = half
        self.moved_by = max(moved, 1e-300)
        self.rows = np.maximum(np.abs(one.faces).sum(axis=1), 1e-300)

    def mapped(self, point: Point) -> Mapped:
        """The map of a Point. NotConverged where events pile up."""
        found = self.one(self.drive, point, self.half)
        n = self.one.n
        omega = self.drive.segments[0].omega
        a = point.motion
        b = found.end.motion
        both = np.abs([a, b])
        width = max(float(both[:, :n].max()), float(both[:, n:].max()) / omega, 1e-300)
        scale = np.repeat([width, width * omega], n)
        alike = _alike(point, found.end)
        if alike:
            scale = np.concatenate([scale, width * self.rows[point.turned[0]]])
            a = point.numbers
            b = found.end.numbers
        return Mapped(
            point,
            found,
            found.slope,
            scale,
            (a - b) / scale,
            width / self.moved_by,
            alike,
            alike and _same(point, found.end),
            found.kept,
        )

    def moved(self, mapped: Mapped, step) -> Point:
        """The Point that lies a step from that of a map, with the elements of its end in every group."""
        return mapped.found.end.moved(mapped.point.numbers + step)

    def after(self, mapped: Mapped, periods: int) -> Point:
        """The Point after some periods of the run from the end of a map."""
        return self.run(self._next(mapped.found), periods)

    def run(self, point: Point, periods: int) -> Point:
        """The Point after some periods of the run."""
        for _ in range(2 * periods if self.half else periods):
            point = self._next(self.one(self.drive, point, self.half, False))
        return point

    def _next(self, found: Map) -> Point:
        """The end of a Map; of a motion that turns over without the turning places that nothing slipped past, as if
        these elements had never slipped."""
        if not self.half or not found.least.any():
            return found.end
        memory = copied(found.end.memory)
        for f, least in enumerate(found.least):
            if least:
                for part in (memory.upto, memory.at, memory.side):
                    part[f, 1 : 1 + memory.depth[f] - least] = part[
                        f, least : memory.depth[f]
                    ].copy()
                memory.upto[f, 0] = self.one.table.count[f]
                memory.at[f, 0] = 0.0
                memory.side[f, 0] = 0.0
                memory.depth[f] += 1 - least
        return Point(found.end.motion, memory)


def _alike(point: Point, end: Point) -> bool:
    """Whether two Points have the same numbers: turning places of the same kind."""
    a = point.memory
    b = end.memory
    deep = a.depth.tolist()
    return deep == b.depth.tolist() and all(
        x[:d].tolist() == y[:d].tolist() for x, y, d in zip(a.side, b.side, deep)
    )


def _same(point: Point, end: Point) -> bool:
    """Whether two Points that are alike hold the same elements in every group, and let the same ones slip."""
    a = point.memory
    b = end.memory
    return (
        a.slipping.tolist() == b.slipping.tolist()
        and a.way.tolist() == b.way.tolist()
        and all(
            x[:d].tolist() == y[:d].tolist() for x, y, d in zip(a.upto, b.upto, a.depth.tolist())
        )
    )


def _result(one: PeriodMap, mapped: Mapped, used: int, half: bool) -> Steady:
    point = mapped.point
    found = mapped.found
    values = mapped.multipliers()
    low, high = found.extremes
    limit = one.table.limit
    n = one.n
    share = sum(row[k] for row, k in zip(limit, found.most)) / max(limit[:, -1].sum(), 1e-300)
    start = InitialState(frozen_array(point.motion[:n]), frozen_array(point.motion[n:]))
    return Steady(
        point,
        start,
        one.placed(point),
        mapped.miss,
        frozen_array(values**2 if half else values, complex),
        float(max(high, -low) if half else (high - low) / 2),
        float(share),
        half,
        used,
    )
