"""Compiled pieces of the march: free motion of the modes over a step and the energy that the step moves."""

import numpy as np
from numba import njit
from numba.core.options import DefaultOptions

# no counting of references in functions that allocate nothing: 1.3 of the 1.6 us of a step of a march
LEAN = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}


@njit(error_model="numpy", **LEAN)
def free_slide(state, step, slide, s, c):
    """Increment of the interface slide [m] over a step without friction; state (n, 2), step (n, 2, 5), slide (n,)."""
    out = 0.0
    for i in range(slide.size):
        z1 = step[i, 0, 0] * state[i, 0] + step[i, 0, 1] * state[i, 1] + step[i, 0, 3] * s + step[i, 0, 4] * c
        out += slide[i] * (z1 - state[i, 0])
    return out


@njit(error_model="numpy", **LEAN)
def move(state, step, slide, mass, force, s, c):
    """Advance the modes in place by one step under the constant interface force [N]; the slide's speed after it."""
    speed = 0.0
    for i in range(slide.size):
        f = -slide[i] * force / mass
        z = step[i, 0, 0] * state[i, 0] + step[i, 0, 1] * state[i, 1] + step[i, 0, 2] * f \
            + step[i, 0, 3] * s + step[i, 0, 4] * c
        v = step[i, 1, 0] * state[i, 0] + step[i, 1, 1] * state[i, 1] + step[i, 1, 2] * f \
            + step[i, 1, 3] * s + step[i, 1, 4] * c
        state[i, 0] = z
        state[i, 1] = v
        speed += slide[i] * v
    return speed


@njit(error_model="numpy", **LEAN)
def step_energy(state, gauss, slide, base, damp, mass, drive, force, s, c, sines, dt, weights, out):
    """Add to `out` (3,) the work of the base [J], the viscous loss [J] and the integral of |power in| [J] of a step.

    Four Gauss points on the exact motion inside the step; damp (n,) = 2 zeta omega.
    """
    for k in range(weights.size):
        power, loss = 0.0, 0.0
        for i in range(slide.size):
            f = -slide[i] * force / mass
            v = gauss[k, i, 1, 0] * state[i, 0] + gauss[k, i, 1, 1] * state[i, 1] + gauss[k, i, 1, 2] * f \
                + gauss[k, i, 1, 3] * s + gauss[k, i, 1, 4] * c
            power -= mass * base[i] * drive * sines[k] * v
            loss += mass * damp[i] * v * v
        share = weights[k] * dt / 2
        out[0] += share * power
        out[1] += share * loss
        out[2] += share * abs(power)


@njit(error_model="numpy", **LEAN)
def stored(state, omega, mass):
    """Kinetic and elastic energy [J] of the modes."""
    out = 0.0
    for i in range(omega.size):
        out += 0.5 * mass * (state[i, 1] * state[i, 1] + omega[i] * omega[i] * state[i, 0] * state[i, 0])
    return out


@njit(error_model="numpy", **LEAN)
def accelerations(state, omega, damp, slide, base, mass, drive, force, s, out):
    """Modal accelerations (n,) [m s-2] at an instant, relative to the base."""
    for i in range(omega.size):
        out[i] = -base[i] * drive * s - damp[i] * state[i, 1] - omega[i] ** 2 * state[i, 0] - slide[i] * force / mass


@njit(error_model="numpy", **LEAN)
def safe_point(low, high, guess):
    """`guess` if it lies inside (low, high), their middle otherwise."""
    if low < guess < high and np.isfinite(guess):
        return guess
    return 0.5 * (low + high)


@njit(error_model="numpy", **LEAN)
def sample(row, state, slide, output):
    """(slide, its speed, output) of the modes, written with them into the first 2 n + 2 entries of a row."""
    n = slide.size
    q, v, out = 0.0, 0.0, 0.0
    for k in range(n):
        row[k], row[n + k] = state[k, 0], state[k, 1]
        q += slide[k] * state[k, 0]
        v += slide[k] * state[k, 1]
        out += output[k] * state[k, 0]
    row[2 * n], row[2 * n + 1] = q, v
    return q, v, out


@njit(error_model="numpy", **LEAN)
def note(row, force, energy, slip, out, travel, total, ledger):
    """Write force, slip and the interface's energy into a row, the peak of all energy into the ledger. Returns 0, or 1
    beyond the travel and 3 for a motion that is not finite."""
    n = row.size - 4
    row[n], row[n + 1], row[n + 2], row[n + 3] = force, slip, force, energy
    ledger[4] = max(ledger[4], total)
    if not np.isfinite(row[n - 2] + row[n - 1] + force):
        return 3
    return 1 if abs(out) > travel else 0


@njit(error_model="numpy", **LEAN)
def tell(count, work, ledger):
    """Book the iterations of a step (below 0: it failed) and its friction work [J]."""
    ledger[5] += abs(count)
    ledger[6] = max(ledger[6], abs(count))
    ledger[7] += 1.0 if count < 0 else 0.0
    ledger[8] += work
