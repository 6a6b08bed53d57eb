"""Forces and slopes of elastic-plastic or bond points coupled by shear modes (compiled).

The bonds have order p = 1 and the stretch form of the law (friction.reading = "stretch"). A step
uses the path mean of the forces under the load in the row LOAD; `ending` selects the forces after
the slide.
"""

from ...compiled.jit import njit
from ...friction.bonds.point_kernels import (
    MAX_SHORT_PATH,
    bond_end_stretch,
    bond_mean,
    short_bond_mean,
)
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ...friction.laws.elastic_plastic_kernels import spring_end, spring_mean
from .arrays import PointRow

# Types of point friction law: elastic-plastic springs or bonds.
PLASTIC = 1
POINTS = 2
# The constants are described in `shear_lists_kernels`; the forces here neither jump nor decrease.
GOAL_SLACK = 100.0
FORCE_MAY_FALL = False
STEP_DAMPING = 0.0


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def are_slides_short(contact, length):
    """Return whether all slides are at most MAX_SHORT_PATH bond lengths; False for nan."""
    points = contact.points
    near = 0.0
    for j in range(int(contact.count[0])):
        # The count is a sum, because the compiler vectorises sums but not maxima.
        near += 1.0 if abs(points[PointRow.SLIDE, j]) <= MAX_SHORT_PATH * length else 0.0
    return near == contact.count[0]


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def write_forces(kind, ending, contact):
    """Write the force [N] and slope [N/m] >= 0 of every point for its slide.

    Parameters
    ----------
    kind : int
        Kind of the law of the points, PLASTIC or POINTS.
    ending : bool
        Whether the pieces relax while the holder is at rest.
    contact : arrays.ShearedPoints

    Returns
    -------
    float
        Friction force [N].
    """
    points = contact.points
    weight = contact.weight
    length = contact.eps[0 if ending else 1]
    force = 0.0
    if kind == POINTS and not ending and are_slides_short(contact, length):
        for j in range(int(contact.count[0])):
            f, s = short_bond_mean(
                points[PointRow.DENSITY, j],
                points[PointRow.STRETCH, j],
                points[PointRow.SLIDE, j],
                points[PointRow.LOAD, j],
                length,
            )
            points[PointRow.FORCE, j] = weight[j] * f
            points[PointRow.SLOPE, j] = weight[j] * max(s, 0.0)
            force += weight[j] * f
        return force
    return write_general_forces(kind, ending, contact, length)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def write_general_forces(kind, ending, contact, length):
    """Write the force and slope of every point for any law and any slide.

    Parameters
    ----------
    kind : int
        Kind of the law of the points, PLASTIC or POINTS.
    ending : bool
        Whether the pieces relax while the holder is at rest.
    contact : arrays.ShearedPoints
    length : float
        Bond length [m].

    Returns
    -------
    float
        Friction force [N].
    """
    points = contact.points
    weight = contact.weight
    force = 0.0
    for j in range(int(contact.count[0])):
        m = points[PointRow.DENSITY, j]
        z = points[PointRow.STRETCH, j]
        load = points[PointRow.LOAD, j]
        xi = points[PointRow.SLIDE, j]
        if kind == PLASTIC:
            f, s = (
                spring_end(m, z, load, xi, length)
                if ending
                else spring_mean(m, z, load, xi, length)
            )
        elif ending:
            f, s = bond_end_stretch(m, z, xi, load, length)
        else:
            f, s = bond_mean(m, z, xi, load, length)
        f *= weight[j]
        points[PointRow.FORCE, j] = f
        points[PointRow.SLOPE, j] = weight[j] * max(s, 0.0)
        force += f
    return force
