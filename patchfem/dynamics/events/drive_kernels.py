"""Compiled series of a drive over a short piece: sines and constants, straight lines, sweeps of either kind.

A segment of the drive is a row: cycle and offset [s] of its start, kind, constant [m s-2], amplitude, omega [rad/s],
phase [rad] at the start of its first cycle (of a sweep at its own start), slope, whether the amplitude is a
displacement, fastest rate [1/s], and what its turns per cycle have beyond a whole number, in two parts: 24 bits, whose
product with a number of cycles is exact, and the rest. So the phase keeps its digits over a million cycles.
"""

from math import cos, exp, expm1, floor, pi, sin

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .series_kernels import TWICE

# kinds of a segment
SINE = 0.0
LINE = 1.0
CHIRP = 2.0
LOG_CHIRP = 3.0
(
    CYCLE,
    OFFSET,
    KIND,
    CONSTANT,
    AMPLITUDE,
    OMEGA,
    PHASE,
    SLOPE,
    DISPLACED,
    RATE,
    TURNS,
    TURNS_LEFT,
) = range(12)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def since(segment, cycle, offset, period):
    """Time [s] since a segment began."""
    return (cycle - segment[CYCLE]) * period + (offset - segment[OFFSET])


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rate_of(segment, period):
    """Fastest rate [1/s] of a drive, and at least that of its cycles, whose sines and cosines are taken of the
    motion."""
    return max(segment[RATE], 2 * pi / period)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def phase_of(segment, cycle, offset, period):
    """Phase of the drive [rad], modulo 2 pi; along a straight line that of the cycle."""
    if segment[KIND] == SINE:
        theta = segment[PHASE] + segment[OMEGA] * offset
        gone = cycle - segment[CYCLE]
        if segment[TURNS] != 0.0:
            extra = gone * segment[TURNS]
            theta += 2 * pi * (extra - floor(extra) + gone * segment[TURNS_LEFT])
        return theta - 2 * pi * floor(theta / (2 * pi))  # a tenth of the time of %
    if segment[KIND] == LINE:
        return 2 * pi * offset / period
    time = since(segment, cycle, offset, period)
    if segment[KIND] == CHIRP:
        return (segment[PHASE] + time * (segment[OMEGA] + 0.5 * segment[SLOPE] * time)) % (2 * pi)
    return (segment[PHASE] + segment[OMEGA] * expm1(segment[SLOPE] * time) / segment[SLOPE]) % (
        2 * pi
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def value_now(segment, cycle, offset, period):
    """Drive [m s-2] of a segment at a time (cycle, offset)."""
    kind = segment[KIND]
    theta = phase_of(segment, cycle, offset, period)
    time = since(segment, cycle, offset, period)
    if kind == LINE:
        return segment[CONSTANT] + segment[SLOPE] * time
    size = segment[AMPLITUDE]
    if segment[DISPLACED] == 1.0:
        omega = (
            segment[OMEGA] + segment[SLOPE] * time
            if kind == CHIRP
            else segment[OMEGA] * exp(segment[SLOPE] * time)
        )
        size *= omega * omega
    return segment[CONSTANT] + size * sin(theta)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def drive_series(segment, cycle, offset, period, h, top, waves):
    """Fill waves[0] (>= top + 1,) with the series over u = t/h of a drive [m s-2] from the time (cycle, offset) on.

    waves (3, >= top + 1): the rest is room.
    """
    wave = waves[0]
    kind = segment[KIND]
    theta = phase_of(segment, cycle, offset, period)
    if kind == SINE:
        turn = segment[OMEGA] * h
        wave[0] = segment[AMPLITUDE] * sin(theta)
        wave[1] = segment[AMPLITUDE] * cos(theta) * turn
        for k in range(2, top + 1):
            wave[k] = -wave[k - 2] * (turn * turn * TWICE[k])
        wave[0] += segment[CONSTANT]
        return
    time = since(segment, cycle, offset, period)
    if kind == LINE:
        for k in range(top + 1):
            wave[k] = 0.0
        wave[0] = segment[CONSTANT] + segment[SLOPE] * time
        wave[1] = segment[SLOPE] * h
        return
    omega = (
        segment[OMEGA] + segment[SLOPE] * time
        if kind == CHIRP
        else segment[OMEGA] * exp(segment[SLOPE] * time)
    )
    swept(kind, omega, theta, segment[SLOPE] * h, h, top, waves)
    if segment[DISPLACED] == 1.0:
        squared(kind, omega, segment[SLOPE] * h, top, waves)
    for k in range(top + 1):
        wave[k] *= segment[AMPLITUDE]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def swept(kind, omega, theta, slope, h, top, waves):
    """Fill waves[0] with the series of the sine of a swept phase, by s' = phi' c and c' = -phi' s; waves[2] with phi'.

    omega [rad/s] and theta: here; slope: of omega [rad/s] over u, or of its logarithm.
    """
    wave = waves[0]
    cosine = waves[1]
    rate = waves[2]
    wave[0] = sin(theta)
    cosine[0] = cos(theta)
    rate[0] = omega * h
    for k in range(1, top + 1):
        rate[k] = rate[k - 1] * slope / k if kind == LOG_CHIRP else slope * h if k == 1 else 0.0
    for k in range(top):
        s = 0.0
        c = 0.0
        for j in range(min(k + 1, 2) if kind == CHIRP else k + 1):
            s += rate[j] * cosine[k - j]
            c -= rate[j] * wave[k - j]
        wave[k + 1] = s / (k + 1)
        cosine[k + 1] = c / (k + 1)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def squared(kind, omega, slope, top, waves):
    """Multiply waves[0] by the series of the swept omega squared."""
    wave = waves[0]
    square = waves[2]
    square[0] = omega * omega
    for k in range(1, top + 1):
        if kind == LOG_CHIRP:
            square[k] = square[k - 1] * 2 * slope / k
        else:
            square[k] = 2 * omega * slope if k == 1 else slope * slope if k == 2 else 0.0
    for k in range(top, -1, -1):
        out = 0.0
        for j in range(k + 1):
            out += square[j] * wave[k - j]
        wave[k] = out
