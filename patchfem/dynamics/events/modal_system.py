"""Arrays of the compiled event-driven solver: modes, time, sums and workspace."""

from typing import NamedTuple

import numpy as np

from ...compiled import get_kernel_module
from ...core import ModalBasis, PatchfemError
from .elements import ElementTable, Memory, make_unstretched_memory
from .positions_kernels import (
    SEGMENT_KIND,
    ConstraintStatus,
    Ledger,
    Limit,
    PreviousStatus,
    Segment,
    Time,
)

# Largest relative deviation from an integer, due to round-off, of the number
# of drive revolutions per cycle.
INTEGER_TOL = 4e-15
# Number of bits of the leading part of the revolutions per cycle; its product with a number of
# cycles is exact in double precision.
REVOLUTION_BITS = 24

series_kernels = get_kernel_module("dynamics.events.series_kernels")


class ModalSystem(NamedTuple):
    """Modal matrices and participation factors as arrays for the kernels.

    The kernels take the number of modes from the length of `omega_squared`, and that of interfaces
    from `inverse_mass`. Of one mode with one interface both are tuples: their length is then part
    of their type, and the same text is compiled for one of each, which is three times as fast.

    - omega_squared: (n,) squares of the natural frequencies [1/s2]
    - damping: (n, n) damping matrix D [1/s]; is_coupled: whether it is more than its diagonal
    - base, output: (n,) excitation by the base, and participation of the output [1]
    - interfaces: (i, n) relative displacement of every interface per modal coordinate [1]
    - inverse_mass: (i,) |row of interfaces|^2/mass [1/kg]; a spring there adds it times its
      stiffness to a squared rate
    - mass: modal mass [kg]
    - max_omega_squared, damping_norm: norms of the stiffness [1/s2] and of the damping [1/s] of the
      modes
    - output_interface: number of an interface that moves as the output does, -1 where none does
    """

    omega_squared: np.ndarray
    damping: np.ndarray
    base: np.ndarray
    interfaces: np.ndarray
    output: np.ndarray
    inverse_mass: np.ndarray
    mass: float
    max_omega_squared: float
    damping_norm: float
    is_coupled: int
    output_interface: int


def make_modal_system(modes: ModalBasis) -> ModalSystem:
    """Return the arrays of a modal basis for the kernels."""
    damping = np.array(modes.damping_matrix, float)
    interfaces = np.array(modes.interfaces, float)
    output = np.array(modes.output, float)
    output_interface = -1
    for k, row in enumerate(interfaces):
        if len(row) == 1 or not np.any(np.outer(row, output) - np.outer(output, row)):
            output_interface = k
            break
    is_coupled = len(damping) > 1 and bool(np.any(damping != np.diag(np.diag(damping))))
    damping_norm = np.linalg.norm(damping, 2) if is_coupled else np.abs(damping).max()
    omega_squared = np.array(modes.omega, float) ** 2
    inverse_mass = (interfaces**2).sum(axis=1) / modes.mass
    if interfaces.shape == (1, 1):
        omega_squared = tuple(omega_squared.tolist())
        inverse_mass = tuple(inverse_mass.tolist())
    return ModalSystem(
        omega_squared,
        np.ascontiguousarray(damping),
        np.array(modes.base, float),
        np.ascontiguousarray(interfaces),
        output,
        inverse_mass,
        float(modes.mass),
        float(modes.omega.max() ** 2),
        float(damping_norm),
        int(is_coupled),
        output_interface,
    )


class TimeState(NamedTuple):
    """Present time of a run, and the segments of its drive signal.

    - now: (6,) time and what the march notes of it, see `Time`
    - segments: (p, 12) segments of the drive, see `Segment`
    - period: (1,) duration of a cycle [s]
    - is_at_reversal: (i + 1,) 1 if an interface, or last the output, is at rest at a reversal
    """

    now: np.ndarray
    segments: np.ndarray
    period: np.ndarray
    is_at_reversal: np.ndarray


def make_initial_time_state(drive, n_interfaces: int) -> TimeState:
    """Return the time state of a run at t = 0.

    Parameters
    ----------
    drive
        A drive of `core` or `structure.drives`.
    n_interfaces : int

    Returns
    -------
    TimeState

    Raises
    ------
    PatchfemError
        If the drive begins later.
    """
    segments = drive_segments(drive)
    if segments[0, :2].any():
        raise PatchfemError("drive: the first segment of the drive must start at 0 s")
    return TimeState(
        np.zeros(len(Time)), segments, np.array([drive.period]), np.zeros(n_interfaces + 1)
    )


def drive_segments(drive) -> np.ndarray:
    """Return the segments (p, 12) of a drive signal: sines, straight lines or a sweep.

    The drive is one of `core` or `structure.drives`; for the columns see `Segment`.
    """
    if drive.segments:
        return np.array([_sine_segment(segment, drive.period) for segment in drive.segments])
    return np.array(_sweep_segments(drive) if hasattr(drive, "low") else _record_segments(drive))


def split_time(time: float, period: float) -> tuple:
    """Split a time [s] into the cycle number and the time [s] since the start of that cycle.

    A time within round-off of the end of a cycle counts as that end.
    """
    cycles = time / period
    nearest = round(cycles)
    if abs(cycles - nearest) <= INTEGER_TOL * max(1.0, abs(cycles)):
        return float(nearest), 0.0
    return float(int(cycles)), max(time - int(cycles) * period, 0.0)


def _make_segment(start: float, period: float, kind: float, **columns) -> np.ndarray:
    """Return one segment (12,) of a drive signal that starts at a given time [s].

    `columns` holds values by the names of `Segment` in lower case.
    """
    segment = np.zeros(len(Segment))
    segment[: Segment.KIND] = split_time(start, period)
    segment[Segment.KIND] = kind
    for name, value in columns.items():
        segment[Segment[name.upper()]] = value
    return segment


def _sine_segment(sine, period: float) -> np.ndarray:
    """Return the drive segment for a sine, or for a constant if amplitude or frequency is 0."""
    omega = sine.omega if sine.amplitude else 0.0
    constant = sine.constant + (0.0 if omega else sine.amplitude * np.sin(sine.phase))
    revolutions = omega * period / (2 * np.pi)
    is_whole = abs(revolutions - round(revolutions)) < INTEGER_TOL * max(1.0, revolutions)
    excess = 0.0 if is_whole else revolutions - int(revolutions)
    rounded = round(excess * 2**REVOLUTION_BITS) / 2**REVOLUTION_BITS
    return _make_segment(
        sine.start,
        period,
        SEGMENT_KIND.sine,
        constant=constant,
        amplitude=sine.amplitude if omega else 0.0,
        omega=omega,
        phase=sine.phase - omega * split_time(sine.start, period)[1],
        rate=omega,
        turns=rounded,
        turns_remainder=excess - rounded,
    )


def _sweep_segments(sweep) -> list:
    """Return the two drive segments for a sweep: the sweep, then a sine at its final frequency."""
    first_omega = 2 * np.pi * sweep.low
    last_omega = 2 * np.pi * sweep.high
    duration = sweep.duration
    is_logarithmic = sweep.logarithmic and last_omega != first_omega
    slope = (
        np.log(last_omega / first_omega) / duration
        if is_logarithmic
        else (last_omega - first_omega) / duration
    )
    is_displacement = sweep.displacement is not None
    amplitude = sweep.displacement if is_displacement else sweep.acceleration
    last_phase = float(sweep.phase(duration)) - last_omega * split_time(duration, sweep.period)[1]
    return [
        _make_segment(
            0.0,
            sweep.period,
            SEGMENT_KIND.log_chirp if is_logarithmic else SEGMENT_KIND.chirp,
            amplitude=amplitude,
            omega=first_omega,
            slope=slope,
            is_displacement=is_displacement,
            rate=sweep.rate,
        ),
        _make_segment(
            duration,
            sweep.period,
            SEGMENT_KIND.sine,
            amplitude=amplitude * last_omega**2 if is_displacement else amplitude,
            omega=last_omega,
            phase=last_phase,
            rate=last_omega,
        ),
    ]


def _record_segments(record) -> np.ndarray:
    """Return the drive segments (p, 12) for a measured signal: straight lines between its samples.

    After the last sample the drive is 0.
    """
    segments = np.zeros((len(record.time), len(Segment)))
    segments[:, : Segment.KIND] = [split_time(float(time), record.period) for time in record.time]
    segments[:, Segment.KIND] = SEGMENT_KIND.line
    segments[:-1, Segment.CONSTANT] = record.value[:-1]
    segments[:-1, Segment.SLOPE] = np.diff(record.value) / np.diff(record.time)
    return segments


def copy_into(old, new):
    """Copy the arrays in a nested tuple into the arrays of another tuple with the same shapes.

    Compiled code knows where the old arrays are, which takes most of the time of a short call.

    Parameters
    ----------
    old, new : tuple
        Tuples of arrays; `old` may be None.

    Returns
    -------
    tuple
        `old` with the values of `new`, or `new` itself where `old` is None or has other shapes.
    """
    if old is None or not _has_same_shapes(old, new):
        return new
    for old_part, new_part in zip(old, new):
        if isinstance(old_part, tuple):
            copy_into(old_part, new_part)
        else:
            old_part[...] = new_part
    return old


def _has_same_shapes(old, new) -> bool:
    """Return whether the arrays in two nested tuples have the same shapes."""
    for a, b in zip(old, new):
        has_same_shape = _has_same_shapes(a, b) if isinstance(a, tuple) else a.shape == b.shape
        if not has_same_shape:
            return False
    return True


class PreviousCycle(NamedTuple):
    """State at the end of the previous cycle, for the detection of a repeating motion.

    - status: (3,) see `PreviousStatus`
    - motion: (2, n) modal coordinates [m] and rates [m/s]
    - memory: of the elements
    """

    status: np.ndarray
    motion: np.ndarray
    memory: Memory


def make_previous_cycle(modal_system: ModalSystem, table: ElementTable) -> PreviousCycle:
    """Return an empty record of the previous cycle, for the beginning of a run."""
    status = np.zeros(len(PreviousStatus))
    status[PreviousStatus.SEGMENT] = -1.0
    return PreviousCycle(
        status,
        np.zeros((2, len(modal_system.omega_squared))),
        make_unstretched_memory(table, np.zeros(len(modal_system.inverse_mass))),
    )


class Constraint(NamedTuple):
    """Constraint that interfaces with sticking rigid elements impose on the modes.

    It is built by `stick_kernels.constrain_slides`.

    - is_sticking: (i,) 1 if the rigid element of an interface sticks
    - status: (2,) see `ConstraintStatus`
    - basis: (i, n) orthogonal rows that span those of the sticking interfaces, 0 in the dependent
      ones
    - inverse: (i, n) transposed pseudo-inverse of the rows of the sticking interfaces, 0 in the
      others
    - is_tied: (i,) 1 if the sticking interfaces also prevent motion at this one
    - reactions: (i, terms) series of the reactions [N] over a piece
    - matrix: (i, i) the transformation to `basis`, or a matrix to solve with
    - scratch: (2, i)
    """

    is_sticking: np.ndarray
    status: np.ndarray
    basis: np.ndarray
    inverse: np.ndarray
    is_tied: np.ndarray
    reactions: np.ndarray
    matrix: np.ndarray
    scratch: np.ndarray


class Choice(NamedTuple):
    """Workspace for the search that determines which interfaces stick after an event.

    The search is `stick_kernels.choose_sticks`.

    - is_resting: (i,) 1 if an interface with a rigid element has no velocity
    - slip_signs, guess: (i,) directions of slip, 0 in stick, at first and as they are tried
    - orders: (i, 2) orders of the terms that vanish where the next piece begins, -1 before the
      first choice
    - motion_sizes, reaction_sizes: (terms, n), (i, terms) magnitudes that the terms of motion and
      reactions are added from, the scale of their round-off
    """

    is_resting: np.ndarray
    slip_signs: np.ndarray
    guess: np.ndarray
    orders: np.ndarray
    motion_sizes: np.ndarray
    reaction_sizes: np.ndarray


class Workspace(NamedTuple):
    """Workspace of the kernels for one time interval between events.

    - coefficients: (terms, n) series of the modal coordinates [m]
    - drive: (3, terms) series of the drive [m s-2], and workspace for it
    - polynomials: (i + 3, terms) series of the speeds of the interfaces, and workspace
    - friction_accel: (i,) friction forces divided by the modal mass [m s-2]
    - stiffness: (i,) stiffness of the interfaces [N/m]
    - rates: (n, 4) modal rates at four Gauss points
    - hulls: Bernstein coefficients of the intervals in which a root is searched for
    - constraint, choice
    """

    coefficients: np.ndarray
    drive: np.ndarray
    polynomials: np.ndarray
    friction_accel: np.ndarray
    stiffness: np.ndarray
    rates: np.ndarray
    hulls: np.ndarray
    constraint: Constraint
    choice: Choice


def make_workspace(modal_system: ModalSystem) -> Workspace:
    """Return a cleared workspace of the kernels for a modal system."""
    i, n = modal_system.interfaces.shape
    n_terms = series_kernels.MAX_POWER + 5
    constraint = Constraint(
        is_sticking=np.empty(i),
        status=np.empty(len(ConstraintStatus)),
        basis=np.empty((i, n)),
        inverse=np.empty((i, n)),
        is_tied=np.empty(i),
        reactions=np.empty((i, n_terms)),
        matrix=np.empty((i, i)),
        scratch=np.empty((2, i)),
    )
    choice = Choice(
        is_resting=np.empty(i),
        slip_signs=np.empty(i),
        guess=np.empty(i),
        orders=np.empty((i, 2)),
        motion_sizes=np.empty((n_terms, n)),
        reaction_sizes=np.empty((i, n_terms)),
    )
    workspace = Workspace(
        coefficients=np.empty((n_terms, n)),
        drive=np.empty((3, n_terms)),
        polynomials=np.empty((i + 3, n_terms)),
        friction_accel=np.empty(i),
        stiffness=np.empty(i),
        rates=np.empty((n, 4)),
        hulls=np.empty((series_kernels.MAX_HALVINGS + 2, series_kernels.N_HULL_COLUMNS)),
        constraint=constraint,
        choice=choice,
    )
    return clear_workspace(workspace)


def clear_workspace(workspace: Workspace) -> Workspace:
    """Reset a kernel workspace to its state before a run, and return the workspace."""
    for array in (*workspace[:-2], *workspace.constraint, *workspace.choice):
        array.fill(0.0)
    workspace.choice.orders.fill(-1.0)
    return workspace


class RunSums(NamedTuple):
    """Energies, extremes and phasors accumulated during a run.

    - ledger: (8,) energies and counts, see `Ledger`
    - extremes: (c, 2) smallest and largest output [m] of every cycle
    - phasors: (c, 2) real and imaginary part of the output [m] at the frequency of the cycle
    - is_phasor_wanted: (c,) 1 in the cycles whose phasor is computed
    - limits: (2,) see `Limit`
    """

    ledger: np.ndarray
    extremes: np.ndarray
    phasors: np.ndarray
    is_phasor_wanted: np.ndarray
    limits: np.ndarray


class RunArrays(NamedTuple):
    """All arrays of a run, as arguments of the kernels.

    - modal_system: modes, which do not change
    - table: elements of the interfaces, which do not change
    - motion: (2, n) modal coordinates [m] and rates [m/s]
    - memory: of the elements
    - previous: state at the end of the cycle before
    - time_state: time, and the segments of the drive
    - sums: energies, extremes and phasors
    - workspace: of the present piece
    """

    modal_system: ModalSystem
    table: ElementTable
    motion: np.ndarray
    memory: Memory
    previous: PreviousCycle
    time_state: TimeState
    sums: RunSums
    workspace: Workspace


def make_run_sums(n_cycles: int, is_phasor_wanted, travel: float = np.inf) -> RunSums:
    """Return zeroed sums for a run over a given number of cycles.

    Parameters
    ----------
    n_cycles : int
        Cycles of the run.
    is_phasor_wanted : array_like
        (n_cycles,) 1 in the cycles whose phasor is computed.
    travel : float, optional
        Travel of the output [m], at which the run ends.

    Returns
    -------
    RunSums
    """
    limits = np.zeros(len(Limit))
    limits[Limit.TRAVEL] = travel
    return RunSums(
        np.zeros(len(Ledger)),
        np.tile([np.inf, -np.inf], (n_cycles, 1)),
        np.zeros((n_cycles, 2)),
        np.array(is_phasor_wanted, float),
        limits,
    )
