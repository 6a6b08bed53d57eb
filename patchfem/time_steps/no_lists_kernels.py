"""Functions of `lists_kernels` for a march without lists of bonds, which calls none of them (compiled)."""

from ..kernel_cache.flags_kernels import NJIT_CALL
from ..kernel_cache.jit import njit


@njit(**NJIT_CALL)
def slide_lists(lists, numbers, values, count, step):
    """Leave the values of the points as they are.

    Parameters
    ----------
    lists : friction.bonds.strip_rows_kernels.BondLists
        Lists of bonds.
    numbers, values : array
        Numbers of the law, and values of the points.
    count : int
        Number of points.
    step : Step
        Duration of the step.
    """


@njit(**NJIT_CALL)
def advance_lists(lists, numbers, values, count, duration):
    """Leave the lists and the values of the points as they are.

    Parameters
    ----------
    lists : friction.bonds.strip_rows_kernels.BondLists
        Lists of bonds.
    numbers, values : array
        Numbers of the law, and values of the points.
    count : int
        Number of points.
    duration : float
        Duration of the step [s].
    """
