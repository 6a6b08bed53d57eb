"""Drive of a run over a short piece as a power series (compiled).

A segment of the drive is a sine, a straight line, or a sweep with linear or logarithmic frequency;
its numbers are named in `positions_kernels.SegmentColumns`.
"""

from math import cos, exp, expm1, floor, pi, sin

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .positions_kernels import KIND, SEGMENT
from .series_kernels import DOUBLE_INTEGRAL


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def time_since_start(segment, cycle, offset, period):
    """Return the time [s] since a segment began.

    Parameters
    ----------
    segment : ndarray
        (12,) segment of the drive, see `SegmentColumns`.
    cycle : float
        Number of the cycle.
    offset : float
        Time since the start of the cycle [s].
    period : float
        Duration of a cycle [s].

    Returns
    -------
    float
    """
    return (cycle - segment[SEGMENT.cycle]) * period + (offset - segment[SEGMENT.offset])


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def fastest_drive_rate(segment, period):
    """Return the fastest rate [1/s] that a piece must resolve: of the drive, and of its cycles.

    The motion is integrated with sines and cosines of the cycle.
    """
    return max(segment[SEGMENT.rate], 2 * pi / period)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def drive_phase(segment, cycle, offset, period):
    """Return the phase of the drive [rad] in [0, 2 pi).

    Along a straight line it is the phase of the cycle.

    Parameters
    ----------
    segment : ndarray
        (12,) segment of the drive, see `SegmentColumns`.
    cycle : float
        Number of the cycle.
    offset : float
        Time since the start of the cycle [s].
    period : float
        Duration of a cycle [s].

    Returns
    -------
    float
    """
    if segment[SEGMENT.kind] == KIND.sine:
        theta = segment[SEGMENT.phase] + segment[SEGMENT.omega] * offset
        cycles = cycle - segment[SEGMENT.cycle]
        if segment[SEGMENT.turns] != 0.0:
            extra = cycles * segment[SEGMENT.turns]
            theta += 2 * pi * (extra - floor(extra) + cycles * segment[SEGMENT.turns_remainder])
        # takes a tenth of the time of the operator %
        return theta - 2 * pi * floor(theta / (2 * pi))
    if segment[SEGMENT.kind] == KIND.line:
        return 2 * pi * offset / period
    time = time_since_start(segment, cycle, offset, period)
    if segment[SEGMENT.kind] == KIND.chirp:
        return (
            segment[SEGMENT.phase]
            + time * (segment[SEGMENT.omega] + 0.5 * segment[SEGMENT.slope] * time)
        ) % (2 * pi)
    return (
        segment[SEGMENT.phase]
        + segment[SEGMENT.omega] * expm1(segment[SEGMENT.slope] * time) / segment[SEGMENT.slope]
    ) % (2 * pi)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def drive_value(segment, cycle, offset, period):
    """Return the acceleration of a segment of the drive [m s-2].

    Parameters
    ----------
    segment : ndarray
        (12,) segment of the drive, see `SegmentColumns`.
    cycle : float
        Number of the cycle.
    offset : float
        Time since the start of the cycle [s].
    period : float
        Duration of a cycle [s].

    Returns
    -------
    float
    """
    kind = segment[SEGMENT.kind]
    theta = drive_phase(segment, cycle, offset, period)
    time = time_since_start(segment, cycle, offset, period)
    if kind == KIND.line:
        return segment[SEGMENT.constant] + segment[SEGMENT.slope] * time
    size = segment[SEGMENT.amplitude]
    if segment[SEGMENT.is_displacement] == 1.0:
        omega = (
            segment[SEGMENT.omega] + segment[SEGMENT.slope] * time
            if kind == KIND.chirp
            else segment[SEGMENT.omega] * exp(segment[SEGMENT.slope] * time)
        )
        size *= omega * omega
    return segment[SEGMENT.constant] + size * sin(theta)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def expand_drive(segment, cycle, offset, period, h, top, waves):
    """Write the series of the drive [m s-2] over u = t/h into waves[0].

    Parameters
    ----------
    segment : ndarray
        (12,) see `SegmentColumns`.
    cycle, offset, period : float
        Cycle and offset [s] of the start of the piece, and duration of a cycle [s].
    h : float
        Duration of the piece [s].
    top : int
        Highest power.
    waves : ndarray
        (3, >= top + 1); rows 1 and 2 are workspace.
    """
    series = waves[0]
    kind = segment[SEGMENT.kind]
    theta = drive_phase(segment, cycle, offset, period)
    if kind == KIND.sine:
        angle = segment[SEGMENT.omega] * h
        series[0] = segment[SEGMENT.amplitude] * sin(theta)
        series[1] = segment[SEGMENT.amplitude] * cos(theta) * angle
        for k in range(2, top + 1):
            series[k] = -series[k - 2] * (angle * angle * DOUBLE_INTEGRAL[k])
        series[0] += segment[SEGMENT.constant]
        return
    time = time_since_start(segment, cycle, offset, period)
    if kind == KIND.line:
        for k in range(top + 1):
            series[k] = 0.0
        series[0] = segment[SEGMENT.constant] + segment[SEGMENT.slope] * time
        series[1] = segment[SEGMENT.slope] * h
        return
    omega = (
        segment[SEGMENT.omega] + segment[SEGMENT.slope] * time
        if kind == KIND.chirp
        else segment[SEGMENT.omega] * exp(segment[SEGMENT.slope] * time)
    )
    expand_sweep(kind, omega, theta, segment[SEGMENT.slope] * h, h, top, waves)
    if segment[SEGMENT.is_displacement] == 1.0:
        multiply_by_squared_frequency(kind, omega, segment[SEGMENT.slope] * h, top, waves)
    for k in range(top + 1):
        series[k] *= segment[SEGMENT.amplitude]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def expand_sweep(kind, omega, theta, slope, h, top, waves):
    """Write the series of the sine of a swept phase into waves[0].

    The series of its frequency is left in waves[2].

    The recursion is s' = phi' c and c' = -phi' s.

    Parameters
    ----------
    kind : float
        `KIND.chirp` or `KIND.log_chirp`.
    omega, theta : float
        Angular frequency [rad/s] and phase [rad] at the start of the piece.
    slope : float
        Change over the piece of omega [rad/s], or of its logarithm.
    h : float
        Duration of the piece [s].
    top : int
        Highest power.
    waves : ndarray
        (3, >= top + 1).
    """
    series = waves[0]
    cosine = waves[1]
    rate = waves[2]
    series[0] = sin(theta)
    cosine[0] = cos(theta)
    rate[0] = omega * h
    for k in range(1, top + 1):
        if kind == KIND.log_chirp:
            rate[k] = rate[k - 1] * slope / k
        else:
            rate[k] = slope * h if k == 1 else 0.0
    for k in range(top):
        s = 0.0
        c = 0.0
        for j in range(min(k + 1, 2) if kind == KIND.chirp else k + 1):
            s += rate[j] * cosine[k - j]
            c -= rate[j] * series[k - j]
        series[k + 1] = s / (k + 1)
        cosine[k + 1] = c / (k + 1)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def multiply_by_squared_frequency(kind, omega, slope, top, waves):
    """Multiply waves[0] by the series of the squared frequency of a sweep.

    Parameters
    ----------
    kind, omega, slope, top, waves
        See `expand_sweep`.
    """
    series = waves[0]
    square = waves[2]
    square[0] = omega * omega
    for k in range(1, top + 1):
        square[k] = square[k - 1] * 2 * slope / k if kind == KIND.log_chirp else 0.0
    if kind == KIND.chirp:
        square[1] = 2 * omega * slope
        square[2] = slope * slope
    for k in range(top, -1, -1):
        total = 0.0
        for j in range(k + 1):
            total += square[j] * series[k - j]
        series[k] = total
