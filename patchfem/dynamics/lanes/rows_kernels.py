"""Rows of the workspace of `loop_kernels`; no compiled code.

The workspace is a flat array in which row r of lane i is the element r * LANES + i, so that a compiler knows the distance
of any two elements and takes several lanes at once. Lengths are in m and times are angles of the drive [rad], so a force
over the mass is in m and an energy over the mass in m^2. The rows are, in this order: the motion, the numbers of the
case, the readings of the observed cycles, the case and the start of its cycle, the ends of the last cycles, and the
state that a law has besides `MEMORY`.
"""

from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT

# These options compile a function into its caller, so that the loop over the lanes can take several lanes at once.
NJIT_INLINE = {
    "error_model": "numpy",
    "forceinline": True,
    "fastmath": FASTMATH_FLAGS,
    **NJIT_NO_REFCOUNT,
}

LANES = 32  # number of cases that march side by side
GROUP_BITS = 3  # lanes march in groups of two to this power while a lane of the group has a case
# Two cycles are equal if their ends differ by less than this fraction of their range
PERIODIC_TOL = 1e-9

# These rows are the motion: its state, then the sums of the run, then the extremes and the phasor of the cycle.
SLIDE = 0  # relative displacement x [m]
SPEED = 1  # derivative x' of the slide by the angle of the drive [m]
SLIP_SIGN = 2  # sign of the slip, 0 while the interface sticks
MEMORY = 3  # state of the law [m]: slide of the unloaded spring, stretch of a bond, or friction over mass (Masing)
SLIP_PATH = 4  # length of the path of slip [m]; the friction work over the mass [m^2] in laws of one stretch
WORK_SUM = 5  # sum of sin * x' over the steps, which gives the work of the drive
LOSS_SUM = 6  # sum of x'^2 over the steps, which gives the viscous loss
POWER_SUM = 7  # sum of |sin * x'| over the steps
MAX_SLIDE = 8  # largest slide of the cycle [m]
MIN_SLIDE = 9  # smallest slide of the cycle [m]
COS_SUM = 10  # sum of x * cos over the steps of the cycle
SIN_SUM = 11  # sum of x * sin over the steps of the cycle
# 1 if an event lies inside the present step, which is then computed by `resolve_step`
HAS_EVENT = 12
N_STATE = 13

# These rows are the numbers of the case. First come the coefficients of an exact step: x1 and v1 after a step are linear
# in x and v (A11, A12, A21, A22), a constant force (RX, RV), and the sine and cosine of the drive (SX, SV, CX, CV).
FIRST_NUMBER = N_STATE
A11 = FIRST_NUMBER
A12 = FIRST_NUMBER + 1
A21 = FIRST_NUMBER + 2
A22 = FIRST_NUMBER + 3
RX = FIRST_NUMBER + 4
RV = FIRST_NUMBER + 5
SX = FIRST_NUMBER + 6
SV = FIRST_NUMBER + 7
CX = FIRST_NUMBER + 8
CV = FIRST_NUMBER + 9
# The same coefficients with the spring of a stick: of x and v, a constant force, the sine and the cosine.
B11 = FIRST_NUMBER + 10
B12 = FIRST_NUMBER + 11
B21 = FIRST_NUMBER + 12
B22 = FIRST_NUMBER + 13
QX = FIRST_NUMBER + 14
QV = FIRST_NUMBER + 15
TX = FIRST_NUMBER + 16
TV = FIRST_NUMBER + 17
UX = FIRST_NUMBER + 18
UV = FIRST_NUMBER + 19
# The equation itself: x'' + DAMPING x' + STIFFNESS x = DRIVE sin - f.
DAMPING = FIRST_NUMBER + 20
STIFFNESS = FIRST_NUMBER + 21
DRIVE = FIRST_NUMBER + 22  # amplitude of the drive [m]
KINETIC = FIRST_NUMBER + 23  # friction over the mass in a slip [m]
STATIC = FIRST_NUMBER + 24  # largest friction over the mass in a stick [m]
SPRING = FIRST_NUMBER + 25  # slope of the friction over the slide in a stick, 0 for a rigid contact
YIELD_LENGTH = FIRST_NUMBER + 26  # elastic slide at which the whole interface slips [m]
OUTPUT_GAIN = FIRST_NUMBER + 27  # acceleration of the output [m s-2] per x'' [m]
BASE_GAIN = FIRST_NUMBER + 28  # acceleration of the base [m s-2] per sine of the drive
N_NUMBERS = 29
# A law that has no exact step keeps its own numbers in the rows of those coefficients.
STEP = A11  # angle of a step [rad]
MIDPOINT_FACTOR = A12  # 0.5/cos(STEP/2): the sine in the middle of a step is this times the sum of those at its ends
LAW_NUMBERS = A21  # first of the numbers of the law
N_LAW_NUMBERS = 6

# These rows are the readings of the observed cycles.
FIRST_READING = FIRST_NUMBER + N_NUMBERS
MAX_ACCELERATION = FIRST_READING  # largest absolute acceleration of the output [m s-2]
STICK_ANGLE = FIRST_READING + 1  # angle of the drive in which the interface sticks [rad]
MAX_FORCE = FIRST_READING + 2  # largest friction over the mass [m]
MAX_SLIP = FIRST_READING + 3  # largest irreversible slide [m]
MIN_SLIP = FIRST_READING + 4  # smallest irreversible slide [m]
COS_1 = FIRST_READING + 5  # sum of x * cos over the steps
SIN_1 = FIRST_READING + 6  # sum of x * sin over the steps
COS_3 = FIRST_READING + 7  # sum of x * cos of three times the angle
SIN_3 = FIRST_READING + 8  # sum of x * sin of three times the angle
SLIDE_SUM = FIRST_READING + 9  # sum of the slide over the steps of the cycle
LOOP_WORK = FIRST_READING + 10  # work of the friction by the trapezoidal rule [m^2]
LOOP_WORK_SIZE = FIRST_READING + 11  # sum of the absolute works of the steps [m^2]
SLIP_STARTS = FIRST_READING + 12  # number of starts of a slip
START_COS = FIRST_READING + 13  # sum of cos of twice the angle at the starts of a slip
START_SIN = FIRST_READING + 14  # sum of sin of twice the angle at the starts of a slip
FORCE_SUM = FIRST_READING + 15  # sum of the friction over the steps of the cycle
FORCE_AT_MAX = (
    FIRST_READING + 16
)  # friction at the largest slide of the cycle, nan if the slide does not reverse there
FORCE_AT_MIN = FIRST_READING + 17  # friction at the smallest slide of the cycle, nan likewise
MEAN_RANGE = FIRST_READING + 18  # mean over the cycles of the range of the slide [m]
SECANT_SUM = FIRST_READING + 19  # sum over the cycles of the secant stiffness of the loop
N_SECANTS = FIRST_READING + 20  # number of cycles in `SECANT_SUM`
LONGEST_STICK = FIRST_READING + 21  # longest angle without a slip [rad]
CURRENT_STICK = FIRST_READING + 22  # angle since the last slip [rad]
FIRST_MEAN_SLIDE = FIRST_READING + 23  # integral of the slide over the first observed cycle
LAST_MEAN_SLIDE = FIRST_READING + 24  # integral of the slide over the last observed cycle
FIRST_MEAN_FORCE = FIRST_READING + 25  # integral of the friction over the first observed cycle
LAST_MEAN_FORCE = FIRST_READING + 26  # integral of the friction over the last observed cycle
CYCLE_START = FIRST_READING + 27  # slide at the start of the observed cycle [m]
N_READINGS = 28

# These rows are the case of the lane, the number of its cycle, and the state at the start of that cycle.
CASE_INDEX = FIRST_READING + N_READINGS
CYCLE_INDEX = CASE_INDEX + 1
START_SLIDE = CASE_INDEX + 2
START_SPEED = CASE_INDEX + 3
START_MEMORY = CASE_INDEX + 4

# These rows are the ends of the last cycles, the latest first. A cycle end holds STATE_ROWS, SUM_ROWS and the first
# numbers of the state of the law, from which `extrapolation_kernels` learns how the motion settles.
CYCLE_ENDS = CASE_INDEX + 5
N_CYCLE_ENDS = 4
STATE_ROWS = (SLIDE, SPEED, MEMORY, SLIP_SIGN)
SUM_ROWS = (SLIP_PATH, WORK_SUM, LOSS_SUM, POWER_SUM)
MAX_KEPT = 38  # largest number of numbers of the state of a law in a cycle end
CYCLE_END_SIZE = len(STATE_ROWS) + len(SUM_ROWS) + MAX_KEPT

# The rows from here on are the state of a law in addition to MEMORY. In a motion it follows the first N_STATE numbers.
LAW_STATE = CYCLE_ENDS + N_CYCLE_ENDS * CYCLE_END_SIZE
# Masing's rule: HALF_SLIP is the slide over YIELD_LENGTH from which half of the friction slips; from CURVE_STATE on a
# table has its own rows, of which the first is the abscissa on the curve that is looked up.
HALF_SLIP = LAW_NUMBERS + 2
CURVE_STATE = LAW_STATE + 276
CURVE_PLACE = CURVE_STATE
