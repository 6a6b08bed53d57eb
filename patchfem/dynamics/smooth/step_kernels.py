"""One Runge-Kutta step of order 8 with its error estimate and dense output (compiled).

The state (2 n + l + 3,) has coordinates and rates of the modes, the states of the law, and work of
the drive, viscous loss and friction work [J]. The energies feed nothing and do not take part in
the choice of the step. The text is compiled for every law that offers its rates
(`friction.protocol`).
"""

from math import sqrt

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_INTERNAL
from ...friction.laws import stretch_kernels as law
from ..events.drive_kernels import Instant, drive_value
from ..tableau_kernels import (
    DENSE_OUTPUT_WEIGHTS,
    FIRST_COLUMNS,
    N_STAGES,
    ORDER_3_WEIGHTS,
    ORDER_5_WEIGHTS,
    RUNGE_KUTTA_MATRIX,
    STAGE_NODES,
)
from .arrays import Mode, Scalar, Turn, Work

# Smallest size of a quantity to which the error of a state is relative; it is needed at rest.
MIN_SIZE = 1e-30
# Round-off error of an acceleration, relative to the forces per mass of the mode
# and the law that balance in it.
ROUND_OFF_RATIO = 2e-15


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def evaluate_drive(motion, t):
    """Return the drive acceleration [m s-2] at a time [s] from the present segment.

    The segment is continued beyond its ends.
    """
    segment = motion.segments[int(motion.scalars[Scalar.SEGMENT])]
    return drive_value(segment, Instant(0.0, t, motion.scalars[Scalar.PERIOD]))


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def find_slide(motion, y):
    """Return relative displacement [m] and relative velocity [m/s] of a state."""
    n = motion.modes.shape[1]
    q = motion.modes[Mode.SLIDE, 0] * y[0]
    v = motion.modes[Mode.SLIDE, 0] * y[n]
    for i in range(1, n):
        q += motion.modes[Mode.SLIDE, i] * y[i]
        v += motion.modes[Mode.SLIDE, i] * y[n + i]
    return q, v


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def write_mode_slopes(motion, i, y, out, drive, friction_accel):
    """Write the time derivatives of the coordinate and rate of one mode.

    Parameters
    ----------
    motion : MotionArrays
    i : int
        Number of the mode.
    y : ndarray
        (N,) state.
    out : ndarray
        (N,) slopes, which are written.
    drive : float
        Drive [m s-2].
    friction_accel : float
        Friction force divided by the modal mass [m s-2].

    Returns
    -------
    drive_power, viscous_power : float
        Over the modal mass [m2 s-3].
    """
    n = motion.modes.shape[1]
    rate = y[motion.modes.shape[1] + i]
    damped = motion.modes[Mode.DAMPING, i] * rate
    if motion.damping.size > 0:
        damped = 0.0
        for j in range(n):
            damped += motion.damping[i, j] * y[n + j]
    out[i] = rate
    out[n + i] = (
        -damped
        - (
            motion.modes[Mode.OMEGA, i] * motion.modes[Mode.OMEGA, i] * y[i]
            + motion.modes[Mode.SLIDE, i] * friction_accel
        )
        - motion.modes[Mode.BASE, i] * drive
    )
    return -motion.modes[Mode.BASE, i] * rate, damped * rate


@njit(error_model="numpy", **NJIT_INTERNAL)
def write_free_motion(motion, q, y, drive):
    """Write the inputs of a set-valued law: free acceleration, inverse mass and displacement.

    Parameters
    ----------
    motion : MotionArrays
    q : float
        Relative displacement [m].
    y : ndarray
        (N,) state.
    drive : float
        Drive [m s-2].
    """
    n = motion.modes.shape[1]
    acceleration = 0.0
    inverse_mass = 0.0
    for i in range(n):
        damped = motion.modes[Mode.DAMPING, i] * y[n + i]
        if motion.damping.size > 0:
            damped = 0.0
            for j in range(n):
                damped += motion.damping[i, j] * y[n + j]
        acceleration -= motion.modes[Mode.SLIDE, i] * (
            damped
            + motion.modes[Mode.OMEGA, i] * motion.modes[Mode.OMEGA, i] * y[i]
            + motion.modes[Mode.BASE, i] * drive
        )
        inverse_mass += (
            motion.modes[Mode.SLIDE, i] * motion.modes[Mode.SLIDE, i] / motion.scalars[Scalar.MASS]
        )
    motion.turn[Turn.FREE_ACCELERATION] = acceleration
    motion.turn[Turn.INVERSE_MASS] = inverse_mass
    motion.turn[Turn.SLIDE] = q


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def write_slopes(motion, t, y, out):
    """Write the time derivative of a state: motion, law and energies.

    The first mode stands before the loop over the others, because the compiler vectorises that
    loop; with one mode this takes 16 ns instead of 53.

    Parameters
    ----------
    motion : MotionArrays
    t : float
        Time [s].
    y : ndarray
        (N,) state.
    out : ndarray
        (N,) slopes, which are written.
    """
    n = motion.modes.shape[1]
    energies = y.size - 3
    drive = evaluate_drive(motion, t)
    mass = motion.scalars[Scalar.MASS]
    q, v = find_slide(motion, y)
    if law.IS_SET_VALUED:
        write_free_motion(motion, q, y, drive)
    force = law.state_rates(
        motion.numbers[0],
        motion.memory[0],
        motion.turn,
        q - motion.scalars[Scalar.ORIGIN],
        v,
        y[2 * n : energies],
        out[2 * n : energies],
    )
    work, loss = write_mode_slopes(motion, 0, y, out, drive, force / mass)
    for i in range(1, n):
        mode_work, mode_loss = write_mode_slopes(motion, i, y, out, drive, force / mass)
        work = work + mode_work
        loss = loss + mode_loss
    out[energies] = mass * drive * work
    out[energies + 1] = mass * loss
    out[energies + 2] = force * v


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_INTERNAL)
def write_stage(motion, stage, h, size):
    """Write the state at a Runge-Kutta stage of a step.

    Parameters
    ----------
    motion : MotionArrays
    stage : int
        Number of the stage.
    h : float
        Length of the step [s].
    size : int
        Numbers of the state that are written.
    """
    first = RUNGE_KUTTA_MATRIX[stage, 0]
    fraction = RUNGE_KUTTA_MATRIX[stage]
    for c in range(size):
        slope = first * motion.work[0, c]
        for j in range(FIRST_COLUMNS[stage], stage):
            slope += fraction[j] * motion.work[j, c]
        motion.work[Work.TRIAL, c] = motion.state[c] + h * slope


@njit(error_model="numpy", **NJIT_INTERNAL)
def take_step(motion, h):
    """Take a Runge-Kutta step of h [s] and write the state after it.

    The state is written into work[Work.TRIAL], and the slopes of all stages are kept.

    work[0] holds the slopes at the start.
    """
    t = motion.scalars[Scalar.TIME]
    size = motion.state.size
    last = motion.work.shape[0] - 14
    for stage in range(1, last + 1):
        write_stage(motion, stage, h, size if stage == last else size - 3)
        write_slopes(
            motion, t + STAGE_NODES[stage] * h, motion.work[Work.TRIAL], motion.work[stage]
        )


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def estimate_error(motion, h, tolerance):
    """Return the estimated error of a step, relative to the tolerance.

    Coordinates and rates count relative to their recent maxima, states of the law relative to their
    sizes. The size of a rate is at least the round-off that the forces leave in it during the step:
    a rate that decays to round-off while the forces balance is no error.

    Parameters
    ----------
    motion : MotionArrays
    h : float
        Length of the step [s].
    tolerance : float
        Relative tolerance of a step.

    Returns
    -------
    float
    """
    n = motion.modes.shape[1]
    n_states = motion.state.size - 3
    sum_5 = 0.0
    sum_3 = 0.0
    friction_accel = (
        motion.scalars[Scalar.STIFFNESS]
        * abs(find_slide(motion, motion.state)[0])
        / motion.scalars[Scalar.MASS]
    )
    for c in range(n_states):
        if c < n:
            scale = motion.scalars[Scalar.MAX_COORDINATE]
        elif c < 2 * n:
            scale = motion.scalars[Scalar.MAX_RATE]
        else:
            scale = motion.work[Work.SIZES, c]
        error_5 = 0.0
        error_3 = 0.0
        for j in range(12):
            error_5 += ORDER_5_WEIGHTS[j] * motion.work[j, c]
            error_3 += ORDER_3_WEIGHTS[j] * motion.work[j, c]
        size_floor = 0.0
        if c < 2 * n:
            size_floor = max(abs(motion.state[c]), abs(motion.work[Work.TRIAL, c]))
            size_floor = max(size_floor, motion.work[Work.SIZES, c])
        if n <= c < 2 * n:
            force_size = (
                abs(motion.state[c - n]) * motion.modes[Mode.OMEGA, c - n] ** 2
                + abs(motion.modes[Mode.SLIDE, c - n]) * friction_accel
            )
            size_floor = max(size_floor, ROUND_OFF_RATIO * abs(h) * force_size / tolerance)
        scale = max(scale, size_floor, MIN_SIZE)
        sum_5 += (error_5 / scale) ** 2
        sum_3 += (error_3 / scale) ** 2
    if not np.isfinite(sum_5):
        return np.inf
    if sum_5 == 0 and sum_3 == 0:
        return 0.0
    return abs(h) * sum_5 / sqrt((sum_5 + 0.01 * sum_3) * n_states) / tolerance


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_INTERNAL)
def extend_step(motion, h):
    """Compute the dense output of a step of h [s] after `take_step`.

    It is written into work[Work.EXTENSION].
    """
    t = motion.scalars[Scalar.TIME]
    size = motion.state.size
    for c in range(size):  # the stages overwrite the state, so it is copied
        motion.work[Work.EXTENSION + 7, c] = motion.work[Work.TRIAL, c]
    for stage in range(13, N_STAGES):
        write_stage(motion, stage, h, size - 3)
        write_slopes(
            motion, t + STAGE_NODES[stage] * h, motion.work[Work.TRIAL], motion.work[stage]
        )
    for c in range(size):
        motion.work[Work.TRIAL, c] = motion.work[Work.EXTENSION + 7, c]
        change = motion.work[Work.TRIAL, c] - motion.state[c]
        motion.work[Work.EXTENSION, c] = change
        motion.work[Work.EXTENSION + 1, c] = h * motion.work[0, c] - change
        motion.work[Work.EXTENSION + 2, c] = 2 * change - h * (
            motion.work[12, c] + motion.work[0, c]
        )
        for k in range(4):
            term = DENSE_OUTPUT_WEIGHTS[k, 0] * motion.work[0, c]
            for j in range(5, N_STAGES):
                term += DENSE_OUTPUT_WEIGHTS[k, j] * motion.work[j, c]
            motion.work[Work.EXTENSION + 3 + k, c] = h * term


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_INTERNAL)
def evaluate_inside(motion, fraction, out, size):
    """Write the state at a fraction of the step from its dense output.

    Parameters
    ----------
    motion : MotionArrays
    fraction : float
        Of the step.
    out : ndarray
        (N,) state, which is written.
    size : int
        Numbers of the state that are written.
    """
    for c in range(size):
        value = motion.work[Work.EXTENSION + 6, c] * fraction
        for k in range(5, -1, -1):
            value = (value + motion.work[Work.EXTENSION + k, c]) * (
                fraction if k % 2 == 0 else 1 - fraction
            )
        out[c] = motion.state[c] + value
