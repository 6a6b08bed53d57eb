"""The list of bonds, compiled: force along a straight increment, its path mean, and the step that keeps the list.

One list sums eq. 2.17 along a line for every order and reading. Two numbers of `list_numbers.law_numbers` make the
engines of `accuracy.quadrature` of it: the cut-off that drops old strips (`truncated`) and the width up to which
`list_merge_kernels` joins neighbours (`merged`); with neither it keeps every bond (`direct`).

c: a named tuple with the arrays of a list, such as `dynamics.interfaces.arrays.BondList`: bondlist (10, capacity), the
rows of `list_sum_kernels`; law (24,) of `list_numbers.law_numbers`; growth (6,) of eq. 2.10; table (k,) of
`list_numbers.share_table`; now (6,): q, path, damage, growth J, mature length, ref; status (16,): first strip, end,
spread ones, length after the last merge, stored energy [m], force [1], created and dissipated [m], pieces beyond one
per step, strips merged although their places differ, largest length, energy owed [m] (`dynamics.interfaces`), first and
last entry + 1 of its room in the array, which several lists may share, pressure under which bonds form, and that which
the first bonds formed under, over that of the friction limit.
"""

from math import ceil, exp, expm1

import numpy as np

from ...compiled.jit import njit
from ..flags_kernels import NJIT_NO_REFCOUNT
from .list_math_kernels import fexp, flog, share
from .list_merge_kernels import merge
from .list_sum_kernels import (
    AGED,
    FIRST,
    MOMENTS,
    POWER,
    SECOND,
    SHARES,
    aged_sums,
    first_bonds,
    first_mean,
    formed,
    moments_of,
    power_sums,
    shares_sums,
)
from .point_kernels import bond_mean, grow

PIECE = 0.25  # longest strip in bond lengths
# two Gauss points a strip then sum growing bonds to 1e-6 (test_exact_direct_of_growing_bonds_is_the_sum_by_hand)
GROWN = 0.5  # most growth J of one strip of growing bonds
MOST_GROWN = 16  # strips of a step for its growth alone: after a long rest J has no bound
SLIGHT = 1e-9  # share of the limit that a step's bonds may miss for strips that are too few: the error falls with the
# fourth power of their number, and once they are grown nothing of it is left
TOUCH = 1e-6  # of an increment, within which it touches the place of the first bonds
LEAST_BALANCED = 1e-3  # increment in bond lengths below which a difference of energies is no better than the force
LEAST_WIDE = 1e-6  # the same behind shear, where a solve does not find a step that ends at a change of the rule


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _after(dq, now, growth, v0, v1, dt):
    """(q, path, damage, J, mature length, length half way) after the increment."""
    eps, more = grow(now[4], v0, v1, abs(dq), dt, growth)
    middle, _ = grow(now[4], v0, (v0 + v1) / 2, abs(dq) / 2, dt / 2, growth)
    return now[0] + dq, now[1] + abs(dq), now[2] + abs(dq) / middle, now[3] + more, eps, middle


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def goal_length(before, after, more):
    """Length that 2.10 tends to in a step that multiplies the distance to it by exp(-more)."""
    rest = -expm1(-more)
    return after if rest == 0 else before + (after - before) / rest


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _pieces(size, eps, more, law):
    """(strips that a step is cut into, strips of it that still count)."""
    count = max(1.0, size / (PIECE * eps))
    if law[1] == AGED:
        share = (size / law[2]) ** (1 + min(law[0], 0.0))
        count = max(count, min(more / GROWN, MOST_GROWN, (share / SLIGHT) ** 0.25))
    count = ceil(count)
    kept = min(count, 1 + ceil(count * (law[6] / (size / eps if law[1] < SHARES else size))))
    return count, kept


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _young(size, before, after, more, middle, law):
    """Weight of the growing bonds that form in one increment."""
    goal = goal_length(before, after, more)
    count, kept = _pieces(size, middle, more, law)
    total = 0.0
    for piece in range(int(kept)):
        for half in range(2):
            back = (piece + (FIRST if half == 0 else SECOND)) / count
            own = max(-goal * expm1(-back * more), 1e-9 * after)
            x = back * size / own
            total += fexp(law[0] * flog(x) - x)
    return total * law[4] * size / (2 * count * law[2])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_state(dq, c, v0, dt):
    """(force weight [1], energy in the bonds that were there [m]) after the straight increment dq.

    Friction force = mu_s N * weight. Energy: the force of each bond over its own stretch at frozen damage.
    """
    q, path, damage, _, _, _ = _after(dq, c.now, c.growth, v0, v0, dt)
    first, stored = first_bonds(q, path, damage, c.law)
    force, energy = later_state(dq, c, v0, dt)
    return c.status[15] * first + force, c.status[15] * stored + energy


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def later_state(dq, c, v0, dt):
    """`list_state` without the first bonds."""
    bonds, status, now, law = c.bondlist, c.status, c.now, c.law
    q, path, damage, age, eps, middle = _after(dq, now, c.growth, v0, v0, dt)
    head, end, many, p, coarse = (
        int(status[0]),
        int(status[1]),
        int(status[2]),
        law[0],
        law[5] * law[2],
    )
    size, young, force, energy = abs(dq), 0.0, 0.0, 0.0
    if law[1] == MOMENTS:
        _, z, s2 = moments_of(q, exp(now[5] - damage), bonds, head, end)
        force += z / law[2]
        energy += s2 / (2 * law[2])
    elif law[1] == POWER:
        f, g = power_sums(q, damage, bonds, head, many, end, p, coarse, law[8:24])
        scale = law[4] / law[2] * exp(now[5] - damage)
        force += scale * f
        energy += scale * g / (p + 1)
    elif law[1] == SHARES:
        f, g = shares_sums(q, path, bonds, head, many, end, p, law[2], c.table, law[4])
        force += f
        energy += g
    else:
        f, g = aged_sums(q, path, exp(now[5] - age), eps, bonds, head, many, end, p, coarse)
        force += law[4] / law[2] * f
        energy += law[4] / law[2] * g
    if size > 0:
        if law[1] == AGED:
            young = _young(size, now[4], eps, age - now[3], middle, law)
        else:
            young = formed(size, middle if law[1] <= POWER else law[2], law)
    return force + np.copysign(status[14] * young, dq), energy


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_force(dq, c, v0, dt):
    """Weight [1] of the list after the straight increment dq: friction force = mu_s N * weight.

    Twin: `quadrature.Quadrature`.
    """
    return list_state(dq, c, v0, dt)[0]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_energy(dq, c, v0, dt):
    """Energy [m] of all bonds, those of the increment too, after the straight increment dq in the stretch reading."""
    middle = _after(dq, c.now, c.growth, v0, v0, dt)[5]
    young = middle * middle / c.law[2] * share(c.law[0] + 1, abs(dq) / middle)
    return c.status[14] * young + list_state(dq, c, v0, dt)[1]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _force(dq, c, v0, dt):
    """The force that means are taken of: without the first bonds in the print, whose mean is closed."""
    return later_state(dq, c, v0, dt)[0] if c.law[1] >= SHARES else list_force(dq, c, v0, dt)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _panel(energy, low, high, dq, c, v0, dt):
    """Integral of the force, or of the energy, over a share of the increment by five Gauss points."""
    out = 0.0
    for y, w in (
        (-0.906179845938664, 0.23692688505618908),
        (-0.5384693101056831, 0.47862867049936647),
        (0.0, 0.5688888888888889),
        (0.5384693101056831, 0.47862867049936647),
        (0.906179845938664, 0.23692688505618908),
    ):
        part = low + (high - low) * (1 + y) / 2
        if energy:
            out += w / 2 * list_energy(part * dq, c, v0, part * dt)
        else:
            out += w / 2 * _force(part * dq, c, v0, part * dt)
    return (high - low) * out


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_mean(dq, c, v0, dt):
    """Path-mean weight over the increment.

    Stretch reading of order 1: closed. Of another order: what damage takes, the share dR/eps of the stored energy, and
    the gain of that energy, so that no step creates any (twin: `quadrature.Quadrature.step`). Printed law: the mean of
    the force, that of the first bonds closed. Other integrals by Simpson's rule where the increment is short (its first
    value is known), by five Gauss points up to half a bond length, beyond it by such panels that double. In the stretch
    reading an increment that touches the place of the first bonds takes Gauss points as well: their force may jump
    there, and its value at the place itself is that of neither side.
    """
    status, now, law = c.status, c.now, c.law
    if dq == 0:
        return status[5]
    if law[1] == MOMENTS:
        return list_slope(dq, c, v0, dt)[0]
    size = abs(dq) / now[4]
    low, high = min(now[0], now[0] + dq), max(now[0], now[0] + dq)
    touched = low <= TOUCH * abs(dq) and high >= -TOUCH * abs(dq)
    # there no change of the rule either
    touched = (touched and law[1] < SHARES) or (law[7] > 0 and law[0] < 1)
    least = LEAST_BALANCED if law[7] == 0 else LEAST_WIDE
    short = (
        status[1] > status[0]
        and size <= (0.1 if law[0] >= 1 else 0.03)
        and law[0] >= 0
        and not touched
    )
    # the force of the first bonds turns within the increment
    kinked = low <= 0.0 <= high and law[3] > 0 and law[0] < 1
    if law[1] == POWER and (size > least or kinked):
        gain = list_energy(dq, c, v0, dt) - status[4]
        middle = _after(dq, now, c.growth, v0, v0, dt)[5]
        spent = _path_mean(True, short, gain + status[4], dq, c, v0, dt)
        return (spent * abs(dq) / middle + gain) / dq
    last = 0.0
    if short:
        last = _force(dq, c, v0, dt)
    mean = _path_mean(False, short, last, dq, c, v0, dt)
    return mean + status[15] * first_mean(dq, now[0], now[1], law) if law[1] >= SHARES else mean


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _path_mean(energy, short, last, dq, c, v0, dt):
    """Path mean of the force, or of the energy, over the increment; last: its value at the end of a short one."""
    if short:
        if energy:
            half = list_energy(0.5 * dq, c, v0, 0.5 * dt)
            return (c.status[4] + 4 * half + last) / 6
        half, before = _force(0.5 * dq, c, v0, 0.5 * dt), c.status[5]
        if c.law[1] >= SHARES:
            before -= c.status[15] * first_bonds(c.now[0], c.now[1], c.now[2], c.law)[0]
        return (before + 4 * half + last) / 6
    size = abs(dq) / c.now[4]
    if size <= 0.5:
        return _panel(energy, 0.0, 1.0, dq, c, v0, dt)
    low, high, out = 0.0, 0.5 / size, 0.0
    while low < 1:
        high = 1.0 if high > 0.75 else high
        out += _panel(energy, low, high, dq, c, v0, dt)
        low, high = high, 2 * high
    return out


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_slope(dq, c, v0, dt):
    """(path-mean weight [1], its derivative over dq [1/m]) of an increment, exact in the stretch reading of order 1.

    dq [m]; c: the list; v0 [m/s], dt [s] set the bond length of the step. Friction force = mu_s N * weight.
    """
    status, now, law = c.status, c.now, c.law
    m, z, _ = moments_of(now[0], exp(now[5] - now[2]), c.bondlist, int(status[0]), int(status[1]))
    first = status[15] * law[3] * exp(-now[2])
    middle, _ = grow(now[4], v0, v0, abs(dq) / 2, dt / 2, c.growth)
    mean, slope = bond_mean(m + first, z + first * now[0], dq, status[14], middle)
    return mean / law[2], slope / law[2]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_step(dq, c, v0, v1, dt):
    """Commit an increment: append its strips, drop strips beyond the cut-off, merge now and then; False without room.

    dq [m]; c: the list, changed in place; v0, v1: speeds [m/s] at the ends of the step of dt [s]. The energy it stores
    and the force after the step stand in `status`.
    """
    bonds, status, now, law = c.bondlist, c.status, c.now, c.law
    before, place, way, harm, age = now[4], now[0], now[1], now[2], now[3]
    q, path, damage, grown, eps, middle = _after(dq, now, c.growth, v0, v1, dt)
    now[0], now[1], now[2], now[3], now[4] = q, path, damage, grown, eps
    _rescale(bonds, status, now, law)
    size, done = abs(dq), True
    if size > 0 and status[14] > 0:
        done = _append(dq, place, way, harm, before, grown - age, middle, bonds, status, now, law)
    if size > 0:
        _cut(bonds, status, now, law)
        # a merge passes over the whole list: wait until it has grown by a fifth
        if law[5] > 0 and status[1] - status[0] > 1.2 * status[3] + 12:
            merge(bonds, status, now, law)
    status[5], status[4] = list_state(0.0, c, 0.0, 0.0)
    status[10] = max(status[10], status[1] - status[0])
    return done


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _rescale(bonds, status, now, law):
    """Move the reference of the scaled numbers before they overflow."""
    if law[1] == SHARES:
        return
    exponent = now[3] if law[1] == AGED else now[2]
    if exponent - now[5] < 300:  # exp(300) = 1e130; the range of numbers ends at exp(709)
        return
    less = exp(now[5] - exponent)
    for k in range(int(status[0]), int(status[1])):
        bonds[5, k] *= less
        bonds[6, k] *= less
    now[5] = exponent


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _append(dq, place, way, harm, before, more, middle, bonds, status, now, law):
    """Strips of the increment dq that began at `place`; False when there is no room."""
    mode, size, end, dense = law[1], abs(dq), int(status[1]), status[14]
    if (
        mode == SHARES
        and end > status[0] + status[2]
        and (bonds[1, end - 1] - bonds[0, end - 1]) * dq > 0
        and bonds[9, end - 1] == way
        and bonds[5, end - 1] == dense
    ):
        k = end - 1
        bonds[1, k] = now[0]
        bonds[2, k] = bonds[9, k] = now[1]
        bonds[3, k] += size
        bonds[8, k] = bonds[3, k]
        bonds[4, k] = dense * bonds[3, k]
        return True
    count, kept = (1, 1) if mode == SHARES else _pieces(size, middle, more, law)
    if mode == MOMENTS:
        count = kept = 1
    status[8] += count - 1
    capacity = min(int(status[13]), bonds.shape[1])
    if end + kept > capacity:
        end = _pack(bonds, status)
        if end + kept > capacity:
            return False
    goal = goal_length(before, now[4], more)
    for piece in range(int(kept) - 1, -1, -1):
        near, far = piece / count, (piece + 1) / count
        bonds[0, end], bonds[1, end] = now[0] - far * dq, now[0] - near * dq
        bonds[7, end] = 1.0
        bonds[8, end], bonds[9, end] = size / count, now[1] - near * size
        bonds[2, end], bonds[3, end], bonds[4, end] = (
            bonds[9, end],
            bonds[8, end],
            dense * bonds[8, end],
        )
        bonds[5, end] = dense
        if mode == MOMENTS:
            _as_moments(bonds, end, dq, middle, now)
            bonds[5, end] *= dense
        elif mode == POWER:
            span = (now[2] - harm) / count
            bonds[2, end], bonds[3, end] = now[2] - near * (now[2] - harm), span
            bonds[4, end] = dense * (size / count * middle ** (-law[0]))
            bonds[5, end] = 0.5 * bonds[4, end] * exp(bonds[2, end] - FIRST * span - now[5])
            bonds[6, end] = 0.5 * bonds[4, end] * exp(bonds[2, end] - SECOND * span - now[5])
        elif mode == AGED:
            for half in range(2):
                back = (piece + (FIRST if half == 0 else SECOND)) / count
                # mature length there, times exp(J there - ref): own = mature - exp(ref - J) times this
                bonds[5 + half, end] = goal * exp(now[3] - back * more - now[5]) + (
                    before - goal
                ) * exp(now[3] - more - now[5])
        end += 1
    status[1] = end
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _as_moments(bonds, k, dq, eps, now):
    """Weight, centre and variance of the bonds of one increment that survive it, exact at a constant length."""
    x, g = abs(dq) / eps, np.copysign(1.0, dq)
    if x < 1e-2:
        zero = x * (1 - x / 2 * (1 - x / 3 * (1 - x / 4 * (1 - x / 5))))
        first = x * (1 / 2 - x / 12 * (1 - x * x / 60))
        spread = x * x / 12 * (1 - x * x / 20)
    else:
        e = exp(-x)
        zero = -expm1(-x)
        first = 1 - x * e / zero
        spread = max(1 - x * x * e / (zero * zero), 0.0)
    bonds[0, k] = now[0] - g * eps * first
    bonds[1, k] = eps * eps * spread
    bonds[5, k] = zero * exp(now[2] - now[5])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _cut(bonds, status, now, law):
    """Pass over the strips older than the cut-off."""
    head, end = int(status[0]), int(status[1])
    while head < end:
        old = (now[1] - bonds[9, head]) if law[1] >= SHARES else now[2] - bonds[2, head]
        if law[1] == MOMENTS:
            old = (now[1] - bonds[9, head]) / law[2]
        if old <= law[6]:
            break
        head += 1
        status[2] = max(status[2] - 1, 0.0)
    status[0] = head


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _pack(bonds, status):
    """Move the list to the front of its room; returns its end."""
    head, end, front = int(status[0]), int(status[1]), int(status[12])
    for i in range(bonds.shape[0]):
        for k in range(head, end):
            bonds[i, k - head + front] = bonds[i, k]
    status[0], status[1] = front, end - head + front
    return end - head + front
