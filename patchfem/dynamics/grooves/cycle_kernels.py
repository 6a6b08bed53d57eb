"""Elastic-plastic elements along flanks over one cycle of a slide that repeats, and their derivatives, compiled.

y is the force along the flank over mu, R the normal force, s the load of the springs that stand, P = sqrt(1 + t^2). A
step over the path ds takes y to y + ds/eps max(s, mean of R), or to the limit +-R; R = P V + mu t y at its end makes
either a closed form. The law is that of `contacts.pressed_points_kernels`, kind PLASTIC. Derivatives of a step are
taken by an imaginary part of 1e-30, which leaves no difference to lose digits.
"""

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from .contact_kernels import LOAD, path_over, steep

LEAD = 32  # steps from rest to the first sample
MU, LENGTH = 4, 5  # of num, which begins as Climbing.flank does
PART = 1e-30  # imaginary, of a number whose derivative is wanted


@njit(error_model="numpy", **LEAN)
def shifted(num, y0, s0, r0, q0, q1, vertical):
    """(y, s, R) [N] after the slide from q0 to q1 [m], where the flank carries `vertical` [N]; all real, or complex."""
    mu, t, e = num[MU], steep(num, q1), path_over(num, q0, q1 - q0) * (q1 - q0) / num[LENGTH]
    flat = np.sqrt(1 + t * t) * (vertical if vertical.real > 0.0 else 0.0 * vertical)
    y1, s1 = y0 + s0 * e, s0
    half = 0.5 * (r0 + flat + mu * t * y1)
    if half.real > s0.real:  # springs are added on the way
        y1 = (y0 + 0.5 * (r0 + flat) * e) / (1 - 0.5 * mu * t * e)
        s1 = 0.5 * (r0 + flat + mu * t * y1)
    r1 = flat + mu * t * y1
    if abs(y1.real) <= r1.real:
        return y1, (s1 if s1.real > r1.real else r1), r1
    way = 1.0 if y1.real > 0 else -1.0
    r1 = flat / (1 - way * mu * t)
    y1 = way * r1
    if s1.real > r1.real:  # what is above the load goes with the path that slips
        slid = way * e - way * (y1 - y0) / s1
        s1 = r1 + (s1 - r1) * np.exp(-slid) if slid.real > 0.0 else s1
    else:
        s1 = r1
    return y1, (s1 if r1.real > 0.0 else 0.0 * s1), r1


@njit(error_model="numpy", **LEAN)
def noted(num, state, q0, q1, vertical, by):
    """Write the derivatives (3, 6) of (y, s, R) after a step to (y, s, R) before it, q0, q1 and `vertical` into by."""
    for k in range(6):
        d = 1j * PART
        y, s, r = shifted(num, state[0] + d * (k == 0), state[1] + d * (k == 1), state[2] + d * (k == 2),
                          q0 + d * (k == 3), q1 + d * (k == 4), vertical + d * (k == 5))
        by[0, k], by[1, k], by[2, k] = y.imag / PART, s.imag / PART, r.imag / PART


@njit(error_model="numpy", **LEAN)
def step(num, state, q0, q1, vertical):
    """Move state (3,), y, s and R [N]."""
    y, s, r = shifted(num, state[0], state[1], state[2], q0, q1, vertical)
    state[0], state[1], state[2] = y, s, r


@njit(error_model="numpy", **LEAN)
def rest(num, state):
    """The state (3,) of a contact at rest at the slide 0."""
    t = steep(num, 0.0)
    state[0], state[1], state[2] = 0.0, num[LOAD] * np.sqrt(1 + t * t), num[LOAD] * np.sqrt(1 + t * t)


@njit(error_model="numpy", cache=True, **LEAN)
def cycle(num, q, vertical, states, most, goal, state):
    """Slide along the samples q (N,) [m] of a cycle under the vertical force (N,) [N] until the force along the flank
    repeats to `goal` [N], `most` times at most: the cycles that it took.

    num: load [N], wave number [rad/m], amplitude [m], phase of the grooves, mu, length [m]; states (N + 1, 3): y, s and
    R [N] at the samples, the last row at the start of the last cycle; state (3,): room. It starts at rest at the slide
    0. 0.1 us per sample and cycle.
    """
    n, first, grows = q.size, q[0] / LEAD, (vertical[0] - num[LOAD]) / LEAD
    rest(num, state)
    for i in range(LEAD):
        step(num, state, i * first, (i + 1) * first, num[LOAD] + (i + 1) * grows)
    for turn in range(most):
        change = 0.0
        for c in range(3):
            states[n, c] = state[c]
        for i in range(n):
            j = i + 1 if i < n - 1 else 0
            step(num, state, q[i], q[j], vertical[j])
            change = max(change, num[MU] * abs(state[0] - states[j, 0])) if turn > 0 else goal + 1.0
            for c in range(3):
                states[j, c] = state[c]
        if change <= goal:
            return turn + 1
    return most


@njit(error_model="numpy", **LEAN)
def varied(by, share0, share1, slide0, slide1, vertical, here, grown):
    """Move derivatives here (3, p) of y, s and R over a step by its derivatives by (3, 6), and by shares of those of
    the slides at its ends and of the vertical force (p,); grown (3, p): room."""
    for c in range(3):
        a, b, d, e, f, g = by[c, 0], by[c, 1], by[c, 2], by[c, 3] * share0, by[c, 4] * share1, by[c, 5] * share1
        for k in range(here.shape[1]):
            grown[c, k] = a * here[0, k] + b * here[1, k] + d * here[2, k] + e * slide0[k] + f * slide1[k] \
                + g * vertical[k]
    for c in range(3):
        for k in range(here.shape[1]):
            here[c, k] = grown[c, k]


@njit(error_model="numpy", cache=True, **LEAN)
def tangents(num, q, vertical, states, turns, by_slide, by_vertical, by, state, here, grown, out):
    """Derivatives out (N, p) [N] of y at the samples to p parameters, from those of q, by_slide (N, p) [m], and of the
    vertical force, by_vertical (N, p) [N]; num, q, vertical and states as of `cycle`, which took `turns` cycles.

    by (N, 3, 6), state (3,), here, grown (3, p): room. 1 us per sample, and 5 ns per sample, turn and parameter.
    """
    n, first, grows = q.size, q[0] / LEAD, (vertical[0] - num[LOAD]) / LEAD
    for c in range(3):
        for k in range(here.shape[1]):
            here[c, k] = 0.0
    rest(num, state)
    for i in range(LEAD):
        noted(num, state, i * first, (i + 1) * first, num[LOAD] + (i + 1) * grows, by[0])
        step(num, state, i * first, (i + 1) * first, num[LOAD] + (i + 1) * grows)
        varied(by[0], i / LEAD, (i + 1) / LEAD, by_slide[0], by_slide[0], by_vertical[0], here, grown)
    for i in range(n):
        j = i + 1 if i < n - 1 else 0
        noted(num, states[i if i else n], q[i], q[j], vertical[j], by[i])
    for _ in range(turns):
        for i in range(n):
            j = i + 1 if i < n - 1 else 0
            varied(by[i], 1.0, 1.0, by_slide[i], by_slide[j], by_vertical[j], here, grown)
            for k in range(here.shape[1]):
                out[j, k] = here[0, k]
