"""Climb of a port on the flanks of grooves z(q), whose points rub along the flank (compiled).

Over an increment dq of the port the points slide by ds = int sqrt(1 + t^2) dq along the flank, t = dz/dq, and the height
rises by dz. With the vertical force V = N + m (w1 - w0)/dt of the load and of a lifted mass m, whose vertical velocity
obeys dz = dt (w0 + w1)/2, and the friction force f along the flank, the force of the port is U = (V dz + f ds)/dq, which
does exactly the work of height, lifted mass and law. The normal force at the end is V sqrt(1 + t^2) + f t.
"""

from math import cos, sin, sqrt

from ..kernel_cache.flags_kernels import NJIT_CALL
from ..kernel_cache.jit import njit
from .march_rows_kernels import Flank, Port, Sample

GAUSS_POINT = sqrt(0.6)  # outer node of the Gauss rule of three points
MIN_PHASE = 1e-4  # phase [rad] below which a series replaces sin(x)/x


@njit(**NJIT_CALL)
def find_slope(flank, q):
    """Return the slope dz/dq at a slide q [m]."""
    wave = flank[Flank.WAVE_NUMBER]
    return flank[Flank.AMPLITUDE] * wave * sin(wave * q - flank[Flank.PHASE])


@njit(**NJIT_CALL)
def climb(flank, q, dq, dt):
    """Write SLOPE, RATIO and TRIAL_VERTICAL of a trial increment dq [m] from the slide q [m] to the flank.

    They are the means dz/dq and ds/dq over the increment, and the vertical force V [N]; the mean rise speed over the step is
    dz/dt, so that the speed of the lifted mass at its end is twice this less that at the start.

    Parameters
    ----------
    flank : (k,) array
        Numbers of the flanks, in the rows of `march_rows_kernels.Flank`.
    q : float
        Slide [m].
    dq : float
        Increment of the slide [m].
    dt : float
        Duration of the step [s].
    """
    wave = flank[Flank.WAVE_NUMBER]
    half = 0.5 * wave * dq
    ratio = sin(half) / half if abs(half) > MIN_PHASE else 1 - half * half / 6
    middle = wave * (q + 0.5 * dq) - flank[Flank.PHASE]
    flank[Flank.SLOPE] = flank[Flank.AMPLITUDE] * wave * sin(middle) * ratio
    path = 0.0
    for k in range(-1, 2):
        t = find_slope(flank, q + 0.5 * dq * (1 + k * GAUSS_POINT))
        path += (4 / 9 if k == 0 else 5 / 18) * sqrt(1 + t * t)
    flank[Flank.RATIO] = path
    rise = flank[Flank.SLOPE] * dq / dt - flank[Flank.RISE_SPEED]
    load = flank[Flank.LOAD] + flank[Flank.ADDED]
    flank[Flank.TRIAL_VERTICAL] = load + 2 * flank[Flank.LIFTED_MASS] * rise / dt


@njit(**NJIT_CALL)
def find_stiffness(flank, q, dq, dt):
    """Return the derivative of the mean climbing force V dz/dq by the increment [N/m].

    Parameters
    ----------
    flank : (k,) array
        Numbers of the flanks, in the rows of `march_rows_kernels.Flank`.
    q : float
        Slide [m].
    dq : float
        Increment of the slide [m].
    dt : float
        Duration of the step [s].
    """
    wave = flank[Flank.WAVE_NUMBER]
    phase = wave * (q + 0.5 * dq) - flank[Flank.PHASE]
    curvature = 0.5 * flank[Flank.AMPLITUDE] * wave * wave * cos(phase)
    inertia = 2 * flank[Flank.LIFTED_MASS] * flank[Flank.SLOPE] ** 2 / (dt * dt)
    return flank[Flank.TRIAL_VERTICAL] * curvature + inertia


@njit(**NJIT_CALL)
def add_climb(flank, moves, dq, dt, end):
    """Write force and slope of the port that climbs, from those of its points along the flank.

    F = V t + r f and dF/dq = K + r^2 df/ds, with the ratio r of path to displacement.

    Parameters
    ----------
    flank : (k,) array
        Numbers of the flanks, in the rows of `march_rows_kernels.Flank`; TRIAL_FORCE becomes `end`.
    moves : (k, p) array
        Values of the ports, in the rows of `march_rows_kernels.Port`.
    dq : float
        Increment of the slide [m].
    dt : float
        Duration of the step [s].
    end : float
        Force along the flank at the end of the step [N].
    """
    flank[Flank.TRIAL_FORCE] = end
    ratio = flank[Flank.RATIO]
    stiffness = find_stiffness(flank, moves[Port.SLIDE, 0], dq, dt)
    moves[Port.SUM, 0] = (
        flank[Flank.TRIAL_VERTICAL] * flank[Flank.SLOPE] + ratio * moves[Port.SUM, 0]
    )
    moves[Port.BY_SLIDE, 0] = stiffness + ratio * ratio * moves[Port.BY_SLIDE, 0]


@njit(**NJIT_CALL)
def find_normal(flank, q):
    """Return the normal force [N] at a slide q [m] under the vertical force and the friction of the trial step."""
    t = find_slope(flank, q)
    vertical = max(flank[Flank.TRIAL_VERTICAL] + flank[Flank.RISE], 0.0)
    return max(vertical * sqrt(1 + t * t) + flank[Flank.TRIAL_FORCE] * t, 0.0)


@njit(**NJIT_CALL)
def find_energy(flank, q):
    """Return the energy [J] of the lifted mass at a slide q, and the work done on the load since height 0."""
    half = sin(0.5 * (flank[Flank.WAVE_NUMBER] * q - flank[Flank.PHASE]))
    height = 2 * flank[Flank.AMPLITUDE] * half * half
    kinetic = 0.5 * flank[Flank.LIFTED_MASS] * flank[Flank.RISE_SPEED] ** 2
    return flank[Flank.LOAD] * height + flank[Flank.ADDED_WORK] + kinetic


@njit(**NJIT_CALL)
def accept_climb(flank, dq, dt):
    """Advance the lifted mass and the work on the load over an accepted step.

    The mean of its rise speed over the step is slope dq/dt.

    Parameters
    ----------
    flank : (k,) array
        Numbers of the flanks, in the rows of `march_rows_kernels.Flank`.
    dq : float
        Increment of the slide [m].
    dt : float
        Duration of the step [s].
    """
    rise = 2 * flank[Flank.SLOPE] * dq / dt
    flank[Flank.RISE_SPEED] = rise - flank[Flank.RISE_SPEED]
    flank[Flank.VERTICAL] = flank[Flank.TRIAL_VERTICAL] + flank[Flank.RISE]
    flank[Flank.ADDED_WORK] += flank[Flank.ADDED] * flank[Flank.SLOPE] * dq
    if flank[Flank.LIFTED_MASS] > 0 and not flank[Flank.VERTICAL] > 0:
        flank[Flank.HAS_LIFTED] = 1.0


@njit(**NJIT_CALL)
def write_sample(flank, q, path, sample, size):
    """Write force, slip, load and the energy of the flank to a sample that has those of the points.

    The points know the path along the flank; the slip is the displacement less the stretch along it. The force of the port
    is V t + f sqrt(1 + t^2), with the vertical force V and the friction f along the flank.

    Parameters
    ----------
    flank : (k,) array
        Numbers of the flanks, in the rows of `march_rows_kernels.Flank`.
    q : float
        Slide [m].
    path : float
        Displacement of the point along the flank [m].
    sample : (k,) array
        Sample, in the rows of `march_rows_kernels.Sample`; output.
    size : int
        Number of modal coordinates and velocities, the first columns.
    """
    first = size + Sample.PORTS
    t = find_slope(flank, q)
    length = sqrt(1 + t * t)
    stretch = path - sample[first + 1]
    sample[first] = flank[Flank.VERTICAL] * t + sample[first] * length
    sample[first + 1] = q - stretch / length
    sample[size + Sample.LOAD] = flank[Flank.VERTICAL]
    sample[size + Sample.ENERGY] += find_energy(flank, q)
