"""Antisymmetric periodic motions under a sinusoidal drive signal, and their measured quantities."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...compiled import load
from ...core import InitialState, ModalBasis, NotConverged, Response
from ...cost_model import PYTHON_READ_TIME_RATIO
from . import histories
from .elements import Memory
from .modal_system import make_modal_system, make_run_sums
from .period import PeriodMap, PoincarePoint
from .positions_kernels import MARCH_STATUS, N_COLUMNS, Limit, Row
from .steady import find_antisymmetric_motion

# Initial number of rows for the time intervals of half a period; it is
# doubled when it does not suffice.
INITIAL_ROWS = 256


class PeriodicMotion(NamedTuple):
    """Measured quantities of a periodic motion.

    - point: state at phase 0 of the drive
    - acceleration: largest absolute acceleration of the output [m s-2]
    - fundamental: its first harmonic [m s-2]
    - displacement: half the range of the gauge [m]
    """

    point: PoincarePoint
    acceleration: float
    fundamental: complex
    displacement: float


class PeriodicMotionFinder:
    """Finder of periodic motions that reverse their sign after half a period.

    A call with a drive (core.SineDrive) and a PoincarePoint near its motion, or None for rest, returns a
    PeriodicMotion; it raises the errors of `steady.solve_steady`. A PoincarePoint of other elements is
    ignored.
    """

    def __init__(self, modes: ModalBasis, groups):
        self.kernels = load("dynamics.events.march_kernels")
        self.period_map = PeriodMap(modes, groups)
        self.march = self.kernels.march
        self.peak = load("dynamics.events.dense_kernels").find_peaks
        self.n_columns = Row.MOTION + 2 * modes.omega.size + N_COLUMNS * len(groups)
        self.rows = np.zeros((INITIAL_ROWS, self.n_columns))
        self.run_sums = make_run_sums(1, np.ones(1))
        self.forces = np.zeros(len(groups))
        self._set_system(modes)

    def _set_system(self, modes: ModalBasis) -> None:
        """Set the modes and build the arrays that depend on them."""
        self.modes = modes
        self.argument_cache = {}
        self.gauge = (
            None if modes.gauge is None else make_modal_system(replace(modes, output=modes.gauge))
        )

    def replace_system(self, modes: ModalBasis, groups) -> bool:
        """Replace the modes and the friction elements, but keep the workspace.

        Returns False if they do not fit.
        """
        fits = self.period_map.replace_system(modes, groups)
        if fits:
            self._set_system(modes)
        return fits

    def __call__(self, drive, near: PoincarePoint | None = None) -> PeriodicMotion:
        period_map = self.period_map
        point = find_antisymmetric_motion(
            period_map, drive, near if self._is_compatible(near) else None
        )[0].point
        n_rows, peak_output = self._march_half_period(drive, point, period_map.modal_system)
        self.peak.add_python_cost(PYTHON_READ_TIME_RATIO * period_map.python_time / 2)
        peak_acceleration = self.peak.call_with_bound_args(
            self._bound_arguments("peak", period_map.modal_system, float(drive.moving)),
            self.rows[:n_rows],
        )
        fundamental = (
            -2 * drive.omega**2 * complex(*self.run_sums.phasors[0])
            - 1j * drive.acceleration * drive.moving
        )
        if self.gauge is not None:
            peak_output = self._march_half_period(drive, point, self.gauge)[1]
        return PeriodicMotion(point, float(peak_acceleration), fundamental, peak_output)

    def window(self, drive, point: PoincarePoint) -> Response:
        """Return the histories over one period of a periodic motion, given its start point."""
        n = self.period_map.n
        memory = self.period_map.complete_memory(point)
        start = InitialState(point.motion[:n], point.motion[n:])
        return histories.simulate(
            self.modes, drive, self.period_map.groups, 1.0, 1, np.inf, 0, None, start, memory
        ).window

    def _is_compatible(self, near: PoincarePoint | None) -> bool:
        """Return whether a start point fits the present modes and friction elements."""
        rest_memory = self.period_map.rest_memory
        n_elements = self.period_map.table.n_elements
        return (
            near is not None
            and near.motion.size == 2 * self.period_map.n
            and near.memory.group_slide.shape == rest_memory.group_slide.shape
            and np.array_equal(_count_elements(near.memory), n_elements)
        )

    def _march_half_period(self, drive, point: PoincarePoint, modal_system) -> tuple:
        """March over half a period; return the number of time intervals and the peak output [m].

        The time intervals are stored in `rows`; the other half of the period changes sign.
        """
        period_map = self.period_map
        run_sums = self.run_sums
        stop = (0.0, drive.period / 2)
        while True:
            period_map.start_period(drive, point)
            self.march.add_python_cost(period_map.python_time / 2)
            run_sums.ledger[:] = 0.0
            run_sums.phasors[:] = 0.0
            run_sums.limits[Limit.N_IDLE] = 0.0
            run_sums.extremes[:] = (np.inf, -np.inf)
            status, n_rows = self.march.call_with_bound_args(
                self._bound_arguments("march", modal_system), stop
            )
            if status == MARCH_STATUS.done:
                return n_rows, float(max(run_sums.extremes[0, 1], -run_sums.extremes[0, 0]))
            if status != MARCH_STATUS.full:
                raise NotConverged(
                    "dynamics: within a period the contact changes between stick and slip again and "
                    "again without time passing"
                )
            self.rows = np.zeros((2 * len(self.rows), self.n_columns))
            self.argument_cache = {}

    def _bound_arguments(self, name: str, modal_system, moving: float = 0.0) -> tuple:
        """Return the arguments that are bound to a compiled function, from a cache."""
        period_map = self.period_map
        key = (name, id(modal_system), moving)
        if key not in self.argument_cache:
            arrays = period_map.run_arrays(modal_system, self.run_sums)
            if name == "peak":
                self.argument_cache[key] = self.peak.bind_arguments(moving, arrays, self.forces)
            else:
                self.argument_cache[key] = self.march.bind_arguments(arrays, self.rows)
        return self.argument_cache[key]


def _count_elements(memory: Memory) -> np.ndarray:
    """Return the number (i,) of friction elements at each interface, given their memory."""
    return np.where(memory.n_groups > 0, memory.group_end[:, 0], memory.n_slipping)
