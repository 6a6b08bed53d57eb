"""Periodic motion of modes with elastic-plastic friction elements, by shooting.

Newton's method finds the fixed point of the map over a period.

The law is odd and a sine changes sign after half a period, so there is a motion that does so too.
It is the fixed point of the map over half a period with the sign changed; its elements are those
that a slowly increasing drive leaves behind, and its multipliers are the squares of those of the
half. Elements that never slip within a cycle are springs: their own memory, an offset that no
cycle changes (multiplier 1), is not part of the state.
"""

from dataclasses import dataclass

import numpy as np

from ...core import InitialState, ModalBasis, frozen_array
from ..periodic import MappedPoint, PeriodicPoint, Shooting, bound_error
from .elements import Memory
from .period import PeriodMap, PeriodMapping, PoincarePoint, copy_memory

# Number of periods that are integrated to obtain the start of Newton's method.
N_APPROACH_PERIODS = 4
# Tolerance for round-off on the slipping fraction of the friction limit when all interfaces slide.
FULL_SLIP_TOL = 1e-12


@dataclass(frozen=True, eq=False, slots=True)
class SteadyState:
    """Periodic motion of modes with elastic-plastic friction elements.

    - point, start, memory: state at phase 0 of the drive
    - residual: |state after a period - start| relative to the size of the motion
    - multipliers: (m,) complex Floquet multipliers of motion and reversal displacements, the largest first;
      the motion is stable if all magnitudes are below 1
    - amplitude: half the range of the output [m]
    - slipping: fraction of the friction limit of all interfaces that slips within a cycle
    - symmetric: whether it changes sign after half a period
    - iterations: of Newton's method
    """

    point: PoincarePoint
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
        """Relative error of the motion that is due to the residual of Newton's method.

        See `periodic.bound_error`.
        """
        return bound_error(self.residual, self.multipliers)

    @property
    def regime(self) -> str:
        """State of the interfaces: "stuck", "partial slip", or "slides" if all of them slip."""
        if self.slipping == 0:
            return "stuck"
        return "slides" if self.slipping > 1 - FULL_SLIP_TOL else "partial slip"


def solve_steady(
    modes: ModalBasis, drive, groups, near: PoincarePoint | None = None
) -> SteadyState:
    """Find the periodic response to a sinusoidal drive signal that reverses sign after half a period.

    Parameters
    ----------
    modes : ModalBasis
    drive
        One segment, a sine.
    groups : sequence of Elements
        One for every interface.
    near : PoincarePoint, optional
        Start of the search, rest by default.

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
    period_map = PeriodMap(modes, groups)
    return _make_steady(period_map, *find_antisymmetric_motion(period_map, drive, near), True)


def continue_to_steady_state(
    modes: ModalBasis, drive, groups, start: InitialState, memory: Memory
) -> SteadyState:
    """Find the periodic motion that a run approaches from a given state.

    The result is valid if the groups of elements no longer change on the way to that motion.

    Parameters
    ----------
    modes, drive, groups
        See `solve_steady`.
    start : InitialState
        State at phase 0 of the drive.
    memory : Memory

    Returns
    -------
    SteadyState

    Raises
    ------
    NotConverged
        As `solve_steady`.
    """
    period_map = PeriodMap(modes, groups)
    shooting = YieldShooting(period_map, drive, False)
    point = PoincarePoint(np.concatenate([start.z, start.v]), memory)
    return _make_steady(period_map, *shooting.find_periodic_point(point), False)


def find_antisymmetric_motion(
    period_map: PeriodMap, drive, near: PoincarePoint | None = None
) -> PeriodicPoint:
    """Find the periodic motion that reverses its sign after half a period, by shooting.

    Parameters
    ----------
    period_map : PeriodMap
    drive
    near : PoincarePoint, optional
        Start of the search, rest by default.

    Returns
    -------
    PeriodicPoint
    """
    shooting = YieldShooting(period_map, drive, True)
    return shooting.find_periodic_point(
        near or shooting.run(period_map.make_rest_point(), N_APPROACH_PERIODS)
    )


class YieldShooting(Shooting):
    """Shooting method for periodic motions with elastic-plastic elements.

    If `half` is set, the map covers half a period and changes the sign.

    The unknowns of a PoincarePoint are its motion and its reversal displacements; they match those of another point
    whose reversal displacements are of the same kind. Every group has the elements that it has at the end
    of the run: they follow from the motion.
    """

    def __init__(self, period_map: PeriodMap, drive, half: bool):
        part = drive.segments[0]
        moved = (
            abs(part.amplitude) / part.omega**2 * float(np.abs(period_map.modal_system.base).max())
        )
        self.period_map = period_map
        self.drive = drive
        self.half = half
        self.moved_by = max(moved, 1e-300)
        self.rows = np.maximum(np.abs(period_map.faces).sum(axis=1), 1e-300)

    def map_point(self, point: PoincarePoint) -> MappedPoint:
        """Map a state over the period; raise NotConverged if events accumulate in time."""
        mapping = self.period_map(self.drive, point, self.half)
        n = self.period_map.n
        omega = self.drive.segments[0].omega
        a = point.motion
        b = mapping.end.motion
        magnitudes = np.abs([a, b])
        motion_size = max(
            float(magnitudes[:, :n].max()), float(magnitudes[:, n:].max()) / omega, 1e-300
        )
        scale = np.repeat([motion_size, motion_size * omega], n)
        has_same_unknowns = _have_same_unknowns(point, mapping.end)
        if has_same_unknowns:
            scale = np.concatenate([scale, motion_size * self.rows[point.stored_reversals[0]]])
            a = point.unknowns
            b = mapping.end.unknowns
        return MappedPoint(
            point,
            mapping,
            mapping.slope,
            scale,
            (a - b) / scale,
            motion_size / self.moved_by,
            has_same_unknowns,
            has_same_unknowns and _have_same_elements(point, mapping.end),
            mapping.kept,
        )

    def move_by_newton_step(self, mapped_point: MappedPoint, step) -> PoincarePoint:
        """Return the state after a Newton step, with the element groups at the end of the period."""
        return mapped_point.image.end.with_unknowns(mapped_point.point.unknowns + step)

    def march_periods(self, mapped_point: MappedPoint, n_periods: int) -> PoincarePoint:
        """Integrate over several periods after a mapped period; return the state at the end."""
        return self.run(self._make_next_start(mapped_point.image), n_periods)

    def run(self, point: PoincarePoint, n_periods: int) -> PoincarePoint:
        """Integrate a state over several periods; return the state at the end."""
        for _ in range(2 * n_periods if self.half else n_periods):
            point = self._make_next_start(self.period_map(self.drive, point, self.half, False))
        return point

    def _make_next_start(self, mapping: PeriodMapping) -> PoincarePoint:
        """Return the end state of a mapped period as the start of the next one.

        For a motion that changes sign, reversal displacements that no slip has passed are removed, as if
        their elements had never slipped.
        """
        if not self.half or not mapping.min_groups.any():
            return mapping.end
        memory = copy_memory(mapping.end.memory)
        for f, n_kept in enumerate(mapping.min_groups):
            if n_kept:
                for array in (memory.group_end, memory.group_slide, memory.group_sign):
                    array[f, 1 : 1 + memory.n_groups[f] - n_kept] = array[
                        f, n_kept : memory.n_groups[f]
                    ].copy()
                memory.group_end[f, 0] = self.period_map.table.n_elements[f]
                memory.group_slide[f, 0] = 0.0
                memory.group_sign[f, 0] = 0.0
                memory.n_groups[f] += 1 - n_kept
        return PoincarePoint(mapping.end.motion, memory)


def _have_same_unknowns(point: PoincarePoint, end: PoincarePoint) -> bool:
    """Return whether two states have the same unknowns: equally many reversals with equal signs."""
    a = point.memory
    b = end.memory
    return _have_same_groups(a, b, a.group_sign, b.group_sign)


def _have_same_elements(point: PoincarePoint, end: PoincarePoint) -> bool:
    """Return whether two states have equal element groups and the same slipping elements."""
    a = point.memory
    b = end.memory
    return (
        a.n_slipping.tolist() == b.n_slipping.tolist()
        and a.direction.tolist() == b.direction.tolist()
        and _have_same_groups(a, b, a.group_end, b.group_end)
    )


def _have_same_groups(a: Memory, b: Memory, values, other_values) -> bool:
    """Return whether two memories have equally many element groups with equal values (i, t)."""
    n_groups = a.n_groups.tolist()
    if n_groups != b.n_groups.tolist():
        return False
    is_group = np.arange(values.shape[1]) < a.n_groups[:, None]
    return np.array_equal(values[is_group], other_values[is_group])


def _make_steady(
    period_map: PeriodMap, mapped_point: MappedPoint, used: int, half: bool
) -> SteadyState:
    point = mapped_point.point
    mapping = mapped_point.image
    multipliers = mapped_point.multipliers()
    minimum, maximum = mapping.extremes
    limits = period_map.table.limit_sum
    n = period_map.n
    slipping_limit = limits[np.arange(len(limits)), mapping.max_slipping].sum()
    slipping = slipping_limit / max(limits[:, -1].sum(), 1e-300)
    start = InitialState(frozen_array(point.motion[:n]), frozen_array(point.motion[n:]))
    return SteadyState(
        point,
        start,
        period_map.complete_memory(point),
        mapped_point.max_residual,
        frozen_array(multipliers**2 if half else multipliers, complex),
        float(max(maximum, -minimum) if half else (maximum - minimum) / 2),
        float(slipping),
        half,
        used,
    )
