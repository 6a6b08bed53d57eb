"""Lists of bonds of many points, as views, and what a point reads from its list (compiled)."""

from typing import NamedTuple

from ...compiled.flags_kernels import NJIT_NO_REFCOUNT
from ...compiled.jit import njit
from .list_rows_kernels import LAW, STATUS, BondList


class PointReading(NamedTuple):
    """Friction force and stored energy per mu_s [N], [J], and elastic stretch [m] of a point."""

    force: float
    energy: float
    stretch: float


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def point_list(lists, point):
    """Return the arrays of the list of a point of a `BondLists` as views."""
    return BondList(
        lists.bondlist,
        lists.nows[point],
        lists.statuses[point],
        lists.law,
        lists.table,
        lists.growth,
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read(lists, point, load):
    """Return force, energy and stretch of a point.

    Parameters
    ----------
    lists : BondLists
        Lists of all points, summed in their present state.
    point : int
        Number of the point.
    load : float
        Present load [N].

    Returns
    -------
    PointReading
    """
    force = lists.statuses[point, STATUS.force]
    energy = lists.statuses[point, STATUS.energy] - lists.statuses[point, STATUS.owed]
    stretch = force * lists.law[LAW.length] / load if load > 0 else 0.0
    return PointReading(force, energy, stretch)
