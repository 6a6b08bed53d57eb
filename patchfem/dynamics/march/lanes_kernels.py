"""March of patches with coupled bond points, one case per lane (compiled).

The time step is that of `passing_kernels`.

The cases share the modes of their rig and the frequency of their drive, and each have N_POINTS points coupled by
N_PIECE_MODES modes of the pieces. In every step all lanes take as many Newton iterations as the slowest of them
needs. The workspace is a flat array as in `lanes.rows_kernels`, whose rows `lane_rows` names. Stretches are relative
to the bond length and squares to its square, for bonds whose density is constant. A test compares a case with
`march.Run`. Cost: 20 ns per step and case on a core with vectors of eight numbers.
"""

from math import sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_NO_REFCOUNT
from .lane_rows import LANES, N_POINTS, N_RIG_MODES, At, RigRow, StepColumn

NEWTON_TOL = 4e-6  # largest last Newton step [bond lengths], as in `shear_solve_kernels`
MAX_SWEEPS = 60  # largest number of Newton iterations in a step
# Largest force change neglected by the last Newton step, due to curvature,
# relative to the friction limit.
CURVATURE_TOL = 1e-9
MAX_SERIES_SLIDE = 0.5  # largest slide for which the series is used [bond lengths]
# Largest slide [bond lengths] at which exp(-x) of the bonds exceeds round-off.
MAX_EXPONENTIAL_SLIDE = 40.0


@njit(**NJIT_INLINE)
def evaluate_force_shapes(x, is_long):
    """Evaluate the shape functions f1, f2 of the mean bond force over a slide, and exp(-x).

    x: slide in bond lengths. See `friction.bonds.point_kernels`. The series of half of x is doubled by f2(2 y) =
    f2(y)/2 + f1(y)^2/4. A larger x takes exp(-x) from that of x/256, so no branch and no call is needed.
    """
    y = 0.5 * (min(x, MAX_SERIES_SLIDE) if is_long else x)
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
    if is_long:
        y = min(x, MAX_EXPONENTIAL_SLIDE) / 256
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
        inverse_x = 1 / max(x, MAX_SERIES_SLIDE)
        mean_decay = (1 - d) * inverse_x
        f1 = mean_decay if x > MAX_SERIES_SLIDE else f1
        f2 = (1 - mean_decay) * inverse_x if x > MAX_SERIES_SLIDE else f2
        e = d if x > MAX_SERIES_SLIDE else e
    return f1, f2, e


@njit(**NJIT_INLINE)
def find_point_slide(workspace, lane, j):
    """Return the slide increment [m] of a bond point in the step.

    Parameters
    ----------
    workspace : array
        Workspace of all lanes, see `lane_rows`.
    lane : int
    j : int
        Number of the point.

    Returns
    -------
    float
    """
    a = workspace[At.SHAPES + j * LANES + lane]
    b = workspace[At.SHAPES + (N_POINTS + j) * LANES + lane]
    return (
        workspace[At.INCREMENTS + lane]
        - a * workspace[At.INCREMENTS + LANES + lane]
        - b * workspace[At.INCREMENTS + 2 * LANES + lane]
    )


@njit(**NJIT_INLINE)
def evaluate_point(workspace, lane, j, is_long):
    """Return the mean force [N] of a bond point in the step, and its slope [N/m].

    Parameters
    ----------
    workspace : array
        Workspace of all lanes, see `lane_rows`.
    lane : int
    j : int
        Number of the point.
    is_long : bool
        Whether a slide may exceed MAX_SERIES_SLIDE; a compile-time constant.
    """
    limit = workspace[At.POINT_LIMITS + j * LANES + lane]
    stretch = workspace[At.STRETCHES + j * LANES + lane]
    inverse_length = 1 / workspace[At.BOND_LENGTH + lane]
    xi = find_point_slide(workspace, lane, j)
    direction = 1.0 if xi > 0.0 else -1.0
    x = abs(xi) * inverse_length
    f1, f2, _ = evaluate_force_shapes(x, is_long)
    force = limit * (stretch * f1 + direction * x * f2)
    slope = limit * inverse_length * (f1 - f2) * max(1 - direction * stretch, 0.0)
    return force, slope


@njit(**NJIT_INLINE)
def take_newton_step(workspace, lane, beta, is_long):
    """Take a Newton step in a lane, or halve its last step if the residual did not decrease.

    Parameters
    ----------
    workspace : array
        Workspace of all lanes, see `lane_rows`.
    lane : int
    beta : float
        Compliance of the slide in a step [m/N].
    is_long : bool
        Whether a slide may exceed MAX_SERIES_SLIDE; a compile-time constant.
    """
    y0 = workspace[At.INCREMENTS + lane]
    y1 = workspace[At.INCREMENTS + LANES + lane]
    y2 = workspace[At.INCREMENTS + 2 * LANES + lane]
    p0 = workspace[At.NEWTON_STEP + lane]
    p1 = workspace[At.NEWTON_STEP + LANES + lane]
    p2 = workspace[At.NEWTON_STEP + 2 * LANES + lane]
    length = workspace[At.BOND_LENGTH + lane]
    descent = workspace[At.DESCENT + lane]
    is_solved = workspace[At.IS_SOLVED + lane]
    half_stiffness1 = 0.5 * workspace[At.STIFFNESSES + lane]
    half_stiffness2 = 0.5 * workspace[At.STIFFNESSES + LANES + lane]
    # These are the residual g and the lower half of the Hessian h of the potential of the step.
    g0 = (y0 - workspace[At.FREE_SLIDE + lane]) / beta
    g1 = half_stiffness1 * (2 * workspace[At.PIECE_POSITION + lane] + y1)
    g2 = half_stiffness2 * (2 * workspace[At.PIECE_POSITION + LANES + lane] + y2)
    h00 = 1 / beta
    h01 = 0.0
    h02 = 0.0
    h11 = half_stiffness1
    h12 = 0.0
    h22 = half_stiffness2
    # The compiler unrolls this loop over the points and vectorises the
    # loop over the lanes around it.
    for j in range(N_POINTS):
        a = workspace[At.SHAPES + j * LANES + lane]
        b = workspace[At.SHAPES + (N_POINTS + j) * LANES + lane]
        force, slope = evaluate_point(workspace, lane, j, is_long)
        g0 += force
        g1 -= a * force
        g2 -= b * force
        h00 += slope
        h01 -= a * slope
        h02 -= b * slope
        h11 += a * a * slope
        h12 += a * b * slope
        h22 += b * b * slope
    overshoots = g0 * p0 + g1 * p1 + g2 * p2 > 0.5 * descent
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
    max_shape1 = workspace[At.MAX_SHAPES + lane]
    max_shape2 = workspace[At.MAX_SHAPES + LANES + lane]
    slopes = h00 - 1 / beta
    size = abs(n0) + max_shape1 * abs(n1) + max_shape2 * abs(n2)
    min_slide = abs(y0) - max_shape1 * abs(y1) - max_shape2 * abs(y2)
    # If no point reverses in this step, the curvature of the forces follows from their slopes,
    # which are 0 while all points slip.
    is_near = size <= NEWTON_TOL * length or (
        min_slide > size
        and slopes * size * size <= CURVATURE_TOL * workspace[At.LIMIT + lane] * length
    )
    is_active = 0.0 if is_solved > 0.0 else 1.0
    workspace[At.INCREMENTS + lane] = y0 + is_active * (-0.5 * p0 if overshoots else n0)
    workspace[At.INCREMENTS + LANES + lane] = y1 + is_active * (-0.5 * p1 if overshoots else n1)
    workspace[At.INCREMENTS + 2 * LANES + lane] = y2 + is_active * (-0.5 * p2 if overshoots else n2)
    workspace[At.NEWTON_STEP + lane] = 0.5 * p0 if overshoots else n0
    workspace[At.NEWTON_STEP + LANES + lane] = 0.5 * p1 if overshoots else n1
    workspace[At.NEWTON_STEP + 2 * LANES + lane] = 0.5 * p2 if overshoots else n2
    workspace[At.DESCENT + lane] = 0.5 * descent if overshoots else -(g0 * n0 + g1 * n1 + g2 * n2)
    workspace[At.IS_SOLVED + lane] = 1.0 if is_solved > 0.0 or (is_near and not overshoots) else 0.0


@njit(**NJIT_INLINE)
def update_point(workspace, lane, j, is_long):
    """Update the stretch and the square of a bond point after a converged step; return its energies.

    Parameters
    ----------
    workspace : array
        Workspace of all lanes, see `lane_rows`.
    lane : int
    j : int
        Number of the point.
    is_long : bool
        Whether a slide may exceed MAX_SERIES_SLIDE; a compile-time constant.

    Returns
    -------
    work : float
        Work of the mean force [J].
    square_increase : float
        Increase of the square over the step.
    """
    limit = workspace[At.POINT_LIMITS + j * LANES + lane]
    stretch = workspace[At.STRETCHES + j * LANES + lane]
    square = workspace[At.SQUARES + j * LANES + lane]
    inverse_length = 1 / workspace[At.BOND_LENGTH + lane]
    xi = find_point_slide(workspace, lane, j)
    direction = 1.0 if xi > 0.0 else -1.0
    x = abs(xi) * inverse_length
    f1, f2, e = evaluate_force_shapes(x, is_long)
    far_x = min(x, MAX_EXPONENTIAL_SLIDE)
    end_square = e * (square + 2 * direction * stretch * x + x * x) + (
        2 - e * (far_x * far_x + 2 * far_x + 2)
    )
    end_square = end_square if x < MAX_EXPONENTIAL_SLIDE else 2.0
    workspace[At.STRETCHES + j * LANES + lane] = stretch * e + direction * (1 - e)
    workspace[At.SQUARES + j * LANES + lane] = end_square
    return limit * (stretch * f1 + direction * x * f2) * xi, end_square - square


@njit(**NJIT_INLINE)
def commit_step(workspace, lane, beta, is_long):
    """Update the bond points, pieces and energies of a lane after its converged step.

    Parameters
    ----------
    workspace : array
        Workspace of all lanes, see `lane_rows`.
    lane : int
    beta : float
        Compliance of the slide in a step [m/N].
    is_long : bool
        Whether a slide may exceed MAX_SERIES_SLIDE; a compile-time constant.
    """
    y0 = workspace[At.INCREMENTS + lane]
    length = workspace[At.BOND_LENGTH + lane]
    mean_force = (workspace[At.FREE_SLIDE + lane] - y0) / beta
    b1 = workspace[At.PIECE_POSITION + lane] + workspace[At.INCREMENTS + LANES + lane]
    b2 = workspace[At.PIECE_POSITION + LANES + lane] + workspace[At.INCREMENTS + 2 * LANES + lane]
    point_work = 0.0
    square_increase = 0.0
    force = 0.0
    square_sum = 0.0
    for j in range(N_POINTS):
        limit = workspace[At.POINT_LIMITS + j * LANES + lane]
        work, increase = update_point(workspace, lane, j, is_long)
        point_work += work
        square_increase += limit * increase
        force += limit * workspace[At.STRETCHES + j * LANES + lane]
        square_sum += limit * workspace[At.SQUARES + j * LANES + lane]
    energy = 0.5 * (
        length * square_sum
        + workspace[At.STIFFNESSES + lane] * b1 * b1
        + workspace[At.STIFFNESSES + LANES + lane] * b2 * b2
    )
    work = mean_force * y0
    dissipated = work - (energy - workspace[At.INTERFACE_ENERGY + lane])
    noise = workspace[At.LIMIT + lane] * (
        1e-12 * abs(y0) + 1e-15 * abs(workspace[At.RIG_SLIDE + lane])
    )
    workspace[At.PIECE_POSITION + lane] = b1
    workspace[At.PIECE_POSITION + LANES + lane] = b2
    workspace[At.MEAN_FORCE + lane] = mean_force
    workspace[At.FRICTION_LOSS + lane] += point_work - 0.5 * length * square_increase
    workspace[At.FRICTION_WORK + lane] += work
    workspace[At.FRICTION_WORK_SIZE + lane] += abs(work)
    workspace[At.SAMPLED_WORK + lane] += 0.5 * (workspace[At.FRICTION + lane] + force) * y0
    workspace[At.INTERFACE_LOSS + lane] += dissipated if dissipated > -noise else 0.0
    workspace[At.INTERFACE_GAIN + lane] -= dissipated if dissipated < -noise else 0.0
    workspace[At.FRICTION + lane] = force
    workspace[At.INTERFACE_ENERGY + lane] = energy
    # The initial guess of the next step is a quadratic extrapolation of the last three steps.
    for k in range(3):
        here = workspace[At.INCREMENTS + k * LANES + lane]
        last = workspace[At.LAST_INCREMENTS + k * LANES + lane]
        workspace[At.INCREMENTS + k * LANES + lane] = (
            3 * (here - last) + workspace[At.INCREMENTS_BEFORE + k * LANES + lane]
        )
        workspace[At.INCREMENTS_BEFORE + k * LANES + lane] = last
        workspace[At.LAST_INCREMENTS + k * LANES + lane] = here


@njit(**NJIT_INLINE)
def move_mode(workspace, lane, k, mode, push):
    """Advance a rig mode of a lane by a step, and add its slide, output and energies.

    Parameters
    ----------
    workspace : array
        Workspace of all lanes, see `lane_rows`.
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
    z = workspace[At.RIG_POSITION + k * LANES + lane]
    v = workspace[At.RIG_RATE + k * LANES + lane]
    f = slide * workspace[At.MEAN_FORCE + lane]
    drive = workspace[At.DRIVE + lane]
    z1 = zz * z + zv * v - by_z * f + drive * more_z
    v1 = vz * z + vv * v - by_v * f + drive * more_v
    workspace[At.DRIVE_WORK + lane] += drive * (work_z * z + work_v * v - work_f * f)
    workspace[At.VISCOUS_LOSS + lane] += (
        drive * (lost_z * z + lost_v * v - lost_f * f)
        + (loss_zz * z + loss_zv * v - loss_zf * f) * z
        + (loss_vv * v - loss_vf * f) * v
        + loss_ff * f * f
    )
    workspace[At.RIG_POSITION + k * LANES + lane] = z1
    workspace[At.RIG_RATE + k * LANES + lane] = v1
    workspace[At.RIG_SLIDE + lane] += slide * z1
    workspace[At.OUTPUT + lane] += output * z1
    workspace[At.OUTPUT_RATE + lane] += output * v1
    workspace[At.RATE_SQUARES + lane] += v1 * v1 + rate * z1 * z1


@njit(**NJIT_INLINE)
def initialise_sums(workspace, lane, work, viscous_loss, cosine, sine):
    """Initialise the sums over the rig modes in a step with the terms of the drive alone.

    Parameters
    ----------
    workspace : array
        Workspace of all lanes, see `lane_rows`.
    lane : int
    work : float
        Constant part of the work of the drive [J].
    viscous_loss : float
        Constant part of the viscous loss [J].
    cosine : float
        Cosine of the drive at the start of the step.
    sine : float
    """
    out = workspace[At.OUTPUT + lane]
    square = workspace[At.DRIVE + lane] * workspace[At.DRIVE + lane]
    workspace[At.COS_SUM + lane] += out * cosine
    workspace[At.SIN_SUM + lane] += out * sine
    workspace[At.LAST_OUTPUT + lane] = out
    workspace[At.LAST_OUTPUT_RATE + lane] = workspace[At.OUTPUT_RATE + lane]
    workspace[At.DRIVE_WORK + lane] = square * work
    workspace[At.VISCOUS_LOSS + lane] = square * viscous_loss
    workspace[At.RIG_SLIDE + lane] = workspace[At.OUTPUT + lane] = workspace[
        At.OUTPUT_RATE + lane
    ] = workspace[At.RATE_SQUARES + lane] = 0.0


@njit(**NJIT_INLINE)
def add_step_sums(workspace, lane, half_mass):
    """Add the energies and output of a step to the run and cycle sums of a lane.

    Parameters
    ----------
    workspace : array
        Workspace of all lanes, see `lane_rows`.
    lane : int
    half_mass : float
        Half of the modal mass [kg].
    """
    slide = workspace[At.RIG_SLIDE + lane]
    output = workspace[At.OUTPUT + lane]
    work = workspace[At.DRIVE_WORK + lane]
    workspace[At.WORK_IN + lane] += work
    workspace[At.DRIVE_WORK_SIZE + lane] += abs(work)
    workspace[At.VISCOUS_SUM + lane] += workspace[At.VISCOUS_LOSS + lane]
    stored_energy = (
        workspace[At.INTERFACE_ENERGY + lane] + half_mass * workspace[At.RATE_SQUARES + lane]
    )
    workspace[At.MAX_STORED + lane] = max(workspace[At.MAX_STORED + lane], stored_energy)
    workspace[At.MAX_SLIDE + lane] = max(workspace[At.MAX_SLIDE + lane], abs(slide))
    workspace[At.MIN_OUTPUT + lane] = min(workspace[At.MIN_OUTPUT + lane], output)
    workspace[At.MAX_OUTPUT + lane] = max(workspace[At.MAX_OUTPUT + lane], output)
    workspace[At.SLIP + lane] = (
        slide
        - workspace[At.MEAN_SHAPES + lane] * workspace[At.PIECE_POSITION + lane]
        - workspace[At.MEAN_SHAPES + LANES + lane] * workspace[At.PIECE_POSITION + LANES + lane]
        - workspace[At.BOND_LENGTH + lane]
        * workspace[At.FRICTION + lane]
        / workspace[At.LIMIT + lane]
    )


@njit(**NJIT_INLINE)
def set_free_slide(workspace, lane, rig, row):
    """Compute the friction-free slide increment of a step from the motion at its start.

    Parameters
    ----------
    workspace : array
        Workspace of all lanes, see `lane_rows`.
    lane : int
    rig : (N_RIG_ROWS + 1, 3) array
        Rows of the modes of the rig.
    row : (N_COLUMNS,) array
        Row of the table of the step.
    """
    free = workspace[At.DRIVE + lane] * row[StepColumn.PORT_SLIDE]
    for k in range(N_RIG_MODES):
        free += (
            rig[RigRow.REACH_Z, k] * workspace[At.RIG_POSITION + k * LANES + lane]
            + rig[RigRow.REACH_V, k] * workspace[At.RIG_RATE + k * LANES + lane]
        )
    workspace[At.FREE_SLIDE + lane] = free
    workspace[At.IS_SOLVED + lane] = workspace[At.DESCENT + lane] = 0.0
    workspace[At.NEWTON_STEP + lane] = workspace[At.NEWTON_STEP + LANES + lane] = workspace[
        At.NEWTON_STEP + 2 * LANES + lane
    ] = 0.0


@njit(**NJIT_INLINE)
def count_long_slides(workspace, lengths):
    """Return the number of lanes in which a point may slide a number of bond lengths or more."""
    near = 0.0
    for lane in range(LANES):
        far = (
            abs(workspace[At.INCREMENTS + lane])
            + workspace[At.MAX_SHAPES + lane] * abs(workspace[At.INCREMENTS + LANES + lane])
            + workspace[At.MAX_SHAPES + LANES + lane]
            * abs(workspace[At.INCREMENTS + 2 * LANES + lane])
        )
        near += 1.0 if far <= lengths * workspace[At.BOND_LENGTH + lane] else 0.0
    return LANES - near


@njit(**NJIT_INLINE)
def count_unsolved(workspace):
    """Return the number of lanes whose step has not converged."""
    done = 0.0
    for lane in range(LANES):
        done += workspace[At.IS_SOLVED + lane]
    return LANES - done


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def update_extremes(workspace, dt):
    """Update the output extremes of the cycle with those inside a step.

    They are those of cubics as in `passing_kernels.find_cycle_output`.

    """
    n_reversals = 0.0
    for lane in range(LANES):
        n_reversals += (
            1.0
            if workspace[At.LAST_OUTPUT_RATE + lane] * workspace[At.OUTPUT_RATE + lane] < 0.0
            else 0.0
        )
    for lane in range(LANES if n_reversals > 0.0 else 0):
        if workspace[At.LAST_OUTPUT_RATE + lane] * workspace[At.OUTPUT_RATE + lane] < 0.0:
            a = workspace[At.LAST_OUTPUT + lane]
            b = workspace[At.OUTPUT + lane]
            p = workspace[At.LAST_OUTPUT_RATE + lane] * dt
            r = workspace[At.OUTPUT_RATE + lane] * dt
            big = 2 * (a - b) + p + r
            mid = 3 * (b - a) - 2 * p - r
            root = sqrt(max(mid * mid - 3 * big * p, 0.0))
            for sign in (1.0, -1.0):
                s = -p / (mid + sign * root)
                if 0.0 <= s <= 1.0:
                    value = a + p * s + mid * s * s + big * s * s * s
                    workspace[At.MIN_OUTPUT + lane] = min(workspace[At.MIN_OUTPUT + lane], value)
                    workspace[At.MAX_OUTPUT + lane] = max(workspace[At.MAX_OUTPUT + lane], value)


@njit(**NJIT_INLINE)
def march_step(workspace, rig, row):
    """Advance all lanes by one time step.

    Parameters
    ----------
    workspace : array
        Workspace of all lanes, see `lane_rows`.
    rig : (N_RIG_ROWS + 1, 3) array
        Rows of the modes of the rig.
    row : (N_COLUMNS,) array
        Row of the table of the step.
    """
    beta = rig[RigRow.STEP, 0]
    for lane in range(LANES):
        set_free_slide(workspace, lane, rig, row)
    for _ in range(MAX_SWEEPS):
        if count_long_slides(workspace, MAX_SERIES_SLIDE) == 0.0:
            for lane in range(LANES):
                take_newton_step(workspace, lane, beta, False)
        else:
            for lane in range(LANES):
                take_newton_step(workspace, lane, beta, True)
        if count_unsolved(workspace) == 0.0:
            break
    if count_unsolved(workspace) > 0.0:
        for lane in range(LANES):
            workspace[At.N_UNSOLVED + lane] += 1.0 - workspace[At.IS_SOLVED + lane]
    if count_long_slides(workspace, MAX_SERIES_SLIDE) == 0.0:
        for lane in range(LANES):
            commit_step(workspace, lane, beta, False)
    else:
        for lane in range(LANES):
            commit_step(workspace, lane, beta, True)
    work = row[StepColumn.REMAINDERS]
    viscous_loss = row[StepColumn.REMAINDERS + 1]
    cosine = row[StepColumn.WAVES]
    sine = row[StepColumn.WAVES + 1]
    half_mass = 0.5 * rig[RigRow.STEP, 1]
    for lane in range(LANES):
        initialise_sums(workspace, lane, work, viscous_loss, cosine, sine)
    for k in range(N_RIG_MODES):
        mode = (
            rig[RigRow.ZZ, k],
            rig[RigRow.ZV, k],
            rig[RigRow.VZ, k],
            rig[RigRow.VV, k],
            rig[RigRow.BY_Z, k],
            rig[RigRow.BY_V, k],
            rig[RigRow.LOSS, k],
            rig[RigRow.LOSS + 1, k],
            rig[RigRow.LOSS + 2, k],
            rig[RigRow.LOSS + 3, k],
            rig[RigRow.LOSS + 4, k],
            rig[RigRow.LOSS + 5, k],
            rig[RigRow.SLIDE_SHAPE, k],
            rig[RigRow.OUTPUT_SHAPE, k],
            rig[RigRow.OMEGA_SQUARE, k],
        )
        push = (
            row[StepColumn.BY_DRIVE + k],
            row[StepColumn.BY_DRIVE + N_RIG_MODES + k],
            row[StepColumn.WORK_FORMS + k],
            row[StepColumn.WORK_FORMS + N_RIG_MODES + k],
            row[StepColumn.WORK_FORMS + 2 * N_RIG_MODES + k],
            row[StepColumn.LOSS_FORMS + k],
            row[StepColumn.LOSS_FORMS + N_RIG_MODES + k],
            row[StepColumn.LOSS_FORMS + 2 * N_RIG_MODES + k],
        )
        for lane in range(LANES):
            move_mode(workspace, lane, k, mode, push)
    for lane in range(LANES):
        add_step_sums(workspace, lane, half_mass)
    update_extremes(workspace, rig[RigRow.STEP, 2])


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def store_samples(workspace, sample):
    """Write the present sample of all lanes into an array (N_SAMPLE, LANES)."""
    for lane in range(LANES):
        for k in range(2 * N_RIG_MODES):
            sample[k, lane] = workspace[k * LANES + lane]
        sample[2 * N_RIG_MODES, lane] = workspace[At.FRICTION + lane]
        sample[2 * N_RIG_MODES + 1, lane] = workspace[At.SLIP + lane]


@njit(error_model="numpy", cache=True, nogil=True, **NJIT_NO_REFCOUNT)
def march(workspace, rig, table, history, samples, work):
    """March all lanes over cycles, and store the samples of the last ones.

    Parameters
    ----------
    workspace : array
        Workspace of all lanes, see `lane_rows`.
    rig : (N_RIG_ROWS + 1, 3) array
        Rows of the modes of the rig.
    table : (s, N_COLUMNS) array
        Rows of the steps of a cycle.
    history : (c, 4, LANES) array
        Smallest and largest output of each cycle, and phasor of the output [m]; output array.
    samples : (w s + 1, N_SAMPLE, LANES) array
        Samples of the last w cycles; output array.
    work : (LANES,) array
        Friction work before these cycles [J]; output array.
    """
    steps = table.shape[0]
    cycles = history.shape[0]
    first = cycles - (samples.shape[0] - 1) // steps
    for c in range(cycles):
        for lane in range(LANES):
            workspace[At.MIN_OUTPUT + lane] = workspace[At.MAX_OUTPUT + lane] = workspace[
                At.OUTPUT + lane
            ]
            workspace[At.COS_SUM + lane] = workspace[At.SIN_SUM + lane] = 0.0
            if c == first:
                work[lane] = workspace[At.FRICTION_WORK + lane]
        for s in range(steps):
            if c >= first:
                store_samples(workspace, samples[(c - first) * steps + s])
            march_step(workspace, rig, table[s])
        for lane in range(LANES):
            history[c, 0, lane] = workspace[At.MIN_OUTPUT + lane]
            history[c, 1, lane] = workspace[At.MAX_OUTPUT + lane]
            history[c, 2, lane] = 2 * workspace[At.COS_SUM + lane] / steps
            history[c, 3, lane] = -2 * workspace[At.SIN_SUM + lane] / steps
    store_samples(workspace, samples[samples.shape[0] - 1])
