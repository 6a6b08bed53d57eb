"""Power series of the drive over a short time interval (compiled).

A segment of the drive is a sine, a straight line, or a sweep with linear or logarithmic frequency;
its numbers are named in `positions_kernels.Segment`.
"""

from math import cos, exp, expm1, floor, pi, sin
from typing import NamedTuple

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_KERNEL
from .positions_kernels import SEGMENT_KIND, Segment, Time
from .series_kernels import DOUBLE_INTEGRAL_FACTORS


class Instant(NamedTuple):
    """Instant of a run: cycle number, time since the cycle began [s], and cycle duration [s]."""

    cycle: float
    offset: float
    period: float


@njit(**NJIT_INLINE)
def present_instant(time_state):
    """Return the present instant of a run."""
    now = time_state.now
    return Instant(now[Time.CYCLE], now[Time.OFFSET], time_state.period[0])


@njit(**NJIT_INLINE)
def time_since_start(segment, instant):
    """Return the time [s] since a segment of the drive began.

    Parameters
    ----------
    segment : ndarray
        (12,) segment of the drive, see `Segment`.
    instant : Instant

    Returns
    -------
    float
    """
    return (instant.cycle - segment[Segment.CYCLE]) * instant.period + (
        instant.offset - segment[Segment.OFFSET]
    )


@njit(**NJIT_INLINE)
def fastest_drive_rate(time_state):
    """Return the fastest rate [1/s] of the drive that the next time interval must resolve.

    It is the rate of the present segment, or that of a sine with the period of a cycle.

    The motion is integrated with sines and cosines of the cycle.
    """
    segment = time_state.segments[int(time_state.now[Time.SEGMENT])]
    return max(segment[Segment.RATE], 2 * pi / time_state.period[0])


@njit(**NJIT_INLINE)
def drive_phase(segment, instant):
    """Return the phase of the drive [rad] in [0, 2 pi) at an instant.

    Along a straight line it is the phase of the cycle.

    Parameters
    ----------
    segment : ndarray
        (12,) segment of the drive, see `Segment`.
    instant : Instant

    Returns
    -------
    float
    """
    offset = instant.offset
    if segment[Segment.KIND] == SEGMENT_KIND.sine:
        theta = segment[Segment.PHASE] + segment[Segment.OMEGA] * offset
        cycles = instant.cycle - segment[Segment.CYCLE]
        if segment[Segment.TURNS] != 0.0:
            extra = cycles * segment[Segment.TURNS]
            theta += 2 * pi * (extra - floor(extra) + cycles * segment[Segment.TURNS_REMAINDER])
        # This takes a tenth of the time of the operator %.
        return theta - 2 * pi * floor(theta / (2 * pi))
    if segment[Segment.KIND] == SEGMENT_KIND.line:
        return 2 * pi * offset / instant.period
    time = time_since_start(segment, instant)
    if segment[Segment.KIND] == SEGMENT_KIND.chirp:
        return (
            segment[Segment.PHASE]
            + time * (segment[Segment.OMEGA] + 0.5 * segment[Segment.SLOPE] * time)
        ) % (2 * pi)
    return (
        segment[Segment.PHASE]
        + segment[Segment.OMEGA] * expm1(segment[Segment.SLOPE] * time) / segment[Segment.SLOPE]
    ) % (2 * pi)


@njit(**NJIT_INLINE)
def swept_frequency(segment, time):
    """Return the angular frequency [rad/s] of a sweep, given the time [s] since its start."""
    if segment[Segment.KIND] == SEGMENT_KIND.chirp:
        return segment[Segment.OMEGA] + segment[Segment.SLOPE] * time
    return segment[Segment.OMEGA] * exp(segment[Segment.SLOPE] * time)


@njit(**NJIT_INLINE)
def drive_value(segment, instant):
    """Return the drive acceleration [m s-2] of a segment at an instant.

    Parameters
    ----------
    segment : ndarray
        (12,) segment of the drive, see `Segment`.
    instant : Instant

    Returns
    -------
    float
    """
    kind = segment[Segment.KIND]
    theta = drive_phase(segment, instant)
    time = time_since_start(segment, instant)
    if kind == SEGMENT_KIND.line:
        return segment[Segment.CONSTANT] + segment[Segment.SLOPE] * time
    size = segment[Segment.AMPLITUDE]
    if segment[Segment.IS_DISPLACEMENT] == 1.0:
        omega = swept_frequency(segment, time)
        size *= omega * omega
    return segment[Segment.CONSTANT] + size * sin(theta)


@njit(**NJIT_KERNEL)
def expand_drive(segment, instant, h, top, waves):
    """Expand the drive acceleration [m s-2] of a time interval as a power series.

    The series over u = t/h is written into waves[0].

    Parameters
    ----------
    segment : ndarray
        (12,) see `Segment`.
    instant : Instant
    h : float
        Duration of the piece [s].
    top : int
        Highest power.
    waves : ndarray
        (3, >= top + 1); rows 1 and 2 are workspace.
    """
    series = waves[0]
    kind = segment[Segment.KIND]
    theta = drive_phase(segment, instant)
    if kind == SEGMENT_KIND.sine:
        angle = segment[Segment.OMEGA] * h
        series[0] = segment[Segment.AMPLITUDE] * sin(theta)
        series[1] = segment[Segment.AMPLITUDE] * cos(theta) * angle
        for k in range(2, top + 1):
            series[k] = -series[k - 2] * (angle * angle * DOUBLE_INTEGRAL_FACTORS[k])
        series[0] += segment[Segment.CONSTANT]
        return
    time = time_since_start(segment, instant)
    if kind == SEGMENT_KIND.line:
        for k in range(top + 1):
            series[k] = 0.0
        series[0] = segment[Segment.CONSTANT] + segment[Segment.SLOPE] * time
        series[1] = segment[Segment.SLOPE] * h
        return
    omega = swept_frequency(segment, time)
    expand_sweep(kind, omega, theta, segment[Segment.SLOPE] * h, h, top, waves)
    if segment[Segment.IS_DISPLACEMENT] == 1.0:
        multiply_by_squared_frequency(kind, omega, segment[Segment.SLOPE] * h, top, waves)
    for k in range(top + 1):
        series[k] *= segment[Segment.AMPLITUDE]


@njit(**NJIT_INLINE)
def expand_sweep(kind, omega, theta, slope, h, top, waves):
    """Expand the sine of the phase of a sweep as a power series.

    The series is written into waves[0].

    The series of its frequency is left in waves[2].

    The recursion is s' = phi' c and c' = -phi' s.

    Parameters
    ----------
    kind : float
        `SEGMENT_KIND.chirp` or `SEGMENT_KIND.log_chirp`.
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
        if kind == SEGMENT_KIND.log_chirp:
            rate[k] = rate[k - 1] * slope / k
        else:
            rate[k] = slope * h if k == 1 else 0.0
    for k in range(top):
        s = 0.0
        c = 0.0
        for j in range(min(k + 1, 2) if kind == SEGMENT_KIND.chirp else k + 1):
            s += rate[j] * cosine[k - j]
            c -= rate[j] * series[k - j]
        series[k + 1] = s / (k + 1)
        cosine[k + 1] = c / (k + 1)


@njit(**NJIT_INLINE)
def multiply_by_squared_frequency(kind, omega, slope, top, waves):
    """Multiply a power series of a sweep by that of its squared frequency.

    The series is waves[0].

    Parameters
    ----------
    kind, omega, slope, top, waves
        See `expand_sweep`.
    """
    series = waves[0]
    square = waves[2]
    square[0] = omega * omega
    for k in range(1, top + 1):
        square[k] = square[k - 1] * 2 * slope / k if kind == SEGMENT_KIND.log_chirp else 0.0
    if kind == SEGMENT_KIND.chirp:
        square[1] = 2 * omega * slope
        square[2] = slope * slope
    for k in range(top, -1, -1):
        total = 0.0
        for j in range(k + 1):
            total += square[j] * series[k - j]
        series[k] = total
