"""Patches with bonds behind shear modes marched side by side, one case in a lane: the steps of `passing_kernels`.

The cases share the modes of their rig and the frequency of their drive, and have POINTS points behind MODES modes of
the pieces each. In every step all lanes take the turns of Newton's method that the slowest of them asks for. A workspace is
a flat array as in `lanes.names_kernels`: number n of lane i stands at n * LANES + i. Stretches are over the bond length
and squares over its square, for bonds whose density stays. Twin: `march.Run`, case by case. Cost: 20 ns a step of a
case on a core with vectors of eight numbers.
"""

from math import sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT

LANES, POINTS, MODES, RIG = 32, 6, 2, 2  # MODES of the pieces, RIG of the rig
# what moves: coordinates and rates of the rig, coordinates of the pieces, stretch and square of the points
Z, V, B, STRETCH, SQUARE = 0, RIG, 2 * RIG, 2 * RIG + MODES, 2 * RIG + MODES + POINTS
# the step: slide and coordinates; those of the two before, Newton's step and by how much it falls
Y = SQUARE + POINTS
LAST, BEFORE, P, FALL, DONE = Y + 3, Y + 6, Y + 9, Y + 12, Y + 13
(FREE, FORCE, ENERGY, SLIP, OUT, RATE, OUT0, RATE0, PLACE, USED, WORK, LOSS_NOW, MOVING) = range(
    DONE + 1, DONE + 14
)
# of a case: drive over that of the table, bond length, limit, limits of the points, slides per coordinate, stiffness
# of the coordinates, largest and mean slide per coordinate
PUSH, LENGTH, LIMIT, OF_POINT = range(MOVING + 1, MOVING + 5)
SHAPE = OF_POINT + POINTS
KAPPA, REACH, MEAN = (SHAPE + (POINTS + k) * MODES for k in range(3))
# sums of the run; extremes and phasor of the output in a cycle; steps without a solution, largest slide
(
    WORK_IN,
    VISCOUS,
    POWER,
    LOST,
    PEAK,
    BOOKED,
    SAMPLED,
    PASSED,
    GONE,
    CREATED,
    LOW,
    HIGH,
    COS,
    SIN,
    BAD,
    FAR,
) = range(MEAN + MODES, MEAN + MODES + 16)
NUMBERS = FAR + 1
# rows of a mode of the rig: its step as `propagator.Propagator` has it, of forces in place of accelerations, then
# slide, output, square of its rate; RIGS: how many, behind them give of the slide [m/N], mass [kg], step [s]
ZZ, ZV, VZ, VV, BY_Z, BY_V, REACH_Z, REACH_V, LOSS, SLIDE, OUTPUT, RATES = (*range(9), 14, 15, 16)
RIGS = 17
# columns of the table, of a drive of 1 m s-2: what it adds to coordinates and rates, linear forms of its work and of
# the viscous loss, the rest of both, what it moves the slide, its cosine and sine at the start of the step
BY_DRIVE, WORKS, LOSSES, REST, PORT, WAVE = 0, 2 * RIG, 5 * RIG, 8 * RIG, 8 * RIG + 2, 8 * RIG + 3
COLUMNS = WAVE + 2
KEPT = 2 * RIG + 2  # of a sample: coordinates, rates, force, slip
# bond lengths of Newton's last step, as in `shear_solve_kernels`; turns of a step
NEAR, MOST = (
    4e-6,
    60,
)
CURVED = 1e-9  # of the friction limit, which the forces may bend in it
# bond lengths of a slide that the series takes; from which on nothing is left of a bond
SHORT, LONG = (
    0.5,
    40.0,
)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def shape(x, far):
    """(f1, f2, exp(-x)) of `point_kernels.shape`, by the series of half of x <= SHORT: f2(2 y) = f2(y)/2 + f1(y)^2/4;
    far: whether x may be larger, exp(-x) then comes from a 256th of it."""
    y = 0.5 * (min(x, SHORT) if far else x)
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
        y = min(x, LONG) / 256
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
        over = 1 / max(x, SHORT)
        one = (1 - d) * over
        f1 = one if x > SHORT else f1
        f2 = (1 - one) * over if x > SHORT else f2
        e = d if x > SHORT else e
    return f1, f2, e


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def add_point(s, workspace, i, j, y, over, far):
    """Residual and lower half of the Hessian `s` (9) at the step y (3) with what the point j adds."""
    g0, g1, g2, h00, h01, h02, h11, h12, h22 = s
    a = workspace[(SHAPE + j) * LANES + i]
    b = workspace[(SHAPE + POINTS + j) * LANES + i]
    limit = workspace[(OF_POINT + j) * LANES + i]
    stretch = workspace[(STRETCH + j) * LANES + i]
    xi = y[0] - a * y[1] - b * y[2]
    way = 1.0 if xi > 0.0 else -1.0
    x = abs(xi) * over
    f1, f2, _ = shape(x, far)
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


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def turn(workspace, i, beta, far):
    """A turn of Newton's method in a lane; where the last step went too far, half of it is taken back."""
    y0 = workspace[Y * LANES + i]
    y1 = workspace[(Y + 1) * LANES + i]
    y2 = workspace[(Y + 2) * LANES + i]
    p0 = workspace[P * LANES + i]
    p1 = workspace[(P + 1) * LANES + i]
    p2 = workspace[(P + 2) * LANES + i]
    length = workspace[LENGTH * LANES + i]
    fall = workspace[FALL * LANES + i]
    done = workspace[DONE * LANES + i]
    over = 1 / length
    one = 0.5 * workspace[KAPPA * LANES + i]
    two = 0.5 * workspace[(KAPPA + 1) * LANES + i]
    y = (y0, y1, y2)
    s = (
        (y0 - workspace[FREE * LANES + i]) / beta,
        one * (2 * workspace[B * LANES + i] + y1),
        two * (2 * workspace[(B + 1) * LANES + i] + y2),
        1 / beta,
        0.0,
        0.0,
        one,
        0.0,
        two,
    )
    # one after the other: a loop over them is not taken in several lanes at once
    s = add_point(s, workspace, i, 0, y, over, far)
    s = add_point(s, workspace, i, 1, y, over, far)
    s = add_point(s, workspace, i, 2, y, over, far)
    s = add_point(s, workspace, i, 3, y, over, far)
    s = add_point(s, workspace, i, 4, y, over, far)
    g0, g1, g2, h00, h01, h02, h11, h12, h22 = add_point(s, workspace, i, 5, y, over, far)
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
    one = workspace[REACH * LANES + i]
    two = workspace[(REACH + 1) * LANES + i]
    slopes = h00 - 1 / beta
    size = abs(n0) + one * abs(n1) + two * abs(n2)
    least = abs(y0) - one * abs(y1) - two * abs(y2)
    # where no point turns over in this step, what the forces bend in it is told by their slopes, which a drag has not
    near = size <= NEAR * length or (
        least > size and slopes * size * size <= CURVED * workspace[LIMIT * LANES + i] * length
    )
    on = 0.0 if done > 0.0 else 1.0
    workspace[Y * LANES + i] = y0 + on * (-0.5 * p0 if back else n0)
    workspace[(Y + 1) * LANES + i] = y1 + on * (-0.5 * p1 if back else n1)
    workspace[(Y + 2) * LANES + i] = y2 + on * (-0.5 * p2 if back else n2)
    workspace[P * LANES + i] = 0.5 * p0 if back else n0
    workspace[(P + 1) * LANES + i] = 0.5 * p1 if back else n1
    workspace[(P + 2) * LANES + i] = 0.5 * p2 if back else n2
    workspace[FALL * LANES + i] = 0.5 * fall if back else -(g0 * n0 + g1 * n1 + g2 * n2)
    workspace[DONE * LANES + i] = 1.0 if done > 0.0 or (near and not back) else 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def moved(s, workspace, i, j, y, over, far):
    """Move the point j by the step y (3); `s`: its work over the limit, the rise of its square, force and square with
    what it adds."""
    worked, rise, force, square = s
    a = workspace[(SHAPE + j) * LANES + i]
    b = workspace[(SHAPE + POINTS + j) * LANES + i]
    limit = workspace[(OF_POINT + j) * LANES + i]
    stretch = workspace[(STRETCH + j) * LANES + i]
    old = workspace[(SQUARE + j) * LANES + i]
    xi = y[0] - a * y[1] - b * y[2]
    way = 1.0 if xi > 0.0 else -1.0
    x = abs(xi) * over
    f1, f2, e = shape(x, far)
    far_x = min(x, LONG)
    new = e * (old + 2 * way * stretch * x + x * x) + (2 - e * (far_x * far_x + 2 * far_x + 2))
    new = new if x < LONG else 2.0
    one = stretch * e + way * (1 - e)
    workspace[(STRETCH + j) * LANES + i] = one
    workspace[(SQUARE + j) * LANES + i] = new
    return (
        worked + limit * (stretch * f1 + way * x * f2) * xi,
        rise + limit * (new - old),
        force + limit * one,
        square + limit * new,
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def commit(workspace, i, beta, far):
    """Move the points and the pieces of a lane by its solved step and add to their sums."""
    y0 = workspace[Y * LANES + i]
    y1 = workspace[(Y + 1) * LANES + i]
    y2 = workspace[(Y + 2) * LANES + i]
    length = workspace[LENGTH * LANES + i]
    used = (workspace[FREE * LANES + i] - y0) / beta
    over = 1 / length
    y = (y0, y1, y2)
    b1 = workspace[B * LANES + i] + y1
    b2 = workspace[(B + 1) * LANES + i] + y2
    s = moved((0.0, 0.0, 0.0, 0.0), workspace, i, 0, y, over, far)
    s = moved(s, workspace, i, 1, y, over, far)
    s = moved(s, workspace, i, 2, y, over, far)
    s = moved(s, workspace, i, 3, y, over, far)
    s = moved(s, workspace, i, 4, y, over, far)
    worked, rise, force, square = moved(s, workspace, i, 5, y, over, far)
    energy = 0.5 * (
        length * square
        + workspace[KAPPA * LANES + i] * b1 * b1
        + workspace[(KAPPA + 1) * LANES + i] * b2 * b2
    )
    work = used * y0
    q = workspace[PLACE * LANES + i]
    gone = work - (energy - workspace[ENERGY * LANES + i])
    noise = workspace[LIMIT * LANES + i] * (1e-12 * abs(y0) + 1e-15 * abs(q))
    workspace[B * LANES + i] = b1
    workspace[(B + 1) * LANES + i] = b2
    workspace[USED * LANES + i] = used
    workspace[LOST * LANES + i] += worked - 0.5 * length * rise
    workspace[BOOKED * LANES + i] += work
    workspace[PASSED * LANES + i] += abs(work)
    workspace[SAMPLED * LANES + i] += 0.5 * (workspace[FORCE * LANES + i] + force) * y0
    workspace[GONE * LANES + i] += gone if gone > -noise else 0.0
    workspace[CREATED * LANES + i] -= gone if gone < -noise else 0.0
    workspace[FORCE * LANES + i] = force
    workspace[ENERGY * LANES + i] = energy
    # the next guess, as the last three steps went on
    for k in range(3):
        here = workspace[(Y + k) * LANES + i]
        last = workspace[(LAST + k) * LANES + i]
        workspace[(Y + k) * LANES + i] = 3 * (here - last) + workspace[(BEFORE + k) * LANES + i]
        workspace[(BEFORE + k) * LANES + i] = last
        workspace[(LAST + k) * LANES + i] = here


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def flow(workspace, i, k, mode, push):
    """Move a mode of the rig of a lane by a step, and add what it shows and takes."""
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
    z = workspace[(Z + k) * LANES + i]
    v = workspace[(V + k) * LANES + i]
    f = slide * workspace[USED * LANES + i]
    drive = workspace[PUSH * LANES + i]
    z1 = zz * z + zv * v - by_z * f + drive * more_z
    v1 = vz * z + vv * v - by_v * f + drive * more_v
    workspace[WORK * LANES + i] += drive * (work_z * z + work_v * v - work_f * f)
    workspace[LOSS_NOW * LANES + i] += (
        drive * (lost_z * z + lost_v * v - lost_f * f)
        + (loss_zz * z + loss_zv * v - loss_zf * f) * z
        + (loss_vv * v - loss_vf * f) * v
        + loss_ff * f * f
    )
    workspace[(Z + k) * LANES + i] = z1
    workspace[(V + k) * LANES + i] = v1
    workspace[PLACE * LANES + i] += slide * z1
    workspace[OUT * LANES + i] += output * z1
    workspace[RATE * LANES + i] += output * v1
    workspace[MOVING * LANES + i] += v1 * v1 + rate * z1 * z1


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def opened(workspace, i, work, lost, cosine, sine):
    """Begin the sums of a step of a lane over the modes, with what the drive alone gives and takes of 1 m s-2."""
    out = workspace[OUT * LANES + i]
    square = workspace[PUSH * LANES + i] * workspace[PUSH * LANES + i]
    workspace[COS * LANES + i] += out * cosine
    workspace[SIN * LANES + i] += out * sine
    workspace[OUT0 * LANES + i] = out
    workspace[RATE0 * LANES + i] = workspace[RATE * LANES + i]
    workspace[WORK * LANES + i] = square * work
    workspace[LOSS_NOW * LANES + i] = square * lost
    workspace[PLACE * LANES + i] = workspace[OUT * LANES + i] = workspace[
        RATE * LANES + i
    ] = workspace[MOVING * LANES + i] = 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def closed(workspace, i, half_mass):
    """Add a step of a lane to the sums of its run and cycle."""
    place = workspace[PLACE * LANES + i]
    out = workspace[OUT * LANES + i]
    work = workspace[WORK * LANES + i]
    workspace[WORK_IN * LANES + i] += work
    workspace[POWER * LANES + i] += abs(work)
    workspace[VISCOUS * LANES + i] += workspace[LOSS_NOW * LANES + i]
    held = workspace[ENERGY * LANES + i] + half_mass * workspace[MOVING * LANES + i]
    workspace[PEAK * LANES + i] = max(workspace[PEAK * LANES + i], held)
    workspace[FAR * LANES + i] = max(workspace[FAR * LANES + i], abs(place))
    workspace[LOW * LANES + i] = min(workspace[LOW * LANES + i], out)
    workspace[HIGH * LANES + i] = max(workspace[HIGH * LANES + i], out)
    workspace[SLIP * LANES + i] = (
        place
        - workspace[MEAN * LANES + i] * workspace[B * LANES + i]
        - workspace[(MEAN + 1) * LANES + i] * workspace[(B + 1) * LANES + i]
        - workspace[LENGTH * LANES + i]
        * workspace[FORCE * LANES + i]
        / workspace[LIMIT * LANES + i]
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def begun(workspace, i, rig, row):
    """Set the free slide of a step, from the motion at its start."""
    free = workspace[PUSH * LANES + i] * row[PORT]
    for k in range(RIG):
        free += (
            rig[REACH_Z, k] * workspace[(Z + k) * LANES + i]
            + rig[REACH_V, k] * workspace[(V + k) * LANES + i]
        )
    workspace[FREE * LANES + i] = free
    workspace[DONE * LANES + i] = workspace[FALL * LANES + i] = 0.0
    workspace[P * LANES + i] = workspace[(P + 1) * LANES + i] = workspace[(P + 2) * LANES + i] = 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def beyond(workspace, lengths):
    """Number of lanes in which a point may slide farther than so many bond lengths in the step, or as far as nan."""
    near = 0.0
    for i in range(LANES):
        far = (
            abs(workspace[Y * LANES + i])
            + workspace[REACH * LANES + i] * abs(workspace[(Y + 1) * LANES + i])
            + workspace[(REACH + 1) * LANES + i] * abs(workspace[(Y + 2) * LANES + i])
        )
        near += 1.0 if far <= lengths * workspace[LENGTH * LANES + i] else 0.0
    return LANES - near


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def left(workspace):
    """Number of lanes whose step is not solved."""
    done = 0.0
    for i in range(LANES):
        done += workspace[DONE * LANES + i]
    return LANES - done


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def turned(workspace, dt):
    """Take the extremes of the output inside a step into those of the cycle, by the cubic through values and rates as
    `passing_kernels.shown` has it."""
    turns = 0.0
    for i in range(LANES):
        turns += 1.0 if workspace[RATE0 * LANES + i] * workspace[RATE * LANES + i] < 0.0 else 0.0
    for i in range(LANES if turns > 0.0 else 0):
        if workspace[RATE0 * LANES + i] * workspace[RATE * LANES + i] < 0.0:
            a = workspace[OUT0 * LANES + i]
            b = workspace[OUT * LANES + i]
            p = workspace[RATE0 * LANES + i] * dt
            r = workspace[RATE * LANES + i] * dt
            big = 2 * (a - b) + p + r
            mid = 3 * (b - a) - 2 * p - r
            root = sqrt(max(mid * mid - 3 * big * p, 0.0))
            for sign in (1.0, -1.0):
                s = -p / (mid + sign * root)
                if 0.0 <= s <= 1.0:
                    value = a + p * s + mid * s * s + big * s * s * s
                    workspace[LOW * LANES + i] = min(workspace[LOW * LANES + i], value)
                    workspace[HIGH * LANES + i] = max(workspace[HIGH * LANES + i], value)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def step(workspace, rig, row):
    """Move all lanes by a step."""
    beta = rig[RIGS, 0]
    for i in range(LANES):
        begun(workspace, i, rig, row)
    for _ in range(MOST):
        if beyond(workspace, SHORT) == 0.0:
            for i in range(LANES):
                turn(workspace, i, beta, False)
        else:
            for i in range(LANES):
                turn(workspace, i, beta, True)
        if left(workspace) == 0.0:
            break
    if left(workspace) > 0.0:
        for i in range(LANES):
            workspace[BAD * LANES + i] += 1.0 - workspace[DONE * LANES + i]
    if beyond(workspace, SHORT) == 0.0:
        for i in range(LANES):
            commit(workspace, i, beta, False)
    else:
        for i in range(LANES):
            commit(workspace, i, beta, True)
    work = row[REST]
    lost = row[REST + 1]
    cosine = row[WAVE]
    sine = row[WAVE + 1]
    half_mass = 0.5 * rig[RIGS, 1]
    for i in range(LANES):
        opened(workspace, i, work, lost, cosine, sine)
    for k in range(RIG):
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
            rig[SLIDE, k],
            rig[OUTPUT, k],
            rig[RATES, k],
        )
        push = (
            row[BY_DRIVE + k],
            row[BY_DRIVE + RIG + k],
            row[WORKS + k],
            row[WORKS + RIG + k],
            row[WORKS + 2 * RIG + k],
            row[LOSSES + k],
            row[LOSSES + RIG + k],
            row[LOSSES + 2 * RIG + k],
        )
        for i in range(LANES):
            flow(workspace, i, k, mode, push)
    for i in range(LANES):
        closed(workspace, i, half_mass)
    turned(workspace, rig[RIGS, 2])


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def keep(workspace, sample):
    """Write the sample (KEPT, LANES) of all lanes."""
    for i in range(LANES):
        for k in range(2 * RIG):
            sample[k, i] = workspace[k * LANES + i]
        sample[2 * RIG, i] = workspace[FORCE * LANES + i]
        sample[2 * RIG + 1, i] = workspace[SLIP * LANES + i]


@njit(error_model="numpy", cache=True, nogil=True, **NJIT_NO_REFCOUNT)
def march(workspace, rig, table, history, samples, work):
    """March all lanes over cycles, the last of which are kept.

    workspace (NUMBERS * LANES,): of the lanes; rig (RIGS + 1, 3): of the rig that they share; table (s, COLUMNS): of the
    steps of a cycle; history (c, 4, LANES) [m]: least and largest output of a cycle, real and imaginary part of its
    phasor; samples (w s + 1, KEPT, LANES): of the last w cycles; work (LANES,) [J]: friction work before these.
    """
    steps = table.shape[0]
    cycles = history.shape[0]
    first = cycles - (samples.shape[0] - 1) // steps
    for c in range(cycles):
        for i in range(LANES):
            workspace[LOW * LANES + i] = workspace[HIGH * LANES + i] = workspace[OUT * LANES + i]
            workspace[COS * LANES + i] = workspace[SIN * LANES + i] = 0.0
            if c == first:
                work[i] = workspace[BOOKED * LANES + i]
        for s in range(steps):
            if c >= first:
                keep(workspace, samples[(c - first) * steps + s])
            step(workspace, rig, table[s])
        for i in range(LANES):
            history[c, 0, i] = workspace[LOW * LANES + i]
            history[c, 1, i] = workspace[HIGH * LANES + i]
            history[c, 2, i] = 2 * workspace[COS * LANES + i] / steps
            history[c, 3, i] = -2 * workspace[SIN * LANES + i] / steps
    keep(workspace, samples[samples.shape[0] - 1])
