"""Functions of `lists_kernels` for a march without lists of bonds, which calls none of them (compiled)."""

from ..compiled.flags_kernels import NJIT_CALL
from ..compiled.jit import njit
from .return_maps_kernels import PointState


@njit(**NJIT_CALL)
def press_list(lists, j, load):
    """Leave the load of a point as it is, because a march without lists has no bonds that form under it.

    The point `j` and the other arguments are those of `lists_kernels.press_list`, and are not used.
    """


@njit(**NJIT_CALL)
def write_list_mean(numbers, values, lists, j, dt):
    """Leave the mean force of a point as it is, because no point of the march has a list.

    The point `j` and the other arguments are those of `lists_kernels.write_list_mean`, and are not used.
    """


@njit(**NJIT_CALL)
def advance_list(numbers, values, lists, j, v0, v1, dt):
    """Leave the list of a point as it is, because no point of the march has one.

    The point `j` and the other arguments are those of `lists_kernels.advance_list`, and are not used.
    """


@njit(**NJIT_CALL)
def read_list(numbers, lists, j, load):
    """Return a `PointState` of zeros: without a list there is no force, energy or stretch.

    The point `j` and the other arguments are those of `lists_kernels.read_list`, and are not used.
    """
    return PointState(0.0, 0.0, 0.0)
