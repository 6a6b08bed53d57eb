"""The map of a motion over one period of a sine, or over half of one turned over, and its exact derivative."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...compiled import load
from ...core import ModalBasis, NotConverged, PatchfemError
from .cost import python_seconds
from .elements import Memory, sorted_stretches, table_of, virgin
from .modal_system import Clock, books_of, clock_of, place, plant_of, room_of

SLOPES = 2.0  # times as long a map takes as Python where it carries its slopes
DRIVES = 256  # sines whose clocks are remembered
# what of a memory turns over with the motion
SIGNED = (
    "place",
    "way",
    "at",
    "side",
    "force",
    "slip",
)


class Point(NamedTuple):
    """State at phase 0 of the drive: motion (2 n,) coordinates [m] and rates [m/s], and memory of the elements."""

    motion: np.ndarray
    memory: Memory
    known: tuple | None = None  # `turned` of a Point that another one was moved to

    @property
    def turned(self) -> tuple:
        """(interfaces (d,), groups (d,)) of the turning places that the memory holds."""
        return self.known or turned_of(self.memory)

    @property
    def numbers(self) -> np.ndarray:
        """Motion and turning places (2 n + d,) in a row."""
        return np.concatenate([self.motion, self.memory.at[self.turned]])

    def moved(self, numbers) -> "Point":
        """The Point of other numbers in a row, the same elements in every group."""
        memory = copied(self.memory)
        count = self.motion.size
        turned = self.turned
        memory.at[turned] = numbers[count:]
        return Point(np.array(numbers[:count]), memory, turned)


def turned_of(memory: Memory) -> tuple:
    """(interfaces (d,), groups (d,)) of the turning places that a memory holds."""
    found = [row[:deep].nonzero()[0] for row, deep in zip(memory.side, memory.depth.tolist())]
    if len(found) == 1:
        return np.zeros_like(found[0]), found[0]
    return np.repeat(np.arange(len(found)), [part.size for part in found]), np.concatenate(found)


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
    """The map of modes behind Elements of every interface, `groups`.

    What the compiled run works in is made once and filled for each map.
    """

    def __init__(self, modes: ModalBasis, groups):
        self.follow = load("dynamics.events.slope_kernels").follow
        self.n = modes.omega.size
        self._given(modes, groups)
        faces = len(self.groups)
        self.workspace = room_of(self.modal_system)
        self.books = books_of(2, np.zeros(2))
        self.scratch = np.zeros((2, self.n)), np.zeros(faces), np.zeros_like(self.workspace.coefs)
        self.motion = np.zeros((2, self.n))
        self.memory = copied(self.still)
        self.seen = np.zeros((2, faces), np.int64)
        self.carried = {}
        self.drive = None
        self.time_state = None
        self.clocks = {}
        self.seconds = 0.0

    def _given(self, modes: ModalBasis, groups) -> None:
        """Take modes and elements."""
        self.modes = modes
        self.groups = tuple(groups)
        self.modal_system = plant_of(modes)
        self.table = table_of(groups)
        self.faces = self.modal_system.faces
        self.held = {}
        self.still = virgin(self.table, np.zeros(len(self.groups)))

    def renewed(self, modes: ModalBasis, groups) -> bool:
        """Take other modes and elements in place of the first; False, and nothing is taken, where their numbers differ,
        which asks for other room."""
        same = (
            modes.omega.size == self.n
            and [one.stiffness.size for one in groups] == self.table.count.tolist()
        )
        if same:
            self._given(modes, groups)
        return same

    def rest(self) -> Point:
        """The Point at rest, no element stretched."""
        return Point(np.zeros(2 * self.n), copied(self.still))

    def placed(self, point: Point) -> Memory:
        """The memory of a Point with its place and slip as they follow from the motion."""
        memory = copied(point.memory)
        memory.place[:] = self.faces @ point.motion[: self.n]
        for f, one in enumerate(self.groups):
            share = one.stiffness * one.yield_displacement
            memory.slip[f] = (
                share
                @ (memory.place[f] - sorted_stretches(one, memory, f))
                / max(share.sum(), 1e-300)
            )
        return memory

    def begin(self, drive, point: Point) -> None:
        """Put clock, books, motion and memory to the start of a period of a sine, in a Point.

        PatchfemError for a drive that does not repeat.
        """
        if drive is not self.drive:
            self._under(drive)
        time_state = self.time_state
        books = self.books
        self.motion[:] = point.motion.reshape(2, self.n)
        for mine, given in zip(self.memory, point.memory):
            mine[...] = given
        self.memory.place[:] = self.faces @ self.motion[0]
        time_state.now[:] = 0.0
        time_state.rest[:] = 0.0
        books.ledger[:] = 0.0
        books.limits[1] = 0.0
        books.extremes[:] = (np.inf, -np.inf)
        self.workspace.orders[:] = -1.0

    def _under(self, drive) -> None:
        """Set the clock to a sine; it is made once for each of the last drives."""
        if id(drive) not in self.clocks:
            if len(drive.segments) != 1:
                raise PatchfemError(
                    "drive: a periodic motion can be computed only if the drive is a single sine "
                    'without end; for this drive use accuracy.method = "march"'
                )
            if len(self.clocks) >= DRIVES:
                self.clocks.clear()
            stiff = max(float(one.stiffness.sum()) for one in self.groups)
            seconds = python_seconds(self.modes, drive, stiff, int(self.table.count.sum()))
            self.clocks[id(drive)] = drive, clock_of(drive, len(self.groups)), seconds
        _, time_state, self.seconds = self.clocks[id(drive)]
        if self.time_state is None:
            self.time_state = Clock(*(part.copy() for part in time_state))
        self.drive = drive
        self.time_state.segments[:] = time_state.segments
        self.time_state.period[:] = time_state.period

    def __call__(self, drive, point: Point, half: bool, slopes: bool = True) -> Map:
        """The Map of a Point over a period of a sine, or over half of one. NotConverged where events pile up,
        PatchfemError for a drive that does not repeat; without `slopes` that of the Map is empty."""
        self.begin(drive, point)
        n = self.n
        memory = self.memory
        seen = self.seen
        period = drive.period
        face, group = point.turned
        size = 2 * n + face.size if slopes else 0
        slope, marks, unit = self._carried(size)
        if slopes:
            slope[:] = unit
            marks[:, : memory.depth.max(initial=0)] = 0.0
            marks[face, group, np.arange(2 * n, size)] = 1.0
        seen[0] = memory.slipping
        seen[1] = memory.depth
        self.follow.expect(self.seconds * (SLOPES if slopes else 1.0) / (1 + half))
        if size not in self.held:
            self.held[size] = self.follow.held(
                self.motion,
                slope,
                marks,
                self.modal_system,
                self.table,
                memory,
                self.time_state,
                self.books,
                self.workspace,
                self.scratch,
                seen,
            )
        pieces = self.follow.call_with_bound_args(
            self.held[size], place(period / 2 if half else period, period)
        )
        if pieces < 0:
            raise NotConverged(
                "dynamics: within one period the contact changes between stick and slip more often than "
                "can be computed"
            )
        rows, columns = turned = turned_of(memory)
        end = Point(self.motion.ravel().copy(), copied(memory), turned)
        kept = 2 * n + (columns < seen[1, rows]).nonzero()[0]
        out = np.concatenate([slope.reshape(2 * n, size), marks[rows, columns]])
        if half:
            for part in (end.motion, out, *(getattr(end.memory, name) for name in SIGNED)):
                np.negative(part, out=part)
        return Map(end, out, kept, *seen.copy(), self.books.extremes[0].copy(), int(pieces))

    def _carried(self, size: int) -> tuple:
        """Room for the slopes of so many numbers, of the motion (2, n, size) and of turning places (i, t + 1, size),
        and the former at the start."""
        if size not in self.carried:
            self.carried[size] = (
                np.zeros((2, self.n, size)),
                np.zeros((*self.memory.at.shape, size)),
                np.eye(2 * self.n, size).reshape(2, self.n, size),
            )
        return self.carried[size]
