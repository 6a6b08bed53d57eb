"""Compiled search for the contact set at a motion of the holder.

On each set forces and gaps are affine in the motion. The motion is measured from a reference state: closing d [m] and
rotation t [rad]. The unknowns y of a set are the forces of its nodes in contact and the gaps of the others. The linear
complementarity problem w = b + t x - d + C f then reads y = R (1, d, t). A node that enters or leaves the set is a
principal pivot of the tableau [T | R].

A set is stored under a 64-bit name, the exclusive or of the names of its nodes, so a state on a stored set costs one
pass over the nodes. The search exchanges all nodes of a wrong sign at once (block pivoting), and after
`N_BLOCK_EXCHANGES` sets only the first of them, which ends for every positive definite C (Murty, Opsearch 11, 1974).
`contact_sets.ContactSets` is the NumPy twin.
"""

from typing import NamedTuple

import numpy as np

from ..compiled.jit import njit
from .polygon_kernels import NJIT_NO_REFCOUNT, ROUND_OFF, is_inside, write_polygon

FASTMATH_FLAGS = {"reassoc", "contract", "arcp"}
# the compiler vectorises loops that search for a minimum only with these flags
FASTMATH_MINIMUM = FASTMATH_FLAGS | {"nnan", "nsz"}
N_BLOCK_EXCHANGES = 12  # sets that are tried with all failing nodes exchanged; more may cycle
# relative residual above which the tableau is computed anew; below it one refinement reaches rounding errors
MAX_TABLEAU_RESIDUAL = 1e-8
# indices into `SetArrays.meta`
COUNT = 0  # number of sets that are stored
SLOT = 1  # slot of the next set
BUILT = 2  # number of sets computed so far
PIVOTS = 3  # number of pivots so far
RENEWED = 4  # number of times that the tableau was computed anew


class SetArrays(NamedTuple):
    """Contact sets of m nodes, with slots for k sets.

    Interface:

    - c (m, m) [m/N]; x (m,) [m]; b (m,) openings of the reference state without forces [m].
    - base (5,): load, moment and energy of the reference state, the size of its openings, and its
      dN/d(delta).
    - node (m,): 64-bit names of the nodes.

    Tableau: tableau (m, m + 3), here (m,) the set to which it is pivoted, wanted (m,) the set that is
    searched for, side (2, 3, m) and row (m + 3,) workspaces.

    Stored sets:

    - on (k, m): nodes in contact; rows (k, 3, m): force or gap of the nodes per (1, d, t).
    - energy (k, 6): coefficients of 1, d, t, d^2/2, d t, t^2/2 of the energy of the preloaded contact.
    - names (k,), heads, link: names of the sets and their hash chains; meta (5,): `COUNT` to `RENEWED`.

    Polygons of motions on which a set holds:

    - sides (k,): number of sides; 0 if there is no polygon, and all nodes have to be checked.
    - edge (k, MAX_SIDES): node of each side; beside (k, MAX_SIDES): slot of the set beyond it, or -1.
    - limit (k, 2): force [N] and gap [m] below which a node fails; corner (2, 3, 4 MAX_SIDES): workspace.
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
    """Exchange force and gap of node k in the tableau; False if the pivot is not positive.

    Cost: m^2 multiplications.
    """
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
def reset_tableau(sets):
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
def refine_rows(sets):
    """Refine the tableau by one iterative step with C; return the relative residual before."""
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
    for i in range(m if worst > 1e-15 else 0):  # a residual at round-off cannot be refined
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
def store_set(sets, name):
    """Store the set of the tableau in the next slot and return the slot.

    Without a free slot the oldest set is dropped.
    """
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
    write_polygon(sets, slot)
    return slot


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def pivot_to_target_set(sets):
    """Pivot the tableau to the contact set `sets.wanted`; False if a pivot is not positive."""
    for i in range(sets.x.size):
        if sets.here[i] != sets.wanted[i] and not pivot(sets, i):
            return False
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def build_set(sets, name):
    """Compute the contact set `sets.wanted` and return its slot.

    The slot is -1 if the compliance is not positive definite on the set.

    name: name of the set. The tableau is pivoted to it. If it has lost its digits, it is computed anew and
    pivoted once more. Cost: m^2 multiplications for each node that is exchanged.
    """
    if not pivot_to_target_set(sets) or refine_rows(sets) > MAX_TABLEAU_RESIDUAL:
        reset_tableau(sets)
        if not pivot_to_target_set(sets) or refine_rows(sets) > MAX_TABLEAU_RESIDUAL:
            return -1
    return store_set(sets, name)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_stored(sets, name):
    """Return the slot of the set `wanted`, or -1 if it is not stored.

    name: name of the set; sets of equal names are compared node by node.
    """
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


@njit(error_model="numpy", fastmath=FASTMATH_MINIMUM, **NJIT_NO_REFCOUNT)
def check_set(sets, k, d, t):
    """Return whether set k holds at a motion, and the force and gap below which nodes fail.

    d [m], t [rad]: motion of the holder. Both bounds [N] and [m] are <= 0, by the rounding error of a force and of a
    gap.
    """
    r0, r1, r2, on = sets.rows[k, 0], sets.rows[k, 1], sets.rows[k, 2], sets.on[k]
    top, compute_energy, deep = 0.0, 0.0, 0.0
    for i in range(on.size):
        y = r0[i] + r1[i] * d + r2[i] * t
        term = abs(r0[i]) + abs(r1[i] * d) + abs(r2[i] * t)
        top = max(top, term if on[i] else 0.0)
        compute_energy = min(compute_energy, y if on[i] else 0.0)
        deep = min(deep, 0.0 if on[i] else y)
    force = -ROUND_OFF * top
    gap = -ROUND_OFF * (sets.base[3] + abs(d) + abs(t) * max(abs(sets.x[0]), abs(sets.x[-1])))
    return compute_energy >= force and deep >= gap, force, gap


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def exchange_failing(sets, k, d, t, force, gap, is_single):
    """Write set k with its failing nodes exchanged to `wanted`, and return its name.

    force [N], gap [m]: bounds from `check_set`; is_single: only the first failing node is exchanged.
    """
    name, searching = sets.names[k], True
    for i in range(sets.x.size):
        on = sets.on[k, i]
        y = sets.rows[k, 0, i] + sets.rows[k, 1, i] * d + sets.rows[k, 2, i] * t
        fails = searching and y < (force if on else gap)
        if fails:
            name ^= sets.node[i]
            searching = not is_single
        sets.wanted[i] = on != fails
    return name


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def find_set(sets, k, d, t):
    """Find the contact set at a motion (d [m], t [rad]) from set k; return its slot or -1.

    Cost: 0.5 us for 400 nodes on a known set, 0.3 ms for a new one that differs by one node.
    """
    for count in range(N_BLOCK_EXCHANGES + 10 * sets.x.size):
        if is_inside(sets, k, d, t):
            return k
        good, force, gap = check_set(sets, k, d, t)
        if good:
            return k
        name = exchange_failing(sets, k, d, t, force, gap, count >= N_BLOCK_EXCHANGES)
        found = find_stored(sets, name)
        k = found if found >= 0 else build_set(sets, name)
        if k < 0:
            return k
    return -1


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def build_first_set(sets, name):
    """Compute the contact set `sets.wanted` from an empty tableau and return its slot.

    name: name of the set. The slot is -1 if the compliance is not positive definite on the set.
    """
    reset_tableau(sets)
    return build_set(sets, name)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def compute_energy(sets, k, h, turn):
    """Return the energy [J] of the preloaded contact on set k, and the slopes of the energy.

    The slopes are those in heave h = -d and in rotation. The load is N0 less the slope in heave, the moment M0 less
    that in rotation.
    """
    q, d = sets.energy[k], -h
    by_d, by_t = q[3] * d + q[4] * turn, q[4] * d + q[5] * turn
    return q[0] + d * (q[1] + 0.5 * by_d) + turn * (q[2] + 0.5 * by_t), -(q[1] + by_d), q[2] + by_t


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def press_state(sets, k, d, t, force):
    """Return load [N], moment [N m] and energy [J] of set k, and write the nodal forces.

    d [m], t [rad]: motion of the holder. force: (m,) array [N] for the forces, which are >= 0.
    """
    energy, slope, turn = compute_energy(sets, k, -d, t)
    for i in range(force.size):
        y = sets.rows[k, 0, i] + sets.rows[k, 1, i] * d + sets.rows[k, 2, i] * t
        force[i] = max(y, 0.0) if sets.on[k, i] else 0.0
    return sets.base[0] - slope, sets.base[1] - turn, energy
