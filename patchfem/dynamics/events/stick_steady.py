"""Periodic motion of a rig with Coulomb friction, or without friction, by shooting.

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
from .positions_kernels import N_COLUMNS, ROW_BEGIN, Column, Row

# Maximum number of integrated periods when Newton's method leads away from the periodic motion.
MAX_APPROACH_PERIODS = 400


@dataclass(frozen=True, eq=False, slots=True)
class CoulombSteadyState:
    """Periodic motion under Coulomb friction.

    - start: state at phase 0 of the drive
    - residual: |state after a period - start| relative to the size of the motion
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
    """Image of a state (2n,) under the map over one or more periods of the drive signal.

    - end: the state at the end
    - slope: (2n, 2n) derivative of the map
    - signs: (k, i) signs of slip in the phases between events
    - has_friction: (i,) whether the interface has friction
    - output_amplitude: half the range of the output [m]
    - sizes: (2n,) sizes of the state on the way
    - first_projector: (n, n) projector of the first phase onto motions that leave the sticking interfaces
      alone
    - alone: see `SteadyState`
    """

    end: np.ndarray
    slope: np.ndarray
    signs: np.ndarray
    has_friction: np.ndarray
    output_amplitude: float
    sizes: np.ndarray
    first_projector: np.ndarray
    alone: bool


class LinearPhase:
    """Linear motion between two successive events, during which the same interfaces stick.

    run: the run; row: first row of the phase; span: duration [s].
    """

    def __init__(self, run, row, span: float):
        modes = run.modes
        modal_system = run.modal_system
        n = run.modes.omega.size
        self.run = run
        self.row = row
        self.span = span
        at = run._column_index(0, 0)
        columns = row[at:].reshape(len(run.groups), N_COLUMNS)
        self.is_sticking = np.isinf(columns[:, Column.STIFFNESS])
        self.signs = columns[:, Column.DIRECTION]
        rows = modal_system.interfaces[self.is_sticking]
        self.pseudo_inverse = np.linalg.pinv(rows, rcond=1e-10)
        self.projector = np.eye(n) - self.pseudo_inverse @ rows
        if len(rows) and np.abs(self.projector).max() < 1e-9:
            self.projector = np.zeros((n, n))
        self.friction_accel = (
            np.where(self.is_sticking, 0.0, columns[:, Column.FORCE])
            @ modal_system.interfaces
            / modes.mass
        )
        self.stiffness_matrix = np.diag(modes.omega**2)
        self.damping_matrix = np.asarray(modes.damping_matrix, float)

    def slope(self) -> np.ndarray:
        """Return the derivative (2n, 2n) of the end state by the start state."""
        n = len(self.stiffness_matrix)
        p = self.projector
        system_matrix = np.block(
            [[np.zeros((n, n)), p], [-p @ self.stiffness_matrix, -p @ self.damping_matrix]]
        )
        return exponentiate_modal_matrix(system_matrix * self.span) @ self.stick_projection()

    def stick_projection(self) -> np.ndarray:
        """Return the matrix (2n, 2n) that projects a state onto zero velocity at sticking interfaces."""
        projection = np.eye(2 * len(self.stiffness_matrix))
        projection[len(self.stiffness_matrix) :, len(self.stiffness_matrix) :] = self.projector
        return projection

    def acceleration(self, z, v, drive: float) -> tuple:
        """Return the modal accelerations with and without the reactions of sticking interfaces.

        Parameters
        ----------
        z : ndarray
            (n,) coordinates [m].
        v : ndarray
            (n,) rates [m/s].
        drive : float
            Drive [m s-2].

        Returns
        -------
        with_reactions, without_reactions : ndarray
            (n,) [m s-2].
        """
        free_acceleration = (
            -self.stiffness_matrix @ z
            - self.damping_matrix @ v
            - self.run.modes.base * drive
            - self.friction_accel
        )
        return self.projector @ free_acceleration, free_acceleration

    def saltation(self, later: "LinearPhase") -> tuple:
        """Return the saltation matrix (2n, 2n) for the event at the end of this phase.

        The second value tells whether only one interface changed.
        """
        run = self.run
        modes = self.run.modes
        n = len(self.stiffness_matrix)
        row = later.row
        z = row[Row.MOTION : Row.MOTION + n]
        v = row[Row.MOTION + n : Row.MOTION + 2 * n]
        segment = run.drive.segments[0]
        drive = segment.constant + segment.amplitude * np.sin(row[Row.PHASE])
        drive_rate = segment.amplitude * segment.omega * np.cos(row[Row.PHASE])
        before, free_acceleration = self.acceleration(z, v, drive)
        changed = self.signs != later.signs
        interface, stops = _identify_event(
            self, later, changed, modes.mass * free_acceleration @ self.pseudo_inverse
        )
        gradient = np.zeros(2 * n)
        static = run.table.static_limit[interface]
        kinetic = run.table.kinetic_limit[interface]
        if stops:
            gradient[n:] = run.modal_system.interfaces[interface]
            speed = float(run.modal_system.interfaces[interface] @ before)
        else:
            reaction_row = self.pseudo_inverse[:, np.flatnonzero(self.is_sticking) == interface][
                :, 0
            ]
            gradient[:n] = -reaction_row @ self.stiffness_matrix
            gradient[n:] = -reaction_row @ self.damping_matrix
            speed = float(
                gradient[:n] @ v + gradient[n:] @ before - reaction_row @ modes.base * drive_rate
            )
        jump = np.zeros(2 * n)
        # Nothing jumps at a release if both limits are equal.
        if stops or static != kinetic:
            jump[n:] = before - later.acceleration(z, v, drive)[0]
        matrix = later.stick_projection()
        if speed != 0:
            matrix -= np.outer(matrix @ jump, gradient) / speed
        changes = (self.signs != 0) & (self.signs != later.signs)
        changes[interface] = False
        return matrix, not changes.any()


def exponentiate_modal_matrix(matrix) -> np.ndarray:
    """Return the exponential of a small matrix (2n, 2n) that acts on modal coordinates and rates.

    Taylor's series of 2^-s of the matrix, squared s times. SciPy's function starts the threads of
    its linear algebra, which takes up to milliseconds for two rows.
    """
    n = len(matrix) // 2
    sizes = np.abs(matrix)
    # The scale gives coordinates and rates a similar size.
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
    """Identify the event between two phases: return its interface and whether slip stopped there.

    reactions: (h,) [N] of the sticking interfaces.
    """
    stopped = np.flatnonzero(changed & (phase.signs != 0))
    if stopped.size:
        return int(stopped[0]), True
    limits = phase.run.table.static_limit[phase.is_sticking]
    distance_to_limit = np.abs(np.abs(reactions) / np.maximum(limits, 1e-300) - 1)
    distance_to_limit[~changed[phase.is_sticking]] = np.inf
    return int(np.flatnonzero(phase.is_sticking)[int(np.argmin(distance_to_limit))]), False


def map_period(modes: ModalBasis, drive, groups, state, periods: int = 1) -> CoulombPeriodMapping:
    """Map a state over complete periods of the drive signal, and compute the derivative of the map.

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
    borders = np.flatnonzero(rows[1:, Row.BEGIN] >= ROW_BEGIN.stick_or_slip) + 1
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
        phases[0].projector,
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
    """Find the periodic response to a sinusoidal drive signal under Coulomb friction.

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
    """Shooting method for periodic motions under Coulomb friction (see `solve_steady`)."""

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
        """Map a state (2n,) over the given number of periods."""
        mapping = map_period(self.modes, self.drive, self.groups, point, self.periods)
        return MappedPoint(
            point,
            mapping,
            mapping.slope,
            mapping.sizes,
            (point - mapping.end) / mapping.sizes,
            mapping.sizes[0] / self.moved_by,
        )

    def move_by_newton_step(self, mapped_point: MappedPoint, step):
        """Return the state after a Newton step that keeps the sticking interfaces at rest."""
        n = self.modes.omega.size
        state = mapped_point.point + step
        state[n:] = mapped_point.image.first_projector @ state[n:]
        return state

    def march_periods(self, mapped_point: MappedPoint, n_periods: int):
        """Integrate over several periods from a mapped state; return the state at the end."""
        return self.run(mapped_point.point, n_periods)

    def run(self, state, n_periods: int):
        """Integrate a state over several periods; return the state at the end."""
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
        signs = mapping.signs[:, mapping.has_friction]
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
        mapping.output_amplitude,
        regime,
        stops,
        mapping.alone,
        used,
    )
