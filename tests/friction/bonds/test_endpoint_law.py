"""The comparison the march is measured against: the law at the end of a step, its force linear in between (3.10)."""

import numpy as np
from scipy.optimize import brentq

from patchfem.friction.bonds.point_kernels import bond_mean, bond_step

OMEGA, LIMIT, EPS = 2 * np.pi * 143.0, 39.24, 2e-6  # rad/s, m/s2 (4 g), m
K_T = LIMIT / EPS


def force_after(state, dq):
    return LIMIT / EPS * bond_step(*state, dq, 1.0, EPS)[1]


def free_decay(per_cycle, count, linear):
    """Energies (count + 1,) of an undamped mode released at 100 um: friction linear over the step between the values
    of the law at its ends, or constant at the law's path mean."""
    dt = 2 * np.pi / OMEGA / per_cycle
    c, s = np.cos(OMEGA * dt), np.sin(OMEGA * dt)
    q, v, state = 100e-6, 0.0, (1.0, 0.0, 0.0)
    old, out = 0.0, []
    # displacement and speed at the end under a unit force: constant, and rising from 0 to 1
    flat = np.array([(1 - c) / OMEGA**2, s / OMEGA])
    ramp = np.array([(1 - s / (OMEGA * dt)) / OMEGA**2, (1 - c) / (OMEGA**2 * dt)])

    def moved(start, end, q, v):
        free = np.array([q * c + v * s / OMEGA, v * c - q * OMEGA * s])
        return free - (start * flat + (end - start) * ramp)

    def miss(end, old, q, v, state):
        dq = moved(old if linear else end, end, q, v)[0] - q
        return (force_after(state, dq) if linear else LIMIT / EPS * bond_mean(*state[:2], dq, 1.0, EPS)[0]) - end

    for _ in range(count + 1):
        out.append(0.5 * v * v + 0.5 * OMEGA**2 * q * q + LIMIT * state[2] / (2 * EPS))

        end = brentq(miss, -1.001 * LIMIT, 1.001 * LIMIT, args=(old, q, v, state), xtol=1e-13 * LIMIT,
                     rtol=1e-15)
        after = moved(old if linear else end, end, q, v)
        state = bond_step(*state, after[0] - q, 1.0, EPS)[:3]
        q, v, old = *after, end
    return np.array(out)


def test_exact_c18_a_force_linear_in_the_step_creates_energy_and_the_path_mean_does_not():
    """6 steps per cycle: the one rises by 1.3e-2 of the start, the other never; at 100 neither does."""
    linear, mean = free_decay(6, 60, True), free_decay(6, 60, False)
    assert 1e-3 < np.diff(linear).max() / linear[0] < 2e-2
    assert np.diff(mean).max() / mean[0] <= 1e-8
    assert np.diff(free_decay(100, 600, False)).max() <= 1e-8 * mean[0]


def unsettled(share):
    """Of 40 steps just after a reversal at full friction, those in which q = free - beta F(q) wanders, beta = dt^2/6 of
    a step of share * dt_c; k_tan = 2 k_t there."""
    beta = share**2 * 3 / K_T / 6
    count = 0
    for free in -EPS * np.linspace(1e-3, 2e-2, 40):
        answer, dq = free, 0.0
        for _ in range(4000):
            answer, dq = dq, free - beta * (force_after((1.0, EPS, 2 * EPS**2), dq) - LIMIT)
            if abs(dq - answer) <= 1e-9 * EPS:
                break
        else:
            count += 1
    return count


def test_exact_c17_contraction_limit_of_the_linear_force():
    """sqrt(3 eps_0/a_f) = 391 us: no failure below it, failures above."""
    assert abs(np.sqrt(3 / K_T) - 391.0e-6) < 5e-8
    assert unsettled(0.95) == 0 and unsettled(1.05) > 20
