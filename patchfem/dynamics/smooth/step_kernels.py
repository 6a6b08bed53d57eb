"""One Runge-Kutta step of order 8, its error and its dense output (compiled).

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
from ..events.drive_kernels import drive_value
from ..tableau_kernels import (
    EXTENSION_WEIGHTS,
    FIRST_COLUMNS,
    N_STAGES,
    ORDER_3_WEIGHTS,
    ORDER_5_WEIGHTS,
    RUNGE_KUTTA_MATRIX,
    STAGE_NODES,
)
from .arrays import MODE, SCALAR, TURN, WORK

# smallest size of a number, by which the error of a state at rest is measured
MIN_SIZE = 1e-30
# round-off of an acceleration over the forces per mass of mode and law that balance in it
ROUND_OFF_RATIO = 2e-15


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def evaluate_drive(motion, t):
    """Return the drive [m s-2] at a time [s] by its present segment.

    The segment is continued beyond its ends.
    """
    return drive_value(
        motion.segments[int(motion.scalars[SCALAR.segment])], 0.0, t, motion.scalars[SCALAR.period]
    )


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def find_slide(motion, y):
    """Return relative displacement [m] and velocity [m/s] of a state."""
    n = motion.modes.shape[1]
    q = motion.modes[MODE.slide, 0] * y[0]
    v = motion.modes[MODE.slide, 0] * y[n]
    for i in range(1, n):
        q += motion.modes[MODE.slide, i] * y[i]
        v += motion.modes[MODE.slide, i] * y[n + i]
    return q, v


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def write_mode_slopes(motion, i, y, out, drive, friction_accel):
    """Write the slopes of a mode.

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
        Friction force over the modal mass [m s-2].

    Returns
    -------
    drive_power, viscous_power : float
        Over the modal mass [m2 s-3].
    """
    n = motion.modes.shape[1]
    rate = y[motion.modes.shape[1] + i]
    damped = motion.modes[MODE.damping, i] * rate
    if motion.damping.size > 0:
        damped = 0.0
        for j in range(n):
            damped += motion.damping[i, j] * y[n + j]
    out[i] = rate
    out[n + i] = (
        -damped
        - (
            motion.modes[MODE.omega, i] * motion.modes[MODE.omega, i] * y[i]
            + motion.modes[MODE.slide, i] * friction_accel
        )
        - motion.modes[MODE.base, i] * drive
    )
    return -motion.modes[MODE.base, i] * rate, damped * rate


@njit(error_model="numpy", **NJIT_INTERNAL)
def write_free_motion(motion, q, y, drive):
    """Write free acceleration, inverse mass and slide into motion.turn for a set-valued law.

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
    free = 0.0
    ease = 0.0
    for i in range(n):
        damped = motion.modes[MODE.damping, i] * y[n + i]
        if motion.damping.size > 0:
            damped = 0.0
            for j in range(n):
                damped += motion.damping[i, j] * y[n + j]
        free -= motion.modes[MODE.slide, i] * (
            damped
            + motion.modes[MODE.omega, i] * motion.modes[MODE.omega, i] * y[i]
            + motion.modes[MODE.base, i] * drive
        )
        ease += (
            motion.modes[MODE.slide, i] * motion.modes[MODE.slide, i] / motion.scalars[SCALAR.mass]
        )
    motion.turn[TURN.free_acceleration] = free
    motion.turn[TURN.inverse_mass] = ease
    motion.turn[TURN.slide] = q


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def write_slopes(motion, t, y, out):
    """Write the slopes of a state: motion, law and energies.

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
    mass = motion.scalars[SCALAR.mass]
    q, v = find_slide(motion, y)
    if law.IS_SET_VALUED:
        write_free_motion(motion, q, y, drive)
    force = law.state_rates(
        motion.numbers[0],
        motion.memory[0],
        motion.turn,
        q - motion.scalars[SCALAR.origin],
        v,
        y[2 * n : energies],
        out[2 * n : energies],
    )
    work, lost = write_mode_slopes(motion, 0, y, out, drive, force / mass)
    for i in range(1, n):
        more, other = write_mode_slopes(motion, i, y, out, drive, force / mass)
        work = work + more
        lost = lost + other
    out[energies] = mass * drive * work
    out[energies + 1] = mass * lost
    out[energies + 2] = force * v


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_INTERNAL)
def write_stage(motion, stage, h, size):
    """Write the state at a stage of a step into work[WORK.trial].

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
        part = first * motion.work[0, c]
        for j in range(FIRST_COLUMNS[stage], stage):
            part += fraction[j] * motion.work[j, c]
        motion.work[WORK.trial, c] = motion.state[c] + h * part


@njit(error_model="numpy", **NJIT_INTERNAL)
def take_step(motion, h):
    """Write the state after a step of h [s] into work[WORK.trial], with all slopes.

    work[0] holds the slopes at the start.
    """
    t = motion.scalars[SCALAR.time]
    size = motion.state.size
    last = motion.work.shape[0] - 14
    for stage in range(1, last + 1):
        write_stage(motion, stage, h, size if stage == last else size - 3)
        write_slopes(
            motion, t + STAGE_NODES[stage] * h, motion.work[WORK.trial], motion.work[stage]
        )


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def estimate_error(motion, h, tolerance):
    """Return the estimated error of a step over the tolerance.

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
    size = motion.state.size - 3
    fifth = 0.0
    third = 0.0
    friction_accel = (
        motion.scalars[SCALAR.stiffness]
        * abs(find_slide(motion, motion.state)[0])
        / motion.scalars[SCALAR.mass]
    )
    for c in range(size):
        if c < n:
            scale = motion.scalars[SCALAR.max_coordinate]
        elif c < 2 * n:
            scale = motion.scalars[SCALAR.max_rate]
        else:
            scale = motion.work[WORK.sizes, c]
        high = 0.0
        low = 0.0
        for j in range(12):
            high += ORDER_5_WEIGHTS[j] * motion.work[j, c]
            low += ORDER_3_WEIGHTS[j] * motion.work[j, c]
        top = (
            max(abs(motion.state[c]), abs(motion.work[WORK.trial, c]), motion.work[WORK.sizes, c])
            if c < 2 * n
            else 0.0
        )
        if n <= c < 2 * n:
            force_size = (
                abs(motion.state[c - n]) * motion.modes[MODE.omega, c - n] ** 2
                + abs(motion.modes[MODE.slide, c - n]) * friction_accel
            )
            top = max(top, ROUND_OFF_RATIO * abs(h) * force_size / tolerance)
        scale = max(scale, top, MIN_SIZE)
        fifth += (high / scale) ** 2
        third += (low / scale) ** 2
    if not np.isfinite(fifth):
        return np.inf
    if fifth == 0 and third == 0:
        return 0.0
    return abs(h) * fifth / sqrt((fifth + 0.01 * third) * size) / tolerance


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_INTERNAL)
def extend_step(motion, h):
    """Write the dense output of a step of h [s], after `take_step`, into work[WORK.extension]."""
    t = motion.scalars[SCALAR.time]
    size = motion.state.size
    for c in range(size):  # the stages overwrite it
        motion.work[WORK.extension + 7, c] = motion.work[WORK.trial, c]
    for stage in range(13, N_STAGES):
        write_stage(motion, stage, h, size - 3)
        write_slopes(
            motion, t + STAGE_NODES[stage] * h, motion.work[WORK.trial], motion.work[stage]
        )
    for c in range(size):
        motion.work[WORK.trial, c] = motion.work[WORK.extension + 7, c]
        rise = motion.work[WORK.trial, c] - motion.state[c]
        motion.work[WORK.extension, c] = rise
        motion.work[WORK.extension + 1, c] = h * motion.work[0, c] - rise
        motion.work[WORK.extension + 2, c] = 2 * rise - h * (motion.work[12, c] + motion.work[0, c])
        for k in range(4):
            part = EXTENSION_WEIGHTS[k, 0] * motion.work[0, c]
            for j in range(5, N_STAGES):
                part += EXTENSION_WEIGHTS[k, j] * motion.work[j, c]
            motion.work[WORK.extension + 3 + k, c] = h * part


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_INTERNAL)
def evaluate_inside(motion, fraction, out, size):
    """Write the state at a fraction of the step by its dense output.

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
        value = motion.work[WORK.extension + 6, c] * fraction
        for k in range(5, -1, -1):
            value = (value + motion.work[WORK.extension + k, c]) * (
                fraction if k % 2 == 0 else 1 - fraction
            )
        out[c] = motion.state[c] + value
