"""The force of a flank that the load climbs, and one Runge-Kutta step of order 5 of modes under it, compiled.

The state y (2 n + 5,) holds coordinates and rates of the modes, and work of the drive, viscous loss, work of the slide,
friction's own loss along the flank, and work done against the load, int N dz [J]. The energies feed nothing and take
no part in the choice of the step.
Source of the coefficients: Dormand and Prince, J. Comp. Appl. Math. 6 (1980).
"""

from math import cos, sin, sqrt, tanh
from typing import NamedTuple

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from ..smooth.step_kernels import push

LOAD, WAVE, AMPLITUDE, PHASE, LIFTED, STATIC, KINETIC, SPEED, LEAST, LEAST_RATE, SWING, PACE, LAG = \
    range(13)  # of Climb.num
STICKS, WAY, FORCE, NORMAL, LENGTH, CREST, CREST_SPEED, RAISED = range(8)  # of Climb.flags
WORK = 5  # energies behind the modes
TRIAL, START = 7, 8  # of Climb.work, whose first rows are the slopes
PLACES = np.array([0.0, 0.2, 0.3, 0.8, 8 / 9, 1.0, 1.0])  # of the stages in the step
SHARES = np.zeros((7, 7))  # of the slopes before it in every stage; row 6 is the step itself
SHARES[1, :1] = [1 / 5]
SHARES[2, :2] = [3 / 40, 9 / 40]
SHARES[3, :3] = [44 / 45, -56 / 15, 32 / 9]
SHARES[4, :4] = [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729]
SHARES[5, :5] = [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656]
SHARES[6, :6] = [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84]
MISSED = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])  # order 5 less 4


class Climb(NamedTuple):
    """A motion over grooves as the compiled loops see it.

    omega, damp, slide, base, output (n,), damping (n, n) or (0, 0), and mass (1,) [kg] of the modes; pieces and now
    (14,): the drive, as `smooth.step_kernels.push` takes it; num (13,): load [N], wave number [rad/m], amplitude
    [m], phase [rad], lifted mass [kg], mu_s, mu_k, speed v_0 [m/s] of a law of the speed, 0 of Coulomb's, sizes of
    coordinates [m] and rates [m/s] below which they are at rest, and of the load amplitude [N], pace [rad/s] and phase
    [rad] of its swing. flags (8,): 1 where it sticks, the way of the slide, force [N] and vertical force [N] at the
    last sample, length [s] of the next step, largest coordinate and rate, work done against a load that swings [J].
    work (9, 2 n + 5): slopes of the stages, the state tried and that at the start.
    """

    omega: np.ndarray
    damp: np.ndarray
    slide: np.ndarray
    base: np.ndarray
    output: np.ndarray
    damping: np.ndarray
    mass: np.ndarray
    pieces: np.ndarray
    now: np.ndarray
    num: np.ndarray
    flags: np.ndarray
    work: np.ndarray


@njit(error_model="numpy", **LEAN)
def flank(num, q):
    """(slope t of the flank [1], its rate t' over the slide [1/m]) at the slide q [m]."""
    steep, turn = num[AMPLITUDE] * num[WAVE], num[WAVE] * q - num[PHASE]
    return steep * sin(turn), steep * num[WAVE] * cos(turn)


@njit(error_model="numpy", **LEAN)
def loaded(num, time):
    """Load [N] at a time [s]."""
    return num[LOAD] + num[SWING] * cos(num[PACE] * time + num[LAG]) if num[SWING] != 0.0 else num[LOAD]


@njit(error_model="numpy", **LEAN)
def stored(m, q, v):
    """Energy [J] of the load's height, or what was done against a load that swings, and of the mass that rises."""
    num = m.num
    turn = sin(0.5 * (num[WAVE] * q - num[PHASE]))
    rise = flank(num, q)[0] * v
    height = m.flags[RAISED] if num[SWING] != 0.0 else 2 * num[LOAD] * num[AMPLITUDE] * turn * turn
    return height + 0.5 * num[LIFTED] * rise * rise


@njit(error_model="numpy", **LEAN)
def holds(num, q, time):
    """Smallest and largest force [N] with which the flank at q [m] holds at rest at a time [s]."""
    t, mu, load = flank(num, q)[0], num[STATIC], loaded(num, time)
    return load * (t - mu) / (1 + mu * t), load * (t + mu) / (1 - mu * t)


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def slide_of(m, y):
    """(slide [m], its speed [m/s]) of a state."""
    q, v, n = 0.0, 0.0, m.slide.size
    for i in range(n):
        q += m.slide[i] * y[i]
        v += m.slide[i] * y[n + i]
    return q, v


@njit(error_model="numpy", **LEAN)
def slope(m, t, y, out):
    """Write the slopes of the state y at the time t [s] into out; (force F against the slide, vertical force V) [N].

    With the slide's acceleration q'' = a - F s, a without the force, s [1/kg] per newton, V = N + m_l (t q'' + t' q'^2)
    and F = V c are linear in F, c = (t + phi)/(1 - phi t): F (1 + m_l t c s) = c (N + m_l (t' q'^2 + t a)).
    """
    n, drive, coupled = m.slide.size, push(m, t), m.damping.size > 0
    (q, v), num, mass, energies = slide_of(m, y), m.num, m.mass[0], 2 * m.slide.size
    work, lost, free, share = 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        rate = y[n + i]
        damped = m.damp[i] * rate
        if coupled:
            damped = 0.0
            for j in range(n):
                damped += m.damping[i, j] * y[n + j]
        out[i] = rate
        out[n + i] = -damped - m.omega[i] * m.omega[i] * y[i] - m.base[i] * drive
        free += m.slide[i] * out[n + i]
        share += m.slide[i] * m.slide[i] / mass
        work -= m.base[i] * rate
        lost += damped * rate
    steep, bend = flank(num, q)
    load = loaded(num, t)
    normal = load
    if m.flags[STICKS] == 1.0:
        force, own = free / share, 0.0
    else:
        phi = m.flags[WAY] * num[KINETIC]
        if num[SPEED] > 0:
            phi = num[STATIC] * tanh(sqrt(1 + steep * steep) * v / num[SPEED])
        ratio = (steep + phi) / (1 - phi * steep)
        force = ratio * (normal + num[LIFTED] * (bend * v * v + steep * free)) \
            / (1 + num[LIFTED] * steep * ratio * share)
        normal += num[LIFTED] * (steep * (free - share * force) + bend * v * v)
        own = phi * (1 + steep * steep) / (1 - phi * steep) * normal * v
    for i in range(n):
        out[n + i] -= m.slide[i] * force / mass
    out[energies], out[energies + 1] = mass * drive * work, mass * lost
    out[energies + 2], out[energies + 3], out[energies + 4] = force * v, own, load * steep * v
    return force, normal


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def step(m, t, y, h):
    """Write the state after a step of h [s] from y at the time t [s] into m.work[TRIAL], and its slopes into m.work[6];
    m.work[0] holds the slopes at the start."""
    size = y.size
    for stage in range(1, 7):
        for c in range(size):
            part = 0.0
            for j in range(stage):
                part += SHARES[stage, j] * m.work[j, c]
            m.work[TRIAL, c] = y[c] + h * part
        slope(m, t + PLACES[stage] * h, m.work[TRIAL], m.work[stage])


@njit(error_model="numpy", **LEAN)
def missed(m, y, h, tolerance):
    """Estimate of the error of the step of h [s] from y, over what the tolerance allows: coordinates relative to the
    largest of late, rates to the fastest."""
    n, out = m.slide.size, 0.0
    crest, fast = max(m.flags[CREST], m.num[LEAST]), max(m.flags[CREST_SPEED], m.num[LEAST_RATE])
    for c in range(2 * n):
        part = 0.0
        for j in range(7):
            part += MISSED[j] * m.work[j, c]
        size = max(crest if c < n else fast, abs(m.work[TRIAL, c]))
        out = max(out, abs(h * part) / size)
    return out / tolerance if np.isfinite(out) else np.inf
