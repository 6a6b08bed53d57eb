"""Compiled polygons of the rigid displacements (d, t) for which a contact set is valid.

Each node of a set limits these motions to one side of a line. The lines enclose a convex polygon, of
which only a few are sides, so comparing a motion with the sides is faster than checking all nodes.
`sets` is a `set_arrays.SetArrays`; motions are d [m] and t [rad].
"""

from typing import NamedTuple

import numpy as np

from ..compiled.flags_kernels import NJIT_NO_REFCOUNT
from ..compiled.jit import njit
from .set_arrays import MAX_POLYGON_SIDES, REFERENCE_OPENING

# Rounding error of a force or gap, relative to the largest of its terms
CONDITION_ROUND_OFF = 1e-13
# Half width of the box in which polygons are computed, in the units of `polygon_units`
BOX_HALF_WIDTH = 100.0


class HalfPlane(NamedTuple):
    """Half plane of rigid displacements (d, t) with constant + by_d d + by_t t >= 0: a contact condition of a node."""

    constant: float
    by_d: float
    by_t: float


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def polygon_units(sets):
    """Return the units of displacement [m] and rotation [rad] in which polygons are computed.

    They are the size of the openings of the reference state, and this size over the largest |x|.
    """
    size = sets.reference[REFERENCE_OPENING]
    arm = max(abs(sets.x[0]), abs(sets.x[-1]))
    return size, size / arm if arm > 0 else 1.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def write_limits(sets, slot):
    """Compute the force and the gap below which a node violates its contact condition."""
    unit_d, unit_t = polygon_units(sets)
    constant = sets.stored.unknowns[slot, 0]
    by_d = sets.stored.unknowns[slot, 1]
    by_t = sets.stored.unknowns[slot, 2]
    in_contact = sets.stored.in_contact[slot]
    largest = 0.0
    for i in range(in_contact.size):
        if in_contact[i]:
            term = abs(constant[i]) + abs(by_d[i]) * unit_d + abs(by_t[i]) * unit_t
            largest = max(largest, term)
    sets.polygons.limits[slot, 0] = -4 * CONDITION_ROUND_OFF * largest
    sets.polygons.limits[slot, 1] = -4 * CONDITION_ROUND_OFF * unit_d


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def half_plane_value(half_plane, d, t):
    """Evaluate the linear function that is negative outside a half plane.

    Parameters
    ----------
    half_plane : HalfPlane
        Coefficients of the function.
    d, t : float
        Rigid displacement in the units of the half plane.

    Returns
    -------
    float
        Force [N] or gap [m] above its limit.
    """
    return half_plane.constant + half_plane.by_d * d + half_plane.by_t * t


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def clip_polygon(old, new, n_corners, half_plane, node):
    """Clip a polygon by a half plane and return its number of corners.

    The method is that of Sutherland and Hodgman (Comm. ACM 17, 32, 1974).

    Parameters
    ----------
    old, new : (3, k) ndarray
        Corners before and after; `new` is written. A corner has two coordinates and the node whose
        line leads to the next corner, -1 for the box.
    n_corners : int
        Number of corners before.
    half_plane : HalfPlane
        Half plane that is kept, in the units of the corners.
    node : int
        Node whose contact condition is the half plane.

    Returns
    -------
    int
        Number of corners, -1 if `new` has too few columns for them.
    """
    n_new = 0
    for k in range(n_corners):
        follower = k + 1 if k + 1 < n_corners else 0
        a = half_plane_value(half_plane, old[0, k], old[1, k])
        b = half_plane_value(half_plane, old[0, follower], old[1, follower])
        if n_new + 2 > new.shape[1]:
            return -1

        # A corner inside stays; where an edge crosses the line, the crossing is a new corner
        if a >= 0:
            for r in range(3):
                new[r, n_new] = old[r, k]
            n_new += 1
        if (a >= 0) != (b >= 0):
            fraction = a / (a - b)
            new[0, n_new] = old[0, k] + fraction * (old[0, follower] - old[0, k])
            new[1, n_new] = old[1, k] + fraction * (old[1, follower] - old[1, k])
            new[2, n_new] = node if a >= 0 else old[2, k]
            n_new += 1
    return n_new


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def write_polygon(sets, slot):
    """Compute the polygon of rigid displacements for which a stored contact set is valid.

    It is a box of motions, clipped by one line for each node: that of the motions at which the node
    would enter or leave the contact. Nodes at the ends of the contact come first, because they cut off
    most. A set with too many sides gets no polygon.
    """
    polygons = sets.polygons
    unit_d, unit_t = polygon_units(sets)
    unknowns = sets.stored.unknowns[slot]
    in_contact = sets.stored.in_contact[slot]
    n_nodes = in_contact.size
    write_limits(sets, slot)

    # The box, whose sides belong to no node
    polygons.n_sides[slot] = 0
    old = polygons.corners[0]
    new = polygons.corners[1]
    n_corners = 4
    for k in range(4):
        old[0, k] = BOX_HALF_WIDTH * (-1 if k in (0, 3) else 1)
        old[1, k] = BOX_HALF_WIDTH * (-1 if k < 2 else 1)
        old[2, k] = -1.0

    # The first round clips by the nodes at the ends of the contact, the second one by the others
    for step in range(2 * n_nodes):
        i = step % n_nodes
        is_end = i == 0 or i == n_nodes - 1
        is_end = is_end or in_contact[i] != in_contact[i - 1] or in_contact[i] != in_contact[i + 1]
        if is_end != (step < n_nodes):
            continue

        # The condition of the node; it cuts nothing if all corners meet it
        limit = polygons.limits[slot, 0 if in_contact[i] else 1]
        half_plane = HalfPlane(
            unknowns[0, i] - limit, unknowns[1, i] * unit_d, unknowns[2, i] * unit_t
        )
        min_value = np.inf
        for k in range(n_corners):
            min_value = min(min_value, half_plane_value(half_plane, old[0, k], old[1, k]))
        if min_value >= 0:
            continue
        n_corners = clip_polygon(old, new, n_corners, half_plane, i)
        if n_corners <= 0:
            return
        old, new = new, old

    # The nodes that are sides, without the sides of the box
    n_sides = 0
    for k in range(n_corners):
        if old[2, k] >= 0:
            if n_sides == MAX_POLYGON_SIDES:
                return
            polygons.nodes[slot, n_sides] = int(old[2, k])
            polygons.neighbours[slot, n_sides] = -1
            n_sides += 1
    polygons.n_sides[slot] = n_sides


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def is_in_box(sets, d, t):
    """Return whether a rigid displacement lies in the region in which polygons are computed.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets.
    d, t : float
        Displacement [m] and rotation [rad].

    Returns
    -------
    bool
    """
    unit_d, unit_t = polygon_units(sets)
    return abs(d) <= BOX_HALF_WIDTH * unit_d and abs(t) <= BOX_HALF_WIDTH * unit_t


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def side_margin(sets, slot, side, d, t):
    """Return the margin by which the force [N] or gap [m] of a polygon side exceeds its limit.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets.
    slot : int
        Slot of the set.
    side : int
        Side of the polygon of the set.
    d, t : float
        Displacement [m] and rotation [rad].

    Returns
    -------
    float
        Negative beyond the side.
    """
    i = sets.polygons.nodes[slot, side]
    limit = sets.polygons.limits[slot, 0 if sets.stored.in_contact[slot, i] else 1]
    unknowns = sets.stored.unknowns
    return unknowns[slot, 0, i] + unknowns[slot, 1, i] * d + unknowns[slot, 2, i] * t - limit


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def is_inside(sets, slot, d, t):
    """Return whether a rigid displacement lies in the polygon of a contact set.

    This takes a few multiplications per side, instead of one pass over the nodes.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets.
    slot : int
        Slot of the set.
    d, t : float
        Displacement [m] and rotation [rad].

    Returns
    -------
    bool
    """
    n_sides = sets.polygons.n_sides[slot]
    if n_sides == 0 or not is_in_box(sets, d, t):
        return False
    for side in range(n_sides):
        if side_margin(sets, slot, side, d, t) < 0:
            return False
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_exit(sets, slot, d, t, dd, dt):
    """Find the point at which an increment of the rigid displacement leaves a polygon.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets.
    slot : int
        Slot of the set.
    d, t : float
        Motion [m] and [rad] at which the increment begins.
    dd, dt : float
        The increment.

    Returns
    -------
    fraction : float
        Fraction of the increment; inf if it stays inside or the set has no polygon.
    side : int
        Side of the polygon; -1 if there is none.
    """
    first_fraction = np.inf
    first_side = -1
    has_polygon = sets.polygons.n_sides[slot] > 0
    if not (has_polygon and is_in_box(sets, d, t) and is_in_box(sets, d + dd, t + dt)):
        return first_fraction, first_side
    for side in range(sets.polygons.n_sides[slot]):
        margin = side_margin(sets, slot, side, d, t)
        rate = side_margin(sets, slot, side, d + dd, t + dt) - margin
        if rate < 0 and max(margin, 0.0) < -rate * first_fraction:
            first_fraction = max(margin, 0.0) / -rate
            first_side = side
    return first_fraction, first_side
