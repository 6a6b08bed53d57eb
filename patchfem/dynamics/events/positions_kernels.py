"""Named positions in the arrays of the event engine.

A kernel reads `row[ROW.duration]` or `sums[LEDGER.drive_work]`. The classes below state unit and
meaning of every position; their instances at the end of the module are what kernels and callers
import.
"""

from typing import NamedTuple


class SegmentColumns(NamedTuple):
    """Columns of a segment of the drive.

    - cycle, offset: number of the cycle in which it starts, and time since that cycle began [s]
    - kind: a number of `SegmentKinds`
    - constant: constant acceleration [m s-2]
    - amplitude: of the sine, [m s-2] or, where is_displacement is 1, [m]
    - omega, phase: angular frequency [rad/s] and phase [rad], both at the start of the first cycle
    of a sine, or at the
      start of a sweep
    - slope: of the line [m s-3], of omega [rad/s2], or of the logarithm of omega [1/s]
    - is_displacement: 1 where the amplitude is a displacement
    - rate: largest rate [1/s]
    - turns, turns_remainder: what the revolutions per cycle exceed a whole number by, in two parts;
    the first has 24
      bits, so its product with a number of cycles is exact and the phase keeps its digits over a
      million cycles
    """

    cycle: int = 0
    offset: int = 1
    kind: int = 2
    constant: int = 3
    amplitude: int = 4
    omega: int = 5
    phase: int = 6
    slope: int = 7
    is_displacement: int = 8
    rate: int = 9
    turns: int = 10
    turns_remainder: int = 11


class SegmentKinds(NamedTuple):
    """Kinds of a segment of the drive: sine, straight line, sweep with linear and with logarithmic frequency."""

    sine: float = 0.0
    line: float = 1.0
    chirp: float = 2.0
    log_chirp: float = 3.0


class RowColumns(NamedTuple):
    """Columns of the row of a piece, as the piece begins.

    - time, duration: of the piece [s]
    - phase: of the drive [rad]
    - segment: number of the segment of the drive
    - begin: what begins the piece, a number of `RowBegins`
    - cycle, offset: number of the cycle, and time since it began [s]
    - motion: first of n modal coordinates [m] and n rates [m/s]; `InterfaceColumns` of every
    interface follow
    """

    time: int = 0
    duration: int = 1
    phase: int = 2
    segment: int = 3
    begin: int = 4
    cycle: int = 5
    offset: int = 6
    motion: int = 8


class InterfaceColumns(NamedTuple):
    """Columns of an interface in the row of a piece, measured from the first of them.

    - force: friction force [N]; the reaction while a rigid element holds the relative displacement
    - stiffness: of the elements that stick [N/m], infinite while a rigid element holds
    - slipping, limit: fraction of the friction limit that slips, and the limit [N] of what slips
    - slip, work, loss: irreversible slip [m], work done on the interface and energy dissipated
    there [J]
    - direction: sign of the slip, 0 in stick
    - slide: relative displacement [m]
    """

    force: int = 0
    stiffness: int = 1
    slipping: int = 2
    limit: int = 3
    slip: int = 4
    work: int = 5
    loss: int = 6
    direction: int = 7
    slide: int = 8


class RowBegins(NamedTuple):
    """Values of `RowColumns.begin`, in increasing order of importance."""

    none: int = 0
    yielding: int = 1
    reversal: int = 2
    stick_or_slip: int = 3
    drive_border: int = 4


class MarchStatus(NamedTuple):
    """Reasons why `march_kernels.march` returns.

    - done: the time is reached
    - full: no row is free; the next call goes on
    - travel: the output has reached its travel
    - idle: events follow each other without progress in time
    - undetermined: no choice of sticking interfaces satisfies the friction law
    - repeats: from here on every cycle equals the last one bit by bit
    """

    done: int = 0
    full: int = 1
    travel: int = 2
    idle: int = 3
    undetermined: int = 4
    repeats: int = 5


class EventKinds(NamedTuple):
    """Kinds of the event that ends a piece.

    - none: the piece ends at a border of the cycle or of the drive
    - yielding: an elastic-plastic element starts to slip
    - reversal, output_reversal: the relative displacement of an interface, or the output, turns
    - travel: the output reaches its travel
    - release: the reaction of a rigid element that sticks reaches its limit
    """

    none: int = 0
    yielding: int = 1
    reversal: int = 2
    output_reversal: int = 3
    travel: int = 4
    release: int = 5


class TimePositions(NamedTuple):
    """Positions in `TimeState.now`.

    - cycle, offset: number of the cycle, and time since it began [s]
    - segment: number of the segment of the drive
    - begin: what begins the next row, a number of `RowBegins`
    - is_paused: 1 where the march stopped because no row was free
    """

    cycle: int = 0
    offset: int = 1
    segment: int = 2
    begin: int = 3
    is_paused: int = 4


class LedgerPositions(NamedTuple):
    """Positions in `RunSums.ledger`: energies [J] since the start, and counts.

    - drive_work, viscous_loss: work of the drive, and energy dissipated by the dampers
    - drive_power: integral of the magnitude of the power of the drive
    - friction_work, friction_loss: work done on the interfaces, and energy dissipated there
    - max_stored: largest energy of modes and elements
    - n_pieces: number of pieces
    - has_slipped: 1 where half or more of an interface has slipped
    """

    drive_work: int = 0
    viscous_loss: int = 1
    drive_power: int = 2
    friction_work: int = 3
    friction_loss: int = 4
    max_stored: int = 5
    n_pieces: int = 6
    has_slipped: int = 7


class LimitPositions(NamedTuple):
    """Positions in `RunSums.limits`: travel of the output [m], and events in a row without progress."""

    travel: int = 0
    n_idle: int = 1


class ConstraintPositions(NamedTuple):
    """Positions in `Constraint.status`.

    - n_sticking: number of interfaces whose rigid elements stick; below 0 where the constraint is
    to be built again
    - is_immobile: 1 where they leave no motion of the modes
    """

    n_sticking: int = 0
    is_immobile: int = 1


class PreviousPositions(NamedTuple):
    """Positions in `PreviousCycle.status`.

    - segment: of the drive then, -1 before there is a state
    - last_distant: last cycle at whose end the state was far from that of the cycle before
    - repeats: 1 where the motion repeats to the last bit
    """

    segment: int = 0
    last_distant: int = 1
    repeats: int = 2


class RunMeasures(NamedTuple):
    """Positions of the measures of a run that `read_kernels` takes from its last cycles.

    - min_output, max_output: of the output [m]
    - max_coordinate: largest modal coordinate [m]
    - max_acceleration: largest acceleration of the output [m s-2]
    - cos_1, sin_1, cos_3, sin_3: integrals of the acceleration times cosine and sine of the cycle
    and of its third
      harmonic [m s-1]
    - n_releases, release_cos, release_sin: releases of the first interface, and sums of the cosine
    and the sine of
      twice their phases
    - ring, ring_angle: of one mode behind one interface, the largest acceleration [m s-2] of the
    free vibration while
      the interface sticks, and the largest angle [rad] by which it turns in one stick
    """

    min_output: int = 0
    max_output: int = 1
    max_coordinate: int = 2
    max_acceleration: int = 3
    cos_1: int = 4
    sin_1: int = 5
    cos_3: int = 6
    sin_3: int = 7
    n_releases: int = 8
    release_cos: int = 9
    release_sin: int = 10
    ring: int = 11
    ring_angle: int = 12


class InterfaceMeasures(NamedTuple):
    """Positions of the measures of an interface that `read_kernels` takes from the last cycles.

    - min_slide, max_slide, min_slip, max_slip: of relative displacement and slip [m]
    - max_force: largest force [N]
    - stuck_time: time in which less than half of the interface slips [s]
    - work, end_work, path_work: friction work by the sums of the march, by the ends of the pieces,
    and the integral of
      the magnitude of its power [J]
    - slide_cos, slide_sin, force_cos, force_sin: integrals of relative displacement [m s] and force
    [N s] times cosine
      and sine of the cycle
    - first_slide, last_slide, first_force, last_force: integrals of both over the first and over
    the last cycle
    - start_slide, end_slide: relative displacement at both ends [m]
    - mean_range: mean range of the relative displacement in a cycle [m]
    - secant: mean secant stiffness of the cycles that show it [N/m], NaN where none does
    """

    min_slide: int = 0
    max_slide: int = 1
    min_slip: int = 2
    max_slip: int = 3
    max_force: int = 4
    stuck_time: int = 5
    work: int = 6
    end_work: int = 7
    path_work: int = 8
    slide_cos: int = 9
    slide_sin: int = 10
    force_cos: int = 11
    force_sin: int = 12
    first_slide: int = 13
    last_slide: int = 14
    first_force: int = 15
    last_force: int = 16
    start_slide: int = 17
    end_slide: int = 18
    mean_range: int = 19
    secant: int = 20


SEGMENT = SegmentColumns()
KIND = SegmentKinds()
ROW = RowColumns()
COLUMN = InterfaceColumns()
BEGIN = RowBegins()
STATUS = MarchStatus()
EVENT = EventKinds()
TIME = TimePositions()
LEDGER = LedgerPositions()
LIMIT = LimitPositions()
CONSTRAINT = ConstraintPositions()
PREVIOUS = PreviousPositions()
RUN = RunMeasures()
INTERFACE = InterfaceMeasures()

# columns of one interface in a row
N_COLUMNS = len(COLUMN)
