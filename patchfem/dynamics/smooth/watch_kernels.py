"""Recording of a step: samples, extremes, phasors and polynomial parts (compiled).

The dense output takes three more slopes, so only a step inside which something is read has one.
"""

from math import cos, pi, sin
from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL
from ...friction.laws import stretch_kernels as law
from . import step_kernels as steps
from .arrays import NODE_FRACTIONS, Counter, Mode, Scalar, Work

# Gauss rule for the part of a step in a cycle over which the phasor is integrated.
PHASOR_POINTS, PHASOR_WEIGHTS = np.polynomial.legendre.leggauss(4)
# Chebyshev polynomial of the second highest degree at NODE_FRACTIONS.
PENULTIMATE_TERM = np.cos(
    np.pi
    * (NODE_FRACTIONS.size - 2)
    / (NODE_FRACTIONS.size - 1)
    * np.arange(NODE_FRACTIONS.size)[::-1]
)
# Size of the last Chebyshev terms of the force in a part, relative to the largest force,
# above which the part is halved.
MAX_ROUGHNESS_RATIO = 1e-9
# Minimum length of a part that is halved, as a fraction of a step.
MIN_PART_FRACTION = 2.0**-14
# Maximum number of parts of a step; their rows must be free.
MAX_PARTS = 64


class InterfaceState(NamedTuple):
    """State of an interface: displacement and velocity, force [N], energy [J] and slip [m]."""

    slide: float
    velocity: float
    force: float
    energy: float
    slip: float


@njit(error_model="numpy", **NJIT_INTERNAL)
def read_interface(motion, y):
    """Return displacement, velocity, force, energy and slip of the interface in a state."""
    n = motion.modes.shape[1]
    q, v = steps.find_slide(motion, y)
    for k in range(motion.memory.shape[1]):
        motion.memory[1, k] = motion.memory[0, k]
    law.end_motion(
        motion.numbers[0],
        motion.memory[1],
        motion.turn,
        q - motion.scalars[Scalar.ORIGIN],
        v,
        y[2 * n : y.size - 3],
    )
    force, energy, slip = law.read_memory(motion.numbers[0], motion.memory[1], q, v)
    return InterfaceState(q, v, force, energy, slip)


@njit(error_model="numpy", **NJIT_INTERNAL)
def write_sample(motion, t, y, row):
    """Write a state as a sample into a row of the record, see `MotionRecord`.

    Parameters
    ----------
    motion : MotionArrays
    t : float
        Time [s].
    y : ndarray
        (N,) state.
    row : ndarray
        (2 n + 7,) sample, which is written.
    """
    n = motion.modes.shape[1]
    if law.IS_SET_VALUED:
        steps.write_slopes(motion, t, y, motion.work[13])
    row[0] = t
    for i in range(2 * n):
        row[1 + i] = y[i]
    interface = read_interface(motion, y)
    row[2 * n + 1] = interface.slide
    row[2 * n + 2] = interface.velocity
    row[2 * n + 3] = interface.force
    row[2 * n + 4] = interface.slip
    row[2 * n + 5] = interface.energy
    row[2 * n + 6] = y[y.size - 1]


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_output(motion, y):
    """Return the output displacement [m] and its rate [m/s] of a state."""
    x = 0.0
    w = 0.0
    n = motion.modes.shape[1]
    for i in range(n):
        x += motion.modes[Mode.OUTPUT, i] * y[i]
        w += motion.modes[Mode.OUTPUT, i] * y[n + i]
    return x, w


@njit(error_model="numpy", **NJIT_INTERNAL)
def can_output_reverse(motion):
    """Return whether the output may have an extremum inside the step.

    With several modes it may. With one mode it reverses only together with the interface, which
    ends a step, or by round-off.
    """
    return (
        motion.modes.shape[1] > 1
        or find_output(motion, motion.state)[1] * find_output(motion, motion.work[Work.TRIAL])[1]
        < 0
    )


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_output_extreme(motion, record, a, b, rate):
    """Return the output displacement [m] at an extremum inside a step.

    Parameters
    ----------
    motion : MotionArrays
    record : MotionRecord
    a, b : float
        Fractions of the step between which the rate vanishes.
    rate : float
        Rate of the output at a [m/s].

    Returns
    -------
    float
    """
    out = 0.0
    for _ in range(60):
        middle = 0.5 * (a + b)
        steps.evaluate_inside(motion, middle, record.workspace, motion.state.size - 3)
        out, here = find_output(motion, record.workspace)
        if here * rate > 0:
            a = middle
        else:
            b = middle
        if b - a < 1e-8:  # the output is flat here, so its error is the square of the interval
            break
    return out


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def widen_by_step(motion, h, record, parts):
    """Include the output during a step in the extremes of the present cycle.

    Parameters
    ----------
    motion : MotionArrays
    h : float
        Length of the step [s].
    record : MotionRecord
    parts : int
        Number of parts of the step, at whose ends the sign of the rate is evaluated.
    """
    x, w = find_output(motion, motion.state)
    minimum = x
    maximum = x
    for k in range(1, parts + 1):
        if k < parts:
            steps.evaluate_inside(motion, k / parts, record.workspace, motion.state.size - 3)
            x1, w1 = find_output(motion, record.workspace)
        else:
            x1, w1 = find_output(motion, motion.work[Work.TRIAL])
        minimum = min(minimum, x1)
        maximum = max(maximum, x1)
        if w * w1 < 0:
            extreme = find_output_extreme(motion, record, (k - 1) / parts, k / parts, w)
            minimum = min(minimum, extreme)
            maximum = max(maximum, extreme)
        w = w1
    widen_extremes(
        record.cycles,
        record.counters[Counter.PERIOD],
        motion.scalars[Scalar.TIME] + 0.5 * h,
        minimum,
        maximum,
    )


@njit(error_model="numpy", **NJIT_INTERNAL)
def widen_extremes(cycles, period, time, x, y):
    """Include two output values in the extremes of the cycle that contains a time.

    Parameters
    ----------
    cycles : ndarray
        (4, c) see `MotionRecord`.
    period : float
        Duration of a cycle [s].
    time : float
        [s].
    x, y : float
        Outputs [m].
    """
    cycle = min(max(int(time / period), 0), cycles.shape[1] - 1)
    cycles[0, cycle] = min(cycles[0, cycle], x, y)
    cycles[1, cycle] = max(cycles[1, cycle], x, y)


@njit(error_model="numpy", **NJIT_INTERNAL)
def add_phasor(cycles, period, t, h, begin, end):
    """Add a step to the phasors of the cycles that request a phasor.

    It integrates 2/T x exp(-i omega t) of the quintic through output, rate and acceleration at
    both ends, whose error is h^6/46080 of the sixth derivative.

    Parameters
    ----------
    cycles, period, t, h
        See `MotionRecord`; times [s].
    begin, end : tuple
        Output [m], its rate [m/s] and acceleration [m s-2] at both ends.
    """
    first = int(t / period)
    last = min(int((t + h) / period), cycles.shape[1] - 1)
    for cycle in range(first, last + 1):
        start_time = max(t, cycle * period)
        end_time = min(t + h, (cycle + 1) * period)
        if np.isnan(cycles[2, cycle]) or end_time <= start_time:
            continue
        p = begin[1] * h
        q = end[1] * h
        a = begin[2] * h * h / 2
        b = end[2] * h * h / 2
        rise = end[0] - begin[0]
        rise_remainder = rise - p - a
        slope_remainder = q - p - 2 * a
        curvature_remainder = 2 * (b - a)
        c3 = 10 * rise_remainder - 4 * slope_remainder + curvature_remainder / 2
        c4 = -15 * rise_remainder + 7 * slope_remainder - curvature_remainder
        c5 = 6 * rise_remainder - 3 * slope_remainder + curvature_remainder / 2
        for j in range(PHASOR_POINTS.size):
            time = start_time + 0.5 * (1 + PHASOR_POINTS[j]) * (end_time - start_time)
            weight = PHASOR_WEIGHTS[j] * (end_time - start_time) / period
            s = (time - t) / h
            angle = 2 * pi * (time / period - cycle)
            x = begin[0] + s * (p + s * (a + s * (c3 + s * (c4 + s * c5))))
            cycles[2, cycle] += weight * x * cos(angle)
            cycles[3, cycle] -= weight * x * sin(angle)


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def add_step_to_phasors(motion, h, record):
    """Add the present step to the phasors.

    Parameters
    ----------
    motion : MotionArrays
    h : float
        Length of the step [s].
    record : MotionRecord
    """
    x, w = find_output(motion, motion.state)
    y, v = find_output(motion, motion.work[Work.TRIAL])
    acceleration = find_output(motion, motion.work[0])[1]
    end_acceleration = find_output(motion, motion.work[12])[1]
    add_phasor(
        record.cycles,
        record.counters[Counter.PERIOD],
        motion.scalars[Scalar.TIME],
        h,
        (x, w, acceleration),
        (y, v, end_acceleration),
    )


@njit(error_model="numpy", **NJIT_INTERNAL)
def write_samples(motion, h, record):
    """Write the samples that are due inside a step or at its end into the record.

    Parameters
    ----------
    motion : MotionArrays
    h : float
        Length of the step [s].
    record : MotionRecord
    """
    t = motion.scalars[Scalar.TIME]
    end = t + h
    while (
        record.counters[Counter.NEXT_SAMPLE] < record.samples.shape[0]
        and record.samples[int(record.counters[Counter.NEXT_SAMPLE]), 0] <= end
    ):
        j = int(record.counters[Counter.NEXT_SAMPLE])
        steps.evaluate_inside(
            motion, (record.samples[j, 0] - t) / h, record.workspace, motion.state.size
        )
        write_sample(motion, record.samples[j, 0], record.workspace, record.samples[j])
        record.counters[Counter.NEXT_SAMPLE] += 1


@njit(error_model="numpy", **NJIT_INTERNAL)
def estimate_roughness(row, force):
    """Return the last two Chebyshev coefficients [N] of the force in a part of a step.

    row: samples at NODE_FRACTIONS; force: column.
    """
    last_term = 0.0
    penultimate_term = 0.0
    last = NODE_FRACTIONS.size - 1
    for j in range(last + 1):
        weight = (0.5 if j == 0 or j == last else 1.0) * row[j, force]
        last_term += weight if j % 2 == 0 else -weight
        penultimate_term += weight * PENULTIMATE_TERM[j]
    return (abs(last_term) + 2 * abs(penultimate_term)) / last


@njit(error_model="numpy", **NJIT_INTERNAL)
def write_step_parts(motion, h, record):
    """Write a step into the record, divided into substeps in which the force is smooth.

    The force in each part is a polynomial to MAX_ROUGHNESS_RATIO.

    Parameters
    ----------
    motion : MotionArrays
    h : float
        Length of the step [s].
    record : MotionRecord
    """
    begin = 0.0
    size = 1.0
    force = 2 * motion.modes.shape[1] + 3
    while begin < 1 and record.counters[Counter.N_PARTS] < record.parts.shape[0]:
        row = record.parts[int(record.counters[Counter.N_PARTS])]
        for j in range(NODE_FRACTIONS.size):
            at = min(begin + NODE_FRACTIONS[j] * size, 1.0)
            steps.evaluate_inside(motion, at, record.workspace, motion.state.size)
            write_sample(motion, motion.scalars[Scalar.TIME] + at * h, record.workspace, row[j])
            record.counters[Counter.MAX_FORCE] = max(
                record.counters[Counter.MAX_FORCE], abs(row[j, force])
            )
        if (
            size > MIN_PART_FRACTION
            and estimate_roughness(row, force)
            > MAX_ROUGHNESS_RATIO * record.counters[Counter.MAX_FORCE]
        ):
            size *= 0.5
            continue
        record.counters[Counter.N_PARTS] += 1
        begin += size
        size = min(2 * size, 1 - begin)


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def stored_energy(motion, y):
    """Return the energy stored in the modes and in the interface [J]."""
    n = motion.modes.shape[1]
    out = 0.0
    for i in range(n):
        out += (
            y[n + i] * y[n + i]
            + motion.modes[Mode.OMEGA, i] * motion.modes[Mode.OMEGA, i] * y[i] * y[i]
        )
    return 0.5 * motion.scalars[Scalar.MASS] * out + read_interface(motion, y).energy


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def record_step(motion, h, record):
    """Record samples, extremes, phasors and parts of a step before the state advances.

    Parameters
    ----------
    motion : MotionArrays
    h : float
        Length of the step [s].
    record : MotionRecord
    """
    work = motion.state.size - 3
    at = int(record.counters[Counter.NEXT_SAMPLE])
    record.counters[Counter.DRIVE_POWER] += abs(motion.work[Work.TRIAL, work] - motion.state[work])
    record.counters[Counter.MAX_STORED] = max(
        record.counters[Counter.MAX_STORED], stored_energy(motion, motion.work[Work.TRIAL])
    )
    record.counters[Counter.ACCEPTED] += 1
    add_step_to_phasors(motion, h, record)
    sampled = (
        at < record.samples.shape[0] and record.samples[at, 0] <= motion.scalars[Scalar.TIME] + h
    )
    records_parts = record.parts.shape[0] > 0
    if not (records_parts or sampled or can_output_reverse(motion)):
        widen_by_step(motion, h, record, 1)
        return
    steps.extend_step(motion, h)
    write_samples(motion, h, record)
    widen_by_step(motion, h, record, 1 if motion.modes.shape[1] == 1 else 4)
    if records_parts:
        write_step_parts(motion, h, record)
