"""Compiled motion of the modes over a step of the march, and the energies of the step.

state (2, n): coordinates and rates; table[at]: a row of `propagator.Propagator.tables`; accel (n,): modal accelerations
due to interface forces, which are constant over the step.
"""

import numpy as np

from ..compiled.jit import njit
from ..friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def free_slide(state, reach, port, table, at):
    """Return the increment [m] of the slide of a port in a step without interface forces."""
    n = state.shape[1]
    out = table[at, 8 * n + 3 + port]
    for i in range(n):
        out += reach[port, i] * state[0, i] + reach[port, n + i] * state[1, i]
    return out


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def free_rate(state, row, free, dense, table, at):
    """Return the rate [m/s] of the slide `row` (n,) after a step without interface forces."""
    n = row.size
    out = 0.0
    for i in range(n):
        end = table[at, n + i]
        if dense.size == 0:
            end += free[2, i] * state[0, i] + free[3, i] * state[1, i]
        else:
            for k in range(n):
                end += dense[n + i, k] * state[0, k] + dense[n + i, n + k] * state[1, k]
        out += row[i] * end
    return out


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def struck(state, row, speed, now, mass):
    """Change the rate of a slide from `now` to `speed` [m/s] by an impulse along it, in place.

    row: (n,) slide per coordinate. Returns the energy [J] that the modes lose.
    """
    share = 0.0
    for i in range(row.size):
        share += row[i] * row[i]
    for i in range(row.size):
        state[1, i] -= row[i] * (now - speed) / share
    return 0.5 * mass * (now * now - speed * speed) / share


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def push_back(force, row, mass, accel):
    """Write the modal accelerations (n,) of a force [N] that resists the slide `row` (n,)."""
    for i in range(accel.size):
        accel[i] = -row[i] * force / mass


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def move(state, free, push, loss, dense, dense_loss, table, at, accel, scratch, ledger):
    """Advance the modes in place by one step, and add its energies to the ledger.

    ledger[0]: work of the drive, ledger[1]: viscous loss, ledger[2]: sum of the absolute works [J]. scratch: (2, n)
    workspace. The arrays of a step are passed separately, because the reference counts of a tuple of them would be
    updated in every step.
    """
    n = state.shape[1]
    work = table[at, 8 * n]
    lost = table[at, 8 * n + 1]
    for i in range(n):
        z = state[0, i]
        v = state[1, i]
        f = accel[i]
        work += table[at, 2 * n + i] * z + table[at, 3 * n + i] * v + table[at, 4 * n + i] * f
        lost += table[at, 5 * n + i] * z + table[at, 6 * n + i] * v + table[at, 7 * n + i] * f
    if dense.size == 0:
        for i in range(n):
            z = state[0, i]
            v = state[1, i]
            f = accel[i]
            lost += (
                (loss[0, i] * z + loss[1, i] * v + loss[3, i] * f) * z
                + (loss[2, i] * v + loss[4, i] * f) * v
                + loss[5, i] * f * f
            )
            state[0, i] = free[0, i] * z + free[1, i] * v + push[0, i] * f + table[at, i]
            state[1, i] = free[2, i] * z + free[3, i] * v + push[1, i] * f + table[at, n + i]
    else:
        lost += _move_coupled(state, dense, dense_loss, table, at, accel, scratch)
    ledger[0] += work
    ledger[1] += lost
    ledger[2] += abs(work)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _move_coupled(state, dense, loss, table, at, accel, scratch):
    """Advance modes whose damping couples the coordinates, as `move` does.

    Returns the quadratic part of the viscous loss [J].
    """
    n = state.shape[1]
    lost = 0.0
    for i in range(3 * n):
        x = accel[i - 2 * n] if i >= 2 * n else state[i // n, i % n]
        part = 0.0
        for j in range(2):
            for k in range(n):
                part += loss[i, j * n + k] * state[j, k]
        for k in range(n):
            part += loss[i, 2 * n + k] * accel[k]
        lost += x * part
    for i in range(2 * n):
        part = table[at, i]
        for j in range(2):
            for k in range(n):
                part += dense[i, j * n + k] * state[j, k]
        for k in range(n):
            part += dense[i, 2 * n + k] * accel[k]
        scratch[i // n, i % n] = part
    for i in range(n):
        state[0, i] = scratch[0, i]
        state[1, i] = scratch[1, i]
    return lost


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def stored(state, omega, mass):
    """Return the kinetic and elastic energy [J] of the modes."""
    out = 0.0
    for i in range(omega.size):
        out += state[1, i] * state[1, i] + omega[i] * omega[i] * state[0, i] * state[0, i]
    return 0.5 * mass * out


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def accelerations(state, omega, damp, damping, base, drive, accel, out):
    """Write the modal accelerations (n,) [m s-2] at an instant, relative to the base.

    drive: base acceleration [m s-2]; accel: (n,) modal accelerations due to interface forces.
    """
    n = omega.size
    for i in range(n):
        out[0, i] = accel[i] - base[i] * drive - omega[i] ** 2 * state[0, i]
        if damping.size == 0:
            out[0, i] -= damp[i] * state[1, i]
        else:
            for k in range(n):
                out[0, i] -= damping[i, k] * state[1, k]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def safe_point(low, high, guess):
    """Return `guess` if it lies inside (low, high), else the midpoint."""
    if low < guess < high and np.isfinite(guess):
        return guess
    return 0.5 * (low + high)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def narrowed(low, high, here, miss, gain, late):
    """Take a bracketed Newton step towards the root of an increasing function.

    miss: the function at `here`; gain: its slope or an approximation of it; low, high: bracket, infinite where there is
    no bound yet. An end of the bracket moves to `here`; a step that leaves the bracket is replaced by the midpoint.
    late: number of evaluations beyond those that usually suffice. From 1 on every other step is a bisection, because
    kinks can make the steps alternate, and without a bracket the steps grow. Returns low, high and the next point.
    """
    if miss > 0:
        high = here
    else:
        low = here
    new = here - miss / gain
    if low > -np.inf and high < np.inf:
        new = safe_point(low, high, new)
        if late > 0 and late % 2:
            new = 0.5 * (low + high)
    elif late > 0:
        new = here - miss * 2.0 ** min(late, 60)
    return low, high, new


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def sample(row, state, slide, output):
    """Write coordinates, rates, slide and slide speed into the first 2 n + 2 entries of row.

    Returns slide [m], slide speed [m/s] and output [m].
    """
    n = slide.size
    q = 0.0
    v = 0.0
    out = 0.0
    for k in range(n):
        row[k] = state[0, k]
        row[n + k] = state[1, k]
        q += slide[k] * state[0, k]
        v += slide[k] * state[1, k]
        out += output[k] * state[0, k]
    row[2 * n] = q
    row[2 * n + 1] = v
    return q, v, out


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def note(row, force, energy, slip, out, travel, total, ledger):
    """Write force, slip and interface energy into a row, and the peak energy into the ledger.

    Returns 0; 1 where the output exceeds the travel; 3 where the motion is not finite.
    """
    n = row.size - 4
    row[n] = force
    row[n + 1] = slip
    row[n + 2] = force
    row[n + 3] = energy
    ledger[4] = max(ledger[4], total)
    if not np.isfinite(row[n - 2] + row[n - 1] + force):
        return 3
    return 1 if abs(out) > travel else 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def tell(count, work, ledger):
    """Add the iterations of a step and its friction work [J] to the ledger.

    count: iterations, negative if the step failed.
    """
    ledger[5] += abs(count)
    ledger[6] = max(ledger[6], abs(count))
    ledger[7] += 1.0 if count < 0 else 0.0
    ledger[8] += work


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def ended(state, free, push, dense, table, at, accel, out):
    """Write coordinates and rates at the end of a step under `accel` (n,) into out (2, n).

    The state and the ledger do not change.
    """
    n = state.shape[1]
    for i in range(n):
        z = table[at, i]
        v = table[at, n + i]
        if dense.size == 0:
            z += free[0, i] * state[0, i] + free[1, i] * state[1, i] + push[0, i] * accel[i]
            v += free[2, i] * state[0, i] + free[3, i] * state[1, i] + push[1, i] * accel[i]
        else:
            for k in range(n):
                z += (
                    dense[i, k] * state[0, k]
                    + dense[i, n + k] * state[1, k]
                    + dense[i, 2 * n + k] * accel[k]
                )
                v += (
                    dense[n + i, k] * state[0, k]
                    + dense[n + i, n + k] * state[1, k]
                    + dense[n + i, 2 * n + k] * accel[k]
                )
        out[0, i] = z
        out[1, i] = v
