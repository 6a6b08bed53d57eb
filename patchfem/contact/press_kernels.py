"""Compiled contact sets: on one contact set everything is affine in the motion of the upper holder.

d is the closing beyond a reference state, t the rotation beyond it. With the unknowns of a set (forces where it
touches, gaps where not) the complementarity problem w = b + t x - d + C f reads y = R (1, d, t). One node more or less
is a principal pivot of the tableau [T | R].

A set is known by its 64-bit name, the exclusive or of the names of its nodes, so a state on a known set costs one pass
over the nodes. The search flips all nodes that fail, later the first of them alone; that ends for every positive
definite C (Murty, Opsearch 11, 1974). NumPy twin: `contact_sets.ContactSets`.
"""

from typing import NamedTuple

import numpy as np

from ..compiled.jit import njit
from .polygon_kernels import NJIT_NO_REFCOUNT, NOISE, outline, within

FASTMATH_FLAGS = {"reassoc", "contract", "arcp"}
# for passes that look for the least value: without them none is vectorised
LEAST = FASTMATH_FLAGS | {
    "nnan",
    "nsz",
}
BLOCKS = 12  # sets tried with all failing nodes flipped at once
FLAW = 1e-8  # relative residual above which the tableau is made anew; below it one refinement reaches round-off
COUNT, SLOT, BUILT, PIVOTS, RENEWED = range(5)


class SetArrays(NamedTuple):
    """Arrays of the contact sets of m nodes with room for k contact sets.

    c (m, m); x, b (m,): places and openings of the reference state; tableau (m, m + 3) with its set `here` (m,); rows
    (k, 3, m): force or gap per (1, d, t) of every set; on (k, m); energy (k, 6): of the preloaded contact, the
    coefficients of 1, d, t, d^2/2, d t, t^2/2; names (k,), heads, link: hash chains; node (m,): names of the nodes;
    base (5,): force, moment and energy of the reference state, size of its openings, its dN/d(delta); wanted (m,), side
    (2, 3, m), row (m + 3,): scratch; meta: COUNT .. RENEWED.

    A set whose motions form a polygon of few sides has more: sides (k,): their number, 0 where the rows have to be
    asked; edge (k, SIDES): the node of each side; beside (k, SIDES): slot of the set beyond it, -1 unknown; limit (k,
    2): forces and gaps below which a node fails; corner (2, 3, 4 SIDES): scratch.
    """

    c: np.ndarray
    x: np.ndarray
    b: np.ndarray
    tableau: np.ndarray
    here: np.ndarray
    rows: np.ndarray
    on: np.ndarray
    energy: np.ndarray
    names: np.ndarray
    heads: np.ndarray
    link: np.ndarray
    node: np.ndarray
    base: np.ndarray
    wanted: np.ndarray
    side: np.ndarray
    row: np.ndarray
    meta: np.ndarray
    sides: np.ndarray
    edge: np.ndarray
    beside: np.ndarray
    limit: np.ndarray
    corner: np.ndarray


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def pivot(sets, k):
    """Exchange force and gap of node k in the tableau; m^2 multiplications. False where the pivot is not positive."""
    tableau, row = sets.tableau, sets.row
    m, wide = tableau.shape
    p = tableau[k, k]
    if not p > 0:
        return False
    for j in range(wide):
        row[j] = tableau[k, j] / p
    for i in range(m):
        share = tableau[i, k]
        if i == k or share == 0.0:
            continue
        line = tableau[i]
        for j in range(wide):
            line[j] -= share * row[j]
        line[k] = share / p
    for j in range(wide):
        tableau[k, j] = -row[j]
    tableau[k, k] = 1 / p
    sets.here[k] = not sets.here[k]
    sets.meta[PIVOTS] += 1
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def renew(sets):
    """Write the tableau of the empty contact set."""
    m = sets.x.size
    for i in range(m):
        for j in range(m):
            sets.tableau[i, j] = sets.c[i, j]
        sets.tableau[i, m] = sets.b[i]
        sets.tableau[i, m + 1] = -1.0
        sets.tableau[i, m + 2] = sets.x[i]
        sets.here[i] = False
    sets.meta[RENEWED] += 1


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def refine(sets):
    """Read the rows of the set off the tableau and refine them once on C itself; relative residual found before that."""
    m, c, tableau = sets.x.size, sets.c, sets.tableau
    force, left = sets.side[0], sets.side[1]
    for i in range(m):
        share = 1.0 if sets.here[i] else 0.0
        for r in range(3):
            force[r, i] = share * tableau[i, m + r]
    top0, top1, top2, off0, off1, off2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(m):
        s0, s1, s2 = 0.0, 0.0, 0.0
        line = c[i]
        for j in range(m):
            s0 += line[j] * force[0, j]
            s1 += line[j] * force[1, j]
            s2 += line[j] * force[2, j]
        top0, top1, top2 = (
            max(top0, abs(s0), abs(sets.b[i])),
            max(top1, abs(s1), 1.0),
            max(top2, abs(s2), abs(sets.x[i])),
        )
        s0 += sets.b[i]
        s1 -= 1.0
        s2 += sets.x[i]
        if sets.here[i]:
            off0, off1, off2 = max(off0, abs(s0)), max(off1, abs(s1)), max(off2, abs(s2))
            left[0, i], left[1, i], left[2, i] = s0, s1, s2
        else:
            tableau[i, m], tableau[i, m + 1], tableau[i, m + 2] = s0, s1, s2
            left[0, i], left[1, i], left[2, i] = 0.0, 0.0, 0.0
    worst = max(off0 / top0 if top0 > 0 else 0.0, off1 / top1, off2 / top2 if top2 > 0 else 0.0)
    for i in range(m if worst > 1e-15 else 0):  # nothing to refine at round-off
        s0, s1, s2 = 0.0, 0.0, 0.0
        line = tableau[i]
        for j in range(m):
            s0 += line[j] * left[0, j]
            s1 += line[j] * left[1, j]
            s2 += line[j] * left[2, j]
        tableau[i, m] -= s0
        tableau[i, m + 1] -= s1
        tableau[i, m + 2] -= s2
    return worst


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def store(sets, name):
    """Keep the refined set of the tableau in the next slot and return the slot; the oldest set gives way where none is
    free."""
    m, meta = sets.x.size, sets.meta
    slot, bucket = meta[SLOT], sets.heads.size - 1
    meta[SLOT] = (slot + 1) % sets.names.size
    meta[BUILT] += 1
    if meta[COUNT] < sets.names.size:
        meta[COUNT] += 1
    else:
        at = sets.names[slot] & bucket
        k = sets.heads[at]
        if k == slot:
            sets.heads[at] = sets.link[slot]
        else:
            while sets.link[k] != slot:
                k = sets.link[k]
            sets.link[k] = sets.link[slot]
    q = sets.energy[slot]
    q[:] = 0.0
    q[0], q[1], q[2] = -sets.base[2], -sets.base[0], sets.base[1]
    for i in range(m):
        f0, f1, f2 = sets.tableau[i, m], sets.tableau[i, m + 1], sets.tableau[i, m + 2]
        sets.rows[slot, 0, i], sets.rows[slot, 1, i], sets.rows[slot, 2, i] = f0, f1, f2
        sets.on[slot, i] = sets.here[i]
        if sets.here[i]:
            q[0] -= 0.5 * f0 * sets.b[i]
            q[1] += f0
            q[2] -= f0 * sets.x[i]
            q[3] += f1
            q[4] += 0.5 * (f2 - f1 * sets.x[i])
            q[5] -= f2 * sets.x[i]
    sets.names[slot] = name
    at = name & bucket
    sets.link[slot] = sets.heads[at]
    sets.heads[at] = slot
    outline(sets, slot)
    return slot


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def to_wanted(sets):
    """Pivot the tableau to the set `wanted`; False where a pivot is not positive."""
    for i in range(sets.x.size):
        if sets.here[i] != sets.wanted[i] and not pivot(sets, i):
            return False
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def build(sets, name):
    """Work out the set `wanted` and return its slot; -1 where the compliance is not positive definite on it.

    name: of the set. The tableau is pivoted to it, m^2 multiplications a node; where it has lost its digits it is
    written anew and pivoted once more.
    """
    if not to_wanted(sets) or refine(sets) > FLAW:
        renew(sets)
        if not to_wanted(sets) or refine(sets) > FLAW:
            return -1
    return store(sets, name)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find(sets, name):
    """Slot of the set `wanted` with this `name`; -1 where it is not kept. Equal names are told apart node by node."""
    k = sets.heads[name & (sets.heads.size - 1)]
    while k >= 0:
        if sets.names[k] == name:
            same = True
            for i in range(sets.x.size):
                if sets.on[k, i] != sets.wanted[i]:
                    same = False
                    break
            if same:
                return k
        k = sets.link[k]
    return k


@njit(error_model="numpy", fastmath=LEAST, **NJIT_NO_REFCOUNT)
def holds(sets, k, d, t):
    """Whether no node of set k fails at (d [m], t [rad]), and the bounds below which a node counts as failing.

    The bounds are a force [N] for nodes that touch and a gap [m] for open ones, both <= 0.
    """
    r0, r1, r2, on = sets.rows[k, 0], sets.rows[k, 1], sets.rows[k, 2], sets.on[k]
    top, pull, deep = 0.0, 0.0, 0.0
    for i in range(on.size):
        y = r0[i] + r1[i] * d + r2[i] * t
        term = abs(r0[i]) + abs(r1[i] * d) + abs(r2[i] * t)
        top = max(top, term if on[i] else 0.0)
        pull = min(pull, y if on[i] else 0.0)
        deep = min(deep, 0.0 if on[i] else y)
    force = -NOISE * top
    gap = -NOISE * (sets.base[3] + abs(d) + abs(t) * max(abs(sets.x[0]), abs(sets.x[-1])))
    return pull >= force and deep >= gap, force, gap


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def flip(sets, k, d, t, force, gap, alone):
    """Write set k with its failing nodes exchanged into `wanted` and return its name; `alone`: only the first of them."""
    name, searching = sets.names[k], True
    for i in range(sets.x.size):
        on = sets.on[k, i]
        y = sets.rows[k, 0, i] + sets.rows[k, 1, i] * d + sets.rows[k, 2, i] * t
        fails = searching and y < (force if on else gap)
        if fails:
            name ^= sets.node[i]
            searching = not alone
        sets.wanted[i] = on != fails
    return name


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def locate(sets, k, d, t):
    """Slot of the contact set at (d, t), searched from set k; -1 where none was found.

    Cost: 0.5 us for 400 nodes on a known set, 0.3 ms for a new one that differs by one node.
    """
    for count in range(BLOCKS + 10 * sets.x.size):
        if within(sets, k, d, t):
            return k
        good, force, gap = holds(sets, k, d, t)
        if good:
            return k
        name = flip(sets, k, d, t, force, gap, count >= BLOCKS)
        found = find(sets, name)
        k = found if found >= 0 else build(sets, name)
        if k < 0:
            return k
    return -1


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def begin(sets, name):
    """Work out the set `wanted` under its `name` from the empty set and return its slot; -1 as in `build`."""
    renew(sets)
    return build(sets, name)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def pull(sets, k, h, turn):
    """Energy of the preloaded contact of set k, and its slopes in heave h = -d and in turn.

    N = N0 - slope in heave, M = M0 - slope in turn.
    """
    q, d = sets.energy[k], -h
    by_d, by_t = q[3] * d + q[4] * turn, q[4] * d + q[5] * turn
    return q[0] + d * (q[1] + 0.5 * by_d) + turn * (q[2] + 0.5 * by_t), -(q[1] + by_d), q[2] + by_t


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def press_state(sets, k, d, t, force):
    """Load N [N], moment M [N m] and energy [J] of set k at (d [m], t [rad]); its nodal forces are written.

    force: (m,) [N] to write to; none is below zero.
    """
    energy, slope, turn = pull(sets, k, -d, t)
    for i in range(force.size):
        y = sets.rows[k, 0, i] + sets.rows[k, 1, i] * d + sets.rows[k, 2, i] * t
        force[i] = max(y, 0.0) if sets.on[k, i] else 0.0
    return sets.base[0] - slope, sets.base[1] - turn, energy
