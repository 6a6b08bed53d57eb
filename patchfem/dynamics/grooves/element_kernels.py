"""A contact that climbs flanks under a law of constant load along them, for the loops of `march.hub`.

The law is that of a contact under the load N of the scene; under another normal force R it has R/N of its elements or
bristles. Those that a falling force lays off take their stretch with them, and those that a rising one brings come
without any, so that a force that only rises leaves the friction as it is: the stretch of all becomes R0/R1 of itself.
Either loses some of the energy stored, R k z^2/(2 N), and neither gives any. Path, height, lifted mass and the books of
a step are those of `contact_kernels`: half of the change of the normal force, the slide, the other half.
"""

from math import sqrt

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from ...friction.laws import lugre_kernels as law
from ..modal_kernels import narrowed
from .contact_kernels import (
    BEFORE,
    HELD,
    LAST,
    LAST_BUT_ONE,
    LIFTED,
    LIFTS,
    LOAD,
    MEAN_SLOPE,
    NORMAL,
    PATH,
    PLACE,
    PULL,
    PULL_SLOPE,
    RISE,
    VERTICAL,
    climb,
    of_height,
    raised,
    resist,
    steep,
)

__all__ = ["commit", "given", "solve", "state"]


@njit(error_model="numpy", **LEAN)
def pressed(c, memory, r0, r1, out):
    """Write the memory under the normal force r1 [N], from that under r0 [N], into out; the energy lost [J]."""
    kept = r0 / r1 if r1 > r0 else 1.0
    for k in range(memory.shape[1]):
        out[0, k] = kept * memory[0, k]
    energy = law.state(c.num, memory, 0, 0.0, 0.0)[1] / c.flank[LOAD]
    if memory.shape[1] > 1:  # of elements side by side the second number is their energy
        out[0, 1] *= kept
    return energy * (r0 * (1 - kept) if r1 > r0 else r0 - r1)


@njit(error_model="numpy", **LEAN)
def drag(ds, flat, end, dt, c):
    """(mean force [N] along the flank over the path ds [m] in dt [s], its slope [N/m]); c.now_at[NORMAL] becomes the
    normal force flat + f end at the end, on a slope `end`, where f is the force there."""
    at, close, load = c.now_at, 1e-14 * c.flank[LOAD], c.flank[LOAD]
    pulled, gain, tried, missed = 0.0, 0.0, 0.0, 0.0
    for count in range(60):
        before = at[NORMAL]
        mean = 0.5 * (at[BEFORE] + before)
        pressed(c, c.mem, at[BEFORE], mean, c.tried)
        pulled, gain = law.mean(c.num, c.tried, 0, 0.0, ds, 0.0, dt)
        pulled, gain = mean / load * pulled, mean / load * gain
        bound = c.bound[0] * before / load
        now = max(flat + min(max(2 * pulled - at[PLACE], -bound), bound) * end, 0.0)
        miss = now - before
        if abs(miss) <= close:
            at[NORMAL] = now
            break
        if count > 0 and abs(missed - miss) > 0.1 * abs(before - tried):
            now = max(before - miss * (before - tried) / (miss - missed), 0.0)
        at[NORMAL], tried, missed = now, before, miss
    return pulled, gain


@njit(error_model="numpy", **LEAN)
def pull(dq, q, dt, c):
    """Write the mean force over the slide dq [m] in dt [s], and what belongs to it, into c.now_at, as
    `contact_kernels.pull`."""
    ds, flat, end = climb(dq, q, dt, c.flank, c.now_at)
    pulled, gain = drag(ds, flat, end, dt, c)
    resist(pulled, gain, q + 0.5 * dq, dt, c.flank, c.now_at)


@njit(error_model="numpy", **LEAN)
def solve(free, beta, q, v, dt, c, goal):
    """(dq [m], mean force [N], iterations) of a step with dq = free - beta force, as of `contacts.element_kernels`."""
    at, low, high = c.now_at, -np.inf, np.inf
    dq = 2 * at[LAST] - at[LAST_BUT_ONE]
    for count in range(1, 200):
        pull(dq, q, dt, c)
        miss = dq - free + beta * at[PULL]
        digit = 4e-16 * (abs(free) + abs(dq) + beta * abs(at[PULL]))
        if abs(miss) <= 0.01 * goal * beta + digit:
            return dq, at[PULL], count
        gain, here = max(1 + beta * at[PULL_SLOPE], 0.1), dq
        low, high, dq = narrowed(low, high, dq, miss, gain, count - 40)
        if high - low <= digit:
            return here, at[PULL], count if abs(miss) <= goal * beta + 8 * gain * digit else -count
    return dq, at[PULL], -200


@njit(error_model="numpy", **LEAN)
def given(dq, q, v, dt, c, goal):
    """(mean force [N], True) over a slide dq [m] in dt [s] that is prescribed."""
    pull(dq, q, dt, c)
    return c.now_at[PULL], True


@njit(error_model="numpy", **LEAN)
def commit(dq, force, q, v0, v1, dt, c):
    """Keep the solved step of mean force [N]; (energy dissipated along the flank [J], True)."""
    at, load = c.now_at, c.flank[LOAD]
    t0, t1 = steep(c.flank, q), steep(c.flank, q + dq)
    v0, v1 = v0 * sqrt(1 + t0 * t0), v1 * sqrt(1 + t1 * t1)
    along, mean = (force - at[HELD] * at[MEAN_SLOPE]) / at[PATH], 0.5 * (at[BEFORE] + at[NORMAL])
    lost = pressed(c, c.mem, at[BEFORE], mean, c.tried)
    if mean > 0.0:
        part = mean / load
        lost += part * law.commit(c.num, c.tried, 0, at[PATH] * dq, along / part, v0, v1, dt, 0.0)
    lost += pressed(c, c.tried, mean, at[NORMAL], c.mem)
    if c.flank[LIFTED] > 0.0:
        at[RISE] = 2 * at[MEAN_SLOPE] * dq / dt - at[RISE]
        at[LIFTS] = max(at[LIFTS], 0.0 if at[HELD] > 0.0 else 1.0)
    raised(dq, dt, c.flank, at)
    at[BEFORE] = at[NORMAL]
    at[PLACE] = at[NORMAL] / load * law.state(c.num, c.mem, 0, 0.0, v1)[0]
    return lost, True


@njit(error_model="numpy", **LEAN)
def state(c, q, v):
    """(force against the slide [N], energy stored in height, lifted mass and law [J], irreversible slip [m]) at the
    slide q [m] and the speed v [m/s]."""
    flank, at, t = c.flank, c.now_at, steep(c.flank, q)
    length, part = sqrt(1 + t * t), at[NORMAL] / flank[LOAD]
    along, energy, kept = law.state(c.num, c.mem, 0, q, v * length)
    energy = part * energy + of_height(c, q) + 0.5 * flank[LIFTED] * at[RISE] * at[RISE]
    return at[VERTICAL] * t + part * along * length, energy, q - (q - kept) / length
