"""Map of a state over one period or half a period of a sine, and the exact derivative of the map.

The sign of the motion is changed after half a period.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...compiled import load
from ...core import ModalBasis, NotConverged, PatchfemError
from .cost import estimate_cycle_time
from .elements import Memory, make_element_table, make_unstretched_memory, sorted_stretches
from .modal_system import (
    RunArrays,
    TimeState,
    make_initial_time_state,
    make_modal_system,
    make_previous_cycle,
    make_run_sums,
    make_workspace,
    split_time,
)
from .positions_kernels import Limit

# Ratio of the CPU time of a map with derivatives to that of a map without them, both interpreted.
SLOPE_COST_FACTOR = 2.0
# Maximum number of drives whose segments are cached.
MAX_KEPT_DRIVES = 256
# Memory fields that change sign when the motion changes sign.
ODD_MEMORY_FIELDS = ("slide", "direction", "group_slide", "group_sign", "force", "slip")


class PoincarePoint(NamedTuple):
    """State of modes and friction elements at phase 0 of the sinusoidal drive signal.

    - motion: (2 n,) modal coordinates [m] and rates [m/s]
    - memory: of the elements
    - known: reversals, None if they are not computed yet
    """

    motion: np.ndarray
    memory: Memory
    known: tuple | None = None  # None until the reversals have been computed

    @property
    def stored_reversals(self) -> tuple:
        """Interface (d,) and element group (d,) of each stored reversal."""
        return self.known or find_stored_reversals(self.memory)

    @property
    def unknowns(self) -> np.ndarray:
        """Unknowns (2 n + d,): modal motion and relative displacements at the stored reversals."""
        return np.concatenate([self.motion, self.memory.group_slide[self.stored_reversals]])

    def with_unknowns(self, unknowns) -> "PoincarePoint":
        """Return a copy of the state with other unknowns and the same elements in every group."""
        memory = copy_memory(self.memory)
        count = self.motion.size
        reversals = self.stored_reversals
        memory.group_slide[reversals] = unknowns[count:]
        return PoincarePoint(np.array(unknowns[:count]), memory, reversals)


def find_stored_reversals(memory: Memory) -> tuple:
    """Return the interface (d,) and element group (d,) of each reversal stored in a memory."""
    groups = []
    for signs, n_groups in zip(memory.group_sign, memory.n_groups.tolist()):
        groups.append(signs[:n_groups].nonzero()[0])
    if len(groups) == 1:
        return np.zeros_like(groups[0]), groups[0]
    interfaces = np.repeat(np.arange(len(groups)), [indices.size for indices in groups])
    return interfaces, np.concatenate(groups)


def copy_memory(memory: Memory) -> Memory:
    """Return a deep copy of a hysteresis memory."""
    return Memory(*(part.copy() for part in memory))


@dataclass(frozen=True, eq=False, slots=True)
class PeriodMapping:
    """Image of a state under the map over a period.

    - end: the PoincarePoint after a period, or after half of one with the sign changed
    - slope: derivative of the unknowns of `end` with respect to those of the start
    - kept: (k,) indices of the unknowns, of start and end, that are reversals which no slip has passed
    - max_slipping: (i,) largest number of elements that slip at once
    - min_groups: (i,) smallest number of groups
    - extremes: (2,) of the output [m]
    - pieces: number of pieces
    """

    end: PoincarePoint
    slope: np.ndarray
    kept: np.ndarray
    max_slipping: np.ndarray
    min_groups: np.ndarray
    extremes: np.ndarray
    pieces: int


class PeriodMap:
    """Map of the state of modes and friction elements over one period of the drive signal.

    Its arrays are reused for each call.
    """

    def __init__(self, modes: ModalBasis, groups):
        self.march_with_slopes = load("dynamics.events.slope_kernels").march_with_slopes
        self.n = modes.omega.size
        self._set_system(modes, groups)
        faces = len(self.groups)
        self.workspace = make_workspace(self.modal_system)
        self.run_sums = make_run_sums(2, np.zeros(2))
        self.previous = make_previous_cycle(self.modal_system, self.table)
        self.scratch = (
            np.zeros((2, self.n)),
            np.zeros(faces),
            np.zeros_like(self.workspace.coefficients),
        )
        self.motion = np.zeros((2, self.n))
        self.memory = copy_memory(self.rest_memory)
        self.element_counts = np.zeros((2, faces), np.int64)
        self.slope_arrays = {}
        self.drive = None
        self.time_state = None
        self.time_states = {}
        self.python_time = 0.0

    def _set_system(self, modes: ModalBasis, groups) -> None:
        """Set modes and friction elements, and build the arrays that depend on them."""
        self.modes = modes
        self.groups = tuple(groups)
        self.modal_system = make_modal_system(modes)
        self.table = make_element_table(groups)
        self.faces = self.modal_system.interfaces
        self.argument_cache = {}
        self.rest_memory = make_unstretched_memory(self.table, np.zeros(len(self.groups)))

    def replace_system(self, modes: ModalBasis, groups) -> bool:
        """Replace the modes and the friction elements if their numbers stay the same.

        Returns False where their numbers differ from the present ones.
        """
        fits = (
            modes.omega.size == self.n
            and [group.stiffness.size for group in groups] == self.table.n_elements.tolist()
        )
        if fits:
            self._set_system(modes, groups)
        return fits

    def make_rest_point(self) -> PoincarePoint:
        """Return the state at rest with unstretched friction elements."""
        return PoincarePoint(np.zeros(2 * self.n), copy_memory(self.rest_memory))

    def complete_memory(self, point: PoincarePoint) -> Memory:
        """Return the memory of a state, including displacement and slip computed from its motion."""
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
        """Return the arrays for a run that starts from the state of the map.

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

    def start_period(self, drive, point: PoincarePoint) -> None:
        """Set time, sums, motion and memory to the start of a drive period.

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
        time_state.is_at_reversal[:] = 0.0
        run_sums.ledger[:] = 0.0
        run_sums.limits[Limit.N_IDLE] = 0.0
        run_sums.extremes[:] = (np.inf, -np.inf)
        self.workspace.choice.orders[:] = -1.0

    def _set_drive(self, drive) -> None:
        """Set the time to the start of a sinusoidal drive signal.

        Its segments are cached for the next call.
        """
        if id(drive) not in self.time_states:
            if len(drive.segments) != 1:
                raise PatchfemError(
                    "drive: a periodic motion can be computed only if the drive is a single sine "
                    'without end; for this drive use accuracy.method = "march"'
                )
            if len(self.time_states) >= MAX_KEPT_DRIVES:
                self.time_states.clear()
            stiff = max(float(group.stiffness.sum()) for group in self.groups)
            seconds = estimate_cycle_time(
                self.modes, drive, stiff, int(self.table.n_elements.sum())
            )
            self.time_states[id(drive)] = (
                drive,
                make_initial_time_state(drive, len(self.groups)),
                seconds,
            )
        _, time_state, self.python_time = self.time_states[id(drive)]
        if self.time_state is None:
            self.time_state = TimeState(*(part.copy() for part in time_state))
        self.drive = drive
        self.time_state.segments[:] = time_state.segments
        self.time_state.period[:] = time_state.period

    def __call__(
        self, drive, point: PoincarePoint, half: bool, slopes: bool = True
    ) -> PeriodMapping:
        """Map a state over one period or half a period of a sinusoidal drive.

        Parameters
        ----------
        drive
        point : PoincarePoint
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
        counts = self.element_counts
        period = drive.period
        interfaces, group = point.stored_reversals
        size = 2 * n + interfaces.size if slopes else 0
        slope, reversal_slopes, start_slope = self._slope_arrays(size)
        if slopes:
            slope[:] = start_slope
            reversal_slopes[:, : memory.n_groups.max(initial=0)] = 0.0
            reversal_slopes[interfaces, group, np.arange(2 * n, size)] = 1.0
        counts[0] = memory.n_slipping
        counts[1] = memory.n_groups
        self.march_with_slopes.add_python_cost(
            self.python_time * (SLOPE_COST_FACTOR if slopes else 1.0) / (1 + half)
        )
        if size not in self.argument_cache:
            arrays = self.run_arrays(self.modal_system, self.run_sums)
            self.argument_cache[size] = self.march_with_slopes.bind_arguments(
                arrays, slope, reversal_slopes, self.scratch, counts
            )
        pieces = self.march_with_slopes.call_with_bound_args(
            self.argument_cache[size], split_time(period / 2 if half else period, period)
        )
        if pieces < 0:
            raise NotConverged(
                "dynamics: within one period the contact changes between stick and slip more often than "
                "can be computed"
            )
        rows, columns = reversals = find_stored_reversals(memory)
        end = PoincarePoint(self.motion.ravel().copy(), copy_memory(memory), reversals)
        kept_unknowns = 2 * n + (columns < counts[1, rows]).nonzero()[0]
        end_slope = np.concatenate([slope.reshape(2 * n, size), reversal_slopes[rows, columns]])
        if half:
            for odd_part in (
                end.motion,
                end_slope,
                *(getattr(end.memory, name) for name in ODD_MEMORY_FIELDS),
            ):
                np.negative(odd_part, out=odd_part)
        return PeriodMapping(
            end,
            end_slope,
            kept_unknowns,
            *counts.copy(),
            self.run_sums.extremes[0].copy(),
            int(pieces),
        )

    def _slope_arrays(self, size: int) -> tuple:
        """Return arrays for the derivatives by a given number of unknowns.

        They are those of the motion (2, n, size) and of reversal displacements (i, t + 2, size), and the
        former at the start.
        """
        if size not in self.slope_arrays:
            self.slope_arrays[size] = (
                np.zeros((2, self.n, size)),
                np.zeros((*self.memory.group_slide.shape, size)),
                np.eye(2 * self.n, size).reshape(2, self.n, size),
            )
        return self.slope_arrays[size]
