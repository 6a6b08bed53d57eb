"""Places of the numbers of a case in lanes, and how many cases march side by side; no compiled code.

A workspace is a flat array that holds a number of all lanes side by side: number n of lane i stands at n * LANES + i, so
that a compiler knows the distance of any two and takes several lanes at once. Lengths are in m, times are angles of the
drive, so forces over the mass are in m and energies over it in m^2.
"""

LANES, GROUP = 32, 3  # of which groups of two to this power march while one of them has a case
CLOSE = 1e-9  # of the range of a cycle, by which the next one may differ that is the same
# of the range of a cycle: the change over one from which it may settle as a linear map does; by how much the end of the
# run is missed if it does, and by how much of the sums; square of the sine up to which two changes have one direction
NEAR, SURE, SURE_SUM, ALONG = 1e-2, 1e-7, 1e-6, 1e-6

# the motion: state, then sums of the run, then extremes and phasor of a cycle; whether the next step holds an event
X, V, WAY, PLACE, PATH, IN, LOST, POWER, HIGH, LOW, COS, SIN, EVENT = range(13)
STATE = 13

# the case: x and x' after a step from x, x', a constant force, the sine and the cosine of the drive, in a slip and with
# the spring of a stick; then the equation itself, acceleration of the output over x'' and of the base over the sine
NUMBER = STATE
(
    A11,
    A12,
    A21,
    A22,
    RX,
    RV,
    SX,
    SV,
    CX,
    CV,
    B11,
    B12,
    B21,
    B22,
    QX,
    QV,
    TX,
    TV,
    UX,
    UV,
    D,
    W,
    P,
    GK,
    GS,
    K,
    LENGTH,
    OUT,
    BASE,
) = range(NUMBER, NUMBER + 29)
NUMBERS = 29
# of a law that needs none of the first of these, in their place: the step, half of one over the cosine of half of it,
# its numbers
H, MIDDLE, FIRST_OF_LAW, OF_LAW = A11, A12, A21, 6

# what the last cycles show
SHOW = NUMBER + NUMBERS
(
    ACCELERATION,
    STUCK,
    FORCE,
    SLIP_HIGH,
    SLIP_LOW,
    C1,
    S1,
    C3,
    S3,
    MEAN,
    TURNED,
    PASSED,
    STARTS,
    START_COS,
    START_SIN,
    PULL,
    PULL_HIGH,
    PULL_LOW,
    RANGE,
    SECANT,
    SEEN,
    LONGEST,
    STICK,
    FIRST,
    LAST,
    F_FIRST,
    F_LAST,
    BEGUN,
) = range(SHOW, SHOW + 28)
SHOWN = 28

# which case a lane has, its cycle and where that began
CASE, CYCLE, WAS_X, WAS_V, WAS_PLACE = range(SHOW + SHOWN, SHOW + SHOWN + 5)

# at the ends of the last cycles but the one that ends: what tells how a motion settles, numbers of the state and sums,
# then those of its law
STATES, SUMS, OWN_MOST, ENDS = (X, V, PLACE, WAY), (PATH, IN, LOST, POWER), 38, 4
PAST, TOLD = SHOW + SHOWN + 5, 8 + OWN_MOST
# from here on what the state of a law has besides; it stands behind STATE in a motion
OWN = PAST + ENDS * TOLD

# of Masing's rule: the number from which half of its friction slips, over LENGTH; from where on its curve has a table,
# and the place on it that is to be found
HALF, CURVE = FIRST_OF_LAW + 2, OWN + 276
WHERE = CURVE
