"""March of patches with bonds behind shear modes, one case per lane.

The steps are those of `passing_kernels`.

The cases share the modes of their rig and the frequency of their drive, and have N_POINTS points behind N_PIECE_MODES modes
of the pieces each. In every step all lanes take as many turns of Newton's method as the slowest of them needs. The workspace
is a flat array as in `lanes.rows_kernels`: row r of lane i is the element r * LANES + i. Stretches are over the bond length
and squares over its square, for bonds whose density is constant. A test compares a case with `march.Run`. Cost: 20 ns per
step and case on a core with vectors of eight numbers.
"""

from math import sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_NO_REFCOUNT

LANES = 32  # number of cases that march side by side
N_POINTS = 6  # points of the interface of a case
N_PIECE_MODES = 2  # shear modes of the pieces of a case
N_RIG_MODES = 2  # modes of the rig
N_UNKNOWNS = 1 + N_PIECE_MODES  # increments of the slide and of the coordinates of the pieces

# These rows are the state: coordinates and rates of the rig, coordinates of the pieces, stretches and their squares.
RIG_POSITION = 0
RIG_RATE = N_RIG_MODES
PIECE_POSITION = 2 * N_RIG_MODES
STRETCHES = PIECE_POSITION + N_PIECE_MODES
SQUARES = STRETCHES + N_POINTS
# These rows are the unknowns of a step, those of the two steps before, and the step of Newton's method.
INCREMENTS = SQUARES + N_POINTS
LAST_INCREMENTS = INCREMENTS + N_UNKNOWNS
INCREMENTS_BEFORE = INCREMENTS + 2 * N_UNKNOWNS
NEWTON_STEP = INCREMENTS + 3 * N_UNKNOWNS
DESCENT = INCREMENTS + 4 * N_UNKNOWNS  # decrease that the last step of Newton's method predicts
IS_SOLVED = DESCENT + 1  # 1 if the step is solved
FREE_SLIDE = DESCENT + 2  # increment of the slide without friction [m]
FRICTION = DESCENT + 3  # friction force at the sample [N]
INTERFACE_ENERGY = DESCENT + 4  # energy of bonds and pieces [J]
SLIP = DESCENT + 5  # mean slip of the points [m]
OUTPUT = DESCENT + 6  # displacement of the output [m]
OUTPUT_RATE = DESCENT + 7  # rate of the output [m/s]
LAST_OUTPUT = DESCENT + 8  # the same at the start of the step
LAST_OUTPUT_RATE = DESCENT + 9
RIG_SLIDE = DESCENT + 10  # slide of the rig [m]
MEAN_FORCE = DESCENT + 11  # mean friction force of the step [N]
DRIVE_WORK = DESCENT + 12  # work of the drive in the step [J]
VISCOUS_LOSS = DESCENT + 13  # viscous loss in the step [J]
RATE_SQUARES = DESCENT + 14  # sum of v^2 + omega^2 z^2 of the modes
# These rows are the numbers of a case.
DRIVE = DESCENT + 15  # amplitude of its drive over that of the table
BOND_LENGTH = DESCENT + 16  # [m]
LIMIT = DESCENT + 17  # friction limit [N]
POINT_LIMITS = DESCENT + 18  # friction limits of the points [N]
SHAPES = POINT_LIMITS + N_POINTS  # slides of the points per coordinate of the pieces
STIFFNESSES = SHAPES + N_PIECE_MODES * N_POINTS  # stiffness of the coordinates of the pieces [N/m]
MAX_SHAPES = STIFFNESSES + N_PIECE_MODES  # largest absolute slide of a point per coordinate
MEAN_SHAPES = MAX_SHAPES + N_PIECE_MODES  # mean slide of the points per coordinate
# These rows are the sums of the run [J], which `lanes.LEDGER_ROWS` names.
WORK_IN = MEAN_SHAPES + N_PIECE_MODES
VISCOUS_SUM = WORK_IN + 1
DRIVE_WORK_SIZE = WORK_IN + 2
FRICTION_LOSS = WORK_IN + 3
MAX_STORED = WORK_IN + 4
FRICTION_WORK = WORK_IN + 5
SAMPLED_WORK = WORK_IN + 6
FRICTION_WORK_SIZE = WORK_IN + 7
INTERFACE_LOSS = WORK_IN + 8
INTERFACE_GAIN = WORK_IN + 9
# These rows are the extremes and the phasor of the output in a cycle [m].
MIN_OUTPUT = WORK_IN + 10
MAX_OUTPUT = WORK_IN + 11
COS_SUM = WORK_IN + 12
SIN_SUM = WORK_IN + 13
N_UNSOLVED = WORK_IN + 14  # number of steps without a solution
MAX_SLIDE = WORK_IN + 15  # largest slide of the run [m]
N_NUMBERS = WORK_IN + 16

# Rows of a mode of the rig: its step as `propagator.Propagator` has it, for forces instead of accelerations.
ZZ = 0
ZV = 1
VZ = 2
VV = 3
BY_Z = 4
BY_V = 5
REACH_Z = 6
REACH_V = 7
LOSS = 8  # six coefficients of the quadratic form of the viscous loss
SLIDE_SHAPE = 14  # slide per coordinate
OUTPUT_SHAPE = 15  # output per coordinate
OMEGA_SQUARE = 16  # square of the angular frequency
N_RIG_ROWS = 17  # after them: compliance of the slide [m/N], mass [kg], length of a step [s]
# Columns of the table of a step, for a drive of 1 m s-2.
BY_DRIVE = 0  # what it adds to coordinates and rates
WORK_FORMS = 2 * N_RIG_MODES  # coefficients of its work
LOSS_FORMS = 5 * N_RIG_MODES  # coefficients of the viscous loss
REMAINDERS = 8 * N_RIG_MODES  # constant parts of work and loss
PORT_SLIDE = REMAINDERS + 2  # increment of the slide
WAVES = REMAINDERS + 3  # cosine and sine of the drive at the start of the step
N_COLUMNS = WAVES + 2
N_SAMPLE = 2 * N_RIG_MODES + 2  # numbers of a sample: coordinates, rates, force, slip

NEWTON_TOL = 4e-6  # last step of Newton's method, in bond lengths, as in `shear_solve_kernels`
MAX_TURNS = 60  # turns of Newton's method
BEND_TOL = 1e-9  # bend of the forces over the last step of Newton's method that is neglected, over the limit
MAX_SERIES = 0.5  # slide, in bond lengths, up to which the series is used
MAX_EXPONENT = 40.0  # slide, in bond lengths, beyond which exp(-x) of the bonds is below round-off


@njit(**NJIT_INLINE)
def path_shapes(x, far):
    """Return the shape functions f1 and f2 of the mean force over a slide of x bond lengths, and exp(-x).

    See `friction.bonds.point_kernels`. The series of half of x is doubled by f2(2 y) = f2(y)/2 + f1(y)^2/4. A
    larger x takes exp(-x) from its 256th part, so no branch and no call is needed.
    """
    y = 0.5 * (min(x, MAX_SERIES) if far else x)
    f2 = 0.5 - y * (
        1 / 6
        - y
        * (
            1 / 24
            - y
            * (
                1 / 120
                - y
                * (
                    1 / 720
                    - y
                    * (
                        1 / 5040
                        - y * (1 / 40320 - y * (1 / 362880 - y * (1 / 3628800 - y / 39916800)))
                    )
                )
            )
        )
    )
    f1 = 1 - y * f2
    e = 1 - y * f1
    f2 = 0.5 * f2 + 0.25 * f1 * f1
    f1 = 0.5 * f1 * (1 + e)
    e = e * e
    if far:
        y = min(x, MAX_EXPONENT) / 256
        d = 1 - y * (
            1
            - y
            / 2
            * (1 - y / 3 * (1 - y / 4 * (1 - y / 5 * (1 - y / 6 * (1 - y / 7 * (1 - y / 8))))))
        )
        d = d * d
        d = d * d
        d = d * d
        d = d * d
        d = d * d
        d = d * d
        d = d * d
        d = d * d
        over = 1 / max(x, MAX_SERIES)
        one = (1 - d) * over
        f1 = one if x > MAX_SERIES else f1
        f2 = (1 - one) * over if x > MAX_SERIES else f2
        e = d if x > MAX_SERIES else e
    return f1, f2, e


@njit(**NJIT_INLINE)
def add_point(s, workspace, lane, j, y, over, far):
    """Add a point to the residual and the lower triangle of the Hessian, s (9,), at increments y.

    Parameters
    ----------
    s : tuple of float
        Residual (3,), then rows of the lower half of the Hessian (6,).
    workspace : array
        Rows of the lanes, named at the top of the module.
    lane : int
    j : int
        Number of the point.
    y : tuple of float
        Increments of the slide and of the coordinates of the pieces [m].
    over : float
        1 over the bond length [1/m].
    far : bool
        Whether a slide may exceed MAX_SERIES; a constant of the call.

    Returns
    -------
    tuple of float
    """
    g0, g1, g2, h00, h01, h02, h11, h12, h22 = s
    a = workspace[(SHAPES + j) * LANES + lane]
    b = workspace[(SHAPES + N_POINTS + j) * LANES + lane]
    limit = workspace[(POINT_LIMITS + j) * LANES + lane]
    stretch = workspace[(STRETCHES + j) * LANES + lane]
    xi = y[0] - a * y[1] - b * y[2]
    way = 1.0 if xi > 0.0 else -1.0
    x = abs(xi) * over
    f1, f2, _ = path_shapes(x, far)
    force = limit * (stretch * f1 + way * x * f2)
    slope = limit * over * (f1 - f2) * max(1 - way * stretch, 0.0)
    return (
        g0 + force,
        g1 - a * force,
        g2 - b * force,
        h00 + slope,
        h01 - a * slope,
        h02 - b * slope,
        h11 + a * a * slope,
        h12 + a * b * slope,
        h22 + b * b * slope,
    )


@njit(**NJIT_INLINE)
def take_newton_turn(workspace, lane, beta, far):
    """Take a Newton step in a lane, or take back half of the last step if it went too far.

    Parameters
    ----------
    workspace : array
        Rows of the lanes, named at the top of the module.
    lane : int
    beta : float
        Give of the slide in a step [m/N].
    far : bool
        Whether a slide may exceed MAX_SERIES; a constant of the call.
    """
    y0 = workspace[INCREMENTS * LANES + lane]
    y1 = workspace[(INCREMENTS + 1) * LANES + lane]
    y2 = workspace[(INCREMENTS + 2) * LANES + lane]
    p0 = workspace[NEWTON_STEP * LANES + lane]
    p1 = workspace[(NEWTON_STEP + 1) * LANES + lane]
    p2 = workspace[(NEWTON_STEP + 2) * LANES + lane]
    length = workspace[BOND_LENGTH * LANES + lane]
    fall = workspace[DESCENT * LANES + lane]
    done = workspace[IS_SOLVED * LANES + lane]
    over = 1 / length
    one = 0.5 * workspace[STIFFNESSES * LANES + lane]
    two = 0.5 * workspace[(STIFFNESSES + 1) * LANES + lane]
    y = (y0, y1, y2)
    s = (
        (y0 - workspace[FREE_SLIDE * LANES + lane]) / beta,
        one * (2 * workspace[PIECE_POSITION * LANES + lane] + y1),
        two * (2 * workspace[(PIECE_POSITION + 1) * LANES + lane] + y2),
        1 / beta,
        0.0,
        0.0,
        one,
        0.0,
        two,
    )
    # unrolled, because the compiler does not vectorise a loop over them across the lanes
    s = add_point(s, workspace, lane, 0, y, over, far)
    s = add_point(s, workspace, lane, 1, y, over, far)
    s = add_point(s, workspace, lane, 2, y, over, far)
    s = add_point(s, workspace, lane, 3, y, over, far)
    s = add_point(s, workspace, lane, 4, y, over, far)
    g0, g1, g2, h00, h01, h02, h11, h12, h22 = add_point(s, workspace, lane, 5, y, over, far)
    back = g0 * p0 + g1 * p1 + g2 * p2 > 0.5 * fall
    r00 = 1 / h00
    l1 = h01 * r00
    l2 = h02 * r00
    r11 = 1 / (h11 - l1 * h01)
    m = h12 - l2 * h01
    l3 = m * r11
    r1 = g1 - l1 * g0
    n2 = -(g2 - l2 * g0 - l3 * r1) / (h22 - l2 * h02 - l3 * m)
    n1 = -r1 * r11 - l3 * n2
    n0 = -g0 * r00 - l1 * n1 - l2 * n2
    one = workspace[MAX_SHAPES * LANES + lane]
    two = workspace[(MAX_SHAPES + 1) * LANES + lane]
    slopes = h00 - 1 / beta
    size = abs(n0) + one * abs(n1) + two * abs(n2)
    least = abs(y0) - one * abs(y1) - two * abs(y2)
    # where no point reverses in this step, the curvature of the forces over it follows from their slopes, which are 0
    # while all points slip
    near = size <= NEWTON_TOL * length or (
        least > size and slopes * size * size <= BEND_TOL * workspace[LIMIT * LANES + lane] * length
    )
    on = 0.0 if done > 0.0 else 1.0
    workspace[INCREMENTS * LANES + lane] = y0 + on * (-0.5 * p0 if back else n0)
    workspace[(INCREMENTS + 1) * LANES + lane] = y1 + on * (-0.5 * p1 if back else n1)
    workspace[(INCREMENTS + 2) * LANES + lane] = y2 + on * (-0.5 * p2 if back else n2)
    workspace[NEWTON_STEP * LANES + lane] = 0.5 * p0 if back else n0
    workspace[(NEWTON_STEP + 1) * LANES + lane] = 0.5 * p1 if back else n1
    workspace[(NEWTON_STEP + 2) * LANES + lane] = 0.5 * p2 if back else n2
    workspace[DESCENT * LANES + lane] = 0.5 * fall if back else -(g0 * n0 + g1 * n1 + g2 * n2)
    workspace[IS_SOLVED * LANES + lane] = 1.0 if done > 0.0 or (near and not back) else 0.0


@njit(**NJIT_INLINE)
def move_point(s, workspace, lane, j, y, over, far):
    """Move a point by the increments and add it to the sums s (4,).

    Parameters
    ----------
    s : tuple of float
        Work over the limit, increase of the squares, force and squares of the points.
    workspace : array
        Rows of the lanes, named at the top of the module.
    lane : int
    j : int
        Number of the point.
    y : tuple of float
        Increments of the slide and of the coordinates of the pieces [m].
    over : float
        1 over the bond length [1/m].
    far : bool
        Whether a slide may exceed MAX_SERIES; a constant of the call.

    Returns
    -------
    tuple of float
    """
    worked, rise, force, square = s
    a = workspace[(SHAPES + j) * LANES + lane]
    b = workspace[(SHAPES + N_POINTS + j) * LANES + lane]
    limit = workspace[(POINT_LIMITS + j) * LANES + lane]
    stretch = workspace[(STRETCHES + j) * LANES + lane]
    old = workspace[(SQUARES + j) * LANES + lane]
    xi = y[0] - a * y[1] - b * y[2]
    way = 1.0 if xi > 0.0 else -1.0
    x = abs(xi) * over
    f1, f2, e = path_shapes(x, far)
    far_x = min(x, MAX_EXPONENT)
    new = e * (old + 2 * way * stretch * x + x * x) + (2 - e * (far_x * far_x + 2 * far_x + 2))
    new = new if x < MAX_EXPONENT else 2.0
    one = stretch * e + way * (1 - e)
    workspace[(STRETCHES + j) * LANES + lane] = one
    workspace[(SQUARES + j) * LANES + lane] = new
    return (
        worked + limit * (stretch * f1 + way * x * f2) * xi,
        rise + limit * (new - old),
        force + limit * one,
        square + limit * new,
    )


@njit(**NJIT_INLINE)
def commit_step(workspace, lane, beta, far):
    """Move the points and the pieces of a lane by its solved step and add to their sums.

    Parameters
    ----------
    workspace : array
        Rows of the lanes, named at the top of the module.
    lane : int
    beta : float
        Give of the slide in a step [m/N].
    far : bool
        Whether a slide may exceed MAX_SERIES; a constant of the call.
    """
    y0 = workspace[INCREMENTS * LANES + lane]
    y1 = workspace[(INCREMENTS + 1) * LANES + lane]
    y2 = workspace[(INCREMENTS + 2) * LANES + lane]
    length = workspace[BOND_LENGTH * LANES + lane]
    used = (workspace[FREE_SLIDE * LANES + lane] - y0) / beta
    over = 1 / length
    y = (y0, y1, y2)
    b1 = workspace[PIECE_POSITION * LANES + lane] + y1
    b2 = workspace[(PIECE_POSITION + 1) * LANES + lane] + y2
    s = move_point((0.0, 0.0, 0.0, 0.0), workspace, lane, 0, y, over, far)
    s = move_point(s, workspace, lane, 1, y, over, far)
    s = move_point(s, workspace, lane, 2, y, over, far)
    s = move_point(s, workspace, lane, 3, y, over, far)
    s = move_point(s, workspace, lane, 4, y, over, far)
    worked, rise, force, square = move_point(s, workspace, lane, 5, y, over, far)
    energy = 0.5 * (
        length * square
        + workspace[STIFFNESSES * LANES + lane] * b1 * b1
        + workspace[(STIFFNESSES + 1) * LANES + lane] * b2 * b2
    )
    work = used * y0
    q = workspace[RIG_SLIDE * LANES + lane]
    gone = work - (energy - workspace[INTERFACE_ENERGY * LANES + lane])
    noise = workspace[LIMIT * LANES + lane] * (1e-12 * abs(y0) + 1e-15 * abs(q))
    workspace[PIECE_POSITION * LANES + lane] = b1
    workspace[(PIECE_POSITION + 1) * LANES + lane] = b2
    workspace[MEAN_FORCE * LANES + lane] = used
    workspace[FRICTION_LOSS * LANES + lane] += worked - 0.5 * length * rise
    workspace[FRICTION_WORK * LANES + lane] += work
    workspace[FRICTION_WORK_SIZE * LANES + lane] += abs(work)
    workspace[SAMPLED_WORK * LANES + lane] += (
        0.5 * (workspace[FRICTION * LANES + lane] + force) * y0
    )
    workspace[INTERFACE_LOSS * LANES + lane] += gone if gone > -noise else 0.0
    workspace[INTERFACE_GAIN * LANES + lane] -= gone if gone < -noise else 0.0
    workspace[FRICTION * LANES + lane] = force
    workspace[INTERFACE_ENERGY * LANES + lane] = energy
    # the next guess is a quadratic extrapolation of the last three steps
    for k in range(3):
        here = workspace[(INCREMENTS + k) * LANES + lane]
        last = workspace[(LAST_INCREMENTS + k) * LANES + lane]
        workspace[(INCREMENTS + k) * LANES + lane] = (
            3 * (here - last) + workspace[(INCREMENTS_BEFORE + k) * LANES + lane]
        )
        workspace[(INCREMENTS_BEFORE + k) * LANES + lane] = last
        workspace[(LAST_INCREMENTS + k) * LANES + lane] = here


@njit(**NJIT_INLINE)
def move_mode(workspace, lane, k, mode, push):
    """Move a mode of the rig of a lane by a step, and add its outputs and energies.

    Parameters
    ----------
    workspace : array
        Rows of the lanes, named at the top of the module.
    lane : int
    k : int
        Number of the mode.
    mode : tuple of float
        Rows of the mode in `rig`.
    push : tuple of float
        Columns of the mode in the table.
    """
    (
        zz,
        zv,
        vz,
        vv,
        by_z,
        by_v,
        loss_zz,
        loss_zv,
        loss_vv,
        loss_zf,
        loss_vf,
        loss_ff,
        slide,
        output,
        rate,
    ) = mode
    more_z, more_v, work_z, work_v, work_f, lost_z, lost_v, lost_f = push
    z = workspace[(RIG_POSITION + k) * LANES + lane]
    v = workspace[(RIG_RATE + k) * LANES + lane]
    f = slide * workspace[MEAN_FORCE * LANES + lane]
    drive = workspace[DRIVE * LANES + lane]
    z1 = zz * z + zv * v - by_z * f + drive * more_z
    v1 = vz * z + vv * v - by_v * f + drive * more_v
    workspace[DRIVE_WORK * LANES + lane] += drive * (work_z * z + work_v * v - work_f * f)
    workspace[VISCOUS_LOSS * LANES + lane] += (
        drive * (lost_z * z + lost_v * v - lost_f * f)
        + (loss_zz * z + loss_zv * v - loss_zf * f) * z
        + (loss_vv * v - loss_vf * f) * v
        + loss_ff * f * f
    )
    workspace[(RIG_POSITION + k) * LANES + lane] = z1
    workspace[(RIG_RATE + k) * LANES + lane] = v1
    workspace[RIG_SLIDE * LANES + lane] += slide * z1
    workspace[OUTPUT * LANES + lane] += output * z1
    workspace[OUTPUT_RATE * LANES + lane] += output * v1
    workspace[RATE_SQUARES * LANES + lane] += v1 * v1 + rate * z1 * z1


@njit(**NJIT_INLINE)
def start_sums(workspace, lane, work, lost, cosine, sine):
    """Start the sums over the modes in a step with the terms that depend on the drive alone.

    Parameters
    ----------
    workspace : array
        Rows of the lanes, named at the top of the module.
    lane : int
    work : float
        Constant part of the work of the drive [J].
    lost : float
        Constant part of the viscous loss [J].
    cosine : float
        Cosine of the drive at the start of the step.
    sine : float
    """
    out = workspace[OUTPUT * LANES + lane]
    square = workspace[DRIVE * LANES + lane] * workspace[DRIVE * LANES + lane]
    workspace[COS_SUM * LANES + lane] += out * cosine
    workspace[SIN_SUM * LANES + lane] += out * sine
    workspace[LAST_OUTPUT * LANES + lane] = out
    workspace[LAST_OUTPUT_RATE * LANES + lane] = workspace[OUTPUT_RATE * LANES + lane]
    workspace[DRIVE_WORK * LANES + lane] = square * work
    workspace[VISCOUS_LOSS * LANES + lane] = square * lost
    workspace[RIG_SLIDE * LANES + lane] = workspace[OUTPUT * LANES + lane] = workspace[
        OUTPUT_RATE * LANES + lane
    ] = workspace[RATE_SQUARES * LANES + lane] = 0.0


@njit(**NJIT_INLINE)
def finish_sums(workspace, lane, half_mass):
    """Add a step of a lane to the sums of its run and of its cycle.

    Parameters
    ----------
    workspace : array
        Rows of the lanes, named at the top of the module.
    lane : int
    half_mass : float
        Half of the modal mass [kg].
    """
    place = workspace[RIG_SLIDE * LANES + lane]
    out = workspace[OUTPUT * LANES + lane]
    work = workspace[DRIVE_WORK * LANES + lane]
    workspace[WORK_IN * LANES + lane] += work
    workspace[DRIVE_WORK_SIZE * LANES + lane] += abs(work)
    workspace[VISCOUS_SUM * LANES + lane] += workspace[VISCOUS_LOSS * LANES + lane]
    held = (
        workspace[INTERFACE_ENERGY * LANES + lane]
        + half_mass * workspace[RATE_SQUARES * LANES + lane]
    )
    workspace[MAX_STORED * LANES + lane] = max(workspace[MAX_STORED * LANES + lane], held)
    workspace[MAX_SLIDE * LANES + lane] = max(workspace[MAX_SLIDE * LANES + lane], abs(place))
    workspace[MIN_OUTPUT * LANES + lane] = min(workspace[MIN_OUTPUT * LANES + lane], out)
    workspace[MAX_OUTPUT * LANES + lane] = max(workspace[MAX_OUTPUT * LANES + lane], out)
    workspace[SLIP * LANES + lane] = (
        place
        - workspace[MEAN_SHAPES * LANES + lane] * workspace[PIECE_POSITION * LANES + lane]
        - workspace[(MEAN_SHAPES + 1) * LANES + lane]
        * workspace[(PIECE_POSITION + 1) * LANES + lane]
        - workspace[BOND_LENGTH * LANES + lane]
        * workspace[FRICTION * LANES + lane]
        / workspace[LIMIT * LANES + lane]
    )


@njit(**NJIT_INLINE)
def set_free_slide(workspace, lane, rig, row):
    """Set the free slide of a step from the motion at its start.

    Parameters
    ----------
    workspace : array
        Rows of the lanes, named at the top of the module.
    lane : int
    rig : (N_RIG_ROWS + 1, 3) array
        Rows of the modes of the rig.
    row : (N_COLUMNS,) array
        Row of the table of the step.
    """
    free = workspace[DRIVE * LANES + lane] * row[PORT_SLIDE]
    for k in range(N_RIG_MODES):
        free += (
            rig[REACH_Z, k] * workspace[(RIG_POSITION + k) * LANES + lane]
            + rig[REACH_V, k] * workspace[(RIG_RATE + k) * LANES + lane]
        )
    workspace[FREE_SLIDE * LANES + lane] = free
    workspace[IS_SOLVED * LANES + lane] = workspace[DESCENT * LANES + lane] = 0.0
    workspace[NEWTON_STEP * LANES + lane] = workspace[(NEWTON_STEP + 1) * LANES + lane] = workspace[
        (NEWTON_STEP + 2) * LANES + lane
    ] = 0.0


@njit(**NJIT_INLINE)
def count_long_slides(workspace, lengths):
    """Return the number of lanes in which a point may slide `lengths` bond lengths or more."""
    near = 0.0
    for lane in range(LANES):
        far = (
            abs(workspace[INCREMENTS * LANES + lane])
            + workspace[MAX_SHAPES * LANES + lane] * abs(workspace[(INCREMENTS + 1) * LANES + lane])
            + workspace[(MAX_SHAPES + 1) * LANES + lane]
            * abs(workspace[(INCREMENTS + 2) * LANES + lane])
        )
        near += 1.0 if far <= lengths * workspace[BOND_LENGTH * LANES + lane] else 0.0
    return LANES - near


@njit(**NJIT_INLINE)
def count_unsolved(workspace):
    """Return the number of lanes whose step is not solved."""
    done = 0.0
    for lane in range(LANES):
        done += workspace[IS_SOLVED * LANES + lane]
    return LANES - done


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def update_extremes(workspace, dt):
    """Update the extremes of the cycle with those inside a step, as `passing_kernels.read_cycle` finds them."""
    turns = 0.0
    for lane in range(LANES):
        turns += (
            1.0
            if workspace[LAST_OUTPUT_RATE * LANES + lane] * workspace[OUTPUT_RATE * LANES + lane]
            < 0.0
            else 0.0
        )
    for lane in range(LANES if turns > 0.0 else 0):
        if workspace[LAST_OUTPUT_RATE * LANES + lane] * workspace[OUTPUT_RATE * LANES + lane] < 0.0:
            a = workspace[LAST_OUTPUT * LANES + lane]
            b = workspace[OUTPUT * LANES + lane]
            p = workspace[LAST_OUTPUT_RATE * LANES + lane] * dt
            r = workspace[OUTPUT_RATE * LANES + lane] * dt
            big = 2 * (a - b) + p + r
            mid = 3 * (b - a) - 2 * p - r
            root = sqrt(max(mid * mid - 3 * big * p, 0.0))
            for sign in (1.0, -1.0):
                s = -p / (mid + sign * root)
                if 0.0 <= s <= 1.0:
                    value = a + p * s + mid * s * s + big * s * s * s
                    workspace[MIN_OUTPUT * LANES + lane] = min(
                        workspace[MIN_OUTPUT * LANES + lane], value
                    )
                    workspace[MAX_OUTPUT * LANES + lane] = max(
                        workspace[MAX_OUTPUT * LANES + lane], value
                    )


@njit(**NJIT_INLINE)
def march_step(workspace, rig, row):
    """March all lanes by a step.

    Parameters
    ----------
    workspace : array
        Rows of the lanes, named at the top of the module.
    rig : (N_RIG_ROWS + 1, 3) array
        Rows of the modes of the rig.
    row : (N_COLUMNS,) array
        Row of the table of the step.
    """
    beta = rig[N_RIG_ROWS, 0]
    for lane in range(LANES):
        set_free_slide(workspace, lane, rig, row)
    for _ in range(MAX_TURNS):
        if count_long_slides(workspace, MAX_SERIES) == 0.0:
            for lane in range(LANES):
                take_newton_turn(workspace, lane, beta, False)
        else:
            for lane in range(LANES):
                take_newton_turn(workspace, lane, beta, True)
        if count_unsolved(workspace) == 0.0:
            break
    if count_unsolved(workspace) > 0.0:
        for lane in range(LANES):
            workspace[N_UNSOLVED * LANES + lane] += 1.0 - workspace[IS_SOLVED * LANES + lane]
    if count_long_slides(workspace, MAX_SERIES) == 0.0:
        for lane in range(LANES):
            commit_step(workspace, lane, beta, False)
    else:
        for lane in range(LANES):
            commit_step(workspace, lane, beta, True)
    work = row[REMAINDERS]
    lost = row[REMAINDERS + 1]
    cosine = row[WAVES]
    sine = row[WAVES + 1]
    half_mass = 0.5 * rig[N_RIG_ROWS, 1]
    for lane in range(LANES):
        start_sums(workspace, lane, work, lost, cosine, sine)
    for k in range(N_RIG_MODES):
        mode = (
            rig[ZZ, k],
            rig[ZV, k],
            rig[VZ, k],
            rig[VV, k],
            rig[BY_Z, k],
            rig[BY_V, k],
            rig[LOSS, k],
            rig[LOSS + 1, k],
            rig[LOSS + 2, k],
            rig[LOSS + 3, k],
            rig[LOSS + 4, k],
            rig[LOSS + 5, k],
            rig[SLIDE_SHAPE, k],
            rig[OUTPUT_SHAPE, k],
            rig[OMEGA_SQUARE, k],
        )
        push = (
            row[BY_DRIVE + k],
            row[BY_DRIVE + N_RIG_MODES + k],
            row[WORK_FORMS + k],
            row[WORK_FORMS + N_RIG_MODES + k],
            row[WORK_FORMS + 2 * N_RIG_MODES + k],
            row[LOSS_FORMS + k],
            row[LOSS_FORMS + N_RIG_MODES + k],
            row[LOSS_FORMS + 2 * N_RIG_MODES + k],
        )
        for lane in range(LANES):
            move_mode(workspace, lane, k, mode, push)
    for lane in range(LANES):
        finish_sums(workspace, lane, half_mass)
    update_extremes(workspace, rig[N_RIG_ROWS, 2])


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def store_samples(workspace, sample):
    """Write the samples (N_SAMPLE, LANES) of all lanes."""
    for lane in range(LANES):
        for k in range(2 * N_RIG_MODES):
            sample[k, lane] = workspace[k * LANES + lane]
        sample[2 * N_RIG_MODES, lane] = workspace[FRICTION * LANES + lane]
        sample[2 * N_RIG_MODES + 1, lane] = workspace[SLIP * LANES + lane]


@njit(error_model="numpy", cache=True, nogil=True, **NJIT_NO_REFCOUNT)
def march(workspace, rig, table, history, samples, work):
    """March all lanes over cycles, of which the last ones are kept.

    Parameters
    ----------
    workspace : array
        Rows of the lanes, named at the top of the module.
    rig : (N_RIG_ROWS + 1, 3) array
        Rows of the modes of the rig.
    table : (s, N_COLUMNS) array
        Rows of the steps of a cycle.
    history : (c, 4, LANES) array
        Smallest and largest output of each cycle, and its phasor [m]; it is written.
    samples : (w s + 1, N_SAMPLE, LANES) array
        Samples of the last w cycles; it is written.
    work : (LANES,) array
        Friction work before these cycles [J]; it is written.
    """
    steps = table.shape[0]
    cycles = history.shape[0]
    first = cycles - (samples.shape[0] - 1) // steps
    for c in range(cycles):
        for lane in range(LANES):
            workspace[MIN_OUTPUT * LANES + lane] = workspace[MAX_OUTPUT * LANES + lane] = workspace[
                OUTPUT * LANES + lane
            ]
            workspace[COS_SUM * LANES + lane] = workspace[SIN_SUM * LANES + lane] = 0.0
            if c == first:
                work[lane] = workspace[FRICTION_WORK * LANES + lane]
        for s in range(steps):
            if c >= first:
                store_samples(workspace, samples[(c - first) * steps + s])
            march_step(workspace, rig, table[s])
        for lane in range(LANES):
            history[c, 0, lane] = workspace[MIN_OUTPUT * LANES + lane]
            history[c, 1, lane] = workspace[MAX_OUTPUT * LANES + lane]
            history[c, 2, lane] = 2 * workspace[COS_SUM * LANES + lane] / steps
            history[c, 3, lane] = -2 * workspace[SIN_SUM * LANES + lane] / steps
    store_samples(workspace, samples[samples.shape[0] - 1])
