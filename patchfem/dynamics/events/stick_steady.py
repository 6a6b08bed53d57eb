"""Periodic motion behind rigid elements (Coulomb friction), or none, by shooting.

Newton's method finds the fixed point of the map over a period.

Between two events the motion is linear, so its derivative is the exponential of its system without
the sticking interfaces. A perturbation dx moves an event with the condition e by dt = -(grad e .
dx)/e', so dx+ = R (dx + f- dt) - f+ dt with the motions f before and after and R removing the
rates of stopped interfaces (saltation matrix; Leine and Nijmeijer 2004, ch. 7). The eigenvalues of
the product are the Floquet multipliers.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...core import InitialState, ModalBasis, PatchfemError, frozen_array
from ..periodic import MappedPoint, MotionGrows, Shooting
from . import histories
from .positions_kernels import BEGIN, N_COLUMNS, Column, Row

# periods of a run where Newton's method leads away from the periodic motion
MAX_APPROACH_PERIODS = 400


@dataclass(frozen=True, eq=False, slots=True)
class CoulombSteadyState:
    """A periodic motion under Coulomb friction.

    - start: state at phase 0 of the drive
    - residual: |state after a period - start| over the size of the motion
    - multipliers: (2n,) complex Floquet multipliers, the largest first; the motion is stable where
      all magnitudes are below 1; a stuck interface that may rest anywhere in a range keeps a 1
    - amplitude: half the range of the output [m]
    - regime: "stuck", "sliding" (no stop lasts), "n stops" per period of the interface with the
      most, or "unbounded"; start, residual and multipliers of an unbounded motion are those of the
      last period
    - stops: (i,) stops per period that last
    - alone: whether no two events coincide; else the multipliers hold for one order of them
    - iterations: of Newton's method
    """

    start: InitialState
    residual: float
    multipliers: np.ndarray
    amplitude: float
    regime: str
    stops: tuple
    alone: bool
    iterations: int


class CoulombPeriodMapping(NamedTuple):
    """Image of a state (2n,) under the map over some periods.

    - end: the state at the end
    - slope: (2n, 2n) derivative of the map
    - signs: (k, i) signs of slip in the phases between events
    - rubs: (i,) whether the interface has friction
    - swing: half the range of the output [m]
    - sizes: (2n,) sizes of the state on the way
    - first: (n, n) projector of the first phase onto motions that leave the sticking interfaces
      alone
    - alone: see `SteadyState`
    """

    end: np.ndarray
    slope: np.ndarray
    signs: np.ndarray
    rubs: np.ndarray
    swing: float
    sizes: np.ndarray
    first: np.ndarray
    alone: bool


class LinearPhase:
    """Motion from one event to the next, in which the same interfaces stick.

    run: the run; row: first row of the phase; span: duration [s].
    """

    def __init__(self, run, row, span: float):
        modes = run.modes
        modal_system = run.modal_system
        n = run.modes.omega.size
        self.run = run
        self.row = row
        self.span = span
        at = run._column(0, 0)
        columns = row[at:].reshape(len(run.groups), N_COLUMNS)
        self.held = np.isinf(columns[:, Column.STIFFNESS])
        self.signs = columns[:, Column.DIRECTION]
        rows = modal_system.interfaces[self.held]
        self.pinv = np.linalg.pinv(rows, rcond=1e-10)
        self.project = np.eye(n) - self.pinv @ rows
        if len(rows) and np.abs(self.project).max() < 1e-9:
            self.project = np.zeros((n, n))
        self.given = (
            np.where(self.held, 0.0, columns[:, Column.FORCE])
            @ modal_system.interfaces
            / modes.mass
        )
        self.square = np.diag(modes.omega**2)
        self.dampers = np.asarray(modes.damping_matrix, float)

    def slope(self) -> np.ndarray:
        """Return the derivative (2n, 2n) of the end state with respect to the start state."""
        n = len(self.square)
        p = self.project
        system_matrix = np.block([[np.zeros((n, n)), p], [-p @ self.square, -p @ self.dampers]])
        return exponentiate_modal_matrix(system_matrix * self.span) @ self.taken_out()

    def taken_out(self) -> np.ndarray:
        """Return the derivative (2n, 2n) of a state whose sticking interfaces come to rest."""
        out = np.eye(2 * len(self.square))
        out[len(self.square) :, len(self.square) :] = self.project
        return out

    def acceleration(self, z, v, drive: float) -> tuple:
        """Return the modal accelerations with and without the reactions.

        Parameters
        ----------
        z : ndarray
            (n,) coordinates [m].
        v : ndarray
            (n,) rates [m/s].
        push : float
            Drive [m s-2].

        Returns
        -------
        with_reactions, without_reactions : ndarray
            (n,) [m s-2].
        """
        free_acceleration = (
            -self.square @ z - self.dampers @ v - self.run.modes.base * drive - self.given
        )
        return self.project @ free_acceleration, free_acceleration

    def saltation(self, later: "LinearPhase") -> tuple:
        """Return the saltation matrix of the event at the end.

        The second value tells whether only one interface changed.
        """
        run = self.run
        modes = self.run.modes
        n = len(self.square)
        row = later.row
        z = row[Row.MOTION : Row.MOTION + n]
        v = row[Row.MOTION + n : Row.MOTION + 2 * n]
        segment = run.drive.segments[0]
        drive = segment.constant + segment.amplitude * np.sin(row[Row.PHASE])
        drive_rate = segment.amplitude * segment.omega * np.cos(row[Row.PHASE])
        before, free_acceleration = self.acceleration(z, v, drive)
        changed = self.signs != later.signs
        interface, stops = _identify_event(
            self, later, changed, modes.mass * free_acceleration @ self.pinv
        )
        gradient = np.zeros(2 * n)
        static = run.table.static_limit[interface]
        kinetic = run.table.kinetic_limit[interface]
        if stops:
            gradient[n:] = run.modal_system.interfaces[interface]
            speed = float(run.modal_system.interfaces[interface] @ before)
        else:
            reaction_row = self.pinv[:, np.flatnonzero(self.held) == interface][:, 0]
            gradient[:n] = -reaction_row @ self.square
            gradient[n:] = -reaction_row @ self.dampers
            speed = float(
                gradient[:n] @ v + gradient[n:] @ before - reaction_row @ modes.base * drive_rate
            )
        jump = np.zeros(2 * n)
        if stops or static != kinetic:  # else nothing jumps at a release
            jump[n:] = before - later.acceleration(z, v, drive)[0]
        matrix = later.taken_out()
        if speed != 0:
            matrix -= np.outer(matrix @ jump, gradient) / speed
        changes = (self.signs != 0) & (self.signs != later.signs)
        changes[interface] = False
        return matrix, not changes.any()


def exponentiate_modal_matrix(matrix) -> np.ndarray:
    """Return the exponential of a small matrix (2n, 2n) of coordinates and rates.

    Taylor's series of 2^-s of the matrix, squared s times. SciPy's function starts the threads of
    its linear algebra, which takes up to milliseconds for two rows.
    """
    n = len(matrix) // 2
    sizes = np.abs(matrix)
    # of rates
    scale = np.sqrt(max(float(sizes.max()), 1e-300) / max(float(sizes[:n].max()), 1e-300))
    weight = np.repeat([scale, 1.0], n)
    balanced = matrix * (weight[:, None] / weight)
    n_squarings = max(
        0, int(np.ceil(np.log2(max(float(np.abs(balanced).sum(axis=0).max()), 1e-300)))) + 1
    )
    balanced = balanced / 2.0**n_squarings
    exponential = np.eye(len(matrix))
    for k in range(16, 0, -1):
        exponential = np.eye(len(matrix)) + balanced @ exponential / k
    for _ in range(n_squarings):
        exponential = exponential @ exponential
    return exponential * (weight / weight[:, None])


def _identify_event(phase: LinearPhase, next_phase: LinearPhase, changed, reactions) -> tuple:
    """Return the interface of the event between two phases and whether its slip stopped.

    reactions: (h,) [N] of the sticking interfaces.
    """
    stopped = np.flatnonzero(changed & (phase.signs != 0))
    if stopped.size:
        return int(stopped[0]), True
    limits = phase.run.table.static_limit[phase.held]
    distance_to_limit = np.abs(np.abs(reactions) / np.maximum(limits, 1e-300) - 1)
    distance_to_limit[~changed[phase.held]] = np.inf
    return int(np.flatnonzero(phase.held)[int(np.argmin(distance_to_limit))]), False


def map_period(modes: ModalBasis, drive, groups, state, periods: int = 1) -> CoulombPeriodMapping:
    """Map a state over whole periods of the drive, with the derivative.

    Parameters
    ----------
    modes : ModalBasis
    drive
    groups : sequence of Elements
        One for every interface, rigid elements alone.
    state : ndarray
        (2n,) modal coordinates [m] and rates [m/s] at the start of the drive.
    periods : int, optional

    Returns
    -------
    CoulombPeriodMapping
        Its slope is the product of those of the phases and of the saltation matrices of the
        events.
    """
    n = modes.omega.size
    run = histories.start_event_run(
        modes, drive, groups, periods, periods, start=InitialState(state[:n], state[n:])
    )
    collected_rows = []
    run.run_to(periods, lambda rows: collected_rows.append(rows.copy()))
    rows = np.concatenate(collected_rows)
    borders = np.flatnonzero(rows[1:, Row.BEGIN] >= BEGIN.stick_or_slip) + 1
    phases = []
    for first, end in pairwise([0, *borders.tolist(), len(rows)]):
        phases.append(LinearPhase(run, rows[first], float(rows[first:end, Row.DURATION].sum())))
    slope = phases[0].slope()
    has_single_events = True
    for before, after in pairwise(phases):
        if np.any(before.signs != after.signs):
            saltation, is_single = before.saltation(after)
            slope = saltation @ slope
            has_single_events = has_single_events and is_single
        slope = after.slope() @ slope
    owner = np.repeat(np.arange(len(rows)), 3)
    dense = run.evaluate_rows(
        rows, owner, np.tile([0.0, 0.5, 1.0], len(rows)) * rows[owner, Row.DURATION]
    )
    magnitudes = np.abs(dense[:, : 2 * n]).max(axis=0)
    sizes = [max(float(half.max()), 1e-300) for half in (magnitudes[:n], magnitudes[n:])]
    extremes = run.run_sums.extremes
    return CoulombPeriodMapping(
        run.motion.ravel().copy(),
        slope,
        np.array([phase.signs for phase in phases]),
        run.table.static_limit > 0,
        float(extremes[:, 1].max() - extremes[:, 0].min()) / 2,
        np.repeat(sizes, n),
        phases[0].project,
        has_single_events,
    )


def solve_steady(
    modes: ModalBasis,
    drive,
    groups,
    start: InitialState | None = None,
    cycles: int = 30,
    periods: int = 1,
) -> CoulombSteadyState:
    """Find the periodic response to a sine under Coulomb friction.

    Parameters
    ----------
    modes : ModalBasis
    drive
        One segment, a sine.
    groups : sequence of Elements
        See `map_period`.
    start : InitialState, optional
        At rest by default.
    cycles : int, optional
        Periods of the run that leads to the start of Newton's method.
    periods : int, optional
        Periods of the drive after which the motion repeats.

    Returns
    -------
    SteadyState

    Raises
    ------
    NotConverged
        As `periodic.Shooting.find_periodic_point`.
    PatchfemError
        If the drive does not repeat.
    """
    if len(drive.segments) != 1:
        raise PatchfemError(
            "drive: a periodic response can be computed only if the drive is a single sine without "
            'end; for this drive use accuracy.method = "march"'
        )
    n = modes.omega.size
    begin = np.zeros(2 * n) if start is None else np.concatenate([start.z, start.v])
    shooting = CoulombShooting(modes, drive, groups, periods)
    try:
        periodic_point = shooting.find_periodic_point(
            shooting.run(begin, cycles), (2 * cycles, MAX_APPROACH_PERIODS)
        )
    except MotionGrows as error:
        return _make_steady(error.mapped_point, n, "unbounded", error.n_steps)
    return _make_steady(periodic_point.mapped_point, n, None, periodic_point.n_steps)


class CoulombShooting(Shooting):
    """Shooting with the map from event to event over periods, see `solve_steady`."""

    def __init__(self, modes: ModalBasis, drive, groups, periods: int = 1):
        self.modes = modes
        self.drive = drive
        self.groups = groups
        self.periods = periods
        part = drive.segments[0]
        self.moved_by = max(
            abs(part.amplitude) / part.omega**2 * float(np.abs(modes.base).max()), 1e-300
        )

    def map_point(self, point) -> MappedPoint:
        """Return the map of a state (2n,)."""
        mapping = map_period(self.modes, self.drive, self.groups, point, self.periods)
        return MappedPoint(
            point,
            mapping,
            mapping.slope,
            mapping.sizes,
            (point - mapping.end) / mapping.sizes,
            mapping.sizes[0] / self.moved_by,
        )

    def step_from(self, mapped_point: MappedPoint, step):
        """Return the state a step away, in which the sticking interfaces stay at rest."""
        n = self.modes.omega.size
        out = mapped_point.point + step
        out[n:] = mapped_point.image.first @ out[n:]
        return out

    def run_from(self, mapped_point: MappedPoint, n_periods: int):
        """Return the state that a run from that of a map reaches after some periods."""
        return self.run(mapped_point.point, n_periods)

    def run(self, state, n_periods: int):
        """Return the state after some periods."""
        n = self.modes.omega.size
        run = histories.start_event_run(
            self.modes, self.drive, self.groups, n_periods, start=InitialState(state[:n], state[n:])
        )
        run.run_to(n_periods)
        return run.motion.ravel().copy()


def _make_steady(mapped_point: MappedPoint, n: int, regime, used: int) -> CoulombSteadyState:
    mapping = mapped_point.image
    state = mapped_point.point
    is_stop = (mapping.signs[:-1] != 0) & (mapping.signs[1:] == 0)
    stops = tuple(np.count_nonzero(is_stop, axis=0).tolist())
    if regime is None:
        signs = mapping.signs[:, mapping.rubs]
        max_stops = max(stops)
        slips = bool(np.any(signs != 0)) or signs.shape[1] == 0
        rests = bool(np.any(signs == 0))
        if not slips:
            regime = "stuck"
        elif not rests:
            regime = "sliding"
        else:
            regime = f"{max_stops} stop{'s' if max_stops != 1 else ''}"
    return CoulombSteadyState(
        InitialState(frozen_array(state[:n]), frozen_array(state[n:])),
        mapped_point.max_residual,
        frozen_array(mapped_point.multipliers(), complex),
        mapping.swing,
        regime,
        stops,
        mapping.alone,
        used,
    )
