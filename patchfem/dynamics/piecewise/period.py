"""The map of a motion over one period of a sine, or over half of one turned over, and its exact derivative."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...compiled import load
from ...core import ModalBasis, NotConverged, PatchfemError
from .elements import Memory, sorted_stretches, table_of, virgin
from .plant import books_of, clock_of, place, plant_of, room_of


class Point(NamedTuple):
    """State at phase 0 of the drive: motion (2 n,) coordinates [m] and rates [m/s], and memory of the elements."""

    motion: np.ndarray
    memory: Memory

    @property
    def turned(self) -> tuple:
        """(interfaces (d,), groups (d,)) of the turning places that the memory holds."""
        rows = np.arange(self.memory.side.shape[1]) < self.memory.depth[:, None]
        return np.nonzero(rows & (self.memory.side != 0))

    @property
    def numbers(self) -> np.ndarray:
        """Motion and turning places (2 n + d,) in a row."""
        return np.concatenate([self.motion, self.memory.at[self.turned]])

    def moved(self, numbers) -> "Point":
        """The Point of other numbers in a row, the same elements in every group."""
        memory, count = copied(self.memory), self.motion.size
        memory.at[self.turned] = numbers[count:]
        return Point(np.array(numbers[:count]), memory)

    def turned_over(self) -> "Point":
        """The Point with every sign changed."""
        memory = self.memory
        over = {name: -getattr(memory, name) for name in ("place", "way", "at", "side", "force", "slip")}
        return Point(-self.motion, copied(memory)._replace(**over))


def copied(memory: Memory) -> Memory:
    """A Memory of its own."""
    return Memory(*(part.copy() for part in memory))


@dataclass(frozen=True, eq=False, slots=True)
class Map:
    """A Point after a period, or turned over after half of one, `end`; slope (its numbers, those of the start): its
    derivative; kept (k,): numbers, of start and end, of the turning places that nothing slipped past.

    most (i,): elements that slip at once at most; least (i,): groups that stayed; extremes (2,): of the output [m];
    pieces of the motion.
    """

    end: Point
    slope: np.ndarray
    kept: np.ndarray
    most: np.ndarray
    least: np.ndarray
    extremes: np.ndarray
    pieces: int


class PeriodMap:
    """The map of modes behind Elements of every interface, `groups`."""

    def __init__(self, modes: ModalBasis, groups):
        self.kernels = load("dynamics.piecewise.slope_kernels")
        self.groups, self.plant, self.table = tuple(groups), plant_of(modes), table_of(groups)
        self.faces, self.n, self.room = self.plant.faces, modes.omega.size, room_of(self.plant)
        self.spare = np.zeros((2, self.n)), np.zeros(len(self.groups)), np.zeros_like(self.room.coefs)

    def rest(self) -> Point:
        """The Point at rest, no element stretched."""
        return Point(np.zeros(2 * self.n), virgin(self.table, np.zeros(len(self.groups))))

    def placed(self, point: Point) -> Memory:
        """The memory of a Point with its place and slip as they follow from the motion."""
        memory = copied(point.memory)
        memory.place[:] = self.faces @ point.motion[:self.n]
        for f, one in enumerate(self.groups):
            share = one.stiffness * one.yield_slide
            memory.slip[f] = share @ (memory.place[f] - sorted_stretches(one, memory, f)) / max(share.sum(), 1e-300)
        return memory

    def __call__(self, drive, point: Point, half: bool, slopes: bool = True) -> Map:
        """The Map of a Point over a period of a sine, or over half of one. NotConverged where events pile up,
        PatchfemError for a drive that does not repeat; without `slopes` that of the Map is empty."""
        if len(drive.segments) != 1:
            raise PatchfemError("drive: a periodic motion needs one sine that goes on; march this one")
        n, memory, motion = self.n, copied(point.memory), point.motion.reshape(2, self.n).copy()
        memory.place[:] = self.faces @ motion[0]
        face, group = point.turned
        size = 2 * n + face.size if slopes else 0
        slope, marks = np.zeros((2, n, size)), np.zeros((*memory.at.shape, size))
        if slopes:
            slope[0, :, :n], slope[1, :, n:2 * n] = np.eye(n), np.eye(n)
            marks[face, group, np.arange(2 * n, size)] = 1.0
        seen = np.array([memory.slipping, memory.depth])
        books, period = books_of(2, np.zeros(2)), drive.period
        pieces = self.kernels.follow(place(period / 2 if half else period, period), motion, slope, marks, self.plant,
                                     self.table, memory, clock_of(drive, len(self.groups)), books, self.room,
                                     self.spare, seen)
        if pieces < 0:
            raise NotConverged("dynamics: events pile up within a period")
        end = Point(motion.ravel(), memory)
        rows, columns = end.turned
        kept = 2 * n + np.flatnonzero(columns < seen[1, rows])
        out = np.concatenate([slope.reshape(2 * n, size), marks[rows, columns]])
        if half:
            end, out = end.turned_over(), -out
        return Map(end, out, kept, *seen, books.extremes[0], int(pieces))
