"""Step of Dormand and Prince's Runge-Kutta method of order 8 with dense output of order 7 (compiled).

The coefficients are those of `scipy.integrate.DOP853` (Hairer, Norsett and Wanner 1993, II.5).

Rows of `State.rows`: 16 stages, 7 coefficients of the dense output per component (from CURVE on), the state at the END of
the step, workspaces POINT, SPARE and RATES, the state at the last cycle (CYCLE), that at the start of the window
(`records.WINDOW_START`), and at last the scales of the errors.
"""

import numpy as np
from scipy.integrate import DOP853

from ..kernel_cache.flags_kernels import NJIT_KERNEL
from ..kernel_cache.jit import njit
from .motion_kernels import find_integrals, find_rates
from .records import Clock

N_STAGES = 12  # stages of a step
N_ALL_STAGES = 16  # these, the rate at its end, and the three further stages of the dense output
# Coefficients: weights A and times C of the stages, E3 and E5 of both error estimates, D of the dense output
A = np.zeros((N_ALL_STAGES, N_ALL_STAGES))
A[:12, :12] = DOP853.A
A[12, :12] = DOP853.B
A[13:, :] = DOP853.A_EXTRA
C = np.concatenate([DOP853.C, [1.0], DOP853.C_EXTRA])
E3 = DOP853.E3
E5 = DOP853.E5
D = DOP853.D
# First row of each block of `State.rows`
CURVE = 16
END = 23
POINT = 24
SPARE = 25
RATES = 26
CYCLE = 27
SCALE = 29
SAFETY = 0.9  # ratio of the next step to the one that would just meet the tolerance
MAX_FACTOR = 4.0  # largest ratio of successive steps
MIN_FACTOR = 0.2  # smallest ratio of successive steps


@njit(**NJIT_KERNEL)
def find_stages(rig, state, h, first, last, y):
    """Compute the stages from `first` to `last` - 1 of a step h: k_i = f(t + C_i h, y + h sum_j A_ij k_j).

    A and C are the weights and times of the method of order 8, and k_i is row i of `State.rows`.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    h : float
        Length of the step [s].
    first : int
        First stage.
    last : int
        Stage after the last one.
    y : (n,) array
        State at the last stage, in the order of `State.y` (output); its integrals at the end of the step alone.
    """
    n_states = find_integrals(rig)
    for stage in range(first, last):
        # No rate depends on the integrals, which are needed at the end of the step alone.
        n = y.size if stage == N_STAGES else n_states
        for k in range(n):
            total = 0.0
            for j in range(stage):
                total += A[stage, j] * state.rows[j, k]
            y[k] = state.y[k] + h * total
        find_rates(rig, state, state.clock[Clock.TIME] + C[stage] * h, y, state.rows[stage])


@njit(**NJIT_KERNEL)
def error_norm(rows, h, rtol, n):
    """Return the error of a step relative to its tolerance, over the first n components.

    Parameters
    ----------
    rows : (30, n) array
        See the module.
    h : float
        Length of the step [s].
    rtol : float
        Tolerance of a step.
    n : int
        Number of components whose errors count.
    """
    fifth = third = 0.0
    for k in range(n):
        e5 = e3 = 0.0
        for j in range(N_STAGES + 1):
            e5 += E5[j] * rows[j, k]
            e3 += E3[j] * rows[j, k]
        fifth += (e5 / rows[SCALE, k]) ** 2
        third += (e3 / rows[SCALE, k]) ** 2
    if fifth == 0:
        return 0.0
    return h * fifth / rtol / np.sqrt((fifth + 0.01 * third) * n)


@njit(**NJIT_KERNEL)
def step_factor(norm):
    """Return the ratio of the next step to one of a given error."""
    if norm == 0:
        return MAX_FACTOR
    return min(MAX_FACTOR, max(MIN_FACTOR, SAFETY * norm**-0.125))


@njit(**NJIT_KERNEL)
def find_curve(state, h):
    """Write the coefficients of the dense output of a step of `h` [s] with a known end to the rows from CURVE on."""
    rows = state.rows
    for k in range(state.y.size):
        change = rows[END, k] - state.y[k]
        rows[CURVE, k] = change
        rows[CURVE + 1, k] = h * rows[0, k] - change
        rows[CURVE + 2, k] = 2 * change - h * (rows[N_STAGES, k] + rows[0, k])
    for i in range(4):
        rows[CURVE + 3 + i, :] = 0.0
        for j in range(N_ALL_STAGES):
            weight = h * D[i, j]
            if weight != 0:
                for k in range(state.y.size):
                    rows[CURVE + 3 + i, k] += weight * rows[j, k]


@njit(**NJIT_KERNEL)
def read_curve(state, x, y):
    """Write the state at the fraction x of a step to `y`, by the polynomial of the dense output (degree 7).

    Parameters
    ----------
    state : State
        Motion, which is updated.
    x : float
        Fraction of the step.
    y : (m,) array
        State, or its first components, which are written.
    """
    rows = state.rows
    for k in range(y.size):
        total = 0.0
        for i in range(6, -1, -1):
            total = (total + rows[CURVE + i, k]) * (x if i % 2 == 0 else 1 - x)
        y[k] = state.y[k] + total


@njit(**NJIT_KERNEL)
def take_step(rig, state, h, rtol, n_checked):
    """Try a step; return its error relative to the tolerance, and find its dense output if it is accepted.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    h : float
        Length of the step [s].
    rtol : float
        Tolerance of a step.
    n_checked : int
        Number of components of the state whose errors count.
    """
    state.clock[Clock.LENGTH] = h
    if state.clock[Clock.IS_SMOOTH] == 0:
        find_stages(rig, state, h, 0, 1, state.rows[END])
        state.clock[Clock.IS_SMOOTH] = 1.0
    find_stages(rig, state, h, 1, N_STAGES + 1, state.rows[END])
    norm = error_norm(state.rows, h, rtol, n_checked)
    if norm <= 1:
        find_stages(rig, state, h, N_STAGES + 1, N_ALL_STAGES, state.rows[SPARE])
        find_curve(state, h)
    return norm
