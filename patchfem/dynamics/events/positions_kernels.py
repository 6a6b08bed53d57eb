"""Named indices of the arrays of the event engine.

A kernel reads `row[Row.DURATION]` or `sums[Ledger.DRIVE_WORK]`. The enumerations below state unit and
meaning of every position. Codes of kinds, causes and results, which arrays of floats hold, are the
fields of named tuples.
"""

from enum import IntEnum
from typing import NamedTuple


class Segment(IntEnum):
    """Column indices of a drive segment.

    - CYCLE, OFFSET: number of the cycle in which it starts, and time since that cycle began [s]
    - KIND: a number of `SegmentKinds`
    - CONSTANT: constant acceleration [m s-2]
    - AMPLITUDE: of the sine, [m s-2] or, where is_displacement is 1, [m]
    - OMEGA, PHASE: angular frequency [rad/s] and phase [rad], both at the start of the first cycle
      of a sine, or at the start of a sweep
    - SLOPE: of the line [m s-3], of omega [rad/s2], or of the logarithm of omega [1/s]
    - IS_DISPLACEMENT: 1 if the amplitude is a displacement
    - RATE: largest rate [1/s]
    - TURNS, TURNS_REMAINDER: what the revolutions per cycle exceed a whole number by, in two parts;
      the first has 24 bits, so its product with a number of cycles is exact and the phase keeps its
      digits over a million cycles
    """

    CYCLE = 0
    OFFSET = 1
    KIND = 2
    CONSTANT = 3
    AMPLITUDE = 4
    OMEGA = 5
    PHASE = 6
    SLOPE = 7
    IS_DISPLACEMENT = 8
    RATE = 9
    TURNS = 10
    TURNS_REMAINDER = 11


class SegmentKinds(NamedTuple):
    """Codes of drive segments: sine, straight line, linear sweep, logarithmic sweep."""

    sine: float = 0.0
    line: float = 1.0
    chirp: float = 2.0
    log_chirp: float = 3.0


class Row(IntEnum):
    """Column indices of a row, which holds the state at the start of a time interval.

    - TIME, DURATION: of the piece [s]
    - PHASE: of the drive [rad]
    - SEGMENT: number of the segment of the drive
    - BEGIN: what begins the piece, a number of `RowBegins`
    - CYCLE, OFFSET: number of the cycle, and time since it began [s]
    - MOTION: first of n modal coordinates [m] and n rates [m/s]; `Column` of every interface follow
    """

    TIME = 0
    DURATION = 1
    PHASE = 2
    SEGMENT = 3
    BEGIN = 4
    CYCLE = 5
    OFFSET = 6
    MOTION = 8


class Column(IntEnum):
    """Column indices of one interface in a row, counted from the first of its columns.

    - FORCE: friction force [N]; the reaction while a rigid element holds the relative displacement
    - STIFFNESS: of the elements that stick [N/m], infinite while a rigid element holds
    - SLIPPING, LIMIT: fraction of the friction limit that slips, and the limit [N] of what slips
    - SLIP, WORK, LOSS: irreversible slip [m], work done on the interface and energy dissipated
      there [J]
    - DIRECTION: sign of the slip, 0 in stick
    - SLIDE: relative displacement [m]
    """

    FORCE = 0
    STIFFNESS = 1
    SLIPPING = 2
    LIMIT = 3
    SLIP = 4
    WORK = 5
    LOSS = 6
    DIRECTION = 7
    SLIDE = 8


class RowBegins(NamedTuple):
    """Codes that state why a time interval begins, in increasing order of importance.

    They are the values of `Row.BEGIN`.
    """

    none: int = 0
    yielding: int = 1
    reversal: int = 2
    stick_or_slip: int = 3
    drive_change: int = 4


class MarchStatus(NamedTuple):
    """Codes that state why the march from event to event stops.

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
    """Codes of the events that end a time interval.

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


class Time(IntEnum):
    """Indices of the entries of `TimeState.now`, the present time of a run.

    - CYCLE, OFFSET: number of the cycle, and time since it began [s]
    - SEGMENT: number of the segment of the drive
    - BEGIN: what begins the next row, a number of `RowBegins`
    - IS_PAUSED: 1 if the march stopped because no row was free
    """

    CYCLE = 0
    OFFSET = 1
    SEGMENT = 2
    BEGIN = 3
    IS_PAUSED = 4


class Ledger(IntEnum):
    """Indices of the entries of `RunSums.ledger`: energies [J] since the start, and counts.

    - DRIVE_WORK, VISCOUS_LOSS: work of the drive, and energy dissipated by the dampers
    - DRIVE_POWER: integral of the magnitude of the power of the drive
    - FRICTION_WORK, FRICTION_LOSS: work done on the interfaces, and energy dissipated there
    - MAX_STORED: largest energy of modes and elements
    - N_PIECES: number of pieces
    - HAS_SLIPPED: 1 if half or more of an interface has slipped
    """

    DRIVE_WORK = 0
    VISCOUS_LOSS = 1
    DRIVE_POWER = 2
    FRICTION_WORK = 3
    FRICTION_LOSS = 4
    MAX_STORED = 5
    N_PIECES = 6
    HAS_SLIPPED = 7


class Limit(IntEnum):
    """Indices of the entries of `RunSums.limits`.

    TRAVEL: travel limit of the output [m]; N_IDLE: number of successive events without progress
    in time.
    """

    TRAVEL = 0
    N_IDLE = 1


class ConstraintStatus(IntEnum):
    """Indices of the entries of `Constraint.status`.

    - N_STICKING: number of interfaces whose rigid elements stick; below 0 if the constraint is
      to be built again
    - IS_IMMOBILE: 1 if they leave no motion of the modes
    """

    N_STICKING = 0
    IS_IMMOBILE = 1


class PreviousStatus(IntEnum):
    """Indices of the entries of `PreviousCycle.status`.

    - SEGMENT: of the drive then, -1 before there is a state
    - LAST_DISTANT: last cycle at whose end the state was far from that of the cycle before
    - REPEATS: 1 if the motion repeats to the last bit
    """

    SEGMENT = 0
    LAST_DISTANT = 1
    REPEATS = 2


class RunMeasure(IntEnum):
    """Indices of the measures of a whole run that `read_kernels` takes from its last cycles.

    - MIN_OUTPUT, MAX_OUTPUT: of the output [m]
    - MAX_COORDINATE: largest modal coordinate [m]
    - MAX_ACCELERATION: largest acceleration of the output [m s-2]
    - COS_1, SIN_1, COS_3, SIN_3: integrals of the acceleration times cosine and sine of the cycle
      and of its third harmonic [m s-1]
    - N_RELEASES, RELEASE_COS, RELEASE_SIN: releases of the first interface, and sums of the cosine
      and the sine of twice their phases
    - RING, RING_ANGLE: of one mode with one interface, the largest acceleration [m s-2] of the
      free vibration while the interface sticks, and the largest angle [rad] by which it turns in
      one stick
    """

    MIN_OUTPUT = 0
    MAX_OUTPUT = 1
    MAX_COORDINATE = 2
    MAX_ACCELERATION = 3
    COS_1 = 4
    SIN_1 = 5
    COS_3 = 6
    SIN_3 = 7
    N_RELEASES = 8
    RELEASE_COS = 9
    RELEASE_SIN = 10
    RING = 11
    RING_ANGLE = 12


class InterfaceMeasure(IntEnum):
    """Indices of the measures of one interface that `read_kernels` takes from the last cycles.

    - MIN_SLIDE, MAX_SLIDE, MIN_SLIP, MAX_SLIP: of relative displacement and slip [m]
    - MAX_FORCE: largest force [N]
    - STUCK_TIME: time in which less than half of the interface slips [s]
    - WORK, END_WORK, PATH_WORK: friction work by the sums of the march, by the ends of the pieces,
      and the integral of the magnitude of its power [J]
    - SLIDE_COS, SLIDE_SIN, FORCE_COS, FORCE_SIN: integrals of relative displacement [m s] and force
      [N s] times cosine and sine of the cycle
    - FIRST_SLIDE, LAST_SLIDE, FIRST_FORCE, LAST_FORCE: integrals of both over the first and over
      the last cycle
    - START_SLIDE, END_SLIDE: relative displacement at both ends [m]
    - MEAN_RANGE: mean range of the relative displacement in a cycle [m]
    - SECANT: mean secant stiffness of the cycles that show it [N/m], NaN where none does
    """

    MIN_SLIDE = 0
    MAX_SLIDE = 1
    MIN_SLIP = 2
    MAX_SLIP = 3
    MAX_FORCE = 4
    STUCK_TIME = 5
    WORK = 6
    END_WORK = 7
    PATH_WORK = 8
    SLIDE_COS = 9
    SLIDE_SIN = 10
    FORCE_COS = 11
    FORCE_SIN = 12
    FIRST_SLIDE = 13
    LAST_SLIDE = 14
    FIRST_FORCE = 15
    LAST_FORCE = 16
    START_SLIDE = 17
    END_SLIDE = 18
    MEAN_RANGE = 19
    SECANT = 20


SEGMENT_KIND = SegmentKinds()
ROW_BEGIN = RowBegins()
MARCH_STATUS = MarchStatus()
EVENT_KIND = EventKinds()

# Number of columns of one interface in a row.
N_COLUMNS = len(Column)
