"""Compiled solution of contacts on a single run of consecutive nodes.

The kernels update the factors of nested stretches and find the right ends of the contacts. With C = U^T U on the nodes
from a on, the leading blocks of U are the factors of all stretches that begin at a. One forward substitution of the gap
gives, for every right end at once, the closing and the rotation, the force of the last node and the gap at the next
node of

    C f = closing - theta x - g on the stretch,    sum f = N,    sum f x = M + K theta.

The backward substitution gives the force of the first node, which shows whether the contact begins further
right. The factor from a + 1 on is a rank-one update of that from a on: the first row is added by Givens
rotations, which lose no digits. `unilateral.solve` is the NumPy twin, case by case. `stretches` is an
`arrays.NestedStretches`.
"""

from math import sqrt

from ...compiled.jit import njit
from ..polygon_kernels import NJIT_NO_REFCOUNT

FASTMATH_FLAGS = {"reassoc", "contract", "arcp"}


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def drop_first_node(upper, a, row):
    """Update a Cholesky factor in place after its first node is removed.

    Parameters
    ----------
    upper : (m, m) ndarray
        Upper factor; only its rows and columns from a on are used.
    a : int
        First node of the stretches.
    row : (m,) ndarray
        Workspace.
    """
    n_nodes = row.size
    for i in range(a + 1, n_nodes):
        row[i] = upper[a, i]
    for j in range(a + 1, n_nodes):
        size = sqrt(upper[j, j] * upper[j, j] + row[j] * row[j])
        cosine = upper[j, j] / size
        sine = row[j] / size
        upper[j, j] = size
        for i in range(j + 1, n_nodes):
            old_entry = upper[j, i]
            row_entry = row[i]
            upper[j, i] = cosine * old_entry + sine * row_entry
            row[i] = cosine * row_entry - sine * old_entry


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def substitute_forward(upper, a, stop, y):
    """Solve U^T z = y in place for a run of consecutive nodes.

    Parameters
    ----------
    upper : (m, m) ndarray
        Upper factor U.
    a, stop : int
        First node of the stretch, and the node after its last one.
    y : (m,) ndarray
        Right-hand side, overwritten on the stretch.
    """
    for j in range(a, stop):
        value = y[j] / upper[j, j]
        y[j] = value
        for i in range(j + 1, stop):
            y[i] -= upper[j, i] * value


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def write_sums(stretches, a):
    """Compute the sums for all runs of consecutive nodes that begin at a given node."""
    closing = stretches.unit[0]
    arm = stretches.unit[1]
    sums = stretches.sums[a]
    n_nodes = stretches.x.size
    for i in range(a, n_nodes):
        closing[i] = 1.0
        arm[i] = stretches.x[i]
    substitute_forward(stretches.upper, a, n_nodes, closing)
    substitute_forward(stretches.upper, a, n_nodes, arm)
    for i in range(a, n_nodes):
        sums[0, i + 1] = sums[0, i] + closing[i] * closing[i]
        sums[1, i + 1] = sums[1, i] + closing[i] * arm[i]
        sums[2, i + 1] = sums[2, i] + arm[i] * arm[i]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_motion(load, moment, spring, is_free, sums, stop):
    """Return the approach [m] and rotation [rad] of the holder for one contiguous set of nodes in contact.

    With the sums a, b and c of the stretch, the equations are closing a - theta b = load and
    closing b - theta (c + spring) = moment; theta is 0 unless it is free.

    Parameters
    ----------
    load, moment, spring : float
        Load [N] and moment [N m], both with the part of the gap, and stiffness [N m/rad].
    is_free : int
        1 if the rotation is free, else 0.
    sums : (3, m + 1) ndarray
        Sums of one left end, from `write_sums`.
    stop : int
        Node after the last one of the stretch.

    Returns
    -------
    closing, theta : float
    """
    a = sums[0, stop]
    b = sums[1, stop]
    c = sums[2, stop] + spring
    if not is_free:
        return load / a, 0.0
    determinant = a * c - b * b
    return (load * c - moment * b) / determinant, (load * b - moment * a) / determinant


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_end(stretches, a, y, limit, loads, is_free):
    """Find the end of the longest run of nodes that begins at a given node and ends at a contact edge.

    The last node of the stretch is pressed, and the next node is open.

    Parameters
    ----------
    stretches : arrays.NestedStretches
    a : int
        First node of the stretch.
    y : (k,) ndarray
        U^-T of the gap from a on.
    limit : int
        Node before which the stretch has to end.
    loads : (3,) ndarray
        As in `arrays.Cases`.
    is_free : int
        1 if the rotation is free, else 0.

    Returns
    -------
    int
        Node after the last one of the stretch, 0 if there is no such stretch.
    """
    unit_closing = stretches.unit[0]
    unit_arm = stretches.unit[1]
    load = loads[0]
    moment = loads[1]
    n_nodes = stretches.x.size
    end = 0
    for i in range(a, limit):
        load += y[i - a] * unit_closing[i]
        moment += y[i - a] * unit_arm[i]
        closing, theta = solve_motion(load, moment, loads[2], is_free, stretches.sums[a], i + 1)
        is_pressed = closing * unit_closing[i] - theta * unit_arm[i] - y[i - a] > 0
        is_open = i + 1 == n_nodes
        # With few nodes in contact, a free rotation is a rounding error, which may look like a
        # contact.
        if i + 1 < limit:
            n = i + 1
            is_open = closing * unit_closing[n] - theta * unit_arm[n] - y[n - a] <= 0
        if is_pressed and is_open:
            end = i + 1
    return end


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def move_left_end(stretches, a, b, is_start):
    """Move the left end of the runs of nodes, and update factor and sums node by node.

    A step by one node takes 2 m^2 multiplications.

    Parameters
    ----------
    stretches : arrays.NestedStretches
        Written.
    a, b : int
        Left ends before and after.
    is_start : int
        1 if the sums of the left end a are written as well, else 0.
    """
    if is_start:
        write_sums(stretches, a)
    for k in range(a, b):
        drop_first_node(stretches.upper, k, stretches.workspace)
        write_sums(stretches, k + 1)


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def solve_ends(stretches, a, y, limits, loads, stop, motion, is_free):
    """Find right contact ends, holder motions and scaled forces of n cases with one left end.

    Parameters
    ----------
    stretches : arrays.NestedStretches
    a : int
        Left end.
    y : (n, k) ndarray
        U^-T of the gaps on k nodes from a on; replaced by U f, which is 0 beyond the stretch.
    limits : (n,) ndarray
        Nodes before which right ends are searched.
    loads : (n, 3) ndarray
        As in `arrays.Cases`.
    stop : (n,) ndarray
        Right ends; where it is 0 one is searched, and it stays 0 if there is none.
    motion : (n, 2) ndarray
        Closing [m] and theta [rad], written.
    is_free : int
        1 if the rotation is free, else 0.
    """
    unit_closing = stretches.unit[0]
    unit_arm = stretches.unit[1]
    for k in range(stop.size):
        row = y[k]
        if stop[k] == 0:
            stop[k] = find_end(stretches, a, row, limits[k], loads[k], is_free)
        end = max(stop[k], a)
        load = loads[k, 0]
        moment = loads[k, 1]
        for i in range(a, end):
            load += row[i - a] * unit_closing[i]
            moment += row[i - a] * unit_arm[i]
        closing = 0.0
        theta = 0.0
        if end > a:
            closing, theta = solve_motion(
                load, moment, loads[k, 2], is_free, stretches.sums[a], end
            )
        for i in range(a, end):
            row[i - a] = closing * unit_closing[i] - theta * unit_arm[i] - row[i - a]
        row[end - a :] = 0.0
        motion[k, 0] = closing
        motion[k, 1] = theta
