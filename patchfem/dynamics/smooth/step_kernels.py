"""One Runge-Kutta step of order 8 of the modes, the states of a law and the energies that pass, and its extension.

The state y (n + n + l + 3,) holds coordinates and rates of the modes, the states of the law, and work of the drive,
viscous loss and friction work [J]. The energies feed nothing and take no part in the choice of the step. The text runs
with any law that offers its rates (`friction.protocol`).
"""

from math import sqrt

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_INTERNAL
from ...friction.laws import stretch_kernels as law
from ..events.drive_kernels import value_now
from ..tableau_kernels import BEFORE, FIFTH, INSIDE, PLACES, SHARES, STAGES, THIRD
from .arrays import CREST, CREST_SPEED, DRIVEN, EASE, FREE, MASS, ORIGIN, PIECE, PLACE, STIFF, TIME

OMEGA, DAMP, SLIDE, BASE, OUTPUT = range(5)  # of Moving.rows
# of Moving.work, whose first rows are the slopes
EXTENSION = 16
SIZES = 24
TRIAL = 25
LEAST = 1e-30  # of a size: at rest everything is as large as this
NOISE = 2e-15  # of the forces of a mode's stiffness and of the law's: round-off of the acceleration where they balance


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def push(m, t):
    """Drive [m s-2] at the time t [s], by the numbers of its piece as it stands, continued beyond its ends."""
    return value_now(m.pieces[int(m.now[PIECE])], 0.0, t, m.now[DRIVEN])


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def slide_of(m, y):
    """(slide [m], its speed [m/s]) of a state."""
    n = m.rows.shape[1]
    q = m.rows[SLIDE, 0] * y[0]
    v = m.rows[SLIDE, 0] * y[n]
    for i in range(1, n):
        q += m.rows[SLIDE, i] * y[i]
        v += m.rows[SLIDE, i] * y[n + i]
    return q, v


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def of_mode(m, i, y, out, drive, pull):
    """Write the slopes of a mode into out; (power of the drive, viscous power) [m2 s-3]; pull: force/mass [m s-2]."""
    n = m.rows.shape[1]
    rate = y[m.rows.shape[1] + i]
    damped = m.rows[DAMP, i] * rate
    if m.damping.size > 0:
        damped = 0.0
        for j in range(n):
            damped += m.damping[i, j] * y[n + j]
    out[i] = rate
    out[n + i] = (
        -damped
        - (m.rows[OMEGA, i] * m.rows[OMEGA, i] * y[i] + m.rows[SLIDE, i] * pull)
        - m.rows[BASE, i] * drive
    )
    return -m.rows[BASE, i] * rate, damped * rate


@njit(error_model="numpy", **NJIT_INTERNAL)
def offered(m, q, y, drive):
    """Write what a law that holds has to know into m.turn: acceleration [m s-2] that the slide has without the force
    and what a newton takes of it [1/kg], slide [m]."""
    n = m.rows.shape[1]
    free = 0.0
    ease = 0.0
    for i in range(n):
        damped = m.rows[DAMP, i] * y[n + i]
        if m.damping.size > 0:
            damped = 0.0
            for j in range(n):
                damped += m.damping[i, j] * y[n + j]
        free -= m.rows[SLIDE, i] * (
            damped + m.rows[OMEGA, i] * m.rows[OMEGA, i] * y[i] + m.rows[BASE, i] * drive
        )
        ease += m.rows[SLIDE, i] * m.rows[SLIDE, i] / m.now[MASS]
    m.turn[FREE] = free
    m.turn[EASE] = ease
    m.turn[PLACE] = q


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def slope(m, t, y, out):
    """Write the slopes of the state y at the time t [s] into out: eq. 3.4 and the rates of the law.

    The first mode stands before the loop over the others, which a machine sets out to take several at a time: with one
    mode that is 16 ns for 53.
    """
    n = m.rows.shape[1]
    energies = y.size - 3
    drive = push(m, t)
    mass = m.now[MASS]
    q, v = slide_of(m, y)
    if law.IS_SET_VALUED:
        offered(m, q, y, drive)
    force = law.state_rates(
        m.num[0], m.mem[0], m.turn, q - m.now[ORIGIN], v, y[2 * n : energies], out[2 * n : energies]
    )
    work, lost = of_mode(m, 0, y, out, drive, force / mass)
    for i in range(1, n):
        more, other = of_mode(m, i, y, out, drive, force / mass)
        work = work + more
        lost = lost + other
    out[energies] = mass * drive * work
    out[energies + 1] = mass * lost
    out[energies + 2] = force * v


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_INTERNAL)
def gathered(m, stage, h, size):
    """Write the state at a stage of a step of h [s] into m.work[TRIAL], its first `size` entries."""
    first = SHARES[stage, 0]
    share = SHARES[stage]
    for c in range(size):
        part = first * m.work[0, c]
        for j in range(BEFORE[stage], stage):
            part += share[j] * m.work[j, c]
        m.work[TRIAL, c] = m.y[c] + h * part


@njit(error_model="numpy", **NJIT_INTERNAL)
def step(m, h):
    """Write the state after a step of h [s] into m.work[TRIAL], with the slopes on the way; m.work[0] is that at the
    start."""
    t = m.now[TIME]
    size = m.y.size
    last = m.work.shape[0] - 14
    for stage in range(1, last + 1):
        gathered(m, stage, h, size if stage == last else size - 3)
        slope(m, t + PLACES[stage] * h, m.work[TRIAL], m.work[stage])


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def missed(m, h, tolerance):
    """Estimate of the error of a step of h [s] over what the tolerance allows, by its estimates of order 5 and 3.

    Coordinates count relative to the largest of late, rates to the fastest, states of the law to their sizes. A rate
    counts no less than what the step makes of round-off: held at a distance, it decays to that, and it is no error.
    """
    n = m.rows.shape[1]
    size = m.y.size - 3
    fifth = 0.0
    third = 0.0
    pull = m.now[STIFF] * abs(slide_of(m, m.y)[0]) / m.now[MASS]
    for c in range(size):
        scale = m.now[CREST] if c < n else m.now[CREST_SPEED] if c < 2 * n else m.work[SIZES, c]
        high = 0.0
        low = 0.0
        for j in range(12):
            high += FIFTH[j] * m.work[j, c]
            low += THIRD[j] * m.work[j, c]
        top = max(abs(m.y[c]), abs(m.work[TRIAL, c]), m.work[SIZES, c]) if c < 2 * n else 0.0
        if n <= c < 2 * n:
            force_size = (
                abs(m.y[c - n]) * m.rows[OMEGA, c - n] ** 2 + abs(m.rows[SLIDE, c - n]) * pull
            )
            top = max(top, NOISE * abs(h) * force_size / tolerance)
        scale = max(scale, top, LEAST)
        fifth += (high / scale) ** 2
        third += (low / scale) ** 2
    if not np.isfinite(fifth):
        return np.inf
    if fifth == 0 and third == 0:
        return 0.0
    return abs(h) * fifth / sqrt((fifth + 0.01 * third) * size) / tolerance


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_INTERNAL)
def extended(m, h):
    """Write the extension of a step of h [s], taken by `step`, beside the slopes; the state at its end stays."""
    t = m.now[TIME]
    size = m.y.size
    for c in range(size):  # the stages overwrite it
        m.work[EXTENSION + 7, c] = m.work[TRIAL, c]
    for stage in range(13, STAGES):
        gathered(m, stage, h, size - 3)
        slope(m, t + PLACES[stage] * h, m.work[TRIAL], m.work[stage])
    for c in range(size):
        m.work[TRIAL, c] = m.work[EXTENSION + 7, c]
        rise = m.work[TRIAL, c] - m.y[c]
        m.work[EXTENSION, c] = rise
        m.work[EXTENSION + 1, c] = h * m.work[0, c] - rise
        m.work[EXTENSION + 2, c] = 2 * rise - h * (m.work[12, c] + m.work[0, c])
        for k in range(4):
            part = INSIDE[k, 0] * m.work[0, c]
            for j in range(5, STAGES):
                part += INSIDE[k, j] * m.work[j, c]
            m.work[EXTENSION + 3 + k, c] = h * part


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_INTERNAL)
def between(m, share, out, size):
    """Write the first `size` entries of the state at a share [1] of the step into out, by its extension."""
    for c in range(size):
        value = m.work[EXTENSION + 6, c] * share
        for k in range(5, -1, -1):
            value = (value + m.work[EXTENSION + k, c]) * (share if k % 2 == 0 else 1 - share)
        out[c] = m.y[c] + value
