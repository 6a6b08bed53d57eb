"""Row layout of the workspace of `loop_kernels`, without compiled code.

The workspace is a flat array in which row r of lane i is the element r * LANES + i, so that a compiler knows the
distance of any two elements and takes several lanes at once. Kernels write `workspace[RowStart.SLIDE + lane]`:
`RowStart` has the elements of lane 0 for every row of `Row`, and `StretchRowStart`, `SliderRowStart` and
`TableRowStart` for the rows of the state of a law. Lengths are in m and times are angles of the drive [rad], so a
force per unit mass is in m and an energy per unit mass in m^2.
"""

from enum import IntEnum

LANES = 32  # number of cases that are integrated together; a compiler vectorises over them
# Binary logarithm of the number of lanes in a group; a group is advanced as long
# as one of its lanes has a case.
GROUP_BITS = 3
# Largest difference between the ends of two equal cycles, relative to their range.
PERIODIC_TOL = 1e-9


class Row(IntEnum):
    """Row indices of the workspace that all friction laws share.

    Motion: the state, then the sums of the run, then the extremes and the phasor of the cycle.

    - SLIDE, SPEED: relative displacement x [m], and its derivative x' with respect to the angle of the drive [m]
    - SLIP_SIGN: sign of the slip, 0 while the interface sticks
    - MEMORY: state of the law [m]: slide of the unloaded spring, stretch of a bond, or friction
      force per unit mass (Masing)
    - SLIP_PATH: length of the path of slip [m]; the friction work per unit mass [m^2] in laws of
      one stretch
    - WORK_SUM, LOSS_SUM, POWER_SUM: sums of sin * x' (work of the drive), of x'^2 (viscous loss)
      and of |sin * x'|
    - MAX_SLIDE, MIN_SLIDE: largest and smallest slide of the cycle [m]
    - COS_SUM, SIN_SUM: sums of x * cos and of x * sin over the steps of the cycle
    - HAS_EVENT: 1 if an event lies inside the present step, which is then computed by
      `resolve_step`

    Numbers of the case.

    - A11 to A22, RX, RV, SX, SV, CX, CV: coefficients of an exact step: x1 and v1 after a step are
      linear in x and v (A), a constant force (R), and the sine (S) and the cosine (C) of the drive
    - B11 to B22, QX, QV, TX, TV, UX, UV: the same with the spring of a stick
    - DAMPING, STIFFNESS, DRIVE: of x'' + DAMPING x' + STIFFNESS x = DRIVE sin - f; DRIVE in m
    - KINETIC, STATIC: friction force per unit mass in a slip, and its maximum in a stick [m]
    - SPRING: slope of the friction with respect to the slide in a stick, 0 for a rigid contact
    - YIELD_LENGTH: elastic slide at which the interface slips as a whole [m]
    - OUTPUT_GAIN, BASE_GAIN: acceleration of the output per x'', and of the base per sine of the
      drive [m s-2]
    - STEP, MIDPOINT_FACTOR: of a law without an exact step, in the rows of its coefficients: the
      angle of a step [rad], and 0.5/cos(STEP/2), by which the sine in the middle of a step follows
      from the sum of those at its ends
    - LAW_NUMBERS: first of the numbers of a law without an exact step
    - HALF_SLIP: of Masing's rule, slide in multiples of YIELD_LENGTH from which half of the friction slips

    Measures of the observed cycles.

    - MAX_ACCELERATION: largest absolute acceleration of the output [m s-2]
    - STICK_ANGLE: angle of the drive in which the interface sticks [rad]
    - MAX_FORCE: largest friction force per unit mass [m]
    - MAX_SLIP, MIN_SLIP: largest and smallest irreversible slide [m]
    - COS_1, SIN_1, COS_3, SIN_3: sums of x times cosine and sine of the angle, and of three times
      the angle
    - SLIDE_SUM, FORCE_SUM: sums of the slide and of the friction over the steps of the cycle
    - LOOP_WORK, LOOP_WORK_SIZE: work of the friction by the trapezoidal rule, and the sum of its
      magnitudes [m^2]
    - SLIP_STARTS, START_COS, START_SIN: number of starts of a slip, and sums of cosine and sine of
      twice their angles
    - FORCE_AT_MAX, FORCE_AT_MIN: friction at the largest and smallest slide of the cycle, nan
      if there is no reversal
    - MEAN_RANGE: mean over the cycles of the range of the slide [m]
    - SECANT_SUM, N_SECANTS: sum of the secant stiffnesses of the cycles that have one, and their
      number
    - LONGEST_STICK, CURRENT_STICK: longest angle without a slip, and angle since the last slip
      [rad]
    - FIRST_MEAN_SLIDE, LAST_MEAN_SLIDE, FIRST_MEAN_FORCE, LAST_MEAN_FORCE: integrals of slide and
      friction over the first and over the last observed cycle
    - CYCLE_START: slide at the start of the observed cycle [m]

    Cycle.

    - CASE_INDEX, CYCLE_INDEX: case of the lane, and number of its cycle
    - START_SLIDE, START_SPEED, START_MEMORY: state at the start of that cycle
    """

    SLIDE = 0
    SPEED = 1
    SLIP_SIGN = 2
    MEMORY = 3
    SLIP_PATH = 4
    WORK_SUM = 5
    LOSS_SUM = 6
    POWER_SUM = 7
    MAX_SLIDE = 8
    MIN_SLIDE = 9
    COS_SUM = 10
    SIN_SUM = 11
    HAS_EVENT = 12
    A11 = 13
    A12 = 14
    A21 = 15
    A22 = 16
    RX = 17
    RV = 18
    SX = 19
    SV = 20
    CX = 21
    CV = 22
    B11 = 23
    B12 = 24
    B21 = 25
    B22 = 26
    QX = 27
    QV = 28
    TX = 29
    TV = 30
    UX = 31
    UV = 32
    DAMPING = 33
    STIFFNESS = 34
    DRIVE = 35
    KINETIC = 36
    STATIC = 37
    SPRING = 38
    YIELD_LENGTH = 39
    OUTPUT_GAIN = 40
    BASE_GAIN = 41
    MAX_ACCELERATION = 42
    STICK_ANGLE = 43
    MAX_FORCE = 44
    MAX_SLIP = 45
    MIN_SLIP = 46
    COS_1 = 47
    SIN_1 = 48
    COS_3 = 49
    SIN_3 = 50
    SLIDE_SUM = 51
    LOOP_WORK = 52
    LOOP_WORK_SIZE = 53
    SLIP_STARTS = 54
    START_COS = 55
    START_SIN = 56
    FORCE_SUM = 57
    FORCE_AT_MAX = 58
    FORCE_AT_MIN = 59
    MEAN_RANGE = 60
    SECANT_SUM = 61
    N_SECANTS = 62
    LONGEST_STICK = 63
    CURRENT_STICK = 64
    FIRST_MEAN_SLIDE = 65
    LAST_MEAN_SLIDE = 66
    FIRST_MEAN_FORCE = 67
    LAST_MEAN_FORCE = 68
    CYCLE_START = 69
    CASE_INDEX = 70
    CYCLE_INDEX = 71
    START_SLIDE = 72
    START_SPEED = 73
    START_MEMORY = 74
    STEP = A11
    MIDPOINT_FACTOR = A12
    LAW_NUMBERS = A21
    HALF_SLIP = LAW_NUMBERS + 2


N_STATE = int(Row.A11)
FIRST_NUMBER = N_STATE
N_NUMBERS = Row.MAX_ACCELERATION - Row.A11
N_LAW_NUMBERS = 6
FIRST_MEASURE = int(Row.MAX_ACCELERATION)
N_MEASURES = Row.CASE_INDEX - Row.MAX_ACCELERATION

# First row of the stored cycle ends, the latest first. A cycle end holds STATE_ROWS,
# SUM_ROWS and the first variables of the law, from which `extrapolation_kernels`
# predicts how the motion settles.
CYCLE_ENDS = len(Row)
N_CYCLE_ENDS = 4
STATE_ROWS = (int(Row.SLIDE), int(Row.SPEED), int(Row.MEMORY), int(Row.SLIP_SIGN))
SUM_ROWS = (int(Row.SLIP_PATH), int(Row.WORK_SUM), int(Row.LOSS_SUM), int(Row.POWER_SUM))


class CycleEnd(IntEnum):
    """Indices of the quantities in a stored cycle end: state, sums and law variables."""

    SLIDE = 0
    SPEED = 1
    MEMORY = 2
    SLIP_SIGN = 3
    SLIP_PATH = 4
    WORK_SUM = 5
    LOSS_SUM = 6
    POWER_SUM = 7
    LAW_STATE = 8


MAX_LAW_VARIABLES = 38  # maximum number of law variables in a cycle end
CYCLE_END_SIZE = CycleEnd.LAW_STATE + MAX_LAW_VARIABLES

# First row of the law variables other than MEMORY; in a motion they
# follow the first N_STATE numbers.
LAW_STATE = CYCLE_ENDS + N_CYCLE_ENDS * CYCLE_END_SIZE


class StretchRow(IntEnum):
    """Row indices of the variables of a friction law with a single stretch.

    - FRICTION: friction force per unit mass [m]
    - STRETCH_SQUARE: mean square of the stretches [m^2]
    - STEP_WORK: friction work of the last step [m^2]
    - IS_OBSERVED: 1 if the step is read
    """

    FRICTION = LAW_STATE
    STRETCH_SQUARE = LAW_STATE + 1
    STEP_WORK = LAW_STATE + 2
    IS_OBSERVED = LAW_STATE + 3


class SliderRow(IntEnum):
    """Row indices of the variables of parallel sliders in the Masing (Iwan) model.

    - DIRECTION: sign of the speed
    - BRANCH_SCALE: m of Masing's rule
    - TURN_SLIDE, TURN_FORCE, TURN_SLIP, TURN_ENERGY: slide, friction force per unit mass, irreversible
      slide [m] and elastic energy [m^2] at the last reversal, which are pushed onto the stack
      together
    - NEXT_EVENT: slide of the next event [m]
    - TANGENT: present slope of the friction with respect to the slide
    - TANGENT_START, TANGENT_BEFORE, TANGENT_AFTER, TANGENT_END: the same at the start of the step,
      before and after its event, and at its end
    - STEP_SLIP: path of slip in the step [m]
    - REVERSAL_FORCE: friction force per unit mass at the last reversal that happened, also if its loop
      has closed [m]
    - EVER_SLIPPED: 1 once half of the friction has slipped
    - KEEPS_FIRST_LOADING: 1 while the start of the first loading is at the bottom of the stack
    - ALL_SLIP: 1 while all sliders slip
    - MAX_DROPPED_GAP: largest gap, relative to its size, of a loop that was dropped from a full stack
    - N_REVERSALS: number of reversals on the stack
    - STICK_FRACTION: fraction of the segment before the event in which the interface sticks
    - INVERSE_LENGTH: DIRECTION over m YIELD_LENGTH
    - FORCE_RATIO: SPRING YIELD_LENGTH over KINETIC
    - REVERSALS: first row of the stack of slide, friction, irreversible slide and energy of the
      reversals
    """

    DIRECTION = LAW_STATE
    BRANCH_SCALE = LAW_STATE + 1
    TURN_SLIDE = LAW_STATE + 2
    TURN_FORCE = LAW_STATE + 3
    TURN_SLIP = LAW_STATE + 4
    TURN_ENERGY = LAW_STATE + 5
    NEXT_EVENT = LAW_STATE + 6
    TANGENT = LAW_STATE + 7
    TANGENT_START = LAW_STATE + 8
    TANGENT_BEFORE = LAW_STATE + 9
    TANGENT_AFTER = LAW_STATE + 10
    TANGENT_END = LAW_STATE + 11
    STEP_SLIP = LAW_STATE + 12
    REVERSAL_FORCE = LAW_STATE + 13
    EVER_SLIPPED = LAW_STATE + 14
    KEEPS_FIRST_LOADING = LAW_STATE + 15
    ALL_SLIP = LAW_STATE + 16
    MAX_DROPPED_GAP = LAW_STATE + 17
    N_REVERSALS = LAW_STATE + 18
    STICK_FRACTION = LAW_STATE + 19
    INVERSE_LENGTH = LAW_STATE + 20
    FORCE_RATIO = LAW_STATE + 21
    REVERSALS = LAW_STATE + 22


REVERSAL_SIZE = 4  # number of quantities per reversal on the stack
MAX_REVERSALS = 63
CURVE_STATE = SliderRow.REVERSALS + REVERSAL_SIZE * MAX_REVERSALS


class TableRow(IntEnum):
    """Row indices of a first-loading curve that is looked up in a table.

    They follow the rows of the sliders.

    - CURVE_PLACE: abscissa that is looked up
    - YIELD_INDEX: number of the last yield before it
    - PREPARED_FORCE, PREPARED_SLOPE, PREPARED_MOMENT: F, S and B of `table_curve_kernels` there
    - START_FORCE, START_MOMENT: F and B at the start of the step
    """

    CURVE_PLACE = CURVE_STATE
    YIELD_INDEX = CURVE_STATE + 1
    PREPARED_FORCE = CURVE_STATE + 2
    PREPARED_SLOPE = CURVE_STATE + 3
    PREPARED_MOMENT = CURVE_STATE + 4
    START_FORCE = CURVE_STATE + 5
    START_MOMENT = CURVE_STATE + 6


class YieldColumn(IntEnum):
    """Column indices of a yield in the table of a first-loading curve.

    - YIELD: its slide in multiples of YIELD_LENGTH
    - FORCE, SLOPE, MOMENT: F, S and B of `table_curve_kernels` from there on
    """

    YIELD = 0
    FORCE = 1
    SLOPE = 2
    MOMENT = 3


N_COLUMNS = len(YieldColumn)
N_YIELDS = 512  # number of yields in a table; the first is at 0 and the last is beyond any motion
# Number of equal parts of the range of the yields, which accelerate the search for a yield.
N_PARTS = 128
# Position in a table, after the yields, of the number of yields before each part of their range.
PART_STARTS = N_COLUMNS * N_YIELDS
# Position of the first yield in a table.
FIRST_YIELD = PART_STARTS + N_PARTS
# Position of the number of parts per displacement in a table.
PARTS_PER_SLIDE = FIRST_YIELD + 1
TABLE_SIZE = FIRST_YIELD + 2


def make_row_starts(name: str, rows: type[IntEnum]) -> type[IntEnum]:
    """Return an enumeration of the workspace indices at which the given rows begin."""
    return IntEnum(name, {row: LANES * value for row, value in rows.__members__.items()})


RowStart = make_row_starts("RowStart", Row)
StretchRowStart = make_row_starts("StretchRowStart", StretchRow)
SliderRowStart = make_row_starts("SliderRowStart", SliderRow)
TableRowStart = make_row_starts("TableRowStart", TableRow)
