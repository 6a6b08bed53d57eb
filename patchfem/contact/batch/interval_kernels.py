"""Compiled parts of the contacts of one stretch of nodes: what a body is to all cases, and where their stretches end.

With C = U^T U on the nodes from a on, the leading blocks of U are the factors of every stretch that begins at a. One
forward substitution of a gap tells of every right end at once what closing and rotation it takes, the force of its last
node and the gap at the next one:

    C f = closing - theta x - g on the stretch,    sum f = N,    sum f x = M + K theta.

The substitution back has the force of the first node, which says whether the contact begins further on. The factor from
a + 1 on is that from a on with its first row added to the rest, by rotations that lose no digits. NumPy twin:
`unilateral.solve`, a case at a time. Bodies are those of `arrays`; `intervals` substitutes for many cases at once.
"""

from math import sqrt

from ...compiled.jit import njit
from ..polygon_kernels import NJIT_NO_REFCOUNT

FASTMATH_FLAGS = {"reassoc", "contract", "arcp"}


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def drop(upper, a, side):
    """From the factor of the nodes from a on to that of those from a + 1 on, in its place; side (m,): scratch."""
    m = side.size
    for i in range(a + 1, m):
        side[i] = upper[a, i]
    for j in range(a + 1, m):
        size = sqrt(upper[j, j] * upper[j, j] + side[j] * side[j])
        c, s = upper[j, j] / size, side[j] / size
        upper[j, j] = size
        for i in range(j + 1, m):
            u, v = upper[j, i], side[i]
            upper[j, i] = c * u + s * v
            side[i] = c * v - s * u


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def forward(upper, a, stop, y):
    """Solve U^T y = y on the nodes from a to stop, in its place."""
    for j in range(a, stop):
        here = y[j] / upper[j, j]
        y[j] = here
        for i in range(j + 1, stop):
            y[i] -= upper[j, i] * here


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def motions(body, a):
    """Write `side` and the row of the table of the stretches that begin at a."""
    one, arm, m = body.side[0], body.side[1], body.x.size
    for i in range(a, m):
        one[i], arm[i] = 1.0, body.x[i]
    forward(body.upper, a, m, one)
    forward(body.upper, a, m, arm)
    for i in range(a, m):
        body.table[a, 0, i + 1] = body.table[a, 0, i] + one[i] * one[i]
        body.table[a, 1, i + 1] = body.table[a, 1, i] + one[i] * arm[i]
        body.table[a, 2, i + 1] = body.table[a, 2, i] + arm[i] * arm[i]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def rigid(load, moment, spring, turns, sums, stop):
    """(closing [m], theta [rad]) of a stretch up to stop, whose sums are a row of the table; theta 0 where it is held.

    closing a - theta b = load,  closing b - theta (c + spring) = moment.
    """
    a, b, c = sums[0, stop], sums[1, stop], sums[2, stop] + spring
    if not turns:
        return load / a, 0.0
    whole = a * c - b * b
    return (load * c - moment * b) / whole, (load * b - moment * a) / whole


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def right_end(body, y, a, stop, load, moment, spring, turns):
    """End of the largest stretch from a on whose last node pushes and whose next one stays open, 0 where there is none
    before stop. y (k,): U^-T of the gap from a on."""
    one, arm, out, m = body.side[0], body.side[1], 0, body.x.size
    for i in range(a, stop):
        load += y[i - a] * one[i]
        moment += y[i - a] * arm[i]
        closing, theta = rigid(load, moment, spring, turns, body.table[a], i + 1)
        push = closing * one[i] - theta * arm[i] - y[i - a] > 0
        n = min(i + 1, m - 1)
        stays = i + 1 == m or (i + 1 < stop and closing * one[n] - theta * arm[n] - y[n - a] <= 0)
        # of a few nodes a free rotation is round-off, which may look like a contact
        if push and stays:
            out = i + 1
    return out


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def walk(body, a, b, begins):
    """Go from the left end a to b: `upper` becomes the factor from b on, `side` and the rows of the table up to b are
    written; begins: that of a as well. Cost: 2 m^2 multiplications a left end."""
    if begins:
        motions(body, a)
    for k in range(a, b):
        drop(body.upper, k, body.room)
        motions(body, k + 1)


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def pushes(body, a, y, reach, target, stop, moved, turns):
    """From U^-T of gaps to what U^-1 makes of them the forces of stretches that begin at a.

    y (n, k): of n cases on k nodes from a on, in its place, 0 beyond the stretch; reach (n,): node before which the
    right end is sought of a case whose stop (n,) is 0, which stays 0 where none is found; target (n, 3): as of
    `arrays.Cases`; moved (n, 2): closing [m] and theta [rad], written; turns: the rotation is free.
    """
    one, arm = body.side[0], body.side[1]
    for k in range(stop.size):
        load, moment, spring, row = target[k, 0], target[k, 1], target[k, 2], y[k]
        if stop[k] == 0:
            stop[k] = right_end(body, row, a, reach[k], load, moment, spring, turns)
        end = max(stop[k], a)
        for i in range(a, end):
            load += row[i - a] * one[i]
            moment += row[i - a] * arm[i]
        closing, theta = (
            rigid(load, moment, spring, turns, body.table[a], end) if end > a else (0.0, 0.0)
        )
        for i in range(a, end):
            row[i - a] = closing * one[i] - theta * arm[i] - row[i - a]
        row[end - a :] = 0.0
        moved[k, 0], moved[k, 1] = closing, theta
