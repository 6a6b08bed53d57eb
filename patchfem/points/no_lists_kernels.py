"""Functions of `lists_kernels` for a march without lists of bonds, which calls none of them (compiled)."""

from ..compiled.flags_kernels import NJIT_CALL
from ..compiled.jit import njit
from .return_maps_kernels import PointState


@njit(**NJIT_CALL)
def press_list(lists, j, load):
    """Press nothing."""


@njit(**NJIT_CALL)
def write_list_mean(numbers, values, lists, j, dt):
    """Write nothing."""


@njit(**NJIT_CALL)
def advance_list(numbers, values, lists, j, v0, v1, dt):
    """Advance nothing; there is room."""
    return True


@njit(**NJIT_CALL)
def read_list(numbers, lists, j, load):
    """Return a state at rest."""
    return PointState(0.0, 0.0, 0.0)
