"""Map of a motion over a period of a sine, or half of one, and its exact derivative.

The sign of the motion is changed after half a period.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...compiled import load
from ...core import ModalBasis, NotConverged, PatchfemError
from .cost import python_seconds
from .elements import Memory, make_element_table, sorted_stretches, unstretched_memory
from .modal_system import (
    RunArrays,
    TimeState,
    make_modal_system,
    make_workspace,
    split_time,
    start_previous_cycle,
    start_sums,
    start_time_state,
)
from .positions_kernels import Limit

# computing time of a map with slopes over that of a map without them, both as interpreted Python
SLOPE_COST_FACTOR = 2.0
# drives whose segments are kept
MAX_KEPT_DRIVES = 256
# fields of a memory that change sign with the motion
ODD_FIELDS = ("slide", "direction", "group_slide", "group_sign", "force", "slip")


class Point(NamedTuple):
    """State at phase 0 of the drive.

    - motion: (2 n,) modal coordinates [m] and rates [m/s]
    - memory: of the elements
    - known: turning points, None where they are not computed yet
    """

    motion: np.ndarray
    memory: Memory
    known: tuple | None = None  # turning points, where they have been computed

    @property
    def turning_places(self) -> tuple:
        """Interfaces (d,) and groups (d,) of the turning points in the memory."""
        return self.known or find_turning_places(self.memory)

    @property
    def numbers(self) -> np.ndarray:
        """Motion and relative displacements of the turning points (2 n + d,)."""
        return np.concatenate([self.motion, self.memory.group_slide[self.turning_places]])

    def with_numbers(self, numbers) -> "Point":
        """Return the Point with other numbers and the same elements in every group."""
        memory = copy_memory(self.memory)
        count = self.motion.size
        turned = self.turning_places
        memory.group_slide[turned] = numbers[count:]
        return Point(np.array(numbers[:count]), memory, turned)


def find_turning_places(memory: Memory) -> tuple:
    """Return interfaces (d,) and groups (d,) of the turning points in a memory."""
    groups = []
    for signs, n_groups in zip(memory.group_sign, memory.n_groups.tolist()):
        groups.append(signs[:n_groups].nonzero()[0])
    if len(groups) == 1:
        return np.zeros_like(groups[0]), groups[0]
    interfaces = np.repeat(np.arange(len(groups)), [indices.size for indices in groups])
    return interfaces, np.concatenate(groups)


def copy_memory(memory: Memory) -> Memory:
    """Return a copy of a memory."""
    return Memory(*(part.copy() for part in memory))


@dataclass(frozen=True, eq=False, slots=True)
class PeriodMapping:
    """Image of a Point under the map.

    - end: the Point after a period, or after half of one with the sign changed
    - slope: derivative of the numbers of `end` with respect to those of the start
    - kept: (k,) numbers, of start and end, of turning places that no slip has passed
    - max_slipping: (i,) largest number of elements that slip at once
    - min_groups: (i,) smallest number of groups
    - extremes: (2,) of the output [m]
    - pieces: number of pieces
    """

    end: Point
    slope: np.ndarray
    kept: np.ndarray
    max_slipping: np.ndarray
    min_groups: np.ndarray
    extremes: np.ndarray
    pieces: int


class PeriodMap:
    """Map over a period of modes behind elements.

    Its arrays are reused for each call.
    """

    def __init__(self, modes: ModalBasis, groups):
        self.follow = load("dynamics.events.slope_kernels").march_with_slopes
        self.n = modes.omega.size
        self._set_system(modes, groups)
        faces = len(self.groups)
        self.workspace = make_workspace(self.modal_system)
        self.run_sums = start_sums(2, np.zeros(2))
        self.previous = start_previous_cycle(self.modal_system, self.table)
        self.scratch = (
            np.zeros((2, self.n)),
            np.zeros(faces),
            np.zeros_like(self.workspace.coefficients),
        )
        self.motion = np.zeros((2, self.n))
        self.memory = copy_memory(self.still)
        self.seen = np.zeros((2, faces), np.int64)
        self.carried = {}
        self.drive = None
        self.time_state = None
        self.clocks = {}
        self.seconds = 0.0

    def _set_system(self, modes: ModalBasis, groups) -> None:
        """Set the modes and the elements, and build the arrays that depend on them."""
        self.modes = modes
        self.groups = tuple(groups)
        self.modal_system = make_modal_system(modes)
        self.table = make_element_table(groups)
        self.faces = self.modal_system.interfaces
        self.held = {}
        self.still = unstretched_memory(self.table, np.zeros(len(self.groups)))

    def replace_system(self, modes: ModalBasis, groups) -> bool:
        """Replace the modes and the elements.

        Returns False where their numbers differ from the present ones.
        """
        fits = (
            modes.omega.size == self.n
            and [group.stiffness.size for group in groups] == self.table.n_elements.tolist()
        )
        if fits:
            self._set_system(modes, groups)
        return fits

    def make_rest_point(self) -> Point:
        """Return the Point at rest with unstretched elements."""
        return Point(np.zeros(2 * self.n), copy_memory(self.still))

    def complete_memory(self, point: Point) -> Memory:
        """Return the memory of a Point with displacement and slip computed from its motion."""
        memory = copy_memory(point.memory)
        memory.slide[:] = self.faces @ point.motion[: self.n]
        for f, elements in enumerate(self.groups):
            limits = elements.stiffness * elements.yield_displacement
            memory.slip[f] = (
                limits
                @ (memory.slide[f] - sorted_stretches(elements, memory, f))
                / max(limits.sum(), 1e-300)
            )
        return memory

    def run_arrays(self, modal_system, sums) -> RunArrays:
        """Return the arrays of a run from the state of this map.

        Parameters
        ----------
        modal_system : ModalSystem
        sums : RunSums

        Returns
        -------
        RunArrays
        """
        return RunArrays(
            modal_system,
            self.table,
            self.motion,
            self.memory,
            self.previous,
            self.time_state,
            sums,
            self.workspace,
        )

    def start_period(self, drive, point: Point) -> None:
        """Set time, sums, motion and memory to the start of a period of a sine at a Point.

        Raises
        ------
        PatchfemError
            If the drive does not repeat.
        """
        if drive is not self.drive:
            self._set_drive(drive)
        time_state = self.time_state
        run_sums = self.run_sums
        self.motion[:] = point.motion.reshape(2, self.n)
        for array, values in zip(self.memory, point.memory):
            array[...] = values
        self.memory.slide[:] = self.faces @ self.motion[0]
        time_state.now[:] = 0.0
        time_state.is_at_turn[:] = 0.0
        run_sums.ledger[:] = 0.0
        run_sums.limits[Limit.N_IDLE] = 0.0
        run_sums.extremes[:] = (np.inf, -np.inf)
        self.workspace.choice.orders[:] = -1.0

    def _set_drive(self, drive) -> None:
        """Set the time to the start of a sine; its segments are kept for the next call."""
        if id(drive) not in self.clocks:
            if len(drive.segments) != 1:
                raise PatchfemError(
                    "drive: a periodic motion can be computed only if the drive is a single sine "
                    'without end; for this drive use accuracy.method = "march"'
                )
            if len(self.clocks) >= MAX_KEPT_DRIVES:
                self.clocks.clear()
            stiff = max(float(group.stiffness.sum()) for group in self.groups)
            seconds = python_seconds(self.modes, drive, stiff, int(self.table.n_elements.sum()))
            self.clocks[id(drive)] = drive, start_time_state(drive, len(self.groups)), seconds
        _, time_state, self.seconds = self.clocks[id(drive)]
        if self.time_state is None:
            self.time_state = TimeState(*(part.copy() for part in time_state))
        self.drive = drive
        self.time_state.segments[:] = time_state.segments
        self.time_state.period[:] = time_state.period

    def __call__(self, drive, point: Point, half: bool, slopes: bool = True) -> PeriodMapping:
        """Map a Point over a period of a sine.

        Parameters
        ----------
        drive
        point : Point
        half : bool
            Whether half a period is mapped and the sign changed.
        slopes : bool, optional
            Whether the derivative is computed.

        Returns
        -------
        PeriodMapping

        Raises
        ------
        NotConverged
            If events follow each other without progress in time.
        PatchfemError
            If the drive does not repeat.
        """
        self.start_period(drive, point)
        n = self.n
        memory = self.memory
        counts = self.seen
        period = drive.period
        interfaces, group = point.turning_places
        size = 2 * n + interfaces.size if slopes else 0
        slope, turning_slopes, start_slope = self._slope_arrays(size)
        if slopes:
            slope[:] = start_slope
            turning_slopes[:, : memory.n_groups.max(initial=0)] = 0.0
            turning_slopes[interfaces, group, np.arange(2 * n, size)] = 1.0
        counts[0] = memory.n_slipping
        counts[1] = memory.n_groups
        self.follow.add_python_cost(
            self.seconds * (SLOPE_COST_FACTOR if slopes else 1.0) / (1 + half)
        )
        if size not in self.held:
            arrays = self.run_arrays(self.modal_system, self.run_sums)
            self.held[size] = self.follow.bind_arguments(
                arrays, slope, turning_slopes, self.scratch, counts
            )
        pieces = self.follow.call_with_bound_args(
            self.held[size], split_time(period / 2 if half else period, period)
        )
        if pieces < 0:
            raise NotConverged(
                "dynamics: within one period the contact changes between stick and slip more often than "
                "can be computed"
            )
        rows, columns = turning_places = find_turning_places(memory)
        end = Point(self.motion.ravel().copy(), copy_memory(memory), turning_places)
        kept_numbers = 2 * n + (columns < counts[1, rows]).nonzero()[0]
        end_slope = np.concatenate([slope.reshape(2 * n, size), turning_slopes[rows, columns]])
        if half:
            for odd_part in (
                end.motion,
                end_slope,
                *(getattr(end.memory, name) for name in ODD_FIELDS),
            ):
                np.negative(odd_part, out=odd_part)
        return PeriodMapping(
            end,
            end_slope,
            kept_numbers,
            *counts.copy(),
            self.run_sums.extremes[0].copy(),
            int(pieces),
        )

    def _slope_arrays(self, size: int) -> tuple:
        """Return arrays for derivatives with respect to so many numbers.

        They are those of the motion (2, n, size) and of turning places (i, t + 2, size), and the
        former at the start.
        """
        if size not in self.carried:
            self.carried[size] = (
                np.zeros((2, self.n, size)),
                np.zeros((*self.memory.group_slide.shape, size)),
                np.eye(2 * self.n, size).reshape(2, self.n, size),
            )
        return self.carried[size]
