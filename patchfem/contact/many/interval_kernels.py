"""Compiled contacts of one stretch of nodes: all cases of a mesh in one pass along its left ends.

With C = U^T U on the nodes from a on, the leading blocks of U are the factors of every stretch that begins at a. One
forward substitution of a gap tells of every right end at once what closing and rotation it takes, the force of its last
node and the gap at the next one:

    C f = closing - theta x - g on the stretch,    sum f = N,    sum f x = M + K theta.

The substitution back has the force of the first node, which says whether the contact begins further on. The factor from
a + 1 on is that from a on with its first row added to the rest, by rotations that lose no digits. NumPy twin:
`unilateral.solve`, a case at a time. Bodies and cases are those of `arrays`.
"""

from math import sqrt

from ...compiled.inner import njit
from ..polygon_kernels import LEAN

FAST = {"reassoc", "contract", "arcp"}


@njit(error_model="numpy", fastmath=FAST, **LEAN)
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


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def forward(upper, a, stop, y):
    """Solve U^T y = y on the nodes from a to stop, in its place."""
    for j in range(a, stop):
        here = y[j] / upper[j, j]
        y[j] = here
        for i in range(j + 1, stop):
            y[i] -= upper[j, i] * here


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def back(upper, a, stop, f):
    """Solve U f = f on the nodes from a to stop, in its place."""
    for j in range(stop - 1, a - 1, -1):
        rest = 0.0
        for i in range(j + 1, stop):
            rest += upper[j, i] * f[i]
        f[j] = (f[j] - rest) / upper[j, j]


@njit(error_model="numpy", fastmath=FAST, **LEAN)
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


@njit(error_model="numpy", **LEAN)
def rigid(load, moment, spring, turns, sums, stop):
    """(closing [m], theta [rad]) of a stretch up to stop, whose sums are a row of the table; theta 0 where it is held.

    closing a - theta b = load,  closing b - theta (c + spring) = moment.
    """
    a, b, c = sums[0, stop], sums[1, stop], sums[2, stop] + spring
    if not turns:
        return load / a, 0.0
    whole = a * c - b * b
    return (load * c - moment * b) / whole, (load * b - moment * a) / whole


@njit(error_model="numpy", **LEAN)
def right_end(body, y, a, stop, load, moment, spring, turns):
    """(end of the largest stretch from a on whose last node pushes and whose next one stays open, load and moment with
    what its gap takes of both); an end of 0 where there is none before stop. y (m,): U^-T of the gap."""
    one, arm, out, m = body.side[0], body.side[1], 0, body.x.size
    for i in range(a, stop):
        load += y[i] * one[i]
        moment += y[i] * arm[i]
        closing, theta = rigid(load, moment, spring, turns, body.table[a], i + 1)
        push = closing * one[i] - theta * arm[i] - y[i] > 0
        n = min(i + 1, m - 1)
        stays = i + 1 == m or (i + 1 < stop and closing * one[n] - theta * arm[n] - y[n] <= 0)
        if push and stays:  # of a few nodes a free rotation is round-off, which may look like a contact
            out = i + 1
    return out


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def forces(body, y, a, stop, load, moment, spring, turns, out):
    """Write the forces of a stretch to out (m,); (closing, theta) of it."""
    one, arm = body.side[0], body.side[1]
    for i in range(a, stop):
        load += y[i] * one[i]
        moment += y[i] * arm[i]
    closing, theta = rigid(load, moment, spring, turns, body.table[a], stop)
    for i in range(a, stop):
        out[i] = closing * one[i] - theta * arm[i] - y[i]
    back(body.upper, a, stop, out)
    return closing, theta


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def opening(body, gap, force, a, stop, moved, i):
    """Opening [m] of node i under the forces of a stretch."""
    bent = 0.0
    for j in range(a, stop):
        bent += body.c[i, j] * force[j]
    return gap[i] + moved[1] * body.x[i] - moved[0] + bent


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def refine(body, gap, force, moved, a, stop, target, turns):
    """Take what round-off left of openings inside, of load and moment out of the forces and the motion `moved` (2,)."""
    y, more = body.room[0], body.room[1]
    load, moment = target[0], target[1] + target[2] * moved[1]
    for i in range(a, stop):
        y[i] = opening(body, gap, force, a, stop, moved, i)
        load -= force[i]
        moment -= force[i] * body.x[i]
    forward(body.upper, a, stop, y)
    closing, theta = forces(body, y, a, stop, load, moment, target[2], turns, more)
    for i in range(a, stop):
        force[i] += more[i]
    moved[0] += closing
    moved[1] += theta


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def paces(body, gap, force, moved, a, stop, out):
    """Write `Cases.pace` of a stretch to out (2, 2)."""
    rise, upper, one = body.room[1], body.upper, body.side[0]
    if stop < body.x.size:
        out[1, 0] = force[stop - 1] * upper[stop - 1, stop - 1] / one[stop - 1]
        out[1, 1] = opening(body, gap, force, a, stop, moved, stop) / (upper[stop, stop] * one[stop])
    if a > 0:
        for i in range(a, stop):
            rise[i] = one[i]
        back(upper, a, stop, rise)
        fall = 1.0
        for j in range(a, stop):
            fall -= body.c[a - 1, j] * rise[j]
        out[0, 0] = force[a] / rise[a]
        out[0, 1] = opening(body, gap, force, a, stop, moved, a - 1) / fall


@njit(error_model="numpy", **LEAN)
def contact(body, cases, k, a, turns):
    """Solve case k with a contact that begins at a; False where it begins further on."""
    m, y, gap, target, force, moved = body.x.size, body.room[0], cases.gap[k], cases.target[k], cases.force[k], \
        cases.moved[k]
    reach, end = min(cases.reach[k], m), 0
    while not end:
        for i in range(a, reach):
            y[i] = gap[i]
        forward(body.upper, a, reach, y)
        end = right_end(body, y, a, reach, target[0], target[1], target[2], turns)
        if not end and reach == m:
            return False
        reach = m if not end else reach
    moved[0], moved[1] = forces(body, y, a, end, target[0], target[1], target[2], turns, force)
    if not force[a] > 0:
        for i in range(a, end):
            force[i] = 0.0
        return False
    refine(body, gap, force, moved, a, end, target, turns)
    paces(body, gap, force, moved, a, end, cases.pace[k])
    cases.first[k], cases.stop[k] = a, end
    return True


@njit(error_model="numpy", cache=True, **LEAN)
def press(body, cases, low, high, tries, turns):
    """Press all cases of a body and fill the rows of its table from `low` to `high` and beside every stretch.

    low: the left end that `body.upper` is the factor from; tries: left ends that are tried; turns: the rotation is
    free. Cost: 2 m^2 multiplications a left end and 4 k^2 a case of k nodes.
    """
    m, waiting = body.x.size, cases.begin.size
    for k in range(waiting):
        cases.link[k] = cases.heads[cases.begin[k]]
        cases.heads[cases.begin[k]] = k
    a = low
    while a < m and (a <= high or waiting > 0):
        motions(body, a)
        k = cases.heads[a]
        while k >= 0:
            after = cases.link[k]
            if contact(body, cases, k, a, turns):
                waiting -= 1
                high = max(high, a + 1)
            elif a + 1 < m and a + 1 < cases.begin[k] + tries:
                cases.link[k] = cases.heads[a + 1]
                cases.heads[a + 1] = k
            else:
                waiting -= 1
            k = after
        drop(body.upper, a, body.room[0])
        a += 1
