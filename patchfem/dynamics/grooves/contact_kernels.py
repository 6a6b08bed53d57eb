"""A contact that climbs flanks under a law along them, for the loops of `march.instances`.

Over a step of dq the path ds = int sqrt(1 + t^2) dq runs along the flank and the height rises by dz. The law acts over
ds under a normal force that goes from R0 to R1, R = V sqrt(1 + t^2) + f t, and pulls with f on the mean; then the force
against the slide is U = (V dz + f ds)/dq, which does exactly the work that height, lifted mass and law take. What rises
keeps its own speed w, dz = dt (w0 + w1)/2, so V = N + m (w1 - w0)/dt takes exactly what its kinetic energy gains.
Where the pieces give way the path ds is that of the holder. The functions are those that `march.loop_kernels` asks of
every contact; the points of the law are those of `points_kernels`.
"""

from math import cos, sin, sqrt

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ..modal_kernels import narrowed
from . import points_kernels as points

LOAD, WAVE, AMPLITUDE, PHASE, LIFTED = range(5)  # of contacts.arrays.Climbing.flank
(
    RISE,
    VERTICAL,
    LAST,
    LAST_BUT_ONE,
    LIFTS,
    PULL,
    PULL_SLOPE,
    ALONG,
    MEAN_SLOPE,
    PATH,
    HELD,
    PLACE,
    BEFORE,
    NORMAL,
) = range(14)  # of now_at
GAUSS_POINT = sqrt(0.6)  # outer points of Gauss's rule of three
STEEP = 1e-4  # radians of a groove below which sines are series


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def steep(flank, q):
    """Slope t [1] of the flank at the slide q [m]."""
    return flank[AMPLITUDE] * flank[WAVE] * np.sin(flank[WAVE] * q - flank[PHASE])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def path_over(flank, q, dq):
    """Mean of sqrt(1 + t^2), ds/dq, over the slide dq [m] from q [m], by Gauss's rule of three."""
    path = 0.0
    for k in range(-1, 2):
        t = steep(flank, q + 0.5 * dq * (1 + k * GAUSS_POINT))
        path = path + (4 / 9 if k == 0 else 5 / 18) * np.sqrt(1 + t * t)
    return path


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def over(flank, q, dq):
    """(mean slope dz/dq, mean of sqrt(1 + t^2), ds/dq) over the slide dq [m] from q [m]."""
    half = 0.5 * flank[WAVE] * dq
    middle = flank[WAVE] * (q + 0.5 * dq) - flank[PHASE]
    share = sin(half) / half if abs(half) > STEEP else 1 - half * half / 6
    return flank[AMPLITUDE] * flank[WAVE] * sin(middle) * share, path_over(flank, q, dq)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def climb(dq, q, dt, flank, at):
    """(path [m] along the flank, normal force [N] at its end without friction, slope [1] there) of a slide dq [m] in dt
    [s]; mean slope, path over slide and mean vertical force [N] go into `at`."""
    at[MEAN_SLOPE], at[PATH] = over(flank, q, dq)
    at[HELD] = flank[LOAD]
    if flank[LIFTED] > 0.0:
        at[HELD] += flank[LIFTED] * 2 * (at[MEAN_SLOPE] * dq / dt - at[RISE]) / dt
    end = steep(flank, q + dq)
    return at[PATH] * dq, max(at[HELD], 0.0) * sqrt(1 + end * end), end


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def resist(pulled, gain, middle, dt, flank, at):
    """Write the mean force against a slide, and its slope [N/m], into `at`; pulled [N], gain [N/m]: mean force along
    the flank and its slope; middle [m]: of the slide."""
    slope = at[MEAN_SLOPE]
    path = at[PATH]
    at[PULL] = at[HELD] * slope + pulled * path
    at[ALONG] = pulled
    bend = (
        0.5
        * flank[AMPLITUDE]
        * flank[WAVE]
        * flank[WAVE]
        * cos(flank[WAVE] * middle - flank[PHASE])
    )
    at[PULL_SLOPE] = (
        gain * path * path + at[HELD] * bend + 2 * flank[LIFTED] * slope * slope / (dt * dt)
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def pull(dq, q, dt, c):
    """Write the mean force over the slide dq [m] in dt [s], and what belongs to it, into c.now_at: NORMAL is then the
    normal force at its end; BEFORE is that at its start, PLACE the force of the law there."""
    ds, flat, end = climb(dq, q, dt, c.flank, c.now_at)
    pulled, gain = points.drag(ds, flat, end, dt, c)
    resist(pulled, gain, q + 0.5 * dq, dt, c.flank, c.now_at)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve(free, beta, q, v, dt, c, goal):
    """(dq [m], mean force [N], iterations) of a step with dq = free - beta force, as of `contacts.element_kernels`."""
    at = c.now_at
    low = -np.inf
    high = np.inf
    t = steep(c.flank, q)
    points.begun(c, v * sqrt(1 + t * t), dt)
    dq = 2 * at[LAST] - at[LAST_BUT_ONE]
    for count in range(1, 200):
        pull(dq, q, dt, c)
        miss = dq - free + beta * at[PULL]
        digit = 4e-16 * (abs(free) + abs(dq) + beta * abs(at[PULL]))
        if abs(miss) <= 0.01 * goal * beta + digit:
            return dq, at[PULL], count
        gain = max(1 + beta * at[PULL_SLOPE], 0.1)
        here = dq
        low, high, dq = narrowed(low, high, dq, miss, gain, count - 40)
        if high - low <= digit:
            return here, at[PULL], count if abs(miss) <= goal * beta + 8 * gain * digit else -count
    return dq, at[PULL], -200


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def given(dq, q, v, dt, c, goal):
    """(mean force [N], True) over a slide dq [m] in dt [s] that is prescribed."""
    t = steep(c.flank, q)
    points.begun(c, v * sqrt(1 + t * t), dt)
    pull(dq, q, dt, c)
    return c.now_at[PULL], True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit(dq, force, q, v0, v1, dt, c):
    """Keep the solved step of mean force [N]; (energy dissipated along the flank [J], True)."""
    at = c.now_at
    t0 = steep(c.flank, q)
    t1 = steep(c.flank, q + dq)
    v0 = v0 * sqrt(1 + t0 * t0)
    v1 = v1 * sqrt(1 + t1 * t1)
    along = (force - at[HELD] * at[MEAN_SLOPE]) / at[PATH]
    lost, fine = points.commit(at[PATH] * dq, along, v0, v1, dt, c)
    if c.flank[LIFTED] > 0.0:
        at[RISE] = 2 * at[MEAN_SLOPE] * dq / dt - at[RISE]
        at[LIFTS] = max(at[LIFTS], 0.0 if at[HELD] > 0.0 else 1.0)
    at[VERTICAL] = at[HELD]
    at[LAST_BUT_ONE] = at[LAST]
    at[LAST] = dq
    at[BEFORE] = at[NORMAL]
    at[PLACE] = points.state(c, 0.0)[0]
    return lost, fine


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state(c, q, v):
    """(force against the slide [N], energy stored in height, lifted mass and law [J], irreversible slip [m]) at the
    slide q [m] and the speed v [m/s]."""
    at = c.now_at
    t = steep(c.flank, q)
    length = sqrt(1 + t * t)
    half = sin(0.5 * (c.flank[WAVE] * q - c.flank[PHASE]))
    along, energy, kept = points.state(c, q)
    energy += (
        2 * c.flank[LOAD] * c.flank[AMPLITUDE] * half * half
        + 0.5 * c.flank[LIFTED] * at[RISE] * at[RISE]
    )
    return at[VERTICAL] * t + along * length, energy, q - (q - kept) / length
